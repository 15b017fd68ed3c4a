//! Sphere tracing, one step at a time.
//!
//! A ray keeps the last point that is proven to lie outside, `t`, and the field's value there, `field`. It is
//! the radius of an empty sphere. The ray tries a `step` longer than that radius. The running slope of the
//! field along the ray determines the excess length (automatic relaxation: R. Bán and G. Valasek, *Automatic
//! Step Size Relaxation in Sphere Tracing*, 2023). If the empty sphere around the new point overlaps that
//! around the old one, no surface was skipped. Otherwise the ray goes back and takes exactly the old radius
//! (B. Keinert and others, *Enhanced Sphere Tracing*, 2014, there with a shorter step back).
//!
//! # Hits
//! A surface is where the field changes its sign, and nothing else. The field must fall below zero by more
//! than [`sign_margin`]. A field that is positive on both sides but for rounding (a flush cut, two faces that
//! coincide, a sheet without thickness) is passed. Neither a bound of the slope nor a factor on the field
//! moves a hit. Where solids touch, the field is zero in the contact too, without a sheet. So at the first value
//! near zero, a ray probes the field on both sides ([`takes_probe`]).
//!
//! The field may be near zero and fall almost linearly, as towards a plane. Then a line through the last two
//! points estimates the root. The ray then goes slightly beyond the estimate, to where the sign should have
//! changed. Estimates begin at 10 thresholds, at most a quarter of a pixel. Where the field falls strictly
//! linearly, as above a plane at a grazing angle, both numbers double. A ray that all but touches a surface
//! would creep past it in tiny steps. So steps are at least a 32nd of a pixel long where the field is below
//! that, or end at the estimated root. Thinner sheets along the ray are passed. After 1,024 steps this
//! minimum grows, up to half a pixel. Where a field was divided by a large bound, rays need many steps
//! without a surface nearby. After 2,048 steps it grows without limit, so that a ray along a field that stays
//! close to zero ends, too.
//!
//! A field may fall faster than its slope bound, or be discontinuous: a slope that a scene states is not
//! checked. A step that ends deep inside is halved until the change of sign is bracketed to a fraction of
//! half a pixel. The bracket's two sides then close in on the root ([`secant_step`]).
//!
//! The field has a slope of at most one, and is negated for rays that start inside: these hit the surface
//! from behind.

use sdfc_vm::real::{Real, Vector3, lit};

/// The end of a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Status {
    /// Not ended.
    #[default]
    Active = 0,
    /// On a surface, from outside.
    Hit = 1,
    /// Beyond `far` or the scene's bounds.
    Miss = 2,
    /// Out of steps.
    StepCap = 3,
    /// On a value that is not a number.
    NotANumber = 4,
    /// On a surface, from inside the solid.
    Inside = 5,
}

impl Status {
    /// Returns the status stored in a ray's status word, which also holds the start side and [`SHOWN`].
    pub fn from_word(word: u32) -> Self {
        match (word & END_MASK, word & FROM_INSIDE != 0) {
            (1, false) => Self::Hit,
            (1, true) => Self::Inside,
            (2, _) => Self::Miss,
            (3, _) => Self::StepCap,
            (4, _) => Self::NotANumber,
            _ => Self::Active,
        }
    }
}

/// Mask of the status bits for a ray's end. [`Status::Inside`] is stored as a hit with [`FROM_INSIDE`].
pub const END_MASK: u32 = 7;
/// Status bit of a ray that started inside a solid.
pub const FROM_INSIDE: u32 = 8;
/// Status bit of a ray that is drawn: it ended on a surface, or near one when it ran out of steps.
pub const SHOWN: u32 = 16;
/// Status bit of a ray whose end the engine `reference` could not prove. Kernels never set it.
pub const UNDECIDED: u32 = 32;
/// Number of the first status bit for the proved fraction of an active ray's step.
pub const PROVED_SHIFT: u32 = 8;
/// The proved fraction of a whole step.
pub const MAX_PROVED: f32 = 16_777_215.0;

/// Default weight of the newest slope in the running mean.
pub const DEFAULT_RELAXATION: f64 = 0.3;
/// Maximum running mean that is used: steps are at most 2 / (1 − this) radii.
const MAX_TREND: f64 = 0.9;
/// Overshoot of a sample beyond an estimated surface, as a fraction of the distance to it: along rays, shadow
/// rays and probes. Thinner sheets may be passed.
pub(crate) const OVERSHOOT_FRACTION: f64 = 0.02;
/// Margin below zero that makes a hit, in units of the field's rounding error.
pub(crate) const MARGIN_ROUNDINGS: f64 = 4.0;
/// Margin per slope along the ray, for fields with a gradient of unknown length.
const MARGIN_ROUNDINGS_PER_SLOPE: f64 = 64.0;
/// Distance of a probe from the ray, in units of the field's rounding error. Across a plane of contact it exceeds
/// the margin, unless the plane is nearly parallel to the probe.
const PROBE_ROUNDINGS: f64 = 48.0;
/// Maximum of that distance, in halves of a pixel.
const MAX_PROBE_HALF_PIXELS: f64 = 0.25;
/// Components of the unit vector to the first two probes, up to their signs. For the other two they are rotated by
/// one place. Few planes are nearly parallel to both.
const PROBE_DIRECTION: [f64; 3] = [0.21, 0.55, 0.81];
/// Depth below zero of a root that probes prove, in units of the field's rounding error.
const ROOT_ROUNDINGS: f64 = 0.01;
/// Number of probes after which a ray takes no more before its next step.
const MAX_PROBES: f64 = 4.0;
/// Count of probes of a ray whose next sample, the last one, lies ahead on the ray itself.
const PROBES_BEFORE_LAST: f64 = 5.0;
/// Number of steps after which the minimum step of a ray close to zero grows, up to half a pixel.
const CAPPED_SPEEDUP_STEPS: f64 = 1024.0;
/// Number of steps after which it grows without limit, so that the ray ends. By default, scenes give rays a
/// thousand more.
const UNCAPPED_SPEEDUP_STEPS: f64 = 2048.0;
/// Minimum descent of the field per length along the ray for an estimate of the root.
const MIN_FALL: f64 = 1e-30;
/// Number of further steps after which the minimum step has doubled.
const SPEEDUP_DOUBLING_STEPS: f64 = 64.0;
/// Field value, in thresholds, from which on roots are estimated where the field falls strictly linearly;
/// half as much where it falls linearly.
const SECANT_FROM_THRESHOLDS: f64 = 20.0;
/// Minimum step where the field is below it, in halves of a pixel.
const MIN_STEP_HALF_PIXELS: f64 = 0.0625;
/// Maximum distance to an estimated root, in halves of a pixel: four pixels. A longer line may lead through a
/// wall, and is followed only where the field falls strictly linearly.
const MAX_SECANT_HALF_PIXELS: f64 = 8.0;
/// Length of a line to an estimated root, in radii. A longer one is followed only from a value below the threshold.
const MAX_UNPROVED_RADII: f64 = 4.0;
/// Value up to which a long line is always followed, in units of the depth that makes a hit.
const MIN_LINE_DEPTHS: f64 = 4.0;
/// Number of steps after which a ray that falls strictly linearly goes far to a root, whatever may be in between.
const FAR_STEPS: f64 = 256.0;
/// Maximum step to a root of a field with unknown slopes without a sample halfway, in halves of a pixel.
const MAX_RAW_SECANT_HALF_PIXELS: f64 = 4.0;
/// Maximum relative difference between the last slope and the mean in a linear fall.
const LINEARITY_TOLERANCE: f64 = 0.3;
/// Maximum relative difference in a strictly linear fall, as towards a plane and nothing else.
const STRICT_LINEARITY_TOLERANCE: f64 = 0.01;
/// Field value below which a ray out of steps counts as a hit, in halves of a pixel: a pixel.
const MAX_ACCEPTED_HALF_PIXELS: f64 = 2.0;
/// Field value below which it does if the field falls to zero before `far`, in halves of a pixel: four
/// pixels.
const MAX_ACCEPTED_FALLING_HALF_PIXELS: f64 = 8.0;
/// Maximum distance of the last sample from the root, in units of [`side_distance`].
const MAX_SETTLED_SIDE_DISTANCES: f64 = 1.5;
/// Number of secant steps after which every second one halves the bracket of a raw field.
const FREE_SECANT_STEPS: f64 = 4.0;
/// Distance from a root at which the sign is certain, in units of the field's rounding error.
const SIDE_ROUNDINGS: f64 = 2.0;
/// Maximum number of secant steps.
pub const MAX_SECANT_STEPS: u32 = 32;

/// State of a ray after a step.
#[derive(Clone, Copy, Debug)]
pub struct Step<R> {
    /// Distance along the ray.
    pub t: R,
    /// Field value there.
    pub field: R,
    /// Next step to try.
    pub step: R,
    /// Running mean of the field's slope along the ray; below −1 it counts probes since the last step.
    pub trend: R,
    /// Distance of the last point with the field above zero, one step before or earlier.
    pub t_before: R,
    /// Field value there.
    pub field_before: R,
    /// 1 where the ray has reached a root, else 0.
    pub arrived: R,
}

/// Takes one step: `next_field` is the field's value at `t + step`, and `count`, the ray's number of steps,
/// includes it.
///
/// A ray begins with `field = step = 0` and a `trend` of −1. `relaxation`, from 0 to 1, is the weight of the
/// newest slope in the running mean. With 0 the trend stays −1 and each step is exactly the radius: plain
/// sphere tracing. Where the field is near `threshold`, a fraction of `half_pixel`, roots are estimated, up to
/// `t_exit` along the ray. `rounding` is the field's rounding error along the ray, and `value_rounding` that of
/// `next_field` alone ([`rounding_near`]). `is_raw` is 1 where the length of the
/// field's gradient is unknown, else 0. `is_probe` is 1 where the sample was a probe ([`takes_probe`]): if two are
/// below the margin, there is a surface at `t`. A raw field may be near zero far from its surface. So there a third
/// probe follows on the ray, and if that is below the margin too, the surface lies between it and `t`.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "a ray's state, as the buffer holds it"
)]
pub fn march_step<R: Real>(
    t: R,
    field: R,
    step: R,
    trend: R,
    t_before: R,
    field_before: R,
    next_field: R,
    count: R,
    threshold: R,
    half_pixel: R,
    relaxation: R,
    rounding: R,
    value_rounding: R,
    is_raw: R,
    t_exit: R,
    crowd_enter: R,
    crowd_exit: R,
    plane_t: R,
    is_probe: R,
) -> Step<R> {
    let margin = (rounding * lit(MARGIN_ROUNDINGS)).named("margin");
    let is_regular = is_probe.less(lit(0.5));
    let probes = probe_count(trend).named("probes");
    let is_first = (probes * lit(0.5)).fract().less(lit(0.25));
    let is_last = is_last_probe(probes);
    let is_inside = next_field.less(-margin);
    let is_second_inside = R::and(is_inside, R::not(is_first));
    let is_known = is_raw.less(lit(0.5));
    let is_proven = R::or(is_last, R::and(is_known, is_second_inside));
    let proves_surface = R::and(R::not(is_regular), is_proven);
    // Between `t` and the last sample the ray enters a solid.
    let ahead_t = (t + probe_distance(half_pixel, rounding)).named("ahead_t");
    let is_in_range = R::not(t_exit.less(ahead_t));
    let enters = R::and(R::and(is_last, is_inside), is_in_range);
    // If one of the first two probes lies in the plane of contact itself, the others may not.
    let is_parallel = R::and(next_field.abs().less(margin), probes.less(lit(1.5)));
    let next_probes = R::select(
        is_inside,
        R::select(is_first, probes + lit(1.0), lit(PROBES_BEFORE_LAST)),
        R::select(is_parallel, lit(2.0), lit(MAX_PROBES)),
    );
    let previous = Step {
        t,
        field,
        step,
        trend: trend.max(lit(-1.0)),
        t_before,
        field_before,
        arrived: lit(0.0),
    };
    let regular = sphere_step(
        previous,
        next_field,
        count,
        threshold,
        half_pixel,
        relaxation,
        rounding,
        value_rounding,
        is_raw,
        (t_exit, [crowd_enter, crowd_exit, plane_t]),
    );
    // In a contact the root is at `t`, but for rounding.
    let contact_field = field.min(rounding * lit(-ROOT_ROUNDINGS));
    let root_field = R::select(enters, next_field, contact_field);
    let moves_bracket = R::and(enters, R::not(field.less(lit(0.0))));
    let probed = Step {
        t: R::select(enters, ahead_t, t),
        field: R::select(proves_surface, root_field, field),
        step,
        trend: lit::<R>(-1.0) - next_probes,
        t_before: R::select(moves_bracket, t, t_before),
        field_before: R::select(moves_bracket, field, field_before),
        arrived: R::select(proves_surface, lit(1.0), lit(0.0)),
    };
    Step {
        t: R::select(is_regular, regular.t, probed.t),
        field: R::select(is_regular, regular.field, probed.field),
        step: R::select(is_regular, regular.step, probed.step),
        trend: R::select(is_regular, regular.trend, probed.trend),
        t_before: R::select(is_regular, regular.t_before, probed.t_before),
        field_before: R::select(is_regular, regular.field_before, probed.field_before),
        arrived: R::select(is_regular, regular.arrived, probed.arrived),
    }
}

/// Takes a step that is no probe, with the parameters of [`march_step`].
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a ray's state and its frame")]
fn sphere_step<R: Real>(
    previous: Step<R>,
    next_field: R,
    count: R,
    threshold: R,
    half_pixel: R,
    relaxation: R,
    rounding: R,
    value_rounding: R,
    is_raw: R,
    (t_exit, crowd): (R, [R; 3]),
) -> Step<R> {
    let Step {
        t,
        field,
        step,
        trend,
        t_before,
        field_before,
        ..
    } = previous;
    let zero = lit::<R>(0.0);
    let slope = ((next_field - field) / step.max(lit(1e-30))).named("slope");
    let depth = sign_margin(value_rounding, slope, is_raw).named("depth");
    let is_plain = R::not(field.less(step));
    let overlaps = R::not((field + next_field).less(step));
    let is_estimate = R::or(is_plain, field.less(field_before));
    let secant_start = secant_start(threshold, half_pixel).named("secant_start");
    let short_step = short_step::<R>(half_pixel, threshold, count).named("short_step");
    let is_value_short = field.less(short_step);
    let is_step_short = R::and(is_value_short, R::not(short_step.less(step)));
    let has_crossed = next_field.less(-depth);
    // The value at the end of a long line must be near zero, or there was a surface in between.
    let max_estimate =
        (half_pixel.max(threshold) * lit(MAX_SECANT_HALF_PIXELS)).named("max_estimate");
    let is_far = R::and(R::not(is_plain), max_estimate.less(step));
    let max_depth = (field * lit(2.0 * OVERSHOOT_FRACTION)).max(depth * lit(4.0));
    let is_astray = R::and(is_far, next_field.less(-max_depth));
    let is_inside = R::and(
        has_crossed,
        R::and(field.less(secant_start), R::not(is_astray)),
    );
    let has_landed = R::and(is_inside, R::or(is_estimate, is_step_short));
    let has_found = R::and(has_crossed, R::or(is_plain, has_landed));
    let certain_depth = threshold.max(depth * lit(2.0)).named("certain_depth");
    let is_deep = R::and(next_field.less(-certain_depth), certain_depth.less(step));
    // A long step may pass a sheet. A value off the line may lie behind a wall before a field that was
    // divided by a bound.
    let is_raw = lit::<R>(0.5).less(is_raw);
    let long_step = certain_depth.max(half_pixel * lit(MAX_RAW_SECANT_HALF_PIXELS));
    let is_long = long_step.less(step);
    let is_off_line = R::and(next_field.less(-max_depth), certain_depth.less(step));
    let is_unproven = R::and(is_raw, R::or(is_long, is_off_line));
    // A short step is taken whatever the radius, and may be long for a ray that has crept for many steps.
    let is_short_crossing = R::and(R::and(has_crossed, is_step_short), R::not(has_found));
    let must_halve = R::or(
        is_short_crossing,
        R::and(has_found, R::or(is_deep, is_unproven)),
    );
    let may_advance = R::or(is_plain, R::or(overlaps, R::or(has_landed, is_step_short)));
    let advances = R::and(may_advance, R::not(must_halve));
    let mean_slope = trend + (slope - trend) * relaxation;
    let has_slope = R::and(advances, zero.less(step));
    let trend = R::select(
        has_slope,
        mean_slope.clamp(lit(-1.0), lit(MAX_TREND)),
        lit(-1.0),
    )
    .named("new_trend");
    let new_t = R::select(advances, t + step, t).named("new_t");
    let new_field = R::select(advances, next_field, field).named("new_field");
    let relaxed = new_field.max(zero) * lit(2.0) / (lit::<R>(1.0) - trend);
    // A slope this small is that of a field that underflows: its line says nothing about a root.
    let is_falling = R::and(has_slope, slope.less(lit(-MIN_FALL)));
    let remaining = new_field.max(zero);
    let estimate_depth =
        (remaining + remaining.min(threshold) * lit(OVERSHOOT_FRACTION) + depth * lit(2.0))
            .named("estimate_depth");
    let to_root = (estimate_depth / (-slope).max(lit(MIN_FALL))).named("to_root");
    let min_stalled_step = (rounding * lit(2.0 * MARGIN_ROUNDINGS))
        .min(short_step)
        .named("min_stalled_step");
    let least_step = R::select(
        is_falling,
        to_root.min(short_step),
        R::select(has_slope, short_step, min_stalled_step),
    );
    let is_close = new_field.less(short_step);
    let regular_step = R::select(is_close, relaxed.max(least_step), relaxed).named("regular_step");
    let is_linear = is_steady::<R>(slope, mean_slope, LINEARITY_TOLERANCE);
    let is_strictly_linear = is_steady::<R>(slope, mean_slope, STRICT_LINEARITY_TOLERANCE);
    // A field that was divided by a bound may be far above its surface, and a wall in between.
    let is_free = R::and(R::not(is_raw), is_way_free([new_t, to_root], crowd, count));
    let is_short = is_short_line::<R>([to_root, max_estimate], new_field, threshold, depth);
    let is_estimate_near = R::or(is_short, R::and(is_strictly_linear, is_free));
    let start_value = R::select(
        is_strictly_linear,
        secant_start,
        (secant_start * lit(0.5)).max(threshold),
    );
    let is_in_range = R::and(new_field.less(start_value), to_root.less(t_exit - new_t));
    let takes_estimate = R::and(
        is_falling,
        R::and(R::and(is_linear, is_estimate_near), is_in_range),
    );
    let next_step = R::select(takes_estimate, to_root, regular_step);
    // A root lies between the last point above zero and the first one that has crossed.
    let moves_bracket = R::and(advances, R::not(field.less(zero)));
    Step {
        t: new_t,
        field: new_field,
        step: R::select(must_halve, step * lit(0.5), next_step),
        trend,
        t_before: R::select(moves_bracket, t, t_before),
        field_before: R::select(moves_bracket, field, field_before),
        arrived: R::select(R::and(advances, has_found), lit(1.0), lit(0.0)),
    }
}

/// Reports whether the field falls by its mean slope, up to a fraction of it.
#[inline(always)]
fn is_steady<R: Real>(slope: R, mean_slope: R, tolerance: f64) -> R::Bool {
    (slope - mean_slope).abs().less(slope * lit(-tolerance))
}

/// Reports whether a ray may follow a line of the length `to_root`, whatever stands beside it.
///
/// A wall may stand on the line, beyond the radius. So only a ray that is hardly above the root follows a long one.
/// A value near its rounding, of which `depth` is a multiple, would give no line.
#[inline(always)]
fn is_short_line<R: Real>(
    [to_root, max_estimate]: [R; 2],
    new_field: R,
    threshold: R,
    depth: R,
) -> R::Bool {
    let is_mostly_proved = to_root.less(new_field * lit(MAX_UNPROVED_RADII));
    let follows_from = threshold
        .max(depth * lit(MIN_LINE_DEPTHS))
        .named("follows_from");
    R::and(
        to_root.less(max_estimate),
        R::or(is_mostly_proved, new_field.less(follows_from)),
    )
}

/// Reports whether a ray may go from `new_t` to a root as far as `to_root`.
///
/// Between the parts of a scene, only floors and walls without an end can be in the way. `crowd` is the start and the end
/// of the parts, and the first of those planes.
#[inline(always)]
fn is_way_free<R: Real>(
    [new_t, to_root]: [R; 2],
    [crowd_enter, crowd_exit, plane_t]: [R; 3],
    count: R,
) -> R::Bool {
    let root_t = (new_t + to_root).named("root_t");
    let is_beside_crowd = R::or(crowd_exit.less(new_t), root_t.less(crowd_enter));
    let is_behind_plane = (plane_t * lit(1.0 + OVERSHOOT_FRACTION)).less(root_t);
    let is_late = R::not(count.less(lit(FAR_STEPS)));
    R::or(is_late, R::and(is_beside_crowd, R::not(is_behind_plane)))
}

/// Returns 1 if a ray takes its next sample as a probe beside its last one, else 0.
///
/// In the plane in which two solids touch, a ray meets no value below zero, as beside a sheet. So a ray that comes
/// from a value above the rounding error, `field_before`, probes at the first value that is not. Before a ray's
/// first value, `field_before` is 0. Except at the camera, it comes from outside there, too.
#[inline(always)]
pub fn takes_probe<R: Real>(t: R, field: R, step: R, trend: R, field_before: R, rounding: R) -> R {
    let error = rounding_at(t, rounding).named("error");
    let is_first = R::not(lit::<R>(0.0).less(field_before.abs()));
    let comes_from_outside = R::or(
        error.less(field_before),
        R::and(is_first, lit::<R>(0.0).less(t)),
    );
    let is_touching = R::and(field.less(error), comes_from_outside);
    let probes = probe_count(trend).named("probes");
    let may_probe = R::or(probes.less(lit(MAX_PROBES - 0.5)), is_last_probe(probes));
    let takes_probe = R::and(is_touching, R::and(lit::<R>(0.0).less(step), may_probe));
    R::select(takes_probe, lit(1.0), lit(0.0))
}

/// Returns the number of probes since the last step. A trend below −1 encodes it.
#[inline(always)]
fn probe_count<R: Real>(trend: R) -> R {
    (lit::<R>(-1.0) - trend).max(lit(0.0))
}

/// Returns whether the next probe after this number of them is the last one, ahead on the ray.
#[inline(always)]
fn is_last_probe<R: Real>(probes: R) -> R::Bool {
    lit::<R>(PROBES_BEFORE_LAST - 0.5).less(probes)
}

/// Returns the point of a ray's next sample: `step` beyond `t`, or a little beyond `t` and beside the ray for a
/// probe.
///
/// Two probes lie on opposite sides of the ray. Both are inside of solids that touch there, and neither beside a
/// sheet. Of a ray that grazes a surface, only one is. A third probe, for raw fields, tells a contact from a
/// surface ahead. Coordinates outside of the box from `low` to `high`, in
/// which the field is known, are mirrored.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a ray and its state")]
pub fn sample_point<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    t: R,
    step: R,
    trend: R,
    is_probe: R,
    low: R::Vec3,
    high: R::Vec3,
    half_pixel: R,
    rounding: R,
) -> R::Vec3 {
    let is_probe = lit::<R>(0.5).less(is_probe);
    let point = origin + direction * (t + R::select(is_probe, lit(0.0), step));
    let distance = probe_distance(half_pixel, rounding_at(t + step, rounding));
    let ahead = R::select(is_probe, distance, lit(0.0)).named("ahead");
    let count = probe_count(trend).named("count");
    let is_rotated = lit::<R>(1.5).less(count);
    let is_second = lit::<R>(0.25).less((count * lit(0.5)).fract());
    let [x, y, z] = PROBE_DIRECTION.map(lit::<R>);
    let first = R::Vec3::new(x, y, z);
    let rotated = R::Vec3::new(z, x, y);
    let oblique = R::Vec3::select(is_rotated, rotated, first).named("oblique");
    let sideways = oblique - direction * oblique.dot(direction);
    let aside = R::select(
        is_last_probe(count),
        lit(0.0),
        R::select(is_second, -ahead, ahead),
    );
    let offset = (direction * ahead + sideways * aside).named("offset");
    let mirrored = |p: R, offset: R, low: R, high: R| {
        let sum = p + offset;
        R::select(R::or(sum.less(low), high.less(sum)), p - offset, sum)
    };
    R::Vec3::new(
        mirrored(point.x(), offset.x(), low.x(), high.x()),
        mirrored(point.y(), offset.y(), low.y(), high.y()),
        mirrored(point.z(), offset.z(), low.z(), high.z()),
    )
}

/// Returns the distance of a probe along the ray and beside it. Half of a pixel and the field's rounding error are those
/// at the end of the next step.
#[inline(always)]
fn probe_distance<R: Real>(half_pixel: R, rounding: R) -> R {
    (rounding * lit(PROBE_ROUNDINGS)).min(half_pixel * lit(MAX_PROBE_HALF_PIXELS))
}

/// Returns the distance from a ray within which all its probes up to `t` lie, along each axis.
#[inline(always)]
pub fn probe_margin<R: Real>(t: R, half_pixel: R, rounding: R) -> R {
    probe_distance(half_pixel, rounding_at(t, rounding)) * lit(2.0)
}

/// Returns the depth below zero from which on a point is inside: a multiple of the field's rounding error.
/// The slope along the ray scales it if the gradient's length is unknown (`is_raw` is 1).
#[inline(always)]
pub fn sign_margin<R: Real>(rounding: R, slope: R, is_raw: R) -> R {
    let known_slope_roundings = (lit::<R>(1.0) - is_raw) * lit(MARGIN_ROUNDINGS);
    rounding
        * (slope.abs() * lit(MARGIN_ROUNDINGS_PER_SLOPE) + known_slope_roundings)
            .min(lit(MARGIN_ROUNDINGS))
}

/// Reports whether samples on each step prove that there is no surface; see [`first_sample_t`].
pub fn proves_steps(factor: f32) -> bool {
    0.0 < factor && factor < 1.0
}

/// Returns the distance along a ray of the first sample of a step from `t` to `end_t`. Up to `proved_t` it needs none.
///
/// A field whose slope is only estimated may reach zero on a step. Where the scene states a bound, samples on the step prove
/// that it does not. `factor` is less than 1 there: times this, the value `field` at `t` is the radius of an empty sphere.
/// These samples do not decide where the step ends, so that a larger bound only adds more of them.
#[inline(always)]
pub fn first_sample_t<R: Real>(t: R, field: R, factor: R, min_step: R, end_t: R, proved_t: R) -> R {
    let sample_t = later_sample_t(t, field, factor, min_step, end_t);
    let is_stated = R::and(factor.less(lit(1.0)), lit::<R>(0.0).less(factor));
    let is_checked = R::and(is_stated, lit::<R>(0.0).less(field));
    R::select(is_checked, sample_t.max(proved_t).min(end_t), end_t)
}

/// Returns the distance along a ray of the next sample of a step that ends at `end_t`, after one at `t`; see
/// [`first_sample_t`].
#[inline(always)]
pub fn later_sample_t<R: Real>(t: R, field: R, factor: R, min_step: R, end_t: R) -> R {
    (t + (field * factor).max(min_step)).min(end_t)
}

/// Returns the fraction of a step from `t` that is proved where its next sample is at `sample_t`.
#[inline(always)]
pub fn proved_fraction<R: Real>(t: R, step: R, sample_t: R) -> R {
    ((sample_t - t) / step.max(lit(1e-30))).saturate()
}

/// Returns the minimum distance between the samples of a step; see [`first_sample_t`].
#[inline(always)]
pub fn min_sample_step<R: Real>(half_pixel: R, threshold: R) -> R {
    (half_pixel * lit(MIN_STEP_HALF_PIXELS)).max(threshold)
}

/// Returns the minimum step where the field is below it. It grows with the number of steps.
#[inline(always)]
fn short_step<R: Real>(half_pixel: R, threshold: R, count: R) -> R {
    let min_step = min_sample_step(half_pixel, threshold).named("min_step");
    let capped_step =
        (min_step * speedup_after(count, CAPPED_SPEEDUP_STEPS)).min(half_pixel.max(min_step));
    capped_step.max(min_step * speedup_after(count, UNCAPPED_SPEEDUP_STEPS))
}

/// Returns the factor on the minimum step of a ray close to zero after `count` steps; 1 during the first
/// `free_steps`.
#[inline(always)]
pub fn speedup_after<R: Real>(count: R, free_steps: f64) -> R {
    let late =
        ((count - lit(free_steps)).max(lit(0.0)) * lit(1.0 / SPEEDUP_DOUBLING_STEPS)).named("late");
    late * late * late + lit(1.0)
}

/// Returns the field value near which a ray estimates its root. It is a fraction of half a pixel, but at
/// least the field's rounding error at `t`.
#[inline(always)]
pub fn threshold<R: Real>(t: R, half_pixel: R, threshold_fraction: R, rounding: R) -> R {
    (half_pixel * threshold_fraction).max(rounding_at(t, rounding))
}

/// Returns the field value below which roots are estimated where the field falls strictly linearly. It is
/// `SECANT_FROM_THRESHOLDS`, but at most half a pixel, and at least the threshold.
#[inline(always)]
pub fn secant_start<R: Real>(threshold: R, half_pixel: R) -> R {
    (threshold * lit(SECANT_FROM_THRESHOLDS))
        .min(half_pixel)
        .max(threshold)
}

/// Rounding error of a field per unit of its coordinates: about three roundings of `f32`.
pub const ROUNDING_PER_UNIT: f64 = 2e-7;

/// Returns the field's rounding error at `t` along a ray.
#[inline(always)]
pub fn rounding_at<R: Real>(t: R, rounding: R) -> R {
    rounding + t * lit(ROUNDING_PER_UNIT)
}

/// Rounding error of a field at a point, in units of that of its coordinates.
const POINT_ROUNDINGS: f64 = 2.0;
/// Rounding of a point on a ray, as a fraction of the field's rounding error along the ray.
const POSITION_FRACTION: f64 = 0.15;

/// Returns the field's rounding error at a `point` of a ray.
///
/// It follows from the coordinates of the point, not from those of the camera. Thus sheets keep their thickness when
/// the camera moves away. `along` is the error by [`rounding_at`], and `least` that at the origin of the scene.
#[inline(always)]
pub fn rounding_near<R: Real>(point: R::Vec3, along: R, least: R) -> R {
    let at_point = point.abs().max_component() * lit(ROUNDING_PER_UNIT * POINT_ROUNDINGS) + least;
    along.min(at_point + along * lit(POSITION_FRACTION))
}

/// Returns 1 if a ray that ran out of steps is drawn as a hit, else 0.
///
/// Such a ray is within a pixel of a surface, along which it creeps. It is not parallel to it: then it never arrives,
/// and the field stays the same. Or the field falls to zero before `far`,
/// and the ray is near a surface or the field falls strictly linearly. The latter happens near the horizon of
/// an endless plane. `half_pixel` is at least the threshold here.
#[inline(always)]
pub fn accept_at_step_cap<R: Real>(
    t: R,
    field: R,
    trend: R,
    t_before: R,
    field_before: R,
    half_pixel: R,
    far: R,
) -> R {
    let is_parallel = R::not(lit::<R>(0.0).less((field - field_before).abs()));
    let is_within_pixel = field.less(half_pixel * lit(MAX_ACCEPTED_HALF_PIXELS));
    let is_beside = R::and(is_within_pixel, R::not(is_parallel));
    let is_near = field.less(half_pixel * lit(MAX_ACCEPTED_FALLING_HALF_PIXELS));
    let slope = ((field - field_before) / (t - t_before).max(lit(1e-30))).named("slope");
    let mean_slope = trend.max(lit(-1.0));
    let is_strictly_linear = is_steady::<R>(slope, mean_slope, STRICT_LINEARITY_TOLERANCE);
    let falls_before_far = field.less(slope * (t - far));
    let falls_nearby = R::and(falls_before_far, R::or(is_near, is_strictly_linear));
    R::select(R::or(is_beside, falls_nearby), lit(1.0), lit(0.0))
}

/// Returns 1 if no further secant step would improve on the secant estimate, else 0.
///
/// Then the last sample is above zero and as near before the root as rounding allows. Or both sides are that
/// near to each other, or have the same value. For a field with unknown slopes (`is_raw` is 1) both sides must
/// be near: it may be far flatter on one of them.
#[inline(always)]
pub fn is_settled<R: Real>(
    t: R,
    field: R,
    t_other: R,
    field_other: R,
    rounding: R,
    is_raw: R,
) -> R {
    let change = (field_other - field).abs().named("change");
    let width = (t - t_other).abs().named("width");
    let side_distance = side_distance::<R>(width, change, rounding, is_raw).named("side_distance");
    let is_at_hand =
        R::not((change * side_distance * lit(MAX_SETTLED_SIDE_DISTANCES)).less(field * width));
    let is_width_small = R::or(
        is_raw.less(lit(0.5)),
        R::not((side_distance * lit(2.0)).less(width)),
    );
    let is_value_close = R::and(
        lit::<R>(0.0).less(field),
        R::and(is_at_hand, is_width_small),
    );
    let is_open = R::and(side_distance.less(width), lit::<R>(0.0).less(change));
    R::select(R::and(is_open, R::not(is_value_close)), lit(0.0), lit(1.0))
}

/// Returns the next point to sample within the bracket of a change of sign.
///
/// It lies before the secant estimate, far enough for the field to be above zero by more than rounding. Where
/// it is not, there is an earlier root. At the foot of a wall, a line may lead through the wall, into the
/// plate below it. `count` is the number of samples in the bracket so far. Where another surface begins in it,
/// lines say little. So for a field with unknown slopes (`is_raw` is 1), every second of many samples halves it.
#[inline(always)]
pub fn next_estimate<R: Real>(
    t: R,
    field: R,
    t_other: R,
    field_other: R,
    rounding: R,
    is_raw: R,
    count: R,
) -> R {
    let width = (t_other - t).named("width");
    let change = (field_other - field).abs().named("change");
    let side_distance =
        side_distance::<R>(width.abs(), change, rounding, is_raw).named("side_distance");
    let root = secant_estimate::<R>(t, field, t_other, field_other).named("root");
    let estimate = (root - side_distance).max(t.min(t_other)).named("estimate");
    let is_short = (estimate - t).abs().less(side_distance);
    let fraction = (side_distance / width.abs().max(lit(1e-30))).min(lit(0.5));
    let is_even = (count * lit(0.5)).fract().less(lit(0.25));
    let is_late = R::and(lit::<R>(FREE_SECANT_STEPS - 0.5).less(count), is_even);
    let halves = R::and(is_late, lit::<R>(0.5).less(is_raw));
    let by_line = R::select(is_short, t + width * fraction, estimate);
    R::select(halves, t + width * lit(0.5), by_line)
}

/// Returns the distance from a root at which the sign is certain: [`SIDE_ROUNDINGS`] along a ray whose field
/// changes by `change` over `width`. Slopes of raw fields are unknown there, and taken to be one.
#[inline(always)]
fn side_distance<R: Real>(width: R, change: R, rounding: R, is_raw: R) -> R {
    let over_slope = R::select(
        lit::<R>(0.5).less(is_raw),
        lit(1.0),
        width / change.max(lit(1e-30)),
    );
    rounding * lit(SIDE_ROUNDINGS) * over_slope
}

/// Returns the root of the line through two values of the field, of which one is below zero. It is never
/// outside of the two points.
#[inline(always)]
pub fn secant_estimate<R: Real>(t: R, field: R, t_other: R, field_other: R) -> R {
    let change = (field_other - field).named("change");
    let has_line = lit::<R>(1e-37).less(change.abs());
    let fraction = (field / R::select(has_line, change, lit(-1.0))).named("fraction");
    // A fraction that is not a number selects `t_other`.
    t + (t - t_other) * fraction.max(lit(-1.0)).min(lit(0.0))
}

/// The two sides of a change of sign along a ray.
#[derive(Clone, Copy, Debug)]
pub struct Bracket<R> {
    /// The latest estimate.
    pub t: R,
    /// Field value there.
    pub field: R,
    /// A point where the field has the other sign.
    pub t_other: R,
    /// Field value there, possibly scaled down: see [`secant_step`].
    pub field_other: R,
}

/// Replaces a side of the bracket by the field at an estimate. Where the same side is replaced twice, the
/// field at the other one is scaled down. So the next line ends nearer to that one (N. Anderson and Å.
/// Björck, *A New High Order Method of Regula Falsi Type for Computing a Root of an Equation*, 1973).
#[inline(always)]
pub fn secant_step<R: Real>(
    t: R,
    field: R,
    t_other: R,
    field_other: R,
    estimate: R,
    field_at_estimate: R,
) -> Bracket<R> {
    // Zero is outside: a field may underflow along all of the bracket but its end.
    let is_inside = field.less(lit(0.0));
    let is_estimate_inside = field_at_estimate.less(lit(0.0));
    let same_sign = R::or(
        R::and(is_inside, is_estimate_inside),
        R::not(R::or(is_inside, is_estimate_inside)),
    );
    let remaining = lit::<R>(1.0) - field_at_estimate / R::select(same_sign, field, lit(1.0));
    let scale = R::select(lit::<R>(0.0).less(remaining), remaining, lit(0.5)).named("scale");
    Bracket {
        t: estimate,
        field: field_at_estimate,
        t_other: R::select(same_sign, t_other, t),
        field_other: R::select(same_sign, field_other * scale, field),
    }
}
