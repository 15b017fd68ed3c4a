//! `f32`, the number type of rendering, and `f64`, that of tests and uniform expressions.
//!
//! On `f32` the elementary functions are our own ([`crate::elementary`]), so that the CPU and every GPU
//! compute the same bits. On `f64` they are the standard library's, because `f64` is the reference for the
//! other types.

use crate::elementary;
use crate::real::Real;
use crate::vector::{V2, V3};

impl Real for f32 {
    type Bool = bool;
    type Vec2 = V2<f32>;
    type Vec3 = V3<f32>;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        value as f32
    }
    #[inline(always)]
    fn is_certain(condition: bool) -> bool {
        condition
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f32::floor(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        if self < low { low } else { self }
    }
    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        if self > high { high } else { self }
    }
    #[inline(always)]
    fn sin(self) -> Self {
        elementary::sine(self)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        elementary::cosine(self)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        elementary::arctangent(self, x)
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        elementary::exponential(self)
    }
    #[inline(always)]
    fn log2(self) -> Self {
        elementary::logarithm(self)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        // The last bits of the sum are those of the exponent; the shift drops all others.
        f32::from_bits((self + (8_388_608.0 + 127.0)).to_bits() << 23)
    }
    #[inline(always)]
    fn exponent(self) -> Self {
        ((self.to_bits() >> 23) as i32 - 127) as f32
    }
    #[inline(always)]
    fn mantissa(self) -> Self {
        f32::from_bits((self.to_bits() & 0x007f_ffff) | 0x3f80_0000)
    }
    #[inline(always)]
    fn signed(self, sign: Self) -> Self {
        f32::from_bits(self.to_bits() ^ (sign.to_bits() & 0x8000_0000))
    }
    #[inline(always)]
    fn lattice(cell: V3<f32>, seed: Self) -> V3<f32> {
        let [x, y, z] = elementary::hash([cell.x, cell.y, cell.z], seed).map(unit);
        V3 { x, y, z }
    }
    #[inline(always)]
    fn noise_corner_gradient(cell: V3<f32>, seed: Self) -> V3<f32> {
        let [x, y, z] = elementary::edge([cell.x, cell.y, cell.z], seed);
        V3 { x, y, z }
    }
    #[inline(always)]
    fn less(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn and(a: bool, b: bool) -> bool {
        a & b
    }
    #[inline(always)]
    fn or(a: bool, b: bool) -> bool {
        a | b
    }
    #[inline(always)]
    fn not(a: bool) -> bool {
        !a
    }
    #[inline(always)]
    fn select(condition: bool, then: Self, otherwise: Self) -> Self {
        if condition { then } else { otherwise }
    }
}

/// Converts the upper 24 bits of a hash to a number in [-1, 1).
#[inline(always)]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as i32 as f32 * (1.0 / 8_388_608.0) - 1.0
}

impl Real for f64 {
    type Bool = bool;
    type Vec2 = V2<f64>;
    type Vec3 = V3<f64>;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn is_certain(condition: bool) -> bool {
        condition
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f64::floor(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        if self < low { low } else { self }
    }
    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        if self > high { high } else { self }
    }
    #[inline(always)]
    fn sin(self) -> Self {
        f64::sin(self)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        f64::cos(self)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        f64::exp2(self)
    }
    #[inline(always)]
    fn log2(self) -> Self {
        f64::log2(self.max(f64::MIN_POSITIVE))
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        f64::exp2(self)
    }
    #[inline(always)]
    fn exponent(self) -> Self {
        ((self.to_bits() >> 52) as i64 - 1023) as f64
    }
    #[inline(always)]
    fn mantissa(self) -> Self {
        f64::from_bits((self.to_bits() & 0x000f_ffff_ffff_ffff) | 0x3ff0_0000_0000_0000)
    }
    #[inline(always)]
    fn lattice(cell: V3<f64>, seed: Self) -> V3<f64> {
        let cell = [cell.x as f32, cell.y as f32, cell.z as f32];
        let [x, y, z] = elementary::hash(cell, seed as f32).map(|bits| unit(bits).into());
        V3 { x, y, z }
    }
    #[inline(always)]
    fn noise_corner_gradient(cell: V3<f64>, seed: Self) -> V3<f64> {
        let cell = [cell.x as f32, cell.y as f32, cell.z as f32];
        let [x, y, z] = elementary::edge(cell, seed as f32).map(f64::from);
        V3 { x, y, z }
    }
    #[inline(always)]
    fn less(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn and(a: bool, b: bool) -> bool {
        a & b
    }
    #[inline(always)]
    fn or(a: bool, b: bool) -> bool {
        a | b
    }
    #[inline(always)]
    fn not(a: bool) -> bool {
        !a
    }
    #[inline(always)]
    fn select(condition: bool, then: Self, otherwise: Self) -> Self {
        if condition { then } else { otherwise }
    }
}
