//! Cones, truncated and rounded.

use crate::bounds::Bounds;
use crate::ops::prepare::half;
use crate::real::{Real, Vector2, Vector3, lit};

/// Returns the signed distance to an infinite cone with its apex at the origin, opening towards −y. `side` is the
/// unit vector along its side in the half plane of (distance from the axis, depth below the apex).
#[inline(always)]
pub fn infinite_cone<R: Real>(p: R::Vec3, side: R::Vec2) -> R {
    let q = R::Vec2::new(p.xz().length(), -p.y()).named("q");
    // Beside the side's line, the distance is to that line; behind the apex, to the apex.
    let beside = q.x() * side.y() - q.y() * side.x();
    R::select(q.dot(side).less(lit(0.0)), q.length(), beside)
}

/// Converts the full opening angle of a cone to the direction of its side.
pub fn infinite_cone_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let angle = half(a[0]).clamp(lit(0.0), lit(std::f64::consts::FRAC_PI_2));
    vec![angle.sin(), angle.cos()]
}

/// Bounds an infinite cone by the half space below its apex.
pub fn infinite_cone_bounds(_: &[f64]) -> Bounds {
    Bounds {
        min: [-f64::INFINITY; 3],
        max: [f64::INFINITY, 0.0, f64::INFINITY],
    }
}

/// Returns the signed distance to a truncated cone with the radii `bottom` and `top`. `across` is the unit normal
/// of its side, in the half plane of (distance from the axis, height), and `slope` the side's length.
#[inline(always)]
pub fn cone<R: Real>(p: R::Vec3, bottom: R, top: R, half: R, slope: R, across: R::Vec2) -> R {
    let q = R::Vec2::new(p.xz().length(), p.y()).named("q");
    let zero = lit::<R>(0.0);
    // Beyond the nearer of the two discs.
    let end = R::select(q.y().less(zero), bottom, top);
    let disc = (q.y().abs() - half).named("disc");
    let over_disc = R::and(zero.less(disc), q.x().less(end));
    // Signed distance from the side, and position along it from the bottom's rim.
    let rim = R::Vec2::new(q.x() - bottom, q.y() + half).named("rim");
    let side = rim.dot(across).named("side");
    let along = (rim.y() * across.x() - rim.x() * across.y()).named("along");
    let beside = R::and(zero.less(along), along.less(slope));
    let upper_rim = R::Vec2::new(q.x() - top, q.y() - half);
    let to_rim = R::Vec2::select(along.less(slope), rim, upper_rim).length();
    let outside = R::select(
        over_disc,
        disc,
        R::select(R::and(zero.less(side), beside), side, to_rim),
    );
    let depth = disc.max(side).named("depth");
    R::select(zero.less(depth), outside, depth)
}

/// Converts the radii at bottom and top and the height to a cone with the length and the normal of its
/// side.
pub fn cone_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let (bottom, top, h) = (a[0], a[1], half(a[2]));
    let (slope, across) = side(bottom, top, h);
    vec![bottom, top, h, slope, across[0], across[1]]
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

/// Returns the signed distance to a cone with rounded rims: the offset by `round` of a smaller sharp one. The
/// centre of that one is at `middle` along y.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "a body's parameters are its row's"
)]
pub fn rounded_cone<R: Real>(
    p: R::Vec3,
    bottom: R,
    top: R,
    half: R,
    slope: R,
    across: R::Vec2,
    middle: R,
    round: R,
) -> R {
    let q = R::Vec3::new(p.x(), p.y() - middle, p.z());
    cone::<R>(q, bottom, top, half, slope, across) - round
}

/// Converts a rounded cone to the sharp cone whose offset by `round` it is. All of its planes are moved in by
/// `round`, or by the largest possible amount.
pub fn rounded_cone_parameters<R: Real>(a: &[R]) -> Vec<R> {
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

/// Bounds a rounded cone: a truncated cone around its centre, grown by the rounding.
pub fn rounded_cone_bounds(a: &[f64]) -> Bounds {
    let r = a[0].max(a[1]);
    let mut b = Bounds::centred([r, a[2], r]).grown(a[7]);
    b.min[1] += a[6];
    b.max[1] += a[6];
    b
}

/// Returns the signed distance to the hull of two spheres on the y axis, of the radii `lower` and `upper`. The
/// first one's centre is at `low`, the second one's is `height` above it. `slant` is the unit vector across the
/// side, in the half plane of (distance from the axis, height).
#[inline(always)]
pub fn round_cone<R: Real>(p: R::Vec3, lower: R, upper: R, low: R, height: R, slant: R::Vec2) -> R {
    let q = R::Vec2::new(p.xz().length(), p.y() - low).named("q");
    // The position along the side, which selects one of the spheres or the side.
    let k = (q.y() * slant.x() - q.x() * slant.y()).named("k");
    let beyond = R::Vec2::new(q.x(), q.y() - height).length() - upper;
    let side = q.dot(slant) - lower;
    let rest = R::select((height * slant.x()).less(k), beyond, side);
    R::select(k.less(lit(0.0)), q.length() - lower, rest)
}

/// Converts two radii and the distance of two spheres to the parameters of their hull. If one sphere
/// contains the other, both become the larger one.
pub fn round_cone_parameters<R: Real>(a: &[R]) -> Vec<R> {
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

/// Bounds the hull of two spheres, given their radii, the height of the first centre and the distance of the
/// second.
pub fn round_cone_bounds(a: &[f64]) -> Bounds {
    let ball = |r: f64, y: f64| Bounds {
        min: [-r, y - r, -r],
        max: [r, y + r, r],
    };
    ball(a[0], a[2]).hull(&ball(a[1], a[2] + a[3]))
}
