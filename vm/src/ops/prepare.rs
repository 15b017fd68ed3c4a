//! Conversions from the arguments in a scene to the parameters of a body, for operations other than shapes and
//! for shapes of several families. They run once per scene (or per change of a live `param`), never per point.
//! [`shapes`](super::shapes) has those of single shapes.
//!
//! They are generic and branch-free, because live numbers are expressions that are computed later. Every
//! argument results in a valid shape: numbers that do not fit are clamped.

use crate::real::{Real, Vector3, lit};

/// Returns the arguments unchanged.
pub fn identity<R: Real>(a: &[R]) -> Vec<R> {
    a.to_vec()
}

/// Halves all arguments: full sizes to half sizes.
pub fn half_size<R: Real>(a: &[R]) -> Vec<R> {
    a.iter().map(|&size| half(size)).collect()
}

/// Halves the first argument, a length before a radius.
pub fn halve_first<R: Real>(a: &[R]) -> Vec<R> {
    let mut v = a.to_vec();
    v[0] = half(v[0]);
    v
}

/// Halves the last argument.
pub fn halve_last<R: Real>(a: &[R]) -> Vec<R> {
    let mut v = a.to_vec();
    let last = v.len() - 1;
    v[last] = half(v[last]);
    v
}

/// Converts height and rounding to half the height and a rounding that fits.
pub fn rounded_extrude<R: Real>(a: &[R]) -> Vec<R> {
    let h = half(a[0]);
    vec![h, a[1].min(h)]
}

/// Converts offset and angle to the offset and the direction of the end.
pub fn revolve_part<R: Real>(a: &[R]) -> Vec<R> {
    let angle = half(a[1]).clamp(lit(0.0), lit(std::f64::consts::PI));
    vec![a[0], angle.cos(), angle.sin()]
}

/// Converts the angle only.
pub fn revolve_close<R: Real>(a: &[R]) -> Vec<R> {
    revolve_part(&[lit(0.0), a[0]])[1..].to_vec()
}

/// Converts a thickness to the width and the coefficient of the quadratic kernel.
pub fn quadratic<R: Real>(a: &[R]) -> Vec<R> {
    let width = thickness(a[0]) * lit(4.0);
    vec![width, lit::<R>(0.25) / width.max(lit(MIN_WIDTH))]
}

/// Converts a thickness to the width and the coefficient of the cubic kernel.
pub fn cubic<R: Real>(a: &[R]) -> Vec<R> {
    let width = thickness(a[0]) * lit(6.0);
    let w = width.max(lit(MIN_WIDTH));
    vec![width, lit::<R>(1.0 / 6.0) / (w * w)]
}

/// Converts a thickness to the width and the coefficient of the circular kernel.
pub fn circular<R: Real>(a: &[R]) -> Vec<R> {
    let width = thickness(a[0]) * lit(1.0 / (1.0 - std::f64::consts::FRAC_1_SQRT_2));
    vec![width, lit::<R>(1.0) / width.max(lit(MIN_WIDTH))]
}

/// Converts a thickness to the width and the coefficient of the exponential kernel.
pub fn exponential<R: Real>(a: &[R]) -> Vec<R> {
    let width = thickness(a[0]);
    vec![width, lit::<R>(1.0) / width.max(lit(MIN_WIDTH))]
}

/// The smallest width to divide by; narrower blends are practically hard. Its inverse, and the inverse's
/// square, are finite.
const MIN_WIDTH: f64 = 1e-15;

/// Clamps a thickness to non-negative values.
fn thickness<R: Real>(k: R) -> R {
    k.max(lit(0.0))
}

/// Clamps a size to non-negative values.
pub fn profile<R: Real>(a: &[R]) -> Vec<R> {
    vec![thickness(a[0])]
}

/// Converts a size and the number of steps in it to the size and half the period of a step.
pub fn stairs<R: Real>(a: &[R]) -> Vec<R> {
    let size = thickness(a[0]);
    vec![size, (size / a[1].max(lit(1.0))).max(lit(1e-9))]
}

/// Clamps a fraction to 0 and 1.
pub fn clamp01<R: Real>(a: &[R]) -> Vec<R> {
    vec![a[0].saturate()]
}

/// Converts the axes of a mirror to the flags 1 and 0.
pub fn mirror_flags<R: Real>(a: &[R]) -> Vec<R> {
    let flag = |v: R| R::select(lit::<R>(0.0).less(v.abs()), lit(1.0), lit(0.0));
    a.iter().map(|&v| flag(v)).collect()
}

/// Converts spacings to the spacings and their inverses; the inverse of zero is zero.
pub fn spacing<R: Real>(a: &[R]) -> Vec<R> {
    let mut v = a[..3].to_vec();
    v.extend(a[..3].iter().map(|&s| inverse(s)));
    v.extend_from_slice(&a[3..]);
    v
}

/// Converts spacings and counts to spacings, their inverses, and the index of the last cell.
pub fn limited_spacing<R: Real>(a: &[R]) -> Vec<R> {
    let mut v = spacing(a);
    for count in &mut v[6..9] {
        *count = (count.round() - lit(1.0)).max(lit(0.0));
    }
    v
}

/// Converts a number of sectors and the direction of the first one to their angle, its inverse, and the
/// direction.
pub fn polar<R: Real>(a: &[R]) -> Vec<R> {
    let (sector, inverse) = sectors(a[0].max(lit(1.0)));
    vec![sector, inverse, a[1]]
}

/// Converts the parameters of [`polar`] and the offset of the copy, in sectors.
pub fn polar_neighbour<R: Real>(a: &[R]) -> Vec<R> {
    let mut v = polar(a);
    v.push(a[2]);
    v
}

/// Length of a step as a fraction of the longest safe one, so that its own slope stays below one.
const STEP_FRACTION: f64 = 0.8;

/// Converts its arguments to the parameters of [`super::distance::field_growth`]. They are the half
/// side of a cube, a slope bound in it, and the factor and the exponent of the growth outside.
pub fn growth<R: Real>(a: &[R]) -> Vec<R> {
    let one = lit::<R>(1.0);
    let inverse = |v: R| one / v.max(lit(1e-30));
    // Over this fraction of the distance, the slope grows by a factor below e^0.5.
    let exponent = a[3].max(lit(0.5));
    let fraction = one / (exponent * lit(2.0));
    let rise = ((one + fraction).ln() * exponent).exp();
    vec![
        a[0],
        exponent,
        fraction,
        inverse(a[1]),
        inverse(a[2] * rise) * lit(STEP_FRACTION),
    ]
}

/// Converts the corners of a box, a margin and a limit to its centre, the margin, its half sizes, and the
/// limit.
pub fn corners<R: Real>(a: &[R]) -> Vec<R> {
    let (low, high) = (vec3::<R>(a), vec3::<R>(&a[3..]));
    let mut v = from_vec3::<R>((low + high) * lit::<R>(0.5));
    v.push(a[6]);
    v.extend(from_vec3::<R>((high - low) * lit::<R>(0.5)));
    v.push(a[7]);
    v
}

/// Converts a slope bound to its inverse.
pub fn inverse_slope<R: Real>(a: &[R]) -> Vec<R> {
    vec![lit::<R>(1.0) / a[0].max(lit(1e-30))]
}

/// Converts frequency, amplitude and seed to an offset that differs by seed, and the three.
pub fn octave<R: Real>(a: &[R]) -> Vec<R> {
    // Multiples of irrational numbers fill the cell evenly.
    let offset = |step: f64| ((a[2] + lit(1.0)) * lit(step)).fract();
    vec![
        offset(0.819_172_513_396_164_4),
        offset(0.671_043_606_703_789_2),
        offset(0.549_700_477_901_97),
        a[0],
        a[1],
        a[2],
    ]
}

/// Halves a number.
pub(super) fn half<R: Real>(v: R) -> R {
    v * lit(0.5)
}

/// Returns one over a number, or zero if its magnitude is below 1e-18.
pub(super) fn inverse<R: Real>(v: R) -> R {
    let none = v.abs().less(lit(1e-18));
    R::select(none, lit(0.0), lit::<R>(1.0) / R::select(none, lit(1.0), v))
}

/// Returns the angle of one of `n` sectors, and its inverse.
pub(super) fn sectors<R: Real>(n: R) -> (R, R) {
    let tau = std::f64::consts::TAU;
    let n = n.round();
    (lit::<R>(tau) / n, n * lit(1.0 / tau))
}

/// Returns the first three numbers as a vector.
pub(super) fn vec3<R: Real>(a: &[R]) -> R::Vec3 {
    R::Vec3::new(a[0], a[1], a[2])
}

/// Returns the components of a vector.
pub(super) fn from_vec3<R: Real>(v: R::Vec3) -> Vec<R> {
    vec![v.x(), v.y(), v.z()]
}
