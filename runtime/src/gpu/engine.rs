//! The engines on a GPU. A scene whose single evaluation is too long is refused before anything runs.

use super::driver::{Arithmetic, DeviceKind, Gpu};
use super::interp::Interpreter;
use super::runner::{DeviceScene, SceneRunner};
use super::scene::{GpuScene, KernelMode};
use super::tiles::TileQueue;
use super::wgsl::GeneratedScene;
use super::{query, warm_up};
use crate::engine::{Engine, EngineError, EngineKind, FieldSample, SceneInput};
use crate::render::plane::plane_of;
use crate::render::{
    FieldFacts, Image, Mode, RenderJob, RenderProgress, RenderSettings, Samples, Surface,
};
use crate::settings::{default_material, field_facts};
use sdfc_shaders::assemble::SceneFunction;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::program::Module;

/// Opens the interpreter with kernels for one scene and image.
pub(crate) fn open_interpreter(gpu: Gpu) -> Box<dyn Engine> {
    Box::new(GpuEngine::<Interpreter>::new(gpu, KernelMode::Specialized))
}

/// Opens the interpreter with kernels for all scenes and images.
pub(crate) fn open_generic_interpreter(gpu: Gpu) -> Box<dyn Engine> {
    Box::new(GpuEngine::<Interpreter>::new(gpu, KernelMode::Generic))
}

/// Opens the engine that runs WGSL generated for the scene.
pub(crate) fn open_generated(gpu: Gpu) -> Box<dyn Engine> {
    Box::new(GpuEngine::<GeneratedScene>::new(
        gpu,
        KernelMode::Specialized,
    ))
}

/// An engine on a GPU.
struct GpuEngine<S> {
    runner: SceneRunner<S>,
    kernel_mode: KernelMode,
}

impl<S: GpuScene> GpuEngine<S> {
    fn new(gpu: Gpu, kernel_mode: KernelMode) -> Self {
        Self {
            runner: SceneRunner::new(gpu),
            kernel_mode,
        }
    }
}

impl<S: GpuScene> Engine for GpuEngine<S> {
    fn kind(&self) -> EngineKind {
        S::KIND
    }

    fn device(&self) -> String {
        let info = self.runner.gpu.info();
        let arithmetic = match self.runner.gpu.arithmetic() {
            Arithmetic::Default => "",
            Arithmetic::Strict => ", strict",
            Arithmetic::Portable => ", strict by barriers",
        };
        let (name, kind, backend) = (&info.name, info.kind.name(), &info.backend);
        format!("{name} ({kind}, {backend}{arithmetic})")
    }

    fn load(&mut self, scene: &SceneInput<'_>) -> Result<(), EngineError> {
        let previous = self
            .runner
            .begin_replace(scene.generated.text.len().div_ceil(1024) as u32);
        let gpu_scene = S::load(&self.runner.gpu, scene, self.kernel_mode, previous)?;
        self.runner.scene = Some(DeviceScene {
            gpu_scene,
            facts: field_facts(scene.module, scene.uniform_values),
            default_material: default_material(scene.module, scene.uniform_values),
            has_surface_program: scene.module.surface.is_some(),
        });
        self.runner
            .check_loop_limit(SceneFunction::Distance, 1, "one evaluation")
    }

    fn update(&mut self, module: &Module, uniform_values: &[f64]) -> Result<(), EngineError> {
        let scene = self
            .runner
            .scene
            .as_mut()
            .ok_or(EngineError::NothingLoaded)?;
        scene
            .gpu_scene
            .update(&self.runner.gpu, module, uniform_values)?;
        scene.facts = field_facts(module, uniform_values);
        scene.default_material = default_material(module, uniform_values);
        Ok(())
    }

    fn sample_plane(
        &mut self,
        settings: &RenderSettings,
        band: f32,
    ) -> Result<Option<Vec<f32>>, EngineError> {
        let Some(plane) = plane_of(settings) else {
            return Ok(None);
        };
        let settings = RenderSettings {
            mode: Mode::Mask,
            is_2d: true,
            aa: 1,
            ..settings.clone()
        };
        let job = RenderJob {
            exact_band: Some(band),
            ..self.runner.job(&settings)?
        };
        self.runner.prepare(Some(&job))?;
        let plan = self.runner.plan(&job)?;
        let [width, height] = plane.size;
        let mut values = vec![0.0; width * height];
        let mut tiles = TileQueue::new(job.size);
        while let Some(tile) = tiles.next(
            plan.max_tile_pixels
                .min(self.runner.budget.tile_pixels(plan.weight)),
        ) {
            self.runner
                .sample_plane_tile(&plan, &job, tile, &mut values)?;
        }
        Ok(Some(values))
    }

    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn RenderProgress,
    ) -> Result<Image, EngineError> {
        let job = self.runner.job(settings)?;
        let (passes, mut image) = samples.passes(&job);
        if passes.is_empty() {
            return Ok(image);
        }
        self.runner.prepare(Some(&job))?;
        let plan = self.runner.plan(&job)?;
        let [width, height] = job.size;
        let total = u64::from(width) * u64::from(height);
        let mut tiles = TileQueue::new(job.size);
        let mut done = 0;
        while let Some(tile) = tiles.next(
            plan.max_tile_pixels
                .min(self.runner.budget.tile_pixels(plan.weight)),
        ) {
            self.runner
                .render_tile(&plan, &job, tile, passes.clone(), &mut image)?;
            done += tile.pixels();
            if progress.report(done as f32 / total as f32).is_break() {
                return Err(EngineError::Stopped);
            }
        }
        if let Some(scene) = &mut self.runner.scene {
            image.stats.cells = scene.gpu_scene.cells(&self.runner.gpu)?;
        }
        Ok(image)
    }

    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<FieldSample>, EngineError> {
        query::query(&mut self.runner, points)
    }

    fn warm_up(&mut self, modes: &[Mode]) -> Result<(), EngineError> {
        if self.kernel_mode == KernelMode::Specialized {
            return Ok(());
        }
        let previous = self.runner.begin_replace(0);
        let Some(gpu_scene) = S::empty_generic(&self.runner.gpu, previous)? else {
            return Ok(());
        };
        self.runner.scene = Some(DeviceScene {
            gpu_scene,
            facts: FieldFacts {
                is_raw: false,
                has_estimated_slopes: false,
                max_slope: 1.0,
                has_loose_slopes: false,
                bounds: Bounds::ALL_SPACE,
                material: None,
            },
            default_material: Surface::default(),
            has_surface_program: true,
        });
        for settings in modes
            .iter()
            .flat_map(|&mode| warm_up::warm_up_settings(mode))
        {
            self.render(&settings, &|_| {})?;
        }
        self.query(&[[0.0; 3]])?;
        Ok(())
    }

    fn benefits_from_guards(&self) -> bool {
        match S::KIND {
            // Tapes have no guards.
            EngineKind::Interp => self.kernel_mode == KernelMode::Specialized,
            _ => self.runner.gpu.info().kind != DeviceKind::Software,
        }
    }

    fn pipelines_created(&self) -> u64 {
        self.runner.gpu.pipelines_created()
    }
}
