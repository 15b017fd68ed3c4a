//! A scene loaded on a device, with all that is kept from one render or query to the next: kernels, buffers
//! and the measured speed.
//!
//! No invocation runs loops for longer than a device allows ([`SceneRunner::max_iterations`]). Stages that need
//! more are resumed.

use super::driver::{DeviceKind, Gpu};
use super::kernel_cache::Kernels;
use super::scene::GpuScene;
use super::tiles::TileBuffers;
use super::work_budget::WorkBudget;
use crate::engine::EngineError;
use crate::render::{FieldFacts, RenderJob, RenderSettings, Surface, prepare};
use sdfc_shaders::assemble::SceneFunction;
use sdfc_shaders::features::MAX_GENERIC_LIGHTS;
use sdfc_shaders::layout;
use std::time::Duration;

/// Maximum number of iterations of all loops of an invocation on a software device. These devices end loops
/// silently after 65,535.
const MAX_ITERATIONS_SOFTWARE: usize = 65_000;
/// Maximum on hardware, which has no such limit but must terminate.
const MAX_ITERATIONS_HARDWARE: usize = 1 << 24;
/// Maximum wait for a software device, besides the time of its compiler, which runs in the first dispatch.
const MAX_SOFTWARE_WAIT: Duration = Duration::from_secs(60);
/// Allowance for compiling one kilobyte of source.
const COMPILE_TIME_PER_KILOBYTE: Duration = Duration::from_millis(500);

/// A loaded scene and the facts about it that do not depend on the engine.
pub(super) struct DeviceScene<S> {
    pub(super) gpu_scene: S,
    pub(super) facts: FieldFacts,
    pub(super) default_material: Surface,
    /// Set if it has a surface program.
    pub(super) has_surface_program: bool,
}

/// A device with its loaded scene.
pub(super) struct SceneRunner<S> {
    pub(super) gpu: Gpu,
    pub(super) scene: Option<DeviceScene<S>>,
    pub(super) kernels: Kernels,
    pub(super) budget: WorkBudget,
    pub(super) buffers: TileBuffers,
}

impl<S: GpuScene> SceneRunner<S> {
    pub(super) fn new(gpu: Gpu) -> Self {
        Self {
            gpu,
            scene: None,
            kernels: Kernels::default(),
            budget: WorkBudget::default(),
            buffers: TileBuffers::default(),
        }
    }

    /// Prepares the scene for a render; `None` is a query.
    pub(super) fn prepare(&mut self, job: Option<&RenderJob>) -> Result<(), EngineError> {
        let scene = self.scene.as_mut().ok_or(EngineError::NothingLoaded)?;
        if scene.gpu_scene.prepare(&self.gpu, job)? {
            self.buffers.generation += 1;
        }
        Ok(())
    }

    /// Removes the current scene and returns it. The source of the next one has this many kilobytes.
    pub(super) fn begin_replace(&mut self, kilobytes: u32) -> Option<S> {
        self.kernels.drop_scene_kernels();
        self.buffers.generation += 1;
        self.budget = WorkBudget::default();
        let wait_limit = match self.gpu.info().kind {
            DeviceKind::Software => MAX_SOFTWARE_WAIT,
            _ => Gpu::DEFAULT_TIMEOUT,
        };
        // Respect a timeout that the caller shortened.
        if self.gpu.timeout >= Gpu::DEFAULT_TIMEOUT {
            self.gpu.timeout = wait_limit + COMPILE_TIME_PER_KILOBYTE * kilobytes;
        }
        self.scene.take().map(|scene| scene.gpu_scene)
    }

    /// Returns the render job for these settings.
    pub(super) fn job(&self, settings: &RenderSettings) -> Result<RenderJob, EngineError> {
        let scene = self.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
        let mut job = prepare(settings, &scene.facts);
        let surface = scene.default_material;
        job.uniforms = layout::FrameUniforms {
            albedo: surface.albedo,
            roughness: surface.roughness,
            emission: surface.emission,
            metallic: surface.metallic,
            id: surface.id,
            ..job.uniforms
        };
        if scene.gpu_scene.is_generic() && job.lights.len() <= MAX_GENERIC_LIGHTS {
            job.features.generic = true;
            // Without one, the surface program returns the default material everywhere.
            job.features.materials = true;
        }
        Ok(job)
    }

    /// Fails if an invocation that evaluates the scene `times` times exceeds the limit of loop iterations.
    pub(super) fn check_loop_limit(
        &self,
        function: SceneFunction,
        times: u32,
        what: &'static str,
    ) -> Result<(), EngineError> {
        let scene = self.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
        let need = scene.gpu_scene.iterations(function);
        // Each evaluation costs one more iteration: that of the loop around it.
        let allowed = self.max_iterations() / times.max(1) as usize - 1;
        if need <= allowed {
            return Ok(());
        }
        Err(EngineError::TooLong {
            kind: S::KIND,
            what,
            need,
            allowed,
        })
    }

    /// Returns the maximum number of evaluations of the distance in one invocation, at least 1.
    pub(super) fn max_evaluations(&self, scene: &S) -> u32 {
        (self.max_iterations() / (scene.iterations(SceneFunction::Distance) + 1)).max(1) as u32
    }

    /// Returns the maximum number of iterations of all loops of an invocation.
    fn max_iterations(&self) -> usize {
        match self.gpu.info().kind {
            DeviceKind::Software => MAX_ITERATIONS_SOFTWARE,
            _ => MAX_ITERATIONS_HARDWARE,
        }
    }
}
