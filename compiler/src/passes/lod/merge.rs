//! Replaces operands of a union by a box, where together they differ from the box around them by about
//! a pixel at most.
//!
//! Each point of the box is within the error of what it replaces. So outside of it their values differ by at
//! most that, where they change no faster than the point moves. Inside, the box is deeper than what it
//! replaces, so subtracted operands are never replaced. Operands of a hard union are merged wherever they are
//! in it. The set is cut along its longest side until the parts fit a box.

use super::probe::box_slack;
use super::sensitivity::{BlendRuns, Sensitivity, sensitivities};
use super::{LodTarget, in_world};
use crate::graph::{Graph, GraphNode, GraphNumber, NodeId};
use crate::passes::guards::influence::InfluenceBoxes;
use crate::passes::guards::operands::{ChainOperands, OperandChain};
use crate::passes::pass::rewrite_graph;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Cost of a box, in instructions; a single operand that costs no more is not replaced by one.
const BOX_COST: f64 = 1.5;
/// Maximum relative difference of a value from a distance for it to count as one.
const DISTANCE_TOLERANCE: f64 = 1e-3;
/// Maximum half diagonal of a candidate for a box, in multiples of the limit.
const MAX_CANDIDATE_RATIO: f64 = 1000.0;

/// Graph with boxes.
pub(super) struct MergeResult {
    pub(super) graph: Graph,
    /// Number of replaced operands, and of the boxes that replace them.
    pub(super) shapes: usize,
    pub(super) boxes: usize,
    /// Maximum error, in pixels.
    pub(super) pixels: f64,
}

/// A material assignment: its constants, and the channels that are computed.
type Paint = ([GraphNumber; 12], Vec<(u8, NodeId)>);

/// An operand that may be replaced.
#[derive(Clone)]
struct MergeCandidate {
    /// Index among the operands.
    index: usize,
    bounds: Bounds,
    /// Maximum distance of the points of its box from it.
    slack: f64,
    influence_band: f64,
    work: f64,
}

/// An operand of the new union.
enum UnionOperand {
    Kept(NodeId),
    Boxed(Bounds, Option<Paint>),
}

/// Returns the graph with boxes in place of shapes that differ from them by at most `limit` pixels.
pub(super) fn merge(graph: &Graph, target: &LodTarget, limit: f64) -> MergeResult {
    let influence_boxes = InfluenceBoxes::new(graph);
    let sensitivities = sensitivities(graph, &influence_boxes, &BlendRuns::new(graph));
    let mut merger = Merger {
        graph,
        target,
        limit,
        operands: ChainOperands::new(graph),
        paints: uniform_paints(graph),
        uses: graph.uses(),
        influence_boxes,
        sensitivities,
        covered: vec![false; graph.len()],
        shapes: 0,
        boxes: 0,
        pixels: 0.0,
    };
    let mut unions: HashMap<NodeId, Vec<UnionOperand>> = HashMap::new();
    let mut replacements: HashMap<NodeId, UnionOperand> = HashMap::new();
    // Outer chains first: inside of a replaced operand nothing is to be done.
    for chain in merger.operands.chains(true).into_iter().rev() {
        if merger.covered[chain.root.0 as usize] || chain.sign < 0.0 {
            continue;
        }
        if chain.is_reorderable {
            if let Some(pieces) = merger.merge_union(&chain) {
                unions.insert(chain.root, pieces);
            }
        } else {
            replacements.extend(merger.merge_blend(&chain));
        }
    }
    let mut new_ids = vec![NodeId::default(); graph.len()];
    let merged = rewrite_graph(graph, |to, id, node| {
        let new = match (unions.get(&id), replacements.get(&id)) {
            (Some(pieces), _) => {
                let operands = pieces.iter().map(|piece| add_operand(to, piece, &new_ids));
                let operands: Vec<NodeId> = operands.collect();
                let joined = operands.into_iter().reduce(|a, b| {
                    to.add(GraphNode::Apply {
                        op: Op::Union,
                        point: None,
                        values: vec![a, b],
                        parameters: Vec::new(),
                    })
                });
                joined.unwrap_or_else(|| to.add(node))
            }
            (None, Some(piece)) => add_operand(to, piece, &new_ids),
            (None, None) => to.add(node),
        };
        new_ids[id.0 as usize] = new;
        new
    });
    MergeResult {
        // Without the nodes that are now unused.
        graph: rewrite_graph(&merged, |to, _, node| to.add(node)),
        shapes: merger.shapes,
        boxes: merger.boxes,
        pixels: merger.pixels,
    }
}

/// Adds the node of an operand.
fn add_operand(to: &mut Graph, piece: &UnionOperand, new_ids: &[NodeId]) -> NodeId {
    let (bounds, paint) = match piece {
        UnionOperand::Kept(id) => return new_ids[id.0 as usize],
        UnionOperand::Boxed(bounds, paint) => (bounds, paint),
    };
    let constant = |v: f64| GraphNumber::Constant(v as f32);
    let world = to.add(GraphNode::World);
    let point = to.add(GraphNode::Moved {
        point: world,
        by: bounds.centre().map(|v| constant(-v)),
    });
    let half_size = |i: usize| constant((bounds.max[i] - bounds.min[i]) / 2.0);
    let value = to.add(GraphNode::Apply {
        op: Op::Cuboid,
        point: Some(point),
        values: Vec::new(),
        parameters: (0..3).map(half_size).collect(),
    });
    let Some((constants, channels)) = paint else {
        return value;
    };
    let channels = channels.iter().map(|&(c, id)| (c, new_ids[id.0 as usize]));
    let channels = channels.collect();
    to.add(GraphNode::Paint {
        value,
        constants: *constants,
        channels,
    })
}

struct Merger<'g> {
    graph: &'g Graph,
    target: &'g LodTarget,
    limit: f64,
    operands: ChainOperands<'g>,
    influence_boxes: InfluenceBoxes<'g>,
    sensitivities: Vec<Sensitivity>,
    paints: Vec<Option<Option<Paint>>>,
    uses: Vec<u32>,
    /// Nodes that belong to a replaced operand.
    covered: Vec<bool>,
    shapes: usize,
    boxes: usize,
    pixels: f64,
}

impl Merger<'_> {
    /// Replaces small operands of a hard union by boxes; `None` if there are none.
    fn merge_union(&mut self, chain: &OperandChain) -> Option<Vec<UnionOperand>> {
        // Only operands with the same paint are merged.
        let mut painted: Vec<(Option<Paint>, Vec<MergeCandidate>)> = Vec::new();
        for index in 0..chain.operands.len() {
            let Some((candidate, paint)) = self.candidate(&chain.operands, index) else {
                continue;
            };
            match painted
                .iter_mut()
                .find(|(known_paint, _)| *known_paint == paint)
            {
                Some((_, candidates)) => candidates.push(candidate),
                None => painted.push((paint, vec![candidate])),
            }
        }
        let mut operands: Vec<Option<UnionOperand>> = Vec::new();
        operands.extend(
            chain
                .operands
                .iter()
                .map(|&id| Some(UnionOperand::Kept(id))),
        );
        let mut has_boxes = false;
        for (paint, candidates) in painted {
            let mut pending = vec![candidates];
            while let Some(mut candidates) = pending.pop() {
                let Some(hull) = self.merged_box(&candidates) else {
                    if candidates.len() > 1 {
                        let half = candidates.len() / 2;
                        sort_along_longest_side(&mut candidates);
                        pending.push(candidates.split_off(half));
                        pending.push(candidates);
                    }
                    continue;
                };
                has_boxes = true;
                // The box takes the index of the first of them.
                let first = candidates.iter().map(|candidate| candidate.index).min();
                for candidate in &candidates {
                    let is_first = Some(candidate.index) == first;
                    let operand = is_first.then(|| UnionOperand::Boxed(hull, paint.clone()));
                    operands[candidate.index] = operand;
                    self.mark_covered(chain.operands[candidate.index]);
                }
                self.record_merge(&candidates, &hull);
            }
        }
        has_boxes.then(|| operands.into_iter().flatten().collect())
    }

    /// Replaces operands of a smooth union one by one.
    fn merge_blend(&mut self, chain: &OperandChain) -> Vec<(NodeId, UnionOperand)> {
        let operands: Vec<NodeId> = chain.first.iter().chain(&chain.operands).copied().collect();
        let mut replaced = Vec::new();
        for (index, &id) in operands.iter().enumerate() {
            if self.uses[id.0 as usize] != 1 {
                continue;
            }
            let Some((candidate, paint)) = self.candidate(&operands, index) else {
                continue;
            };
            let candidates = [candidate];
            if let Some(hull) = self.merged_box(&candidates) {
                replaced.push((id, UnionOperand::Boxed(hull, paint)));
                self.mark_covered(id);
                self.record_merge(&candidates, &hull);
            }
        }
        replaced
    }

    /// Returns an operand that may be replaced, and its paint.
    fn candidate(
        &self,
        operands: &[NodeId],
        index: usize,
    ) -> Option<(MergeCandidate, Option<Paint>)> {
        let id = operands[index];
        let paint = self.paints[id.0 as usize].clone()?;
        let (bounds, distance_ratio) = in_world(self.graph, &self.influence_boxes, id)?;
        let Sensitivity {
            gain,
            influence_band,
            sign_sensitive,
        } = self.sensitivities[id.0 as usize];
        let is_distance = (distance_ratio - 1.0).abs() < DISTANCE_TOLERANCE
            && (gain - 1.0).abs() < DISTANCE_TOLERANCE;
        if !is_distance || sign_sensitive || !bounds.is_finite() || !influence_band.is_finite() {
            return None;
        }
        // An operand that is far too long for a box need not be sampled.
        let min_error = self.in_pixels(bounds.half_diagonal(), &bounds, influence_band);
        if min_error > MAX_CANDIDATE_RATIO * self.limit {
            return None;
        }
        let operand = MergeCandidate {
            index,
            bounds,
            slack: box_slack(self.graph, id, &bounds)?,
            influence_band,
            work: self.operands.analyze(id, None).work,
        };
        (self.error(std::slice::from_ref(&operand), &bounds) <= self.limit)
            .then_some((operand, paint))
    }

    /// Returns the box for these operands, if they may be replaced.
    fn merged_box(&self, candidates: &[MergeCandidate]) -> Option<Bounds> {
        let hull = candidates.iter().fold(Bounds::EMPTY, |hull, candidate| {
            hull.hull(&candidate.bounds)
        });
        let work: f64 = candidates.iter().map(|candidate| candidate.work).sum();
        let is_profitable = candidates.len() > 1 || work > BOX_COST;
        (is_profitable && self.error(candidates, &hull) <= self.limit).then_some(hull)
    }

    /// Returns the maximum distance, in pixels, of the points of a box from its content: of the
    /// farthest corner from the nearest operand.
    fn error(&self, candidates: &[MergeCandidate], hull: &Bounds) -> f64 {
        let distances = candidates
            .iter()
            .map(|candidate| farthest_distance(hull, &candidate.bounds) + candidate.slack);
        self.in_pixels(
            distances.fold(f64::INFINITY, f64::min),
            hull,
            max_band(candidates),
        )
    }

    /// Returns a length in pixels at a box, or at the nearest point to the camera within its band.
    fn in_pixels(&self, length: f64, bounds: &Bounds, influence_band: f64) -> f64 {
        let pixel_size =
            (self.target).pixel_size(self.target.distance(&bounds.grown(influence_band)));
        match pixel_size > 0.0 {
            true => length / pixel_size,
            false => f64::INFINITY,
        }
    }

    fn record_merge(&mut self, candidates: &[MergeCandidate], hull: &Bounds) {
        self.shapes += candidates.len();
        self.boxes += 1;
        self.pixels = self.pixels.max(self.error(candidates, hull));
    }

    /// Marks all nodes below a node.
    fn mark_covered(&mut self, id: NodeId) {
        let mut pending = vec![id];
        while let Some(id) = pending.pop() {
            if !std::mem::replace(&mut self.covered[id.0 as usize], true) {
                pending.extend(self.graph.get(id).inputs());
            }
        }
    }
}

/// Returns the distance of a box's farthest point from another box. It is that of a corner, since the
/// distance from a convex set has no maximum elsewhere.
fn farthest_distance(hull: &Bounds, from: &Bounds) -> f64 {
    let gap = |i: usize| (from.min[i] - hull.min[i]).max(hull.max[i] - from.max[i]);
    (0..3).map(|i| gap(i).max(0.0).powi(2)).sum::<f64>().sqrt()
}

fn max_band(candidates: &[MergeCandidate]) -> f64 {
    candidates
        .iter()
        .map(|candidate| candidate.influence_band)
        .fold(0.0, f64::max)
}

/// Sorts candidates by their centres along the longest side of the box around all centres.
fn sort_along_longest_side(candidates: &mut [MergeCandidate]) {
    let centres = candidates.iter().fold(Bounds::EMPTY, |hull, candidate| {
        hull.including(candidate.bounds.centre())
    });
    let side = |axis: usize| centres.max[axis] - centres.min[axis];
    let axis = (1..3).fold(
        0,
        |best, axis| {
            if side(axis) > side(best) { axis } else { best }
        },
    );
    candidates.sort_by(|a, b| a.bounds.centre()[axis].total_cmp(&b.bounds.centre()[axis]));
}

/// Returns the paint of each value if it is uniform, and within that `None` if it is unpainted.
fn uniform_paints(graph: &Graph) -> Vec<Option<Option<Paint>>> {
    let mut paints: Vec<Option<Option<Paint>>> = Vec::with_capacity(graph.len());
    for (_, node) in graph.nodes() {
        let paint = match node {
            GraphNode::Paint {
                constants,
                channels,
                ..
            } => Some(Some((*constants, channels.clone()))),
            GraphNode::Apply { values, .. } => {
                let mut operand_paints = values.iter().map(|value| &paints[value.0 as usize]);
                let first = operand_paints.next().cloned().unwrap_or(Some(None));
                first.filter(|first| operand_paints.all(|other| other.as_ref() == Some(first)))
            }
            _ => Some(None),
        };
        paints.push(paint);
    }
    paints
}
