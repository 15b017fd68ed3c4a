//! The stage `shadow`: visibility of a light from surfaces.

mod candidate_check;
mod sized;
mod starts;

use super::probe_turns::{is_probe, probes_next, waiting_lanes};
use super::ray_tasks::{
    ColumnChoice, RayTask, any_nonzero, is_nan, lane_vector, lanes, run_streamed, set_lane_vector,
    store_point,
};
use super::tile::Tile;
use super::{Evaluator, F32x64, LANES, Points};
use sdfc_shaders::features::ShadowForm;
use starts::{ShadowCaster, ShadowRayStart, ray_starts};

use sdfc_shaders::layout::{FrameUniforms, LightRecord};
use sdfc_shaders::{camera, candidate, marching, shadow};
use sdfc_vm::vector::V3;

lanes! {
    /// Rays towards a light.
    ShadowLanes {
        start_x, start_y, start_z, direction_x, direction_y, direction_z, exit_t,
        axis_x, axis_y, axis_z, light_t, size, ray_number, best_visibility, clear_t, steps_before,
        t, visibility, steps, min_step, side, rounding, field_before, step, slope_before, last_visibility, candidate_t,
        next_check_t, moves,
        sample_t, value, phase, round, gradient_x, gradient_y, gradient_z, offset_x, offset_y, offset_z, face_x, face_y, face_z,
    }
}

const HARD: u32 = ShadowForm::Hard as u32;
const PLAIN: u32 = ShadowForm::Plain as u32;
const SOFT: u32 = ShadowForm::Soft as u32;
const SIZED: u32 = ShadowForm::Sized as u32;

/// Rays towards a light whose shadow has the form `FORM`: items are indices of the starts.
struct ShadowRays<'a, const FORM: u32> {
    frame: &'a FrameUniforms,
    light: &'a LightRecord,
    starts: &'a [ShadowRayStart],
    light_visibility: &'a mut [f32],
}

/// Computes the fraction of a light that arrives at the shown pixels; returns the number of evaluations.
pub(super) fn cast(
    frame: &FrameUniforms,
    light: &LightRecord,
    light_index: usize,
    form: ShadowForm,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    macro_rules! cast {
        ($form:ident) => {{
            let caster = ShadowCaster {
                light,
                size: if has_penumbra($form) { light.size } else { 0.0 },
                is_sharp: if $form == HARD { 1.0 } else { 0.0 },
            };
            let starts = ray_starts(frame, caster, tile);
            let mut task = ShadowRays::<$form> {
                frame,
                light,
                starts: &starts,
                light_visibility: &mut tile.light_visibility[light_index],
            };
            let items: Vec<u32> = (0..starts.len() as u32).collect();
            run_streamed(&mut task, evaluator, &items)
        }};
    }
    match form {
        ShadowForm::None => {
            tile.light_visibility[light_index].fill(1.0);
            0
        }
        ShadowForm::Hard => cast!(HARD),
        ShadowForm::Plain => cast!(PLAIN),
        ShadowForm::Soft => cast!(SOFT),
        ShadowForm::Sized => cast!(SIZED),
    }
}

impl<const FORM: u32> RayTask for ShadowRays<'_, FORM> {
    type Block = ShadowLanes;

    fn begin(&mut self, item: u32, block: &mut ShadowLanes, lane: usize) -> bool {
        let ShadowRayStart {
            item,
            is_facing,
            origin: start,
            direction,
            start_t,
            exit_t,
            light_t,
            min_step,
            side,
            rounding,
        } = self.starts[item as usize];
        if !is_facing {
            self.light_visibility[item as usize] = 0.0;
            return false;
        }
        set_lane_vector!(block, lane, start_x, start_y, start_z, start);
        set_lane_vector!(
            block,
            lane,
            direction_x,
            direction_y,
            direction_z,
            direction
        );
        block.exit_t.0[lane] = exit_t;
        block.light_t.0[lane] = light_t;
        block.field_before.0[lane] = 0.0;
        block.step.0[lane] = 0.0;
        block.slope_before.0[lane] = 0.0;
        block.t.0[lane] = start_t;
        block.sample_t.0[lane] = start_t;
        block.visibility.0[lane] = 1.0;
        block.steps.0[lane] = 0.0;
        block.min_step.0[lane] = min_step;
        block.side.0[lane] = side;
        block.rounding.0[lane] = rounding;
        if has_penumbra(FORM) {
            block.phase.0[lane] = 0.0;
            block.last_visibility.0[lane] = 1.0;
            block.candidate_t.0[lane] = shadow::NO_CANDIDATE;
            block.moves.0[lane] = 0.0;
            block.next_check_t.0[lane] = 0.0;
        }
        if FORM == SIZED {
            set_lane_vector!(block, lane, axis_x, axis_y, axis_z, direction);
            block.size.0[lane] = self.light.size;
            block.ray_number.0[lane] = 0.0;
            block.best_visibility.0[lane] = -1.0;
            block.clear_t.0[lane] = start_t;
            block.steps_before.0[lane] = 0.0;
        }
        true
    }

    #[inline(always)]
    fn points(&self, block: &ShadowLanes, points: &mut Points) {
        let t = match self.proves_steps() {
            true => &block.sample_t,
            false => &block.t,
        };
        for i in 0..LANES {
            let start = lane_vector!(block, i, start_x, start_y, start_z);
            let direction = lane_vector!(block, i, direction_x, direction_y, direction_z);
            let p = camera::point_along::<f32>(start, direction, t.0[i]);
            store_point(points, i, p);
        }
        if FORM == SIZED && any_nonzero(&block.ray_number) {
            for i in 0..LANES {
                let to_centre = lane_axis(block, i) * block.light_t.0[i];
                let is_measuring = block.size.0[i] == 0.0;
                let add = |to: f32, offset: f32| if is_measuring { to + offset } else { to };
                points[0].0[i] = add(points[0].0[i], to_centre.x);
                points[1].0[i] = add(points[1].0[i], to_centre.y);
                points[2].0[i] = add(points[2].0[i], to_centre.z);
            }
        }
    }

    #[inline(always)]
    fn advance(&self, block: &mut ShadowLanes, values: &F32x64, ended: &mut [bool; LANES]) {
        match self.proves_steps() {
            true => self.advance_with::<true>(block, values, ended),
            false => self.advance_with::<false>(block, values, ended),
        }
    }

    #[inline(always)]
    fn divergent_mask(block: &ShadowLanes) -> Option<&F32x64> {
        has_penumbra(FORM).then_some(&block.phase)
    }

    #[inline(always)]
    fn waiting_lanes(&self, block: &ShadowLanes, is_divergent: bool) -> u64 {
        if is_divergent {
            waiting_lanes(&block.phase)
        } else {
            0
        }
    }

    #[inline(always)]
    fn divergent_points(&self, block: &ShadowLanes, points: &mut Points) {
        match probes_next(&block.phase) {
            true => self.check_points::<true>(block, points),
            false => self.check_points::<false>(block, points),
        }
    }

    #[inline(always)]
    fn advance_divergent(
        &self,
        block: &mut ShadowLanes,
        values: &F32x64,
        ended: &mut [bool; LANES],
    ) {
        match probes_next(&block.phase) {
            true => self.advance_checks::<true>(block, values, ended),
            false => self.advance_checks::<false>(block, values, ended),
        }
    }

    fn end(&mut self, item: u32, block: &ShadowLanes, lane: usize) {
        let visibility = match FORM {
            SIZED if block.ray_number.0[lane] > 0.0 => block.best_visibility.0[lane],
            _ => block.visibility.0[lane],
        };
        self.light_visibility[self.starts[item as usize].item as usize] = match FORM {
            SIZED => shadow::light_fraction_sized(visibility),
            _ => shadow::light_fraction(visibility),
        };
    }
}

impl<const FORM: u32> ShadowRays<'_, FORM> {
    /// Reports whether samples on each step prove that there is no surface.
    #[inline(always)]
    fn proves_steps(&self) -> bool {
        marching::proves_steps(self.frame.step_factor)
    }

    /// Computes the points of checks. With `PROBES` those of probes matter, else those of the phases before.
    #[inline(always)]
    fn check_points<const PROBES: bool>(&self, block: &ShadowLanes, points: &mut Points) {
        for i in 0..LANES {
            let limit = shadow::candidate_limit(
                block.candidate_t.0[i],
                lane_size::<FORM>(block, i, self.light.size),
            );
            let (phase, value) = (block.phase.0[i], block.value.0[i]);
            let point = round_point(block, i);
            let p = if PROBES {
                let (offset, face) = (lane_offset(block, i), lane_face(block, i));
                let gradient = lane_gradient(block, i);
                candidate::probe_point::<f32>(point, offset, face, phase, value, gradient, limit)
            } else {
                candidate::tap_point::<f32>(point, phase, value, limit)
            };
            store_point(points, i, p);
        }
    }

    /// Advances checks. With `PROBES` those in probes advance, else the others.
    #[inline(always)]
    fn advance_checks<const PROBES: bool>(
        &self,
        block: &mut ShadowLanes,
        values: &F32x64,
        ended: &mut [bool; LANES],
    ) {
        let light_params = self.light_params();
        let check_step = if light_params.checks_all() { 0.0 } else { 1.0 };
        let mut transitions = sized::RayTransitions::default();
        for (i, ended) in ended.iter_mut().enumerate() {
            let advances = is_probe(block.phase.0[i]) == PROBES;
            block.steps.0[i] += if advances { check_step } else { 0.0 };
            let field = values.0[i] * block.side.0[i];
            let (is_out_of_steps, is_last) = light_params.step_check::<PROBES>(block, i, field);
            *ended = advances & (is_out_of_steps | is_nan(field) | (is_last & (FORM != SIZED)));
            if FORM == SIZED {
                transitions.kind.0[i] = if is_last { sized::RAY_ENDED } else { 0.0 };
                transitions.visibility_or_size.0[i] = block.visibility.0[i];
            }
        }
        if FORM == SIZED {
            light_params.begin_next_rays(block, &transitions, ended);
        }
    }

    /// Advances rays that are not divergent. With `PROVES`, samples on their steps prove that there is no surface.
    #[inline(always)]
    fn advance_with<const PROVES: bool>(
        &self,
        block: &mut ShadowLanes,
        values: &F32x64,
        ended: &mut [bool; LANES],
    ) {
        // Copied here, since the loop's writes could alias the fields behind a pointer.
        let light_params = self.light_params();
        let mut transitions = sized::RayTransitions::default();
        for (i, ended) in ended.iter_mut().enumerate() {
            let field = values.0[i] * block.side.0[i];
            if PROVES && light_params.proves_part_of_step(block, i, field) {
                *ended = false;
                continue;
            }
            let t = block.t.0[i];
            block.steps.0[i] += 1.0;
            if FORM == SIZED {
                (
                    *ended,
                    transitions.kind.0[i],
                    transitions.visibility_or_size.0[i],
                ) = light_params.step_sized(block, i, field);
            } else {
                *ended = light_params.step(block, i, field);
            }
            if PROVES {
                light_params.plan_sample(block, i, t, field);
            }
        }
        if FORM == SIZED {
            light_params.begin_next_rays(block, &transitions, ended);
        }
    }

    /// Returns the parameters that all rays share.
    #[inline(always)]
    fn light_params(&self) -> LightParams<'_, FORM> {
        LightParams {
            size: self.light.size,
            is_positional: self.light.is_positional,
            is_raw: self.frame.is_raw,
            step_factor: self.frame.step_factor,
            checks: self.light.checks,
            least_rounding: self.frame.least_rounding,
            frame: self.frame,
            max_steps: self.frame.max_shadow_steps as f32,
            choice: ColumnChoice::new(),
        }
    }
}

/// Reports whether a form of shadows has penumbras.
const fn has_penumbra(form: u32) -> bool {
    form != HARD
}

/// Returns the part of the gradient in a lane that is measured so far.
#[inline(always)]
fn lane_gradient(block: &ShadowLanes, i: usize) -> V3<f32> {
    lane_vector!(block, i, gradient_x, gradient_y, gradient_z)
}

/// Returns the point of the candidate's round in a lane.
#[inline(always)]
fn round_point(block: &ShadowLanes, i: usize) -> V3<f32> {
    let start = lane_vector!(block, i, start_x, start_y, start_z);
    camera::point_along::<f32>(start, lane_direction(block, i), block.candidate_t.0[i])
        + lane_offset(block, i)
}

/// Returns the direction of the ray in a lane.
#[inline(always)]
fn lane_direction(block: &ShadowLanes, i: usize) -> V3<f32> {
    lane_vector!(block, i, direction_x, direction_y, direction_z)
}

/// Returns the light's size for the ray in a lane.
#[inline(always)]
fn lane_size<const FORM: u32>(block: &ShadowLanes, i: usize, size: f32) -> f32 {
    if FORM == SIZED { block.size.0[i] } else { size }
}

/// Returns the direction from the start of the ray in a lane to the centre of the light.
#[inline(always)]
fn lane_axis(block: &ShadowLanes, i: usize) -> V3<f32> {
    lane_vector!(block, i, axis_x, axis_y, axis_z)
}

/// Returns the offset from the candidate in a lane to the point of its round.
#[inline(always)]
fn lane_offset(block: &ShadowLanes, i: usize) -> V3<f32> {
    lane_vector!(block, i, offset_x, offset_y, offset_z)
}

/// Returns the gradient of the round before the present one in a lane, zero in the first round.
#[inline(always)]
fn lane_face(block: &ShadowLanes, i: usize) -> V3<f32> {
    lane_vector!(block, i, face_x, face_y, face_z)
}

#[inline(always)]
fn set_face(block: &mut ShadowLanes, i: usize, face: V3<f32>) {
    set_lane_vector!(block, i, face_x, face_y, face_z, face);
}

#[inline(always)]
fn set_direction(block: &mut ShadowLanes, i: usize, direction: V3<f32>) {
    set_lane_vector!(block, i, direction_x, direction_y, direction_z, direction);
}

/// Begins the check of a lane's occluder candidate if `begins` is set. With `is_at_end` the ray ends after
/// the check.
#[inline(always)]
fn begin_candidate_check(
    choice: ColumnChoice,
    block: &mut ShadowLanes,
    i: usize,
    begins: bool,
    is_at_end: bool,
) {
    let select = |new: f32, old: f32| choice.choose(begins, new, old);
    block.phase.0[i] = select(1.0, block.phase.0[i]);
    block.round.0[i] = select(0.0, block.round.0[i]);
    block.offset_x.0[i] = select(0.0, block.offset_x.0[i]);
    block.offset_y.0[i] = select(0.0, block.offset_y.0[i]);
    block.offset_z.0[i] = select(0.0, block.offset_z.0[i]);
    let face = lane_face(block, i);
    set_face(
        block,
        i,
        V3::new(
            select(0.0, face.x),
            select(0.0, face.y),
            select(0.0, face.z),
        ),
    );
    block.gradient_x.0[i] = select(0.0, block.gradient_x.0[i]);
    block.gradient_y.0[i] = select(0.0, block.gradient_y.0[i]);
    block.gradient_z.0[i] = select(0.0, block.gradient_z.0[i]);
    block.next_check_t.0[i] = choice.choose(
        begins & is_at_end,
        shadow::NO_NEXT_CHECK,
        block.next_check_t.0[i],
    );
}

/// Parameters that all rays towards a light share.
#[derive(Clone, Copy)]
struct LightParams<'a, const FORM: u32> {
    /// Size of the light.
    size: f32,
    /// 0 for a directional light, 1 for a point light.
    is_positional: f32,
    /// 1 where raw fields occur, so that the gradient may have any length; else 0.
    is_raw: f32,
    /// Factor on the field for a safe step; below 1, samples on each step prove that there is no surface.
    step_factor: f32,
    /// Samples that are occluder candidates: [`shadow::Checks`] as a number.
    checks: f32,
    /// Rounding error of the field at the origin of the scene.
    least_rounding: f32,
    /// Everything else, for rays that begin.
    frame: &'a FrameUniforms,
    /// Maximum number of evaluations of a ray.
    max_steps: f32,
    choice: ColumnChoice,
}

impl<const FORM: u32> LightParams<'_, FORM> {
    /// Reports whether every candidate is checked at once.
    #[inline(always)]
    fn checks_all(self) -> bool {
        self.checks > 0.5
    }

    /// Returns the rounding error of the field at the point of the ray in a lane.
    #[inline(always)]
    fn rounding_near(self, block: &ShadowLanes, i: usize) -> f32 {
        self.rounding_at(block, i, block.t.0[i])
    }

    /// Returns the rounding error of the field at `t` along the ray in a lane.
    #[inline(always)]
    fn rounding_at(self, block: &ShadowLanes, i: usize, t: f32) -> f32 {
        let start = lane_vector!(block, i, start_x, start_y, start_z);
        let point = camera::point_along::<f32>(start, lane_direction(block, i), t);
        marching::rounding_near::<f32>(point, block.rounding.0[i], self.least_rounding)
    }

    /// Takes a sample with the value `field` on a step. Reports whether it proves a part of it. Otherwise the step ends
    /// there, if it does not end at the sample anyway.
    #[inline(always)]
    fn proves_part_of_step(self, block: &mut ShadowLanes, i: usize, field: f32) -> bool {
        let (t, end_t) = (block.sample_t.0[i], block.t.0[i]);
        if t >= end_t {
            return false;
        }
        let step = block.step.0[i] - (end_t - t);
        let slope = shadow::slope(field, block.field_before.0[i], step);
        let rounding = self.rounding_at(block, i, t);
        if field >= -marching::sign_margin(rounding, slope, self.is_raw) {
            let min_step = self.min_sample_step(block, i, t);
            block.sample_t.0[i] =
                marching::later_sample_t(t, field, self.step_factor, min_step, end_t);
            return true;
        }
        block.t.0[i] = t;
        block.step.0[i] = step;
        false
    }

    /// Places the first sample on the next step of a ray, after a sample at `t` with the value `field`.
    #[inline(always)]
    fn plan_sample(self, block: &mut ShadowLanes, i: usize, t: f32, field: f32) {
        let (min_step, end_t) = (self.min_sample_step(block, i, t), block.t.0[i]);
        block.sample_t.0[i] =
            marching::first_sample_t(t, field, self.step_factor, min_step, end_t, t);
    }

    /// Returns the minimum distance between samples on a step at `t`. Nothing narrower is visible.
    #[inline(always)]
    fn min_sample_step(self, block: &ShadowLanes, i: usize, t: f32) -> f32 {
        let size = if has_penumbra(FORM) {
            lane_size::<FORM>(block, i, self.size)
        } else {
            0.0
        };
        shadow::stride(0.0, t, block.min_step.0[i], size)
    }

    /// Advances a ray by the field's value at its point; reports whether the ray has ended.
    ///
    /// An occluder candidate is checked once the next sample is no candidate, or at the end of the
    /// ray.
    #[inline(always)]
    fn step(self, block: &mut ShadowLanes, i: usize, field: f32) -> bool {
        let (t, v) = (block.t.0[i], block.visibility.0[i]);
        let slope = shadow::slope(field, block.field_before.0[i], block.step.0[i]);
        let sign_margin = marching::sign_margin(self.rounding_near(block, i), slope, self.is_raw);
        let min_stride = block.min_step.0[i] * shadow::late_speedup(block.steps.0[i]);
        let next = match FORM {
            PLAIN => shadow::short_stride(field, t, min_stride, self.size),
            _ => shadow::stride(field, t, min_stride, self.size),
        };
        let next = match has_penumbra(FORM) {
            true => shadow::step_to_check(next, t, block.next_check_t.0[i], self.checks),
            false => next,
        };
        // The last point is the end of the ray itself, wherever the previous steps were.
        let remaining = block.exit_t.0[i] - t;
        let remaining = if remaining > 0.0 { remaining } else { 0.0 };
        let next = if next < remaining { next } else { remaining };
        let out_of_steps = block.steps.0[i] >= self.max_steps;
        let is_at_end = (t >= block.exit_t.0[i]) | out_of_steps;
        let is_nan_value = is_nan(field);
        let back_step = shadow::step_to_passed_sheet(
            field,
            block.field_before.0[i],
            block.step.0[i],
            block.slope_before.0[i],
            sign_margin,
        );
        let goes_back = (back_step > 0.0) & !out_of_steps;
        let next = if goes_back {
            back_step - block.step.0[i]
        } else {
            next
        };
        let select = |new: f32, old: f32| self.choice.choose(!goes_back, new, old);
        block.t.0[i] = t + next;
        block.field_before.0[i] = select(field, block.field_before.0[i]);
        block.step.0[i] = if goes_back { back_step } else { next };
        block.slope_before.0[i] = if goes_back { 0.0 } else { slope };
        if !has_penumbra(FORM) {
            let sample_visibility = select(shadow::hard_visibility(v, field, sign_margin), v);
            block.visibility.0[i] = sample_visibility;
            return !goes_back & (is_at_end | (sample_visibility <= 0.0) | is_nan_value);
        }
        let sample_visibility = shadow::visibility_at(field, t, self.size);
        let is_inside = (field < -sign_margin) & !goes_back;
        let is_lower = shadow::is_candidate(sample_visibility, block.last_visibility.0[i], v);
        let next_check_t = block.next_check_t.0[i];
        let is_checked = shadow::is_checked(is_lower, t, next_check_t, self.checks);
        let is_candidate = (is_checked > 0.0) & !goes_back;
        let if_candidate = |new: f32, old: f32| self.choice.choose(is_candidate, new, old);
        block.candidate_t.0[i] = if_candidate(t, block.candidate_t.0[i]);
        block.value.0[i] = if_candidate(candidate::restart_value::<f32>(field), block.value.0[i]);
        let last_visibility = shadow::last_visibility(sample_visibility, self.checks);
        block.last_visibility.0[i] = select(last_visibility, block.last_visibility.0[i]);
        let has_passed_minimum = (!is_candidate | is_at_end | self.checks_all()) & !goes_back;
        let has_candidate = block.candidate_t.0[i] > 0.0;
        let begins = has_passed_minimum & has_candidate & !out_of_steps & !is_inside;
        begin_candidate_check(self.choice, block, i, begins, is_at_end);
        block.visibility.0[i] = self.choice.choose(is_inside, 0.0, v);
        !goes_back & (is_inside | (is_at_end & !begins) | is_nan_value)
    }
}
