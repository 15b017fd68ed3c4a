//! Sets below zero, from the signs of operands.

use super::{Level, Node, Set, Sublevels, is_above_zero, is_magnitude};
use crate::expression::{ExprId, Expression, Expressions};
use crate::uniforms::postorder;
use sdfc_vm::row::Continuity;
use sdfc_vm::table::Op;

impl Sublevels<'_, '_> {
    /// Returns a set that follows from the signs of operands.
    pub(super) fn by_sign(&mut self, node: Node<'_>, level: Level, depth: u32) -> Option<Set> {
        let Node { number, op, values } = node;
        match (op, values) {
            (Op::Neg, &[a]) => Some(self.not_below(a, level.of_rest(), depth)),
            (Op::Min | Op::Max, &[a, b]) => {
                let sets = [a, b].map(|operand| self.below(operand, level, depth));
                Some(self.combined(op, sets))
            }
            (Op::Select, &[condition, a, b]) => {
                let sets = [a, b].map(|branch| self.below(branch, level, depth));
                self.selected(condition, sets, depth)
            }
            (Op::Sinh, &[a]) => Some(self.below(a, level, depth)),
            (Op::Atan | Op::Tanh | Op::Asin | Op::Sign, &[a]) if !may_have_poles(self.e, a) => {
                Some(self.below(a, level, depth))
            }
            (Op::Sqrt, &[a]) if self.is_root(number) => self.below_root(a, level, depth),
            (Op::Pow, &[a, _]) if self.is_root(number) => self.below_root(a, level, depth),
            (Op::Mul | Op::Div, _) => self.of_product(node, level, depth),
            _ => None,
        }
    }

    /// Returns the set of a root or power, which is zero where its operand is and positive elsewhere.
    pub(super) fn below_root(&mut self, operand: ExprId, level: Level, depth: u32) -> Option<Set> {
        match level.is_included {
            true => Some(self.below(operand, level, depth)),
            false => Some(Set::Empty),
        }
    }

    /// Reports whether a number is a root or a power that is not defined where its operand is negative.
    pub(super) fn is_root(&mut self, number: ExprId) -> bool {
        let Expression::Apply { op, values, .. } = self.e.get(number) else {
            return false;
        };
        let is_fraction = |id: ExprId| {
            let exponent = self.e.as_constant(id);
            exponent.is_some_and(|exponent| exponent > 0.0 && exponent.fract() != 0.0)
        };
        match (op, values.as_slice()) {
            (Op::Sqrt, &[a]) => !is_magnitude(self.e, a),
            (Op::Pow, &[a, exponent]) => is_fraction(exponent) && !is_magnitude(self.e, a),
            _ => false,
        }
    }
}

/// Reports whether a number may be infinite on both sides of a point.
fn may_have_poles(e: &Expressions, number: ExprId) -> bool {
    postorder(e, number, |_| false)
        .into_iter()
        .any(|id| match e.get(id) {
            Expression::Apply {
                op: Op::Pow,
                values,
                ..
            } => !is_above_zero(e, values[1]),
            Expression::Apply { op, .. } => op.row().facts.continuity == Continuity::HasPoles,
            _ => false,
        })
}
