//! Slopes of a graph's values in world space, by the operations' rules: bounds that hold everywhere,
//! and infinity where there is no rule.

use crate::graph::{Graph, GraphNode, GraphNumber, NodeId, constants};
use sdfc_vm::row::{Category, SlopeRule};
use sdfc_vm::table::Op;

/// Slopes of the nodes so far. For points, their stretch.
#[derive(Default)]
pub(super) struct GraphSlopes(Vec<f64>);

impl GraphSlopes {
    /// Returns the slope of a value of a graph that may have grown since the last call.
    pub(super) fn value(&mut self, graph: &Graph, id: NodeId) -> f64 {
        for (_, node) in graph.nodes().skip(self.0.len()) {
            let slope = self.node_slope(graph, node);
            // NaN is no bound.
            self.0
                .push(if slope >= 0.0 { slope } else { f64::INFINITY });
        }
        self.0[id.0 as usize]
    }

    fn get(&self, id: NodeId) -> f64 {
        self.0[id.0 as usize]
    }

    fn node_slope(&self, graph: &Graph, node: &GraphNode) -> f64 {
        match node {
            GraphNode::World => 1.0,
            GraphNode::Constant(_) => 0.0,
            GraphNode::Moved { point, .. } => self.get(*point),
            GraphNode::Mapped { point, rows } => match constants(rows) {
                Some(rows) => self.get(*point) * max_stretch(&rows),
                None => f64::INFINITY,
            },
            GraphNode::Paint { value, .. } => self.get(*value),
            GraphNode::Normal { .. } | GraphNode::Chain { .. } => f64::INFINITY,
            GraphNode::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let point_stretch = point.map_or(0.0, |point| self.get(point));
                let value_slopes = || values.iter().map(|&value| self.get(value));
                if *op == Op::MakePoint {
                    return value_slopes()
                        .map(|slope| slope * slope)
                        .sum::<f64>()
                        .sqrt();
                }
                let Some(numbers) = constants(parameters) else {
                    return f64::INFINITY;
                };
                self.by_rule(graph, *op, point_stretch, values, &numbers)
            }
        }
    }

    /// Returns the slope of an operation at a point with this stretch.
    fn by_rule(
        &self,
        graph: &Graph,
        op: Op,
        point_stretch: f64,
        values: &[NodeId],
        numbers: &[f64],
    ) -> f64 {
        let slopes: Vec<f64> = values.iter().map(|&value| self.get(value)).collect();
        let facts = &op.row().facts;
        let constant = |id: NodeId| match graph.get(id) {
            GraphNode::Constant(GraphNumber::Constant(v)) => Some(f64::from(*v)),
            _ => None,
        };
        match facts.slope {
            SlopeRule::Unbounded => match (op, values) {
                (Op::Mul, &[a, b]) => match (constant(a), constant(b)) {
                    (Some(factor), _) => factor.abs() * self.get(b),
                    (_, Some(factor)) => factor.abs() * self.get(a),
                    _ => f64::INFINITY,
                },
                // Arithmetic of constants.
                _ if facts.category == Category::Math
                    && point_stretch == 0.0
                    && slopes.iter().all(|&slope| slope == 0.0) =>
                {
                    0.0
                }
                _ => f64::INFINITY,
            },
            rule => rule.bound(&slopes, point_stretch, |rule| rule(numbers)),
        }
    }
}

/// Returns a bound on the stretch of a map of three rows of four. Its squared norm is at most the
/// largest row sum of its square, with equality for rotations and for scales along axes.
fn max_stretch(rows: &[f64]) -> f64 {
    let square = |a: usize, b: usize| {
        let product = |r: usize| rows[4 * r + a] * rows[4 * r + b];
        (0..3).map(product).sum::<f64>()
    };
    let sum = |a: usize| (0..3).map(|b| square(a, b).abs()).sum::<f64>();
    (0..3).map(sum).fold(0.0, f64::max).sqrt()
}
