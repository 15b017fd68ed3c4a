//! The truth: the intersections of rays with a scene's surface, proved by interval arithmetic in `f64`.
//!
//! # What is proved
//! A ray consists of the points `o + t·d`, for the numbers that the camera computes in `f64` from the
//! settings themselves. Along it the field is the real function that the program defines, with the program's
//! `f32` constants taken as exact. [`Outcome`] states a proved property of its first root in [0, `far`]:
//! - [`Outcome::Hit`]: there is none before `t0`, and the field changes its sign in [`t0`, `t1`];
//! - [`Outcome::Miss`]: there is none;
//! - [`Outcome::Undecided`]: there is none before `t0`, and nothing is known beyond it.
//!
//! A root is a point where the field falls below zero by more than rounding alone can do in `f32`
//! ([`sdfc_shaders::marching::sign_margin`]), as in all engines. Thinner parts are passed.
//!
//! Trusted are the interval arithmetic of `sdfc_vm` ([`sdfc_vm::interval`], outward rounded after every
//! operation) and the constant bounds of noise and its slope. The standard library's sine, cosine,
//! arctangent, exponential and logarithm are trusted to be accurate to 1e-15. The bounds, the slope and the
//! volumes of the compiler are not trusted: they are only used for estimates where nothing could be proved.
//! Slopes of roots and logarithms are used where they are below 1e9; poles that are better hidden change the
//! field by less than 1e-15.
//!
//! # What counts as a surface
//! - **Discontinuities.** Repetition, choices and steps may make a field discontinuous. A change of sign at a
//!   discontinuity is a surface for a ray that marches, and a hit here. A discontinuity without a change of
//!   sign is passed.
//! - **Inside.** A ray that starts inside the solid, where the field is below zero, sees the surface from
//!   behind. Its first root is where it leaves the solid, and the normal is turned towards it. All engines do
//!   this. A ray that starts on a surface starts behind it. One that runs along the surface from there is
//!   undecided ([`UndecidedReason::Start`]).
//! - **Touching.** Where the field touches zero and is above zero again beyond, as in a flush cut or at a
//!   silhouette, there is no surface. Where a ray runs along a surface, the sign may stay unknown for a
//!   thousandth of the coordinates. Such a ray is undecided ([`UndecidedReason::Touching`]), and drawn as a
//!   miss.
//! - **2-D shapes.** 2-D shapes are drawn from their field and have no rays; [`trace`] treats them as the 3-D
//!   field that they define.

mod camera;
pub(crate) mod engine;
mod errors;
mod field;
mod isolate;
mod normal;
mod pixel_class;
mod sample;

use crate::render::RenderSettings;
use crate::work_stealing::parallel_map_with;
use field::RayFieldEvaluator;
use sdfc_vm::program::Module;
use serde::Serialize;

pub use camera::{ReferenceCamera, ReferenceRay};
pub use errors::{PictureErrors, RenderedPixels, compare};
pub use field::ReferenceField;
pub use pixel_class::PixelClass;
pub use sample::PixelSample;

/// Limits of the work per ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceOptions {
    /// Maximum number of evaluations of the field; a ray that requires more is undecided.
    pub evaluations: u32,
    /// Maximum width of a hit's interval, as a fraction of `t0`. Near the camera, where that is below the
    /// resolution of `f64`, it is 2⁻⁴⁰ of the coordinates.
    pub tolerance: f64,
}

impl Default for TraceOptions {
    fn default() -> Self {
        Self {
            evaluations: 20_000,
            tolerance: 1e-9,
        }
    }
}

/// Proved property of a ray's first root; distances are in units of the scene along the ray.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// The field changes its sign for the first time in [`t0`, `t1`].
    Hit {
        /// Start of the interval.
        t0: f64,
        /// End of the interval.
        t1: f64,
    },
    /// There is no root.
    Miss,
    /// There is no root before `t0`.
    Undecided {
        /// Start of the undecided interval.
        t0: f64,
        /// End of the undecided interval.
        t1: f64,
        /// Reason why no root is proved there.
        why: UndecidedReason,
    },
}

/// Reason for an undecided ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum UndecidedReason {
    /// The field is zero at the start of the ray, or so close to zero that its sign is unknown.
    Start,
    /// The ray touches a surface, or passes it too closely to decide.
    Touching,
    /// [`TraceOptions::evaluations`] were spent.
    Budget,
}

/// Result of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RayEnd {
    /// Proved property of its first root.
    pub outcome: Outcome,
    /// Set if the ray starts inside the solid.
    pub inside: bool,
    /// Most likely length of the ray: the middle of a hit's interval, or an estimate if it is undecided.
    /// `None` for a ray that misses, or most likely does.
    pub depth: Option<f64>,
    /// Unit normal at a hit. `None` where it has no direction (an edge, a tip), and if there is no hit.
    pub normal: Option<[f64; 3]>,
    /// Set if there is an edge of the surface at the hit, or within half a pixel of it.
    pub edge: bool,
}

/// The truth of a picture, or of a sample of its pixels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroundTruth {
    /// Width and height of the picture in pixels.
    pub size: [usize; 2],
    /// The pixels in ascending order.
    pub pixels: Vec<TruePixel>,
    /// Number of traced rays: those of the pixels and of their neighbours.
    pub traced: usize,
    /// Number of evaluations of the field.
    pub evaluations: u64,
}

/// The truth of a pixel with one sample.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TruePixel {
    /// Index in the picture, row after row from the upper left.
    pub index: usize,
    /// Number of pixels that it stands for.
    pub weight: f64,
    /// Result of its ray.
    pub ray: RayEnd,
    /// Its class.
    pub class: PixelClass,
}

impl GroundTruth {
    /// Returns the number of pixels whose ray is undecided.
    pub fn undecided(&self) -> usize {
        let undecided = |pixel: &&TruePixel| matches!(pixel.ray.outcome, Outcome::Undecided { .. });
        self.pixels.iter().filter(undecided).count()
    }
}

/// Traces the rays of all pixels, one sample each; see [`trace_sample`].
pub fn trace(module: &Module, settings: &RenderSettings, options: &TraceOptions) -> GroundTruth {
    let sample = PixelSample::all(settings.size.map(|side| side as usize));
    trace_sample(module, settings, &sample, options)
}

/// Traces the rays of a sample of pixels and of their neighbours, one sample each, on all cores. The result does
/// not depend on their number. `module` is as [`Module::update`] left it, and `settings` are those of the picture
/// ([`crate::settings::resolve`]).
pub fn trace_sample(
    module: &Module,
    settings: &RenderSettings,
    sample: &PixelSample,
    options: &TraceOptions,
) -> GroundTruth {
    let field = ReferenceField::from_module(module);
    let camera = ReferenceCamera::new(settings);
    let [width, height] = sample.size;
    let mut is_needed = vec![false; width * height];
    for &(index, _) in &sample.pixels {
        for neighbor in pixel_class::neighborhood(index, width, height) {
            is_needed[neighbor] = true;
        }
    }
    let rows = parallel_map_with(
        height,
        || ReferenceTracer::new(&field, options),
        |tracer, y| {
            let evaluations_before = tracer.evaluator.evaluations;
            let row: Vec<Option<RayEnd>> = (0..width)
                .map(|x| {
                    let ray = camera.ray([x as f64, y as f64], [0.0, 0.0]);
                    let far = camera.far(&ray);
                    let mut trace = || tracer.ray(&ray, far, |t| camera.half_pixel(t));
                    is_needed[y * width + x].then(&mut trace)
                })
                .collect();
            (row, tracer.evaluator.evaluations - evaluations_before)
        },
    );
    let evaluations = rows.iter().map(|(_, evaluations)| evaluations).sum();
    let rays: Vec<Option<RayEnd>> = rows.into_iter().flat_map(|(row, _)| row).collect();
    let pixels = sample.pixels.iter().filter_map(|&(index, weight)| {
        Some(TruePixel {
            index,
            weight,
            ray: rays[index]?,
            class: pixel_class::classify(&rays, width, index, &camera),
        })
    });
    GroundTruth {
        size: sample.size,
        pixels: pixels.collect(),
        traced: rays.iter().flatten().count(),
        evaluations,
    }
}

/// Distance, as a fraction of the coordinates, within which a hit with several directions has no normal.
const NORMAL_RADIUS_FRACTION: f64 = 1e-10;

/// Traces rays through a field, with its evaluator.
pub struct ReferenceTracer<'a> {
    evaluator: RayFieldEvaluator<'a>,
    options: TraceOptions,
}

impl<'a> ReferenceTracer<'a> {
    /// Creates a tracer of rays through this field.
    pub fn new(field: &'a ReferenceField, options: &TraceOptions) -> Self {
        Self {
            evaluator: RayFieldEvaluator::new(field),
            options: *options,
        }
    }

    /// Returns the number of evaluations of the field so far.
    pub fn evaluations(&self) -> u64 {
        self.evaluator.evaluations
    }

    /// Traces a ray up to `far`. `half_pixel` returns the distance from a hit at `t` within which edges are
    /// detected.
    pub fn ray(&mut self, ray: &ReferenceRay, far: f64, half_pixel: impl Fn(f64) -> f64) -> RayEnd {
        let (outcome, inside) = isolate::first_root(&mut self.evaluator, ray, far, &self.options);
        let mut ray_end = RayEnd {
            outcome,
            inside,
            depth: None,
            normal: None,
            edge: false,
        };
        let (t0, t1) = match outcome {
            Outcome::Miss => return ray_end,
            Outcome::Undecided {
                why: UndecidedReason::Start,
                ..
            } => return ray_end,
            Outcome::Undecided { t0, .. } => {
                ray_end.depth = isolate::estimate_end(&mut self.evaluator, ray, t0, far, inside);
                return ray_end;
            }
            Outcome::Hit { t0, t1 } => (t0, t1),
        };
        let middle = t0 + (t1 - t0) / 2.0;
        ray_end.depth = Some(middle);
        let side = if inside { -1.0 } else { 1.0 };
        let (field, p) = (self.evaluator.field(), ray.at(middle));
        let max_coordinate = p.iter().fold(middle, |max_abs, v| max_abs.max(v.abs()));
        let radius = (t1 - t0).max(max_coordinate * NORMAL_RADIUS_FRACTION);
        ray_end.normal = normal::normal(field, p, radius, side);
        ray_end.edge = ray_end
            .normal
            .is_none_or(|normal| normal::is_at_edge(field, p, normal, half_pixel(middle)));
        ray_end
    }

    /// Returns the normal of a pixel's surface: the proved one, or else the most likely one at the end of the
    /// ray.
    pub(crate) fn shown_normal(&self, ray: &ReferenceRay, ended: &RayEnd) -> [f64; 3] {
        let side = if ended.inside { -1.0 } else { 1.0 };
        ended.normal.unwrap_or_else(|| match ended.depth {
            Some(depth) => {
                normal::likely_normal(self.evaluator.field(), ray.at(depth), ray.direction, side)
            }
            None => ray.direction.map(|v| -v),
        })
    }
}
