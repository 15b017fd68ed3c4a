//! Rays, and the first point at which the value changes its sign.
//!
//! A ray advances by radii within which the sign is proved constant. Some formulas only yield an estimate
//! of such a radius. Then a step is at most a fixed fraction of the range. An interval that two radii do
//! not cover is halved, the nearer half first.

use super::point::{Point, max_coordinate, norm, orthonormal_pair, point_along};
use super::tree::ShapeTree;

/// Longest step by an estimated radius, as a fraction of the range.
const MAX_ESTIMATED_STEP_FRACTION: f64 = 1e-3;
/// Largest number of sampled points per ray.
const MAX_SAMPLES_PER_RAY: usize = 500_000;
/// Largest number of samples per ray that are too near a surface to be decided.
const MAX_UNDECIDED_SAMPLES_PER_RAY: usize = 5_000;
/// Length of a step in proved radii. The radius at the next point is expected to cover the remainder.
const STEP_RADII: f64 = 1.5;
/// Distance to a surface within which a passing ray is undecided, relative to the size of coordinates.
const MAX_GRAZING_DISTANCE_PER_SIZE: f64 = 1e-6;
/// Shortest interval that is halved in search of a root, relative to the size of coordinates.
const MIN_INTERVAL_LENGTH_PER_SIZE: f64 = 1e-7;
/// Largest depth attributed to rounding of `f64`, relative to the size of coordinates and the slope.
const MAX_ROUNDING_DEPTH_PER_SIZE: f64 = 1e-9;
/// Step of one-sided differences, relative to the size of coordinates.
const DIFFERENCE_STEP_PER_SIZE: f64 = 1e-7;
/// Largest difference of one-sided slopes away from edges, as a fraction of the gradient's length.
const MAX_SLOPE_DIFFERENCE_FRACTION: f64 = 0.02;

/// Result of tracing a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TraceOutcome {
    /// A surface was hit.
    Hit {
        /// Ray parameter at the hit.
        t: f64,
        /// Unit normal that points out of the solid, or `None` on edges.
        normal: Option<Point>,
        /// Set if the ray starts inside and so sees the surface from behind.
        inside: bool,
    },
    /// No surface within the range.
    Miss,
    /// A surface that the ray touches or passes too closely, or that cannot be decided.
    Undecided {
        /// Ray parameter at the undecided point.
        t: f64,
    },
}

/// Sample on a ray.
#[derive(Clone, Copy, Debug)]
struct RaySample {
    /// Length of the ray up to the sample.
    s: f64,
    /// Value, with a sign that makes it positive in front of the first surface.
    value: f64,
    proven_radius: f64,
    estimated_radius: f64,
}

/// A ray through a tree.
pub(super) struct OracleRay<'t> {
    tree: &'t ShapeTree,
    origin: Point,
    /// Unit direction.
    direction: Point,
    /// Length of the direction before normalization.
    direction_length: f64,
    /// Start and end of the range, as lengths.
    start: f64,
    end: f64,
    /// 1 for a ray that starts outside, −1 for one that starts inside.
    sign: f64,
    /// Longest step by an estimated radius.
    max_estimated_step: f64,
    /// Largest coordinate at the start of the range.
    start_magnitude: f64,
}

impl<'t> OracleRay<'t> {
    /// Creates the ray from an origin along a direction, between two of its parameters.
    pub(super) fn new(
        tree: &'t ShapeTree,
        origin: Point,
        direction: Point,
        range: [f64; 2],
    ) -> Self {
        let direction_length = norm(direction).max(f64::MIN_POSITIVE);
        let mut ray = Self {
            tree,
            origin,
            direction: direction.map(|v| v / direction_length),
            direction_length,
            start: range[0] * direction_length,
            end: range[1] * direction_length,
            sign: 1.0,
            max_estimated_step: 0.0,
            start_magnitude: 0.0,
        };
        ray.start_magnitude = max_coordinate(ray.point(ray.start));
        let start_value = tree.value(tree.root, ray.point(ray.start));
        if start_value < 0.0 {
            ray.sign = -1.0;
        }
        ray.clip();
        ray.max_estimated_step = (ray.end - ray.start).max(0.0) * MAX_ESTIMATED_STEP_FRACTION;
        ray
    }

    /// Clips the range to the box around the scene.
    fn clip(&mut self) {
        let bounds = &self.tree.node(self.tree.root).bounds;
        let ends = bounds.low.iter().chain(&bounds.high).map(|v| v.abs());
        let max_bound = ends
            .filter(|v| v.is_finite())
            .fold(self.start_magnitude, f64::max);
        let slack = MAX_GRAZING_DISTANCE_PER_SIZE * 10.0 * max_bound;
        for axis in 0..3 {
            let (from, along) = (self.origin[axis], self.direction[axis]);
            let (low, high) = (bounds.low[axis] - slack, bounds.high[axis] + slack);
            if along == 0.0 {
                if from < low || from > high {
                    self.end = self.start;
                }
                continue;
            }
            let ends = [(low - from) / along, (high - from) / along];
            self.start = self.start.max(ends[0].min(ends[1]));
            self.end = self.end.min(ends[0].max(ends[1]));
        }
    }

    fn point(&self, s: f64) -> Point {
        point_along(self.origin, self.direction, s)
    }

    fn value(&self, p: Point) -> f64 {
        self.sign * self.tree.value(self.tree.root, p)
    }

    fn sample(&self, s: f64) -> RaySample {
        let sample = self
            .tree
            .sample(self.tree.root, self.point(s), self.max_estimated_step / 4.0);
        RaySample {
            s,
            value: self.sign * sample.value,
            proven_radius: sample.proven_radius,
            estimated_radius: sample.estimated_radius,
        }
    }

    /// Returns the distance that counts as touching at a point.
    fn grazing_distance(&self, p: Point) -> f64 {
        MAX_GRAZING_DISTANCE_PER_SIZE * self.start_magnitude.max(max_coordinate(p))
    }

    /// Returns the size of coordinates at a point for rounding errors.
    fn local_magnitude(&self, p: Point) -> f64 {
        max_coordinate(p).max(1e-3 * self.start_magnitude)
    }

    /// Returns the largest one-sided slope along the axes at a point.
    fn max_slope(&self, p: Point) -> f64 {
        let [forward, backward] = self.one_sided_gradients(p);
        max_coordinate(forward).max(max_coordinate(backward))
    }

    /// Returns the slopes along the axes, forward and backward from a point.
    fn one_sided_gradients(&self, p: Point) -> [Point; 2] {
        let length = DIFFERENCE_STEP_PER_SIZE
            * self
                .start_magnitude
                .max(max_coordinate(p))
                .max(f64::MIN_POSITIVE);
        let centre_value = self.value(p);
        let one_sided_slope = |axis: usize, side: f64| {
            let mut q = p;
            q[axis] += side * length;
            side * (self.value(q) - centre_value) / (q[axis] - p[axis]).abs()
        };
        [1.0, -1.0].map(|side| [0, 1, 2].map(|axis| one_sided_slope(axis, side)))
    }

    /// Reports whether a sample is past a surface by more than rounding.
    fn is_past_surface(&self, place: RaySample) -> bool {
        if place.value >= 0.0 {
            return false;
        }
        let p = self.point(place.s);
        let noise = MAX_ROUNDING_DEPTH_PER_SIZE * self.local_magnitude(p);
        place.value < -noise || place.value < -noise * self.max_slope(p)
    }

    /// Reports whether no surface is between two samples, neither of which is past one.
    fn is_free(&self, a: RaySample, b: RaySample) -> bool {
        let length = b.s - a.s;
        a.proven_radius + b.proven_radius >= length
            || length <= self.max_estimated_step
                && a.estimated_radius + b.estimated_radius >= length
    }

    /// Returns the first surface that the ray hits.
    pub(super) fn trace(&self) -> TraceOutcome {
        if self.start >= self.end {
            return TraceOutcome::Miss;
        }
        let mut current = self.sample(self.start);
        let mut pending: Vec<RaySample> = Vec::with_capacity(64);
        // Length at which the ray came near a surface, while it is near.
        let mut near_from: Option<f64> = None;
        let mut undecided_samples = 0;
        for _ in 0..MAX_SAMPLES_PER_RAY {
            let p = self.point(current.s);
            let shortest = MIN_INTERVAL_LENGTH_PER_SIZE * self.local_magnitude(p);
            let Some(&next) = pending.last() else {
                if current.s >= self.end {
                    return match near_from {
                        Some(from) => self
                            .grazing_outcome(from, current.s)
                            .unwrap_or(TraceOutcome::Miss),
                        None => TraceOutcome::Miss,
                    };
                }
                let estimated_radius =
                    (STEP_RADII * current.estimated_radius).min(self.max_estimated_step);
                let step = (STEP_RADII * current.proven_radius)
                    .max(estimated_radius)
                    .max(shortest);
                pending.push(self.sample((current.s + step).min(self.end)));
                continue;
            };
            let is_short = next.s - current.s <= shortest;
            let is_behind = self.is_past_surface(next);
            if is_behind && is_short {
                return self.hit(current, next);
            }
            if is_short || !is_behind && self.is_free(current, next) {
                pending.pop();
                let distance = next.proven_radius.max(next.estimated_radius);
                let is_near = distance <= self.grazing_distance(self.point(next.s));
                undecided_samples += usize::from(is_near);
                if undecided_samples > MAX_UNDECIDED_SAMPLES_PER_RAY {
                    break;
                }
                match (near_from, is_near) {
                    (None, true) => near_from = Some(current.s),
                    (Some(from), false) => {
                        near_from = None;
                        if let Some(grazing) = self.grazing_outcome(from, next.s) {
                            return grazing;
                        }
                    }
                    _ => {}
                }
                current = next;
            } else {
                pending.push(self.sample(0.5 * (current.s + next.s)));
            }
        }
        self.undecided(current.s)
    }

    fn undecided(&self, s: f64) -> TraceOutcome {
        TraceOutcome::Undecided {
            t: s / self.direction_length,
        }
    }

    /// Decides about a surface that the ray came near to between two lengths, and did not enter.
    fn grazing_outcome(&self, from: f64, to: f64) -> Option<TraceOutcome> {
        let minimum = ternary_minimum(|s| self.value(self.point(s)), from, to);
        let p = self.point(minimum);
        // If the value is zero all around, faces touch and there is no surface.
        let noise = MAX_ROUNDING_DEPTH_PER_SIZE * self.local_magnitude(p);
        let around = self.circle_around(p, 2.0 * self.grazing_distance(p));
        let is_grazing = around.into_iter().any(|q| self.value(q) < -2.0 * noise);
        is_grazing.then(|| self.undecided(minimum))
    }

    /// Returns 8 points on a circle around a point of the ray.
    fn circle_around(&self, p: Point, radius: f64) -> [Point; 8] {
        let [u, v] = orthonormal_pair(self.direction);
        [0, 1, 2, 3, 4, 5, 6, 7].map(|index| {
            let (sine, cosine) = (f64::from(index) * std::f64::consts::FRAC_PI_4).sin_cos();
            point_along(point_along(p, u, radius * cosine), v, radius * sine)
        })
    }

    /// Returns the hit between two samples, the second of which is past a surface.
    fn hit(&self, current: RaySample, past: RaySample) -> TraceOutcome {
        let (mut low, mut high) = (current.s, past.s);
        // If the first sample is practically on the surface, the root is slightly before it.
        let shortest = MIN_INTERVAL_LENGTH_PER_SIZE * self.local_magnitude(self.point(low));
        let backsteps = [0.0, 0.25, 1.0, 4.0, 16.0, 64.0, 256.0, 1024.0];
        let mut backsteps = backsteps.iter().map(|lengths| low - lengths * shortest);
        let is_outside = |s: f64| self.value(self.point(s)) > 0.0;
        let outside = backsteps.find(|&s| s >= self.start && is_outside(s));
        low = outside.unwrap_or(low);
        while high - low > 0.0 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            let is_free = match outside {
                Some(_) => is_outside(middle),
                None => !self.is_past_surface(self.sample(middle)),
            };
            if is_free {
                low = middle;
            } else {
                high = middle;
            }
        }
        let s = 0.5 * (low + high);
        let p = self.point(s);
        if !self.is_robust_hit(s, self.grazing_distance(p)) {
            return self.undecided(s);
        }
        TraceOutcome::Hit {
            t: s / self.direction_length,
            normal: self.normal(p),
            inside: self.sign < 0.0,
        }
    }

    /// Reports whether parallel rays at this distance hit the same surface.
    fn is_robust_hit(&self, s: f64, grazing: f64) -> bool {
        let max_slope = self.max_slope(self.point(s));
        let (mut deepest, mut depth) = (s, 0.0);
        let mut step = grazing / 1024.0;
        while s + step <= self.end {
            let value = self.value(self.point(s + step));
            if value < -4.0 * grazing * max_slope {
                return true;
            }
            if -value <= depth {
                break;
            }
            (deepest, depth) = (s + step, -value);
            step *= 2.0;
        }
        // The surface may be oblique: parallel rays may hit it this far before or after the point.
        let search_length =
            (deepest - s) + 4.0 * grazing * (max_slope * (deepest - s) / depth).min(1e3);
        let p = self.point(deepest);
        let around = self.circle_around(p, grazing);
        depth > 0.0
            && around.into_iter().all(|q| {
                let along = |offset: f64| self.value(point_along(q, self.direction, offset));
                along(0.0) < 0.0
                    || along(ternary_minimum(along, -search_length, search_length)) < 0.0
            })
    }

    /// Returns the normal at a point, or `None` if one-sided slopes differ.
    fn normal(&self, p: Point) -> Option<Point> {
        let [forward, backward] = self.one_sided_gradients(p);
        let mean = [0, 1, 2].map(|i| 0.5 * (forward[i] + backward[i]));
        let length = norm(mean);
        let differs =
            |i: usize| (forward[i] - backward[i]).abs() > MAX_SLOPE_DIFFERENCE_FRACTION * length;
        let is_edge = length == 0.0 || !length.is_finite() || (0..3).any(differs);
        (!is_edge).then(|| mean.map(|v| self.sign * v / length))
    }
}

/// Returns the position of the minimum of a function that decreases and then increases, by ternary search.
fn ternary_minimum(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..60 {
        let third = (high - low) / 3.0;
        if f(low + third) <= f(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    0.5 * (low + high)
}
