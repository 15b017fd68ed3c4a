//! Blends: hard and smooth minima and maxima as one formula, `s · (min(s·a, s·b) − kernel(|a − b|))`.
//!
//! `s` is 1 for unions and −1 for intersections. A subtraction is an intersection with the second operand
//! negated. The kernel is the offset that a smooth operation adds to a hard one. It is largest where both
//! operands are equal, and zero where they differ by more than its support.

use crate::real::{Real, lit};

/// The transition of a blend from one operand to the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum BlendKernel {
    /// No transition.
    Hard = 1,
    /// A parabola.
    Quadratic,
    /// A cubic.
    Cubic,
    /// A quarter of a circle.
    Circular,
    /// An exponential, with infinite support.
    Exponential,
}

impl BlendKernel {
    /// All kernels, by number.
    pub const ALL: [Self; 5] = [
        Self::Hard,
        Self::Quadratic,
        Self::Cubic,
        Self::Circular,
        Self::Exponential,
    ];

    /// Returns the kernel's number in an instruction.
    pub const fn number(self) -> u8 {
        self as u8
    }
    /// Returns the kernel with this number.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|kernel| kernel.number() == number)
    }
    /// Returns the kernel's name in a listing and in WGSL.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hard => "hard",
            Self::Quadratic => "quadratic",
            Self::Cubic => "cubic",
            Self::Circular => "circular",
            Self::Exponential => "exponential",
        }
    }

    /// Returns the offset where the operands differ by `x ≥ 0`. `width` and `coefficient` are prepared
    /// parameters.
    #[inline(always)]
    pub fn offset_at<R: Real>(self, x: R, width: R, coefficient: R) -> R {
        let h = (width - x).max(lit(0.0)).named("h");
        match self {
            Self::Hard => lit(0.0),
            // c · h² with c = 1 / 4w: w/4 at x = 0.
            Self::Quadratic => h * h * coefficient,
            // c · h³ with c = 1 / 6w²: w/6 at x = 0.
            Self::Cubic => h * h * h * coefficient,
            // The arc of a quarter circle that touches both axes; h runs from 0 to w, and c = 1/w.
            Self::Circular => {
                let t = (h * coefficient).named("t");
                let arc = (lit::<R>(1.0) + t * (lit::<R>(2.0) - t)).sqrt();
                // (1 + t − arc) / 2, without the cancellation.
                width * (t * t / (lit::<R>(1.0) + t + arc))
            }
            // w · log2(1 + 2^(−x/w)) with c = 1/w: w at x = 0.
            Self::Exponential => {
                let t = (-(x * coefficient)).exp2();
                width * (lit::<R>(1.0) + t).log2()
            }
        }
    }

    /// Returns the largest offset, which is that of equal operands.
    pub fn max_offset(self, width: f64) -> f64 {
        match self {
            Self::Hard => 0.0,
            Self::Quadratic => width / 4.0,
            Self::Cubic => width / 6.0,
            Self::Circular => width * (1.0 - std::f64::consts::FRAC_1_SQRT_2),
            Self::Exponential => width,
        }
    }
    /// Returns an upper bound of the offset of a chain of this many operands, blended one after the other.
    /// Both the sum of the steps' largest offsets and the support bound it.
    pub fn max_chain_offset(self, width: f64, operands: usize) -> f64 {
        let steps = operands.saturating_sub(1).max(1) as f64;
        match self {
            // The order does not matter: all n operands are equal, and the sum is n · 2^(−x/w).
            Self::Exponential => width * (steps + 1.0).log2(),
            _ => (self.max_offset(width) * steps).min(self.support(width)),
        }
    }
    /// Returns the difference of the operands from which on the offset is zero.
    pub fn support(self, width: f64) -> f64 {
        match self {
            Self::Hard => 0.0,
            Self::Quadratic | Self::Cubic | Self::Circular => width,
            Self::Exponential => f64::INFINITY,
        }
    }

    /// Returns the blend of `a` and `b` with sign `s`, after `b` is multiplied by `sb`.
    #[inline(always)]
    pub fn blend<R: Real>(self, a: R, b: R, s: R, sb: R, width: R, coefficient: R) -> R {
        let b = b * sb;
        let hard = (a * s).min(b * s);
        match self {
            Self::Hard => hard * s,
            _ => (hard - self.offset_at((a - b).abs(), width, coefficient)) * s,
        }
    }
}

/// The blend that a row of the table performs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// Kernel of the smooth minimum.
    pub kernel: BlendKernel,
    /// 1 for unions, −1 for intersections and subtractions.
    pub sign: f32,
    /// Set for subtractions, which negate the second operand.
    pub negate_second: bool,
}
