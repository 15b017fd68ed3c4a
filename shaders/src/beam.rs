//! Beams: how far all rays of a block of 8 × 8 pixels can go before any of them can meet something.
//!
//! A beam is the ray through the middle of a block and how far the others are from it: `spread` where
//! they start, and `widening` more per unit of the way. A surface that is farther from a point of the
//! middle ray than the others are there cannot be nearer to any of them than the difference, so they
//! all go on by that much; what they stop at, the threshold of the march, is left between. Then
//! each begins its own march where the beam ended. (The idea is that of a coarse first pass for
//! octrees: S. Laine and T. Karras, *Efficient Sparse Voxel Octrees*, 2010, section 4.3.)
//!
//! Measured at 320×180, without cells: 11 to 40 % of the evaluations of marches are saved, most of
//! them over open ground.

use sdfc_vm::real::{Real, Vector3, lit};

/// The pixels along a side of a block.
pub const SIDE: u32 = 8;
/// The most evaluations for a beam.
pub const STEPS: u32 = 32;

/// How far apart two points are, or the ends of two directions.
#[inline(always)]
pub fn apart<R: Real>(a: R::Vec3, b: R::Vec3) -> R {
    (a - b).length()
}

/// Where a beam begins that starts at `origin`: before that no ray of it is in the box.
#[inline(always)]
pub fn begin<R: Real>(origin: R::Vec3, low: R::Vec3, high: R::Vec3, spread: R) -> R {
    let zero = R::Vec3::splat(lit(0.0));
    let outside = (low - origin).max(origin - high).max(zero).named("outside");
    (outside.length() * lit(1.0 - 1e-5) - spread).max(lit(0.0))
}

/// Where the field is asked for a point of the middle ray: in the box, since the slope of a field may
/// be known there only. All surfaces are in there too, and none is nearer to the point than to this one.
#[inline(always)]
pub fn within<R: Real>(p: R::Vec3, low: R::Vec3, high: R::Vec3) -> R::Vec3 {
    p.max(low).min(high)
}

/// How far its rays all go on from `t`, where the field is `field`, its slope being one, and rays
/// stop within `threshold` of a surface.
#[inline(always)]
pub fn advance<R: Real>(t: R, field: R, spread: R, widening: R, threshold: R) -> R {
    field - (spread + widening * t) * lit(1.0 + 1e-5) - threshold
}

/// Whether, as 1 or 0, it is worth going on by so much: not in steps of less than two pixels, nor by
/// what is not a number.
#[inline(always)]
pub fn goes_on<R: Real>(way: R, half_pixel: R) -> R {
    R::select((half_pixel * lit(4.0)).less(way), lit(1.0), lit(0.0))
}
