//! Solids. Each is centred at the origin with its axis along y, unless it says otherwise.

mod periodic;
mod pointed;

pub use periodic::{diamond, gyroid, schwarz_p};
pub use pointed::{
    cone, infinite_cone, octahedron, pyramid, round_cone, rounded_cone, tetrahedron,
};

use crate::ops::dimension::corner;
use crate::ops::shapes2::polygon_sector;
use crate::real::{Real, Vector2, Vector3, lit};

/// A sphere: the distance to the centre, minus the radius.
#[inline(always)]
pub fn sphere<R: Real>(p: R::Vec3, r: R) -> R {
    p.length() - r
}

/// A box with sharp edges. `q` is the signed distance of the point to each pair of faces. Outside, the
/// result is the length of its positive part; inside, its largest (negative) component. (The zero is the
/// first operand of the minimum because of equal values the second one gives the gradient: on a face, the
/// face's.)
#[inline(always)]
pub fn cuboid<R: Real>(p: R::Vec3, half: R::Vec3) -> R {
    let q = (p.abs() - half).named("q");
    q.max(R::Vec3::splat(lit(0.0))).length() + lit::<R>(0.0).min(q.max_component())
}

/// A box with rounded edges: the offset of a smaller sharp one by `round`.
#[inline(always)]
pub fn rounded_cuboid<R: Real>(p: R::Vec3, half: R::Vec3, round: R) -> R {
    cuboid::<R>(p, half - R::Vec3::splat(round)) - round
}

/// The twelve edges of a box as bars of the half thickness `bar`, flush with its faces. By symmetry, three
/// bars that meet in one corner remain; each is a box that is long in one direction.
#[inline(always)]
pub fn box_frame<R: Real>(p: R::Vec3, half: R::Vec3, bar: R) -> R {
    let bars = R::Vec3::splat(bar);
    let q = (p.abs() - half).named("q");
    let e = ((q + bars).abs() - bars).named("e");
    one_bar(q.x(), e.y(), e.z())
        .min(one_bar(e.x(), q.y(), e.z()))
        .min(one_bar(e.x(), e.y(), q.z()))
}

/// A bar, from the signed distance of the point to each pair of its faces. (A function, because a closure
/// would not be compiled into each loop over lanes.)
#[inline(always)]
fn one_bar<R: Real>(x: R, y: R, z: R) -> R {
    let v = R::Vec3::new(x, y, z);
    v.max(R::Vec3::splat(lit(0.0))).length() + lit::<R>(0.0).min(v.max_component())
}

/// All points within `r` of a segment of the y axis.
#[inline(always)]
pub fn capsule<R: Real>(p: R::Vec3, half: R, r: R) -> R {
    let y = p.y() - p.y().clamp(-half, half);
    R::Vec3::new(p.x(), y, p.z()).length() - r
}

/// All points within `r` of the segment from `start` to `start + axis`. `inverse` is one over its squared
/// length, or zero for an empty segment.
#[inline(always)]
pub fn capsule_between<R: Real>(p: R::Vec3, start: R::Vec3, r: R, axis: R::Vec3, inverse: R) -> R {
    let q = (p - start).named("q");
    let t = (q.dot(axis) * inverse).saturate();
    (q - axis * t).length() - r
}

/// All points within `tube` of a circle of radius `ring` in the xz plane.
#[inline(always)]
pub fn torus<R: Real>(p: R::Vec3, ring: R, tube: R) -> R {
    R::Vec2::new(p.xz().length() - ring, p.y()).length() - tube
}

/// All points within `tube` of an arc in the xz plane, symmetric about the positive x axis. `end` is the
/// direction of one of its ends. Beyond the ends, the end is the nearest point.
#[inline(always)]
pub fn capped_torus<R: Real>(p: R::Vec3, ring: R, tube: R, end: R::Vec2) -> R {
    let z = p.z().abs().named("z");
    let beside = (end.x() * z).less(end.y() * p.x());
    let to_end = R::Vec3::new(p.x() - end.x() * ring, p.y(), z - end.y() * ring);
    let to_ring = R::Vec3::new(p.xz().length() - ring, p.y(), lit(0.0));
    R::Vec3::select(beside, to_ring, to_end).length() - tube
}

/// A cylinder with sharp rims.
#[inline(always)]
pub fn cylinder<R: Real>(p: R::Vec3, r: R, half: R) -> R {
    corner::<R>(R::Vec2::new(p.xz().length() - r, p.y().abs() - half))
}

/// A cylinder with rounded rims: the offset of a smaller sharp one by `round`.
#[inline(always)]
pub fn rounded_cylinder<R: Real>(p: R::Vec3, r: R, half: R, round: R) -> R {
    cylinder::<R>(p, r - round, half - round) - round
}

/// A cylinder around the line through `middle` along the unit vector `axis`.
#[inline(always)]
pub fn cylinder_between<R: Real>(p: R::Vec3, middle: R::Vec3, r: R, axis: R::Vec3, half: R) -> R {
    let q = (p - middle).named("q");
    let t = q.dot(axis).named("t");
    corner::<R>(R::Vec2::new((q - axis * t).length() - r, t.abs() - half))
}

/// An ellipsoid with the radii `r`; see [`crate::ellipsoid`].
#[inline(always)]
pub fn ellipsoid<R: Real>(p: R::Vec3, r: R::Vec3) -> R {
    R::ellipsoid(p, r)
}

/// The half space below a plane with the unit normal `normal`, at the signed distance `at` from the origin.
#[inline(always)]
pub fn plane<R: Real>(p: R::Vec3, normal: R::Vec3, at: R) -> R {
    p.dot(normal) - at
}

/// All points within `half` of the plane through the origin with the unit normal `normal`.
#[inline(always)]
pub fn slab<R: Real>(p: R::Vec3, normal: R::Vec3, half: R) -> R {
    p.dot(normal).abs() - half
}

/// A regular prism with a corner edge on the +x side.
#[inline(always)]
pub fn prism<R: Real>(p: R::Vec3, sector: R, inverse: R, apothem: R, side: R, half: R) -> R {
    let d = polygon_sector::<R>(p.xz(), sector, inverse, apothem, side);
    corner::<R>(R::Vec2::new(d, p.y().abs() - half))
}

/// A link of a chain in the xy plane: a torus elongated by `half` along y in both directions.
#[inline(always)]
pub fn link<R: Real>(p: R::Vec3, half: R, ring: R, tube: R) -> R {
    let y = p.y() - p.y().clamp(-half, half);
    let around = R::Vec2::new(p.x(), y).length() - ring;
    R::Vec2::new(around, p.z()).length() - tube
}
