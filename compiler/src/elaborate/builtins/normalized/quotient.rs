//! Values divided by the lengths of their gradients.

use crate::expression::{ExprId, Expression};
use crate::formula::Formula;
use crate::symbolic::Symbolic;
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::table::Op;
use std::collections::{HashMap, HashSet};

/// A number with its gradient.
type SymbolicDual = Dual<Symbolic>;

/// Factor on value and gradient. Squares of steep gradients, such as those of polynomials far from
/// the origin, stay within `f32`.
const GRADIENT_SCALE: f64 = 1e-8;

/// Returns the point, with the gradients of its coordinates.
pub(super) fn point_with_gradient() -> DualVec3<Symbolic> {
    DualVec3::seed(Symbolic::point())
}

/// Maximum distances outside and inside.
#[derive(Clone, Copy)]
pub(super) struct DistanceLimits {
    pub(super) outside: Option<Symbolic>,
    pub(super) inside: Option<Symbolic>,
}

/// Divides a value by the length of its gradient, and clamps it to the limits.
pub(super) fn quotient(value: SymbolicDual, limits: DistanceLimits) -> Symbolic {
    let scale = Symbolic::constant(GRADIENT_SCALE);
    let distance = value.value * scale / (value.gradient * scale).length();
    let distance = match limits.outside {
        Some(limit) => distance.min(limit),
        None => distance,
    };
    match limits.inside {
        Some(limit) => distance.max(-limit),
        None => distance,
    }
}

/// Normalizes a number: the operands of choices are normalized, and then the choice is made.
pub(super) fn normalize(
    formula: &Formula,
    id: ExprId,
    limits: DistanceLimits,
) -> Result<Symbolic, &'static str> {
    let steps = formula.steps_of(id);
    let mut choice_nodes = HashSet::from([id]);
    let mut gradient_nodes = HashSet::new();
    for (id, step) in steps.iter().rev() {
        let choices = if choice_nodes.contains(id) {
            choice_operands(step)
        } else {
            &[]
        };
        choice_nodes.extend(choices);
        if choices.is_empty() && choice_nodes.contains(id) {
            gradient_nodes.insert(*id);
        }
        if gradient_nodes.contains(id) || !choices.is_empty() {
            let operands = operands(step).filter(|operand| !choices.contains(operand));
            gradient_nodes.extend(operands);
        }
    }
    let duals: HashMap<ExprId, SymbolicDual> =
        formula.steps(id, point_with_gradient(), |id| gradient_nodes.contains(&id))?;
    let mut distances: HashMap<ExprId, Symbolic> = HashMap::new();
    for (id, step) in steps.iter().filter(|(id, _)| choice_nodes.contains(id)) {
        let distance_of = |id: &ExprId| {
            let uniform = || quotient(Dual::fixed(Symbolic(*id)), limits);
            distances.get(id).copied().unwrap_or_else(uniform)
        };
        let distance = match step {
            Expression::Apply { op, values, .. } if !choice_operands(step).is_empty() => {
                let operands = values.iter().map(|value| match op {
                    Op::Select if value == &values[0] => Symbolic(*value),
                    _ => distance_of(value),
                });
                Symbolic::apply_op(*op, Symbolic::point(), &operands.collect::<Vec<_>>(), &[])
            }
            _ => quotient(duals[id], limits),
        };
        distances.insert(*id, distance);
    }
    Ok(distances
        .get(&id)
        .copied()
        .unwrap_or_else(|| quotient(Dual::fixed(Symbolic(id)), limits)))
}

/// Returns the operands of a choice: the result is one of them, up to its sign.
fn choice_operands(step: &Expression) -> &[ExprId] {
    match step {
        Expression::Apply { op, values, .. } => match op {
            Op::Min | Op::Max | Op::Neg | Op::Abs => values,
            Op::Select => &values[1..],
            _ => &[],
        },
        _ => &[],
    }
}

/// Returns all operands of a step: the point's coordinates, then the values.
fn operands(step: &Expression) -> impl Iterator<Item = ExprId> {
    let (point, values) = match step {
        Expression::Apply { point, values, .. } => (point.as_ref(), &values[..]),
        _ => (None, &[][..]),
    };
    point.into_iter().flatten().chain(values).copied()
}
