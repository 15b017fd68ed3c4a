//! Sets of sums of rounded numbers, such as `floor(a) + floor(b) + 1`.

use super::{Level, Sublevels};
use crate::analysis::terms::{Sum, Term, sum_of};
use crate::expression::{ExprId, Expression, Expressions};
use crate::sublevel::set::Set;
use sdfc_vm::table::Op;

/// Maximum number of operands of an integer that are searched.
const MAX_OPERANDS: usize = 64;

impl Sublevels<'_> {
    /// Returns the set of a sum of integers and a constant: one of its terms is no longer rounded.
    pub(super) fn of_integers(&mut self, number: ExprId, level: Level, depth: u32) -> Option<Set> {
        let Sum {
            mut terms,
            constant,
        } = sum_of(self.e, number)?;
        let is_rounded = |term: &Term| self.rounded(term.number).is_some();
        let index = terms.iter().position(is_rounded)?;
        let term = terms.swap_remove(index);
        if !terms.iter().all(|term| is_integer(self.e, term.number)) {
            return None;
        }
        let (op, operand) = self.rounded(term.number)?;
        // With a rounded number `r`, integers `n` and a limit `c`, this is `r + n < c` or `r > n - c`.
        let limit = level.value - constant;
        if op == Op::Round && self.pieces.of(self.e, operand).may_have_any() {
            return None;
        }
        let level = match term.is_negated {
            false => level.at(limit),
            true => level.at(limit).of_rest(),
        };
        let level = below_rounded(op, level);
        let mut difference = operand;
        for other in terms {
            let is_added = other.is_negated == term.is_negated;
            let op = if is_added { Op::Add } else { Op::Sub };
            difference = self.e.call(op, &[difference, other.number]);
        }
        Some(match term.is_negated {
            false => self.below(difference, level, depth),
            true => self.not_below(difference, level, depth),
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
    // The least integer that is not below the level.
    let end = match level.is_included {
        true => level.value.floor() + 1.0,
        false => level.value.ceil(),
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
