//! Where a pixel's ray starts and goes, how wide the pixel is along it, and where it crosses the
//! scene's bounds.

use sdfc_vm::real::{Real, Vector2, Vector3, lit};

/// Where in the picture a pixel's sample lies: from (-1, -1), lower left, to (1, 1), upper right.
/// `pixel` counts from the upper left; `offset` is within (-½, ½).
#[inline(always)]
pub fn place_in_view<R: Real>(pixel: R::Vec2, offset: R::Vec2, size: R::Vec2) -> R::Vec2 {
    let half = R::Vec2::splat(lit(0.5));
    let at = (pixel + half + offset).named("at");
    R::Vec2::new(
        at.x() / size.x() * lit(2.0) - lit(1.0),
        lit::<R>(1.0) - at.y() / size.y() * lit(2.0),
    )
}

/// What lies at `place` when the middle lies at `centre` and the edges at `right` and `up` from it.
#[inline(always)]
pub fn across<R: Real>(place: R::Vec2, centre: R::Vec3, right: R::Vec3, up: R::Vec3) -> R::Vec3 {
    centre + right * place.x() + up * place.y()
}

/// How much longer the way from the eye to a ray's start is than in the middle of the picture, where
/// it is `approach`; `side` is how the ray's direction differs from the middle's. Written so that
/// nothing is lost where the two ways are nearly equal.
#[inline(always)]
pub fn way_beyond<R: Real>(side: R::Vec3, approach: R) -> R {
    let s = side.dot(side).named("s");
    approach * s / (lit::<R>(1.0) + (lit::<R>(1.0) + s).sqrt())
}

/// The direction of length one; `v` is never zero here.
#[inline(always)]
pub fn unit<R: Real>(v: R::Vec3) -> R::Vec3 {
    v.normalize()
}

/// The point at `t` along a ray.
#[inline(always)]
pub fn along<R: Real>(origin: R::Vec3, direction: R::Vec3, t: R) -> R::Vec3 {
    origin + direction * t
}

/// Half of a pixel's height at `t` along its ray.
#[inline(always)]
pub fn half_pixel<R: Real>(t: R, footprint: R, growth: R) -> R {
    footprint + growth * t
}

/// The ways along a ray to the first and the last of a box's two faces across each axis, and those per unit across it.
#[inline(always)]
pub(crate) fn faces<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    low: R::Vec3,
    high: R::Vec3,
) -> [R::Vec3; 3] {
    // Directions along a face are moved off it by so little that nothing is seen of it.
    let inverse = |d: R| {
        let tiny = lit::<R>(1e-12);
        lit::<R>(1.0) / (d.abs().max(tiny) * d.side())
    };
    let inverse = R::Vec3::new(
        inverse(direction.x()),
        inverse(direction.y()),
        inverse(direction.z()),
    )
    .named("inverse");
    let a = ((low - origin) * inverse).named("a");
    let b = ((high - origin) * inverse).named("b");
    [a.min(b).named("first"), a.max(b).named("last"), inverse]
}

/// The ways along a ray to where it enters and leaves a box, as (enter, leave) with `enter ≥ 0` and
/// `leave ≤ far`; it misses the box if `leave < enter`.
#[inline(always)]
pub fn crossing<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    low: R::Vec3,
    high: R::Vec3,
    far: R,
) -> R::Vec2 {
    let [first, last, _] = faces::<R>(origin, direction, low, high);
    let enter = first.max_component();
    let leave = last.x().min(last.y()).min(last.z());
    R::Vec2::new(enter.max(lit(0.0)), leave.min(far))
}

/// How far along the ray the plane through `centre` lies that faces along `forward`.
#[inline(always)]
pub fn meet_plane<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    centre: R::Vec3,
    forward: R::Vec3,
) -> R {
    (centre - origin).dot(forward) / direction.dot(forward)
}
