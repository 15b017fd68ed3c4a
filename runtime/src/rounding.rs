//! How far rounding may move what is seen: running error bounds ([`sdfc_vm::rounding`]) for all of a
//! scene's surface, and what they come to in pixels.
//!
//! Coordinates count with their own rounding: within the bounds with half a unit in their last place,
//! as points have that are given in `f32`, and in the picture with what marching takes rays to be off
//! by ([`rounding_at`](sdfc_shaders::marching::rounding_at)).

mod search;

pub use search::Worst;

use crate::frame::{FieldFacts, Picture, RenderSettings, prepare};
use crate::settings::facts;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::interval::Interval;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::rounding::bound;
use search::{Found, Gauge, error_at, worst};

/// How far from the origin [`Rounding::afar`] is told.
pub const AFAR: f64 = 1e4;

/// How far off `f32` is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounding {
    /// The field, wherever there may be a surface within the scene's bounds, in scene units; `None`
    /// where these have no end, or hold nothing.
    pub within: Option<Worst>,
    /// The field at [`AFAR`] from the origin, in some directions from there; infinite where nothing is
    /// known.
    pub afar: f64,
    /// What the camera may see of a surface, hidden or not, in pixels of the picture; `None` where
    /// that is nothing.
    pub seen: Option<Worst>,
}

/// How far off `f32` is in a module, after [`Module::update`] which gave `outputs`, and in the picture
/// that the settings describe. It takes some ten thousand instructions, and more for long programs.
pub fn rounding(module: &Module, outputs: &[f64], settings: &RenderSettings) -> Rounding {
    let facts = facts(module, outputs);
    let program = &module.distance;
    let space = flat(facts.bounds, settings.plane);
    let within = space.is_finite().then(|| {
        let coarse = space.half_diagonal() / 4.0;
        worst(program, &space, Found::default(), |place| {
            Some(Gauge {
                off: place.map(|side| side.magnitude() * HALF_UNIT),
                unit: 1.0,
                coarse,
            })
        })
    });
    Rounding {
        within: within.flatten(),
        afar: at(program, AFAR, settings.plane),
        seen: in_picture(program, settings, &facts),
    }
}

/// [`Rounding::seen`] alone.
pub fn seen(module: &Module, outputs: &[f64], settings: &RenderSettings) -> Option<Worst> {
    in_picture(&module.distance, settings, &facts(module, outputs))
}

/// How far off rounding may be at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Here {
    /// The field, in scene units; infinite where nothing is known.
    pub field: f64,
    /// By so many pixels of the picture that may move a surface there.
    pub pixels: f64,
    /// Whether `f32` may decide otherwise than real numbers there, as at a seam of repeated space: the
    /// numbers hold for either side, and not for the difference of the two.
    pub torn: bool,
}

/// How far off `f32` is at a point that the camera sees, in a module after [`Module::update`] which gave
/// `outputs`. The point counts as rounded as the end of a ray is.
pub fn here(module: &Module, outputs: &[f64], settings: &RenderSettings, point: [f64; 3]) -> Here {
    let camera = Camera::of(settings, &prepare(settings, &facts(module, outputs)));
    let from: [f64; 3] = std::array::from_fn(|i| point[i] - camera.origin[i]);
    let way = dot(from, from).sqrt().min(camera.far);
    let off = camera.rounding + 2e-7 * way;
    let bound = bound(&module.distance, point.map(Interval::point), [off; 3]);
    let ahead = dot(from, camera.axes[0]).max(0.0);
    let pixel = camera.pixel[0] + camera.pixel[1] * ahead;
    Here {
        field: bound.error,
        pixels: bound.error / pixel.max(f64::MIN_POSITIVE),
        torn: bound.torn,
    }
}

/// What the camera may see: first where some rays end, then all that it may see at all.
fn in_picture(program: &Program, settings: &RenderSettings, facts: &FieldFacts) -> Option<Worst> {
    let camera = Camera::of(settings, &prepare(settings, facts));
    let region = flat(facts.bounds.common(&camera.reach()), settings.plane);
    let gauge = |place: &[Interval; 3]| camera.gauge(place);
    let mut found = Found::default();
    let rays = if settings.plane { 0 } else { RAYS };
    for ray in 0..rays {
        let Some(end) = camera.march(program, ray) else {
            continue;
        };
        let place = end.map(Interval::point);
        if let Some(gauge) = gauge(&place) {
            let bound = bound(program, place, gauge.off);
            let error = error_at(program, end, &bound).unwrap_or_default();
            found = found.or(error.per(gauge.unit));
        }
    }
    let finite = region.is_finite();
    finite
        .then(|| worst(program, &region, found, gauge))
        .flatten()
}

/// A box of space, or of the plane where a figure is.
fn flat(mut bounds: Bounds, plane: bool) -> Bounds {
    if plane {
        (bounds.min[2], bounds.max[2]) = (0.0, 0.0);
    }
    bounds
}

/// How many rays look for a surface, and how many steps each takes at most.
const RAYS: u32 = 12;
const STEPS: u32 = 64;
/// The most pixels from a surface at which a ray out of steps counts as on it.
const BESIDE: f64 = 4.0;

/// Half a unit in the last place, as a share of a number.
const HALF_UNIT: f64 = 1.0 / 16_777_216.0;

/// The largest bound at this distance from the origin, towards the corners, edges and faces of a cube
/// around it that is turned a little: its own axes are where much is folded.
fn at(program: &Program, distance: f64, plane: bool) -> f64 {
    let mut most = 0.0_f64;
    for i in 0..27 {
        let [x, y, z] = [i % 3, i / 3 % 3, i / 9].map(|step| f64::from(step) - 1.0);
        let turned = [x + 0.11 * y - 0.07 * z, y - 0.11 * x, z + 0.07 * x];
        let turned = if plane {
            [turned[0], turned[1], 0.0]
        } else {
            turned
        };
        let length = turned.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length > 0.0 {
            let p = turned.map(|v| v / length * distance);
            let off = p.map(|v| v.abs() * HALF_UNIT);
            most = most.max(bound(program, p.map(Interval::point), off).error);
        }
    }
    most
}

/// Where rays go, and how wide a pixel is.
struct Camera {
    origin: [f64; 3],
    /// The direction of the middle of the picture, and those to the right and up.
    axes: [[f64; 3]; 3],
    /// Half of the picture's width and height where rays start.
    start: [f64; 2],
    /// By how much these grow per unit of the way ahead.
    growth: [f64; 2],
    /// A pixel's height where rays start, and its growth along a ray.
    pixel: [f64; 2],
    /// What the start of a ray is off by.
    rounding: f64,
    far: f64,
}

impl Camera {
    fn of(settings: &RenderSettings, picture: &Picture) -> Self {
        let u = &picture.uniforms;
        let wide = |v: [f32; 3]| v.map(f64::from);
        let length = |v: [f64; 3]| dot(v, v).sqrt();
        let [right, up] = [
            [wide(u.origin_right), wide(u.forward_right)],
            [wide(u.origin_up), wide(u.forward_up)],
        ];
        let direction = |[start, growth]: [[f64; 3]; 2]| {
            let both: [f64; 3] = std::array::from_fn(|i| start[i] + growth[i]);
            both.map(|v| v / length(both).max(1e-30))
        };
        let samples = f64::from(settings.aa.max(1));
        Self {
            origin: wide(u.origin),
            axes: [wide(u.forward), direction(right), direction(up)],
            start: [length(right[0]), length(up[0])],
            growth: [length(right[1]), length(up[1])],
            pixel: [u.footprint, u.footprint_growth].map(|half| 2.0 * samples * f64::from(half)),
            rounding: u.rounding.into(),
            far: u.far.into(),
        }
    }

    /// A box around all that rays reach.
    fn reach(&self) -> Bounds {
        let ahead = self.growth.map(|growth| growth * self.far);
        let aside = self.start[0] + self.start[1] + ahead[0] + ahead[1];
        let point = Bounds {
            min: self.origin,
            max: self.origin,
        };
        point.grown(self.far + aside)
    }

    /// The end on a surface of one of [`RAYS`], spread over the picture. A ray out of steps ends there if it is
    /// within some pixels of one.
    fn march(&self, program: &Program, ray: u32) -> Option<[f64; 3]> {
        // The golden ratio's multiples fill the picture evenly, from the bottom to the top.
        let across = (f64::from(ray) * 0.618_034).fract() * 1.9 - 0.95;
        let up = (f64::from(ray) + 0.5) / f64::from(RAYS) * 1.9 - 0.95;
        let aside = |extent: [f64; 2]| [extent[0] * across, extent[1] * up];
        let (start, growth) = (aside(self.start), aside(self.growth));
        let [forward, right, above] = self.axes;
        let from: [f64; 3] =
            std::array::from_fn(|i| self.origin[i] + right[i] * start[0] + above[i] * start[1]);
        let to: [f64; 3] =
            std::array::from_fn(|i| forward[i] + right[i] * growth[0] + above[i] * growth[1]);
        let length = dot(to, to).sqrt().max(1e-30);
        let place = |t: f64| std::array::from_fn(|i| from[i] + to[i] / length * t);
        let mut t = 0.0;
        let mut is_beside = false;
        for _ in 0..STEPS {
            let field = evaluate_f64(program, place(t)).abs();
            let pixel = self.pixel[0] + self.pixel[1] * t;
            if field <= 0.25 * pixel {
                return Some(place(t));
            }
            is_beside = field <= BESIDE * pixel;
            t += field;
            // What is no number ends a ray, too.
            let goes_on = t < self.far;
            if !goes_on {
                return None;
            }
        }
        is_beside.then(|| place(t))
    }

    /// What a box is measured by; `None` where no ray comes to it.
    fn gauge(&self, place: &[Interval; 3]) -> Option<Gauge> {
        let bounds = Bounds {
            min: place.map(|side| side.lo),
            max: place.map(|side| side.hi),
        };
        let views = bounds.corners().map(|corner| {
            let from: [f64; 3] = std::array::from_fn(|i| corner[i] - self.origin[i]);
            self.axes.map(|axis| dot(from, axis))
        });
        let beyond = |side: &dyn Fn(&[f64; 3]) -> bool| views.iter().all(side);
        let hidden = beyond(&|v| v[0] < 0.0)
            || (0..2).any(|i| {
                let half = |ahead: f64| self.start[i] + self.growth[i] * ahead;
                beyond(&|v| v[i + 1] > half(v[0])) || beyond(&|v| v[i + 1] < -half(v[0]))
            });
        let away = |i: usize| {
            let (below, above) = (
                bounds.min[i] - self.origin[i],
                self.origin[i] - bounds.max[i],
            );
            below.max(above).max(0.0)
        };
        let gap = [away(0), away(1), away(2)];
        // Rays that start beside the origin come nearer than it is.
        let aside = self.start[0].hypot(self.start[1]);
        let nearest = (dot(gap, gap).sqrt() - aside).max(0.0);
        if hidden || nearest > self.far {
            return None;
        }
        let farthest = views.iter().map(|&v| dot(v, v).sqrt()).fold(0.0, f64::max);
        let off = self.rounding + 2e-7 * farthest.min(self.far);
        let pixel = self.pixel[0] + self.pixel[1] * nearest;
        let size = self.start[1] + self.growth[1] * nearest;
        Some(Gauge {
            off: [off; 3],
            unit: pixel,
            coarse: size / 2.0,
        })
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
