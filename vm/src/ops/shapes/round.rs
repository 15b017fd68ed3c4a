//! Round solids: spheres and ellipsoids, capsules, rings and links.

use crate::bounds::Bounds;
use crate::ops::prepare::{from_vec3, half, inverse, vec3};
use crate::real::{Real, Vector2, Vector3, lit};

/// Returns the signed distance to a sphere: the distance to the centre, minus the radius.
#[inline(always)]
pub fn sphere<R: Real>(p: R::Vec3, r: R) -> R {
    p.length() - r
}

/// Returns the signed distance to an ellipsoid with the radii `r`; see [`crate::ellipsoid`].
#[inline(always)]
pub fn ellipsoid<R: Real>(p: R::Vec3, r: R::Vec3) -> R {
    R::ellipsoid(p, r)
}

/// Returns the signed distance to all points within `r` of a segment of the y axis.
#[inline(always)]
pub fn capsule<R: Real>(p: R::Vec3, half: R, r: R) -> R {
    let y = p.y() - p.y().clamp(-half, half);
    R::Vec3::new(p.x(), y, p.z()).length() - r
}

/// Returns the signed distance to all points within `r` of the segment from `start` to `start + axis`. `inverse`
/// is one over its squared length, or zero for an empty segment.
#[inline(always)]
pub fn capsule_between<R: Real>(p: R::Vec3, start: R::Vec3, r: R, axis: R::Vec3, inverse: R) -> R {
    let q = (p - start).named("q");
    let t = (q.dot(axis) * inverse).saturate();
    (q - axis * t).length() - r
}

/// Converts two end points and a radius to a start, a radius, an axis, and one over its squared length.
pub fn capsule_between_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let (from, to) = (vec3::<R>(a), vec3::<R>(&a[3..]));
    let axis = to - from;
    let mut v = from_vec3::<R>(from);
    v.push(a[6]);
    v.extend(from_vec3::<R>(axis));
    v.push(inverse(axis.dot(axis)));
    v
}

/// Bounds a capsule between two points, given its start, radius and axis.
pub fn capsule_between_bounds(a: &[f64]) -> Bounds {
    let (from, to) = ([a[0], a[1], a[2]], [a[0] + a[4], a[1] + a[5], a[2] + a[6]]);
    Bounds::EMPTY.including(from).including(to).grown(a[3])
}

/// Returns the signed distance to all points within `tube` of a circle of radius `ring` in the xz plane.
#[inline(always)]
pub fn torus<R: Real>(p: R::Vec3, ring: R, tube: R) -> R {
    R::Vec2::new(p.xz().length() - ring, p.y()).length() - tube
}

/// Returns the signed distance to all points within `tube` of an arc in the xz plane, symmetric about the positive
/// x axis. `end` is the direction of one of its ends. Beyond the ends, the end is the nearest point.
#[inline(always)]
pub fn capped_torus<R: Real>(p: R::Vec3, ring: R, tube: R, end: R::Vec2) -> R {
    let z = p.z().abs().named("z");
    let beside = (end.x() * z).less(end.y() * p.x());
    let to_end = R::Vec3::new(p.x() - end.x() * ring, p.y(), z - end.y() * ring);
    let to_ring = R::Vec3::new(p.xz().length() - ring, p.y(), lit(0.0));
    R::Vec3::select(beside, to_ring, to_end).length() - tube
}

/// Converts two radii and an angle to the radii and the direction of the arc's end. The arc is limited to
/// slightly less than a full turn, where its ends would coincide.
pub fn capped_torus_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let angle = half(a[2]).clamp(lit(0.0), lit(std::f64::consts::PI - 1e-4));
    vec![a[0], a[1], angle.cos(), angle.sin()]
}

/// Bounds an arc of a torus, given its ring, its tube and the direction of its end.
pub fn capped_torus_bounds(a: &[f64]) -> Bounds {
    let (ring, tube, cosine, sine) = (a[0], a[1], a[2], a[3]);
    let z = if cosine < 0.0 { ring } else { ring * sine };
    Bounds {
        min: [ring * cosine, 0.0, -z],
        max: [ring, 0.0, z],
    }
    .grown(tube)
}

/// Returns the distance to a link of a chain in the xy plane: a torus elongated by `half` along y in both
/// directions.
#[inline(always)]
pub fn link<R: Real>(p: R::Vec3, half: R, ring: R, tube: R) -> R {
    let y = p.y() - p.y().clamp(-half, half);
    let around = R::Vec2::new(p.x(), y).length() - ring;
    R::Vec2::new(around, p.z()).length() - tube
}
