//! Sets of sums that have a plateau at the level.

use super::{Level, Set, Sublevels};
use crate::analysis::terms::{Sum, Term, difference};
use crate::expression::{ExprId, Expression};
use sdfc_vm::table::Op;

impl Sublevels<'_, '_> {
    /// Returns the set of a sum, or of a multiple, with a plateau at the level.
    pub(super) fn of_sum(&mut self, number: ExprId, level: Level, depth: u32) -> Option<Set> {
        let sum = Sum::of(self.e, number)?;
        if let [
            Term {
                number: term,
                factor,
            },
        ] = *sum.terms
        {
            if term == number {
                return None;
            }
            let level = level.at(difference(level.value, sum.constant));
            return self.of_multiple(term, factor, level, depth);
        }
        self.of_integers(&sum, level, depth)
            .or_else(|| self.of_extremes(&sum, level, depth))
            .or_else(|| self.of_steps(&sum, level, depth))
            .or_else(|| self.distributed(&sum, level, depth))
    }

    /// Returns the set at which the multiple of a number lies below a level.
    fn of_multiple(
        &mut self,
        number: ExprId,
        factor: f64,
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let end = level.value / factor;
        match end.is_finite() && factor.is_finite() {
            false => None,
            true if factor > 0.0 => Some(self.below(number, level.at(end), depth)),
            true => Some(self.not_below(number, level.of_rest().at(end), depth)),
        }
    }

    /// Returns the set of a sum in which the first term and the rest have plateaus at their highest or lowest values.
    fn of_extremes(&mut self, sum: &Sum, level: Level, depth: u32) -> Option<Set> {
        let Term { number, factor } = *sum.terms.first()?;
        let mut values = self.facts.pieces.of(self.e, number).values()?.to_vec();
        values.push(0.0);
        let rest = sum.without(0).build(self.e);
        values.into_iter().find_map(|value| {
            let end = difference(level.value, factor * value);
            let mut end_sets = |is_included| {
                let level = Level {
                    is_included,
                    ..level
                };
                let first = self.of_multiple(number, factor, level.at(factor * value), depth)?;
                Some([first, self.below(rest, level.at(end), depth)])
            };
            let [below, up_to] = [end_sets(false)?, end_sets(true)?];
            match (up_to, below) {
                // No point has more than the highest values, or less than the lowest ones.
                ([Set::All, Set::All], _) => Some(match level.is_included {
                    true => Set::All,
                    false => below[0].union(below[1], self.e),
                }),
                (_, [Set::Empty, Set::Empty]) => Some(match level.is_included {
                    true => up_to[0].intersection(up_to[1], self.e),
                    false => Set::Empty,
                }),
                _ => None,
            }
        })
    }

    /// Returns the set of a sum in which a term has few values.
    fn of_steps(&mut self, sum: &Sum, level: Level, depth: u32) -> Option<Set> {
        let (index, values) = (0..sum.terms.len()).find_map(|index| {
            let pieces = self.facts.pieces.of(self.e, sum.terms[index].number);
            Some((index, pieces.all_values()?))
        })?;
        let Term { number, factor } = sum.terms[index];
        let rest = sum.without(index).build(self.e);
        let mut set = Set::Empty;
        for value in values {
            let value = factor * value;
            let low = self.of_multiple(number, factor, Level::including(value), depth)?;
            let rest = self.below(rest, level.at(difference(level.value, value)), depth);
            let part = low.intersection(rest, self.e);
            set = set.union(part, self.e);
        }
        Some(set)
    }

    /// Returns the set of a sum in which a term is one of two numbers, by each of these.
    fn distributed(&mut self, sum: &Sum, level: Level, depth: u32) -> Option<Set> {
        let (index, is_minimum, operands) = (0..sum.terms.len()).find_map(|index| {
            let (is_minimum, operands) = self.compared_in(sum.terms[index].number)?;
            Some((index, is_minimum, operands))
        })?;
        let mut sets = [Set::Empty; 2];
        for (set, operand) in sets.iter_mut().zip(operands) {
            let number = sum.with_replaced(self.e, index, operand)?.build(self.e);
            *set = self.below(number, level, depth);
        }
        let is_reversed = sum.terms[index].factor < 0.0;
        let combination = if is_minimum != is_reversed {
            Op::Min
        } else {
            Op::Max
        };
        Some(self.combined(combination, sets))
    }

    /// Returns the operands of a number that is the lesser or the greater of two, and whether it is the lesser.
    fn compared_in(&mut self, number: ExprId) -> Option<(bool, [ExprId; 2])> {
        let Expression::Apply { op, values, .. } = self.e.get(number).clone() else {
            return None;
        };
        match (op, values.as_slice()) {
            (Op::Min | Op::Max, &[a, b]) => Some((op == Op::Min, [a, b])),
            (Op::Abs, &[a]) => Some((false, [a, self.e.call(Op::Neg, &[a])])),
            (Op::Clamp, &[a, low, high]) => Some((true, [self.e.call(Op::Max, &[a, low]), high])),
            _ => None,
        }
    }
}
