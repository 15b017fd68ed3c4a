//! Values divided by the lengths of their gradients.

use crate::expression::{ExprId, Expression};
use crate::formula::Formula;
use crate::symbolic::Symbolic;
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::table::Op;
use std::collections::{HashMap, HashSet};

/// A number with its gradient.
type Sloped = Dual<Symbolic>;

/// The factor on value and gradient that keeps the squares of steep gradients far away, as of polynomials, within
/// `f32`.
const SMALL: f64 = 1e-8;

/// The point itself, with the gradients of its coordinates.
pub(super) fn here() -> DualVec3<Symbolic> {
    DualVec3::seed(Symbolic::place())
}

/// The largest distances that are meant, outside and inside.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) outside: Option<Symbolic>,
    pub(super) inside: Option<Symbolic>,
}

/// A value divided by the length of its gradient, within limits.
pub(super) fn quotient(value: Sloped, limits: Limits) -> Symbolic {
    let small = Symbolic::constant(SMALL);
    let distance = value.value * small / (value.gradient * small).length();
    let distance = match limits.outside {
        Some(most) => distance.min(most),
        None => distance,
    };
    match limits.inside {
        Some(most) => distance.max(-most),
        None => distance,
    }
}

/// A number as a distance: what it chooses from is normalized, and then chosen from.
pub(super) fn normalized(
    formula: &Formula,
    id: ExprId,
    limits: Limits,
) -> Result<Symbolic, &'static str> {
    let steps = formula.steps_of(id);
    let mut chosen = HashSet::from([id]);
    let mut needed = HashSet::new();
    for (id, step) in steps.iter().rev() {
        let choices = if chosen.contains(id) {
            choices(step)
        } else {
            &[]
        };
        chosen.extend(choices);
        if choices.is_empty() && chosen.contains(id) {
            needed.insert(*id);
        }
        if needed.contains(id) || !choices.is_empty() {
            let operands = operands(step).filter(|operand| !choices.contains(operand));
            needed.extend(operands);
        }
    }
    let sloped: HashMap<ExprId, Sloped> = formula.steps(id, here(), |id| needed.contains(&id))?;
    let mut distances: HashMap<ExprId, Symbolic> = HashMap::new();
    for (id, step) in steps.iter().filter(|(id, _)| chosen.contains(id)) {
        let of = |id: &ExprId| {
            let uniform = || quotient(Dual::fixed(Symbolic(*id)), limits);
            distances.get(id).copied().unwrap_or_else(uniform)
        };
        let distance = match step {
            Expression::Apply { op, values, .. } if !choices(step).is_empty() => {
                let operands = values.iter().map(|value| match op {
                    Op::Select if value == &values[0] => Symbolic(*value),
                    _ => of(value),
                });
                Symbolic::applied(*op, Symbolic::place(), &operands.collect::<Vec<_>>(), &[])
            }
            _ => quotient(sloped[id], limits),
        };
        distances.insert(*id, distance);
    }
    Ok(distances
        .get(&id)
        .copied()
        .unwrap_or_else(|| quotient(Dual::fixed(Symbolic(id)), limits)))
}

/// The operands that a number is one of, in magnitude.
fn choices(step: &Expression) -> &[ExprId] {
    match step {
        Expression::Apply { op, values, .. } => match op {
            Op::Min | Op::Max | Op::Neg | Op::Abs => values,
            Op::Select => &values[1..],
            _ => &[],
        },
        _ => &[],
    }
}

/// All that a number is computed from.
fn operands(step: &Expression) -> impl Iterator<Item = ExprId> {
    let (point, values) = match step {
        Expression::Apply { point, values, .. } => (point.as_ref(), &values[..]),
        _ => (None, &[][..]),
    };
    point.into_iter().flatten().chain(values).copied()
}
