//! Transforms: affine maps of points by constant numbers, composed, and recognized in coordinate
//! expressions.

use crate::graph::{Graph, GraphNode, GraphNumber, NodeId};
use sdfc_vm::table::Op;

/// A 3×4 matrix by rows, with shifts in the last column.
type MapRows = [[f64; 4]; 3];

const IDENTITY: MapRows = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
];

/// Reports for each point whether it may become a transform. A point under a transform with parameter-dependent
/// numbers may not, since the two could not be composed.
pub(super) fn composable(graph: &Graph) -> Vec<bool> {
    let mut composable = vec![true; graph.len()];
    for (_, node) in graph.nodes() {
        if let GraphNode::Moved { point, .. } | GraphNode::Mapped { point, .. } = node
            && constant_matrix(node).is_none()
        {
            composable[point.0 as usize] = false;
        }
    }
    composable
}

/// Returns the simplest node that maps points as this one does: one transform for two, a shift for a map
/// that only shifts. `None` if the node is already the simplest.
///
/// Composed numbers are rounded once instead of twice; all other changes keep every bit.
pub(super) fn simplified(
    graph: &Graph,
    node: &GraphNode,
    may_be_transform: bool,
) -> Option<GraphNode> {
    let (point, rows) = match node {
        GraphNode::Moved { point, .. } | GraphNode::Mapped { point, .. } => {
            (*point, constant_matrix(node)?)
        }
        GraphNode::Apply {
            op: Op::MakePoint,
            values,
            ..
        } if may_be_transform => matrix_from_coordinates(graph, values)?,
        _ => return None,
    };
    let (point, rows) = match (graph.get(point), constant_matrix(graph.get(point))) {
        (GraphNode::Moved { point, .. } | GraphNode::Mapped { point, .. }, Some(outer)) => {
            (*point, compose(&rows, &outer))
        }
        // The base point of a transform is no transform.
        (GraphNode::Moved { .. } | GraphNode::Mapped { .. }, None) => return None,
        _ => (point, rows),
    };
    let number = |v: f64| GraphNumber::Constant(v as f32);
    let is_shift = (0..3).all(|i| rows[i][..3] == IDENTITY[i][..3]);
    let simple = if is_shift {
        GraphNode::Moved {
            point,
            by: std::array::from_fn(|i| number(rows[i][3])),
        }
    } else {
        GraphNode::Mapped {
            point,
            rows: std::array::from_fn(|i| number(rows[i / 4][i % 4])),
        }
    };
    (simple != *node).then_some(simple)
}

/// Returns the matrix of a transform with constant numbers.
fn constant_matrix(node: &GraphNode) -> Option<MapRows> {
    let constant = |n: GraphNumber| match n {
        GraphNumber::Constant(v) => Some(f64::from(v)),
        GraphNumber::Uniform(_) => None,
    };
    let mut rows = IDENTITY;
    match node {
        GraphNode::Moved { by, .. } => {
            for (row, by) in rows.iter_mut().zip(by) {
                row[3] = constant(*by)?;
            }
        }
        GraphNode::Mapped { rows: numbers, .. } => {
            for (i, number) in numbers.iter().enumerate() {
                rows[i / 4][i % 4] = constant(*number)?;
            }
        }
        _ => return None,
    }
    Some(rows)
}

/// Returns `inner` after `outer`.
fn compose(inner: &MapRows, outer: &MapRows) -> MapRows {
    std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let sum: f64 = (0..3).map(|k| inner[r][k] * outer[k][c]).sum();
            sum + if c == 3 { inner[r][3] } else { 0.0 }
        })
    })
}

/// Returns the matrix of three coordinate expressions. Each is a coordinate of the same point, with an
/// optional factor and shift: forms that round as a transform does.
fn matrix_from_coordinates(graph: &Graph, values: &[NodeId]) -> Option<(NodeId, MapRows)> {
    let mut rows = [[0.0; 4]; 3];
    let mut from = None;
    for (row, &value) in rows.iter_mut().zip(values) {
        let term = shifted_term(graph, value)?;
        row[3] = term.shift;
        if let Some((point, axis)) = term.coordinate {
            if *from.get_or_insert(point) != point {
                return None;
            }
            row[axis] = term.factor;
        }
    }
    Some((from?, rows))
}

/// A coordinate times a factor plus a shift, or the shift only.
struct Term {
    coordinate: Option<(NodeId, usize)>,
    factor: f64,
    shift: f64,
}

fn shifted_term(graph: &Graph, id: NodeId) -> Option<Term> {
    if let Some(shift) = constant(graph, id) {
        return Some(Term {
            coordinate: None,
            factor: 0.0,
            shift,
        });
    }
    let GraphNode::Apply { op, values, .. } = graph.get(id) else {
        return None;
    };
    let (scaled, shift) = match (op, values.as_slice()) {
        (Op::Add, [a, b]) => match (constant(graph, *a), constant(graph, *b)) {
            (None, Some(shift)) => (*a, shift),
            (Some(shift), None) => (*b, shift),
            _ => return None,
        },
        (Op::Sub, [a, b]) => (*a, -constant(graph, *b)?),
        _ => (id, 0.0),
    };
    let (coordinate, factor) = scaled_coordinate(graph, scaled)?;
    Some(Term {
        coordinate: Some(coordinate),
        factor,
        shift,
    })
}

/// Returns a coordinate times a factor.
fn scaled_coordinate(graph: &Graph, id: NodeId) -> Option<((NodeId, usize), f64)> {
    let GraphNode::Apply {
        op, point, values, ..
    } = graph.get(id)
    else {
        return None;
    };
    let axis = |op| [Op::X, Op::Y, Op::Z].into_iter().position(|x| x == op);
    let (inner, factor) = match (op, values.as_slice()) {
        (op, []) => return Some((((*point)?, axis(*op)?), 1.0)),
        (Op::Neg, [a]) => (*a, -1.0),
        (Op::Mul, [a, b]) => match (constant(graph, *a), constant(graph, *b)) {
            (None, Some(factor)) => (*a, factor),
            (Some(factor), None) => (*b, factor),
            _ => return None,
        },
        _ => return None,
    };
    let GraphNode::Apply {
        op, point, values, ..
    } = graph.get(inner)
    else {
        return None;
    };
    let coordinate = values.is_empty().then(|| axis(*op)).flatten()?;
    Some((((*point)?, coordinate), factor))
}

fn constant(graph: &Graph, id: NodeId) -> Option<f64> {
    match graph.get(id) {
        GraphNode::Constant(GraphNumber::Constant(v)) => Some(f64::from(*v)),
        _ => None,
    }
}
