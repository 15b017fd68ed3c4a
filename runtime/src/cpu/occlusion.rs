//! The stage `occlusion`: how much of the sky surfaces see.

use super::lanes::{Walk, any, is_nan, lanes};
use super::march::vector;
use super::{Column, LANES, Points};
use sdfc_shaders::layout::{Frame, Ray};
use sdfc_shaders::marching::{self, FROM_INSIDE};
use sdfc_shaders::{camera, claim, occlusion};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

lanes! {
    /// Surfaces that are looked around from.
    OcclusionLanes {
        x, y, z, normal_x, normal_y, normal_z, place_x, place_y, hidden, index, side, unsure, slope,
        phase, round, value, gradient_x, gradient_y, gradient_z, offset_x, offset_y, offset_z,
    }
}

/// Surfaces that are looked around from: over the hemisphere, or (`MANY` is false) along the
/// normal; with values checked before they are taken for distances (`CHECKED`), or not. Items are places in the tile.
pub(super) struct Look<'a, const MANY: bool, const CHECKED: bool> {
    pub(super) frame: &'a Frame,
    pub(super) taps: u32,
    pub(super) pixels: &'a [[f32; 2]],
    pub(super) points: &'a [V3<f32>],
    pub(super) rays: &'a [Ray],
    pub(super) normals: &'a [[f32; 3]],
    /// The lengths of the gradients there.
    pub(super) slopes: &'a [f32],
    pub(super) open: &'a mut [f32],
}

impl<const MANY: bool, const CHECKED: bool> Look<'_, MANY, CHECKED> {
    /// The place of the tap in a lane.
    #[inline(always)]
    fn tap(&self, b: &OcclusionLanes, i: usize) -> V3<f32> {
        let (count, pass) = (self.taps as f32, self.frame.sample as f32);
        let p = V3::of(b.x.0[i], b.y.0[i], b.z.0[i]);
        let normal = V3::of(b.normal_x.0[i], b.normal_y.0[i], b.normal_z.0[i]);
        let place = V3::of(b.place_x.0[i], b.place_y.0[i], pass);
        let (index, reach) = (b.index.0[i], self.frame.occlusion_reach);
        let (direction, distance) = if MANY {
            (
                occlusion::many_direction::<f32>(normal, index, count, place),
                occlusion::many_distance(index, place, reach),
            )
        } else {
            (normal, occlusion::five_distance(index, reach))
        };
        camera::along::<f32>(p, direction, distance)
    }

    /// The height of the tap in a lane above a plane through the surface.
    #[inline(always)]
    fn height(&self, b: &OcclusionLanes, i: usize) -> f32 {
        let (index, reach) = (b.index.0[i], self.frame.occlusion_reach);
        if !MANY {
            return occlusion::five_distance(index, reach);
        }
        let pass = self.frame.sample as f32;
        let place = V3::of(b.place_x.0[i], b.place_y.0[i], pass);
        let distance = occlusion::many_distance(index, place, reach);
        distance * occlusion::many_cosine(index, self.taps as f32)
    }
}

impl<const MANY: bool, const CHECKED: bool> Walk for Look<'_, MANY, CHECKED> {
    type Block = OcclusionLanes;

    fn begin(&mut self, item: u32, b: &mut OcclusionLanes, lane: usize) -> bool {
        let item = item as usize;
        let (p, normal) = (self.points[item], vector(self.normals[item]));
        b.x.0[lane] = p.x;
        b.y.0[lane] = p.y;
        b.z.0[lane] = p.z;
        b.normal_x.0[lane] = normal.x;
        b.normal_y.0[lane] = normal.y;
        b.normal_z.0[lane] = normal.z;
        [b.place_x.0[lane], b.place_y.0[lane]] = self.pixels[item];
        b.slope.0[lane] = if CHECKED { self.slopes[item] } else { 1.0 };
        b.phase.0[lane] = 0.0;
        b.value.0[lane] = 0.0;
        b.hidden.0[lane] = 0.0;
        b.index.0[lane] = 0.0;
        // What rounding may take from the field counts as open.
        b.unsure.0[lane] = marching::rounding_at(self.rays[item].t, self.frame.rounding);
        b.side.0[lane] = if self.rays[item].status & FROM_INSIDE != 0 {
            -1.0
        } else {
            1.0
        };
        true
    }

    #[inline(always)]
    fn points(&self, b: &OcclusionLanes, points: &mut Points) {
        for i in 0..LANES {
            let at = self.tap(b, i);
            points[0].0[i] = at.x;
            points[1].0[i] = at.y;
            points[2].0[i] = at.z;
        }
        if CHECKED && any(&b.phase) {
            for i in 0..LANES {
                let (phase, value, offset) = (b.phase.0[i], b.value.0[i], offset_of(b, i));
                let tap = V3::of(points[0].0[i], points[1].0[i], points[2].0[i]);
                let limit = occlusion::limit(self.height(b, i));
                let gradient = gradient_of(b, i);
                let p = claim::place::<f32>(tap + offset, offset, phase, value, gradient, limit);
                let checking = phase > 0.0;
                points[0].0[i] = if checking { p.x } else { tap.x };
                points[1].0[i] = if checking { p.y } else { tap.y };
                points[2].0[i] = if checking { p.z } else { tap.z };
            }
        }
    }

    #[inline(always)]
    fn advance(&self, b: &mut OcclusionLanes, values: &Column, ended: &mut [bool; LANES]) {
        let (count, pass) = (self.taps as f32, self.frame.sample as f32);
        let reach = self.frame.occlusion_reach;
        let mut fields = Column([0.0; LANES]);
        for i in 0..LANES {
            fields.0[i] = values.0[i] * b.side.0[i];
        }
        let mut checking = [false; LANES];
        if CHECKED && any(&b.phase) {
            for (i, checking) in checking.iter_mut().enumerate() {
                let limit = occlusion::limit(self.height(b, i));
                (*checking, fields.0[i]) = check(b, i, fields.0[i], self.tap(b, i), limit);
            }
        }
        for (i, ended) in ended.iter_mut().enumerate() {
            let index = b.index.0[i];
            let field = fields.0[i];
            let (distance, height, weight) = if MANY {
                let place = V3::of(b.place_x.0[i], b.place_y.0[i], pass);
                let distance = occlusion::many_distance(index, place, reach);
                (
                    distance,
                    distance * occlusion::many_cosine(index, count),
                    1.0,
                )
            } else {
                let distance = occlusion::five_distance(index, reach);
                (distance, distance, occlusion::five_weight(index))
            };
            let nan = is_nan(field);
            let fresh = CHECKED & !checking[i] & (b.phase.0[i] == 0.0);
            let claims = fresh & (occlusion::claims(field, height, b.slope.0[i]) > 0.0);
            // What claims nothing hides nothing.
            let clear = fresh & !claims & (field > 0.0);
            let goes_on = claims | checking[i];
            let field = if clear { height } else { field };
            let hidden = occlusion::hidden(field + b.unsure.0[i], height, distance, weight);
            b.value.0[i] = if claims { fields.0[i] } else { b.value.0[i] };
            b.hidden.0[i] += if nan | goes_on { 0.0 } else { hidden };
            let phase = if checking[i] { b.phase.0[i] } else { 0.0 };
            b.phase.0[i] = if claims { 1.0 } else { phase };
            let zeroed = |old: f32| if claims { 0.0 } else { old };
            b.gradient_x.0[i] = zeroed(b.gradient_x.0[i]);
            b.gradient_y.0[i] = zeroed(b.gradient_y.0[i]);
            b.gradient_z.0[i] = zeroed(b.gradient_z.0[i]);
            b.offset_x.0[i] = zeroed(b.offset_x.0[i]);
            b.offset_y.0[i] = zeroed(b.offset_y.0[i]);
            b.offset_z.0[i] = zeroed(b.offset_z.0[i]);
            b.round.0[i] = zeroed(b.round.0[i]);
            let next = if goes_on { index } else { index + 1.0 };
            b.index.0[i] = next;
            *ended = next >= count;
        }
    }

    fn end(&mut self, item: u32, b: &OcclusionLanes, lane: usize) {
        self.open[item as usize] = occlusion::open(b.hidden.0[lane], self.frame.occlusion_weight);
    }
}

/// The part of the gradient in a lane that is found so far.
#[inline(always)]
fn gradient_of(b: &OcclusionLanes, i: usize) -> V3<f32> {
    V3::of(b.gradient_x.0[i], b.gradient_y.0[i], b.gradient_z.0[i])
}

/// The way from the tap in a lane to the place of the claim's round.
#[inline(always)]
fn offset_of(b: &OcclusionLanes, i: usize) -> V3<f32> {
    V3::of(b.offset_x.0[i], b.offset_y.0[i], b.offset_z.0[i])
}

/// Takes an evaluation for the check of a claim into account; the phases are those of [`claim`]. Reports whether the
/// check goes on, and gives the distance of a surface once it is known. A lane that checks nothing, or whose `field`
/// is not a number, keeps that.
#[inline(always)]
fn check(b: &mut OcclusionLanes, i: usize, field: f32, tap: V3<f32>, limit: f32) -> (bool, f32) {
    let (phase, value) = (b.phase.0[i], b.value.0[i]);
    let (gradient, offset) = (gradient_of(b, i), offset_of(b, i));
    let at = tap + offset;
    let checks = (phase > 0.0) & !is_nan(field);
    let measures = checks & (phase < 3.5);
    let apart = claim::apart::<f32>(value, at, limit);
    let measured = claim::gradient::<f32>(gradient, phase, field - value, apart);
    let next = claim::offset::<f32>(at, offset, value, gradient, limit);
    let outcome = claim::outcome::<f32>(at, gradient, b.round.0[i], value, field, next, limit);
    let repeats = checks & !measures & (outcome == 0.0);
    let way = claim::surface::<f32>(offset, next, value, field);
    let distance = if outcome > 0.0 {
        way.length()
    } else {
        claim::NOTHING
    };
    let either = |measured: f32, repeated: f32, old: f32| {
        let old = if repeats { repeated } else { old };
        if measures { measured } else { old }
    };
    b.gradient_x.0[i] = either(measured.x, 0.0, gradient.x);
    b.gradient_y.0[i] = either(measured.y, 0.0, gradient.y);
    b.gradient_z.0[i] = either(measured.z, 0.0, gradient.z);
    b.phase.0[i] = either(phase + 1.0, 1.0, phase);
    b.offset_x.0[i] = if repeats { next.x } else { offset.x };
    b.offset_y.0[i] = if repeats { next.y } else { offset.y };
    b.offset_z.0[i] = if repeats { next.z } else { offset.z };
    b.value.0[i] = if repeats { field } else { value };
    b.round.0[i] += if repeats { 1.0 } else { 0.0 };
    let goes_on = measures | repeats;
    let known = checks & !goes_on;
    (goes_on, if known { distance } else { field })
}
