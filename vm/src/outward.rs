//! Interval arithmetic for devices: bounds for what *any* device gives that computes as WGSL demands.
//!
//! [`crate::interval`] knows how its numbers are rounded, and has an infinity. Here neither is known:
//! every result is rounded outwards by a share of itself, and an end that is beyond what is told apart
//! ([`KNOWN`]) becomes one that stands for any number ([`ANY`]). No operation is given numbers that
//! overflow or have no result, since devices need not know infinity or NaN. The functions are bodies
//! over [`Real`]: the [recorder](crate::record) makes WGSL of them, tests run them on the CPU.
//!
//! # Why these shares
//! A bound has to hold for a value that is rounded, and is rounded itself: twice what WGSL and Vulkan
//! allow an operation, and one unit in the last place (1.2e-7 at most) for widening.
//!
//! | operation | allowed | share |
//! |---|---|---|
//! | sum, difference, product | either neighbour: 1 unit | 4e-7 |
//! | quotient | 2.5 units | 8e-7 |
//! | square root | as 1 / `inverseSqrt`: 2 and 2.5 units | 1.4e-6 |
//! | length | a root of three squares and two sums | 2e-6 |
//! | a row of a matrix | three products and three sums, of their magnitudes | 1.3e-6 |
//!
//! What is fused is rounded less often, and lies between the same bounds. Numbers that are not normal
//! may be taken for zero, which a tiny number allows for.

use crate::ellipsoid::between;
use crate::interval::NOISE_STEEPNESS;
use crate::real::{Real, Vector3, lit};

/// Ends of larger magnitude are not told apart. Products of known ends are far from overflowing.
pub const KNOWN: f64 = 1e17;

/// The magnitude of an end that may be any number.
pub const ANY: f64 = 1e18;

/// Divisors this near to zero may be zero: quotients of known ends by others do not overflow.
const LEAST_DIVISOR: f64 = 1e-18;

/// More than the smallest normal number.
const TINY: f64 = 1e-37;

/// More than the root of the sum of three squares that are not normal.
const TINY_ROOT: f64 = 1e-18;

const SUM: f64 = 4e-7;
const QUOTIENT: f64 = 8e-7;
const ROOT: f64 = 1.4e-6;
const LENGTH: f64 = 2e-6;
const ROW: f64 = 1.3e-6;

/// How far sine, cosine and angle may be off, for arguments up to some magnitude: twice what
/// [`crate::interval`] allows for.
const TRIGONOMETRIC: [f64; 2] = [2e-6, 4e-7];

/// How far exponential and logarithm may be off, and for which share of the result.
const EXPONENTIAL: [f64; 2] = [2e-6, 4e-6];

/// How far noise may be off.
const NOISE: f64 = 2e-5;

/// How far the distance to an ellipsoid may be off, as a fraction of coordinates and radii.
const DISTANCE: f64 = 4e-6;

/// All numbers from `low` to `high`.
#[derive(Clone, Copy, Debug)]
pub struct Ends<R> {
    /// No number is smaller; −[`ANY`] where that is not known.
    pub low: R,
    /// No number is larger; [`ANY`] where that is not known.
    pub high: R,
}

/// What is known of a comparison.
#[derive(Clone, Copy, Debug)]
pub struct Known<B> {
    /// It may hold for some numbers.
    pub may: B,
    /// It may fail for some.
    pub may_not: B,
}

impl<R: Real> Ends<R> {
    /// All numbers.
    pub fn everything() -> Self {
        Self {
            low: lit(-ANY),
            high: lit(ANY),
        }
    }

    /// The largest magnitude.
    fn magnitude(self) -> R {
        self.low.abs().max(self.high.abs())
    }

    /// These where the condition holds, `otherwise` elsewhere.
    fn or_else(self, holds: R::Bool, otherwise: Self) -> Self {
        Self {
            low: R::select(holds, self.low, otherwise.low),
            high: R::select(holds, self.high, otherwise.high),
        }
    }
}

/// Whether an end of no greater magnitude than this is known.
fn is_known<R: Real>(magnitude: R) -> R::Bool {
    R::not(lit::<R>(KNOWN).less(magnitude))
}

/// The ends, with those that are not told apart as what stands for any number.
fn told<R: Real>(low: R, high: R) -> Ends<R> {
    let (least, most) = (lit::<R>(-KNOWN), lit::<R>(KNOWN));
    Ends {
        low: R::select(low.less(least), lit(-ANY), low.min(most)),
        high: R::select(most.less(high), lit(ANY), high.max(least)),
    }
}

/// Rounded outwards by a share of each end.
fn outwards<R: Real>(low: R, high: R, share: f64) -> Ends<R> {
    let by = |end: R| end.abs() * lit(share) + lit(TINY);
    told(low - by(low), high + by(high))
}

/// The sum. An end that is not known stays so, since [`ANY`] is much larger than [`KNOWN`]; what a scene
/// gives may be larger than both.
pub fn add<R: Real>(a: Ends<R>, b: Ends<R>) -> Ends<R> {
    let (least, most) = (lit::<R>(-KNOWN), lit::<R>(KNOWN));
    let low = a.low.min(most) + b.low.min(most);
    outwards(low, a.high.max(least) + b.high.max(least), SUM)
}

/// The difference.
pub fn sub<R: Real>(a: Ends<R>, b: Ends<R>) -> Ends<R> {
    let negative = Ends {
        low: -b.high,
        high: -b.low,
    };
    add(a, negative)
}

/// The product.
pub fn mul<R: Real>(a: Ends<R>, b: Ends<R>) -> Ends<R> {
    let (p, q) = (a.low * b.low, a.low * b.high);
    let (r, s) = (a.high * b.low, a.high * b.high);
    let product = outwards(p.min(q).min(r.min(s)), p.max(q).max(r.max(s)), SUM);
    let known = is_known(a.magnitude().max(b.magnitude()));
    product.or_else(known, Ends::everything())
}

/// The product with one number. That with 1 or −1 is exact.
pub fn scale<R: Real>(a: Ends<R>, factor: R) -> Ends<R> {
    let falls = factor.less(lit(0.0));
    let from = Ends {
        low: R::select(falls, a.high, a.low),
        high: R::select(falls, a.low, a.high),
    };
    let exact = Ends {
        low: from.low * factor,
        high: from.high * factor,
    };
    let rounded = outwards(exact.low, exact.high, SUM);
    let size = factor.abs();
    let is_sign = R::not(R::or(size.less(lit(1.0)), lit::<R>(1.0).less(size)));
    let known = |end: R| is_known(end.abs().max(size));
    let scaled = Ends {
        low: R::select(known(from.low), rounded.low, lit(-ANY)),
        high: R::select(known(from.high), rounded.high, lit(ANY)),
    };
    exact.or_else(is_sign, scaled)
}

/// The quotient.
pub fn div<R: Real>(a: Ends<R>, b: Ends<R>) -> Ends<R> {
    let (zero, least) = (lit::<R>(0.0), lit::<R>(LEAST_DIVISOR));
    let apart = R::or(R::not(b.low.less(least)), R::not((-least).less(b.high)));
    // Never the quotient of a number by zero, even where it is not used.
    let by = Ends {
        low: R::select(apart, b.low, lit(1.0)),
        high: R::select(apart, b.high, lit(1.0)),
    };
    let (p, q) = (a.low / by.low, a.low / by.high);
    let (r, s) = (a.high / by.low, a.high / by.high);
    let quotient = outwards(p.min(q).min(r.min(s)), p.max(q).max(r.max(s)), QUOTIENT);
    let known = is_known(a.magnitude().max(b.magnitude()));
    // A divisor from zero on up leaves a dividend's sign, and the smallest quotient is by the largest.
    let rises = R::not(R::or(a.low.less(zero), b.low.less(zero)));
    let smallest = a.low / b.high.max(least);
    let smallest = (smallest - (smallest * lit(QUOTIENT) + lit(TINY))).max(zero);
    let above = R::select(is_known(b.high), smallest.min(lit(KNOWN)), zero);
    let unknown = Ends {
        low: R::select(rises, above, lit(-ANY)),
        high: lit(ANY),
    };
    quotient.or_else(R::and(apart, known), unknown)
}

/// The magnitude.
pub fn abs<R: Real>(a: Ends<R>) -> Ends<R> {
    Ends {
        low: a.low.max(-a.high).max(lit(0.0)),
        high: a.high.max(-a.low),
    }
}

/// The number times itself.
pub fn square<R: Real>(a: Ends<R>) -> Ends<R> {
    let a = abs(a);
    let square = outwards(a.low * a.low, a.high * a.high, SUM);
    Ends {
        low: square.low.max(lit(0.0)),
        high: square.high,
    }
}

/// The square root; negative numbers count as zero.
pub fn sqrt<R: Real>(a: Ends<R>) -> Ends<R> {
    let zero = lit::<R>(0.0);
    let root = outwards(a.low.max(zero).sqrt(), a.high.max(zero).sqrt(), ROOT);
    Ends {
        low: root.low.max(zero),
        high: R::select(is_known(a.high), root.high, lit(ANY)),
    }
}

/// The length of a vector with these components.
pub fn length<R: Real, const N: usize>(components: [Ends<R>; N]) -> Ends<R> {
    let zero = lit::<R>(0.0);
    let squares = components.map(abs);
    let sum = |end: fn(&Ends<R>) -> R| {
        let mut ends = squares.iter().map(end);
        let first = ends.next().map_or(zero, |x| x * x);
        ends.fold(first, |sum, x| sum + x * x).sqrt()
    };
    // A component that is not known makes the length larger than what is.
    let (low, high) = (sum(|a| a.low), sum(|a| a.high));
    let by = |end: R| end * lit(LENGTH) + lit(TINY_ROOT);
    let length = told(low - by(low), high + by(high));
    Ends {
        low: length.low.max(zero),
        high: length.high,
    }
}

/// What lies above the largest whole number that is not larger.
pub fn fract<R: Real>(a: Ends<R>) -> Ends<R> {
    let (floor, ceiling) = (a.low.floor(), a.high.floor());
    let inside = sub(
        a,
        Ends {
            low: floor,
            high: ceiling,
        },
    );
    let whole = Ends {
        low: lit(0.0),
        high: lit(1.0),
    };
    inside.or_else(R::not(floor.less(ceiling)), whole)
}

/// The sine of an angle in radians.
pub fn sin<R: Real>(a: Ends<R>) -> Ends<R> {
    wave(a, R::sin, std::f64::consts::FRAC_PI_2)
}

/// The cosine of an angle in radians.
pub fn cos<R: Real>(a: Ends<R>) -> Ends<R> {
    wave(a, R::cos, 0.0)
}

/// A sine or cosine `f`, whose crests are at `crest` and every full turn from there.
fn wave<R: Real>(a: Ends<R>, f: fn(R) -> R, crest: f64) -> Ends<R> {
    use std::f64::consts::{PI, TAU};
    let [least, share] = TRIGONOMETRIC;
    let size = a.magnitude();
    let error = size * lit(share) + lit(least);
    let (first, last) = (f(a.low), f(a.high));
    // A crest (or a trough) lies inside if one more of them is passed at the end than at the start;
    // the slack errs on the side of a wider range.
    let passes = |phase: f64| {
        let turns = |x: R, slack: R| ((x - lit(phase)) * lit(1.0 / TAU) + slack).floor();
        turns(a.low, -error).less(turns(a.high, error))
    };
    let short = R::and((a.high - a.low).less(lit(TAU)), size.less(lit(1e5)));
    let whole = |phase: f64| R::or(R::not(short), passes(phase));
    let most = lit::<R>(1.0 + 2.0 * least);
    let low = R::select(whole(crest - PI), -most, first.min(last) - error);
    let high = R::select(whole(crest), most, first.max(last) + error);
    Ends {
        low: low.max(-most),
        high: high.min(most),
    }
}

/// The angle of the vectors (`x`, `y`), in [-π, π].
pub fn atan2<R: Real>(y: Ends<R>, x: Ends<R>) -> Ends<R> {
    // Away from the cut along the negative x axis the angle is monotone along every edge of the box, so
    // its extremes lie at the corners.
    let zero = lit::<R>(0.0);
    let (a, b) = (y.low.atan2(x.low), y.low.atan2(x.high));
    let (c, d) = (y.high.atan2(x.low), y.high.atan2(x.high));
    let aside = R::or(zero.less(y.low), y.high.less(zero));
    let monotone = R::and(
        R::or(zero.less(x.low), aside),
        is_known(x.magnitude().max(y.magnitude())),
    );
    let corners = Ends {
        low: a.min(b).min(c.min(d)),
        high: a.max(b).max(c.max(d)),
    };
    let whole = Ends {
        low: lit(-std::f64::consts::PI),
        high: lit(std::f64::consts::PI),
    };
    let ends = corners.or_else(monotone, whole);
    let error = lit::<R>(TRIGONOMETRIC[0] + TRIGONOMETRIC[1]);
    Ends {
        low: ends.low - error,
        high: ends.high + error,
    }
}

/// Two to the power of the number.
pub fn exp2<R: Real>(a: Ends<R>) -> Ends<R> {
    let power = increasing(a, R::exp2);
    Ends {
        low: power.low.max(lit(0.0)),
        high: power.high,
    }
}

/// The logarithm to base two.
pub fn log2<R: Real>(a: Ends<R>) -> Ends<R> {
    let logarithm = increasing(a, R::log2);
    Ends {
        low: logarithm.low,
        high: R::select(is_known(a.high), logarithm.high, lit(ANY)),
    }
}

/// A function that increases.
fn increasing<R: Real>(a: Ends<R>, f: fn(R) -> R) -> Ends<R> {
    let [least, share] = EXPONENTIAL;
    let by = |end: R| end.abs() * lit(share) + lit(least);
    let (low, high) = (f(a.low), f(a.high));
    told(low - by(low), high + by(high))
}

/// Noise over a box: its value in the middle, and no more than its slope allows on the way from there.
/// What the middle is rounded to does not matter.
pub fn noise<R: Real>(p: [Ends<R>; 3], seed: R) -> Ends<R> {
    let middles = p.map(|axis| (axis.low + axis.high) * lit(0.5));
    let [x, y, z] = middles;
    let mut way = [lit::<R>(0.0); 3];
    for ((way, axis), middle) in way.iter_mut().zip(p).zip(middles) {
        *way = (axis.high - middle).max(middle - axis.low);
    }
    let way = R::length3(way[0], way[1], way[2]);
    let value = R::noise(R::Vec3::new(x, y, z), seed);
    // Far out, the coordinates themselves are rounded to steps that count.
    let coarse = (x.abs() + y.abs() + z.abs()) * lit(2e-6);
    let change = (way + coarse) * lit(NOISE_STEEPNESS * 1.001) + lit(NOISE);
    let most = lit::<R>(1.5);
    // Of what is not known the way is far, too.
    Ends {
        low: (value - change).max(-most),
        high: (value + change).min(most),
    }
}

/// The distance to an ellipsoid with the radii `r` over a box.
pub fn ellipsoid<R: Real>(p: [Ends<R>; 3], r: R::Vec3) -> Ends<R> {
    let magnitudes = p.map(abs);
    let [x, y, z] = magnitudes.map(|axis| axis.low.max(lit(0.0)).min(lit(KNOWN)));
    let near = R::Vec3::new(x, y, z);
    let [x, y, z] = magnitudes.map(|axis| axis.high.min(lit(KNOWN)));
    let far = R::Vec3::new(x, y, z);
    let error = (far.max_component() + r.max_component()) * lit(DISTANCE);
    let [low, high] = between::<R>(near, far, r, error);
    // What is farther than is told apart may be anywhere.
    let is_known = far.max_component().less(lit(KNOWN));
    told(low, R::select(is_known, high, lit(ANY)))
}

/// Whether the first is smaller. Of ends that are not told apart, that is not known.
pub fn less<R: Real>(a: Ends<R>, b: Ends<R>) -> Known<R::Bool> {
    let (least, most) = (lit::<R>(-KNOWN), lit::<R>(KNOWN));
    Known {
        may: a.low.min(most).less(b.high.max(least)),
        may_not: R::not(a.high.max(least).less(b.low.min(most))),
    }
}

/// The first where the condition holds, the second elsewhere.
pub fn select<R: Real>(condition: Known<R::Bool>, then: Ends<R>, otherwise: Ends<R>) -> Ends<R> {
    let both = Ends {
        low: then.low.min(otherwise.low),
        high: then.high.max(otherwise.high),
    };
    both.or_else(condition.may_not, then)
        .or_else(condition.may, otherwise)
}

/// A box of points through a matrix, given by its columns, and a shift.
pub fn mapped<R: Real>(p: [Ends<R>; 3], columns: [R::Vec3; 3], shift: R::Vec3) -> [Ends<R>; 3] {
    let (mut low, mut high) = (shift, shift);
    let mut size = shift.abs();
    let mut farthest = lit::<R>(0.0);
    for (axis, column) in p.into_iter().zip(columns) {
        let (a, b) = (column * axis.low, column * axis.high);
        let magnitude = axis.magnitude();
        low = low + a.min(b);
        high = high + a.max(b);
        size = size + column.abs() * magnitude;
        farthest = farthest.max(magnitude);
    }
    let by = size * lit::<R>(ROW) + R::Vec3::splat(lit(TINY));
    let (low, high) = (low - by, high + by);
    let known = is_known(farthest);
    let component = |low: R, high: R| told(low, high).or_else(known, Ends::everything());
    [
        component(low.x(), high.x()),
        component(low.y(), high.y()),
        component(low.z(), high.z()),
    ]
}
