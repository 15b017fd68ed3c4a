//! Cost of changes: parameters, time, cameras and supported scenes create no pipeline.

use crate::scenes::{cpu, drawn, drawn_as, interp, loaded, module, with_params};
use sdfc_runtime::engine::{Engine, EngineError};
use sdfc_runtime::render::Image;
use sdfc_runtime::settings::Overrides;
use sdfc_vm::program::Module;

fn render(engine: &mut dyn Engine, module: &Module, uniform_values: &[f64]) -> Image {
    engine
        .render(&drawn(module, uniform_values), &|_| {})
        .expect("it renders")
}

/// Sets the only parameter to another value.
fn set(module: &mut Module, value: f64) -> Vec<f64> {
    let uniform_values = module.uniforms.run(&[value], 0.0);
    module.distance.patch(&[value as f32]);
    uniform_values
}

const BALL_AND_BOX: &str = "
    sphere [0.8@u0]
    cuboid [0.4, 0.4, 0.4]  moved [-0.9, 0.0, 0.0]  blend quadratic [1.0, 1.0, 0.4, 0.625]
";

#[test]
fn parameters_and_cameras_are_numbers() {
    let Some(mut interp) = interp() else { return };
    let mut cpu = cpu();
    let mut scene = module(BALL_AND_BOX, None);
    with_params(&mut scene, 1);
    let uniform_values = set(&mut scene, 0.8);
    for engine in [&mut cpu, &mut interp] {
        engine
            .load(&loaded(&scene, &uniform_values))
            .expect("it loads");
    }
    let first_image = render(&mut *interp, &scene, &uniform_values);
    let pipelines = interp.pipelines_created();
    assert!(pipelines >= 5, "{pipelines}");

    // Repeating a render gives the same image, however it is divided into dispatches.
    assert_eq!(
        render(&mut *interp, &scene, &uniform_values).color,
        first_image.color
    );

    let uniform_values = set(&mut scene, 1.1);
    for engine in [&mut cpu, &mut interp] {
        engine
            .update(&scene, &uniform_values)
            .expect("it takes the parameter");
    }
    let after = render(&mut *interp, &scene, &uniform_values);
    assert!(after.stats.hits > first_image.stats.hits + 20);
    let expected = render(&mut *cpu, &scene, &uniform_values);
    let differing = expected.depth.iter().zip(&after.depth).filter(|(a, b)| {
        a.is_finite() != b.is_finite() || (a.is_finite() && (*a - *b).abs() > 1e-4)
    });
    assert!(differing.count() <= 4);

    scene.settings.cameras[0].from = crate::scenes::constants([-3.0, 1.0, 4.0]);
    let moved = render(&mut *interp, &scene, &uniform_values);
    assert_ne!(moved.color, after.color);
    // Larger than before: buffers grow, kernels stay.
    let overrides = Overrides {
        size: Some([120, 80]),
        ..Overrides::default()
    };
    let large = interp
        .render(&drawn_as(&scene, &uniform_values, &overrides), &|_| {})
        .expect("it renders");
    assert_eq!((large.width, large.height), (120, 80));
    assert_eq!(interp.pipelines_created(), pipelines);
}

#[test]
fn a_scene_that_needs_nothing_new_runs_in_the_kernels_there_are() {
    let Some(mut interp) = interp() else { return };
    let first = module(BALL_AND_BOX, None);
    interp.load(&loaded(&first, &[])).expect("it loads");
    render(&mut *interp, &first, &[]);
    let pipelines = interp.pipelines_created();

    let second = module("cuboid [0.7, 0.5, 0.3]  moved [0.3, 0.0, 0.0]", None);
    interp.load(&loaded(&second, &[])).expect("it loads");
    let image = render(&mut *interp, &second, &[]);
    assert_eq!(interp.pipelines_created(), pipelines);
    let mut cpu = cpu();
    cpu.load(&loaded(&second, &[])).expect("it loads");
    assert_eq!(image.stats.hits, render(&mut *cpu, &second, &[]).stats.hits);

    let third = module("torus [0.7, 0.2]", None);
    interp.load(&loaded(&third, &[])).expect("it loads");
    render(&mut *interp, &third, &[]);
    assert!(interp.pipelines_created() > pipelines, "a torus is new");
}

#[test]
fn parameters_of_another_scene_are_refused() {
    let scene = module(BALL_AND_BOX, None);
    let other = module("torus [0.7, 0.2]", None);
    for engine in [Some(cpu()), interp()].into_iter().flatten() {
        let mut engine: Box<dyn Engine> = engine;
        assert_eq!(
            engine.update(&scene, &[0.5]),
            Err(EngineError::NothingLoaded)
        );
        assert_eq!(engine.query(&[[0.0; 3]]), Err(EngineError::NothingLoaded));
        engine.load(&loaded(&scene, &[0.5])).expect("it loads");
        assert_eq!(engine.update(&other, &[]), Err(EngineError::SceneMismatch));
    }
}

#[test]
fn progress_only_grows_and_ends_at_all() {
    let scene = module(BALL_AND_BOX, None);
    let overrides = Overrides {
        size: Some([96, 96]),
        ..Overrides::default()
    };
    let settings = drawn_as(&scene, &[0.8], &overrides);
    for engine in [Some(cpu()), interp()].into_iter().flatten() {
        let mut engine: Box<dyn Engine> = engine;
        engine.load(&loaded(&scene, &[0.8])).expect("it loads");
        let reports = std::sync::Mutex::new(Vec::new());
        let note = |fraction: f32| reports.lock().expect("no panic before").push(fraction);
        engine.render(&settings, &note).expect("it renders");
        let mut reports = reports.into_inner().expect("no panic before");
        // Threads may report out of order.
        reports.sort_by(f32::total_cmp);
        assert!(
            reports.first() > Some(&0.0) && reports.last() == Some(&1.0),
            "{reports:?}"
        );
    }
}
