//! Secant refinement of the hits in a leaf.

use super::{Roots, whole_chunks};
use crate::cpu::lanes::{ColumnChoice, is_nan};
use crate::cpu::{F32x64, Points};
use sdfc_shaders::camera;
use sdfc_shaders::layout::FrameUniforms;
use sdfc_shaders::marching;
use sdfc_vm::multiversion;
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;

multiversion! {
    /// Computes the points of the estimated roots. Reports whether any root is not yet settled.
    pub(super) fn estimate_roots(frame: &FrameUniforms, roots: &Roots, count: usize, points: &mut Points) -> bool =
        estimate_roots_body;
}

/// Returns the estimate of a root, clamped to its leaf.
#[inline(always)]
fn root_estimate(f: &FrameUniforms, b: &Roots, i: usize) -> f32 {
    let rounding = marching::rounding_at(b.t.0[i], f.rounding);
    let estimate = marching::next_estimate(
        b.t.0[i],
        b.field.0[i],
        b.t_other.0[i],
        b.field_other.0[i],
        rounding,
        f.is_raw,
    );
    Real::max(Real::min(estimate, b.high.0[i]), b.low.0[i])
}

/// Reports whether a root is as accurate as rounding allows.
#[inline(always)]
fn is_settled(f: &FrameUniforms, b: &Roots, i: usize) -> bool {
    let rounding = marching::rounding_at(b.t.0[i], f.rounding);
    marching::is_settled(
        b.t.0[i],
        b.field.0[i],
        b.t_other.0[i],
        b.field_other.0[i],
        rounding,
        f.is_raw,
    ) > 0.0
}

#[inline(always)]
fn estimate_roots_body(f: &FrameUniforms, b: &Roots, count: usize, points: &mut Points) -> bool {
    let mut has_open = 0;
    for i in 0..whole_chunks(count) {
        let is_settled = is_settled(f, b, i);
        has_open |= u32::from(!is_settled & (i < count));
        let origin = V3::new(b.origin_x.0[i], b.origin_y.0[i], b.origin_z.0[i]);
        let direction = V3::new(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
        let p = camera::point_along::<f32>(origin, direction, root_estimate(f, b, i));
        points[0].0[i] = p.x;
        points[1].0[i] = p.y;
        points[2].0[i] = p.z;
    }
    has_open != 0
}

multiversion! {
    /// Applies the field's values at the estimates.
    pub(super) fn refine_roots(frame: &FrameUniforms, values: &F32x64, count: usize, roots: &mut Roots) =
        refine_roots_body;
}

#[inline(always)]
fn refine_roots_body(f: &FrameUniforms, values: &F32x64, count: usize, b: &mut Roots) {
    let choice = ColumnChoice::new();
    for i in 0..whole_chunks(count) {
        let factor = 1.0 / b.slope.0[i];
        let field = values.0[i] * b.side.0[i] * factor;
        let best = marching::secant_step(
            b.t.0[i],
            b.field.0[i],
            b.t_other.0[i],
            b.field_other.0[i],
            root_estimate(f, b, i),
            field,
        );
        // Settled roots stay, and an estimate without a value is not used.
        let keeps_old = is_settled(f, b, i) | is_nan(field);
        let select = |new: f32, old: f32| choice.choose(!keeps_old, new, old);
        b.t_other.0[i] = select(best.t_other, b.t_other.0[i]);
        b.field_other.0[i] = select(best.field_other, b.field_other.0[i]);
        b.t.0[i] = select(best.t, b.t.0[i]);
        b.field.0[i] = select(best.field, b.field.0[i]);
    }
}
