//! Maps of the point before the shape is evaluated. A row transforms space, so its body maps a point of the
//! result back to the point of the shape. (Translation, rotation, scaling and shear are not rows but
//! matrices, see [`crate::ops::affine`].)

use crate::real::{Real, Vector2, Vector3, lit};

/// Mirrors the positive side of an axis to both sides; `axes` is 1 for each axis to mirror and 0 for the
/// others.
#[inline(always)]
pub fn mirror<R: Real>(p: R::Vec3, axes: R::Vec3) -> R::Vec3 {
    p + (p.abs() - p) * axes
}

/// Folds the point into its cell of an infinite grid; `inverse` is one over `spacing`, or zero along axes
/// without repetition.
#[inline(always)]
pub fn repeat<R: Real>(p: R::Vec3, spacing: R::Vec3, inverse: R::Vec3) -> R::Vec3 {
    p - spacing * (p * inverse + R::Vec3::splat(lit(0.5))).floor()
}

/// Maps the point to another cell. It lies `which` cells away along each axis, on the side nearer to the
/// point, or on the other side where `which` is negative.
#[inline(always)]
pub fn repeat_neighbour<R: Real>(
    p: R::Vec3,
    spacing: R::Vec3,
    inverse: R::Vec3,
    which: R::Vec3,
) -> R::Vec3 {
    let q = repeat::<R>(p, spacing, inverse).named("q");
    let side = R::Vec3::new(
        q.x().sign_nonzero(),
        q.y().sign_nonzero(),
        q.z().sign_nonzero(),
    );
    q - spacing * which * side
}

/// Folds the point into its cell of a grid of `last` + 1 cells along each axis, centred at the origin.
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

/// Maps the point to a neighbouring cell of a limited grid; beyond the last cell, to that cell.
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
    let side = R::Vec3::new(
        off.x().sign_nonzero(),
        off.y().sign_nonzero(),
        off.z().sign_nonzero(),
    );
    let cell = own + which * side;
    q - spacing * cell.max(R::Vec3::splat(lit(0.0))).min(last)
}

/// Rotates a vector of a plane into its sector. With `which`, it rotates the vector into the sector that is
/// this number of sectors away on the nearer side. The rotation is by whole sectors: it is constant within
/// a sector, and does not affect gradients.
#[inline(always)]
fn turned<R: Real>(q: R::Vec2, angle: R, inverse: R, phase: R, which: Option<R>) -> R::Vec2 {
    let at = ((q.y().atan2(q.x()) - phase) * inverse).named("at");
    let own = (at + lit(0.5)).floor().named("own");
    let sector = match which {
        Some(which) => own + (at - own).sign_nonzero() * which,
        None => own,
    };
    let turn = (sector * angle).named("turn");
    let (c, s) = (turn.cos().named("c"), turn.sin().named("s"));
    R::Vec2::new(q.x() * c + q.y() * s, q.y() * c - q.x() * s)
}

/// Rotates the point about the y axis into the sector around the direction `phase`, an angle from the x
/// axis towards z. A sector has the angle `sector`, and `inverse` is one over it.
#[inline(always)]
pub fn polar<R: Real>(p: R::Vec3, sector: R, inverse: R, phase: R) -> R::Vec3 {
    let q = turned::<R>(p.xz(), sector, inverse, phase, None);
    R::Vec3::new(q.x(), p.y(), q.y())
}

/// Rotates the point about the y axis into the sector that is `which` sectors away on the nearer side.
#[inline(always)]
pub fn polar_neighbour<R: Real>(p: R::Vec3, sector: R, inverse: R, phase: R, which: R) -> R::Vec3 {
    let q = turned::<R>(p.xz(), sector, inverse, phase, Some(which));
    R::Vec3::new(q.x(), p.y(), q.y())
}

/// Rotates the point about the z axis into the sector around the direction `phase`, an angle from the x axis
/// towards y. It is [`polar`] for 2-D shapes.
#[inline(always)]
pub fn polar_plane<R: Real>(p: R::Vec3, sector: R, inverse: R, phase: R) -> R::Vec3 {
    let q = turned::<R>(p.xy(), sector, inverse, phase, None);
    R::Vec3::new(q.x(), q.y(), p.z())
}

/// Rotates the point about the z axis into the sector that is `which` sectors away on the nearer side.
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

/// Cuts the shape at the planes through its middle and moves the parts by `half` to both sides.
#[inline(always)]
pub fn elongate<R: Real>(p: R::Vec3, half: R::Vec3) -> R::Vec3 {
    p - p.max(-half).min(half)
}

/// Rotates space about the y axis, by `rate` radians per unit of y.
#[inline(always)]
pub fn twist<R: Real>(p: R::Vec3, rate: R) -> R::Vec3 {
    let turn = (p.y() * rate).named("turn");
    let (c, s) = (turn.cos().named("c"), turn.sin().named("s"));
    R::Vec3::new(p.x() * c - p.z() * s, p.y(), p.x() * s + p.z() * c)
}

/// Rotates space about the z axis, by `rate` radians per unit of x: a bar along x curls up. Where `rate`·y
/// falls to −1, space overlaps itself, and the shape appears again.
#[inline(always)]
pub fn bend<R: Real>(p: R::Vec3, rate: R) -> R::Vec3 {
    let turn = (p.x() * rate).named("turn");
    let (c, s) = (turn.cos().named("c"), turn.sin().named("s"));
    R::Vec3::new(p.x() * c + p.y() * s, p.y() * c - p.x() * s, p.z())
}
