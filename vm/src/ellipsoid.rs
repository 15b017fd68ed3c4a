//! The distance to an ellipsoid.
//!
//! The nearest point of the ellipsoid with the radii `r` to `p` is `r² p / (t + r²)` for the `t` at which that
//! point lies on the ellipsoid (D. Eberly, *Distance from a Point to an Ellipse, an Ellipsoid, or a
//! Hyperellipsoid*, 2013). Newton's steps find it on one over the norm of that point, which is nearly a line
//! (M. Hebden, 1973).
//!
//! The distance is then taken along the normal `n` there, as `p · n − |r n|`. Along any direction this is at most
//! the distance to a convex solid, inside and outside, and the error is the square of that of the direction.
//! So the value is a lower bound, however far the steps came. Of radii that differ by up to 100 to 1 it is
//! exact to rounding outside, and inside as deep as half of the smallest radius of curvature. Beside the
//! place where opposite sides are equally near it may be short by 0.3 % of the smallest radius.

use crate::interval::{End, IntervalOf};
use crate::real::{Real, Vector3, lit};
use crate::vector::V3;

/// The number of Newton's steps.
const STEPS: usize = 8;
/// The least share of `r²` that `t + r²` is taken for.
const LEAST_SHARE: f64 = 1e-7;
/// How much less than one the norm of the nearest point may be by rounding.
const NORM_ERROR: f64 = 2e-6;
/// The most that the value may be short of the distance inside, as a fraction of the smallest radius.
const MOST_SHORT: f64 = 4e-3;
/// The same outside, as a fraction of the distance, where the radii differ more than [`STEADY`] to 1.
const SHORT_OUTSIDE: f64 = 2e-2;
/// The ratio of radii up to which the value is the distance outside.
const STEADY: f64 = 100.0;

/// The distance and its gradient.
#[inline(always)]
pub fn ellipsoid<R: Real>(p: R::Vec3, r: R::Vec3) -> (R, R::Vec3) {
    let (q, r) = (p.abs().named("q"), lengths::<R>(r));
    let normal = normal::<R>(q, r, multiplier::<R>(q, r)).named("normal");
    let side = R::Vec3::new(p.x().side(), p.y().side(), p.z().side());
    (q.dot(normal) - (r * normal).length(), normal * side)
}

/// Radii, none of them zero.
#[inline(always)]
fn lengths<R: Real>(r: R::Vec3) -> R::Vec3 {
    r.abs().max(R::Vec3::splat(lit(1e-12))).named("lengths")
}

/// The components of a vector divided by those of another.
#[inline(always)]
fn divided<R: Real>(a: R::Vec3, b: R::Vec3) -> R::Vec3 {
    R::Vec3::new(a.x() / b.x(), a.y() / b.y(), a.z() / b.z())
}

/// The sum of the components.
#[inline(always)]
fn sum<R: Real>(a: R::Vec3) -> R {
    a.x() + a.y() + a.z()
}

#[inline(always)]
fn least<R: Real>(r: R::Vec3) -> R {
    r.x().min(r.y()).min(r.z())
}

/// `t + r²`, kept above zero.
#[inline(always)]
fn divisors<R: Real>(t: R, squares: R::Vec3) -> R::Vec3 {
    (R::Vec3::splat(t) + squares).max(squares * lit::<R>(LEAST_SHARE))
}

/// The `t` of the nearest point, of a point with positive coordinates.
#[inline(always)]
fn multiplier<R: Real>(q: R::Vec3, r: R::Vec3) -> R {
    let squares = (r * r).named("squares");
    let a = (r * q).named("a");
    let low = (a - squares).max_component().named("low");
    let smallest = least::<R>(r);
    let high = (a.length() - smallest * smallest).max(low).named("high");
    // At the surface itself it is zero.
    let mut t = lit::<R>(0.0).max(low).min(high).named("t");
    for _ in 0..STEPS {
        let m = divisors::<R>(t, squares).named("m");
        let u = divided::<R>(a, m).named("u");
        let w = (u * u).named("w");
        let norm = sum::<R>(w).named("norm");
        let slope = sum::<R>(divided::<R>(w, m)).max(lit(1e-37));
        let step = norm * (norm.sqrt() - lit(1.0)) / slope;
        t = (t + step).max(low).min(high).named("t");
    }
    t
}

/// The unit normal at the nearest point. Inside, where that lies beside the plane across the smallest radius, what
/// its norm lacks is the component across that plane.
#[inline(always)]
fn normal<R: Real>(q: R::Vec3, r: R::Vec3, t: R) -> R::Vec3 {
    let squares = r * r;
    let m = divisors::<R>(t, squares);
    let v = divided::<R>(q, m).named("v");
    let u = r * v;
    let lack = (lit::<R>(1.0 - NORM_ERROR) - u.dot(u)).max(lit(0.0));
    let smallest = least::<R>(r);
    let across = (lack / (smallest * smallest)).named("across");
    let with = |v: R, r: R| {
        let longer = (v * v + across).sqrt();
        R::select(smallest.less(r), v, longer)
    };
    let v = R::Vec3::new(with(v.x(), r.x()), with(v.y(), r.y()), with(v.z(), r.z()));
    v * (lit::<R>(1.0) / v.length().max(lit(1e-30)))
}

/// What the value may be short of the distance by, where that is `distance`.
#[inline(always)]
fn shortage<R: Real>(distance: R, r: R::Vec3) -> R {
    let (smallest, largest) = (least::<R>(r), r.max_component());
    // Where the surface is nearer than its centres of curvature the steps come to an end.
    let depth = (-distance).max(lit(0.0)) * largest / (smallest * smallest);
    let inside = smallest * lit(MOST_SHORT) * (depth * depth).min(lit(1.0));
    let is_steady = largest.less(smallest * lit(STEADY));
    let outside = distance.max(lit(0.0)) * R::select(is_steady, lit(0.0), lit(SHORT_OUTSIDE));
    inside + outside
}

/// Bounds of the value over a box from those at the nearest and the farthest of its corners: the distance to a
/// convex solid with three planes of symmetry grows with each coordinate's magnitude. `error` is that of rounding.
pub fn between<R: Real>(near: R::Vec3, far: R::Vec3, r: R::Vec3, error: R) -> [R; 2] {
    let r = lengths::<R>(r);
    let low = ellipsoid::<R>(near, r).0;
    let high = ellipsoid::<R>(far, r).0;
    [
        low - shortage::<R>(low, r) - error,
        high + shortage::<R>(high, r) + error,
    ]
}

/// The value and its gradient over a box, for radii that are numbers.
pub(crate) fn over<E: End>(
    p: V3<IntervalOf<E>>,
    r: V3<IntervalOf<E>>,
) -> (IntervalOf<E>, V3<IntervalOf<E>>) {
    let q = p.abs();
    let (near, far) = (
        V3::of(q.x.lo, q.y.lo, q.z.lo),
        V3::of(q.x.hi, q.y.hi, q.z.hi),
    );
    let radii = lengths::<E>(V3::of(r.x.lo, r.y.lo, r.z.lo));
    let any = IntervalOf {
        lo: lit(-1.0),
        hi: lit(1.0),
    };
    let anywhere = V3::of(any, any, any);
    let is_known = r.x.lo == r.x.hi && r.y.lo == r.y.hi && r.z.lo == r.z.hi;
    if !(is_known && far.max_component() < E::INFINITY) {
        let everything = IntervalOf {
            lo: -E::INFINITY,
            hi: E::INFINITY,
        };
        return (everything, anywhere);
    }
    let error = E::distance_error(far.max_component() + radii.max_component());
    let [lo, hi] = between::<E>(near, far, radii, error);
    let value = IntervalOf { lo, hi };
    let squares = radii * radii;
    let slack = squares.max_component() * lit(1e-6);
    let (first, last) = (
        multiplier::<E>(near, radii) - slack,
        multiplier::<E>(far, radii) + slack,
    );
    // Beside the plane across the smallest radius the normal may have any direction.
    let smallest = least::<E>(radii);
    if first < smallest * smallest * lit(LEAST_SHARE - 0.75) {
        return (value, anywhere);
    }
    let t = IntervalOf {
        lo: first,
        hi: last,
    };
    let part = |p: IntervalOf<E>, square: E| p / (t + IntervalOf::point(square));
    let v = V3::of(
        part(p.x, squares.x),
        part(p.y, squares.y),
        part(p.z, squares.z),
    );
    let unit = |a: IntervalOf<E>, b: IntervalOf<E>, c: IntervalOf<E>| {
        let rest = b.square() + c.square();
        // The component of a unit vector grows with the vector's, and shrinks with the others.
        let share = |a: E, rest: E| a / (a * a + rest).sqrt().max(lit(1e-30));
        let zero = lit::<E>(0.0);
        let low = if a.lo < zero { rest.lo } else { rest.hi };
        let high = if a.hi < zero { rest.hi } else { rest.lo };
        let slack = lit::<E>(1e-5);
        IntervalOf {
            lo: (share(a.lo, low) - slack).max(lit(-1.0)),
            hi: (share(a.hi, high) + slack).min(lit(1.0)),
        }
    };
    let gradient = V3::of(
        unit(v.x, v.y, v.z),
        unit(v.y, v.z, v.x),
        unit(v.z, v.x, v.y),
    );
    (value, gradient)
}
