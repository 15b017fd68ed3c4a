//! The direction that a surface faces: from the field's gradient, or from differences.
//!
//! Each scheme of differences is a list of taps. A tap is an offset from the point, in units of the tap
//! distance, and a weight. The sum of weight times field is parallel to the gradient. So each kernel
//! evaluates the scene in one place, in a loop.

use crate::features::Normals;
use sdfc_vm::real::{Real, Vector3, lit};

/// A tap: its offset and its weight.
pub type Tap = ([f32; 3], [f32; 3]);

const X: [f32; 3] = [1.0, 0.0, 0.0];
const Y: [f32; 3] = [0.0, 1.0, 0.0];
const Z: [f32; 3] = [0.0, 0.0, 1.0];
const NEG_X: [f32; 3] = [-1.0, 0.0, 0.0];
const NEG_Y: [f32; 3] = [0.0, -1.0, 0.0];
const NEG_Z: [f32; 3] = [0.0, 0.0, -1.0];

const FORWARD: [Tap; 4] = [(X, X), (Y, Y), (Z, Z), ([0.0; 3], [-1.0; 3])];
const REVERSE: [Tap; 4] = [
    (NEG_X, NEG_X),
    (NEG_Y, NEG_Y),
    (NEG_Z, NEG_Z),
    ([0.0; 3], [1.0; 3]),
];
const CENTRAL: [Tap; 6] = [
    (X, X),
    (NEG_X, NEG_X),
    (Y, Y),
    (NEG_Y, NEG_Y),
    (Z, Z),
    (NEG_Z, NEG_Z),
];
const TETRAHEDRON: [Tap; 4] = [
    ([1.0, -1.0, -1.0], [1.0, -1.0, -1.0]),
    ([-1.0, -1.0, 1.0], [-1.0, -1.0, 1.0]),
    ([-1.0, 1.0, -1.0], [-1.0, 1.0, -1.0]),
    ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]),
];

/// Returns the taps of a scheme of differences; none for the exact gradient.
pub fn taps(normals: Normals) -> &'static [Tap] {
    match normals {
        Normals::Exact => &[],
        Normals::Forward => &FORWARD,
        Normals::Reverse => &REVERSE,
        Normals::Central | Normals::Wide => &CENTRAL,
        Normals::Tetrahedron => &TETRAHEDRON,
    }
}

/// The scheme of differences where the exact gradient is unusable: across a discontinuity of the field.
pub const AT_DISCONTINUITIES: Normals = Normals::Central;

/// Maximum number of taps of a scheme.
const MAX_TAPS: usize = CENTRAL.len();
/// The distinct sets of taps.
const TAP_SETS: [&[Tap]; 4] = [&FORWARD, &REVERSE, &CENTRAL, &TETRAHEDRON];

/// Returns the taps of all sets, one after the other, for kernels that can use any of them. All sets are
/// padded to the same length, with taps of weight zero.
pub fn tap_table() -> Vec<Tap> {
    let empty = ([0.0; 3], [0.0; 3]);
    let padded = |taps: &&'static [Tap]| {
        let fill = MAX_TAPS - taps.len();
        taps.iter().copied().chain(std::iter::repeat_n(empty, fill))
    };
    TAP_SETS.iter().flat_map(padded).collect()
}

/// Returns the index of the first tap of a scheme in the [`tap_table`]; 0 for the exact gradient.
pub fn first_tap(normals: Normals) -> usize {
    let set = taps(normals);
    let index = TAP_SETS.iter().position(|taps| *taps == set);
    index.unwrap_or(0) * MAX_TAPS
}

/// Returns the distance of the taps, in halves of a pixel. It is less for schemes with an error of first
/// order in it.
pub fn tap_spread(normals: Normals) -> f32 {
    match normals {
        Normals::Wide => 1.0,
        Normals::Exact | Normals::Central => 0.2,
        Normals::Forward | Normals::Reverse | Normals::Tetrahedron => 0.02,
    }
}

/// Returns the distance of a tap from the point. It is `spread_half_pixels` halves of a pixel, but at least
/// sixteen units in the last place of the largest coordinate, so that both points differ.
#[inline(always)]
pub fn tap_distance<R: Real>(p: R::Vec3, half_pixel: R, spread_half_pixels: R) -> R {
    let largest = p.abs().max_component();
    (half_pixel * spread_half_pixels)
        .max(largest * lit(2e-6))
        .max(lit(1e-12))
}

/// Distance before the end of a ray at which the exact gradient is evaluated, in units of the field's
/// rounding error.
const OUTSIDE_ROUNDINGS: f64 = 8.0;

/// Returns the distance before the end of a ray at which the exact gradient is evaluated. Where two faces
/// meet or coincide, the visible one decides the field just outside.
#[inline(always)]
pub fn outside_distance<R: Real>(rounding: R) -> R {
    rounding * lit(OUTSIDE_ROUNDINGS)
}

/// Returns 1 where the field `value` just beside a surface exceeds what the gradient of length `slope`
/// explains, else 0. Then the gradient is that of another shape, whose value was divided by a large bound, or
/// the field is discontinuous.
#[inline(always)]
pub fn is_doubtful<R: Real>(value: R, slope: R, rounding: R) -> R {
    let max_value = slope * rounding * lit(2.0 * OUTSIDE_ROUNDINGS);
    R::select(max_value.less(value.abs()), lit(1.0), lit(0.0))
}

/// Returns 1 where the field has a discontinuity beside a surface, else 0. By `value` and a gradient of
/// length `slope`, there is no zero within `distance`, at which differences are taken instead.
#[inline(always)]
pub fn is_discontinuous<R: Real>(value: R, slope: R, distance: R) -> R {
    R::select((slope * distance).less(value.abs()), lit(1.0), lit(0.0))
}

/// Depth below a surface at which its material is evaluated, in units of rounding.
const INSIDE_ROUNDINGS: f64 = 8.0;

/// Returns the depth below a surface at which its material is evaluated. There a skin of no thickness, as a
/// flush cut leaves, is absent, and the material behind it is visible.
#[inline(always)]
pub fn inside_depth<R: Real>(rounding: R) -> R {
    rounding * lit(INSIDE_ROUNDINGS)
}

/// Returns the direction of a gradient; without one (on an edge of the field, or beyond finite numbers), the
/// direction back along the ray. A gradient that points along the ray, as that of a field without a sign may,
/// is turned round. `side` is −1 for rays that started inside.
#[inline(always)]
pub fn facing<R: Real>(gradient: R::Vec3, direction: R::Vec3, side: R) -> R::Vec3 {
    // Scaled first: squares of the small differences between taps can underflow.
    let largest = gradient.abs().max_component().named("largest");
    let is_usable = R::and(lit::<R>(1e-30).less(largest), largest.less(lit(1e30)));
    let scale = side / R::select(is_usable, largest, lit(1.0));
    let normal = R::Vec3::select(is_usable, gradient * scale, -direction).normalize();
    let faces_away = lit::<R>(MAX_AWAY_COSINE).less(normal.dot(direction));
    normal * R::select(faces_away, lit(-1.0), lit(1.0))
}

/// Maximum cosine between a normal and its ray, by rounding and curved surfaces.
const MAX_AWAY_COSINE: f64 = 0.05;

/// Returns the normal of a surface displaced by a height with the gradient `bump`.
#[inline(always)]
pub fn bumped<R: Real>(normal: R::Vec3, bump: R::Vec3) -> R::Vec3 {
    // Only the tangential component of the gradient tilts the surface.
    let tilt = bump - normal * bump.dot(normal);
    (normal - tilt).normalize()
}

/// Height above a surface at which secondary rays start, in halves of a pixel.
const LIFT_HALF_PIXELS: f64 = 0.25;
/// Height for sharp shadows, in halves of a pixel. It is lower, since lifted rays shorten the shadows of low
/// lights.
const SHARP_LIFT_HALF_PIXELS: f64 = 0.0625;

/// Returns the height above a surface at which secondary rays start, along the normal: enough for a positive
/// field there. `is_sharp` is 1 for sharp shadows, else 0.
#[inline(always)]
pub fn lift<R: Real>(p: R::Vec3, half_pixel: R, rounding: R, is_sharp: R) -> R {
    let largest = p.abs().max_component();
    let half_pixels = R::select(
        lit::<R>(0.5).less(is_sharp),
        lit(SHARP_LIFT_HALF_PIXELS),
        lit(LIFT_HALF_PIXELS),
    );
    (half_pixel * half_pixels)
        .max(rounding * lit(4.0))
        .max(largest * lit(4e-6))
}
