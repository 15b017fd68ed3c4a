//! The fraction of a light that arrives at a surface: sphere tracing towards the light. Where the field is
//! lowest relative to the distance along the ray, [`crate::candidate`] finds the nearest point of a surface.
//! The angle between that point and the ray is the width of the penumbra (after I. Quilez, *Soft shadows in
//! raymarched SDFs*).
//!
//! `size` is the tangent of the light's angular radius. A point at a distance `h` beside the ray, at `t`
//! along it, leaves `h / (size · t)` of the light uncovered.
//!
//! A light with a size (`sized`) is partly visible where its centre is hidden. Rays to points around its rim
//! find the edges of what hides it. On each side, the light's radius is at most half of the free distance
//! beside its centre.

use crate::camera::{faces, unit};
use crate::marching::{self, OVERSHOOT_FRACTION};
use crate::occlusion::tangent_frame;
use sdfc_vm::real::{Real, Vector3, lit};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Flag in the step count of a shadow ray that has ended.
pub const DONE_FLAG: u32 = 1 << 31;
/// Maximum number of evaluations of a shadow ray. Each ray to the rim of a light with a size has its own.
pub const MAX_STEPS: u32 = 4096;
/// Number of evaluations after which the minimum step of a ray close to surfaces grows, by up to
/// [`MAX_CAPPED_SPEEDUP`].
const CAPPED_SPEEDUP_STEPS: f64 = 192.0;
/// Number of evaluations after which it grows without limit, so that the ray ends.
const UNCAPPED_SPEEDUP_STEPS: f64 = 1024.0;
/// Maximum factor on the minimum step before that: an eighth of a pixel, unless rounding lengthens the step.
const MAX_CAPPED_SPEEDUP: f64 = 4.0;

/// Returns the factor on the minimum step of a ray after `count` evaluations. Where a field was divided by a
/// large bound, rays need many evaluations without a surface nearby.
#[inline(always)]
pub fn late_speedup<R: Real>(count: R) -> R {
    let capped = marching::speedup_after(count, CAPPED_SPEEDUP_STEPS).min(lit(MAX_CAPPED_SPEEDUP));
    capped.max(marching::speedup_after(count, UNCAPPED_SPEEDUP_STEPS))
}

/// Minimum step of a shadow ray before that factor, in halves of a pixel.
const MIN_STEP_HALF_PIXELS: f64 = 0.0625;
/// Start of a ray for sharp shadows, in minimum steps. Its origin is nearer to the surface than that of
/// others, and it would take more steps to leave it.
const SHARP_START_STEPS: f64 = 4.0;

/// Returns the minimum step of a shadow ray before [`late_speedup`]. `height` is that of its start over the surface
/// ([`lift`](crate::normals::lift)).
#[inline(always)]
pub fn min_step<R: Real>(half_pixel: R, height: R) -> R {
    (half_pixel * lit(MIN_STEP_HALF_PIXELS)).max(height * lit(0.25))
}

/// Returns the distance along a shadow ray of its first sample; `is_sharp` is 1 for sharp shadows, else 0.
#[inline(always)]
pub fn start_t<R: Real>(min_step: R, is_sharp: R) -> R {
    min_step
        * R::select(
            lit::<R>(0.5).less(is_sharp),
            lit(SHARP_START_STEPS),
            lit(1.0),
        )
}

/// Visibility of half of a light. A plane along a ray leaves as much of a light whose centre lies in it. (Of a light with
/// a size, half is visible at 0.)
pub const HALF_VISIBILITY: f32 = 0.5;

/// Placeholder for the visibility at the previous sample where it must not be compared with.
pub const NO_LAST_VISIBILITY: f32 = 1e30;

/// Placeholder for the distance along the ray of a missing candidate.
pub const NO_CANDIDATE: f32 = -1e30;

/// Returns the visibility by a sample at `t` alone, with its `field` taken for a distance. It is −1 and
/// below where the whole light is covered; it is not clamped.
#[inline(always)]
pub fn visibility_at<R: Real>(field: R, t: R, size: R) -> R {
    field / (size * t).max(lit(1e-20))
}

/// Minimum ratio of the nearest distance between two steps to the distances at both.
const MIN_BETWEEN_STEPS_RATIO: f64 = 0.9;

/// Returns 1 where a sample with `sample_visibility` is a candidate, else 0. Its visibility is lower than at
/// the previous sample, and may be lower than that of the ray so far.
#[inline(always)]
pub fn is_candidate<R: Real>(sample_visibility: R, last_visibility: R, visibility: R) -> R {
    let lowest = sample_visibility.min(sample_visibility * lit(MIN_BETWEEN_STEPS_RATIO));
    let is_lower = R::and(
        sample_visibility.less(last_visibility),
        lowest.less(visibility),
    );
    R::select(is_lower, lit(1.0), lit(0.0))
}

/// Minimum size of a light whose rays check all candidates in raw fields. Penumbras of narrower ones lie close to surfaces.
const MIN_CHECKED_SIZE: f64 = 0.1;

/// Samples of shadow rays that are occluder candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Checks {
    /// Those where the value is lowest, relative to the distance along the ray.
    Lowest = 0,
    /// All at which a surface may be near by their values.
    Near = 1,
    /// All in distances that follow from measured slopes, whatever the values are.
    Measured = 2,
}

impl Checks {
    /// Returns the checks of rays towards a light. In raw fields, the lowest value over the distance along the ray need not be
    /// the nearest to a surface. Without a close bound of their slopes, values say little about distances.
    pub fn new(size: f64, is_raw: bool, has_loose_slopes: bool) -> Self {
        match has_loose_slopes {
            true => Self::Measured,
            false if is_raw && size >= MIN_CHECKED_SIZE => Self::Near,
            false => Self::Lowest,
        }
    }
}

/// Reports whether all samples are candidates that lie apart by measured slopes.
#[inline(always)]
fn is_measured<R: Real>(checks: R) -> R::Bool {
    lit::<R>(1.5).less(checks)
}

/// Relative tolerance of the place of a check.
const CHECK_TOLERANCE: f64 = 1e-6;

/// Returns the step from `t` that ends at the next check at the latest, if checks lie apart by measured slopes.
#[inline(always)]
pub fn step_to_check<R: Real>(step: R, t: R, next_check_t: R, checks: R) -> R {
    let is_ahead = (t * lit(1.0 + CHECK_TOLERANCE)).less(next_check_t);
    let is_limited = R::and(is_measured(checks), is_ahead);
    R::select(is_limited, step.min(next_check_t - t), step)
}

/// Returns 1 where a sample at `t` is checked, else 0. `is_candidate` is the result of [`is_candidate`].
#[inline(always)]
pub fn is_checked<R: Real>(is_candidate: R, t: R, next_check_t: R, checks: R) -> R {
    let is_due = R::not((t * lit(1.0 + CHECK_TOLERANCE)).less(next_check_t));
    let may_darken = R::or(is_measured(checks), lit::<R>(0.5).less(is_candidate));
    R::select(R::and(is_due, may_darken), lit(1.0), lit(0.0))
}

/// Returns the visibility with which [`is_candidate`] compares the next sample.
#[inline(always)]
pub fn last_visibility<R: Real>(sample_visibility: R, checks: R) -> R {
    R::select(
        checks.less(lit(0.5)),
        sample_visibility,
        lit(f64::from(NO_LAST_VISIBILITY)),
    )
}

/// Distance along the ray between two candidates where all are checked, as a fraction of a surface's distance from the
/// first.
const CHECK_SPACING: f64 = 0.25;
/// Minimum of that distance, in radii of the light.
const MIN_CHECK_SPACING_RADII: f64 = 0.1;
/// Maximum of that distance, in radii of the light.
const MAX_CHECK_SPACING_RADII: f64 = 3.0;

/// Placeholder for the distance before which no sample is a candidate, where the ray ends after the present check.
pub const NO_NEXT_CHECK: f32 = 1e30;

/// Returns the distance along the ray before which no other sample is a candidate, after one at `t` with the field `value`
/// and its `gradient`. The end of the ray, at `t_end`, is checked in any case: a light is widest there.
#[inline(always)]
pub fn next_check_t<R: Real>(t: R, value: R, gradient: R::Vec3, size: R, t_end: R) -> R {
    let distance = value / gradient.length().max(lit(1e-20));
    let radius = (size * t).named("radius");
    let spacing = (distance * lit(CHECK_SPACING)).max(radius * lit(MIN_CHECK_SPACING_RADII));
    (t + spacing.min(radius * lit(MAX_CHECK_SPACING_RADII))).min(t_end)
}

/// Maximum distance of surfaces from a candidate, in radii of the light there. A ray may find a candidate
/// before it is beside the surface.
const MAX_CANDIDATE_RADII: f64 = 2.0;

/// Returns the maximum distance from a candidate at `t` of a surface that may cover part of a light.
#[inline(always)]
pub fn candidate_limit<R: Real>(t: R, size: R) -> R {
    size * t * lit(MAX_CANDIDATE_RADII)
}

/// Returns the end of a ray to a light of the `size` at `light_t`. Its distance from the box of all solids is
/// there the radius of the light. A ray just above the highest solid leaves the box before it is beside that
/// solid.
#[inline(always)]
pub fn exit_t<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    low: R::Vec3,
    high: R::Vec3,
    light_t: R,
    size: R,
) -> R {
    let [_, last, inverse] = faces::<R>(origin, direction, low, high);
    // Beyond a face, both the distance from it and the radius of the light grow linearly; they are equal at
    // the end.
    let axis_end = |last: R, inverse: R| {
        let gap_per_t = lit::<R>(1.0) - size * inverse.abs();
        let end = last / gap_per_t.max(lit(1e-6));
        R::select(lit::<R>(1e-6).less(gap_per_t), end, light_t)
    };
    let x = axis_end(last.x(), inverse.x());
    let y = axis_end(last.y(), inverse.y());
    let z = axis_end(last.z(), inverse.z());
    x.min(y).min(z).min(light_t)
}

/// Returns the distance along a ray at which its height above a half space is the radius of a light of this `size`.
/// `light_t` if it does not climb that steeply. `offset` is the distance of the origin from the plane along its `normal`.
#[inline(always)]
pub fn half_space_exit_t<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    normal: R::Vec3,
    offset: R,
    light_t: R,
    size: R,
) -> R {
    let height = (origin.dot(normal) + offset).named("height");
    let climb_per_t = (direction.dot(normal) - size).named("climb_per_t");
    let end = -height / climb_per_t.max(lit(1e-6));
    R::select(lit::<R>(1e-6).less(climb_per_t), end, light_t)
}

/// Maximum tangent of the angle between the direction to a surface and the plane across the ray for a
/// candidate that stays in place.
const MAX_AHEAD_TANGENT: f64 = 0.05;

/// Minimum cosine of the angle between the direction to a point of a surface and the normal there for the
/// nearest point.
const MIN_NEAREST_COSINE: f64 = 0.999;
/// Maximum number of moves of a candidate.
const MAX_MOVES: f64 = 12.0;
/// Number of moves that are made whether or not they reduce the visibility, besides those that lead far back.
const FREE_MOVES: f64 = 2.0;
/// Minimum reduction of the visibility by a later move that another one follows.
const MIN_MOVE_GAIN: f64 = 0.001;

/// Returns the value of the field at a candidate itself, as far as its sign matters: the one of the first round. Later rounds
/// begin beside the ray, where a solid may be.
#[inline(always)]
fn value_on_ray<R: Real>(value: R, round: R) -> R {
    R::select(round.less(lit(0.5)), value, lit(1.0))
}

/// Returns the distance along the ray beside a point of a surface, at which the candidate is probed once
/// more. [`NO_CANDIDATE`] where that would find nothing new. The point is at `to_surface` from a candidate at
/// `t`. The probe found it after `round` rounds by the `gradient`, and `moves` counts earlier moves of the
/// candidate. The probe reduced the visibility by `gain`.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the state of a candidate")]
pub fn moved_candidate_t<R: Real>(
    to_surface: R::Vec3,
    gradient: R::Vec3,
    direction: R::Vec3,
    t: R,
    t_end: R,
    size: R,
    value: R,
    round: R,
    moves: R,
    gain: R,
) -> R {
    let ahead = to_surface.dot(direction).named("ahead");
    let sideways = (to_surface - direction * ahead).named("sideways");
    let distance = sideways.length().named("distance");
    // On the outline of a surface the line of sight touches it. The normal there meets the ray after this shift.
    let shift = ahead + distance * distance / (t + ahead).max(lit(1e-20));
    let shift = shift.named("shift");
    let is_across = shift.abs().less(distance * lit(MAX_AHEAD_TANGENT));
    // The point that one probe finds is the nearest one, and leads to no other at the same place.
    let along_gradient = sideways.dot(gradient).abs().named("along_gradient");
    let min_along = distance * gradient.length() * lit(MIN_NEAREST_COSINE);
    let is_nearest = R::or(round.less(lit(0.5)), min_along.less(along_gradient));
    let target = t + shift;
    let is_on_ray = R::and(lit::<R>(0.0).less(target), target.less(t_end));
    let leads_back = shift.less(-(size * t * lit(BACK_RADII)));
    let is_free = R::or(moves.less(lit(FREE_MOVES - 0.5)), leads_back);
    let has_gained = R::or(is_free, lit::<R>(MIN_MOVE_GAIN).less(gain));
    let may_continue = R::and(has_gained, moves.less(lit(MAX_MOVES - 0.5)));
    let is_outside = lit::<R>(0.0).less(value_on_ray(value, round));
    let is_open = R::and(is_outside, may_continue);
    let may_move = R::and(
        R::and(is_on_ray, is_open),
        R::not(R::and(is_across, is_nearest)),
    );
    R::select(may_move, target, lit(f64::from(NO_CANDIDATE)))
}

/// Returns 1 where a surface hides more of a light at the end of the ray than beside a candidate, `rest` before, else 0. The
/// ray falls towards its tangent plane and ends above it.
#[inline(always)]
pub fn hides_most_at_end<R: Real>(
    to_surface: R::Vec3,
    gradient: R::Vec3,
    direction: R::Vec3,
    rest: R,
) -> R {
    let rise = direction.dot(gradient).named("rise");
    let height_at_end = (rest * rise - to_surface.dot(gradient)).named("height_at_end");
    let falls = R::and(rise.less(lit(0.0)), lit::<R>(0.0).less(height_at_end));
    R::select(falls, lit(1.0), lit(0.0))
}

/// Minimum distance back along the ray from a candidate without a surface, in radii of the light there. Other moves that lead
/// farther back go on, too: beside the extension of a face, they come near its edge in several steps.
const BACK_RADII: f64 = 0.5;
/// Factor on the visibility so far below which a moved candidate must lie.
const MIN_GAIN_FACTOR: f64 = 0.999;

/// Returns the distance along the ray of another candidate before one at `t` without a surface, or [`NO_CANDIDATE`]. The
/// field may be lowest where a cutter ends, where copies have their box, or beside the extension of a face. The surface lies
/// beside the ray before that. `ahead` is the way along the ray to the last point of the probe.
#[inline(always)]
pub fn earlier_candidate_t<R: Real>(t: R, size: R, moves: R, ahead: R) -> R {
    let back = (t * size.min(lit(1.0)) * lit(BACK_RADII)).named("back");
    let leads_back = R::and(ahead.less(-back), moves.less(lit(MAX_MOVES - 0.5)));
    let is_allowed = R::or(moves.less(lit(0.5)), leads_back);
    let target = t + ahead.min(-back);
    R::select(is_allowed, target, lit(f64::from(NO_CANDIDATE)))
}

/// Returns 1 where a moved candidate at `t` with the value `field` cannot darken the light further, else 0.
#[inline(always)]
pub fn cannot_darken<R: Real>(field: R, t: R, size: R, bound: R) -> R {
    let may_darken = visibility_at(field, t, size).less(bound * lit(MIN_GAIN_FACTOR));
    R::select(may_darken, lit(0.0), lit(1.0))
}

/// Returns the offset at which a moved candidate is probed after several rounds. It leads from the ray to the
/// nearest point on the plane of the surface at `to_surface`.
#[inline(always)]
pub fn plane_offset<R: Real>(
    to_surface: R::Vec3,
    gradient: R::Vec3,
    direction: R::Vec3,
) -> R::Vec3 {
    let sideways = to_surface - direction * to_surface.dot(direction);
    let square = gradient.dot(gradient).max(lit(1e-30)).named("square");
    let factor = (sideways.dot(gradient) / square).named("factor");
    gradient * factor
}

/// Returns the distance of a surface from a ray that ends `rest` ahead of a candidate. The nearest point of the surface is
/// at `to_surface` from the candidate.
///
/// Beyond the end, as of a ceiling above a light, the plane through that point counts where it meets that of the light.
#[inline(always)]
fn distance_beside<R: Real>(to_surface: R::Vec3, direction: R::Vec3, rest: R) -> R {
    let along = to_surface.dot(direction).named("along");
    let across = (to_surface - direction * along).length().named("across");
    let in_plane = (to_surface.dot(to_surface) - rest * along) / across.max(lit(1e-20));
    R::select(rest.less(along), in_plane, across)
}

/// Sine of the angle between a ray and a surface beyond its light from which on that surface counts as behind the light.
const MIN_BACKING_SINE: f64 = 0.25;
/// Tolerance of the end of a ray, in radii of the light: a light may touch the surface beyond it.
const BACKING_TOLERANCE: f64 = 0.01;

/// Returns the visibility of a round light whose centre lies in a surface beyond it, such as a ceiling; 0 for a surface
/// before it. The surface is at `along` on a ray that ends `rest` ahead.
///
/// Half of a ball remains in front of a plane through its centre. Its outline is half a disc, and half an ellipse that
/// is as wide as the sine of the angle between ray and plane.
#[inline(always)]
fn backed_visibility<R: Real>(
    gradient: R::Vec3,
    direction: R::Vec3,
    along: R,
    rest: R,
    radius: R,
    grazing_visibility: R,
) -> R {
    let sine = (-gradient.dot(direction) / gradient.length().max(lit(1e-20)))
        .saturate()
        .named("sine");
    let is_beyond = rest.less(along + radius * lit(BACKING_TOLERANCE));
    let weight = (sine / lit(MIN_BACKING_SINE)).min(lit(1.0));
    let backed = grazing_visibility + (lit::<R>(1.0) - grazing_visibility) * sine;
    R::select(is_beyond, weight * backed, lit(0.0))
}

/// Returns the visibility after a candidate at `t`, by the point of a surface at `to_surface` from it. It is
/// the distance of that point from the ray, as a fraction of the light's radius. The ray ends at `t_end`.
/// `value` is below zero inside of a solid, in the first `round`. `gradient` leads away from the surface.
///
/// A surface before the light that reaches its centre hides it. One beyond leaves `grazing_visibility` or more.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the state of a candidate")]
pub fn visibility_beside<R: Real>(
    visibility: R,
    to_surface: R::Vec3,
    gradient: R::Vec3,
    direction: R::Vec3,
    t: R,
    size: R,
    value: R,
    round: R,
    t_end: R,
    grazing_visibility: R,
) -> R {
    let (along, rest) = (to_surface.dot(direction), t_end - t);
    let ahead = along.min(rest).named("ahead");
    let distance = distance_beside::<R>(to_surface, direction, rest).named("distance");
    let radius = (size * (t + ahead)).max(lit(1e-20)).named("radius");
    let is_inside = value_on_ray(value, round).less(lit(0.0));
    let signed_distance = R::select(is_inside, -distance, distance);
    let open = (signed_distance / radius).named("open");
    let hidden = (lit::<R>(1.0) - open).max(lit(0.0)).named("hidden");
    let backed =
        backed_visibility::<R>(gradient, direction, along, rest, radius, grazing_visibility);
    let sample_visibility = open + hidden * backed;
    visibility.min(sample_visibility).max(lit(-1.0))
}

/// Returns the visibility after a step, for a sharp shadow: none where the ray is inside by more than
/// `margin`.
#[inline(always)]
pub fn hard_visibility<R: Real>(visibility: R, field: R, margin: R) -> R {
    R::select(field.less(-margin), lit(0.0), visibility)
}

/// Returns the slope of the field along the ray, by its value at a sample and the one a `step` before.
#[inline(always)]
pub fn slope<R: Real>(field: R, field_before: R, step: R) -> R {
    (field - field_before) / step.max(lit(1e-30))
}

/// Returns the step from the previous sample back to a sheet that the last step has passed, or 0 where it has
/// passed none. The empty spheres around both samples leave a gap, and the field was falling by
/// `slope_before` to zero in between. `margin` is the depth below zero that it must reach. It is deepest in the middle
/// of a thin sheet.
#[inline(always)]
pub fn step_to_passed_sheet<R: Real>(
    field: R,
    field_before: R,
    step: R,
    slope_before: R,
    margin: R,
) -> R {
    let estimate_depth = (field_before.max(lit(0.0)) * lit(1.0 + OVERSHOOT_FRACTION)
        + margin * lit(2.0))
    .named("estimate_depth");
    let slope = (-slope_before).max(lit(1e-30)).named("slope");
    let beyond_root = (estimate_depth / slope).named("beyond_root");
    let to_middle = ((step + (field_before - field) / slope) * lit(0.5)).named("to_middle");
    let is_deep = ((field_before + margin) / slope).less(to_middle);
    let to_sheet = R::select(is_deep, to_middle, beyond_root);
    let to_root = to_sheet.min(beyond_root).named("to_root");
    let is_outside = R::not(field.less(-margin));
    let is_gap = R::and(is_outside, (field_before + field).less(step));
    let has_root = R::and(slope_before.less(lit(0.0)), to_root.less(step));
    R::select(R::and(is_gap, has_root), to_root, lit(0.0))
}

/// Returns the next step: the radius of the empty sphere, but at least `min_step`. For a light with a size it
/// is at least a tenth of the light's radius there. Nothing narrower than a tenth of the penumbra is visible.
#[inline(always)]
pub fn stride<R: Real>(field: R, t: R, min_step: R, size: R) -> R {
    field.max(min_step.max(size * t * lit(0.1)))
}

/// Returns the next step of a ray with limited steps: for plain shadows and lights with a size.
#[inline(always)]
pub fn short_stride<R: Real>(field: R, t: R, min_step: R, size: R) -> R {
    stride(
        field.min(t * lit(0.4) + min_step * lit(64.0)),
        t,
        min_step,
        size,
    )
}

/// Number of rays to the rim of a light with a size, where a ray to its centre is blocked.
pub const RIM_RAYS: f32 = 8.0;
/// Number of those that are sent first, a right angle apart. The others lie between them, and are sent only
/// where one of these is free.
pub const FIRST_RIM_RAYS: f32 = 4.0;
/// Distance of these rays from the centre, in radii of the light. A straight edge that leaves more than a
/// 200th of the light leaves one of the first rays.
const RIM_RADII: f64 = 1.306_562_964_876_376_5;
/// Ray number of a ray to the centre that has entered a solid. It is 0 before, and at least 1 for rays to the
/// rim.
pub const INSIDE_RAY_NUMBER: f32 = 0.5;
/// Maximum visibility at which the centre of a light counts as hidden.
pub const MAX_HIDDEN_VISIBILITY: f32 = 0.01;

/// Returns the direction from the centre of a light to the point of its rim for the ray `number`.
#[inline(always)]
pub fn rim_direction<R: Real>(axis: R::Vec3, number: R) -> R::Vec3 {
    let (tangent, bitangent) = tangent_frame::<R>(axis);
    let is_first = number.less(lit(f64::from(FIRST_RIM_RAYS) + 0.5));
    let turn = R::select(is_first, lit(0.0), lit(FRAC_PI_4));
    let angle = (number * lit(FRAC_PI_2) + turn).named("angle");
    tangent * angle.cos() + bitangent * angle.sin()
}

/// Returns the direction of a ray to the rim: `axis` leads to the centre of the light, and `rim` from there
/// to the rim.
#[inline(always)]
pub fn rim_ray_direction<R: Real>(axis: R::Vec3, rim: R::Vec3, size: R) -> R::Vec3 {
    unit::<R>(axis + rim * (size * lit(RIM_RADII)))
}

/// Returns the distance along `direction` to the plane through the centre of a light, across the `axis`; the
/// centre is at `light_t` on that.
#[inline(always)]
pub fn light_plane_t<R: Real>(direction: R::Vec3, axis: R::Vec3, light_t: R) -> R {
    light_t / direction.dot(axis).max(lit(1e-20))
}

/// Returns the distance around the centre of a light that must be free: `light_t` is the distance to the
/// light.
#[inline(always)]
pub fn required_room<R: Real>(light_t: R, size: R) -> R {
    light_t * size * lit(2.0 * RIM_RADII)
}

/// Returns the size of a light whose centre has `room` on one side.
#[inline(always)]
pub fn size_in_room<R: Real>(room: R, light_t: R) -> R {
    room / (light_t * lit(2.0 * RIM_RADII)).max(lit(1e-20))
}

/// Returns the visibility after a candidate at `t` of a ray to the rim, from −1 to 0. It follows from the
/// line across the light through the point of a surface at `to_surface`. The light beyond a hole is at most
/// as wide as the hole.
#[inline(always)]
pub fn rim_visibility_beside<R: Real>(
    visibility: R,
    to_surface: R::Vec3,
    direction: R::Vec3,
    axis: R::Vec3,
    t: R,
    size: R,
    t_end: R,
) -> R {
    let ahead = to_surface.dot(direction).min(t_end - t).named("ahead");
    let distance = distance_beside::<R>(to_surface, direction, t_end - t).named("distance");
    let sideways = (to_surface - direction * ahead).named("sideways");
    let to_rim = direction * (lit::<R>(1.0) / direction.dot(axis).max(lit(1e-20))) - axis;
    let edge_offset = -sideways.dot(to_rim) / (sideways.length() * size).max(lit(1e-20));
    let room = distance / (size * (t + ahead)).max(lit(1e-20));
    visibility
        .min(room - edge_offset.max(lit(1.0)))
        .max(lit(-1.0))
}

/// Returns the visibility below which a sample is a candidate: for rays to the rim, measured from the rim.
#[inline(always)]
pub fn candidate_bound<R: Real>(visibility: R, number: R) -> R {
    let is_rim = lit::<R>(f64::from(INSIDE_RAY_NUMBER)).less(number);
    visibility + R::select(is_rim, lit(RIM_RADII), lit(0.0))
}

/// Returns the distance up to which rays to the rim need no samples, after a sample at `t` of the ray to the
/// centre. While it is positive, the empty spheres of all samples contain the rays to the rim. The first
/// sample with a smaller sphere makes it final, and negative. Where checks lie apart by measured slopes, it is the start.
#[inline(always)]
pub fn clear_until<R: Real>(clear_t: R, field: R, t: R, size: R, checks: R) -> R {
    let is_clear = R::and(
        R::not(is_measured(checks)),
        (size * t * lit(2.0 * RIM_RADII)).less(field),
    );
    let is_clear_so_far = lit::<R>(0.0).less(clear_t);
    R::select(is_clear_so_far, R::select(is_clear, t, -clear_t), clear_t)
}

/// Returns the next step of a ray in a solid, on which the depth is compared with the light's radius.
#[inline(always)]
pub fn inner_stride<R: Real>(t: R, min_step: R, size: R) -> R {
    min_step.max(size * t * lit(0.5))
}

/// Returns the fraction of the light that arrives, by a visibility of at least 0: the smoothed fraction of a
/// disc beside a straight edge.
#[inline(always)]
pub fn light_fraction<R: Real>(visibility: R) -> R {
    let v = visibility.saturate();
    v * v * (lit::<R>(3.0) - v * lit(2.0))
}

/// Returns the fraction of the light that arrives, by a visibility of at least −1.
#[inline(always)]
pub fn light_fraction_sized<R: Real>(visibility: R) -> R {
    light_fraction(visibility * lit(0.5) + lit(0.5))
}
