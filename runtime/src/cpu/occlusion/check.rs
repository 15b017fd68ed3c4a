//! Checks of what taps claim: whether a surface is as near as the field says, by the phases of [`claim`].

use super::super::lanes::{Walk, is_nan, lanes, stream};
use super::super::normal::around;
use super::super::{Asked, Column, Evaluator, LANES, Points};
use super::Tap;
use crate::cells::Region;
use sdfc_shaders::{claim, occlusion};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// The farthest point from a tap at which its claim is checked, in limits: two ways, and what is beside them.
const FARTHEST: f32 = 2.1;
/// The same at least, as a fraction of the coordinates: the points by which gradients are found.
const BESIDE: f32 = 4e-5;

/// A tap whose value says that something is near.
pub(super) struct Claim {
    item: u32,
    tap: Tap,
    value: f32,
    side: f32,
    unsure: f32,
}

impl Claim {
    /// The claim of a value outside of the solid, which lies below zero where `side` is −1.
    pub(super) fn new(item: u32, tap: Tap, value: f32, side: f32, unsure: f32) -> Self {
        Self {
            item,
            tap,
            value,
            side,
            unsure,
        }
    }

    /// The largest distance of a surface that hides something.
    fn limit(&self) -> f32 {
        occlusion::limit(self.tap.height)
    }
}

lanes! {
    /// Claims that are checked.
    CheckLanes {
        x, y, z, limit, side, value, phase, round, gradient_x, gradient_y, gradient_z,
        offset_x, offset_y, offset_z, distance,
    }
}

/// Adds what the claims hide to the pixels' sums; gives the number of evaluations.
pub(super) fn all(claims: &[Claim], hidden: &mut [f32], evaluator: &mut dyn Evaluator) -> u64 {
    let items: Vec<u32> = (0..claims.len() as u32).collect();
    let mut checks = Checks { claims, hidden };
    if evaluator.blocks(Asked::Distances) > 1 {
        return stream(&mut checks, evaluator, &items);
    }
    let regions: Vec<Region> = claims.chunks(LANES).map(region).collect();
    evaluator.announce(Asked::Distances, &regions);
    let each = |(region, items): (usize, &[u32])| {
        evaluator.focus(Some(region));
        stream(&mut checks, evaluator, items)
    };
    let evaluations = items.chunks(LANES).enumerate().map(each).sum();
    evaluator.focus(None);
    evaluations
}

/// The box in which claims are checked.
fn region(claims: &[Claim]) -> Region {
    let limit = claims.iter().map(Claim::limit).fold(0.0, f32::max);
    let Region { low, high } = around(claims.iter().map(|claim| claim.tap.at));
    let size = low
        .iter()
        .chain(&high)
        .fold(0.0, |size, v| v.abs().max(size));
    let reach = limit * FARTHEST + size * BESIDE;
    Region {
        low: low.map(|v| v - reach),
        high: high.map(|v| v + reach),
    }
}

/// Checks of claims; items are places in their list.
struct Checks<'a> {
    claims: &'a [Claim],
    hidden: &'a mut [f32],
}

impl Walk for Checks<'_> {
    type Block = CheckLanes;

    fn begin(&mut self, item: u32, b: &mut CheckLanes, lane: usize) -> bool {
        let claim = &self.claims[item as usize];
        b.x.0[lane] = claim.tap.at.x;
        b.y.0[lane] = claim.tap.at.y;
        b.z.0[lane] = claim.tap.at.z;
        b.limit.0[lane] = claim.limit();
        b.side.0[lane] = claim.side;
        b.value.0[lane] = claim.value;
        b.phase.0[lane] = 1.0;
        b.round.0[lane] = 0.0;
        b.gradient_x.0[lane] = 0.0;
        b.gradient_y.0[lane] = 0.0;
        b.gradient_z.0[lane] = 0.0;
        b.offset_x.0[lane] = 0.0;
        b.offset_y.0[lane] = 0.0;
        b.offset_z.0[lane] = 0.0;
        true
    }

    #[inline(always)]
    fn points(&self, b: &CheckLanes, points: &mut Points) {
        for i in 0..LANES {
            let (at, offset, gradient) = (place_of(b, i), offset_of(b, i), gradient_of(b, i));
            let (phase, value, limit) = (b.phase.0[i], b.value.0[i], b.limit.0[i]);
            let p = claim::place::<f32>(at, offset, phase, value, gradient, limit);
            points[0].0[i] = p.x;
            points[1].0[i] = p.y;
            points[2].0[i] = p.z;
        }
    }

    #[inline(always)]
    fn advance(&self, b: &mut CheckLanes, values: &Column, ended: &mut [bool; LANES]) {
        for (i, ended) in ended.iter_mut().enumerate() {
            let field = values.0[i] * b.side.0[i];
            let (phase, value, limit) = (b.phase.0[i], b.value.0[i], b.limit.0[i]);
            let (at, offset, gradient) = (place_of(b, i), offset_of(b, i), gradient_of(b, i));
            let measures = phase < 3.5;
            let apart = claim::apart::<f32>(value, at, limit);
            let measured = claim::gradient::<f32>(gradient, phase, field - value, apart);
            let next = claim::offset::<f32>(at, offset, phase, value, gradient, limit);
            let round = b.round.0[i];
            let outcome = claim::outcome::<f32>(
                at, gradient, round, phase, value, field, offset, next, limit,
            );
            let repeats = !measures & (outcome == 0.0);
            let shortens = !measures & (outcome == claim::TOO_FAR);
            let way = claim::surface::<f32>(offset, next, value, field);
            let found = if outcome > 0.0 {
                way.length()
            } else {
                claim::NOTHING
            };
            let repeated = claim::repeated::<f32>(field);
            let nan = is_nan(field);
            // What is no number hides nothing.
            b.distance.0[i] = if nan { claim::NOTHING } else { found };
            let left = if shortens { gradient } else { V3::splat(0.0) };
            b.gradient_x.0[i] = if measures { measured.x } else { left.x };
            b.gradient_y.0[i] = if measures { measured.y } else { left.y };
            b.gradient_z.0[i] = if measures { measured.z } else { left.z };
            b.offset_x.0[i] = if repeats { next.x } else { offset.x };
            b.offset_y.0[i] = if repeats { next.y } else { offset.y };
            b.offset_z.0[i] = if repeats { next.z } else { offset.z };
            b.value.0[i] = if repeats { repeated } else { value };
            b.round.0[i] += if repeats { 1.0 } else { 0.0 };
            b.phase.0[i] = if measures | shortens {
                phase + 1.0
            } else {
                1.0
            };
            *ended = nan | (!measures & !repeats & !shortens);
        }
    }

    fn end(&mut self, item: u32, b: &CheckLanes, lane: usize) {
        let claim = &self.claims[item as usize];
        let Tap {
            distance,
            height,
            weight,
            ..
        } = claim.tap;
        let field = b.distance.0[lane] + claim.unsure;
        self.hidden[claim.item as usize] += occlusion::hidden(field, height, distance, weight);
    }
}

/// The place of the round in a lane.
#[inline(always)]
fn place_of(b: &CheckLanes, i: usize) -> V3<f32> {
    V3::of(b.x.0[i], b.y.0[i], b.z.0[i]) + offset_of(b, i)
}

/// The part of the gradient in a lane that is found so far.
#[inline(always)]
fn gradient_of(b: &CheckLanes, i: usize) -> V3<f32> {
    V3::of(b.gradient_x.0[i], b.gradient_y.0[i], b.gradient_z.0[i])
}

/// The way from the tap in a lane to the place of the claim's round.
#[inline(always)]
fn offset_of(b: &CheckLanes, i: usize) -> V3<f32> {
    V3::of(b.offset_x.0[i], b.offset_y.0[i], b.offset_z.0[i])
}
