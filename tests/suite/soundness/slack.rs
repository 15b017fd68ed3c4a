//! The smallest scenes that need what guards and paints allow for rounding.

use crate::corpus::compiled_text;
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind, Loaded, open};
use sdfc_runtime::frame::{CellUse, Lens, Mode, View};
use sdfc_runtime::reference::Camera;
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::random::Random;
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::lanes::{LANES, Points};
use sdfc_vm::program::{Code, Program};
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::vector::V3;

/// Two piles of turned boxes, each the other's mirror image, which touch in the plane x = 0.
const PILES: &str = "fn brick(i: int) -> shape3 = box(0.4, 0.4, 0.4).rotate(45deg, Y).rotate(i * 30deg, X)\
    .translate(0.28284271247461906, (i % 5) * 0.5, floor(i / 5) * 0.5);\n\
    fn pile() -> shape3 = union(for i in 0..40 { brick(i) });\n\
    pile() | pile().rotate(180deg, Y).translate(0, 0, 3.5)\n";

/// The values with guards and without at 64 points.
fn differing(
    program: &Program,
    tape: &Tape,
    machine: &mut Machine<f32>,
    points: &Points,
) -> Option<String> {
    *machine.seed() = *points;
    let all = *machine.run(program, &tape.clauses, LANES);
    (0..LANES).find_map(|lane| {
        let [x, y, z] = [0, 1, 2].map(|axis| points[axis].0[lane]);
        let guarded = evaluate::<f32>(program, V3 { x, y, z });
        let all = all.0[lane];
        (guarded != all)
            .then(|| format!("{all} without guards, {guarded} with them at {x}, {y}, {z}"))
    })
}

/// Ties of two shapes, of which each of a thousand roundings counts: far out those of the distance, on faces those
/// of coordinates.
#[test]
fn guards_skip_nothing_where_two_shapes_are_equally_near() {
    let mut round = 0;
    let found = changed_by_guards(PILES, |random| {
        let far = [2.0, 2.0, 30.0, 1e3, 1e5][round / LANES % 5];
        round += 1;
        let mut number = |size: f32| (random.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0) * size;
        [number(far * 1e-6), number(far) + 1.0, number(far) + 1.75]
    });
    assert!(found.is_empty(), "{} times: {}", found.len(), found[0]);
}

/// Boxes that touch at their edges, the first one at a place.
fn touching([x, y, z]: [f32; 3]) -> String {
    format!(
        "fn beside(i: int, j: int, k: int) -> shape3 = \
        box(1).translate({x} + 2 * i + (j + k) % 2, {y} + j, {z} + k);\n\
        union(for i in 0..3 {{ for j in 0..5 {{ for k in 0..5 {{ beside(i, j, k) }} }} }})\n"
    )
}

/// Values that guards change, at random points that `place` gives.
fn changed_by_guards(text: &str, mut place: impl FnMut(&mut Random) -> [f32; 3]) -> Vec<String> {
    let module = compiled_text(text, PassOptions::default()).module;
    let program = &module.distance;
    let guards = program.code.iter().filter(|i| i.code == Code::Guard);
    assert!(guards.count() > 2);
    let tape = Tape::of(program);
    let mut machine = Machine::<f32>::new(tape.values, tape.points);
    let mut random = Random::new(4);
    let mut found = Vec::new();
    for _ in 0..3000 {
        let mut points = Points::default();
        for lane in 0..LANES {
            let p = place(&mut random);
            for axis in 0..3 {
                points[axis].0[lane] = p[axis];
            }
        }
        found.extend(differing(program, &tape, &mut machine, &points));
    }
    found
}

/// Boxes are as large as what guards put around them. Beside the edges at which they touch the roundings of
/// coordinates decide which of two is nearer.
#[test]
fn guards_skip_no_box_beside_an_edge() {
    let first = [0.1, 0.3, 0.7];
    let found = changed_by_guards(&touching(first), |random| {
        // Corners of boxes, and as far from them along two axes.
        let steps = random.below(6) as f32 / 4_194_304.0;
        let mut p = first.map(|v| v + random.below(6) as f32 - 0.5);
        for v in &mut p {
            *v += [-steps, steps, 0.25][random.below(3)];
        }
        p
    });
    assert!(found.is_empty(), "{} times: {}", found.len(), found[0]);
}

/// Roundings of distances decide far away.
#[test]
fn guards_skip_no_box_far_away() {
    let mut round = 0;
    let found = changed_by_guards(&touching([0.1, 0.3, 0.7]), |random| {
        round += 1;
        let far = [1e4, 1e6, 1e7][round % 3];
        [0; 3].map(|_| (random.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0) * far)
    });
    assert!(found.is_empty(), "{} times: {}", found.len(), found[0]);
}

/// Of two faces in one plane the first shows, on every engine.
#[test]
fn of_coincident_faces_the_first_shows_on_every_engine() {
    let engines: &[EngineKind] = match std::env::var_os("SDFC_SKIP_GPU") {
        Some(_) => &[EngineKind::Cpu],
        None => &EngineKind::FAST,
    };
    for kind in engines {
        let mut engine = open(*kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
        for blend in ["|", "&"] {
            let text = format!("box(2, 1, 1).color(#ff0000) {blend} box(1, 1, 2).color(#0000ff)\n");
            let mut compiled = compiled_text(&text, PassOptions::default());
            let outputs = compiled.module.update(0.0);
            let source = compiled.generated();
            let loaded = Loaded {
                module: &compiled.module,
                outputs: &outputs,
                generated: SceneSource {
                    text: &source.text,
                    calls: &source.calls,
                },
            };
            engine.load(&loaded).expect("it loads");
            let found = engine.query(&[[0.1, 0.5, 0.2], [-0.2, 0.5, 0.1], [0.2, -0.5, -0.3]]);
            for answer in found.expect("it answers") {
                let [red, _, blue] = answer.surface.albedo;
                assert!(red > blue, "{kind}, {blend}: {answer:?}");
            }
        }
    }
}

/// Gives a text without generated code to an engine.
fn load(engine: &mut dyn Engine, text: &str) -> (Compiled, Vec<f64>) {
    let mut compiled = compiled_text(text, PassOptions::default());
    let outputs = compiled.module.update(0.0);
    let loaded = Loaded {
        module: &compiled.module,
        outputs: &outputs,
        generated: SceneSource::default(),
    };
    engine.load(&loaded).expect("it loads");
    (compiled, outputs)
}

/// A hole is filled with another colour, flush with the face. Nothing shows of the skin that it leaves.
#[test]
fn what_fills_a_hole_shows() {
    // The second cutter is one that is not made longer.
    for cutter in [
        "cylinder(r: 1, h: h)",
        "field(fn(p) => max(length(p.xz) - 1, abs(p.y) - 0.5))",
    ] {
        let text = format!(
            "param h = 1 in 0.5..=2;\n\
            (box([4, h, 4]) - {cutter}).color(#ff0000) | cylinder(r: 1, h: h).color(#0000ff)\n"
        );
        what_fills_shows(&text);
    }
}

/// Demands that nothing but blue is seen within a radius of 1 of the y axis, at the height 0.5.
fn what_fills_shows(text: &str) {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let (compiled, outputs) = load(&mut *engine, text);
    for (from, cells) in [
        ([0.3, 6.0, 0.4], CellUse::Never),
        ([3.0, 4.0, 2.0], CellUse::Never),
        ([3.0, 4.0, 2.0], CellUse::Always),
        ([-1.0, 1.0, 5.0], CellUse::Never),
    ] {
        let overrides = Overrides {
            size: Some([80, 60]),
            aa: Some(1),
            mode: Mode::Albedo,
            cells,
            view: Some(View {
                from,
                look: [0.0, 0.5, 0.0],
                up: [0.0, 0.0, -1.0],
                lens: Lens::Perspective(0.5),
            }),
            ..Overrides::default()
        };
        let settings = resolve(&compiled.module, &outputs, &overrides).expect("it has settings");
        let frame = engine.render(&settings, &|_| {}).expect("it is drawn");
        let camera = Camera::of(&settings);
        let mut seen = 0;
        for at in 0..frame.status.len() {
            let pixel = [at % frame.width, at / frame.width].map(|v| v as f64);
            let ray = camera.ray(pixel, [0.0; 2]);
            let way = (0.5 - ray.origin[1]) / ray.direction[1];
            let [x, _, z] = [0, 1, 2].map(|i| ray.origin[i] + way * ray.direction[i]);
            if x.hypot(z) > 0.97 {
                continue;
            }
            seen += 1;
            let [red, _, blue, _] = frame.color[at];
            let up = frame.normal[at][1];
            assert!(
                blue > 0.9 && red < 0.1 && up > 0.9999,
                "at {x}, {z} from {from:?}: red {red}, blue {blue}, a normal of {:?}",
                frame.normal[at]
            );
        }
        assert!(seen > 100, "{seen} pixels of the filling");
    }
}

/// Above a hole a cutter goes on: nothing is as near as the height above the body says.
#[test]
fn cutters_do_not_end_with_what_they_cut() {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    for cutter in [
        "field(fn(p) => dot(p.xz, p.xz) - 0.09)",
        "box(0.6, 3, 0.6).twist(20deg)",
    ] {
        let text = format!("box(2, 1, 2) - {cutter}\n");
        load(&mut *engine, &text);
        let above = engine.query(&[[0.0, 0.505, 0.0], [0.0, 0.51, 0.1]]);
        for answer in above.expect("it answers") {
            assert!(answer.distance > 0.025, "{cutter}: {answer:?}");
        }
    }
}

/// Bricks that touch hide a face between them. Rays end beside the surface by rounding, perhaps nearer to that face.
/// The face that is seen decides the normal.
#[test]
fn no_seams_show_between_bricks() {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let text = "union(for i in 0..12 { for k in 0..12 { box(5, 4, 5).translate(5 * i, 0, 5 * k) } })\
        .translate(250000, 100000, 3000)\n";
    let (compiled, outputs) = load(&mut *engine, text);
    for cells in [CellUse::Never, CellUse::Always] {
        let overrides = Overrides {
            size: Some([240, 180]),
            aa: Some(1),
            cells,
            view: Some(View {
                from: [250_043.0, 100_090.0, 3_071.0],
                look: [250_028.0, 100_000.0, 3_028.0],
                up: [0.0, 1.0, 0.0],
                lens: Lens::Perspective(0.3),
            }),
            ..Overrides::default()
        };
        let settings = resolve(&compiled.module, &outputs, &overrides).expect("it has settings");
        let frame = engine.render(&settings, &|_| {}).expect("it is drawn");
        let camera = Camera::of(&settings);
        let (mut seen, mut wrong) = (0, Vec::new());
        for at in 0..frame.status.len() {
            let pixel = [at % frame.width, at / frame.width].map(|v| v as f64);
            let ray = camera.ray(pixel, [0.0; 2]);
            let way = (100_002.0 - ray.origin[1]) / ray.direction[1];
            let place = [0, 2].map(|i| ray.origin[i] + way * ray.direction[i]);
            let aside = [place[0] - 250_000.0, place[1] - 3_000.0];
            // Away from the rims of the wall, and where the ray did not go on into a seam.
            let is_on_top = (f64::from(frame.depth[at]) - way).abs() < 0.1;
            if is_on_top && aside.iter().all(|v| (-2.0..57.0).contains(v)) {
                seen += 1;
                if frame.normal[at][1] < 0.99 {
                    wrong.push((aside, frame.normal[at]));
                }
            }
        }
        assert!(seen > 20_000, "{seen} pixels");
        assert!(
            wrong.is_empty(),
            "{cells:?}: {} of {seen}: {:?}",
            wrong.len(),
            wrong[0]
        );
    }
}
