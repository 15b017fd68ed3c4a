//! Bounds of the distance to an ellipsoid, and of its gradient, over a box.

use super::{MAX_EXACT_RATIO, MULTIPLIER_ERROR, NormalizedEllipsoid, lengths, value, widened};
use crate::interval::{Endpoint, GenericInterval};
use crate::real::{Real, Vector3, lit};
use crate::vector::V3;

/// Returns the points of a box nearest to the centre and farthest from it, by magnitudes of coordinates.
#[inline(always)]
pub(super) fn corners<E: Endpoint>(p: V3<GenericInterval<E>>) -> [V3<E>; 2] {
    let q = p.abs();
    [
        V3::new(q.x.lo, q.y.lo, q.z.lo),
        V3::new(q.x.hi, q.y.hi, q.z.hi),
    ]
}

/// Returns the value and its gradient over a box, for radii that are single numbers.
#[inline(always)]
pub(crate) fn over<E: Endpoint>(
    p: V3<GenericInterval<E>>,
    r: V3<GenericInterval<E>>,
) -> (GenericInterval<E>, V3<GenericInterval<E>>) {
    let radii = lengths::<E>(V3::new(r.x.lo, r.y.lo, r.z.lo));
    let multiplier = |q: V3<E>| NormalizedEllipsoid::<E>::new(q, radii).multiplier();
    over_by(p, r, corners(p).map(multiplier))
}

/// Returns the value and its gradient over a box, given the `t` of the nearest points to the box's corners.
/// It is branch-free, so that loops over lanes are vectorized.
#[inline(always)]
pub(super) fn over_by<E: Endpoint>(
    p: V3<GenericInterval<E>>,
    r: V3<GenericInterval<E>>,
    [first, last]: [E; 2],
) -> (GenericInterval<E>, V3<GenericInterval<E>>) {
    let [near, far] = corners(p);
    let size = far.max_component();
    let same = |r: GenericInterval<E>| r.lo == r.hi;
    let is_known = same(r.x) & same(r.y) & same(r.z) & size.less(E::INFINITY);
    let r = lengths::<E>(V3::new(r.x.lo, r.y.lo, r.z.lo));
    let (low, high) = (value::<E>(near, r, first), value::<E>(far, r, last));
    let [low, high] = widened(low, high, r, E::distance_error(size + r.max_component()));
    let value = GenericInterval {
        lo: E::select(is_known, low, -E::INFINITY),
        hi: E::select(is_known, high, E::INFINITY),
    };
    let moved = |t: E, error: f64| t + (lit::<E>(1.0) + t.abs()) * lit(error);
    let first = moved(first, -MULTIPLIER_ERROR);
    let last = moved(last, MULTIPLIER_ERROR);
    // Near the plane across the axis of the smallest radius, the normal may have any direction.
    let NormalizedEllipsoid { squares, least, .. } = NormalizedEllipsoid::<E>::new(near, r);
    let is_told = is_known
        & (least * lit(-0.75)).less(first)
        & lit::<E>(1.0).less(least * lit(MAX_EXACT_RATIO * MAX_EXACT_RATIO));
    let zero = lit::<E>(0.0);
    // Rounding of the quotients is far below the slack of the directions.
    let part = |p: GenericInterval<E>, square: E| {
        let (least, most) = (first + square, last + square);
        GenericInterval {
            lo: p.lo / E::select(p.lo.less(zero), least, most),
            hi: p.hi / E::select(p.hi.less(zero), most, least),
        }
    };
    let v = V3::new(
        part(p.x, squares.x),
        part(p.y, squares.y),
        part(p.z, squares.z),
    );
    let squared = |a: GenericInterval<E>| {
        let a = a.abs();
        (a.lo * a.lo, a.hi * a.hi)
    };
    let (x, y, z) = (squared(v.x), squared(v.y), squared(v.z));
    let component = |a: GenericInterval<E>, b: (E, E), c: (E, E)| {
        let rest = (b.0 + c.0, b.1 + c.1);
        // A component of a unit vector increases with that of the vector, and decreases with the others'
        // magnitudes.
        let component_of_unit = |a: E, rest: E| a / (a * a + rest).sqrt().max(lit(1e-30));
        let low = component_of_unit(a.lo, E::select(a.lo.less(zero), rest.0, rest.1));
        let high = component_of_unit(a.hi, E::select(a.hi.less(zero), rest.1, rest.0));
        let (slack, one) = (lit::<E>(1e-5), lit::<E>(1.0));
        GenericInterval {
            lo: E::select(is_told, (low - slack).max(-one), -one),
            hi: E::select(is_told, (high + slack).min(one), one),
        }
    };
    let gradient = V3::new(
        component(v.x, y, z),
        component(v.y, z, x),
        component(v.z, x, y),
    );
    (value, gradient)
}
