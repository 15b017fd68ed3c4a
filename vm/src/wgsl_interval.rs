//! Interval arithmetic under WGSL's accuracy rules: bounds for the results of *any* conforming device.
//!
//! [`crate::interval`] relies on known rounding and on infinity. Neither is available here: every result is
//! widened by a relative error. Endpoints whose magnitude exceeds [`MAX_BOUNDED`] are replaced by
//! [`UNBOUNDED`], which represents ±∞. No operation receives numbers that overflow or have no result, since
//! devices need not support infinity or NaN. The functions are bodies over [`Real`]: the
//! [recorder](crate::record) turns them into WGSL, and tests run them on the CPU.
//!
//! # Relative errors
//! A bound is computed with rounding, and it must hold for a value that is rounded as well. So each relative
//! error is twice what WGSL and Vulkan allow an operation. The widening itself adds one unit in the last
//! place (at most 1.2e-7).
//!
//! | operation | allowed | relative error |
//! |---|---|---|
//! | sum, difference, product | either neighbour: 1 unit | 4e-7 |
//! | quotient | 2.5 units | 8e-7 |
//! | square root | as 1 / `inverseSqrt`: 2 and 2.5 units | 1.4e-6 |
//! | length | a root of three squares and two sums | 2e-6 |
//! | a row of a matrix | three products and three sums, of their magnitudes | 1.3e-6 |
//!
//! Fused operations round less often, and stay within the same bounds. Denormal numbers may be flushed to
//! zero, which a tiny absolute error covers.

use crate::ellipsoid::bounds_between;
use crate::interval::MAX_NOISE_STEEPNESS;
use crate::real::{Real, Vector3, lit};

/// The largest magnitude of a bounded end. Products of bounded ends are far from overflowing.
pub const MAX_BOUNDED: f64 = 1e17;

/// The magnitude of an unbounded end.
pub const UNBOUNDED: f64 = 1e18;

/// Smaller divisors count as zero, so that quotients of bounded ends do not overflow.
const MIN_DIVISOR: f64 = 1e-18;

/// An absolute error above the smallest normal number.
const MIN_ERROR: f64 = 1e-37;

/// An absolute error above the root of the sum of three denormal squares.
const MIN_LENGTH_ERROR: f64 = 1e-18;

const SUM_ERROR: f64 = 4e-7;
const QUOTIENT_ERROR: f64 = 8e-7;
const ROOT_ERROR: f64 = 1.4e-6;
const LENGTH_ERROR: f64 = 2e-6;
const ROW_ERROR: f64 = 1.3e-6;

/// Errors of sine, cosine and angle: an absolute one, and one per unit of the argument's magnitude. Both
/// are twice those in [`crate::interval`].
const TRIGONOMETRIC_ERRORS: [f64; 2] = [2e-6, 4e-7];

/// Errors of the exponential: an absolute and a relative one. The absolute one covers results that are flushed to
/// zero.
const EXPONENTIAL_ERRORS: [f64; 2] = [2.4e-38, 4e-6];

/// Errors of the logarithm: an absolute and a relative one.
const LOGARITHM_ERRORS: [f64; 2] = [2e-6, 4e-6];

/// The absolute error of noise.
const NOISE_ERROR: f64 = 2e-5;

/// The error of the distance to an ellipsoid, as a fraction of coordinates and radii.
const DISTANCE_ERROR: f64 = 4e-6;

/// All numbers from `low` to `high`.
#[derive(Clone, Copy, Debug)]
pub struct WgslInterval<R> {
    /// The lower end; −[`UNBOUNDED`] if there is none.
    pub low: R,
    /// The upper end; [`UNBOUNDED`] if there is none.
    pub high: R,
}

/// The three-valued result of a comparison.
#[derive(Clone, Copy, Debug)]
pub struct WgslTristate<B> {
    /// Set if it may hold for some numbers.
    pub can_be_true: B,
    /// Set if it may fail for some numbers.
    pub can_be_false: B,
}

impl<R: Real> WgslInterval<R> {
    /// Returns the interval of all numbers.
    pub fn unbounded() -> Self {
        Self {
            low: lit(-UNBOUNDED),
            high: lit(UNBOUNDED),
        }
    }

    /// Returns the largest magnitude.
    fn magnitude(self) -> R {
        self.low.abs().max(self.high.abs())
    }

    /// Returns this interval where the condition holds, `otherwise` elsewhere.
    fn select(self, holds: R::Bool, otherwise: Self) -> Self {
        Self {
            low: R::select(holds, self.low, otherwise.low),
            high: R::select(holds, self.high, otherwise.high),
        }
    }
}

/// Reports whether an end of this magnitude is bounded.
fn is_bounded<R: Real>(magnitude: R) -> R::Bool {
    R::not(lit::<R>(MAX_BOUNDED).less(magnitude))
}

/// Creates an interval, with ends beyond [`MAX_BOUNDED`] replaced by unbounded ones.
fn saturate_unbounded<R: Real>(low: R, high: R) -> WgslInterval<R> {
    let (least, limit) = (lit::<R>(-MAX_BOUNDED), lit::<R>(MAX_BOUNDED));
    WgslInterval {
        low: R::select(low.less(least), lit(-UNBOUNDED), low.min(limit)),
        high: R::select(limit.less(high), lit(UNBOUNDED), high.max(least)),
    }
}

/// Creates an interval, widened by this relative error of each end.
fn outwards<R: Real>(low: R, high: R, relative_error: f64) -> WgslInterval<R> {
    let by = |end: R| end.abs() * lit(relative_error) + lit(MIN_ERROR);
    saturate_unbounded(low - by(low), high + by(high))
}

/// Returns the sum. Unbounded ends stay unbounded, since [`UNBOUNDED`] is much larger than [`MAX_BOUNDED`].
/// A scene's numbers may be larger than both.
pub fn add<R: Real>(a: WgslInterval<R>, b: WgslInterval<R>) -> WgslInterval<R> {
    let (least, limit) = (lit::<R>(-MAX_BOUNDED), lit::<R>(MAX_BOUNDED));
    let low = a.low.min(limit) + b.low.min(limit);
    outwards(low, a.high.max(least) + b.high.max(least), SUM_ERROR)
}

/// Returns the difference.
pub fn sub<R: Real>(a: WgslInterval<R>, b: WgslInterval<R>) -> WgslInterval<R> {
    let negative = WgslInterval {
        low: -b.high,
        high: -b.low,
    };
    add(a, negative)
}

/// Returns the product.
pub fn mul<R: Real>(a: WgslInterval<R>, b: WgslInterval<R>) -> WgslInterval<R> {
    let (p, q) = (a.low * b.low, a.low * b.high);
    let (r, s) = (a.high * b.low, a.high * b.high);
    let product = outwards(p.min(q).min(r.min(s)), p.max(q).max(r.max(s)), SUM_ERROR);
    let bounded = is_bounded(a.magnitude().max(b.magnitude()));
    product.select(bounded, WgslInterval::unbounded())
}

/// Returns the product with one number. Products with 1 or −1 are exact.
pub fn scale<R: Real>(a: WgslInterval<R>, factor: R) -> WgslInterval<R> {
    let falls = factor.less(lit(0.0));
    let from = WgslInterval {
        low: R::select(falls, a.high, a.low),
        high: R::select(falls, a.low, a.high),
    };
    let exact = WgslInterval {
        low: from.low * factor,
        high: from.high * factor,
    };
    let rounded = outwards(exact.low, exact.high, SUM_ERROR);
    let size = factor.abs();
    let is_sign = R::not(R::or(size.less(lit(1.0)), lit::<R>(1.0).less(size)));
    let bounded = |end: R| is_bounded(end.abs().max(size));
    let scaled = WgslInterval {
        low: R::select(bounded(from.low), rounded.low, lit(-UNBOUNDED)),
        high: R::select(bounded(from.high), rounded.high, lit(UNBOUNDED)),
    };
    exact.select(is_sign, scaled)
}

/// Returns the quotient.
pub fn div<R: Real>(a: WgslInterval<R>, b: WgslInterval<R>) -> WgslInterval<R> {
    let (zero, least) = (lit::<R>(0.0), lit::<R>(MIN_DIVISOR));
    let nonzero = R::or(R::not(b.low.less(least)), R::not((-least).less(b.high)));
    // Avoids a division by zero even where its result is not used.
    let by = WgslInterval {
        low: R::select(nonzero, b.low, lit(1.0)),
        high: R::select(nonzero, b.high, lit(1.0)),
    };
    let (p, q) = (a.low / by.low, a.low / by.high);
    let (r, s) = (a.high / by.low, a.high / by.high);
    let quotient = outwards(
        p.min(q).min(r.min(s)),
        p.max(q).max(r.max(s)),
        QUOTIENT_ERROR,
    );
    let bounded = is_bounded(a.magnitude().max(b.magnitude()));
    // A non-negative divisor keeps the sign of the dividend, and the largest divisor gives the smallest
    // quotient.
    let rises = R::not(R::or(a.low.less(zero), b.low.less(zero)));
    let smallest = a.low / b.high.max(least);
    let smallest = (smallest - (smallest * lit(QUOTIENT_ERROR) + lit(MIN_ERROR))).max(zero);
    let above = R::select(is_bounded(b.high), smallest.min(lit(MAX_BOUNDED)), zero);
    let unknown = WgslInterval {
        low: R::select(rises, above, lit(-UNBOUNDED)),
        high: lit(UNBOUNDED),
    };
    quotient.select(R::and(nonzero, bounded), unknown)
}

/// Returns the magnitude.
pub fn abs<R: Real>(a: WgslInterval<R>) -> WgslInterval<R> {
    WgslInterval {
        low: a.low.max(-a.high).max(lit(0.0)),
        high: a.high.max(-a.low),
    }
}

/// Returns the square.
pub fn square<R: Real>(a: WgslInterval<R>) -> WgslInterval<R> {
    let a = abs(a);
    let square = outwards(a.low * a.low, a.high * a.high, SUM_ERROR);
    WgslInterval {
        low: square.low.max(lit(0.0)),
        high: square.high,
    }
}

/// Returns the square root; negative numbers count as zero.
pub fn sqrt<R: Real>(a: WgslInterval<R>) -> WgslInterval<R> {
    let zero = lit::<R>(0.0);
    let root = outwards(a.low.max(zero).sqrt(), a.high.max(zero).sqrt(), ROOT_ERROR);
    WgslInterval {
        low: root.low.max(zero),
        high: R::select(is_bounded(a.high), root.high, lit(UNBOUNDED)),
    }
}

/// Returns the length of a vector with these components.
pub fn length<R: Real, const N: usize>(components: [WgslInterval<R>; N]) -> WgslInterval<R> {
    let zero = lit::<R>(0.0);
    let squares = components.map(abs);
    let sum = |end: fn(&WgslInterval<R>) -> R| {
        let mut ends = squares.iter().map(end);
        let first = ends.next().map_or(zero, |x| x * x);
        ends.fold(first, |sum, x| sum + x * x).sqrt()
    };
    // An unbounded component makes the length exceed `MAX_BOUNDED`.
    let (low, high) = (sum(|a| a.low), sum(|a| a.high));
    let by = |end: R| end * lit(LENGTH_ERROR) + lit(MIN_LENGTH_ERROR);
    let length = saturate_unbounded(low - by(low), high + by(high));
    WgslInterval {
        low: length.low.max(zero),
        high: length.high,
    }
}

/// Returns the fractional part.
pub fn fract<R: Real>(a: WgslInterval<R>) -> WgslInterval<R> {
    let (floor, ceiling) = (a.low.floor(), a.high.floor());
    let inside = sub(
        a,
        WgslInterval {
            low: floor,
            high: ceiling,
        },
    );
    let full_range = WgslInterval {
        low: lit(0.0),
        high: lit(1.0),
    };
    inside.select(R::not(floor.less(ceiling)), full_range)
}

/// Returns the sine of an angle in radians.
pub fn sin<R: Real>(a: WgslInterval<R>) -> WgslInterval<R> {
    wave(a, R::sin, std::f64::consts::FRAC_PI_2)
}

/// Returns the cosine of an angle in radians.
pub fn cos<R: Real>(a: WgslInterval<R>) -> WgslInterval<R> {
    wave(a, R::cos, 0.0)
}

/// Returns a sine or cosine `f` whose maxima are at `crest` and every full turn from there.
fn wave<R: Real>(a: WgslInterval<R>, f: fn(R) -> R, crest: f64) -> WgslInterval<R> {
    use std::f64::consts::{PI, TAU};
    let [least, relative_error] = TRIGONOMETRIC_ERRORS;
    let size = a.magnitude();
    let error = size * lit(relative_error) + lit(least);
    let (first, last) = (f(a.low), f(a.high));
    // A crest (or a trough) lies inside if the end has passed one more of them than the start. The slack can
    // only widen the range.
    let passes = |phase: f64| {
        let turns = |x: R, slack: R| ((x - lit(phase)) * lit(1.0 / TAU) + slack).floor();
        turns(a.low, -error).less(turns(a.high, error))
    };
    let short = R::and((a.high - a.low).less(lit(TAU)), size.less(lit(1e5)));
    let covers_extremum = |phase: f64| R::or(R::not(short), passes(phase));
    let limit = lit::<R>(1.0 + 2.0 * least);
    let low = R::select(covers_extremum(crest - PI), -limit, first.min(last) - error);
    let high = R::select(covers_extremum(crest), limit, first.max(last) + error);
    WgslInterval {
        low: low.max(-limit),
        high: high.min(limit),
    }
}

/// Returns the angle of the vectors (`x`, `y`), in [-π, π].
pub fn atan2<R: Real>(y: WgslInterval<R>, x: WgslInterval<R>) -> WgslInterval<R> {
    // Away from the cut along the negative x axis, the angle is monotone along every edge of the box. So
    // its extremes lie at the corners.
    let zero = lit::<R>(0.0);
    let (a, b) = (y.low.atan2(x.low), y.low.atan2(x.high));
    let (c, d) = (y.high.atan2(x.low), y.high.atan2(x.high));
    let aside = R::or(zero.less(y.low), y.high.less(zero));
    let monotone = R::and(
        R::or(zero.less(x.low), aside),
        is_bounded(x.magnitude().max(y.magnitude())),
    );
    let corners = WgslInterval {
        low: a.min(b).min(c.min(d)),
        high: a.max(b).max(c.max(d)),
    };
    let full_range = WgslInterval {
        low: lit(-std::f64::consts::PI),
        high: lit(std::f64::consts::PI),
    };
    let ends = corners.select(monotone, full_range);
    let error = lit::<R>(TRIGONOMETRIC_ERRORS[0] + TRIGONOMETRIC_ERRORS[1]);
    WgslInterval {
        low: ends.low - error,
        high: ends.high + error,
    }
}

/// Returns two to the power of the number.
pub fn exp2<R: Real>(a: WgslInterval<R>) -> WgslInterval<R> {
    let power = increasing(a, R::exp2, EXPONENTIAL_ERRORS);
    WgslInterval {
        low: power.low.max(lit(0.0)),
        high: power.high,
    }
}

/// Returns the logarithm to base two.
pub fn log2<R: Real>(a: WgslInterval<R>) -> WgslInterval<R> {
    let logarithm = increasing(a, R::log2, LOGARITHM_ERRORS);
    WgslInterval {
        low: logarithm.low,
        high: R::select(is_bounded(a.high), logarithm.high, lit(UNBOUNDED)),
    }
}

/// Evaluates an increasing function, widened by an absolute and a relative error.
fn increasing<R: Real>(
    a: WgslInterval<R>,
    f: fn(R) -> R,
    [least, relative_error]: [f64; 2],
) -> WgslInterval<R> {
    let by = |end: R| end.abs() * lit(relative_error) + lit(least);
    let (low, high) = (f(a.low), f(a.high));
    saturate_unbounded(low - by(low), high + by(high))
}

/// Bounds noise over a box: its value at the centre, plus or minus the largest change that its slope bound
/// allows. Rounding of the centre does not matter.
pub fn noise<R: Real>(p: [WgslInterval<R>; 3], seed: R) -> WgslInterval<R> {
    let middles = p.map(|axis| (axis.low + axis.high) * lit(0.5));
    let [x, y, z] = middles;
    let mut half_sizes = [lit::<R>(0.0); 3];
    for ((radius, axis), middle) in half_sizes.iter_mut().zip(p).zip(middles) {
        *radius = (axis.high - middle).max(middle - axis.low);
    }
    let radius = R::length3(half_sizes[0], half_sizes[1], half_sizes[2]);
    let value = R::noise(R::Vec3::new(x, y, z), seed);
    // Far from the origin, coordinates are rounded to steps that are not negligible.
    let coarse = (x.abs() + y.abs() + z.abs()) * lit(2e-6);
    let change = (radius + coarse) * lit(MAX_NOISE_STEEPNESS * 1.001) + lit(NOISE_ERROR);
    let limit = lit::<R>(1.5);
    // Unbounded ends make `change` large as well.
    WgslInterval {
        low: (value - change).max(-limit),
        high: (value + change).min(limit),
    }
}

/// Bounds the distance to an ellipsoid with the radii `r` over a box.
pub fn ellipsoid<R: Real>(p: [WgslInterval<R>; 3], r: R::Vec3) -> WgslInterval<R> {
    let magnitudes = p.map(abs);
    let [x, y, z] = magnitudes.map(|axis| axis.low.max(lit(0.0)).min(lit(MAX_BOUNDED)));
    let near = R::Vec3::new(x, y, z);
    let [x, y, z] = magnitudes.map(|axis| axis.high.min(lit(MAX_BOUNDED)));
    let far = R::Vec3::new(x, y, z);
    let error = (far.max_component() + r.max_component()) * lit(DISTANCE_ERROR);
    let [low, high] = bounds_between::<R>(near, far, r, error);
    // The distance to a point beyond `MAX_BOUNDED` has no upper bound.
    let is_known = far.max_component().less(lit(MAX_BOUNDED));
    saturate_unbounded(low, R::select(is_known, high, lit(UNBOUNDED)))
}

/// Compares two intervals. Between unbounded ends, the result is undecided.
pub fn less<R: Real>(a: WgslInterval<R>, b: WgslInterval<R>) -> WgslTristate<R::Bool> {
    let (least, limit) = (lit::<R>(-MAX_BOUNDED), lit::<R>(MAX_BOUNDED));
    WgslTristate {
        can_be_true: a.low.min(limit).less(b.high.max(least)),
        can_be_false: R::not(a.high.max(least).less(b.low.min(limit))),
    }
}

/// Returns the first where the condition holds, the second elsewhere.
pub fn select<R: Real>(
    condition: WgslTristate<R::Bool>,
    then: WgslInterval<R>,
    otherwise: WgslInterval<R>,
) -> WgslInterval<R> {
    let hull = WgslInterval {
        low: then.low.min(otherwise.low),
        high: then.high.max(otherwise.high),
    };
    hull.select(condition.can_be_false, then)
        .select(condition.can_be_true, otherwise)
}

/// Maps a box of points by a matrix, given by its columns, and a shift.
pub fn mapped<R: Real>(
    p: [WgslInterval<R>; 3],
    columns: [R::Vec3; 3],
    shift: R::Vec3,
) -> [WgslInterval<R>; 3] {
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
    let by = size * lit::<R>(ROW_ERROR) + R::Vec3::splat(lit(MIN_ERROR));
    let (low, high) = (low - by, high + by);
    let bounded = is_bounded(farthest);
    let component =
        |low: R, high: R| saturate_unbounded(low, high).select(bounded, WgslInterval::unbounded());
    [
        component(low.x(), high.x()),
        component(low.y(), high.y()),
        component(low.z(), high.z()),
    ]
}
