//! Marches without cells, interrupted for rays with many steps: where intervals exclude a surface on all that remains of
//! a ray, it ends.
//!
//! Such rays run along a floor, above it or inside of it, and never come nearer. Bounds over the box around a ray are
//! tight where it is parallel to an axis.

use super::march::March;
use super::ray_tasks::run_streamed;
use super::{AabbLanes, Evaluator, LANES, RangeLanes};
use crate::cells::Aabb;
use sdfc_shaders::camera;
use sdfc_shaders::marching::{FROM_INSIDE, Status};
use sdfc_vm::vector::V3;

/// Numbers of steps after which rays are interrupted.
const INTERRUPTIONS: [u32; 2] = [256, 1024];

impl<const PROVES: bool> March<'_, PROVES> {
    /// Marches rays to their ends. Returns the number of evaluations.
    pub(super) fn run(mut self, items: &[u32], evaluator: &mut dyn Evaluator) -> u64 {
        self.max_steps = INTERRUPTIONS[0];
        let mut evaluations = run_streamed(&mut self, evaluator, items);
        let mut items = items.to_vec();
        self.are_under_way = true;
        for max_steps in INTERRUPTIONS[1..].iter().copied().chain([u32::MAX]) {
            items.retain(|&item| self.is_under_way(item));
            evaluations += self.end_clear(&items, evaluator);
            items.retain(|&item| self.is_under_way(item));
            if items.is_empty() {
                break;
            }
            self.max_steps = max_steps;
            evaluations += run_streamed(&mut self, evaluator, &items);
        }
        evaluations
    }

    fn is_under_way(&self, item: u32) -> bool {
        self.rays[item as usize].status & !FROM_INSIDE == Status::Active as u32
    }

    /// Ends the rays on whose rest the field cannot change its sign. Returns the number of evaluations.
    fn end_clear(&mut self, items: &[u32], evaluator: &mut dyn Evaluator) -> u64 {
        let mut evaluations = 0;
        let mut boxes = AabbLanes::default();
        let mut ranges = RangeLanes::default();
        for items in items.chunks(LANES) {
            for (lane, &item) in items.iter().enumerate() {
                let ray = &self.camera_rays[item as usize];
                // Rounding keeps the order of points along a ray, so the box of its ends contains those between them.
                let ends = [self.rays[item as usize].t, ray.exit]
                    .map(|t| camera::point_along::<f32>(ray.origin, ray.direction, t));
                Aabb::around(ends.map(V3::to_array).into_iter()).write_lane(&mut boxes, lane);
            }
            if !evaluator.ranges(&boxes, items.len(), &mut ranges) {
                break;
            }
            evaluations += items.len() as u64;
            for (lane, &item) in items.iter().enumerate() {
                let ray = &mut self.rays[item as usize];
                let is_clear = match ray.status & FROM_INSIDE {
                    0 => ranges[0].0[lane] > 0.0,
                    _ => ranges[1].0[lane] < 0.0,
                };
                if is_clear {
                    ray.status |= Status::Miss as u32;
                }
            }
        }
        evaluations
    }
}
