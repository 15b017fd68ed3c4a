//! The value of a shape, as it is written, as a number of the point.

use crate::expression::{ExprId, Expression, Expressions};
use crate::scene::{NO_EDGE, Scene, ShapeId, ShapeKind};
use crate::uniforms::{operands_first, rewritten};
use sdfc_vm::table::Op;

/// The most operations of such a number.
const MAX_OPERATIONS: usize = 2_000;

/// The number that is a shape's value. `None` where there is no such number, or only a long one: of copies, of maps that
/// are rows, and of rows whose parameters are live.
pub(crate) fn written(scene: &mut Scene, id: ShapeId) -> Option<ExprId> {
    let point = [0, 1, 2].map(|axis| scene.expressions.coordinate(axis));
    let mut left = MAX_OPERATIONS;
    value(scene, id, point, &mut left)
}

/// The value where a shape is evaluated at a point. Recursion over shapes within shapes, whose depth the elaborator
/// bounds.
fn value(scene: &mut Scene, id: ShapeId, point: [ExprId; 3], left: &mut usize) -> Option<ExprId> {
    *left = left.checked_sub(1)?;
    let kind = scene.shapes[id.0 as usize].kind.clone();
    match kind {
        ShapeKind::Primitive { op, parameters } => row(scene, op, point, &[], &parameters),
        ShapeKind::Field { value, .. } => at(&mut scene.expressions, value, point, left),
        ShapeKind::Polygon { points } => {
            let mut value = scene.expressions.constant(NO_EDGE);
            for (i, a) in points.iter().enumerate() {
                let b = points[(i + 1) % points.len()];
                *left = left.checked_sub(1)?;
                let corners = [a[0], a[1], b[0], b[1]];
                value = row(scene, Op::PolygonEdge, point, &[value], &corners)?;
            }
            Some(value)
        }
        ShapeKind::Combine {
            op,
            children,
            parameters,
        } => {
            let mut sum = value(scene, children[0], point, left)?;
            for &child in &children[1..] {
                let next = value(scene, child, point, left)?;
                sum = row(scene, op, point, &[sum, next], &parameters)?;
            }
            Some(sum)
        }
        ShapeKind::Frame {
            child,
            matrix,
            scale,
        } => {
            let e = &mut scene.expressions;
            let inner = [0, 1, 2].map(|axis| {
                let mut sum = matrix[4 * axis + 3];
                for column in 0..3 {
                    let part = e.call(Op::Mul, &[matrix[4 * axis + column], point[column]]);
                    sum = e.call(Op::Add, &[sum, part]);
                }
                sum
            });
            let value = value(scene, child, inner, left)?;
            Some(scene.expressions.call(Op::Mul, &[value, scale]))
        }
        ShapeKind::Warp { child, point: map } => {
            let e = &mut scene.expressions;
            let [x, y, z] = map.map(|number| at(e, number, point, left));
            value(scene, child, [x?, y?, z?], left)
        }
        ShapeKind::Distance {
            op,
            child,
            parameters,
        } => {
            let inner = value(scene, child, point, left)?;
            row(scene, op, point, &[inner], &parameters)
        }
        ShapeKind::Displace { child, amount } => {
            let inner = value(scene, child, point, left)?;
            let amount = at(&mut scene.expressions, amount, point, left)?;
            Some(scene.expressions.call(Op::Add, &[inner, amount]))
        }
        ShapeKind::Painted { child, .. } => value(scene, child, point, left),
        ShapeKind::Repeat { .. }
        | ShapeKind::Polar { .. }
        | ShapeKind::Domain { .. }
        | ShapeKind::Nothing => None,
    }
}

/// What a row gives, whose parameters are constants.
fn row(
    scene: &mut Scene,
    op: Op,
    point: [ExprId; 3],
    values: &[ExprId],
    parameters: &[ExprId],
) -> Option<ExprId> {
    let e = &mut scene.expressions;
    let is_constant = |&id: &ExprId| e.as_constant(id).is_some();
    if !parameters.iter().all(is_constant) {
        return None;
    }
    let point = op.row().reads_point().then_some(point);
    Some(e.apply(op, point, values, parameters))
}

/// A number at another point.
fn at(e: &mut Expressions, number: ExprId, point: [ExprId; 3], left: &mut usize) -> Option<ExprId> {
    *left = left.checked_sub(operands_first(e, number, |_| false).len())?;
    Some(rewritten(e, number, |e, id, written, _| match e.get(id) {
        Expression::Coordinate(axis) => point[usize::from(*axis)],
        _ => written,
    }))
}
