//! Rays of pixels, the size of a pixel along its ray, and the intersection of rays with the scene's bounds.

use sdfc_vm::real::{Real, Vector2, Vector3, lit};

/// Shift of all samples in pixels. Without it, rays of level cameras lie exactly in planes of the scene. In the
/// plane in which two solids touch, the field is zero all along the ray, as beside a sheet without thickness.
/// Such planes lead through centres or corners of pixels, also in rolled views. The samples keep a distance from
/// all lines through these whose slope is a ratio of numbers up to 8.
pub const SAMPLE_SHIFT: [f64; 2] = [0.032_25, 0.072];

/// Returns the position of a pixel's sample in the picture: from (-1, -1), lower left, to (1, 1), upper
/// right. `pixel` counts from the upper left; `offset` is within (-½, ½). All samples are shifted by a
/// twelfth of a pixel.
#[inline(always)]
pub fn view_position<R: Real>(pixel: R::Vec2, offset: R::Vec2, size: R::Vec2) -> R::Vec2 {
    let [x, y] = SAMPLE_SHIFT.map(|shift| lit(0.5 + shift));
    let sample = (pixel + R::Vec2::new(x, y) + offset).named("sample");
    R::Vec2::new(
        sample.x() / size.x() * lit(2.0) - lit(1.0),
        lit::<R>(1.0) - sample.y() / size.y() * lit(2.0),
    )
}

/// Returns the vector at `position` in the picture, by that at its `centre` and the differences to its right
/// and upper edges.
#[inline(always)]
pub fn interpolate_view<R: Real>(
    position: R::Vec2,
    centre: R::Vec3,
    right: R::Vec3,
    up: R::Vec3,
) -> R::Vec3 {
    centre + right * position.x() + up * position.y()
}

/// Returns how much farther the start of a ray is from the camera than in the middle of the picture, where
/// that distance is `approach`. `offset` is the difference between the ray's direction and the middle one.
/// The formula loses no precision where both distances are nearly equal.
#[inline(always)]
pub fn start_excess<R: Real>(offset: R::Vec3, approach: R) -> R {
    let tangent_square = offset.dot(offset).named("tangent_square");
    approach * tangent_square / (lit::<R>(1.0) + (lit::<R>(1.0) + tangent_square).sqrt())
}

/// Returns the direction of length one; `v` is never zero here.
#[inline(always)]
pub fn unit<R: Real>(v: R::Vec3) -> R::Vec3 {
    v.normalize()
}

/// Returns the point at `t` along a ray.
#[inline(always)]
pub fn point_along<R: Real>(origin: R::Vec3, direction: R::Vec3, t: R) -> R::Vec3 {
    origin + direction * t
}

/// Returns half of a pixel's height at `t` along its ray.
#[inline(always)]
pub fn half_pixel<R: Real>(t: R, half_pixel_size: R, growth: R) -> R {
    half_pixel_size + growth * t
}

/// Returns the distances along a ray to the first and the last of a box's two faces across each axis. The
/// third result is the inverse of the direction.
#[inline(always)]
pub(crate) fn faces<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    low: R::Vec3,
    high: R::Vec3,
) -> [R::Vec3; 3] {
    // Directions along a face are moved off it by an invisible amount.
    let inverse = |d: R| {
        let tiny = lit::<R>(1e-12);
        lit::<R>(1.0) / (d.abs().max(tiny) * d.sign_nonzero())
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

/// Returns the distances along a ray at which it enters and leaves a box, as (enter, exit) with `enter ≥ 0`
/// and `exit ≤ far`. The ray misses the box if `exit < enter`.
#[inline(always)]
pub fn intersect_box<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    low: R::Vec3,
    high: R::Vec3,
    far: R,
) -> R::Vec2 {
    let [first, last, _] = faces::<R>(origin, direction, low, high);
    let enter = first.max_component();
    let exit = last.x().min(last.y()).min(last.z());
    R::Vec2::new(enter.max(lit(0.0)), exit.min(far))
}

/// Distance that stands for never.
pub const NEVER: f64 = 1e30;
/// Least rate at which a ray falls that is extended to a half space: at a lesser one, rounding decides where it
/// arrives.
const MIN_EXTENDED_FALL: f64 = 1e-5;
/// Length of an extended ray, in distances to the half space.
const EXTENDED_LENGTH: f64 = 1.5;

/// Returns the distance along a ray up to which it may meet the surface of a half space. It is 0 for none, and −1 if the
/// ray never leaves the solid part.
///
/// Rays end at `far`. Those that fall towards the half space go on until they are in its solid part, up to
/// `extended_far`. If no solid part is known, they go on into the half space. `offset` is the distance of the origin from
/// the plane along its `normal`, which points out of the half space. From `solid_depth` on, the half space is solid.
/// [`NEVER`] stands for none.
#[inline(always)]
pub fn half_space_exit<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    normal: R::Vec3,
    offset: R,
    solid_depth: R,
    far: R,
    extended_far: R,
) -> R {
    let height = (origin.dot(normal) + offset).named("height");
    let fall = -direction.dot(normal);
    let inverse_fall = (lit::<R>(1.0) / fall.abs().max(lit(1e-12))).named("inverse_fall");
    let crossing = (height.abs() * inverse_fall).named("crossing");
    let is_solid = solid_depth.less(lit(NEVER));
    let drop = (height + R::select(is_solid, solid_depth, lit(0.0))).named("drop");
    let is_falling = lit::<R>(0.0).less(fall);
    let is_extended = R::and(
        lit::<R>(MIN_EXTENDED_FALL).less(fall),
        R::not(extended_far.less(crossing)),
    );
    let beyond_arrival = drop.abs() * inverse_fall * lit(EXTENDED_LENGTH);
    let falling_far =
        R::select(is_extended, beyond_arrival.min(extended_far).max(far), far).named("falling_far");
    let arrives = R::or(is_extended, crossing.less(far));
    let arrival = R::select(arrives, falling_far, lit(0.0));
    let above = R::select(is_falling, arrival, lit(0.0));
    let stays = R::or(is_falling, R::not(crossing.less(far)));
    let is_buried = R::and(height.less(-solid_depth), stays);
    let inside = R::select(is_falling, falling_far, far);
    let inside_or_buried = R::select(is_buried, lit(-1.0), inside);
    R::select(lit::<R>(0.0).less(height), above, inside_or_buried)
}

/// Returns the distance along a ray at which it enters a half space: 0 if it starts in it, [`NEVER`] if it does not enter.
#[inline(always)]
pub fn half_space_entry<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    normal: R::Vec3,
    offset: R,
) -> R {
    let height = (origin.dot(normal) + offset).named("height");
    let fall = -direction.dot(normal);
    let crossing = height / fall.max(lit(1e-12));
    let is_falling = lit::<R>(1e-12).less(fall);
    let entry = R::select(is_falling, crossing, lit(NEVER));
    R::select(lit::<R>(0.0).less(height), entry, lit(0.0))
}

/// Fraction of the way to the first exact half space that a ray skips.
const SKIPPED_FRACTION: f64 = 0.9;

/// Returns the distance at which a ray begins: up to there, nothing is before it. It enters the crowded part of a scene at
/// `crowd_enter`, and a floor or a wall at `plane_t`.
#[inline(always)]
pub fn free_start<R: Real>(crowd_enter: R, plane_t: R) -> R {
    crowd_enter
        .min(plane_t * lit(SKIPPED_FRACTION))
        .max(lit(0.0))
}

/// Returns the distance along the ray to the plane through `centre` with the normal `forward`.
#[inline(always)]
pub fn intersect_plane<R: Real>(
    origin: R::Vec3,
    direction: R::Vec3,
    centre: R::Vec3,
    forward: R::Vec3,
) -> R {
    (centre - origin).dot(forward) / direction.dot(forward)
}

#[cfg(test)]
mod tests {
    use super::SAMPLE_SHIFT;

    #[test]
    fn samples_keep_away_from_simple_lines_through_pixels() {
        let [x, y] = SAMPLE_SHIFT;
        let slopes = (-8..=8).flat_map(|rise| (0..=8).map(move |run| [rise, run]));
        let is_reduced = |slope: &[i32; 2]| (2..=8).all(|n| slope.iter().any(|k| k % n != 0));
        for [rise, run] in slopes.filter(is_reduced).map(|slope| slope.map(f64::from)) {
            // Centres and corners lie on lines where twice this number is whole.
            let offset = rise * x - run * y;
            let beside = (offset - (2.0 * offset).round() / 2.0).abs() / rise.hypot(run);
            assert!(beside > 1e-3, "{rise}:{run}: {beside} pixels");
        }
        assert!(x.min(y) > 0.03, "level views have the most such planes");
    }
}
