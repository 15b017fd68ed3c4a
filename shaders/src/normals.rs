//! The direction a surface faces: from the field's gradient, or from differences.
//!
//! Every way of taking differences is a list of taps, each an offset from the point, in units of
//! the tap distance, and a weight: the sum of weight times field points along the gradient. So
//! each has one place where the scene is evaluated, in a loop.

use crate::features::Normals;
use sdfc_vm::real::{Real, Vector3, lit};

/// A tap: its offset and its weight.
pub type Tap = ([f32; 3], [f32; 3]);

const X: [f32; 3] = [1.0, 0.0, 0.0];
const Y: [f32; 3] = [0.0, 1.0, 0.0];
const Z: [f32; 3] = [0.0, 0.0, 1.0];
const BACK_X: [f32; 3] = [-1.0, 0.0, 0.0];
const BACK_Y: [f32; 3] = [0.0, -1.0, 0.0];
const BACK_Z: [f32; 3] = [0.0, 0.0, -1.0];

const FORWARD: [Tap; 4] = [(X, X), (Y, Y), (Z, Z), ([0.0; 3], [-1.0; 3])];
const REVERSE: [Tap; 4] = [
    (BACK_X, BACK_X),
    (BACK_Y, BACK_Y),
    (BACK_Z, BACK_Z),
    ([0.0; 3], [1.0; 3]),
];
const CENTRAL: [Tap; 6] = [
    (X, X),
    (BACK_X, BACK_X),
    (Y, Y),
    (BACK_Y, BACK_Y),
    (Z, Z),
    (BACK_Z, BACK_Z),
];
const TETRAHEDRON: [Tap; 4] = [
    ([1.0, -1.0, -1.0], [1.0, -1.0, -1.0]),
    ([-1.0, -1.0, 1.0], [-1.0, -1.0, 1.0]),
    ([-1.0, 1.0, -1.0], [-1.0, 1.0, -1.0]),
    ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]),
];

/// The taps of a way of taking differences; none for the exact gradient.
pub fn taps(normals: Normals) -> &'static [Tap] {
    match normals {
        Normals::Exact => &[],
        Normals::Forward => &FORWARD,
        Normals::Reverse => &REVERSE,
        Normals::Central | Normals::Wide => &CENTRAL,
        Normals::Tetrahedron => &TETRAHEDRON,
    }
}

/// The way of taking differences where the exact gradient is of no use: across a jump of the field.
pub const ACROSS_JUMPS: Normals = Normals::Central;

/// The most taps of a way.
const MOST_TAPS: usize = CENTRAL.len();
/// The ways whose taps differ.
const WAYS: [&[Tap]; 4] = [&FORWARD, &REVERSE, &CENTRAL, &TETRAHEDRON];

/// The taps of all ways, one after the other, for kernels that can take any of them: each with as many
/// as the longest has, those that it does not have with a weight of zero.
pub fn table() -> Vec<Tap> {
    let none = ([0.0; 3], [0.0; 3]);
    let padded = |way: &&'static [Tap]| {
        let fill = MOST_TAPS - way.len();
        way.iter().copied().chain(std::iter::repeat_n(none, fill))
    };
    WAYS.iter().flat_map(padded).collect()
}

/// Where the taps of a way of taking differences begin in the [`table`]; 0 for the exact gradient.
pub fn first_in_table(normals: Normals) -> usize {
    let own = taps(normals);
    let way = WAYS.iter().position(|way| *way == own);
    way.unwrap_or(0) * MOST_TAPS
}

/// How far apart the taps are, in halves of a pixel. What is first order in this distance has them
/// closer.
pub fn spread(normals: Normals) -> f32 {
    match normals {
        Normals::Wide => 1.0,
        Normals::Exact | Normals::Central => 0.2,
        Normals::Forward | Normals::Reverse | Normals::Tetrahedron => 0.02,
    }
}

/// How far a tap lies from the point: so many halves of a pixel, but far enough that coordinates
/// can tell it from the point (sixteen units in the last place of the largest).
#[inline(always)]
pub fn tap_distance<R: Real>(p: R::Vec3, half_pixel: R, spread: R) -> R {
    let largest = p.abs().max_component();
    (half_pixel * spread)
        .max(largest * lit(2e-6))
        .max(lit(1e-12))
}

/// How far before its end a ray takes the exact gradient, in units of what rounding can make of the field.
const OUTSIDE_ROUNDINGS: f64 = 8.0;

/// How far before its end a ray takes the exact gradient. Where two faces meet or coincide, the one that is
/// seen decides the field just outside.
#[inline(always)]
pub fn outside<R: Real>(rounding: R) -> R {
    rounding * lit(OUTSIDE_ROUNDINGS)
}

/// 1 where the field `value` just beside a surface is more than the gradient's length `slope` leads to zero from
/// there, else 0: another shape's gradient was taken, whose value is divided by a large bound, or the field jumps.
#[inline(always)]
pub fn is_doubtful<R: Real>(value: R, slope: R, rounding: R) -> R {
    let most = slope * rounding * lit(2.0 * OUTSIDE_ROUNDINGS);
    R::select(most.less(value.abs()), lit(1.0), lit(0.0))
}

/// 1 where the field jumps to `value` beside a surface, else 0: the gradient's length `slope` leads to no zero within
/// the distance `apart`, at which differences are taken instead.
#[inline(always)]
pub fn jumps<R: Real>(value: R, slope: R, apart: R) -> R {
    R::select((slope * apart).less(value.abs()), lit(1.0), lit(0.0))
}

/// The depth below a surface at which its material is asked for, in units of rounding.
const INSIDE_ROUNDINGS: f64 = 8.0;

/// The depth below a surface at which its material is asked for. A skin of no thickness, as a flush cut leaves, is nothing
/// there, and what lies behind it shows.
#[inline(always)]
pub fn inside<R: Real>(rounding: R) -> R {
    rounding * lit(INSIDE_ROUNDINGS)
}

/// The direction of a gradient; where there is none (on an edge of the field, or beyond numbers),
/// the direction back along the ray. A gradient that points along the ray, as that of a field without a sign
/// may, is turned round. `side` is −1 for rays that started inside.
#[inline(always)]
pub fn facing<R: Real>(gradient: R::Vec3, direction: R::Vec3, side: R) -> R::Vec3 {
    // Scaled first: squares of the small differences between taps can vanish.
    let largest = gradient.abs().max_component().named("largest");
    let known = R::and(lit::<R>(1e-30).less(largest), largest.less(lit(1e30)));
    let scale = side / R::select(known, largest, lit(1.0));
    let normal = R::Vec3::select(known, gradient * scale, -direction).normalize();
    let away = lit::<R>(MOST_AWAY).less(normal.dot(direction));
    normal * R::select(away, lit(-1.0), lit(1.0))
}

/// The largest cosine between a normal and its ray that rounding and bent surfaces may cause.
const MOST_AWAY: f64 = 0.05;

/// The normal of a surface that seems displaced by a height with the gradient `bump`.
#[inline(always)]
pub fn bumped<R: Real>(normal: R::Vec3, bump: R::Vec3) -> R::Vec3 {
    // Only the part of the gradient that lies in the surface tilts it.
    let tilt = bump - normal * bump.dot(normal);
    (normal - tilt).normalize()
}

/// The height above a surface from which rays leave it, in halves of a pixel.
const LIFT: f64 = 0.25;
/// The same of rays for sharp shadows, which are shorter by what this height hides of a low light.
const SHARP_LIFT: f64 = 0.0625;

/// The height above a surface from which rays leave it, along the normal: enough for the field there to be above zero
/// for certain. `sharp` is 1 for sharp shadows, else 0.
#[inline(always)]
pub fn lift<R: Real>(p: R::Vec3, half_pixel: R, rounding: R, sharp: R) -> R {
    let largest = p.abs().max_component();
    let share = R::select(lit::<R>(0.5).less(sharp), lit(SHARP_LIFT), lit(LIFT));
    (half_pixel * share)
        .max(rounding * lit(4.0))
        .max(largest * lit(4e-6))
}
