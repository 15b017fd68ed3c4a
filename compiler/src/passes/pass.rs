//! Form of a pass: its description, its input and output, and the copy of a graph that every pass makes.

use super::lod::target::{LodReport, LodTarget};
use crate::graph::{Graph, GraphNode, NodeId, Purpose};

/// An optimizer pass.
#[derive(Clone, Copy, Debug)]
pub struct Pass {
    /// Name by which it is disabled.
    pub name: &'static str,
    /// Summary in one line.
    pub summary: &'static str,
    /// Largest change of the values.
    pub effect: PassEffect,
    /// Set if it runs only with an [`LodTarget`].
    pub needs_lod_target: bool,
    pub(super) run: fn(&Graph, &Context) -> PassOutput,
}

/// Largest change that a pass makes to the values of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PassEffect {
    /// Every bit stays, except signs of zeros.
    None,
    /// Composed maps of points round once instead of twice.
    Rounding,
    /// Values grow, but stay safe steps to the same surface.
    LargerSteps,
    /// Values change within the tolerance for level of detail.
    Simplification,
}

/// Inputs of a pass besides the graph.
#[derive(Clone, Copy, Debug)]
pub struct Context {
    /// Purpose of the graph.
    pub purpose: Purpose,
    /// View for which detail that is too small to be visible may be simplified.
    pub lod_target: Option<LodTarget>,
}

/// Output of a pass: a graph, and a report in the pass's own terms.
#[derive(Clone, Debug, Default)]
pub struct PassOutput {
    /// Graph after the pass.
    pub graph: Graph,
    /// Changes that were made, with their counts.
    pub notes: Vec<String>,
    /// Error introduced by the pass, if it may change the value.
    pub lod_report: Option<LodReport>,
}

/// Copies the graph through `rewrite`. It maps each node that the root uses to a node of the new graph.
/// Its arguments are that graph, the old id, and the node with its inputs replaced.
pub(super) fn rewrite_graph(
    graph: &Graph,
    mut rewrite: impl FnMut(&mut Graph, NodeId, GraphNode) -> NodeId,
) -> Graph {
    let mut result = Graph::default();
    let uses = graph.uses();
    let mut new_ids = vec![NodeId::default(); graph.len()];
    // The world's point stays the first node.
    result.add(GraphNode::World);
    for (id, node) in graph.nodes() {
        if uses[id.0 as usize] == 0 {
            continue;
        }
        let node = node.with_inputs(|input| new_ids[input.0 as usize]);
        let new = rewrite(&mut result, id, node);
        if let Some(origin) = graph.origin(id) {
            result.set_origin(new, origin.clone());
        }
        new_ids[id.0 as usize] = new;
    }
    result.root = new_ids[graph.root.0 as usize];
    result
}

/// Returns "3 guards", "1 guard"; `None` for zero.
pub(super) fn plural(count: usize, one: &str, many: &str) -> Option<String> {
    match count {
        0 => None,
        1 => Some(format!("1 {one}")),
        _ => Some(format!("{count} {many}")),
    }
}
