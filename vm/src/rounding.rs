//! Running error bounds: how far `f32` may be off, for every point of a box.
//!
//! A [`Rounded`] number is an interval that holds what a formula gives for real numbers, and a bound
//! on the difference to what it gives when it is evaluated in `f32`, at the same point, by the same
//! operations. Running a body, or a program ([`bound`]), on this type gives its bound, since each
//! operation adds half a unit in the last place of its result and passes on what its operands are
//! off already (J. H. Wilkinson, *Rounding Errors in Algebraic Processes*, 1963).
//!
//! **Included** are the rounding of every sum, product, quotient and root, of literals, of our own
//! elementary functions as measured, the flushing of denormals, and what the coordinates are off
//! themselves, as far as the caller says. A fused product and sum rounds less, so the bound holds
//! for it too. **Not included** are the numbers of the program, which are what they are since they
//! were rounded once, and devices that divide or take roots with more than the error of IEEE 754.
//!
//! **Decisions.** A floor, a `select` and an angle at its cut jump, and where a point is nearer to the
//! jump than rounding, `f32` may decide otherwise than real numbers. Then the result is marked as
//! [`torn`](Rounded::torn): `error` counts as if both decided alike, and `f32` may have the value
//! from the other side of the jump. Where both sides differ by no more than rounding, as at an edge
//! of a shape, it is not torn. Minima and maxima never are.

use crate::evaluate::evaluate;
use crate::interval::{Interval, NOISE_CURVATURE, NOISE_SLOPE, NOISE_STEEPNESS};
use crate::program::Program;
use crate::real::Real;
use crate::vector::{V2, V3};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Half a unit in the last place, as a share of a number: 2⁻²⁴, and what the sums of errors in
/// `f64` may lose.
const UNIT: f64 = 5.960_465e-8;
/// The smallest normal number: what is less may be flushed to zero.
const TINY: f64 = 1.175_494_4e-38;
/// Numbers whose square is flushed to zero, at most three of them together.
const TINY_LENGTH: f64 = 2e-19;
/// The largest number, and the largest whose square is one.
const LARGEST: f64 = f32::MAX as f64;
const LARGEST_LENGTH: f64 = 1e19;
/// Whole numbers up to here are exact, with room for the last place of the interval's own ends.
const MOST_COUNTED: f64 = 16_777_215.5;
/// How far off noise is by its own rounding, for coordinates that are what they are; measured to be
/// below 9e-7.
const NOISE_ERROR: f64 = 3e-6;
/// The same of its slope.
const NOISE_SLOPE_ERROR: f64 = 3e-5;
/// How far off the distance to an ellipsoid is by its own rounding, as a fraction of coordinates and radii
/// together; measured to be below 3e-7.
const DISTANCE_ERROR: f64 = 1e-6;

/// Numbers from an interval, and how far `f32` may be off each of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounded {
    /// What real numbers give, for some point of the box.
    pub value: Interval,
    /// How far `f32` is off at most, at any point of the box, where it decides as real numbers do;
    /// infinite where nothing is known, or where `f32` overflows.
    pub error: f64,
    /// Whether `f32` may decide otherwise somewhere in the box.
    pub torn: bool,
    /// Whether all numbers are whole, so that sums and products of them are not rounded.
    pub whole: bool,
}

/// What is known of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decision {
    /// It may hold for some point.
    pub may: bool,
    /// It may fail for some.
    pub may_not: bool,
    /// `f32` may decide otherwise than real numbers at some, by rounding of what is compared.
    pub unsure: bool,
    /// What is compared is torn.
    pub torn: bool,
}

/// The bound of a program for the points of a box: `error` is how far each coordinate may be off
/// already. The program must be verified ([`crate::verify`]).
pub fn bound(program: &Program, place: [Interval; 3], error: [f64; 3]) -> Rounded {
    let [x, y, z] = std::array::from_fn(|axis| Rounded {
        value: place[axis],
        error: error[axis],
        torn: false,
        whole: false,
    });
    evaluate::<Rounded>(program, V3::of(x, y, z))
}

impl Rounded {
    /// A number that `f32` holds as it is.
    pub fn exact(value: f64) -> Self {
        Self {
            value: Interval::point(value),
            error: 0.0,
            torn: false,
            whole: value.fract() == 0.0,
        }
    }
    /// How far `f32` is off at most, whatever it decides: infinite where it may decide otherwise.
    pub fn whatever_is_decided(self) -> f64 {
        if self.torn { f64::INFINITY } else { self.error }
    }
    /// Whether the value may be zero somewhere, for real numbers or in `f32`.
    pub fn may_be_zero(self) -> bool {
        self.value.lo <= self.error && self.value.hi >= -self.error
    }

    /// An operation's result, which is `passed` off by its operands, and is rounded.
    #[inline(always)]
    fn after(value: Interval, passed: f64, torn: bool) -> Self {
        let largest = value.magnitude() + passed;
        Self::known(value, passed + largest * UNIT + TINY, torn)
    }
    /// An operation's result, which is `error` off in all. What is too large for `f32` or no number
    /// at all is off by anything.
    #[inline(always)]
    fn known(value: Interval, error: f64, torn: bool) -> Self {
        let fits = value.magnitude() + error <= LARGEST;
        Self {
            value,
            error: if fits { error } else { f64::INFINITY },
            torn,
            whole: false,
        }
    }
    /// A result of which nothing is known but the interval that holds it.
    #[inline(always)]
    fn unknown(value: Interval, torn: bool) -> Self {
        Self {
            value,
            error: f64::INFINITY,
            torn,
            whole: false,
        }
    }
    /// Random numbers of a cell: exact where the cell is.
    fn random(
        of_cell: impl Fn(V3<Interval>, Interval) -> V3<Interval>,
        cell: V3<Self>,
        seed: Self,
    ) -> V3<Self> {
        let values = V3::of(cell.x.value, cell.y.value, cell.z.value);
        let v = of_cell(values, seed.value);
        let inputs = [cell.x, cell.y, cell.z, seed];
        let exact = inputs.iter().all(|i| i.error == 0.0);
        let torn = inputs.iter().any(|i| i.torn);
        let of = |value| {
            if exact {
                Self::known(value, 0.0, torn)
            } else {
                Self::unknown(value, torn)
            }
        };
        V3::of(of(v.x), of(v.y), of(v.z))
    }
    /// The sum or product of two numbers, if `f32` makes it without rounding because they are whole
    /// and not too large.
    #[inline(always)]
    fn counted(self, b: Self, value: Interval) -> Option<Self> {
        let exact = self.error == 0.0 && b.error == 0.0 && self.whole && b.whole;
        (exact && value.magnitude() <= MOST_COUNTED).then_some(Self {
            value,
            error: 0.0,
            torn: self.torn | b.torn,
            whole: true,
        })
    }
    /// Whether it is this one number, in `f32` too.
    #[inline(always)]
    fn is(self, number: f64) -> bool {
        let known = self.error == 0.0 && !self.torn;
        known && self.value.lo == number && self.value.hi == number
    }
    /// Whether multiplying and dividing by it is exact: it is zero or a power of two.
    #[inline(always)]
    fn only_scales(self) -> bool {
        let v = self.value.lo;
        let power = v.to_bits() & 0x000f_ffff_ffff_ffff == 0;
        self.error == 0.0 && v == self.value.hi && power
    }
    /// The smallest number in the interval, and what `f32` may make of it.
    #[inline(always)]
    fn least(self) -> f64 {
        self.value.lo - self.error
    }
    /// The largest, and what `f32` may make of it.
    #[inline(always)]
    fn most(self) -> f64 {
        self.value.hi + self.error
    }
    /// The length of some numbers, whose squares are added and whose sum has `share` units in the
    /// last place of rounding. As much as a vector is off, its length is off, and no more; the rules
    /// of a sum and a root would lose that near zero.
    #[inline(always)]
    fn length_of<const N: usize>(parts: [Self; N], share: f64) -> Self {
        let squares = parts.map(|part| part.value.square());
        let sum = squares.into_iter().reduce(|a, b| a + b);
        let value = sum.map_or(Interval::point(0.0), Interval::sqrt);
        let passed = parts.iter().map(|part| part.error * part.error);
        let passed = passed.sum::<f64>().sqrt();
        let largest = value.magnitude() + passed;
        let error = passed + largest * UNIT * share + TINY_LENGTH;
        let fits = largest < LARGEST_LENGTH;
        Self {
            value,
            error: if fits { error } else { f64::INFINITY },
            torn: parts.iter().any(|part| part.torn),
            whole: false,
        }
    }
    /// The sine or cosine of this angle, which is `value`.
    #[inline(always)]
    fn wave(self, value: Interval) -> Self {
        let x = self.value.magnitude() + self.error;
        // Of what may be no number at all, the polynomials of f32 make any.
        let is_number = x < f64::INFINITY;
        if !is_number {
            return Self::unknown(value, self.torn);
        }
        // As the documentation of the elementary functions has it, and a test.
        let own = if x <= 1e5 { 2e-7 + 2e-9 * x } else { 2e-7 * x };
        Self::known(value, (self.error + own).min(2.001), self.torn)
    }
}

/// 0 · ∞ is 0 here: an error that nothing is multiplied with has no part in the result.
#[inline(always)]
fn times(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}

/// The larger one; what is no number is infinite.
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

impl Add for Rounded {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        if b.is(0.0) {
            return self;
        }
        if self.is(0.0) {
            return b;
        }
        let (passed, torn) = (self.error + b.error, self.torn | b.torn);
        let value = self.value + b.value;
        if let Some(sum) = self.counted(b, value) {
            return sum;
        }
        // Of single numbers it is known whether their sum is one of f32's.
        let (x, y) = (self.value.lo, b.value.lo);
        let sum = x + y;
        let single = x == self.value.hi && y == b.value.hi && passed == 0.0;
        if single && sum - x == y && sum - y == x && f64::from(sum as f32) == sum {
            return Self {
                torn,
                ..Self::exact(sum)
            };
        }
        Self::after(value, passed, torn)
    }
}
impl Sub for Rounded {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}
impl Neg for Rounded {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            ..self
        }
    }
}
impl Mul for Rounded {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        if self.is(0.0) || b.is(0.0) {
            return Self::exact(0.0);
        }
        let passed = times(self.value.magnitude(), b.error)
            + times(b.value.magnitude(), self.error)
            + times(self.error, b.error);
        let (value, torn) = (self.value * b.value, self.torn | b.torn);
        if let Some(product) = self.counted(b, value) {
            return product;
        }
        if self.only_scales() || b.only_scales() {
            Self::known(value, passed + TINY, torn)
        } else {
            Self::after(value, passed, torn)
        }
    }
}
impl Div for Rounded {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        let torn = self.torn | b.torn;
        // What f32 divides by is at least as large as this, away from zero.
        let divisor = larger(b.least(), -b.most());
        if divisor <= 0.0 {
            return Self::unknown(value, torn);
        }
        let passed = (self.error + times(value.magnitude(), b.error)) / divisor;
        if b.only_scales() {
            Self::known(value, passed + TINY, torn)
        } else {
            Self::after(value, passed, torn)
        }
    }
}

impl Real for Rounded {
    type Bool = Decision;
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
        let passed = times(2.0 * self.value.magnitude() + self.error, self.error);
        Self::after(self.value.square(), passed, self.torn)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        if self.value.hi < 0.0 {
            return Self::unknown(Interval::ALL, self.torn);
        }
        // √(s + e) − √s = e / (√(s + e) + √s), and never more than √e.
        let lower = self.value.lo.max(0.0).sqrt() + self.least().max(0.0).sqrt();
        let passed = self.error.sqrt();
        let passed = if lower > 0.0 {
            passed.min(self.error / lower)
        } else {
            passed
        };
        Self::after(self.value.sqrt(), passed, self.torn)
    }
    #[inline(always)]
    fn length2(x: Self, y: Self) -> Self {
        Self::length_of([x, y], 2.0)
    }
    #[inline(always)]
    fn length3(x: Self, y: Self, z: Self) -> Self {
        Self::length_of([x, y, z], 2.5)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        let alike = self.error == 0.0 || self.least().floor() == self.most().floor();
        // Near a jump it is the whole number of one side or the other; of what is off by as much as
        // that, it is anything.
        let means = self.error < 0.25;
        Self {
            whole: true,
            ..Self::known(
                self.value.floor(),
                if means { 0.0 } else { self.error + 1.0 },
                self.torn | !alike,
            )
        }
    }
    #[inline(always)]
    fn fract(self) -> Self {
        let floor = self.floor();
        let passed = self.error + floor.error;
        Self::after(self.value.fract(), passed, floor.torn)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        let value = self.value.min(b.value);
        // Which one is smaller may be known, in f32 too.
        let error = if self.most() < b.least() {
            self.error
        } else if b.most() < self.least() {
            b.error
        } else {
            larger(self.error, b.error)
        };
        Self {
            value,
            error,
            torn: self.torn | b.torn,
            whole: self.whole & b.whole,
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
        let off = self.error.hypot(x.error);
        // As seen from the origin, a disc of the radius `off` at the distance `away`.
        let passed = if off < away {
            (off / away).asin()
        } else if off == 0.0 {
            0.0
        } else if off < f64::INFINITY {
            std::f64::consts::TAU
        } else {
            off
        };
        let cut = self.error > 0.0 && self.least() <= 0.0 && self.most() >= 0.0 && x.least() < 0.0;
        let torn = self.torn | x.torn | cut;
        Self::known(self.value.atan2(x.value), passed + 4e-7, torn)
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        let largest = self.most();
        let fits = largest <= 127.0;
        if !fits {
            return Self::unknown(self.value.exp2(), self.torn);
        }
        let passed = self.value.hi.exp2() * (self.error * std::f64::consts::LN_2).exp_m1();
        let own = largest.exp2() * 4e-7 + TINY;
        Self::known(self.value.exp2(), passed + own, self.torn)
    }
    #[inline(always)]
    fn log2(self) -> Self {
        let (value, least) = (self.value.log2(), self.least());
        // Below the smallest normal number f32 stops, and real numbers go on.
        let is_normal = least > TINY;
        if !is_normal {
            return Self::unknown(value, self.torn);
        }
        let passed = self.error / (least * std::f64::consts::LN_2);
        let own = 6e-7 + 4e-7 * (value.magnitude() + passed);
        Self::known(value, passed + own, self.torn)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.exp2()
    }
    /// Only the elementary functions, which have their own rules here, ask for it: nothing is known.
    #[inline(always)]
    fn exponent(self) -> Self {
        Self::unknown(self.value.exponent(), self.torn)
    }
    /// As for [`Self::exponent`].
    #[inline(always)]
    fn mantissa(self) -> Self {
        Self::unknown(self.value.mantissa(), self.torn)
    }
    #[inline(always)]
    fn lattice(cell: V3<Self>, seed: Self) -> V3<Self> {
        Self::random(Interval::lattice, cell, seed)
    }
    #[inline(always)]
    fn lattice_edge(cell: V3<Self>, seed: Self) -> V3<Self> {
        Self::random(Interval::lattice_edge, cell, seed)
    }
    #[inline(always)]
    fn noise(p: V3<Self>, seed: Self) -> Self {
        let at = V3::of(p.x.value, p.y.value, p.z.value);
        let (value, _) = Interval::noise_gradient(at, seed.value);
        let inputs = [p.x, p.y, p.z, seed];
        let off = inputs[..3].iter().map(|i| i.error * i.error);
        // Noise has no jumps, so its slope says how much of an error it passes on.
        let passed = NOISE_STEEPNESS * off.sum::<f64>().sqrt();
        let anything = if seed.error == 0.0 {
            3.0
        } else {
            f64::INFINITY
        };
        let error = (passed + NOISE_ERROR).min(anything);
        Self::known(value, error, inputs.iter().any(|i| i.torn))
    }
    #[inline(always)]
    fn ellipsoid_gradient(p: V3<Self>, r: V3<Self>) -> (Self, V3<Self>) {
        let values = |v: V3<Self>| V3::of(v.x.value, v.y.value, v.z.value);
        let (value, slope) = Interval::ellipsoid_gradient(values(p), values(r));
        let inputs = [p.x, p.y, p.z];
        let off = inputs.iter().map(|i| i.error * i.error).sum::<f64>().sqrt();
        let sizes = inputs.iter().chain([&r.x, &r.y, &r.z]);
        let size = sizes.map(|i| i.value.magnitude()).sum::<f64>();
        let radii = [r.x, r.y, r.z].iter().map(|i| i.error).sum::<f64>();
        let torn = inputs.iter().any(|i| i.torn);
        let of = |value| Self::unknown(value, torn);
        // No distance is steeper than one, nor changes by more than the radii do.
        let error = off + radii + size * DISTANCE_ERROR;
        (
            Self::known(value, error, torn),
            V3::of(of(slope.x), of(slope.y), of(slope.z)),
        )
    }
    #[inline(always)]
    fn noise_slope(p: V3<Self>, seed: Self) -> V3<Self> {
        let (_, slope) = Self::noise_gradient(p, seed);
        let off = [p.x, p.y, p.z].map(|i| i.error * i.error).into_iter();
        let passed = NOISE_CURVATURE * (3.0 * off.sum::<f64>()).sqrt();
        let anything = if seed.error == 0.0 {
            2.0 * NOISE_SLOPE
        } else {
            f64::INFINITY
        };
        let error = (passed + NOISE_SLOPE_ERROR).min(anything);
        let of = |slope: Self| Self::known(slope.value, error, slope.torn);
        V3::of(of(slope.x), of(slope.y), of(slope.z))
    }
    /// The noise; of its gradient nothing is known.
    #[inline(always)]
    fn noise_gradient(p: V3<Self>, seed: Self) -> (Self, V3<Self>) {
        let noise = Self::noise(p, seed);
        let at = V3::of(p.x.value, p.y.value, p.z.value);
        let (_, slope) = Interval::noise_gradient(at, seed.value);
        let of = |value| Self::unknown(value, noise.torn);
        (noise, V3::of(of(slope.x), of(slope.y), of(slope.z)))
    }
    #[inline(always)]
    fn unit_component(self) -> Self {
        Self {
            value: self.value.unit_component(),
            ..self
        }
    }
    #[inline(always)]
    fn less(self, b: Self) -> Decision {
        let off = self.error + b.error;
        let known = self.value.less(b.value);
        let apart = self.most() < b.least() || b.most() < self.least();
        let unsure = off != 0.0 && !apart;
        Decision {
            may: known.may | unsure,
            may_not: known.may_not | unsure,
            unsure,
            torn: self.torn | b.torn,
        }
    }
    #[inline(always)]
    fn and(a: Decision, b: Decision) -> Decision {
        Decision {
            may: a.may & b.may,
            may_not: a.may_not | b.may_not,
            unsure: (a.unsure & b.may) | (b.unsure & a.may),
            torn: a.torn | b.torn,
        }
    }
    #[inline(always)]
    fn or(a: Decision, b: Decision) -> Decision {
        Decision {
            may: a.may | b.may,
            may_not: a.may_not & b.may_not,
            unsure: (a.unsure & b.may_not) | (b.unsure & a.may_not),
            torn: a.torn | b.torn,
        }
    }
    #[inline(always)]
    fn not(a: Decision) -> Decision {
        Decision {
            may: a.may_not,
            may_not: a.may,
            ..a
        }
    }
    /// Off by what rounding in the blend itself comes to, near to operands that are exact, and by what the
    /// worse of the two is.
    fn shared(a: Self, b: Self, blend: impl Fn(Self, Self) -> Self) -> Self {
        let passed_on = blend(a, b);
        let off = larger(a.error, b.error);
        if !off.is_finite() {
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
        let own = blend(exact(a), exact(b)).error;
        Self {
            error: passed_on.error.min(off + own),
            ..passed_on
        }
    }
    #[inline(always)]
    fn select(condition: Decision, then: Self, otherwise: Self) -> Self {
        let torn = then.torn | otherwise.torn | condition.torn;
        if !condition.may_not {
            return Self { torn, ..then };
        }
        if !condition.may {
            return Self { torn, ..otherwise };
        }
        let (a, b) = (then.value, otherwise.value);
        let error = larger(then.error, otherwise.error);
        let value = a.hull(b);
        let alike = Self {
            value,
            error,
            torn,
            whole: then.whole & otherwise.whole,
        };
        if !condition.unsure {
            return alike;
        }
        let jump = larger(a.hi - b.lo, b.hi - a.lo);
        if jump <= 4.0 * error + TINY {
            return Self::known(value, error + jump, torn);
        }
        Self {
            torn: true,
            ..alike
        }
    }
}
