//! Rays, and the first place at which the value really changes its sign.
//!
//! A ray goes on by radii within which the sign is proved to stay. Some formulas leave only a guess
//! of such a radius: then it goes by the guess, and no farther than a share of the whole. A piece
//! that two radii do not cover is halved, the nearer half first.

use super::point::{Point, across, beyond, magnitude, norm};
use super::tree::Tree;

/// The longest step on a guess, as a share of the range.
const MAX_GUESSED_STEP_SHARE: f64 = 1e-3;
/// The most points of a ray that are looked at.
const MAX_PROBES_PER_RAY: usize = 500_000;
/// The most of them that are too near a surface to be decided.
const MAX_NEAR_PROBES_PER_RAY: usize = 5_000;
/// The length of a step in known radii: the next radius is expected to cover the rest.
const DEFAULT_STEP_RADII: f64 = 1.5;
/// The distance to a surface within which a passing ray is undecided, by size of coordinates.
const MAX_GRAZING_DISTANCE_PER_SIZE: f64 = 1e-6;
/// The shortest length that is halved in search of a root, by size of coordinates.
const MIN_INTERVAL_LENGTH_PER_SIZE: f64 = 1e-7;
/// The largest depth that is noise of `f64`, by size of coordinates and slope.
const MAX_NOISE_DEPTH_PER_SIZE: f64 = 1e-9;
/// The length over which slopes are taken, by size of coordinates.
const DEFAULT_SLOPE_LENGTH_PER_SIZE: f64 = 1e-7;
/// The largest difference of slopes to both sides of a place on no edge, by the whole slope.
const MAX_SLOPE_DIFFERENCE_SHARE: f64 = 0.02;

/// The end of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trace {
    /// A surface.
    Hit {
        /// The ray's parameter there.
        t: f64,
        /// The unit normal, out of the solid, or none on edges.
        normal: Option<Point>,
        /// Set if the ray comes from inside, and so sees the surface from behind.
        inside: bool,
    },
    /// Nothing within the range.
    Miss,
    /// A surface that it touches or passes too closely, or that cannot be decided.
    Undecided {
        /// The ray's parameter there.
        t: f64,
    },
}

/// A place on a ray.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The length of the ray up to it.
    s: f64,
    /// The value, with a sign by which it is positive as long as the way is free.
    value: f64,
    safe: f64,
    guess: f64,
}

/// A ray through a tree.
pub(super) struct Ray<'t> {
    tree: &'t Tree,
    origin: Point,
    /// The direction, of length one.
    direction: Point,
    /// The length of the direction as it was given.
    speed: f64,
    /// The begin and the end of the range, as lengths.
    start: f64,
    end: f64,
    /// 1 for a ray that starts outside, −1 for one that starts inside.
    sign: f64,
    /// The longest step on a guess.
    longest: f64,
    /// The largest coordinate where the range begins.
    size: f64,
}

impl<'t> Ray<'t> {
    /// The ray from an origin along a direction, between two of its parameters.
    pub(super) fn new(tree: &'t Tree, origin: Point, direction: Point, range: [f64; 2]) -> Self {
        let speed = norm(direction).max(f64::MIN_POSITIVE);
        let mut ray = Self {
            tree,
            origin,
            direction: direction.map(|v| v / speed),
            speed,
            start: range[0] * speed,
            end: range[1] * speed,
            sign: 1.0,
            longest: 0.0,
            size: 0.0,
        };
        ray.size = magnitude(ray.point(ray.start));
        let first = tree.value(tree.root, ray.point(ray.start));
        if first < 0.0 {
            ray.sign = -1.0;
        }
        ray.clip();
        ray.longest = (ray.end - ray.start).max(0.0) * MAX_GUESSED_STEP_SHARE;
        ray
    }

    /// Leaves out the pieces outside of the box around everything.
    fn clip(&mut self) {
        let extent = &self.tree.node(self.tree.root).extent;
        let ends = extent.low.iter().chain(&extent.high).map(|v| v.abs());
        let largest = ends.filter(|v| v.is_finite()).fold(self.size, f64::max);
        let slack = MAX_GRAZING_DISTANCE_PER_SIZE * 10.0 * largest;
        for axis in 0..3 {
            let (from, along) = (self.origin[axis], self.direction[axis]);
            let (low, high) = (extent.low[axis] - slack, extent.high[axis] + slack);
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
        beyond(self.origin, self.direction, s)
    }

    fn value(&self, p: Point) -> f64 {
        self.sign * self.tree.value(self.tree.root, p)
    }

    fn place(&self, s: f64) -> Place {
        let probe = self
            .tree
            .probe(self.tree.root, self.point(s), self.longest / 4.0);
        Place {
            s,
            value: self.sign * probe.value,
            safe: probe.safe,
            guess: probe.guess,
        }
    }

    /// The distance that counts as touching at a point.
    fn grazing(&self, p: Point) -> f64 {
        MAX_GRAZING_DISTANCE_PER_SIZE * self.size.max(magnitude(p))
    }

    /// The size of coordinates at a point, as far as rounding is concerned.
    fn local_size(&self, p: Point) -> f64 {
        magnitude(p).max(1e-3 * self.size)
    }

    /// The steepest slope along the axes to either side of a point.
    fn slope(&self, p: Point) -> f64 {
        let [ahead, behind] = self.slopes(p);
        magnitude(ahead).max(magnitude(behind))
    }

    /// The slopes along the axes ahead of a point and behind it.
    fn slopes(&self, p: Point) -> [Point; 2] {
        let length =
            DEFAULT_SLOPE_LENGTH_PER_SIZE * self.size.max(magnitude(p)).max(f64::MIN_POSITIVE);
        let middle = self.value(p);
        let slope = |axis: usize, side: f64| {
            let mut q = p;
            q[axis] += side * length;
            side * (self.value(q) - middle) / (q[axis] - p[axis]).abs()
        };
        [1.0, -1.0].map(|side| [0, 1, 2].map(|axis| slope(axis, side)))
    }

    /// Tells if a place is behind a surface by more than noise.
    fn is_behind(&self, place: Place) -> bool {
        if place.value >= 0.0 {
            return false;
        }
        let p = self.point(place.s);
        let noise = MAX_NOISE_DEPTH_PER_SIZE * self.local_size(p);
        place.value < -noise || place.value < -noise * self.slope(p)
    }

    /// Tells if there is no surface between two places, neither of which is behind one.
    fn is_free(&self, a: Place, b: Place) -> bool {
        let length = b.s - a.s;
        a.safe + b.safe >= length || length <= self.longest && a.guess + b.guess >= length
    }

    /// The first surface that the ray meets.
    pub(super) fn trace(&self) -> Trace {
        if self.start >= self.end {
            return Trace::Miss;
        }
        let mut here = self.place(self.start);
        let mut ahead: Vec<Place> = Vec::with_capacity(64);
        // The length at which the ray came near a surface that it has not left yet.
        let mut near: Option<f64> = None;
        let mut near_probes = 0;
        for _ in 0..MAX_PROBES_PER_RAY {
            let p = self.point(here.s);
            let shortest = MIN_INTERVAL_LENGTH_PER_SIZE * self.local_size(p);
            let Some(&next) = ahead.last() else {
                if here.s >= self.end {
                    return match near {
                        Some(from) => self.passed(from, here.s).unwrap_or(Trace::Miss),
                        None => Trace::Miss,
                    };
                }
                let guess = (DEFAULT_STEP_RADII * here.guess).min(self.longest);
                let step = (DEFAULT_STEP_RADII * here.safe).max(guess).max(shortest);
                ahead.push(self.place((here.s + step).min(self.end)));
                continue;
            };
            let is_short = next.s - here.s <= shortest;
            let is_behind = self.is_behind(next);
            if is_behind && is_short {
                return self.hit(here, next);
            }
            if is_short || !is_behind && self.is_free(here, next) {
                ahead.pop();
                let distance = next.safe.max(next.guess);
                let is_near = distance <= self.grazing(self.point(next.s));
                near_probes += usize::from(is_near);
                if near_probes > MAX_NEAR_PROBES_PER_RAY {
                    break;
                }
                match (near, is_near) {
                    (None, true) => near = Some(here.s),
                    (Some(from), false) => {
                        near = None;
                        if let Some(grazing) = self.passed(from, next.s) {
                            return grazing;
                        }
                    }
                    _ => {}
                }
                here = next;
            } else {
                ahead.push(self.place(0.5 * (here.s + next.s)));
            }
        }
        self.undecided(here.s)
    }

    fn undecided(&self, s: f64) -> Trace {
        Trace::Undecided { t: s / self.speed }
    }

    /// A verdict on a surface that the ray came near to between two lengths, and did not enter.
    fn passed(&self, from: f64, to: f64) -> Option<Trace> {
        let bottom = lowest(|s| self.value(self.point(s)), from, to);
        let p = self.point(bottom);
        // If the value is zero all around, faces touch and there is nothing to meet.
        let noise = MAX_NOISE_DEPTH_PER_SIZE * self.local_size(p);
        let beside = self.beside(p, 2.0 * self.grazing(p));
        let is_grazing = beside.into_iter().any(|q| self.value(q) < -2.0 * noise);
        is_grazing.then(|| self.undecided(bottom))
    }

    /// Points around one of the ray's.
    fn beside(&self, p: Point, radius: f64) -> [Point; 8] {
        let [u, v] = across(self.direction);
        [0, 1, 2, 3, 4, 5, 6, 7].map(|at| {
            let (sine, cosine) = (f64::from(at) * std::f64::consts::FRAC_PI_4).sin_cos();
            beyond(beyond(p, u, radius * cosine), v, radius * sine)
        })
    }

    /// The hit between two places, the second of which is behind a surface.
    fn hit(&self, here: Place, behind: Place) -> Trace {
        let (mut low, mut high) = (here.s, behind.s);
        // If the first place is as good as on the surface, the root lies a little before it.
        let shortest = MIN_INTERVAL_LENGTH_PER_SIZE * self.local_size(self.point(low));
        let before = [0.0, 0.25, 1.0, 4.0, 16.0, 64.0, 256.0, 1024.0];
        let mut before = before.iter().map(|lengths| low - lengths * shortest);
        let is_outside = |s: f64| self.value(self.point(s)) > 0.0;
        let outside = before.find(|&s| s >= self.start && is_outside(s));
        low = outside.unwrap_or(low);
        while high - low > 0.0 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            let is_free = match outside {
                Some(_) => is_outside(middle),
                None => !self.is_behind(self.place(middle)),
            };
            if is_free {
                low = middle;
            } else {
                high = middle;
            }
        }
        let s = 0.5 * (low + high);
        let p = self.point(s);
        if !self.is_firm(s, self.grazing(p)) {
            return self.undecided(s);
        }
        Trace::Hit {
            t: s / self.speed,
            normal: self.normal(p),
            inside: self.sign < 0.0,
        }
    }

    /// Tells if rays that run this far beside this one go into the same surface.
    fn is_firm(&self, s: f64, grazing: f64) -> bool {
        let slope = self.slope(self.point(s));
        let (mut deepest, mut depth) = (s, 0.0);
        let mut way = grazing / 1024.0;
        while s + way <= self.end {
            let value = self.value(self.point(s + way));
            if value < -4.0 * grazing * slope {
                return true;
            }
            if -value <= depth {
                break;
            }
            (deepest, depth) = (s + way, -value);
            way *= 2.0;
        }
        // The surface may be askew: how far before or behind it, rays beside this one meet it.
        let reach = (deepest - s) + 4.0 * grazing * (slope * (deepest - s) / depth).min(1e3);
        let p = self.point(deepest);
        let beside = self.beside(p, grazing);
        depth > 0.0
            && beside.into_iter().all(|q| {
                let along = |by: f64| self.value(beyond(q, self.direction, by));
                along(0.0) < 0.0 || along(lowest(along, -reach, reach)) < 0.0
            })
    }

    /// The normal at a point, or none if slopes to both sides differ.
    fn normal(&self, p: Point) -> Option<Point> {
        let [ahead, behind] = self.slopes(p);
        let mean = [0, 1, 2].map(|i| 0.5 * (ahead[i] + behind[i]));
        let length = norm(mean);
        let differs = |i: usize| (ahead[i] - behind[i]).abs() > MAX_SLOPE_DIFFERENCE_SHARE * length;
        let is_edge = length == 0.0 || !length.is_finite() || (0..3).any(differs);
        (!is_edge).then(|| mean.map(|v| self.sign * v / length))
    }
}

/// The place at which a function that falls and then rises is least, by thirds.
fn lowest(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
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
