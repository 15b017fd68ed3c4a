//! Claims: a value that is small enough to matter for light says that a surface may be near, and a look along
//! the gradient says whether one is, and where.
//!
//! A step to the surface ([`crate::marching`]) is a distance where shapes are exact. Of cuts and intersections
//! it is a lower bound, which may be far less: the field of a hole is zero where the cutter ends, with nothing
//! there. Of raw fields it was divided by a bound of the slope. So light takes no value for a distance before it
//! is checked, one evaluation after the other, in the same way for all fields:
//!
//! | phase | evaluated |
//! |---|---|
//! | 0 | the value |
//! | 0.5 | the value at a place to which a shadow's claim was moved |
//! | 1 to 3 | beside it along x, y and z, for the gradient |
//! | 4 | a little beyond the place where the gradient says that the surface is |
//! | 5 on | the same on a part of the way, where the field was far below what the gradient says |
//!
//! Where the field is above zero in phase 4, another face begins there, or the field falls more slowly from there
//! on: the look goes on from that place, along the edge between the faces, in at most eight rounds of these
//! phases. A surface is there once the field is below zero, and nowhere else: a cutter leaves faces in the
//! field that nothing is behind. So light depends on surfaces alone: not on how far a cutter reaches out of what it
//! cuts, nor on a factor on a field or a bound of its slope.

use crate::marching::ROUNDING;
use sdfc_vm::real::{Real, Vector3, lit};

/// The way of the look beyond the expected surface, as a fraction of the way to it.
const BEYOND: f64 = 0.02;
/// The same at least, in units of what rounding can make of the field there.
const BEYOND_ROUNDINGS: f64 = 2.0 * NOISE;
/// The same at least, as a fraction of the limit of what matters: at a corner, a shorter way leads along a face.
const BEYOND_LIMIT: f64 = 0.001;
/// The distance of the points by which the gradient is found, as a fraction of the value.
const APART: f64 = 0.004;
/// The same at least, in units of what rounding can make of the field there.
const APART_ROUNDINGS: f64 = 64.0;
/// The same at least, as a fraction of the limit of what matters: at a corner, the faces beside it count alike.
const APART_LIMIT: f64 = 0.0005;
/// The most rounds of looks: at a face, an edge and a corner, and where a field bends.
const ROUNDS: f64 = 8.0;
/// The squared sine of the angle between the faces of the sharpest edge that is followed. Faces that are more
/// opposed are those of a valley between two that nothing is behind.
const SHARPEST: f64 = 0.2;
/// The thickness of a sheet into which a look goes back, as a fraction of the way to it.
const THIN: f64 = 0.1;
/// The depth below zero from which on the field is no rounding, in units of what that can make of it.
const NOISE: f64 = 4.0;
/// The depth of the field below what the gradient says, in units of the value, from which on the line through both ends
/// of a look tells nothing of the surface between them.
const TOO_DEEP: f64 = 0.15;
/// The last phase of a look.
const LAST_PHASE: f64 = 9.0;
/// The distance of a surface that is not there.
pub const NOTHING: f32 = 1e18;
/// The phase in which a claim that was moved takes its value.
pub const MOVED: f32 = 0.5;

/// The field that rounding alone can cause at a place, however far away the eye is.
#[inline(always)]
fn rounding<R: Real>(at: R::Vec3) -> R {
    at.abs().max_component() * lit(ROUNDING)
}

/// The distance of the points by which the gradient at a place is found.
#[inline(always)]
pub fn apart<R: Real>(value: R, at: R::Vec3, limit: R) -> R {
    let least = (rounding::<R>(at) * lit(APART_ROUNDINGS)).max(limit * lit(APART_LIMIT));
    (value.abs() * lit(APART)).max(least)
}

/// The part of the way on which the look of a phase goes.
#[inline(always)]
fn part<R: Real>(phase: R) -> R {
    let times = (phase - lit(4.0)).max(lit(0.0)).named("times");
    lit::<R>(1.0) / (times * times + lit(1.0))
}

/// The way of the look in phase 4, from the place of a round that is `offset` away from the claim: a little beyond the
/// surface that is expected against the gradient, but no farther than `limit`, and back from no face that the rounds
/// before led to, unless through a thin sheet. From a claim in a solid it leads out.
#[inline(always)]
fn look<R: Real>(value: R, gradient: R::Vec3, offset: R::Vec3, rounding: R, limit: R) -> R::Vec3 {
    let back = gradient.dot(offset).max(lit(0.0)).named("back");
    let way = offset.dot(offset).named("way");
    let square = gradient.dot(gradient).max(lit(1e-30)).named("square");
    let aside = gradient - offset * (back / way.max(lit(1e-30)));
    let is_thin = (value * value).less(way * square * lit(THIN * THIN));
    let along = R::Vec3::select(is_thin, gradient, aside).named("along");
    let left = along.dot(along).named("left");
    let is_valley = left.less(square * lit(SHARPEST));
    let slope = left.max(lit(1e-30)).sqrt().named("slope");
    let length = (value.abs() / slope).named("length");
    let least = (rounding * lit(BEYOND_ROUNDINGS)).max(limit * lit(BEYOND_LIMIT));
    let far = (length + least.max(length * lit(BEYOND))).min(limit);
    let share = R::select(is_valley, lit(0.0), far / slope).named("share");
    along * R::select(value.less(lit(0.0)), share, -share)
}

/// The offset of the place of a look, from which the next round goes on. `at` is the place of this round.
#[inline(always)]
pub fn offset<R: Real>(
    at: R::Vec3,
    offset: R::Vec3,
    phase: R,
    value: R,
    gradient: R::Vec3,
    limit: R,
) -> R::Vec3 {
    offset + look::<R>(value, gradient, offset, rounding::<R>(at), limit) * part(phase)
}

/// The point at which a phase evaluates the field. `at` is the place of the round, `offset` away from the claim.
/// `value` is the field there, and `gradient` its gradient as far as phases 1 to 3 found it. Surfaces farther than
/// `limit` do not matter.
#[inline(always)]
pub fn place<R: Real>(
    at: R::Vec3,
    offset: R::Vec3,
    phase: R,
    value: R,
    gradient: R::Vec3,
    limit: R,
) -> R::Vec3 {
    let zero = lit::<R>(0.0);
    let apart = apart::<R>(value, at, limit).named("apart");
    let along = |number: f64| {
        let here = (phase - lit(number)).abs().less(lit(0.5));
        R::select(here, apart, zero)
    };
    let beside = R::Vec3::new(along(1.0), along(2.0), along(3.0));
    let looks = R::select(phase.less(lit(3.5)), zero, part(phase)).named("looks");
    at + beside + look::<R>(value, gradient, offset, rounding::<R>(at), limit) * looks
}

/// The gradient after one of the phases 1 to 3: `change` is how much larger the field is there.
#[inline(always)]
pub fn gradient<R: Real>(gradient: R::Vec3, phase: R, change: R, apart: R) -> R::Vec3 {
    let zero = lit::<R>(0.0);
    let slope = (change / apart).named("slope");
    let along = |number: f64| {
        let here = (phase - lit(number)).abs().less(lit(0.5));
        R::select(here, slope, zero)
    };
    gradient + R::Vec3::new(along(1.0), along(2.0), along(3.0))
}

/// The outcome of a look that does not tell where the surface is: the next phase takes a part of the way.
pub const TOO_FAR: f32 = 2.0;

/// The outcome of a look, in which the field is `field` at the offset `next` from a claim, and `value` at the place `at`
/// of the round, with the offset `offset`: 1 where a surface is there, −1 where nothing is that matters, and 0 where
/// another round tells. [`TOO_FAR`] where it is beyond the surface by more than the gradient says. A look that goes
/// nowhere finds nothing.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the state of a claim")]
pub fn outcome<R: Real>(
    at: R::Vec3,
    gradient: R::Vec3,
    round: R,
    phase: R,
    value: R,
    field: R,
    offset: R::Vec3,
    next: R::Vec3,
    limit: R,
) -> R {
    // Of what was divided by a large bound, rounding makes less.
    let noise = rounding::<R>(at) * gradient.length().min(lit(1.0)) * lit(NOISE);
    let there = value.min(field).less(-noise);
    let expected = value + gradient.dot(next - offset);
    let is_deep = field.less(expected - value * lit(TOO_DEEP));
    let is_outside = lit::<R>(0.0).less(value);
    let may_go_on = R::and(is_outside, phase.less(lit(LAST_PHASE - 0.5)));
    let is_too_far = R::and(R::and(there, is_deep), may_go_on);
    let is_last = lit::<R>(ROUNDS - 1.5).less(round);
    let moved = R::or(field.less(value), value.less(field));
    let is_far = (limit * limit).less(next.dot(next));
    let goes_on = R::and(moved, R::not(R::or(is_last, is_far)));
    let found = R::select(is_too_far, lit(f64::from(TOO_FAR)), lit(1.0));
    R::select(there, found, R::select(goes_on, lit(0.0), lit(-1.0)))
}

/// The value from which another round goes on after an outcome of 0. What is below zero there is rounding, and only a
/// claim itself can be in a solid.
#[inline(always)]
pub fn repeated<R: Real>(field: R) -> R {
    field.max(lit(1e-30))
}

/// The way from the claim to the surface, once one is there: to the root of the line through the round's place and
/// the offset `next`, at which the field is `field`.
#[inline(always)]
pub fn surface<R: Real>(offset: R::Vec3, next: R::Vec3, value: R, field: R) -> R::Vec3 {
    let crosses = (value * field).less(lit(0.0));
    let change = R::select(crosses, value - field, lit(1.0));
    offset + (next - offset) * R::select(crosses, value / change, lit(1.0))
}
