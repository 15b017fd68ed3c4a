//! The stage `shadow`: visibility of a light from surfaces.

mod candidate_check;
mod sized;

use super::lanes::{ColumnChoice, RayTask, any_nonzero, is_nan, lanes, run_streamed};
use super::tile::Tile;
use super::{Evaluator, F32x64, LANES, Points};
use crate::render::ray::vector;
use sdfc_shaders::features::ShadowForm;
use sdfc_shaders::layout::{FrameUniforms, LightRecord, RayState};
use sdfc_shaders::marching::FROM_INSIDE;
use sdfc_shaders::{camera, candidate, marching, normals, reflectance, shadow};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

lanes! {
    /// Rays towards a light.
    ShadowLanes {
        start_x, start_y, start_z, direction_x, direction_y, direction_z, exit_t,
        axis_x, axis_y, axis_z, light_t, size, ray_number, best_visibility, clear_t, steps_before,
        t, visibility, steps, min_step, side, rounding, field_before, step, slope_before, last_visibility, candidate_t,
        ends_after_check, moves,
        value, phase, round, gradient_x, gradient_y, gradient_z, offset_x, offset_y, offset_z,
    }
}

const HARD: u32 = ShadowForm::Hard as u32;
const PLAIN: u32 = ShadowForm::Plain as u32;
const SOFT: u32 = ShadowForm::Soft as u32;
const SIZED: u32 = ShadowForm::Sized as u32;

/// Rays towards a light whose shadow has the form `FORM`: items are indices in the tile.
struct ShadowRays<'a, const FORM: u32> {
    frame: &'a FrameUniforms,
    light: &'a LightRecord,
    points: &'a [V3<f32>],
    rays: &'a [RayState],
    normals: &'a [[f32; 3]],
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
            let mut task = ShadowRays::<$form> {
                frame,
                light,
                points: &tile.points,
                rays: &tile.rays,
                normals: &tile.normals,
                light_visibility: &mut tile.light_visibility[light_index],
            };
            run_streamed(&mut task, evaluator, &tile.shown)
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

    fn begin(&mut self, item: u32, b: &mut ShadowLanes, lane: usize) -> bool {
        let (f, light) = (self.frame, self.light);
        let primary_ray = &self.rays[item as usize];
        let p = self.points[item as usize];
        let normal = vector(self.normals[item as usize]);
        let light_position = vector(light.position);
        let to_light = camera::unit::<f32>(light_position - p * light.is_positional);
        if reflectance::cosine::<f32>(normal, to_light) <= 0.0 {
            self.light_visibility[item as usize] = 0.0;
            return false;
        }
        let half = camera::half_pixel(primary_ray.t, f.half_pixel_size, f.half_pixel_growth);
        let rounding = marching::rounding_at(primary_ray.t, f.rounding);
        let is_sharp = if FORM == HARD { 1.0 } else { 0.0 };
        let lift = normals::lift::<f32>(p, half, rounding, is_sharp);
        let min_step = shadow::min_step::<f32>(half, lift);
        let start_t = shadow::start_t::<f32>(min_step, is_sharp);
        let start = camera::point_along::<f32>(p, normal, lift);
        // The direction is taken from the start of the ray, so that the ray ends at the light and not beside
        // it.
        let to_light_from_start = light_position - start * light.is_positional;
        let direction = camera::unit::<f32>(to_light_from_start);
        let length = to_light_from_start.length();
        let light_distance = if length < f.far { length } else { f.far };
        let light_t = if light.is_positional > 0.0 {
            light_distance
        } else {
            f.far
        };
        let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
        let size = if has_penumbra(FORM) {
            self.light.size
        } else {
            0.0
        };
        let exit_t = shadow::exit_t::<f32>(start, direction, low, high, light_t, size);
        let side = if primary_ray.status & FROM_INSIDE != 0 {
            -1.0
        } else {
            1.0
        };
        b.start_x.0[lane] = start.x;
        b.start_y.0[lane] = start.y;
        b.start_z.0[lane] = start.z;
        b.direction_x.0[lane] = direction.x;
        b.direction_y.0[lane] = direction.y;
        b.direction_z.0[lane] = direction.z;
        b.exit_t.0[lane] = exit_t;
        b.light_t.0[lane] = light_t;
        b.field_before.0[lane] = 0.0;
        b.step.0[lane] = 0.0;
        b.slope_before.0[lane] = 0.0;
        b.t.0[lane] = start_t;
        b.visibility.0[lane] = 1.0;
        b.steps.0[lane] = 0.0;
        b.min_step.0[lane] = min_step;
        b.side.0[lane] = side;
        b.rounding.0[lane] = rounding;
        if has_penumbra(FORM) {
            b.phase.0[lane] = 0.0;
            b.last_visibility.0[lane] = 1.0;
            b.candidate_t.0[lane] = shadow::NO_CANDIDATE;
            b.moves.0[lane] = 0.0;
        }
        if FORM == SIZED {
            b.axis_x.0[lane] = direction.x;
            b.axis_y.0[lane] = direction.y;
            b.axis_z.0[lane] = direction.z;
            b.size.0[lane] = self.light.size;
            b.ray_number.0[lane] = 0.0;
            b.best_visibility.0[lane] = -1.0;
            b.clear_t.0[lane] = start_t;
            b.steps_before.0[lane] = 0.0;
        }
        true
    }

    #[inline(always)]
    fn points(&self, b: &ShadowLanes, points: &mut Points) {
        for i in 0..LANES {
            let start = V3::new(b.start_x.0[i], b.start_y.0[i], b.start_z.0[i]);
            let direction = V3::new(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
            let p = camera::point_along::<f32>(start, direction, b.t.0[i]);
            points[0].0[i] = p.x;
            points[1].0[i] = p.y;
            points[2].0[i] = p.z;
        }
        if FORM == SIZED && any_nonzero(&b.ray_number) {
            for i in 0..LANES {
                let to_centre = lane_axis(b, i) * b.light_t.0[i];
                let is_measuring = b.size.0[i] == 0.0;
                let add = |to: f32, offset: f32| if is_measuring { to + offset } else { to };
                points[0].0[i] = add(points[0].0[i], to_centre.x);
                points[1].0[i] = add(points[1].0[i], to_centre.y);
                points[2].0[i] = add(points[2].0[i], to_centre.z);
            }
        }
    }

    #[inline(always)]
    fn advance(&self, b: &mut ShadowLanes, values: &F32x64, ended: &mut [bool; LANES]) {
        // Copied here, since the loop's writes could alias the fields behind a pointer.
        let light_params = self.light_params();
        let mut transitions = sized::RayTransitions::default();
        for (i, ended) in ended.iter_mut().enumerate() {
            b.steps.0[i] += 1.0;
            let field = values.0[i] * b.side.0[i];
            if FORM == SIZED {
                (
                    *ended,
                    transitions.kind.0[i],
                    transitions.visibility_or_size.0[i],
                ) = light_params.step_sized(b, i, field);
            } else {
                *ended = light_params.step(b, i, field);
            }
        }
        if FORM == SIZED {
            light_params.begin_next_rays(b, &transitions, ended);
        }
    }

    #[inline(always)]
    fn divergent_mask(b: &ShadowLanes) -> Option<&F32x64> {
        has_penumbra(FORM).then_some(&b.phase)
    }

    #[inline(always)]
    fn divergent_points(&self, b: &ShadowLanes, points: &mut Points) {
        for i in 0..LANES {
            let limit = shadow::candidate_limit(
                b.candidate_t.0[i],
                lane_size::<FORM>(b, i, self.light.size),
            );
            let (phase, value) = (b.phase.0[i], b.value.0[i]);
            let (point, offset, gradient) =
                (round_point(b, i), lane_offset(b, i), lane_gradient(b, i));
            let p = candidate::sample_point::<f32>(point, offset, phase, value, gradient, limit);
            points[0].0[i] = p.x;
            points[1].0[i] = p.y;
            points[2].0[i] = p.z;
        }
    }

    #[inline(always)]
    fn advance_divergent(&self, b: &mut ShadowLanes, values: &F32x64, ended: &mut [bool; LANES]) {
        let light_params = self.light_params();
        let mut transitions = sized::RayTransitions::default();
        for (i, ended) in ended.iter_mut().enumerate() {
            b.steps.0[i] += 1.0;
            let field = values.0[i] * b.side.0[i];
            let (is_out_of_steps, is_last) = light_params.step_check(b, i, field);
            *ended = is_out_of_steps | is_nan(field) | (is_last & (FORM != SIZED));
            if FORM == SIZED {
                transitions.kind.0[i] = if is_last { sized::RAY_ENDED } else { 0.0 };
                transitions.visibility_or_size.0[i] = b.visibility.0[i];
            }
        }
        if FORM == SIZED {
            light_params.begin_next_rays(b, &transitions, ended);
        }
    }

    fn end(&mut self, item: u32, b: &ShadowLanes, lane: usize) {
        let visibility = match FORM {
            SIZED if b.ray_number.0[lane] > 0.0 => b.best_visibility.0[lane],
            _ => b.visibility.0[lane],
        };
        self.light_visibility[item as usize] = match FORM {
            SIZED => shadow::light_fraction_sized(visibility),
            _ => shadow::light_fraction(visibility),
        };
    }
}

impl<const FORM: u32> ShadowRays<'_, FORM> {
    /// Returns the parameters that all rays share.
    #[inline(always)]
    fn light_params(&self) -> LightParams<FORM> {
        LightParams {
            size: self.light.size,
            is_positional: self.light.is_positional,
            is_raw: self.frame.is_raw,
            low: vector(self.frame.bounds_min),
            high: vector(self.frame.bounds_max),
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
fn lane_gradient(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::new(b.gradient_x.0[i], b.gradient_y.0[i], b.gradient_z.0[i])
}

/// Returns the point of the candidate's round in a lane.
#[inline(always)]
fn round_point(b: &ShadowLanes, i: usize) -> V3<f32> {
    let start = V3::new(b.start_x.0[i], b.start_y.0[i], b.start_z.0[i]);
    camera::point_along::<f32>(start, lane_direction(b, i), b.candidate_t.0[i]) + lane_offset(b, i)
}

/// Returns the direction of the ray in a lane.
#[inline(always)]
fn lane_direction(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::new(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i])
}

/// Returns the light's size for the ray in a lane.
#[inline(always)]
fn lane_size<const FORM: u32>(b: &ShadowLanes, i: usize, size: f32) -> f32 {
    if FORM == SIZED { b.size.0[i] } else { size }
}

/// Returns the direction from the start of the ray in a lane to the centre of the light.
#[inline(always)]
fn lane_axis(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::new(b.axis_x.0[i], b.axis_y.0[i], b.axis_z.0[i])
}

/// Returns the offset from the candidate in a lane to the point of its round.
#[inline(always)]
fn lane_offset(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::new(b.offset_x.0[i], b.offset_y.0[i], b.offset_z.0[i])
}

#[inline(always)]
fn set_direction(b: &mut ShadowLanes, i: usize, direction: V3<f32>) {
    b.direction_x.0[i] = direction.x;
    b.direction_y.0[i] = direction.y;
    b.direction_z.0[i] = direction.z;
}

/// Begins the check of a lane's occluder candidate if `begins` is set. With `is_at_end` the ray ends after
/// the check.
#[inline(always)]
fn begin_candidate_check(
    choice: ColumnChoice,
    b: &mut ShadowLanes,
    i: usize,
    begins: bool,
    is_at_end: bool,
) {
    let select = |new: f32, old: f32| choice.choose(begins, new, old);
    b.phase.0[i] = select(1.0, b.phase.0[i]);
    b.round.0[i] = select(0.0, b.round.0[i]);
    b.offset_x.0[i] = select(0.0, b.offset_x.0[i]);
    b.offset_y.0[i] = select(0.0, b.offset_y.0[i]);
    b.offset_z.0[i] = select(0.0, b.offset_z.0[i]);
    b.gradient_x.0[i] = select(0.0, b.gradient_x.0[i]);
    b.gradient_y.0[i] = select(0.0, b.gradient_y.0[i]);
    b.gradient_z.0[i] = select(0.0, b.gradient_z.0[i]);
    b.ends_after_check.0[i] = select(if is_at_end { 1.0 } else { 0.0 }, b.ends_after_check.0[i]);
}

/// Parameters that all rays towards a light share.
#[derive(Clone, Copy)]
struct LightParams<const FORM: u32> {
    /// Size of the light.
    size: f32,
    /// 0 for a directional light, 1 for a point light.
    is_positional: f32,
    /// 1 where raw fields occur, so that the gradient may have any length; else 0.
    is_raw: f32,
    /// Lower corner of the scene's bounds, outside of which there is nothing.
    low: V3<f32>,
    /// Upper corner of the scene's bounds.
    high: V3<f32>,
    /// Maximum number of evaluations of a ray.
    max_steps: f32,
    choice: ColumnChoice,
}

impl<const FORM: u32> LightParams<FORM> {
    /// Advances a ray by the field's value at its point; reports whether the ray has ended.
    ///
    /// An occluder candidate is checked once the next sample is no candidate, or at the end of the
    /// ray.
    #[inline(always)]
    fn step(self, b: &mut ShadowLanes, i: usize, field: f32) -> bool {
        let (t, v) = (b.t.0[i], b.visibility.0[i]);
        let slope = shadow::slope(field, b.field_before.0[i], b.step.0[i]);
        let sign_margin = marching::sign_margin(b.rounding.0[i], slope, self.is_raw);
        let min_stride = b.min_step.0[i] * shadow::late_speedup(b.steps.0[i]);
        let next = match FORM {
            PLAIN => shadow::short_stride(field, t, min_stride, self.size),
            _ => shadow::stride(field, t, min_stride, self.size),
        };
        // The last point is the end of the ray itself, wherever the previous steps were.
        let remaining = b.exit_t.0[i] - t;
        let remaining = if remaining > 0.0 { remaining } else { 0.0 };
        let next = if next < remaining { next } else { remaining };
        let out_of_steps = b.steps.0[i] >= self.max_steps;
        let is_at_end = (t >= b.exit_t.0[i]) | out_of_steps;
        let is_nan_value = is_nan(field);
        let back_step = shadow::step_to_passed_sheet(
            field,
            b.field_before.0[i],
            b.step.0[i],
            b.slope_before.0[i],
            sign_margin,
        );
        let goes_back = (back_step > 0.0) & !out_of_steps;
        let next = if goes_back {
            back_step - b.step.0[i]
        } else {
            next
        };
        let select = |new: f32, old: f32| self.choice.choose(!goes_back, new, old);
        b.t.0[i] = t + next;
        b.field_before.0[i] = select(field, b.field_before.0[i]);
        b.step.0[i] = if goes_back { back_step } else { next };
        b.slope_before.0[i] = if goes_back { 0.0 } else { slope };
        if !has_penumbra(FORM) {
            let sample_visibility = select(shadow::hard_visibility(v, field, sign_margin), v);
            b.visibility.0[i] = sample_visibility;
            return !goes_back & (is_at_end | (sample_visibility <= 0.0) | is_nan_value);
        }
        let sample_visibility = shadow::visibility_at(field, t, self.size);
        let is_inside = (field < -sign_margin) & !goes_back;
        let is_candidate =
            (shadow::is_candidate(sample_visibility, b.last_visibility.0[i], v) > 0.0) & !goes_back;
        let if_candidate = |new: f32, old: f32| self.choice.choose(is_candidate, new, old);
        b.candidate_t.0[i] = if_candidate(t, b.candidate_t.0[i]);
        b.value.0[i] = if_candidate(field, b.value.0[i]);
        b.last_visibility.0[i] = select(sample_visibility, b.last_visibility.0[i]);
        let has_passed_minimum = (!is_candidate | is_at_end) & !goes_back;
        let has_candidate = b.candidate_t.0[i] > 0.0;
        let begins = has_passed_minimum & has_candidate & !out_of_steps & !is_inside;
        begin_candidate_check(self.choice, b, i, begins, is_at_end);
        b.visibility.0[i] = self.choice.choose(is_inside, 0.0, v);
        !goes_back & (is_inside | (is_at_end & !begins) | is_nan_value)
    }
}
