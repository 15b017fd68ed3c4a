//! The truth: where rays meet a scene's surface, proved by interval arithmetic in `f64`.
//!
//! # What is proved
//! A ray is the points `o + t·d` for the numbers that the camera gives in `f64` from the settings
//! themselves. Along it the field is the real function that the program writes, with the `f32`
//! constants of the program taken as they are. [`Outcome`] says what is known of its first root in
//! [0, `far`]:
//! - [`Outcome::Hit`]: there is none before `t0`, and the field changes its sign in [`t0`, `t1`];
//! - [`Outcome::Miss`]: there is none;
//! - [`Outcome::Undecided`]: there is none before `t0`, and what happens behind is not known.
//!
//! A root is a place where the field gets below zero by more than rounding alone can do in `f32`
//! ([`sdfc_shaders::marching::noise`]), the same as in all engines. What is thinner is passed.
//!
//! Trusted are the interval arithmetic of `sdfc_vm` ([`sdfc_vm::interval`], outward rounded after
//! every operation), that the standard library's sine, cosine, arctangent, exponential and
//! logarithm are right to 1e-15, and the constant bounds of noise and its slope. The bounds, the
//! slope and the volumes that the compiler found are not: they only help to guess where nothing
//! could be proved. Slopes of roots and logarithms are used where they are below 1e9; poles that
//! are hidden better change the field by less than 1e-15.
//!
//! # What counts as a surface
//! - **Jumps.** Repetition, choices and steps may make a field jump. A jump across zero is a
//!   surface for a ray that marches, and a hit here. A jump that stays on one side is passed.
//! - **Inside.** A ray that starts inside the solid, where the field is below zero, sees the surface
//!   from behind: its first root is where it comes out, and its normal is turned towards it. This
//!   is what all engines do. One that starts on a surface starts behind it. One that runs along the surface
//!   from there is undecided ([`Why::Start`]).
//! - **Touching.** Where the field touches zero and is above zero again behind, as in a flush cut or at a
//!   silhouette, there is no surface. Where a ray runs along a surface, so that its sign stays unknown for a
//!   thousandth of the way, it is undecided ([`Why::Touching`]), and drawn as a miss.
//! - **Figures.** Plane figures are drawn from their field and have no rays; [`trace`] takes them
//!   for what they are in space.

mod camera;
mod errors;
mod field;
mod isolate;
mod normal;
mod place;

use crate::crew::share;
use crate::frame::RenderSettings;
use field::Asker;
use sdfc_vm::program::Module;
use serde::Serialize;

pub use camera::{Camera, Ray};
pub use errors::{Drawn, Errors, compare};
pub use field::Field;
pub use place::Place;

/// How much is done for a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The most evaluations of the field; a ray that needs more is undecided.
    pub evaluations: u32,
    /// How wide the interval of a hit may be, as a share of `t0`. Near the camera, where that is
    /// less than `f64` can tell, it is 2⁻⁴⁰ of the coordinates.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            evaluations: 20_000,
            tolerance: 1e-9,
        }
    }
}

/// What is known of a ray's first root; distances are in units of the scene along the ray.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// The field changes its sign for the first time in [`t0`, `t1`].
    Hit {
        /// From here,
        t0: f64,
        /// to here.
        t1: f64,
    },
    /// It has no root.
    Miss,
    /// It has no root before `t0`.
    Undecided {
        /// From here,
        t0: f64,
        /// to here nothing could be decided.
        t1: f64,
        /// The reason.
        why: Why,
    },
}

/// Why nothing could be decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Why {
    /// The field is zero where the ray starts, or so near to it that its sign is not known.
    Start,
    /// The ray touches a surface, or passes it too closely to tell.
    Touching,
    /// [`Options::evaluations`] were spent.
    Budget,
}

/// How a ray ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ended {
    /// What is known of its first root.
    pub outcome: Outcome,
    /// Whether it starts inside the solid.
    pub inside: bool,
    /// How far it most likely goes: to the middle of a hit, and to a guess where it is undecided;
    /// `None` for what misses or, as far as is known, would.
    pub depth: Option<f64>,
    /// Which way the surface faces at a hit, as a unit vector; `None` where it has no direction
    /// there (an edge, a tip), and where there is no hit.
    pub normal: Option<[f64; 3]>,
    /// Whether there is an edge of the surface at the hit, or within half a pixel of it.
    pub edge: bool,
}

/// The truth of a picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// How the ray through the centre of each pixel ends, row after row from the upper left.
    pub rays: Vec<Ended>,
    /// Where those pixels lie.
    pub places: Vec<Place>,
    /// How often the field was evaluated.
    pub evaluations: u64,
}

impl Truth {
    /// How many rays are undecided.
    pub fn undecided(&self) -> usize {
        let undecided = |ray: &&Ended| matches!(ray.outcome, Outcome::Undecided { .. });
        self.rays.iter().filter(undecided).count()
    }
}

/// Finds how the rays through the centres of all pixels end, on all cores; the result does not
/// depend on how many there are. `module` is as [`Module::update`] left it, and `settings` are those
/// of the picture ([`crate::settings::resolve`]).
pub fn trace(module: &Module, settings: &RenderSettings, options: &Options) -> Truth {
    let field = Field::of(module);
    let camera = Camera::of(settings);
    let [width, height] = settings.size.map(|side| side as usize);
    let rows = share(
        height,
        || Tracer::new(&field, options),
        |tracer, y| {
            let pixels = (0..width).map(|x| [x as f64, y as f64]);
            let before = tracer.asker.evaluations;
            let row: Vec<Ended> = pixels
                .map(|pixel| {
                    let ray = camera.ray(pixel, [0.0, 0.0]);
                    tracer.ray(&ray, settings.far, |t| camera.half_pixel(t))
                })
                .collect();
            (row, tracer.asker.evaluations - before)
        },
    );
    let evaluations = rows.iter().map(|(_, evaluations)| evaluations).sum();
    let rays: Vec<Ended> = rows.into_iter().flat_map(|(row, _)| row).collect();
    Truth {
        size: [width, height],
        places: place::places(&rays, width, &camera),
        rays,
        evaluations,
    }
}

/// Within this share of the coordinates, a hit with several directions has no normal.
const NEAR: f64 = 1e-10;

/// Follows rays through a field, with the memory that takes.
pub struct Tracer<'a> {
    asker: Asker<'a>,
    options: Options,
}

impl<'a> Tracer<'a> {
    /// One for rays through this field.
    pub fn new(field: &'a Field, options: &Options) -> Self {
        Self {
            asker: Asker::new(field),
            options: *options,
        }
    }

    /// How often the field was evaluated so far.
    pub fn evaluations(&self) -> u64 {
        self.asker.evaluations
    }

    /// How a ray ends that goes up to `far`; `half_pixel` says how far from a hit at `t` an edge is
    /// looked for.
    pub fn ray(&mut self, ray: &Ray, far: f64, half_pixel: impl Fn(f64) -> f64) -> Ended {
        let (outcome, inside) = isolate::first_root(&mut self.asker, ray, far, &self.options);
        let mut ended = Ended {
            outcome,
            inside,
            depth: None,
            normal: None,
            edge: false,
        };
        let (t0, t1) = match outcome {
            Outcome::Miss => return ended,
            Outcome::Undecided {
                why: Why::Start, ..
            } => return ended,
            Outcome::Undecided { t0, .. } => {
                ended.depth = isolate::guess(&mut self.asker, ray, t0, far, inside);
                return ended;
            }
            Outcome::Hit { t0, t1 } => (t0, t1),
        };
        let middle = t0 + (t1 - t0) / 2.0;
        ended.depth = Some(middle);
        let side = if inside { -1.0 } else { 1.0 };
        let (field, p) = (self.asker.field(), ray.at(middle));
        let size = p.iter().fold(middle, |most, v| most.max(v.abs()));
        let near = (t1 - t0).max(size * NEAR);
        ended.normal = normal::normal(field, p, near, side);
        ended.edge = ended
            .normal
            .is_none_or(|normal| normal::is_at_edge(field, p, normal, half_pixel(middle)));
        ended
    }

    /// The normal of a pixel's surface: the one that is proved, or else the one that is most likely where the ray ends.
    pub(crate) fn shown_normal(&self, ray: &Ray, ended: &Ended) -> [f64; 3] {
        let side = if ended.inside { -1.0 } else { 1.0 };
        ended.normal.unwrap_or_else(|| match ended.depth {
            Some(depth) => normal::likely(self.asker.field(), ray.at(depth), ray.direction, side),
            None => ray.direction.map(|v| -v),
        })
    }
}
