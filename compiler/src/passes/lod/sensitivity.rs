//! Sensitivity of the surface to a value: how small the value must be for its change to move the
//! surface.

use crate::graph::{Graph, GraphNode, GraphNumber, NodeId, constants};
use crate::passes::guards::influence::InfluenceBoxes;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// Number of blend widths by which a value in a run of blends may exceed the result. Beyond it the
/// value has a weight of less than a hundredth: it is the farther operand of several blends.
const MIN_NEGLIGIBLE_WIDTHS: f64 = 3.0;

/// Sensitivity of the result to a value, from its users.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sensitivity {
    /// Maximum change of the result per unit change of the value.
    pub(super) gain: f64,
    /// Magnitude of the value from which on the surface does not depend on it.
    pub(super) influence_band: f64,
    /// Set if its inside may matter: it is subtracted from something, or its magnitude counts.
    pub(super) sign_sensitive: bool,
}

impl Sensitivity {
    const UNKNOWN: Self = Self {
        gain: f64::INFINITY,
        influence_band: f64::INFINITY,
        sign_sensitive: true,
    };

    fn widened(self, amount: f64) -> Self {
        Self {
            influence_band: self.influence_band + amount,
            ..self
        }
    }

    fn with_sign_sensitivity(self, sign_sensitive: bool) -> Self {
        Self {
            sign_sensitive: self.sign_sensitive || sign_sensitive,
            ..self
        }
    }

    fn union(self, other: Self) -> Self {
        Self {
            gain: self.gain.max(other.gain),
            influence_band: self.influence_band.max(other.influence_band),
            sign_sensitive: self.sign_sensitive || other.sign_sensitive,
        }
    }
}

/// Returns the sensitivities of all values.
pub(super) fn sensitivities(
    graph: &Graph,
    influence_boxes: &InfluenceBoxes<'_>,
    runs: &BlendRuns,
) -> Vec<Sensitivity> {
    let mut sensitivities = vec![Sensitivity::default(); graph.len()];
    sensitivities[graph.root.0 as usize] = Sensitivity {
        gain: 1.0,
        influence_band: 0.0,
        sign_sensitive: false,
    };
    let nodes: Vec<(NodeId, &GraphNode)> = graph.nodes().collect();
    for (id, node) in nodes.into_iter().rev() {
        let node_sensitivity = sensitivities[id.0 as usize];
        if node_sensitivity == Sensitivity::default() {
            continue;
        }
        for (index, input) in node.inputs().into_iter().enumerate() {
            let sensitivity = input_sensitivity(
                graph,
                influence_boxes,
                runs,
                (id, node),
                (index, input),
                node_sensitivity,
            );
            let total = &mut sensitivities[input.0 as usize];
            *total = total.union(sensitivity);
        }
    }
    sensitivities
}

/// Returns the sensitivity to an input, from that to the node.
fn input_sensitivity(
    graph: &Graph,
    influence_boxes: &InfluenceBoxes<'_>,
    runs: &BlendRuns,
    (id, node): (NodeId, &GraphNode),
    (index, input): (usize, NodeId),
    node_sensitivity: Sensitivity,
) -> Sensitivity {
    let (op, parameters, values) = match node {
        GraphNode::Paint { .. } if index == 0 => return node_sensitivity,
        GraphNode::Apply {
            op,
            parameters,
            values,
            ..
        } => (*op, parameters, values),
        _ => return Sensitivity::UNKNOWN,
    };
    if let Some(blend) = op.row().facts.blend {
        let Some((support, thickness)) = blend_width(op, parameters) else {
            return Sensitivity::UNKNOWN;
        };
        // The bulge of an intersection depends on the depth inside one operand.
        let is_taken_away = blend.negate_second && values[1] == input;
        let node_sensitivity = node_sensitivity
            .with_sign_sensitivity(is_taken_away || (blend.sign < 0.0 && support > 0.0));
        let is_run = values[0] == input
            && values[1] != input
            && runs.is_interior(input)
            && runs.root(id) == runs.root(input);
        return match support > 0.0 && !is_run {
            true => node_sensitivity.widened(MIN_NEGLIGIBLE_WIDTHS * support + thickness),
            false => node_sensitivity,
        };
    }
    let number = match parameters[..] {
        [GraphNumber::Constant(v)] => f64::from(v),
        _ => f64::NAN,
    };
    match op {
        Op::Min | Op::Max => node_sensitivity,
        Op::Complement | Op::Neg | Op::Abs | Op::Xor => {
            node_sensitivity.with_sign_sensitivity(true)
        }
        Op::Offset if number.is_finite() => node_sensitivity.widened(number.abs()),
        Op::Shell if number.is_finite() => node_sensitivity
            .widened(number.abs())
            .with_sign_sensitivity(true),
        Op::ScaleDistance if number > 0.0 => Sensitivity {
            gain: node_sensitivity.gain * number,
            influence_band: node_sensitivity.influence_band / number,
            ..node_sensitivity
        },
        // A displaced shape: division does not reduce the error of the surface.
        Op::FieldDistance if number > 0.0 && is_sum(graph, input) => Sensitivity {
            influence_band: node_sensitivity.influence_band / number,
            ..node_sensitivity
        },
        Op::Add | Op::Sub => {
            let other = if values[0] == input {
                values[1]
            } else {
                values[0]
            };
            node_sensitivity
                .widened(magnitude(influence_boxes.range(other)))
                .with_sign_sensitivity(true)
        }
        _ => Sensitivity::UNKNOWN,
    }
}

fn is_sum(graph: &Graph, id: NodeId) -> bool {
    matches!(
        graph.get(id),
        GraphNode::Apply {
            op: Op::Add | Op::Sub,
            ..
        }
    )
}

/// Returns the largest magnitude of a range.
pub(super) fn magnitude(range: Interval) -> f64 {
    match range.lo.is_nan() || range.hi.is_nan() {
        true => f64::INFINITY,
        false => range.lo.abs().max(range.hi.abs()),
    }
}

/// Returns the difference of operands from which on a blend is hard, and the maximum amount that it
/// adds. `None` for a blend without end, or one that depends on a parameter.
pub(super) fn blend_width(op: Op, parameters: &[GraphNumber]) -> Option<(f64, f64)> {
    let blend = op.row().facts.blend?;
    let width = constants(parameters)?.first().copied().unwrap_or(0.0);
    let support = blend.kernel.support(width);
    support
        .is_finite()
        .then(|| (support, blend.kernel.max_offset(width)))
}

/// Runs: consecutive blends of one kind whose intermediate results have no other user.
pub(super) struct BlendRuns {
    /// For each blend the last one of its run; for other nodes the node itself.
    roots: Vec<NodeId>,
}

impl BlendRuns {
    pub(super) fn new(graph: &Graph) -> Self {
        let uses = graph.uses();
        let mut roots: Vec<NodeId> = graph.nodes().map(|(id, _)| id).collect();
        let nodes: Vec<(NodeId, &GraphNode)> = graph.nodes().collect();
        for (id, node) in nodes.into_iter().rev() {
            if let Some(first) = run_predecessor(graph, node)
                && uses[first.0 as usize] == 1
            {
                roots[first.0 as usize] = roots[id.0 as usize];
            }
        }
        Self { roots }
    }

    pub(super) fn root(&self, id: NodeId) -> NodeId {
        self.roots[id.0 as usize]
    }

    /// Reports whether it is a blend of a run, except the last.
    pub(super) fn is_interior(&self, id: NodeId) -> bool {
        self.root(id) != id
    }

    /// Returns the blends of the run that ends with this one, the last first.
    pub(super) fn members(&self, graph: &Graph, root: NodeId) -> Vec<NodeId> {
        let mut members = vec![root];
        let mut current = root;
        while let Some(first) =
            run_predecessor(graph, graph.get(current)).filter(|&id| self.is_interior(id))
        {
            members.push(first);
            current = first;
        }
        members
    }
}

/// Returns the first operand of a blend, if it is the same blend.
fn run_predecessor(graph: &Graph, node: &GraphNode) -> Option<NodeId> {
    let blend_parts = |node: &GraphNode| match node {
        GraphNode::Apply {
            op,
            parameters,
            values,
            ..
        } if op.row().facts.blend.is_some() => Some((*op, parameters.clone(), values[0])),
        _ => None,
    };
    let (op, parameters, first) = blend_parts(node)?;
    let (inner, inner_parameters, _) = blend_parts(graph.get(first))?;
    (inner == op && inner_parameters == parameters).then_some(first)
}
