//! How much of a light arrives at a surface: sphere tracing towards the light, with the nearest
//! miss along the way as the width of the penumbra (I. Quilez, *Soft shadows in raymarched SDFs*).
//!
//! `size` is the tangent of the angle under which the light's radius is seen; a ball of radius
//! `h` around the point at `t` on the ray leaves `h / (size · t)` of the light uncovered.

use sdfc_vm::real::{Real, lit};

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

/// What stands for the visibility by a claim where there is none.
pub const NO_CLAIM: f32 = 2.0;

/// Whether a point by which `visible` would be seen of a light claims a part of what arrives so far, as 1 or 0:
/// where that falls along the ray. What rounding can make of the field claims nothing.
#[inline(always)]
pub fn claims<R: Real>(visible: R, last: R, visibility: R, h: R, noise: R) -> R {
    let falls = R::and(visible.less(last), visible.less(visibility));
    R::select(R::and(falls, noise.less(h.abs())), lit(1.0), lit(0.0))
}

/// Visibility after a step, for a sharp shadow: none where the ray is inside by more than `noise`.
#[inline(always)]
pub fn hard<R: Real>(visibility: R, h: R, noise: R) -> R {
    R::select(h.less(-noise), lit(0.0), visibility)
}

/// Visibility after a step, from the ball at `t` itself.
#[inline(always)]
pub fn plain<R: Real>(visibility: R, h: R, t: R, size: R) -> R {
    visibility.min(h.max(lit(0.0)) / (size * t).max(lit(1e-20)))
}

/// The largest distance of a surface, in steps, for which the place between two steps is looked for.
const LONG_STEPS: f64 = 4.0;

/// Visibility after a step, from the nearest place between this ball and the one `stride` before:
/// where the two meet, the surface may touch both. The published form takes the stride to be
/// `before`; this one allows any.
#[inline(always)]
pub fn improved<R: Real>(visibility: R, h: R, before: R, stride: R, t: R, size: R) -> R {
    let h = h.max(lit(0.0)).named("ball");
    let y = ((stride * stride + h * h - before * before) / (stride * lit(2.0)).max(lit(1e-20)))
        .max(lit(0.0))
        .named("y");
    // One ball may hold the other; then the nearest place is the middle of this one. So it is where steps are
    // short, of which the difference of the balls tells nothing but rounding.
    let close = before.less(stride * lit(LONG_STEPS));
    let meet = R::and(R::and(y.less(h), lit::<R>(0.0).less(before)), close);
    let distance = R::select(meet, (h * h - y * y).max(lit(0.0)).sqrt(), h);
    let at = R::select(meet, t - y, t);
    visibility.min(distance / (size * at).max(lit(1e-20)))
}

/// Visibility after a step, from −1, all of the light covered, to 1, none.
#[inline(always)]
pub fn sized<R: Real>(visibility: R, h: R, t: R, size: R) -> R {
    visibility
        .min(h / (size * t).max(lit(1e-20)))
        .max(lit(-1.0))
}

/// How far the next step goes: the ball's radius, but not less than a threshold that for a light
/// with a size grows with the way, since nothing narrower than a tenth of the penumbra is seen.
#[inline(always)]
pub fn stride<R: Real>(h: R, t: R, threshold: R, size: R) -> R {
    h.max(threshold.max(size * t * lit(0.1)))
}

/// The same for [`plain`] and [`sized`], which know only the points that the ray stepped on:
/// these must not be too far apart.
#[inline(always)]
pub fn short_stride<R: Real>(h: R, t: R, threshold: R, size: R) -> R {
    stride(
        h.min(t * lit(0.4) + threshold * lit(64.0)),
        t,
        threshold,
        size,
    )
}

/// What of the light arrives, from the visibility of [`plain`] and [`improved`]: the share of a
/// disc that is not behind a straight edge, smoothed.
#[inline(always)]
pub fn arriving<R: Real>(visibility: R) -> R {
    let v = visibility.saturate();
    v * v * (lit::<R>(3.0) - v * lit(2.0))
}

/// What of the light arrives, from the visibility of [`sized`].
#[inline(always)]
pub fn arriving_sized<R: Real>(visibility: R) -> R {
    arriving(visibility * lit(0.5) + lit(0.5))
}
