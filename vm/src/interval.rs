//! Intervals: a body evaluated on intervals gives bounds that hold for every point of a box.
//!
//! There are two kinds, by the number type of their ends ([`Endpoint`]):
//! - [`Interval`], of `f64`, bounds the formula's value for *real* numbers: every result is widened to the next
//!   representable number on both sides. It is for proofs.
//! - [`FloatInterval`], of `f32`, bounds the formula's value when it is *evaluated in `f32`*. Sums, products,
//!   quotients, roots and minima round monotonically, so their ends need no widening: an end is the `f32` result
//!   there. It is for pruning programs: its decisions cannot change a bit of the result.
//!
//! All code is branch-free, so that 64 intervals are evaluated in lanes ([`crate::lanes`]).

mod real;

use crate::elementary;
use crate::real::{Real, lit};
use crate::vector::V3;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// All numbers from `lo` to `hi`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GenericInterval<E> {
    /// The smallest number.
    pub lo: E,
    /// The largest number.
    pub hi: E,
}

/// Bounds for real numbers.
pub type Interval = GenericInterval<f64>;

/// Bounds for `f32` results.
pub type FloatInterval = GenericInterval<f32>;

/// The three-valued result of a comparison between intervals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tristate {
    /// Set if it may hold for some numbers.
    pub can_be_true: bool,
    /// Set if it may fail for some numbers.
    pub can_be_false: bool,
}

/// A number type for the ends of intervals.
pub trait Endpoint: Real<Bool = bool, Vec3 = V3<Self>> + PartialOrd + std::fmt::Debug {
    /// Infinity, which is larger than all numbers.
    const INFINITY: Self;
    /// Set if the ends bound real numbers, for which identities hold that `f32` arithmetic may violate.
    const BOUNDS_REALS: bool;
    /// Returns the number itself, or the next one below where the bound requires it.
    fn down(self) -> Self;
    /// Returns the number itself, or the next one above where the bound requires it.
    fn up(self) -> Self;
    /// Returns the largest error of the sine, cosine and angle for arguments up to `magnitude`.
    fn trigonometric_error(magnitude: Self) -> Self;
    /// Returns the largest error of an exponential with this result.
    fn exponential_error(result: Self) -> Self;
    /// Returns the largest error of a logarithm with this result.
    fn logarithm_error(result: Self) -> Self;
    /// Returns the largest error of a distance that is computed from coordinates and lengths up to `size`
    /// in a few dozen operations.
    fn distance_error(size: Self) -> Self;
    /// Returns bounds of gradient noise and of its gradient over a box.
    fn noise_gradient(
        p: V3<GenericInterval<Self>>,
        seed: GenericInterval<Self>,
    ) -> (GenericInterval<Self>, V3<GenericInterval<Self>>);
}

impl Endpoint for f64 {
    const INFINITY: Self = f64::INFINITY;
    const BOUNDS_REALS: bool = true;
    #[inline(always)]
    fn down(self) -> Self {
        self.next_down()
    }
    #[inline(always)]
    fn up(self) -> Self {
        self.next_up()
    }
    #[inline(always)]
    fn trigonometric_error(_: Self) -> Self {
        1e-15
    }
    #[inline(always)]
    fn exponential_error(result: Self) -> Self {
        f64::abs(result) * 1e-15
    }
    #[inline(always)]
    fn logarithm_error(result: Self) -> Self {
        f64::abs(result) * 1e-15
    }
    #[inline(always)]
    fn distance_error(size: Self) -> Self {
        size * 4e-15
    }
    fn noise_gradient(p: V3<Interval>, seed: Interval) -> (Interval, V3<Interval>) {
        let single = |i: Interval| i.lo.floor() == i.hi.floor();
        let value = noise_around_middle(p, seed, 1e-12);
        let slopes: V3<Interval> = noise_slopes();
        if single(p.x) && single(p.y) && single(p.z) && seed.lo == seed.hi {
            let (inside, gradient) = elementary::perlin(p, seed);
            let gradient = V3::new(
                gradient.x.intersection(slopes.x),
                gradient.y.intersection(slopes.y),
                gradient.z.intersection(slopes.z),
            );
            return (inside.intersection(value), gradient);
        }
        (value, slopes)
    }
}

impl Endpoint for f32 {
    const INFINITY: Self = f32::INFINITY;
    const BOUNDS_REALS: bool = false;
    #[inline(always)]
    fn down(self) -> Self {
        self
    }
    #[inline(always)]
    fn up(self) -> Self {
        self
    }
    #[inline(always)]
    fn trigonometric_error(magnitude: Self) -> Self {
        1e-6 + magnitude * 2e-7
    }
    #[inline(always)]
    fn exponential_error(result: Self) -> Self {
        // A fixed error would hide the sign of fields that decay. The least normal number covers results that
        // are flushed to zero.
        f32::abs(result) * 2e-6 + f32::MIN_POSITIVE
    }
    #[inline(always)]
    fn logarithm_error(_: Self) -> Self {
        // It decreases between no two of the normal numbers above zero: all were compared.
        0.0
    }
    #[inline(always)]
    fn distance_error(size: Self) -> Self {
        size * 2e-6
    }
    #[inline(always)]
    fn noise_gradient(
        p: V3<FloatInterval>,
        seed: FloatInterval,
    ) -> (FloatInterval, V3<FloatInterval>) {
        (noise_around_middle(p, seed, 1e-5), noise_slopes())
    }
}

/// A number near the overflow limit of `f32`. The lower end of an increasing function is at most this, and the
/// upper end at least its negative, so that no end becomes ∞ − ∞.
const NEAR_OVERFLOW: f64 = 3e38;

/// Reports whether a number is not NaN.
#[inline(always)]
#[expect(clippy::eq_op, reason = "NaN alone is not equal to itself")]
fn is_number<E: Endpoint>(v: E) -> bool {
    v == v
}

/// Bounds noise over a box: its value at the centre, plus or minus the largest change that its slope bound
/// allows. `slack` covers rounding of the value; rounding of the centre does not matter.
#[inline(always)]
fn noise_around_middle<E: Endpoint>(
    p: V3<GenericInterval<E>>,
    seed: GenericInterval<E>,
    slack: f64,
) -> GenericInterval<E> {
    let middle = |i: GenericInterval<E>| (i.lo + i.hi) * lit(0.5);
    let centre = V3::new(middle(p.x), middle(p.y), middle(p.z));
    let half = |i: GenericInterval<E>, middle: E| (i.hi - middle).max(middle - i.lo);
    let (x, y, z) = (
        half(p.x, centre.x),
        half(p.y, centre.y),
        half(p.z, centre.z),
    );
    let radius = (x * x + y * y + z * z).sqrt();
    let value = E::noise(centre, seed.lo);
    // Far from the origin, coordinates are rounded to steps that are not negligible.
    let coarse = (centre.x.abs() + centre.y.abs() + centre.z.abs()) * lit(1e-6);
    let change = (radius + coarse) * lit(MAX_NOISE_STEEPNESS) + lit(slack);
    let is_bounded = (seed.lo == seed.hi) & (change < E::INFINITY);
    let limit = lit::<E>(1.5);
    GenericInterval {
        lo: E::select(is_bounded, (value - change).max(-limit), -limit),
        hi: E::select(is_bounded, (value + change).min(limit), limit),
    }
}

/// Returns bounds of the noise's gradient that hold everywhere.
#[inline(always)]
fn noise_slopes<E: Endpoint>() -> V3<GenericInterval<E>> {
    let slope = GenericInterval {
        lo: lit(-MAX_NOISE_SLOPE),
        hi: lit(MAX_NOISE_SLOPE),
    };
    V3::new(slope, slope, slope)
}

impl Interval {
    /// The interval of all numbers.
    pub const ALL: Self = Self {
        lo: f64::NEG_INFINITY,
        hi: f64::INFINITY,
    };
}

impl<E: Endpoint> GenericInterval<E> {
    /// Creates the interval of one number.
    #[inline(always)]
    pub const fn point(v: E) -> Self {
        Self { lo: v, hi: v }
    }
    /// Creates the interval between two numbers, in either order.
    #[inline(always)]
    pub fn between(a: E, b: E) -> Self {
        Self {
            lo: a.min(b),
            hi: a.max(b),
        }
    }
    /// Returns the smallest interval that contains both.
    #[inline(always)]
    pub fn hull(self, other: Self) -> Self {
        Self {
            lo: self.lo.min(other.lo),
            hi: self.hi.max(other.hi),
        }
    }
    /// Returns the intersection of two bounds of the same number.
    #[inline(always)]
    fn intersection(self, other: Self) -> Self {
        Self {
            lo: self.lo.max(other.lo),
            hi: self.hi.min(other.hi),
        }
    }
    /// Reports whether `v` lies inside.
    #[inline(always)]
    pub fn contains(self, v: E) -> bool {
        self.lo <= v && v <= self.hi
    }
    /// Returns the largest magnitude inside.
    #[inline(always)]
    pub fn magnitude(self) -> E {
        self.lo.abs().max(self.hi.abs())
    }
    /// Reports whether it is a single number.
    #[inline(always)]
    fn is_point(self) -> bool {
        self.lo == self.hi
    }
    /// Returns a random number of a cell: `v`, or its full range where the cell is ambiguous.
    #[inline(always)]
    fn random(v: E, [lo, hi]: [f64; 2], cell: V3<Self>, seed: Self) -> Self {
        let is_single = cell.x.is_point() & cell.y.is_point() & cell.z.is_point() & seed.is_point();
        Self {
            lo: E::select(is_single, v, lit(lo)),
            hi: E::select(is_single, v, lit(hi)),
        }
    }
    /// Returns the ends rounded outwards; NaN becomes infinite.
    #[inline(always)]
    fn widened(lo: E, hi: E) -> Self {
        let is_valid = is_number(lo) & is_number(hi);
        Self {
            lo: E::select(is_valid, lo.down(), -E::INFINITY),
            hi: E::select(is_valid, hi.up(), E::INFINITY),
        }
    }
    /// Returns a sum's ends rounded outwards. A zero end is exact, so squares of boxes at the origin stay
    /// non-negative.
    #[inline(always)]
    fn summed(lo: E, hi: E) -> Self {
        let wide = Self::widened(lo, hi);
        let zero = lit::<E>(0.0);
        let is_valid = is_number(lo) & is_number(hi);
        Self {
            lo: E::select(is_valid & (lo == zero), zero, wide.lo),
            hi: E::select(is_valid & (hi == zero), zero, wide.hi),
        }
    }
    /// Returns the hull of four numbers, rounded outwards.
    #[inline(always)]
    fn hull_of_four([a, b, c, d]: [E; 4]) -> Self {
        let is_valid = is_number(a) & is_number(b) & is_number(c) & is_number(d);
        let (lo, hi) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        Self {
            lo: E::select(is_valid, lo.down(), -E::INFINITY),
            hi: E::select(is_valid, hi.up(), E::INFINITY),
        }
    }
    /// Evaluates a monotonically increasing elementary function, widened by its error at each end.
    #[inline(always)]
    fn increasing(self, f: impl Fn(E) -> E, error: impl Fn(E) -> E) -> Self {
        // Infinite results are clamped; otherwise their error would be infinite as well.
        let (lo, hi) = (
            f(self.lo).min(lit(NEAR_OVERFLOW)),
            f(self.hi).max(lit(-NEAR_OVERFLOW)),
        );
        Self::widened(lo - error(lo), hi + error(hi))
    }
    /// Returns the range of a wave over this interval of radians. The wave is a sine or cosine `f` whose
    /// maxima are at `crest` and every full turn from there.
    #[inline(always)]
    fn wave(self, f: impl Fn(E) -> E, crest: f64) -> Self {
        use std::f64::consts::{PI, TAU};
        let error = E::trigonometric_error(self.magnitude());
        let (a, b) = (f(self.lo), f(self.hi));
        // A crest (or a trough) lies inside if the end has passed one more of them than the start. Where
        // rounding moves one across an end, the value at that end almost equals the crest.
        let passes = |phase: f64| {
            let turns = |x: E| ((x - lit(phase)) * lit(1.0 / TAU)).floor();
            turns(self.lo) < turns(self.hi)
        };
        let one = lit::<E>(1.0);
        // Comparisons with NaN fail: an interval whose length is NaN counts as long.
        let short = (self.hi - self.lo < lit(TAU)) & (self.magnitude() < lit(1e5));
        let limit = one + E::trigonometric_error(one);
        let lo = E::select(!short | passes(crest - PI), -limit, a.min(b) - error);
        let hi = E::select(!short | passes(crest), limit, a.max(b) + error);
        Self {
            lo: lo.max(-limit),
            hi: hi.min(limit),
        }
    }
}

impl<E: Endpoint> Add for GenericInterval<E> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::summed(self.lo + other.lo, self.hi + other.hi)
    }
}
impl<E: Endpoint> Sub for GenericInterval<E> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::summed(self.lo - other.hi, self.hi - other.lo)
    }
}
impl<E: Endpoint> Neg for GenericInterval<E> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            lo: -self.hi,
            hi: -self.lo,
        }
    }
}
impl<E: Endpoint> Mul for GenericInterval<E> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::hull_of_four([
            product(self.lo, other.lo),
            product(self.lo, other.hi),
            product(self.hi, other.lo),
            product(self.hi, other.hi),
        ])
    }
}

/// Multiplies two ends. 0 · ∞ is 0 here: an infinite end means "arbitrarily large". (A function, because a closure
/// would not be compiled into each loop over lanes.)
#[inline(always)]
fn product<E: Endpoint>(a: E, b: E) -> E {
    let zero = lit::<E>(0.0);
    E::select((a == zero) | (b == zero), zero, a * b)
}
impl<E: Endpoint> Div for GenericInterval<E> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let zero = lit::<E>(0.0);
        let quotients = Self::hull_of_four([
            self.lo / other.lo,
            self.lo / other.hi,
            self.hi / other.lo,
            self.hi / other.hi,
        ]);
        // A non-negative divisor keeps the sign of the dividend.
        let rising = (self.lo >= zero) & (other.lo >= zero) & (other.hi > zero);
        let spans_zero = !((other.lo > zero) | (other.hi < zero));
        Self {
            lo: E::select(
                spans_zero,
                E::select(rising, (self.lo / other.hi).down(), -E::INFINITY),
                quotients.lo,
            ),
            hi: E::select(spans_zero, E::INFINITY, quotients.hi),
        }
    }
}

/// An upper bound of the noise's slope along an axis, no tighter than in any other direction.
pub const MAX_NOISE_SLOPE: f64 = MAX_NOISE_STEEPNESS;

/// An upper bound of each second derivative of the noise, for any hash. With the worst gradient direction
/// at every corner of a cell, they would reach 8.5.
pub const MAX_NOISE_CURVATURE: f64 = 9.0;

/// An upper bound of the length of the noise's gradient, for any hash. In the middle of a cell it could be
/// 2.652, and a test proves that it never exceeds this bound.
pub const MAX_NOISE_STEEPNESS: f64 = 2.68;
