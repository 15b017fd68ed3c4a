//! Intervals: a body evaluated on intervals gives bounds that hold for every point of a box.
//!
//! There are two of them, by the number type of their ends ([`End`]):
//! - [`Interval`], of `f64`, bounds what the formula gives for *real* numbers: every result is
//!   widened to the next representable number on both sides. It is for proofs.
//! - [`FloatInterval`], of `f32`, bounds what the formula gives when it is *evaluated in `f32`*.
//!   Sums, products, quotients, roots and minima round monotonically, so their ends need no
//!   widening at all: an end is what `f32` gives there. It is for pruning programs: what it
//!   decides cannot change a bit of the result.
//!
//! Everything is branch-free, so that 64 of them run in lanes ([`crate::lanes`]).

use crate::elementary;
use crate::real::{Real, eased, lit};
use crate::vector::V3;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// All numbers from `lo` to `hi`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IntervalOf<E> {
    /// The smallest number.
    pub lo: E,
    /// The largest number.
    pub hi: E,
}

/// Bounds for real numbers.
pub type Interval = IntervalOf<f64>;

/// Bounds for what `f32` gives.
pub type FloatInterval = IntervalOf<f32>;

/// What is known of a comparison between intervals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Known {
    /// It may hold for some numbers.
    pub may: bool,
    /// It may fail for some.
    pub may_not: bool,
}

/// A number type for the ends of intervals.
pub trait End: Real<Bool = bool, Vec3 = V3<Self>> + PartialOrd + std::fmt::Debug {
    /// Larger than all numbers.
    const INFINITY: Self;
    /// Set where the ends bound real numbers, for which identities hold that devices are not asked to know.
    const OF_REALS: bool;
    /// The number itself, or the next one below where that is needed for the bound to hold.
    fn down(self) -> Self;
    /// The number itself, or the next one above where that is needed for the bound to hold.
    fn up(self) -> Self;
    /// How far the sine, cosine and angle of arguments up to `magnitude` may be off.
    fn trigonometric_error(magnitude: Self) -> Self;
    /// How far the exponential and the logarithm that gave `result` may be off.
    fn exponential_error(result: Self) -> Self;
    /// How far a distance may be off that is computed from coordinates and lengths up to `size` in some dozens of
    /// operations.
    fn distance_error(size: Self) -> Self;
    /// Gradient noise and its gradient over a box.
    fn noise_gradient(
        p: V3<IntervalOf<Self>>,
        seed: IntervalOf<Self>,
    ) -> (IntervalOf<Self>, V3<IntervalOf<Self>>);
}

impl End for f64 {
    const INFINITY: Self = f64::INFINITY;
    const OF_REALS: bool = true;
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
    fn distance_error(size: Self) -> Self {
        size * 4e-15
    }
    fn noise_gradient(p: V3<Interval>, seed: Interval) -> (Interval, V3<Interval>) {
        let single = |i: Interval| i.lo.floor() == i.hi.floor();
        let value = noise_around_middle(p, seed, 1e-12);
        let slopes: V3<Interval> = noise_slopes();
        if single(p.x) && single(p.y) && single(p.z) && seed.lo == seed.hi {
            let (inside, gradient) = elementary::perlin(p, seed);
            let gradient = V3::of(
                gradient.x.common(slopes.x),
                gradient.y.common(slopes.y),
                gradient.z.common(slopes.z),
            );
            return (inside.common(value), gradient);
        }
        (value, slopes)
    }
}

impl End for f32 {
    const INFINITY: Self = f32::INFINITY;
    const OF_REALS: bool = false;
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
        f32::abs(result) * 2e-6 + 1e-6
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

/// A bound within all formats of what is too large for a number.
const LARGE: f64 = 3e38;

/// Whether a number is one, and not NaN.
#[inline(always)]
#[expect(clippy::eq_op, reason = "NaN alone is not equal to itself")]
fn is_number<E: End>(v: E) -> bool {
    v == v
}

/// Noise over a box: its value in the middle, and no more than its slope allows on the way from
/// there; `slack` covers rounding. What the middle is rounded to does not matter.
#[inline(always)]
fn noise_around_middle<E: End>(
    p: V3<IntervalOf<E>>,
    seed: IntervalOf<E>,
    slack: f64,
) -> IntervalOf<E> {
    let middle = |i: IntervalOf<E>| (i.lo + i.hi) * lit(0.5);
    let centre = V3::of(middle(p.x), middle(p.y), middle(p.z));
    let half = |i: IntervalOf<E>, middle: E| (i.hi - middle).max(middle - i.lo);
    let (x, y, z) = (
        half(p.x, centre.x),
        half(p.y, centre.y),
        half(p.z, centre.z),
    );
    let way = (x * x + y * y + z * z).sqrt();
    let value = E::noise(centre, seed.lo);
    // Far out, the coordinates themselves are rounded to steps that count.
    let coarse = (centre.x.abs() + centre.y.abs() + centre.z.abs()) * lit(1e-6);
    let change = (way + coarse) * lit(NOISE_STEEPNESS) + lit(slack);
    let known = (seed.lo == seed.hi) & (change < E::INFINITY);
    let most = lit::<E>(1.5);
    IntervalOf {
        lo: E::select(known, (value - change).max(-most), -most),
        hi: E::select(known, (value + change).min(most), most),
    }
}

/// What is known of the noise's slopes anywhere.
#[inline(always)]
fn noise_slopes<E: End>() -> V3<IntervalOf<E>> {
    let slope = IntervalOf {
        lo: lit(-NOISE_SLOPE),
        hi: lit(NOISE_SLOPE),
    };
    V3::of(slope, slope, slope)
}

impl Interval {
    /// All numbers.
    pub const ALL: Self = Self {
        lo: f64::NEG_INFINITY,
        hi: f64::INFINITY,
    };
}

impl<E: End> IntervalOf<E> {
    /// The interval of one number.
    #[inline(always)]
    pub const fn point(v: E) -> Self {
        Self { lo: v, hi: v }
    }
    /// The interval between two numbers, in either order.
    #[inline(always)]
    pub fn between(a: E, b: E) -> Self {
        Self {
            lo: a.min(b),
            hi: a.max(b),
        }
    }
    /// The smallest interval that holds both.
    #[inline(always)]
    pub fn hull(self, other: Self) -> Self {
        Self {
            lo: self.lo.min(other.lo),
            hi: self.hi.max(other.hi),
        }
    }
    /// What both hold of one number, of which both are known to be bounds.
    #[inline(always)]
    fn common(self, other: Self) -> Self {
        Self {
            lo: self.lo.max(other.lo),
            hi: self.hi.min(other.hi),
        }
    }
    /// Whether `v` lies inside.
    #[inline(always)]
    pub fn contains(self, v: E) -> bool {
        self.lo <= v && v <= self.hi
    }
    /// The largest magnitude inside.
    #[inline(always)]
    pub fn magnitude(self) -> E {
        self.lo.abs().max(self.hi.abs())
    }
    /// Whether it is one number.
    #[inline(always)]
    fn is_point(self) -> bool {
        self.lo == self.hi
    }
    /// A random number of a cell: `v`, or any of a range where the cell is not known.
    #[inline(always)]
    fn random(v: E, [lo, hi]: [f64; 2], cell: V3<Self>, seed: Self) -> Self {
        let known = cell.x.is_point() & cell.y.is_point() & cell.z.is_point() & seed.is_point();
        Self {
            lo: E::select(known, v, lit(lo)),
            hi: E::select(known, v, lit(hi)),
        }
    }
    /// Rounded outwards; NaN becomes everything.
    #[inline(always)]
    fn widened(lo: E, hi: E) -> Self {
        let known = is_number(lo) & is_number(hi);
        Self {
            lo: E::select(known, lo.down(), -E::INFINITY),
            hi: E::select(known, hi.up(), E::INFINITY),
        }
    }
    /// Sums rounded outwards. One that is zero is exact: squares of boxes at the origin do not go below zero.
    #[inline(always)]
    fn summed(lo: E, hi: E) -> Self {
        let wide = Self::widened(lo, hi);
        let zero = lit::<E>(0.0);
        let known = is_number(lo) & is_number(hi);
        Self {
            lo: E::select(known & (lo == zero), zero, wide.lo),
            hi: E::select(known & (hi == zero), zero, wide.hi),
        }
    }
    /// The hull of four numbers, rounded outwards.
    #[inline(always)]
    fn of_four([a, b, c, d]: [E; 4]) -> Self {
        let known = is_number(a) & is_number(b) & is_number(c) & is_number(d);
        let (lo, hi) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        Self {
            lo: E::select(known, lo.down(), -E::INFINITY),
            hi: E::select(known, hi.up(), E::INFINITY),
        }
    }
    /// A monotonically increasing elementary function, widened by its error.
    #[inline(always)]
    fn increasing(self, f: impl Fn(E) -> E) -> Self {
        // What overflows is large: without a limit its error would be as large.
        let (lo, hi) = (f(self.lo).min(lit(LARGE)), f(self.hi).max(lit(-LARGE)));
        Self::widened(lo - E::exponential_error(lo), hi + E::exponential_error(hi))
    }
    /// The range of a wave over this interval of radians: a sine or cosine `f` whose crests are
    /// at `crest` and every full turn from there.
    #[inline(always)]
    fn wave(self, f: impl Fn(E) -> E, crest: f64) -> Self {
        use std::f64::consts::{PI, TAU};
        let error = E::trigonometric_error(self.magnitude());
        let (a, b) = (f(self.lo), f(self.hi));
        // A crest (or a trough) lies inside if one more of them is passed at the end than at the
        // start. One that rounding puts on the wrong side of an end is all but reached there.
        let passes = |phase: f64| {
            let turns = |x: E| ((x - lit(phase)) * lit(1.0 / TAU)).floor();
            turns(self.lo) < turns(self.hi)
        };
        let one = lit::<E>(1.0);
        // Comparisons with NaN fail: what is not known to be short is taken to be long.
        let short = (self.hi - self.lo < lit(TAU)) & (self.magnitude() < lit(1e5));
        let most = one + E::trigonometric_error(one);
        let lo = E::select(!short | passes(crest - PI), -most, a.min(b) - error);
        let hi = E::select(!short | passes(crest), most, a.max(b) + error);
        Self {
            lo: lo.max(-most),
            hi: hi.min(most),
        }
    }
}

impl<E: End> Add for IntervalOf<E> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::summed(self.lo + other.lo, self.hi + other.hi)
    }
}
impl<E: End> Sub for IntervalOf<E> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::summed(self.lo - other.hi, self.hi - other.lo)
    }
}
impl<E: End> Neg for IntervalOf<E> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            lo: -self.hi,
            hi: -self.lo,
        }
    }
}
impl<E: End> Mul for IntervalOf<E> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::of_four([
            product(self.lo, other.lo),
            product(self.lo, other.hi),
            product(self.hi, other.lo),
            product(self.hi, other.hi),
        ])
    }
}

/// 0 · ∞ is 0 here: the infinite end stands for "however large". (A function and not a closure,
/// which would not be compiled into each loop over lanes.)
#[inline(always)]
fn product<E: End>(a: E, b: E) -> E {
    let zero = lit::<E>(0.0);
    E::select((a == zero) | (b == zero), zero, a * b)
}
impl<E: End> Div for IntervalOf<E> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let zero = lit::<E>(0.0);
        let quotients = Self::of_four([
            self.lo / other.lo,
            self.lo / other.hi,
            self.hi / other.lo,
            self.hi / other.hi,
        ]);
        // A divisor from zero on up leaves a dividend's sign.
        let rising = (self.lo >= zero) & (other.lo >= zero) & (other.hi > zero);
        let whole = !((other.lo > zero) | (other.hi < zero));
        Self {
            lo: E::select(
                whole,
                E::select(rising, (self.lo / other.hi).down(), -E::INFINITY),
                quotients.lo,
            ),
            hi: E::select(whole, E::INFINITY, quotients.hi),
        }
    }
}

impl<E: End> Real for IntervalOf<E> {
    type Bool = Known;
    type Vec2 = crate::vector::V2<Self>;
    type Vec3 = V3<Self>;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::point(lit(value))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self {
            lo: self.lo.max(-self.hi).max(lit(0.0)),
            hi: self.hi.max(-self.lo),
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let zero = lit::<E>(0.0);
        Self {
            lo: self.lo.max(zero).sqrt().down().max(zero),
            hi: self.hi.max(zero).sqrt().up(),
        }
    }
    #[inline(always)]
    fn square(self) -> Self {
        let a = self.abs();
        Self {
            lo: (a.lo * a.lo).down().max(lit(0.0)),
            hi: (a.hi * a.hi).up(),
        }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self {
            lo: self.lo.floor(),
            hi: self.hi.floor(),
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self {
            lo: self.lo.min(other.lo),
            hi: self.hi.min(other.hi),
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self {
            lo: self.lo.max(other.lo),
            hi: self.hi.max(other.hi),
        }
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.wave(E::sin, std::f64::consts::FRAC_PI_2)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.wave(E::cos, 0.0)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        // Away from the cut along the negative x axis the angle is monotone along every edge of
        // the box, so its extremes lie at the corners.
        let zero = lit::<E>(0.0);
        let corners = Self::of_four([
            self.lo.atan2(x.lo),
            self.lo.atan2(x.hi),
            self.hi.atan2(x.lo),
            self.hi.atan2(x.hi),
        ]);
        let monotone = (x.lo > zero) | (self.lo > zero) | (self.hi < zero);
        let most = lit::<E>(std::f64::consts::PI);
        let error = E::trigonometric_error(lit(1.0));
        Self {
            lo: E::select(monotone, corners.lo, -most) - error,
            hi: E::select(monotone, corners.hi, most) + error,
        }
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        let e = self.increasing(E::exp2);
        Self {
            lo: e.lo.max(lit(0.0)),
            hi: e.hi,
        }
    }
    #[inline(always)]
    fn log2(self) -> Self {
        let range = self.increasing(E::log2);
        // Beyond all numbers, and of what is none, it may be anything.
        Self {
            lo: range.lo,
            hi: E::select(self.hi < E::INFINITY, range.hi, E::INFINITY),
        }
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.exp2()
    }
    #[inline(always)]
    fn exponent(self) -> Self {
        Self {
            lo: self.lo.exponent(),
            hi: self.hi.exponent(),
        }
    }
    #[inline(always)]
    fn mantissa(self) -> Self {
        Self {
            lo: lit(1.0),
            hi: lit(2.0),
        }
    }
    #[inline(always)]
    fn lattice(cell: V3<Self>, seed: Self) -> V3<Self> {
        let v = E::lattice(V3::of(cell.x.lo, cell.y.lo, cell.z.lo), seed.lo);
        let of = |v: E| Self::random(v, [-1.0, 1.0], cell, seed);
        V3::of(of(v.x), of(v.y), of(v.z))
    }
    #[inline(always)]
    fn lattice_edge(cell: V3<Self>, seed: Self) -> V3<Self> {
        let v = E::lattice_edge(V3::of(cell.x.lo, cell.y.lo, cell.z.lo), seed.lo);
        let of = |v: E, range| Self::random(v, range, cell, seed);
        V3::of(
            of(v.x, [1.0, 2.0]),
            of(v.y, [-1.0, 1.0]),
            of(v.z, [-1.0, 1.0]),
        )
    }
    #[inline(always)]
    fn ellipsoid_gradient(p: V3<Self>, r: V3<Self>) -> (Self, V3<Self>) {
        crate::ellipsoid::over(p, r)
    }
    fn noise_slope(p: V3<Self>, seed: Self) -> V3<Self> {
        <E as End>::noise_gradient(p, seed).1
    }
    /// Bounds that hold anywhere.
    fn noise_curvature(_: V3<Self>, _: Self) -> [V3<Self>; 3] {
        let any = IntervalOf {
            lo: lit(-NOISE_CURVATURE),
            hi: lit(NOISE_CURVATURE),
        };
        [V3::of(any, any, any); 3]
    }
    #[inline(always)]
    fn noise_gradient(p: V3<Self>, seed: Self) -> (Self, V3<Self>) {
        <E as End>::noise_gradient(p, seed)
    }
    #[inline(always)]
    fn jump_gradient(gradient: V3<Self>, condition: Known) -> V3<Self> {
        let either = |g: Self| Self {
            lo: E::select(condition.may & condition.may_not, -E::INFINITY, g.lo),
            hi: E::select(condition.may & condition.may_not, E::INFINITY, g.hi),
        };
        V3::of(either(gradient.x), either(gradient.y), either(gradient.z))
    }
    #[inline(always)]
    fn floor_gradient(floor: Self) -> V3<Self> {
        let zero = Self::point(lit(0.0));
        let flat = V3::of(zero, zero, zero);
        let apart = Known {
            may: !floor.is_point(),
            may_not: !floor.is_point(),
        };
        Self::jump_gradient(flat, apart)
    }
    #[inline(always)]
    fn fract(self) -> Self {
        let within = self.lo.floor() == self.hi.floor();
        let inside = self - self.floor();
        Self {
            lo: E::select(within, inside.lo, lit(0.0)),
            hi: E::select(within, inside.hi, lit(1.0)),
        }
    }
    #[inline(always)]
    fn mix(self, other: Self, t: Self) -> Self {
        let line = self + (other - self) * t;
        let is_between = E::OF_REALS & (lit::<E>(0.0) <= t.lo) & (t.hi <= lit(1.0));
        let error = E::distance_error(self.magnitude() + other.magnitude());
        let between = Self {
            lo: line.lo.max(self.lo.min(other.lo) - error),
            hi: line.hi.min(self.hi.max(other.hi) + error),
        };
        Self {
            lo: E::select(is_between, between.lo, line.lo),
            hi: E::select(is_between, between.hi, line.hi),
        }
    }
    #[inline(always)]
    fn smoothstep(self, low: Self, high: Self) -> Self {
        let t = Self::ramp(self, low, high);
        if !E::OF_REALS {
            return eased(t);
        }
        // It rises with `t`, but for rounding.
        let error = E::distance_error(lit(1.0));
        Self {
            lo: (eased(t.lo) - error).max(lit(0.0)),
            hi: (eased(t.hi) + error).min(lit(1.0)),
        }
    }
    #[inline(always)]
    fn modulo(self, divisor: Self) -> Self {
        let whole = (self / divisor).floor();
        let rest = self - divisor * whole;
        let error = E::distance_error(self.magnitude() + divisor.magnitude());
        let has_sign = E::OF_REALS & (lit::<E>(0.0).less(divisor.lo) | divisor.hi.less(lit(0.0)));
        // The rest has the sign of the divisor, and is less.
        let least = divisor.lo.min(lit(0.0)) - error;
        let most = divisor.hi.max(lit(0.0)) + error;
        Self {
            lo: E::select(has_sign, rest.lo.max(least), rest.lo),
            hi: E::select(has_sign, rest.hi.min(most), rest.hi),
        }
    }
    #[inline(always)]
    fn unit_component(self) -> Self {
        self.clamp(lit(-1.0), lit(1.0))
    }
    #[inline(always)]
    fn less(self, other: Self) -> Known {
        // Comparisons with NaN fail, and then nothing is known.
        let never = self.lo >= other.hi;
        let always = self.hi < other.lo;
        Known {
            may: !never,
            may_not: !always,
        }
    }
    #[inline(always)]
    fn and(a: Known, b: Known) -> Known {
        Known {
            may: a.may & b.may,
            may_not: a.may_not | b.may_not,
        }
    }
    #[inline(always)]
    fn or(a: Known, b: Known) -> Known {
        Known {
            may: a.may | b.may,
            may_not: a.may_not & b.may_not,
        }
    }
    #[inline(always)]
    fn not(a: Known) -> Known {
        Known {
            may: a.may_not,
            may_not: a.may,
        }
    }
    #[inline(always)]
    fn select(condition: Known, then: Self, otherwise: Self) -> Self {
        let both = then.hull(otherwise);
        let sure = Self {
            lo: E::select(condition.may_not, both.lo, then.lo),
            hi: E::select(condition.may_not, both.hi, then.hi),
        };
        Self {
            lo: E::select(condition.may, sure.lo, otherwise.lo),
            hi: E::select(condition.may, sure.hi, otherwise.hi),
        }
    }
}

/// A bound of the noise's slope along an axis, where it can be as steep as in any direction.
pub const NOISE_SLOPE: f64 = NOISE_STEEPNESS;

/// A bound of each second derivative of the noise, whatever the hash: if each corner of a cell had the direction
/// that is worst for a place, they would reach 8.5.
pub const NOISE_CURVATURE: f64 = 9.0;

/// A bound of the length of the noise's gradient, whatever the hash: in the middle of a cell it
/// could be 2.652, and a test proves that it is nowhere more than this.
pub const NOISE_STEEPNESS: f64 = 2.68;
