//! Sine, cosine, exponential, logarithm, arctangent and gradient noise, from basic arithmetic only.
//!
//! WGSL allows its builtins errors as large as 5e-4 in a sine, and devices use this allowance. These bodies
//! are written once, run on every engine, and give the same bits unless multiplications and additions are
//! fused. Ranges are reduced by constants in several parts (W. J. Cody and W. Waite, *Software Manual for
//! the Elementary Functions*, 1980). The polynomials on the reduced ranges are Taylor series, truncated where
//! the next term is below half a unit in the last place. That of the arctangent is a fitted polynomial.
//!
//! [`Real`] cannot express integer hashes. They are the intrinsics [`Real::lattice`] and, for noise,
//! [`Real::noise_corner_gradient`], written by hand on each side and compared bit for bit by a test.

use crate::real::{Real, Vector3, lit};

/// Returns two to the power of `x`, which is clamped to [-126, 127]; relative error below 4e-7.
#[inline(always)]
pub fn exponential<R: Real>(x: R) -> R {
    let x = x.at_least(lit(-126.0)).at_most(lit(127.0));
    let n = (x + lit(0.5)).floor().named("n");
    let f = ((x - n) * lit(std::f64::consts::LN_2)).named("f");
    let series = lit::<R>(1.0)
        + f * (lit::<R>(1.0)
            + f * (lit::<R>(1.0 / 2.0)
                + f * (lit::<R>(1.0 / 6.0)
                    + f * (lit::<R>(1.0 / 24.0)
                        + f * (lit::<R>(1.0 / 120.0)
                            + f * (lit::<R>(1.0 / 720.0) + f * lit(1.0 / 5040.0)))))));
    series * n.power_of_two()
}

/// Returns the logarithm to base two of `x`, which is raised to 1.2e-38 if it is smaller. The absolute
/// error is below 6e-7 near 1, and three units in the last place elsewhere. For NaN, it is at least 128.
#[inline(always)]
pub fn logarithm<R: Real>(x: R) -> R {
    // A NaN may have a sign bit, which is not part of its exponent.
    let x = x.at_least(lit(1.2e-38)).abs();
    let m = x.mantissa().named("m");
    let high = lit::<R>(std::f64::consts::SQRT_2).less(m);
    let m = R::select(high, m * lit(0.5), m);
    let e = x.exponent() + R::select(high, lit(1.0), lit(0.0));
    let s = ((m - lit(1.0)) / (m + lit(1.0))).named("s");
    let s2 = (s * s).named("s2");
    let series = s
        * (lit::<R>(1.0)
            + s2 * (lit::<R>(1.0 / 3.0)
                + s2 * (lit::<R>(1.0 / 5.0) + s2 * (lit::<R>(1.0 / 7.0) + s2 * lit(1.0 / 9.0)))));
    e + series * lit(2.0 * std::f64::consts::LOG2_E)
}

/// π/2 in three parts, the first two with enough trailing zeros that their products with the quadrant's
/// number are exact up to 2¹³ quadrants.
const HALF_PI: [f64; 3] = [
    1.5703125,
    4.837_512_969_970_703e-4,
    7.549_789_948_768_648e-8,
];

/// Returns the number of the quadrant that contains `x`, and the remainder within [-π/4, π/4].
#[inline(always)]
fn quadrant<R: Real>(x: R) -> (R, R) {
    let k = (x * lit(std::f64::consts::FRAC_2_PI) + lit(0.5))
        .floor()
        .named("k");
    let r = x - k * lit(HALF_PI[0]);
    let r = r - k * lit(HALF_PI[1]);
    // For huge angles the remainder has no correct digit, but it stays within this range.
    let r = (r - k * lit(HALF_PI[2]))
        .at_least(lit(-0.8))
        .at_most(lit(0.8))
        .named("r");
    let turn = k - (k * lit(0.25)).floor() * lit(4.0);
    (turn.named("turn"), r)
}

/// Returns sine and cosine of a remainder within [-π/4, π/4].
#[inline(always)]
fn sine_cosine<R: Real>(r: R) -> (R, R) {
    let r2 = (r * r).named("r2");
    let sine = r + r
        * r2
        * (lit::<R>(-1.0 / 6.0)
            + r2 * (lit::<R>(1.0 / 120.0)
                + r2 * (lit::<R>(-1.0 / 5040.0) + r2 * lit(1.0 / 362_880.0))));
    let cosine = lit::<R>(1.0)
        + r2 * (lit::<R>(-0.5)
            + r2 * (lit::<R>(1.0 / 24.0)
                + r2 * (lit::<R>(-1.0 / 720.0) + r2 * lit(1.0 / 40320.0))));
    (sine, cosine)
}

/// Returns the value for a quadrant: `even` in the even ones, `odd` in the odd ones, negated in the second
/// half of the turn.
#[inline(always)]
fn by_quadrant<R: Real>(turn: R, even: R, odd: R) -> R {
    let first = turn.less(lit(0.5));
    let third = R::and(lit::<R>(1.5).less(turn), turn.less(lit(2.5)));
    let value = R::select(R::or(first, third), even, odd);
    R::select(lit::<R>(1.5).less(turn), -value, value)
}

/// Returns the sine of `x` radians. The absolute error is below 2e-7 for |x| ≤ 100, and grows in proportion
/// to |x| beyond, like the rounding error of the argument itself.
#[inline(always)]
pub fn sine<R: Real>(x: R) -> R {
    let (turn, r) = quadrant(x);
    let (sine, cosine) = sine_cosine(r);
    by_quadrant(turn, sine, cosine)
}

/// Returns the cosine of `x` radians; errors as for [`sine`].
#[inline(always)]
pub fn cosine<R: Real>(x: R) -> R {
    let (turn, r) = quadrant(x);
    let (sine, cosine) = sine_cosine(r);
    // cos x = sin(x + a quarter turn): the next quadrant's value.
    let next = turn + lit(1.0);
    by_quadrant(
        R::select(lit::<R>(3.5).less(next), lit(0.0), next),
        sine,
        cosine,
    )
}

/// Returns the angle of the vector (`x`, `y`) in [-π, π]; 0 at the origin; absolute error below 4e-7.
#[inline(always)]
pub fn arctangent<R: Real>(y: R, x: R) -> R {
    let (ax, ay) = (x.abs().named("ax"), y.abs().named("ay"));
    // The ratio of the smaller to the larger lies in [0, 1]. Above tan(π/8) it is rotated by an eighth of a
    // turn, which leaves a range short enough for a polynomial.
    let ratio = (ax.min(ay) / ax.max(ay).max(lit(1e-30))).named("ratio");
    let far = lit::<R>(std::f64::consts::SQRT_2 - 1.0).less(ratio);
    let a = R::select(far, (ratio - lit(1.0)) / (ratio + lit(1.0)), ratio).named("a");
    let a2 = (a * a).named("a2");
    let series = a + a
        * a2
        * (lit::<R>(ARCTANGENT[0])
            + a2 * (lit::<R>(ARCTANGENT[1])
                + a2 * (lit::<R>(ARCTANGENT[2])
                    + a2 * (lit::<R>(ARCTANGENT[3]) + a2 * lit(ARCTANGENT[4])))));
    let eighth = R::select(far, lit(std::f64::consts::FRAC_PI_4), lit(0.0)) + series;
    let quarter = R::select(
        ax.less(ay),
        lit::<R>(std::f64::consts::FRAC_PI_2) - eighth,
        eighth,
    );
    let half = R::select(
        x.less(lit(0.0)),
        lit::<R>(std::f64::consts::PI) - quarter,
        quarter,
    );
    R::select(y.less(lit(0.0)), -half, half)
}

/// Coefficients of `(atan(a) − a) / a³` in powers of a², fitted by least squares on Chebyshev nodes over
/// [0, tan(π/8)]; the relative error of the arctangent is 2e-9.
const ARCTANGENT: [f64; 5] = [
    -0.333_333_166_913_634_4,
    0.199_985_484_344_080_76,
    -0.142_448_018_716_056_71,
    0.106_022_186_317_085_22,
    -0.060_976_436_466_572_64,
];

/// The offset 1.5 · 2²³ that moves an integer to the last bits of its sum. It is exact for integers up to
/// 2²², beyond which noise has no digits left. The addition takes one instruction for a vector of numbers.
/// A conversion that defines the results for all other numbers takes dozens.
const INTEGER_OFFSET: f32 = 12_582_912.0;

/// Returns different bits for different integers.
#[inline(always)]
fn integer_bits(integer: f32) -> u32 {
    (integer + INTEGER_OFFSET).to_bits()
}

/// Returns the hash bits of a seed.
#[inline(always)]
fn salt(seed: f32) -> u32 {
    integer_bits(seed).wrapping_mul(0x9e37_79b9)
}

/// Returns three 32-bit hashes of three integers and a seed (M. Jarzynski and M. Olano, *Hash Functions for
/// GPU Rendering*, JCGT 2020: the "pcg3d" permutation).
#[inline(always)]
pub fn hash(cell: [f32; 3], seed: f32) -> [u32; 3] {
    let step = |v: u32| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let salt = salt(seed);
    let [mut x, mut y, mut z] = cell.map(|c| step(integer_bits(c) ^ salt));
    x = x.wrapping_add(y.wrapping_mul(z));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
    x = x.wrapping_add(y.wrapping_mul(z));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    [x, y, z]
}

/// Returns one 32-bit hash of three integers and a seed, whose upper bits have the better quality. It mixes
/// in one coordinate after another, as Perlin's permutations do, so that the corners of a cell reuse common
/// partial hashes. Each coordinate is multiplied in and mixed by a shift. The multipliers and the last
/// shift are those of C. Wellons' *lowbias32* (Prospecting for Hash Functions, 2018).
#[inline(always)]
fn corner_hash([x, y, z]: [f32; 3], seed: f32) -> u32 {
    let h = (integer_bits(x) ^ salt(seed)).wrapping_mul(0x7feb_352d);
    let h = (h ^ (h >> 15))
        .wrapping_add(integer_bits(y))
        .wrapping_mul(0x846c_a68b);
    let h = (h ^ (h >> 15))
        .wrapping_add(integer_bits(z))
        .wrapping_mul(0x7feb_352d);
    (h ^ (h >> 16)).wrapping_mul(0x846c_a68b)
}

/// The bits of 1.
const ONE: u32 = 0x3f80_0000;

/// Returns the components of [`Real::noise_corner_gradient`]: a number in [1, 2) and two signs, from the
/// bits of one hash.
#[inline(always)]
pub fn edge(cell: [f32; 3], seed: f32) -> [f32; 3] {
    let h = corner_hash(cell, seed);
    let sign = |h: u32| f32::from_bits(ONE | (h & 0x8000_0000));
    [
        f32::from_bits(ONE | ((h >> 7) & 0x007f_ffff)),
        sign(h),
        sign(h << 1),
    ]
}

/// Returns gradient noise (K. Perlin, *Improving Noise*, SIGGRAPH 2002, with gradients of length one) and
/// its exact gradient. Its magnitude is at most 1, and its slope is at most
/// [`MAX_NOISE_SLOPE`](crate::interval::MAX_NOISE_SLOPE).
#[inline(always)]
pub fn perlin<R: Real>(p: R::Vec3, seed: R) -> (R, R::Vec3) {
    let cell = p.floor().named("cell");
    let f = (p - cell).named("f");
    let w = R::Vec3::new(fade(f.x()), fade(f.y()), fade(f.z())).named("w");
    let dw = R::Vec3::new(fade_slope(f.x()), fade_slope(f.y()), fade_slope(f.z())).named("dw");
    // At each corner: its gradient, and the value of the linear function with that gradient.
    let c: [(R, R::Vec3); 8] = [
        corner::<R>(cell, f, seed, [0.0, 0.0, 0.0]),
        corner::<R>(cell, f, seed, [1.0, 0.0, 0.0]),
        corner::<R>(cell, f, seed, [0.0, 1.0, 0.0]),
        corner::<R>(cell, f, seed, [1.0, 1.0, 0.0]),
        corner::<R>(cell, f, seed, [0.0, 0.0, 1.0]),
        corner::<R>(cell, f, seed, [1.0, 0.0, 1.0]),
        corner::<R>(cell, f, seed, [0.0, 1.0, 1.0]),
        corner::<R>(cell, f, seed, [1.0, 1.0, 1.0]),
    ];
    let x00 = interpolate::<R>(c[0], c[1], w.x());
    let x10 = interpolate::<R>(c[2], c[3], w.x());
    let x01 = interpolate::<R>(c[4], c[5], w.x());
    let x11 = interpolate::<R>(c[6], c[7], w.x());
    let y0 = interpolate::<R>(x00, x10, w.y());
    let y1 = interpolate::<R>(x01, x11, w.y());
    let (value, mixed) = interpolate::<R>(y0, y1, w.z());
    // The weights change too: along x between the corners of each x edge, and so on.
    let dx = (c[1].0 - c[0].0)
        .mix(c[3].0 - c[2].0, w.y())
        .mix((c[5].0 - c[4].0).mix(c[7].0 - c[6].0, w.y()), w.z());
    let dy = (x10.0 - x00.0).mix(x11.0 - x01.0, w.z());
    let dz = y1.0 - y0.0;
    let length = lit(std::f64::consts::FRAC_1_SQRT_2);
    (
        value * length,
        (mixed + R::Vec3::new(dx, dy, dz) * dw) * length,
    )
}

/// Returns the weight of the next corner of a cell.
#[inline(always)]
fn fade<R: Real>(t: R) -> R {
    t * t * t * (t * (t * lit(6.0) - lit(15.0)) + lit(10.0))
}

/// Returns the derivative of [`fade`].
#[inline(always)]
fn fade_slope<R: Real>(t: R) -> R {
    let u = t * (t - lit(1.0));
    u * u * lit(30.0)
}

/// Returns a corner's linear function at the position `f` in the cell, and its gradient, both √2 times too
/// large. The gradient points to one of the twelve edges of a cube. With so few directions, the largest
/// slope is little more than the typical one. The first number selects by thirds which component is zero;
/// the others are the two signs.
#[inline(always)]
fn corner<R: Real>(cell: R::Vec3, f: R::Vec3, seed: R, [x, y, z]: [f64; 3]) -> (R, R::Vec3) {
    let offset = R::Vec3::new(lit(x), lit(y), lit(z));
    let edge = R::noise_corner_gradient(cell + offset, seed).named("edge");
    let (a, b) = (edge.y(), edge.z());
    let (first, last) = (
        edge.x().less(lit(4.0 / 3.0)),
        lit::<R>(5.0 / 3.0).less(edge.x()),
    );
    let d = (f - offset).named("d");
    let value = R::select(first, d.y(), d.x()).signed(a) + R::select(last, d.y(), d.z()).signed(b);
    let zero = lit::<R>(0.0);
    let gradient = R::Vec3::new(
        R::select(first, zero, a),
        R::select(first, a, R::select(last, b, zero)),
        R::select(last, zero, b),
    );
    (value.named("v"), gradient.named("g"))
}

/// Interpolates linearly between the values and gradients of two corners.
#[inline(always)]
fn interpolate<R: Real>(a: (R, R::Vec3), b: (R, R::Vec3), t: R) -> (R, R::Vec3) {
    (a.0.mix(b.0, t), a.1.mix(b.1, t))
}
