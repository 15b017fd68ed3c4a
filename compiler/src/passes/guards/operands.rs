//! Chains of unions and subtractions, and the nodes that belong to one operand only.

use crate::graph::{Graph, GraphNode, GraphNumber, NodeId, constants};
use sdfc_vm::blend::Blend;
use sdfc_vm::row::Category;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Maximum number of nodes of an operand with a guard.
const MAX_OPERAND_NODES: usize = 4096;

/// Values that are blended one after the other by the same operation.
#[derive(Clone, Debug)]
pub(in crate::passes) struct OperandChain {
    /// Node of the last blend, whose value is that of the chain.
    pub(in crate::passes) root: NodeId,
    pub(in crate::passes) op: Op,
    pub(in crate::passes) parameters: Vec<GraphNumber>,
    /// 1 for unions, −1 for subtractions.
    pub(in crate::passes) sign: f64,
    /// Difference of two values from which on only the nearer one counts.
    pub(in crate::passes) support: f64,
    /// Value that the operands are blended into; `None` if it may be any of them.
    pub(in crate::passes) first: Option<NodeId>,
    /// Operands, in order.
    pub(in crate::passes) operands: Vec<NodeId>,
    /// Set if any order gives the same value.
    pub(in crate::passes) is_reorderable: bool,
}

/// Facts about an operand.
#[derive(Clone, Copy, Debug)]
pub(in crate::passes) struct OperandInfo {
    /// Set if it can be skipped: only cheap numbers and points are also used elsewhere, and all points
    /// derive from the point of its box.
    pub(in crate::passes) is_closed: bool,
    /// Cost of running it, in instructions.
    pub(in crate::passes) work: f64,
    /// Nesting of guards in it.
    pub(in crate::passes) depth: usize,
}

/// Analysis of the operands of a graph.
pub(in crate::passes) struct ChainOperands<'g> {
    graph: &'g Graph,
    uses: Vec<u32>,
    depths: HashMap<NodeId, usize>,
}

impl<'g> ChainOperands<'g> {
    pub(in crate::passes) fn new(graph: &'g Graph) -> Self {
        Self {
            graph,
            uses: graph.uses(),
            depths: HashMap::new(),
        }
    }

    /// Records the nesting of guards in a planned chain.
    pub(in crate::passes) fn set_depth(&mut self, chain: NodeId, depth: usize) {
        self.depths.insert(chain, depth);
    }

    /// Returns all chains, nested ones first. `reorder` allows another order of the operands of hard
    /// ones.
    pub(in crate::passes) fn chains(&self, reorder: bool) -> Vec<OperandChain> {
        let mut is_member = vec![false; self.graph.len()];
        let mut chains = Vec::new();
        let nodes: Vec<(NodeId, &GraphNode)> = self.graph.nodes().collect();
        for (id, node) in nodes.into_iter().rev() {
            if self.uses[id.0 as usize] == 0 || is_member[id.0 as usize] {
                continue;
            }
            let Some((op, blend, parameters)) = union_blend(node) else {
                continue;
            };
            let width = constants(parameters).map(|n| n.first().copied().unwrap_or(0.0));
            let support = width.map_or(f64::INFINITY, |width| blend.kernel.support(width));
            if !support.is_finite() {
                continue;
            }
            let is_union = !blend.negate_second;
            // Hard blends are those without support.
            let is_reorderable = reorder && support == 0.0;
            let mut operands = Vec::new();
            let mut pending = vec![id];
            let mut first = None;
            while let Some(inner_id) = pending.pop() {
                let inner = &self.graph.get(inner_id);
                let is_same =
                    union_blend(inner).is_some_and(|(o, _, p)| o == op && p == parameters);
                if let GraphNode::Apply { values, .. } = inner
                    && (inner_id == id || (is_same && self.uses[inner_id.0 as usize] == 1))
                {
                    is_member[inner_id.0 as usize] = true;
                    if is_union && is_reorderable {
                        pending.extend([values[1], values[0]]);
                    } else {
                        operands.push(values[1]);
                        pending.push(values[0]);
                    }
                } else if is_union && is_reorderable {
                    operands.push(inner_id);
                } else {
                    first = Some(inner_id);
                }
            }
            if first.is_some() {
                operands.reverse();
            }
            chains.push(OperandChain {
                root: id,
                op,
                parameters: parameters.to_vec(),
                sign: if is_union { 1.0 } else { -1.0 },
                support,
                first,
                operands,
                is_reorderable,
            });
        }
        chains.reverse();
        chains
    }

    /// Returns the work of an operand, and whether it can be skipped with all its nodes. Its box is in
    /// the space of the given point.
    pub(in crate::passes) fn analyze(&self, operand: NodeId, space: Option<NodeId>) -> OperandInfo {
        let mut info = OperandInfo {
            is_closed: true,
            work: 0.0,
            depth: 0,
        };
        let base = space.map(|space| self.base(space));
        // Number of uses of each node within the operand.
        let mut reads: HashMap<NodeId, u32> = HashMap::from([(operand, 1)]);
        let mut pending = vec![operand];
        while let Some(id) = pending.pop() {
            if Some(id) == base {
                continue;
            }
            let node = self.graph.get(id);
            info.work += node_work(node);
            info.depth = info.depth.max(self.depths.get(&id).copied().unwrap_or(0));
            info.is_closed &= *node != GraphNode::World;
            for input in node.inputs() {
                let count = reads.entry(input).or_insert(0);
                *count += 1;
                if *count == 1 {
                    pending.push(input);
                }
            }
            if reads.len() > MAX_OPERAND_NODES {
                info.is_closed = false;
                break;
            }
        }
        info.is_closed &= reads
            .iter()
            .all(|(&id, &count)| count == self.uses[id.0 as usize] || self.is_recomputed(id));
        info
    }

    /// Returns the point that a frame maps.
    fn base(&self, point: NodeId) -> NodeId {
        match self.graph.get(point) {
            GraphNode::Moved { point, .. } | GraphNode::Mapped { point, .. } => *point,
            _ => point,
        }
    }

    /// Reports whether a node is recomputed wherever it is used.
    fn is_recomputed(&self, id: NodeId) -> bool {
        match self.graph.get(id) {
            GraphNode::World
            | GraphNode::Moved { .. }
            | GraphNode::Mapped { .. }
            | GraphNode::Constant(_) => true,
            GraphNode::Apply {
                op: Op::X | Op::Y | Op::Z,
                ..
            } => true,
            node @ GraphNode::Apply { values, .. } => node.is_point() && values.is_empty(),
            GraphNode::Chain { .. } | GraphNode::Normal { .. } | GraphNode::Paint { .. } => false,
        }
    }
}

/// Returns a union or subtraction that is a blend, and its parameters.
fn union_blend(node: &GraphNode) -> Option<(Op, Blend, &[GraphNumber])> {
    let GraphNode::Apply { op, parameters, .. } = node else {
        return None;
    };
    let blend = op.row().facts.blend?;
    (blend.sign > 0.0 || blend.negate_second).then_some((*op, blend, parameters))
}

/// Returns the cost of running a node, in instructions of average size.
fn node_work(node: &GraphNode) -> f64 {
    match node {
        GraphNode::World | GraphNode::Constant(_) => 0.0,
        GraphNode::Moved { .. } => 0.1,
        GraphNode::Mapped { .. } => 0.3,
        GraphNode::Apply { op, .. } => match op.row().facts.category {
            Category::Combine => 0.3,
            Category::Math => match op {
                Op::Noise | Op::NoiseOctave | Op::RidgeOctave => 6.0,
                _ => 0.6,
            },
            Category::Domain => match op {
                Op::Polar | Op::PolarNeighbour | Op::PolarPlane | Op::PolarPlaneNeighbour => 2.0,
                _ => 1.0,
            },
            Category::Shape3
            | Category::Shape2
            | Category::Dimension
            | Category::Distance
            | Category::Internal => 1.0,
        },
        GraphNode::Chain { .. } => 0.3,
        GraphNode::Normal { .. } | GraphNode::Paint { .. } => 1.0,
    }
}
