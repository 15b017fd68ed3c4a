//! Slope bounds with discontinuities held, throughout a region.

use super::{
    Budget, MAX_BOXES, MAX_BOXES_WHILE_INFINITE, SAMPLE_POINTS, SlopeSearch, found_slope,
    run_search, sample_points, search_slopes, steepest_of,
};
use crate::analysis::box_eval::HeldBranches;
use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expressions};
use crate::uniforms::postorder;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// Ratio of a bound to the median slope from which on bounds around each point are worth their
/// operations.
const MAX_MEDIAN_RATIO: f64 = 4.0;

/// Region in which bounds of the numbers of one graph are searched.
pub(super) struct RegionBounds<'a> {
    region: &'a Bounds,
    /// Size of the scene.
    pub(super) size: f64,
    ranges: &'a ParamRanges,
    budget: &'a mut Budget,
    /// Slopes of numbers and of their operands at the sample points.
    sampled: HashMap<ExprId, Vec<f64>>,
}

impl<'a> RegionBounds<'a> {
    pub(super) fn new(
        region: &'a Bounds,
        size: f64,
        ranges: &'a ParamRanges,
        budget: &'a mut Budget,
    ) -> Self {
        Self {
            region,
            size,
            ranges,
            budget,
            sampled: HashMap::new(),
        }
    }

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
        let best_sample = search.best_lower_bound();
        let steepest_sample = || match numbers {
            &[number] => self.steepest_sample(expressions, number),
            _ => steepest_of(search_slopes(search, self.region)),
        };
        found_slope(bound, best_sample, steepest_sample).map(|found| found.bound)
    }

    /// Returns the steepest slope of the sample points.
    fn steepest_sample(&mut self, expressions: &Expressions, number: ExprId) -> f64 {
        let slopes = self.sampled_slopes(expressions, number);
        let finite = slopes.iter().filter(|slope| slope.is_finite());
        finite.fold(0.0, |max, &slope| max.max(slope))
    }

    /// Returns the slopes of the sample points.
    fn sampled_slopes(&mut self, expressions: &Expressions, number: ExprId) -> &[f64] {
        if !self.sampled.contains_key(&number) {
            self.sample(expressions, number);
        }
        self.sampled.get(&number).map_or(&[], Vec::as_slice)
    }

    /// Returns the median slope of the sample points.
    pub(super) fn median_slope(
        &mut self,
        expressions: &Expressions,
        number: ExprId,
    ) -> Option<f64> {
        let mut slopes = self.sampled_slopes(expressions, number).to_vec();
        if slopes.is_empty() {
            return None;
        }
        let middle = slopes.len() / 2;
        let (_, median, _) = slopes.select_nth_unstable_by(middle, f64::total_cmp);
        Some(*median)
    }

    /// Samples the slopes of a number, and of all its operands with it.
    fn sample(&mut self, expressions: &Expressions, number: ExprId) {
        let mut search = SlopeSearch::new(expressions, &[number], self.ranges);
        let operands = postorder(expressions, number, |_| false);
        let mut slopes = vec![Vec::with_capacity(SAMPLE_POINTS); operands.len()];
        for point in sample_points(self.region) {
            for (slopes, dual) in slopes.iter_mut().zip(search.operands_at(point)) {
                let V3 { x, y, z } = dual.gradient;
                slopes.push((x * x + y * y + z * z).sqrt());
            }
        }
        self.sampled.extend(operands.into_iter().zip(slopes));
    }

    /// Reports whether a bound exceeds a number's median slope by far.
    pub(super) fn exceeds_median(
        &mut self,
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
