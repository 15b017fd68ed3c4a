//! Bounds of the field along the next segments of rays in a leaf.
//!
//! A leaf's bounds hold in all of it. In the box around a short segment of a ray, the field may change far
//! more slowly. So a ray that is still under way after some steps passes segments on which intervals exclude a
//! surface. Where they prove none, bounds of the gradient give a slope for the next segment. It is marched as if it
//! were a leaf (E. Galin and others,
//! *Segment Tracing Using Local Lipschitz Bounds*, 2020).

use super::entry::{DirectionalBounds, directional_bounds};
use super::{LeafRays, Marcher, active_lanes, active_lanes_body, whole_chunks};
use crate::cells::gradient_slack::{clamped_slope, with_slack};
use crate::cells::{Aabb, Cell};
use crate::cpu::march::outcome;
use crate::cpu::ray_tasks::lane_ray;
use crate::cpu::{AabbLanes, Evaluator, F32x64, GradientRangeLanes, LANES, RangeLanes};
use sdfc_shaders::layout::FrameUniforms;
use sdfc_shaders::{camera, marching};
use sdfc_vm::multiversion;
use sdfc_vm::real::Real;

/// Number of steps after which rays get new segments.
pub(super) const STEPS: u32 = 4;
/// Minimum gain for new segments after that number of steps: bounds of the gradient cost about as much.
pub(super) const MIN_GAIN: f32 = 4.0;
/// Factor of the length of a segment after one that was passed.
const GROWTH: f32 = 2.0;
/// Factor of the length of a segment after one that was not passed.
const SHRINKAGE: f32 = 0.25;
/// Minimum length of a segment to pass, in steps of its ray before.
const MIN_LENGTH_STEPS: f32 = 8.0;
/// Length of a segment with a slope of its own, in steps of its ray before.
const LENGTH_STEPS: f32 = 16.0;
/// Largest number of steps that count as saved: without segments, steps may grow.
const MAX_SAVED_STEPS: f32 = 64.0;
/// Number of steps of a ray after which it gets no segments. Its least step grows from then on.
const MAX_RAY_STEPS: f32 = 1024.0;
/// Minimum fraction of the rays with another segment to pass.
const MIN_OPEN_FRACTION: f32 = 0.25;
/// Number of segments in a row that are tried, whether or not they are passed.
const FREE_ROUNDS: f32 = 6.0;
/// Minimum mean number of steps that a segment saves beyond these: its interval costs about two steps.
const MIN_SAVED_STEPS: f32 = 2.0;
/// Maximum number of segments in a row.
const MAX_ROUNDS: f32 = 32.0;

impl Marcher {
    /// Moves rays on by segments, and begins segments with slopes of their own. Returns the mean factor by which
    /// this lengthens steps, and the number of evaluations.
    pub(super) fn bound_segments(
        &mut self,
        frame: &FrameUniforms,
        (cell_index, cell): (u32, &Cell),
        active: u64,
        count: usize,
        evaluator: &mut dyn Evaluator,
    ) -> (f32, u64) {
        let mut evaluations = 0;
        let block = &mut self.leaf_rays;
        block.outcome = F32x64([outcome::ACTIVE; LANES]);
        for (base_step, step) in block.base_step.0.iter_mut().zip(&block.step.0) {
            *base_step = step.max(f32::MIN_POSITIVE);
        }
        open_segments(block, f32::INFINITY);
        let ray_count = active.count_ones() as f32;
        let (mut saved, mut rounds) = (0.0, 0.0);
        loop {
            segment_boxes(&self.leaf_rays, count, &mut self.boxes);
            widen_boxes(frame, cell, &self.leaf_rays, count, &mut self.boxes);
            if !evaluator.ranges_in_cell(cell_index, &self.boxes, count, &mut self.range) {
                return (0.0, evaluations);
            }
            evaluations += count as u64;
            let [saved_steps, open_rays] =
                pass_segments(cell, &self.range, active, count, &mut self.leaf_rays);
            saved += saved_steps / ray_count;
            rounds += 1.0;
            let pays = rounds < FREE_ROUNDS || saved >= MIN_SAVED_STEPS * rounds;
            if open_rays < ray_count * MIN_OPEN_FRACTION || !pays || rounds >= MAX_ROUNDS {
                break;
            }
        }
        let active = active & active_lanes(&self.leaf_rays);
        let gain = saved / rounds;
        if active == 0 {
            return (gain, evaluations);
        }
        open_segments(&mut self.leaf_rays, LENGTH_STEPS);
        segment_boxes(&self.leaf_rays, count, &mut self.boxes);
        widen_boxes(frame, cell, &self.leaf_rays, count, &mut self.boxes);
        let bounds = &mut self.gradient_range;
        if !evaluator.gradient_ranges_in_cell(cell_index, &self.boxes, count, bounds) {
            return (gain, evaluations);
        }
        evaluations += count as u64;
        let gains = begin_segments(
            cell,
            self.max_slope,
            bounds,
            active,
            count,
            &mut self.leaf_rays,
        );
        let gain = gain.max(gains / active.count_ones() as f32);
        (gain, evaluations)
    }
}

/// Opens the next segments, of `steps` steps before. An infinite one leads to the leaf's end.
fn open_segments(block: &mut LeafRays, steps: f32) {
    for i in 0..LANES {
        let is_open = block.steps.0[i] < MAX_RAY_STEPS;
        block.is_open.0[i] = if is_open { 1.0 } else { 0.0 };
        block.segment.0[i] = block.base_step.0[i] * steps;
    }
}

multiversion! {
    /// Computes the bounding boxes of the next segments.
    pub(super) fn segment_boxes(leaf_rays: &LeafRays, count: usize, boxes: &mut AabbLanes) = segment_boxes_body;
}

#[inline(always)]
fn segment_boxes_body(block: &LeafRays, count: usize, boxes: &mut AabbLanes) {
    for i in 0..whole_chunks(count) {
        let (origin, direction) = lane_ray!(block, i);
        // Rounding keeps the order of points along a ray, so the box of its ends contains all points between
        // them.
        let from = camera::point_along::<f32>(origin, direction, block.t.0[i]).to_array();
        let to = camera::point_along::<f32>(origin, direction, segment_end(block, i)).to_array();
        for axis in 0..3 {
            boxes[axis].0[i] = Real::min(from[axis], to[axis]);
            boxes[axis + 3].0[i] = Real::max(from[axis], to[axis]);
        }
    }
}

multiversion! {
    /// Widens the boxes of segments by the distance of probes, within the leaf. A field that is zero in the contact of
    /// two solids is negative beside it.
    fn widen_boxes(
        frame: &FrameUniforms, cell: &Cell, leaf_rays: &LeafRays, count: usize, boxes: &mut AabbLanes,
    ) = widen_boxes_body;
}

#[inline(always)]
fn widen_boxes_body(
    frame: &FrameUniforms,
    cell: &Cell,
    block: &LeafRays,
    count: usize,
    boxes: &mut AabbLanes,
) {
    let Aabb { low, high } = cell.region;
    for i in 0..whole_chunks(count) {
        let t = segment_end(block, i);
        let half = camera::half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
        let margin = marching::probe_margin(t, half, frame.rounding);
        for axis in 0..3 {
            // Rounding may put the ends of a segment outside.
            let (from, to) = (boxes[axis].0[i], boxes[axis + 3].0[i]);
            boxes[axis].0[i] = Real::min(from, Real::max(from - margin, low[axis]));
            boxes[axis + 3].0[i] = Real::max(to, Real::min(to + margin, high[axis]));
        }
    }
}

/// Returns the distance at which a ray's segment ends.
#[inline(always)]
fn segment_end(block: &LeafRays, i: usize) -> f32 {
    Real::min(block.t.0[i] + block.segment.0[i], block.leaf_exit_t.0[i])
}

multiversion! {
    /// Moves rays to the ends of segments on which the field cannot change its sign. Returns the number of steps that
    /// this saves, and the number of rays of `active` with a next segment.
    pub(super) fn pass_segments(
        cell: &Cell, range: &RangeLanes, active: u64, count: usize, leaf_rays: &mut LeafRays,
    ) -> [f32; 2] = pass_segments_body;
}

#[inline(always)]
fn pass_segments_body(
    cell: &Cell,
    [low, high]: &RangeLanes,
    active: u64,
    count: usize,
    block: &mut LeafRays,
) -> [f32; 2] {
    let (mut saved_steps, mut open_rays) = (0.0, 0.0);
    for i in 0..whole_chunks(count) {
        let is_open = block.is_open.0[i] > 0.0;
        let nearest = if block.side.0[i] > 0.0 {
            low.0[i]
        } else {
            -high.0[i]
        };
        // Without a value below zero there is no surface.
        let is_clear = is_open & (nearest >= 0.0);
        let (from, to) = (block.t.0[i], segment_end(block, i));
        let is_last = to >= block.leaf_exit_t.0[i];
        let (length, base_step) = (to - from, block.base_step.0[i]);
        pass(cell, block, i, is_clear, to);
        let factor = if is_clear { GROWTH } else { SHRINKAGE };
        block.segment.0[i] = length * factor;
        let is_long = block.segment.0[i] > base_step * MIN_LENGTH_STEPS;
        let goes_on = is_open & !(is_clear & is_last) & is_long;
        block.is_open.0[i] = if goes_on { 1.0 } else { 0.0 };
        let is_active = active >> i & 1 == 1;
        let saved = Real::min(length / base_step, MAX_SAVED_STEPS);
        saved_steps += if is_active & is_clear { saved } else { 0.0 };
        open_rays += if is_active & goes_on { 1.0 } else { 0.0 };
    }
    [saved_steps, open_rays]
}

/// Least value of a ray that was moved on: zero stands for a ray without a value.
const MIN_VALUE: f32 = 1e-30;

/// Moves a ray to the end of a segment, where it is as one that enters a leaf. But it keeps its last value, which
/// decides on probes: a raw field may be near zero far from its surface.
#[inline(always)]
fn pass(cell: &Cell, block: &mut LeafRays, i: usize, is_clear: bool, to: f32) {
    let from = block.t.0[i];
    let is_last = to >= block.leaf_exit_t.0[i];
    let moves = is_clear & !is_last;
    let select = |new: f32, old: f32| if moves { new } else { old };
    block.outcome.0[i] = if is_clear & is_last {
        outcome::EXITED
    } else {
        block.outcome.0[i]
    };
    block.t.0[i] = select(to, from);
    block.t_before.0[i] = select(to, block.t_before.0[i]);
    let leaf = leaf_bounds(cell, block, i);
    let value = block.field.0[i] * block.slope.0[i] / leaf.slope;
    let value = Real::max(value, MIN_VALUE);
    block.field.0[i] = select(value, block.field.0[i]);
    block.field_before.0[i] = select(value, block.field_before.0[i]);
    block.step.0[i] = select(0.0, block.step.0[i]);
    block.trend.0[i] = select(-1.0, block.trend.0[i]);
    set_bounds(block, i, moves, leaf, block.leaf_exit_t.0[i]);
}

/// Bounds the directional derivative of the field along a ray in the whole leaf.
#[inline(always)]
fn leaf_bounds(cell: &Cell, block: &LeafRays, i: usize) -> DirectionalBounds {
    let direction = [
        block.direction_x.0[i],
        block.direction_y.0[i],
        block.direction_z.0[i],
    ];
    directional_bounds((cell.slope, cell.gradient), direction, block.side.0[i])
}

/// Replaces the bounds of a ray's way to `exit`, if `sets` is true.
#[inline(always)]
fn set_bounds(block: &mut LeafRays, i: usize, sets: bool, bounds: DirectionalBounds, exit: f32) {
    let select = |new: f32, old: f32| if sets { new } else { old };
    block.slope.0[i] = select(bounds.slope, block.slope.0[i]);
    block.decrease_max.0[i] = select(bounds.decrease_max, block.decrease_max.0[i]);
    block.decrease_min.0[i] = select(bounds.decrease_min, block.decrease_min.0[i]);
    block.exit_t.0[i] = select(exit, block.exit_t.0[i]);
}

multiversion! {
    /// Begins segments with slopes of their own. Returns the factors by which steps grow, summed over `active`.
    pub(super) fn begin_segments(
        cell: &Cell, max_slope: f32, bounds: &GradientRangeLanes, active: u64, count: usize, leaf_rays: &mut LeafRays,
    ) -> f32 = begin_segments_body;
}

#[inline(always)]
fn begin_segments_body(
    cell: &Cell,
    max_slope: f32,
    [x, y, z, values]: &GradientRangeLanes,
    active: u64,
    count: usize,
    block: &mut LeafRays,
) -> f32 {
    let mut gains = 0.0;
    for i in 0..whole_chunks(count) {
        let direction = [
            block.direction_x.0[i],
            block.direction_y.0[i],
            block.direction_z.0[i],
        ];
        let side = block.side.0[i];
        let (from, to) = (block.t.0[i], segment_end(block, i));
        let gradient = [x, y, z].map(|[low, high]| [low.0[i], high.0[i]]);
        let (slope, gradient) = with_slack(gradient);
        let is_bounded = slope < f32::INFINITY;
        let local = directional_bounds(
            (clamped_slope(slope, max_slope), Some(gradient)),
            direction,
            side,
        );
        let leaf = leaf_bounds(cell, block, i);
        let is_open = (block.is_open.0[i] > 0.0) & is_bounded;
        let nearest = if side > 0.0 {
            values[0].0[i]
        } else {
            -values[1].0[i]
        };
        // The value of a ray that was moved on is that before its segment.
        let is_value_here = block.step.0[i] > 0.0;
        let value = if is_value_here {
            block.field.0[i] * block.slope.0[i]
        } else {
            0.0
        };
        let end_value = value - local.decrease_max * (to - from);
        let is_clear = is_open & ((nearest >= 0.0) | (end_value > 0.0));
        let takes = is_open & !is_clear & (local.slope < leaf.slope);
        let ratio = if takes {
            block.slope.0[i] / local.slope
        } else {
            1.0
        };
        block.field.0[i] *= ratio;
        block.field_before.0[i] *= ratio;
        block.step.0[i] *= ratio;
        set_bounds(block, i, takes, local, to);
        pass(cell, block, i, is_clear, to);
        block.step.0[i] = Real::min(block.step.0[i], block.exit_t.0[i] - block.t.0[i]);
        let gain = if is_clear {
            (to - from) / block.base_step.0[i]
        } else if takes {
            // Near zero, steps are longer than the field says.
            value / (local.slope * block.base_step.0[i])
        } else {
            0.0
        };
        let is_active = active >> i & 1 == 1;
        gains += if is_active {
            Real::min(gain, MAX_SAVED_STEPS)
        } else {
            0.0
        };
    }
    gains
}

multiversion! {
    /// Lets rays that left a segment go on in the leaf, as if they entered it there. Returns the mask of the lanes whose
    /// rays are under way.
    pub(super) fn leave_segments(cell: &Cell, count: usize, leaf_rays: &mut LeafRays) -> u64 = leave_segments_body;
}

#[inline(always)]
fn leave_segments_body(cell: &Cell, count: usize, block: &mut LeafRays) -> u64 {
    for i in 0..count {
        let exit = block.exit_t.0[i];
        if block.outcome.0[i] != outcome::EXITED || exit >= block.leaf_exit_t.0[i] {
            continue;
        }
        block.outcome.0[i] = outcome::ACTIVE;
        pass(cell, block, i, true, exit);
    }
    active_lanes_body(block)
}
