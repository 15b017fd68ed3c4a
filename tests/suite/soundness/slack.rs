//! The smallest scenes that need what guards and paints allow for rounding.

use crate::corpus::compiled_text;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, Loaded, open};
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

/// Where two shapes are equally near, each of a thousand roundings counts: far out those of the distance, on faces
/// those of coordinates.
#[test]
fn guards_skip_nothing_where_two_shapes_are_equally_near() {
    let module = compiled_text(PILES, PassOptions::default()).module;
    let program = &module.distance;
    let guards = program.code.iter().filter(|i| i.code == Code::Guard);
    assert!(guards.count() > 2);
    let tape = Tape::of(program);
    let mut machine = Machine::<f32>::new(tape.values, tape.points);
    let mut random = Random::new(3);
    let mut number = |size: f32| (random.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0) * size;
    let mut failures = Vec::new();
    for round in 0..3000 {
        let far = [2.0, 2.0, 30.0, 1e3, 1e5][round % 5];
        let mut points = Points::default();
        for lane in 0..LANES {
            points[0].0[lane] = number(far * 1e-6);
            points[1].0[lane] = number(far) + 1.0;
            points[2].0[lane] = number(far) + 1.75;
        }
        failures.extend(differing(program, &tape, &mut machine, &points));
    }
    assert!(
        failures.is_empty(),
        "{} times: {}",
        failures.len(),
        failures[0]
    );
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
