//! The rays of a tile's pixels from the camera, computed 64 at a time.

use super::LANES;
use super::ray_tasks::{lane_ray, lanes, set_lane_ray};
use crate::render::ray::{PixelRay, camera_ray, segments};
use sdfc_shaders::layout::FrameUniforms;
use sdfc_vm::multiversion;
use sdfc_vm::vector::V3;

lanes! {
    /// Rays of 64 pixels.
    CameraLanes {
        origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, start_offset,
    }
}

/// Ray of a pixel in a sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CameraRay {
    pub(super) origin: V3<f32>,
    pub(super) direction: V3<f32>,
    /// Difference of the start's distance from the camera to that of the central ray.
    pub(super) start_offset: f32,
    /// Distances at which it enters and leaves the scene's bounds. It misses them if `exit < enter`.
    pub(super) enter: f32,
    pub(super) exit: f32,
    /// Start and end of the parts of the scene other than exact half spaces.
    pub(super) crowd: [f32; 2],
    /// Entry into the first exact half space.
    pub(super) plane_t: f32,
}

multiversion! {
    /// Computes the rays of pixels.
    pub(super) fn camera_rays(
        frame: &FrameUniforms,
        pixels: &[[f32; 2]],
        rays: &mut Vec<CameraRay>,
    ) = camera_rays_body;
}

#[inline(always)]
fn camera_rays_body(frame: &FrameUniforms, pixels: &[[f32; 2]], rays: &mut Vec<CameraRay>) {
    rays.clear();
    let mut block = CameraLanes::default();
    for pixels in pixels.chunks(LANES) {
        for (lane, &pixel) in pixels.iter().enumerate() {
            let PixelRay {
                origin,
                direction,
                start_offset,
            } = camera_ray(frame, pixel);
            set_lane_ray!(block, lane, origin, direction);
            block.start_offset.0[lane] = start_offset;
        }
        let segments = segments::<LANES>(frame, pixels.len(), |lane| lane_ray!(block, lane));
        rays.extend((0..pixels.len()).map(|lane| {
            let (origin, direction) = lane_ray!(block, lane);
            CameraRay {
                origin,
                direction,
                start_offset: block.start_offset.0[lane],
                enter: segments.enter[lane],
                exit: segments.exit[lane],
                crowd: [segments.crowd_enter[lane], segments.crowd_exit[lane]],
                plane_t: segments.plane_t[lane],
            }
        }));
    }
}
