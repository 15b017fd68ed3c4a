//! Effect of rounding on what is visible. Running error bounds ([`sdfc_vm::rounding`]) hold for all of a
//! scene's surface, and give the pixels by which it may move.
//!
//! Coordinates count with their own rounding. Within the bounds that is half a unit in their last place, as
//! for points that are given in `f32`. In the picture it is the error that marching assumes for rays
//! ([`rounding_at`](sdfc_shaders::marching::rounding_at)).

mod plane;
mod search;

pub use search::ErrorBound;

use crate::render::{FieldFacts, RenderJob, RenderSettings, prepare};
use crate::settings::field_facts;
use glam::{DVec3, Vec3};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::interval::Interval;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::rounding::error_bound;
use search::{ErrorScale, SampledError, max_error, sampled_error};

/// Distance from the origin of the samples of [`Rounding::far`], in scene units.
pub const FAR_SAMPLE_DISTANCE: f64 = 1e4;

/// Rounding errors of a module in `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounding {
    /// Error of the field near any surface within the scene's bounds, in scene units; `None` if these are
    /// infinite or contain nothing.
    pub in_bounds: Option<ErrorBound>,
    /// Error of the field at [`FAR_SAMPLE_DISTANCE`] from the origin, in a few directions; infinite where it is
    /// unbounded.
    pub far: f64,
    /// Error on any surface within the view, hidden or not, in pixels of the picture; `None` if there is
    /// none.
    pub visible: Option<ErrorBound>,
}

/// Bounds the rounding errors of a module, after [`Module::update`] returned `uniform_values`, and of the picture
/// that the settings describe. It evaluates some ten thousand instructions, and more for long programs.
pub fn rounding(module: &Module, uniform_values: &[f64], settings: &RenderSettings) -> Rounding {
    let facts = field_facts(module, uniform_values);
    let program = &module.distance;
    let bounds = flattened(facts.bounds, settings.is_2d);
    let in_bounds = bounds.is_finite().then(|| {
        let max_half_diagonal = bounds.half_diagonal() / 4.0;
        max_error(program, &bounds, SampledError::default(), |region_box| {
            Some(ErrorScale {
                coordinate_errors: region_box.map(|side| side.magnitude() * UNIT_ROUNDOFF),
                unit: 1.0,
                max_half_diagonal,
            })
        })
    });
    Rounding {
        in_bounds: in_bounds.flatten(),
        far: max_error_at_distance(program, FAR_SAMPLE_DISTANCE, settings.is_2d),
        visible: error_in_picture(program, settings, &facts),
    }
}

/// Computes [`Rounding::visible`] alone.
pub fn visible_error(
    module: &Module,
    uniform_values: &[f64],
    settings: &RenderSettings,
) -> Option<ErrorBound> {
    error_in_picture(
        &module.distance,
        settings,
        &field_facts(module, uniform_values),
    )
}

/// Rounding error at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointError {
    /// Error of the field, in scene units; infinite where it is unbounded.
    pub field: f64,
    /// Number of pixels by which it may move a surface there.
    pub pixels: f64,
    /// Set if `f32` may take another branch than real numbers there, as at a discontinuity of repeated space.
    /// The errors hold for either side, and not for the difference between them.
    pub branch_uncertain: bool,
}

/// Bounds the rounding error at a visible point, in a module after [`Module::update`] returned `uniform_values`. The
/// point is taken to be as inexact as the end of a ray.
pub fn error_at(
    module: &Module,
    uniform_values: &[f64],
    settings: &RenderSettings,
    point: [f64; 3],
) -> PointError {
    let camera = RayFan::new(
        settings,
        &prepare(settings, &field_facts(module, uniform_values)),
    );
    let from = DVec3::from(point) - camera.origin;
    let distance = from.length().min(camera.far);
    let coordinate_error = camera.rounding + 2e-7 * distance;
    let bound = error_bound(
        &module.distance,
        point.map(Interval::point),
        [coordinate_error; 3],
    );
    let ahead = from.dot(camera.axes[0]).max(0.0);
    let pixel = camera.pixel[0] + camera.pixel[1] * ahead;
    PointError {
        field: bound.error,
        pixels: bound.error / pixel.max(f64::MIN_POSITIVE),
        branch_uncertain: bound.branch_uncertain,
    }
}

/// Computes the error within the view: first where some rays end, then on all of it.
fn error_in_picture(
    program: &Program,
    settings: &RenderSettings,
    facts: &FieldFacts,
) -> Option<ErrorBound> {
    let ray_fan = RayFan::new(settings, &prepare(settings, facts));
    if settings.is_2d {
        return plane::error_at_edges(program, &ray_fan);
    }
    let region = facts.bounds.intersection(&ray_fan.reachable_bounds());
    let error_scale = |region_box: &[Interval; 3]| ray_fan.error_scale(region_box);
    let mut largest = SampledError::default();
    for ray in 0..RAY_COUNT {
        let Some(end) = ray_fan.march(program, ray) else {
            continue;
        };
        let region_box = end.map(Interval::point);
        if let Some(error_scale) = error_scale(&region_box) {
            let bound = error_bound(program, region_box, error_scale.coordinate_errors);
            let error = sampled_error(program, end, &bound).unwrap_or_default();
            largest = largest.or(error.in_units(error_scale.unit));
        }
    }
    let is_finite = region.is_finite();
    is_finite
        .then(|| max_error(program, &region, largest, error_scale))
        .flatten()
}

/// Flattens a box to the plane of a 2-D scene.
fn flattened(mut bounds: Bounds, is_2d: bool) -> Bounds {
    if is_2d {
        (bounds.min[2], bounds.max[2]) = (0.0, 0.0);
    }
    bounds
}

/// Number of rays that search for a surface, and maximum number of steps of each.
const RAY_COUNT: u32 = 12;
const MAX_STEPS: u32 = 64;
/// Largest distance from a surface, in pixels, at which a ray out of steps counts as on it.
const MAX_PIXELS_FROM_SURFACE: f64 = 4.0;

/// Half a unit in the last place, as a fraction of a number.
const UNIT_ROUNDOFF: f64 = 1.0 / 16_777_216.0;

/// Returns the largest bound at a distance from the origin, towards the corners, edges and faces of a
/// slightly rotated cube. Many fields are folded along the axes themselves.
fn max_error_at_distance(program: &Program, distance: f64, is_2d: bool) -> f64 {
    let mut max_error = 0.0_f64;
    for i in 0..27 {
        let [x, y, z] = [i % 3, i / 3 % 3, i / 9].map(|step| f64::from(step) - 1.0);
        let mut direction = DVec3::new(x + 0.11 * y - 0.07 * z, y - 0.11 * x, z + 0.07 * x);
        if is_2d {
            direction.z = 0.0;
        }
        let length = direction.length();
        if length > 0.0 {
            let p = (direction / length * distance).to_array();
            let coordinate_errors = p.map(|v| v.abs() * UNIT_ROUNDOFF);
            max_error = max_error
                .max(error_bound(program, p.map(Interval::point), coordinate_errors).error);
        }
    }
    max_error
}

/// The rays of a picture, and the size of its pixels.
struct RayFan {
    origin: DVec3,
    /// Direction of the picture's centre, and those to the right and up.
    axes: [DVec3; 3],
    /// Half of the picture's width and height where rays start.
    start: [f64; 2],
    /// Growth of these per unit of distance along the view.
    growth: [f64; 2],
    /// Height of a pixel where rays start, and its growth along a ray.
    pixel: [f64; 2],
    /// Error of the start of a ray.
    rounding: f64,
    far: f64,
}

impl RayFan {
    fn new(settings: &RenderSettings, job: &RenderJob) -> Self {
        let u = &job.uniforms;
        let wide = |v: [f32; 3]| Vec3::from(v).as_dvec3();
        let [right, up] = [
            [wide(u.origin_right), wide(u.forward_right)],
            [wide(u.origin_up), wide(u.forward_up)],
        ];
        let direction = |[start, growth]: [DVec3; 2]| {
            let sum = start + growth;
            sum / sum.length().max(1e-30)
        };
        let samples = f64::from(settings.aa.max(1));
        Self {
            origin: wide(u.origin),
            axes: [wide(u.forward), direction(right), direction(up)],
            start: [right[0].length(), up[0].length()],
            growth: [right[1].length(), up[1].length()],
            pixel: [u.half_pixel_size, u.half_pixel_growth]
                .map(|half| 2.0 * samples * f64::from(half)),
            rounding: u.rounding.into(),
            far: u.far.into(),
        }
    }

    /// Returns a box that contains all rays.
    fn reachable_bounds(&self) -> Bounds {
        let far_growth = self.growth.map(|growth| growth * self.far);
        let lateral = self.start[0] + self.start[1] + far_growth[0] + far_growth[1];
        let point = Bounds {
            min: self.origin.into(),
            max: self.origin.into(),
        };
        point.grown(self.far + lateral)
    }

    /// Returns the end on a surface of one of [`RAY_COUNT`] rays, spread over the picture. A ray out of steps
    /// ends there if it is within [`MAX_PIXELS_FROM_SURFACE`] pixels of one.
    fn march(&self, program: &Program, ray: u32) -> Option<[f64; 3]> {
        // The golden ratio's multiples fill the picture evenly, from the bottom to the top.
        let horizontal = (f64::from(ray) * 0.618_034).fract() * 1.9 - 0.95;
        let vertical = (f64::from(ray) + 0.5) / f64::from(RAY_COUNT) * 1.9 - 0.95;
        let offset = |extent: [f64; 2]| [extent[0] * horizontal, extent[1] * vertical];
        let (start_offset, growth_offset) = (offset(self.start), offset(self.growth));
        let [forward, right, above] = self.axes;
        let start_point = self.origin + right * start_offset[0] + above * start_offset[1];
        let direction = forward + right * growth_offset[0] + above * growth_offset[1];
        let direction = direction / direction.length().max(1e-30);
        let point_at = |t: f64| (start_point + direction * t).to_array();
        let mut t = 0.0;
        let mut is_near_surface = false;
        for _ in 0..MAX_STEPS {
            let field = evaluate_f64(program, point_at(t)).abs();
            let pixel = self.pixel[0] + self.pixel[1] * t;
            if field <= 0.25 * pixel {
                return Some(point_at(t));
            }
            is_near_surface = field <= MAX_PIXELS_FROM_SURFACE * pixel;
            t += field;
            // NaN ends a ray, too.
            let goes_on = t < self.far;
            if !goes_on {
                return None;
            }
        }
        is_near_surface.then(|| point_at(t))
    }

    /// Returns the error scale of a box, or `None` if no ray reaches it.
    fn error_scale(&self, region_box: &[Interval; 3]) -> Option<ErrorScale> {
        let bounds = Bounds {
            min: region_box.map(|side| side.lo),
            max: region_box.map(|side| side.hi),
        };
        let corners = bounds.corners().map(|corner| {
            let from = DVec3::from(corner) - self.origin;
            DVec3::from(self.axes.map(|axis| from.dot(axis)))
        });
        let all_corners = |side: &dyn Fn(&DVec3) -> bool| corners.iter().all(side);
        let is_hidden = all_corners(&|v| v[0] < 0.0)
            || (0..2).any(|i| {
                let half = |ahead: f64| self.start[i] + self.growth[i] * ahead;
                all_corners(&|v| v[i + 1] > half(v[0])) || all_corners(&|v| v[i + 1] < -half(v[0]))
            });
        // Rays that start beside the origin pass closer to the box than the origin is.
        let start_radius = self.start[0].hypot(self.start[1]);
        let nearest = (bounds.distance(self.origin.into()) - start_radius).max(0.0);
        if is_hidden || nearest > self.far {
            return None;
        }
        let farthest = corners.iter().map(|v| v.length()).fold(0.0, f64::max);
        let coordinate_error = self.rounding + 2e-7 * farthest.min(self.far);
        let pixel = self.pixel[0] + self.pixel[1] * nearest;
        let size = self.start[1] + self.growth[1] * nearest;
        Some(ErrorScale {
            coordinate_errors: [coordinate_error; 3],
            unit: pixel,
            max_half_diagonal: size / 2.0,
        })
    }
}
