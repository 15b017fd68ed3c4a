//! Engines on a GPU: the representation of a scene on a device ([`GpuScene`]), and the limits of devices.
//! Images are rendered in [`super::gpu_render`].
//!
//! No invocation runs loops for longer than a device allows ([`GpuEngine::max_iterations`]). Stages that need
//! more are resumed. A scene whose single evaluation is too long is refused before anything runs.

use super::kernels::{Kernels, SceneWgsl};
use super::tiles::{TileBuffers, TileQueue};
use super::work_budget::WorkBudget;
use super::{Engine, EngineError, EngineKind, FieldSample, SceneInput, query, warm_up};
use crate::gpu::{Arithmetic, Buffer, BufferBinding, DeviceKind, Gpu};
use crate::render::{
    CellStats, FieldFacts, Image, Mode, RenderJob, RenderProgress, RenderSettings, Samples,
    Surface, prepare,
};
use crate::settings::{default_material, field_facts};
use sdfc_shaders::assemble::SceneFunction;
use sdfc_shaders::features::MAX_GENERIC_LIGHTS;
use sdfc_shaders::layout;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::program::Module;
use std::time::Duration;

/// Maximum number of iterations of all loops of an invocation on a software device. These devices end loops
/// silently after 65,535.
const MAX_ITERATIONS_SOFTWARE: usize = 65_000;
/// Maximum on hardware, which has no such limit but must terminate.
const MAX_ITERATIONS_HARDWARE: usize = 1 << 24;
/// Maximum wait for a software device, besides the time of its compiler, which runs in the first dispatch.
const SOFTWARE_TIMEOUT: Duration = Duration::from_secs(60);
/// Allowance for compiling one kilobyte of source.
const COMPILE_TIME_PER_KILOBYTE: Duration = Duration::from_millis(500);

/// The range of scenes that the kernels of an engine support.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KernelMode {
    /// One scene and one image: kernels contain only what these need.
    Specialized,
    /// All scenes and images, within the limits of the engine.
    Generic,
}

/// A scene on a device: its WGSL functions and the buffers they read.
pub(super) trait GpuScene: Sized {
    /// The engine that runs it.
    const KIND: EngineKind;
    /// Uploads a scene; `previous` is the scene that it replaces.
    fn load(
        gpu: &Gpu,
        scene: &SceneInput<'_>,
        kernel_mode: KernelMode,
        previous: Option<Self>,
    ) -> Result<Self, EngineError>;
    /// Uploads an empty scene in generic mode and creates all that scenes need, except the kernels of their
    /// images. `previous` is the scene that it replaces. Returns `None` where there is no generic mode.
    fn empty_generic(_gpu: &Gpu, _previous: Option<Self>) -> Result<Option<Self>, EngineError> {
        Ok(None)
    }
    /// Reports whether its functions are those of all scenes. [`GpuScene::variant`] is then
    /// [`super::kernels::GENERIC_VARIANT`].
    fn is_generic(&self) -> bool {
        false
    }
    /// Writes the numbers of new parameters.
    fn update(&mut self, gpu: &Gpu, module: &Module, outputs: &[f64]) -> Result<(), EngineError>;
    /// Prepares a render, or a query if there is no job. Reports whether buffers were replaced. The constants
    /// are those of the last load or update.
    fn prepare(&mut self, _gpu: &Gpu, _picture: Option<&RenderJob>) -> Result<bool, EngineError> {
        Ok(false)
    }
    /// A number that changes whenever [`GpuScene::source`] or the bindings change.
    fn variant(&self) -> u32 {
        0
    }
    /// WGSL of these functions and of all they need.
    fn source(&self, functions: &[SceneFunction]) -> SceneWgsl;
    /// The buffers declared by [`GpuScene::source`].
    fn buffers(&self) -> &[(BufferBinding, Buffer)];
    /// Counts of the cells cut for the last image.
    fn cells(&mut self, _gpu: &Gpu) -> Result<CellStats, EngineError> {
        Ok(CellStats::default())
    }
    /// Number of loop iterations of one evaluation.
    fn iterations(&self, function: SceneFunction) -> usize;
}

/// WGSL of `unpainted_surface` for kernels whose functions can call it: the material in the frame uniforms.
pub(super) fn default_material_wgsl(functions: &[SceneFunction]) -> &'static str {
    if functions.contains(&SceneFunction::Surface) {
        DEFAULT_MATERIAL_WGSL
    } else {
        ""
    }
}

const DEFAULT_MATERIAL_WGSL: &str = "fn unpainted_surface() -> Surface {
    return Surface(
        frame.albedo, frame.roughness, frame.emission, frame.metallic, vec3f(0.0), frame.id
    );
}

";

/// An engine on a GPU.
pub(super) struct GpuEngine<S> {
    pub(super) gpu: Gpu,
    kernel_mode: KernelMode,
    pub(super) scene: Option<DeviceScene<S>>,
    pub(super) kernels: Kernels,
    pub(super) budget: WorkBudget,
    pub(super) buffers: TileBuffers,
}

/// A loaded scene and the facts about it that do not depend on the engine.
pub(super) struct DeviceScene<S> {
    pub(super) gpu_scene: S,
    pub(super) facts: FieldFacts,
    pub(super) default_material: Surface,
    /// Set if it has a surface program.
    pub(super) has_surface_program: bool,
}

impl<S: GpuScene> GpuEngine<S> {
    pub(super) fn new(gpu: Gpu, kernel_mode: KernelMode) -> Self {
        Self {
            gpu,
            kernel_mode,
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
    fn begin_replace(&mut self, kilobytes: u32) -> Option<S> {
        self.kernels.drop_scene_kernels();
        self.buffers.generation += 1;
        self.budget = WorkBudget::default();
        let wait_limit = match self.gpu.info().kind {
            DeviceKind::Software => SOFTWARE_TIMEOUT,
            _ => Gpu::DEFAULT_TIMEOUT,
        };
        // Respect a timeout that the caller shortened.
        if self.gpu.timeout >= Gpu::DEFAULT_TIMEOUT {
            self.gpu.timeout = wait_limit + COMPILE_TIME_PER_KILOBYTE * kilobytes;
        }
        self.scene.take().map(|scene| scene.gpu_scene)
    }

    /// The render job for these settings.
    fn job(&self, settings: &RenderSettings) -> Result<RenderJob, EngineError> {
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

    /// Maximum number of evaluations of the distance in one invocation.
    pub(super) fn max_evaluations(&self, scene: &S) -> u32 {
        (self.max_iterations() / (scene.iterations(SceneFunction::Distance) + 1)).max(1) as u32
    }

    /// Maximum number of iterations of all loops of an invocation.
    fn max_iterations(&self) -> usize {
        match self.gpu.info().kind {
            DeviceKind::Software => MAX_ITERATIONS_SOFTWARE,
            _ => MAX_ITERATIONS_HARDWARE,
        }
    }
}

impl<S: GpuScene> Engine for GpuEngine<S> {
    fn kind(&self) -> EngineKind {
        S::KIND
    }

    fn device(&self) -> String {
        let info = self.gpu.info();
        let arithmetic = match self.gpu.arithmetic() {
            Arithmetic::Default => "",
            Arithmetic::Strict => ", strict",
            Arithmetic::Portable => ", strict by barriers",
        };
        let (name, kind, backend) = (&info.name, info.kind.name(), &info.backend);
        format!("{name} ({kind}, {backend}{arithmetic})")
    }

    fn load(&mut self, scene: &SceneInput<'_>) -> Result<(), EngineError> {
        let previous = self.begin_replace(scene.generated.text.len().div_ceil(1024) as u32);
        let gpu_scene = S::load(&self.gpu, scene, self.kernel_mode, previous)?;
        self.scene = Some(DeviceScene {
            gpu_scene,
            facts: field_facts(scene.module, scene.outputs),
            default_material: default_material(scene.module, scene.outputs),
            has_surface_program: scene.module.surface.is_some(),
        });
        self.check_loop_limit(SceneFunction::Distance, 1, "one evaluation")
    }

    fn update(&mut self, module: &Module, outputs: &[f64]) -> Result<(), EngineError> {
        let scene = self.scene.as_mut().ok_or(EngineError::NothingLoaded)?;
        scene.gpu_scene.update(&self.gpu, module, outputs)?;
        scene.facts = field_facts(module, outputs);
        scene.default_material = default_material(module, outputs);
        Ok(())
    }

    fn sample_plane(
        &mut self,
        settings: &RenderSettings,
        band: f32,
    ) -> Result<Option<Vec<f32>>, EngineError> {
        let Some(plane) = super::plane_of(settings) else {
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
            ..self.job(&settings)?
        };
        self.prepare(Some(&job))?;
        let plan = self.plan(&job)?;
        let [width, height] = plane.size;
        let mut values = vec![0.0; width * height];
        let mut tiles = TileQueue::new(job.size);
        while let Some(tile) = tiles.next(
            plan.max_tile_pixels
                .min(self.budget.tile_pixels(plan.weight)),
        ) {
            self.sample_plane_tile(&plan, &job, tile, &mut values)?;
        }
        Ok(Some(values))
    }

    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn RenderProgress,
    ) -> Result<Image, EngineError> {
        let job = self.job(settings)?;
        let (passes, mut image) = samples.passes(&job);
        if passes.is_empty() {
            return Ok(image);
        }
        self.prepare(Some(&job))?;
        let plan = self.plan(&job)?;
        let [width, height] = job.size;
        let total = u64::from(width) * u64::from(height);
        let mut tiles = TileQueue::new(job.size);
        let mut done = 0;
        while let Some(tile) = tiles.next(
            plan.max_tile_pixels
                .min(self.budget.tile_pixels(plan.weight)),
        ) {
            self.render_tile(&plan, &job, tile, passes.clone(), &mut image)?;
            done += tile.pixels();
            if progress.report(done as f32 / total as f32).is_break() {
                return Err(EngineError::Stopped);
            }
        }
        if let Some(scene) = &mut self.scene {
            image.stats.cells = scene.gpu_scene.cells(&self.gpu)?;
        }
        Ok(image)
    }

    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<FieldSample>, EngineError> {
        query::query(self, points)
    }

    fn warm_up(&mut self, modes: &[Mode]) -> Result<(), EngineError> {
        if self.kernel_mode == KernelMode::Specialized {
            return Ok(());
        }
        let previous = self.begin_replace(0);
        let Some(gpu_scene) = S::empty_generic(&self.gpu, previous)? else {
            return Ok(());
        };
        self.scene = Some(DeviceScene {
            gpu_scene,
            facts: FieldFacts {
                is_raw: false,
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
            _ => self.gpu.info().kind != DeviceKind::Software,
        }
    }

    fn pipelines_created(&self) -> u64 {
        self.gpu.pipelines_created()
    }
}
