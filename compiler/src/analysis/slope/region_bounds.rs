//! Slope bounds with discontinuities held, throughout a region.

use super::{
    Budget, MAX_BOXES, MAX_BOXES_WHILE_INFINITE, MAX_SLOPE, SlopeSearch, is_loose, run_search,
    sample_points,
};
use crate::analysis::box_eval::HeldBranches;
use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;

/// Ratio of a bound to the median slope from which on bounds around each point are worth their
/// operations.
const MAX_MEDIAN_RATIO: f64 = 4.0;

/// Region in which bounds are searched.
pub(super) struct RegionBounds<'a> {
    pub(super) region: &'a Bounds,
    /// Size of the scene.
    pub(super) size: f64,
    pub(super) ranges: &'a ParamRanges,
    pub(super) budget: &'a mut Budget,
}

impl RegionBounds<'_> {
    /// Returns a slope bound of numbers.
    pub(super) fn slope(
        &mut self,
        expressions: &Expressions,
        numbers: &[ExprId],
        held: HeldBranches,
    ) -> Option<f64> {
        let search = SlopeSearch::new(expressions, numbers, self.ranges).with_held_branches(held);
        let (bound, search) = run_search(
            search,
            self.region,
            self.budget,
            [MAX_BOXES, MAX_BOXES_WHILE_INFINITE],
        );
        let is_bound = bound < MAX_SLOPE && !is_loose(bound, search, self.region);
        is_bound.then_some(bound)
    }

    /// Returns the median slope of the sample points.
    pub(super) fn median_slope(&self, expressions: &Expressions, number: ExprId) -> Option<f64> {
        let mut search = SlopeSearch::new(expressions, &[number], self.ranges);
        let mut slopes: Vec<f64> = Vec::new();
        for point in sample_points(self.region) {
            let gradients = search.duals_at(point).map(|dual| dual.gradient);
            slopes.extend(gradients.map(|g| (g.x * g.x + g.y * g.y + g.z * g.z).sqrt()));
        }
        slopes.sort_by(f64::total_cmp);
        slopes.get(slopes.len() / 2).copied()
    }

    /// Reports whether a bound exceeds a number's median slope by far.
    pub(super) fn exceeds_median(
        &self,
        expressions: &Expressions,
        number: ExprId,
        bound: f64,
    ) -> bool {
        let median_slope = self.median_slope(expressions, number);
        median_slope.is_some_and(|median_slope| bound > median_slope * MAX_MEDIAN_RATIO)
    }

    /// Reports whether a number is proved to have no zero gradient in the region.
    pub(super) fn is_nowhere_flat(&self, expressions: &Expressions, number: ExprId) -> bool {
        let mut search = SlopeSearch::new(expressions, &[number], self.ranges);
        let changes = |component: Interval| component.lo > 0.0 || component.hi < 0.0;
        search
            .first_in_region(self.region)
            .is_some_and(|Dual { gradient, .. }| {
                [gradient.x, gradient.y, gradient.z]
                    .into_iter()
                    .any(changes)
            })
    }

    /// Reports whether a number is proved to be above zero.
    pub(super) fn is_positive(&self, expressions: &Expressions, number: ExprId) -> bool {
        let mut search = SlopeSearch::new(expressions, &[number], self.ranges);
        search
            .first_in_region(self.region)
            .is_some_and(|Dual { value, .. }| value.lo > 0.0)
    }
}
