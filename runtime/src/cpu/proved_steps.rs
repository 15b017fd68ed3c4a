//! Samples on the steps of rays through fields whose slope is only stated: see [`marching::first_sample_t`].
//!
//! The macros apply to a lane of a block with the columns of a march, and `sample_t`: the next sample on the present step.

use sdfc_shaders::layout::FrameUniforms;
use sdfc_shaders::{camera, marching};

/// Reports whether the next sample of a lane's ray lies on a step, before its end.
macro_rules! is_between {
    ($frame:expr, $block:ident, $i:ident) => {{
        let (t, sample_t) = ($block.t.0[$i], $block.sample_t.0[$i]);
        let is_probe = takes_probe!($frame, $block, $i) > 0.5;
        !is_probe & (t < sample_t) & (sample_t < t + $block.step.0[$i])
    }};
}

/// Returns the step to the next sample of a lane's ray.
macro_rules! sample_step {
    ($frame:expr, $block:ident, $i:ident) => {
        match is_between!($frame, $block, $i) {
            true => $block.sample_t.0[$i] - $block.t.0[$i],
            false => $block.step.0[$i],
        }
    };
}

/// Takes a sample with the value `$distance` on a step. Evaluates to `true` if it proves a part of the step. Otherwise the
/// step ends there, if it does not end at the sample anyway. The block's values are those of the field over `$slope`.
macro_rules! proves_part_of_step {
    ($frame:expr, $block:ident, $i:ident, $distance:expr, $slope:expr) => {
        is_between!($frame, $block, $i) && {
            let (t, end_t) = ($block.sample_t.0[$i], $block.t.0[$i] + $block.step.0[$i]);
            let step = t - $block.t.0[$i];
            let field = $distance * $block.side.0[$i];
            let (origin, direction) = lane_ray!($block, $i);
            let point = camera::point_along::<f32>(origin, direction, t);
            let rounding = marching::rounding_at(t, $frame.rounding);
            let value_rounding =
                marching::rounding_near::<f32>(point, rounding, $frame.least_rounding);
            let slope = (field / $slope - $block.field.0[$i]) / step;
            let margin = marching::sign_margin(value_rounding, slope, $frame.is_raw);
            let is_outside = field / $slope >= -margin;
            if is_outside {
                let min_step = $crate::cpu::proved_steps::min_sample_step($frame, t);
                $block.sample_t.0[$i] =
                    marching::later_sample_t(t, field, $frame.step_factor, min_step, end_t);
            } else {
                $block.step.0[$i] = step;
            }
            is_outside
        }
    };
}

/// Places the first sample on the next step of a lane's ray.
macro_rules! plan_sample {
    ($frame:expr, $block:ident, $i:ident, $slope:expr) => {{
        let t = $block.t.0[$i];
        $block.sample_t.0[$i] = marching::first_sample_t(
            t,
            $block.field.0[$i] * $slope,
            $frame.step_factor,
            $crate::cpu::proved_steps::min_sample_step($frame, t),
            t + $block.step.0[$i],
            $block.sample_t.0[$i],
        );
    }};
}
pub(super) use {is_between, plan_sample, proves_part_of_step, sample_step};

/// Returns the minimum distance between samples on a step at `t`.
#[inline(always)]
pub(super) fn min_sample_step(frame: &FrameUniforms, t: f32) -> f32 {
    let half = camera::half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
    let threshold = marching::threshold(t, half, frame.threshold_fraction, frame.rounding);
    marching::min_sample_step(half, threshold)
}
