//! Fields that are zero in a part of space, such as `min(g, 0)` outside of its solid.
//!
//! Their value and their gradient say nothing there: rays do not advance, and a surface has no normal. Where the set of
//! points below zero is all that counts, the field `g` replaces them. It is below zero at the same points.
//!
//! Roots and powers such as `-pow(g, 0.25)` go with them. They are infinitely steep at their surface, and not defined
//! beyond it.

use crate::expression::{ExprId, Expression, Expressions};
use crate::scene::NO_SURFACE_DISTANCE;
use crate::uniforms::postorder;
use sdfc_vm::row::Continuity;
use sdfc_vm::table::Op;

/// The points that a replacement of a number leaves unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum KeptSet {
    /// Those at which it is below zero.
    Negative,
    /// Those at which it is above zero.
    Positive,
    /// Both.
    Both,
}

impl KeptSet {
    /// Returns the set of a number whose negative has this set.
    pub(crate) fn negated(self) -> Self {
        match self {
            Self::Negative => Self::Positive,
            Self::Positive => Self::Negative,
            Self::Both => Self::Both,
        }
    }

    /// Returns the set of a number whose quotient, or product, with another one has this set.
    pub(crate) fn divided_by(self, e: &Expressions, other: ExprId) -> Self {
        match e.as_constant(other) {
            Some(other) if other > 0.0 => self,
            Some(other) if other < 0.0 => self.negated(),
            _ => Self::Both,
        }
    }
}

/// Returns a number with the same set that has no plateau at zero; `None` if none is found.
pub(crate) fn without_plateau(
    e: &mut Expressions,
    op: Op,
    values: &[ExprId],
    kept: KeptSet,
) -> Option<ExprId> {
    let constants: Vec<Option<f64>> = values.iter().map(|&id| e.as_constant(id)).collect();
    let is_zero = |index: usize| constants[index] == Some(0.0);
    let is_negative = kept == KeptSet::Negative;
    match (op, values) {
        _ if kept == KeptSet::Both => None,
        (Op::Min, &[a, b]) | (Op::Max, &[a, b]) if (op == Op::Min) == is_negative => {
            if is_zero(1) {
                return Some(a);
            }
            is_zero(0).then_some(b)
        }
        (Op::Clamp, &[a, _, _]) => {
            let (low, high) = (constants[1]?, constants[2]?);
            let is_plateau = match kept {
                KeptSet::Negative => low < 0.0 && high == 0.0,
                _ => low == 0.0 && high > 0.0,
            };
            is_plateau.then_some(a)
        }
        // Twice the lesser of a number and zero.
        (Op::Sub, &[a, b]) if is_negative && magnitude(e, b) == Some(a) => Some(a),
        (Op::Add, &[a, b]) if !is_negative && magnitude(e, b) == Some(a) => Some(a),
        (Op::Add, &[a, b]) if !is_negative && magnitude(e, a) == Some(b) => Some(b),
        (Op::Floor | Op::Ceil | Op::Round, &[a]) => {
            let (a, shift) = match is_negative {
                true => below_integer(e, op, a)?,
                false => above_integer(e, op, a)?,
            };
            let shift = e.constant(shift);
            Some(e.call(Op::Add, &[a, shift]))
        }
        (Op::Sub, &[a, b]) if is_negative => below(e, a, b),
        (Op::Add, &[a, _]) if is_negative => {
            let integer = e.constant(-constants[1]?);
            below(e, a, integer)
        }
        // A step is one from its edge on.
        (Op::Step, &[edge, a]) if !is_negative && is_continuous(e, &[edge, a]) => {
            Some(e.call(Op::Sub, &[a, edge]))
        }
        (Op::Smoothstep, &[_, _, a]) if !is_negative => {
            let (from, to) = (constants[0]?, constants[1]?);
            match from < to {
                true => Some(e.call(Op::Sub, &[a, values[0]])),
                false if to < from => Some(e.call(Op::Sub, &[values[0], a])),
                false => None,
            }
        }
        (Op::Select, &[condition, _, b]) if is_negative => {
            if constants[1] == Some(NO_SURFACE_DISTANCE) {
                return defined_part(e, condition, b);
            }
            let &[less, greater] = e.operands_of(condition, Op::Less)? else {
                return None;
            };
            let is_continuous = is_continuous(e, &[less, greater]);
            match (constants[1]?, constants[2]?) {
                (inside, 0.0) if inside < 0.0 => Some(e.call(Op::Sub, &[less, greater])),
                (0.0, inside) if inside < 0.0 && is_continuous => {
                    Some(e.call(Op::Sub, &[greater, less]))
                }
                _ => None,
            }
        }
        (Op::Sqrt, &[a]) if !is_negative && !is_magnitude(e, a) => Some(a),
        (Op::Pow, &[a, _]) if !is_negative && !is_magnitude(e, a) => {
            let exponent = constants[1]?;
            (exponent > 0.0 && exponent.fract() != 0.0).then_some(a)
        }
        _ => None,
    }
}

/// Returns a number that is below zero where a rounded number is below an integer; `None` for any other numbers.
fn below(e: &mut Expressions, number: ExprId, integer: ExprId) -> Option<ExprId> {
    if !is_integer(e, integer) {
        return None;
    }
    let Expression::Apply { op, values, .. } = e.get(number).clone() else {
        return None;
    };
    if let (Op::Step, &[edge, a]) = (op, values.as_slice()) {
        // A step is zero below its edge.
        let is_one = e.as_constant(integer) == Some(1.0);
        return is_one.then(|| e.call(Op::Sub, &[a, edge]));
    }
    let (a, shift) = below_integer(e, op, *values.first()?)?;
    let difference = e.call(Op::Sub, &[a, integer]);
    let shift = e.constant(shift);
    Some(e.call(Op::Add, &[difference, shift]))
}

/// Returns a number, and a shift of it, whose sum is below an integer wherever the rounded number is.
fn below_integer(e: &Expressions, op: Op, number: ExprId) -> Option<(ExprId, f64)> {
    match op {
        Op::Floor => Some((number, 0.0)),
        Op::Ceil if is_continuous(e, &[number]) => Some((number, 1.0)),
        Op::Round if is_continuous(e, &[number]) => Some((number, 0.5)),
        _ => None,
    }
}

/// Returns a number, and a shift of it, whose sum is above an integer wherever the rounded number is.
fn above_integer(e: &Expressions, op: Op, number: ExprId) -> Option<(ExprId, f64)> {
    match op {
        Op::Ceil => Some((number, 0.0)),
        Op::Floor if is_continuous(e, &[number]) => Some((number, -1.0)),
        Op::Round if is_continuous(e, &[number]) => Some((number, -0.5)),
        _ => None,
    }
}

/// Reports whether a number is an integer everywhere.
fn is_integer(e: &Expressions, number: ExprId) -> bool {
    if let Some(constant) = e.as_constant(number) {
        return constant.fract() == 0.0;
    }
    match e.get(number) {
        Expression::Apply { op, .. } => matches!(op, Op::Floor | Op::Ceil | Op::Round),
        _ => false,
    }
}

/// Reports whether a number is a sum of squares or of magnitudes, which is negative nowhere.
fn is_magnitude(e: &Expressions, number: ExprId) -> bool {
    let mut pending = vec![number];
    while let Some(id) = pending.pop() {
        match e.get(id) {
            Expression::Apply {
                op: Op::Add,
                values,
                ..
            } => pending.extend(values),
            Expression::Apply {
                op: Op::Square | Op::Abs,
                ..
            } => {}
            _ if e.as_constant(id).is_some_and(|constant| constant >= 0.0) => {}
            _ => return false,
        }
    }
    true
}

/// Returns the negative of `a` for a field that is a negative root or power of `a` where that is not negative, and
/// outside elsewhere.
fn defined_part(e: &mut Expressions, undefined: ExprId, field: ExprId) -> Option<ExprId> {
    let less = e.operands_of(undefined, Op::Less)?[0];
    let negated = e.operands_of(field, Op::Neg)?[0];
    let mut root = negated;
    while let Expression::Apply { op, values, .. } = e.get(root).clone() {
        match without_plateau(e, op, &values, KeptSet::Positive) {
            Some(inner) if matches!(op, Op::Sqrt | Op::Pow) => root = inner,
            _ => break,
        }
    }
    (root == less && root != negated).then(|| e.call(Op::Neg, &[root]))
}

/// Returns the number whose magnitude this is.
fn magnitude(e: &Expressions, number: ExprId) -> Option<ExprId> {
    Some(e.operands_of(number, Op::Abs)?[0])
}

/// Reports whether numbers have no discontinuities.
fn is_continuous(e: &Expressions, numbers: &[ExprId]) -> bool {
    let is_continuous = |id: ExprId| match e.get(id) {
        Expression::Apply { op, .. } => op.row().facts.continuity == Continuity::Continuous,
        _ => true,
    };
    numbers.iter().all(|&number| {
        postorder(e, number, |_| false)
            .into_iter()
            .all(is_continuous)
    })
}
