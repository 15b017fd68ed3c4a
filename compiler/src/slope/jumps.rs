//! The operations of a number that jump, and the places where they do.

use super::held::Throughout;
use super::local::{Local, local};
use crate::boxes::Held;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::uniforms::{operands_first, rewritten};
use sdfc_vm::table::Op;

/// A place where operations of a field jump.
pub(super) struct Jump {
    /// The number that tells where it is.
    pub(super) number: ExprId,
    pub(super) place: Place,
    pub(super) operations: Vec<ExprId>,
    /// The bound of the number's slope.
    pub(super) slope: Local,
}

/// The places where a jump is, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// The zeros of its fraction, one of many.
    Whole,
    /// Its zeros.
    Zero,
    /// Its zeros at which another number is negative: there angles begin again.
    Turn(ExprId),
}

/// The bounds of slopes by which the places of jumps are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Known {
    /// Those that hold in all of a region.
    Throughout,
    /// The same, and for numbers without one those around each point.
    Locally,
}

/// Reports whether a number has operations that jump.
pub(crate) fn has_jumps(expressions: &Expressions, number: ExprId) -> bool {
    let order = operands_first(expressions, number, |_| false);
    order.into_iter().any(|id| jumps(expressions, id))
}

/// Reports whether an operation jumps where its operand does not.
fn jumps(expressions: &Expressions, id: ExprId) -> bool {
    let Expression::Apply { op, .. } = expressions.get(id) else {
        return false;
    };
    let is_one = matches!(
        op,
        Op::Floor
            | Op::Ceil
            | Op::Round
            | Op::Trunc
            | Op::Fract
            | Op::Modulo
            | Op::Less
            | Op::Step
            | Op::Sign
            | Op::Atan2
    );
    is_one && expressions.stage(id) > Stage::Uniform
}

/// A number that jumps by floors, fractions, remainders and comparisons alone. It has the same values, but in the places
/// of jumps, where these are no more than surfaces: there it has the value of one side.
pub(super) fn sided(
    expressions: &mut Expressions,
    number: ExprId,
    throughout: &Throughout,
) -> ExprId {
    rewritten(expressions, number, |e, id, written, values| {
        match e.get(id) {
            &Expression::Apply { op, .. } if e.stage(id) > Stage::Uniform => {
                sided_operation(e, op, values, throughout).unwrap_or(written)
            }
            _ => written,
        }
    })
}

/// An operation by those that are left.
fn sided_operation(
    e: &mut Expressions,
    op: Op,
    values: &[ExprId],
    throughout: &Throughout,
) -> Option<ExprId> {
    let [zero, half, one, two] = [0.0, 0.5, 1.0, 2.0].map(|value| e.constant(value));
    Some(match (op, values) {
        (Op::Sign, &[a]) if throughout.is_nowhere_flat(e, a) => {
            let is_below = e.call(Op::Less, &[a, zero]);
            let twice = e.call(Op::Mul, &[is_below, two]);
            e.call(Op::Sub, &[one, twice])
        }
        (Op::Sign, &[a]) => {
            let is_above = e.call(Op::Less, &[zero, a]);
            let is_below = e.call(Op::Less, &[a, zero]);
            e.call(Op::Sub, &[is_above, is_below])
        }
        (Op::Step, &[edge, a]) => {
            let is_below = e.call(Op::Less, &[a, edge]);
            e.call(Op::Sub, &[one, is_below])
        }
        (Op::Floor, &[a]) => {
            let opposite = opposite_of(e, a)?;
            if !throughout.is_nowhere_flat(e, opposite) {
                return None;
            }
            let ceil = sided_operation(e, Op::Ceil, &[opposite], throughout)?;
            e.call(Op::Neg, &[ceil])
        }
        (Op::Ceil, &[a]) => match opposite_of(e, a) {
            Some(opposite) => {
                let floor = e.call(Op::Floor, &[opposite]);
                e.call(Op::Neg, &[floor])
            }
            None if throughout.is_nowhere_flat(e, a) => {
                let floor = e.call(Op::Floor, &[a]);
                e.call(Op::Add, &[floor, one])
            }
            None => {
                let opposite = e.call(Op::Neg, &[a]);
                let floor = e.call(Op::Floor, &[opposite]);
                e.call(Op::Neg, &[floor])
            }
        },
        (Op::Round, &[a]) => {
            let more = e.call(Op::Add, &[a, half]);
            e.call(Op::Floor, &[more])
        }
        (Op::Trunc, &[a]) => {
            let size = e.call(Op::Abs, &[a]);
            let floor = e.call(Op::Floor, &[size]);
            let size = e.call(Op::Max, &[zero, floor]);
            let sign = sided_operation(e, Op::Sign, &[a], throughout)?;
            e.call(Op::Mul, &[sign, size])
        }
        _ => return None,
    })
}

/// The number whose opposite another one is written as.
fn opposite_of(expressions: &Expressions, id: ExprId) -> Option<ExprId> {
    match expressions.get(id) {
        Expression::Apply {
            op: Op::Neg,
            values,
            ..
        } => Some(values[0]),
        _ => None,
    }
}

/// The jumps of a number, or `None` where the places of one are not known. What jumps only where something else does is
/// none of them.
pub(super) fn found(
    expressions: &mut Expressions,
    number: ExprId,
    known: Known,
    throughout: &mut Throughout,
) -> Option<Vec<Jump>> {
    let mut found: Vec<Jump> = Vec::new();
    for id in operands_first(expressions, number, |_| false) {
        if !jumps(expressions, id) {
            continue;
        }
        let Expression::Apply { op, values, .. } = expressions.get(id).clone() else {
            continue;
        };
        let (own, place) = match (op, values.as_slice()) {
            (Op::Less, &[a, b]) => (expressions.call(Op::Sub, &[a, b]), Place::Zero),
            (Op::Modulo, &[a, b]) => (expressions.call(Op::Div, &[a, b]), Place::Whole),
            (Op::Atan2, &[_, x]) if throughout.is_positive(expressions, x) => continue,
            (Op::Atan2, &[y, x]) => (y, Place::Turn(x)),
            (_, &[a]) => (a, Place::Whole),
            _ => return None,
        };
        let number = same_place(expressions, own, place);
        let same = found
            .iter_mut()
            .find(|jump| jump.number == number && jump.place == place);
        if let Some(jump) = same {
            jump.operations.push(id);
            continue;
        }
        let slope = match (place, known) {
            (Place::Turn(x), _) => {
                let slope = throughout.slope(expressions, &[number, x], Held::Own)?;
                Local::everywhere(expressions, slope)
            }
            (_, Known::Throughout) => {
                let slope = throughout.slope(expressions, &[number], Held::Own)?;
                Local::everywhere(expressions, slope)
            }
            (_, Known::Locally) => local(expressions, number, Held::Own, throughout)?,
        };
        if expressions.as_constant(slope.slope) != Some(0.0) {
            found.push(Jump {
                number,
                place,
                operations: vec![id],
                slope,
            });
        }
    }
    Some(found)
}

/// One number for all that are whole in the same places and by the same steps: what is added to it is left out, if it is
/// whole.
fn same_place(e: &Expressions, mut number: ExprId, place: Place) -> ExprId {
    let is_whole = |id: ExprId| e.as_constant(id).is_some_and(|v| v.fract() == 0.0);
    while place == Place::Whole
        && let Expression::Apply { op, values, .. } = e.get(number)
    {
        number = match (op, values.as_slice()) {
            (Op::Add | Op::Sub, &[a, b]) if is_whole(b) => a,
            (Op::Add, &[a, b]) if is_whole(a) => b,
            _ => break,
        };
    }
    number
}
