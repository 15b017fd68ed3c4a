//! Folds constants, removes identities, and composes maps of points. Before: any graph. After: no
//! operation reads only constants, none of the identities below is left, and no transform follows another
//! (`transforms.rs`). The value is the same in every bit, but for the sign of zeros. Where two transforms were
//! composed, the point is the same up to one rounding.

mod transforms;

use super::pass::{Context, PassOutput, plural, rewrite_graph};
use crate::graph::{Graph, GraphNode, GraphNumber, NodeId};
use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// Returns the folded graph.
pub fn fold(graph: &Graph, _: &Context) -> PassOutput {
    let (mut constants, mut identities, mut transforms) = (0, 0, 0);
    let composable = transforms::composable(graph);
    let graph = rewrite_graph(graph, |to, id, mut node| {
        if let Some(value) = constant_value(to, &node) {
            constants += 1;
            return to.add(GraphNode::Constant(GraphNumber::Constant(value)));
        }
        if let Some(simplified_node) = transforms::simplified(to, &node, composable[id.0 as usize])
        {
            transforms += 1;
            node = simplified_node;
        }
        if let Some(id) = passthrough_operand(to, &node) {
            identities += 1;
            return id;
        }
        to.add(node)
    });
    let notes = [
        plural(constants, "constant", "constants"),
        plural(identities, "identity", "identities"),
        plural(
            transforms,
            "map of points made simpler",
            "maps of points made simpler",
        ),
    ];
    PassOutput {
        graph,
        notes: notes.into_iter().flatten().collect(),
        lod_report: None,
    }
}

fn constant(graph: &Graph, id: NodeId) -> Option<f32> {
    match graph.get(id) {
        GraphNode::Constant(GraphNumber::Constant(v)) => Some(*v),
        _ => None,
    }
}

/// Returns the value of an operation that reads constants only, in `f32` as in every engine.
fn constant_value(graph: &Graph, node: &GraphNode) -> Option<f32> {
    let GraphNode::Apply {
        op,
        point: None,
        values,
        parameters,
    } = node
    else {
        return None;
    };
    let mut operands = [0.0; 3];
    for (slot, &value) in operands.iter_mut().zip(values) {
        *slot = constant(graph, value)?;
    }
    let numbers: Option<Vec<f64>> = parameters
        .iter()
        .map(|n| match n {
            GraphNumber::Constant(v) => Some(f64::from(*v)),
            GraphNumber::Uniform(_) => None,
        })
        .collect();
    match apply::<f32>(
        *op,
        V3::new(0.0, 0.0, 0.0),
        operands,
        &pack_parameters(*op, &numbers?),
    ) {
        OpResult::Value(v) if v.is_finite() => Some(v),
        _ => None,
    }
}

/// Returns the operand that an operation returns unchanged.
fn passthrough_operand(graph: &Graph, node: &GraphNode) -> Option<NodeId> {
    match node {
        GraphNode::Apply {
            op,
            values,
            parameters,
            ..
        } => match (op, values.as_slice()) {
            (Op::Offset, [d]) if parameters[0].is(0.0) => Some(*d),
            (Op::ScaleDistance | Op::FieldDistance, [d]) if parameters[0].is(1.0) => Some(*d),
            (Op::Add, [a, b]) if constant(graph, *b) == Some(0.0) => Some(*a),
            (Op::Add, [a, b]) if constant(graph, *a) == Some(0.0) => Some(*b),
            (Op::Sub, [a, b]) if constant(graph, *b) == Some(0.0) => Some(*a),
            (Op::Mul, [a, b]) if constant(graph, *b) == Some(1.0) => Some(*a),
            (Op::Mul, [a, b]) if constant(graph, *a) == Some(1.0) => Some(*b),
            (Op::Div, [a, b]) if constant(graph, *b) == Some(1.0) => Some(*a),
            (Op::Min | Op::Max | Op::Union | Op::Intersection, [a, b]) if a == b => Some(*a),
            _ => None,
        },
        GraphNode::Moved { point, by } if by.iter().all(|n| n.is(0.0)) => Some(*point),
        _ => None,
    }
}
