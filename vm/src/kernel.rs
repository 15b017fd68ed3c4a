//! The blends: hard and smooth minima and maxima as one formula,
//! `s · (min(s·a, s·b) − kernel(|a − b|))`.
//!
//! `s` is 1 for unions and −1 for intersections; a subtraction is an intersection with the second
//! operand negated. The kernel is what a smooth operation adds to a hard one: most, the thickness,
//! where both operands are equal, and nothing where they differ by more than its support.

use crate::real::{Real, lit};

/// How a blend eases from one operand to the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Kernel {
    /// Not at all.
    Hard = 1,
    /// By a parabola.
    Quadratic,
    /// By a cubic.
    Cubic,
    /// By a quarter of a circle.
    Circular,
    /// By an exponential, which never ends.
    Exponential,
}

impl Kernel {
    /// All kernels, by number.
    pub const ALL: [Self; 5] = [
        Self::Hard,
        Self::Quadratic,
        Self::Cubic,
        Self::Circular,
        Self::Exponential,
    ];

    /// Its number in an instruction.
    pub const fn number(self) -> u8 {
        self as u8
    }
    /// The kernel with this number.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|kernel| kernel.number() == number)
    }
    /// Its name in a listing and in WGSL.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hard => "hard",
            Self::Quadratic => "quadratic",
            Self::Cubic => "cubic",
            Self::Circular => "circular",
            Self::Exponential => "exponential",
        }
    }

    /// What the kernel adds where the operands differ by `x ≥ 0`; `width` and `coefficient` are
    /// those of the prepared parameters.
    #[inline(always)]
    pub fn bulge<R: Real>(self, x: R, width: R, coefficient: R) -> R {
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

    /// The most that the kernel adds: its value where the operands are equal.
    pub fn thickness(self, width: f64) -> f64 {
        match self {
            Self::Hard => 0.0,
            Self::Quadratic => width / 4.0,
            Self::Cubic => width / 6.0,
            Self::Circular => width * (1.0 - std::f64::consts::FRAC_1_SQRT_2),
            Self::Exponential => width,
        }
    }
    /// The most that a chain of this many operands adds, one blended after the other: no more than
    /// each step adds at most, and no more than where the kernel ends.
    pub fn most(self, width: f64, operands: usize) -> f64 {
        let steps = operands.saturating_sub(1).max(1) as f64;
        match self {
            // The order does not matter: all n operands are equal, and the sum is n · 2^(−x/w).
            Self::Exponential => width * (steps + 1.0).log2(),
            _ => (self.thickness(width) * steps).min(self.support(width)),
        }
    }
    /// The difference of the operands from which on the kernel adds nothing.
    pub fn support(self, width: f64) -> f64 {
        match self {
            Self::Hard => 0.0,
            Self::Quadratic | Self::Cubic | Self::Circular => width,
            Self::Exponential => f64::INFINITY,
        }
    }

    /// The share that the farther operand has in the result where the operands differ by `x ≥ 0`:
    /// a half where they are equal. It is how much the result follows that operand, and what a
    /// blend of two materials gives the farther one.
    #[inline(always)]
    pub fn share<R: Real>(self, x: R, width: R, coefficient: R) -> R {
        let h = (width - x).max(lit(0.0));
        match self {
            Self::Hard => lit(0.0),
            Self::Quadratic => h * coefficient * lit(2.0),
            Self::Cubic => h * h * coefficient * lit(3.0),
            Self::Circular => {
                let t = h * coefficient;
                let arc = (lit::<R>(1.0) + t * (lit::<R>(2.0) - t))
                    .max(lit(1e-12))
                    .sqrt();
                // (1 − (1 − t) / arc) / 2, without the cancellation.
                t * (lit::<R>(2.0) - t) / (arc * (arc + lit(1.0) - t))
            }
            Self::Exponential => {
                let t = (-(x * coefficient)).exp2();
                t / (lit::<R>(1.0) + t)
            }
        }
    }

    /// The blend of `a` and `b` with sign `s`, after `b` is multiplied by `sb`.
    #[inline(always)]
    pub fn blend<R: Real>(self, a: R, b: R, s: R, sb: R, width: R, coefficient: R) -> R {
        let b = b * sb;
        let hard = (a * s).min(b * s);
        match self {
            Self::Hard => hard * s,
            _ => (hard - self.bulge((a - b).abs(), width, coefficient)) * s,
        }
    }
}

/// That a row of the table is a blend, and which.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// The kernel.
    pub kernel: Kernel,
    /// 1 for unions, −1 for intersections and subtractions.
    pub sign: f32,
    /// Whether the second operand is negated: a subtraction.
    pub negate_second: bool,
}
