//! Interval arithmetic for numbers over a box of points.
//!
//! Ranges only limit the step length of rays. The range of an unknown number is unbounded.

use super::arithmetic;
use sdfc_vm::table::Op;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Largest slope of gradient noise along an axis: 1.5 times the measured maximum.
const MAX_NOISE_SLOPE: f64 = 3.3;
/// Largest rounding error of a range, relative to its size.
const MAX_ROUNDING_PER_SIZE: f64 = 1e-14;

/// Closed interval of numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct ValueRange {
    /// Lower end.
    pub(super) low: f64,
    /// Upper end.
    pub(super) high: f64,
}

impl ValueRange {
    /// All numbers.
    pub(super) const UNBOUNDED: Self = Self {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    /// Creates a range from its ends, which is unbounded if one of them is NaN.
    pub(super) fn new(low: f64, high: f64) -> Self {
        if low.is_nan() || high.is_nan() {
            return Self::UNBOUNDED;
        }
        Self { low, high }
    }

    /// Creates the range of all numbers within `radius` of a centre.
    pub(super) fn centred(centre: f64, radius: f64) -> Self {
        Self::new(centre - radius, centre + radius)
    }

    /// Reports whether all numbers have the same nonzero sign.
    pub(super) fn excludes_zero(self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }

    /// Returns the range of the sum.
    pub(super) fn plus(self, other: Self) -> Self {
        Self::new(self.low + other.low, self.high + other.high)
    }

    /// Returns the range of the negated number.
    pub(super) fn negated(self) -> Self {
        Self::new(-self.high, -self.low)
    }

    /// Returns the range of an increasing function.
    pub(super) fn map_increasing(self, f: impl Fn(f64) -> f64) -> Self {
        Self::new(f(self.low), f(self.high))
    }

    /// Returns the range of the absolute value.
    pub(super) fn abs(self) -> Self {
        if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            self.negated()
        } else {
            Self::new(0.0, self.high.max(-self.low))
        }
    }

    /// Returns the range of the minimum.
    pub(super) fn min(self, other: Self) -> Self {
        Self::new(self.low.min(other.low), self.high.min(other.high))
    }

    /// Returns the range of the maximum.
    pub(super) fn max(self, other: Self) -> Self {
        self.negated().min(other.negated()).negated()
    }

    /// Returns the smallest range that contains both.
    fn hull(self, other: Self) -> Self {
        Self::new(self.low.min(other.low), self.high.max(other.high))
    }

    /// Returns the range of the product.
    fn times(self, other: Self) -> Self {
        // Zero times infinity is zero: an infinite end is never attained.
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

    fn divided_by(self, other: Self) -> Self {
        if other.low <= 1e-18 && other.high >= -1e-18 {
            return Self::UNBOUNDED;
        }
        self.times(Self::new(other.high.recip(), other.low.recip()))
    }

    /// Returns the range of the sine.
    fn sine(self) -> Self {
        if (self.high - self.low).is_nan() || self.high - self.low >= TAU {
            return Self::new(-1.0, 1.0);
        }
        // Reports whether a maximum of the sine at π/2, or a minimum at -π/2, is in the range.
        let contains = |extremum: f64| {
            ((self.high - extremum) / TAU).floor() >= ((self.low - extremum) / TAU).ceil()
        };
        let ends = [self.low.sin(), self.high.sin()];
        Self::new(
            if contains(-FRAC_PI_2) {
                -1.0
            } else {
                ends[0].min(ends[1])
            },
            if contains(FRAC_PI_2) {
                1.0
            } else {
                ends[0].max(ends[1])
            },
        )
    }

    /// Returns the range of the fractional part.
    fn fract(self) -> Self {
        let floor = self.low.floor();
        if self.high.floor() > floor || !self.low.is_finite() {
            return Self::new(0.0, 1.0);
        }
        Self::new(self.low - floor, self.high - floor)
    }

    /// Reports whether the tangent is finite over the range.
    fn is_between_poles(self) -> bool {
        let branch = |v: f64| (v / PI + 0.5).floor();
        self.low.is_finite() && branch(self.low) == branch(self.high)
    }

    /// Returns the range extended on both sides to cover rounding.
    fn widened_for_rounding(self) -> Self {
        let size = self.low.abs().max(self.high.abs());
        let slack = if size.is_finite() {
            size * MAX_ROUNDING_PER_SIZE
        } else {
            0.0
        };
        Self::new(self.low - slack, self.high + slack)
    }
}

/// Returns the range of a truth value that is certainly 1, certainly 0, or unknown.
fn truth_range(is_true: bool, is_false: bool) -> ValueRange {
    ValueRange::new(f64::from(u8::from(is_true)), f64::from(u8::from(!is_false)))
}

/// Returns the range of `atan2` over a box.
///
/// The extremes are at corners, unless the box meets the half axis at which the angle is discontinuous.
fn angle(y: ValueRange, x: ValueRange) -> ValueRange {
    if x.low <= 0.0 && !y.excludes_zero() {
        return ValueRange::new(-PI, PI);
    }
    let at_corner = |y: f64, x: f64| ValueRange::centred(y.atan2(x), 0.0);
    let range = at_corner(y.low, x.low).hull(at_corner(y.high, x.low));
    range
        .hull(at_corner(y.low, x.high))
        .hull(at_corner(y.high, x.high))
}

/// Returns the range of the result of an arithmetic operation.
pub(super) fn arithmetic(op: Op, [a, b, c]: [ValueRange; 3]) -> ValueRange {
    let range = match op {
        Op::Add => a.plus(b),
        Op::Sub => a.plus(b.negated()),
        Op::Mul => a.times(b),
        Op::Square => a.abs().map_increasing(|v| v * v),
        Op::Div => a.divided_by(b),
        Op::Modulo if b.low == b.high && b.low.abs() > 1e-18 => a.divided_by(b).fract().times(b),
        Op::Neg => a.negated(),
        Op::Abs => a.abs(),
        Op::Sign => a.map_increasing(|v| if v == 0.0 { 0.0 } else { v.signum() }),
        Op::Min | Op::And => a.min(b),
        Op::Max | Op::Or => a.max(b),
        Op::Clamp => a.max(b).min(c),
        Op::Floor => a.map_increasing(f64::floor),
        Op::Ceil => a.map_increasing(f64::ceil),
        Op::Round => a.map_increasing(|v| (v + 0.5).floor()),
        Op::Fract => a.fract(),
        Op::Trunc => a.map_increasing(f64::trunc),
        Op::Sqrt => a.map_increasing(|v| v.max(0.0).sqrt()),
        Op::InverseSqrt => a
            .negated()
            .map_increasing(|v| (-v).max(1e-30).sqrt().recip()),
        Op::Sin => a.sine(),
        Op::Cos => a.map_increasing(|v| v + FRAC_PI_2).sine(),
        Op::Asin => a.map_increasing(|v| v.clamp(-1.0, 1.0).asin()),
        Op::Acos => a.negated().map_increasing(|v| (-v).clamp(-1.0, 1.0).acos()),
        Op::Atan => a.map_increasing(f64::atan),
        Op::Tan if a.is_between_poles() => a.map_increasing(f64::tan),
        Op::Atan2 => angle(a, b),
        Op::Sinh => a.map_increasing(f64::sinh),
        Op::Cosh => a.abs().map_increasing(f64::cosh),
        Op::Tanh => a.map_increasing(f64::tanh),
        Op::Exp => a.map_increasing(f64::exp),
        Op::Exp2 => a.map_increasing(f64::exp2),
        Op::Ln => a.map_increasing(|v| v.max(f64::MIN_POSITIVE).ln()),
        Op::Log2 => a.map_increasing(|v| v.max(f64::MIN_POSITIVE).log2()),
        Op::Pow if b.low == b.high && b.low >= 0.0 => a.map_increasing(|v| v.max(0.0).powf(b.low)),
        Op::Step => truth_range(b.low >= a.high, b.high < a.low),
        Op::Less => truth_range(a.high < b.low, a.low >= b.high),
        Op::Smoothstep if a.low == a.high && b.low == b.high && a.low < b.low => {
            c.map_increasing(|v| arithmetic::arithmetic(op, [a.low, b.low, v]))
        }
        Op::Smoothstep => ValueRange::new(0.0, 1.0),
        Op::Mix => a.plus(b.plus(a.negated()).times(c)),
        Op::Not => ValueRange::new(1.0, 1.0).plus(a.negated()),
        Op::Select if a.low > 0.5 => b,
        Op::Select if a.high <= 0.5 => c,
        Op::Select => b.hull(c),
        _ => ValueRange::UNBOUNDED,
    };
    range.widened_for_rounding()
}

/// Returns the range of a noise row applied to a range.
///
/// `centre` is the noise at the centre of the point's ranges.
pub(super) fn noise(
    op: Op,
    sum: ValueRange,
    p: [ValueRange; 3],
    centre: f64,
    numbers: &[f64],
) -> ValueRange {
    let (frequency, amplitude) = match numbers {
        [_, _, _, frequency, amplitude, _] => (*frequency, *amplitude),
        _ => (1.0, 1.0),
    };
    let half_width_sum: f64 = p.iter().map(|r| 0.5 * (r.high - r.low)).sum();
    let value_range =
        ValueRange::centred(centre, MAX_NOISE_SLOPE * frequency.abs() * half_width_sum);
    let value_range = value_range.map_increasing(|v| v.clamp(-1.0, 1.0));
    let value = match op {
        Op::Noise => return value_range,
        Op::NoiseSlope => return ValueRange::centred(0.0, MAX_NOISE_SLOPE * 3.0_f64.sqrt()),
        Op::RidgeOctave => value_range
            .abs()
            .negated()
            .map_increasing(|v| 1.0 + 2.0 * v),
        _ => value_range,
    };
    sum.plus(value.times(ValueRange::centred(amplitude, 0.0)))
        .widened_for_rounding()
}
