//! Leaves out what the root does not reach. Before: any graph. After: every node is read. The value
//! is the same in every bit.

use crate::graph::Graph;

/// The graph without its unread nodes.
pub fn dead(graph: &Graph) -> Graph {
    super::rebuilt(graph, |to, node| to.add(node))
}
