//! Shapes in the xy plane.

use crate::bounds::Bounds;
use crate::ops::dimension::corner;
use crate::ops::map_bounds::along_z;
use crate::ops::prepare::{half, inverse, sectors};
use crate::real::{Real, Vector2, lit};

/// Rotates the point about the origin into the sector whose middle lies on the first axis. The sectors have
/// the angle `angle`, and `inverse` is one over it. The first sector starts `start` sectors from the first
/// axis.
///
/// The rotation is by whole sectors, so the result is as smooth as the plane itself between
/// discontinuities.
#[inline(always)]
pub fn sector<R: Real>(q: R::Vec2, angle: R, inverse: R, start: f64) -> R::Vec2 {
    let which = (q.y().atan2(q.x()) * inverse + lit(start)).floor();
    let turn = ((which + lit(0.5 - start)) * angle).named("turn");
    let (c, s) = (turn.cos().named("c"), turn.sin().named("s"));
    R::Vec2::new(q.x() * c + q.y() * s, q.y() * c - q.x() * s)
}

/// Returns the distance to a regular polygon with a corner on the first axis. In the sector of a side, it is the
/// distance to that side, which is `apothem` away and extends by `side` in both directions.
#[inline(always)]
pub fn polygon_sector<R: Real>(q: R::Vec2, angle: R, inverse: R, apothem: R, side: R) -> R {
    let s = sector::<R>(q, angle, inverse, 0.0).named("s");
    let beyond = (s.x() - apothem).named("beyond");
    let outside = R::Vec2::new(beyond, (s.y().abs() - side).max(lit(0.0))).length();
    R::select(lit::<R>(0.0).less(beyond), outside, beyond)
}

/// Returns the signed distance to a disc of radius `r` around the origin.
#[inline(always)]
pub fn circle<R: Real>(p: R::Vec2, r: R) -> R {
    p.length() - r
}

/// Returns the signed distance to a rectangle with sharp corners, centred at the origin.
#[inline(always)]
pub fn rect<R: Real>(p: R::Vec2, half: R::Vec2) -> R {
    corner::<R>(p.abs() - half)
}

/// Returns the signed distance to a rectangle with rounded corners: the offset of a smaller sharp one by `round`.
#[inline(always)]
pub fn rounded_rect<R: Real>(p: R::Vec2, half: R::Vec2, round: R) -> R {
    corner::<R>(p.abs() - half + R::Vec2::splat(round)) - round
}

/// Converts full sizes and a rounding radius in the plane.
pub fn rounded_rect_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let size = [half(a[0]), half(a[1])];
    vec![size[0], size[1], a[2].min(size[0]).min(size[1])]
}

/// Returns the signed distance to all points within `r` of a segment, as
/// [`capsule_between`](super::capsule_between) in the plane.
#[inline(always)]
pub fn segment<R: Real>(p: R::Vec2, start: R::Vec2, axis: R::Vec2, inverse: R, r: R) -> R {
    let q = (p - start).named("q");
    let t = (q.dot(axis) * inverse).saturate();
    (q - axis * t).length() - r
}

/// Converts two end points and a radius in the plane to a start, an axis, one over its squared length, and
/// the radius.
pub fn segment_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let (x, y) = (a[2] - a[0], a[3] - a[1]);
    vec![a[0], a[1], x, y, inverse(x * x + y * y), a[4]]
}

/// Bounds a segment, given its start, its axis, one over its squared length, and its radius.
pub fn segment_bounds(a: &[f64]) -> Bounds {
    let b = Bounds::EMPTY
        .including([a[0], a[1], 0.0])
        .including([a[0] + a[2], a[1] + a[3], 0.0])
        .grown(a[5]);
    along_z(&b, f64::INFINITY)
}

/// Returns the distance to a regular polygon with a corner on the +y axis.
#[inline(always)]
pub fn ngon<R: Real>(p: R::Vec2, sector: R, inverse: R, apothem: R, side: R) -> R {
    polygon_sector::<R>(R::Vec2::new(p.y(), p.x()), sector, inverse, apothem, side)
}

/// Converts the number of corners (at least three) and the circumradius. Results are the angle of a sector,
/// its inverse, the apothem, and half the length of a side. Further arguments are kept.
pub fn ngon_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let (sector, inverse) = sectors(a[0].max(lit(3.0)));
    let angle = half(sector);
    let mut v = vec![sector, inverse, a[1] * angle.cos(), a[1] * angle.sin()];
    v.extend_from_slice(&a[2..]);
    v
}

/// Returns the circumradius of a regular polygon, given the apothem and half a side.
pub fn ngon_radius(a: &[f64]) -> f64 {
    a[2].hypot(a[3])
}

/// Returns the distance to a star with a tip on the +y axis, at the distance `tip` from the centre. By symmetry,
/// one edge remains, from the tip to the inner corner; `length` is its length, `across` its unit normal.
#[inline(always)]
pub fn star<R: Real>(p: R::Vec2, sector: R, inverse: R, tip: R, length: R, across: R::Vec2) -> R {
    let folded = self::sector::<R>(R::Vec2::new(p.y(), p.x()), sector, inverse, 0.5);
    let q = R::Vec2::new(folded.x() - tip, folded.y().abs()).named("q");
    let side = q.dot(across).named("side");
    let along = (q.y() * across.x() - q.x() * across.y()).named("along");
    let beside = R::and(lit::<R>(0.0).less(along), along.less(length));
    let end = along.clamp(lit(0.0), length);
    let to_end = R::Vec2::new(side, along - end).length();
    R::select(beside, side, side.sign_nonzero() * to_end)
}

/// Converts the number of tips (at least two), the radius of the tips, and the radius of the inner corners.
pub fn star_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let (sector, inverse) = sectors(a[0].max(lit(2.0)));
    let angle = half(sector);
    let (x, y) = (a[2] * angle.cos() - a[1], a[2] * angle.sin());
    let length = (x * x + y * y).sqrt();
    let scale = lit::<R>(1.0) / length.max(lit(1e-12));
    vec![sector, inverse, a[1], length, y * scale, -x * scale]
}

/// Returns the distance of the farthest corner of a star from its centre. The inner corners may be farther than
/// the tips.
pub fn star_radius(a: &[f64]) -> f64 {
    let (tip, length) = (a[2], a[3]);
    let inner = (tip - length * a[5]).hypot(length * a[4]);
    tip.abs().max(inner)
}

/// Adds one edge to the distance to a polygon. The value passed along the chain of edges is the distance to the
/// nearest edge so far. It is negative while a ray from the point to the right crosses the edges so far an odd
/// number of times. So after the last edge it is the signed distance. An edge includes its lower end and excludes
/// its upper one, so that a corner is never counted twice.
#[inline(always)]
pub fn polygon_edge<R: Real>(acc: R, p: R::Vec2, a: R::Vec2, b: R::Vec2) -> R {
    let zero = lit::<R>(0.0);
    let e = (b - a).named("e");
    let length = e.length().named("length");
    let direction = (e * (lit::<R>(1.0) / length.max(lit(1e-30)))).named("direction");
    let (q, r) = ((p - a).named("q"), p - b);
    let along = q.dot(direction).named("along");
    let across = (direction.x() * q.y() - direction.y() * q.x()).named("across");
    let beside = R::and(zero.less(along), along.less(length));
    let to_end = R::Vec2::select(zero.less(along), r, q).length();
    // Crossed upwards: above `a`, below `b`, and to the left of the edge. Crossed downwards: none of these.
    let above = R::not(p.y().less(a.y()));
    let below = p.y().less(b.y());
    let left = zero.less(across);
    let upwards = R::and(above, R::and(below, left));
    let downwards = R::not(R::or(above, R::or(below, left)));
    // A point on the edge counts as right of it. A point on a level edge counts as above it, which is to
    // the left if the edge runs along +x. The gradient must agree with this.
    let level = R::not(R::or(e.y().less(zero), zero.less(e.y())));
    let above_level = R::and(R::and(level, zero.less(e.x())), R::not(across.less(zero)));
    let aside = R::select(R::or(left, above_level), across, -across);
    // Never exactly zero, so that the next edges receive the sign.
    let d = (R::select(beside, aside, to_end).min(acc.abs()) + lit(1e-30)).named("d");
    let inside = R::select(R::or(upwards, downwards), -acc, acc).less(zero);
    R::select(inside, -d, d)
}

/// Bounds the edges of a polygon so far, given the two ends of the last one and the box of those before.
pub fn polygon_edge_bounds(a: &[f64], before: &Bounds) -> Bounds {
    let edge = Bounds::EMPTY
        .including([a[0], a[1], 0.0])
        .including([a[2], a[3], 0.0]);
    before.hull(&along_z(&edge, f64::INFINITY))
}
