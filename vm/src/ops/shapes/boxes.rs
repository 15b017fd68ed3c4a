//! Boxes with sharp and rounded edges, and their frames.

use crate::ops::prepare::half;
use crate::real::{Real, Vector3, lit};

/// Returns the signed distance to a box with sharp edges. `q` is the signed distance of the point to each pair of
/// faces. Outside, the result is the length of its positive part; inside, its largest (negative) component.
///
/// The zero is the first operand of the minimum: of equal values, the second one gives the gradient. So a
/// point on a face has the face's gradient.
#[inline(always)]
pub fn cuboid<R: Real>(p: R::Vec3, half: R::Vec3) -> R {
    let q = (p.abs() - half).named("q");
    q.max(R::Vec3::splat(lit(0.0))).length() + lit::<R>(0.0).min(q.max_component())
}

/// Returns the signed distance to a box with rounded edges: the offset of a smaller sharp one by `round`.
#[inline(always)]
pub fn rounded_cuboid<R: Real>(p: R::Vec3, half: R::Vec3, round: R) -> R {
    cuboid::<R>(p, half - R::Vec3::splat(round)) - round
}

/// Converts full sizes and a rounding radius. The radius is limited to the smallest half size.
pub fn rounded_cuboid_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let size = [half(a[0]), half(a[1]), half(a[2])];
    let round = a[3].min(size[0]).min(size[1]).min(size[2]);
    vec![size[0], size[1], size[2], round]
}

/// Returns the distance to the twelve edges of a box, as bars of the half thickness `bar`, flush with its faces.
/// By symmetry, three bars that meet in one corner remain; each is a box that is long in one direction.
#[inline(always)]
pub fn box_frame<R: Real>(p: R::Vec3, half: R::Vec3, bar: R) -> R {
    let bars = R::Vec3::splat(bar);
    let q = (p.abs() - half).named("q");
    let e = ((q + bars).abs() - bars).named("e");
    one_bar(q.x(), e.y(), e.z())
        .min(one_bar(e.x(), q.y(), e.z()))
        .min(one_bar(e.x(), e.y(), q.z()))
}

/// Returns the distance to a bar, from the signed distance of the point to each pair of its faces. (A function,
/// because a closure would not be compiled into each loop over lanes.)
#[inline(always)]
fn one_bar<R: Real>(x: R, y: R, z: R) -> R {
    let v = R::Vec3::new(x, y, z);
    v.max(R::Vec3::splat(lit(0.0))).length() + lit::<R>(0.0).min(v.max_component())
}

/// Converts full sizes and the thickness of the bars, which is limited by the size.
pub fn box_frame_parameters<R: Real>(a: &[R]) -> Vec<R> {
    rounded_cuboid_parameters(&[a[0], a[1], a[2], half(a[3])])
}
