//! Computes what is constant, drops what changes nothing, and composes maps of points. Before: any
//! graph. After: no operation reads only constants, none of the identities below is left, and no
//! frame stands on another (`frames.rs`). The value is the same in every bit, but for the sign of
//! zeros; where two frames became one, the point is, but for one rounding.

mod frames;

use super::{Context, Passed, counted};
use crate::graph::{Graph, Node, NodeId, Number};
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// The folded graph.
pub fn fold(graph: &Graph, _: &Context) -> Passed {
    let (mut constants, mut identities, mut frames) = (0, 0, 0);
    let composable = frames::composable(graph);
    let graph = super::rebuilt(graph, |to, id, mut node| {
        if let Some(value) = constant_value(to, &node) {
            constants += 1;
            return to.add(Node::Constant(Number::Constant(value)));
        }
        if let Some(simpler) = frames::simpler(to, &node, composable[id.0 as usize]) {
            frames += 1;
            node = simpler;
        }
        if let Some(id) = same_as(to, &node) {
            identities += 1;
            return id;
        }
        to.add(node)
    });
    let notes = [
        counted(constants, "constant", "constants"),
        counted(identities, "identity", "identities"),
        counted(
            frames,
            "map of points made simpler",
            "maps of points made simpler",
        ),
    ];
    Passed {
        graph,
        notes: notes.into_iter().flatten().collect(),
        loss: None,
    }
}

fn constant(graph: &Graph, id: NodeId) -> Option<f32> {
    match graph.get(id) {
        Node::Constant(Number::Constant(v)) => Some(*v),
        _ => None,
    }
}

/// The value of an operation that reads constants alone; in `f32`, as every engine would get it.
fn constant_value(graph: &Graph, node: &Node) -> Option<f32> {
    let Node::Apply {
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
            Number::Constant(v) => Some(f64::from(*v)),
            Number::Uniform(_) => None,
        })
        .collect();
    match apply::<f32>(
        *op,
        V3::of(0.0, 0.0, 0.0),
        operands,
        &laid_out(*op, &numbers?),
    ) {
        Applied::Value(v) if v.is_finite() => Some(v),
        _ => None,
    }
}

/// The operand that an operation only hands on.
fn same_as(graph: &Graph, node: &Node) -> Option<NodeId> {
    match node {
        Node::Apply {
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
        Node::Moved { point, by } if by.iter().all(|n| n.is(0.0)) => Some(*point),
        _ => None,
    }
}
