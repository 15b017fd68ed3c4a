//! Running error bounds: the error of `f32` evaluation, for every point of a box.
//!
//! A [`RunningError`] number is an interval that contains the value of a formula for real numbers, and an
//! error bound. That bounds the difference to the `f32` value at the same point, by the same operations.
//! Evaluating a body, or a program ([`error_bound`]), on this type gives its error bound. Each operation
//! adds half a unit in the last place of its result to the propagated errors of its operands (J. H.
//! Wilkinson, *Rounding Errors in Algebraic Processes*, 1963).
//!
//! **Included** are the rounding of every sum, product, quotient, root and literal, the measured errors of
//! our own elementary functions, and the flushing of denormals. So are the errors of the coordinates, as
//! given by the caller. A fused multiply-add rounds less, so the bound holds for it too. **Not included**
//! are devices whose divisions or roots have larger errors than IEEE 754 allows. Neither are the constants
//! of the program, which were rounded once and are exact since then.
//!
//! **Decisions.** A floor, a `select` and an angle at its cut are discontinuous. Where a point is nearer to
//! the discontinuity than rounding, `f32` may decide differently from real numbers. Then the result is
//! marked as [`branch_uncertain`](RunningError::branch_uncertain): `error` holds if both decide alike, and
//! `f32` may have the value from the other side. If both sides differ by at most rounding, as at an edge of
//! a shape, the mark is not set. Minima and maxima never set it.

mod error_bound;

pub use error_bound::error_bound;

use crate::interval::{Interval, MAX_NOISE_CURVATURE, MAX_NOISE_SLOPE, MAX_NOISE_STEEPNESS};
use crate::real::Real;
use crate::vector::{V2, V3};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The unit roundoff of `f32`, 2⁻²⁴, and an allowance for the rounding of the error sums in `f64`.
const UNIT_ROUNDOFF_WITH_SLACK: f64 = 5.960_465e-8;
/// The smallest normal number of `f32`; smaller numbers may be flushed to zero.
const MIN_NORMAL: f64 = 1.175_494_4e-38;
/// The length of three components whose squares are flushed to zero.
const MIN_LENGTH: f64 = 2e-19;
/// The largest finite number.
const MAX_FINITE: f64 = f32::MAX as f64;
/// A length below this has a finite square.
const MAX_SQUARABLE: f64 = 1e19;
/// Integers up to this magnitude are exact, with a margin for the last place of the interval's ends.
const MAX_EXACT_INTEGER: f64 = 16_777_215.5;
/// The rounding error of noise for exact coordinates; measured to be below 9e-7.
const NOISE_ERROR: f64 = 3e-6;
/// The rounding error of the noise's gradient for exact coordinates.
const NOISE_SLOPE_ERROR: f64 = 3e-5;
/// The rounding error of the distance to an ellipsoid, as a fraction of the sum of coordinates and radii;
/// measured to be below 3e-7.
const DISTANCE_ERROR: f64 = 1e-6;

/// A range of numbers, and a bound of the `f32` error of each of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunningError {
    /// The values for real numbers, over the points of the box.
    pub value: Interval,
    /// The largest `f32` error at any point of the box, if `f32` decides as real numbers do. Infinite where
    /// it is unknown, or where `f32` overflows.
    pub error: f64,
    /// Set if `f32` may decide differently somewhere in the box.
    pub branch_uncertain: bool,
    /// Set if all numbers are integers, so that sums and products of them are not rounded.
    pub is_integer: bool,
}

/// The three-valued result of a comparison, with the effects of rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RoundedComparison {
    /// Set if it may hold for some point.
    pub can_be_true: bool,
    /// Set if it may fail for some point.
    pub can_be_false: bool,
    /// Set if rounding of the operands may change the `f32` result at some point.
    pub may_differ: bool,
    /// Set if the branch decisions of an operand are uncertain.
    pub branch_uncertain: bool,
}

impl RunningError {
    /// Creates a number that `f32` represents exactly.
    pub fn exact(value: f64) -> Self {
        Self {
            value: Interval::point(value),
            error: 0.0,
            branch_uncertain: false,
            is_integer: value.fract() == 0.0,
        }
    }
    /// Returns the largest `f32` error for any decisions: infinite where they are uncertain.
    pub fn worst_case_error(self) -> f64 {
        if self.branch_uncertain {
            f64::INFINITY
        } else {
            self.error
        }
    }
    /// Reports whether the value may be zero somewhere, for real numbers or in `f32`.
    pub fn may_be_zero(self) -> bool {
        self.value.lo <= self.error && self.value.hi >= -self.error
    }

    /// Creates the rounded result of an operation whose operands propagate the error `propagated`.
    #[inline(always)]
    fn rounded(value: Interval, propagated: f64, uncertain: bool) -> Self {
        let largest = value.magnitude() + propagated;
        Self::with_error(
            value,
            propagated + largest * UNIT_ROUNDOFF_WITH_SLACK + MIN_NORMAL,
            uncertain,
        )
    }
    /// Creates the result of an operation with this total error. The error becomes infinite if the value
    /// may overflow or be NaN.
    #[inline(always)]
    fn with_error(value: Interval, error: f64, uncertain: bool) -> Self {
        let fits = value.magnitude() + error <= MAX_FINITE;
        Self {
            value,
            error: if fits { error } else { f64::INFINITY },
            branch_uncertain: uncertain,
            is_integer: false,
        }
    }
    /// Creates a result with an unknown error.
    #[inline(always)]
    fn unknown(value: Interval, uncertain: bool) -> Self {
        Self {
            value,
            error: f64::INFINITY,
            branch_uncertain: uncertain,
            is_integer: false,
        }
    }
    /// Returns the random numbers of a cell, which are exact where the cell is.
    fn random(
        cell_values: impl Fn(V3<Interval>, Interval) -> V3<Interval>,
        cell: V3<Self>,
        seed: Self,
    ) -> V3<Self> {
        let values = V3::new(cell.x.value, cell.y.value, cell.z.value);
        let v = cell_values(values, seed.value);
        let inputs = [cell.x, cell.y, cell.z, seed];
        let exact = inputs.iter().all(|i| i.error == 0.0);
        let uncertain = inputs.iter().any(|i| i.branch_uncertain);
        let component = |value| {
            if exact {
                Self::with_error(value, 0.0, uncertain)
            } else {
                Self::unknown(value, uncertain)
            }
        };
        V3::new(component(v.x), component(v.y), component(v.z))
    }
    /// Returns the sum or product of two numbers, if `f32` computes it exactly because both are integers
    /// and not too large.
    #[inline(always)]
    fn exact_integer(self, b: Self, value: Interval) -> Option<Self> {
        let exact = self.error == 0.0 && b.error == 0.0 && self.is_integer && b.is_integer;
        (exact && value.magnitude() <= MAX_EXACT_INTEGER).then_some(Self {
            value,
            error: 0.0,
            branch_uncertain: self.branch_uncertain | b.branch_uncertain,
            is_integer: true,
        })
    }
    /// Reports whether it is exactly this number, in `f32` too.
    #[inline(always)]
    fn is(self, number: f64) -> bool {
        let is_exact = self.error == 0.0 && !self.branch_uncertain;
        is_exact && self.value.lo == number && self.value.hi == number
    }
    /// Reports whether multiplication and division by it are exact: it is zero or a power of two.
    #[inline(always)]
    fn only_scales(self) -> bool {
        let v = self.value.lo;
        let power = v.to_bits() & 0x000f_ffff_ffff_ffff == 0;
        self.error == 0.0 && v == self.value.hi && power
    }
    /// Returns the smallest number that the interval or `f32` may hold.
    #[inline(always)]
    fn lowest(self) -> f64 {
        self.value.lo - self.error
    }
    /// Returns the largest number that the interval or `f32` may hold.
    #[inline(always)]
    fn highest(self) -> f64 {
        self.value.hi + self.error
    }
    /// Returns the length of a vector. Its own relative rounding error is `rounding_units` times the unit
    /// roundoff. The length's propagated error is at most the vector's error; the rules of a sum and a root
    /// would overestimate it near zero.
    #[inline(always)]
    fn vector_length<const N: usize>(parts: [Self; N], rounding_units: f64) -> Self {
        let squares = parts.map(|part| part.value.square());
        let sum = squares.into_iter().reduce(|a, b| a + b);
        let value = sum.map_or(Interval::point(0.0), Interval::sqrt);
        let propagated = parts.iter().map(|part| part.error * part.error);
        let propagated = propagated.sum::<f64>().sqrt();
        let largest = value.magnitude() + propagated;
        let error = propagated + largest * UNIT_ROUNDOFF_WITH_SLACK * rounding_units + MIN_LENGTH;
        let fits = largest < MAX_SQUARABLE;
        Self {
            value,
            error: if fits { error } else { f64::INFINITY },
            branch_uncertain: parts.iter().any(|part| part.branch_uncertain),
            is_integer: false,
        }
    }
    /// Returns the sine or cosine of this angle, whose range is `value`.
    #[inline(always)]
    fn wave(self, value: Interval) -> Self {
        let x = self.value.magnitude() + self.error;
        // For an argument that may be infinite or NaN, the `f32` polynomials may return any number.
        let is_number = x < f64::INFINITY;
        if !is_number {
            return Self::unknown(value, self.branch_uncertain);
        }
        // As the documentation of the elementary functions states, and a test checks.
        let rounding = if x <= 1e5 { 2e-7 + 2e-9 * x } else { 2e-7 * x };
        Self::with_error(
            value,
            (self.error + rounding).min(2.001),
            self.branch_uncertain,
        )
    }
}

/// Multiplies two errors. 0 · ∞ is 0 here: an infinite error that is multiplied by zero does not contribute.
#[inline(always)]
fn times(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}

/// Returns the larger number; infinity if one is NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a >= b {
        a
    } else if b >= a {
        b
    } else {
        f64::INFINITY
    }
}

impl Add for RunningError {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        if b.is(0.0) {
            return self;
        }
        if self.is(0.0) {
            return b;
        }
        let (propagated, uncertain) = (
            self.error + b.error,
            self.branch_uncertain | b.branch_uncertain,
        );
        let value = self.value + b.value;
        if let Some(sum) = self.exact_integer(b, value) {
            return sum;
        }
        // For single numbers, it is decidable whether `f32` represents their sum exactly.
        let (x, y) = (self.value.lo, b.value.lo);
        let sum = x + y;
        let single = x == self.value.hi && y == b.value.hi && propagated == 0.0;
        if single && sum - x == y && sum - y == x && f64::from(sum as f32) == sum {
            return Self {
                branch_uncertain: uncertain,
                ..Self::exact(sum)
            };
        }
        Self::rounded(value, propagated, uncertain)
    }
}
impl Sub for RunningError {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}
impl Neg for RunningError {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            ..self
        }
    }
}
impl Mul for RunningError {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        if self.is(0.0) || b.is(0.0) {
            return Self::exact(0.0);
        }
        let propagated = times(self.value.magnitude(), b.error)
            + times(b.value.magnitude(), self.error)
            + times(self.error, b.error);
        let (value, uncertain) = (
            self.value * b.value,
            self.branch_uncertain | b.branch_uncertain,
        );
        if let Some(product) = self.exact_integer(b, value) {
            return product;
        }
        if self.only_scales() || b.only_scales() {
            Self::with_error(value, propagated + MIN_NORMAL, uncertain)
        } else {
            Self::rounded(value, propagated, uncertain)
        }
    }
}
impl Div for RunningError {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        let uncertain = self.branch_uncertain | b.branch_uncertain;
        // Lower bound of the magnitude of the `f32` divisor.
        let divisor = larger(b.lowest(), -b.highest());
        if divisor <= 0.0 {
            return Self::unknown(value, uncertain);
        }
        let propagated = (self.error + times(value.magnitude(), b.error)) / divisor;
        if b.only_scales() {
            Self::with_error(value, propagated + MIN_NORMAL, uncertain)
        } else {
            Self::rounded(value, propagated, uncertain)
        }
    }
}

impl Real for RunningError {
    type Bool = RoundedComparison;
    type Vec2 = V2<Self>;
    type Vec3 = V3<Self>;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self {
            error: (f64::from(value as f32) - value).abs(),
            ..Self::exact(value)
        }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self {
            value: self.value.abs(),
            ..self
        }
    }
    #[inline(always)]
    fn square(self) -> Self {
        let propagated = times(2.0 * self.value.magnitude() + self.error, self.error);
        Self::rounded(self.value.square(), propagated, self.branch_uncertain)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        if self.value.hi < 0.0 {
            return Self::unknown(Interval::ALL, self.branch_uncertain);
        }
        // √(s + e) − √s = e / (√(s + e) + √s), and never more than √e.
        let lower = self.value.lo.max(0.0).sqrt() + self.lowest().max(0.0).sqrt();
        let propagated = self.error.sqrt();
        let propagated = if lower > 0.0 {
            propagated.min(self.error / lower)
        } else {
            propagated
        };
        Self::rounded(self.value.sqrt(), propagated, self.branch_uncertain)
    }
    #[inline(always)]
    fn length2(x: Self, y: Self) -> Self {
        Self::vector_length([x, y], 2.0)
    }
    #[inline(always)]
    fn length3(x: Self, y: Self, z: Self) -> Self {
        Self::vector_length([x, y, z], 2.5)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        let agrees = self.error == 0.0 || self.lowest().floor() == self.highest().floor();
        // Near a discontinuity, the result is the integer of one side or the other. With an error of a
        // quarter or more, it may be further off.
        let means = self.error < 0.25;
        Self {
            is_integer: true,
            ..Self::with_error(
                self.value.floor(),
                if means { 0.0 } else { self.error + 1.0 },
                self.branch_uncertain | !agrees,
            )
        }
    }
    #[inline(always)]
    fn fract(self) -> Self {
        let floor = self.floor();
        let propagated = self.error + floor.error;
        Self::rounded(self.value.fract(), propagated, floor.branch_uncertain)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        let value = self.value.min(b.value);
        // The smaller operand may be certain, in `f32` too.
        let error = if self.highest() < b.lowest() {
            self.error
        } else if b.highest() < self.lowest() {
            b.error
        } else {
            larger(self.error, b.error)
        };
        Self {
            value,
            error,
            branch_uncertain: self.branch_uncertain | b.branch_uncertain,
            is_integer: self.is_integer & b.is_integer,
        }
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        -(-self).min(-b)
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.wave(self.value.sin())
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.wave(self.value.cos())
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let nearest = |i: Interval| i.lo.max(-i.hi).max(0.0);
        let away = nearest(self.value).hypot(nearest(x.value));
        let input_error = self.error.hypot(x.error);
        // As seen from the origin, a disc of the radius `input_error` at the distance `away`.
        let propagated = if input_error < away {
            (input_error / away).asin()
        } else if input_error == 0.0 {
            0.0
        } else if input_error < f64::INFINITY {
            std::f64::consts::TAU
        } else {
            input_error
        };
        let cut =
            self.error > 0.0 && self.lowest() <= 0.0 && self.highest() >= 0.0 && x.lowest() < 0.0;
        let uncertain = self.branch_uncertain | x.branch_uncertain | cut;
        Self::with_error(self.value.atan2(x.value), propagated + 4e-7, uncertain)
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        let largest = self.highest();
        let fits = largest <= 127.0;
        if !fits {
            return Self::unknown(self.value.exp2(), self.branch_uncertain);
        }
        let propagated = self.value.hi.exp2() * (self.error * std::f64::consts::LN_2).exp_m1();
        let rounding = largest.exp2() * 4e-7 + MIN_NORMAL;
        Self::with_error(
            self.value.exp2(),
            propagated + rounding,
            self.branch_uncertain,
        )
    }
    #[inline(always)]
    fn log2(self) -> Self {
        let (value, least) = (self.value.log2(), self.lowest());
        // `f32` stops at the smallest normal number, and real numbers do not.
        let is_normal = least > MIN_NORMAL;
        if !is_normal {
            return Self::unknown(value, self.branch_uncertain);
        }
        let propagated = self.error / (least * std::f64::consts::LN_2);
        let rounding = 6e-7 + 4e-7 * (value.magnitude() + propagated);
        Self::with_error(value, propagated + rounding, self.branch_uncertain)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.exp2()
    }
    /// Returns the exponent with an unknown error. Bodies do not use it, since the elementary functions have their
    /// own rules here.
    #[inline(always)]
    fn exponent(self) -> Self {
        Self::unknown(self.value.exponent(), self.branch_uncertain)
    }
    /// Returns the mantissa with an unknown error, as for [`Self::exponent`].
    #[inline(always)]
    fn mantissa(self) -> Self {
        Self::unknown(self.value.mantissa(), self.branch_uncertain)
    }
    #[inline(always)]
    fn lattice(cell: V3<Self>, seed: Self) -> V3<Self> {
        Self::random(Interval::lattice, cell, seed)
    }
    #[inline(always)]
    fn noise_corner_gradient(cell: V3<Self>, seed: Self) -> V3<Self> {
        Self::random(Interval::noise_corner_gradient, cell, seed)
    }
    #[inline(always)]
    fn noise(p: V3<Self>, seed: Self) -> Self {
        let position = V3::new(p.x.value, p.y.value, p.z.value);
        let (value, _) = Interval::noise_gradient(position, seed.value);
        let inputs = [p.x, p.y, p.z, seed];
        let input_error = inputs[..3].iter().map(|i| i.error * i.error);
        // Noise is continuous, so its slope bound limits the propagated error.
        let propagated = MAX_NOISE_STEEPNESS * input_error.sum::<f64>().sqrt();
        let anything = if seed.error == 0.0 {
            3.0
        } else {
            f64::INFINITY
        };
        let error = (propagated + NOISE_ERROR).min(anything);
        Self::with_error(value, error, inputs.iter().any(|i| i.branch_uncertain))
    }
    #[inline(always)]
    fn ellipsoid_gradient(p: V3<Self>, r: V3<Self>) -> (Self, V3<Self>) {
        let values = |v: V3<Self>| V3::new(v.x.value, v.y.value, v.z.value);
        let (value, slope) = Interval::ellipsoid_gradient(values(p), values(r));
        let inputs = [p.x, p.y, p.z];
        let input_error = inputs.iter().map(|i| i.error * i.error).sum::<f64>().sqrt();
        let sizes = inputs.iter().chain([&r.x, &r.y, &r.z]);
        let size = sizes.map(|i| i.value.magnitude()).sum::<f64>();
        let radii = [r.x, r.y, r.z].iter().map(|i| i.error).sum::<f64>();
        let uncertain = inputs.iter().any(|i| i.branch_uncertain);
        let component = |value| Self::unknown(value, uncertain);
        // The slope of a distance is at most one, and it changes by no more than the radii do.
        let error = input_error + radii + size * DISTANCE_ERROR;
        (
            Self::with_error(value, error, uncertain),
            V3::new(component(slope.x), component(slope.y), component(slope.z)),
        )
    }
    #[inline(always)]
    fn noise_slope(p: V3<Self>, seed: Self) -> V3<Self> {
        let (_, slope) = Self::noise_gradient(p, seed);
        let input_error = [p.x, p.y, p.z].map(|i| i.error * i.error).into_iter();
        let propagated = MAX_NOISE_CURVATURE * (3.0 * input_error.sum::<f64>()).sqrt();
        let anything = if seed.error == 0.0 {
            2.0 * MAX_NOISE_SLOPE
        } else {
            f64::INFINITY
        };
        let error = (propagated + NOISE_SLOPE_ERROR).min(anything);
        let component = |slope: Self| Self::with_error(slope.value, error, slope.branch_uncertain);
        V3::new(component(slope.x), component(slope.y), component(slope.z))
    }
    /// Returns the noise; the error of its gradient is unknown.
    #[inline(always)]
    fn noise_gradient(p: V3<Self>, seed: Self) -> (Self, V3<Self>) {
        let noise = Self::noise(p, seed);
        let position = V3::new(p.x.value, p.y.value, p.z.value);
        let (_, slope) = Interval::noise_gradient(position, seed.value);
        let component = |value| Self::unknown(value, noise.branch_uncertain);
        (
            noise,
            V3::new(component(slope.x), component(slope.y), component(slope.z)),
        )
    }
    #[inline(always)]
    fn unit_component(self) -> Self {
        Self {
            value: self.value.unit_component(),
            ..self
        }
    }
    #[inline(always)]
    fn less(self, b: Self) -> RoundedComparison {
        let input_error = self.error + b.error;
        let outcome = self.value.less(b.value);
        let disjoint = self.highest() < b.lowest() || b.highest() < self.lowest();
        let unsure = input_error != 0.0 && !disjoint;
        RoundedComparison {
            can_be_true: outcome.can_be_true | unsure,
            can_be_false: outcome.can_be_false | unsure,
            may_differ: unsure,
            branch_uncertain: self.branch_uncertain | b.branch_uncertain,
        }
    }
    #[inline(always)]
    fn and(a: RoundedComparison, b: RoundedComparison) -> RoundedComparison {
        RoundedComparison {
            can_be_true: a.can_be_true & b.can_be_true,
            can_be_false: a.can_be_false | b.can_be_false,
            may_differ: (a.may_differ & b.can_be_true) | (b.may_differ & a.can_be_true),
            branch_uncertain: a.branch_uncertain | b.branch_uncertain,
        }
    }
    #[inline(always)]
    fn or(a: RoundedComparison, b: RoundedComparison) -> RoundedComparison {
        RoundedComparison {
            can_be_true: a.can_be_true | b.can_be_true,
            can_be_false: a.can_be_false & b.can_be_false,
            may_differ: (a.may_differ & b.can_be_false) | (b.may_differ & a.can_be_false),
            branch_uncertain: a.branch_uncertain | b.branch_uncertain,
        }
    }
    #[inline(always)]
    fn not(a: RoundedComparison) -> RoundedComparison {
        RoundedComparison {
            can_be_true: a.can_be_false,
            can_be_false: a.can_be_true,
            ..a
        }
    }
    /// Bounds the error by the larger error of the operands plus the rounding error of the blend itself.
    /// The latter is evaluated on exact operands in the same ranges.
    fn convex_blend(a: Self, b: Self, blend: impl Fn(Self, Self) -> Self) -> Self {
        let passed_on = blend(a, b);
        let input_error = larger(a.error, b.error);
        if !input_error.is_finite() {
            return passed_on;
        }
        let exact = |x: Self| Self {
            value: Interval {
                lo: x.value.lo - x.error,
                hi: x.value.hi + x.error,
            },
            error: 0.0,
            ..x
        };
        let rounding = blend(exact(a), exact(b)).error;
        Self {
            error: passed_on.error.min(input_error + rounding),
            ..passed_on
        }
    }
    #[inline(always)]
    fn select(condition: RoundedComparison, then: Self, otherwise: Self) -> Self {
        let uncertain =
            then.branch_uncertain | otherwise.branch_uncertain | condition.branch_uncertain;
        if !condition.can_be_false {
            return Self {
                branch_uncertain: uncertain,
                ..then
            };
        }
        if !condition.can_be_true {
            return Self {
                branch_uncertain: uncertain,
                ..otherwise
            };
        }
        let (a, b) = (then.value, otherwise.value);
        let error = larger(then.error, otherwise.error);
        let value = a.hull(b);
        let agrees = Self {
            value,
            error,
            branch_uncertain: uncertain,
            is_integer: then.is_integer & otherwise.is_integer,
        };
        if !condition.may_differ {
            return agrees;
        }
        let jump = larger(a.hi - b.lo, b.hi - a.lo);
        if jump <= 4.0 * error + MIN_NORMAL {
            return Self::with_error(value, error + jump, uncertain);
        }
        Self {
            branch_uncertain: true,
            ..agrees
        }
    }
}
