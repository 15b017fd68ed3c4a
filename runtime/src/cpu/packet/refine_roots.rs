//! Secant refinement of the hits in a leaf.

use super::{Roots, whole_chunks};
use crate::cpu::ray_tasks::{ColumnChoice, is_nan, lane_ray, store_point};
use crate::cpu::{F32x64, Points};
use sdfc_shaders::camera;
use sdfc_shaders::layout::FrameUniforms;
use sdfc_shaders::marching;
use sdfc_vm::multiversion;
use sdfc_vm::real::Real;

multiversion! {
    /// Computes the points of the estimated roots. Reports whether any root is not yet settled.
    pub(super) fn estimate_roots(
        frame: &FrameUniforms, roots: &Roots, steps: f32, count: usize, points: &mut Points,
    ) -> bool = estimate_roots_body;
}

/// Returns the estimate of a root after a number of steps, clamped to its leaf.
#[inline(always)]
fn root_estimate(frame: &FrameUniforms, block: &Roots, steps: f32, i: usize) -> f32 {
    let rounding = marching::rounding_at(block.t.0[i], frame.rounding);
    let estimate = marching::next_estimate(
        block.t.0[i],
        block.field.0[i],
        block.t_other.0[i],
        block.field_other.0[i],
        rounding,
        frame.is_raw,
        steps,
    );
    Real::max(Real::min(estimate, block.high.0[i]), block.low.0[i])
}

/// Reports whether a root is as accurate as rounding allows.
#[inline(always)]
fn is_settled(frame: &FrameUniforms, block: &Roots, i: usize) -> bool {
    let rounding = marching::rounding_at(block.t.0[i], frame.rounding);
    marching::is_settled(
        block.t.0[i],
        block.field.0[i],
        block.t_other.0[i],
        block.field_other.0[i],
        rounding,
        frame.is_raw,
    ) > 0.0
}

#[inline(always)]
fn estimate_roots_body(
    frame: &FrameUniforms,
    block: &Roots,
    steps: f32,
    count: usize,
    points: &mut Points,
) -> bool {
    let mut has_open = 0;
    for i in 0..whole_chunks(count) {
        let is_settled = is_settled(frame, block, i);
        has_open |= u32::from(!is_settled & (i < count));
        let (origin, direction) = lane_ray!(block, i);
        let p =
            camera::point_along::<f32>(origin, direction, root_estimate(frame, block, steps, i));
        store_point(points, i, p);
    }
    has_open != 0
}

multiversion! {
    /// Applies the field's values at the estimates.
    pub(super) fn refine_roots(
        frame: &FrameUniforms, values: &F32x64, steps: f32, count: usize, roots: &mut Roots,
    ) = refine_roots_body;
}

#[inline(always)]
fn refine_roots_body(
    frame: &FrameUniforms,
    values: &F32x64,
    steps: f32,
    count: usize,
    block: &mut Roots,
) {
    let choice = ColumnChoice::new();
    for i in 0..whole_chunks(count) {
        let factor = 1.0 / block.slope.0[i];
        let field = values.0[i] * block.side.0[i] * factor;
        let best = marching::secant_step(
            block.t.0[i],
            block.field.0[i],
            block.t_other.0[i],
            block.field_other.0[i],
            root_estimate(frame, block, steps, i),
            field,
        );
        // Settled roots stay, and an estimate without a value is not used.
        let keeps_old = is_settled(frame, block, i) | is_nan(field);
        let select = |new: f32, old: f32| choice.choose(!keeps_old, new, old);
        block.t_other.0[i] = select(best.t_other, block.t_other.0[i]);
        block.field_other.0[i] = select(best.field_other, block.field_other.0[i]);
        block.t.0[i] = select(best.t, block.t.0[i]);
        block.field.0[i] = select(best.field, block.field.0[i]);
    }
}
