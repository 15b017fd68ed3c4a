//! The stage `beam`: distance that the rays of each block of pixels can advance together.

use super::ray_tasks::{RayTask, lane_ray, lanes, set_lane_ray, store_point};
use super::{F32x64, LANES, Points};
use crate::render::ray::{camera_ray, vector};
use sdfc_shaders::layout::{self, FrameUniforms};
use sdfc_shaders::{beam, camera, marching};
use sdfc_vm::real::Real;

lanes! {
    /// Beams under way.
    BeamLanes {
        origin_x, origin_y, origin_z, direction_x, direction_y, direction_z,
        spread, widening, t, steps,
    }
}

/// The beams of a tile's blocks: items are the blocks' indices, row after row.
pub(super) struct Beams<'a> {
    pub(super) frame: &'a FrameUniforms,
    /// The tile's upper left pixel.
    pub(super) corner: [u32; 2],
    /// Number of blocks in a row.
    pub(super) columns: u32,
    pub(super) beams: &'a mut [layout::Beam],
}

impl RayTask for Beams<'_> {
    type Block = BeamLanes;

    fn begin(&mut self, item: u32, block: &mut BeamLanes, lane: usize) -> bool {
        let frame = self.frame;
        let position = [item % self.columns, item / self.columns];
        let first: [u32; 2] =
            std::array::from_fn(|i| self.corner[i] + position[i] * beam::BLOCK_SIDE);
        let ray =
            |x: u32, y: u32| camera_ray(frame, [(first[0] + x) as f32, (first[1] + y) as f32]);
        let centre_ray = ray(beam::BLOCK_SIDE / 2, beam::BLOCK_SIDE / 2);
        let last = beam::BLOCK_SIDE - 1;
        let (mut spread, mut widening) = (0.0, 0.0);
        for (x, y) in [(0, 0), (last, 0), (0, last), (last, last)] {
            let corner_ray = ray(x, y);
            spread = Real::max(
                spread,
                beam::distance_between::<f32>(corner_ray.origin, centre_ray.origin),
            );
            let direction_difference =
                beam::distance_between::<f32>(corner_ray.direction, centre_ray.direction);
            widening = Real::max(widening, direction_difference);
        }
        let (low, high) = (vector(frame.bounds_min), vector(frame.bounds_max));
        set_lane_ray!(block, lane, centre_ray.origin, centre_ray.direction);
        block.spread.0[lane] = spread;
        block.widening.0[lane] = widening;
        block.t.0[lane] = beam::start_t::<f32>(centre_ray.origin, low, high, spread);
        block.steps.0[lane] = 0.0;
        true
    }

    #[inline(always)]
    fn points(&self, block: &BeamLanes, points: &mut Points) {
        let (low, high) = (vector(self.frame.bounds_min), vector(self.frame.bounds_max));
        for i in 0..LANES {
            let (origin, direction) = lane_ray!(block, i);
            let p = camera::point_along::<f32>(origin, direction, block.t.0[i]);
            let p = beam::clamp_to_box::<f32>(p, low, high);
            store_point(points, i, p);
        }
    }

    #[inline(always)]
    fn advance(&self, block: &mut BeamLanes, values: &F32x64, ended: &mut [bool; LANES]) {
        let frame = self.frame;
        for (i, ended) in ended.iter_mut().enumerate() {
            let t = block.t.0[i];
            let half = camera::half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
            let threshold = marching::threshold(t, half, frame.threshold_fraction, frame.rounding);
            let is_distance = frame.flags & layout::ESTIMATE_FLAG == 0;
            let field = if is_distance { values.0[i] } else { 0.0 };
            let step = beam::advance(t, field, block.spread.0[i], block.widening.0[i], threshold);
            let goes_on = beam::should_continue(step, half) > 0.0;
            let t = t + if goes_on { step } else { 0.0 };
            let steps = block.steps.0[i] + 1.0;
            *ended = !goes_on | (t > frame.far) | (steps >= beam::MAX_STEPS as f32);
            block.t.0[i] = t;
            block.steps.0[i] = steps;
        }
    }

    fn end(&mut self, item: u32, block: &BeamLanes, lane: usize) {
        self.beams[item as usize] = layout::Beam {
            t: block.t.0[lane],
            steps: block.steps.0[lane] as u32,
        };
    }
}
