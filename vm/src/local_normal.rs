//! Normals of surfaces in the frame of a part.

use crate::real::{Real, Vector3, lit};

/// Relative volume of the gradients of a map below which it has no inverse: a revolution maps space to a plane.
const MIN_RELATIVE_VOLUME: f64 = 1e-6;

/// Returns the unit normal of a surface in the frame of a part. `x`, `y` and `z` are the gradients of the part's
/// coordinates in the world, and `n` is the unit normal there.
///
/// A normal is a gradient: it follows the transposed inverse of the map, which stretches it where space is compressed. A map
/// without an inverse is taken for a rotation.
#[inline]
pub(crate) fn local_normal<R: Real>(x: R::Vec3, y: R::Vec3, z: R::Vec3, n: R::Vec3) -> R::Vec3 {
    let across = y.cross(z).named("across");
    let volume = x.dot(across).named("volume");
    let size = (x.length() * y.length() * z.length()).named("size");
    let has_inverse = (size * lit(MIN_RELATIVE_VOLUME)).less(volume.abs());
    let side = volume.sign_nonzero().named("side");
    let inverse = R::Vec3::new(
        across.dot(n) * side,
        z.cross(x).dot(n) * side,
        x.cross(y).dot(n) * side,
    );
    let rotated = R::Vec3::new(x.dot(n), y.dot(n), z.dot(n));
    let local = R::Vec3::select(has_inverse, inverse, rotated).named("local");
    local * (lit::<R>(1.0) / local.length().max(lit(1e-30)))
}
