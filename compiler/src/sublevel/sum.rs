//! Sets of sums and differences that have a plateau at the level.

use super::set::negated;
use super::{Level, Set, Sublevels};
use crate::analysis::terms::FoldedSum;
use crate::expression::{ExprId, Expression};
use sdfc_vm::table::Op;

impl Sublevels<'_> {
    /// Returns the set of a sum or a difference with a plateau at the level.
    pub(super) fn of_sum(
        &mut self,
        op: Op,
        a: ExprId,
        b: ExprId,
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let is_difference = op == Op::Sub;
        if let Some(b) = self.e.as_constant(b) {
            let b = if is_difference { -b } else { b };
            return Some(self.below(a, level.at(level.value - b), depth));
        }
        if let Some(a) = self.e.as_constant(a) {
            let end = level.at(level.value - a);
            return Some(self.below_signed(b, is_difference, end, depth));
        }
        self.of_extremes([a, b], is_difference, level, depth)
            .or_else(|| self.of_steps([a, b], is_difference, level, depth))
            .or_else(|| self.distributed([a, b], is_difference, level, depth))
    }

    pub(super) fn of_folded_sum(&mut self, sum: FoldedSum, level: Level, depth: u32) -> Set {
        let zero = self.e.constant(0.0);
        let number = match sum.number.is_negated {
            true => negated(self.e, sum.number.number),
            false => sum.number.number,
        };
        let half = self.e.call(sum.op, &[number, zero]);
        let level = level.at((level.value - sum.constant) / 2.0);
        self.below(half, level, depth)
    }

    /// Returns the set of a sum whose terms have plateaus at their highest or lowest values.
    pub(super) fn of_extremes(
        &mut self,
        [a, b]: [ExprId; 2],
        is_difference: bool,
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let values = self.pieces.of(self.e, a).values()?.to_vec();
        // No point has more than the highest values, or less than the lowest ones.
        let excluded = if level.is_included {
            Set::Empty
        } else {
            Set::All
        };
        values.into_iter().find_map(|value| {
            let ends = [value, level.value - value];
            let mut end_sets = |is_included| {
                let level = Level {
                    is_included,
                    ..level
                };
                let first = self.below(a, level.at(ends[0]), depth);
                [
                    first,
                    self.below_signed(b, is_difference, level.at(ends[1]), depth),
                ]
            };
            if end_sets(!level.is_included) != [excluded; 2] {
                return None;
            }
            let [first, second] = end_sets(level.is_included);
            Some(match level.is_included {
                false => first.union(second, self.e),
                true => first.intersection(second, self.e),
            })
        })
    }

    /// Returns the set of a sum in which a minimum or a maximum is the first or the second term.
    pub(super) fn distributed(
        &mut self,
        terms: [ExprId; 2],
        is_difference: bool,
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let (index, op, operands) = (0..2).find_map(|index| {
            let has_plateau = self.pieces.of(self.e, terms[index]).may_have_any();
            match self.e.get(terms[index]) {
                Expression::Apply {
                    op: op @ (Op::Min | Op::Max),
                    values,
                    ..
                } if has_plateau => Some((index, *op, [values[0], values[1]])),
                _ => None,
            }
        })?;
        let sum = if is_difference { Op::Sub } else { Op::Add };
        let sets = operands.map(|operand| {
            let mut terms = terms;
            terms[index] = operand;
            let number = self.e.call(sum, &terms);
            self.below(number, level, depth)
        });
        let is_reversed = is_difference && index == 1;
        let combination = if (op == Op::Min) != is_reversed {
            Op::Min
        } else {
            Op::Max
        };
        Some(self.combined(combination, sets))
    }

    /// Returns the set of a sum of a number with few values and any other number.
    pub(super) fn of_steps(
        &mut self,
        [a, b]: [ExprId; 2],
        is_difference: bool,
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let (steps, values, are_second) =
            match [a, b].map(|id| self.pieces.of(self.e, id).all_values()) {
                [Some(values), _] => (a, values, false),
                [None, Some(values)] => (b, values, true),
                [None, None] => return None,
            };
        let other = if are_second { a } else { b };
        let mut set = Set::Empty;
        for value in values {
            let value = if are_second && is_difference {
                -value
            } else {
                value
            };
            let low = Level::including(value);
            let low = self.below_signed(steps, are_second && is_difference, low, depth);
            let rest = level.at(level.value - value);
            let rest = self.below_signed(other, !are_second && is_difference, rest, depth);
            let part = low.intersection(rest, self.e);
            set = set.union(part, self.e);
        }
        Some(set)
    }
}
