//! The distance to an ellipsoid.
//!
//! The nearest point to `p` on the ellipsoid with the radii `r` is `r² p / (t + r²)`, for the `t` that puts
//! this point on the ellipsoid (D. Eberly, *Distance from a Point to an Ellipse, an Ellipsoid, or a
//! Hyperellipsoid*, 2013). Halley's method finds it on one over the norm of that point, a function that is
//! concave and nearly linear (M. Hebden, 1973). The initial `t` is that of the tangent plane below `p`, so
//! most points need one step or two. A step is the last one if it changes no denominator by more than 2 %.
//!
//! The distance is then computed along the normal `n` at that point, as `p · n − |r n|`. Along any
//! direction, this is at most the distance to a convex solid, inside and outside. Its error is the square
//! of the direction's error. The root in `|r n|` is that of a number near one. It is replaced by the
//! tangent of the root there, which is no less. So the value is a lower bound after any number of steps.
//!
//! For radii that differ by up to 1,000 to 1, the value is exact up to rounding outside. Inside, it is exact
//! to a depth of half the smallest radius of curvature. Near the points where opposite sides are equally
//! near, it may be too small by 0.2 % of the smallest radius. For larger ratios it may be far too small near
//! a rim, by half of the distance at 10,000 to 1.

pub(crate) mod interval;
pub(crate) mod lanes;

use crate::real::{Real, Vector3, lit};

/// Maximum number of Halley steps.
const MAX_STEPS: usize = 6;
/// The largest change of `t + r²` by a last step, as a fraction of its value for the smallest radius. A
/// step leaves the cube of the previous change as its error, and the distance depends on the square of
/// that.
const MAX_LAST_STEP_FRACTION: f64 = 0.02;
/// The smallest and the largest factor applied to Newton's step.
const STEP_RANGE: [f64; 2] = [2.0 / 3.0, 3.0];
/// The smallest value of `t + r²`, as a fraction of `r²`.
const MIN_DENOMINATOR_FRACTION: f64 = 1e-3;
/// The smallest radius for which `t` is searched, as a fraction of the largest.
const MIN_RADIUS: f64 = 1e-6;
/// The exponent of the farthest distance for which `t` is searched, in units of the largest radius. From
/// there, the nearest point is in the direction of the centre, up to rounding.
const MAX_DISTANCE_EXPONENT: f64 = 20.0;
/// The largest exponent of an `f32`.
const MAX_EXPONENT: f64 = 127.0;
/// The norm of the nearest point, which is one, reduced by its rounding error.
const MIN_NORM: f64 = 1.0 - 1e-6;
/// The largest shortfall of the value below the distance inside, as a fraction of the smallest radius.
const MAX_INNER_SHORTFALL: f64 = 2e-3;
/// The largest shortfall outside, as a fraction of the distance, if the ratio of radii exceeds [`MAX_EXACT_RATIO`].
const MAX_OUTER_SHORTFALL: f64 = 0.99;
/// The largest ratio of radii for which the value outside is the exact distance.
const MAX_EXACT_RATIO: f64 = 1000.0;
/// The largest shortfall in all cases and for any precision: the error left by the last step. It is a
/// fraction of the distance and the largest radius.
const MAX_STEP_RESIDUAL: f64 = 1e-10;
/// The error of `t` after the last step, as a fraction of `1 + |t|` in units of the largest radius.
const MULTIPLIER_ERROR: f64 = 4e-6;
/// The smallest divisor.
const MIN_DIVISOR: f64 = 1e-37;
/// The smallest length of vectors that have a direction; its square is representable in `f32`.
const MIN_LENGTH: f64 = 1e-18;

/// Returns the distance and its gradient.
#[inline(always)]
pub fn ellipsoid<R: Real>(p: R::Vec3, r: R::Vec3) -> (R, R::Vec3) {
    let (q, r) = (p.abs().named("q"), lengths::<R>(r));
    let unit = NormalizedEllipsoid::<R>::new(q, r);
    let t = unit.multiplier();
    let nearest = unit.nearest(t);
    let normal = nearest.normal.named("normal");
    (q.dot(normal) - nearest.support, facing::<R>(p, normal))
}

/// Returns the normal on the side of `p`, given the one of the point with non-negative coordinates.
#[inline(always)]
fn facing<R: Real>(p: R::Vec3, normal: R::Vec3) -> R::Vec3 {
    let facing = |p: R, n: R| R::select(p.less(lit(0.0)), -n, n);
    R::Vec3::new(
        facing(p.x(), normal.x()),
        facing(p.y(), normal.y()),
        facing(p.z(), normal.z()),
    )
}

/// Returns the magnitudes of the radii, none of them zero.
#[inline(always)]
fn lengths<R: Real>(r: R::Vec3) -> R::Vec3 {
    r.abs().max(R::Vec3::splat(lit(1e-12))).named("lengths")
}

/// Returns the sum of the components.
#[inline(always)]
fn sum<R: Real>(a: R::Vec3) -> R {
    a.x() + a.y() + a.z()
}

#[inline(always)]
fn least<R: Real>(r: R::Vec3) -> R {
    r.x().min(r.y()).min(r.z())
}

/// A point with non-negative coordinates and an ellipsoid, in units of the largest radius.
#[derive(Clone, Copy)]
struct NormalizedEllipsoid<R: Real> {
    /// The point, whose coordinates are non-negative.
    q: R::Vec3,
    /// The radii, of which the largest is 1.
    r: R::Vec3,
    /// The squares of the radii.
    squares: R::Vec3,
    /// One over the radii.
    inverse: R::Vec3,
    /// The square of the smallest radius.
    least: R,
    /// One over the square of the smallest radius.
    sharpness: R,
    /// The factor from the original unit to this one.
    scale: R,
    /// The largest radius, in the original unit.
    largest: R,
}

/// A vector in the direction of the normal at a nearest point: that point over the squares of the radii.
#[derive(Clone, Copy)]
struct NormalVector<R: Real> {
    /// The vector; it may lack a component along the axis of the smallest radius.
    v: R::Vec3,
    /// The amount by which its squared norm is below that of a nearest point; positive if a component is
    /// missing.
    deficit: R,
}

/// The nearest point.
#[derive(Clone, Copy)]
struct Nearest<R: Real> {
    /// The unit normal at the nearest point.
    normal: R::Vec3,
    /// The distance of its tangent plane from the centre, or slightly more.
    support: R,
}

/// The search range of `t`.
#[derive(Clone, Copy)]
struct Search<R: Real> {
    /// The radii times the point.
    a: R::Vec3,
    low: R,
    high: R,
}

impl<R: Real> NormalizedEllipsoid<R> {
    #[inline(always)]
    fn new(q: R::Vec3, r: R::Vec3) -> Self {
        let one = lit::<R>(1.0);
        let largest = r.max_component().named("largest");
        let scale = (one / largest).named("scale");
        let r = (r * scale).max(R::Vec3::splat(lit(MIN_RADIUS)));
        let r = r.named("radii");
        let inverse = R::Vec3::new(one / r.x(), one / r.y(), one / r.z()).named("inverse");
        let smallest = least::<R>(r).named("smallest");
        let sharpest = inverse.max_component().named("sharpest");
        let unit = Self {
            q,
            r,
            squares: (r * r).named("squares"),
            inverse,
            least: smallest * smallest,
            sharpness: sharpest * sharpest,
            scale,
            largest,
        };
        unit.with_point(q)
    }

    /// Returns the same ellipsoid with another point, given in the original unit.
    #[inline(always)]
    fn with_point(&self, q: R::Vec3) -> Self {
        // Far away, the normal depends on the direction alone.
        let exponent = q.max_component().max(lit(MIN_DIVISOR)).exponent();
        let nearer = (lit::<R>(MAX_DISTANCE_EXPONENT) - exponent).min(lit(MAX_EXPONENT));
        Self {
            q: (q * self.scale.min(nearer.power_of_two())).named("place"),
            ..*self
        }
    }

    /// Returns one over `t + r²`, which is kept above zero, with a single division.
    #[inline(always)]
    fn reciprocals(&self, t: R) -> R::Vec3 {
        let m = R::Vec3::splat(t) + self.squares;
        let m = m
            .max(self.squares * lit::<R>(MIN_DENOMINATOR_FRACTION))
            .named("m");
        let others = R::Vec3::new(m.y() * m.z(), m.z() * m.x(), m.x() * m.y());
        let others = others.named("others");
        (others * (lit::<R>(1.0) / (m.x() * others.x()))).named("shares")
    }

    /// Returns the search range of the `t` of the nearest point, and an initial value.
    #[inline(always)]
    fn search(&self) -> (Search<R>, R) {
        let one = lit::<R>(1.0);
        let a = (self.r * self.q).named("a");
        // In units of the radii, no component of the nearest point exceeds one.
        let low = (a - self.squares).max_component();
        let low = low
            .max(self.least * lit(MIN_DENOMINATOR_FRACTION - 1.0))
            .named("low");
        // The sum is an upper bound of the length.
        let high = (sum::<R>(a) - self.least).max(low).named("high");
        // The tangent plane of the similar ellipsoid through the point.
        let v = (self.q * self.inverse).named("seen");
        let w = (v * self.inverse).named("steepness");
        let (square, slope) = (v.dot(v).named("square"), w.dot(w));
        let tangent = (square.sqrt() - one) * (square / slope.max(lit(MIN_DIVISOR)));
        let first = tangent.max(low).min(high).named("t");
        (Search { a, low, high }, first)
    }

    /// Returns the next `t` by a Halley step.
    #[inline(always)]
    fn step(&self, search: &Search<R>, t: R) -> R {
        let shares = self.reciprocals(t);
        let u = (search.a * shares).named("u");
        let w = (u * u).named("w");
        let norm = sum::<R>(w).named("norm");
        let steep = (w * shares).named("steep");
        let slope = sum::<R>(steep).named("slope");
        let bend = sum::<R>(steep * shares);
        let square = (slope * slope).named("square");
        // The root of the norm is `(1 + 3 norm) / (3 + norm)` near one, and the norm is at most three.
        let excess = (norm - lit::<R>(1.0)).named("excess");
        let whole = (square * (norm + lit::<R>(3.0))).named("whole");
        let [short, long] = STEP_RANGE;
        let divisor = (whole + excess * lit(3.0) * (square - norm * bend))
            .max(whole * lit(1.0 / long))
            .min(whole * lit(1.0 / short));
        let step = norm * slope * excess * lit(2.0) / divisor.max(lit(MIN_DIVISOR));
        (t + step).max(search.low).min(search.high).named("t")
    }

    /// Reports whether a step from `t` to `next` was long enough to require another one.
    #[inline(always)]
    fn needs_step(&self, t: R, next: R) -> R::Bool {
        let small = (t.min(next) + self.least) * lit(MAX_LAST_STEP_FRACTION);
        small.less((next - t).abs())
    }

    /// Returns the `t` of the nearest point.
    #[inline(always)]
    fn multiplier(&self) -> R {
        let (search, first) = self.search();
        let mut t = self.step(&search, first);
        let mut goes_on = self.needs_step(first, t);
        for _ in 1..MAX_STEPS {
            let next = self.step(&search, t);
            let last = t;
            t = R::select(goes_on, next, last).named("t");
            goes_on = R::and(goes_on, self.needs_step(last, next));
        }
        t
    }

    /// Returns the nearest point.
    #[inline(always)]
    fn nearest(&self, t: R) -> Nearest<R> {
        self.completed(self.normal_vector(t))
    }

    /// Returns the vector in the direction of the normal, as far as the point determines it.
    #[inline(always)]
    fn normal_vector(&self, t: R) -> NormalVector<R> {
        let v = (self.q * self.reciprocals(t)).named("v");
        let u = (self.r * v).named("u");
        let lack = (lit::<R>(MIN_NORM * MIN_NORM) - u.dot(u)).named("lack");
        NormalVector { v, deficit: lack }
    }

    /// Completes the vector to that of the nearest point. Inside, near the plane across the axis of the
    /// smallest radius, the component along that axis is missing. If several radii are the smallest, it has
    /// the point's direction among their axes.
    #[inline(always)]
    fn completed(&self, short: NormalVector<R>) -> Nearest<R> {
        let NormalVector { v, deficit: lack } = short;
        let across = (lack.max(lit(0.0)) * self.sharpness).named("across");
        // One along the axes of the smallest radius, and zero along the others.
        let (zero, one) = (lit::<R>(0.0), lit::<R>(1.0));
        let smallest = |square: R| R::select(self.least.less(square), zero, one);
        let (x, y) = (smallest(self.squares.x()), smallest(self.squares.y()));
        let axes = R::Vec3::new(x, y, smallest(self.squares.z())).named("axes");
        let first = R::Vec3::new(x, y * (one - x), (one - x) * (one - y)).named("first");
        let among = (v * axes).named("among");
        let known = among.length().named("known");
        let least = lit::<R>(MIN_LENGTH);
        let direction = among * (one / known.max(least));
        let direction = R::Vec3::select(least.less(known), direction, first).named("direction");
        let longer = v + direction * ((known * known + across).sqrt() - known);
        self.nearest_along(NormalVector {
            v: R::Vec3::select(zero.less(lack), longer, v).named("longer"),
            deficit: lack,
        })
    }

    /// Returns the nearest point from a complete vector.
    #[inline(always)]
    fn nearest_along(&self, NormalVector { v, deficit: lack }: NormalVector<R>) -> Nearest<R> {
        let one = lit::<R>(1.0);
        let inverse = (one / v.length().max(lit(1e-30))).named("inverse_length");
        // The smallest norm if a component was missing; else a tangent of the root, which is no less.
        let excess = (-lack).max(lit(0.0));
        let norm = (lit::<R>(MIN_NORM) + excess * lit(0.5 / MIN_NORM)).named("norm");
        Nearest {
            normal: v * inverse,
            support: norm * self.largest * inverse,
        }
    }
}

/// Returns the largest shortfall of the value, given the distance.
#[inline(always)]
fn shortfall<R: Real>(distance: R, r: R::Vec3) -> R {
    let (smallest, largest) = (least::<R>(r), r.max_component());
    // The steps converge where the surface is nearer than its centres of curvature.
    let depth = (-distance).max(lit(0.0)) * largest / (smallest * smallest);
    let inside = smallest * lit(MAX_INNER_SHORTFALL) * (depth * depth).min(lit(1.0));
    let is_steady = largest.less(smallest * lit(MAX_EXACT_RATIO));
    let outside = distance.max(lit(0.0)) * R::select(is_steady, lit(0.0), lit(MAX_OUTER_SHORTFALL));
    let left = (distance.abs() + largest) * lit(MAX_STEP_RESIDUAL);
    // A radius below the minimum was replaced by the minimum.
    let thicker = largest * R::select(is_steady, lit(0.0), lit(MIN_RADIUS));
    inside + outside + left + thicker
}

/// Bounds the value over a box by its values at the nearest and the farthest corner. The distance to a
/// convex solid with three planes of symmetry increases with each coordinate's magnitude. `error` is the
/// rounding error.
pub fn bounds_between<R: Real>(near: R::Vec3, far: R::Vec3, r: R::Vec3, error: R) -> [R; 2] {
    let r = lengths::<R>(r);
    let low = ellipsoid::<R>(near, r).0;
    let high = ellipsoid::<R>(far, r).0;
    widened(low, high, r, error)
}

/// Returns the value at a point with non-negative coordinates, given the `t` of its nearest point.
#[inline(always)]
fn value<R: Real>(q: R::Vec3, r: R::Vec3, t: R) -> R {
    let Nearest { normal, support } = NormalizedEllipsoid::<R>::new(q, r).nearest(t);
    q.dot(normal) - support
}

/// Widens the values at the nearest and the farthest corner by the largest shortfall and the rounding
/// error.
#[inline(always)]
fn widened<R: Real>(low: R, high: R, r: R::Vec3, error: R) -> [R; 2] {
    [
        low - shortfall::<R>(low, r) - error,
        high + shortfall::<R>(high, r) + error,
    ]
}
