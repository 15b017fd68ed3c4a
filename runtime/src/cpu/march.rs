//! The stage `march`: rays advance to the surface.

use super::camera_rays::CameraRay;
use super::proved_steps::{is_between, plan_sample, proves_part_of_step, sample_step};
use super::ray_tasks::{ColumnChoice, RayTask, is_nan, lane_ray, lanes, set_lane_ray, store_point};
use super::{F32x64, LANES, Points};
use crate::render::ray::vector;
use sdfc_shaders::layout::{Beam, FrameUniforms, RayState};
use sdfc_shaders::marching::{self, FROM_INSIDE, Status};
use sdfc_shaders::{beam, camera};
use sdfc_vm::real::Real;

lanes! {
    /// Rays under way.
    MarchLanes {
        origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, exit_t, crowd_enter, crowd_exit, plane_t,
        t, field, step, trend, t_before, field_before, side, steps, outcome, sample_t,
    }
}

/// State of a ray after a step.
pub(super) mod outcome {
    use sdfc_shaders::marching::{SHOWN, Status};

    pub(in crate::cpu) const ACTIVE: f32 = 0.0;
    pub(in crate::cpu) const HIT: f32 = 1.0;
    pub(in crate::cpu) const EXITED: f32 = 2.0;
    pub(in crate::cpu) const STEP_CAP: f32 = 3.0;
    pub(in crate::cpu) const NEAR_SURFACE: f32 = 4.0;
    pub(in crate::cpu) const NOT_A_NUMBER: f32 = 5.0;

    /// Returns the status bits of a ray that ends with this outcome.
    pub(in crate::cpu) fn status(outcome: f32) -> u32 {
        match outcome {
            HIT => Status::Hit as u32 | SHOWN,
            ACTIVE => Status::Active as u32,
            EXITED => Status::Miss as u32,
            NEAR_SURFACE => Status::StepCap as u32 | SHOWN,
            NOT_A_NUMBER => Status::NotANumber as u32,
            _ => Status::StepCap as u32,
        }
    }
}

/// Returns the side of the surface, given that of the previous step. A ray that starts where the field is
/// below zero sees the surface from inside.
#[inline(always)]
pub(super) fn initial_side(steps: f32, t: f32, distance: f32, side: f32) -> f32 {
    let inside = (steps == 0.0) & (t == 0.0) & (distance < 0.0);
    if inside { -1.0 } else { side }
}

/// Reports by 1 or 0 whether the ray in a lane of a block with the columns of a march takes a probe.
macro_rules! takes_probe {
    ($frame:expr, $block:ident, $i:ident) => {
        marching::takes_probe(
            $block.t.0[$i],
            $block.field.0[$i],
            $block.step.0[$i],
            $block.trend.0[$i],
            $block.field_before.0[$i],
            $frame.rounding,
        )
    };
}
pub(super) use takes_probe;

/// Returns the point of the next sample of the ray in a lane of such a block, `$step` beyond the last one. The field is
/// known from `$low` to `$high`.
macro_rules! next_point {
    ($frame:expr, $block:ident, $i:ident, $step:expr, $low:expr, $high:expr) => {{
        let (origin, direction) = lane_ray!($block, $i);
        let (t, step): (f32, f32) = ($block.t.0[$i], $step);
        let half = camera::half_pixel(t + step, $frame.half_pixel_size, $frame.half_pixel_growth);
        marching::sample_point::<f32>(
            origin,
            direction,
            t,
            step,
            $block.trend.0[$i],
            takes_probe!($frame, $block, $i),
            $low,
            $high,
            half,
            $frame.rounding,
        )
    }};
}
pub(super) use next_point;

/// Takes the step of the ray in a lane of a block with the columns of a march. `$distance` is the field's
/// value at the ray, and times `$factor` it has a slope of one. `$choice` is a [`ColumnChoice`]. `$decide`
/// computes the outcome from the next state and the outcome by the number of steps.
macro_rules! step_lane {
    (
        $frame:expr, $choice:ident, $block:ident, $i:ident, $distance:expr, $factor:expr, $crowd:expr,
        |$next:ident, $out:ident| $decide:expr
    ) => {{
        let distance: f32 = $distance;
        let t = $block.t.0[$i] + $block.step.0[$i];
        let steps = $block.steps.0[$i] + 1.0;
        let side = $crate::cpu::march::initial_side(
            $block.steps.0[$i],
            t,
            distance,
            $choice.hide($block.side.0[$i]),
        );
        let half = camera::half_pixel(t, $frame.half_pixel_size, $frame.half_pixel_growth);
        let threshold = marching::threshold(t, half, $frame.threshold_fraction, $frame.rounding);
        let (origin, direction) = lane_ray!($block, $i);
        let point = camera::point_along::<f32>(origin, direction, t);
        let rounding = marching::rounding_at(t, $frame.rounding);
        let value_rounding = marching::rounding_near::<f32>(point, rounding, $frame.least_rounding);
        let $next = marching::march_step(
            $choice.hide($block.t.0[$i]),
            $choice.hide($block.field.0[$i]),
            $choice.hide($block.step.0[$i]),
            $choice.hide($block.trend.0[$i]),
            $choice.hide($block.t_before.0[$i]),
            $choice.hide($block.field_before.0[$i]),
            distance * side * $factor,
            steps,
            threshold,
            half,
            $frame.relaxation,
            rounding,
            value_rounding,
            $frame.is_raw,
            $block.exit_t.0[$i],
            $crowd[0],
            $crowd[1],
            $crowd[2],
            takes_probe!($frame, $block, $i),
        );
        let is_near_surface = marching::accept_at_step_cap(
            $next.t,
            $next.field,
            $next.trend,
            $next.t_before,
            $next.field_before,
            half.max(threshold),
            $block.exit_t.0[$i],
        ) > 0.0;
        let capped = if is_near_surface {
            outcome::NEAR_SURFACE
        } else {
            outcome::STEP_CAP
        };
        let $out = if steps >= $frame.max_steps as f32 {
            capped
        } else {
            outcome::ACTIVE
        };
        let out = $decide;
        let out = if is_nan(distance) {
            outcome::NOT_A_NUMBER
        } else {
            out
        };
        $block.t.0[$i] = $next.t;
        $block.field.0[$i] = $next.field;
        $block.step.0[$i] = $next.step;
        $block.trend.0[$i] = $next.trend;
        $block.t_before.0[$i] = $next.t_before;
        $block.field_before.0[$i] = $next.field_before;
        $block.side.0[$i] = side;
        $block.steps.0[$i] = steps;
        $block.outcome.0[$i] = out;
    }};
}
pub(super) use step_lane;

/// Rays through pixels: items are indices in the tile. With `PROVES`, samples on each step prove that there is no surface.
pub(super) struct March<'a, const PROVES: bool> {
    pub(super) frame: &'a FrameUniforms,
    pub(super) camera_rays: &'a [CameraRay],
    pub(super) rays: &'a mut [RayState],
    /// Distance that the rays of each block can advance together, number of blocks in a row, and number of
    /// pixels in a row.
    pub(super) beams: &'a [Beam],
    pub(super) columns: u32,
    pub(super) width: u32,
    /// Number of steps after which rays stay under way.
    pub(super) max_steps: u32,
    /// Set if rays continue from their stored states.
    pub(super) are_under_way: bool,
}

impl<const PROVES: bool> RayTask for March<'_, PROVES> {
    type Block = MarchLanes;

    fn begin(&mut self, item: u32, block: &mut MarchLanes, lane: usize) -> bool {
        let CameraRay {
            origin,
            direction,
            enter,
            exit,
            crowd,
            plane_t,
            ..
        } = self.camera_rays[item as usize];
        let [x, y] = [item % self.width, item / self.width].map(|pixel| pixel / beam::BLOCK_SIDE);
        let beam = &self.beams[(y * self.columns + x) as usize];
        let start = Real::max(enter, beam.t);
        let ray = &mut self.rays[item as usize];
        if !self.are_under_way {
            *ray = RayState {
                t: start,
                trend: -1.0,
                t_before: start,
                ..RayState::default()
            };
            if exit < start {
                ray.status = Status::Miss as u32;
                return false;
            }
        }
        set_lane_ray!(block, lane, origin, direction);
        block.exit_t.0[lane] = exit;
        [block.crowd_enter.0[lane], block.crowd_exit.0[lane]] = crowd;
        block.plane_t.0[lane] = plane_t;
        block.t.0[lane] = ray.t;
        block.sample_t.0[lane] = ray.t;
        block.field.0[lane] = ray.field;
        block.step.0[lane] = ray.step;
        block.trend.0[lane] = ray.trend;
        block.t_before.0[lane] = ray.t_before;
        block.field_before.0[lane] = ray.field_before;
        block.side.0[lane] = match ray.status & FROM_INSIDE {
            0 => 1.0,
            _ => -1.0,
        };
        block.steps.0[lane] = ray.steps as f32;
        true
    }

    #[inline(always)]
    fn points(&self, block: &MarchLanes, points: &mut Points) {
        let frame = self.frame;
        let (low, high) = (vector(frame.bounds_min), vector(frame.bounds_max));
        for i in 0..LANES {
            let step = match PROVES {
                true => sample_step!(frame, block, i),
                false => block.step.0[i],
            };
            store_point(points, i, next_point!(frame, block, i, step, low, high));
        }
    }

    #[inline(always)]
    fn advance(&self, block: &mut MarchLanes, values: &F32x64, ended: &mut [bool; LANES]) {
        let frame = self.frame;
        let choice = ColumnChoice::new();
        for i in 0..LANES {
            if PROVES && proves_part_of_step!(frame, block, i, values.0[i], 1.0) {
                block.outcome.0[i] = outcome::ACTIVE;
                continue;
            }
            let crowd = [
                block.crowd_enter.0[i],
                block.crowd_exit.0[i],
                block.plane_t.0[i],
            ];
            step_lane!(
                frame,
                choice,
                block,
                i,
                values.0[i],
                1.0,
                crowd,
                |next, out| {
                    let out = if next.arrived > 0.0 {
                        outcome::HIT
                    } else {
                        out
                    };
                    if next.t > block.exit_t.0[i] {
                        outcome::EXITED
                    } else {
                        out
                    }
                }
            );
            if PROVES {
                plan_sample!(frame, block, i, 1.0);
            }
        }
        let max_steps = self.max_steps as f32;
        for ((ended, &out), &steps) in ended.iter_mut().zip(&block.outcome.0).zip(&block.steps.0) {
            *ended = (out != outcome::ACTIVE) | (steps >= max_steps);
        }
    }

    fn end(&mut self, item: u32, block: &MarchLanes, lane: usize) {
        let status = outcome::status(block.outcome.0[lane]);
        self.rays[item as usize] = RayState {
            t: block.t.0[lane],
            field: block.field.0[lane],
            step: block.step.0[lane],
            trend: block.trend.0[lane],
            t_before: block.t_before.0[lane],
            field_before: block.field_before.0[lane],
            status: status
                | if block.side.0[lane] < 0.0 {
                    FROM_INSIDE
                } else {
                    0
                },
            steps: block.steps.0[lane] as u32,
        };
    }
}
