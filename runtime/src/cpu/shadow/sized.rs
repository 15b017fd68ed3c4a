//! Rays towards a light with a size: one to its centre and, if that is hidden, several to its rim.

use super::starts::ray_end;
use super::{
    F32x64, LANES, LightParams, ShadowLanes, any_nonzero, begin_candidate_check, is_nan, lane_axis,
    lane_direction, set_direction,
};
use crate::cpu::ray_tasks::lane_vector;
use sdfc_shaders::{candidate, marching, shadow};

/// Transitions of the lanes' rays after an evaluation: a ray goes on, ends, or begins as a rim ray.
#[derive(Default)]
pub(super) struct RayTransitions {
    /// 0 for a ray that goes on, [`RAY_ENDED`] or [`RIM_RAY_BEGINS`].
    pub(super) kind: F32x64,
    /// Visibility along a ray that has ended, or the light's size for one that begins.
    pub(super) visibility_or_size: F32x64,
}

/// Kind of a ray that has ended.
pub(super) const RAY_ENDED: f32 = 1.0;
/// Kind of a ray to the rim that begins, after the free distance from the light's centre was measured.
const RIM_RAY_BEGINS: f32 = 2.0;

impl<const FORM: u32> LightParams<'_, FORM> {
    /// Advances a ray towards a light with a size by the field's value at its point. Reports whether the
    /// lane's last ray has ended, and returns its entries in [`RayTransitions`].
    #[inline(always)]
    pub(super) fn step_sized(
        self,
        block: &mut ShadowLanes,
        i: usize,
        field: f32,
    ) -> (bool, f32, f32) {
        let (t, ray_number, size) = (block.t.0[i], block.ray_number.0[i], block.size.0[i]);
        let (field_before, last_step) = (block.field_before.0[i], block.step.0[i]);
        let steps = block.steps.0[i] - block.steps_before.0[i];
        let out_of_steps = steps >= self.max_steps;
        let is_over = is_nan(field) | (out_of_steps & (ray_number > 0.0));
        let is_running = !is_over;
        let slope = shadow::slope(field, field_before, last_step);
        let sign_margin = marching::sign_margin(self.rounding_near(block, i), slope, self.is_raw);
        let min_stride = block.min_step.0[i] * shadow::late_speedup(steps);
        let is_inside = field < -sign_margin;
        let is_measuring = size == 0.0;
        let free_stride = shadow::stride(field, t, min_stride, size);
        let short_stride = shadow::short_stride(field, t, min_stride, size);
        let inner_stride = shadow::inner_stride(t, min_stride, size);
        let next = if is_measuring {
            free_stride
        } else {
            short_stride
        };
        let next = if is_inside { inner_stride } else { next };
        let next = shadow::step_to_check(next, t, block.next_check_t.0[i], self.checks);
        let remaining = block.exit_t.0[i] - t;
        let remaining = if remaining > 0.0 { remaining } else { 0.0 };
        let next = if next < remaining { next } else { remaining };
        let is_at_end = (t >= block.exit_t.0[i]) | out_of_steps;

        let has_measured = is_running & is_measuring & (is_inside | is_at_end);
        let room_t = if is_inside { t - last_step } else { t };
        let fitting_size = shadow::size_in_room(room_t, block.light_t.0[i]);
        let begins_rim_ray = has_measured & (fitting_size > 0.0);
        let is_over = is_over | (has_measured & !begins_rim_ray);
        let is_running = is_running & !has_measured;

        let back_step = shadow::step_to_passed_sheet(
            field,
            field_before,
            last_step,
            block.slope_before.0[i],
            sign_margin,
        );
        let is_passed =
            (back_step > 0.0) & (ray_number != shadow::INSIDE_RAY_NUMBER) & !out_of_steps;
        let goes_back = is_running & is_passed;
        let is_running = is_running & !is_passed;
        let next_t = self.choice.choose(is_running, t + next, t);
        let choose = |changes: bool, new: f32, old: f32| self.choice.choose(changes, new, old);
        block.t.0[i] = choose(goes_back, t + back_step - last_step, next_t);
        let step = choose(goes_back, back_step, last_step);
        block.step.0[i] = choose(is_running, next, step);
        let slope_before = choose(goes_back, 0.0, block.slope_before.0[i]);
        block.slope_before.0[i] = choose(is_running, slope, slope_before);
        block.field_before.0[i] = choose(is_running, field, field_before);

        let is_running = is_running & !is_measuring;
        let sample_visibility = shadow::visibility_at(field, t, size);
        let enters_solid = is_running & is_inside & (ray_number < 1.0);
        let new_ray_number = choose(enters_solid, shadow::INSIDE_RAY_NUMBER, ray_number);
        block.ray_number.0[i] = new_ray_number;
        let kept_t = choose(enters_solid, shadow::NO_CANDIDATE, block.candidate_t.0[i]);
        let is_over = is_over | (enters_solid & (sample_visibility <= -1.0));
        let is_running = is_running & !(enters_solid & ((sample_visibility <= -1.0) | !is_at_end));
        let is_blocked = is_running & (is_inside | (new_ray_number == shadow::INSIDE_RAY_NUMBER));
        let is_running = is_running & !is_blocked;

        let clear_t = shadow::clear_until(block.clear_t.0[i], field, t, size, self.checks);
        let is_central = is_running & (ray_number == 0.0);
        block.clear_t.0[i] = choose(is_central, clear_t, block.clear_t.0[i]);
        let bound = shadow::candidate_bound(block.visibility.0[i], ray_number);
        let is_lower = shadow::is_candidate(sample_visibility, block.last_visibility.0[i], bound);
        let next_check_t = block.next_check_t.0[i];
        let is_checked = shadow::is_checked(is_lower, t, next_check_t, self.checks);
        let is_candidate = is_running & (is_checked > 0.0);
        let last_visibility = shadow::last_visibility(sample_visibility, self.checks);
        block.last_visibility.0[i] =
            choose(is_running, last_visibility, block.last_visibility.0[i]);
        let candidate_t = choose(is_candidate, t, kept_t);
        block.candidate_t.0[i] = candidate_t;
        block.value.0[i] = choose(
            is_candidate,
            candidate::restart_value::<f32>(field),
            block.value.0[i],
        );
        let begins_check = is_running
            & (!is_candidate | is_at_end | self.checks_all())
            & (candidate_t > 0.0)
            & !out_of_steps;
        begin_candidate_check(self.choice, block, i, begins_check, is_at_end);
        let is_ended = is_running & !begins_check & is_at_end;
        let visibility = choose(is_blocked, -1.0, block.visibility.0[i]);
        let visibility_or_size = choose(begins_rim_ray, fitting_size.min(self.size), visibility);
        let kind = choose(is_blocked | is_ended, RAY_ENDED, 0.0);
        let kind = choose(begins_rim_ray, RIM_RAY_BEGINS, kind);
        (is_over, kind, visibility_or_size)
    }

    /// Begins the next rays of the lanes in which one has ended; sets `ended` where that was the last one.
    pub(super) fn begin_next_rays(
        self,
        block: &mut ShadowLanes,
        transitions: &RayTransitions,
        ended: &mut [bool; LANES],
    ) {
        if !any_nonzero(&transitions.kind) {
            return;
        }
        for (i, ended) in ended.iter_mut().enumerate() {
            let visibility_or_size = transitions.visibility_or_size.0[i];
            if transitions.kind.0[i] == RAY_ENDED {
                *ended |= self.end_ray(block, i, visibility_or_size);
            } else if transitions.kind.0[i] == RIM_RAY_BEGINS {
                self.begin_rim(block, i, visibility_or_size);
            }
        }
    }

    /// Ends a ray towards a light with a size, given the visibility along it. If the centre is hidden, rays
    /// to the rim follow. Reports whether that was the last one.
    fn end_ray(self, block: &mut ShadowLanes, i: usize, visibility: f32) -> bool {
        let ray_number = block.ray_number.0[i];
        if ray_number == 0.0 && visibility > shadow::MAX_HIDDEN_VISIBILITY {
            return true;
        }
        let is_rim = ray_number >= 1.0;
        let best_visibility =
            block.best_visibility.0[i].max(if is_rim { visibility } else { -1.0 });
        let next_ray_number = ray_number.floor() + 1.0;
        block.ray_number.0[i] = next_ray_number;
        block.best_visibility.0[i] = best_visibility;
        let is_hidden = next_ray_number > shadow::FIRST_RIM_RAYS && best_visibility <= -1.0;
        if is_hidden || best_visibility >= 0.0 || next_ray_number > shadow::RIM_RAYS {
            return true;
        }
        let rim = shadow::rim_direction::<f32>(lane_axis(block, i), next_ray_number);
        set_direction(block, i, rim);
        if self.is_positional == 0.0 {
            self.begin_rim(block, i, self.size);
            return false;
        }
        block.size.0[i] = 0.0;
        block.t.0[i] = 0.0;
        block.sample_t.0[i] = 0.0;
        block.exit_t.0[i] = shadow::required_room(block.light_t.0[i], self.size);
        block.steps_before.0[i] = block.steps.0[i];
        block.field_before.0[i] = 0.0;
        block.step.0[i] = 0.0;
        block.slope_before.0[i] = 0.0;
        block.candidate_t.0[i] = shadow::NO_CANDIDATE;
        false
    }

    /// Begins a ray to the rim of a light, which has the `size` on that side. The lane's direction is that of
    /// the rim from the light's centre.
    fn begin_rim(self, block: &mut ShadowLanes, i: usize, size: f32) {
        let axis = lane_axis(block, i);
        let direction = shadow::rim_ray_direction::<f32>(axis, lane_direction(block, i), size);
        let light_t = shadow::light_plane_t::<f32>(direction, axis, block.light_t.0[i]);
        let start = lane_vector!(block, i, start_x, start_y, start_z);
        let exit_t = ray_end(self.frame, start, direction, light_t, size);
        set_direction(block, i, direction);
        block.size.0[i] = size;
        block.exit_t.0[i] = exit_t;
        block.steps_before.0[i] = block.steps.0[i];
        block.t.0[i] = block.clear_t.0[i].abs();
        block.sample_t.0[i] = block.t.0[i];
        block.field_before.0[i] = 0.0;
        block.step.0[i] = 0.0;
        block.slope_before.0[i] = 0.0;
        block.visibility.0[i] = 0.0;
        block.next_check_t.0[i] = 0.0;
        block.last_visibility.0[i] = shadow::NO_LAST_VISIBILITY;
        block.candidate_t.0[i] = shadow::NO_CANDIDATE;
    }
}
