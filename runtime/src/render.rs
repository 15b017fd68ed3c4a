//! Inputs and results of a render.
//!
//! This module depends neither on the language nor on an engine. [`RenderSettings`] are converted to the
//! uniform data that CPU and GPU share ([`prepare`]); the result is an [`Image`].

mod display;
pub(crate) mod plane;
mod prepare;
pub(crate) mod ray;

pub use display::Display;
pub use plane::{ExactValues, PixelPlane};
pub use prepare::{Axes, RenderJob, prepare};
pub use sdfc_shaders::features::{Features, Mode, Normals, Occlusion};
pub use sdfc_shaders::layout::Surface;
pub use sdfc_shaders::marching::Status;
pub use sdfc_vm::settings::Tonemap;

use glam::DVec3;
use std::ops::{ControlFlow, Range};

/// Receives the progress of a render. Any function of the completed fraction implements it and never stops
/// the render.
pub trait RenderProgress: Sync {
    /// Receives the completed fraction, now and then and from any thread. Returns whether to continue. A render
    /// that is stopped returns no image.
    fn report(&self, fraction: f32) -> ControlFlow<()>;
}

impl<F: Fn(f32) + Sync> RenderProgress for F {
    fn report(&self, fraction: f32) -> ControlFlow<()> {
        self(fraction);
        ControlFlow::Continue(())
    }
}

/// The samples of an image to be rendered. An image rendered in two parts, the first samples and then the
/// others, equals one that is rendered at once, to the last bit.
#[derive(Clone, Copy, Debug)]
pub enum Samples<'f> {
    /// All samples.
    All,
    /// The first sample of each pixel.
    First,
    /// All other samples, added to this image of the first ones, which must be of the same engine, scene and
    /// settings. If its size differs, all samples are rendered.
    Remaining(&'f Image),
}

impl Samples<'_> {
    /// Returns the passes over subpixels, and the image that they are added to. Its colours are the sums of the
    /// passes before.
    pub(crate) fn passes(self, job: &RenderJob) -> (Range<u32>, Image) {
        let pass_count = job.pass_count();
        match self {
            Self::All => (0..pass_count, job.blank_image()),
            Self::First => (0..1, job.blank_image()),
            Self::Remaining(first) => {
                let [width, height] = job.size.map(|side| side as usize);
                if [first.width, first.height] == [width, height] {
                    (1..pass_count, first.clone())
                } else {
                    (0..pass_count, job.blank_image())
                }
            }
        }
    }
}

/// A camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position of the camera.
    pub from: [f64; 3],
    /// The point at the centre of the image.
    pub look: [f64; 3],
    /// The up direction; it need not be perpendicular to the direction of view.
    pub up: [f64; 3],
    /// Projection: field of view in radians, or height in scene units.
    pub lens: ResolvedLens,
}

/// The projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ResolvedLens {
    /// Perspective, with this vertical field of view in radians.
    Perspective(f64),
    /// Parallel rays, with this visible height in scene units.
    Orthographic(f64),
}

impl View {
    /// Returns the view of the xy plane, seen face on: `height` of it, around `centre`.
    pub fn plane(centre: [f64; 2], height: f64) -> Self {
        let [x, y] = centre;
        Self {
            from: [x, y, height],
            look: [x, y, 0.0],
            up: [0.0, 1.0, 0.0],
            lens: ResolvedLens::Orthographic(height),
        }
    }

    /// Returns the distance from the camera to the point at the centre of the image.
    pub fn target_distance(&self) -> f64 {
        DVec3::from(self.look).distance(self.from.into())
    }
}

/// All light sources.
#[derive(Clone, Debug, PartialEq)]
pub struct Lighting {
    /// The lights, in the scene's order; colours are linear.
    pub lights: Vec<ResolvedLight>,
    /// The colour straight up; linear, like all colours here.
    pub sky_top: [f64; 3],
    /// The colour at the horizon.
    pub sky_horizon: [f64; 3],
    /// The colour straight down.
    pub sky_ground: [f64; 3],
    /// The up direction.
    pub up: [f64; 3],
    /// Factor on the light from the sky.
    pub ambient: f64,
    /// Density of fog: the attenuation per unit of distance; `None` without fog.
    pub fog: Option<f64>,
}

/// A light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResolvedLight {
    /// Direction or position.
    pub source: LightEmitter,
    /// Colour times intensity.
    pub color: [f64; 3],
    /// The kind of shadow.
    pub shadow: ResolvedShadow,
}

/// Direction or position of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightEmitter {
    /// A light at infinity: the direction to the light, of any length except zero.
    Directional([f64; 3]),
    /// A light at a position; its colour is the one that arrives at a distance of one unit.
    Point([f64; 3]),
}

/// The kind of a light's shadow. The number is the tangent of the light's angular radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ResolvedShadow {
    /// No shadow.
    None,
    /// A sharp edge.
    Hard,
    /// A penumbra, found by short strides.
    Plain(f64),
    /// A penumbra, found by full sphere-tracing strides.
    Soft(f64),
    /// A penumbra that also darkens from inside the shape.
    Sized(f64),
}

/// The settings of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples per pixel along each side.
    pub aa: u32,
    /// Maximum number of steps of a ray.
    pub steps: u32,
    /// Maximum length of a ray, in scene units.
    pub far: f64,
    /// Maximum length of a ray that falls towards a half space of the enclosure, which may lie beyond `far`.
    pub extended_far: f64,
    /// Distance from a surface at which a march searches for the root, as a fraction of half a pixel. Where
    /// the field decreases steadily, it is 10 to 20 times as far. The depth is refined afterwards. A larger
    /// fraction takes fewer steps, and misses more details thinner than a pixel.
    pub threshold_fraction: f64,
    /// Weight of the newest slope in the running mean that lengthens steps, from 0 to 1. 0 is plain sphere
    /// tracing. See [`sdfc_shaders::marching`].
    pub relaxation: f64,
    /// The kind of image.
    pub mode: Mode,
    /// The method for normals.
    pub normals: Normals,
    /// Method for ambient occlusion.
    pub occlusion: Occlusion,
    /// Radius of occlusion, in scene units.
    pub occlusion_reach: f64,
    /// The tone curve.
    pub tonemap: Tonemap,
    /// Factor on all light, before tone mapping.
    pub exposure: f64,
    /// Position, direction and projection of the camera.
    pub view: View,
    /// Boxes of the parts of the scene; empty if all of it is one part. The rounding of each matters near that part only.
    pub parts: Vec<sdfc_vm::bounds::Bounds>,
    /// Region that contains an endless scene; `None` if none is known.
    pub enclosure: Option<sdfc_vm::settings::Enclosure>,
    /// The lights and the sky.
    pub lighting: Lighting,
    /// Set if the scene is a 2-D shape.
    pub is_2d: bool,
    /// Use of cells. It does not change the image.
    pub cells: CellMode,
}

/// Use of cells ([`crate::cells`]) in engines that support them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CellMode {
    /// If they are expected to make the render faster.
    #[default]
    Auto,
    /// Never: the whole program is evaluated everywhere.
    Never,
    /// Always, even where they make the render slower.
    Always,
    /// Always, and split on the CPU even if a device renders.
    Cpu,
    /// Always, and split on the device that renders, if it can ([`crate::engine`]). By default, software
    /// devices leave splitting to the faster code on the CPU.
    Gpu,
}

impl RenderSettings {
    /// The default of [`RenderSettings::threshold_fraction`].
    pub const DEFAULT_THRESHOLD_FRACTION: f64 = 0.05;
    /// The default of [`RenderSettings::relaxation`].
    pub const DEFAULT_RELAXATION: f64 = sdfc_shaders::marching::DEFAULT_RELAXATION;
}

/// Facts about a field besides its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldFacts {
    /// Set if the slope of the field may differ from about one, because it contains raw fields.
    pub is_raw: bool,
    /// Set if a raw field was divided by an estimate of its slope.
    pub has_estimated_slopes: bool,
    /// Bound of the slope of the field: 1, or more where a scene states a bound above an estimate. Infinite if only an
    /// estimate is known.
    pub max_slope: f32,
    /// Set if no close bound of a field's slope is found.
    pub has_loose_slopes: bool,
    /// The bounding box of the solid.
    pub bounds: sdfc_vm::bounds::Bounds,
    /// The material, if there is only one and it is the same everywhere.
    pub material: Option<Surface>,
}

impl FieldFacts {
    /// Returns the bound of the field's slope without what the scene states; infinite if only an estimate is known.
    pub(crate) fn found_slope(&self) -> f32 {
        match self.has_estimated_slopes {
            true => f32::INFINITY,
            false => 1.0,
        }
    }

    /// Returns the factor on a value for the radius of an empty sphere; 0 without a bound of the slope.
    pub(crate) fn step_factor(&self) -> f32 {
        1.0 / self.max_slope
    }
}

/// The surface at each pixel, row after row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// Distance along the ray; infinite where there is no surface.
    pub depth: Vec<f32>,
    /// Unit normals; zero where there is no surface.
    pub normal: Vec<[f32; 3]>,
}

/// A rendered image with its data per pixel. All lists are by rows from the upper left.
#[derive(Clone, Debug)]
pub struct Image {
    /// Number of pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// The mean of the samples: linear light and coverage, or a finished colour in modes that do not show
    /// light.
    pub color: Vec<[f32; 4]>,
    /// Length of the first sample's ray; infinite if it hit nothing.
    pub depth: Vec<f32>,
    /// The unit normal of the surface there; zero if there is none.
    pub normal: Vec<[f32; 3]>,
    /// The identifier of the material there; 0 if there is none.
    pub id: Vec<u32>,
    /// Number of evaluations of the field along that ray.
    pub steps: Vec<u32>,
    /// The end of that ray.
    pub status: Vec<Status>,
    /// The conversion of the colours to bytes.
    pub display: Display,
    /// Counts of the render.
    pub stats: Stats,
}

/// Counts of a render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Rays that hit a surface from outside.
    pub hits: u64,
    /// Rays that started inside a solid and reached its surface.
    pub inside: u64,
    /// Rays that left the scene or reached their maximum length.
    pub misses: u64,
    /// Those of the misses that reached their maximum length (`far`) before the scene ends.
    pub at_far: u64,
    /// Rays that ran out of steps.
    pub step_caps: u64,
    /// Rays that met a NaN.
    pub nans: u64,
    /// Rays for which the engine `reference` could not prove whether and where they hit; they are also
    /// counted above as the most likely outcome. Other engines prove nothing and count none.
    pub undecided: u64,
    /// Evaluations of the field, including gradients.
    pub evaluations: u64,
    /// The cells of the render.
    pub cells: CellStats,
}

/// Counts of cells ([`crate::cells`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CellStats {
    /// Number of cells. Cells of a device include those replaced by edits, as long as they stay in memory.
    pub count: u64,
    /// Number of clauses of their programs; shared ones count once.
    pub clauses: u64,
    /// Number of cells that kept the program of their parent, or were not split further, because memory ran
    /// out.
    pub out_of_memory: u64,
    /// Number of cells built for this image, not kept from the one before an edit.
    pub fresh: u64,
}

impl CellStats {
    /// Adds the cells built after an edit.
    pub(crate) fn with_fresh(self, fresh: u64) -> Self {
        Self {
            count: self.count + fresh,
            fresh,
            ..self
        }
    }
    /// Adds the counts of two programs.
    pub(crate) fn sum(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            clauses: self.clauses + other.clauses,
            out_of_memory: self.out_of_memory + other.out_of_memory,
            fresh: self.fresh + other.fresh,
        }
    }
}

impl Image {
    /// Returns the number of pixels whose colour contains a NaN.
    pub fn nan_pixels(&self) -> usize {
        let is_colorless = |color: &&[f32; 4]| color.iter().any(|v| v.is_nan());
        self.color.iter().filter(is_colorless).count()
    }

    /// Returns the image as red, green, blue and alpha bytes, encoded for a screen (sRGB) where it shows light.
    pub fn rgba8(&self) -> Vec<u8> {
        self.display.all_bytes(&self.color)
    }
}

impl Stats {
    /// Counts one ray. `at_far` is called for a miss, and reports whether it ended at `far`.
    pub(crate) fn count(&mut self, status: Status, at_far: impl FnOnce() -> bool) {
        match status {
            Status::Active | Status::StepCap => self.step_caps += 1,
            Status::Hit => self.hits += 1,
            Status::Miss => {
                self.misses += 1;
                self.at_far += u64::from(at_far());
            }
            Status::NotANumber => self.nans += 1,
            Status::Inside => self.inside += 1,
        }
    }
    /// Returns the sums of the counts of rays and evaluations, with the cells of `self`.
    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            hits: self.hits + other.hits,
            inside: self.inside + other.inside,
            misses: self.misses + other.misses,
            at_far: self.at_far + other.at_far,
            step_caps: self.step_caps + other.step_caps,
            nans: self.nans + other.nans,
            undecided: self.undecided + other.undecided,
            evaluations: self.evaluations + other.evaluations,
            cells: self.cells,
        }
    }
    /// Returns the number of rays, of all outcomes.
    pub fn rays(&self) -> u64 {
        self.hits + self.inside + self.misses + self.step_caps + self.nans
    }
}
