//! Rays of pixels, and the points on them.

use super::RenderJob;
use sdfc_shaders::camera;
use sdfc_shaders::layout::FrameUniforms;
use sdfc_vm::real::Real;
use sdfc_vm::vector::{V2, V3};

/// The ray of a pixel.
pub(crate) struct PixelRay {
    pub(crate) origin: V3<f32>,
    pub(crate) direction: V3<f32>,
    /// Difference of the start's distance from the camera to that of the central ray.
    pub(crate) start_offset: f32,
}

/// Returns the distance from the camera that a pixel's ray has reached.
pub(crate) fn distance_from_camera(f: &FrameUniforms, pixel: [f32; 2], t: f32) -> f32 {
    // Rays of endless scenes start at the camera.
    if f.approach == 0.0 {
        return t;
    }
    t + camera_ray(f, pixel).start_offset + f.approach
}

/// Reports whether a pixel's ray, if it misses, ends because of the limit `far`, and not at the end of the
/// scene's bounds. Rays to a plane end there.
pub(crate) fn ends_at_far(job: &RenderJob, f: &FrameUniforms, pixel: [f32; 2]) -> bool {
    if job.shows_plane() {
        return false;
    }
    let camera = camera_ray(f, pixel);
    let bounds = bounds_segment(f, camera.origin, camera.direction);
    let mut exit = [bounds.y];
    limit_to_enclosure(f, |_| (camera.origin, camera.direction), &mut exit);
    bounds.x <= exit[0] && exit[0] == f.far
}

/// Returns the distances along a ray at which it enters and leaves the bounds of the scene.
#[inline(always)]
pub(crate) fn bounds_segment(f: &FrameUniforms, origin: V3<f32>, direction: V3<f32>) -> V2<f32> {
    let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
    let far = match f.half_space_count {
        0 => f.far,
        _ => f.extended_far,
    };
    camera::intersect_box::<f32>(origin, direction, low, high, far)
}

/// Maximum number of rays that are limited together.
const MAX_RAYS: usize = 64;

/// Ends rays where they leave the enclosure of an endless scene. `exits` are the distances at which they leave the bounds.
#[inline(always)]
pub(crate) fn limit_to_enclosure(
    f: &FrameUniforms,
    ray: impl Fn(usize) -> (V3<f32>, V3<f32>),
    exits: &mut [f32],
) {
    if f.half_space_count == 0 {
        return;
    }
    let (low, high) = (vector(f.finite_min), vector(f.finite_max));
    let mut ends = [0.0; MAX_RAYS];
    let mut least_exits = [0.0; MAX_RAYS];
    for (i, end) in ends.iter_mut().enumerate().take(exits.len()) {
        let (origin, direction) = ray(i);
        let finite = camera::intersect_box::<f32>(origin, direction, low, high, f.far);
        *end = if finite.x <= finite.y { finite.y } else { 0.0 };
    }
    let half_spaces = &f.half_spaces[..f.half_space_count as usize];
    for (number, &[x, y, z, offset]) in half_spaces.iter().enumerate() {
        let is_solid = number < f.solid_half_space_count as usize;
        let solid_depth = match is_solid {
            true => f.solid_depth,
            false => camera::NO_SOLID_DEPTH as f32,
        };
        for i in 0..exits.len() {
            let (origin, direction) = ray(i);
            let exit = camera::half_space_exit::<f32>(
                origin,
                direction,
                V3::new(x, y, z),
                offset,
                solid_depth,
                f.far,
                f.extended_far,
            );
            ends[i] = Real::max(ends[i], exit);
            least_exits[i] = Real::min(least_exits[i], exit);
        }
    }
    for (i, exit) in exits.iter_mut().enumerate() {
        // A ray that stays in a solid meets no surface.
        let end = if least_exits[i] < 0.0 { -1.0 } else { ends[i] };
        *exit = Real::min(*exit, end);
    }
}

/// Returns the ray of a pixel.
#[inline(always)]
pub(crate) fn camera_ray(f: &FrameUniforms, [x, y]: [f32; 2]) -> PixelRay {
    let pair = |[x, y]: [f32; 2]| V2 { x, y };
    let view_position = camera::view_position::<f32>(V2 { x, y }, pair(f.offset), pair(f.size));
    let (right, up) = (vector(f.origin_right), vector(f.origin_up));
    let origin = camera::interpolate_view::<f32>(view_position, vector(f.origin), right, up);
    let (right, up) = (vector(f.forward_right), vector(f.forward_up));
    let offset_in_view =
        camera::interpolate_view::<f32>(view_position, V3::new(0.0, 0.0, 0.0), right, up);
    let forward = camera::interpolate_view::<f32>(view_position, vector(f.forward), right, up);
    PixelRay {
        origin,
        direction: camera::unit::<f32>(forward),
        start_offset: camera::start_excess::<f32>(offset_in_view, f.approach),
    }
}

/// Converts three numbers to a vector.
pub(crate) fn vector([x, y, z]: [f32; 3]) -> V3<f32> {
    V3::new(x, y, z)
}
