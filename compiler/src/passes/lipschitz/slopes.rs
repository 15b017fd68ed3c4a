//! How steep a graph's values are in the world, by the rows' rules: bounds that hold everywhere, and
//! infinity where the rules know none.

use crate::graph::{Graph, Node, NodeId, Number};
use sdfc_vm::row::{Category, Slope};
use sdfc_vm::table::Op;

/// The slopes of the nodes looked at so far: of values, and of points how much they stretch.
#[derive(Default)]
pub(super) struct Slopes(Vec<f64>);

impl Slopes {
    /// The slope of a value of a graph that has grown since.
    pub(super) fn value(&mut self, graph: &Graph, id: NodeId) -> f64 {
        for (_, node) in graph.nodes().skip(self.0.len()) {
            let slope = self.of(graph, node);
            // What is no number is no bound.
            self.0
                .push(if slope >= 0.0 { slope } else { f64::INFINITY });
        }
        self.0[id.0 as usize]
    }

    fn get(&self, id: NodeId) -> f64 {
        self.0[id.0 as usize]
    }

    fn of(&self, graph: &Graph, node: &Node) -> f64 {
        match node {
            Node::World => 1.0,
            Node::Constant(_) => 0.0,
            Node::Moved { point, .. } => self.get(*point),
            Node::Mapped { point, rows } => match constants(rows) {
                Some(rows) => self.get(*point) * stretch(&rows),
                None => f64::INFINITY,
            },
            Node::Paint { value, .. } => self.get(*value),
            Node::Normal { .. } | Node::Chain { .. } => f64::INFINITY,
            Node::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let at = point.map_or(0.0, |point| self.get(point));
                let each = || values.iter().map(|&value| self.get(value));
                if *op == Op::MakePoint {
                    return each().map(|slope| slope * slope).sum::<f64>().sqrt();
                }
                let Some(numbers) = constants(parameters) else {
                    return f64::INFINITY;
                };
                self.by_rule(graph, *op, at, values, &numbers)
            }
        }
    }

    /// The slope of an operation at a point that stretches so much.
    fn by_rule(&self, graph: &Graph, op: Op, at: f64, values: &[NodeId], numbers: &[f64]) -> f64 {
        let each = || values.iter().map(|&value| self.get(value));
        let largest = each().fold(0.0, f64::max);
        let meta = &op.row().meta;
        let constant = |id: NodeId| match graph.get(id) {
            Node::Constant(Number::Constant(v)) => Some(f64::from(*v)),
            _ => None,
        };
        match meta.slope {
            Slope::Constant(slope) => slope * at,
            Slope::Of(slope) => slope(numbers) * at,
            Slope::Largest(factor) => largest * factor,
            Slope::LargestOrOne | Slope::Step => largest.max(at),
            Slope::Sum => each().sum(),
            Slope::Norm => each().map(|v| v * v).sum::<f64>().sqrt(),
            Slope::Plus(more) => largest + more(numbers) * at,
            Slope::Times(factor) => largest * factor(numbers),
            // Folds move space; what turns it by another angle at each point is not known here.
            Slope::Stretch(_) => match op {
                Op::Twist | Op::Bend => f64::INFINITY,
                _ => at,
            },
            Slope::Unknown => match (op, values) {
                (Op::Mul, &[a, b]) => match (constant(a), constant(b)) {
                    (Some(factor), _) => factor.abs() * self.get(b),
                    (_, Some(factor)) => factor.abs() * self.get(a),
                    _ => f64::INFINITY,
                },
                _ if meta.category == Category::Math && largest == 0.0 && at == 0.0 => 0.0,
                _ => f64::INFINITY,
            },
        }
    }
}

fn constants(numbers: &[Number]) -> Option<Vec<f64>> {
    let constant = |n: &Number| match n {
        Number::Constant(v) => Some(f64::from(*v)),
        Number::Uniform(_) => None,
    };
    numbers.iter().map(constant).collect()
}

/// How much a map of three rows of four stretches at most: its norm is at most the root of the largest
/// sum of a row of its square, which is what it is for turns and for scales by axes.
fn stretch(rows: &[f64]) -> f64 {
    let square = |a: usize, b: usize| {
        let product = |r: usize| rows[4 * r + a] * rows[4 * r + b];
        (0..3).map(product).sum::<f64>()
    };
    let sum = |a: usize| (0..3).map(|b| square(a, b).abs()).sum::<f64>();
    (0..3).map(sum).fold(0.0, f64::max).sqrt()
}
