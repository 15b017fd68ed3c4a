//! The number type that every operation's body is generic over.
//!
//! A body such as `fn sphere<R: Real>(p: R::Vec3, r: R) -> R` is written once. It runs on:
//!
//! | type | for |
//! |---|---|
//! | `f32` | pictures |
//! | `f64` | tests and uniform numbers |
//! | [`Interval`](crate::interval::Interval) | proofs |
//! | [`Dual`] | exact gradients |
//! | the [recorder](crate::record) | WGSL: its values are nodes of expressions |
//!
//! Bodies are branch-free: [`Real::select`] and the comparisons take the place of `if`. Formulas
//! are written out (`a + (b - a) * t`, the square root of a sum of squares) rather than left to
//! builtins, whose rounding differs from device to device.

use crate::dual::{Dual, DualVec3};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number: a distance, a coordinate or a parameter.
pub trait Real:
    Copy
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The result of a comparison.
    type Bool: Copy;
    /// A vector of two of these numbers.
    type Vec2: Vector2<Self>;
    /// A vector of three of these numbers.
    type Vec3: Vector3<Self>;

    /// Returns the nearest number to `value`.
    fn constant(value: f64) -> Self;
    /// Returns the magnitude.
    fn abs(self) -> Self;
    /// Returns the square root; the argument must not be negative.
    fn sqrt(self) -> Self;
    /// Returns the largest integer that is not larger.
    fn floor(self) -> Self;
    /// Returns the smaller of two.
    fn min(self, other: Self) -> Self;
    /// Returns the larger of two.
    fn max(self, other: Self) -> Self;
    /// Returns the sine of an angle in radians.
    fn sin(self) -> Self;
    /// Returns the cosine of an angle in radians.
    fn cos(self) -> Self;
    /// Returns the angle of the vector (`x`, `self`), in `[-π, π]`; 0 at the origin.
    fn atan2(self, x: Self) -> Self;
    /// Returns two to the power of this.
    fn exp2(self) -> Self;
    /// Returns the logarithm to base two. For zero and negative numbers, it is the most negative value that
    /// the type's exponent allows, never NaN.
    fn log2(self) -> Self;
    /// Returns `2^n` for an integer `n` in [-126, 127].
    fn power_of_two(self) -> Self;
    /// Returns the `e` of `x = m · 2^e` with `m` in [1, 2), for normal positive `x`.
    fn exponent(self) -> Self;
    /// Returns the `m` of `x = m · 2^e` with `m` in [1, 2), for normal positive `x`.
    fn mantissa(self) -> Self;
    /// Returns a reproducible pseudo-random vector in [-1, 1)³ for the integer coordinates of `cell`.
    fn lattice(cell: Self::Vec3, seed: Self) -> Self::Vec3;
    /// Returns a reproducible pseudo-random number in [1, 2) and two signs, −1 or 1, for the integer
    /// coordinates of `cell`. They encode the gradient of the noise at that corner; see
    /// [`crate::elementary::perlin`].
    fn noise_corner_gradient(cell: Self::Vec3, seed: Self) -> Self::Vec3;
    /// Tests for `self < other`.
    fn less(self, other: Self) -> Self::Bool;
    /// Returns the conjunction of two conditions.
    fn and(a: Self::Bool, b: Self::Bool) -> Self::Bool;
    /// Returns the disjunction of two conditions.
    fn or(a: Self::Bool, b: Self::Bool) -> Self::Bool;
    /// Returns the negation of a condition.
    fn not(a: Self::Bool) -> Self::Bool;
    /// Returns `then` where the condition holds, `otherwise` elsewhere.
    fn select(condition: Self::Bool, then: Self, otherwise: Self) -> Self;
    /// Returns `blend(a, b)`. The derivatives of `blend` with respect to both are weights that sum to at
    /// most one in magnitude. So the operands' errors do not add up.
    #[inline(always)]
    fn convex_blend(a: Self, b: Self, blend: impl Fn(Self, Self) -> Self) -> Self {
        blend(a, b)
    }

    /// Reports whether a condition certainly holds, so that code that depends on its negation may be
    /// skipped. Types that represent many numbers, or text, return `false`.
    #[inline(always)]
    fn is_certain(_condition: Self::Bool) -> bool {
        false
    }
    /// Returns gradient noise at `p` and its gradient; see [`crate::elementary::perlin`].
    #[inline(always)]
    fn noise_gradient(p: Self::Vec3, seed: Self) -> (Self, Self::Vec3) {
        crate::elementary::perlin::<Self>(p, seed)
    }
    /// Returns gradient noise at `p`.
    #[inline(always)]
    fn noise(p: Self::Vec3, seed: Self) -> Self {
        Self::noise_gradient(p, seed).0
    }
    /// Returns the gradient of gradient noise at `p`.
    #[inline(always)]
    fn noise_slope(p: Self::Vec3, seed: Self) -> Self::Vec3 {
        crate::elementary::perlin::<Self>(p, seed).1
    }
    /// Returns the second derivatives of gradient noise at `p`: the gradient of each component of its
    /// gradient.
    #[inline(always)]
    fn noise_curvature(p: Self::Vec3, seed: Self) -> [Self::Vec3; 3] {
        let (p, seed) = (DualVec3::<Self>::seed(p), Dual::fixed(seed));
        crate::elementary::perlin::<Dual<Self>>(p, seed).1.gradients
    }
    /// Returns the distance to an ellipsoid with the radii `r`, and its gradient; see [`crate::ellipsoid`].
    #[inline(always)]
    fn ellipsoid_gradient(p: Self::Vec3, r: Self::Vec3) -> (Self, Self::Vec3) {
        crate::ellipsoid::ellipsoid::<Self>(p, r)
    }
    /// Returns the distance to an ellipsoid with the radii `r`.
    #[inline(always)]
    fn ellipsoid(p: Self::Vec3, r: Self::Vec3) -> Self {
        Self::ellipsoid_gradient(p, r).0
    }
    /// Returns the number unchanged; a recorder uses the name for its variable.
    #[inline(always)]
    fn named(self, _name: &'static str) -> Self {
        self
    }
    /// Returns a number that lies in [-1, 1], such as a component of a unit vector. Intervals, which may
    /// have overestimated it, are clamped.
    #[inline(always)]
    fn unit_component(self) -> Self {
        self
    }

    /// Returns the number unchanged, and marks it as discontinuous where the condition changes: its slope
    /// is unbounded there. Only types that represent more than one point at once use the mark.
    #[inline(always)]
    fn mark_discontinuity(self, _condition: Self::Bool) -> Self {
        self
    }
    /// Returns the gradient of a value that is discontinuous where the condition changes, given its
    /// gradient elsewhere.
    #[inline(always)]
    fn discontinuity_gradient(gradient: Self::Vec3, _condition: Self::Bool) -> Self::Vec3 {
        gradient
    }
    /// Returns the gradient of a floor, given the floor.
    #[inline(always)]
    fn floor_gradient(_floor: Self) -> Self::Vec3 {
        Self::Vec3::splat(lit(0.0))
    }

    /// Returns the number times a sign, which is −1 or 1.
    #[inline(always)]
    fn signed(self, sign: Self) -> Self {
        self * sign
    }
    /// Returns the square.
    #[inline(always)]
    fn square(self) -> Self {
        self * self
    }
    /// Returns the length of the vector with these components. (By squares rather than products: an
    /// interval's square is never negative.)
    #[inline(always)]
    fn length2(x: Self, y: Self) -> Self {
        (x.square() + y.square()).sqrt()
    }
    /// Returns the length of the vector with these components, summed in their order.
    #[inline(always)]
    fn length3(x: Self, y: Self, z: Self) -> Self {
        (x.square() + y.square() + z.square()).sqrt()
    }
    /// Returns the number, raised to `low` where it is less. NaN stays NaN; a maximum would drop it.
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        self.max(low)
    }
    /// Returns the number, lowered to `high` where it is more. NaN stays NaN.
    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        self.min(high)
    }
    /// Returns the number, clamped to `low` and `high`.
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
    /// Returns the number, clamped to 0 and 1.
    #[inline(always)]
    fn saturate(self) -> Self {
        self.clamp(lit(0.0), lit(1.0))
    }
    /// Returns −1 for negative numbers, 1 for all others: unlike the mathematical sign, never 0.
    #[inline(always)]
    fn sign_nonzero(self) -> Self {
        Self::select(self.less(lit(0.0)), lit(-1.0), lit(1.0))
    }
    /// Returns −1, 0 or 1.
    #[inline(always)]
    fn sign(self) -> Self {
        Self::select(
            self.less(lit(0.0)),
            lit(-1.0),
            Self::select(lit::<Self>(0.0).less(self), lit(1.0), lit(0.0)),
        )
    }
    /// Returns the linear interpolation from `self` at `t = 0` to `other` at `t = 1`.
    #[inline(always)]
    fn mix(self, other: Self, t: Self) -> Self {
        self + (other - self) * t
    }
    /// Returns the difference to the floor.
    #[inline(always)]
    fn fract(self) -> Self {
        self - self.floor()
    }
    /// Returns the smallest integer that is not smaller.
    #[inline(always)]
    fn ceil(self) -> Self {
        -(-self).floor()
    }
    /// Returns the nearest integer, halves upwards.
    #[inline(always)]
    fn round(self) -> Self {
        (self + lit(0.5)).floor()
    }
    /// Returns the integer part, rounded towards zero.
    #[inline(always)]
    fn trunc(self) -> Self {
        self.sign_nonzero() * self.abs().floor()
    }
    /// Returns the remainder of a floored division: it has the divisor's sign.
    #[inline(always)]
    fn modulo(self, divisor: Self) -> Self {
        self - divisor * (self / divisor).floor()
    }
    /// Returns the tangent of an angle in radians.
    #[inline(always)]
    fn tan(self) -> Self {
        self.sin() / self.cos()
    }
    /// Returns the exponential.
    #[inline(always)]
    fn exp(self) -> Self {
        (self * lit(std::f64::consts::LOG2_E)).exp2()
    }
    /// Returns the natural logarithm.
    #[inline(always)]
    fn ln(self) -> Self {
        self.log2() * lit(std::f64::consts::LN_2)
    }
    /// Returns this non-negative number to the power of `exponent`.
    #[inline(always)]
    fn pow(self, exponent: Self) -> Self {
        (exponent * self.at_least(lit(1e-37)).log2()).exp2()
    }
    /// Returns the inverse sine of the number clamped to [-1, 1].
    #[inline(always)]
    fn asin(self) -> Self {
        let x = self.at_least(lit(-1.0)).at_most(lit(1.0));
        x.atan2(((lit::<Self>(1.0) - x) * (lit::<Self>(1.0) + x)).sqrt())
    }
    /// Returns the inverse cosine of the number clamped to [-1, 1].
    #[inline(always)]
    fn acos(self) -> Self {
        let x = self.at_least(lit(-1.0)).at_most(lit(1.0));
        ((lit::<Self>(1.0) - x) * (lit::<Self>(1.0) + x))
            .sqrt()
            .atan2(x)
    }
    /// Returns the inverse tangent.
    #[inline(always)]
    fn atan(self) -> Self {
        self.atan2(lit(1.0))
    }
    /// Returns 0 below `edge`, 1 from it on.
    #[inline(always)]
    fn step(self, edge: Self) -> Self {
        Self::select(self.less(edge), lit(0.0), lit(1.0))
    }
    /// Returns the position between `low` and `high`, clamped to 0 and 1; a step where they are equal.
    #[inline(always)]
    fn ramp(self, low: Self, high: Self) -> Self {
        let width = (high - low).named("width");
        let is_none = width.abs().less(lit(1e-18));
        ((self - low) / Self::select(is_none, lit(1e-18), width)).saturate()
    }
    /// Returns 0 up to `low`, 1 from `high` on, and a smooth cubic between. It decreases where `high` is
    /// less than `low`; where they are equal it is a step.
    #[inline(always)]
    fn smoothstep(self, low: Self, high: Self) -> Self {
        eased(self.ramp(low, high))
    }
}

/// Returns a smooth cubic from 0 at 0 to 1 at 1.
#[inline(always)]
pub(crate) fn eased<R: Real>(t: R) -> R {
    t * t * (lit::<R>(3.0) - lit::<R>(2.0) * t)
}

/// Returns the literal `value` as a number of any type.
#[inline(always)]
pub fn lit<R: Real>(value: f64) -> R {
    R::constant(value)
}

/// A vector of two numbers.
pub trait Vector2<R: Real>:
    Copy
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<R, Output = Self>
    + Neg<Output = Self>
{
    /// Creates a vector from its components.
    fn new(x: R, y: R) -> Self;
    /// Returns the first component.
    fn x(self) -> R;
    /// Returns the second component.
    fn y(self) -> R;
    /// Returns the magnitude of each component.
    fn abs(self) -> Self;
    /// Returns the smaller of each pair of components.
    fn min(self, other: Self) -> Self;
    /// Returns the larger of each pair of components.
    fn max(self, other: Self) -> Self;
    /// Returns `then` where the condition holds, `otherwise` elsewhere.
    fn select(condition: R::Bool, then: Self, otherwise: Self) -> Self;
    /// Returns the vector unchanged; a recorder uses the name for its variable.
    #[inline(always)]
    fn named(self, _name: &'static str) -> Self {
        self
    }
    /// Creates a vector with this number in both components.
    #[inline(always)]
    fn splat(v: R) -> Self {
        Self::new(v, v)
    }
    /// Returns the inner product.
    #[inline(always)]
    fn dot(self, other: Self) -> R {
        self.x() * other.x() + self.y() * other.y()
    }
    /// Returns the Euclidean length.
    #[inline(always)]
    fn length(self) -> R {
        self.dot(self).sqrt()
    }
    /// Returns the larger component.
    #[inline(always)]
    fn max_component(self) -> R {
        self.x().max(self.y())
    }
}

/// A vector of three numbers.
pub trait Vector3<R: Real>:
    Copy
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<R, Output = Self>
    + Neg<Output = Self>
{
    /// Creates a vector from its components.
    fn new(x: R, y: R, z: R) -> Self;
    /// Returns the first component.
    fn x(self) -> R;
    /// Returns the second component.
    fn y(self) -> R;
    /// Returns the third component.
    fn z(self) -> R;
    /// Returns the magnitude of each component.
    fn abs(self) -> Self;
    /// Returns the floor of each component.
    fn floor(self) -> Self;
    /// Returns the smaller of each pair of components.
    fn min(self, other: Self) -> Self;
    /// Returns the larger of each pair of components.
    fn max(self, other: Self) -> Self;
    /// Returns `then` where the condition holds, `otherwise` elsewhere.
    fn select(condition: R::Bool, then: Self, otherwise: Self) -> Self;
    /// Returns the vector unchanged; a recorder uses the name for its variable.
    #[inline(always)]
    fn named(self, _name: &'static str) -> Self {
        self
    }
    /// Returns the first and second component.
    #[inline(always)]
    fn xy(self) -> R::Vec2 {
        R::Vec2::new(self.x(), self.y())
    }
    /// Returns the first and third component.
    #[inline(always)]
    fn xz(self) -> R::Vec2 {
        R::Vec2::new(self.x(), self.z())
    }
    /// Creates a vector with this number in all three components.
    #[inline(always)]
    fn splat(v: R) -> Self {
        Self::new(v, v, v)
    }
    /// Returns the inner product, summed in the order of the components.
    #[inline(always)]
    fn dot(self, other: Self) -> R {
        self.x() * other.x() + self.y() * other.y() + self.z() * other.z()
    }
    /// Returns the Euclidean length.
    #[inline(always)]
    fn length(self) -> R {
        self.dot(self).sqrt()
    }
    /// Returns the cross product.
    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        Self::new(
            self.y() * other.z() - self.z() * other.y(),
            self.z() * other.x() - self.x() * other.z(),
            self.x() * other.y() - self.y() * other.x(),
        )
    }
    /// Returns the unit vector in this direction; the zero vector stays zero.
    #[inline(always)]
    fn normalize(self) -> Self {
        self * (lit::<R>(1.0) / self.length().max(lit(1e-30)))
    }
    /// Returns the largest component.
    #[inline(always)]
    fn max_component(self) -> R {
        self.x().max(self.y()).max(self.z())
    }
    /// Returns the linear interpolation from `self` at `t = 0` to `other` at `t = 1`.
    #[inline(always)]
    fn mix(self, other: Self, t: R) -> Self {
        self + (other - self) * t
    }
}
