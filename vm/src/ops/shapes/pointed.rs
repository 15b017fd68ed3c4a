//! Solids with an apex or corners: cones, pyramids, the octahedron and the tetrahedron.

use crate::real::{Real, Vector2, Vector3, lit};

/// An infinite cone with its apex at the origin, opening towards −y. `side` is the unit vector along its
/// side in the half plane of (distance from the axis, depth below the apex).
#[inline(always)]
pub fn infinite_cone<R: Real>(p: R::Vec3, side: R::Vec2) -> R {
    let q = R::Vec2::new(p.xz().length(), -p.y()).named("q");
    // Beside the side's line, the distance is to that line; behind the apex, to the apex.
    let beside = q.x() * side.y() - q.y() * side.x();
    R::select(q.dot(side).less(lit(0.0)), q.length(), beside)
}

/// A truncated cone with the radii `bottom` and `top`. `across` is the unit normal of its side, in the half
/// plane of (distance from the axis, height), and `slope` the side's length.
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

/// A cone with rounded rims: the offset by `round` of a smaller sharp one with its centre at `middle` along
/// y.
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

/// The hull of two spheres on the y axis, of the radii `lower` and `upper`. The first one's centre is at
/// `low`, the second one's is `height` above it. `slant` is the unit vector across the side, in the half
/// plane of (distance from the axis, height).
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

/// An octahedron with its corners on the axes, at the distance `r`. The octant of the point contains one
/// face. For a point beyond one of its edges, the distance is to that edge.
#[inline(always)]
pub fn octahedron<R: Real>(p: R::Vec3, r: R) -> R {
    let q = p.abs().named("q");
    let m = (q.x() + q.y() + q.z() - r).named("m");
    let three = lit::<R>(3.0);
    let beyond_x = (q.x() * three).less(m);
    let beyond_y = (q.y() * three).less(m);
    let beyond_z = (q.z() * three).less(m);
    // The coordinates permuted so that the edge lies in the plane where the first one is zero.
    let yz = R::Vec3::select(beyond_y, R::Vec3::new(q.y(), q.z(), q.x()), {
        R::Vec3::new(q.z(), q.x(), q.y())
    });
    let e = R::Vec3::select(beyond_x, q, yz).named("e");
    let k = ((e.z() - e.y() + r) * lit(0.5))
        .clamp(lit(0.0), r)
        .named("k");
    let edge = R::Vec3::new(e.x(), e.y() - r + k, e.z() - k).length();
    let any = R::or(beyond_x, R::or(beyond_y, beyond_z));
    R::select(any, edge, m * lit(0.577_350_269_189_625_8))
}

/// A tetrahedron whose faces are at the distance `inner` from the centre. By symmetry, the coordinates are
/// sorted by magnitude, and only the last one may be negative. The nearest edge then has its middle on the
/// x axis, and is parallel to the diagonal of y and z.
#[inline(always)]
pub fn tetrahedron<R: Real>(p: R::Vec3, inner: R) -> R {
    let q = p.abs().named("q");
    // Of equal values, each takes its second operand, so that no coordinate is used twice.
    let (low, high) = (q.x().min(q.y()), q.y().max(q.x()));
    let between = high.min(q.z()).named("between");
    let x = q.z().max(high).named("x");
    let y = between.max(low).named("y");
    let side = p.x().sign_nonzero() * p.y().sign_nonzero() * p.z().sign_nonzero();
    let z = (low.min(between) * side).named("z");
    // Half of the edge of the cube that shares the corners of the tetrahedron.
    let half = (inner * lit(1.732_050_807_568_877_2)).named("half");
    let plane = (x + y - z) * lit(0.577_350_269_189_625_8) - inner;
    let across = ((y - z) * lit(std::f64::consts::FRAC_1_SQRT_2)).named("across");
    let along = ((y + z) * lit(std::f64::consts::FRAC_1_SQRT_2)).named("along");
    let beyond = (along - half * lit(std::f64::consts::SQRT_2)).max(lit(0.0));
    let outward = (x - half).named("outward");
    let edge = R::Vec3::new(outward, across, beyond).length();
    // The side of the edge in the plane of the face.
    let is_edge = across.less(outward * lit(std::f64::consts::SQRT_2));
    R::select(is_edge, edge, plane)
}

/// A pyramid on a square of the half side `base`, from −`half` to `half` along y. `across` is the unit
/// normal of the +x side in the xy plane. `slope` is the length of a side from the middle of its lower edge
/// to the apex. `inverse` is one over the squared length of an edge up to the apex.
#[inline(always)]
pub fn pyramid<R: Real>(p: R::Vec3, base: R, half: R, across: R::Vec2, slope: R, inverse: R) -> R {
    let zero = lit::<R>(0.0);
    let (ax, az) = (p.x().abs(), p.z().abs());
    // By symmetry, half of one side remains: the one towards +x, for 0 ≤ z ≤ x. `x` and `z` are relative to
    // the corner of the base, `y` to its plane. Of equal values, each takes its second operand.
    let x = (ax.max(az) - base).named("x");
    let z = (az.min(ax) - base).named("z");
    let y = (p.y() + half).named("y");
    // In the plane of the side: z along its lower edge, v up the slope, w away from it.
    let w = (x * across.x() + y * across.y()).named("w");
    let v = (y * across.x() - x * across.y()).named("v");
    let over_side = R::and(zero.less(v), (z * slope + v * base).less(zero));
    // The edge up to the apex, and the lower edge.
    let t = ((v * slope - z * base) * inverse).saturate().named("t");
    let edge = R::Vec2::new(z + base * t, v - slope * t).named("edge");
    let lower = R::Vec2::new(z.max(zero), v).named("lower");
    let to_edge = (w * w + edge.dot(edge).min(lower.dot(lower))).sqrt();
    let over_base = R::and(x.less(zero), y.less(zero));
    let beside = R::select(R::and(over_side, zero.less(w)), w, to_edge);
    let outside = R::select(over_base, -y, beside);
    let depth = (-y).max(w).named("depth");
    R::select(zero.less(depth), outside, depth)
}
