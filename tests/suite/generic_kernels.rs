//! The interpreter with generic kernels, which run every scene. It draws the same pictures as the one
//! with specialised kernels and creates no pipelines per scene.

use crate::corpus::{compiled, compiled_text, on_large_stack, scenes_on_gpu};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind, SceneInput, open_generic, open_on};
use sdfc_runtime::gpu::{AdapterPreference, Arithmetic, Gpu};
use sdfc_runtime::render::{
    CellMode, Image, LightEmitter, Lighting, Mode, Normals, Occlusion, RenderSettings,
    ResolvedLight, ResolvedShadow,
};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::skip::is_gpu_skipped;
use sdfc_vm::program::Module;

/// Returns the engine with generic kernels, warmed up for these modes, and the one with specialised
/// kernels; `None` if GPU tests are skipped. Arithmetic is strict: otherwise drivers fuse other operations in
/// each kernel.
fn engines(modes: &[Mode]) -> Option<[Box<dyn Engine>; 2]> {
    if is_gpu_skipped() {
        return None;
    }
    let gpu =
        || Gpu::open_with(AdapterPreference::Any, Arithmetic::Strict).expect("there is an adapter");
    let mut generic = open_generic(gpu());
    generic.warm_up(modes).expect("it warms up");
    Some([generic, open_on(EngineKind::Interp, gpu())])
}

fn load(engine: &mut dyn Engine, module: &Module, uniform_values: &[f64]) {
    let loaded = SceneInput {
        module,
        uniform_values,
        generated: SceneSource::default(),
    };
    engine.load(&loaded).expect("the scene loads");
}

/// Counts the pixels in which depths, materials and steps differ in any bit. Normals and colours count
/// where they differ by more than drivers may cause.
fn differing(a: &Image, b: &Image) -> [usize; 5] {
    let count = |same: &dyn Fn(usize) -> bool| (0..a.depth.len()).filter(|&i| !same(i)).count();
    let is_close = |a: &[f32], b: &[f32], max_difference: f32| {
        let mut pairs = a.iter().zip(b);
        pairs.all(|(a, b)| (a - b).abs() <= max_difference)
    };
    [
        count(&|i| a.depth[i].to_bits() == b.depth[i].to_bits()),
        count(&|i| a.id[i] == b.id[i]),
        count(&|i| a.steps[i] == b.steps[i]),
        count(&|i| is_close(&a.normal[i], &b.normal[i], 1e-6)),
        count(&|i| is_close(&a.color[i], &b.color[i], 1e-4)),
    ]
}

const NO_DIFFERENCES: [usize; 5] = [0; 5];

fn settings(
    module: &Module,
    uniform_values: &[f64],
    mode: Mode,
    cells: CellMode,
) -> RenderSettings {
    let overrides = Overrides {
        size: Some([24, 16]),
        aa: Some(1),
        mode,
        cells,
        ..Overrides::default()
    };
    resolve(module, uniform_values, &overrides).expect("the scene has settings")
}

fn draw(engine: &mut dyn Engine, settings: &RenderSettings) -> Image {
    engine.render(settings, &|_| {}).expect("it is drawn")
}

#[test]
fn scenes_run_in_the_kernels_that_are_there() {
    let Some([mut generic, mut specialized]) = engines(&[Mode::Shaded]) else {
        return;
    };
    let pipelines = generic.pipelines_created();
    let mut failures = Vec::new();
    for path in scenes_on_gpu(1) {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let module = &compiled.module;
        load(&mut *generic, module, &uniform_values);
        load(&mut *specialized, module, &uniform_values);
        let [never, always] = [CellMode::Never, CellMode::Always]
            .map(|c| settings(module, &uniform_values, Mode::Shaded, c));
        let expected = draw(&mut *specialized, &never);
        for settings in [never, always] {
            let drawn = draw(&mut *generic, &settings);
            let pixels = differing(&drawn, &expected);
            if pixels != NO_DIFFERENCES || drawn.stats.evaluations != expected.stats.evaluations {
                failures.push(format!(
                    "{}, cells {:?}: depths, materials, steps, normals and colours differ in \
                     {pixels:?} pixels; {} and {} evaluations",
                    path.display(),
                    settings.cells,
                    drawn.stats.evaluations,
                    expected.stats.evaluations,
                ));
            }
        }
        generic
            .query(&[[0.3, 0.2, 0.4], [-1.0, 0.5, 0.1]])
            .expect("it answers");
        assert_eq!(generic.pipelines_created(), pipelines, "{}", path.display());
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// A scene with materials and one without.
const WITH_MATERIALS: &str = "material clay { color: #c04030, roughness: 0.4 }
sphere(1).material(clay) | box([3, 0.1, 3]).translate(0, -1, 0)
";
const WITHOUT_MATERIALS: &str = "sphere(1) | box([3, 0.1, 3]).translate(0, -1, 0)\n";

/// Returns variants of a picture that differ in one setting each.
fn picture_variants(first: &RenderSettings) -> Vec<(String, RenderSettings)> {
    let mut variants = Vec::new();
    for normals in [
        Normals::Exact,
        Normals::Forward,
        Normals::Central,
        Normals::Reverse,
        Normals::Tetrahedron,
        Normals::Wide,
    ] {
        let settings = RenderSettings {
            normals,
            ..first.clone()
        };
        variants.push((format!("{normals:?}"), settings));
    }
    for occlusion in [Occlusion::Off, Occlusion::FiveTap, Occlusion::Multi(6)] {
        let settings = RenderSettings {
            occlusion,
            ..first.clone()
        };
        variants.push((format!("{occlusion:?}"), settings));
    }
    let light = |shadow| ResolvedLight {
        source: LightEmitter::Directional([0.4, 1.0, 0.6]),
        color: [0.7, 0.6, 0.5],
        shadow,
    };
    let point_light = ResolvedLight {
        source: LightEmitter::Point([-2.0, 2.0, 2.0]),
        ..light(ResolvedShadow::Soft(0.1))
    };
    let shadows = [
        ResolvedShadow::None,
        ResolvedShadow::Hard,
        ResolvedShadow::Plain(0.1),
        ResolvedShadow::Soft(0.1),
        ResolvedShadow::Sized(0.1),
    ];
    let mut lights: Vec<Vec<ResolvedLight>> =
        shadows.iter().map(|&shadow| vec![light(shadow)]).collect();
    lights.push(Vec::new());
    lights.push([&lights[0][..], &lights[4], &[point_light]].concat());
    for lights in lights {
        for fog in [None, Some(0.1)] {
            let lighting = Lighting {
                lights: lights.clone(),
                fog,
                ..first.lighting.clone()
            };
            let title = format!("fog {fog:?}, lights {lights:?}");
            let settings = RenderSettings {
                lighting,
                ..first.clone()
            };
            variants.push((title, settings));
        }
    }
    variants
}

#[test]
fn every_mode_and_setting_runs_in_generic_kernels() {
    let modes = [Mode::Shaded, Mode::Normal, Mode::Distance];
    let Some([mut generic, mut specialized]) = engines(&modes) else {
        return;
    };
    let pipelines = generic.pipelines_created();
    for text in [WITH_MATERIALS, WITHOUT_MATERIALS] {
        let mut compiled = on_large_stack(|| compiled_text(text, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let module = &compiled.module;
        load(&mut *generic, module, &uniform_values);
        load(&mut *specialized, module, &uniform_values);
        let shaded = settings(module, &uniform_values, Mode::Shaded, CellMode::Auto);
        let mut pictures = picture_variants(&shaded);
        for mode in [Mode::Normal, Mode::Distance] {
            let settings = settings(module, &uniform_values, mode, CellMode::Auto);
            pictures.push((format!("{mode:?}"), settings));
        }
        for (title, settings) in pictures {
            let drawn = draw(&mut *generic, &settings);
            let expected = draw(&mut *specialized, &settings);
            assert_eq!(
                differing(&drawn, &expected),
                NO_DIFFERENCES,
                "{title} of {text}"
            );
            assert_eq!(generic.pipelines_created(), pipelines, "{title} of {text}");
        }
    }
}

/// Returns `depth` boxes, each with all smaller ones subtracted, which require as many registers.
fn nested(depth: usize) -> String {
    let mut text = String::from("sphere(0.1)");
    for n in 0..depth {
        let side = 0.2 + 0.02 * n as f64;
        text = format!(
            "box([{side}, {}, 1]).rotate({n}deg, [0, 1, 0]) - ({text})",
            side * 0.9
        );
    }
    text + "\n"
}

#[test]
fn a_scene_beyond_their_room_gets_kernels_of_its_own() {
    let Some([mut generic, mut specialized]) = engines(&[Mode::Shaded]) else {
        return;
    };
    let mut pipelines = generic.pipelines_created();
    for (depth, is_within_limits) in [(8, true), (40, false), (8, true)] {
        let text = nested(depth);
        let mut compiled = on_large_stack(|| compiled_text(&text, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let module = &compiled.module;
        load(&mut *generic, module, &uniform_values);
        load(&mut *specialized, module, &uniform_values);
        let settings = settings(module, &uniform_values, Mode::Shaded, CellMode::Never);
        let drawn = draw(&mut *generic, &settings);
        let expected = draw(&mut *specialized, &settings);
        assert_eq!(
            differing(&drawn, &expected),
            NO_DIFFERENCES,
            "{depth} boxes"
        );
        let created = generic.pipelines_created();
        assert_eq!(
            created == pipelines,
            is_within_limits,
            "{} pipelines for {depth} boxes",
            created - pipelines
        );
        pipelines = created;
    }
}
