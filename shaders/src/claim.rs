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
//! | 5 | twice as far beyond, where the field did not get below zero |
//!
//! Where the field rises again behind that place, there is no surface. So light depends on surfaces alone:
//! not on how far a cutter reaches out of what it cuts, nor on a factor on a field or a bound of its slope.

use sdfc_vm::real::{Real, Vector3, lit};

/// How far beyond the expected surface is looked, as a fraction of the way to it.
const BEYOND: f64 = 0.02;
/// How far apart the points are by which the gradient is found, as a fraction of the value.
const APART: f64 = 0.02;
/// The same at least, in units of what rounding can make of the field.
const APART_ROUNDINGS: f64 = 64.0;
/// How fast the field may rise behind the expected surface, in units of its slope before, if there is one.
const RISING: f64 = 0.7;
/// The distance of a surface that is not there.
pub const NOTHING: f32 = 1e18;
/// The last phase.
pub const LAST_PHASE: f32 = 5.0;

/// How far apart the points are by which the gradient is found.
#[inline(always)]
pub fn apart<R: Real>(value: R, rounding: R) -> R {
    (value.abs() * lit(APART)).max(rounding * lit(APART_ROUNDINGS))
}

/// Where a phase evaluates the field: `at` is the point of the claim, `value` the field there, and `gradient`
/// what is known of its gradient.
#[inline(always)]
pub fn place<R: Real>(at: R::Vec3, phase: R, value: R, gradient: R::Vec3, apart: R) -> R::Vec3 {
    let zero = lit::<R>(0.0);
    let along = |number: f64| {
        let here = (phase - lit(number)).abs().less(lit(0.5));
        R::select(here, apart, zero)
    };
    let beside = R::Vec3::new(along(1.0), along(2.0), along(3.0));
    let square = gradient.dot(gradient).max(lit(1e-30)).named("square");
    let beyond = (phase - lit(3.0)) * lit(BEYOND) + lit(1.0);
    let way = R::select(phase.less(lit(3.5)), zero, value * beyond / square).named("way");
    at + beside - gradient * way
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

/// Whether the claim is decided, as 1 or 0: after phase 4 where the field got below zero or was so before, and
/// after phase 5.
#[inline(always)]
pub fn decided<R: Real>(phase: R, value: R, field: R) -> R {
    let below = R::and(lit::<R>(3.5).less(phase), value.min(field).less(lit(0.0)));
    R::select(R::or(below, lit::<R>(4.5).less(phase)), lit(1.0), lit(0.0))
}

/// How far the surface is, once the claim is decided: `last` is the field of the last phase, and `before` that
/// of phase 4. Where the field is above zero there, it turns a corner; or, where raw fields were divided by
/// bounds (`raw` is 1), it may go on falling more slowly, as within the box of such a field, and is followed.
#[inline(always)]
pub fn distance<R: Real>(value: R, gradient: R::Vec3, phase: R, last: R, before: R, raw: R) -> R {
    let length = gradient.length().max(lit(1e-10)).named("length");
    let way = (value / length).named("way");
    // Over the last piece, in units of the slope.
    let rise = ((last - before) / (value * lit(BEYOND)).max(lit(1e-30))).named("rise");
    let aside = (before.max(lit(0.0)) / length).named("aside");
    let corner = (way * way + aside * aside).sqrt();
    let followed = way * lit(1.0 + BEYOND) + aside / (-rise).max(lit(1e-9));
    let is_raw = lit::<R>(0.5).less(raw);
    let late = lit::<R>(4.5).less(phase);
    let found = R::select(late, R::select(is_raw, followed, corner), way);
    let flat = length.less(R::select(is_raw, lit(1e-9), lit(1e-4)));
    let behind = R::select(is_raw, lit(-1e-8), lit(RISING)).less(rise);
    let gone = R::or(flat, R::and(late, behind));
    R::select(gone, lit(f64::from(NOTHING)), found)
}
