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
//! Where the field has come near to zero and falls evenly, as towards a plane, the root is guessed by a
//! line through the last two points, and that is where the ray goes next: near is ten thresholds, which
//! are shares of half a pixel, and twenty where the field falls steadily, as it does above a plane that a ray
//! all but runs along; but no more than half a pixel. A ray stops if next to nothing is left of the
//! field there, or its sign has changed; else it passes by, or goes on in plain steps and guesses again. So
//! it stops where there is a root, and not wherever a field is small: beside a rim, before something far
//! thinner than a pixel, or above a field that is much flatter than its slope bound. A ray that
//! all but touches something would creep past it: where less than an eighth of a pixel is left of the
//! field it goes on by at least as much, or to where a line says that the root is, and passes what is
//! shorter along the ray.
//! [`secant_step`] then finds the root to rounding.
//!
//! A field may fall faster than its slope says, or jump: a slope that a scene claims is not checked. A
//! step that ends deep inside is halved until the place where the sign changes is known to a share of
//! half a pixel.
//!
//! The field is given divided by its slope bound, and negated for rays that start inside: these
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
/// What may be left of the field where a root was guessed, as a share of the field before, or of the
/// threshold if that is less.
pub const LEFT: f64 = 0.02;
/// From how many thresholds on roots are guessed where the field falls steadily, and from half as many on
/// where it falls evenly.
const NEAR: f64 = 20.0;
/// How far a ray goes at least where no more than that is left of the field, in halves of a pixel.
const CREEP: f64 = 0.25;
/// How far ahead roots are guessed, in halves of a pixel: four pixels. A line farther on may lead through a
/// wall; only where the field falls steadily is it followed.
const AHEAD: f64 = 8.0;
/// A field falls evenly if its last slope differs from the mean by no more than this share of it.
const EVENLY: f64 = 0.3;
/// It falls steadily, as towards a plane and nothing else, if they differ by no more than this share.
const STEADILY: f64 = 0.01;
/// From how many halves of a pixel on a ray that ran out of steps is taken for one that hit: a pixel.
const BESIDE: f64 = 2.0;
/// From how many on it is if the field falls to zero before it: four pixels.
const WITHIN: f64 = 8.0;
/// How many secant steps are taken at most.
pub const SECANT_STEPS: u32 = 6;

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
    /// How far it was one step before.
    pub t_before: R,
    /// The field there.
    pub radius_before: R,
    /// 1 where it has come to a root, else 0.
    pub arrived: R,
}

/// One step: `field` is the value at `t + step`. A ray begins with `radius = step = 0` and a
/// `trend` of −1. `relaxation`, from 0 to 1, is the weight of the newest slope in the running mean;
/// with 0 the trend stays −1 and each step is exactly the radius: plain sphere tracing.
/// Near `threshold`, a share of `half_pixel`, roots are guessed, up to `leave` along the ray; below
/// `rounding` the field is as good as zero.
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
    threshold: R,
    half_pixel: R,
    relaxation: R,
    rounding: R,
    leave: R,
) -> Step<R> {
    let plain = R::not(radius.less(step));
    let overlapping = R::not((radius + field).less(step));
    let guessed = R::or(plain, radius.less(radius_before));
    let near = near(threshold, half_pixel).named("near");
    let creep = (half_pixel * lit(CREEP)).max(threshold).named("creep");
    let below = radius.less(creep);
    let short = R::and(below, R::not(creep.less(step)));
    let least = radius.min(threshold) * lit(LEFT);
    let vanished = R::and(radius.less(near), field.less(least));
    // A line followed far must lead to the root itself, or there was something in between.
    let ahead = (half_pixel.max(threshold) * lit(AHEAD)).named("ahead");
    let far = R::and(R::not(plain), ahead.less(step));
    let astray = R::and(far, field.less(-least));
    let landed = R::and(R::and(R::or(guessed, short), vanished), R::not(astray));
    let deep = R::and(field.less(-threshold), threshold.less(step));
    let jumped = R::and(R::or(plain, landed), deep);
    let passable = R::or(plain, R::or(overlapping, R::or(landed, short)));
    let safe = R::and(passable, R::not(jumped));
    let slope = ((field - radius) / step.max(lit(1e-30))).named("slope");
    let mean = trend + (slope - trend) * relaxation;
    let known = R::and(safe, lit::<R>(0.0).less(step));
    let trend =
        R::select(known, mean.clamp(lit(-1.0), lit(STEEPEST)), lit(-1.0)).named("new_trend");
    let new_t = R::select(safe, t + step, t).named("new_t");
    let new_radius = R::select(safe, field, radius).named("new_radius");
    let relaxed = new_radius * lit(2.0) / (lit::<R>(1.0) - trend);
    let falling = R::and(known, slope.less(lit(0.0)));
    let to_root = (new_radius / (-slope).max(lit(1e-30))).named("to_root");
    let at_least = R::select(falling, to_root.min(creep), creep);
    let creeping = R::and(known, new_radius.less(creep));
    let onward = R::select(creeping, relaxed.max(at_least), relaxed).named("onward");
    let evenly = (slope - mean).abs().less(slope * lit(-EVENLY));
    let steadily = (slope - mean).abs().less(slope * lit(-STEADILY));
    let leads = R::or(to_root.less(ahead), steadily);
    let enough = R::select(steadily, near, (near * lit(0.5)).max(threshold));
    let within = R::and(new_radius.less(enough), to_root.less(leave - new_t));
    let guess = R::and(falling, R::and(R::and(evenly, leads), within));
    let next = R::select(guess, to_root, onward);
    let touching = new_radius.less(rounding);
    Step {
        t: new_t,
        radius: new_radius,
        step: R::select(jumped, step * lit(0.5), next),
        trend,
        t_before: R::select(safe, t, t_before),
        radius_before: R::select(safe, radius, radius_before),
        arrived: R::select(R::and(safe, R::or(touching, landed)), lit(1.0), lit(0.0)),
    }
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

/// The field that rounding alone can cause at `t` along a ray.
#[inline(always)]
pub fn rounding_at<R: Real>(t: R, rounding: R) -> R {
    rounding + t * lit(2e-7)
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

/// Whether, as 1 or 0, the field is so small that no further secant step would tell more.
#[inline(always)]
pub fn settled<R: Real>(field: R, rounding: R) -> R {
    R::select(field.abs().less(rounding * lit(0.1)), lit(1.0), lit(0.0))
}

/// Where a straight line through two values of the field meets zero: (`t`, `field`) is the better
/// one. It goes at most `reach` from there. Where the two make no line, it is a plain step.
#[inline(always)]
pub fn secant_guess<R: Real>(t: R, field: R, t_other: R, field_other: R, reach: R) -> R {
    let between = (t - t_other).named("between");
    let change = (field_other - field).named("change");
    let tiny = lit::<R>(1e-30);
    let line = R::and(tiny.less(change.abs()), tiny.less(between.abs()));
    let way = between * field / R::select(line, change, lit(1.0));
    t + R::select(line, way, field).clamp(-reach, reach)
}

/// The two best of three points on a ray.
#[derive(Clone, Copy, Debug)]
pub struct Bracket<R> {
    /// Where the field is nearest to zero.
    pub t: R,
    /// The field there.
    pub field: R,
    /// The other point.
    pub t_other: R,
    /// The field there.
    pub field_other: R,
}

/// Takes the field at a guess into account: the guess becomes the better point if it is, and the
/// other one if it is not, since it lies nearer than what the line went through before. Where the field
/// has different signs at both points, and the guess is no better, it takes the place of the one with
/// its sign: so a jump across zero is closed in on.
#[inline(always)]
pub fn secant_step<R: Real>(
    t: R,
    field: R,
    t_other: R,
    field_other: R,
    guess: R,
    field_at_guess: R,
) -> Bracket<R> {
    let zero = lit::<R>(0.0);
    let better = field_at_guess.abs().less(field.abs());
    let astride = (field * field_other).less(zero);
    let alike = zero.less(field * field_at_guess);
    let closer = R::and(R::not(better), R::and(astride, alike));
    let taken = R::or(better, closer);
    Bracket {
        t: R::select(taken, guess, t),
        field: R::select(taken, field_at_guess, field),
        t_other: R::select(better, t, R::select(closer, t_other, guess)),
        field_other: R::select(
            better,
            field,
            R::select(closer, field_other, field_at_guess),
        ),
    }
}

/// How far a secant step may go: sixteen pixels, or as far as the last step; as far as the line says
/// for a ray that ran out of steps (`capped` is 1, else 0), which nothing else brings to its root.
#[inline(always)]
pub fn secant_reach<R: Real>(t: R, t_other: R, half_pixel: R, rounding: R, capped: R) -> R {
    let usual = (t - t_other)
        .abs()
        .max(half_pixel * lit(32.0))
        .max(rounding * lit(64.0));
    R::select(lit::<R>(0.0).less(capped), lit(1e18), usual)
}
