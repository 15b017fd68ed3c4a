//! Value of a shape, as it is written, as a number of the point.

use crate::expression::ExprId;
use crate::formula::{Formula, numbers};
use crate::scene::{Scene, ShapeId, ShapeKind, children, grid_cells};
use crate::symbolic::{Symbolic, with_expressions};
use crate::uniforms::postorder;

/// Maximum number of operations of such a number.
const MAX_OPERATIONS: usize = 2_000;

/// Builds the number that is a shape's value. `None` if it exceeds [`MAX_OPERATIONS`], or if parameters
/// of operations are live.
pub(crate) fn written_value(scene: &mut Scene, id: ShapeId) -> Option<ExprId> {
    if cost(scene, id)? > MAX_OPERATIONS {
        return None;
    }
    let mut formula = Formula::default();
    formula.read_shape(&scene.expressions, &scene.shapes, id);
    let shapes = &scene.shapes;
    let number = with_expressions(&mut scene.expressions, || {
        formula.shape::<Symbolic>(shapes, id, Symbolic::point())
    });
    number.ok().map(|number| number.0)
}

/// Returns the number of operations of a shape's value. `None` if parameters of an operation are live.
/// Recursion over nested shapes, whose depth the elaborator bounds.
fn cost(scene: &Scene, id: ShapeId) -> Option<usize> {
    let kind = &scene.shapes[id.0 as usize].kind;
    let is_constant = |&id: &ExprId| scene.expressions.as_constant(id).is_some();
    let (copies, is_known) = match kind {
        ShapeKind::Primitive { parameters, .. }
        | ShapeKind::Combine { parameters, .. }
        | ShapeKind::Distance { parameters, .. } => (1, parameters.iter().all(is_constant)),
        ShapeKind::Polygon { points } => (points.len(), points.iter().flatten().all(is_constant)),
        ShapeKind::Repeat { others, .. } => (grid_cells(others).count(), true),
        ShapeKind::Polar { others, .. } => (others.cells().count(), true),
        _ => (1, true),
    };
    let numbers = numbers(kind).iter();
    let number_costs =
        numbers.map(|&number| postorder(&scene.expressions, number, |_| false).len());
    let mut sum = 1 + number_costs.sum::<usize>();
    for &child in children(kind) {
        sum += cost(scene, child).filter(|cost| *cost <= MAX_OPERATIONS)?;
    }
    is_known.then_some(sum * copies)
}
