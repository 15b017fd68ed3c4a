//! Default choice of an engine: a hardware GPU if there is one, else the CPU. A GPU that fails is replaced by
//! the CPU, with the same image. Where only an estimate of a field's slope is known, the CPU draws: it alone proves
//! that rays step over nothing.

use super::open::open_on;
use super::{Engine, EngineError, EngineKind, FieldSample, SceneInput};
use crate::cells::CellInfo;
use crate::cpu::engine::CpuEngine;
use crate::gpu::{AdapterPreference, Arithmetic, Gpu};
use crate::render::{Geometry, Image, Mode, RenderProgress, RenderSettings, Samples};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;

/// Opens the interpreter on a hardware GPU with the CPU as fallback; the CPU engine if there is none.
pub fn open_auto() -> Box<dyn Engine> {
    open_auto_with(Arithmetic::Default)
}

/// Opens an engine like [`open_auto`], with strict or default arithmetic. Hardware that cannot be strict is
/// skipped; the CPU always is strict.
pub fn open_auto_with(arithmetic: Arithmetic) -> Box<dyn Engine> {
    match Gpu::open_with(AdapterPreference::Hardware, arithmetic) {
        Ok(gpu) => with_fallback(open_on(EngineKind::Interp, gpu)),
        Err(_) => Box::new(CpuEngine::default()),
    }
}

/// Wraps an engine so that it switches permanently to the CPU when `engine` fails. This covers failures of
/// its device, and limits that the CPU does not have. Scenes with estimated slopes are drawn by the CPU.
pub fn with_fallback(engine: Box<dyn Engine>) -> Box<dyn Engine> {
    Box::new(WithFallback {
        engine,
        prover: None,
        scene: None,
    })
}

struct WithFallback {
    engine: Box<dyn Engine>,
    /// The CPU, while it draws a scene with estimated slopes.
    prover: Option<CpuEngine>,
    /// The scene that the CPU engine loads after a switch.
    scene: Option<(Module, Vec<f64>)>,
}

impl WithFallback {
    /// Returns the engine that draws the present scene.
    fn active(&self) -> &dyn Engine {
        match &self.prover {
            Some(prover) => prover,
            None => &*self.engine,
        }
    }

    /// Runs `work`; if it fails for a reason that the CPU does not have, switches to the CPU and runs it
    /// again.
    fn attempt<R>(
        &mut self,
        mut work: impl FnMut(&mut dyn Engine) -> Result<R, EngineError>,
    ) -> Result<R, EngineError> {
        if let Some(prover) = &mut self.prover {
            return work(prover);
        }
        let result = work(&mut *self.engine);
        let helps = matches!(
            result,
            Err(EngineError::Gpu(_) | EngineError::TooLong { .. })
        );
        if !helps || self.engine.kind() == EngineKind::Cpu {
            return result;
        }
        self.engine = Box::new(CpuEngine::default());
        if let Some((module, uniform_values)) = &self.scene {
            let generated = SceneSource::default();
            self.engine.load(&SceneInput {
                module,
                uniform_values,
                generated,
            })?;
        }
        work(&mut *self.engine)
    }
}

impl Engine for WithFallback {
    fn kind(&self) -> EngineKind {
        self.active().kind()
    }
    fn device(&self) -> String {
        self.active().device()
    }
    fn load(&mut self, scene: &SceneInput<'_>) -> Result<(), EngineError> {
        let needs_proof = scene.module.settings.max_slope().is_infinite();
        self.prover = needs_proof.then(|| self.prover.take().unwrap_or_default());
        self.scene = Some((scene.module.clone(), scene.uniform_values.to_vec()));
        self.attempt(|engine| engine.load(scene))
    }
    fn update(&mut self, module: &Module, uniform_values: &[f64]) -> Result<(), EngineError> {
        self.attempt(|engine| engine.update(module, uniform_values))?;
        self.scene = Some((module.clone(), uniform_values.to_vec()));
        Ok(())
    }
    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn RenderProgress,
    ) -> Result<Image, EngineError> {
        self.attempt(|engine| engine.render_samples(settings, samples, progress))
    }
    fn geometry(&mut self, settings: &RenderSettings) -> Result<Geometry, EngineError> {
        self.attempt(|engine| engine.geometry(settings))
    }
    fn sample_plane(
        &mut self,
        settings: &RenderSettings,
        band: f32,
    ) -> Result<Option<Vec<f32>>, EngineError> {
        self.attempt(|engine| engine.sample_plane(settings, band))
    }
    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<FieldSample>, EngineError> {
        self.attempt(|engine| engine.query(points))
    }
    fn cells_at(
        &mut self,
        settings: &RenderSettings,
        points: &[[f32; 3]],
    ) -> Result<Option<Vec<Option<CellInfo>>>, EngineError> {
        self.attempt(|engine| engine.cells_at(settings, points))
    }
    fn benefits_from_guards(&self) -> bool {
        self.active().benefits_from_guards()
    }
    fn warm_up(&mut self, modes: &[Mode]) -> Result<(), EngineError> {
        self.attempt(|engine| engine.warm_up(modes))
    }
    fn pipelines_created(&self) -> u64 {
        self.active().pipelines_created()
    }
}
