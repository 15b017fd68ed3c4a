//! Pictures of every engine against the ground truth. No ray is wrong away from silhouettes, and depths and
//! normals equal those proved by the engine `reference`.

use crate::corpus::{compiled, name, on_large_stack, scene_input, scenes};
use crate::metamorphic::draw::{self, DrawOptions};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::reference::{TraceOptions, compare, trace};
use sdfc_runtime::render::{CellMode, Mode, RenderSettings};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_trials::skip::is_gpu_skipped;
use std::path::Path;

/// Scenes with blends, repetition, a raw field and a landscape.
const SCENES: [&str; 6] = [
    "examples/hello.sdf",
    "examples/blends.sdf",
    "examples/bracket.sdf",
    "tests/scenes/domain_repeat.sdf",
    "tests/scenes/solids_round.sdf",
    "tests/scenes/field_math.sdf",
];

/// Maximum percentage of undecided rays.
const MAX_UNDECIDED_PERCENT: f64 = 1.0;

#[test]
fn pictures_of_all_engines_are_near_the_truth() {
    let is_gpu_skipped = is_gpu_skipped();
    let mut wrong = Vec::new();
    for name in SCENES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let source = compiled.generated();
        let overrides = Overrides {
            size: Some([48, 32]),
            aa: Some(1),
            ..Overrides::default()
        };
        let settings = resolve(&compiled.module, &uniform_values, &overrides);
        let settings = settings.unwrap_or_else(|error| panic!("{name}: {error}"));
        let truth = trace(&compiled.module, &settings, &TraceOptions::default());
        let share = 100.0 * truth.undecided() as f64 / truth.pixels.len() as f64;
        if share > MAX_UNDECIDED_PERCENT {
            wrong.push(format!("{name}: {share:.1} % of the rays are undecided"));
        }
        let loaded = scene_input(&compiled, &uniform_values, &source);
        for kind in EngineKind::FAST {
            if kind != EngineKind::Cpu && is_gpu_skipped {
                continue;
            }
            let mut engine = open(kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
            engine.load(&loaded).expect("it loads");
            for cells in [CellMode::Never, CellMode::Always] {
                let settings = RenderSettings {
                    cells,
                    ..settings.clone()
                };
                let image = engine.render(&settings, &|_| {}).expect("it draws");
                let errors = compare(&truth, &image);
                let depth = errors.depth_smooth.p99;
                if errors.mismatches_inside > 0 || errors.nans > 0 || depth > 1e-5 {
                    wrong.push(format!("{name} on {kind}, cells {cells:?}: {errors:#?}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Unproved hits are drawn with their most likely result. Nothing is proved about noise.
#[test]
fn unproved_hits_have_the_normals_of_the_field() {
    let text = "camera { from: [2, 3, 4], look: [0, 0, 0], fov: 35deg }\n\
        field(fn(p) => length(p) - 1 + 0.1 * noise(p * 5))\n";
    let options = DrawOptions {
        size: [48, 36],
        passes: PassOptions::default(),
        cells: CellMode::Auto,
        scale: 1.0,
    };
    let [truth, drawn] = [EngineKind::Reference, EngineKind::Cpu].map(|kind| {
        let mut engine = open(kind).expect("both run on the CPU");
        draw::image(&mut *engine, text, &options).expect("it compiles")
    });
    let alike = |a: &[f32; 3], b: &[f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.02);
    let pairs = truth.normal.iter().zip(&drawn.normal);
    let others = pairs.filter(|(a, b)| !alike(a, b)).count();
    assert!(truth.stats.undecided > 200, "{:?}", truth.stats);
    assert!(others < 10, "{others} normals are others");
}

/// With fewer steps than the default, rays of four examples did not terminate. The long form draws all scenes of the
/// tests, too.
#[test]
fn every_ray_of_a_scene_ends() {
    let mut left = Vec::new();
    let mut engine = open(EngineKind::Cpu).expect("the CPU draws");
    let paths = match std::env::var_os("SDFC_LONG") {
        Some(_) => crate::strangers::cases(),
        None => scenes("examples"),
    };
    for path in paths {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let source = compiled.generated();
        let settings = resolve(&compiled.module, &uniform_values, &Overrides::default());
        let mut settings = settings.unwrap_or_else(|error| panic!("{}: {error}", name(&path)));
        settings.mode = Mode::Depth;
        let loaded = scene_input(&compiled, &uniform_values, &source);
        engine.load(&loaded).expect("it loads");
        let image = engine.render(&settings, &|_| {}).expect("it draws");
        if image.stats.step_caps > 0 {
            left.push(format!("{}: {} rays", name(&path), image.stats.step_caps));
        }
    }
    assert!(left.is_empty(), "out of steps: {}", left.join(", "));
}
