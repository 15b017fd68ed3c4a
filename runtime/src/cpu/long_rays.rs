//! Marches without cells, interrupted for rays with many steps: where intervals exclude a surface on all that remains of
//! a ray, it ends.
//!
//! Such rays run along a floor, above it or inside of it, and never come nearer. Bounds over the box around a ray are
//! tight where it is parallel to an axis.

use super::camera_rays::CameraRay;
use super::march::March;
use super::ray_tasks::run_streamed;
use super::{AabbLanes, Evaluator, LANES, RangeLanes};
use crate::cells::Aabb;
use sdfc_shaders::camera;
use sdfc_shaders::layout::{Beam, FrameUniforms, RayState};
use sdfc_shaders::marching::{FROM_INSIDE, Status};
use sdfc_vm::vector::V3;

/// Numbers of steps after which rays are interrupted.
const INTERRUPTIONS: [u32; 2] = [256, 1024];

/// Rays of a tile.
pub(super) struct LongRays<'a> {
    pub(super) frame: &'a FrameUniforms,
    pub(super) camera_rays: &'a [CameraRay],
    pub(super) rays: &'a mut [RayState],
    pub(super) beams: &'a [Beam],
    pub(super) columns: u32,
    pub(super) width: u32,
}

impl LongRays<'_> {
    /// Marches rays through the whole field, each block from the end of its beam. Returns the number of evaluations.
    pub(super) fn march(mut self, items: &[u32], evaluator: &mut dyn Evaluator) -> u64 {
        let mut evaluations = self.march_up_to(INTERRUPTIONS[0], false, items, evaluator);
        let mut items = items.to_vec();
        let later = INTERRUPTIONS[1..].iter().copied().chain([u32::MAX]);
        for max_steps in later {
            items.retain(|&item| self.rays[item as usize].status & !FROM_INSIDE == 0);
            evaluations += self.end_clear(&items, evaluator);
            items.retain(|&item| self.rays[item as usize].status & !FROM_INSIDE == 0);
            if items.is_empty() {
                break;
            }
            evaluations += self.march_up_to(max_steps, true, &items, evaluator);
        }
        evaluations
    }

    fn march_up_to(
        &mut self,
        max_steps: u32,
        are_under_way: bool,
        items: &[u32],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let mut task = March {
            frame: self.frame,
            camera_rays: self.camera_rays,
            rays: self.rays,
            beams: self.beams,
            columns: self.columns,
            width: self.width,
            max_steps,
            are_under_way,
        };
        run_streamed(&mut task, evaluator, items)
    }

    /// Ends the rays on whose rest the field cannot change its sign. Returns the number of evaluations.
    fn end_clear(&mut self, items: &[u32], evaluator: &mut dyn Evaluator) -> u64 {
        let mut evaluations = 0;
        let mut boxes = AabbLanes::default();
        let mut ranges = RangeLanes::default();
        for items in items.chunks(LANES) {
            for (lane, &item) in items.iter().enumerate() {
                let CameraRay {
                    origin,
                    direction,
                    exit,
                    ..
                } = self.camera_rays[item as usize];
                let from =
                    camera::point_along::<f32>(origin, direction, self.rays[item as usize].t);
                let to = camera::point_along::<f32>(origin, direction, exit);
                // Rounding keeps the order of points along a ray, so the box of its ends contains those between them.
                Aabb::around([from, to].map(V3::to_array).into_iter()).write_lane(&mut boxes, lane);
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
