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
        phase, value, beyond, gradient_x, gradient_y, gradient_z,
    }
}

/// Surfaces that are looked around from: over the hemisphere, or (`MANY` is false) along the
/// normal; with values of raw fields checked before they are taken for distances (`RAW`), or not. Items are
/// places in the tile.
pub(super) struct Look<'a, const MANY: bool, const RAW: bool> {
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

impl<const MANY: bool, const RAW: bool> Look<'_, MANY, RAW> {
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
}

impl<const MANY: bool, const RAW: bool> Walk for Look<'_, MANY, RAW> {
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
        b.slope.0[lane] = if RAW { self.slopes[item] } else { 1.0 };
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
        if RAW && any(&b.phase) {
            for i in (0..LANES).filter(|&i| b.phase.0[i] > 0.0) {
                let value = b.value.0[i];
                let at = V3::of(points[0].0[i], points[1].0[i], points[2].0[i]);
                let apart = claim::apart::<f32>(value, at);
                let p = claim::place::<f32>(
                    at,
                    V3::splat(0.0),
                    b.phase.0[i],
                    value,
                    gradient_of(b, i),
                    apart,
                );
                points[0].0[i] = p.x;
                points[1].0[i] = p.y;
                points[2].0[i] = p.z;
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
        if RAW && any(&b.phase) {
            for (i, checking) in checking.iter_mut().enumerate() {
                let field = fields.0[i];
                if (b.phase.0[i] == 0.0) | is_nan(field) {
                    continue;
                }
                match check(b, i, field, self.tap(b, i)) {
                    Some(distance) => fields.0[i] = distance,
                    None => *checking = true,
                }
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
            let fresh = RAW & !checking[i] & (b.phase.0[i] == 0.0);
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
            let gradient = |old: f32| if claims { 0.0 } else { old };
            b.gradient_x.0[i] = gradient(b.gradient_x.0[i]);
            b.gradient_y.0[i] = gradient(b.gradient_y.0[i]);
            b.gradient_z.0[i] = gradient(b.gradient_z.0[i]);
            let next = if goes_on { index } else { index + 1.0 };
            b.index.0[i] = next;
            *ended = next >= count;
        }
    }

    fn end(&mut self, item: u32, b: &OcclusionLanes, lane: usize) {
        self.open[item as usize] = occlusion::open(b.hidden.0[lane], self.frame.occlusion_weight);
    }
}

/// What is known of the gradient in a lane.
#[inline(always)]
fn gradient_of(b: &OcclusionLanes, i: usize) -> V3<f32> {
    V3::of(b.gradient_x.0[i], b.gradient_y.0[i], b.gradient_z.0[i])
}

/// Takes an evaluation for the check of a claim into account; the phases are those of [`claim`]. Gives how far
/// a surface is, once that is known.
fn check(b: &mut OcclusionLanes, i: usize, field: f32, tap: V3<f32>) -> Option<f32> {
    let (phase, value) = (b.phase.0[i], b.value.0[i]);
    if phase < 3.5 {
        let apart = claim::apart::<f32>(value, tap);
        let gradient = claim::gradient::<f32>(gradient_of(b, i), phase, field - value, apart);
        b.gradient_x.0[i] = gradient.x;
        b.gradient_y.0[i] = gradient.y;
        b.gradient_z.0[i] = gradient.z;
        b.phase.0[i] = phase + 1.0;
        return None;
    }
    if claim::decided(phase, claim::LAST_ROUND, value, field, b.beyond.0[i], 1.0) == 0.0 {
        b.beyond.0[i] = field;
        b.phase.0[i] = claim::LAST_PHASE;
        return None;
    }
    let gradient = gradient_of(b, i);
    Some(claim::distance::<f32>(
        value,
        gradient,
        V3::splat(0.0),
        phase,
        field,
        b.beyond.0[i],
        1.0,
    ))
}
