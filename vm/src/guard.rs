//! Guards: what a program may leave out at a point.
//!
//! A guard stands in front of a block of instructions that blends shapes into the value on top. It
//! holds a box around those shapes and how near they have to be to matter. Where a point is farther
//! from the box, the block would give back the value on top in every bit, and is skipped.

use crate::real::{Real, Vector3, lit};

/// What a guard compares is squared; the one side is taken by this much larger, so that rounding,
/// of the guard or of the shapes, never skips what matters. What is far away is less certain.
pub const CAUTION: f64 = 1.001;

/// By how much `p` lies beyond the reach of what a guard stands in front of, as a difference of
/// squares: above zero, it has no part in `top`. The shapes are within `half` of `centre`; they
/// matter where they are nearer than `factor` times `top` and `reach` together.
#[inline(always)]
pub fn beyond<R: Real>(
    p: R::Vec3,
    top: R,
    centre: R::Vec3,
    reach: R,
    half: R::Vec3,
    factor: R,
) -> R {
    let gap = ((p - centre).abs() - half)
        .max(R::Vec3::splat(lit(0.0)))
        .named("gap");
    // In this order, what is not a number stays so, and nothing is skipped.
    let near = lit::<R>(0.0).max(top * factor + reach).named("near");
    gap.dot(gap) - near * near * lit(CAUTION)
}
