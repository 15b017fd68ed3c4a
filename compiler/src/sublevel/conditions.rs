//! Sets at which conditions hold, and sets that conditions select.

use super::{Level, Set, Sublevels};
use crate::expression::{ExprId, Expression};
use sdfc_vm::table::Op;

impl Sublevels<'_, '_> {
    /// Returns the first set where a condition holds, and the second elsewhere.
    pub(super) fn selected(
        &mut self,
        condition: ExprId,
        sets: [Set; 2],
        depth: u32,
    ) -> Option<Set> {
        if let [Set::Field(a), Set::Field(b)] = sets {
            // The planes between both are no surfaces of either.
            return Some(Set::Field(self.e.call(Op::Select, &[condition, a, b])));
        }
        let holds = self.where_true(condition, depth)?;
        Some(self.in_parts(holds, sets))
    }

    /// Returns the first set within a part of space, and the second in the rest.
    pub(super) fn in_parts(&mut self, part: Set, sets: [Set; 2]) -> Set {
        let rest = part.complement(self.e);
        let a = part.intersection(sets[0], self.e);
        let b = rest.intersection(sets[1], self.e);
        a.union(b, self.e)
    }

    /// Returns the set at which a condition holds.
    pub(super) fn where_true(&mut self, condition: ExprId, depth: u32) -> Option<Set> {
        let depth = depth.checked_sub(1)?;
        let Expression::Apply { op, values, .. } = self.e.get(condition).clone() else {
            return match self.e.as_constant(condition)? {
                0.0 => Some(Set::Empty),
                _ => Some(Set::All),
            };
        };
        match (op, values.as_slice()) {
            (Op::Not, &[a]) => Some(self.where_true(a, depth)?.complement(self.e)),
            (Op::And | Op::Or, &[a, b]) => {
                let sets = [self.where_true(a, depth)?, self.where_true(b, depth)?];
                let combination = if op == Op::And { Op::Max } else { Op::Min };
                Some(self.combined(combination, sets))
            }
            (Op::Less, &[a, b]) => Some(self.less(a, b, depth)),
            _ => None,
        }
    }

    /// Returns the set at which a number is less than another one.
    pub(super) fn less(&mut self, a: ExprId, b: ExprId, depth: u32) -> Set {
        if let Some(level) = self.e.as_constant(b) {
            return self.below(a, Level::excluding(level), depth);
        }
        if let Some(level) = self.e.as_constant(a) {
            return self.not_below(b, Level::including(level), depth);
        }
        let difference = self.e.call(Op::Sub, &[a, b]);
        self.below(difference, Level::ZERO, depth)
    }
}
