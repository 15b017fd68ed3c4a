//! Two distances into one: hard and smooth set operations.
//!
//! All that are a minimum at heart are one formula, `s · (min(s·a, s·b) − kernel(|a − b|))` with
//! `s = 1` for unions and `s = −1` for intersections; a subtraction intersects with the negated
//! second operand. The kernel is what a smooth operation adds: zero where the operands differ by
//! more than its `width`, and the thickness that the scene asked for where they are equal.

use crate::real::{Real, lit};

/// The union: the nearer of two.
#[inline(always)]
pub fn union<R: Real>(a: R, b: R) -> R {
    a.min(b)
}

/// The intersection: the farther of two.
#[inline(always)]
pub fn intersection<R: Real>(a: R, b: R) -> R {
    a.max(b)
}

/// The first without the second.
#[inline(always)]
pub fn subtraction<R: Real>(a: R, b: R) -> R {
    a.max(-b)
}

/// What the quadratic kernel adds: `c · (w − x)²` for `x < w`, with `c = 1 / 4w`.
#[inline(always)]
pub fn quadratic<R: Real>(x: R, width: R, coefficient: R) -> R {
    let h = (width - x).max(lit(0.0)).named("h");
    h * h * coefficient
}

/// The union with a quadratic blend.
#[inline(always)]
pub fn smooth_union<R: Real>(a: R, b: R, width: R, coefficient: R) -> R {
    a.min(b) - quadratic((a - b).abs(), width, coefficient)
}
