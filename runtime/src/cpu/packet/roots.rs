//! Rays that hit in a leaf, on their way to the root.

use super::{Roots, whole_chunks};
use crate::cpu::lanes::is_nan;
use crate::cpu::{Column, Points};
use sdfc_shaders::camera;
use sdfc_shaders::layout::Frame;
use sdfc_shaders::marching;
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;
use sdfc_vm::widest;

widest! {
    /// Where the roots are estimated to be; whether any of them is still to be found.
    pub(super) fn place_roots(frame: &Frame, roots: &Roots, count: usize, points: &mut Points) -> bool =
        place_roots_body;
}

/// The estimate of a root, kept within its leaf.
#[inline(always)]
fn guess(f: &Frame, b: &Roots, i: usize) -> f32 {
    let rounding = marching::rounding_at(b.t.0[i], f.rounding);
    let guess = marching::next_guess(
        b.t.0[i],
        b.field.0[i],
        b.t_other.0[i],
        b.field_other.0[i],
        rounding,
        f.raw,
    );
    Real::max(Real::min(guess, b.high.0[i]), b.low.0[i])
}

/// Tells if a root is known as well as it can be.
#[inline(always)]
fn settled(f: &Frame, b: &Roots, i: usize) -> bool {
    let rounding = marching::rounding_at(b.t.0[i], f.rounding);
    marching::settled(
        b.t.0[i],
        b.field.0[i],
        b.t_other.0[i],
        b.field_other.0[i],
        rounding,
        f.raw,
    ) > 0.0
}

#[inline(always)]
fn place_roots_body(f: &Frame, b: &Roots, count: usize, points: &mut Points) -> bool {
    let mut open = 0;
    for i in 0..whole_chunks(count) {
        let settled = settled(f, b, i);
        open |= u32::from(!settled & (i < count));
        let origin = V3::of(b.origin_x.0[i], b.origin_y.0[i], b.origin_z.0[i]);
        let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
        let p = camera::along::<f32>(origin, direction, guess(f, b, i));
        points[0].0[i] = p.x;
        points[1].0[i] = p.y;
        points[2].0[i] = p.z;
    }
    open != 0
}

widest! {
    /// Takes the field at the guesses into account.
    pub(super) fn step_roots(frame: &Frame, values: &Column, count: usize, roots: &mut Roots) =
        step_roots_body;
}

#[inline(always)]
fn step_roots_body(f: &Frame, values: &Column, count: usize, b: &mut Roots) {
    for i in 0..whole_chunks(count) {
        let factor = 1.0 / b.slope.0[i];
        let field = values.0[i] * b.side.0[i] * factor;
        let best = marching::secant_step(
            b.t.0[i],
            b.field.0[i],
            b.t_other.0[i],
            b.field_other.0[i],
            guess(f, b, i),
            field,
        );
        // What is settled stays, and an estimate without a value is not taken.
        let keep = settled(f, b, i) | is_nan(field);
        b.t_other.0[i] = if keep { b.t_other.0[i] } else { best.t_other };
        b.field_other.0[i] = if keep {
            b.field_other.0[i]
        } else {
            best.field_other
        };
        b.t.0[i] = if keep { b.t.0[i] } else { best.t };
        b.field.0[i] = if keep { b.field.0[i] } else { best.field };
    }
}
