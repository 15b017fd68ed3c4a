//! Engines on a GPU: what a scene is made of there ([`OnDevice`]), and the limits that it keeps.
//! Pictures are made in [`super::passes`].
//!
//! No invocation runs loops for more than a device can
//! ([`GpuEngine::most_iterations`]): the stages that need more are resumed, and a scene that is too
//! long for that is refused before anything runs.

use super::kernels::Kernels;
use super::rate::Rate;
use super::tiles::{TileBuffers, Tiles};
use super::{Engine, EngineError, EngineKind, Loaded, Sample, query, warm};
use crate::frame::{
    CellStats, FieldFacts, Frame, Mode, Picture, Progress, RenderSettings, Samples, Surface,
    prepare,
};
use crate::gpu::{Arithmetic, Binding, Buffer, DeviceKind, Gpu};
use crate::settings::{facts, unpainted};
use sdfc_shaders::assemble::SceneFunction;
use sdfc_shaders::features::MOST_LIGHTS;
use sdfc_shaders::layout;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::program::Module;
use std::time::Duration;

/// The most rounds that all loops of an invocation may run together on a software device: these
/// end loops silently after 65,535.
const MOST_ITERATIONS_SOFTWARE: usize = 65_000;
/// The same on hardware, which has no such limit but must come to an end.
const MOST_ITERATIONS_HARDWARE: usize = 1 << 24;
/// How long a wait for a software device may take besides the time its compiler takes, which is
/// spent in the first dispatch.
const SOFTWARE_TIMEOUT: Duration = Duration::from_secs(60);
/// How long compilers may take for a kilobyte of text.
const COMPILING: Duration = Duration::from_millis(500);

/// WGSL that scene functions are declared in.
#[derive(Clone, Debug, Default)]
pub(super) struct SceneText {
    /// The functions and all they need, the buffers they read included, except the prelude and the
    /// struct `Surface`.
    pub(super) text: String,
    /// The functions of the prelude that it calls.
    pub(super) calls: Vec<&'static str>,
}

/// What the kernels of an engine are made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// What a scene and a picture need, and nothing else.
    Special,
    /// All scenes and pictures, as far as an engine can.
    General,
}

/// A scene on a device: what its functions are, and the buffers they read.
pub(super) trait OnDevice: Sized {
    /// The engine that runs it.
    const KIND: EngineKind;
    /// Brings a scene there; `before` is the one whose place it takes.
    fn load(
        gpu: &Gpu,
        scene: &Loaded<'_>,
        form: Form,
        before: Option<Self>,
    ) -> Result<Self, EngineError>;
    /// A scene of nothing in the general form, with all made that scenes need besides the kernels of
    /// their pictures; `before` is the one whose place it takes. `None` where there is no such form.
    fn nothing(_gpu: &Gpu, _before: Option<Self>) -> Result<Option<Self>, EngineError> {
        Ok(None)
    }
    /// Whether its functions are those of all scenes: [`OnDevice::variant`] is then
    /// [`super::kernels::GENERAL`].
    fn is_general(&self) -> bool {
        false
    }
    /// Writes the numbers of new parameters.
    fn update(&mut self, gpu: &Gpu, module: &Module, outputs: &[f64]) -> Result<(), EngineError>;
    /// Makes ready for a picture, or for a query where there is none; whether the buffers are
    /// others now. The programs' constants are those of the last load or update.
    fn prepare(&mut self, _gpu: &Gpu, _picture: Option<&Picture>) -> Result<bool, EngineError> {
        Ok(false)
    }
    /// A number that is another whenever [`OnDevice::source`] or the bindings are.
    fn variant(&self) -> u32 {
        0
    }
    /// These functions and what they need.
    fn source(&self, functions: &[SceneFunction]) -> SceneText;
    /// The buffers that [`OnDevice::source`] declares.
    fn buffers(&self) -> &[(Binding, Buffer)];
    /// What came of cutting cells for the last picture.
    fn cells(&mut self, _gpu: &Gpu) -> Result<CellStats, EngineError> {
        Ok(CellStats::default())
    }
    /// How many rounds of a loop an evaluation takes.
    fn iterations(&self, function: SceneFunction) -> usize;
}

/// `unpainted_surface`, where a kernel with these functions can call it: the material that the
/// frame's uniforms hold.
pub(super) fn unpainted_surface(functions: &[SceneFunction]) -> &'static str {
    if functions.contains(&SceneFunction::Surface) {
        UNPAINTED_SURFACE
    } else {
        ""
    }
}

const UNPAINTED_SURFACE: &str = "fn unpainted_surface() -> Surface {
    return Surface(
        frame.albedo, frame.roughness, frame.emission, frame.metallic, vec3f(0.0), frame.id
    );
}

";

/// An engine on a GPU.
pub(super) struct GpuEngine<S> {
    pub(super) gpu: Gpu,
    form: Form,
    pub(super) scene: Option<Scene<S>>,
    pub(super) kernels: Kernels,
    pub(super) rate: Rate,
    pub(super) buffers: TileBuffers,
}

/// A loaded scene and what is known of it here.
pub(super) struct Scene<S> {
    pub(super) on_device: S,
    pub(super) facts: FieldFacts,
    pub(super) unpainted: Surface,
    /// Whether it has a program of surfaces.
    pub(super) painted: bool,
}

impl<S: OnDevice> GpuEngine<S> {
    pub(super) fn new(gpu: Gpu, form: Form) -> Self {
        Self {
            gpu,
            form,
            scene: None,
            kernels: Kernels::default(),
            rate: Rate::default(),
            buffers: TileBuffers::default(),
        }
    }

    /// Lets the scene make ready; `None` is a query.
    pub(super) fn prepare(&mut self, picture: Option<&Picture>) -> Result<(), EngineError> {
        let scene = self.scene.as_mut().ok_or(EngineError::NothingLoaded)?;
        if scene.on_device.prepare(&self.gpu, picture)? {
            self.buffers.generation += 1;
        }
        Ok(())
    }

    /// Makes another scene's place; its text is so many kilobytes long.
    fn make_place(&mut self, kilobytes: u32) -> Option<S> {
        self.kernels.forget_scene();
        self.buffers.generation += 1;
        self.rate = Rate::default();
        let waiting = match self.gpu.info().kind {
            DeviceKind::Software => SOFTWARE_TIMEOUT,
            _ => Gpu::DEFAULT_TIMEOUT,
        };
        // Whoever made it shorter wants it so.
        if self.gpu.timeout >= Gpu::DEFAULT_TIMEOUT {
            self.gpu.timeout = waiting + COMPILING * kilobytes;
        }
        self.scene.take().map(|scene| scene.on_device)
    }

    /// The picture that settings ask for.
    fn picture(&self, settings: &RenderSettings) -> Result<Picture, EngineError> {
        let scene = self.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
        let mut picture = prepare(settings, &scene.facts);
        let surface = scene.unpainted;
        picture.uniforms = layout::Frame {
            albedo: surface.albedo,
            roughness: surface.roughness,
            emission: surface.emission,
            metallic: surface.metallic,
            id: surface.id,
            ..picture.uniforms
        };
        if scene.on_device.is_general() && picture.lights.len() <= MOST_LIGHTS {
            picture.features.general = true;
            // Without any, the program of surfaces leaves everything unpainted.
            picture.features.materials = true;
        }
        Ok(picture)
    }

    /// Fails if an invocation that evaluates the scene `times` times would run loops for too long.
    pub(super) fn fits(
        &self,
        function: SceneFunction,
        times: u32,
        what: &'static str,
    ) -> Result<(), EngineError> {
        let scene = self.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
        let need = scene.on_device.iterations(function);
        // One round more for each evaluation: that of the loop around it.
        let allowed = self.most_iterations() / times.max(1) as usize - 1;
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

    /// The most evaluations of the distance that an invocation may do.
    pub(super) fn most_evaluations(&self, scene: &S) -> u32 {
        (self.most_iterations() / (scene.iterations(SceneFunction::Distance) + 1)).max(1) as u32
    }

    /// The most rounds that all loops of an invocation may run together.
    fn most_iterations(&self) -> usize {
        match self.gpu.info().kind {
            DeviceKind::Software => MOST_ITERATIONS_SOFTWARE,
            _ => MOST_ITERATIONS_HARDWARE,
        }
    }
}

impl<S: OnDevice> Engine for GpuEngine<S> {
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

    fn load(&mut self, scene: &Loaded<'_>) -> Result<(), EngineError> {
        let before = self.make_place(scene.generated.text.len().div_ceil(1024) as u32);
        let on_device = S::load(&self.gpu, scene, self.form, before)?;
        self.scene = Some(Scene {
            on_device,
            facts: facts(scene.module, scene.outputs),
            unpainted: unpainted(scene.module, scene.outputs),
            painted: scene.module.surface.is_some(),
        });
        self.fits(SceneFunction::Distance, 1, "one evaluation")
    }

    fn update(&mut self, module: &Module, outputs: &[f64]) -> Result<(), EngineError> {
        let scene = self.scene.as_mut().ok_or(EngineError::NothingLoaded)?;
        scene.on_device.update(&self.gpu, module, outputs)?;
        scene.facts = facts(module, outputs);
        scene.unpainted = unpainted(module, outputs);
        Ok(())
    }

    fn figure(
        &mut self,
        settings: &RenderSettings,
        band: f32,
    ) -> Result<Option<Vec<f32>>, EngineError> {
        let Some(plane) = super::plane(settings) else {
            return Ok(None);
        };
        let settings = RenderSettings {
            mode: Mode::Mask,
            plane: true,
            aa: 1,
            ..settings.clone()
        };
        let picture = Picture {
            band: Some(band),
            ..self.picture(&settings)?
        };
        self.prepare(Some(&picture))?;
        let plan = self.plan(&picture)?;
        let [width, height] = plane.size;
        let mut values = vec![0.0; width * height];
        let mut tiles = Tiles::of(picture.size);
        while let Some(tile) = tiles.next(plan.largest.min(self.rate.pixels(plan.weight))) {
            self.values(&plan, &picture, tile, &mut values)?;
        }
        Ok(Some(values))
    }

    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn Progress,
    ) -> Result<Frame, EngineError> {
        let picture = self.picture(settings)?;
        let (passes, mut frame) = samples.begin(&picture);
        if passes.is_empty() {
            return Ok(frame);
        }
        self.prepare(Some(&picture))?;
        let plan = self.plan(&picture)?;
        let [width, height] = picture.size;
        let total = u64::from(width) * u64::from(height);
        let mut tiles = Tiles::of(picture.size);
        let mut done = 0;
        while let Some(tile) = tiles.next(plan.largest.min(self.rate.pixels(plan.weight))) {
            self.tile(&plan, &picture, tile, passes.clone(), &mut frame)?;
            done += tile.pixels();
            if progress.is_at(done as f32 / total as f32).is_break() {
                return Err(EngineError::Stopped);
            }
        }
        if let Some(scene) = &mut self.scene {
            frame.stats.cells = scene.on_device.cells(&self.gpu)?;
        }
        Ok(frame)
    }

    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<Sample>, EngineError> {
        query::query(self, points)
    }

    fn warm_up(&mut self, modes: &[Mode]) -> Result<(), EngineError> {
        if self.form == Form::Special {
            return Ok(());
        }
        let before = self.make_place(0);
        let Some(on_device) = S::nothing(&self.gpu, before)? else {
            return Ok(());
        };
        self.scene = Some(Scene {
            on_device,
            facts: FieldFacts {
                raw: false,
                bounds: Bounds::EVERYTHING,
                material: None,
            },
            unpainted: Surface::default(),
            painted: true,
        });
        for settings in modes.iter().flat_map(|&mode| warm::pictures(mode)) {
            self.render(&settings, &|_| {})?;
        }
        self.query(&[[0.0; 3]])?;
        Ok(())
    }

    fn heeds_guards(&self) -> bool {
        match S::KIND {
            // Tapes have no guards.
            EngineKind::Interp => self.form == Form::Special,
            _ => self.gpu.info().kind != DeviceKind::Software,
        }
    }

    fn pipelines_created(&self) -> u64 {
        self.gpu.pipelines_created()
    }
}
