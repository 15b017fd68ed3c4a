//! Sets of numbers by cases: an operand that has a plateau is replaced by each of its branches.

use super::{Level, Sublevels};
use crate::expression::{ExprId, Expression};
use crate::sublevel::set::Set;
use crate::uniforms::{postorder, rewrite_number};
use sdfc_vm::table::Op;

/// Operand that is one of two numbers.
pub(super) struct Branches {
    pub(super) operand: ExprId,
    /// Set if the operand is the first branch where it is below the second one.
    is_minimum: bool,
    pub(super) branches: [ExprId; 2],
}

impl Branches {
    /// Returns both branches. Where the first one returned is below the second, the operand is its first branch.
    pub(super) fn in_order(&self) -> [ExprId; 2] {
        let [a, b] = self.branches;
        if self.is_minimum { [a, b] } else { [b, a] }
    }
}

impl Sublevels<'_, '_> {
    /// Returns the set of a number with plateaus, by the branches of a minimum or maximum with a constant in it.
    pub(super) fn in_cases(&mut self, number: ExprId, level: Level, depth: u32) -> Option<Set> {
        let parts = self.branches_in(number)?;
        let sets = parts.branches.map(|branch| {
            let number = self.with_replaced(number, parts.operand, branch);
            self.below(number, level, depth)
        });
        let [smaller, larger] = parts.in_order();
        if let [Set::Field(a), Set::Field(b)] = sets {
            let condition = self.e.call(Op::Less, &[smaller, larger]);
            return Some(Set::Field(self.e.call(Op::Select, &[condition, a, b])));
        }
        let is_first = self.less(smaller, larger, depth);
        Some(self.in_parts(is_first, sets))
    }

    /// Returns the first operand of a number that is the lesser or the greater of a number and a constant.
    pub(super) fn branches_in(&mut self, number: ExprId) -> Option<Branches> {
        postorder(self.e, number, |_| false)
            .into_iter()
            .find_map(|id| {
                let Expression::Apply { op, values, .. } = self.e.get(id).clone() else {
                    return None;
                };
                let is_constant = |&id: &ExprId| self.e.as_constant(id).is_some();
                match (op, values.as_slice()) {
                    (Op::Min | Op::Max, &[a, b]) if values.iter().any(is_constant) => {
                        Some(Branches {
                            operand: id,
                            is_minimum: op == Op::Min,
                            branches: [a, b],
                        })
                    }
                    (Op::Clamp, &[a, low, high]) => Some(Branches {
                        operand: id,
                        is_minimum: true,
                        branches: [self.e.call(Op::Max, &[a, low]), high],
                    }),
                    _ => None,
                }
            })
    }

    /// Returns a number in which an operand is replaced by another one.
    pub(super) fn with_replaced(&mut self, number: ExprId, operand: ExprId, by: ExprId) -> ExprId {
        rewrite_number(self.e, number, |_, id, rebuilt, _| match id == operand {
            true => by,
            false => rebuilt,
        })
    }
}
