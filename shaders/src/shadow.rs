//! The part of a light that arrives at a surface: sphere tracing towards the light. Where the field is least for the
//! way, [`crate::claim`] finds the nearest point of a surface, and the angle between that and the ray is the width of
//! the penumbra (after I. Quilez, *Soft shadows in raymarched SDFs*).
//!
//! `size` is the tangent of the angle under which the light's radius is seen; a point `h` beside the ray, `t` ahead,
//! leaves `h / (size · t)` of the light uncovered.

use sdfc_vm::real::{Real, Vector3, lit};

/// Set in the steps of a shadow ray that has ended.
pub const DONE: u32 = 1 << 31;
/// The most evaluations of a shadow ray.
pub const STEPS: u32 = 4096;
/// The evaluations after which a ray that stays close to surfaces begins to go on faster.
const PATIENT_STEPS: f64 = 192.0;
/// The further evaluations after which it goes on twice as fast.
const HURRY_STEPS: f64 = 64.0;

/// How many times as far as usual a ray goes on at least after so many evaluations.
#[inline(always)]
pub fn hurry<R: Real>(count: R) -> R {
    let late = ((count - lit(PATIENT_STEPS)).max(lit(0.0)) * lit(1.0 / HURRY_STEPS)).named("late");
    late * late * late + lit(1.0)
}

/// The place of a claim on the ray where there is none.
pub const NO_CLAIM: f32 = -1.0;

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

/// The largest tangent of the angle between the way to a surface and the plane across the ray for which a claim is not
/// moved.
const MAX_AHEAD: f64 = 0.2;

/// The place along the ray beside the point of a surface that is `way` away from a claim at `t`, where the claim is
/// checked once more; [`NO_CLAIM`] where that would tell nothing new.
#[inline(always)]
pub fn moved<R: Real>(way: R::Vec3, direction: R::Vec3, t: R, leave: R, value: R) -> R {
    let ahead = way.dot(direction).named("ahead");
    let across = (way - direction * ahead).length().named("across");
    let is_beside = ahead.abs().less(across * lit(MAX_AHEAD));
    let to = t + ahead;
    let is_on_ray = R::and(lit::<R>(0.0).less(to), to.less(leave));
    let moves = R::and(
        is_on_ray,
        R::and(R::not(is_beside), lit::<R>(0.0).less(value)),
    );
    R::select(moves, to, lit(f64::from(NO_CLAIM)))
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

/// How far the next step goes: the ball's radius, but not less than a threshold that for a light
/// with a size grows with the way, since nothing narrower than a tenth of the penumbra is seen.
#[inline(always)]
pub fn stride<R: Real>(h: R, t: R, threshold: R, size: R) -> R {
    h.max(threshold.max(size * t * lit(0.1)))
}

/// The same for shadows whose rays must not take too long steps: plain ones and those that darken from inside.
#[inline(always)]
pub fn short_stride<R: Real>(h: R, t: R, threshold: R, size: R) -> R {
    stride(
        h.min(t * lit(0.4) + threshold * lit(64.0)),
        t,
        threshold,
        size,
    )
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
