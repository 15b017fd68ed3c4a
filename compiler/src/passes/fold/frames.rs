//! Frames: maps of points by constant numbers, composed, and found where coordinates spell one out.

use crate::graph::{Graph, Node, NodeId, Number};
use sdfc_vm::table::Op;

/// A 3×4 matrix by rows, with shifts in the last column.
type Rows = [[f64; 4]; 3];

const IDENTITY: Rows = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
];

/// Points that are computed from coordinates, and may become frames: nothing looks at them through a
/// frame whose numbers follow the parameters, which could not be composed with them.
pub(super) fn composable(graph: &Graph) -> Vec<bool> {
    let mut composable = vec![true; graph.len()];
    for (_, node) in graph.nodes() {
        if let Node::Moved { point, .. } | Node::Mapped { point, .. } = node
            && own(node).is_none()
        {
            composable[point.0 as usize] = false;
        }
    }
    composable
}

/// The simplest node that maps points as this one does: one frame for two, a shift for a map that
/// only shifts, the point itself for one that does nothing. `None` where it is as simple as it gets.
///
/// Composed numbers are rounded once instead of twice; all else gives the same bits.
pub(super) fn simpler(graph: &Graph, node: &Node, may_be_frame: bool) -> Option<Node> {
    let (point, rows) = match node {
        Node::Moved { point, .. } | Node::Mapped { point, .. } => (*point, own(node)?),
        Node::Apply {
            op: Op::MakePoint,
            values,
            ..
        } if may_be_frame => spelled(graph, values)?,
        _ => return None,
    };
    let (point, rows) = match (graph.get(point), own(graph.get(point))) {
        (Node::Moved { point, .. } | Node::Mapped { point, .. }, Some(outer)) => {
            (*point, composed(&rows, &outer))
        }
        // Frames stand on points that are no frames.
        (Node::Moved { .. } | Node::Mapped { .. }, None) => return None,
        _ => (point, rows),
    };
    let number = |v: f64| Number::Constant(v as f32);
    let is_shift = (0..3).all(|i| rows[i][..3] == IDENTITY[i][..3]);
    let simple = if is_shift {
        Node::Moved {
            point,
            by: std::array::from_fn(|i| number(rows[i][3])),
        }
    } else {
        Node::Mapped {
            point,
            rows: std::array::from_fn(|i| number(rows[i / 4][i % 4])),
        }
    };
    (simple != *node).then_some(simple)
}

/// The matrix of a frame with constant numbers.
fn own(node: &Node) -> Option<Rows> {
    let constant = |n: Number| match n {
        Number::Constant(v) => Some(f64::from(v)),
        Number::Uniform(_) => None,
    };
    let mut rows = IDENTITY;
    match node {
        Node::Moved { by, .. } => {
            for (row, by) in rows.iter_mut().zip(by) {
                row[3] = constant(*by)?;
            }
        }
        Node::Mapped { rows: numbers, .. } => {
            for (i, number) in numbers.iter().enumerate() {
                rows[i / 4][i % 4] = constant(*number)?;
            }
        }
        _ => return None,
    }
    Some(rows)
}

/// `inner` after `outer`.
fn composed(inner: &Rows, outer: &Rows) -> Rows {
    std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let sum: f64 = (0..3).map(|k| inner[r][k] * outer[k][c]).sum();
            sum + if c == 3 { inner[r][3] } else { 0.0 }
        })
    })
}

/// The matrix that three coordinates spell out, each as one coordinate of the same point, perhaps
/// with a factor, perhaps with a shift: forms that round as a frame does.
fn spelled(graph: &Graph, values: &[NodeId]) -> Option<(NodeId, Rows)> {
    let mut rows = [[0.0; 4]; 3];
    let mut from = None;
    for (row, &value) in rows.iter_mut().zip(values) {
        let term = shifted(graph, value)?;
        row[3] = term.shift;
        if let Some((point, axis)) = term.of {
            if *from.get_or_insert(point) != point {
                return None;
            }
            row[axis] = term.factor;
        }
    }
    Some((from?, rows))
}

/// A coordinate times a factor plus a shift, or the shift alone.
struct Term {
    of: Option<(NodeId, usize)>,
    factor: f64,
    shift: f64,
}

fn shifted(graph: &Graph, id: NodeId) -> Option<Term> {
    if let Some(shift) = constant(graph, id) {
        return Some(Term {
            of: None,
            factor: 0.0,
            shift,
        });
    }
    let Node::Apply { op, values, .. } = graph.get(id) else {
        return None;
    };
    let (rest, shift) = match (op, values.as_slice()) {
        (Op::Add, [a, b]) => match (constant(graph, *a), constant(graph, *b)) {
            (None, Some(shift)) => (*a, shift),
            (Some(shift), None) => (*b, shift),
            _ => return None,
        },
        (Op::Sub, [a, b]) => (*a, -constant(graph, *b)?),
        _ => (id, 0.0),
    };
    let (of, factor) = scaled(graph, rest)?;
    Some(Term {
        of: Some(of),
        factor,
        shift,
    })
}

/// A coordinate times a factor.
fn scaled(graph: &Graph, id: NodeId) -> Option<((NodeId, usize), f64)> {
    let Node::Apply {
        op, point, values, ..
    } = graph.get(id)
    else {
        return None;
    };
    let axis = |op| [Op::X, Op::Y, Op::Z].into_iter().position(|x| x == op);
    let (rest, factor) = match (op, values.as_slice()) {
        (op, []) => return Some((((*point)?, axis(*op)?), 1.0)),
        (Op::Neg, [a]) => (*a, -1.0),
        (Op::Mul, [a, b]) => match (constant(graph, *a), constant(graph, *b)) {
            (None, Some(factor)) => (*a, factor),
            (Some(factor), None) => (*b, factor),
            _ => return None,
        },
        _ => return None,
    };
    let Node::Apply {
        op, point, values, ..
    } = graph.get(rest)
    else {
        return None;
    };
    let coordinate = values.is_empty().then(|| axis(*op)).flatten()?;
    Some((((*point)?, coordinate), factor))
}

fn constant(graph: &Graph, id: NodeId) -> Option<f64> {
    match graph.get(id) {
        Node::Constant(Number::Constant(v)) => Some(f64::from(*v)),
        _ => None,
    }
}
