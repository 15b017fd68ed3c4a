//! Jumps of fields: comparisons and roundings of numbers that are equal in a part of space.
//!
//! Engines take the distance to a jump for that to the points at which both sides of a comparison are equal. Where they
//! are equal in a part of space, as in `max(x, y) == x`, the comparison is written by its set instead.

use super::set::Set;
use super::{Facts, Level, MAX_DEPTH, Sublevels};
use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expression, Expressions};
use crate::uniforms::{postorder, rewrite_number};
use sdfc_vm::table::Op;

/// Maximum number of operands with branches that are replaced in one rounded number.
const MAX_CASES: u32 = 6;

/// Returns a number with the same values, but for parts without thickness, in which nothing that is compared is equal in
/// a part of space.
pub(super) fn without_wide_jumps<'r>(
    e: &mut Expressions,
    number: ExprId,
    param_ranges: &'r ParamRanges,
    facts: &mut Facts<'r>,
) -> ExprId {
    let mut operands = postorder(e, number, |_| false).into_iter();
    if !operands.any(|id| jumps(e, id)) {
        return number;
    }
    rewrite_number(e, number, |e, id, rebuilt, values| {
        let Expression::Apply { op, .. } = *e.get(id) else {
            return rebuilt;
        };
        let selections = facts.selections;
        let mut sublevels = Sublevels {
            e,
            param_ranges,
            facts,
        };
        let number = sublevels.without_wide_jump(op, values);
        // Numbers that are piecewise constant stay as they are where no rule is known.
        let is_known = facts.selections == selections;
        number.filter(|_| is_known).unwrap_or(rebuilt)
    })
}

/// Reports whether a number may jump where its operands do not.
fn jumps(e: &Expressions, id: ExprId) -> bool {
    match e.get(id) {
        Expression::Apply { op, .. } => matches!(
            op,
            Op::Less | Op::Step | Op::Sign | Op::Floor | Op::Ceil | Op::Round
        ),
        _ => false,
    }
}

impl Sublevels<'_, '_> {
    /// Returns a comparison or a rounded number by sets; `None` where it jumps at surfaces alone.
    fn without_wide_jump(&mut self, op: Op, values: &[ExprId]) -> Option<ExprId> {
        match (op, values) {
            (Op::Less, &[a, b]) if self.are_equal_in_part(a, b) => {
                let set = self.less(a, b, MAX_DEPTH);
                Some(self.indicator(set))
            }
            (Op::Step, &[edge, a]) if self.are_equal_in_part(a, edge) => {
                let below = self.less(a, edge, MAX_DEPTH);
                let from_edge = below.complement(self.e);
                Some(self.indicator(from_edge))
            }
            (Op::Sign, &[a]) if self.shows_plateau(a, Level::ZERO) => {
                let signs = self.signs(a, MAX_DEPTH);
                let [negative, positive] =
                    [signs.negative, signs.positive].map(|set| self.indicator(set));
                Some(self.e.call(Op::Sub, &[positive, negative]))
            }
            (Op::Floor | Op::Ceil | Op::Round, &[a]) => self.rounded_by_cases(op, a, MAX_CASES),
            _ => None,
        }
    }

    /// Reports whether two numbers are equal in a part of space.
    fn are_equal_in_part(&mut self, a: ExprId, b: ExprId) -> bool {
        if let Some(value) = self.e.as_constant(b) {
            return self.shows_plateau(a, Level::including(value));
        }
        if let Some(value) = self.e.as_constant(a) {
            return self.shows_plateau(b, Level::including(value));
        }
        let difference = self.e.call(Op::Sub, &[a, b]);
        self.shows_plateau(difference, Level::ZERO)
    }

    /// Returns the number that is one in a set, and zero elsewhere.
    fn indicator(&mut self, set: Set) -> ExprId {
        let zero = self.e.constant(0.0);
        match set {
            Set::Empty => zero,
            Set::All => self.e.constant(1.0),
            Set::Field(field) => self.e.call(Op::Less, &[field, zero]),
        }
    }

    /// Returns a rounded number by the branches of its operand, of which one is rounded to a constant.
    fn rounded_by_cases(&mut self, op: Op, number: ExprId, cases: u32) -> Option<ExprId> {
        if cases == 0 || !self.is_constant_where_it_jumps(op, number) {
            return None;
        }
        let parts = self.branches_in(number)?;
        let results = parts.branches.map(|branch| {
            let number = self.with_replaced(number, parts.operand, branch);
            match self.rounded_by_cases(op, number, cases - 1) {
                Some(rounded) => rounded,
                None => self.e.call(op, &[number]),
            }
        });
        let [smaller, larger] = parts.in_order();
        let condition = self.e.call(Op::Less, &[smaller, larger]);
        Some(
            self.e
                .call(Op::Select, &[condition, results[0], results[1]]),
        )
    }

    /// Reports whether a number has a plateau at which its rounded value jumps.
    fn is_constant_where_it_jumps(&mut self, op: Op, number: ExprId) -> bool {
        let offset = if op == Op::Round { 0.5 } else { 0.0 };
        let values = self.facts.pieces.of(self.e, number).values();
        let jumps = |&&value: &&f64| (value - offset).fract() == 0.0;
        let values: Vec<f64> = values
            .unwrap_or_default()
            .iter()
            .filter(jumps)
            .copied()
            .collect();
        let mut values = values.into_iter();
        values.any(|value| self.shows_plateau(number, Level::including(value)))
    }
}
