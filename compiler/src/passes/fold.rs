//! Computes what is constant and drops what changes nothing. Before: any graph. After: no operation
//! reads only constants, and none of the identities below is left. The value is the same in every
//! bit, but for the sign of zeros.

use crate::graph::{Graph, Node, NodeId, Number};
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// The folded graph.
pub fn fold(graph: &Graph) -> Graph {
    super::rebuilt(graph, |to, node| match constant_value(to, &node) {
        Some(value) => to.add(Node::Constant(Number::Constant(value))),
        None => match same_as(to, &node) {
            Some(id) => id,
            None => to.add(node),
        },
    })
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
