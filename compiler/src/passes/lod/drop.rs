//! Drops amounts that are too small to be visible: the bulges of smooth blends, offsets, displacements.

use super::sensitivity::{BlendRuns, Sensitivity, blend_width, magnitude, sensitivities};
use super::{LodTarget, in_world};
use crate::graph::{Graph, GraphNode, GraphNumber, NodeId};
use crate::passes::guards::influence::InfluenceBoxes;
use crate::passes::pass::rewrite_graph;
use sdfc_vm::blend::BlendKernel;
use sdfc_vm::table::Op;

/// Fraction of the tolerance that this part may use.
const TOLERANCE_FRACTION: f64 = 0.5;

/// A simplified graph, with the counts of the changes.
pub(super) struct DropResult {
    pub(super) graph: Graph,
    /// Number of smooth blends that became hard.
    pub(super) blends: usize,
    pub(super) offsets: usize,
    pub(super) displacements: usize,
    /// Maximum error, in pixels.
    pub(super) pixels: f64,
}

/// Replacement of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Replacement {
    /// The hard blend of the same sign.
    Hard(Op),
    /// Its operand at this index.
    Operand(usize),
}

/// Returns the graph without amounts that are too small.
pub(super) fn drop(graph: &Graph, target: &LodTarget) -> DropResult {
    let influence_boxes = InfluenceBoxes::new(graph);
    let runs = BlendRuns::new(graph);
    let sensitivities = sensitivities(graph, &influence_boxes, &runs);
    let mut selector = DropSelector {
        graph,
        target,
        influence_boxes,
        runs,
        sensitivities,
        replacements: vec![None; graph.len()],
        errors: vec![0.0; graph.len()],
        limit: target.tolerance * TOLERANCE_FRACTION,
    };
    for (id, node) in graph.nodes() {
        selector.consider(id, node);
    }
    let (mut blends, mut offsets, mut displacements) = (0, 0, 0);
    let simplified = rewrite_graph(graph, |to, id, node| {
        let GraphNode::Apply { op, values, .. } = &node else {
            return to.add(node);
        };
        match selector.replacements[id.0 as usize] {
            None => to.add(node),
            Some(Replacement::Hard(hard)) => {
                blends += 1;
                to.add(GraphNode::Apply {
                    op: hard,
                    point: None,
                    values: values.clone(),
                    parameters: Vec::new(),
                })
            }
            Some(Replacement::Operand(index)) => {
                match op {
                    Op::Offset => offsets += 1,
                    _ => displacements += 1,
                }
                values[index]
            }
        }
    });
    DropResult {
        graph: simplified,
        blends,
        offsets,
        displacements,
        pixels: selector.errors[graph.root.0 as usize],
    }
}

/// Selection of the nodes to simplify, from the operands to the root.
struct DropSelector<'g> {
    graph: &'g Graph,
    target: &'g LodTarget,
    influence_boxes: InfluenceBoxes<'g>,
    runs: BlendRuns,
    sensitivities: Vec<Sensitivity>,
    replacements: Vec<Option<Replacement>>,
    /// Errors of the nodes so far, in pixels.
    errors: Vec<f64>,
    limit: f64,
}

impl DropSelector<'_> {
    fn consider(&mut self, id: NodeId, node: &GraphNode) {
        self.errors[id.0 as usize] = self.input_error(node);
        if self.sensitivities[id.0 as usize]
            .influence_band
            .is_infinite()
        {
            return;
        }
        let GraphNode::Apply {
            op,
            values,
            parameters,
            ..
        } = node
        else {
            return;
        };
        match op {
            Op::Offset => {
                if let [GraphNumber::Constant(amount)] = parameters[..] {
                    self.consider_change(id, 0, values[0], f64::from(amount).abs());
                }
            }
            Op::Add | Op::Sub => {
                let amount = magnitude(self.influence_boxes.range(values[1]));
                if amount.is_finite() {
                    self.consider_change(id, 0, values[0], amount);
                } else if *op == Op::Add {
                    let amount = magnitude(self.influence_boxes.range(values[0]));
                    self.consider_change(id, 1, values[1], amount);
                }
            }
            _ if op.row().facts.blend.is_some() && !self.runs.is_interior(id) => {
                self.consider_run(id);
            }
            _ => {}
        }
    }

    /// Returns the error that a node inherits from its inputs.
    fn input_error(&self, node: &GraphNode) -> f64 {
        let inputs = node.inputs().into_iter();
        let errors = inputs.map(|input| self.errors[input.0 as usize]);
        match node {
            // The errors of two summands add up.
            GraphNode::Apply {
                op: Op::Add | Op::Sub,
                ..
            } => errors.sum(),
            _ => errors.fold(0.0, f64::max),
        }
    }

    /// Drops a change of a value by this amount, if allowed. The value must be a distance, or have a
    /// known distance ratio.
    fn consider_change(&mut self, id: NodeId, index: usize, operand: NodeId, amount: f64) {
        if in_world(self.graph, &self.influence_boxes, operand).is_none() {
            return;
        }
        let pixels = self.change_in_pixels(id, &[operand], amount, amount);
        if let Some(pixels) = pixels
            && amount > 0.0
            && self.errors[operand.0 as usize] + pixels <= self.limit
        {
            self.errors[id.0 as usize] = self.errors[operand.0 as usize] + pixels;
            self.replacements[id.0 as usize] = Some(Replacement::Operand(index));
        }
    }

    /// Makes the blends of a run hard where allowed. Together they add at most their number times
    /// `BlendKernel::max_offset`, and never more than the support.
    fn consider_run(&mut self, root: NodeId) {
        let members = self.runs.members(self.graph, root);
        let GraphNode::Apply { op, parameters, .. } = self.graph.get(root) else {
            return;
        };
        let Some(blend) = op
            .row()
            .facts
            .blend
            .filter(|b| b.kernel != BlendKernel::Hard)
        else {
            return;
        };
        let Some((support, thickness)) = blend_width(*op, parameters) else {
            return;
        };
        let hard = match (blend.sign > 0.0, blend.negate_second) {
            (true, _) => Op::Union,
            (false, true) => Op::Subtraction,
            (false, false) => Op::Intersection,
        };
        let total_thickness = (thickness * members.len() as f64).min(support);
        let input_error = self.errors[root.0 as usize];
        let mut added_error: f64 = 0.0;
        for id in members {
            let GraphNode::Apply { values, .. } = self.graph.get(id) else {
                continue;
            };
            let pixels = self.change_in_pixels(id, values, total_thickness, support + thickness);
            if let Some(pixels) = pixels.filter(|pixels| input_error + pixels <= self.limit) {
                self.replacements[id.0 as usize] = Some(Replacement::Hard(hard));
                added_error = added_error.max(pixels);
            }
        }
        self.errors[root.0 as usize] = input_error + added_error;
    }

    /// Returns the size in pixels of a change of a node's value by `change`. Only places count
    /// where all of these operands are at most the node's influence band plus `margin`.
    fn change_in_pixels(
        &self,
        id: NodeId,
        operands: &[NodeId],
        change: f64,
        margin: f64,
    ) -> Option<f64> {
        let sensitivity = self.sensitivities[id.0 as usize];
        let (mut distance, mut gain) = (0.0_f64, sensitivity.gain);
        for &operand in operands {
            if let Some((bounds, distance_ratio)) =
                in_world(self.graph, &self.influence_boxes, operand)
            {
                let influence_box =
                    bounds.grown((sensitivity.influence_band + margin) / distance_ratio);
                distance = distance.max(self.target.distance(&influence_box));
                gain = gain.max(1.0 / distance_ratio);
            }
        }
        let pixel_size = self.target.pixel_size(distance);
        (pixel_size > 0.0).then(|| change * gain / pixel_size)
    }
}
