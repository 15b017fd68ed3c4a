//! Guards: blocks of a program that a point may skip.
//!
//! A guard precedes a block of instructions that blends shapes into the value on top. It holds a box around
//! those shapes and the influence radius within which they matter. For a point that is farther from the
//! box, the block would return the value on top with the same bits, and is skipped.

use crate::real::{Real, Vector3, lit};

/// Safety factor on the squared influence radius, so that rounding, of the guard or of the shapes, never
/// skips a block that matters. Rounding errors grow with the distance.
pub const SAFETY_FACTOR: f64 = 1.001;

/// Returns the signed squared margin by which `p` is outside the influence region of a guard's block. If it
/// is positive, the block does not affect `top`. The shapes are within `half` of `centre`; they matter at
/// distances below `scale` times `top` plus `radius`.
#[inline(always)]
pub fn influence_margin_sq<R: Real>(
    p: R::Vec3,
    top: R,
    centre: R::Vec3,
    radius: R,
    half: R::Vec3,
    scale: R,
) -> R {
    let gap = ((p - centre).abs() - half)
        .max(R::Vec3::splat(lit(0.0)))
        .named("gap");
    // In this order, NaN stays NaN, and nothing is skipped.
    let near = lit::<R>(0.0).max(top * scale + radius).named("near");
    gap.dot(gap) - near * near * lit(SAFETY_FACTOR)
}
