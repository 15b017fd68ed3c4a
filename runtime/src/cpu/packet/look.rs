//! A look at what is left of rays in a leaf as a whole: where bounds of the field say that there is nothing.

use super::{Inside, whole_chunks};
use crate::cpu::march::outcome;
use crate::cpu::{Boxes, Range};
use sdfc_shaders::camera;
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;
use sdfc_vm::widest;

widest! {
    /// The boxes around what is left of the rays in the leaf.
    pub(super) fn spans(inside: &Inside, count: usize, boxes: &mut Boxes) = spans_body;
}

#[inline(always)]
fn spans_body(b: &Inside, count: usize, boxes: &mut Boxes) {
    for i in 0..whole_chunks(count) {
        let origin = V3::of(b.origin_x.0[i], b.origin_y.0[i], b.origin_z.0[i]);
        let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
        // Rounding keeps the order of points along a ray, so these ends hold all between them.
        let from = camera::along::<f32>(origin, direction, b.t.0[i]).to_array();
        let to = camera::along::<f32>(origin, direction, b.leave.0[i]).to_array();
        for axis in 0..3 {
            boxes[axis].0[i] = Real::min(from[axis], to[axis]);
            boxes[axis + 3].0[i] = Real::max(from[axis], to[axis]);
        }
    }
}

widest! {
    /// Lets those rays through along which the field cannot change its sign.
    pub(super) fn rule_out(range: &Range, count: usize, inside: &mut Inside) = rule_out_body;
}

#[inline(always)]
fn rule_out_body([low, high]: &Range, count: usize, b: &mut Inside) {
    for i in 0..whole_chunks(count) {
        let slope = b.slope.0[i];
        let outside = b.side.0[i] > 0.0;
        let nearest = if outside { low.0[i] } else { -high.0[i] };
        let clear = nearest > 0.0;
        b.outcome.0[i] = if clear {
            outcome::THROUGH
        } else {
            outcome::UNDER_WAY
        };
        // What is clear is a ball around the last point; nothing is known beyond the leaf.
        let (from, to) = (b.t.0[i], b.leave.0[i]);
        let (middle, half) = ((from + to) * 0.5, (to - from) * 0.5 / slope);
        b.t.0[i] = if clear { middle } else { from };
        b.radius.0[i] = if clear { half } else { b.radius.0[i] };
    }
}
