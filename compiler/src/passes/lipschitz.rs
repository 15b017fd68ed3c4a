//! Divisions by slopes that are larger than they need to be. Before: any graph, in which raw fields,
//! warps and displacements are divided by a bound on their slope where a step is wanted of them
//! (`lower/step.rs`), found on the scene's expressions. After: none of them is divided by more than a bound
//! that the rows' own rules give for what the graph computes now: a warp that turned out to be a turn is
//! not slowed down.
//!
//! The value grows where a division shrank, but is never steeper than one and zero only where it was:
//! it stays a safe step to the same surface. A division in whose result the magnitude is taken for a
//! length (by a blend, an offset, arithmetic) stays: programs that were not compiled from a scene may hold
//! some. So do divisions where the rules know no bound.

mod slopes;

use super::{Context, Passed, counted};
use crate::graph::{Graph, Node, NodeId, Number};
use sdfc_vm::table::Op;
use slopes::Slopes;

/// Bounds that are sharper by less than this are left as they are.
const WORTHWHILE: f64 = 1.0 + 1e-3;
/// A bound of one but for rounding is one.
const TIDY: f64 = 1.0 + 1e-5;

/// The graph with the divisions that it needs.
pub fn lipschitz(graph: &Graph, _: &Context) -> Passed {
    let measured = measured(graph);
    let mut slopes = Slopes::default();
    let (mut dropped, mut sharpened) = (0, 0);
    let mut longest: f64 = 1.0;
    let graph = super::rebuilt(graph, |to, id, node| {
        let divided = divided(&node).filter(|_| !measured[id.0 as usize]);
        let Some((inner, factor)) = divided else {
            return to.add(node);
        };
        let needed = slopes.value(to, inner).max(1.0);
        if factor * needed * WORTHWHILE > 1.0 {
            return to.add(node);
        }
        longest = longest.max(1.0 / (factor * needed));
        if needed < TIDY {
            dropped += 1;
            return inner;
        }
        sharpened += 1;
        to.add(Node::Apply {
            op: Op::FieldDistance,
            point: None,
            values: vec![inner],
            parameters: vec![Number::Constant((1.0 / needed) as f32)],
        })
    });
    let notes = [
        counted(dropped, "division dropped", "divisions dropped"),
        counted(sharpened, "division sharpened", "divisions sharpened"),
        (longest > 1.0).then(|| format!("steps up to {longest:.2} times as long")),
    ];
    Passed {
        graph,
        notes: notes.into_iter().flatten().collect(),
        loss: None,
    }
}

/// What a division by a constant slope of one or more divides, and by what it is multiplied.
fn divided(node: &Node) -> Option<(NodeId, f64)> {
    let Node::Apply {
        op: Op::FieldDistance,
        values,
        parameters,
        ..
    } = node
    else {
        return None;
    };
    match parameters[..] {
        [Number::Constant(factor)] if factor > 0.0 && factor <= 1.0 => {
            Some((values[0], f64::from(factor)))
        }
        _ => None,
    }
}

/// Which nodes are read by something for which their magnitude matters, not only which is nearer: a
/// kernel, an offset, arithmetic, a scale that is multiplied back.
fn measured(graph: &Graph) -> Vec<bool> {
    let mut measured = vec![false; graph.len()];
    let nodes: Vec<(NodeId, &Node)> = graph.nodes().collect();
    for (id, node) in nodes.into_iter().rev() {
        let compares = match node {
            Node::Apply {
                op: Op::ScaleDistance | Op::FieldDistance,
                parameters,
                ..
            } => matches!(parameters[..], [Number::Constant(f)] if f > 0.0 && f <= 1.0),
            Node::Apply { op, .. } => op.row().meta.only_signs,
            _ => false,
        };
        for input in node.inputs() {
            // A material is put on a value and leaves it as it is.
            let is_painted = matches!(node, Node::Paint { value, .. } if *value == input);
            if measured[id.0 as usize] || !(compares || is_painted) {
                measured[input.0 as usize] = true;
            }
        }
    }
    measured
}
