//! Ranges of numbers while the point moves within a box.
//!
//! They only say how far a ray may step at once. The range of an unknown number is everything.

use super::number;
use sdfc_vm::table::Op;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The steepest slope of gradient noise along an axis, measured, with half as much to spare.
const MAX_NOISE_SLOPE: f64 = 3.3;
/// The most that rounding may add to a range, by its size.
const MAX_ROUNDING_PER_SIZE: f64 = 1e-14;

/// All numbers from one to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    /// The smallest.
    pub(super) low: f64,
    /// The largest.
    pub(super) high: f64,
}

impl Range {
    /// All numbers.
    pub(super) const EVERYTHING: Self = Self {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    /// The numbers between these, or everything if one of them is not a number.
    pub(super) fn new(low: f64, high: f64) -> Self {
        if low.is_nan() || high.is_nan() {
            return Self::EVERYTHING;
        }
        Self { low, high }
    }

    /// All numbers within `by` of one.
    pub(super) fn around(middle: f64, by: f64) -> Self {
        Self::new(middle - by, middle + by)
    }

    /// Tells if all numbers have the same sign, which zero has not.
    pub(super) fn is_signed(self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }

    /// The range of a sum.
    pub(super) fn plus(self, other: Self) -> Self {
        Self::new(self.low + other.low, self.high + other.high)
    }

    /// The range of the negated number.
    pub(super) fn negated(self) -> Self {
        Self::new(-self.high, -self.low)
    }

    /// The range of a rising function.
    pub(super) fn rising(self, f: impl Fn(f64) -> f64) -> Self {
        Self::new(f(self.low), f(self.high))
    }

    /// The range of the number without its sign.
    pub(super) fn magnitude(self) -> Self {
        if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            self.negated()
        } else {
            Self::new(0.0, self.high.max(-self.low))
        }
    }

    /// The range of the smaller of both.
    pub(super) fn least(self, other: Self) -> Self {
        Self::new(self.low.min(other.low), self.high.min(other.high))
    }

    /// The range of the larger of both.
    pub(super) fn greatest(self, other: Self) -> Self {
        self.negated().least(other.negated()).negated()
    }

    /// The numbers of both.
    fn hull(self, other: Self) -> Self {
        Self::new(self.low.min(other.low), self.high.max(other.high))
    }

    /// The range of a product.
    fn times(self, other: Self) -> Self {
        // Zero times infinity is zero: the infinite end is never reached.
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let ends = [
            product(self.low, other.low),
            product(self.low, other.high),
            product(self.high, other.low),
            product(self.high, other.high),
        ];
        let low = ends.into_iter().fold(f64::INFINITY, f64::min);
        let high = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
        Self::new(low, high)
    }

    fn over(self, other: Self) -> Self {
        if other.low <= 1e-18 && other.high >= -1e-18 {
            return Self::EVERYTHING;
        }
        self.times(Self::new(other.high.recip(), other.low.recip()))
    }

    /// The range of a sine.
    fn sine(self) -> Self {
        if (self.high - self.low).is_nan() || self.high - self.low >= TAU {
            return Self::new(-1.0, 1.0);
        }
        // Whether a crest, or a trough half a turn later, lies within.
        let holds = |at: f64| ((self.high - at) / TAU).floor() >= ((self.low - at) / TAU).ceil();
        let ends = [self.low.sin(), self.high.sin()];
        Self::new(
            if holds(-FRAC_PI_2) {
                -1.0
            } else {
                ends[0].min(ends[1])
            },
            if holds(FRAC_PI_2) {
                1.0
            } else {
                ends[0].max(ends[1])
            },
        )
    }

    /// The range of the part above the whole number, for a spacing of one.
    fn fraction(self) -> Self {
        let whole = self.low.floor();
        if self.high.floor() > whole || !self.low.is_finite() {
            return Self::new(0.0, 1.0);
        }
        Self::new(self.low - whole, self.high - whole)
    }

    /// Tells if a tangent is finite for all of these.
    fn is_between_poles(self) -> bool {
        let piece = |v: f64| (v / PI + 0.5).floor();
        self.low.is_finite() && piece(self.low) == piece(self.high)
    }

    /// The same with a little more on both sides, for rounding.
    fn rounded(self) -> Self {
        let size = self.low.abs().max(self.high.abs());
        let slack = if size.is_finite() {
            size * MAX_ROUNDING_PER_SIZE
        } else {
            0.0
        };
        Self::new(self.low - slack, self.high + slack)
    }
}

/// The range of a truth value that is known to be 1 or known to be 0, or neither.
fn truth(is_true: bool, is_false: bool) -> Range {
    Range::new(f64::from(u8::from(is_true)), f64::from(u8::from(!is_false)))
}

/// The range of the angle of a vector in a box.
///
/// Its ends are at corners, unless the box holds a piece of the axis at which the angle jumps.
fn angle(y: Range, x: Range) -> Range {
    if x.low <= 0.0 && !y.is_signed() {
        return Range::new(-PI, PI);
    }
    let corner = |y: f64, x: f64| Range::around(y.atan2(x), 0.0);
    let left = corner(y.low, x.low).hull(corner(y.high, x.low));
    left.hull(corner(y.low, x.high))
        .hull(corner(y.high, x.high))
}

/// The range of the number that an operation of arithmetic makes.
pub(super) fn arithmetic(op: Op, [a, b, c]: [Range; 3]) -> Range {
    let range = match op {
        Op::Add => a.plus(b),
        Op::Sub => a.plus(b.negated()),
        Op::Mul => a.times(b),
        Op::Square => a.magnitude().rising(|v| v * v),
        Op::Div => a.over(b),
        Op::Modulo if b.low == b.high && b.low.abs() > 1e-18 => a.over(b).fraction().times(b),
        Op::Neg => a.negated(),
        Op::Abs => a.magnitude(),
        Op::Sign => a.rising(|v| if v == 0.0 { 0.0 } else { v.signum() }),
        Op::Min | Op::And => a.least(b),
        Op::Max | Op::Or => a.greatest(b),
        Op::Clamp => a.greatest(b).least(c),
        Op::Floor => a.rising(f64::floor),
        Op::Ceil => a.rising(f64::ceil),
        Op::Round => a.rising(|v| (v + 0.5).floor()),
        Op::Fract => a.fraction(),
        Op::Trunc => a.rising(f64::trunc),
        Op::Sqrt => a.rising(|v| v.max(0.0).sqrt()),
        Op::InverseSqrt => a.negated().rising(|v| (-v).max(1e-30).sqrt().recip()),
        Op::Sin => a.sine(),
        Op::Cos => a.rising(|v| v + FRAC_PI_2).sine(),
        Op::Asin => a.rising(|v| v.clamp(-1.0, 1.0).asin()),
        Op::Acos => a.negated().rising(|v| (-v).clamp(-1.0, 1.0).acos()),
        Op::Atan => a.rising(f64::atan),
        Op::Tan if a.is_between_poles() => a.rising(f64::tan),
        Op::Atan2 => angle(a, b),
        Op::Sinh => a.rising(f64::sinh),
        Op::Cosh => a.magnitude().rising(f64::cosh),
        Op::Tanh => a.rising(f64::tanh),
        Op::Exp => a.rising(f64::exp),
        Op::Exp2 => a.rising(f64::exp2),
        Op::Ln => a.rising(|v| v.max(f64::MIN_POSITIVE).ln()),
        Op::Log2 => a.rising(|v| v.max(f64::MIN_POSITIVE).log2()),
        Op::Pow if b.low == b.high && b.low >= 0.0 => a.rising(|v| v.max(0.0).powf(b.low)),
        Op::Step => truth(b.low >= a.high, b.high < a.low),
        Op::Less => truth(a.high < b.low, a.low >= b.high),
        Op::Smoothstep if a.low == a.high && b.low == b.high && a.low < b.low => {
            c.rising(|v| number::arithmetic(op, [a.low, b.low, v]))
        }
        Op::Smoothstep => Range::new(0.0, 1.0),
        Op::Mix => a.plus(b.plus(a.negated()).times(c)),
        Op::Not => Range::new(1.0, 1.0).plus(a.negated()),
        Op::Select if a.low > 0.5 => b,
        Op::Select if a.high <= 0.5 => c,
        Op::Select => b.hull(c),
        _ => Range::EVERYTHING,
    };
    range.rounded()
}

/// The range of noise of one of the rows on top of a range.
///
/// `middle` is the noise in the middle of the point's ranges.
pub(super) fn noise(op: Op, sum: Range, p: [Range; 3], middle: f64, numbers: &[f64]) -> Range {
    let (frequency, amplitude) = match numbers {
        [_, _, _, frequency, amplitude, _] => (*frequency, *amplitude),
        _ => (1.0, 1.0),
    };
    let reach: f64 = p.iter().map(|r| 0.5 * (r.high - r.low)).sum();
    let near = Range::around(middle, MAX_NOISE_SLOPE * frequency.abs() * reach);
    let near = near.rising(|v| v.clamp(-1.0, 1.0));
    let value = match op {
        Op::Noise => return near,
        Op::NoiseSlope => return Range::around(0.0, MAX_NOISE_SLOPE * 3.0_f64.sqrt()),
        Op::RidgeOctave => near.magnitude().negated().rising(|v| 1.0 + 2.0 * v),
        _ => near,
    };
    sum.plus(value.times(Range::around(amplitude, 0.0)))
        .rounded()
}
