//! Engines: the ways to run a scene, behind one trait.
//!
//! [`EngineKind::Cpu`] runs the program on 64 points at a time on all cores; [`EngineKind::Interp`]
//! runs the same words in a kernel on a GPU; [`EngineKind::Wgsl`] runs the generated source there.
//! [`EngineKind::Reference`] proves where rays end, slowly; the others are measured by it.
//! All of them make a picture in the same stages, so that pictures can be compared pixel by pixel
//! ([`crate::verify`]). Adding an engine is an implementation of [`Engine`] and a line in [`open`].

mod auto;
mod cpu;
mod cut;
mod cutter;
mod driver;
mod interp;
mod kernels;
mod order;
mod passes;
mod query;
mod rate;
mod reference;
mod tiles;
mod warm;
mod wgsl;
mod worth;

use crate::cells::Part;
use crate::cpu::figure::Plane;
use crate::cpu::{Geometry, face_on};
use crate::frame::{FieldFacts, Frame, Mode, Progress, RenderSettings, Samples, prepare};
use crate::gpu::{Arithmetic, Gpu, GpuError, Preference};
use sdfc_shaders::assemble::SceneSource;
use sdfc_shaders::layout::Surface;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::program::Module;
use std::fmt;
use std::str::FromStr;

pub use auto::{open_auto, open_auto_with, with_fallback};
use driver::{Form, GpuEngine};

/// The ways to run a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineKind {
    /// The program on batches of 64 points, on all cores.
    Cpu,
    /// The program in an interpreter on a GPU: a change is a write to a buffer.
    Interp,
    /// Source generated for the scene, on a GPU.
    Wgsl,
    /// Intervals of `f64`, by which the errors of the others are measured ([`crate::reference`]).
    Reference,
}

impl EngineKind {
    /// The kinds that pictures are made with, and that are compared with each other.
    pub const FAST: [Self; 3] = [Self::Cpu, Self::Interp, Self::Wgsl];
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Cpu, Self::Interp, Self::Wgsl, Self::Reference];

    /// The name: `cpu`, `interp`, `wgsl` or `reference`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Interp => "interp",
            Self::Wgsl => "wgsl",
            Self::Reference => "reference",
        }
    }
}

impl fmt::Display for EngineKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that no engine has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no engine `{0}`, only cpu, interp, wgsl and reference")]
pub struct UnknownEngine(pub String);

impl FromStr for EngineKind {
    type Err = UnknownEngine;
    fn from_str(name: &str) -> Result<Self, UnknownEngine> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| UnknownEngine(name.to_owned()))
    }
}

/// A scene as engines take it.
#[derive(Clone, Copy, Debug)]
pub struct Loaded<'a> {
    /// The programs, with the constants of the present parameters and time.
    pub module: &'a Module,
    /// The results of the uniform program, as [`Module::update`] gives them.
    pub outputs: &'a [f64],
    /// The generated source: `scene_distance`, `scene_gradient` and, if the module has a program of
    /// surfaces, `scene_surface`, with the operations they call; they read `uniforms` and may call
    /// `unpainted_surface`, which engines declare. Only `wgsl` reads it; for the others it may be
    /// empty.
    pub generated: SceneSource<'a>,
}

/// What a scene is at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// The distance to the surface, negative inside.
    pub distance: f32,
    /// How it changes along the axes.
    pub gradient: [f32; 3],
    /// The material, for the surface nearest to the point.
    pub surface: Surface,
}

/// A way to run a scene.
pub trait Engine {
    /// Which of the ways it is.
    fn kind(&self) -> EngineKind;

    /// What it runs on, for people.
    fn device(&self) -> String;

    /// Takes a new scene. On a GPU this may compile kernels, now or at the next picture.
    fn load(&mut self, scene: &Loaded<'_>) -> Result<(), EngineError>;

    /// Takes new parameters or a new time for the scene that is loaded: `module` is that scene
    /// after [`Module::update`], which gave `outputs`. Only numbers are written; no program
    /// changes, and no pipeline is made.
    fn update(&mut self, module: &Module, outputs: &[f64]) -> Result<(), EngineError>;

    /// Where the surface is at each pixel and which way it faces, without light or colours: for
    /// tools that want no picture.
    fn geometry(&mut self, settings: &RenderSettings) -> Result<Geometry, EngineError> {
        let settings = RenderSettings {
            mode: Mode::Normal,
            aa: 1,
            ..settings.clone()
        };
        let frame = self.render(&settings, &|_| {})?;
        Ok(Geometry {
            depth: frame.depth,
            normal: frame.normal,
        })
    }

    /// The field at each pixel of a plane figure that is seen face on, row after row, negative
    /// inside; `None` where the view is another. What is `band` or farther from zero may be any
    /// number that far from zero, of its sign.
    fn figure(
        &mut self,
        settings: &RenderSettings,
        _band: f32,
    ) -> Result<Option<Vec<f32>>, EngineError> {
        let Some(plane) = plane(settings) else {
            return Ok(None);
        };
        let samples = self.query(&plane.points())?;
        let distances = samples.into_iter().map(|sample| sample.distance);
        Ok(Some(distances.collect()))
    }

    /// Makes a picture, unless `progress` stops it.
    ///
    /// # Errors
    ///
    /// [`EngineError::Stopped`] where it was stopped.
    fn render(
        &mut self,
        settings: &RenderSettings,
        progress: &dyn Progress,
    ) -> Result<Frame, EngineError> {
        self.render_samples(settings, Samples::All, progress)
    }

    /// Makes some samples of a picture, unless `progress` stops it.
    ///
    /// # Errors
    ///
    /// [`EngineError::Stopped`] where it was stopped.
    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn Progress,
    ) -> Result<Frame, EngineError>;

    /// What the scene is at each of the points.
    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<Sample>, EngineError>;

    /// Which part of space each of the points lies in, as it is cut into cells for a picture, and how
    /// long the program is there; nothing for points outside of all cells. `None` where the picture is
    /// made without cells, or none that could be asked: those of devices stay there, and figures have
    /// theirs for a moment only.
    fn cells_at(
        &mut self,
        _settings: &RenderSettings,
        _points: &[[f32; 3]],
    ) -> Result<Option<Vec<Option<Part>>>, EngineError> {
        Ok(None)
    }

    /// Whether guards in programs gain anything here: not where cells skip more, nor where a device
    /// runs both sides of a branch and takes longer to compile it.
    fn heeds_guards(&self) -> bool {
        true
    }

    /// Makes beforehand what pictures in these modes need of [`general`] engines, their queries
    /// included, and lets the driver compile it, so that no scene waits for that later. It may be called
    /// for one mode after the other. No scene of the caller's is loaded afterwards. For other engines
    /// there is nothing to be made, and nothing is changed.
    fn warm_up(&mut self, _modes: &[Mode]) -> Result<(), EngineError> {
        Ok(())
    }

    /// How many GPU pipelines were compiled so far.
    fn pipelines_created(&self) -> u64 {
        0
    }
}

/// The plane that a figure's picture shows.
fn plane(settings: &RenderSettings) -> Option<Plane> {
    let nothing_known = FieldFacts {
        raw: false,
        bounds: Bounds::EVERYTHING,
        material: None,
    };
    let settings = RenderSettings {
        aa: 1,
        ..settings.clone()
    };
    face_on(&prepare(&settings, &nothing_known))
}

/// Why an engine could not do what it was asked for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EngineError {
    /// The device failed, or there is none.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The scene is too long for the engine.
    #[error(
        "the program has {need} instructions, at most {allowed} are allowed on engine {kind} for {what}"
    )]
    TooLong {
        /// Which engine.
        kind: EngineKind,
        /// What it was to do.
        what: &'static str,
        /// How many instructions there are.
        need: usize,
        /// How many there may be.
        allowed: usize,
    },
    /// Whoever followed it stopped it.
    #[error("the picture was stopped")]
    Stopped,
    /// Nothing was loaded yet.
    #[error("no scene is loaded")]
    NothingLoaded,
    /// The module of an update is not that of the scene that is loaded.
    #[error("the new parameters belong to another scene than the one that is loaded")]
    AnotherScene,
}

impl EngineError {
    /// Whether there is no device to run on, rather than something wrong with the scene.
    pub fn is_environment(&self) -> bool {
        matches!(
            self,
            Self::Gpu(
                GpuError::NoAdapter
                    | GpuError::OnlySoftware { .. }
                    | GpuError::DeviceRequest { .. }
                    | GpuError::Inexact { .. }
            )
        )
    }
}

/// Opens an engine; one for GPUs takes hardware if there is any, else software Vulkan.
pub fn open(kind: EngineKind) -> Result<Box<dyn Engine>, EngineError> {
    open_with(kind, Arithmetic::Default)
}

/// Opens an engine whose arithmetic is strict or not: engines that are strict give the same bits.
/// The CPU always is.
pub fn open_with(kind: EngineKind, arithmetic: Arithmetic) -> Result<Box<dyn Engine>, EngineError> {
    Ok(match kind {
        EngineKind::Cpu => Box::new(cpu::CpuEngine::default()),
        EngineKind::Reference => Box::new(reference::ReferenceEngine::default()),
        EngineKind::Interp | EngineKind::Wgsl => {
            on(kind, Gpu::open_with(Preference::Any, arithmetic)?)
        }
    })
}

/// The interpreter on a device in hand with kernels that run every scene: whatever is loaded after
/// [`Engine::warm_up`] and whatever of a picture in those modes is changed (lights and their shadows,
/// occlusion, fog, materials, normals), no pipeline is made. The pictures are those of
/// [`EngineKind::Interp`], whose kernels have only what a scene needs.
///
/// Hardware skips the operations that a scene does not have; software Vulkan runs all of them at each
/// instruction and is many times slower. Kernels have room for 32 values and 8 points at once in a
/// scene's tape (materials: 16 values) and for [`sdfc_shaders::features::MOST_LIGHTS`] lights; a scene
/// with more gets kernels of its own.
pub fn general(gpu: Gpu) -> Box<dyn Engine> {
    Box::new(GpuEngine::<interp::Interpreter>::new(gpu, Form::General))
}

/// An engine of this kind on a device in hand; those on the CPU need none.
pub fn on(kind: EngineKind, gpu: Gpu) -> Box<dyn Engine> {
    match kind {
        EngineKind::Cpu => Box::new(cpu::CpuEngine::default()),
        EngineKind::Reference => Box::new(reference::ReferenceEngine::default()),
        EngineKind::Interp => Box::new(GpuEngine::<interp::Interpreter>::new(gpu, Form::Special)),
        EngineKind::Wgsl => Box::new(GpuEngine::<wgsl::Generated>::new(gpu, Form::Special)),
    }
}
