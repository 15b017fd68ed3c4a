//! Claims: a value that is small enough to matter for light says that a surface may be near, and a look along
//! the gradient says whether one is, and how far.
//!
//! A step to the surface ([`crate::marching`]) is a distance where shapes are exact. Of cuts and intersections
//! it is a lower bound, which may be far less: the field of a hole is zero where the cutter ends, with nothing
//! there. Of raw fields it was divided by a bound of the slope. So light takes no value for a distance before it
//! is checked, one evaluation after the other:
//!
//! | phase | evaluated |
//! |---|---|
//! | 0 | the value |
//! | 1 to 3 | beside it along x, y and z, for the gradient |
//! | 4 | a little beyond the place where the gradient says that the surface is |
//! | 5 | twice as far beyond, where a raw field did not get below zero |
//!
//! Another face begins where the field is above zero in phase 4, and a raw one does not go on falling: the look
//! goes on from that place, along the edge between the faces, in at most three rounds of these phases. A
//! surface is there once the field is below zero, and nowhere else: a cutter leaves faces in the field that
//! nothing is behind. So light depends on surfaces alone: not on how far a cutter reaches out of what it cuts, nor
//! on a factor on a field or a bound of its slope.

use crate::marching::ROUNDING;
use sdfc_vm::real::{Real, Vector3, lit};

/// The way of the look beyond the expected surface, as a fraction of the way to it.
const BEYOND: f64 = 0.02;
/// The distance of the points by which the gradient is found, as a fraction of the value.
const APART: f64 = 0.02;
/// The same at least, in units of what rounding can make of the field there.
const APART_ROUNDINGS: f64 = 64.0;
/// The most rounds of looks: at a face, an edge and a corner.
const ROUNDS: f64 = 3.0;
/// The squared sine of the angle between the faces of the sharpest edge that is followed. Faces that are more
/// opposed are those of a valley between two that nothing is behind.
const SHARPEST: f64 = 0.2;
/// The distance of a surface that is not there.
pub const NOTHING: f32 = 1e18;
/// The last phase.
pub const LAST_PHASE: f32 = 5.0;

/// The distance of the points by which the gradient at a place is found. What rounding can make of the field there
/// follows from the place itself, however far away the eye is.
#[inline(always)]
pub fn apart<R: Real>(value: R, at: R::Vec3) -> R {
    let rounding = at.abs().max_component() * lit(ROUNDING);
    (value.abs() * lit(APART)).max(rounding * lit(APART_ROUNDINGS))
}

/// The thickness of a sheet into which a look goes back, as a fraction of the way to it.
const THIN: f64 = 0.1;

/// The way to the surface from the place of a round, `offset` away from the claim: against the gradient, but
/// back from no face that the rounds before led to, unless through a thin sheet.
#[inline(always)]
fn toward<R: Real>(value: R, gradient: R::Vec3, offset: R::Vec3) -> R::Vec3 {
    let back = gradient.dot(offset).max(lit(0.0)).named("back");
    let way = offset.dot(offset).named("way");
    let square = gradient.dot(gradient).max(lit(1e-30)).named("square");
    let aside = gradient - offset * (back / way.max(lit(1e-30)));
    let is_thin = (value * value).less(way * square * lit(THIN * THIN));
    let along = R::Vec3::select(is_thin, gradient, aside).named("along");
    let left = along.dot(along).named("left");
    let is_valley = left.less(square * lit(SHARPEST));
    along * R::select(is_valley, lit(0.0), -(value / left.max(lit(1e-30))))
}

/// The offset of the next round's place: a little beyond the surface that was expected, as in phase 4.
#[inline(always)]
pub fn offset<R: Real>(offset: R::Vec3, value: R, gradient: R::Vec3) -> R::Vec3 {
    offset + toward::<R>(value, gradient, offset) * lit::<R>(1.0 + BEYOND)
}

/// The point at which a phase evaluates the field. `at` is the place of the round, `offset` away from the claim.
/// `value` is the field there, and `gradient` its gradient as far as phases 1 to 3 found it.
#[inline(always)]
pub fn place<R: Real>(
    at: R::Vec3,
    offset: R::Vec3,
    phase: R,
    value: R,
    gradient: R::Vec3,
    apart: R,
) -> R::Vec3 {
    let zero = lit::<R>(0.0);
    let along = |number: f64| {
        let here = (phase - lit(number)).abs().less(lit(0.5));
        R::select(here, apart, zero)
    };
    let beside = R::Vec3::new(along(1.0), along(2.0), along(3.0));
    let beyond = (phase - lit(3.0)) * lit(BEYOND) + lit(1.0);
    let ways = R::select(phase.less(lit(3.5)), zero, beyond).named("ways");
    at + beside + toward::<R>(value, gradient, offset) * ways
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

/// The number of a round that is the last one.
pub const LAST_ROUND: f32 = ROUNDS as f32 - 1.0;

/// 1 if the claim is decided, else 0. It is where the field got below zero or was so before, and in the last of the
/// rounds, which are counted from 0. Of a raw field it is where that goes on falling after phase 4, in which it was
/// `before`.
#[inline(always)]
pub fn decided<R: Real>(phase: R, round: R, value: R, field: R, before: R, raw: R) -> R {
    let below = value.min(field).less(lit(0.0));
    let is_last = lit::<R>(ROUNDS - 1.5).less(round);
    let late = lit::<R>(4.5).less(phase);
    let ends = R::or(below, R::and(is_last, raw.less(lit(0.5))));
    let looked = R::and(lit::<R>(3.5).less(phase), ends);
    let followed = R::and(late, R::or(is_last, field.less(before)));
    R::select(R::or(looked, followed), lit(1.0), lit(0.0))
}

/// 1 if the next phase of a claim that is not decided is the last one of its round, else 0.
#[inline(always)]
pub fn looks_again<R: Real>(phase: R, raw: R) -> R {
    let again = R::and(phase.less(lit(4.5)), lit::<R>(0.5).less(raw));
    R::select(again, lit(1.0), lit(0.0))
}

/// The distance of the surface, once the claim is decided: `last` is the field of the last phase, and `before`
/// that of phase 4. Where raw fields were divided by bounds (`raw` is 1), the field may go on falling more
/// slowly, as within the box of such a field, and is followed.
#[inline(always)]
pub fn distance<R: Real>(
    value: R,
    gradient: R::Vec3,
    offset: R::Vec3,
    phase: R,
    last: R,
    before: R,
    raw: R,
) -> R {
    let length = gradient.length().max(lit(1e-10)).named("length");
    let way = (value / length).named("way");
    let zero = lit::<R>(0.0);
    let around = (offset + toward::<R>(value, gradient, offset)).length();
    let straight = R::select(zero.less(offset.dot(offset)), around, way).named("straight");
    // Over the last piece, in units of the slope.
    let rise = ((last - before) / (value * lit(BEYOND)).max(lit(1e-30))).named("rise");
    let aside = (before.max(zero) / length).named("aside");
    let followed = straight + way * lit(BEYOND) + aside / (-rise).max(lit(1e-9));
    let is_raw = lit::<R>(0.5).less(raw);
    let late = lit::<R>(4.5).less(phase);
    let flat = length.less(R::select(is_raw, lit(1e-9), lit(1e-4)));
    let above = R::and(R::not(late), zero.less(value.min(last)));
    let behind = R::and(late, lit::<R>(-1e-8).less(rise));
    let gone = R::or(flat, R::or(above, behind));
    let found = R::select(late, followed, straight);
    R::select(gone, lit(f64::from(NOTHING)), found)
}

/// The distance of the surface from the point before the claim, where the field was a `share` of that of the
/// claim; [`NOTHING`] where the field says too little of it.
#[inline(always)]
pub fn before<R: Real>(share: R, found: R, round: R) -> R {
    let is_edge = lit::<R>(0.5).less(round);
    R::select(is_edge, lit(f64::from(NOTHING)), share * found)
}
