//! Pictures: what is asked for, as plain numbers, and what came out.
//!
//! Nothing here knows the language or an engine. A [`RenderSettings`] goes in, is turned into the
//! uniform data that CPU and GPU share ([`prepare`]), and a [`Frame`] comes out.

mod prepare;

pub use prepare::{Axes, Picture, prepare};
pub use sdfc_shaders::features::{Features, Mode, Normals, Occlusion};
pub use sdfc_shaders::layout::Surface;
pub use sdfc_shaders::marching::Status;
pub use sdfc_vm::settings::Tonemap;

use sdfc_shaders::tone;
use sdfc_vm::vector::V3;
use std::ops::{ControlFlow, Range};

/// Follows a picture while it is made. Any function of the share that is done is one that never
/// stops it.
pub trait Progress: Sync {
    /// Is told now and then, from any thread, what share is done, and says whether to go on. What
    /// is stopped gives no picture.
    fn is_at(&self, share: f32) -> ControlFlow<()>;
}

impl<F: Fn(f32) + Sync> Progress for F {
    fn is_at(&self, share: f32) -> ControlFlow<()> {
        self(share);
        ControlFlow::Continue(())
    }
}

/// Which of a picture's samples are made. One that is made in two parts, the first samples and then
/// the others, is the same to the last bit as one that is made at once.
#[derive(Clone, Copy, Debug)]
pub enum Samples<'f> {
    /// All of them.
    All,
    /// The first one of each pixel.
    First,
    /// All others, added to this picture of the first ones, which must be of the same engine, scene and
    /// settings. A picture of another size is none, and all samples are made.
    Rest(&'f Frame),
}

impl Samples<'_> {
    /// Which passes over subpixels these are, and the frame that they are added to: a pixel's colour
    /// there is the sum of the passes before.
    pub(crate) fn begin(self, picture: &Picture) -> (Range<u32>, Frame) {
        let all = picture.passes();
        match self {
            Self::All => (0..all, picture.blank()),
            Self::First => (0..1, picture.blank()),
            Self::Rest(first) => {
                let [width, height] = picture.size.map(|side| side as usize);
                if [first.width, first.height] == [width, height] {
                    (1..all, first.clone())
                } else {
                    (0..all, picture.blank())
                }
            }
        }
    }
}

/// Where the picture is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where the camera is.
    pub from: [f64; 3],
    /// What it looks at: the middle of the picture.
    pub look: [f64; 3],
    /// Which way is up; it need not be at a right angle to the direction of view.
    pub up: [f64; 3],
    /// How wide it sees.
    pub lens: Lens,
}

/// How wide a camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// With this vertical field of view in radians.
    Perspective(f64),
    /// Along parallel rays, with this much of the scene from the lower to the upper edge.
    Orthographic(f64),
}

impl View {
    /// The xy plane, seen face on: `height` of it, around `centre`.
    pub fn plane(centre: [f64; 2], height: f64) -> Self {
        let [x, y] = centre;
        Self {
            from: [x, y, height],
            look: [x, y, 0.0],
            up: [0.0, 1.0, 0.0],
            lens: Lens::Orthographic(height),
        }
    }
}

/// All that gives light.
#[derive(Clone, Debug, PartialEq)]
pub struct Lighting {
    /// The lights.
    pub lights: Vec<Light>,
    /// The colour straight up; linear, as all colours here.
    pub sky_top: [f64; 3],
    /// The colour at the horizon.
    pub sky_horizon: [f64; 3],
    /// The colour straight down.
    pub sky_ground: [f64; 3],
    /// Which direction is up.
    pub up: [f64; 3],
    /// A factor on the light that comes from the sky.
    pub ambient: f64,
    /// How much of a surface the air hides per unit of distance; `None` where there is no fog.
    pub fog: Option<f64>,
}

/// A light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Where its light comes from.
    pub source: Source,
    /// Its colour times its intensity.
    pub color: [f64; 3],
    /// Its shadow.
    pub shadow: Shadow,
}

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// From far away; the direction points towards the light and has any length but zero.
    Directional([f64; 3]),
    /// From a place; its colour is what arrives at a distance of one unit.
    Point([f64; 3]),
}

/// How a light's shadow is drawn; the number is the tangent of the light's angular radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shadow {
    /// It casts none.
    None,
    /// With a sharp edge.
    Hard,
    /// A penumbra from the nearest of the points that the ray stepped on.
    Plain(f64),
    /// A penumbra from the nearest point of the ray, estimated between steps.
    Improved(f64),
    /// A penumbra that also darkens from inside the shape.
    Sized(f64),
}

/// How a picture is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples per pixel along each side.
    pub aa: u32,
    /// The most steps of a ray.
    pub steps: u32,
    /// How far a ray goes, in scene units.
    pub far: f64,
    /// How near to a surface a march comes before it looks for the root: to this share of half a pixel,
    /// and to a few times as much where the field falls evenly. The depth is polished afterwards; with
    /// a larger share it takes fewer steps, and passes more of what is thinner than a pixel.
    pub cone: f64,
    /// How far steps go beyond the distance of the nearest surface where the field allows it: the
    /// weight, from 0 to 1, of the newest slope along a ray in a running mean of them. 0 is plain
    /// sphere tracing. See [`sdfc_shaders::marching`].
    pub relaxation: f64,
    /// What is shown.
    pub mode: Mode,
    /// How normals are found.
    pub normals: Normals,
    /// Ambient occlusion.
    pub occlusion: Occlusion,
    /// How far occlusion reaches, in scene units.
    pub occlusion_reach: f64,
    /// How light becomes a colour.
    pub tonemap: Tonemap,
    /// A factor on all light, before tone mapping.
    pub exposure: f64,
    /// The camera.
    pub view: View,
    /// The lights and the sky.
    pub lighting: Lighting,
    /// Whether the scene is a plane figure.
    pub plane: bool,
    /// Whether space is cut into cells. The picture is the same.
    pub cells: CellUse,
}

/// When engines that can cut space into cells ([`crate::cells`]) do so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CellUse {
    /// Where it makes the picture sooner, as far as is known beforehand.
    #[default]
    Auto,
    /// Never: the whole program is evaluated everywhere.
    Never,
    /// Always.
    Always,
    /// Always, and on the processor, also where a device draws.
    Processor,
    /// Always, and on the device that draws where it can ([`crate::engine`]). By themselves devices
    /// that are the processor leave it to the faster code there.
    Device,
}

impl RenderSettings {
    /// The default of [`RenderSettings::cone`].
    pub const CONE: f64 = 0.05;
    /// The default of [`RenderSettings::relaxation`].
    pub const RELAXATION: f64 = sdfc_shaders::marching::RELAXATION;
}

/// What is known of a field besides its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldFacts {
    /// Whether the length of its gradient is not known to be about one: it holds raw fields.
    pub raw: bool,
    /// The box that holds the solid.
    pub bounds: sdfc_vm::bounds::Bounds,
    /// The material, where there is only one and it is the same everywhere.
    pub material: Option<Surface>,
}

/// How light becomes bytes, for a picture in hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// A factor on all light.
    pub exposure: f32,
    /// The tone curve.
    pub tonemap: Tonemap,
    /// Whether the colours are light; otherwise (normals, depths, …) they are shown as they are.
    pub light: bool,
    /// Whether that is the light of a lit scene, which is exposed and tone mapped.
    pub scene: bool,
}

impl Display {
    /// The bytes of a colour.
    #[inline]
    pub fn bytes(&self, [r, g, b, _]: [f32; 4]) -> [u8; 4] {
        let mut color = V3::of(r, g, b);
        if self.scene {
            color = color * self.exposure;
            color = match self.tonemap {
                Tonemap::None => color,
                Tonemap::Reinhard => tone::reinhard::<f32>(color),
                Tonemap::Aces => tone::filmic::<f32>(color),
            };
        }
        if self.light {
            color = tone::encode::<f32>(color);
        }
        let byte = |channel: f32| tone::to_byte(channel) as u8;
        [byte(color.x), byte(color.y), byte(color.z), 255]
    }
}

/// A picture, and what was learned on the way. All lists are by rows from the upper left.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The mean of the samples: linear light and coverage, or a finished colour in modes that show
    /// no light.
    pub color: Vec<[f32; 4]>,
    /// How far the first sample's ray went; infinite where it hit nothing.
    pub depth: Vec<f32>,
    /// The direction of the surface there, of length one; zero where there is none.
    pub normal: Vec<[f32; 3]>,
    /// Which material is there; 0 where there is none.
    pub id: Vec<u32>,
    /// How often the field was evaluated along that ray.
    pub steps: Vec<u32>,
    /// How that ray ended.
    pub status: Vec<Status>,
    /// How the colours become bytes.
    pub display: Display,
    /// What it took.
    pub stats: Stats,
}

/// What a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Rays that hit a surface from outside.
    pub hits: u64,
    /// Rays that started inside a solid and came to its surface.
    pub inside: u64,
    /// Rays that left the scene, or came as far as they go.
    pub misses: u64,
    /// Those of them that came as far as they go (`far`) where the scene goes on.
    pub at_far: u64,
    /// Rays that ran out of steps.
    pub step_caps: u64,
    /// Rays that met a value that is not a number.
    pub nans: u64,
    /// Rays of which the engine `reference` could not prove whether and where they hit; they are
    /// counted above as what they most likely are. Other engines prove nothing, and count none.
    pub undecided: u64,
    /// Evaluations of the field, gradients included.
    pub evaluations: u64,
    /// The cells that were cut for the picture.
    pub cells: CellStats,
}

/// What came of cutting space into cells ([`crate::cells`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CellStats {
    /// How many there are; of those that a device cut, also those that edits replaced, as long as they
    /// stay in memory.
    pub made: u64,
    /// How many clauses their programs have, shared ones counted once.
    pub clauses: u64,
    /// How many kept the program of the cell around them, or were not cut further, because memory
    /// ran out.
    pub short: u64,
    /// How many were made for this picture, and not kept from the one before an edit.
    pub fresh: u64,
}

impl CellStats {
    /// Where an edit made so many more.
    pub(crate) fn with_fresh(self, fresh: u64) -> Self {
        Self {
            made: self.made + fresh,
            fresh,
            ..self
        }
    }
    /// Those of two programs.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            made: self.made + other.made,
            clauses: self.clauses + other.clauses,
            short: self.short + other.short,
            fresh: self.fresh + other.fresh,
        }
    }
}

impl Frame {
    /// The number of pixels whose colour is no number.
    pub fn colorless(&self) -> usize {
        let is_colorless = |color: &&[f32; 4]| color.iter().any(|v| v.is_nan());
        self.color.iter().filter(is_colorless).count()
    }

    /// The picture as red, green, blue and alpha bytes, encoded for a screen (sRGB) where it shows
    /// light.
    pub fn rgba8(&self) -> Vec<u8> {
        self.color
            .iter()
            .flat_map(|&color| self.display.bytes(color))
            .collect()
    }
}

impl Stats {
    /// Counts one ray; `at_far` says whether it ended at `far`, if it met nothing.
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
    /// How many rays there were.
    pub fn rays(&self) -> u64 {
        self.hits + self.inside + self.misses + self.step_caps + self.nans
    }
}

impl std::ops::AddAssign for Stats {
    fn add_assign(&mut self, other: Self) {
        self.hits += other.hits;
        self.inside += other.inside;
        self.misses += other.misses;
        self.at_far += other.at_far;
        self.step_caps += other.step_caps;
        self.nans += other.nans;
        self.undecided += other.undecided;
        self.evaluations += other.evaluations;
    }
}
