//! Solids with flat faces besides boxes: the octahedron, the tetrahedron, pyramids and prisms.

use super::shapes_2d::{ngon_parameters, polygon_sector};
use crate::ops::dimension::corner;
use crate::ops::prepare::{half, halve_last, inverse};
use crate::real::{Real, Vector2, Vector3, lit};

/// Returns the signed distance to an octahedron with its corners on the axes, at the distance `r`. The octant of
/// the point contains one face. For a point beyond one of its edges, the distance is to that edge.
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

/// Returns the signed distance to a tetrahedron whose faces are at the distance `inner` from the centre. By
/// symmetry, the coordinates are sorted by magnitude, and only the last one may be negative. The nearest edge then
/// has its middle on the x axis, and is parallel to the diagonal of y and z.
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

/// Converts the circumradius of a tetrahedron to the distance of its faces.
pub fn tetrahedron_parameters<R: Real>(a: &[R]) -> Vec<R> {
    vec![a[0] * lit(1.0 / 3.0)]
}

/// Returns half the edge of the cube whose corners a tetrahedron shares, given the distance of its faces. The
/// corners lie on diagonals of the cube, three times as far as the faces.
pub fn tetrahedron_half_edge(a: &[f64]) -> f64 {
    a[0] * 3.0_f64.sqrt()
}

/// Returns the signed distance to a pyramid on a square of the half side `base`, from −`half` to `half` along y.
/// `across` is the unit normal of the +x side in the xy plane. `slope` is the length of a side from the middle of
/// its lower edge to the apex. `inverse` is one over the squared length of an edge up to the apex.
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

/// Converts the side of the base and the height.
pub fn pyramid_parameters<R: Real>(a: &[R]) -> Vec<R> {
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

/// Returns the signed distance to a regular prism around the y axis with a corner edge on the +x side.
#[inline(always)]
pub fn prism<R: Real>(p: R::Vec3, sector: R, inverse: R, apothem: R, side: R, half: R) -> R {
    let d = polygon_sector::<R>(p.xz(), sector, inverse, apothem, side);
    corner::<R>(R::Vec2::new(d, p.y().abs() - half))
}

/// Converts a regular prism: the polygon, and the height to the half height.
pub fn prism_parameters<R: Real>(a: &[R]) -> Vec<R> {
    halve_last(&ngon_parameters(a))
}
