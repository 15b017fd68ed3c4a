//! Terms of sums, and sums of a number and its magnitude.

use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::table::Op;

/// Maximum number of terms of a sum.
const MAX_TERMS: usize = 32;

/// Term of a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Term {
    pub(crate) number: ExprId,
    /// Set if the sum subtracts it.
    pub(crate) is_negated: bool,
}

/// Sum that is taken apart.
#[derive(Clone, Debug)]
pub(crate) struct Sum {
    /// Terms that are not constant, in the order of the text.
    pub(crate) terms: Vec<Term>,
    pub(crate) constant: f64,
}

/// Takes apart a sum. `None` for too many terms.
pub(crate) fn sum_of(e: &Expressions, sum: ExprId) -> Option<Sum> {
    let mut terms = Vec::new();
    let mut constant = 0.0;
    let mut pending = vec![Term {
        number: sum,
        is_negated: false,
    }];
    while let Some(term) = pending.pop() {
        if let Some(value) = e.as_constant(term.number) {
            constant += if term.is_negated { -value } else { value };
            continue;
        }
        let operand = |number, is_negated| Term { number, is_negated };
        let (op, values) = match e.get(term.number) {
            Expression::Apply { op, values, .. } => (Some(*op), values.as_slice()),
            _ => (None, &[][..]),
        };
        match (op, values) {
            (Some(Op::Add | Op::Sub), &[a, b]) => {
                let is_difference = op == Some(Op::Sub);
                pending.push(operand(b, term.is_negated ^ is_difference));
                pending.push(operand(a, term.is_negated));
            }
            (Some(Op::Neg), &[a]) => pending.push(operand(a, !term.is_negated)),
            _ => terms.push(term),
        }
        if terms.len() + pending.len() > MAX_TERMS {
            return None;
        }
    }
    Some(Sum { terms, constant })
}

/// Sum of a number, its magnitude and a constant: twice a minimum or maximum with zero, plus that constant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FoldedSum {
    /// Operation that compares the number with zero.
    pub(crate) op: Op,
    /// Number, or its negative.
    pub(crate) number: Term,
    pub(crate) constant: f64,
}

/// Returns a sum of a number and its magnitude, in whatever order its terms are written.
pub(crate) fn folded_sum(e: &Expressions, sum: ExprId) -> Option<FoldedSum> {
    let Sum { terms, constant } = sum_of(e, sum)?;
    (0..terms.len()).find_map(|index| {
        let number = e.operands_of(terms[index].number, Op::Abs)?[0];
        let inner = sum_of(e, number)?;
        if inner.terms.len() + 1 != terms.len() {
            return None;
        }
        let mut others = terms.clone();
        let magnitude = others.remove(index);
        others.sort_unstable();
        [false, true].into_iter().find_map(|is_negated| {
            let sign = if is_negated { -1.0 } else { 1.0 };
            let mut wanted: Vec<Term> = inner
                .terms
                .iter()
                .map(|term| Term {
                    number: term.number,
                    is_negated: term.is_negated ^ is_negated,
                })
                .collect();
            wanted.sort_unstable();
            (wanted == others).then_some(FoldedSum {
                op: if magnitude.is_negated {
                    Op::Min
                } else {
                    Op::Max
                },
                number: Term { number, is_negated },
                constant: constant - sign * inner.constant,
            })
        })
    })
}
