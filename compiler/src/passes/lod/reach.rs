//! Where a change of a value can move the surface: how small the value has to be for that.

use crate::graph::{Graph, Node, NodeId, Number};
use crate::passes::bounding::volumes::{Volumes, constants};
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// In a run of blends one after the other, a value that exceeds the result by more than so many widths
/// of the kernel has a share of less than a hundredth in it: on the way there it is the farther operand
/// of several blends.
const WIDTHS: f64 = 3.0;

/// What is known of a value from what reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Reach {
    /// How much the result changes at most where the value changes by one.
    pub(super) gain: f64,
    /// Where the value's magnitude exceeds this, the surface does not depend on it.
    pub(super) band: f64,
    /// Whether its inside may matter: it is taken away from something, or its magnitude counts.
    pub(super) is_turned: bool,
}

impl Reach {
    const UNKNOWN: Self = Self {
        gain: f64::INFINITY,
        band: f64::INFINITY,
        is_turned: true,
    };

    fn wider(self, by: f64) -> Self {
        Self {
            band: self.band + by,
            ..self
        }
    }

    fn turned(self, is_turned: bool) -> Self {
        Self {
            is_turned: self.is_turned || is_turned,
            ..self
        }
    }

    fn or(self, other: Self) -> Self {
        Self {
            gain: self.gain.max(other.gain),
            band: self.band.max(other.band),
            is_turned: self.is_turned || other.is_turned,
        }
    }
}

/// The reaches of all values.
pub(super) fn reaches(graph: &Graph, volumes: &Volumes<'_>, runs: &Runs) -> Vec<Reach> {
    let mut reaches = vec![Reach::default(); graph.len()];
    reaches[graph.root.0 as usize] = Reach {
        gain: 1.0,
        band: 0.0,
        is_turned: false,
    };
    let nodes: Vec<(NodeId, &Node)> = graph.nodes().collect();
    for (id, node) in nodes.into_iter().rev() {
        let own = reaches[id.0 as usize];
        if own == Reach::default() {
            continue;
        }
        for (at, input) in node.inputs().into_iter().enumerate() {
            let reach = inner(graph, volumes, runs, (id, node), (at, input), own);
            let known = &mut reaches[input.0 as usize];
            *known = known.or(reach);
        }
    }
    reaches
}

/// What a node's reach makes of that of one of its inputs.
fn inner(
    graph: &Graph,
    volumes: &Volumes<'_>,
    runs: &Runs,
    (id, node): (NodeId, &Node),
    (at, input): (usize, NodeId),
    own: Reach,
) -> Reach {
    let (op, parameters, values) = match node {
        Node::Paint { .. } if at == 0 => return own,
        Node::Apply {
            op,
            parameters,
            values,
            ..
        } => (*op, parameters, values),
        _ => return Reach::UNKNOWN,
    };
    if let Some(blend) = op.row().meta.blend {
        let Some((support, thickness)) = width(op, parameters) else {
            return Reach::UNKNOWN;
        };
        // The bulge of an intersection follows how deep inside one operand is.
        let is_taken_away = blend.negate_second && values[1] == input;
        let own = own.turned(is_taken_away || (blend.sign < 0.0 && support > 0.0));
        let is_run = values[0] == input
            && values[1] != input
            && runs.is_interior(input)
            && runs.root(id) == runs.root(input);
        return match support > 0.0 && !is_run {
            true => own.wider(WIDTHS * support + thickness),
            false => own,
        };
    }
    let number = match parameters[..] {
        [Number::Constant(v)] => f64::from(v),
        _ => f64::NAN,
    };
    match op {
        Op::Min | Op::Max => own,
        Op::Complement | Op::Neg | Op::Abs | Op::Xor => own.turned(true),
        Op::Offset if number.is_finite() => own.wider(number.abs()),
        Op::Shell if number.is_finite() => own.wider(number.abs()).turned(true),
        Op::ScaleDistance if number > 0.0 => Reach {
            gain: own.gain * number,
            band: own.band / number,
            ..own
        },
        // A displaced shape: what is divided is no smaller an error of the surface.
        Op::FieldDistance if number > 0.0 && is_sum(graph, input) => Reach {
            band: own.band / number,
            ..own
        },
        Op::Add | Op::Sub => {
            let other = if values[0] == input {
                values[1]
            } else {
                values[0]
            };
            own.wider(magnitude(volumes.range(other))).turned(true)
        }
        _ => Reach::UNKNOWN,
    }
}

fn is_sum(graph: &Graph, id: NodeId) -> bool {
    matches!(
        graph.get(id),
        Node::Apply {
            op: Op::Add | Op::Sub,
            ..
        }
    )
}

/// The largest magnitude of a range.
pub(super) fn magnitude(range: Interval) -> f64 {
    match range.lo.is_nan() || range.hi.is_nan() {
        true => f64::INFINITY,
        false => range.lo.abs().max(range.hi.abs()),
    }
}

/// From which difference of the operands on a blend is hard, and what it adds at most; nothing for one
/// that never ends, or follows a parameter.
pub(super) fn width(op: Op, parameters: &[Number]) -> Option<(f64, f64)> {
    let blend = op.row().meta.blend?;
    let width = constants(parameters)?.first().copied().unwrap_or(0.0);
    let support = blend.kernel.support(width);
    support
        .is_finite()
        .then(|| (support, blend.kernel.thickness(width)))
}

/// Blends of one kind, one after the other, that nothing else reads: a run.
pub(super) struct Runs {
    /// For each blend the last one of its run; for other nodes they themselves.
    roots: Vec<NodeId>,
}

impl Runs {
    pub(super) fn of(graph: &Graph) -> Self {
        let uses = graph.uses();
        let mut roots: Vec<NodeId> = graph.nodes().map(|(id, _)| id).collect();
        let nodes: Vec<(NodeId, &Node)> = graph.nodes().collect();
        for (id, node) in nodes.into_iter().rev() {
            if let Some(first) = continued(graph, node)
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

    /// Whether it is a blend of a run but the last.
    pub(super) fn is_interior(&self, id: NodeId) -> bool {
        self.root(id) != id
    }

    /// The blends of the run that ends with this one, the last first.
    pub(super) fn members(&self, graph: &Graph, root: NodeId) -> Vec<NodeId> {
        let mut members = vec![root];
        let mut at = root;
        while let Some(first) = continued(graph, graph.get(at)).filter(|&id| self.is_interior(id)) {
            members.push(first);
            at = first;
        }
        members
    }
}

/// The first operand of a blend, if it is the same blend.
fn continued(graph: &Graph, node: &Node) -> Option<NodeId> {
    let parts = |node: &Node| match node {
        Node::Apply {
            op,
            parameters,
            values,
            ..
        } if op.row().meta.blend.is_some() => Some((*op, parameters.clone(), values[0])),
        _ => None,
    };
    let (op, parameters, first) = parts(node)?;
    let (inner, own, _) = parts(graph.get(first))?;
    (inner == op && own == parameters).then_some(first)
}
