//! Guards: operands that are too far from a point to matter there are skipped. Before: any graph.
//! After: long unions and subtractions are [`GraphNode::Chain`]s with guards among their steps; hard ones
//! are in another order. The value is the same in every bit, but for the sign of zeros.
//!
//! In a union, an operand matters where its distance is at most the value so far, plus the width of a blend
//! kernel. A subtraction requires the subtracted operand where the point is
//! deeper inside the value so far than it is away from that operand. So an influence box around an
//! operand, from which its value keeps its distance (`influence.rs`), determines where it can be skipped.
//!
//! Minima and maxima are associative, so the operands of a hard union are sorted by a hierarchy of boxes
//! (`bvh.rs`). A guard before a box skips everything inside. Blends are not associative, and of
//! materials at equal distance the first one counts. There the order stays, and only adjacent operands
//! are skipped together. A guard costs about as much as a shape. So it is emitted only where the
//! skipped work and the skip probability outweigh that, and never in small scenes.

mod bvh;
pub(super) mod influence;
pub(super) mod operands;

use super::pass::{Context, PassOutput, plural, rewrite_graph};
use crate::graph::{Graph, GraphChainStep, GraphNode, GraphNumber, Guard, NodeId, Purpose};
use bvh::{BvhBuilder, BvhLeaf, ChainStep};
use influence::{InfluenceBoxes, NodeInfluenceBox};
use operands::{ChainOperands, OperandChain};
use sdfc_vm::program::MAX_GUARDS;
use std::collections::HashMap;

/// Minimum work of a chain with guards, in instructions. Measured: from 60 boxes on an interpreter
/// gains, with twenty shapes it does not.
const MIN_CHAIN_WORK: f64 = 40.0;
/// Maximum nesting of the guards of one chain.
const MAX_NESTED_GUARDS: usize = 12;
/// Margin of a guard's box, as a fraction of the coordinates' magnitude: about a thousand roundings of
/// `f32`.
const BOX_MARGIN: f64 = 1.0 / 8192.0;
/// Coordinate from which on a side counts as infinite; its square is finite in `f32`.
const MIN_INFINITE_COORDINATE: f64 = 1e15;

/// Returns the graph with guards.
pub fn guards(graph: &Graph, context: &Context) -> PassOutput {
    let mut operands = ChainOperands::new(graph);
    let reorder = context.purpose == Purpose::Distance;
    let chains = operands.chains(reorder);
    if chains.is_empty() {
        return PassOutput {
            graph: graph.clone(),
            ..PassOutput::default()
        };
    }
    let influence_boxes = InfluenceBoxes::new(graph);
    let mut plans: HashMap<NodeId, Plan> = HashMap::new();
    // Nested chains come first, so that the depth of their guards is known.
    for chain in chains {
        if let Some(plan) = plan(&chain, &mut operands, &influence_boxes) {
            operands.set_depth(chain.root, plan.depth);
            plans.insert(chain.root, plan);
        }
    }
    let (mut guards, mut guarded) = (0, 0);
    let mut new_ids = vec![NodeId::default(); graph.len()];
    let graph = rewrite_graph(graph, |to, id, node| {
        let node = match plans.get(&id) {
            Some(plan) => {
                guards += plan.guards();
                guarded += plan.guarded_operands();
                plan.node(&new_ids)
            }
            None => node,
        };
        let new = to.add(node);
        new_ids[id.0 as usize] = new;
        new
    });
    let notes = [
        plural(guards, "guard", "guards"),
        plural(guarded, "shape behind them", "shapes behind them"),
    ];
    PassOutput {
        graph,
        notes: notes.into_iter().flatten().collect(),
        lod_report: None,
    }
}

/// A chain with its guards.
struct Plan {
    chain: OperandChain,
    first: NodeId,
    steps: Vec<ChainStep>,
    /// Maximum nesting of guards, including those of nested chains.
    depth: usize,
}

impl Plan {
    fn guards(&self) -> usize {
        let is_guard = |step: &&ChainStep| matches!(step, ChainStep::Guard { .. });
        self.steps.iter().filter(is_guard).count()
    }

    /// Returns the number of operands behind a guard.
    fn guarded_operands(&self) -> usize {
        let (mut end, mut count) = (0, 0);
        for (index, step) in self.steps.iter().enumerate() {
            match step {
                ChainStep::Guard { steps, .. } => end = end.max(index + 1 + steps),
                ChainStep::Blend(_) => count += usize::from(index < end),
            }
        }
        count
    }

    /// Returns the node, with its inputs mapped to the new graph.
    fn node(&self, new_ids: &[NodeId]) -> GraphNode {
        let new_id = |id: NodeId| new_ids[id.0 as usize];
        let steps = self.steps.iter().map(|step| match step {
            ChainStep::Blend(value) => GraphChainStep::Blend(new_id(*value)),
            ChainStep::Guard {
                influence_box,
                steps,
            } => GraphChainStep::Guard(Guard {
                point: new_id(influence_box.space),
                numbers: guard_numbers(influence_box, self.chain.sign, self.chain.support),
                steps: *steps as u32,
            }),
        });
        GraphNode::Chain {
            op: self.chain.op,
            parameters: self.chain.parameters.clone(),
            first: new_id(self.first),
            steps: steps.collect(),
        }
    }
}

/// Plans the guards of a chain; `None` where none is profitable.
fn plan(
    chain: &OperandChain,
    operands: &mut ChainOperands<'_>,
    influence_boxes: &InfluenceBoxes<'_>,
) -> Option<Plan> {
    let mut leaves = Vec::with_capacity(chain.operands.len());
    let mut depth = 0;
    for &id in &chain.operands {
        let influence_box = influence_boxes.outermost(id).filter(can_skip_points);
        let info = operands.analyze(
            id,
            influence_box
                .as_ref()
                .map(|influence_box| influence_box.space),
        );
        let influence_box = influence_box.filter(|_| info.is_closed && info.depth + 1 < MAX_GUARDS);
        depth = depth.max(info.depth);
        leaves.push(BvhLeaf {
            id,
            influence_box,
            work: info.work,
        });
    }
    let work: f64 = leaves.iter().map(|leaf| leaf.work).sum();
    if work < MIN_CHAIN_WORK {
        return None;
    }
    let mut planner = BvhBuilder::new(&leaves, MAX_NESTED_GUARDS.min(MAX_GUARDS - 1 - depth));
    let first = match chain.first {
        Some(first) => {
            planner.emit_all(chain.is_reorderable);
            first
        }
        // Any operand may be the first one; the best one is always evaluated.
        None => planner.emit_with_first(),
    };
    let nesting = planner.max_nesting();
    (nesting > 0).then(|| Plan {
        chain: chain.clone(),
        first,
        steps: planner.steps,
        depth: depth + nesting,
    })
}

/// Reports whether a box can skip points: it is finite along at least two axes.
fn can_skip_points(influence_box: &NodeInfluenceBox) -> bool {
    let b = &influence_box.bounds;
    let is_bounded =
        |i: &usize| b.min[*i] > -MIN_INFINITE_COORDINATE && b.max[*i] < MIN_INFINITE_COORDINATE;
    (0..3).filter(is_bounded).count() >= 2
}

/// Returns the numbers that a guard compares with, for a chain whose operation has this sign and
/// support.
fn guard_numbers(influence_box: &NodeInfluenceBox, sign: f64, support: f64) -> [GraphNumber; 8] {
    let (radius, factor) = (
        support / influence_box.distance_ratio,
        sign / influence_box.distance_ratio,
    );
    let margin = (influence_box.max_coordinate + radius) * BOX_MARGIN + f64::from(f32::EPSILON);
    let b = influence_box.bounds.grown(margin);
    let side = |i: usize| {
        let is_bounded = b.min[i] > -MIN_INFINITE_COORDINATE && b.max[i] < MIN_INFINITE_COORDINATE;
        match is_bounded {
            true => ((b.min[i] + b.max[i]) / 2.0, (b.max[i] - b.min[i]) / 2.0),
            false => (0.0, MIN_INFINITE_COORDINATE),
        }
    };
    let [x, y, z] = [0, 1, 2].map(side);
    [x.0, y.0, z.0, radius, x.1, y.1, z.1, factor].map(|v| GraphNumber::Constant(v as f32))
}
