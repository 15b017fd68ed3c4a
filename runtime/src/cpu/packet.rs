//! The stage `march` through cells: the rays of a bundle of packets go from leaf to leaf together ([`bundle`]).
//!
//! In a leaf a ray goes from its entry to its exit, on the leaf's own tape and with the leaf's slope bound.
//! Between leaves there is no surface, and no evaluation. A leaf that lies in the last empty sphere is
//! skipped without evaluation, too. Most other leaves are rejected by one evaluation at the entry points
//! ([`entry`]); only the surviving rays are compacted and marched.
//!
//! In fields written with coordinates, gradient bounds limit the change of the field along each ray in the
//! leaf. They give the slope to march with. Where the field cannot fall to zero before the exit, the ray
//! leaves. Where it is certain to fall below zero, there is one root, which secant steps find.
//!
//! A ray that runs along a surface still takes tiny steps. So after a number of steps interval bounds of the
//! field on the remaining ray segments cull the rays that meet nothing in the leaf. If all rays are parallel
//! to an axis, that test is first applied to whole rays.
//!
//! Lists are sorted by the smallest distance of any ray, which is not the order for each ray. So a hit counts
//! until a nearer one is found, and leaves behind it are not entered.

pub(super) mod bundle;
mod entry;
mod interval_cull;
mod refine_roots;
mod segments;

use super::march::{next_point, outcome, step_lane, takes_probe};
use super::proved_steps::{is_between, plan_sample, proves_part_of_step, sample_step};
use super::ray_tasks::{ColumnChoice, Lanes, is_nan, lane_ray, lanes, store_point};
use super::{AabbLanes, Evaluator, F32x64, GradientRangeLanes, LANES, Points, RangeLanes};
use crate::cells::Cell;
use crate::render::ray::vector;
use entry::{bound_directions, cull_entered, entry_points, misses_leaf};
use interval_cull::cull_clear;
use refine_roots::{estimate_roots, refine_roots};
use sdfc_shaders::camera;
use sdfc_shaders::layout::{self, FrameUniforms, RayState};
use sdfc_shaders::marching::{self, MAX_SECANT_STEPS};
use sdfc_vm::lanes::CHUNK;
use sdfc_vm::multiversion;
use sdfc_vm::real::Real;
use segments::{leave_segments, segment_boxes};

/// Number of steps from which on the limit of steps in cells without a bound grows.
const MAX_SHORT_STEPS: f64 = 512.0;

/// Placeholder for the crowded part of a ray: a leaf is small.
const NO_CROWD: [f32; 3] = [camera::NEVER as f32, 0.0, camera::NEVER as f32];

/// Marks a ray that ended in no leaf.
pub(super) const NO_LEAF: u32 = u32::MAX;

lanes! {
    /// 64 rays, and the segments in which they may still hit a surface.
    Packet {
        origin_x, origin_y, origin_z, direction_x, direction_y, direction_z,
        inverse_x, inverse_y, inverse_z, begin_t, end_t, clear_from, clear_to, side, steps, entry_t, exit_t,
    }
}

lanes! {
    /// Rays under way in a leaf.
    LeafRays {
        lane, origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, exit_t,
        t, field, step, trend, t_before, field_before, side, steps, outcome, slope, decrease_max, decrease_min, leaf_exit_t, segment, base_step, is_open, sample_t,
    }
}

lanes! {
    /// Rays that hit in a leaf, during secant refinement.
    Roots {
        lane, origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, low, high,
        t, field, t_other, field_other, side, slope,
    }
}

/// State of a packet of a bundle.
struct BundledPacket {
    packet: Packet,
    /// Index in the tile of each ray.
    items: [u32; LANES],
    /// Values of the field at the entries into the present leaf.
    values: F32x64,
    /// Mask of the rays that cross the present leaf.
    crossing: u64,
    /// Leaf in which each ray ended.
    hit_leaves: [u32; LANES],
}

impl Default for BundledPacket {
    fn default() -> Self {
        Self {
            packet: Packet::default(),
            items: [0; LANES],
            values: F32x64::default(),
            crossing: 0,
            hit_leaves: [NO_LEAF; LANES],
        }
    }
}

/// Buffers of a march.
#[derive(Default)]
pub(super) struct Marcher {
    bundle: Vec<BundledPacket>,
    leaf_rays: LeafRays,
    roots: Roots,
    /// Number of hits in `roots`.
    hit_count: usize,
    points: Points,
    values: F32x64,
    entry_points: Points,
    boxes: AabbLanes,
    range: RangeLanes,
    gradient_range: GradientRangeLanes,
    /// Bound of the program's slope.
    max_slope: f32,
    /// Number of leaves that packets were tested against, and of those that were entered.
    pub(super) visits: [u64; 2],
}

/// Number of steps in a leaf after which interval bounds cull the remaining segments, and factor to the
/// number of steps of the next cull.
const INTERVAL_CULL_STEPS: u32 = 4;
/// Number of steps before the first cull where gradient bounds already cull rays at the entry.
const INTERVAL_CULL_STEPS_WITH_GRADIENT: u32 = 6;

/// Largest ratio of the greatest to the least rate of decrease in a leaf at which secant steps find the root
/// from anywhere in it.
const MAX_DECREASE_RATIO: f32 = 4.0;

impl Marcher {
    /// Collects a ray at its entry into the leaf, with the field's value there.
    fn collect_lane(&mut self, [number, lane]: [usize; 2], slot: usize) {
        let (bundled, block) = (&self.bundle[number], &mut self.leaf_rays);
        let p = &bundled.packet;
        block.lane.0[slot] = (number * LANES + lane) as f32;
        block.origin_x.0[slot] = p.origin_x.0[lane];
        block.origin_y.0[slot] = p.origin_y.0[lane];
        block.origin_z.0[slot] = p.origin_z.0[lane];
        block.direction_x.0[slot] = p.direction_x.0[lane];
        block.direction_y.0[slot] = p.direction_y.0[lane];
        block.direction_z.0[slot] = p.direction_z.0[lane];
        block.exit_t.0[slot] = p.exit_t.0[lane];
        block.leaf_exit_t.0[slot] = p.exit_t.0[lane];
        block.t.0[slot] = p.entry_t.0[lane];
        block.t_before.0[slot] = p.entry_t.0[lane];
        block.sample_t.0[slot] = p.entry_t.0[lane];
        block.side.0[slot] = p.side.0[lane];
        block.steps.0[slot] = p.steps.0[lane];
        self.values.0[slot] = bundled.values.0[lane];
    }

    /// Begins the march of collected rays.
    fn begin_group(&mut self) {
        let block = &mut self.leaf_rays;
        block.field = F32x64::default();
        block.step = F32x64::default();
        block.trend = F32x64([-1.0; LANES]);
        block.field_before = F32x64::default();
    }

    /// Evaluates the field at the entry points of all rays that cross a leaf. Returns their number.
    fn sample_entries(&mut self, cell: u32, evaluator: &mut dyn Evaluator) -> u64 {
        let mut crossing_count = 0;
        let (mut sources, mut count) = ([[0; 2]; LANES], 0);
        for number in 0..self.bundle.len() {
            let crossing = self.bundle[number].crossing;
            if crossing == 0 {
                continue;
            }
            crossing_count += u64::from(crossing.count_ones());
            entry_points(&self.bundle[number].packet, &mut self.entry_points);
            for lane in set_bits(crossing) {
                for (column, entries) in self.points.iter_mut().zip(&self.entry_points) {
                    column.0[count] = entries.0[lane];
                }
                sources[count] = [number, lane];
                count += 1;
                if count == LANES {
                    self.evaluate_entries(cell, &sources, evaluator);
                    count = 0;
                }
            }
        }
        if count > 0 {
            self.evaluate_entries(cell, &sources[..count], evaluator);
        }
        crossing_count
    }

    /// Evaluates the field at collected entry points. Each value is stored in the lane of its ray.
    fn evaluate_entries(
        &mut self,
        cell: u32,
        sources: &[[usize; 2]],
        evaluator: &mut dyn Evaluator,
    ) {
        evaluator.distances_in_cell(cell, &self.points, sources.len(), &mut self.values);
        for (slot, &[number, lane]) in sources.iter().enumerate() {
            self.bundle[number].values.0[lane] = self.values.0[slot];
        }
    }

    /// Marches the rays that cross a leaf through it, as many as fill the lanes at once.
    fn march_leaf(
        &mut self,
        frame: &FrameUniforms,
        (cell_index, cell): (u32, &Cell),
        rays: &mut [RayState],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let mut evaluations = self.sample_entries(cell_index, evaluator);
        let mut count = 0;
        for number in 0..self.bundle.len() {
            let BundledPacket {
                packet,
                values,
                crossing,
                ..
            } = &mut self.bundle[number];
            let culled = match *crossing == 0 || cell.may_be_discontinuous {
                true => 0,
                false => cull_entered(frame, cell, values, packet),
            };
            for lane in set_bits(*crossing & !culled) {
                self.collect_lane([number, lane], count);
                count += 1;
                if count == LANES {
                    evaluations +=
                        self.march_group(frame, (cell_index, cell), count, rays, evaluator);
                    count = 0;
                }
            }
        }
        if count > 0 {
            evaluations += self.march_group(frame, (cell_index, cell), count, rays, evaluator);
        }
        evaluations
    }

    /// Marches collected rays through a leaf. The ended ones stay in their lanes until they occupy half of the
    /// lanes. Carrying them along costs less than moving the others each time.
    fn march_group(
        &mut self,
        frame: &FrameUniforms,
        (cell_index, cell): (u32, &Cell),
        mut count: usize,
        rays: &mut [RayState],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let mut evaluations = 0;
        self.begin_group();
        bound_directions(cell, &mut self.leaf_rays);
        self.hit_count = 0;
        let is_raw = evaluator.is_raw();
        let mut active = first_lanes(count);
        let first_check = match cell.gradient {
            Some(_) => INTERVAL_CULL_STEPS_WITH_GRADIENT,
            None => INTERVAL_CULL_STEPS,
        };
        let mut next_cull = first_check;
        let is_unbounded = cell.may_be_discontinuous && frame.flags & layout::ESTIMATE_FLAG != 0;
        // Where no slope is found in the leaf, samples on each step prove what the scene states.
        let proves_steps = marching::proves_steps(frame.step_factor) && cell.gradient.is_none();
        for steps in 1.. {
            let advance = if proves_steps {
                advance_proving
            } else {
                advance
            };
            let mut remaining_rays =
                active & advance(frame, cell, &self.values, count, &mut self.leaf_rays);
            if is_unbounded {
                limit_steps(frame, count, &mut self.leaf_rays);
            }
            if is_raw && remaining_rays != active {
                remaining_rays = active & leave_segments(cell, count, &mut self.leaf_rays);
            }
            if remaining_rays != active {
                self.retire(frame, active & !remaining_rays, cell_index, rays);
                (active, count) = self.compact_lanes(remaining_rays, count);
            }
            if steps == next_cull && active != 0 {
                // Most rays that creep are culled at once.
                let (gain, work) = if is_raw && steps > first_check {
                    let leaf = (cell_index, cell);
                    self.bound_segments(frame, leaf, active, count, evaluator)
                } else {
                    (0.0, self.cull_by_interval(cell_index, count, evaluator))
                };
                evaluations += work;
                if gain > segments::MIN_GAIN {
                    next_cull = steps + segments::STEPS;
                } else {
                    next_cull *= INTERVAL_CULL_STEPS;
                }
                let remaining_rays = active & active_lanes(&self.leaf_rays);
                self.retire(frame, active & !remaining_rays, cell_index, rays);
                (active, count) = self.compact_lanes(remaining_rays, count);
            }
            if active == 0 {
                break;
            }
            let next_points = if proves_steps {
                next_samples
            } else {
                next_points
            };
            next_points(frame, cell, &self.leaf_rays, count, &mut self.points);
            evaluator.distances_in_cell(cell_index, &self.points, count, &mut self.values);
            evaluations += u64::from(active.count_ones());
        }
        evaluations + self.refine_hits(frame, cell_index, rays, evaluator)
    }

    /// Culls collected rays whose interval bounds exclude a surface in this cell. Returns the number of
    /// evaluations.
    fn cull_by_interval(&mut self, cell: u32, count: usize, evaluator: &mut dyn Evaluator) -> u64 {
        self.leaf_rays.segment = F32x64([f32::INFINITY; LANES]);
        segment_boxes(&self.leaf_rays, count, &mut self.boxes);
        let has_bounds = evaluator.ranges_in_cell(cell, &self.boxes, count, &mut self.range);
        if !has_bounds {
            self.leaf_rays.outcome = F32x64([outcome::ACTIVE; LANES]);
            return 0;
        }
        cull_clear(&self.range, count, &mut self.leaf_rays);
        count as u64
    }

    /// Stores the results of rays that ended.
    fn retire(&mut self, frame: &FrameUniforms, ended: u64, cell: u32, rays: &mut [RayState]) {
        for slot in set_bits(ended) {
            self.retire_lane(frame, slot, cell, rays);
        }
    }

    /// Moves the rays under way to the front if that halves the lanes that are evaluated. Returns their
    /// lanes, and the number of lanes to evaluate.
    fn compact_lanes(&mut self, active: u64, count: usize) -> (u64, usize) {
        let ray_count = active.count_ones() as usize;
        if whole_chunks(ray_count) * 2 > whole_chunks(count) {
            return (active, count);
        }
        let front = first_lanes(ray_count);
        let (mut free, mut beyond_front) = (front & !active, active & !front);
        while beyond_front != 0 {
            let (from, to) = (beyond_front.trailing_zeros(), free.trailing_zeros());
            self.leaf_rays.move_lane(from as usize, to as usize);
            beyond_front &= beyond_front - 1;
            free &= free - 1;
        }
        (front, ray_count)
    }

    /// Refines the hits in the leaf by secant steps, as far as the surface lies in it. The stage `refine_roots`
    /// does the others.
    fn refine_hits(
        &mut self,
        frame: &FrameUniforms,
        cell: u32,
        rays: &mut [RayState],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let count = self.hit_count;
        if count == 0 {
            return 0;
        }
        let mut evaluations = 0;
        for steps in 0..MAX_SECANT_STEPS {
            let steps = steps as f32;
            let has_open = estimate_roots(frame, &self.roots, steps, count, &mut self.points);
            if !has_open {
                break;
            }
            evaluator.distances_in_cell(cell, &self.points, count, &mut self.values);
            evaluations += count as u64;
            refine_roots(frame, &self.values, steps, count, &mut self.roots);
        }
        let block = &self.roots;
        for slot in 0..count {
            let [number, lane] = ray_of_slot(block.lane.0[slot]);
            let bundled = &mut self.bundle[number];
            bundled.packet.end_t.0[lane] = block.t.0[slot];
            let ray = &mut rays[bundled.items[lane] as usize];
            ray.t = block.t.0[slot];
            ray.field = block.field.0[slot] * block.slope.0[slot];
            ray.t_before = block.t_other.0[slot];
            ray.field_before = block.field_other.0[slot] * block.slope.0[slot];
        }
        evaluations
    }

    /// Stores the result of a ray that ended in the leaf or left it.
    fn retire_lane(
        &mut self,
        frame: &FrameUniforms,
        slot: usize,
        cell: u32,
        rays: &mut [RayState],
    ) {
        let block = &self.leaf_rays;
        let [number, lane] = ray_of_slot(block.lane.0[slot]);
        let bundled = &mut self.bundle[number];
        let packet = &mut bundled.packet;
        packet.steps.0[lane] = block.steps.0[slot];
        packet.side.0[lane] = block.side.0[slot];
        // The sphere around the last point is empty beyond the leaf, too.
        let slope = block.slope.0[slot];
        let value = block.field.0[slot] * slope;
        let clear_radius = value * entry::clear_fraction(frame);
        packet.clear_from.0[lane] = block.t.0[slot] - clear_radius;
        packet.clear_to.0[lane] = block.t.0[slot] + clear_radius;
        let outcome = block.outcome.0[slot];
        if outcome == outcome::EXITED {
            return;
        }
        if outcome == outcome::HIT {
            let r = &mut self.roots;
            let hit = self.hit_count;
            self.hit_count += 1;
            r.lane.0[hit] = block.lane.0[slot];
            r.origin_x.0[hit] = block.origin_x.0[slot];
            r.origin_y.0[hit] = block.origin_y.0[slot];
            r.origin_z.0[hit] = block.origin_z.0[slot];
            r.direction_x.0[hit] = block.direction_x.0[slot];
            r.direction_y.0[hit] = block.direction_y.0[slot];
            r.direction_z.0[hit] = block.direction_z.0[slot];
            // The field is below zero from the entry on: rounding hid the root, which lies a little before
            // the leaf.
            let is_before = value < 0.0 && block.field_before.0[slot] == 0.0;
            let rounding = marching::rounding_at(block.t.0[slot], frame.rounding);
            let hidden_depth = marching::sign_margin(rounding, 1.0, frame.is_raw) * 2.0;
            let step_back = if is_before { hidden_depth } else { 0.0 };
            r.low.0[hit] = packet.entry_t.0[lane] - step_back;
            r.high.0[hit] = block.exit_t.0[slot];
            r.t.0[hit] = block.t.0[slot];
            r.field.0[hit] = block.field.0[slot];
            r.t_other.0[hit] = block.t_before.0[slot] - step_back;
            r.field_other.0[hit] = block.field_before.0[slot];
            r.side.0[hit] = block.side.0[slot];
            r.slope.0[hit] = slope;
        }
        // Surfaces behind the hit no longer count.
        packet.end_t.0[lane] = block.t.0[slot];
        bundled.hit_leaves[lane] = cell;
        rays[bundled.items[lane] as usize] = RayState {
            t: block.t.0[slot],
            field: block.field.0[slot] * slope,
            step: block.step.0[slot],
            trend: block.trend.0[slot],
            t_before: block.t_before.0[slot],
            field_before: block.field_before.0[slot] * slope,
            status: outcome::status(outcome),
            steps: 0,
        };
    }
}

/// Returns the packet and the lane of a collected ray.
fn ray_of_slot(ray: f32) -> [usize; 2] {
    [ray as usize / LANES, ray as usize % LANES]
}

/// Returns the number of lanes of the chunks that hold `count` rays: loops over them become vectors without
/// remainders.
#[inline(always)]
fn whole_chunks(count: usize) -> usize {
    count.div_ceil(CHUNK).min(LANES / CHUNK) * CHUNK
}

/// Iterates over the set bits, from the lowest on.
fn set_bits(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        lane
    })
}

/// Returns the mask of the first `count` lanes.
fn first_lanes(count: usize) -> u64 {
    u64::MAX.checked_shr((LANES - count) as u32).unwrap_or(0)
}

multiversion! {
    /// Computes the points of the next evaluation.
    fn next_points(
        frame: &FrameUniforms, cell: &Cell, leaf_rays: &LeafRays, count: usize, points: &mut Points,
    ) = next_points_body;
}

#[inline(always)]
fn next_points_body(
    frame: &FrameUniforms,
    cell: &Cell,
    block: &LeafRays,
    count: usize,
    points: &mut Points,
) {
    store_points::<false>(frame, cell, block, count, points);
}

/// Computes the points of the next evaluation of rays with samples on their steps.
fn next_samples(
    frame: &FrameUniforms,
    cell: &Cell,
    block: &LeafRays,
    count: usize,
    points: &mut Points,
) {
    store_points::<true>(frame, cell, block, count, points);
}

#[inline(always)]
fn store_points<const PROVES: bool>(
    frame: &FrameUniforms,
    cell: &Cell,
    block: &LeafRays,
    count: usize,
    points: &mut Points,
) {
    // The tape is valid in the leaf alone.
    let (low, high) = (vector(cell.region.low), vector(cell.region.high));
    for i in 0..whole_chunks(count) {
        let step = match PROVES {
            true => sample_step!(frame, block, i),
            false => block.step.0[i],
        };
        store_point(points, i, next_point!(frame, block, i, step, low, high));
    }
}

multiversion! {
    /// Returns the mask of the lanes whose rays are under way.
    fn active_lanes(leaf_rays: &LeafRays) -> u64 = active_lanes_body;
}

#[inline(always)]
fn active_lanes_body(block: &LeafRays) -> u64 {
    let mut active = 0;
    for (i, &out) in block.outcome.0.iter().enumerate() {
        active |= u64::from(out == outcome::ACTIVE) << i;
    }
    active
}

multiversion! {
    /// Advances each ray by a step. Returns a mask of the lanes whose rays are still under way.
    fn advance(
        frame: &FrameUniforms, cell: &Cell, values: &F32x64, count: usize, leaf_rays: &mut LeafRays,
    ) -> u64 = advance_body;
}

#[inline(always)]
fn advance_body(
    frame: &FrameUniforms,
    cell: &Cell,
    values: &F32x64,
    count: usize,
    block: &mut LeafRays,
) -> u64 {
    let choice = ColumnChoice::new();
    for i in 0..whole_chunks(count) {
        advance_lane(frame, cell, values, choice, block, i);
    }
    active_lanes_body(block)
}

multiversion! {
    /// Limits steps where neither values nor slopes are known between two points, to half a pixel. The limit grows with the
    /// number of steps, so that all rays end.
    fn limit_steps(frame: &FrameUniforms, count: usize, leaf_rays: &mut LeafRays) = limit_steps_body;
}

#[inline(always)]
fn limit_steps_body(frame: &FrameUniforms, count: usize, block: &mut LeafRays) {
    for i in 0..whole_chunks(count) {
        let half = camera::half_pixel(block.t.0[i], frame.half_pixel_size, frame.half_pixel_growth);
        let limit = half * marching::speedup_after(block.steps.0[i], MAX_SHORT_STEPS);
        // At the camera itself, pixels have no size.
        let limit = if half > 0.0 { limit } else { f32::INFINITY };
        block.step.0[i] = Real::min(block.step.0[i], limit);
    }
}

/// Advances each ray by a step, or by a sample on one. Returns a mask of the lanes whose rays are still under way.
fn advance_proving(
    frame: &FrameUniforms,
    cell: &Cell,
    values: &F32x64,
    count: usize,
    block: &mut LeafRays,
) -> u64 {
    let choice = ColumnChoice::new();
    for i in 0..whole_chunks(count) {
        let slope = block.slope.0[i];
        if proves_part_of_step!(frame, block, i, values.0[i], slope) {
            block.outcome.0[i] = outcome::ACTIVE;
            continue;
        }
        advance_lane(frame, cell, values, choice, block, i);
        plan_sample!(frame, block, i, slope);
    }
    active_lanes_body(block)
}

/// Advances the ray in a lane by a step.
#[inline(always)]
fn advance_lane(
    frame: &FrameUniforms,
    cell: &Cell,
    values: &F32x64,
    choice: ColumnChoice,
    block: &mut LeafRays,
    i: usize,
) {
    let slope = block.slope.0[i];
    step_lane!(
        frame,
        choice,
        block,
        i,
        values.0[i],
        1.0 / slope,
        NO_CROWD,
        |next, out| {
            let remaining = block.exit_t.0[i] - next.t;
            let decrease_max = block.decrease_max.0[i] / slope;
            // Behind a discontinuity there may be a surface: the ray goes on to the leaf's face, and reads
            // the sign there.
            let is_at_face = remaining <= next.t.abs() * f32::EPSILON;
            // A probe decides whether solids touch here.
            let is_probe_due = marching::takes_probe(
                next.t,
                next.field,
                next.step,
                next.trend,
                next.field_before,
                frame.rounding,
            ) > 0.0;
            let is_through = misses_leaf(next.t, next.field, next.step, decrease_max, remaining)
                & (!cell.may_be_discontinuous | is_at_face)
                & (!is_probe_due | is_at_face);
            let out = if is_through { outcome::EXITED } else { out };
            if next.arrived > 0.0 {
                outcome::HIT
            } else {
                out
            }
        }
    );
    // The tape is valid in the leaf, so no step leads out of it.
    let remaining = block.exit_t.0[i] - block.t.0[i];
    block.step.0[i] = Real::min(block.step.0[i], remaining);
    // A field that decreases all the way, and to below zero, has one root. The first secant uses the mean
    // of the least and the greatest rate of decrease.
    let (min_decrease, max_decrease) = (
        block.decrease_min.0[i] / slope,
        block.decrease_max.0[i] / slope,
    );
    let active = block.outcome.0[i] == outcome::ACTIVE;
    let is_even = max_decrease < min_decrease * MAX_DECREASE_RATIO;
    let (field, falls) = (block.field.0[i], min_decrease * remaining);
    let rounding = marching::rounding_at(block.exit_t.0[i], frame.rounding);
    let depth = marching::sign_margin(rounding, min_decrease, frame.is_raw);
    let is_certain = active & is_even & (field > 0.0) & (field + depth < falls);
    let select = |new: f32, old: f32| choice.choose(is_certain, new, old);
    block.outcome.0[i] = select(outcome::HIT, block.outcome.0[i]);
    block.t_before.0[i] = select(block.exit_t.0[i], block.t_before.0[i]);
    let end_value = field - (min_decrease + max_decrease) * 0.5 * remaining;
    block.field_before.0[i] = select(Real::min(end_value, -depth), block.field_before.0[i]);
}
