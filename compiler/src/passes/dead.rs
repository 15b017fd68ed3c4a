//! Leaves out what the root does not reach. Before: any graph. After: every node is read. The value
//! is the same in every bit.

use super::{Context, Passed, counted};
use crate::graph::Graph;

/// The graph without its unread nodes.
pub fn dead(graph: &Graph, _: &Context) -> Passed {
    let kept = super::rebuilt(graph, |to, _, node| to.add(node));
    let gone = graph.len() - kept.len();
    Passed {
        graph: kept,
        notes: counted(gone, "unread node", "unread nodes")
            .into_iter()
            .collect(),
        loss: None,
    }
}
