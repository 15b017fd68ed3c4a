//! The number type that every operation's body is generic over.
//!
//! A body such as `fn sphere<R: Real>(p: R::Vec3, r: R) -> R` is written once. It runs on `f32`
//! (pictures), `f64` (tests and uniform expressions), [`Interval`](crate::interval::Interval)
//! (proofs), [`Dual`] (exact gradients), and on the
//! [recorder](crate::record), whose values are expression nodes and whose result is WGSL.
//!
//! Bodies are branch-free: [`Real::select`] and the comparisons take the place of `if`. Formulas
//! are written out (`a + (b - a) * t`, the square root of a sum of squares) rather than left to
//! builtins, whose rounding differs from device to device.

use crate::dual::{Dual, DualVec3};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number: what a distance, a coordinate or a parameter is.
pub trait Real:
    Copy
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The outcome of a comparison.
    type Bool: Copy;
    /// Two of these numbers.
    type Vec2: Vector2<Self>;
    /// Three of these numbers.
    type Vec3: Vector3<Self>;

    /// The number nearest to `value`.
    fn constant(value: f64) -> Self;
    /// The magnitude.
    fn abs(self) -> Self;
    /// The square root; the argument must not be negative.
    fn sqrt(self) -> Self;
    /// The largest whole number that is not larger.
    fn floor(self) -> Self;
    /// The smaller of two.
    fn min(self, other: Self) -> Self;
    /// The larger of two.
    fn max(self, other: Self) -> Self;
    /// The sine of an angle in radians.
    fn sin(self) -> Self;
    /// The cosine of an angle in radians.
    fn cos(self) -> Self;
    /// The angle of the vector (`x`, `self`), in `[-π, π]`; 0 at the origin.
    fn atan2(self, x: Self) -> Self;
    /// Two to the power of this.
    fn exp2(self) -> Self;
    /// The logarithm to base two; of zero or less it is the most negative value that the type's
    /// exponent gives, never NaN.
    fn log2(self) -> Self;
    /// `2^n` for a whole `n` in [-126, 127].
    fn power_of_two(self) -> Self;
    /// The `e` of `x = m · 2^e` with `m` in [1, 2), for normal positive `x`.
    fn exponent(self) -> Self;
    /// The `m` of `x = m · 2^e` with `m` in [1, 2), for normal positive `x`.
    fn mantissa(self) -> Self;
    /// A reproducible pseudo-random vector in [-1, 1)³ for the whole numbers of `cell`.
    fn lattice(cell: Self::Vec3, seed: Self) -> Self::Vec3;
    /// A reproducible pseudo-random number in [1, 2) and two of −1 and 1, for the whole numbers of
    /// `cell`: the gradient of the noise there, see [`crate::elementary::perlin`].
    fn lattice_edge(cell: Self::Vec3, seed: Self) -> Self::Vec3;
    /// Whether this is smaller than `other`.
    fn less(self, other: Self) -> Self::Bool;
    /// Whether both hold.
    fn and(a: Self::Bool, b: Self::Bool) -> Self::Bool;
    /// Whether at least one holds.
    fn or(a: Self::Bool, b: Self::Bool) -> Self::Bool;
    /// Whether it does not hold.
    fn not(a: Self::Bool) -> Self::Bool;
    /// `then` where the condition holds, `otherwise` elsewhere.
    fn select(condition: Self::Bool, then: Self, otherwise: Self) -> Self;
    /// What `blend` makes of two numbers, in which each has a share, and no more than one together: what
    /// they are off by does not add up.
    #[inline(always)]
    fn shared(a: Self, b: Self, blend: impl Fn(Self, Self) -> Self) -> Self {
        blend(a, b)
    }

    /// Whether the outcome is known to hold, so that what depends on it may be left out. Numbers
    /// that stand for many, or for text, never know.
    #[inline(always)]
    fn surely(_condition: Self::Bool) -> bool {
        false
    }
    /// Gradient noise at `p` and its gradient; see [`crate::elementary::perlin`].
    #[inline(always)]
    fn noise_gradient(p: Self::Vec3, seed: Self) -> (Self, Self::Vec3) {
        crate::elementary::perlin::<Self>(p, seed)
    }
    /// Gradient noise at `p`.
    #[inline(always)]
    fn noise(p: Self::Vec3, seed: Self) -> Self {
        Self::noise_gradient(p, seed).0
    }
    /// The gradient of gradient noise at `p`.
    #[inline(always)]
    fn noise_slope(p: Self::Vec3, seed: Self) -> Self::Vec3 {
        crate::elementary::perlin::<Self>(p, seed).1
    }
    /// The second derivatives of gradient noise at `p`: the gradient of each component of its gradient.
    #[inline(always)]
    fn noise_curvature(p: Self::Vec3, seed: Self) -> [Self::Vec3; 3] {
        let (p, seed) = (DualVec3::<Self>::seed(p), Dual::fixed(seed));
        crate::elementary::perlin::<Dual<Self>>(p, seed).1.gradients
    }
    /// The distance to an ellipsoid with the radii `r`, and its gradient; see [`crate::ellipsoid`].
    #[inline(always)]
    fn ellipsoid_gradient(p: Self::Vec3, r: Self::Vec3) -> (Self, Self::Vec3) {
        crate::ellipsoid::ellipsoid::<Self>(p, r)
    }
    /// The distance to an ellipsoid with the radii `r`.
    #[inline(always)]
    fn ellipsoid(p: Self::Vec3, r: Self::Vec3) -> Self {
        Self::ellipsoid_gradient(p, r).0
    }
    /// The same number; a recorder takes the name for its variable.
    #[inline(always)]
    fn named(self, _name: &'static str) -> Self {
        self
    }
    /// A number known to lie in [-1, 1], as the component of a unit vector does; intervals, which
    /// may have lost that knowledge, are cut to it.
    #[inline(always)]
    fn unit_component(self) -> Self {
        self
    }

    /// The same number, which jumps where the condition changes: its slope there has no bound.
    /// Only numbers that look at more than one point at once care.
    #[inline(always)]
    fn jumping(self, _condition: Self::Bool) -> Self {
        self
    }
    /// The gradient of what jumps where the condition changes, given its gradient elsewhere.
    #[inline(always)]
    fn jump_gradient(gradient: Self::Vec3, _condition: Self::Bool) -> Self::Vec3 {
        gradient
    }
    /// The gradient of a floor, given the floor.
    #[inline(always)]
    fn floor_gradient(_floor: Self) -> Self::Vec3 {
        Self::Vec3::splat(lit(0.0))
    }

    /// The number times a sign, which is −1 or 1.
    #[inline(always)]
    fn signed(self, sign: Self) -> Self {
        self * sign
    }
    /// The number times itself.
    #[inline(always)]
    fn square(self) -> Self {
        self * self
    }
    /// The length of the vector with these components. (Squares rather than products: an
    /// interval's square is never negative.)
    #[inline(always)]
    fn length2(x: Self, y: Self) -> Self {
        (x.square() + y.square()).sqrt()
    }
    /// The length of the vector with these components, summed in their order.
    #[inline(always)]
    fn length3(x: Self, y: Self, z: Self) -> Self {
        (x.square() + y.square() + z.square()).sqrt()
    }
    /// The number, raised to `low` where it is less. What is no number stays so; of maxima it is dropped.
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        self.max(low)
    }
    /// The number, lowered to `high` where it is more. What is no number stays so.
    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        self.min(high)
    }
    /// The number, kept within `low` and `high`.
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
    /// The number, kept within 0 and 1.
    #[inline(always)]
    fn saturate(self) -> Self {
        self.clamp(lit(0.0), lit(1.0))
    }
    /// −1 for negative numbers, 1 for all others: unlike the mathematical sign, never 0.
    #[inline(always)]
    fn side(self) -> Self {
        Self::select(self.less(lit(0.0)), lit(-1.0), lit(1.0))
    }
    /// −1, 0 or 1.
    #[inline(always)]
    fn sign(self) -> Self {
        Self::select(
            self.less(lit(0.0)),
            lit(-1.0),
            Self::select(lit::<Self>(0.0).less(self), lit(1.0), lit(0.0)),
        )
    }
    /// `self` at `t = 0`, `other` at `t = 1`, straight between.
    #[inline(always)]
    fn mix(self, other: Self, t: Self) -> Self {
        self + (other - self) * t
    }
    /// The distance to the whole number below.
    #[inline(always)]
    fn fract(self) -> Self {
        self - self.floor()
    }
    /// The smallest whole number that is not smaller.
    #[inline(always)]
    fn ceil(self) -> Self {
        -(-self).floor()
    }
    /// The nearest whole number, halves upwards.
    #[inline(always)]
    fn round(self) -> Self {
        (self + lit(0.5)).floor()
    }
    /// The whole part, towards zero.
    #[inline(always)]
    fn trunc(self) -> Self {
        self.side() * self.abs().floor()
    }
    /// The remainder of a floored division: it has the divisor's sign.
    #[inline(always)]
    fn modulo(self, divisor: Self) -> Self {
        self - divisor * (self / divisor).floor()
    }
    /// The tangent of an angle in radians.
    #[inline(always)]
    fn tan(self) -> Self {
        self.sin() / self.cos()
    }
    /// The exponential.
    #[inline(always)]
    fn exp(self) -> Self {
        (self * lit(std::f64::consts::LOG2_E)).exp2()
    }
    /// The natural logarithm.
    #[inline(always)]
    fn ln(self) -> Self {
        self.log2() * lit(std::f64::consts::LN_2)
    }
    /// This, not negative, to the power of `exponent`.
    #[inline(always)]
    fn pow(self, exponent: Self) -> Self {
        (exponent * self.at_least(lit(1e-37)).log2()).exp2()
    }
    /// The inverse sine of a number kept within [-1, 1].
    #[inline(always)]
    fn asin(self) -> Self {
        let x = self.at_least(lit(-1.0)).at_most(lit(1.0));
        x.atan2(((lit::<Self>(1.0) - x) * (lit::<Self>(1.0) + x)).sqrt())
    }
    /// The inverse cosine of a number kept within [-1, 1].
    #[inline(always)]
    fn acos(self) -> Self {
        let x = self.at_least(lit(-1.0)).at_most(lit(1.0));
        ((lit::<Self>(1.0) - x) * (lit::<Self>(1.0) + x))
            .sqrt()
            .atan2(x)
    }
    /// The inverse tangent.
    #[inline(always)]
    fn atan(self) -> Self {
        self.atan2(lit(1.0))
    }
    /// 0 below `edge`, 1 from it on.
    #[inline(always)]
    fn step(self, edge: Self) -> Self {
        Self::select(self.less(edge), lit(0.0), lit(1.0))
    }
    /// The way from `low` to `high`, from 0 to 1; a step where they are equal.
    #[inline(always)]
    fn ramp(self, low: Self, high: Self) -> Self {
        let width = (high - low).named("width");
        let is_none = width.abs().less(lit(1e-18));
        ((self - low) / Self::select(is_none, lit(1e-18), width)).saturate()
    }
    /// 0 at `low` and before, 1 at `high` and beyond, a smooth cubic between. It falls where `high` is less; where they
    /// are equal it is a step.
    #[inline(always)]
    fn smoothstep(self, low: Self, high: Self) -> Self {
        eased(self.ramp(low, high))
    }
}

/// A smooth cubic from 0 at 0 to 1 at 1.
#[inline(always)]
pub(crate) fn eased<R: Real>(t: R) -> R {
    t * t * (lit::<R>(3.0) - lit::<R>(2.0) * t)
}

/// The literal `value` as a number of the wanted type.
#[inline(always)]
pub fn lit<R: Real>(value: f64) -> R {
    R::constant(value)
}

/// Two numbers.
pub trait Vector2<R: Real>:
    Copy
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<R, Output = Self>
    + Neg<Output = Self>
{
    /// From its components.
    fn new(x: R, y: R) -> Self;
    /// The first component.
    fn x(self) -> R;
    /// The second component.
    fn y(self) -> R;
    /// Each component's magnitude.
    fn abs(self) -> Self;
    /// The smaller of each pair of components.
    fn min(self, other: Self) -> Self;
    /// The larger of each pair of components.
    fn max(self, other: Self) -> Self;
    /// `then` where the condition holds, `otherwise` elsewhere.
    fn select(condition: R::Bool, then: Self, otherwise: Self) -> Self;
    /// The same vector; a recorder takes the name for its variable.
    #[inline(always)]
    fn named(self, _name: &'static str) -> Self {
        self
    }
    /// The same number twice.
    #[inline(always)]
    fn splat(v: R) -> Self {
        Self::new(v, v)
    }
    /// The inner product.
    #[inline(always)]
    fn dot(self, other: Self) -> R {
        self.x() * other.x() + self.y() * other.y()
    }
    /// The Euclidean length.
    #[inline(always)]
    fn length(self) -> R {
        self.dot(self).sqrt()
    }
    /// The larger component.
    #[inline(always)]
    fn max_component(self) -> R {
        self.x().max(self.y())
    }
}

/// Three numbers.
pub trait Vector3<R: Real>:
    Copy
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<R, Output = Self>
    + Neg<Output = Self>
{
    /// From its components.
    fn new(x: R, y: R, z: R) -> Self;
    /// The first component.
    fn x(self) -> R;
    /// The second component.
    fn y(self) -> R;
    /// The third component.
    fn z(self) -> R;
    /// Each component's magnitude.
    fn abs(self) -> Self;
    /// Each component's floor.
    fn floor(self) -> Self;
    /// The smaller of each pair of components.
    fn min(self, other: Self) -> Self;
    /// The larger of each pair of components.
    fn max(self, other: Self) -> Self;
    /// `then` where the condition holds, `otherwise` elsewhere.
    fn select(condition: R::Bool, then: Self, otherwise: Self) -> Self;
    /// The same vector; a recorder takes the name for its variable.
    #[inline(always)]
    fn named(self, _name: &'static str) -> Self {
        self
    }
    /// The first and second component.
    #[inline(always)]
    fn xy(self) -> R::Vec2 {
        R::Vec2::new(self.x(), self.y())
    }
    /// The first and third component.
    #[inline(always)]
    fn xz(self) -> R::Vec2 {
        R::Vec2::new(self.x(), self.z())
    }
    /// The same number three times.
    #[inline(always)]
    fn splat(v: R) -> Self {
        Self::new(v, v, v)
    }
    /// The inner product, summed in the order of the components.
    #[inline(always)]
    fn dot(self, other: Self) -> R {
        self.x() * other.x() + self.y() * other.y() + self.z() * other.z()
    }
    /// The Euclidean length.
    #[inline(always)]
    fn length(self) -> R {
        self.dot(self).sqrt()
    }
    /// The vector product.
    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        Self::new(
            self.y() * other.z() - self.z() * other.y(),
            self.z() * other.x() - self.x() * other.z(),
            self.x() * other.y() - self.y() * other.x(),
        )
    }
    /// The vector of length one in this direction; the zero vector stays zero.
    #[inline(always)]
    fn normalize(self) -> Self {
        self * (lit::<R>(1.0) / self.length().max(lit(1e-30)))
    }
    /// The largest component.
    #[inline(always)]
    fn max_component(self) -> R {
        self.x().max(self.y()).max(self.z())
    }
    /// `self` at `t = 0`, `other` at `t = 1`, straight between.
    #[inline(always)]
    fn mix(self, other: Self, t: R) -> Self {
        self + (other - self) * t
    }
}
