//! How steep the scene's distance can be: the rows' slope rules, carried through the graph.
//!
//! Fields are divided by their own bounds where they stand, so a number above one comes only from
//! rows that say so (rounded blends); rays then take steps that are shorter by that factor. What is divided
//! is as steep as the shapes in it, whatever the rules would say of the arithmetic there.

use crate::graph::{Graph, Node};
use sdfc_vm::row::{Category, Slope};
use sdfc_vm::table::Op;

/// A bound on the slope of the graph's result.
pub fn steepness(graph: &Graph) -> f64 {
    let mut slopes: Vec<f64> = Vec::with_capacity(graph.len());
    // The steepest of the shapes that a number is computed from.
    let mut shapes: Vec<f64> = Vec::with_capacity(graph.len());
    for (_, node) in graph.nodes() {
        let slope = match node {
            // Maps that stretch are divided out where they stand; frames are rigid, or their
            // scale is multiplied back.
            _ if node.is_point() => 1.0,
            Node::Constant(_) | Node::Normal { .. } => 0.0,
            Node::Paint { value, .. } => slopes[value.0 as usize],
            Node::Apply { op, parameters, .. } | Node::Chain { op, parameters, .. } => {
                let meta = &op.row().meta;
                let values = node
                    .inputs()
                    .into_iter()
                    .filter(|&v| !graph.get(v).is_point());
                let operands = values.map(|v| slopes[v.0 as usize]);
                let numbers: Vec<f64> = parameters
                    .iter()
                    .map(|n| match n {
                        crate::graph::Number::Constant(v) => f64::from(*v),
                        crate::graph::Number::Uniform(_) => f64::NAN,
                    })
                    .collect();
                let largest = operands.clone().fold(0.0, f64::max);
                match meta.slope {
                    _ if *op == Op::FieldDistance => shape_of(node, &shapes).max(1.0),
                    Slope::Constant(slope) => slope,
                    Slope::Of(slope) => finite(slope(&numbers), 1.0),
                    Slope::Largest(factor) => largest * factor,
                    Slope::LargestOrOne => largest.max(1.0),
                    Slope::Sum => operands.sum(),
                    Slope::Plus(more) => largest + finite(more(&numbers), 0.0),
                    Slope::Times(factor) => largest * finite(factor(&numbers), 1.0),
                    // A field that was divided by its bound, or the arithmetic inside one.
                    Slope::Unknown if meta.category == Category::Math => 1.0,
                    Slope::Unknown | Slope::Stretch(_) => 1.0,
                }
            }
            Node::World | Node::Moved { .. } | Node::Mapped { .. } => 1.0,
        };
        let is_math = matches!(node, Node::Constant(_))
            || matches!(node, Node::Apply { op, .. } if op.row().meta.category == Category::Math);
        shapes.push(if is_math {
            shape_of(node, &shapes)
        } else {
            slope
        });
        slopes.push(slope);
    }
    slopes[graph.root.0 as usize].max(1.0)
}

/// The steepest of the shapes that a node's operands are computed from; points are no shapes.
fn shape_of(node: &Node, shapes: &[f64]) -> f64 {
    let operands = node.inputs().into_iter().map(|v| shapes[v.0 as usize]);
    operands.fold(0.0, f64::max)
}

/// A rule's result, or what stands for it where a parameter is not known before the scene runs.
fn finite(slope: f64, otherwise: f64) -> f64 {
    if slope.is_finite() { slope } else { otherwise }
}
