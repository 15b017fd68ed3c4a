//! Conversions between 2-D shapes and solids.

use crate::real::{Real, Vector2, Vector3, lit};

/// Returns the distance to the intersection of two half planes at right angles, given the distance to each.
/// Outside, it is the length of the positive part; inside, the larger (negative) one. (Of equal values, the second
/// one gives the gradient: on a face, the face's.)
#[inline(always)]
pub fn corner<R: Real>(q: R::Vec2) -> R {
    let q = q.named("q");
    q.max(R::Vec2::splat(lit(0.0))).length() + lit::<R>(0.0).min(q.max_component())
}

/// Extrudes the 2-D shape with the distance `d`, from −`half` to `half` along z.
#[inline(always)]
pub fn extrude<R: Real>(d: R, p: R::Vec3, half: R) -> R {
    corner::<R>(R::Vec2::new(d, p.z().abs() - half))
}

/// Extrudes a 2-D shape with rounded rims: the offset of a smaller sharp extrusion by `round`.
#[inline(always)]
pub fn rounded_extrude<R: Real>(d: R, p: R::Vec3, half: R, round: R) -> R {
    corner::<R>(R::Vec2::new(d + round, p.z().abs() - half + round)) - round
}

/// Maps space to the half plane that is revolved about the y axis; `offset` moves the 2-D shape away from
/// the axis.
#[inline(always)]
pub fn revolve<R: Real>(p: R::Vec3, offset: R) -> R::Vec3 {
    R::Vec3::new(p.xz().length() - offset, p.y(), lit(0.0))
}

/// Maps space to the half plane of a partial revolution. It is symmetric about the +x axis, with an end in
/// the direction `end` of the xz plane. Beyond the ends, points map to the plane of the nearer end.
#[inline(always)]
pub fn revolve_part<R: Real>(p: R::Vec3, offset: R, end: R::Vec2) -> R::Vec3 {
    let z = p.z().abs().named("z");
    let beside = (end.x() * z).less(end.y() * p.x());
    let along = R::Vec2::new(p.x(), z).dot(end);
    R::Vec3::new(
        R::select(beside, p.xz().length(), along) - offset,
        p.y(),
        lit(0.0),
    )
}

/// Closes a partial revolution: `d` is the 2-D shape's distance after [`revolve_part`], `p` the point
/// before it.
#[inline(always)]
pub fn revolve_close<R: Real>(d: R, p: R::Vec3, end: R::Vec2) -> R {
    let z = p.z().abs().named("z");
    let across = (end.x() * z - end.y() * p.x()).named("across");
    // Inside and behind the axis, the nearest point of the end's half plane lies on the axis.
    let along = R::Vec2::new(p.x(), z).dot(end);
    let behind = R::and(across.less(lit(0.0)), along.less(lit(0.0)));
    corner::<R>(R::Vec2::new(d, R::select(behind, -p.xz().length(), across)))
}

/// Projects space to the plane z = 0: shapes evaluated at the result are sections of solids.
#[inline(always)]
pub fn slice<R: Real>(p: R::Vec3) -> R::Vec3 {
    R::Vec3::new(p.x(), p.y(), lit(0.0))
}
