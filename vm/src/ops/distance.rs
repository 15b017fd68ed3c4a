//! Changes of a distance after its shape is evaluated.

use crate::ops::shapes::cuboid;
use crate::real::{Real, Vector3, lit};

/// Returns the complement: the region outside the shape.
#[inline(always)]
pub fn complement<R: Real>(d: R) -> R {
    -d
}

/// Moves the surface outwards by `by`.
#[inline(always)]
pub fn offset<R: Real>(d: R, by: R) -> R {
    d - by
}

/// Returns the surface as a wall that extends by `half` to both sides.
#[inline(always)]
pub fn shell<R: Real>(d: R, half: R) -> R {
    d.abs() - half
}

/// Converts a distance to a space in which lengths are `factor` times as large.
#[inline(always)]
pub fn scale_distance<R: Real>(d: R, factor: R) -> R {
    d * factor
}

/// Divides a raw field by its slope bound, so that a step by its value is safe.
#[inline(always)]
pub fn field_distance<R: Real>(v: R, inverse_slope: R) -> R {
    v * inverse_slope
}

/// The smallest logarithm of a power; smaller powers count as this one, which is 1e-30.
const MIN_LOGARITHM: f64 = -69.0;

/// Returns a safe step of a raw field with a bound on its growth. In a cube of the half side `side` around the
/// origin, the slope is at most one over `inverse`. Outside, it grows at most by a power of the largest
/// coordinate's magnitude.
///
/// In the cube, a step of the value times `inverse` is safe up to the cube's faces. Anywhere, a step of the
/// value times `beyond` over that power is safe, up to the fraction `share` of the distance from the
/// origin. The result is the longer step. Its slope is at most one, and it has the field's sign.
#[inline(always)]
pub fn field_growth<R: Real>(
    v: R,
    p: R::Vec3,
    side: R,
    exponent: R,
    share: R,
    inverse: R,
    beyond: R,
) -> R {
    let far = p.abs().max_component().named("far");
    let inside = (side - far).max(lit(0.0)).named("inside");
    let way = far.max(side).max(lit(1e-30)).named("way");
    let logarithm = (side / way).ln() * exponent;
    let shrunk = logarithm.max(lit(MIN_LOGARITHM)).exp().named("shrunk");
    let near = (v * inverse).abs().min(inside).named("near");
    let grown = (v * beyond * shrunk).abs().min(way * share).named("grown");
    let step = near.max(grown).named("step");
    signed::<R>(v, step)
}

/// Returns the distance `step` within which a raw field with discontinuities does not change its sign, with that
/// sign. The distance is computed from the field's pieces.
#[inline(always)]
pub fn piecewise<R: Real>(v: R, step: R) -> R {
    signed::<R>(v, step)
}

/// Returns a step with the sign of a value; NaN stays NaN.
#[inline(always)]
fn signed<R: Real>(v: R, step: R) -> R {
    let signed = R::select(v.less(lit(0.0)), -step, step);
    R::select(is_number(v), signed, v)
}

/// Tests for NaN, which minima and maxima drop. Intervals are always numbers.
#[inline(always)]
fn is_number<R: Real>(v: R) -> R::Bool {
    lit::<R>(-1.0).less(v.abs())
}

/// Adds the correction of an elongated shape inside the gap. There, all points map to the middle, and the distance
/// to the gap's own sides is added. If the middle is outside the shape, so is the gap.
#[inline(always)]
pub fn elongate_correct<R: Real>(d: R, p: R::Vec3, half: R::Vec3) -> R {
    let depth = lit::<R>(0.0).min((p.abs() - half).max_component());
    d + R::select(d.less(lit(0.0)), depth, lit(0.0))
}

/// Returns a distance that is valid only within `margin` of a box of the half sizes `half` around `centre`.
/// Farther away, the distance to the box replaces it.
///
/// The valid neighbourhood of the box contains all paths from there to the shape. So the value is used
/// unchanged up to the neighbourhood's boundary, where the result is discontinuous. With a tight limit, the
/// value would be constant near a corner, and its gradient would vanish. The shape's own distance counts as
/// at most `limit`, for overflowing values.
#[inline(always)]
pub fn bounded<R: Real>(
    d: R,
    p: R::Vec3,
    centre: R::Vec3,
    margin: R,
    half: R::Vec3,
    limit: R,
) -> R {
    let beyond = cuboid::<R>(p - centre, half).named("beyond");
    let is_outside = margin.less(beyond);
    let near = d.at_most(limit).at_least(beyond);
    R::select(is_outside, beyond, near).mark_discontinuity(is_outside)
}
