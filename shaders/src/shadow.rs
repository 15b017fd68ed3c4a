//! The part of a light that arrives at a surface: sphere tracing towards the light. Where the field is least for the
//! way, [`crate::claim`] finds the nearest point of a surface, and the angle between that and the ray is the width of
//! the penumbra (after I. Quilez, *Soft shadows in raymarched SDFs*).
//!
//! `size` is the tangent of the angle under which the light's radius is seen; a point `h` beside the ray, `t` ahead,
//! leaves `h / (size · t)` of the light uncovered.
//!
//! Of a light with a size (`sized`) a part is seen where its centre is hidden. Rays to points around its rim find the
//! edges of what hides it. On each side a light reaches no farther than half of the way to what is there.

use crate::camera::{faces, unit};
use crate::marching;
use crate::occlusion::frame_around;
use sdfc_vm::real::{Real, Vector3, lit};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Set in the steps of a shadow ray that has ended.
pub const DONE: u32 = 1 << 31;
/// The most evaluations of a shadow ray.
pub const STEPS: u32 = 4096;
/// The evaluations after which a ray that stays close to surfaces begins to go on faster, by up to [`MAX_EARLY_HURRY`].
const PATIENT_STEPS: f64 = 192.0;
/// The evaluations after which it goes on ever faster, so that it ends.
const LAST_STEPS: f64 = 1024.0;
/// The most times as far as usual that a ray goes on before that: about a pixel.
const MAX_EARLY_HURRY: f64 = 4.0;

/// The factor on the shortest steps of a ray after so many evaluations. Where a field was divided by a large
/// bound, rays are late though nothing is near.
#[inline(always)]
pub fn hurry<R: Real>(count: R) -> R {
    let early = marching::hurry(count, PATIENT_STEPS).min(lit(MAX_EARLY_HURRY));
    early.max(marching::hurry(count, LAST_STEPS))
}

/// The length of a shadow ray's shortest steps before it hurries, in halves of a pixel.
const SHORTEST: f64 = 0.0625;
/// The place of the first look of a ray for sharp shadows, in shortest steps. It begins nearer to the surface than
/// others, and would take more steps to leave it.
const SHARP_BEGIN: f64 = 4.0;

/// The length of a shadow ray's shortest steps before it hurries. `above` is the height of its start over the surface
/// ([`lift`](crate::normals::lift)).
#[inline(always)]
pub fn shortest<R: Real>(half_pixel: R, above: R) -> R {
    (half_pixel * lit(SHORTEST)).max(above * lit(0.25))
}

/// The place on a shadow ray of its first look; `sharp` is 1 for sharp shadows, else 0.
#[inline(always)]
pub fn begin<R: Real>(shortest: R, sharp: R) -> R {
    shortest * R::select(lit::<R>(0.5).less(sharp), lit(SHARP_BEGIN), lit(1.0))
}

/// The visibility by the point before where that tells nothing.
pub const NO_LAST: f32 = 1e30;

/// The place of a claim on the ray where there is none.
pub const NO_CLAIM: f32 = -1e30;

/// The visibility by a point at `t` alone, with the field `h` there taken for a distance: from −1, all of the light
/// covered, on.
#[inline(always)]
pub fn seen<R: Real>(h: R, t: R, size: R) -> R {
    h / (size * t).max(lit(1e-20))
}

/// The least ratio of the nearest distance between two steps to the distances at both.
const BETWEEN_STEPS: f64 = 0.9;

/// 1 where a point by which `visible` would be seen of a light claims a part of what arrives so far, else 0. It does
/// where `visible` falls along the ray.
#[inline(always)]
pub fn claims<R: Real>(visible: R, last: R, visibility: R) -> R {
    let least = visible.min(visible * lit(BETWEEN_STEPS));
    let falls = R::and(visible.less(last), least.less(visibility));
    R::select(falls, lit(1.0), lit(0.0))
}

/// The largest distance of surfaces from a claim, in radii of the light there. A claim may be made before the ray is
/// beside the surface.
const MAX_WAY: f64 = 2.0;

/// The largest distance of a surface from a claim at `t` that may cover some of a light.
#[inline(always)]
pub fn limit<R: Real>(t: R, size: R) -> R {
    size * t * lit(MAX_WAY)
}

/// The end of a ray to a light of the `size` that ends at `reach`: where it is farther from the box of all solids than
/// the light's radius there. A ray just above the highest solid leaves the box before it is beside that.
#[inline(always)]
pub fn leave<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    low: R::Vec3,
    high: R::Vec3,
    reach: R,
    size: R,
) -> R {
    let [_, last, inverse] = faces::<R>(origin, direction, low, high);
    // Beyond a face, the distance from that and the light's radius grow with the way: they are equal at the end.
    let across = |last: R, inverse: R| {
        let gain = lit::<R>(1.0) - size * inverse.abs();
        let end = last / gain.max(lit(1e-6));
        R::select(lit::<R>(1e-6).less(gain), end, reach)
    };
    let x = across(last.x(), inverse.x());
    let y = across(last.y(), inverse.y());
    let z = across(last.z(), inverse.z());
    x.min(y).min(z).min(reach)
}

/// The largest tangent of the angle between the way to a surface and the plane across the ray for which a claim is not
/// moved.
const MAX_AHEAD: f64 = 0.2;

/// The cosine of the angle between the way to a point of a surface and the normal there from which on that is
/// the nearest one.
const NEAREST: f64 = 0.98;
/// The most times that a claim is moved.
const MOVES: f64 = 3.0;

/// The place along the ray beside the point of a surface that is `way` away from a claim at `t`, where the claim is
/// checked once more; [`NO_CLAIM`] where that would tell nothing new. The surface was found after so many rounds by the
/// `gradient`, and the claim was moved `moves` times before.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the state of a claim")]
pub fn moved<R: Real>(
    way: R::Vec3,
    gradient: R::Vec3,
    direction: R::Vec3,
    t: R,
    leave: R,
    value: R,
    round: R,
    moves: R,
) -> R {
    let ahead = way.dot(direction).named("ahead");
    let beside = (way - direction * ahead).named("beside");
    let across = beside.length().named("across");
    let is_beside = ahead.abs().less(across * lit(MAX_AHEAD));
    // What one look finds is the nearest point, and leads to no other at the same place.
    let along = beside.dot(gradient).abs().named("along");
    let least = across * gradient.length() * lit(NEAREST);
    let is_nearest = R::or(round.less(lit(0.5)), least.less(along));
    let to = t + ahead;
    let is_on_ray = R::and(lit::<R>(0.0).less(to), to.less(leave));
    let is_open = R::and(lit::<R>(0.0).less(value), moves.less(lit(MOVES - 0.5)));
    let moves = R::and(
        R::and(is_on_ray, is_open),
        R::not(R::and(is_beside, is_nearest)),
    );
    R::select(moves, to, lit(f64::from(NO_CLAIM)))
}

/// The way back from a claim that nothing is behind, in radii of the light there.
const BACK: f64 = 0.5;
/// The share of the visibility so far that a moved claim must fall short of.
const GAINS: f64 = 0.999;

/// The place before a claim at `t` that nothing is behind, where another one is made; [`NO_CLAIM`] for a moved one. The
/// field may be least where a cutter ends or copies have their box, and the surface beside the ray before that.
#[inline(always)]
pub fn earlier<R: Real>(t: R, size: R, moves: R) -> R {
    let to = t * (lit::<R>(1.0) - size.min(lit(1.0)) * lit(BACK));
    R::select(moves.less(lit(0.5)), to, lit(f64::from(NO_CLAIM)))
}

/// 1 where a moved claim at `t` with the value `h` can darken no more than the ones before, else 0.
#[inline(always)]
pub fn is_vain<R: Real>(h: R, t: R, size: R, visibility: R) -> R {
    let is_less = seen(h, t, size).less(visibility * lit(GAINS));
    R::select(is_less, lit(0.0), lit(1.0))
}

/// The offset at which a moved claim is checked after a roundabout way: from the ray to its nearest point on the plane
/// through the point of a surface that is `way` away.
#[inline(always)]
pub fn aside<R: Real>(way: R::Vec3, gradient: R::Vec3, direction: R::Vec3) -> R::Vec3 {
    let beside = way - direction * way.dot(direction);
    let square = gradient.dot(gradient).max(lit(1e-30)).named("square");
    let share = (beside.dot(gradient) / square).named("share");
    gradient * share
}

/// Visibility after a claim at `t`, from the point of a surface that is `way` away from it: how far that point is
/// beside the ray, which ends at `leave`, as a share of the light. `value` is below zero inside of a solid.
#[inline(always)]
pub fn beside<R: Real>(
    visibility: R,
    way: R::Vec3,
    direction: R::Vec3,
    t: R,
    size: R,
    value: R,
    leave: R,
) -> R {
    let ahead = way.dot(direction).min(leave - t).named("ahead");
    let across = (way - direction * ahead).length().named("across");
    let side = R::select(value.less(lit(0.0)), -across, across);
    let visible = side / (size * (t + ahead)).max(lit(1e-20));
    visibility.min(visible).max(lit(-1.0))
}

/// Visibility after a step, for a sharp shadow: none where the ray is inside by more than `noise`.
#[inline(always)]
pub fn hard<R: Real>(visibility: R, h: R, noise: R) -> R {
    R::select(h.less(-noise), lit(0.0), visibility)
}

/// The slope of the field along the ray, by its value at a point and the one a `step` before.
#[inline(always)]
pub fn slope<R: Real>(h: R, last: R, step: R) -> R {
    (h - last) / step.max(lit(1e-30))
}

/// The way beyond an expected surface, as a fraction of the field before it. A sheet that is thinner may be passed.
const OVERSHOOT: f64 = 0.02;

/// The way from the point before back to a sheet that the last step has passed, or 0 where it has passed none: the
/// balls around both points leave a gap, and the field was falling by `fall` to zero in between. `noise` is how far
/// below zero it must get.
#[inline(always)]
pub fn passed<R: Real>(h: R, last: R, step: R, fall: R, noise: R) -> R {
    let goal = (last.max(lit(0.0)) * lit(1.0 + OVERSHOOT) + noise * lit(2.0)).named("goal");
    let root = (goal / (-fall).max(lit(1e-30))).named("root");
    let is_outside = R::not(h.less(-noise));
    let is_gap = R::and(is_outside, (last + h).less(step));
    let is_there = R::and(fall.less(lit(0.0)), root.less(step));
    R::select(R::and(is_gap, is_there), root, lit(0.0))
}

/// How far the next step goes: the ball's radius, but not less than a threshold that for a light
/// with a size grows with the way, since nothing narrower than a tenth of the penumbra is seen.
#[inline(always)]
pub fn stride<R: Real>(h: R, t: R, threshold: R, size: R) -> R {
    h.max(threshold.max(size * t * lit(0.1)))
}

/// The same for shadows whose rays must not take too long steps: plain ones and those of lights with a size.
#[inline(always)]
pub fn short_stride<R: Real>(h: R, t: R, threshold: R, size: R) -> R {
    stride(
        h.min(t * lit(0.4) + threshold * lit(64.0)),
        t,
        threshold,
        size,
    )
}

/// The number of rays to the rim of a light with a size, where a ray to its centre is blocked.
pub const RIM_RAYS: f32 = 8.0;
/// The number of those that are sent first, a right angle apart. The others lie between them, and are sent only where
/// one of these is free.
pub const FIRST_RIM_RAYS: f32 = 4.0;
/// The distance of these rays from the centre, in radii of the light: a straight edge that leaves more than a 200th of
/// the light leaves one of the first.
const RIM: f64 = 1.306_562_964_876_376_5;
/// The number of a ray to the centre that has come into a solid: 0 before, and from 1 on for the rays to the rim.
pub const INSIDE: f32 = 0.5;
/// The visibility up to which a light's centre counts as hidden.
pub const HIDDEN: f32 = 0.01;

/// The direction from the centre of a light to the point of its rim for the ray `number`.
#[inline(always)]
pub fn rim<R: Real>(axis: R::Vec3, number: R) -> R::Vec3 {
    let (tangent, bitangent) = frame_around::<R>(axis);
    let is_first = number.less(lit(f64::from(FIRST_RIM_RAYS) + 0.5));
    let aside = R::select(is_first, lit(0.0), lit(FRAC_PI_4));
    let angle = (number * lit(FRAC_PI_2) + aside).named("angle");
    tangent * angle.cos() + bitangent * angle.sin()
}

/// The direction of a ray to the rim: `axis` leads to the centre of the light, and `rim` from there to the rim.
#[inline(always)]
pub fn aim<R: Real>(axis: R::Vec3, rim: R::Vec3, size: R) -> R::Vec3 {
    unit::<R>(axis + rim * (size * lit(RIM)))
}

/// The way to the plane through the centre of a light, across the `axis`: the centre is at `reach` on that.
#[inline(always)]
pub fn rim_reach<R: Real>(direction: R::Vec3, axis: R::Vec3, reach: R) -> R {
    reach / direction.dot(axis).max(lit(1e-20))
}

/// The way from a light's centre on which it needs room: `reach` is its distance.
#[inline(always)]
pub fn room<R: Real>(reach: R, size: R) -> R {
    reach * size * lit(2.0 * RIM)
}

/// The size of a light whose centre has `room` on one side.
#[inline(always)]
pub fn fitting<R: Real>(room: R, reach: R) -> R {
    room / (reach * lit(2.0 * RIM)).max(lit(1e-20))
}

/// Visibility after a claim at `t` of a ray to the rim, from −1 to 0: by the line across the light through the point
/// of a surface that is `way` away from the claim. The light beyond a hole is no more than the hole has room for.
#[inline(always)]
pub fn beside_rim<R: Real>(
    visibility: R,
    way: R::Vec3,
    direction: R::Vec3,
    axis: R::Vec3,
    t: R,
    size: R,
    leave: R,
) -> R {
    let ahead = way.dot(direction).min(leave - t).named("ahead");
    let across = (way - direction * ahead).named("across");
    let clear = across.length().named("clear");
    let rim = direction * (lit::<R>(1.0) / direction.dot(axis).max(lit(1e-20))) - axis;
    let beyond = -across.dot(rim) / (clear * size).max(lit(1e-20));
    let room = clear / (size * (t + ahead)).max(lit(1e-20));
    visibility.min(room - beyond.max(lit(1.0))).max(lit(-1.0))
}

/// The visibility that a ray's claims must fall short of: those of rays to the rim from the rim on.
#[inline(always)]
pub fn claimed<R: Real>(visibility: R, number: R) -> R {
    let is_rim = lit::<R>(f64::from(INSIDE)).less(number);
    visibility + R::select(is_rim, lit(RIM), lit(0.0))
}

/// The place up to which rays to the rim need not look, after a point at `t` of the ray to the centre: balls around
/// that hold them. It is negative from the first point on whose ball is too small.
#[inline(always)]
pub fn cleared<R: Real>(cleared: R, h: R, t: R, size: R) -> R {
    let holds = (size * t * lit(2.0 * RIM)).less(h);
    let is_open = lit::<R>(0.0).less(cleared);
    R::select(is_open, R::select(holds, t, -cleared), cleared)
}

/// The next step of a ray in a solid, on which the depth is compared with the light's radius.
#[inline(always)]
pub fn inner_stride<R: Real>(t: R, threshold: R, size: R) -> R {
    threshold.max(size * t * lit(0.5))
}

/// The light that arrives, by a visibility from 0 on: the share of a disc that is not behind a straight edge,
/// smoothed.
#[inline(always)]
pub fn arriving<R: Real>(visibility: R) -> R {
    let v = visibility.saturate();
    v * v * (lit::<R>(3.0) - v * lit(2.0))
}

/// The light that arrives, by a visibility from −1 on.
#[inline(always)]
pub fn arriving_sized<R: Real>(visibility: R) -> R {
    arriving(visibility * lit(0.5) + lit(0.5))
}
