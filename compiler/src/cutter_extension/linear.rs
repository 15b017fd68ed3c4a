//! Numbers as linear combinations of others, so that numbers that depend on the same parameters can be
//! compared.

use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;
use std::collections::BTreeMap;

/// A constant plus multiples of numbers that are not linear combinations themselves.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LinearForm {
    constant: f64,
    terms: BTreeMap<ExprId, f64>,
}

impl LinearForm {
    pub(super) fn constant(constant: f64) -> Self {
        Self {
            constant,
            terms: BTreeMap::new(),
        }
    }

    /// Returns the linear form of a number that does not depend on the point. It recurses over nested sums, which
    /// the elaborator's limit of nested expressions bounds.
    pub(super) fn from_expr(expressions: &Expressions, id: ExprId) -> Self {
        let operand = |id: ExprId| Self::from_expr(expressions, id);
        if let Some(value) = expressions.as_constant(id) {
            return Self::constant(value);
        }
        if let Expression::Apply { op, values, .. } = expressions.get(id) {
            match (op, values.as_slice()) {
                (Op::Add, [a, b]) => return operand(*a).plus_scaled(&operand(*b), 1.0),
                (Op::Sub, [a, b]) => return operand(*a).plus_scaled(&operand(*b), -1.0),
                (Op::Neg, [a]) => return operand(*a).scaled(-1.0),
                (Op::Mul, [a, b]) => {
                    let (a, b) = (operand(*a), operand(*b));
                    if a.terms.is_empty() {
                        return b.scaled(a.constant);
                    }
                    if b.terms.is_empty() {
                        return a.scaled(b.constant);
                    }
                }
                (Op::Div, [a, b]) => {
                    let b = operand(*b);
                    if b.terms.is_empty() && b.constant != 0.0 {
                        return operand(*a).scaled(1.0 / b.constant);
                    }
                }
                _ => {}
            }
        }
        Self {
            constant: 0.0,
            terms: BTreeMap::from([(id, 1.0)]),
        }
    }

    /// Returns the value, if it has no terms. Factors up to 1e-12 count as rounding errors.
    pub(super) fn as_constant(&self) -> Option<f64> {
        let is_negligible = |term: &f64| term.abs() <= 1e-12;
        self.terms
            .values()
            .all(is_negligible)
            .then_some(self.constant)
    }

    pub(super) fn scaled(mut self, factor: f64) -> Self {
        self.constant *= factor;
        for term in self.terms.values_mut() {
            *term *= factor;
        }
        self
    }

    /// Adds a multiple of another form.
    pub(super) fn plus_scaled(mut self, other: &Self, factor: f64) -> Self {
        self.constant += other.constant * factor;
        for (&id, &term) in &other.terms {
            *self.terms.entry(id).or_default() += term * factor;
        }
        self
    }

    /// Bounds the values, from the ranges of its terms. Relative factors up to 1e-12 count as rounding errors.
    pub(super) fn range(&self, mut range_of: impl FnMut(ExprId) -> Interval) -> Interval {
        let max_factor = self
            .terms
            .values()
            .fold(0.0, |max: f64, v| max.max(v.abs()));
        let terms = self
            .terms
            .iter()
            .filter(|(_, term)| term.abs() > 1e-12 * max_factor.max(1.0));
        terms.fold(Interval::point(self.constant), |sum, (&id, &term)| {
            sum + range_of(id) * Interval::point(term)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_a_number_and_their_sum_are_one() {
        let mut e = Expressions::default();
        let t = e.time();
        let half = e.constant(0.5);
        let halved = e.call(Op::Mul, &[half, t]);
        let sum = e.call(Op::Add, &[halved, halved]);
        let difference = e.call(Op::Sub, &[sum, t]);
        let [sum, difference] = [sum, difference].map(|id| LinearForm::from_expr(&e, id));
        assert_eq!(sum, LinearForm::from_expr(&e, t));
        let anything = |_| Interval::ALL;
        assert_eq!(difference.range(anything), Interval::point(0.0));
        assert_eq!(sum.range(anything), Interval::ALL);
    }
}
