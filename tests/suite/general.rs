//! The interpreter whose kernels run every scene: it draws what the one draws whose kernels have only
//! what a scene needs, and makes no pipeline for it.

use crate::corpus::{compiled, compiled_text, on_large_stack, scenes};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind, Loaded, general, on};
use sdfc_runtime::frame::{
    CellUse, Frame, Light, Lighting, Mode, Normals, Occlusion, RenderSettings, Shadow, Source,
};
use sdfc_runtime::gpu::{Gpu, Preference};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;

/// The engine with general kernels, warmed up for these modes, and the one with special ones; `None`
/// where GPU tests are to be skipped.
fn engines(modes: &[Mode]) -> Option<[Box<dyn Engine>; 2]> {
    if let Ok(reason) = std::env::var("SDFC_SKIP_GPU") {
        eprintln!("skipped: {reason}");
        return None;
    }
    let gpu = || Gpu::open(Preference::Any).expect("there is an adapter");
    let mut warm = general(gpu());
    warm.warm_up(modes).expect("it warms up");
    Some([warm, on(EngineKind::Interp, gpu())])
}

fn load(engine: &mut dyn Engine, module: &Module, outputs: &[f64]) {
    let loaded = Loaded {
        module,
        outputs,
        generated: SceneSource::default(),
    };
    engine.load(&loaded).expect("the scene loads");
}

/// In how many pixels depths, materials and steps differ in any bit, and normals and colours by more
/// than a driver may make them differ between two kernels.
fn differing(a: &Frame, b: &Frame) -> [usize; 5] {
    let count = |same: &dyn Fn(usize) -> bool| (0..a.depth.len()).filter(|&i| !same(i)).count();
    let near = |a: &[f32], b: &[f32], most: f32| {
        let mut pairs = a.iter().zip(b);
        pairs.all(|(a, b)| (a - b).abs() <= most)
    };
    [
        count(&|i| a.depth[i].to_bits() == b.depth[i].to_bits()),
        count(&|i| a.id[i] == b.id[i]),
        count(&|i| a.steps[i] == b.steps[i]),
        count(&|i| near(&a.normal[i], &b.normal[i], 1e-6)),
        count(&|i| near(&a.color[i], &b.color[i], 1e-4)),
    ]
}

const SAME: [usize; 5] = [0; 5];

fn settings(module: &Module, outputs: &[f64], mode: Mode, cells: CellUse) -> RenderSettings {
    let overrides = Overrides {
        size: Some([24, 16]),
        aa: Some(1),
        mode,
        cells,
        ..Overrides::default()
    };
    resolve(module, outputs, &overrides).expect("the scene has settings")
}

fn draw(engine: &mut dyn Engine, settings: &RenderSettings) -> Frame {
    engine.render(settings, &|_| {}).expect("it is drawn")
}

#[test]
fn every_scene_runs_in_the_kernels_that_are_there() {
    let Some([mut general, mut special]) = engines(&[Mode::Shaded]) else {
        return;
    };
    let pipelines = general.pipelines_created();
    let mut failures = Vec::new();
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        let mut compiled = on_large_stack(|| compiled(path, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let module = &compiled.module;
        load(&mut *general, module, &outputs);
        load(&mut *special, module, &outputs);
        let [never, always] =
            [CellUse::Never, CellUse::Always].map(|c| settings(module, &outputs, Mode::Shaded, c));
        let needed = draw(&mut *special, &never);
        for settings in [never, always] {
            let found = draw(&mut *general, &settings);
            let pixels = differing(&found, &needed);
            if pixels != SAME || found.stats.evaluations != needed.stats.evaluations {
                failures.push(format!(
                    "{}, cells {:?}: depths, materials, steps, normals and colours differ in \
                     {pixels:?} pixels; {} and {} evaluations",
                    path.display(),
                    settings.cells,
                    found.stats.evaluations,
                    needed.stats.evaluations,
                ));
            }
        }
        general
            .query(&[[0.3, 0.2, 0.4], [-1.0, 0.5, 0.1]])
            .expect("it answers");
        assert_eq!(general.pipelines_created(), pipelines, "{}", path.display());
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// A scene with materials and one without.
const PAINTED: &str = "material clay { color: #c04030, roughness: 0.4 }
sphere(1).material(clay) | box([3, 0.1, 3]).translate(0, -1, 0)
";
const PLAIN: &str = "sphere(1) | box([3, 0.1, 3]).translate(0, -1, 0)\n";

/// Pictures of a scene that ask for one thing after the other.
fn asked(first: &RenderSettings) -> Vec<(String, RenderSettings)> {
    let mut all = Vec::new();
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
        all.push((format!("{normals:?}"), settings));
    }
    for occlusion in [Occlusion::Off, Occlusion::FiveTap, Occlusion::Multi(6)] {
        let settings = RenderSettings {
            occlusion,
            ..first.clone()
        };
        all.push((format!("{occlusion:?}"), settings));
    }
    let lamp = |shadow| Light {
        source: Source::Directional([0.4, 1.0, 0.6]),
        color: [0.7, 0.6, 0.5],
        shadow,
    };
    let near = Light {
        source: Source::Point([-2.0, 2.0, 2.0]),
        ..lamp(Shadow::Improved(0.1))
    };
    let forms = [
        Shadow::None,
        Shadow::Hard,
        Shadow::Plain(0.1),
        Shadow::Improved(0.1),
        Shadow::Sized(0.1),
    ];
    let mut lights: Vec<Vec<Light>> = forms.iter().map(|&form| vec![lamp(form)]).collect();
    lights.push(Vec::new());
    lights.push([&lights[0][..], &lights[4], &[near]].concat());
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
            all.push((title, settings));
        }
    }
    all
}

#[test]
fn whatever_a_picture_asks_for_runs_in_them() {
    let modes = [Mode::Shaded, Mode::Normal, Mode::Distance];
    let Some([mut general, mut special]) = engines(&modes) else {
        return;
    };
    let pipelines = general.pipelines_created();
    for text in [PAINTED, PLAIN] {
        let mut compiled = on_large_stack(|| compiled_text(text, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let module = &compiled.module;
        load(&mut *general, module, &outputs);
        load(&mut *special, module, &outputs);
        let shaded = settings(module, &outputs, Mode::Shaded, CellUse::Auto);
        let mut pictures = asked(&shaded);
        for mode in [Mode::Normal, Mode::Distance] {
            let settings = settings(module, &outputs, mode, CellUse::Auto);
            pictures.push((format!("{mode:?}"), settings));
        }
        for (title, settings) in pictures {
            let found = draw(&mut *general, &settings);
            let needed = draw(&mut *special, &settings);
            assert_eq!(differing(&found, &needed), SAME, "{title} of {text}");
            assert_eq!(general.pipelines_created(), pipelines, "{title} of {text}");
        }
    }
}

/// So many boxes, each with all smaller ones taken out of it: as many values at once.
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
    let Some([mut general, mut special]) = engines(&[Mode::Shaded]) else {
        return;
    };
    let mut made = general.pipelines_created();
    for (depth, fits) in [(8, true), (40, false), (8, true)] {
        let text = nested(depth);
        let mut compiled = on_large_stack(|| compiled_text(&text, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let module = &compiled.module;
        load(&mut *general, module, &outputs);
        load(&mut *special, module, &outputs);
        let settings = settings(module, &outputs, Mode::Shaded, CellUse::Never);
        let found = draw(&mut *general, &settings);
        let needed = draw(&mut *special, &settings);
        assert_eq!(differing(&found, &needed), SAME, "{depth} boxes");
        let now = general.pipelines_created();
        assert_eq!(
            now == made,
            fits,
            "{} pipelines for {depth} boxes",
            now - made
        );
        made = now;
    }
}
