//! Arithmetic of raw fields. All functions are defined for all numbers: a division by zero gives a very
//! large number, the root of a negative number is zero. NaN, which may follow from an overflow, stays NaN;
//! its logarithm is large.
//!
//! Truth values are the numbers 1 and 0. Discontinuous results are marked ([`Real::mark_discontinuity`]),
//! so that the flat regions beside a discontinuity are not mistaken for a small slope.

use crate::real::{Real, Vector3, lit};

/// Returns the first coordinate of the point.
#[inline(always)]
pub fn x<R: Real>(p: R::Vec3) -> R {
    p.x()
}

/// Returns the second coordinate of the point.
#[inline(always)]
pub fn y<R: Real>(p: R::Vec3) -> R {
    p.y()
}

/// Returns the third coordinate of the point.
#[inline(always)]
pub fn z<R: Real>(p: R::Vec3) -> R {
    p.z()
}

/// Returns the value of a program's constant.
#[inline(always)]
pub fn constant<R: Real>(value: R) -> R {
    value
}

/// Returns the point with these coordinates.
#[inline(always)]
pub fn point<R: Real>(x: R, y: R, z: R) -> R::Vec3 {
    R::Vec3::new(x, y, z)
}

/// Returns the sum `a + b`.
#[inline(always)]
pub fn add<R: Real>(a: R, b: R) -> R {
    a + b
}

/// Returns the difference `a − b`.
#[inline(always)]
pub fn sub<R: Real>(a: R, b: R) -> R {
    a - b
}

/// Returns the product `a · b`.
#[inline(always)]
pub fn mul<R: Real>(a: R, b: R) -> R {
    a * b
}

/// Returns the square, which is known to be non-negative.
#[inline(always)]
pub fn square<R: Real>(a: R) -> R {
    a.square()
}

/// Returns a divisor, kept away from zero.
#[inline(always)]
fn divisor<R: Real>(b: R) -> R {
    let tiny = b.abs().less(lit(1e-18));
    R::select(tiny, lit(1e-18), b)
}

/// Returns the quotient; a divisor below 1e-18 in magnitude counts as 1e-18.
#[inline(always)]
pub fn div<R: Real>(a: R, b: R) -> R {
    a / divisor(b)
}

/// Returns the remainder of a floored division, with the divisor's sign; a divisor below 1e-18 in magnitude counts
/// as 1e-18.
#[inline(always)]
pub fn modulo<R: Real>(a: R, b: R) -> R {
    a.modulo(divisor(b).named("divisor"))
}

/// Returns the negated number.
#[inline(always)]
pub fn neg<R: Real>(a: R) -> R {
    -a
}

/// Returns the magnitude.
#[inline(always)]
pub fn abs<R: Real>(a: R) -> R {
    a.abs()
}

/// Returns −1, 0 or 1, by the sign of the number.
#[inline(always)]
pub fn sign<R: Real>(a: R) -> R {
    let zero = lit::<R>(0.0);
    a.sign()
        .mark_discontinuity(a.less(zero))
        .mark_discontinuity(zero.less(a))
}

/// Returns the smaller of two numbers.
#[inline(always)]
pub fn min<R: Real>(a: R, b: R) -> R {
    a.min(b)
}

/// Returns the larger of two numbers.
#[inline(always)]
pub fn max<R: Real>(a: R, b: R) -> R {
    a.max(b)
}

/// Clamps the first number to the range from `low` to `high`.
#[inline(always)]
pub fn clamp<R: Real>(a: R, low: R, high: R) -> R {
    a.clamp(low, high)
}

/// Returns the largest integer that is not larger.
#[inline(always)]
pub fn floor<R: Real>(a: R) -> R {
    a.floor()
}

/// Returns the smallest integer that is not smaller.
#[inline(always)]
pub fn ceil<R: Real>(a: R) -> R {
    a.ceil()
}

/// Returns the nearest integer, halves upwards.
#[inline(always)]
pub fn round<R: Real>(a: R) -> R {
    a.round()
}

/// Returns the fractional part.
#[inline(always)]
pub fn fract<R: Real>(a: R) -> R {
    a.fract()
}

/// Returns the integer part, rounded towards zero.
#[inline(always)]
pub fn trunc<R: Real>(a: R) -> R {
    a.trunc()
}

/// Returns the square root; zero for negative numbers.
#[inline(always)]
pub fn sqrt<R: Real>(a: R) -> R {
    a.at_least(lit(0.0)).sqrt()
}

/// Returns one over the square root; arguments below 1e-30 count as 1e-30.
#[inline(always)]
pub fn inverse_sqrt<R: Real>(a: R) -> R {
    lit::<R>(1.0) / a.at_least(lit(1e-30)).sqrt()
}

/// Returns the sine of an angle in radians.
#[inline(always)]
pub fn sin<R: Real>(a: R) -> R {
    a.sin()
}

/// Returns the cosine of an angle in radians.
#[inline(always)]
pub fn cos<R: Real>(a: R) -> R {
    a.cos()
}

/// Returns the tangent of an angle in radians; a cosine below 1e-18 in magnitude counts as 1e-18.
#[inline(always)]
pub fn tan<R: Real>(a: R) -> R {
    a.sin() / divisor(a.cos())
}

/// Returns the angle in radians with this sine; the argument is clamped to −1 and 1.
#[inline(always)]
pub fn asin<R: Real>(a: R) -> R {
    a.asin()
}

/// Returns the angle in radians with this cosine; the argument is clamped to −1 and 1.
#[inline(always)]
pub fn acos<R: Real>(a: R) -> R {
    a.acos()
}

/// Returns the angle with this tangent, in [−π/2, π/2].
#[inline(always)]
pub fn atan<R: Real>(a: R) -> R {
    a.atan()
}

/// Returns the angle of the vector (`x`, `y`) in [−π, π]; 0 at the origin.
#[inline(always)]
pub fn atan2<R: Real>(y: R, x: R) -> R {
    y.atan2(x)
        .mark_discontinuity(R::and(x.less(lit(0.0)), y.less(lit(0.0))))
}

/// Returns the hyperbolic sine, from two exponentials.
#[inline(always)]
pub fn sinh<R: Real>(a: R) -> R {
    (a.exp() - (-a).exp()) * lit(0.5)
}

/// Returns the hyperbolic cosine, from two exponentials.
#[inline(always)]
pub fn cosh<R: Real>(a: R) -> R {
    (a.exp() + (-a).exp()) * lit(0.5)
}

/// Returns the hyperbolic tangent, from the exponential of twice the number.
#[inline(always)]
pub fn tanh<R: Real>(a: R) -> R {
    lit::<R>(1.0) - lit::<R>(2.0) / ((a + a).exp() + lit(1.0))
}

/// Returns e to the power of the number.
#[inline(always)]
pub fn exp<R: Real>(a: R) -> R {
    a.exp()
}

/// Returns two to the power of the number.
#[inline(always)]
pub fn exp2<R: Real>(a: R) -> R {
    a.exp2()
}

/// Returns the natural logarithm; for zero and negative numbers, that of the smallest number.
#[inline(always)]
pub fn ln<R: Real>(a: R) -> R {
    a.ln()
}

/// Returns the logarithm to base two; for zero and negative numbers, that of the smallest number.
#[inline(always)]
pub fn log2<R: Real>(a: R) -> R {
    a.log2()
}

/// Returns the first, which must not be negative, to the power of the second.
#[inline(always)]
pub fn pow<R: Real>(a: R, b: R) -> R {
    a.pow(b)
}

/// Returns 0 where `a` is below `edge`, 1 elsewhere.
#[inline(always)]
pub fn step<R: Real>(edge: R, a: R) -> R {
    a.step(edge).mark_discontinuity(a.less(edge))
}

/// Returns 0 up to `low`, 1 from `high` on, and a smooth cubic of `a` between. If `high` is less, it decreases: 1
/// up to `high`, 0 from `low` on.
#[inline(always)]
pub fn smoothstep<R: Real>(low: R, high: R, a: R) -> R {
    a.smoothstep(low, high)
}

/// Returns the linear interpolation from the first at `t = 0` to the second at `t = 1`, and its extrapolation.
#[inline(always)]
pub fn mix<R: Real>(a: R, b: R, t: R) -> R {
    a.mix(b, t)
}

/// Returns 1 where the first is smaller, 0 elsewhere.
#[inline(always)]
pub fn less<R: Real>(a: R, b: R) -> R {
    let c = a.less(b);
    R::select(c, lit(1.0), lit(0.0)).mark_discontinuity(c)
}

/// Returns the conjunction of two truth values: their minimum.
#[inline(always)]
pub fn and<R: Real>(a: R, b: R) -> R {
    a.min(b)
}

/// Returns the disjunction of two truth values: their maximum.
#[inline(always)]
pub fn or<R: Real>(a: R, b: R) -> R {
    a.max(b)
}

/// Returns the negation of a truth value: one minus it.
#[inline(always)]
pub fn not<R: Real>(a: R) -> R {
    lit::<R>(1.0) - a
}

/// Returns the second where the first is true, which is above 0.5, and the third elsewhere.
#[inline(always)]
pub fn select<R: Real>(condition: R, a: R, b: R) -> R {
    let c = lit::<R>(0.5).less(condition);
    R::select(c, a, b).mark_discontinuity(c)
}

/// Returns gradient noise, between −1 and 1.
#[inline(always)]
pub fn noise<R: Real>(p: R::Vec3, seed: R) -> R {
    R::noise(p, seed)
}

/// Returns the directional derivative of gradient noise: its gradient times `along`.
#[inline(always)]
pub fn noise_slope<R: Real>(p: R::Vec3, along: R::Vec3, seed: R) -> R {
    R::noise_slope(p, seed).dot(along)
}

/// Adds one octave of fractal noise. The offset separates the octaves' lattices, on which all noise is
/// zero.
#[inline(always)]
pub fn noise_octave<R: Real>(
    acc: R,
    p: R::Vec3,
    offset: R::Vec3,
    frequency: R,
    amplitude: R,
    seed: R,
) -> R {
    acc + R::noise(p * frequency + offset, seed) * amplitude
}

/// Adds one octave of ridges: 1 where the noise is zero, decreasing to both sides.
#[inline(always)]
pub fn ridge_octave<R: Real>(
    acc: R,
    p: R::Vec3,
    offset: R::Vec3,
    frequency: R,
    amplitude: R,
    seed: R,
) -> R {
    let n = R::noise(p * frequency + offset, seed);
    acc + (lit::<R>(1.0) - n.abs() * lit(2.0)) * amplitude
}
