//! Half spaces and slabs.

use crate::bounds::Bounds;
use crate::real::{Real, Vector3};

/// Returns the signed distance to the half space below a plane with the unit normal `normal`, `at` from the
/// origin.
#[inline(always)]
pub fn plane<R: Real>(p: R::Vec3, normal: R::Vec3, at: R) -> R {
    p.dot(normal) - at
}

/// Bounds a half space. It is bounded along an axis if that is its normal.
pub fn plane_bounds(a: &[f64]) -> Bounds {
    let mut b = Bounds::ALL_SPACE;
    for i in 0..3 {
        if a[(i + 1) % 3] == 0.0 && a[(i + 2) % 3] == 0.0 {
            if a[i] > 0.0 {
                b.max[i] = a[3] / a[i];
            } else if a[i] < 0.0 {
                b.min[i] = a[3] / a[i];
            }
        }
    }
    b
}

/// Returns the signed distance to all points within `half` of the plane through the origin with the unit normal
/// `normal`.
#[inline(always)]
pub fn slab<R: Real>(p: R::Vec3, normal: R::Vec3, half: R) -> R {
    p.dot(normal).abs() - half
}

/// Bounds a slab, given its normal and half thickness.
pub fn slab_bounds(a: &[f64]) -> Bounds {
    let side = |sign: f64| plane_bounds(&[a[0] * sign, a[1] * sign, a[2] * sign, a[3]]);
    side(1.0).intersection(&side(-1.0))
}
