//! Limits and failures: what an engine cannot do is an error with both numbers, and a device that
//! fails is replaced by the CPU where nobody asked for it by name.

use crate::scenes::{cpu, drawn, gpu, loaded, module};
use sdfc_runtime::engine::{
    Engine, EngineError, EngineKind, Loaded, Sample, on, open_auto, with_fallback,
};
use sdfc_runtime::frame::{CellUse, Frame, Progress, RenderSettings, Samples};
use sdfc_runtime::gpu::{DeviceKind, Gpu, GpuError, Limits, Preference};
use sdfc_runtime::verify::compare;
use sdfc_shaders::marching::SECANT_STEPS;
use sdfc_vm::program::Module;
use std::time::Duration;

const BALL: &str = "sphere [0.8]";

fn picture(engine: &mut dyn Engine, scene: &Module) -> Result<Frame, EngineError> {
    engine.load(&loaded(scene, &[]))?;
    engine.render(&drawn(scene, &[]), &|_| {})
}

#[test]
fn a_lost_device_is_an_error_and_the_cpu_takes_its_place_where_it_may() {
    let Some(lost) = gpu() else { return };
    lost.destroy();
    let scene = module(BALL, None);
    let mut engine = on(EngineKind::Interp, lost);
    let error = picture(&mut *engine, &scene).map(|frame| frame.stats);
    assert!(
        matches!(error, Err(EngineError::Gpu(GpuError::DeviceLost(_)))),
        "{error:?}"
    );

    let mut engine = with_fallback(engine);
    assert_eq!(engine.kind(), EngineKind::Interp);
    let frame = picture(&mut *engine, &scene).expect("the CPU does not fail");
    assert_eq!(engine.kind(), EngineKind::Cpu);
    let expected = picture(&mut *cpu(), &scene).expect("the CPU does not fail");
    assert_eq!(frame.color, expected.color);
}

/// Demands that an engine fails with such an error, and that the CPU then draws its own picture.
fn falls_back(
    mut engine: Box<dyn Engine>,
    scene: &Module,
    during: &dyn Progress,
    expected: impl Fn(&GpuError) -> bool,
) {
    let attempt = |engine: &mut dyn Engine| {
        engine.load(&loaded(scene, &[]))?;
        engine.render(&drawn(scene, &[]), during)
    };
    let failed = attempt(&mut *engine).map(|frame| frame.stats);
    assert!(
        matches!(&failed, Err(EngineError::Gpu(error)) if expected(error)),
        "{failed:?}"
    );
    let mut engine = with_fallback(engine);
    let frame = picture(&mut *engine, scene).expect("the CPU does not fail");
    assert_eq!(engine.kind(), EngineKind::Cpu);
    let expected = picture(&mut *cpu(), scene).expect("the CPU does not fail");
    assert_eq!(frame.color, expected.color);
    assert_eq!(frame.depth, expected.depth);
}

#[test]
fn a_device_that_is_lost_in_the_middle_of_a_picture() {
    let Some(gpu) = gpu() else { return };
    let destroy = gpu.destroyer();
    let engine = on(EngineKind::Interp, gpu);
    let lost = |error: &GpuError| matches!(error, GpuError::DeviceLost(_));
    falls_back(engine, &large(), &move |_| destroy(), lost);
}

#[test]
fn a_device_that_does_not_answer_in_time() {
    let Some(mut gpu) = gpu() else { return };
    gpu.timeout = Duration::ZERO;
    let engine = on(EngineKind::Interp, gpu);
    let late = |error: &GpuError| matches!(error, GpuError::Timeout { .. });
    falls_back(engine, &large(), &|_| {}, late);
}

/// Small tiles are drawn where buffers are small, and nothing where not even one block of pixels fits.
#[test]
fn a_device_with_tiny_limits() {
    if gpu().is_none() {
        return;
    }
    let within = |bytes: u64| {
        let tiny = move |limits: Limits| Limits {
            buffer: limits.buffer.min(bytes),
            storage_binding: limits.storage_binding.min(bytes),
            ..limits
        };
        let gpu = Gpu::open_within(Preference::Any, tiny).expect("lower limits are allowed");
        on(EngineKind::Interp, gpu)
    };
    let scene = large();
    let frame = picture(&mut *within(8192), &scene).expect("8192 bytes do for 64 rays");
    let expected = picture(&mut *cpu(), &scene).expect("the CPU does not fail");
    let (_, failures) = compare(&expected, &frame);
    assert!(failures.is_empty(), "{failures:?}");

    let small = |error: &GpuError| matches!(error, GpuError::LimitExceeded { .. });
    falls_back(within(1024), &scene, &|_| {}, small);
}

/// A scene whose picture takes several tiles.
fn large() -> Module {
    let mut scene = module(BALL, None);
    scene.settings.render.size = [160, 120];
    scene
}

/// An engine whose device is lost at the first picture or query.
struct Fragile(Box<dyn Engine>);

impl Engine for Fragile {
    fn kind(&self) -> EngineKind {
        EngineKind::Wgsl
    }
    fn device(&self) -> String {
        "glass".to_owned()
    }
    fn load(&mut self, scene: &Loaded<'_>) -> Result<(), EngineError> {
        self.0.load(scene)
    }
    fn update(&mut self, module: &Module, outputs: &[f64]) -> Result<(), EngineError> {
        self.0.update(module, outputs)
    }
    fn render_samples(
        &mut self,
        _: &RenderSettings,
        _: Samples<'_>,
        _: &dyn Progress,
    ) -> Result<Frame, EngineError> {
        Err(GpuError::DeviceLost("it broke".to_owned()).into())
    }
    fn query(&mut self, _: &[[f32; 3]]) -> Result<Vec<Sample>, EngineError> {
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
fn automatic_is_hardware_or_the_cpu() {
    let mut engine = open_auto();
    let scene = module(BALL, None);
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

/// A program of so many instructions.
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
    let mut interp = on(EngineKind::Interp, gpu);
    let allowed = 65_000 / SECANT_STEPS as usize - 1;
    let scene = long(allowed + 1);
    interp
        .load(&loaded(&scene, &[]))
        .expect("each evaluation alone is short enough");
    let whole = RenderSettings {
        cells: CellUse::Never,
        ..drawn(&scene, &[])
    };
    let refused = interp.render(&whole, &|_| {}).map(|frame| frame.stats);
    let expected = EngineError::TooLong {
        kind: EngineKind::Interp,
        what: "polish",
        need: allowed + 1,
        allowed,
    };
    assert_eq!(refused, Err(expected.clone()));
    assert_eq!(interp.pipelines_created(), 0);
    assert_eq!(
        expected.to_string(),
        format!(
            "the program has {} instructions, at most {allowed} are allowed on engine interp for \
             polish",
            allowed + 1
        )
    );
    // Several evaluations are too many, one is not.
    let samples = interp.query(&[[2.0, 0.0, 0.0]]).expect("it answers");
    assert!((samples[0].distance - 1.2).abs() < 1e-6);
}
