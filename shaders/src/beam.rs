//! Beams: conservative distances that all rays of a block of 8 × 8 pixels can advance without a hit.
//!
//! A beam is the ray through the middle of a block, and the distance of the other rays from it. That is
//! `spread` where they start, and `widening` more per unit along the ray. Let a surface be farther from a
//! point of the middle ray than the other rays are. Then its distance from any of these is at least the
//! difference, so that all rays advance by that, less the threshold of the march. Each ray then begins its
//! own march where the beam ended. (The idea is that of a coarse first pass for octrees: S. Laine and T.
//! Karras, *Efficient Sparse Voxel Octrees*, 2010, section 4.3.)
//!
//! Measured at 320×180, without cells: 11 to 40 % of the evaluations of marches are saved, most of them over
//! open ground.

use sdfc_vm::real::{Real, Vector3, lit};

/// Side of a block, in pixels.
pub const BLOCK_SIDE: u32 = 8;
/// Maximum number of evaluations for a beam.
pub const MAX_STEPS: u32 = 32;

/// Returns the distance between two points, or between the ends of two directions.
#[inline(always)]
pub fn distance_between<R: Real>(a: R::Vec3, b: R::Vec3) -> R {
    (a - b).length()
}

/// Returns the start of a beam from `origin`: no ray of it is in the box before that distance.
#[inline(always)]
pub fn start_t<R: Real>(origin: R::Vec3, low: R::Vec3, high: R::Vec3, spread: R) -> R {
    let zero = R::Vec3::splat(lit(0.0));
    let outside = (low - origin).max(origin - high).max(zero).named("outside");
    (outside.length() * lit(1.0 - 1e-5) - spread).max(lit(0.0))
}

/// Returns the point of the box that is nearest to a point of the middle ray. The field is evaluated there,
/// since its slope may be bounded in the box only. All surfaces are in there too, and none is nearer to `p`
/// than to the result.
#[inline(always)]
pub fn clamp_to_box<R: Real>(p: R::Vec3, low: R::Vec3, high: R::Vec3) -> R::Vec3 {
    p.max(low).min(high)
}

/// Returns the distance that all rays advance from `t`, where the field is `field`. The field has a slope of
/// at most one, and rays stop within `threshold` of a surface.
#[inline(always)]
pub fn advance<R: Real>(t: R, field: R, spread: R, widening: R, threshold: R) -> R {
    field - (spread + widening * t) * lit(1.0 + 1e-5) - threshold
}

/// Returns 1 if the beam continues by `advance`, else 0: where that is at most two pixels, or not a number.
#[inline(always)]
pub fn should_continue<R: Real>(advance: R, half_pixel: R) -> R {
    R::select((half_pixel * lit(4.0)).less(advance), lit(1.0), lit(0.0))
}
