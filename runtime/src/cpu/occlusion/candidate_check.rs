//! Checks of occluder candidates at taps: whether a surface is as near as the field says, by the phases of
//! [`candidate`].

use super::super::probe_turns::{is_probe, probes_next, waiting_lanes};
use super::super::ray_tasks::{
    ColumnChoice, RayTask, is_nan, lane_vector, lanes, run_streamed, set_lane_vector, store_point,
};
use super::super::{Evaluator, F32x64, FieldQuantity, LANES, Points};
use super::OcclusionTap;
use crate::cells::Aabb;
use sdfc_shaders::{candidate, occlusion};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// Largest distance from a tap at which its candidate is probed, in candidate limits: two steps, and the taps
/// beside them.
const MAX_PROBE_LIMITS: f32 = 2.1;
/// Least distance of the same, as a fraction of the coordinates: the taps that measure gradients.
const MIN_PROBE_FRACTION: f32 = 4e-5;

/// A tap whose value makes a nearby surface possible.
pub(super) struct OccluderCandidate {
    item: u32,
    tap: OcclusionTap,
    value: f32,
    side: f32,
    open_margin: f32,
}

impl OccluderCandidate {
    /// Creates a candidate. `value` is positive outside the solid; where `side` is −1, it is the negated
    /// field.
    pub(super) fn new(
        item: u32,
        tap: OcclusionTap,
        value: f32,
        side: f32,
        open_margin: f32,
    ) -> Self {
        Self {
            item,
            tap,
            value,
            side,
            open_margin,
        }
    }

    /// Returns the largest distance at which a surface hides anything.
    fn limit(&self) -> f32 {
        occlusion::candidate_limit(self.tap.height)
    }
}

lanes! {
    /// Candidates under check.
    CheckLanes {
        x, y, z, limit, side, value, phase, round, gradient_x, gradient_y, gradient_z,
        offset_x, offset_y, offset_z, face_x, face_y, face_z, distance,
    }
}

/// Adds the occlusion by candidates to the pixels' sums; returns the number of evaluations.
pub(super) fn check_candidates(
    candidates: &[OccluderCandidate],
    hidden: &mut [f32],
    evaluator: &mut dyn Evaluator,
) -> u64 {
    let items: Vec<u32> = (0..candidates.len() as u32).collect();
    let mut checks = CandidateChecks {
        candidates,
        hidden_weights: vec![0.0; candidates.len()],
    };
    let evaluations = run_checks(&mut checks, &items, evaluator);
    // In the order of the taps, whatever the order in which checks end.
    for (candidate, weight) in candidates.iter().zip(checks.hidden_weights) {
        hidden[candidate.item as usize] += weight;
    }
    evaluations
}

/// Runs checks, grouped by regions if the evaluator takes a block at a time; returns the number of evaluations.
fn run_checks(
    checks: &mut CandidateChecks<'_>,
    items: &[u32],
    evaluator: &mut dyn Evaluator,
) -> u64 {
    if evaluator.preferred_blocks(FieldQuantity::Distances) > 1 {
        return run_streamed(checks, evaluator, items);
    }
    let regions: Vec<Aabb> = checks.candidates.chunks(LANES).map(probe_region).collect();
    evaluator.prune_for_regions(FieldQuantity::Distances, &regions);
    let check_chunk = |(probe_region, items): (usize, &[u32])| {
        evaluator.select_region(Some(probe_region));
        run_streamed(checks, evaluator, items)
    };
    let evaluations = items.chunks(LANES).enumerate().map(check_chunk).sum();
    evaluator.select_region(None);
    evaluations
}

/// Returns the box in which candidates are probed.
fn probe_region(candidates: &[OccluderCandidate]) -> Aabb {
    let limit = candidates
        .iter()
        .map(OccluderCandidate::limit)
        .fold(0.0, f32::max);
    let Aabb { low, high } = Aabb::around(
        candidates
            .iter()
            .map(|candidate| candidate.tap.point.to_array()),
    );
    let max_coordinate = low.iter().chain(&high).fold(0.0, |max, v| v.abs().max(max));
    let margin = limit * MAX_PROBE_LIMITS + max_coordinate * MIN_PROBE_FRACTION;
    Aabb {
        low: low.map(|v| v - margin),
        high: high.map(|v| v + margin),
    }
}

/// Checks of candidates; items are indices in their list.
struct CandidateChecks<'a> {
    candidates: &'a [OccluderCandidate],
    hidden_weights: Vec<f32>,
}

impl RayTask for CandidateChecks<'_> {
    type Block = CheckLanes;

    fn begin(&mut self, item: u32, block: &mut CheckLanes, lane: usize) -> bool {
        let candidate = &self.candidates[item as usize];
        set_lane_vector!(block, lane, x, y, z, candidate.tap.point);
        block.limit.0[lane] = candidate.limit();
        block.side.0[lane] = candidate.side;
        block.value.0[lane] = candidate.value;
        block.phase.0[lane] = 1.0;
        block.round.0[lane] = 0.0;
        block.gradient_x.0[lane] = 0.0;
        block.gradient_y.0[lane] = 0.0;
        block.gradient_z.0[lane] = 0.0;
        block.face_x.0[lane] = 0.0;
        block.face_y.0[lane] = 0.0;
        block.face_z.0[lane] = 0.0;
        block.offset_x.0[lane] = 0.0;
        block.offset_y.0[lane] = 0.0;
        block.offset_z.0[lane] = 0.0;
        true
    }

    #[inline(always)]
    fn waiting_lanes(&self, block: &CheckLanes, _is_divergent: bool) -> u64 {
        waiting_lanes(&block.phase)
    }

    #[inline(always)]
    fn points(&self, block: &CheckLanes, points: &mut Points) {
        match probes_next(&block.phase) {
            true => check_points::<true>(block, points),
            false => check_points::<false>(block, points),
        }
    }

    #[inline(always)]
    fn advance(&self, block: &mut CheckLanes, values: &F32x64, ended: &mut [bool; LANES]) {
        match probes_next(&block.phase) {
            true => advance_checks::<true>(block, values, ended),
            false => advance_checks::<false>(block, values, ended),
        }
    }

    fn end(&mut self, item: u32, block: &CheckLanes, lane: usize) {
        let candidate = &self.candidates[item as usize];
        let OcclusionTap {
            distance,
            height,
            weight,
            ..
        } = candidate.tap;
        let field = block.distance.0[lane] + candidate.open_margin;
        self.hidden_weights[item as usize] =
            occlusion::hidden_weight(field, height, distance, weight);
    }
}

/// Computes the points of checks. With `PROBES` those of probes matter, else those of the phases before.
#[inline(always)]
fn check_points<const PROBES: bool>(block: &CheckLanes, points: &mut Points) {
    for i in 0..LANES {
        let (phase, value, limit) = (block.phase.0[i], block.value.0[i], block.limit.0[i]);
        let point = round_point(block, i);
        let p = if PROBES {
            let (offset, face) = (lane_offset(block, i), lane_face(block, i));
            let gradient = lane_gradient(block, i);
            candidate::probe_point::<f32>(point, offset, face, phase, value, gradient, limit)
        } else {
            candidate::tap_point::<f32>(point, phase, value, limit)
        };
        store_point(points, i, p);
    }
}

/// Advances checks by the field's values. With `PROBES` those in probes advance, else the others.
#[inline(always)]
fn advance_checks<const PROBES: bool>(
    block: &mut CheckLanes,
    values: &F32x64,
    ended: &mut [bool; LANES],
) {
    let choice = ColumnChoice::new();
    for (i, ended) in ended.iter_mut().enumerate() {
        let field = values.0[i] * block.side.0[i];
        let (phase, value, limit) = (block.phase.0[i], block.value.0[i], block.limit.0[i]);
        let (point, offset, gradient) = (
            round_point(block, i),
            lane_offset(block, i),
            lane_gradient(block, i),
        );
        let is_probing = PROBES & is_probe(phase);
        let is_tap = !PROBES & !is_probe(phase);
        let advances = is_probing | is_tap;
        let tap_distance = candidate::tap_distance::<f32>(value, point, limit);
        let new_gradient = candidate::add_tap::<f32>(gradient, phase, field - value, tap_distance);
        let next = candidate::next_offset::<f32>(
            point,
            offset,
            lane_face(block, i),
            phase,
            value,
            gradient,
            limit,
        );
        let round = block.round.0[i];
        let outcome = candidate::probe_outcome::<f32>(
            point,
            gradient,
            round,
            phase,
            value,
            field,
            offset,
            lane_face(block, i),
            next,
            limit,
        );
        let is_repeat = is_probing & (outcome == 0.0);
        let goes_back = is_probing & (outcome > candidate::MIN_PHASE_OUTCOME);
        let surface_offset = candidate::surface_offset::<f32>(offset, next, value, field);
        let distance = if outcome > 0.0 {
            surface_offset.length()
        } else {
            candidate::NO_SURFACE
        };
        let restart_value = candidate::restart_value::<f32>(field);
        let is_nan_value = is_nan(field);
        // NaN hides nothing.
        let distance = if is_nan_value {
            candidate::NO_SURFACE
        } else {
            distance
        };
        block.distance.0[i] = choice.choose(advances, distance, block.distance.0[i]);
        let gradient_part = |new: f32, old: f32| {
            let kept = choice.choose(is_probing & !goes_back, 0.0, old);
            choice.choose(is_tap, new, kept)
        };
        block.gradient_x.0[i] = gradient_part(new_gradient.x, gradient.x);
        block.gradient_y.0[i] = gradient_part(new_gradient.y, gradient.y);
        block.gradient_z.0[i] = gradient_part(new_gradient.z, gradient.z);
        let if_repeat = |new: f32, old: f32| choice.choose(is_repeat, new, old);
        block.offset_x.0[i] = if_repeat(next.x, offset.x);
        block.offset_y.0[i] = if_repeat(next.y, offset.y);
        block.offset_z.0[i] = if_repeat(next.z, offset.z);
        let face = lane_face(block, i);
        block.face_x.0[i] = if_repeat(gradient.x, face.x);
        block.face_y.0[i] = if_repeat(gradient.y, face.y);
        block.face_z.0[i] = if_repeat(gradient.z, face.z);
        block.value.0[i] = if_repeat(restart_value, value);
        block.round.0[i] += if is_repeat { 1.0 } else { 0.0 };
        let later_phase = if goes_back { outcome } else { 1.0 };
        let probed_phase = choice.choose(is_probing, later_phase, phase);
        block.phase.0[i] = if is_tap { phase + 1.0 } else { probed_phase };
        *ended = advances & (is_nan_value | (is_probing & !is_repeat & !goes_back));
    }
}

/// Returns the point of the candidate's round in a lane.
#[inline(always)]
fn round_point(block: &CheckLanes, i: usize) -> V3<f32> {
    lane_vector!(block, i, x, y, z) + lane_offset(block, i)
}

/// Returns the part of the gradient in a lane that is measured so far.
#[inline(always)]
fn lane_gradient(block: &CheckLanes, i: usize) -> V3<f32> {
    lane_vector!(block, i, gradient_x, gradient_y, gradient_z)
}

/// Returns the offset from the tap in a lane to the point of the candidate's round.
#[inline(always)]
fn lane_offset(block: &CheckLanes, i: usize) -> V3<f32> {
    lane_vector!(block, i, offset_x, offset_y, offset_z)
}

/// Returns the gradient of the round before the present one in a lane, zero in the first round.
#[inline(always)]
fn lane_face(block: &CheckLanes, i: usize) -> V3<f32> {
    lane_vector!(block, i, face_x, face_y, face_z)
}
