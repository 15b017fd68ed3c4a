//! Conversions from the arguments in a scene to the parameters of a body. They run once per scene (or per
//! change of a live `param`), never per point.
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

/// Converts full sizes and a rounding radius; the radius is limited to the smallest half size.
pub fn rounded_size<R: Real>(a: &[R]) -> Vec<R> {
    let size = [half(a[0]), half(a[1]), half(a[2])];
    let round = a[3].min(size[0]).min(size[1]).min(size[2]);
    vec![size[0], size[1], size[2], round]
}

/// Converts full sizes and a rounding radius in the plane.
pub fn rounded_size2<R: Real>(a: &[R]) -> Vec<R> {
    let size = [half(a[0]), half(a[1])];
    vec![size[0], size[1], a[2].min(size[0]).min(size[1])]
}

/// Converts full sizes and the thickness of the bars, which is limited by the size.
pub fn frame<R: Real>(a: &[R]) -> Vec<R> {
    rounded_size(&[a[0], a[1], a[2], half(a[3])])
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

/// Converts two end points and a radius to a start, a radius, an axis, and one over its squared length.
pub fn segment<R: Real>(a: &[R]) -> Vec<R> {
    let (from, to) = (vec3::<R>(a), vec3::<R>(&a[3..]));
    let axis = to - from;
    let mut v = from_vec3::<R>(from);
    v.push(a[6]);
    v.extend(from_vec3::<R>(axis));
    v.push(inverse(axis.dot(axis)));
    v
}

/// Converts two end points and a radius in the plane to a start, an axis, one over its squared length, and
/// the radius.
pub fn segment2<R: Real>(a: &[R]) -> Vec<R> {
    let (x, y) = (a[2] - a[0], a[3] - a[1]);
    vec![a[0], a[1], x, y, inverse(x * x + y * y), a[4]]
}

/// Converts two end points and a radius to a midpoint, a radius, a unit axis and a half length. Equal end
/// points give a disc across the y axis.
pub fn axis_midpoint<R: Real>(a: &[R]) -> Vec<R> {
    let (from, to) = (vec3::<R>(a), vec3::<R>(&a[3..]));
    let axis = to - from;
    let length = axis.dot(axis).sqrt();
    let none = length.less(lit(1e-12));
    let up = R::Vec3::new(lit(0.0), lit(1.0), lit(0.0));
    let axis = R::Vec3::select(none, up, axis * (lit::<R>(1.0) / length.max(lit(1e-12))));
    let mut v = from_vec3::<R>((from + to) * lit::<R>(0.5));
    v.push(a[6]);
    v.extend(from_vec3::<R>(axis));
    v.push(half(length));
    v
}

/// Converts two radii and an angle to the radii and the direction of the arc's end. The arc is limited to
/// slightly less than a full turn, where its ends would coincide.
pub fn arc<R: Real>(a: &[R]) -> Vec<R> {
    let angle = half(a[2]).clamp(lit(0.0), lit(std::f64::consts::PI - 1e-4));
    vec![a[0], a[1], angle.cos(), angle.sin()]
}

/// Converts radius, height and rounding to radius, half height and a rounding that fits.
pub fn rounded_cylinder<R: Real>(a: &[R]) -> Vec<R> {
    let h = half(a[1]);
    vec![a[0], h, a[2].min(a[0]).min(h)]
}

/// Converts the full opening angle of a cone to the direction of its side.
pub fn half_angle<R: Real>(a: &[R]) -> Vec<R> {
    let angle = half(a[0]).clamp(lit(0.0), lit(std::f64::consts::FRAC_PI_2));
    vec![angle.sin(), angle.cos()]
}

/// Converts the radii at bottom and top and the height to a cone with the length and the normal of its
/// side.
pub fn cone<R: Real>(a: &[R]) -> Vec<R> {
    let (bottom, top, h) = (a[0], a[1], half(a[2]));
    let (slope, across) = side(bottom, top, h);
    vec![bottom, top, h, slope, across[0], across[1]]
}

/// Converts a rounded cone to the sharp cone whose offset by `round` it is: all of its planes are moved in
/// by `round`, or by the largest possible amount.
pub fn rounded_cone<R: Real>(a: &[R]) -> Vec<R> {
    let (bottom, top, h) = (a[0], a[1], half(a[2]));
    let (slope, _) = side(bottom, top, h);
    // Narrowing per unit of height, and inward motion of the side per unit of rounding.
    let taper = (top - bottom) / (h * lit(2.0)).max(lit(1e-12));
    let shift = slope / (h * lit(2.0)).max(lit(1e-12));
    let widest = bottom.max(top) / (taper.abs() + shift).max(lit(1e-12));
    let round = a[3].min(h).min(widest);
    // The radius at each height after the side has moved. Where it is negative, the cone ends earlier, at
    // its apex.
    let middle = (bottom + top) * lit(0.5) - shift * round;
    let steep = R::select(taper.abs().less(lit(1e-12)), lit(1e-12), taper);
    let apex = -middle / steep;
    let reach = (h - round).max(lit(0.0));
    let rising = lit::<R>(0.0).less(taper);
    let flat = taper.abs().less(lit(1e-9));
    let high = R::select(R::or(rising, flat), reach, reach.min(apex));
    let low = R::select(R::and(rising, R::not(flat)), (-reach).max(apex), -reach);
    let radius_at = |y: R| (middle + taper * y).max(lit(0.0));
    let (bottom, top) = (radius_at(low), radius_at(high));
    let h = ((high - low) * lit(0.5)).max(lit(0.0));
    let (slope, across) = side(bottom, top, h);
    vec![
        bottom,
        top,
        h,
        slope,
        across[0],
        across[1],
        (high + low) * lit(0.5),
        round,
    ]
}

/// Returns the length and the unit normal of a cone's side; for a side of length zero, the normal points
/// outwards.
fn side<R: Real>(bottom: R, top: R, h: R) -> (R, [R; 2]) {
    let (x, y) = (bottom - top, h * lit(2.0));
    let slope = (x * x + y * y).sqrt();
    let none = slope.less(lit(1e-12));
    let inverse = lit::<R>(1.0) / slope.max(lit(1e-12));
    (
        slope,
        [
            R::select(none, lit(1.0), y * inverse),
            R::select(none, lit(0.0), x * inverse),
        ],
    )
}

/// Converts two radii and the distance of two spheres to the parameters of their hull. If one sphere
/// contains the other, both become the larger one.
pub fn round_cone<R: Real>(a: &[R]) -> Vec<R> {
    let (lower, upper, h) = (a[0], a[1], a[2]);
    let inside = R::not((lower - upper).abs().less(h));
    let first = upper.less(lower);
    let larger = lower.max(upper);
    let low = R::select(R::and(inside, R::not(first)), half(h), -half(h));
    let sine = R::select(inside, lit(0.0), (lower - upper) / h.max(lit(1e-12)));
    let cosine = (lit::<R>(1.0) - sine * sine).max(lit(0.0)).sqrt();
    vec![
        R::select(inside, larger, lower),
        R::select(inside, larger, upper),
        low,
        R::select(inside, lit(0.0), h),
        cosine,
        sine,
    ]
}

/// Converts the number of corners (at least three) and the circumradius to the angle of a sector, its
/// inverse, the apothem, and half the length of a side. Further arguments are kept.
pub fn polygon<R: Real>(a: &[R]) -> Vec<R> {
    let (sector, inverse) = sectors(a[0].max(lit(3.0)));
    let angle = half(sector);
    let mut v = vec![sector, inverse, a[1] * angle.cos(), a[1] * angle.sin()];
    v.extend_from_slice(&a[2..]);
    v
}

/// Converts a regular prism: the polygon, and the height to the half height.
pub fn prism<R: Real>(a: &[R]) -> Vec<R> {
    halve_last(&polygon(a))
}

/// Converts the number of tips (at least two), the radius of the tips, and the radius of the inner corners.
pub fn star<R: Real>(a: &[R]) -> Vec<R> {
    let (sector, inverse) = sectors(a[0].max(lit(2.0)));
    let angle = half(sector);
    let (x, y) = (a[2] * angle.cos() - a[1], a[2] * angle.sin());
    let length = (x * x + y * y).sqrt();
    let scale = lit::<R>(1.0) / length.max(lit(1e-12));
    vec![sector, inverse, a[1], length, y * scale, -x * scale]
}

/// Converts the side of the base and the height.
pub fn pyramid<R: Real>(a: &[R]) -> Vec<R> {
    let (base, h) = (half(a[0]), a[1]);
    let square = base * base + h * h;
    let slope = square.sqrt();
    let scale = lit::<R>(1.0) / slope.max(lit(1e-12));
    vec![
        base,
        half(h),
        h * scale,
        base * scale,
        slope,
        inverse(square + base * base),
    ]
}

/// Converts the circumradius of a tetrahedron to the distance of its faces.
pub fn tetrahedron<R: Real>(a: &[R]) -> Vec<R> {
    vec![a[0] * lit(1.0 / 3.0)]
}

/// Converts the size of a cell and the thickness of a sheet to radians per unit, a scale, and half the
/// thickness. The scale makes the level function a lower bound of the distance.
pub fn periodic<R: Real>(a: &[R]) -> Vec<R> {
    let per_radian = a[0] * lit(1.0 / std::f64::consts::TAU);
    let steepest = 3.0_f64.sqrt();
    vec![
        lit::<R>(1.0) / per_radian.max(lit(1e-12)),
        per_radian * lit(1.0 / steepest),
        half(a[1]),
    ]
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

/// Converts the lower and upper corner of a cell's content, the spacing and the guarded axes. The result is
/// the spacing, the ends of the copies below, the starts of the copies above, and the axes.
pub fn guard<R: Real>(a: &[R]) -> Vec<R> {
    let spacing: Vec<R> = a[6..9].iter().map(|spacing| spacing.abs()).collect();
    [&spacing, &*neighbours(a), &a[9..12]].concat()
}

/// Converts the corners, the spacing, the counts and the guarded axes. The result is the parameters of the
/// grid, the ends and starts of the neighbours, and the axes.
pub fn limited_guard<R: Real>(a: &[R]) -> Vec<R> {
    let mut v = limited_spacing(&a[6..12]);
    v.extend(neighbours(a));
    v.extend_from_slice(&a[12..15]);
    v
}

/// Returns the ends of the copies below and the starts of the copies above.
fn neighbours<R: Real>(a: &[R]) -> Vec<R> {
    let kept = |v: R| v.clamp(lit(-1e15), lit(1e15));
    let lower = (0..3).map(|i| kept(a[3 + i]) - a[6 + i].abs());
    let upper = (0..3).map(|i| kept(a[i]) + a[6 + i].abs());
    lower.chain(upper).collect()
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

fn half<R: Real>(v: R) -> R {
    v * lit(0.5)
}

/// Returns one over a number, or zero if its magnitude is below 1e-18.
fn inverse<R: Real>(v: R) -> R {
    let none = v.abs().less(lit(1e-18));
    R::select(none, lit(0.0), lit::<R>(1.0) / R::select(none, lit(1.0), v))
}

/// Returns the angle of one of `n` sectors, and its inverse.
fn sectors<R: Real>(n: R) -> (R, R) {
    let tau = std::f64::consts::TAU;
    let n = n.round();
    (lit::<R>(tau) / n, n * lit(1.0 / tau))
}

fn vec3<R: Real>(a: &[R]) -> R::Vec3 {
    R::Vec3::new(a[0], a[1], a[2])
}

fn from_vec3<R: Real>(v: R::Vec3) -> Vec<R> {
    vec![v.x(), v.y(), v.z()]
}
