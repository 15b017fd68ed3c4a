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
    let segment = segments::<1>(f, 1, |_| (camera.origin, camera.direction));
    is_limited([segment.enter[0], segment.exit[0]], f.far)
}

/// Reports whether a ray, on which surfaces lie between `enter` and `exit`, ends because of the limit `far`.
pub(crate) fn is_limited([enter, exit]: [f32; 2], far: f32) -> bool {
    enter <= exit && exit == far
}

/// Parts of rays on which they may meet surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segments<const N: usize> {
    pub(crate) enter: [f32; N],
    /// The ray meets nothing if this is less than `enter`.
    pub(crate) exit: [f32; N],
    /// Start of the parts of the scene other than exact half spaces.
    pub(crate) crowd_enter: [f32; N],
    /// Their end.
    pub(crate) crowd_exit: [f32; N],
    /// Entry into the first exact half space.
    pub(crate) plane_t: [f32; N],
}

/// Returns the parts of the first `count` rays on which they may meet surfaces.
#[inline(always)]
pub(crate) fn segments<const N: usize>(
    f: &FrameUniforms,
    count: usize,
    ray: impl Fn(usize) -> (V3<f32>, V3<f32>),
) -> Segments<N> {
    let never = camera::NEVER as f32;
    let mut segments = Segments {
        enter: [0.0; N],
        exit: [0.0; N],
        crowd_enter: [0.0; N],
        crowd_exit: [never; N],
        plane_t: [never; N],
    };
    let far = match f.half_space_count {
        0 => f.far,
        _ => f.extended_far,
    };
    for i in 0..count {
        let (origin, direction) = ray(i);
        let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
        let bounds = camera::intersect_box::<f32>(origin, direction, low, high, far);
        segments.enter[i] = bounds.x;
        segments.exit[i] = bounds.y;
    }
    if f.half_space_count > 0 {
        limit_to_enclosure(f, count, ray, &mut segments);
    }
    segments
}

/// Limits rays to the enclosure of an endless scene.
#[inline(always)]
fn limit_to_enclosure<const N: usize>(
    f: &FrameUniforms,
    count: usize,
    ray: impl Fn(usize) -> (V3<f32>, V3<f32>),
    segments: &mut Segments<N>,
) {
    let never = camera::NEVER as f32;
    let (low, high) = (vector(f.box_min), vector(f.box_max));
    let mut ends = [0.0; N];
    let mut least_exits = [0.0; N];
    for (i, end) in ends.iter_mut().enumerate().take(count) {
        let (origin, direction) = ray(i);
        let finite = camera::intersect_box::<f32>(origin, direction, low, high, f.far);
        let is_met = finite.x <= finite.y;
        *end = if is_met { finite.y } else { 0.0 };
        segments.crowd_enter[i] = if is_met { finite.x } else { never };
        segments.crowd_exit[i] = *end;
    }
    let half_spaces = &f.half_spaces[..f.half_space_count as usize];
    for (number, &[x, y, z, offset]) in half_spaces.iter().enumerate() {
        let normal = V3::new(x, y, z);
        let is_exact = number < f.exact_half_space_count as usize;
        let is_solid = number < f.solid_half_space_count as usize;
        let solid_depth = if is_solid { f.solid_depth } else { never };
        for i in 0..count {
            let (origin, direction) = ray(i);
            let exit = camera::half_space_exit::<f32>(
                origin,
                direction,
                normal,
                offset,
                solid_depth,
                f.far,
                f.extended_far,
            );
            ends[i] = Real::max(ends[i], exit);
            least_exits[i] = Real::min(least_exits[i], exit);
            let entry = camera::half_space_entry::<f32>(origin, direction, normal, offset);
            if is_exact {
                segments.plane_t[i] = Real::min(segments.plane_t[i], entry);
            } else {
                segments.crowd_enter[i] = Real::min(segments.crowd_enter[i], entry);
                segments.crowd_exit[i] = Real::max(segments.crowd_exit[i], exit);
            }
        }
    }
    for i in 0..count {
        let start = camera::free_start::<f32>(segments.crowd_enter[i], segments.plane_t[i]);
        segments.enter[i] = Real::max(segments.enter[i], start);
        // A ray that stays in a solid meets no surface.
        let end = if least_exits[i] < 0.0 { -1.0 } else { ends[i] };
        segments.exit[i] = Real::min(segments.exit[i], end);
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
