//! Numbers as sums of multiples of others, so that two that follow the same parameters can be compared.

use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;
use std::collections::BTreeMap;

/// A constant and multiples of numbers that are no such sums themselves.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Linear {
    constant: f64,
    terms: BTreeMap<ExprId, f64>,
}

impl Linear {
    pub(super) fn constant(constant: f64) -> Self {
        Self {
            constant,
            terms: BTreeMap::new(),
        }
    }

    /// A number that depends on no point. Recursion over sums within sums, which the elaborator's limit of
    /// nested expressions bounds.
    pub(super) fn of(expressions: &Expressions, id: ExprId) -> Self {
        let of = |id: ExprId| Self::of(expressions, id);
        if let Some(value) = expressions.as_constant(id) {
            return Self::constant(value);
        }
        if let Expression::Apply { op, values, .. } = expressions.get(id) {
            match (op, values.as_slice()) {
                (Op::Add, [a, b]) => return of(*a).plus(&of(*b), 1.0),
                (Op::Sub, [a, b]) => return of(*a).plus(&of(*b), -1.0),
                (Op::Neg, [a]) => return of(*a).times(-1.0),
                (Op::Mul, [a, b]) => {
                    let (a, b) = (of(*a), of(*b));
                    if a.terms.is_empty() {
                        return b.times(a.constant);
                    }
                    if b.terms.is_empty() {
                        return a.times(b.constant);
                    }
                }
                (Op::Div, [a, b]) => {
                    let b = of(*b);
                    if b.terms.is_empty() && b.constant != 0.0 {
                        return of(*a).times(1.0 / b.constant);
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

    /// The value, if it follows nothing. Multiples that only rounding left count as none.
    pub(super) fn as_constant(&self) -> Option<f64> {
        let is_none = |term: &f64| term.abs() <= 1e-12;
        self.terms.values().all(is_none).then_some(self.constant)
    }

    pub(super) fn times(mut self, factor: f64) -> Self {
        self.constant *= factor;
        for term in self.terms.values_mut() {
            *term *= factor;
        }
        self
    }

    /// The sum with a multiple of another one.
    pub(super) fn plus(mut self, other: &Self, factor: f64) -> Self {
        self.constant += other.constant * factor;
        for (&id, &term) in &other.terms {
            *self.terms.entry(id).or_default() += term * factor;
        }
        self
    }

    /// All values, by those of the numbers in it. Multiples that only rounding left count as none.
    pub(super) fn range(&self, mut of: impl FnMut(ExprId) -> Interval) -> Interval {
        let largest = self
            .terms
            .values()
            .fold(0.0, |most: f64, v| most.max(v.abs()));
        let terms = self
            .terms
            .iter()
            .filter(|(_, term)| term.abs() > 1e-12 * largest.max(1.0));
        terms.fold(Interval::point(self.constant), |sum, (&id, &term)| {
            sum + of(id) * Interval::point(term)
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
        let rest = e.call(Op::Sub, &[sum, t]);
        let [sum, rest] = [sum, rest].map(|id| Linear::of(&e, id));
        assert_eq!(sum, Linear::of(&e, t));
        let anything = |_| Interval::ALL;
        assert_eq!(rest.range(anything), Interval::point(0.0));
        assert_eq!(sum.range(anything), Interval::ALL);
    }
}
