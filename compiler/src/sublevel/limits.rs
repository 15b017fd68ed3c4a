//! Sets of limited numbers, such as `min(g, 0.1)`, which are flat beyond a limit that is not the level.
//!
//! There, values and gradients say nothing of the surface, and penumbras end. The number without its limit has the same
//! set. A limit remains where it bounds the slope, as beside a pole.

use super::set::Set;
use super::{Level, Node, Sublevels};
use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::analysis::terms::{Sum, Term, difference};
use crate::expression::ExprId;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// Side of the box in which slopes without a limit are bounded.
const BOX_SIZE: f64 = 2e3;

impl Sublevels<'_, '_> {
    /// Returns the set of a number from the operand that it limits; `None` where it limits none.
    pub(super) fn without_limit(
        &mut self,
        node: Node<'_>,
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let Node { number, op, values } = node;
        if !self.facts.pieces.of(self.e, number).may_have_any() {
            return None;
        }
        let set = match (op, values) {
            (Op::Min | Op::Max, &[a, b]) => {
                self.constant_of([a, b])?;
                let sets = [a, b].map(|id| self.below(id, level, depth));
                Some(self.combined(op, sets))
            }
            (Op::Clamp, &[a, low, high]) => {
                let [low, high] = [self.e.as_constant(low)?, self.e.as_constant(high)?];
                let is_between = low < level.value && level.value < high;
                is_between.then(|| self.below(a, level, depth))
            }
            (Op::Smoothstep, &[from, to, a]) => {
                self.below_slope_of_step([from, to, a], level, depth)
            }
            (Op::Mul, &[a, b]) if self.are_switches([a, b]) => self.by_value(node, level, depth),
            (Op::Step, _) => self.by_value(node, level, depth),
            (Op::Add | Op::Sub | Op::Neg | Op::Mul | Op::Div, _) => {
                self.without_inner_limit(number, level, depth)
            }
            _ => None,
        };
        let field = match set? {
            Set::Field(field) => field,
            set => return Some(set),
        };
        if self.has_bounded_slope(field) {
            return Some(Set::Field(field));
        }
        match (op, values) {
            (Op::Min | Op::Max, &[a, b]) if level.value == 0.0 => {
                let limit = self.constant_of([a, b])?;
                Some(Set::Field(self.e.call(op, &[field, limit])))
            }
            _ => None,
        }
    }

    /// Returns the first of two numbers that is constant.
    fn constant_of(&self, numbers: [ExprId; 2]) -> Option<ExprId> {
        let mut numbers = numbers.into_iter();
        numbers.find(|&number| self.e.as_constant(number).is_some())
    }

    /// Returns the set of a multiple of a limited number, plus a constant.
    fn without_inner_limit(&mut self, number: ExprId, level: Level, depth: u32) -> Option<Set> {
        let sum = Sum::of(self.e, number)?;
        let &[
            Term {
                number: term,
                factor,
            },
        ] = sum.terms.as_slice()
        else {
            return None;
        };
        let inner = level.at(difference(level.value, sum.constant) / factor);
        if term == number || !inner.value.is_finite() {
            return None;
        }
        let inner = if factor > 0.0 {
            inner
        } else {
            inner.of_rest().at(inner.value)
        };
        let set = self.below(term, inner, depth);
        let is_unchanged = set == Set::Field(self.shifted(term, inner));
        match is_unchanged {
            true => None,
            false if factor > 0.0 => Some(set),
            false => Some(set.complement(self.e)),
        }
    }

    /// Returns the set of a smoothstep at a level between zero and one.
    fn below_slope_of_step(
        &mut self,
        [from, to, number]: [ExprId; 3],
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let [from, to] = [self.e.as_constant(from)?, self.e.as_constant(to)?];
        if !(0.0 < level.value && level.value < 1.0) {
            return None;
        }
        // The cubic 3t² − 2t³ is solved by the sine of a third of an angle.
        let share = 0.5 - ((1.0 - 2.0 * level.value).asin() / 3.0).sin();
        let end = from + (to - from) * share;
        Some(match from < to {
            true => self.below(number, level.at(end), depth),
            false => self.not_below(number, level.of_rest().at(end), depth),
        })
    }

    /// Reports whether the slope of a number has a bound in a large box around the origin.
    fn has_bounded_slope(&mut self, number: ExprId) -> bool {
        let mut leaf = |id| UniformInput::Known(self.param_ranges.leaf(self.e, id));
        let mut program = BoxNumber::<Dual<Interval>>::new(self.e, number, &mut leaf);
        program.eval(&Bounds::centred([BOX_SIZE; 3]), &[]);
        program.gradient_norm_bound().is_finite()
    }
}
