//! Cells preserve the picture of every scene, and the bits of the field inside each cell.

use crate::corpus::{compiled, on_large_stack, scenes, scenes_on_gpu};
use glam::Vec3;
use sdfc_compiler::compile::{self, Compiled, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::passes::PassOptions;
use sdfc_lang::Sources;
use sdfc_runtime::cells::{
    Aabb, CellSpec, CellSplit, Cells, Occupancy, SplitRule, build, rebuild_after_edit,
};
use sdfc_runtime::comparison::compare;
use sdfc_runtime::engine::{Engine, EngineKind, SceneInput, open};
use sdfc_runtime::render::{CellMode, Image, Mode, RenderSettings, Status};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::random::Random;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::lanes::{F32x64, LANES};
use sdfc_vm::program::Module;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::{Clause, Tape};
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn scene_paths() -> Vec<PathBuf> {
    let mut paths = scenes("tests/scenes");
    paths.extend(scenes("examples"));
    paths
}

fn open_engine(kind: EngineKind) -> Box<dyn Engine> {
    open(kind).expect("there is a processor, and an adapter")
}

/// Draws a scene after loading it.
fn picture(
    engine: &mut dyn Engine,
    module: &Module,
    uniform_values: &[f64],
    settings: &RenderSettings,
) -> Image {
    let loaded = SceneInput {
        module,
        uniform_values,
        generated: SceneSource::default(),
    };
    engine.load(&loaded).expect("the scene loads");
    engine.render(settings, &|_| {}).expect("it is drawn")
}

/// Draws a compiled scene with a cell mode and size.
fn drawn(
    engine: &mut dyn Engine,
    compiled: &Compiled,
    uniform_values: &[f64],
    (cells, size): (CellMode, [u32; 2]),
) -> Image {
    let overrides = Overrides {
        size: Some(size),
        aa: Some(1),
        cells,
        ..Overrides::default()
    };
    let settings =
        resolve(&compiled.module, uniform_values, &overrides).expect("the scene has settings");
    picture(engine, &compiled.module, uniform_values, &settings)
}

/// Maximum number of pixels of a picture in which rounding of the depth decides whether light meets an edge.
const MAX_LIT_PIXELS: usize = 1;

#[test]
fn pictures_are_the_same_with_and_without_cells() {
    let mut failures = Vec::new();
    let mut engine = open_engine(EngineKind::Cpu);
    for path in scene_paths() {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let mut drawn = |cells| drawn(&mut *engine, &compiled, &uniform_values, (cells, [128, 96]));
        let without = drawn(CellMode::Never);
        for cells in [CellMode::Auto, CellMode::Always] {
            let with = drawn(cells);
            let (differences, _) = compare(&without, &with);
            let has_lit_pixels = differences.differing_inside > MAX_LIT_PIXELS;
            if differences.hit_mismatches_inside > 0 || has_lit_pixels {
                failures.push(format!("{}, {cells:?}\n{differences}", path.display()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Minimum cosine of the angle between a normal from the tape of its leaf and that from the whole
/// program.
const MIN_NORMAL_COSINE: f32 = 0.9998;
/// Maximum cosine of the angle between the normals on both sides of a crease. A hit within rounding of one may
/// show either.
const MAX_CREASE_COSINE: f32 = 0.9;
/// Maximum fraction of pixels that are hit within rounding of a crease.
const MAX_CREASE_FRACTION: f64 = 1e-4;

#[test]
fn normals_by_leaves_are_those_of_the_full_program() {
    let mut engine = open_engine(EngineKind::Cpu);
    for scene in [
        "examples/chess.sdf",
        "examples/clock.sdf",
        "examples/gyroid.sdf",
        "tests/strangers/games/city_blocks_nested.sdf",
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(scene);
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let overrides = |cells| Overrides {
            size: Some([320, 240]),
            aa: Some(1),
            mode: Mode::Normal,
            cells,
            ..Overrides::default()
        };
        let [without, with] = [CellMode::Never, CellMode::Always].map(|cells| {
            let settings = resolve(&compiled.module, &uniform_values, &overrides(cells));
            let settings = settings.expect("the scene has settings");
            picture(&mut *engine, &compiled.module, &uniform_values, &settings)
        });
        let differs = |&index: &usize| {
            let [n, m] = [&without, &with].map(|image| Vec3::from(image.normal[index]));
            let is_hit = [&without, &with]
                .iter()
                .all(|image| image.status[index] == Status::Hit);
            is_hit && n.dot(m) < MIN_NORMAL_COSINE
        };
        let is_at_crease = |&index: &usize| {
            let normals = [index - 1, index + 1, index - 320, index + 320]
                .map(|neighbour| Vec3::from(without.normal[neighbour]));
            let normal = Vec3::from(without.normal[index]);
            normals.iter().any(|n| n.dot(normal) < MAX_CREASE_COSINE)
        };
        let differing = (0..without.normal.len()).filter(differs);
        let (at_creases, elsewhere): (Vec<usize>, Vec<usize>) = differing.partition(is_at_crease);
        let most = (MAX_CREASE_FRACTION * without.normal.len() as f64) as usize;
        assert!(elsewhere.is_empty(), "{scene}: {elsewhere:?}");
        assert!(at_creases.len() <= most, "{scene}: {at_creases:?}");
    }
}

/// Maximum difference of a colour channel. A driver may simplify the arithmetic of two kernels
/// differently.
const MAX_COLOR_DIFFERENCE: f32 = 1e-4;

#[test]
fn the_interpreter_draws_the_same_bits_with_and_without_cells() {
    let mut engine = open_engine(EngineKind::Interp);
    let mut failures = Vec::new();
    for path in scenes_on_gpu(1) {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let mut drawn = |cells| drawn(&mut *engine, &compiled, &uniform_values, (cells, [64, 48]));
        let [without, with] = [CellMode::Never, CellMode::Always].map(&mut drawn);
        let differing =
            |same: &dyn Fn(usize) -> bool| (0..without.depth.len()).filter(|&i| !same(i)).count();
        let near = |i: usize| {
            let channels = without.color[i].iter().zip(with.color[i]);
            channels.fold(true, |near, (a, b)| {
                near && (a - b).abs() <= MAX_COLOR_DIFFERENCE
            })
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
fn a_query_of_many_points_gives_the_values_of_one_of_few() {
    let mut engine = open_engine(EngineKind::Cpu);
    let region = Aabb {
        low: [-4.0; 3],
        high: [4.0; 3],
    };
    let mut points: Vec<[f32; 3]> = (0..32)
        .map(|seed| scattered(&region, seed))
        .flat_map(|[x, y, z]| (0..LANES).map(move |i| [x.0[i], y.0[i], z.0[i]]))
        .collect();
    points[77] = [f32::NAN, 0.0, 1.0];
    points[99] = [f32::INFINITY, 0.0, 1.0];
    for path in scene_paths() {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let loaded = SceneInput {
            module: &compiled.module,
            uniform_values: &uniform_values,
            generated: SceneSource::default(),
        };
        engine.load(&loaded).expect("the scene loads");
        let batched = engine.query(&points).expect("it answers");
        let separate = points.chunks(LANES).map(|chunk| engine.query(chunk));
        let separate: Vec<_> = separate.map(|chunk| chunk.expect("it answers")).collect();
        for (index, (a, b)) in batched.iter().zip(separate.iter().flatten()).enumerate() {
            let same =
                |a: f32, b: f32| a == b || (a - b).abs() <= 1e-5 || (a.is_nan() && b.is_nan());
            let gradients = a.gradient.iter().zip(b.gradient);
            assert!(
                (a.distance == b.distance || (a.distance.is_nan() && b.distance.is_nan()))
                    && gradients.fold(true, |all, (a, b)| all && same(*a, b))
                    && a.surface.id == b.surface.id,
                "{} at {:?}: {a:?} of many, {b:?} alone",
                path.display(),
                points[index]
            );
        }
    }
}

/// Splits all cells down to a side length.
struct DownToSide(f32);

impl SplitRule for DownToSide {
    fn should_split(&self, region: &Aabb, _: usize, _: f32) -> bool {
        region.longest_side() > self.0
    }
}

/// Returns the cells of the cube between two coordinates on each axis. Only cells that may contain a surface
/// are kept.
fn cube([low, high]: [f32; 2], rule: &DownToSide) -> CellSpec<'_> {
    CellSpec {
        max_slope: 1.0,
        max_split_clauses: u64::MAX,
        region: Aabb {
            low: [low; 3],
            high: [high; 3],
        },
        split: CellSplit::Volume,
        band: 0.0,
        margin: 0.0,
        rule,
    }
}

#[test]
fn the_tape_of_a_cell_gives_the_bits_of_the_full_tape_in_it() {
    let mut shorter = 0;
    for path in scene_paths() {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        compiled.module.update(0.0);
        let program = &compiled.module.distance;
        let tape = Tape::new(program);
        let spec = cube([-3.1, 3.2], &DownToSide(0.5));
        let cells = build(program, &tape, &spec);
        let mut machine = TapeEvaluator::<f32>::new(tape.values, tape.points);
        let mut run = |clauses: &[Clause], points: [F32x64; 3]| {
            *machine.inputs_mut() = points;
            *machine.run(program, clauses, LANES)
        };
        for (number, leaf) in cells.leaves().enumerate().step_by(7) {
            let points = scattered(&cells.cell(leaf).region, number as u64);
            let clauses = cells.tape(leaf);
            shorter += usize::from(clauses.len() < tape.clauses.len());
            let (full, pruned) = (run(&tape.clauses, points), run(clauses, points));
            for lane in 0..LANES {
                let (a, b) = (full.0[lane], pruned.0[lane]);
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
fn empty_cells_have_the_sign_that_they_claim() {
    // Boxes of raw fields can also be empty by the value at their centre and bounds of the gradient.
    let mut paths = scene_paths();
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
        let tape = Tape::new(program);
        let spec = cube([-3.1, 3.2], &DownToSide(0.3));
        let cells = build(program, &tape, &spec);
        let points = (0..64).flat_map(|seed| {
            let [x, y, z] = scattered(&spec.region, seed + 1);
            (0..LANES).map(move |lane| [x.0[lane], y.0[lane], z.0[lane]])
        });
        for point in points {
            let Some(part) = cells.info_at(point) else {
                continue;
            };
            if part.clauses.is_some() {
                continue;
            }
            let value = evaluate_f64(program, point.map(f64::from));
            let inside = cells.occupancy_at(point) == Occupancy::Full;
            *(if inside { &mut full } else { &mut empty }) += 1;
            // At a discontinuity either value may be returned.
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
        let uniform_values = compiled.module.update(0.0);
        let image = drawn(engine, &compiled, &uniform_values, (CellMode::Auto, size));
        image.stats.cells.count
    };
    // Measured: see `runtime/src/cells/trial.rs`.
    for (scene, expects_cells) in [
        ("examples/primitives.sdf", true),
        ("examples/city.sdf", true),
        ("examples/landscape.sdf", true),
        ("examples/gyroid.sdf", false),
        ("examples/chess.sdf", false),
        ("tests/hard/flat_field.sdf", false),
    ] {
        let mut engine = open_engine(EngineKind::Cpu);
        let first = cells_of(scene, &mut *engine);
        assert_eq!(first > 0, expects_cells, "{scene}: {first} cells");
        // Drawing again makes the same decision.
        let repeated = cells_of(scene, &mut *engine);
        assert_eq!(repeated > 0, expects_cells, "{scene}: {repeated} cells");
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
        let mut engine = open_engine(EngineKind::Cpu);
        let loaded = SceneInput {
            module: &module,
            uniform_values: &[],
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
    let separate = clauses_at_hits(format!("{camera}{things}"));
    let grounded = clauses_at_hits(format!("{camera}{things} | plane(Y, at: -0.2)"));
    assert!(
        separate < Some(9) && grounded < Some(9),
        "{separate:?} {grounded:?}"
    );
}

/// Returns points spread over a box, including its corners.
fn scattered(region: &Aabb, seed: u64) -> [F32x64; 3] {
    let mut random = Random::new(seed);
    std::array::from_fn(|axis| {
        F32x64(std::array::from_fn(|lane| {
            let (low, high) = (region.low[axis], region.high[axis]);
            if lane < 8 {
                return if lane >> axis & 1 == 0 { low } else { high };
            }
            (low + (high - low) * random.unit_f32()).clamp(low, high)
        }))
    })
}

/// Returns a thousand spheres in a smooth union, one of them raised to this height. Guards are disabled,
/// because their boxes and positions in the program depend on the spheres.
fn balls(height: f64) -> Module {
    use std::fmt::Write;
    let mut text = String::from("union([\n");
    for n in 0..1000 {
        let coordinate = |n: i32| f64::from(n) * 0.3 - 4.7;
        let (x, y, z) = (
            coordinate(n % 32),
            if n == 444 { height } else { 0.0 },
            coordinate(n / 32),
        );
        let _ = writeln!(text, "sphere(0.12).translate({x}, {y}, {z}),");
    }
    text.push_str("], smooth: 0.01)\n");
    without_guards(text)
}

/// Returns two thousand rounded boxes in a smooth union, scattered in a cube of side 10 and rotated.
fn boxes() -> Module {
    use std::fmt::Write;
    let mut text = String::from("union([\n");
    let mut random = Random::for_case("scattered boxes");
    let mut fraction = || random.unit_f32();
    for _ in 0..2000 {
        let [x, y, z] = [0; 3].map(|_| fraction() * 9.0 - 4.5);
        let [size, angle] = [fraction() * 0.3 + 0.2, fraction() * 180.0];
        let _ = writeln!(
            text,
            "box([{size}, {size}, {size}], round: 0.02).rotate({angle}deg, [1, 2, 0]).translate({x}, {y}, {z}),"
        );
    }
    text.push_str("], smooth: 0.1)\n");
    without_guards(text)
}

/// Compiles a text without guards.
fn without_guards(text: String) -> Module {
    let mut sources = Sources::new();
    let file = sources.add("scene".to_owned(), text);
    let (scene, found) = elaborate(&mut sources, file, &elaborate::Options::default());
    let scene = scene.unwrap_or_else(|| panic!("{found:?}"));
    let passes = PassOptions {
        disable_all: false,
        disabled: vec!["guards".to_owned()],
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

/// At a resolution of 256³, engines use leaves of 16 voxels; these have 4.
#[test]
fn cells_of_two_thousand_blended_primitives_take_less_than_64_mib() {
    let program = on_large_stack(boxes).distance;
    let tape = Tape::new(&program);
    assert!(tape.clauses.len() >= 2000);
    let spec = cube([-5.2, 5.2], &DownToSide(10.4 / 64.0 * 1.5));
    let cells = build(&program, &tape, &spec);
    assert_eq!(cells.over_budget_count(), 0);
    assert!(
        cells.leaves().count() > 20_000,
        "{}",
        cells.leaves().count()
    );
    assert!(
        cells.size_bytes() < 64 << 20,
        "{} bytes",
        cells.size_bytes()
    );
    // Smaller cells exceed the memory budget, but not by much.
    let finest = CellSpec {
        rule: &DownToSide(10.4 / 256.0 * 1.5),
        ..spec
    };
    let cells = build(&program, &tape, &finest);
    assert!(cells.over_budget_count() > 0);
    assert!(
        cells.size_bytes() < 128 << 20,
        "{} bytes",
        cells.size_bytes()
    );
}

#[test]
fn moving_one_primitive_makes_only_the_cells_that_it_touches() {
    let [old, new] = [0.0, 0.05].map(|height| on_large_stack(|| balls(height)).distance);
    let [old_tape, new_tape] = [&old, &new].map(Tape::new);
    let spec = cube([-5.2, 5.2], &DownToSide(0.2));
    let before = Arc::new(build(&old, &old_tape, &spec));
    assert_eq!(before.over_budget_count(), 0);
    let after = rebuild_after_edit(&before, (&old, &old_tape), (&new, &new_tape), &spec)
        .expect("the edit changes only constants");
    let anew = build(&new, &new_tape, &spec);
    assert!(
        after.rebuilt_count() * 5 < anew.rebuilt_count(),
        "{} of {} cells were made",
        after.rebuilt_count(),
        anew.rebuilt_count()
    );
    assert!(after.rebuilt_count() > 0);
    // The cells equal those of a full rebuild.
    let tapes = |cells: &Cells| {
        let mut leaf_tapes: Vec<_> = cells
            .leaves()
            .map(|leaf| {
                (
                    format!("{:?}", cells.cell(leaf).region),
                    cells.tape(leaf).to_vec(),
                )
            })
            .collect();
        leaf_tapes.sort_by(|a, b| a.0.cmp(&b.0));
        leaf_tapes
    };
    assert!(tapes(&after) == tapes(&anew));
    // An unchanged program keeps all cells; an edit beyond constants keeps none.
    let unchanged = rebuild_after_edit(&after, (&new, &new_tape), (&new, &new_tape), &spec);
    assert!(unchanged.is_some_and(|cells| Arc::ptr_eq(&cells, &after)));
    let mut longer = new.clone();
    longer.code.push(longer.code[0]);
    assert!(rebuild_after_edit(&after, (&new, &new_tape), (&longer, &new_tape), &spec).is_none());
}

#[test]
fn a_picture_after_an_edit_equals_that_of_a_new_engine() {
    let mut engine = open_engine(EngineKind::Cpu);
    let overrides = Overrides {
        size: Some([96, 72]),
        aa: Some(1),
        cells: CellMode::Always,
        ..Overrides::default()
    };
    for height in [0.0, 0.05, 0.3, 0.3] {
        let module = on_large_stack(|| balls(height));
        let settings = resolve(&module, &[], &overrides).expect("the scene has settings");
        let edited = picture(&mut *engine, &module, &[], &settings);
        let anew = picture(&mut *open_engine(EngineKind::Cpu), &module, &[], &settings);
        assert_eq!(edited.color, anew.color);
        assert_eq!(edited.depth, anew.depth);
    }
}

#[test]
fn cells_are_those_of_the_picture_and_not_of_the_one_before() {
    let draw = |engine: &mut dyn Engine, loaded: &SceneInput<'_>, mode: Mode| {
        let overrides = Overrides {
            size: Some([256, 192]),
            aa: Some(1),
            cells: CellMode::Always,
            mode,
            ..Overrides::default()
        };
        let settings = resolve(loaded.module, loaded.uniform_values, &overrides).expect("settings");
        engine
            .render(&settings, &|_| {})
            .expect("it is drawn")
            .color
    };
    for scene in ["examples/figures.sdf", "examples/hello.sdf"] {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(scene);
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let loaded = SceneInput {
            module: &compiled.module,
            uniform_values: &uniform_values,
            generated: SceneSource::default(),
        };
        let started = || {
            let mut engine = open_engine(EngineKind::Interp);
            engine.load(&loaded).expect("the scene loads");
            engine
        };
        let mut engine = started();
        for mode in [Mode::Mask, Mode::Distance, Mode::Normal, Mode::Shaded] {
            let after = draw(&mut *engine, &loaded, mode);
            let separate = draw(&mut *started(), &loaded, mode);
            assert!(after == separate, "{scene}, {mode:?}");
        }
    }
}

#[test]
fn the_interpreter_keeps_the_cells_that_an_edit_does_not_touch() {
    let overrides = Overrides {
        size: Some([96, 72]),
        aa: Some(1),
        mode: Mode::Depth,
        cells: CellMode::Cpu,
        ..Overrides::default()
    };
    let mut engine = open_engine(EngineKind::Interp);
    let mut before = None;
    let mut view = None;
    for height in [0.0, 0.05, 0.05, 0.0] {
        let module = on_large_stack(|| balls(height));
        let mut settings = resolve(&module, &[], &overrides).expect("the scene has settings");
        // The camera stays fixed during edits.
        settings.view = *view.get_or_insert(settings.view);
        let edited = picture(&mut *engine, &module, &[], &settings);
        let anew = picture(
            &mut *open_engine(EngineKind::Interp),
            &module,
            &[],
            &settings,
        );
        assert_eq!(edited.depth, anew.depth);
        assert_eq!(edited.steps, anew.steps);
        let [incremental, rebuilt] = [&edited, &anew].map(|image| image.stats.cells);
        // Replaced cells are not counted. The box is that of the first picture, and tapes are shared with
        // those built together.
        let near = |a: u64, b: u64| a.abs_diff(b) * 50 <= b;
        assert!(
            near(incremental.count, rebuilt.count),
            "{incremental:?} and {rebuilt:?}"
        );
        assert!(
            near(incremental.clauses, rebuilt.clauses),
            "{incremental:?} and {rebuilt:?}"
        );
        assert_eq!(rebuilt.fresh, rebuilt.count);
        match before {
            None => assert_eq!(incremental.fresh, rebuilt.fresh),
            Some((previous_height, pipelines)) => {
                // Many cells in the whole region depend on a sphere that is not the nearest one.
                assert!(
                    incremental.fresh * 2 < rebuilt.count,
                    "{} of {} cells were made",
                    incremental.fresh,
                    rebuilt.count
                );
                assert_eq!(incremental.fresh == 0, previous_height == height);
                assert_eq!(engine.pipelines_created(), pipelines);
            }
        }
        before = Some((height, engine.pipelines_created()));
    }
}
