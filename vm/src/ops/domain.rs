//! Changes of the point, before the shape is evaluated. What a row moves is space, so the body
//! takes a point of the result back to the point of the shape. (Moving, turning, scaling and
//! shearing are no rows: they are matrices, see [`crate::ops::affine`].)

use crate::real::{Real, Vector2, Vector3, lit};

/// What lies on the positive side of an axis, on both sides; `axes` is 1 for each axis to mirror
/// and 0 for the others.
#[inline(always)]
pub fn mirror<R: Real>(p: R::Vec3, axes: R::Vec3) -> R::Vec3 {
    p + (p.abs() - p) * axes
}

/// The point in its cell of an endless grid; `inverse` is one over `spacing`, or zero along axes
/// without repetition.
#[inline(always)]
pub fn repeat<R: Real>(p: R::Vec3, spacing: R::Vec3, inverse: R::Vec3) -> R::Vec3 {
    p - spacing * (p * inverse + R::Vec3::splat(lit(0.5))).floor()
}

/// The point as another cell sees it: `which` cells farther along each axis, on the side that the point is
/// nearer to, or on the other side where that is negative.
#[inline(always)]
pub fn repeat_neighbour<R: Real>(
    p: R::Vec3,
    spacing: R::Vec3,
    inverse: R::Vec3,
    which: R::Vec3,
) -> R::Vec3 {
    let q = repeat::<R>(p, spacing, inverse).named("q");
    let side = R::Vec3::new(q.x().side(), q.y().side(), q.z().side());
    q - spacing * which * side
}

/// The point in its cell of a grid of `last` + 1 cells along each axis, centred at the origin.
#[inline(always)]
pub fn repeat_limited<R: Real>(
    p: R::Vec3,
    spacing: R::Vec3,
    inverse: R::Vec3,
    last: R::Vec3,
) -> R::Vec3 {
    let q = (p + spacing * last * lit::<R>(0.5)).named("q");
    let cell = (q * inverse + R::Vec3::splat(lit(0.5))).floor();
    q - spacing * cell.max(R::Vec3::splat(lit(0.0))).min(last)
}

/// The point as a neighbouring cell of a limited grid sees it; beyond the last cell, that cell.
#[inline(always)]
pub fn repeat_limited_neighbour<R: Real>(
    p: R::Vec3,
    spacing: R::Vec3,
    inverse: R::Vec3,
    last: R::Vec3,
    which: R::Vec3,
) -> R::Vec3 {
    let q = (p + spacing * last * lit::<R>(0.5)).named("q");
    let own = (q * inverse + R::Vec3::splat(lit(0.5)))
        .floor()
        .named("own");
    let off = (q - spacing * own).named("off");
    let side = R::Vec3::new(off.x().side(), off.y().side(), off.z().side());
    let cell = own + which * side;
    q - spacing * cell.max(R::Vec3::splat(lit(0.0))).min(last)
}

/// A vector of a plane, turned into its sector or, with `which`, as the sector sees it that is so many
/// farther on the nearer side. The turn is by whole sectors: it is the same for all points of a
/// sector, and has no part in gradients.
#[inline(always)]
fn turned<R: Real>(q: R::Vec2, angle: R, inverse: R, phase: R, which: Option<R>) -> R::Vec2 {
    let at = ((q.y().atan2(q.x()) - phase) * inverse).named("at");
    let own = (at + lit(0.5)).floor().named("own");
    let sector = match which {
        Some(which) => own + (at - own).side() * which,
        None => own,
    };
    let turn = (sector * angle).named("turn");
    let (c, s) = (turn.cos().named("c"), turn.sin().named("s"));
    R::Vec2::new(q.x() * c + q.y() * s, q.y() * c - q.x() * s)
}

/// The point turned about the y axis into the sector around the direction `phase`, an angle from
/// the x axis towards z; a sector is `sector` wide, and `inverse` is one over that.
#[inline(always)]
pub fn polar<R: Real>(p: R::Vec3, sector: R, inverse: R, phase: R) -> R::Vec3 {
    let q = turned::<R>(p.xz(), sector, inverse, phase, None);
    R::Vec3::new(q.x(), p.y(), q.y())
}

/// The point as the sector about the y axis sees it that is `which` farther on the nearer side.
#[inline(always)]
pub fn polar_neighbour<R: Real>(p: R::Vec3, sector: R, inverse: R, phase: R, which: R) -> R::Vec3 {
    let q = turned::<R>(p.xz(), sector, inverse, phase, Some(which));
    R::Vec3::new(q.x(), p.y(), q.y())
}

/// The point turned about the z axis into the sector around the direction `phase`, an angle from
/// the x axis towards y: [`polar`] for plane shapes.
#[inline(always)]
pub fn polar_plane<R: Real>(p: R::Vec3, sector: R, inverse: R, phase: R) -> R::Vec3 {
    let q = turned::<R>(p.xy(), sector, inverse, phase, None);
    R::Vec3::new(q.x(), q.y(), p.z())
}

/// The point as the sector about the z axis sees it that is `which` farther on the nearer side.
#[inline(always)]
pub fn polar_plane_neighbour<R: Real>(
    p: R::Vec3,
    sector: R,
    inverse: R,
    phase: R,
    which: R,
) -> R::Vec3 {
    let q = turned::<R>(p.xy(), sector, inverse, phase, Some(which));
    R::Vec3::new(q.x(), q.y(), p.z())
}

/// The shape cut at the planes through its middle and pulled apart by `half` to both sides.
#[inline(always)]
pub fn elongate<R: Real>(p: R::Vec3, half: R::Vec3) -> R::Vec3 {
    p - p.max(-half).min(half)
}

/// Space turned about the y axis, by `rate` radians per unit of y.
#[inline(always)]
pub fn twist<R: Real>(p: R::Vec3, rate: R) -> R::Vec3 {
    let turn = (p.y() * rate).named("turn");
    let (c, s) = (turn.cos().named("c"), turn.sin().named("s"));
    R::Vec3::new(p.x() * c - p.z() * s, p.y(), p.x() * s + p.z() * c)
}

/// Space turned about the z axis, by `rate` radians per unit of x: a bar along x curls up. Where
/// `rate`·y reaches one, space folds over, and the shape shows up again.
#[inline(always)]
pub fn bend<R: Real>(p: R::Vec3, rate: R) -> R::Vec3 {
    let turn = (p.x() * rate).named("turn");
    let (c, s) = (turn.cos().named("c"), turn.sin().named("s"));
    R::Vec3::new(p.x() * c + p.y() * s, p.y() * c - p.x() * s, p.z())
}
