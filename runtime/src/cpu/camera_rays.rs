//! The rays of a tile's pixels from the camera, computed 64 at a time.

use super::LANES;
use super::ray_tasks::{lane_ray, lanes, set_lane_ray};
use crate::render::ray::{PixelRay, bounds_segment, camera_ray, limit_to_enclosure};
use sdfc_shaders::layout::FrameUniforms;
use sdfc_vm::multiversion;
use sdfc_vm::vector::V3;

lanes! {
    /// Rays of 64 pixels.
    CameraLanes {
        origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, start_offset, enter, exit,
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
            let bounds = bounds_segment(frame, origin, direction);
            set_lane_ray!(block, lane, origin, direction);
            block.start_offset.0[lane] = start_offset;
            block.enter.0[lane] = bounds.x;
            block.exit.0[lane] = bounds.y;
        }
        let mut exits = block.exit;
        let ray = |lane: usize| lane_ray!(block, lane);
        limit_to_enclosure(frame, ray, &mut exits.0[..pixels.len()]);
        block.exit = exits;
        rays.extend((0..pixels.len()).map(|lane| {
            let (origin, direction) = lane_ray!(block, lane);
            CameraRay {
                origin,
                direction,
                start_offset: block.start_offset.0[lane],
                enter: block.enter.0[lane],
                exit: block.exit.0[lane],
            }
        }));
    }
}
