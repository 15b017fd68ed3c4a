//! Makes one node of what is computed twice. Equal nodes of a graph are one node already; here the
//! operands of what commutes may stand in either order. Before: any graph. After: no two nodes are
//! equal but for the order of operands that does not matter. The value is the same in every bit, but
//! for the sign of zeros; nothing is reassociated.
//!
//! Sums, products, minima and maxima commute. So do blends, but where they carry materials, of two
//! equally near the first is taken.

use super::{Context, Passed, counted};
use crate::graph::{Graph, Node, NodeId, is_commutative};
use crate::lower::Purpose;
use sdfc_vm::table::Op;

/// The graph with what was computed twice computed once.
pub fn cse(graph: &Graph, context: &Context) -> Passed {
    let mut found = 0;
    let graph = super::rebuilt(graph, |to, _, node| match exchanged(to, &node, context) {
        Some(id) => {
            found += 1;
            id
        }
        None => to.add(node),
    });
    let notes = counted(found, "node shared", "nodes shared");
    Passed {
        graph,
        notes: notes.into_iter().collect(),
        loss: None,
    }
}

/// The node that is there already and differs in the order of its operands only.
fn exchanged(graph: &Graph, node: &Node, context: &Context) -> Option<NodeId> {
    let Node::Apply {
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
    if !is_commutative(*op) || (context.purpose != Purpose::Distance && !is_arithmetic) {
        return None;
    }
    graph.find(&Node::Apply {
        op: *op,
        point: None,
        values: vec![b, a],
        parameters: parameters.clone(),
    })
}
