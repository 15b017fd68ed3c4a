//! Engines: implementations that render and sample a scene, behind one trait.
//!
//! [`EngineKind::Cpu`] runs the program on 64 points at a time on all cores. [`EngineKind::Interp`] runs the
//! same program in a kernel on a GPU. [`EngineKind::Wgsl`] runs WGSL generated for the scene on a GPU.
//! [`EngineKind::Reference`] proves where rays end. It is slow, and the errors of the others are measured
//! against it. All of them render in the same stages, so that images can be compared pixel by pixel
//! ([`crate::comparison`]). A new engine is an implementation of [`Engine`] and a variant of [`EngineKind`].

mod auto_select;
mod open;

use crate::cells::CellInfo;
use crate::gpu::GpuError;
use crate::render::plane::plane_of;
use crate::render::{Geometry, Image, Mode, RenderProgress, RenderSettings, Samples};
use sdfc_shaders::assemble::SceneSource;
use sdfc_shaders::layout::Surface;
use sdfc_vm::program::Module;
use std::fmt;
use std::str::FromStr;

pub use auto_select::{open_auto, open_auto_with, with_fallback};
pub use open::{open, open_generic, open_on, open_with};

/// The kinds of engines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineKind {
    /// The program on batches of 64 points, on all cores.
    Cpu,
    /// The program in an interpreter on a GPU: an edit is a write to a buffer.
    Interp,
    /// Source generated for the scene, on a GPU.
    Wgsl,
    /// Intervals of `f64`, against which the errors of the others are measured ([`crate::reference`]).
    Reference,
}

impl EngineKind {
    /// The kinds that render images in practice and are compared with each other.
    pub const FAST: [Self; 3] = [Self::Cpu, Self::Interp, Self::Wgsl];
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Cpu, Self::Interp, Self::Wgsl, Self::Reference];

    /// Returns the name: `cpu`, `interp`, `wgsl` or `reference`.
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

/// An engine name that does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no engine `{0}`, only cpu, interp, wgsl and reference")]
pub struct UnknownEngine(pub String);

impl FromStr for EngineKind {
    type Err = UnknownEngine;
    fn from_str(name: &str) -> Result<Self, UnknownEngine> {
        let kind = Self::ALL.into_iter().find(|kind| kind.name() == name);
        kind.ok_or_else(|| UnknownEngine(name.to_owned()))
    }
}

/// A scene to be loaded into an engine.
#[derive(Clone, Copy, Debug)]
pub struct SceneInput<'a> {
    /// The programs, with the constants of the current parameters and time.
    pub module: &'a Module,
    /// The results of the uniform program, as returned by [`Module::update`].
    pub uniform_values: &'a [f64],
    /// The generated source: `scene_distance`, `scene_gradient` and, if the module has a surface program,
    /// `scene_surface`, with the operations they call. They read `uniforms` and may call `unpainted_surface`;
    /// engines declare both. Only `wgsl` reads it; for the other engines it may be empty.
    pub generated: SceneSource<'a>,
}

/// Distance, gradient and material at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FieldSample {
    /// The distance to the surface, negative inside.
    pub distance: f32,
    /// The gradient of the distance.
    pub gradient: [f32; 3],
    /// The material of the surface nearest to the point.
    pub surface: Surface,
}

impl FieldSample {
    /// Creates a sample. Its zeros are positive: their signs are accidents of how an engine computes.
    pub fn new(distance: f32, gradient: [f32; 3], surface: Surface) -> Self {
        Self {
            distance: distance + 0.0,
            gradient: gradient.map(|v| v + 0.0),
            surface,
        }
    }
}

/// Renders and samples a loaded scene.
pub trait Engine {
    /// Returns the kind of the engine.
    fn kind(&self) -> EngineKind;

    /// Returns the name of the device, for display.
    fn device(&self) -> String;

    /// Loads a scene. On a GPU this may compile kernels, now or at the next render.
    fn load(&mut self, scene: &SceneInput<'_>) -> Result<(), EngineError>;

    /// Applies new parameters or a new time to the loaded scene: `module` is that scene after
    /// [`Module::update`], which returned `uniform_values`. Only numbers are written; no program changes, and no
    /// pipeline is created.
    fn update(&mut self, module: &Module, uniform_values: &[f64]) -> Result<(), EngineError>;

    /// Computes depth and normal of each pixel without light or colours, for tools that need no image.
    fn geometry(&mut self, settings: &RenderSettings) -> Result<Geometry, EngineError> {
        let settings = RenderSettings {
            mode: Mode::Normal,
            aa: 1,
            ..settings.clone()
        };
        let image = self.render(&settings, &|_| {})?;
        Ok(Geometry {
            depth: image.depth,
            normal: image.normal,
        })
    }

    /// Samples the field at each pixel of a 2-D shape seen face on, row by row, negative inside. Returns
    /// `None` for any other view. Where the absolute value is at least `exact_band`, any value of the same
    /// sign that is at least as far from zero is allowed.
    fn sample_plane(
        &mut self,
        settings: &RenderSettings,
        _exact_band: f32,
    ) -> Result<Option<Vec<f32>>, EngineError> {
        let Some(plane) = plane_of(settings) else {
            return Ok(None);
        };
        let samples = self.query(&plane.points())?;
        let distances = samples.into_iter().map(|sample| sample.distance);
        Ok(Some(distances.collect()))
    }

    /// Renders an image, unless `progress` stops it.
    ///
    /// # Errors
    ///
    /// [`EngineError::Stopped`] if it was stopped.
    fn render(
        &mut self,
        settings: &RenderSettings,
        progress: &dyn RenderProgress,
    ) -> Result<Image, EngineError> {
        self.render_samples(settings, Samples::All, progress)
    }

    /// Renders a subset of the samples of an image, unless `progress` stops it.
    ///
    /// # Errors
    ///
    /// [`EngineError::Stopped`] if it was stopped.
    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn RenderProgress,
    ) -> Result<Image, EngineError>;

    /// Evaluates the scene at each of the points.
    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<FieldSample>, EngineError>;

    /// Returns the cell that contains each point, with the length of the program there; `None` for points
    /// outside of all cells. The cells are those of a render with these settings. The whole result is `None`
    /// where rendering uses no cells, or none that can be read. Cells of devices stay on the device, and 2-D
    /// shapes have cells only while they are rendered.
    fn cells_at(
        &mut self,
        _settings: &RenderSettings,
        _points: &[[f32; 3]],
    ) -> Result<Option<Vec<Option<CellInfo>>>, EngineError> {
        Ok(None)
    }

    /// Reports whether guards in programs make this engine faster. They do not where cells skip more, nor
    /// where a device runs both sides of a branch and takes longer to compile it.
    fn benefits_from_guards(&self) -> bool {
        true
    }

    /// Creates everything that [`open_generic`] engines need to render in these modes and to answer queries.
    /// The driver compiles it now, so that no scene waits for it later. May be called several times, with one
    /// mode after the other. Afterwards no scene of the caller is loaded. Other engines do nothing.
    fn warm_up(&mut self, _modes: &[Mode]) -> Result<(), EngineError> {
        Ok(())
    }

    /// Returns the number of GPU pipelines compiled so far; 0 for engines on the CPU.
    fn pipelines_created(&self) -> u64 {
        0
    }
}

/// Reasons why an engine failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EngineError {
    /// The device failed, or there is none.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The scene is too long for the engine.
    #[error(
        "the program has {need} instructions, at most {allowed} are allowed on engine {kind} for its stage {what}: engine cpu \
         has no such limit"
    )]
    TooLong {
        /// The engine that rejects the scene.
        kind: EngineKind,
        /// The attempted task.
        what: &'static str,
        /// Number of instructions of the program.
        need: usize,
        /// Maximum number of instructions.
        allowed: usize,
    },
    /// The progress callback stopped it.
    #[error("the picture was stopped")]
    Stopped,
    /// No scene is loaded.
    #[error("no scene is loaded")]
    NothingLoaded,
    /// The module of an update does not belong to the loaded scene.
    #[error("the new parameters belong to another scene than the one that is loaded")]
    SceneMismatch,
}

impl EngineError {
    /// Reports whether the cause is a missing or unsuitable device, not the scene.
    pub fn is_device_unavailable(&self) -> bool {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_have_positive_zeros() {
        let sample = FieldSample::new(-0.0, [-0.0, 0.0, -1.0], Surface::default());
        assert_eq!(sample.distance.to_bits(), 0);
        assert_eq!(sample.gradient.map(f32::to_bits)[..2], [0, 0]);
        assert_eq!(sample.gradient[2], -1.0);
    }
}
