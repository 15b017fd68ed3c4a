//! Relaxes slope divisions that are larger than necessary. Before: any graph. In it, raw fields, warps
//! and displacements that are used as steps are divided by a bound on their slope (`lower/step.rs`).
//! The bound was found on the scene's expressions. After: none of them is divided by more than the
//! bound that the operations' own rules give for the current graph. A warp that proved to be a
//! rotation is not slowed down.
//!
//! The value grows where a divisor shrank, but its slope is at most one and its zeros are the same. It stays
//! a safe step to the same surface. A division stays where the magnitude of its result is used as a length
//! (by a blend, an offset, arithmetic). Programs that were not compiled from a scene may contain some. So do
//! divisions for which the rules give no bound.

mod slopes;

use super::pass::{Context, PassOutput, plural, rewrite_graph};
use crate::graph::{Graph, GraphNode, GraphNumber, NodeId};
use sdfc_vm::table::Op;
use slopes::GraphSlopes;

/// Minimum improvement of a bound, as a factor.
const MIN_IMPROVEMENT: f64 = 1.0 + 1e-3;
/// Maximum bound that counts as one, for rounding.
const MAX_UNIT_RATIO: f64 = 1.0 + 1e-5;

/// Returns the graph with the divisions that are necessary.
pub fn lipschitz(graph: &Graph, _: &Context) -> PassOutput {
    let is_magnitude_used = magnitude_sensitive(graph);
    let mut slopes = GraphSlopes::default();
    let (mut dropped, mut sharpened) = (0, 0);
    let mut longest: f64 = 1.0;
    let graph = rewrite_graph(graph, |to, id, node| {
        let division = field_division(&node).filter(|_| !is_magnitude_used[id.0 as usize]);
        let Some((inner, factor)) = division else {
            return to.add(node);
        };
        let bound = slopes.value(to, inner).max(1.0);
        if factor * bound * MIN_IMPROVEMENT > 1.0 {
            return to.add(node);
        }
        longest = longest.max(1.0 / (factor * bound));
        if bound < MAX_UNIT_RATIO {
            dropped += 1;
            return inner;
        }
        sharpened += 1;
        to.add(GraphNode::Apply {
            op: Op::FieldDistance,
            point: None,
            values: vec![inner],
            parameters: vec![GraphNumber::Constant((1.0 / bound) as f32)],
        })
    });
    let notes = [
        plural(dropped, "division dropped", "divisions dropped"),
        plural(sharpened, "division sharpened", "divisions sharpened"),
        (longest > 1.0).then(|| format!("steps up to {longest:.2} times as long")),
    ];
    PassOutput {
        graph,
        notes: notes.into_iter().flatten().collect(),
        lod_report: None,
    }
}

/// Returns the dividend of a division by a constant slope of one or more, and the factor that it is
/// multiplied by.
fn field_division(node: &GraphNode) -> Option<(NodeId, f64)> {
    let GraphNode::Apply {
        op: Op::FieldDistance,
        values,
        parameters,
        ..
    } = node
    else {
        return None;
    };
    match parameters[..] {
        [GraphNumber::Constant(factor)] if factor > 0.0 && factor <= 1.0 => {
            Some((values[0], f64::from(factor)))
        }
        _ => None,
    }
}

/// Reports for each node whether a user depends on its magnitude and not only on comparisons. Such users are
/// blend kernels, offsets, arithmetic, and scales that are multiplied back.
fn magnitude_sensitive(graph: &Graph) -> Vec<bool> {
    let mut is_magnitude_used = vec![false; graph.len()];
    let nodes: Vec<(NodeId, &GraphNode)> = graph.nodes().collect();
    for (id, node) in nodes.into_iter().rev() {
        let is_comparison = match node {
            GraphNode::Apply {
                op: Op::ScaleDistance | Op::FieldDistance,
                parameters,
                ..
            } => matches!(parameters[..], [GraphNumber::Constant(f)] if f > 0.0 && f <= 1.0),
            GraphNode::Apply { op, .. } => op.row().facts.uses_only_signs,
            _ => false,
        };
        for input in node.inputs() {
            // A material assignment leaves the value as it is.
            let is_painted = matches!(node, GraphNode::Paint { value, .. } if *value == input);
            if is_magnitude_used[id.0 as usize] || !(is_comparison || is_painted) {
                is_magnitude_used[input.0 as usize] = true;
            }
        }
    }
    is_magnitude_used
}
