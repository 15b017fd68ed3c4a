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
//! | 5 to 9 | a fraction of that way, where the field was far below the gradient's prediction |
//! | 10 to 15 | points on the new face of a sharp edge, before the place that phase 4 found |
//! | 16 | a point on its old face, before that place |
//!
//! If the field is above zero in phase 4, another face begins there, or the field falls more slowly from
//! there on. The probe then continues from that point, along the edge between the faces, in at most eight
//! rounds of these phases. At a sharp edge, phase 4 leads far along the old face, and what it finds may lie behind the edge
//! of a curved face. Phases 10 and 16 verify that both faces end there. A surface is where the field is below zero, and nowhere else: a cutter leaves
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
const MIN_EDGE_SINE_SQUARED: f64 = 1e-6;
/// Squared sine of the angle between two faces below which an edge counts as sharp. If a face is curved, the edge may be far
/// from the place at which their tangent planes meet.
const SHARP_EDGE_SINE_SQUARED: f64 = 0.2;
/// Maximum length of the last part of the way to a sharp edge, as a fraction of the distance of the edge.
const EDGE_TOLERANCE: f64 = 0.1;
/// Fraction of the way to a sharp edge at which its place is verified.
const VERIFIED_FRACTION: f64 = 0.9;
/// Thickness of a sheet into which a probe goes back, as a fraction of the distance to it.
const THIN_SHEET_FRACTION: f64 = 0.1;
/// Minimum cosine of the angle between the way to a sheet and its normal for a probe that goes back.
const MIN_BACK_COSINE: f64 = 0.9;
/// Depth below zero from which on a value is not mere rounding, in units of the field's rounding error.
const MAX_NOISE_ROUNDINGS: f64 = 4.0;
/// Maximum depth of the field below the gradient's prediction, in units of the value. Beyond it, the line
/// through both ends of a probe does not locate the surface.
const MAX_EXCESS_DEPTH: f64 = 0.15;
/// Fraction of the squared limit from which on a probe is too far: less than one, since a step of exactly the limit
/// is rounded.
const FAR_FRACTION: f64 = 0.999;
/// Phase from which on the gradient is measured.
pub const MIN_TAP_PHASE: f32 = 0.75;
/// Phase up to which it is measured. Probes follow.
pub const MAX_TAP_PHASE: f32 = 3.5;
/// Fractions of phase 4's step at which the middle of a sheet is searched.
const SHEET_FRACTIONS: [f64; 2] = [1e-4, 0.98];
/// Phase between phase 4 and those in the middle of a sheet.
const MIN_FULL_STEP_PHASE: f64 = 3.995;
/// First phase in which a probe goes back on its way.
const BACK_PHASE: f64 = 5.0;
/// Phase that verifies the place of a sharp edge on its new face. A probe goes back on that face in the phases after it.
const NEW_FACE_PHASE: f64 = 10.0;
/// Phase that verifies the place of a sharp edge on its old face.
const OLD_FACE_PHASE: f64 = 16.0;
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

/// Reports whether a phase takes points between the foot on a new face and a sharp edge.
#[inline(always)]
fn is_on_new_face<R: Real>(phase: R) -> R::Bool {
    R::and(
        lit::<R>(NEW_FACE_PHASE - 0.5).less(phase),
        phase.less(lit(OLD_FACE_PHASE - 0.5)),
    )
}

/// Reports whether a phase verifies that an edge is not nearer than expected.
#[inline(always)]
fn is_verifying<R: Real>(phase: R) -> R::Bool {
    let is_new = (phase - lit(NEW_FACE_PHASE)).abs().less(lit(0.5));
    R::or(is_new, lit::<R>(OLD_FACE_PHASE - 0.5).less(phase))
}

/// Returns the fraction of the probe's way that a phase takes: 1 in phase 4, less in others.
#[inline(always)]
fn way_fraction<R: Real>(phase: R) -> R {
    let first = R::select(is_on_new_face(phase), lit(NEW_FACE_PHASE), lit(4.0));
    let retries = (phase - first).max(lit(0.0)).named("retries");
    let sheet_fraction = (phase - lit(3.5)) * lit(2.0);
    let retried = (lit::<R>(1.0) / (retries * retries + lit(1.0))).min(sheet_fraction);
    R::select(is_verifying(phase), lit(VERIFIED_FRACTION), retried)
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

/// Reports whether a round is at a sharp edge, between the face that the rounds before have reached and a new one. `face` is
/// zero in the first round.
#[inline(always)]
fn is_sharp_edge<R: Real>(gradient: R::Vec3, face: R::Vec3) -> R::Bool {
    let along = gradient.dot(face).named("along");
    let squares = (gradient.dot(gradient) * face.dot(face)).named("squares");
    let leads_back = along.less(lit(0.0));
    let is_narrow = (squares - along * along).less(squares * lit(SHARP_EDGE_SINE_SQUARED));
    R::and(leads_back, is_narrow)
}

/// Reports whether a probe has passed a thin sheet: the field falls on the way back, by little.
#[inline(always)]
fn has_passed_sheet<R: Real>(value: R, gradient: R::Vec3, offset: R::Vec3) -> R::Bool {
    let back = gradient.dot(offset).named("back");
    let squares = (gradient.dot(gradient) * offset.dot(offset)).named("squares");
    let is_thin = (value * value).less(squares * lit(THIN_SHEET_FRACTION * THIN_SHEET_FRACTION));
    let is_straight = (squares * lit(MIN_BACK_COSINE * MIN_BACK_COSINE)).less(back * back);
    R::and(R::and(is_thin, is_straight), lit::<R>(0.0).less(back))
}

/// Returns a vector, shortened to a length where it is longer.
#[inline(always)]
fn no_longer<R: Real>(vector: R::Vec3, length: R) -> R::Vec3 {
    vector * (length / vector.length().max(lit(1e-30))).min(lit(1.0))
}

/// Returns the way of a probe in a phase, from the `point` of a round.
///
/// It leads against the gradient, slightly beyond the expected surface but at most `limit` far. It does not
/// lead back from the `face` that earlier rounds have reached, unless through a thin sheet. From a candidate in a solid it leads out.
///
/// Some phases take points between the foot on the new face and a sharp edge.
#[inline(always)]
fn probe_way<R: Real>(
    phase: R,
    value: R,
    gradient: R::Vec3,
    offset: R::Vec3,
    face: R::Vec3,
    point: R::Vec3,
    limit: R,
) -> R::Vec3 {
    let rounding = rounding::<R>(point);
    let backward = gradient.dot(face).min(lit(0.0)).named("backward");
    let face_square = face.dot(face).named("face_square");
    let has_passed_sheet = has_passed_sheet::<R>(value, gradient, offset);
    let gradient_square = gradient
        .dot(gradient)
        .max(lit(1e-30))
        .named("gradient_square");
    let sideways = gradient - face * (backward / face_square.max(lit(1e-30)));
    let direction = R::Vec3::select(has_passed_sheet, gradient, sideways).named("direction");
    let slope_square = direction.dot(direction).named("slope_square");
    let is_valley = slope_square.less(gradient_square * lit(MIN_EDGE_SINE_SQUARED));
    let slope = slope_square.max(lit(1e-30)).sqrt().named("slope");
    let distance = (value.abs() / slope).named("distance");
    let min_overshoot =
        (rounding * lit(MIN_OVERSHOOT_ROUNDINGS)).max(limit * lit(MIN_OVERSHOOT_LIMIT_FRACTION));
    let overshoot = min_overshoot.max(distance * lit(OVERSHOOT_FRACTION));
    let factor = R::select(is_valley, lit(0.0), (distance + overshoot) / slope).named("factor");
    let signed_factor = R::select(value.less(lit(0.0)), factor, -factor);
    let step = (direction * signed_factor).named("step");
    // The step leads within the old face to the new one, so its part along the gradient leads to the foot.
    let to_foot = gradient * (step.dot(gradient) / gradient_square);
    let foot = no_longer::<R>(to_foot, limit).named("foot");
    let along_face = no_longer::<R>(step - to_foot, limit).named("along_face");
    let fraction = way_fraction(phase).named("fraction");
    let foot_fraction = R::select(is_on_new_face(phase), lit(1.0), fraction);
    foot * foot_fraction + along_face * fraction
}

/// Returns the candidate's offset to the point that a probe reaches, from which the next round continues. Verified, it is
/// that of the edge. `point` is that of this round.
#[inline(always)]
pub fn next_offset<R: Real>(
    point: R::Vec3,
    offset: R::Vec3,
    face: R::Vec3,
    phase: R,
    value: R,
    gradient: R::Vec3,
    limit: R,
) -> R::Vec3 {
    let end_phase = R::select(is_verifying(phase), lit(4.0), phase).named("end_phase");
    offset + probe_way::<R>(end_phase, value, gradient, offset, face, point, limit)
}

/// Returns the point at which a phase evaluates the field. `point` is that of the round, at `offset` from the candidate. `value` is the field there, and `gradient` its gradient as far as phases 1 to 3 found it.
/// Surfaces farther than `limit` do not matter.
#[inline(always)]
pub fn sample_point<R: Real>(
    point: R::Vec3,
    offset: R::Vec3,
    face: R::Vec3,
    phase: R,
    value: R,
    gradient: R::Vec3,
    limit: R,
) -> R::Vec3 {
    let tap = tap_point::<R>(point, phase, value, limit);
    let probe = probe_point::<R>(point, offset, face, phase, value, gradient, limit);
    let is_tap = phase.less(lit(f64::from(MAX_TAP_PHASE)));
    R::Vec3::select(is_tap, tap, probe)
}

/// Returns [`sample_point`] for the phases up to [`MAX_TAP_PHASE`].
#[inline(always)]
pub fn tap_point<R: Real>(point: R::Vec3, phase: R, value: R, limit: R) -> R::Vec3 {
    let distance = tap_distance::<R>(value, point, limit).named("distance");
    let component = |axis_phase: f64| {
        let is_axis = (phase - lit(axis_phase)).abs().less(lit(0.5));
        R::select(is_axis, distance, lit(0.0))
    };
    point + R::Vec3::new(component(1.0), component(2.0), component(3.0))
}

/// Returns [`sample_point`] for the other phases.
#[inline(always)]
pub fn probe_point<R: Real>(
    point: R::Vec3,
    offset: R::Vec3,
    face: R::Vec3,
    phase: R,
    value: R,
    gradient: R::Vec3,
    limit: R,
) -> R::Vec3 {
    point + probe_way::<R>(phase, value, gradient, offset, face, point, limit).named("way")
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
    face: R::Vec3,
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
    let way = next - offset;
    let is_long = (next.dot(next) * lit(EDGE_TOLERANCE * EDGE_TOLERANCE)).less(way.dot(way));
    let is_edge = R::not(has_passed_sheet::<R>(value, gradient, offset));
    let is_sharp = R::and(R::and(is_edge, is_sharp_edge::<R>(gradient, face)), is_long);
    let is_verifying = is_verifying(phase);
    let is_retry = lit::<R>(BACK_PHASE - 0.5).less(phase);
    let is_last_retry = R::or(
        (phase - lit(NEW_FACE_PHASE - 1.0)).abs().less(lit(0.5)),
        (phase - lit(OLD_FACE_PHASE - 1.0)).abs().less(lit(0.5)),
    );
    let has_overshot = R::and(R::or(is_deep, is_sharp), R::not(is_last_retry));
    let goes_back = R::and(R::or(has_overshot, is_verifying), may_go_back);
    let starts_verifying = R::and(is_sharp, R::not(is_retry));
    let is_on_old_face = lit::<R>(OLD_FACE_PHASE - 0.5).less(phase);
    let retry_phase = R::select(is_on_old_face, lit(BACK_PHASE), phase + lit(1.0));
    let later_phase = R::select(starts_verifying, lit(NEW_FACE_PHASE), retry_phase);
    let is_last_round = lit::<R>(MAX_ROUNDS - 1.5).less(round);
    let has_changed = R::or(field.less(value), value.less(field));
    // Later steps lead sideways, and so farther away.
    let is_too_far = (limit * limit * lit(FAR_FRACTION)).less(next.dot(next));
    let may_continue = R::and(has_changed, R::not(R::or(is_last_round, is_too_far)));
    let surface_outcome = R::select(goes_back, later_phase, lit(1.0));
    let is_passed = R::and(may_go_back, (field + expected).less(noise * lit(-2.0)));
    let other_outcome = R::select(may_continue, lit(0.0), lit(-1.0));
    let verified_outcome = R::select(is_on_old_face, lit(1.0), lit(OLD_FACE_PHASE));
    let other_outcome = R::select(is_verifying, verified_outcome, other_outcome);
    R::select(
        is_surface,
        surface_outcome,
        R::select(
            R::and(is_passed, R::not(is_retry)),
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
