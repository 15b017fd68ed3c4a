//! The engine that is taken where none is asked for: a hardware GPU if there is one, else the CPU;
//! and the CPU in place of a GPU that fails, with the same picture.

use super::cpu::CpuEngine;
use super::{Engine, EngineError, EngineKind, Loaded, Sample, on};
use crate::cells::Part;
use crate::cpu::Geometry;
use crate::frame::{Frame, Mode, Progress, RenderSettings, Samples};
use crate::gpu::{Arithmetic, Gpu, Preference};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;

/// Opens the interpreter on a hardware GPU if there is one, with the CPU behind it, else the CPU.
pub fn open_auto() -> Box<dyn Engine> {
    open_auto_with(Arithmetic::Default)
}

/// The same with arithmetic that is strict or not. Hardware that cannot be strict is passed over; the
/// CPU behind it always is.
pub fn open_auto_with(arithmetic: Arithmetic) -> Box<dyn Engine> {
    match Gpu::open_with(Preference::Hardware, arithmetic) {
        Ok(gpu) => with_fallback(on(EngineKind::Interp, gpu)),
        Err(_) => Box::new(CpuEngine::default()),
    }
}

/// An engine that goes over to the CPU for good when `engine` fails for a reason of its own: its
/// device, or a limit that the CPU does not have.
pub fn with_fallback(engine: Box<dyn Engine>) -> Box<dyn Engine> {
    Box::new(WithFallback {
        engine,
        scene: None,
    })
}

struct WithFallback {
    engine: Box<dyn Engine>,
    /// What the CPU would load.
    scene: Option<(Module, Vec<f64>)>,
}

impl WithFallback {
    /// Does `work`, again on the CPU if it fails here and the CPU may do better.
    fn attempt<R>(
        &mut self,
        mut work: impl FnMut(&mut dyn Engine) -> Result<R, EngineError>,
    ) -> Result<R, EngineError> {
        let result = work(&mut *self.engine);
        let helps = matches!(
            result,
            Err(EngineError::Gpu(_) | EngineError::TooLong { .. })
        );
        if !helps || self.engine.kind() == EngineKind::Cpu {
            return result;
        }
        self.engine = Box::new(CpuEngine::default());
        if let Some((module, outputs)) = &self.scene {
            let generated = SceneSource::default();
            self.engine.load(&Loaded {
                module,
                outputs,
                generated,
            })?;
        }
        work(&mut *self.engine)
    }
}

impl Engine for WithFallback {
    fn kind(&self) -> EngineKind {
        self.engine.kind()
    }
    fn device(&self) -> String {
        self.engine.device()
    }
    fn load(&mut self, scene: &Loaded<'_>) -> Result<(), EngineError> {
        self.scene = Some((scene.module.clone(), scene.outputs.to_vec()));
        self.attempt(|engine| engine.load(scene))
    }
    fn update(&mut self, module: &Module, outputs: &[f64]) -> Result<(), EngineError> {
        self.attempt(|engine| engine.update(module, outputs))?;
        self.scene = Some((module.clone(), outputs.to_vec()));
        Ok(())
    }
    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn Progress,
    ) -> Result<Frame, EngineError> {
        self.attempt(|engine| engine.render_samples(settings, samples, progress))
    }
    fn geometry(&mut self, settings: &RenderSettings) -> Result<Geometry, EngineError> {
        self.attempt(|engine| engine.geometry(settings))
    }
    fn figure(
        &mut self,
        settings: &RenderSettings,
        band: f32,
    ) -> Result<Option<Vec<f32>>, EngineError> {
        self.attempt(|engine| engine.figure(settings, band))
    }
    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<Sample>, EngineError> {
        self.attempt(|engine| engine.query(points))
    }
    fn cells_at(
        &mut self,
        settings: &RenderSettings,
        points: &[[f32; 3]],
    ) -> Result<Option<Vec<Option<Part>>>, EngineError> {
        self.attempt(|engine| engine.cells_at(settings, points))
    }
    fn heeds_guards(&self) -> bool {
        self.engine.heeds_guards()
    }
    fn warm_up(&mut self, modes: &[Mode]) -> Result<(), EngineError> {
        self.attempt(|engine| engine.warm_up(modes))
    }
    fn pipelines_created(&self) -> u64 {
        self.engine.pipelines_created()
    }
}
