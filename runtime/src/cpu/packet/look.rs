//! Looks at parts of rays as a whole: where bounds of the field say that there is nothing, or one root.

use super::first::change;
use super::{Inside, UNEVEN, whole_chunks};
use crate::cells::Steepness;
use crate::cpu::march::outcome;
use crate::cpu::{Boxes, Column, LANES, Range};
use sdfc_shaders::camera;
use sdfc_shaders::layout::Frame;
use sdfc_shaders::marching;
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;
use sdfc_vm::widest;

/// How many times as far ahead as a line says that the root is, rays are looked at.
const AHEAD: f32 = 1.5;

widest! {
    /// Looks at all that is left of the rays in the leaf.
    pub(super) fn look_to_the_end(inside: &mut Inside) = to_the_end_body;
}

#[inline(always)]
fn to_the_end_body(b: &mut Inside) {
    b.until = b.leave;
    b.outcome = Column([outcome::UNDER_WAY; LANES]);
}

widest! {
    /// Looks no farther than to a little behind where a line through the last two values comes to zero.
    pub(super) fn look_ahead(frame: &Frame, count: usize, inside: &mut Inside) = look_ahead_body;
}

#[inline(always)]
fn look_ahead_body(f: &Frame, count: usize, b: &mut Inside) {
    for i in 0..whole_chunks(count) {
        let (t, leave) = (b.t.0[i], b.leave.0[i]);
        let (way, fallen) = (t - b.t_before.0[i], b.radius_before.0[i] - b.radius.0[i]);
        let half = camera::half_pixel(t, f.footprint, f.footprint_growth);
        let to_root = b.radius.0[i] * way / Real::max(fallen, 1e-30);
        let falling = (way > 0.0) & (fallen > 0.0);
        let ahead = t + to_root * super::env(2) + half;
        b.until.0[i] = Real::min(if falling { ahead } else { leave }, leave);
    }
}

widest! {
    /// The boxes around what is looked at of the rays.
    pub(super) fn spans(inside: &Inside, count: usize, boxes: &mut Boxes) = spans_body;
}

#[inline(always)]
fn spans_body(b: &Inside, count: usize, boxes: &mut Boxes) {
    for i in 0..whole_chunks(count) {
        let origin = V3::of(b.origin_x.0[i], b.origin_y.0[i], b.origin_z.0[i]);
        let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
        // Rounding keeps the order of points along a ray, so these ends hold all between them.
        let from = camera::along::<f32>(origin, direction, b.t.0[i]).to_array();
        let to = camera::along::<f32>(origin, direction, b.until.0[i]).to_array();
        for axis in 0..3 {
            boxes[axis].0[i] = Real::min(from[axis], to[axis]);
            boxes[axis + 3].0[i] = Real::max(from[axis], to[axis]);
        }
    }
}

widest! {
    /// Lets those rays through that stay farther from the surface than where they would stop.
    pub(super) fn rule_out(
        frame: &Frame, range: &Range, count: usize, inside: &mut Inside,
    ) = rule_out_body;
}

#[inline(always)]
fn rule_out_body(f: &Frame, [low, high]: &Range, count: usize, b: &mut Inside) {
    for i in 0..whole_chunks(count) {
        let slope = b.slope.0[i];
        let factor = f.inverse_slope / slope;
        let half = camera::half_pixel(b.leave.0[i], f.footprint, f.footprint_growth);
        let enough = marching::threshold(b.leave.0[i], half, f.cone, f.rounding);
        let outside = b.side.0[i] > 0.0;
        let nearest = if outside { low.0[i] } else { -high.0[i] };
        let clear = nearest * factor > enough * marching::LEFT as f32;
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

widest! {
    /// Lets those rays through that bounds of the field and its gradient keep from meeting anything, and
    /// ends those that come to one root for certain; what is left of the others in the leaf has the slopes
    /// found here.
    pub(super) fn conclude(
        frame: &Frame, found: &Steepness, count: usize, inside: &mut Inside,
    ) = conclude_body;
}

#[inline(always)]
fn conclude_body(f: &Frame, found: &Steepness, count: usize, b: &mut Inside) {
    for i in 0..whole_chunks(count) {
        let way = [b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]];
        let gradient = std::array::from_fn(|axis| found.gradient[axis].each_ref().map(|c| c.0[i]));
        let change = change(gradient, found.slope.0[i], way, b.side.0[i]);
        let known = found.slope.0[i] < f32::INFINITY;
        let (t, until, leave) = (b.t.0[i], b.until.0[i], b.leave.0[i]);
        // From the leaf's slope to the one found here.
        let slope = Real::min(change.slope, b.slope.0[i]);
        let ratio = b.slope.0[i] / slope;
        let radius = b.radius.0[i] * ratio;
        let scale = f.inverse_slope / slope;
        let (least, most) = (change.steady * scale, change.fall * scale);
        let way = until - t;
        let half = camera::half_pixel(until, f.footprint, f.footprint_growth);
        let enough = marching::threshold(until, half, f.cone, f.rounding) * marching::LEFT as f32;
        let outside = b.side.0[i] > 0.0;
        let nearest = if outside {
            found.range[0].0[i]
        } else {
            -found.range[1].0[i]
        };
        let whole = known & (until >= leave);
        let clear = whole & ((nearest * scale > enough) | (radius - most * way > enough));
        let certain = known & (most < least * UNEVEN) & (radius > 0.0) & (radius < least * way);
        let before = radius + (least + most) * 0.5 * way;
        b.outcome.0[i] = if clear {
            outcome::THROUGH
        } else if certain {
            outcome::HIT
        } else {
            outcome::UNDER_WAY
        };
        let select = |condition: bool, new: f32, old: f32| if condition { new } else { old };
        let anew = whole | certain;
        b.slope.0[i] = select(anew, slope, b.slope.0[i]);
        b.fall.0[i] = select(anew, change.fall, b.fall.0[i]);
        b.steady.0[i] = select(anew, change.steady, b.steady.0[i]);
        b.radius_before.0[i] *= select(anew, ratio, 1.0);
        let trend = b.trend.0[i] * select(anew, ratio, 1.0);
        b.trend.0[i] = Real::min(Real::max(trend, -1.0), marching::STEEPEST as f32);
        let step = radius * 2.0 / (1.0 - b.trend.0[i]);
        b.step.0[i] = select(anew, Real::min(step, leave - t), b.step.0[i]);
        b.t_before.0[i] = select(certain, t - way, b.t_before.0[i]);
        b.radius_before.0[i] = select(certain, before, b.radius_before.0[i]);
        // What is clear is a ball around the last point; nothing is known beyond the leaf.
        let radius = select(anew, radius, b.radius.0[i]);
        b.t.0[i] = select(clear, (t + leave) * 0.5, t);
        b.radius.0[i] = select(clear, (leave - t) * 0.5 / b.slope.0[i], radius);
    }
}
