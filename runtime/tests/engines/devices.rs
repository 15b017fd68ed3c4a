//! Limits and failures. An impossible request is an error with both numbers. A failing device is replaced by
//! the CPU unless it was requested by name.

use crate::scenes::{cpu, drawn, gpu, loaded, module};
use sdfc_runtime::comparison::compare;
use sdfc_runtime::engine::{
    Engine, EngineError, EngineKind, FieldSample, SceneInput, open_auto, open_on, with_fallback,
};
use sdfc_runtime::gpu::{AdapterPreference, DeviceKind, DeviceLimits, Gpu, GpuError};
use sdfc_runtime::render::{CellMode, Image, RenderProgress, RenderSettings, Samples};
use sdfc_shaders::marching::MAX_SECANT_STEPS;
use sdfc_vm::program::Module;
use std::time::Duration;

const SPHERE: &str = "sphere [0.8]";

fn picture(engine: &mut dyn Engine, scene: &Module) -> Result<Image, EngineError> {
    engine.load(&loaded(scene, &[]))?;
    engine.render(&drawn(scene, &[]), &|_| {})
}

#[test]
fn a_lost_device_is_an_error_and_the_cpu_takes_its_place_where_it_may() {
    let Some(lost) = gpu() else { return };
    lost.destroy();
    let scene = module(SPHERE, None);
    let mut engine = open_on(EngineKind::Interp, lost);
    let error = picture(&mut *engine, &scene).map(|image| image.stats);
    assert!(
        matches!(error, Err(EngineError::Gpu(GpuError::DeviceLost(_)))),
        "{error:?}"
    );

    let mut engine = with_fallback(engine);
    assert_eq!(engine.kind(), EngineKind::Interp);
    let image = picture(&mut *engine, &scene).expect("the CPU does not fail");
    assert_eq!(engine.kind(), EngineKind::Cpu);
    let expected = picture(&mut *cpu(), &scene).expect("the CPU does not fail");
    assert_eq!(image.color, expected.color);
}

/// Checks that an engine fails with this error, and that the CPU then renders its usual image.
fn falls_back(
    mut engine: Box<dyn Engine>,
    scene: &Module,
    during: &dyn RenderProgress,
    expected: impl Fn(&GpuError) -> bool,
) {
    let attempt = |engine: &mut dyn Engine| {
        engine.load(&loaded(scene, &[]))?;
        engine.render(&drawn(scene, &[]), during)
    };
    let failed = attempt(&mut *engine).map(|image| image.stats);
    assert!(
        matches!(&failed, Err(EngineError::Gpu(error)) if expected(error)),
        "{failed:?}"
    );
    let mut engine = with_fallback(engine);
    let image = picture(&mut *engine, scene).expect("the CPU does not fail");
    assert_eq!(engine.kind(), EngineKind::Cpu);
    let expected = picture(&mut *cpu(), scene).expect("the CPU does not fail");
    assert_eq!(image.color, expected.color);
    assert_eq!(image.depth, expected.depth);
}

#[test]
fn a_device_that_is_lost_in_the_middle_of_a_picture() {
    let Some(gpu) = gpu() else { return };
    let destroy = gpu.destroyer();
    let engine = open_on(EngineKind::Interp, gpu);
    let lost = |error: &GpuError| matches!(error, GpuError::DeviceLost(_));
    falls_back(engine, &large(), &move |_| destroy(), lost);
}

#[test]
fn a_device_that_does_not_respond_in_time() {
    let Some(mut gpu) = gpu() else { return };
    gpu.timeout = Duration::ZERO;
    let engine = open_on(EngineKind::Interp, gpu);
    let late = |error: &GpuError| matches!(error, GpuError::Timeout { .. });
    falls_back(engine, &large(), &|_| {}, late);
}

/// Small tiles are rendered where buffers are small, and nothing where not even one block of pixels fits.
#[test]
fn a_device_with_tiny_limits() {
    if gpu().is_none() {
        return;
    }
    let within = |bytes: u64| {
        let tiny = move |limits: DeviceLimits| DeviceLimits {
            buffer: limits.buffer.min(bytes),
            storage_binding: limits.storage_binding.min(bytes),
            ..limits
        };
        let gpu =
            Gpu::open_with_limits(AdapterPreference::Any, tiny).expect("lower limits are allowed");
        open_on(EngineKind::Interp, gpu)
    };
    let scene = large();
    let image = picture(&mut *within(8192), &scene).expect("8192 bytes do for 64 rays");
    let expected = picture(&mut *cpu(), &scene).expect("the CPU does not fail");
    let (_, failures) = compare(&expected, &image);
    assert!(failures.is_empty(), "{failures:?}");

    let small = |error: &GpuError| matches!(error, GpuError::LimitExceeded { .. });
    falls_back(within(1024), &scene, &|_| {}, small);
}

/// A scene whose image takes several tiles.
fn large() -> Module {
    let mut scene = module(SPHERE, None);
    scene.settings.render.size = [160, 120];
    scene
}

/// An engine whose device is lost at the first render or query.
struct Fragile(Box<dyn Engine>);

impl Engine for Fragile {
    fn kind(&self) -> EngineKind {
        EngineKind::Wgsl
    }
    fn device(&self) -> String {
        "glass".to_owned()
    }
    fn load(&mut self, scene: &SceneInput<'_>) -> Result<(), EngineError> {
        self.0.load(scene)
    }
    fn update(&mut self, module: &Module, uniform_values: &[f64]) -> Result<(), EngineError> {
        self.0.update(module, uniform_values)
    }
    fn render_samples(
        &mut self,
        _: &RenderSettings,
        _: Samples<'_>,
        _: &dyn RenderProgress,
    ) -> Result<Image, EngineError> {
        Err(GpuError::DeviceLost("it broke".to_owned()).into())
    }
    fn query(&mut self, _: &[[f32; 3]]) -> Result<Vec<FieldSample>, EngineError> {
        Err(GpuError::OutOfMemory("it is full".to_owned()).into())
    }
}

#[test]
fn a_device_that_fails_in_the_middle_is_replaced_with_the_parameters_it_had() {
    let mut scene = module("sphere [0.8@u0]", None);
    crate::scenes::with_params(&mut scene, 1);
    let mut engine = with_fallback(Box::new(Fragile(cpu())));
    engine.load(&loaded(&scene, &[0.8])).expect("it loads");
    scene.distance.patch(&[1.2]);
    engine
        .update(&scene, &[1.2])
        .expect("it takes the parameter");
    let samples = engine
        .query(&[[0.0; 3], [2.0, 0.0, 0.0]])
        .expect("the CPU answers");
    assert_eq!(samples[0].distance, -1.2);
    assert!((samples[1].distance - 0.8).abs() < 1e-6);
    assert_eq!(engine.kind(), EngineKind::Cpu);
    engine
        .render(&drawn(&scene, &[1.2]), &|_| {})
        .expect("the CPU renders");
}

#[test]
fn the_cpu_draws_what_only_it_can_prove() {
    let Some(gpu) = gpu() else { return };
    let mut engine = with_fallback(open_on(EngineKind::Interp, gpu));
    let known = module(SPHERE, None);
    let mut estimated = known.clone();
    estimated.settings.slope_over_estimate = Some(f64::INFINITY);
    for (scene, kind) in [
        (&known, EngineKind::Interp),
        (&estimated, EngineKind::Cpu),
        (&known, EngineKind::Interp),
    ] {
        picture(&mut *engine, scene).expect("it draws");
        assert_eq!(engine.kind(), kind);
    }
}

#[test]
fn automatic_is_hardware_or_the_cpu() {
    let mut engine = open_auto();
    let scene = module(SPHERE, None);
    assert!(matches!(
        engine.kind(),
        EngineKind::Interp | EngineKind::Cpu
    ));
    assert!(
        picture(&mut *engine, &scene)
            .expect("it renders")
            .stats
            .hits
            > 50
    );
}

/// A program with this number of instructions.
fn long(instructions: usize) -> Module {
    let mut text = String::from("sphere [0.8]\n");
    text.push_str(&"offset [0.0]\n".repeat(instructions - 1));
    module(&text, None)
}

#[test]
fn a_program_too_long_for_a_stage_is_refused_before_anything_runs() {
    let Some(gpu) = gpu() else { return };
    if gpu.info().kind != DeviceKind::Software {
        return;
    }
    let mut interp = open_on(EngineKind::Interp, gpu);
    let allowed = 65_000 / MAX_SECANT_STEPS as usize - 1;
    let scene = long(allowed + 1);
    interp
        .load(&loaded(&scene, &[]))
        .expect("each evaluation alone is short enough");
    let full_view = RenderSettings {
        cells: CellMode::Never,
        ..drawn(&scene, &[])
    };
    let refused = interp.render(&full_view, &|_| {}).map(|image| image.stats);
    let expected = EngineError::TooLong {
        kind: EngineKind::Interp,
        what: "refine_roots",
        need: allowed + 1,
        allowed,
    };
    assert_eq!(refused, Err(expected.clone()));
    assert_eq!(interp.pipelines_created(), 0);
    assert_eq!(
        expected.to_string(),
        format!(
            "the program has {} instructions, at most {allowed} are allowed on engine interp for its \
             stage refine_roots: engine cpu has no such limit",
            allowed + 1
        )
    );
    // Several evaluations are too many, one is not.
    let samples = interp.query(&[[2.0, 0.0, 0.0]]).expect("it answers");
    assert!((samples[0].distance - 1.2).abs() < 1e-6);
}
