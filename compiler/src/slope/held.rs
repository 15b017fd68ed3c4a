//! Bounds of slopes with jumps held, throughout a region.

use super::{Budget, ENDLESS, MAX_BOXES, Ranges, STEEPEST, Search, is_loose, points, searched};
use crate::boxes::Held;
use crate::expression::{ExprId, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;

/// The times by which a bound may exceed the usual slope, before bounds around each point are worth their operations.
const UNEVEN: f64 = 4.0;

/// A region in which bounds are searched.
pub(super) struct Throughout<'a> {
    pub(super) region: &'a Bounds,
    pub(super) ranges: &'a Ranges,
    pub(super) budget: &'a mut Budget,
}

impl Throughout<'_> {
    /// A bound of the slope of numbers.
    pub(super) fn slope(
        &mut self,
        expressions: &Expressions,
        numbers: &[ExprId],
        held: Held,
    ) -> Option<f64> {
        let search = Search::new(expressions, numbers, self.ranges).holding(held);
        let (bound, search) = searched(search, self.region, self.budget, [MAX_BOXES, ENDLESS]);
        let is_bound = bound < STEEPEST && !is_loose(bound, search, self.region);
        is_bound.then_some(bound)
    }

    /// The slope that half of the points tried do not exceed.
    pub(super) fn usual(&self, expressions: &Expressions, number: ExprId) -> Option<f64> {
        let mut search = Search::new(expressions, &[number], self.ranges);
        let mut slopes: Vec<f64> = Vec::new();
        for point in points(self.region) {
            let gradients = search.duals_at(point).map(|dual| dual.gradient);
            slopes.extend(gradients.map(|g| (g.x * g.x + g.y * g.y + g.z * g.z).sqrt()));
        }
        slopes.sort_by(f64::total_cmp);
        slopes.get(slopes.len() / 2).copied()
    }

    /// Reports whether a number is as steep as a bound in few places only.
    pub(super) fn is_uneven(&self, expressions: &Expressions, number: ExprId, bound: f64) -> bool {
        let usual = self.usual(expressions, number);
        usual.is_some_and(|usual| bound > usual * UNEVEN)
    }

    /// Reports whether it is proved that a number changes wherever it is.
    pub(super) fn is_nowhere_flat(&self, expressions: &Expressions, number: ExprId) -> bool {
        let mut search = Search::new(expressions, &[number], self.ranges);
        let changes = |part: Interval| part.lo > 0.0 || part.hi < 0.0;
        search
            .first_over(self.region)
            .is_some_and(|Dual { gradient, .. }| {
                [gradient.x, gradient.y, gradient.z]
                    .into_iter()
                    .any(changes)
            })
    }

    /// Reports whether it is proved that a number is above zero.
    pub(super) fn is_positive(&self, expressions: &Expressions, number: ExprId) -> bool {
        let mut search = Search::new(expressions, &[number], self.ranges);
        search
            .first_over(self.region)
            .is_some_and(|Dual { value, .. }| value.lo > 0.0)
    }
}
