//! Cells keep the picture of every scene, and in each cell the bits of the field.

use crate::corpus::{compiled, on_large_stack, scenes};
use sdfc_compiler::compile::{self, Compiled, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::passes::PassOptions;
use sdfc_lang::Sources;
use sdfc_runtime::cells::{Cells, Cut, Held, Refine, Region, Split, again, build};
use sdfc_runtime::engine::{Engine, EngineKind, Loaded, open};
use sdfc_runtime::frame::{CellUse, Frame, Mode, RenderSettings, Status};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_runtime::verify::compare;
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::lanes::{Column, LANES};
use sdfc_vm::program::Module;
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::tape::{Clause, Tape};
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn all() -> Vec<PathBuf> {
    let mut paths = scenes("tests/scenes");
    paths.extend(scenes("examples"));
    paths
}

fn opened(kind: EngineKind) -> Box<dyn Engine> {
    open(kind).expect("there is a processor, and an adapter")
}

/// The picture of a scene that is loaded anew.
fn picture(
    engine: &mut dyn Engine,
    module: &Module,
    outputs: &[f64],
    settings: &RenderSettings,
) -> Frame {
    let loaded = Loaded {
        module,
        outputs,
        generated: SceneSource::default(),
    };
    engine.load(&loaded).expect("the scene loads");
    engine.render(settings, &|_| {}).expect("it is drawn")
}

/// The scene drawn.
fn drawn(
    engine: &mut dyn Engine,
    compiled: &Compiled,
    outputs: &[f64],
    (cells, size): (CellUse, [u32; 2]),
) -> Frame {
    let overrides = Overrides {
        size: Some(size),
        aa: Some(1),
        cells,
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, outputs, &overrides).expect("the scene has settings");
    picture(engine, &compiled.module, outputs, &settings)
}

#[test]
fn pictures_are_the_same_with_and_without_cells() {
    let mut failures = Vec::new();
    let mut engine = opened(EngineKind::Cpu);
    for path in all() {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let mut drawn = |cells| drawn(&mut *engine, &compiled, &outputs, (cells, [128, 96]));
        let without = drawn(CellUse::Never);
        for cells in [CellUse::Auto, CellUse::Always] {
            let with = drawn(cells);
            let (differences, _) = compare(&without, &with);
            if differences.hit_mismatches_inside > 0 || differences.differing_inside > 0 {
                failures.push(format!("{}, {cells:?}\n{differences}", path.display()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The least cosine of the angle between a normal by the tape of its leaf and that by the whole program.
const SAME_NORMAL: f32 = 0.9998;

#[test]
fn normals_by_leaves_are_those_of_the_whole() {
    let mut engine = opened(EngineKind::Cpu);
    for scene in [
        "examples/chess.sdf",
        "examples/clock.sdf",
        "examples/gyroid.sdf",
        "tests/strangers/games/city_blocks_nested.sdf",
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(scene);
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let overrides = |cells| Overrides {
            size: Some([320, 240]),
            aa: Some(1),
            mode: Mode::Normal,
            cells,
            ..Overrides::default()
        };
        let [without, with] = [CellUse::Never, CellUse::Always].map(|cells| {
            let settings = resolve(&compiled.module, &outputs, &overrides(cells));
            let settings = settings.expect("the scene has settings");
            picture(&mut *engine, &compiled.module, &outputs, &settings)
        });
        let differs = |&at: &usize| {
            let [n, m] = [&without, &with].map(|frame| frame.normal[at]);
            let is_hit = [&without, &with]
                .iter()
                .all(|frame| frame.status[at] == Status::Hit);
            is_hit && (0..3).map(|i| n[i] * m[i]).sum::<f32>() < SAME_NORMAL
        };
        let differing: Vec<usize> = (0..without.normal.len()).filter(differs).collect();
        assert!(differing.is_empty(), "{scene}: {differing:?}");
    }
}

/// How much colours may differ: a driver may simplify the arithmetic of two kernels differently.
const COLOR: f32 = 1e-4;

#[test]
fn the_interpreter_draws_the_same_bits_with_and_without_cells() {
    let mut engine = opened(EngineKind::Interp);
    let mut failures = Vec::new();
    for path in all() {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let mut drawn = |cells| drawn(&mut *engine, &compiled, &outputs, (cells, [64, 48]));
        let [without, with] = [CellUse::Never, CellUse::Always].map(&mut drawn);
        let differing =
            |same: &dyn Fn(usize) -> bool| (0..without.depth.len()).filter(|&i| !same(i)).count();
        let near = |i: usize| {
            let channels = without.color[i].iter().zip(with.color[i]);
            channels.fold(true, |near, (a, b)| near && (a - b).abs() <= COLOR)
        };
        let found = [
            differing(&near),
            differing(&|i| without.depth[i].to_bits() == with.depth[i].to_bits()),
            differing(&|i| without.normal[i].map(f32::to_bits) == with.normal[i].map(f32::to_bits)),
            differing(&|i| without.id[i] == with.id[i]),
            differing(&|i| without.steps[i] == with.steps[i]),
        ];
        if found != [0; 5] {
            failures.push(format!(
                "{}: colours, depths, normals, materials and steps differ in {found:?} pixels",
                path.display()
            ));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_query_of_many_points_answers_as_one_of_few() {
    let mut engine = opened(EngineKind::Cpu);
    let region = Region {
        low: [-4.0; 3],
        high: [4.0; 3],
    };
    let mut points: Vec<[f32; 3]> = (0..32)
        .map(|seed| scattered(&region, seed))
        .flat_map(|[x, y, z]| (0..LANES).map(move |i| [x.0[i], y.0[i], z.0[i]]))
        .collect();
    points[77] = [f32::NAN, 0.0, 1.0];
    points[99] = [f32::INFINITY, 0.0, 1.0];
    for path in all() {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let loaded = Loaded {
            module: &compiled.module,
            outputs: &outputs,
            generated: SceneSource::default(),
        };
        engine.load(&loaded).expect("the scene loads");
        let together = engine.query(&points).expect("it answers");
        let alone = points.chunks(LANES).map(|few| engine.query(few));
        let alone: Vec<_> = alone.map(|few| few.expect("it answers")).collect();
        for (at, (a, b)) in together.iter().zip(alone.iter().flatten()).enumerate() {
            let same =
                |a: f32, b: f32| a == b || (a - b).abs() <= 1e-5 || (a.is_nan() && b.is_nan());
            let gradients = a.gradient.iter().zip(b.gradient);
            assert!(
                (a.distance == b.distance || (a.distance.is_nan() && b.distance.is_nan()))
                    && gradients.fold(true, |all, (a, b)| all && same(*a, b))
                    && a.surface.id == b.surface.id,
                "{} at {:?}: {a:?} of many, {b:?} alone",
                path.display(),
                points[at]
            );
        }
    }
}

/// Cuts everything down to a side.
struct Down(f32);

impl Refine for Down {
    fn cut(&self, region: &Region, _: usize, _: f32) -> bool {
        region.side() > self.0
    }
}

/// A cube from one coordinate to another along each axis, of which the cells that may hold a surface are kept.
fn cube([low, high]: [f32; 2], refine: &Down) -> Cut<'_> {
    Cut {
        region: Region {
            low: [low; 3],
            high: [high; 3],
        },
        split: Split::Cube,
        band: 0.0,
        refine,
    }
}

#[test]
fn the_tape_of_a_cell_gives_the_bits_of_the_whole_in_it() {
    let mut shorter = 0;
    for path in all() {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        compiled.module.update(0.0);
        let program = &compiled.module.distance;
        let tape = Tape::of(program);
        let cut = cube([-3.1, 3.2], &Down(0.5));
        let cells = build(program, &tape, &cut);
        let mut machine = Machine::<f32>::new(tape.values, tape.points);
        let mut run = |clauses: &[Clause], points: [Column; 3]| {
            *machine.seed() = points;
            *machine.run(program, clauses, LANES)
        };
        for (number, leaf) in cells.leaves().enumerate().step_by(7) {
            let points = scattered(&cells.cell(leaf).region, number as u64);
            let clauses = cells.tape(leaf);
            shorter += usize::from(clauses.len() < tape.clauses.len());
            let (whole, pruned) = (run(&tape.clauses, points), run(clauses, points));
            for lane in 0..LANES {
                let (a, b) = (whole.0[lane], pruned.0[lane]);
                assert!(
                    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()),
                    "{}: {a} by the whole, {b} by the cell's {} of {} clauses",
                    path.display(),
                    clauses.len(),
                    tape.clauses.len()
                );
            }
        }
    }
    assert!(shorter > 1000, "only {shorter} tapes were shorter");
}

#[test]
fn where_nothing_is_kept_the_field_has_the_sign_that_is_claimed() {
    // Boxes of raw fields are empty by the value in their middle and bounds of the gradient, too.
    let mut paths = all();
    paths.extend(scenes("tests/hard"));
    let mut fields: Vec<(String, Module)> = paths
        .iter()
        .map(|path| {
            let mut compiled = on_large_stack(|| compiled(path, PassOptions::default()));
            compiled.module.update(0.0);
            (path.display().to_string(), compiled.module)
        })
        .collect();
    let text = "field(fn(p) => dot(p * p, p * p) - 5 * dot(p, p) + 11.8, within: 3)\n";
    fields.push(("tanglecube".to_owned(), without_guards(text.to_owned())));
    let (mut empty, mut full) = (0, 0);
    let mut failures = Vec::new();
    for (name, module) in &fields {
        let program = &module.distance;
        let tape = Tape::of(program);
        let cut = cube([-3.1, 3.2], &Down(0.3));
        let cells = build(program, &tape, &cut);
        let points = (0..64).flat_map(|seed| {
            let [x, y, z] = scattered(&cut.region, seed + 1);
            (0..LANES).map(move |lane| [x.0[lane], y.0[lane], z.0[lane]])
        });
        for point in points {
            let Some(part) = cells.part_at(point) else {
                continue;
            };
            if part.clauses.is_some() {
                continue;
            }
            let value = evaluate_f64(program, point.map(f64::from));
            let inside = cells.held_at(point) == Held::Solid;
            *(if inside { &mut full } else { &mut empty }) += 1;
            // What jumps has, at a jump, either value.
            if (value < 0.0) != inside && value.abs() > 1e-6 {
                failures.push(format!("{name}: {value} at {point:?}"));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(empty > 50_000 && full > 1_000, "{empty} empty, {full} full");
}

#[test]
fn fields_get_cells_where_they_are_worth_it() {
    let size = [320, 180];
    let cells_of = |scene: &str, engine: &mut dyn Engine| {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(scene);
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let frame = drawn(engine, &compiled, &outputs, (CellUse::Auto, size));
        frame.stats.cells.made
    };
    // Measured: see `runtime/src/engine/worth.rs`.
    for (scene, worth) in [
        ("examples/primitives.sdf", true),
        ("examples/city.sdf", true),
        ("examples/landscape.sdf", true),
        ("examples/gyroid.sdf", false),
        ("examples/chess.sdf", false),
        ("tests/hard/flat_field.sdf", false),
    ] {
        let mut engine = opened(EngineKind::Cpu);
        let first = cells_of(scene, &mut *engine);
        assert_eq!(first > 0, worth, "{scene}: {first} cells");
        // The same again is decided the same.
        let again = cells_of(scene, &mut *engine);
        assert_eq!(again > 0, worth, "{scene}: {again} cells");
    }
}

#[test]
fn things_on_an_endless_ground_have_as_short_tapes_as_without_it() {
    let things = "union([for i in 0..6 { for j in 0..6 {
        sphere(0.2).translate(0.5 * i - 1.25, 0, 0.5 * j - 1.25)
    } }])";
    let camera = "camera { from: [4, 5, 6], look: [0, 0, 0], fov: 30deg }\n";
    let clauses_at_hits = |scene: String| {
        let module = without_guards(scene);
        let mut engine = opened(EngineKind::Cpu);
        let loaded = Loaded {
            module: &module,
            outputs: &[],
            generated: SceneSource::default(),
        };
        engine.load(&loaded).expect("the scene loads");
        let overrides = Overrides {
            size: Some([640, 480]),
            aa: Some(1),
            ..Overrides::default()
        };
        let settings = resolve(&module, &[], &overrides).expect("the scene has settings");
        let balls = (0..36).map(|n| [n / 6, n % 6].map(|n| 0.5 * n as f32 - 1.25));
        let tops: Vec<[f32; 3]> = balls.map(|[x, z]| [x, 0.2, z]).collect();
        let parts = engine.cells_at(&settings, &tops).expect("it is loaded");
        let parts = parts.expect("there are cells").into_iter();
        parts
            .map(|part| {
                part.and_then(|part| part.clauses)
                    .expect("a surface is there")
            })
            .max()
    };
    let alone = clauses_at_hits(format!("{camera}{things}"));
    let grounded = clauses_at_hits(format!("{camera}{things} | plane(Y, at: -0.2)"));
    assert!(
        alone < Some(9) && grounded < Some(9),
        "{alone:?} {grounded:?}"
    );
}

/// Points all over a box, its corners among them.
fn scattered(region: &Region, seed: u64) -> [Column; 3] {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    std::array::from_fn(|axis| {
        Column(std::array::from_fn(|lane| {
            let (low, high) = (region.low[axis], region.high[axis]);
            if lane < 8 {
                return if lane >> axis & 1 == 0 { low } else { high };
            }
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            let share = (state >> 40) as f32 / (1 << 24) as f32;
            (low + (high - low) * share).clamp(low, high)
        }))
    })
}

/// A thousand balls in a smooth union, one of which is lifted by this height. Without guards, whose
/// boxes and places among the instructions follow the balls.
fn balls(height: f64) -> Module {
    use std::fmt::Write;
    let mut text = String::from("union([\n");
    for n in 0..1000 {
        let at = |n: i32| f64::from(n) * 0.3 - 4.7;
        let (x, y, z) = (at(n % 32), if n == 444 { height } else { 0.0 }, at(n / 32));
        let _ = writeln!(text, "sphere(0.12).translate({x}, {y}, {z}),");
    }
    text.push_str("], smooth: 0.01)\n");
    without_guards(text)
}

/// Two thousand rounded boxes in a smooth union, scattered in a cube of side 10 and turned.
fn boxes() -> Module {
    use std::fmt::Write;
    let mut text = String::from("union([\n");
    let mut state = 1_u64;
    let mut share = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    for _ in 0..2000 {
        let [x, y, z] = [0; 3].map(|_| share() * 9.0 - 4.5);
        let [size, angle] = [share() * 0.3 + 0.2, share() * 180.0];
        let _ = writeln!(
            text,
            "box([{size}, {size}, {size}], round: 0.02).rotate({angle}deg, [1, 2, 0]).translate({x}, {y}, {z}),"
        );
    }
    text.push_str("], smooth: 0.1)\n");
    without_guards(text)
}

/// What a text means, compiled without guards.
fn without_guards(text: String) -> Module {
    let mut sources = Sources::new();
    let file = sources.add("scene".to_owned(), text);
    let (scene, found) = elaborate(&mut sources, file, &elaborate::Options::default());
    let scene = scene.unwrap_or_else(|| panic!("{found:?}"));
    let passes = PassOptions {
        none: false,
        without: vec!["bounding".to_owned()],
    };
    let (compiled, found) = compile(
        scene,
        &compile::Options {
            passes,
            ..compile::Options::default()
        },
    );
    let mut module = compiled.unwrap_or_else(|| panic!("{found:?}")).module;
    module.update(0.0);
    module
}

/// At the resolution of 256³ engines make leaves of 16 voxels; these have 4.
#[test]
fn cells_of_two_thousand_blended_primitives_take_less_than_64_mib() {
    let program = on_large_stack(boxes).distance;
    let tape = Tape::of(&program);
    assert!(tape.clauses.len() >= 2000);
    let cut = cube([-5.2, 5.2], &Down(10.4 / 64.0 * 1.5));
    let cells = build(&program, &tape, &cut);
    assert_eq!(cells.short(), 0);
    assert!(
        cells.leaves().count() > 20_000,
        "{}",
        cells.leaves().count()
    );
    assert!(cells.size() < 64 << 20, "{} bytes", cells.size());
    // With smaller ones there is an end, and it is not far beyond what is allowed.
    let finest = Cut {
        refine: &Down(10.4 / 256.0 * 1.5),
        ..cut
    };
    let cells = build(&program, &tape, &finest);
    assert!(cells.short() > 0);
    assert!(cells.size() < 128 << 20, "{} bytes", cells.size());
}

#[test]
fn moving_one_primitive_makes_only_the_cells_that_it_touches() {
    let [old, new] = [0.0, 0.05].map(|height| on_large_stack(|| balls(height)).distance);
    let [old_tape, new_tape] = [&old, &new].map(Tape::of);
    let cut = cube([-5.2, 5.2], &Down(0.2));
    let before = Arc::new(build(&old, &old_tape, &cut));
    assert_eq!(before.short(), 0);
    let after = again(&before, (&old, &old_tape), (&new, &new_tape), &cut)
        .expect("the edit changes only constants");
    let anew = build(&new, &new_tape, &cut);
    assert!(
        after.made() * 5 < anew.made(),
        "{} of {} cells were made",
        after.made(),
        anew.made()
    );
    assert!(after.made() > 0);
    // What is there now is what would have been made anew.
    let tapes = |cells: &Cells| {
        let mut all: Vec<_> = cells
            .leaves()
            .map(|leaf| {
                (
                    format!("{:?}", cells.cell(leaf).region),
                    cells.tape(leaf).to_vec(),
                )
            })
            .collect();
        all.sort_by(|a, b| a.0.cmp(&b.0));
        all
    };
    assert!(tapes(&after) == tapes(&anew));
    // The same again is all kept, and an edit that changes more than constants keeps nothing.
    let same = again(&after, (&new, &new_tape), (&new, &new_tape), &cut);
    assert!(same.is_some_and(|cells| Arc::ptr_eq(&cells, &after)));
    let mut longer = new.clone();
    longer.code.push(longer.code[0]);
    assert!(again(&after, (&new, &new_tape), (&longer, &new_tape), &cut).is_none());
}

#[test]
fn a_picture_after_an_edit_is_as_one_drawn_anew() {
    let mut engine = opened(EngineKind::Cpu);
    let overrides = Overrides {
        size: Some([96, 72]),
        aa: Some(1),
        cells: CellUse::Always,
        ..Overrides::default()
    };
    for height in [0.0, 0.05, 0.3, 0.3] {
        let module = on_large_stack(|| balls(height));
        let settings = resolve(&module, &[], &overrides).expect("the scene has settings");
        let edited = picture(&mut *engine, &module, &[], &settings);
        let anew = picture(&mut *opened(EngineKind::Cpu), &module, &[], &settings);
        assert_eq!(edited.color, anew.color);
        assert_eq!(edited.depth, anew.depth);
    }
}

#[test]
fn cells_are_those_of_the_picture_and_not_of_the_one_before() {
    let draw = |engine: &mut dyn Engine, loaded: &Loaded<'_>, mode: Mode| {
        let overrides = Overrides {
            size: Some([256, 192]),
            aa: Some(1),
            cells: CellUse::Always,
            mode,
            ..Overrides::default()
        };
        let settings = resolve(loaded.module, loaded.outputs, &overrides).expect("settings");
        engine
            .render(&settings, &|_| {})
            .expect("it is drawn")
            .color
    };
    for scene in ["examples/figures.sdf", "examples/hello.sdf"] {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(scene);
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let loaded = Loaded {
            module: &compiled.module,
            outputs: &outputs,
            generated: SceneSource::default(),
        };
        let started = || {
            let mut engine = opened(EngineKind::Interp);
            engine.load(&loaded).expect("the scene loads");
            engine
        };
        let mut engine = started();
        for mode in [Mode::Mask, Mode::Distance, Mode::Normal, Mode::Shaded] {
            let after = draw(&mut *engine, &loaded, mode);
            let alone = draw(&mut *started(), &loaded, mode);
            assert!(after == alone, "{scene}, {mode:?}");
        }
    }
}

#[test]
fn the_interpreter_keeps_the_cells_that_an_edit_does_not_touch() {
    let overrides = Overrides {
        size: Some([96, 72]),
        aa: Some(1),
        mode: Mode::Depth,
        cells: CellUse::Processor,
        ..Overrides::default()
    };
    let mut engine = opened(EngineKind::Interp);
    let mut before = None;
    let mut view = None;
    for height in [0.0, 0.05, 0.05, 0.0] {
        let module = on_large_stack(|| balls(height));
        let mut settings = resolve(&module, &[], &overrides).expect("the scene has settings");
        // Whoever edits does not let go of the camera.
        settings.view = *view.get_or_insert(settings.view);
        let edited = picture(&mut *engine, &module, &[], &settings);
        let anew = picture(&mut *opened(EngineKind::Interp), &module, &[], &settings);
        assert_eq!(edited.depth, anew.depth);
        assert_eq!(edited.steps, anew.steps);
        let [kept, all] = [&edited, &anew].map(|frame| frame.stats.cells);
        // What edits left behind is not counted; the box is that of the first picture, and tapes are shared
        // with those made together.
        let near = |a: u64, b: u64| a.abs_diff(b) * 50 <= b;
        assert!(near(kept.made, all.made), "{kept:?} and {all:?}");
        assert!(near(kept.clauses, all.clauses), "{kept:?} and {all:?}");
        assert_eq!(all.fresh, all.made);
        match before {
            None => assert_eq!(kept.fresh, all.fresh),
            Some((same, pipelines)) => {
                // Of cells all over space, many know of a ball that is not the nearest.
                assert!(
                    kept.fresh * 2 < all.made,
                    "{} of {} cells were made",
                    kept.fresh,
                    all.made
                );
                assert_eq!(kept.fresh == 0, same == height);
                assert_eq!(engine.pipelines_created(), pipelines);
            }
        }
        before = Some((height, engine.pipelines_created()));
    }
}
