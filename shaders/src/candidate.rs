//! Occluder candidates: sample points whose field value is small enough for a nearby surface to block light.
//! A probe along the gradient finds whether a surface is there, and where.
//!
//! A step to the surface ([`crate::marching`]) is a distance where shapes are exact. For cuts and
//! intersections it is a lower bound, which may be far less. For example, the field of a hole is zero where
//! the cutter ends, although no surface is there. Raw fields were divided by a bound of the slope. So light
//! takes no value for a distance before it is checked, one evaluation at a time, in the same way for all
//! fields:
//!
//! | phase | evaluated |
//! |---|---|
//! | 0 | the value |
//! | 0.5 | the value at the point to which a shadow's candidate was moved |
//! | 1 to 3 | taps along x, y and z, for the gradient |
//! | 3.5 to 4 | in the middle of a sheet that phase 4 may have passed |
//! | 4 | slightly beyond the surface that the gradient predicts |
//! | 5 on | a fraction of that step, where the field was far below the gradient's prediction |
//!
//! If the field is above zero in phase 4, another face begins there, or the field falls more slowly from
//! there on. The probe then continues from that point, along the edge between the faces, in at most eight
//! rounds of these phases. A surface is where the field is below zero, and nowhere else: a cutter leaves
//! zeros in the field without a surface. So light depends on surfaces alone. The extent of a cutter outside
//! of what it cuts, a factor on a field, or a bound of its slope has no effect.

use crate::marching::{OVERSHOOT_FRACTION, ROUNDING_PER_UNIT};
use sdfc_vm::real::{Real, Vector3, lit};

/// Minimum overshoot of a probe, in units of the field's rounding error there.
const MIN_OVERSHOOT_ROUNDINGS: f64 = 2.0 * MAX_NOISE_ROUNDINGS;
/// Minimum overshoot of a probe, as a fraction of the distance limit: at a corner, a shorter step leads along
/// a face.
const MIN_OVERSHOOT_LIMIT_FRACTION: f64 = 0.001;
/// Distance of the gradient's taps from the round's point, as a fraction of the value.
const TAP_FRACTION: f64 = 0.004;
/// Minimum distance of the taps, in units of the field's rounding error there.
const MIN_TAP_ROUNDINGS: f64 = 64.0;
/// Minimum distance of the taps, as a fraction of the distance limit: at a corner, both faces then contribute
/// to the gradient.
const MIN_TAP_LIMIT_FRACTION: f64 = 0.0005;
/// Maximum number of rounds of a probe: at a face, an edge and a corner, and where a field bends.
const MAX_ROUNDS: f64 = 8.0;
/// Squared sine of the angle between the faces of the sharpest edge that a probe follows. More opposed faces
/// are those of a valley between two faces without a surface.
const MIN_EDGE_SINE_SQUARED: f64 = 0.2;
/// Thickness of a sheet into which a probe goes back, as a fraction of the distance to it.
const THIN_SHEET_FRACTION: f64 = 0.1;
/// Depth below zero from which on a value is not mere rounding, in units of the field's rounding error.
const MAX_NOISE_ROUNDINGS: f64 = 4.0;
/// Maximum depth of the field below the gradient's prediction, in units of the value. Beyond it, the line
/// through both ends of a probe does not locate the surface.
const MAX_EXCESS_DEPTH: f64 = 0.15;
/// Fraction of the squared limit from which on a probe is too far: less than one, since a step of exactly the limit
/// is rounded.
const FAR_FRACTION: f64 = 0.999;
/// Fractions of phase 4's step at which the middle of a sheet is searched.
const SHEET_FRACTIONS: [f64; 2] = [1e-4, 0.98];
/// Phase between phase 4 and those in the middle of a sheet.
const MIN_FULL_STEP_PHASE: f64 = 3.995;
/// The last phase of a probe.
const LAST_PHASE: f64 = 9.0;
/// Distance of a missing surface.
pub const NO_SURFACE: f32 = 1e18;
/// Phase in which a moved candidate takes its value.
pub const MOVED_PHASE: f32 = 0.5;

/// Returns the field's rounding error at a point, independent of the camera's distance.
#[inline(always)]
fn rounding<R: Real>(point: R::Vec3) -> R {
    point.abs().max_component() * lit(ROUNDING_PER_UNIT)
}

/// Returns the distance from a point of the taps that find its gradient.
#[inline(always)]
pub fn tap_distance<R: Real>(value: R, point: R::Vec3, limit: R) -> R {
    let min_distance =
        (rounding::<R>(point) * lit(MIN_TAP_ROUNDINGS)).max(limit * lit(MIN_TAP_LIMIT_FRACTION));
    (value.abs() * lit(TAP_FRACTION)).max(min_distance)
}

/// Returns the fraction of the probe's step that a phase takes: 1 in phase 4, less in others.
#[inline(always)]
fn step_fraction<R: Real>(phase: R) -> R {
    let retries = (phase - lit(4.0)).max(lit(0.0)).named("retries");
    let sheet_fraction = (phase - lit(3.5)) * lit(2.0);
    (lit::<R>(1.0) / (retries * retries + lit(1.0))).min(sheet_fraction)
}

/// Returns the phase that searches the middle of a sheet. Phase 4 has passed it if the field falls as much before the
/// middle as it rises behind.
#[inline(always)]
fn sheet_phase<R: Real>(value: R, expected: R, field: R) -> R {
    let drop = (value - expected).max(lit(1e-30)).named("drop");
    let [low, high] = SHEET_FRACTIONS;
    let fraction = ((value - field + drop) / (drop * lit(2.0)))
        .max(lit(low))
        .min(lit(high));
    lit::<R>(3.5) + fraction * lit(0.5)
}

/// Returns the probe's step in phase 4, from the point of a round at `offset` from the candidate.
///
/// It leads against the gradient, slightly beyond the expected surface but at most `limit` far. It does not
/// lead back from a face that earlier rounds reached, unless through a thin sheet. From a candidate in a
/// solid it leads out.
#[inline(always)]
fn probe_step<R: Real>(
    value: R,
    gradient: R::Vec3,
    offset: R::Vec3,
    rounding: R,
    limit: R,
) -> R::Vec3 {
    let backward = gradient.dot(offset).max(lit(0.0)).named("backward");
    let offset_square = offset.dot(offset).named("offset_square");
    let gradient_square = gradient
        .dot(gradient)
        .max(lit(1e-30))
        .named("gradient_square");
    let sideways = gradient - offset * (backward / offset_square.max(lit(1e-30)));
    let is_thin = (value * value)
        .less(offset_square * gradient_square * lit(THIN_SHEET_FRACTION * THIN_SHEET_FRACTION));
    let direction = R::Vec3::select(is_thin, gradient, sideways).named("direction");
    let slope_square = direction.dot(direction).named("slope_square");
    let is_valley = slope_square.less(gradient_square * lit(MIN_EDGE_SINE_SQUARED));
    let slope = slope_square.max(lit(1e-30)).sqrt().named("slope");
    let distance = (value.abs() / slope).named("distance");
    let min_overshoot =
        (rounding * lit(MIN_OVERSHOOT_ROUNDINGS)).max(limit * lit(MIN_OVERSHOOT_LIMIT_FRACTION));
    let length = (distance + min_overshoot.max(distance * lit(OVERSHOOT_FRACTION))).min(limit);
    let factor = R::select(is_valley, lit(0.0), length / slope).named("factor");
    direction * R::select(value.less(lit(0.0)), factor, -factor)
}

/// Returns the candidate's offset to the point that a probe reaches, from which the next round continues.
/// `point` is that of this round.
#[inline(always)]
pub fn next_offset<R: Real>(
    point: R::Vec3,
    offset: R::Vec3,
    phase: R,
    value: R,
    gradient: R::Vec3,
    limit: R,
) -> R::Vec3 {
    offset
        + probe_step::<R>(value, gradient, offset, rounding::<R>(point), limit)
            * step_fraction(phase)
}

/// Returns the point at which a phase evaluates the field. `point` is that of the round, at `offset` from the
/// candidate. `value` is the field there, and `gradient` its gradient as far as phases 1 to 3 found it.
/// Surfaces farther than `limit` do not matter.
#[inline(always)]
pub fn sample_point<R: Real>(
    point: R::Vec3,
    offset: R::Vec3,
    phase: R,
    value: R,
    gradient: R::Vec3,
    limit: R,
) -> R::Vec3 {
    let zero = lit::<R>(0.0);
    let distance = tap_distance::<R>(value, point, limit).named("distance");
    let component = |axis_phase: f64| {
        let is_axis = (phase - lit(axis_phase)).abs().less(lit(0.5));
        R::select(is_axis, distance, zero)
    };
    let tap = R::Vec3::new(component(1.0), component(2.0), component(3.0));
    let fraction = R::select(phase.less(lit(3.5)), zero, step_fraction(phase)).named("fraction");
    point + tap + probe_step::<R>(value, gradient, offset, rounding::<R>(point), limit) * fraction
}

/// Returns the gradient after one of the phases 1 to 3. `change` is the difference between the tap's value
/// and the round's, `distance` that of the tap.
#[inline(always)]
pub fn add_tap<R: Real>(gradient: R::Vec3, phase: R, change: R, distance: R) -> R::Vec3 {
    let zero = lit::<R>(0.0);
    let slope = (change / distance).named("slope");
    let component = |axis_phase: f64| {
        let is_axis = (phase - lit(axis_phase)).abs().less(lit(0.5));
        R::select(is_axis, slope, zero)
    };
    gradient + R::Vec3::new(component(1.0), component(2.0), component(3.0))
}

/// Outcome of a probe from which on it is the next phase.
pub const MIN_PHASE_OUTCOME: f32 = 1.5;

/// Returns the outcome of a probe: 1 for a surface, −1 without a relevant one, 0 where another round decides.
///
/// The probe may have ended too deep to locate the surface, or passed a sheet. Then the outcome is the phase that takes a
/// fraction of the step.
///
/// The field is `field` at `next`, and `value` at the round's `point` with the offset `offset`, both offsets
/// relative to the candidate. A probe without any change of the field finds nothing.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the state of a candidate")]
pub fn probe_outcome<R: Real>(
    point: R::Vec3,
    gradient: R::Vec3,
    round: R,
    phase: R,
    value: R,
    field: R,
    offset: R::Vec3,
    next: R::Vec3,
    limit: R,
) -> R {
    // The rounding error of a field that was divided by a large bound is smaller, too.
    let noise = rounding::<R>(point) * gradient.length().min(lit(1.0)) * lit(MAX_NOISE_ROUNDINGS);
    let is_surface = value.min(field).less(-noise);
    let expected = value + gradient.dot(next - offset);
    let is_deep = field.less(expected - value * lit(MAX_EXCESS_DEPTH));
    let is_outside = lit::<R>(0.0).less(value);
    let is_full_step = R::not(phase.less(lit(MIN_FULL_STEP_PHASE)));
    let may_go_back = R::and(is_outside, is_full_step);
    let may_retry = R::and(may_go_back, phase.less(lit(LAST_PHASE - 0.5)));
    let has_overshot = R::and(R::and(is_surface, is_deep), may_retry);
    let is_last_round = lit::<R>(MAX_ROUNDS - 1.5).less(round);
    let has_changed = R::or(field.less(value), value.less(field));
    // Later steps lead sideways, and so farther away.
    let is_too_far = (limit * limit * lit(FAR_FRACTION)).less(next.dot(next));
    let may_continue = R::and(has_changed, R::not(R::or(is_last_round, is_too_far)));
    let surface_outcome = R::select(has_overshot, phase + lit(1.0), lit(1.0));
    let is_passed = R::and(may_go_back, (field + expected).less(noise * lit(-2.0)));
    let other_outcome = R::select(may_continue, lit(0.0), lit(-1.0));
    R::select(
        is_surface,
        surface_outcome,
        R::select(
            is_passed,
            sheet_phase(value, expected, field),
            other_outcome,
        ),
    )
}

/// Returns the value with which a shadow's candidate or another round begins. A value below zero there is rounding:
/// rays end in solids.
#[inline(always)]
pub fn restart_value<R: Real>(field: R) -> R {
    field.max(lit(1e-30))
}

/// Returns the offset from the candidate to a surface. It is the root of the line through the round's point
/// and the offset `next`, at which the field is `field`.
#[inline(always)]
pub fn surface_offset<R: Real>(offset: R::Vec3, next: R::Vec3, value: R, field: R) -> R::Vec3 {
    let crosses = (value * field).less(lit(0.0));
    let change = R::select(crosses, value - field, lit(1.0));
    offset + (next - offset) * R::select(crosses, value / change, lit(1.0))
}
