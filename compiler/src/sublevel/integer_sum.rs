//! Sets of sums of rounded numbers, such as `floor(a) + floor(b) + 1`.

use super::{Level, Sublevels};
use crate::analysis::terms::{Sum, Term, difference};
use crate::expression::{ExprId, Expression, Expressions};
use crate::sublevel::set::Set;
use crate::symbolic::simplified;
use sdfc_vm::table::Op;

/// Maximum number of operands of an integer that are searched.
const MAX_OPERANDS: usize = 64;

impl Sublevels<'_, '_> {
    /// Returns the set of a sum of integers and a constant: one of its terms is no longer rounded.
    pub(super) fn of_integers(&mut self, sum: &Sum, level: Level, depth: u32) -> Option<Set> {
        let is_rounded =
            |term: &Term| term.factor.abs() == 1.0 && self.rounded(term.number).is_some();
        let index = sum.terms.iter().position(is_rounded)?;
        let Term { number, factor } = sum.terms[index];
        let mut rest = sum.without(index);
        let are_integers =
            |term: &Term| term.factor.fract() == 0.0 && is_integer(self.e, term.number);
        if !rest.terms.iter().all(are_integers) {
            return None;
        }
        let (op, operand) = self.rounded(number)?;
        if op == Op::Round && self.facts.pieces.of(self.e, operand).may_have_any() {
            return None;
        }
        // With a rounded number `r`, integers `n` and a limit `c`, this is `r + n < c`, or `r - n > -c`.
        let level = level.at(difference(level.value, rest.constant));
        rest.constant = 0.0;
        let level = match factor > 0.0 {
            true => below_rounded(op, level),
            false => below_rounded(op, level.of_rest()),
        };
        let rest = rest.build(self.e);
        let sum = if factor > 0.0 { Op::Add } else { Op::Sub };
        let number = simplified(self.e, sum, &[operand, rest]);
        Some(match factor > 0.0 {
            true => self.below(number, level, depth),
            false => self.not_below(number, level, depth),
        })
    }

    /// Returns how a number is rounded, and the number.
    fn rounded(&self, number: ExprId) -> Option<(Op, ExprId)> {
        match self.e.get(number) {
            Expression::Apply {
                op: op @ (Op::Floor | Op::Ceil | Op::Round),
                values,
                ..
            } => Some((*op, values[0])),
            _ => None,
        }
    }
}

/// Returns the level below which a number lies where the rounded number lies below a level.
pub(super) fn below_rounded(op: Op, level: Level) -> Level {
    let nearest = level.value.round();
    let value = match difference(level.value, nearest) == 0.0 {
        true => nearest,
        false => level.value,
    };
    // The least integer that is not below the level.
    let end = match level.is_included {
        true => value.floor() + 1.0,
        false => value.ceil(),
    };
    match op {
        Op::Floor => Level::excluding(end),
        Op::Ceil => Level::including(end - 1.0),
        _ => Level::excluding(end - 0.5),
    }
}

/// Reports whether a number is an integer everywhere.
pub(super) fn is_integer(e: &Expressions, number: ExprId) -> bool {
    let mut pending = vec![number];
    for _ in 0..MAX_OPERANDS {
        let Some(id) = pending.pop() else {
            return true;
        };
        if let Some(constant) = e.as_constant(id) {
            if constant.fract() != 0.0 {
                return false;
            }
            continue;
        }
        match e.get(id) {
            Expression::Apply { op, values, .. } => match op {
                Op::Floor | Op::Ceil | Op::Round | Op::Trunc | Op::Sign | Op::Step => {}
                Op::Less | Op::And | Op::Or | Op::Not => {}
                Op::Add
                | Op::Sub
                | Op::Mul
                | Op::Neg
                | Op::Min
                | Op::Max
                | Op::Square
                | Op::Abs => {
                    pending.extend(values);
                }
                Op::Select => pending.extend(&values[1..]),
                _ => return false,
            },
            _ => return false,
        }
    }
    false
}
