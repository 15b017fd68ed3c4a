//! Common subexpression elimination for commuted operands. Equal nodes of a graph are shared already;
//! here the operands of commutative operations may be in either order. Before: any graph. After: no two
//! nodes differ only in an order of operands that does not matter. The value is the same in every bit,
//! but for the sign of zeros; nothing is reassociated.
//!
//! Sums, products, minima and maxima commute. So do blends, except where they carry materials: of two
//! equally near operands the first one counts.

use super::pass::{Context, PassOutput, plural, rewrite_graph};
use crate::graph::{Graph, GraphNode, NodeId, Purpose};
use sdfc_vm::table::Op;

/// Returns the graph with common subexpressions shared.
pub fn cse(graph: &Graph, context: &Context) -> PassOutput {
    let mut shared = 0;
    let graph = rewrite_graph(graph, |to, _, node| {
        match find_commuted(to, &node, context) {
            Some(id) => {
                shared += 1;
                id
            }
            None => to.add(node),
        }
    });
    let notes = plural(shared, "node shared", "nodes shared");
    PassOutput {
        graph,
        notes: notes.into_iter().collect(),
        lod_report: None,
    }
}

/// Returns an existing node that differs only in the order of its operands.
fn find_commuted(graph: &Graph, node: &GraphNode, context: &Context) -> Option<NodeId> {
    let GraphNode::Apply {
        op,
        point: None,
        values,
        parameters,
    } = node
    else {
        return None;
    };
    let is_arithmetic = matches!(op, Op::Add | Op::Mul | Op::Min | Op::Max);
    let [a, b] = values[..] else { return None };
    if !op.row().is_commutative() || (context.purpose != Purpose::Distance && !is_arithmetic) {
        return None;
    }
    graph.find(&GraphNode::Apply {
        op: *op,
        point: None,
        values: vec![b, a],
        parameters: parameters.clone(),
    })
}
