//! Ambient occlusion: the fraction of the sky that is visible from a surface, from samples of the field
//! around it.
//!
//! A tap samples the field at a distance from the surface. Were the surface a plane with nothing on it, the
//! field there would be the height above it; the deficit is taken for hidden sky.

use crate::marching::{MARGIN_ROUNDINGS, rounding_at};
use sdfc_vm::real::{Real, Vector3, lit};

/// Angle between two directions of a spiral that distributes them evenly.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653_3;

/// Returns the distance of a tap along the normal: `index` counts from 0 to 4, and taps are closer together
/// near the surface.
#[inline(always)]
pub fn five_tap_distance<R: Real>(index: R, reach: R) -> R {
    let fraction = (index + lit(1.0)) * lit(0.2);
    reach * fraction * fraction
}

/// Deficit of the field at an open tap, in units of the field's rounding error: those of the hit and of the tap.
const OPEN_ROUNDINGS: f64 = 1.0 + MARGIN_ROUNDINGS;

/// Returns the part of a field's value at a tap that counts as open, for a surface at `t` along a ray.
#[inline(always)]
pub fn open_margin<R: Real>(t: R, rounding: R) -> R {
    rounding_at(t, rounding) * lit(OPEN_ROUNDINGS)
}

/// Maximum fraction of the sky that five taps along the normal hide. A wall beside them counts as if it stood
/// in front, though it hides at most half.
pub const MAX_FIVE_TAP_OCCLUSION: f32 = 0.6;

/// Returns the weight of a tap along the normal: near ones weigh most.
#[inline(always)]
pub fn five_tap_weight<R: Real>(index: R) -> R {
    lit::<R>(1.0) / (index + lit(1.0))
}

/// Returns the direction of a tap over the hemisphere around `normal`. The directions are distributed by the
/// cosine, as the light of a uniform sky. `seed`, the pixel and the pass, rotates all of them by a random
/// angle.
#[inline(always)]
pub fn hemisphere_direction<R: Real>(
    normal: R::Vec3,
    index: R,
    count: R,
    seed: R::Vec3,
) -> R::Vec3 {
    let up = hemisphere_cosine(index, count).named("up");
    let radius = (lit::<R>(1.0) - up * up)
        .max(lit(0.0))
        .sqrt()
        .named("radius");
    let pixel_angle = pixel_hash::<R>(seed).x() * lit(std::f64::consts::PI);
    let turn = (index * lit(GOLDEN_ANGLE) + pixel_angle).named("turn");
    let (tangent, bitangent) = tangent_frame::<R>(normal);
    tangent * (radius * turn.cos()) + bitangent * (radius * turn.sin()) + normal * up
}

/// Returns the distance of a tap over the hemisphere. The order of distances is independent of the angles, or
/// one side would have all the far taps. (The powers of 0.7548… distribute evenly together with most others.)
#[inline(always)]
pub fn hemisphere_distance<R: Real>(index: R, seed: R::Vec3, reach: R) -> R {
    let order =
        ((index + lit(0.5)) * lit(0.754_877_666_246_693) + pixel_hash::<R>(seed).y()).fract();
    let fraction = (order * lit(0.9) + lit(0.1)).named("fraction");
    reach * fraction * fraction
}

/// Returns random numbers of a pixel, in [-1, 1).
#[inline(always)]
fn pixel_hash<R: Real>(seed: R::Vec3) -> R::Vec3 {
    R::lattice(seed, lit(7.0)).named("hash")
}

/// Returns the cosine between the normal and a tap's direction: its squares are distributed evenly.
#[inline(always)]
pub fn hemisphere_cosine<R: Real>(index: R, count: R) -> R {
    (lit::<R>(1.0) - (index + lit(0.5)) / count)
        .max(lit(0.0))
        .sqrt()
}

/// Returns the hidden part of the weight of a tap. `height` is the field above a plane, `distance` that of
/// the tap from the point. A field of half the height counts as open: an obstacle beside a tap hides
/// little, and many fields are lower bounds of the distance.
#[inline(always)]
pub fn hidden_weight<R: Real>(field: R, height: R, distance: R, weight: R) -> R {
    (height - field * lit::<R>(2.0)).clamp(lit(0.0), height) / distance.max(lit(1e-20)) * weight
}

/// Returns 1 if the field at a tap, taken for a distance, would hide something, else 0: an occluder
/// candidate. `slope` is the length of the field's gradient at the surface, which scales the field here.
#[inline(always)]
pub fn is_candidate<R: Real>(field: R, height: R, slope: R) -> R {
    let is_near = (field * lit::<R>(2.0)).less(height * slope);
    R::select(
        R::and(lit::<R>(0.0).less(field), is_near),
        lit(1.0),
        lit(0.0),
    )
}

/// Returns the maximum distance from a tap of a surface that hides something.
#[inline(always)]
pub fn candidate_limit<R: Real>(height: R) -> R {
    height * lit(0.5)
}

/// Returns the visible fraction of the sky: `hidden_sum` is the sum over all taps, `weight_sum` its maximum.
#[inline(always)]
pub fn open_fraction<R: Real>(hidden_sum: R, weight_sum: R) -> R {
    (lit::<R>(1.0) - hidden_sum / weight_sum.max(lit(1e-20))).saturate()
}

/// Returns two directions at right angles to a normal and to each other (T. Duff and others, *Building an
/// Orthonormal Basis, Revisited*, 2017).
#[inline(always)]
pub fn tangent_frame<R: Real>(n: R::Vec3) -> (R::Vec3, R::Vec3) {
    let side = n.z().sign_nonzero().named("side");
    let a = (lit::<R>(-1.0) / (side + n.z())).named("a");
    let b = (n.x() * n.y() * a).named("b");
    (
        R::Vec3::new(
            lit::<R>(1.0) + side * n.x() * n.x() * a,
            side * b,
            -(side * n.x()),
        ),
        R::Vec3::new(b, side + n.y() * n.y() * a, -n.y()),
    )
}
