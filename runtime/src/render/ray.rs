//! Rays of pixels, and the points on them.

use super::RenderJob;
use sdfc_shaders::camera;
use sdfc_shaders::layout::FrameUniforms;
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
    let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
    let segment =
        camera::intersect_box::<f32>(camera.origin, camera.direction, low, high, f32::MAX);
    segment.x <= f.far && f.far < segment.y
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
