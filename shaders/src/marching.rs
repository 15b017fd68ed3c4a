//! Sphere tracing, one step at a time.
//!
//! A ray keeps the last point that is proven to lie outside (`t`, with the field's value there as
//! `radius`: no surface is nearer), and tries a `step` longer than that radius: the running slope
//! of the field along the ray says how much longer (automatic relaxation: R. Bán and G. Valasek,
//! *Automatic Step Size Relaxation in Sphere Tracing*, 2023). If the ball around the new point
//! overlaps the ball around the old one, nothing was jumped over; else the ray goes back and takes
//! exactly the old radius (B. Keinert and others, *Enhanced Sphere Tracing*, 2014, there with a
//! shorter step back).
//!
//! # Hits
//! A surface is where the field changes its sign, and nothing else: [`noise`] is how far it must get below
//! zero, so that what is positive on both sides but for rounding (a flush cut, two faces that coincide, a
//! sheet without thickness) is passed. Neither a bound of the slope nor a factor on the field moves a hit.
//!
//! Where the field has come near to zero and falls evenly, as towards a plane, the root is estimated by a
//! line through the last two points, and the ray goes a little beyond it, to where the sign should have
//! changed. Estimates begin at 10 thresholds (20 where the field falls steadily, as it does above a plane at
//! grazing angles), capped at half a pixel. A ray that all but touches something would creep past it: where
//! less than an eighth of a pixel is left of the field it goes on by at least as much, or to where a line
//! says that the root is, and passes what is shorter along the ray. After 1,024 steps it goes on faster, by up
//! to half a pixel: where a field was divided by a large bound, rays are late though nothing is near. At last it goes
//! on ever faster, so that a field that stays close to zero ends, too.
//!
//! A field may fall faster than its slope says, or jump: a slope that a scene claims is not checked. A
//! step that ends deep inside is halved until the place where the sign changes is known to a fraction of
//! half a pixel. The two sides of the change then close in on the root ([`secant_step`]).
//!
//! The field is given with a slope of at most one, and negated for rays that start inside: these
//! see the surface from behind.

use sdfc_vm::real::{Real, lit};

/// How a ray ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Status {
    /// It has not.
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
    /// The status of a ray's record, which also says on which side it started and what is shown.
    pub fn of(word: u32) -> Self {
        match (word & ENDING, word & FROM_INSIDE != 0) {
            (1, false) => Self::Hit,
            (1, true) => Self::Inside,
            (2, _) => Self::Miss,
            (3, _) => Self::StepCap,
            (4, _) => Self::NotANumber,
            _ => Self::Active,
        }
    }
}

/// The bits of a record's status that say how the ray ended; [`Status::Inside`] is written as a
/// hit with [`FROM_INSIDE`].
pub const ENDING: u32 = 7;
/// Set in the status of a ray that started inside a solid.
pub const FROM_INSIDE: u32 = 8;
/// Set in the status of a ray that ended on a surface, or out of steps so near to one that it is
/// drawn.
pub const SHOWN: u32 = 16;
/// Set in the status of a ray whose end an engine that proves things could not prove. No kernel
/// does so.
pub const UNDECIDED: u32 = 32;

/// The weight of the newest slope in the running mean that is used where nothing else is asked for.
pub const RELAXATION: f64 = 0.3;
/// The largest mean that is used: steps are at most 2 / (1 − this) radii.
const STEEPEST: f64 = 0.9;
/// The share of the field or of the threshold by which a ray goes beyond an estimated root. A sheet that is
/// thinner may be passed.
const OVERSHOOT: f64 = 0.02;
/// How far the field must get below zero, in units of what rounding alone can cause.
const NOISE: f64 = 4.0;
/// The same per slope along the ray, for fields whose gradient's length is not known.
const NOISE_PER_SLOPE: f64 = 64.0;
/// The steps after which a ray that stays close to zero begins to go on faster, by up to half a pixel.
const PATIENT_STEPS: f64 = 1024.0;
/// The steps after which it goes on ever faster, so that it ends. Scenes give rays a thousand more by default.
const LAST_STEPS: f64 = 2048.0;
/// The further steps after which it goes on twice as fast.
const HURRY_STEPS: f64 = 64.0;
/// From how many thresholds on roots are estimated where the field falls steadily, and from half as many on
/// where it falls evenly.
const NEAR: f64 = 20.0;
/// How far a ray goes at least where no more than that is left of the field, in halves of a pixel.
const CREEP: f64 = 0.0625;
/// How far ahead roots are guessed, in halves of a pixel: four pixels. A line farther on may lead through a
/// wall; only where the field falls steadily is it followed.
const AHEAD: f64 = 8.0;
/// The longest guess at a root of a field with unknown slopes without a look halfway, in halves of a pixel.
const UNPROVEN: f64 = 4.0;
/// A field falls evenly if its last slope differs from the mean by no more than this share of it.
const EVENLY: f64 = 0.3;
/// It falls steadily, as towards a plane and nothing else, if they differ by no more than this share.
const STEADILY: f64 = 0.01;
/// From how many halves of a pixel on a ray that ran out of steps is taken for one that hit: a pixel.
const BESIDE: f64 = 2.0;
/// From how many on it is if the field falls to zero before it: four pixels.
const WITHIN: f64 = 8.0;
/// The largest way from the last look to the root, in units of the way that tells its side.
const AT_HAND: f64 = 1.5;
/// The distance from a root that tells its side, in units of rounding.
const BOTH_SIDES: f64 = 2.0;
/// How many secant steps are taken at most.
pub const SECANT_STEPS: u32 = 24;

/// What a step makes of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Step<R> {
    /// How far it came.
    pub t: R,
    /// The field there.
    pub radius: R,
    /// The step that is tried next.
    pub step: R,
    /// The running mean of the field's slope along the ray.
    pub trend: R,
    /// The way to the last place with the field above zero, one step before or earlier.
    pub t_before: R,
    /// The field there.
    pub radius_before: R,
    /// 1 where it has come to a root, else 0.
    pub arrived: R,
}

/// One step: `field` is the value at `t + step`, and the ray's `count` of steps includes it. A ray begins
/// with `radius = step = 0` and a `trend` of −1. `relaxation`, from 0 to 1, is the weight of the newest slope
/// in the running mean; with 0 the trend stays −1 and each step is exactly the radius: plain sphere tracing.
/// Near `threshold`, a fraction of `half_pixel`, roots are estimated, up to `leave` along the ray;
/// `rounding` is what rounding alone can make of the field, and `raw` is 1 where the length of the field's
/// gradient is not known, else 0.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "a ray's state, as the buffer holds it"
)]
pub fn march_step<R: Real>(
    t: R,
    radius: R,
    step: R,
    trend: R,
    t_before: R,
    radius_before: R,
    field: R,
    count: R,
    threshold: R,
    half_pixel: R,
    relaxation: R,
    rounding: R,
    raw: R,
    leave: R,
) -> Step<R> {
    let zero = lit::<R>(0.0);
    let slope = ((field - radius) / step.max(lit(1e-30))).named("slope");
    let depth = noise(rounding, slope, raw).named("depth");
    let plain = R::not(radius.less(step));
    let overlapping = R::not((radius + field).less(step));
    let guessed = R::or(plain, radius.less(radius_before));
    let near = near(threshold, half_pixel).named("near");
    let slowest = (half_pixel * lit(CREEP)).max(threshold).named("slowest");
    let patient = (slowest * hurry(count, PATIENT_STEPS)).min(half_pixel.max(slowest));
    let creep = patient
        .max(slowest * hurry(count, LAST_STEPS))
        .named("creep");
    let below = radius.less(creep);
    let short = R::and(below, R::not(creep.less(step)));
    let crossed = field.less(-depth);
    // A line followed far must lead to the root itself, or there was something in between.
    let ahead = (half_pixel.max(threshold) * lit(AHEAD)).named("ahead");
    let far = R::and(R::not(plain), ahead.less(step));
    let beyond = (radius * lit(2.0 * OVERSHOOT)).max(depth * lit(4.0));
    let astray = R::and(far, field.less(-beyond));
    let inside = R::and(crossed, R::and(radius.less(near), R::not(astray)));
    let landed = R::and(inside, R::or(guessed, short));
    let found = R::and(crossed, R::or(plain, landed));
    let sure = threshold.max(depth * lit(2.0)).named("sure");
    let deep = R::and(field.less(-sure), sure.less(step));
    // A sheet may lie on a longer way, or a wall before what was divided by a bound, and the value off the line.
    let is_raw = lit::<R>(0.5).less(raw);
    let long = (half_pixel * lit(UNPROVEN)).max(sure).less(step);
    let off = R::and(field.less(-beyond), sure.less(step));
    let unproven = R::and(is_raw, R::or(long, off));
    let jumped = R::and(found, R::or(deep, unproven));
    let passable = R::or(plain, R::or(overlapping, R::or(landed, short)));
    let safe = R::and(passable, R::not(jumped));
    let mean = trend + (slope - trend) * relaxation;
    let known = R::and(safe, zero.less(step));
    let trend =
        R::select(known, mean.clamp(lit(-1.0), lit(STEEPEST)), lit(-1.0)).named("new_trend");
    let new_t = R::select(safe, t + step, t).named("new_t");
    let new_radius = R::select(safe, field, radius).named("new_radius");
    let relaxed = new_radius.max(zero) * lit(2.0) / (lit::<R>(1.0) - trend);
    let falling = R::and(known, slope.less(zero));
    let left = new_radius.max(zero);
    let goal = (left + left.min(threshold) * lit(OVERSHOOT) + depth * lit(2.0)).named("goal");
    let to_root = (goal / (-slope).max(lit(1e-30))).named("to_root");
    let stuck = (rounding * lit(2.0 * NOISE)).min(creep).named("stuck");
    let at_least = R::select(falling, to_root.min(creep), R::select(known, creep, stuck));
    let creeping = new_radius.less(creep);
    let onward = R::select(creeping, relaxed.max(at_least), relaxed).named("onward");
    let evenly = (slope - mean).abs().less(slope * lit(-EVENLY));
    let steadily = (slope - mean).abs().less(slope * lit(-STEADILY));
    // What was divided by a bound may be far above its surface, and a wall in between.
    let straight = R::and(steadily, R::not(is_raw));
    let leads = R::or(to_root.less(ahead), straight);
    let enough = R::select(steadily, near, (near * lit(0.5)).max(threshold));
    let within = R::and(new_radius.less(enough), to_root.less(leave - new_t));
    let guess = R::and(falling, R::and(R::and(evenly, leads), within));
    let next = R::select(guess, to_root, onward);
    // A root lies between where the field was above zero last and where it has crossed.
    let leaves = R::and(safe, R::not(radius.less(zero)));
    Step {
        t: new_t,
        radius: new_radius,
        step: R::select(jumped, step * lit(0.5), next),
        trend,
        t_before: R::select(leaves, t, t_before),
        radius_before: R::select(leaves, radius, radius_before),
        arrived: R::select(R::and(safe, found), lit(1.0), lit(0.0)),
    }
}

/// How far a field must get below zero to be inside: some times what rounding alone can make of it. Where the
/// gradient's length is not known (`raw` is 1), its slope along the ray stands for it.
#[inline(always)]
pub fn noise<R: Real>(rounding: R, slope: R, raw: R) -> R {
    let known = (lit::<R>(1.0) - raw) * lit(NOISE);
    rounding * (slope.abs() * lit(NOISE_PER_SLOPE) + known).min(lit(NOISE))
}

/// The factor on the steps of a ray close to zero after so many steps, of which the first `patient` change nothing.
#[inline(always)]
pub(crate) fn hurry<R: Real>(count: R, patient: f64) -> R {
    let late = ((count - lit(patient)).max(lit(0.0)) * lit(1.0 / HURRY_STEPS)).named("late");
    late * late * late + lit(1.0)
}

/// The field near which a ray looks for a root: a share of half a pixel, but no less than what
/// rounding leaves of a point at `t`.
#[inline(always)]
pub fn threshold<R: Real>(t: R, half_pixel: R, cone: R, rounding: R) -> R {
    (half_pixel * cone).max(rounding_at(t, rounding))
}

/// The field below which roots are guessed where it falls steadily: some thresholds, but no more than
/// half a pixel where the threshold is less.
#[inline(always)]
pub fn near<R: Real>(threshold: R, half_pixel: R) -> R {
    (threshold * lit(NEAR)).min(half_pixel).max(threshold)
}

/// What rounding alone can make of a field per unit of its coordinates: about three roundings of `f32`.
pub const ROUNDING: f64 = 2e-7;

/// The field that rounding alone can cause at `t` along a ray.
#[inline(always)]
pub fn rounding_at<R: Real>(t: R, rounding: R) -> R {
    rounding + t * lit(ROUNDING)
}

/// Whether, as 1 or 0, a ray that ran out of steps is drawn as one that hit: where it is within a pixel of
/// a surface, along which it creeps; and where the field falls to zero before `far`, if the ray is
/// near to a surface, or the field has been falling steadily for many steps, as towards an endless
/// plane near its horizon. `half_pixel` is no less than the threshold here.
#[inline(always)]
pub fn nearly_arrived<R: Real>(
    t: R,
    radius: R,
    trend: R,
    t_before: R,
    radius_before: R,
    half_pixel: R,
    far: R,
) -> R {
    let beside = radius.less(half_pixel * lit(BESIDE));
    let near = radius.less(half_pixel * lit(WITHIN));
    let slope = ((radius - radius_before) / (t - t_before).max(lit(1e-30))).named("slope");
    let steadily = (slope - trend).abs().less(slope * lit(-STEADILY));
    let falls = radius.less(slope * (t - far));
    let falls_soon = R::and(falls, R::or(near, steadily));
    R::select(R::or(beside, falls_soon), lit(1.0), lit(0.0))
}

/// 1 if no further secant step would tell more than [`secant_guess`] does, else 0: the field was seen above zero
/// as near before the root as rounding allows, or both sides are that near to each other, or the same. Of a
/// field whose slopes are not known (`raw` is 1) both sides must be near: it may be far flatter on one of them.
#[inline(always)]
pub fn settled<R: Real>(t: R, field: R, t_other: R, field_other: R, rounding: R, raw: R) -> R {
    let change = (field_other - field).abs().named("change");
    let width = (t - t_other).abs().named("width");
    let least = least_way::<R>(width, change, rounding, raw).named("least");
    let at_hand = R::not((change * least * lit(AT_HAND)).less(field * width));
    let known = R::or(raw.less(lit(0.5)), R::not((least * lit(2.0)).less(width)));
    let seen = R::and(lit::<R>(0.0).less(field), R::and(at_hand, known));
    let is_open = R::and(least.less(width), lit::<R>(0.0).less(change));
    R::select(R::and(is_open, R::not(seen)), lit(0.0), lit(1.0))
}

/// The next place to look at between both sides of a change of sign. It lies before [`secant_guess`], far enough
/// for the field to be above zero by more than rounding: where it is not, there is a root before that one. At the
/// foot of a wall a line may lead through the wall, into the plate on which it stands.
#[inline(always)]
pub fn next_guess<R: Real>(t: R, field: R, t_other: R, field_other: R, rounding: R, raw: R) -> R {
    let width = (t_other - t).named("width");
    let change = (field_other - field).abs().named("change");
    let least = least_way::<R>(width.abs(), change, rounding, raw).named("least");
    let root = secant_guess::<R>(t, field, t_other, field_other).named("root");
    let guess = (root - least).max(t.min(t_other)).named("guess");
    let short = (guess - t).abs().less(least);
    let share = (least / width.abs().max(lit(1e-30))).min(lit(0.5));
    R::select(short, t + width * share, guess)
}

/// The distance from a root at which the sign tells on which side it is: [`BOTH_SIDES`] along a ray whose field
/// changes by `change` over `width`. Slopes of raw fields are not known there, and taken to be one.
#[inline(always)]
fn least_way<R: Real>(width: R, change: R, rounding: R, raw: R) -> R {
    let over_slope = R::select(
        lit::<R>(0.5).less(raw),
        lit(1.0),
        width / change.max(lit(1e-30)),
    );
    rounding * lit(BOTH_SIDES) * over_slope
}

/// Where a straight line through two values of the field, of which one is below zero, meets zero. It is never
/// outside of the two.
#[inline(always)]
pub fn secant_guess<R: Real>(t: R, field: R, t_other: R, field_other: R) -> R {
    let change = (field_other - field).named("change");
    let line = lit::<R>(1e-37).less(change.abs());
    let share = (field / R::select(line, change, lit(-1.0))).named("share");
    // What is no number is the end where the ray is.
    t + (t - t_other) * share.max(lit(-1.0)).min(lit(0.0))
}

/// The two sides of a change of sign along a ray.
#[derive(Clone, Copy, Debug)]
pub struct Bracket<R> {
    /// The place that was found last.
    pub t: R,
    /// The field there.
    pub field: R,
    /// A place with the other sign.
    pub t_other: R,
    /// The field there, or less of it: see [`secant_step`].
    pub field_other: R,
}

/// Takes the field at an estimate into account, which becomes one of the two sides. Where it is twice the
/// same side, the field at the other one is scaled down, so that the next line ends nearer to that one
/// (N. Anderson and Å. Björck, *A New High Order Method of Regula Falsi Type for Computing a Root of an
/// Equation*, 1973).
#[inline(always)]
pub fn secant_step<R: Real>(
    t: R,
    field: R,
    t_other: R,
    field_other: R,
    guess: R,
    field_at_guess: R,
) -> Bracket<R> {
    let alike = lit::<R>(0.0).less(field * field_at_guess);
    let left = lit::<R>(1.0) - field_at_guess / R::select(alike, field, lit(1.0));
    let scale = R::select(lit::<R>(0.0).less(left), left, lit(0.5)).named("scale");
    Bracket {
        t: guess,
        field: field_at_guess,
        t_other: R::select(alike, t_other, t),
        field_other: R::select(alike, field_other * scale, field),
    }
}
