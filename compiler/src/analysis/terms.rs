//! Sums of multiples of numbers, in which equal terms are merged.

use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::table::Op;

/// Maximum number of terms of a sum.
const MAX_TERMS: usize = 32;
/// Rounding of a constant, relative to what it is computed from.
const ROUNDING: f64 = 1e-13;

/// Term of a sum: the multiple of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Term {
    pub(crate) number: ExprId,
    pub(crate) factor: f64,
}

/// Sum of terms and a constant.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sum {
    /// Terms of different numbers that are not constant, in the order of the text.
    pub(crate) terms: Vec<Term>,
    pub(crate) constant: f64,
}

impl Sum {
    /// Takes apart a sum. `None` for too many terms.
    pub(crate) fn of(e: &Expressions, number: ExprId) -> Option<Self> {
        let mut sum = Self::default();
        sum.add(
            e,
            Term {
                number,
                factor: 1.0,
            },
        )?;
        Some(sum)
    }

    /// Returns the sum with a term replaced by the same multiple of another number. `None` for too many terms.
    pub(crate) fn with_replaced(&self, e: &Expressions, index: usize, by: ExprId) -> Option<Self> {
        let mut sum = self.without(index);
        let factor = self.terms[index].factor;
        sum.add(e, Term { number: by, factor })?;
        Some(sum)
    }

    /// Returns the sum without a term.
    pub(crate) fn without(&self, index: usize) -> Self {
        let mut sum = self.clone();
        sum.terms.remove(index);
        sum
    }

    fn add(&mut self, e: &Expressions, term: Term) -> Option<()> {
        let mut pending = vec![term];
        while let Some(Term { number, factor }) = pending.pop() {
            if let Some(value) = e.as_constant(number) {
                self.constant = difference(self.constant, -factor * value);
                continue;
            }
            let multiple = |number, times: f64| Term {
                number,
                factor: factor * times,
            };
            let (op, values) = match e.get(number) {
                Expression::Apply { op, values, .. } => (Some(*op), values.as_slice()),
                _ => (None, &[][..]),
            };
            match (op, values) {
                (Some(Op::Add), &[a, b]) => pending.extend([multiple(b, 1.0), multiple(a, 1.0)]),
                (Some(Op::Sub), &[a, b]) => pending.extend([multiple(b, -1.0), multiple(a, 1.0)]),
                (Some(Op::Neg), &[a]) => pending.push(multiple(a, -1.0)),
                (Some(Op::Mul), &[a, b]) if let Some(times) = e.as_constant(a) => {
                    pending.push(multiple(b, times));
                }
                (Some(Op::Mul), &[a, b]) if let Some(times) = e.as_constant(b) => {
                    pending.push(multiple(a, times));
                }
                (Some(Op::Div), &[a, b]) if let Some(divisor) = e.as_constant(b) => {
                    pending.push(multiple(a, 1.0 / divisor));
                }
                _ => self.merge(Term { number, factor }),
            }
            if self.terms.len() + pending.len() > MAX_TERMS {
                return None;
            }
        }
        Some(())
    }

    fn merge(&mut self, term: Term) {
        let known = self.terms.iter().position(|it| it.number == term.number);
        let Some(index) = known else {
            self.terms.push(term);
            return;
        };
        let factor = difference(self.terms[index].factor, -term.factor);
        match factor == 0.0 {
            true => _ = self.terms.remove(index),
            false => self.terms[index].factor = factor,
        }
    }

    /// Returns the sum as a number.
    pub(crate) fn build(&self, e: &mut Expressions) -> ExprId {
        let mut sum = None;
        for &Term { number, factor } in &self.terms {
            let (op, term) = match (sum, factor.abs() == 1.0) {
                (Some(_), true) if factor < 0.0 => (Op::Sub, number),
                (None, true) if factor < 0.0 => (Op::Add, e.call(Op::Neg, &[number])),
                (_, true) => (Op::Add, number),
                (_, false) => {
                    let factor = e.constant(factor);
                    (Op::Add, e.call(Op::Mul, &[number, factor]))
                }
            };
            sum = Some(sum.map_or(term, |sum| e.call(op, &[sum, term])));
        }
        let constant = e.constant(self.constant);
        match sum {
            Some(sum) if self.constant == 0.0 => sum,
            Some(sum) => e.call(Op::Add, &[sum, constant]),
            None => constant,
        }
    }
}

/// Returns the difference of two constants, or zero where it is rounding.
pub(crate) fn difference(a: f64, b: f64) -> f64 {
    let difference = a - b;
    match difference.abs() <= ROUNDING * a.abs().max(b.abs()) {
        true => 0.0,
        false => difference,
    }
}
