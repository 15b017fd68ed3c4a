//! The stage `refine_roots`: the ends of rays are moved onto the surface. Packets refine theirs in
//! `packet/refine_roots.rs`.

use super::camera_rays::CameraRay;
use super::ray_tasks::{ColumnChoice, RayTask, is_nan, lane_ray, lanes, set_lane_ray, store_point};
use super::{F32x64, LANES, Points};
use sdfc_shaders::camera;
use sdfc_shaders::layout::{FrameUniforms, RayState};
use sdfc_shaders::marching::{self, FROM_INSIDE, MAX_SECANT_STEPS, Status};

lanes! {
    /// Ends of rays during secant refinement.
    RootLanes {
        origin_x, origin_y, origin_z, direction_x, direction_y, direction_z,
        t, field, t_other, field_other, estimate, side, steps,
    }
}

/// Ends of rays that are moved onto the surface: items are indices in the tile.
pub(super) struct RootRefinement<'a> {
    pub(super) frame: &'a FrameUniforms,
    pub(super) camera_rays: &'a [CameraRay],
    pub(super) rays: &'a mut [RayState],
}

impl RayTask for RootRefinement<'_> {
    type Block = RootLanes;

    fn begin(&mut self, item: u32, block: &mut RootLanes, lane: usize) -> bool {
        let frame = self.frame;
        let ray = &mut self.rays[item as usize];
        // Rays that ran out of steps have no change of sign to refine.
        if !matches!(Status::from_word(ray.status), Status::Hit | Status::Inside) {
            return false;
        }
        let rounding = marching::rounding_at(ray.t, frame.rounding);
        let (t, field, other, field_other) = (ray.t, ray.field, ray.t_before, ray.field_before);
        if marching::is_settled(t, field, other, field_other, rounding, frame.is_raw) > 0.0 {
            ray.t = marching::secant_estimate(t, field, other, field_other);
            return false;
        }
        let CameraRay {
            origin, direction, ..
        } = self.camera_rays[item as usize];
        set_lane_ray!(block, lane, origin, direction);
        block.t.0[lane] = ray.t;
        block.field.0[lane] = ray.field;
        block.t_other.0[lane] = ray.t_before;
        block.field_other.0[lane] = ray.field_before;
        block.estimate.0[lane] =
            marching::next_estimate(t, field, other, field_other, rounding, frame.is_raw, 0.0);
        block.side.0[lane] = if ray.status & FROM_INSIDE != 0 {
            -1.0
        } else {
            1.0
        };
        block.steps.0[lane] = 0.0;
        true
    }

    #[inline(always)]
    fn points(&self, block: &RootLanes, points: &mut Points) {
        for i in 0..LANES {
            let (origin, direction) = lane_ray!(block, i);
            let p = camera::point_along::<f32>(origin, direction, block.estimate.0[i]);
            store_point(points, i, p);
        }
    }

    #[inline(always)]
    fn advance(&self, block: &mut RootLanes, values: &F32x64, ended: &mut [bool; LANES]) {
        let choice = ColumnChoice::new();
        for (i, ended) in ended.iter_mut().enumerate() {
            let distance = values.0[i];
            let is_nan_value = is_nan(distance);
            let next = marching::secant_step(
                block.t.0[i],
                block.field.0[i],
                block.t_other.0[i],
                block.field_other.0[i],
                block.estimate.0[i],
                distance * block.side.0[i],
            );
            // An estimate without a value is not used.
            let select = |new: f32, old: f32| choice.choose(!is_nan_value, new, old);
            block.t.0[i] = select(next.t, block.t.0[i]);
            block.field.0[i] = select(next.field, block.field.0[i]);
            block.t_other.0[i] = select(next.t_other, block.t_other.0[i]);
            block.field_other.0[i] = select(next.field_other, block.field_other.0[i]);
            let (t, field) = (block.t.0[i], block.field.0[i]);
            let (other, field_other) = (block.t_other.0[i], block.field_other.0[i]);
            let is_raw = self.frame.is_raw;
            let rounding = marching::rounding_at(t, self.frame.rounding);
            let steps = block.steps.0[i] + 1.0;
            *ended = (steps >= MAX_SECANT_STEPS as f32)
                | is_nan_value
                | (marching::is_settled(t, field, other, field_other, rounding, is_raw) > 0.0);
            block.estimate.0[i] = if *ended {
                marching::secant_estimate(t, field, other, field_other)
            } else {
                marching::next_estimate(t, field, other, field_other, rounding, is_raw, steps)
            };
            block.steps.0[i] = steps;
        }
    }

    fn end(&mut self, item: u32, block: &RootLanes, lane: usize) {
        let ray = &mut self.rays[item as usize];
        ray.t = block.estimate.0[lane];
        ray.steps += block.steps.0[lane] as u32;
    }
}
