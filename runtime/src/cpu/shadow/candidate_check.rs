//! The check of an occluder candidate of a shadow ray, a surface beside the ray, by the phases of
//! [`candidate`].

use super::{
    F32x64, LightParams, SIZED, ShadowLanes, lane_axis, lane_direction, lane_face, lane_gradient,
    lane_offset, lane_size, round_point, set_face,
};
use crate::cpu::probe_turns::{is_probe, is_start};
use sdfc_shaders::{candidate, shadow};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

impl<const FORM: u32> LightParams<'_, FORM> {
    /// Advances the check of a candidate by an evaluation. Reports whether the ray gives up, out of steps,
    /// and whether it is done after the check. With `PROBES` only a probe advances, else only the phases before.
    #[inline(always)]
    pub(super) fn step_check<const PROBES: bool>(
        self,
        block: &mut ShadowLanes,
        i: usize,
        field: f32,
    ) -> (bool, bool) {
        let hidden = |column: &F32x64| self.choice.hide(column.0[i]);
        let (phase, value) = (hidden(&block.phase), hidden(&block.value));
        let out_of_steps = self.steps_of_ray(block, i) >= self.max_steps;
        let size = lane_size::<FORM>(block, i, self.size);
        let (point, offset) = (round_point(block, i), lane_offset(block, i));
        let (face, gradient) = (lane_face(block, i), lane_gradient(block, i));
        let limit = shadow::candidate_limit(block.candidate_t.0[i], size);
        let is_probe_phase = PROBES & is_probe(phase);
        let is_start = !PROBES & is_start(phase);
        let is_tap = !PROBES & !is_probe(phase) & !is_start;

        let tap_distance = candidate::tap_distance::<f32>(value, point, limit);
        let new_gradient = candidate::add_tap::<f32>(gradient, phase, field - value, tap_distance);
        let next =
            candidate::next_offset::<f32>(point, offset, face, phase, value, gradient, limit);
        let is_first = is_probe_phase & (block.round.0[i] + block.moves.0[i] < 0.5);
        let next_check_t = hidden(&block.next_check_t);
        let ends_after_check = next_check_t >= shadow::NO_NEXT_CHECK;
        block.next_check_t.0[i] = self.choice.choose(
            is_first & self.checks_all() & !ends_after_check,
            shadow::next_check_t::<f32>(
                block.candidate_t.0[i],
                value,
                gradient,
                size,
                block.exit_t.0[i],
            ),
            next_check_t,
        );
        let outcome = candidate::probe_outcome::<f32>(
            point,
            gradient,
            block.round.0[i],
            phase,
            value,
            field,
            offset,
            face,
            next,
            limit,
        );
        let is_repeat = is_probe_phase & (outcome == 0.0);
        let goes_back = is_probe_phase & (outcome > candidate::MIN_PHASE_OUTCOME);
        let is_found = is_probe_phase & (outcome == 1.0);
        let is_misled = is_found & (block.round.0[i] > 0.0);

        let surface_offset = candidate::surface_offset::<f32>(offset, next, value, field);
        let (t, v) = (hidden(&block.candidate_t), hidden(&block.visibility));
        let direction = lane_direction(block, i);
        let (visibility, light_t) =
            self.probed_visibility(block, i, [v, value], [surface_offset, gradient]);
        let choose = |changes: bool, new: f32, old: f32| self.choice.choose(changes, new, old);
        let hides_most_at_end =
            shadow::hides_most_at_end::<f32>(surface_offset, gradient, direction, light_t - t);
        let is_deferred = self.checks_all() & !ends_after_check & (hides_most_at_end > 0.0);
        let visibility = choose(is_deferred, v, visibility);
        block.visibility.0[i] = choose(is_found, visibility, v);
        let (round, moves) = (hidden(&block.round), hidden(&block.moves));
        let moved_t = shadow::moved_candidate_t::<f32>(
            surface_offset,
            gradient,
            direction,
            t,
            light_t,
            size,
            value,
            round,
            moves,
            v - visibility,
        );
        let plane_offset = shadow::plane_offset::<f32>(surface_offset, gradient, direction);
        let is_dark = self.is_dark(block, i);
        let is_moving = is_found & (moved_t > 0.0) & !is_dark;
        // After a detour the next move counts as a detour, too.
        let is_detour = is_moving & is_misled;
        let is_offset = offset.dot(offset) > 0.0;
        let bound = shadow::candidate_bound(v, block.ray_number.0[i]);
        let cannot_darken =
            is_start & !is_offset & (shadow::cannot_darken::<f32>(field, t, size, bound) > 0.0);
        let is_done = is_probe_phase & !is_repeat & !goes_back & !is_moving;
        let earlier_t = shadow::earlier_candidate_t(t, size, moves, next.dot(direction));
        let is_returning = is_done & !is_found & (earlier_t > 0.0) & !self.checks_all();
        let is_finished = cannot_darken | (is_done & !is_returning);
        let is_restart = is_finished | is_returning;

        let restart_value = candidate::restart_value::<f32>(field);
        let kept_value = choose(is_repeat, restart_value, value);
        block.value.0[i] = choose(is_start, field, kept_value);
        let zero = V3::splat(0.0);
        let forgets = is_repeat | is_moving | is_restart;
        let gradient_part = |new: f32, old: f32| choose(is_tap, new, choose(forgets, 0.0, old));
        block.gradient_x.0[i] = gradient_part(new_gradient.x, gradient.x);
        block.gradient_y.0[i] = gradient_part(new_gradient.y, gradient.y);
        block.gradient_z.0[i] = gradient_part(new_gradient.z, gradient.z);
        let kept_offset = if is_moving | is_restart { zero } else { offset };
        let kept_offset = if is_detour { plane_offset } else { kept_offset };
        let kept_face = if is_moving | is_restart { zero } else { face };
        let reaches_face = is_repeat | is_detour;
        set_face(block, i, if reaches_face { gradient } else { kept_face });
        block.offset_x.0[i] = choose(is_repeat, next.x, kept_offset.x);
        block.offset_y.0[i] = choose(is_repeat, next.y, kept_offset.y);
        block.offset_z.0[i] = choose(is_repeat, next.z, kept_offset.z);
        let later_phase = if goes_back { outcome } else { phase };
        let next_phase = if is_tap { phase + 1.0 } else { later_phase };
        let next_phase = if is_start | is_repeat {
            1.0
        } else {
            next_phase
        };
        let next_phase = if is_moving | is_returning {
            candidate::MOVED_PHASE
        } else {
            next_phase
        };
        block.phase.0[i] = if is_finished { 0.0 } else { next_phase };
        let round = round + if is_repeat { 1.0 } else { 0.0 };
        let round = if is_restart { 0.0 } else { round };
        block.round.0[i] = if is_detour { 1.0 } else { round };
        let kept_moves = if is_moving | is_returning {
            moves + 1.0
        } else {
            moves
        };
        block.moves.0[i] = if is_finished { 0.0 } else { kept_moves };
        let kept_t = choose(is_returning, earlier_t, t);
        let kept_t = choose(is_moving, moved_t, kept_t);
        block.candidate_t.0[i] = choose(is_finished, shadow::NO_CANDIDATE, kept_t);
        // Where the field led nowhere, or by a detour, the next point may be a candidate that is farther
        // away.
        let lost_track = is_done & (!is_found | is_misled);
        block.last_visibility.0[i] = choose(
            lost_track,
            shadow::NO_LAST_VISIBILITY,
            block.last_visibility.0[i],
        );
        let is_last = is_finished & (ends_after_check | is_dark | out_of_steps);
        (!is_finished & out_of_steps, is_last)
    }

    /// Returns the number of steps of the current ray in a lane.
    #[inline(always)]
    fn steps_of_ray(self, block: &ShadowLanes, i: usize) -> f32 {
        match FORM {
            SIZED => block.steps.0[i] - block.steps_before.0[i],
            _ => block.steps.0[i],
        }
    }

    /// Returns the visibility of a ray after a probe, with the distance to the light or to the plane of its rim. The probe
    /// began at a candidate's `value` and found a surface at an offset.
    #[inline(always)]
    fn probed_visibility(
        self,
        block: &ShadowLanes,
        i: usize,
        [visibility, value]: [f32; 2],
        [surface_offset, gradient]: [V3<f32>; 2],
    ) -> (f32, f32) {
        let direction = lane_direction(block, i);
        let t = self.choice.hide(block.candidate_t.0[i]);
        let size = lane_size::<FORM>(block, i, self.size);
        // At the light, not at the exit from the bounds: light does not depend on these.
        let light_t = block.light_t.0[i];
        if FORM == SIZED && block.ray_number.0[i] > 0.0 {
            let axis = lane_axis(block, i);
            let plane_t = shadow::light_plane_t::<f32>(direction, axis, light_t);
            let rim_visibility = shadow::rim_visibility_beside::<f32>(
                visibility,
                surface_offset,
                direction,
                axis,
                t,
                size,
                plane_t,
            );
            return (rim_visibility, plane_t);
        }
        let grazing_visibility = match FORM {
            SIZED => 0.0,
            _ => shadow::HALF_VISIBILITY,
        };
        let visibility = shadow::visibility_beside::<f32>(
            visibility,
            surface_offset,
            gradient,
            direction,
            t,
            size,
            value,
            self.choice.hide(block.round.0[i]),
            light_t,
            grazing_visibility,
        );
        (visibility, light_t)
    }

    /// Reports whether the current ray sees nothing more of the light. The ray to the centre of a light with
    /// a size is followed by others.
    #[inline(always)]
    fn is_dark(self, block: &ShadowLanes, i: usize) -> bool {
        let dark = match FORM {
            SIZED if block.ray_number.0[i] == 0.0 => shadow::MAX_HIDDEN_VISIBILITY,
            SIZED => -1.0,
            _ => 0.0,
        };
        block.visibility.0[i] <= dark
    }
}
