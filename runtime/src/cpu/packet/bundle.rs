//! Bundles of packets, whose rays go through the leaves together. A leaf is smaller than a packet, so the rays of one
//! packet alone leave most lanes empty.
//!
//! Each packet has its own list of leaves. The nearest leaf of all lists is next, for the packets that list it.

use super::entry::{bound_directions, init_packet, intersect_box};
use super::{BundledPacket, Marcher, NO_LEAF, ray_of_slot};
use crate::cells::{Cell, Cells, Occupancy};
use crate::cpu::camera_rays::CameraRay;
use crate::cpu::leaf_bins::BinnedLeaf;
use crate::cpu::march::outcome;
use crate::cpu::ray_tasks::lane_ray;
use crate::cpu::{Evaluator, F32x64, LANES};
use sdfc_shaders::camera;
use sdfc_shaders::layout::{FrameUniforms, RayState};
use sdfc_shaders::marching::{FROM_INSIDE, SHOWN, Status};
use sdfc_vm::vector::V3;
use std::cmp::Ordering;

/// Packet of a bundle: its pixels, and the leaves that its rays may meet, the nearest first.
#[derive(Clone, Copy)]
pub(in crate::cpu) struct PacketTask<'a> {
    pub(in crate::cpu) items: &'a [u32],
    pub(in crate::cpu) leaves: &'a [BinnedLeaf],
}

/// Reports whether all rays are parallel to an axis.
fn is_axis_aligned(frame: &FrameUniforms) -> bool {
    let nonzero_axes = frame.forward.iter().filter(|d| d.abs() > 1e-6).count();
    frame.half_pixel_growth == 0.0 && nonzero_axes == 1
}

impl Marcher {
    /// Marches the rays of a bundle of packets, and stores the leaf in which each ended. Returns the number of
    /// evaluations.
    pub(in crate::cpu) fn march(
        &mut self,
        frame: &FrameUniforms,
        cells: &Cells,
        tasks: &[PacketTask<'_>],
        camera_rays: &[CameraRay],
        (rays, points, leaves): (&mut [RayState], &mut [V3<f32>], &mut [u32]),
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        self.max_slope = cells.max_slope();
        self.bundle.resize_with(tasks.len(), BundledPacket::default);
        let mut evaluations = 0;
        for (number, task) in tasks.iter().enumerate() {
            evaluations += self.begin(frame, cells, number, task, camera_rays, rays, evaluator);
        }
        let mut lists: Vec<&[BinnedLeaf]> = tasks.iter().map(|task| task.leaves).collect();
        while let Some(leaf) = nearest_leaf(&lists) {
            if self.enter_leaf(cells, leaf, &mut lists) {
                let leaf = (leaf.cell, cells.cell(leaf.cell));
                evaluations += self.march_leaf(frame, leaf, rays, evaluator);
            }
        }
        for (bundled, task) in self.bundle.iter().zip(tasks) {
            store_results(bundled, task.items, (rays, points, leaves));
        }
        evaluations
    }

    /// Begins the rays of a packet. Returns the number of evaluations.
    #[expect(clippy::too_many_arguments, reason = "the buffers of a tile")]
    fn begin(
        &mut self,
        frame: &FrameUniforms,
        cells: &Cells,
        number: usize,
        task: &PacketTask<'_>,
        camera_rays: &[CameraRay],
        rays: &mut [RayState],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let count = task.items.len();
        let bundled = &mut self.bundle[number];
        let starts_inside = init_packet(task.items, camera_rays, &mut bundled.packet);
        bundled.items[..count].copy_from_slice(task.items);
        bundled.hit_leaves = [NO_LEAF; LANES];
        for (lane, &item) in task.items.iter().enumerate() {
            rays[item as usize] = RayState {
                t: bundled.packet.end_t.0[lane],
                trend: -1.0,
                t_before: bundled.packet.begin_t.0[lane],
                status: Status::Miss as u32,
                ..RayState::default()
            };
        }
        if starts_inside {
            self.find_sides(cells, number, count, evaluator);
        }
        if !task.leaves.is_empty() && evaluator.is_raw() && is_axis_aligned(frame) {
            return self.cull_axis_aligned(cells.cell(0), number, count, evaluator);
        }
        0
    }

    /// Intersects the packets that list a leaf with it, and removes it from their lists. Reports whether any ray
    /// crosses it.
    fn enter_leaf(&mut self, cells: &Cells, leaf: BinnedLeaf, lists: &mut [&[BinnedLeaf]]) -> bool {
        let region = &cells.cell(leaf.cell).region;
        let mut is_crossed = false;
        for (list, bundled) in lists.iter_mut().zip(&mut self.bundle) {
            bundled.crossing = 0;
            let Some((_, others)) = list
                .split_first()
                .filter(|(first, _)| first.cell == leaf.cell)
            else {
                continue;
            };
            *list = others;
            if cells.may_be_discontinuous() {
                // Beyond a discontinuity no sphere around a point is known to be empty.
                bundled.packet.clear_to = F32x64([f32::NEG_INFINITY; LANES]);
            }
            let crossings = intersect_box(region, &mut bundled.packet);
            self.visits[0] += 1;
            if crossings.farthest < leaf.min_ray_t {
                *list = &[];
            } else if crossings.lanes != 0 {
                self.visits[1] += 1;
                bundled.crossing = crossings.lanes;
                is_crossed = true;
            }
        }
        is_crossed
    }

    /// Finds the side of the surface on which the rays of a packet start, before any goes through a leaf. Their
    /// origin may lie on the face between two leaves.
    fn find_sides(
        &mut self,
        cells: &Cells,
        number: usize,
        lanes: usize,
        evaluator: &mut dyn Evaluator,
    ) {
        let mut previous: Option<([f32; 3], f32)> = None;
        for lane in 0..lanes {
            let p = &self.bundle[number].packet;
            if p.begin_t.0[lane] > 0.0 {
                continue;
            }
            let origin = [p.origin_x.0[lane], p.origin_y.0[lane], p.origin_z.0[lane]];
            let side = match previous {
                Some((previous_origin, side)) if previous_origin == origin => side,
                _ => self.side_at(cells, origin, evaluator),
            };
            previous = Some((origin, side));
            self.bundle[number].packet.side.0[lane] = side;
        }
    }

    /// Returns −1 for a point inside the solid, else 1.
    fn side_at(&mut self, cells: &Cells, point: [f32; 3], evaluator: &mut dyn Evaluator) -> f32 {
        match cells.occupancy_at(point) {
            Occupancy::Full => -1.0,
            Occupancy::Empty => 1.0,
            Occupancy::Leaf(cell) => {
                for (column, v) in self.points.iter_mut().zip(point) {
                    column.0.fill(v);
                }
                evaluator.distances_in_cell(cell, &self.points, 1, &mut self.values);
                if self.values.0[0] < 0.0 { -1.0 } else { 1.0 }
            }
        }
    }

    /// Ends rays of a packet that meet no surface at all. The bounding box of an axis-aligned ray is the ray itself,
    /// and faces often run along all of it.
    fn cull_axis_aligned(
        &mut self,
        root: &Cell,
        number: usize,
        lanes: usize,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let p = &mut self.bundle[number].packet;
        p.entry_t = p.begin_t;
        p.exit_t = p.end_t;
        let mut count = 0;
        for lane in 0..lanes {
            let p = &self.bundle[number].packet;
            if p.entry_t.0[lane] <= p.exit_t.0[lane] {
                self.collect_lane([number, lane], count);
                count += 1;
            }
        }
        self.begin_group();
        bound_directions(root, &mut self.leaf_rays);
        let evaluations = self.cull_by_interval(0, count, evaluator);
        for slot in 0..count {
            if self.leaf_rays.outcome.0[slot] == outcome::EXITED {
                let [number, lane] = ray_of_slot(self.leaf_rays.lane.0[slot]);
                self.bundle[number].packet.end_t.0[lane] = f32::NEG_INFINITY;
            }
        }
        evaluations
    }
}

/// Returns the nearest of the first leaves of some lists.
fn nearest_leaf(lists: &[&[BinnedLeaf]]) -> Option<BinnedLeaf> {
    let first = lists.iter().filter_map(|list| list.first().copied());
    first.reduce(|nearest, leaf| {
        let order = nearest.min_ray_t.total_cmp(&leaf.min_ray_t);
        match order.then(nearest.cell.cmp(&leaf.cell)) {
            Ordering::Greater => leaf,
            Ordering::Less | Ordering::Equal => nearest,
        }
    })
}

/// Stores the ends of the rays of a packet.
fn store_results(
    bundled: &BundledPacket,
    items: &[u32],
    (rays, points, leaves): (&mut [RayState], &mut [V3<f32>], &mut [u32]),
) {
    let p = &bundled.packet;
    for (lane, &item) in items.iter().enumerate() {
        let ray = &mut rays[item as usize];
        ray.steps = p.steps.0[lane] as u32;
        leaves[item as usize] = bundled.hit_leaves[lane];
        if p.side.0[lane] < 0.0 {
            ray.status |= FROM_INSIDE;
        }
        if ray.status & SHOWN == 0 {
            continue;
        }
        let (origin, direction) = lane_ray!(p, lane);
        points[item as usize] = camera::point_along::<f32>(origin, direction, ray.t);
    }
}
