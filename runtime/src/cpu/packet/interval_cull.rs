//! Culling of the remaining ray segments in a leaf by interval bounds of the field.

use super::{LeafRays, whole_chunks};
use crate::cpu::march::outcome;
use crate::cpu::ray_tasks::lane_ray;
use crate::cpu::{AabbLanes, RangeLanes};
use sdfc_shaders::camera;
use sdfc_vm::multiversion;
use sdfc_vm::real::Real;

multiversion! {
    /// Computes the bounding boxes of the remaining segments in the leaf.
    pub(super) fn remaining_boxes(leaf_rays: &LeafRays, count: usize, boxes: &mut AabbLanes) = remaining_boxes_body;
}

#[inline(always)]
fn remaining_boxes_body(block: &LeafRays, count: usize, boxes: &mut AabbLanes) {
    for i in 0..whole_chunks(count) {
        let (origin, direction) = lane_ray!(block, i);
        // Rounding keeps the order of points along a ray, so the box of its ends contains all points between
        // them.
        let from = camera::point_along::<f32>(origin, direction, block.t.0[i]).to_array();
        let to = camera::point_along::<f32>(origin, direction, block.leaf_exit_t.0[i]).to_array();
        for axis in 0..3 {
            boxes[axis].0[i] = Real::min(from[axis], to[axis]);
            boxes[axis + 3].0[i] = Real::max(from[axis], to[axis]);
        }
    }
}

multiversion! {
    /// Culls the rays along which the field cannot change its sign.
    pub(super) fn cull_clear(range: &RangeLanes, count: usize, leaf_rays: &mut LeafRays) = cull_clear_body;
}

#[inline(always)]
fn cull_clear_body([low, high]: &RangeLanes, count: usize, block: &mut LeafRays) {
    for i in 0..whole_chunks(count) {
        let slope = block.slope.0[i];
        let outside = block.side.0[i] > 0.0;
        let nearest = if outside { low.0[i] } else { -high.0[i] };
        let is_clear = nearest > 0.0;
        block.outcome.0[i] = if is_clear {
            outcome::EXITED
        } else {
            outcome::ACTIVE
        };
        // The empty sphere must not extend beyond the leaf, so it is centred on the remaining segment.
        let (from, to) = (block.t.0[i], block.leaf_exit_t.0[i]);
        let (centre, half) = ((from + to) * 0.5, (to - from) * 0.5 / slope);
        block.t.0[i] = if is_clear { centre } else { from };
        block.field.0[i] = if is_clear { half } else { block.field.0[i] };
    }
}
