//! Removes nodes that the root does not reach. Before: any graph. After: every node is used. The value
//! is the same in every bit.

use super::pass::{Context, PassOutput, plural, rewrite_graph};
use crate::graph::Graph;

/// Returns the graph without its unused nodes.
pub fn dead(graph: &Graph, _: &Context) -> PassOutput {
    let live = rewrite_graph(graph, |to, _, node| to.add(node));
    let removed = graph.len() - live.len();
    PassOutput {
        graph: live,
        notes: plural(removed, "unread node", "unread nodes")
            .into_iter()
            .collect(),
        lod_report: None,
    }
}
