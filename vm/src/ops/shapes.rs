//! Solids. Each is centred at the origin with its axis along y, unless it says otherwise.

use crate::real::{Real, Vector3, lit};

/// A ball: the distance to the centre, less the radius.
#[inline(always)]
pub fn sphere<R: Real>(p: R::Vec3, r: R) -> R {
    p.length() - r
}

/// A box with sharp edges. `q` is how far the point is beyond each face: outside, the length of
/// its positive part; inside, its largest (negative) component.
#[inline(always)]
pub fn cuboid<R: Real>(p: R::Vec3, half: R::Vec3) -> R {
    let q = (p.abs() - half).named("q");
    q.max(R::Vec3::splat(lit(0.0))).length() + q.max_component().min(lit(0.0))
}

/// A box with rounded edges: a smaller sharp one, grown by `round`.
#[inline(always)]
pub fn rounded_cuboid<R: Real>(p: R::Vec3, half: R::Vec3, round: R) -> R {
    cuboid::<R>(p, half - R::Vec3::splat(round)) - round
}
