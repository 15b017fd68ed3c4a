//! Chains of unions and subtractions, and what belongs to an operand alone.

use super::volumes::constants;
use crate::graph::{Graph, Node, NodeId, Number};
use sdfc_vm::kernel::Blend;
use sdfc_vm::row::Category;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// The most nodes that an operand may have to be guarded.
const LARGEST: usize = 4096;

/// Values that are blended one after the other by the same operation.
#[derive(Clone, Debug)]
pub(in crate::passes) struct Chain {
    /// The last blend.
    pub(in crate::passes) root: NodeId,
    pub(in crate::passes) op: Op,
    pub(in crate::passes) parameters: Vec<Number>,
    /// 1 for unions, −1 for subtractions.
    pub(in crate::passes) sign: f64,
    /// The difference of two values from which on only the nearer one counts.
    pub(in crate::passes) support: f64,
    /// What the operands are blended into; none where any of them may be that.
    pub(in crate::passes) first: Option<NodeId>,
    /// The operands, in order.
    pub(in crate::passes) operands: Vec<NodeId>,
    /// Whether another order gives the same value.
    pub(in crate::passes) is_free: bool,
}

/// What is known of an operand.
#[derive(Clone, Copy, Debug)]
pub(in crate::passes) struct Found {
    /// Whether it can be left out: nothing but cheap numbers and points is also read from elsewhere,
    /// and all points are made from that of its box.
    pub(in crate::passes) is_closed: bool,
    /// What running it takes, in instructions.
    pub(in crate::passes) work: f64,
    /// How deep the guards lie in it.
    pub(in crate::passes) depth: usize,
}

/// What operands of a graph are made of.
pub(in crate::passes) struct Operands<'g> {
    graph: &'g Graph,
    uses: Vec<u32>,
    depths: HashMap<NodeId, usize>,
}

impl<'g> Operands<'g> {
    pub(in crate::passes) fn of(graph: &'g Graph) -> Self {
        Self {
            graph,
            uses: graph.uses(),
            depths: HashMap::new(),
        }
    }

    /// How deep guards lie in a chain that has been planned.
    pub(in crate::passes) fn set_depth(&mut self, chain: NodeId, depth: usize) {
        self.depths.insert(chain, depth);
    }

    /// All chains, those within others first. `reorder` tells whether the order of hard ones may
    /// change.
    pub(in crate::passes) fn chains(&self, reorder: bool) -> Vec<Chain> {
        let mut is_part = vec![false; self.graph.len()];
        let mut chains = Vec::new();
        let nodes: Vec<(NodeId, &Node)> = self.graph.nodes().collect();
        for (id, node) in nodes.into_iter().rev() {
            if self.uses[id.0 as usize] == 0 || is_part[id.0 as usize] {
                continue;
            }
            let Some((op, blend, parameters)) = blended(node) else {
                continue;
            };
            let width = constants(parameters).map(|n| n.first().copied().unwrap_or(0.0));
            let support = width.map_or(f64::INFINITY, |width| blend.kernel.support(width));
            if !support.is_finite() {
                continue;
            }
            let is_union = !blend.negate_second;
            // The difference between hard and smooth is the support.
            let is_free = reorder && support == 0.0;
            let mut operands = Vec::new();
            let mut pending = vec![id];
            let mut first = None;
            while let Some(at) = pending.pop() {
                let inner = &self.graph.get(at);
                let same = blended(inner).is_some_and(|(o, _, p)| o == op && p == parameters);
                if let Node::Apply { values, .. } = inner
                    && (at == id || (same && self.uses[at.0 as usize] == 1))
                {
                    is_part[at.0 as usize] = true;
                    if is_union && is_free {
                        pending.extend([values[1], values[0]]);
                    } else {
                        operands.push(values[1]);
                        pending.push(values[0]);
                    }
                } else if is_union && is_free {
                    operands.push(at);
                } else {
                    first = Some(at);
                }
            }
            if first.is_some() {
                operands.reverse();
            }
            chains.push(Chain {
                root: id,
                op,
                parameters: parameters.to_vec(),
                sign: if is_union { 1.0 } else { -1.0 },
                support,
                first,
                operands,
                is_free,
            });
        }
        chains.reverse();
        chains
    }

    /// What belongs to an operand, and whether all of that can be left out with it. Its box lies in
    /// the space of a point.
    pub(in crate::passes) fn closed(&self, operand: NodeId, space: Option<NodeId>) -> Found {
        let mut found = Found {
            is_closed: true,
            work: 0.0,
            depth: 0,
        };
        let base = space.map(|space| self.base(space));
        // How often each node is read within.
        let mut reads: HashMap<NodeId, u32> = HashMap::from([(operand, 1)]);
        let mut pending = vec![operand];
        while let Some(id) = pending.pop() {
            if Some(id) == base {
                continue;
            }
            let node = self.graph.get(id);
            found.work += work(node);
            found.depth = found.depth.max(self.depths.get(&id).copied().unwrap_or(0));
            found.is_closed &= *node != Node::World;
            for input in node.inputs() {
                let count = reads.entry(input).or_insert(0);
                *count += 1;
                if *count == 1 {
                    pending.push(input);
                }
            }
            if reads.len() > LARGEST {
                found.is_closed = false;
                break;
            }
        }
        found.is_closed &= reads
            .iter()
            .all(|(&id, &count)| count == self.uses[id.0 as usize] || self.is_made_again(id));
        found
    }

    /// The point that a frame looks at.
    fn base(&self, point: NodeId) -> NodeId {
        match self.graph.get(point) {
            Node::Moved { point, .. } | Node::Mapped { point, .. } => *point,
            _ => point,
        }
    }

    /// Whether a node is computed anew wherever it is needed.
    fn is_made_again(&self, id: NodeId) -> bool {
        match self.graph.get(id) {
            Node::World | Node::Moved { .. } | Node::Mapped { .. } | Node::Constant(_) => true,
            Node::Apply {
                op: Op::X | Op::Y | Op::Z,
                ..
            } => true,
            node @ Node::Apply { values, .. } => node.is_point() && values.is_empty(),
            Node::Chain { .. } | Node::Normal { .. } | Node::Paint { .. } => false,
        }
    }
}

/// A union or a subtraction that is a blend, and its parameters.
fn blended(node: &Node) -> Option<(Op, Blend, &[Number])> {
    let Node::Apply { op, parameters, .. } = node else {
        return None;
    };
    let blend = op.row().meta.blend?;
    (blend.sign > 0.0 || blend.negate_second).then_some((*op, blend, parameters))
}

/// What running a node takes, in instructions of common size.
fn work(node: &Node) -> f64 {
    match node {
        Node::World | Node::Constant(_) => 0.0,
        Node::Moved { .. } => 0.1,
        Node::Mapped { .. } => 0.3,
        Node::Apply { op, .. } => match op.row().meta.category {
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
        Node::Chain { .. } => 0.3,
        Node::Normal { .. } | Node::Paint { .. } => 1.0,
    }
}
