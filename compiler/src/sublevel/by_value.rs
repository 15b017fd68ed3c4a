//! Sets of numbers that have a plateau at the level, from their operations.

use super::integer_sum::{below_rounded, is_integer};
use super::{Level, Node, Set, Sublevels};
use crate::analysis::definedness::ROUNDING_SHARE;
use crate::analysis::terms::{Sum, Term};
use crate::expression::ExprId;
use crate::scene::NO_SURFACE_DISTANCE;
use crate::symbolic::simplified;
use sdfc_vm::table::Op;

impl Sublevels<'_, '_> {
    /// Returns the set of a number with plateaus, from its operation.
    pub(super) fn by_value(
        &mut self,
        Node { number, op, values }: Node<'_>,
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let c = level.value;
        let is_included = level.is_included;
        match (op, values) {
            (Op::Min | Op::Max, &[a, b]) => {
                let sets = [a, b].map(|operand| self.below(operand, level, depth));
                Some(self.combined(op, sets))
            }
            (Op::Clamp, &[a, low, high]) => {
                let [a, low, high] = [a, low, high].map(|id| self.below(id, level, depth));
                let above_low = a.intersection(low, self.e);
                Some(above_low.union(high, self.e))
            }
            (Op::Trunc, &[a]) => {
                let is_floor = c > 0.0 || c == 0.0 && is_included;
                let rounding = if is_floor { Op::Floor } else { Op::Ceil };
                Some(self.below(a, below_rounded(rounding, level), depth))
            }
            // Between −1 and 1 there is nothing but zero, where the operand is.
            (Op::Sign, &[a]) => {
                let includes_zero = c > 0.0 || c == 0.0 && is_included;
                let level = match includes_zero {
                    true => Level::including(0.0),
                    false => Level::excluding(0.0),
                };
                Some(self.below(a, level, depth))
            }
            (Op::Step, &[edge, a]) => Some(self.less(a, edge, depth)),
            (Op::Less | Op::And | Op::Or | Op::Not, _) => {
                let holds = self.where_true(number, depth)?;
                Some(holds.complement(self.e))
            }
            (Op::Smoothstep, &[from, to, a]) => self.below_smoothstep([from, to, a], level, depth),
            (Op::Select, &[condition, a, b]) => {
                let sets = [a, b].map(|branch| self.below(branch, level, depth));
                self.selected(condition, sets, depth)
            }
            (Op::Abs, &[a]) => self.below_magnitude(a, level, depth),
            (Op::Square, &[a]) if c >= 0.0 => self.below_magnitude(a, level.at(c.sqrt()), depth),
            (Op::Sqrt, &[a]) if c >= 0.0 => Some(self.below(a, level.at(c * c), depth)),
            (Op::Floor | Op::Ceil | Op::Round, _) => {
                let sum = Sum::of(self.e, number)?;
                self.of_integers(&sum, level, depth)
            }
            (Op::Add | Op::Sub | Op::Neg, _) => self.of_sum(number, level, depth),
            (Op::Mix, &[a, b, switch]) if self.facts.pieces.of(self.e, switch).is_switch() => {
                let on = self.not_below(switch, Level::excluding(1.0), depth);
                let sets = [b, a].map(|branch| self.below(branch, level, depth));
                Some(self.in_parts(on, sets))
            }
            (Op::Mix, &[a, b, weight]) => {
                let product = self.product_of_mix(a, b, weight)?;
                Some(self.below(product, level, depth))
            }
            (Op::Exp, &[a]) if c > 0.0 => Some(self.below(a, level.at(c.ln()), depth)),
            (Op::Mul, &[a, b]) if self.are_switches([a, b]) => {
                let sets = [a, b].map(|id| self.below(id, level, depth));
                Some(self.combined(Op::Min, sets))
            }
            (Op::Mul | Op::Div, _) => self.of_sum(number, level, depth),
            _ => None,
        }
    }

    /// Reports whether numbers are zero or one everywhere.
    pub(super) fn are_switches(&mut self, numbers: [ExprId; 2]) -> bool {
        numbers
            .into_iter()
            .all(|number| self.facts.pieces.of(self.e, number).is_switch())
    }

    /// Returns an interpolation from or to zero as a product.
    fn product_of_mix(&mut self, a: ExprId, b: ExprId, weight: ExprId) -> Option<ExprId> {
        let is_zero = |id: ExprId| self.e.as_constant(id) == Some(0.0);
        match (is_zero(a), is_zero(b)) {
            (true, _) => Some(self.e.call(Op::Mul, &[b, weight])),
            (_, true) => {
                let one = self.e.constant(1.0);
                let rest = self.e.call(Op::Sub, &[one, weight]);
                Some(self.e.call(Op::Mul, &[a, rest]))
            }
            _ => None,
        }
    }

    /// Returns the set at which the magnitude of a number lies below a level.
    pub(super) fn below_magnitude(
        &mut self,
        number: ExprId,
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let below = self.below(number, level, depth);
        let above = self.not_below(number, level.of_rest(), depth);
        Some(below.intersection(above, self.e))
    }

    /// Returns the set of a smoothstep that has a plateau at the level: zero or one.
    pub(super) fn below_smoothstep(
        &mut self,
        [from, to, number]: [ExprId; 3],
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let [from, to] = [self.e.as_constant(from)?, self.e.as_constant(to)?];
        let end = if level.value == 0.0 { from } else { to };
        match level.value == 0.0 || level.value == 1.0 {
            true if from < to => Some(self.below(number, level.at(end), depth)),
            true if to < from => Some(self.not_below(number, level.of_rest().at(end), depth)),
            _ => None,
        }
    }

    /// Returns the set of a number with plateaus of unknown shape. Values within rounding of the level count as equal.
    pub(super) fn by_selection(&mut self, number: ExprId, level: Level) -> Set {
        self.facts.selections += 1;
        let shifted = self.shifted(number, level);
        let mut limit = self.e.constant(level.value);
        if let Some(rounding) = self.rounding(shifted) {
            let op = if level.is_included { Op::Add } else { Op::Sub };
            limit = self.e.call(op, &[limit, rounding]);
        }
        let (condition, inside, outside) = match level.is_included {
            false => ([number, limit], shifted, NO_SURFACE_DISTANCE),
            true => ([limit, number], shifted, -NO_SURFACE_DISTANCE),
        };
        let condition = self.e.call(Op::Less, &condition);
        let outside = self.e.constant(outside);
        Set::Field(self.e.call(Op::Select, &[condition, inside, outside]))
    }

    /// Returns the rounding of a sum that is not one of integers.
    pub(super) fn rounding(&mut self, sum: ExprId) -> Option<ExprId> {
        let Sum { terms, constant } = Sum::of(self.e, sum)?;
        let is_integer =
            |term: &Term| term.factor.fract() == 0.0 && is_integer(self.e, term.number);
        if constant.fract() == 0.0 && terms.iter().all(is_integer) {
            return None;
        }
        let mut magnitude = self.e.constant(constant.abs());
        for Term { number, factor } in terms {
            let factor = self.e.constant(factor);
            let term = simplified(self.e, Op::Mul, &[number, factor]);
            let term = self.e.call(Op::Abs, &[term]);
            magnitude = self.e.call(Op::Add, &[magnitude, term]);
        }
        let share = self.e.constant(ROUNDING_SHARE);
        Some(self.e.call(Op::Mul, &[magnitude, share]))
    }
}
