//! Nodes of the branch-and-bound search for slopes: parts of space together with parts of the ranges of
//! parameters.

use crate::analysis::box_eval::{AxisDependence, BoxNumber, HeldBranches, UniformInput};
use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;

/// Fractions of each range at which slopes at points are sampled: its end, where most fields are
/// steepest, and a point inside.
const SAMPLE_FRACTIONS: [f64; 2] = [1.0, 0.38];

/// Fraction of each range at which a single value stands for all. The middle of a range is often a special value at
/// which a field is constant, such as the exponent zero.
const TYPICAL_FRACTION: f64 = 0.62;

/// Distance of a sample beside a corner from the centre, in units of the corner's. At a corner itself, a number may be
/// undefined.
const CORNER_FRACTION: f64 = 0.999;

/// Maximum ratio of the bound after halving a range to that after halving space, for the range to be
/// halved.
const MAX_RANGE_RATIO: f64 = 0.95;

/// A node: a part of space, and of the range of each parameter.
pub(super) struct SubBox {
    /// Bound on the square of the slope in it.
    pub(super) upper: f64,
    bounds: Bounds,
    ranges: Vec<Interval>,
}

/// Numbers whose slope is searched, over boxes and at points.
pub(super) struct SlopeSearch {
    box_numbers: Vec<BoxNumber<Dual<Interval>>>,
    point_numbers: Vec<BoxNumber<Dual<f64>>>,
    /// Indices of the ranges that are worth halving.
    split_ranges: Vec<usize>,
    /// Ranges of the parameters and of time that the numbers depend on.
    ranges: Vec<Interval>,
    /// Square of the steepest sampled slope.
    max_square: f64,
    /// Square of the steepest slope beside the corners of the region. It ends the search only: far from a surface, a field
    /// may be much steeper than beside it.
    corner_square: f64,
    /// Values at which the slope matters.
    relevant_values: Interval,
    /// Region in which a bound is known, and the square of that bound.
    known: Option<(Bounds, f64)>,
}

impl SlopeSearch {
    pub(super) fn new(expressions: &Expressions, numbers: &[ExprId], ranges: &ParamRanges) -> Self {
        let mut ranged = Vec::new();
        let mut uniform = |id| {
            let range = ranges.leaf(expressions, id);
            if range.lo == range.hi || !(range.hi - range.lo).is_finite() {
                return UniformInput::Known(range);
            }
            let slot = ranged.iter().position(|&(existing, _)| existing == id);
            UniformInput::Input(slot.unwrap_or_else(|| {
                ranged.push((id, range));
                ranged.len() - 1
            }))
        };
        let box_numbers = numbers
            .iter()
            .map(|&id| BoxNumber::new(expressions, id, &mut uniform))
            .collect();
        let point_numbers = numbers
            .iter()
            .map(|&id| BoxNumber::new(expressions, id, &mut uniform))
            .collect();
        Self {
            box_numbers,
            point_numbers,
            split_ranges: Vec::new(),
            ranges: ranged.into_iter().map(|(_, range)| range).collect(),
            max_square: 0.0,
            corner_square: 0.0,
            relevant_values: Interval::ALL,
            known: None,
        }
    }

    /// Returns the same search, with the bound in a part of space from an earlier search.
    pub(super) fn with_known(self, known: Option<(Bounds, f64)>) -> Self {
        let known = known.map(|(region, bound)| (region, bound * bound));
        Self { known, ..self }
    }

    /// Returns the same search, with slopes that count only where all numbers are in a range.
    pub(super) fn within_values(self, values: Interval) -> Self {
        Self {
            relevant_values: values,
            ..self
        }
    }

    /// Returns the same search over the numbers' pieces, with their discontinuities held.
    pub(super) fn with_held_branches(self, held: HeldBranches) -> Self {
        let numbers = self.box_numbers.into_iter();
        let box_numbers = numbers
            .map(|number| number.with_held_branches(held))
            .collect();
        Self {
            box_numbers,
            ..self
        }
    }

    /// Returns the cost of evaluating a box.
    pub(super) fn cost(&self) -> usize {
        let evaluation: usize = self.box_numbers.iter().map(BoxNumber::cost).sum();
        evaluation * (1 + self.split_ranges.len())
    }

    /// Returns the root node: this region, or one period of the numbers. Along an axis on which all numbers are linear, the
    /// slope is the same everywhere.
    pub(super) fn root(&mut self, region: &Bounds) -> SubBox {
        let all_values_count = self.relevant_values == Interval::ALL;
        let of_slope = |dependence: AxisDependence| match dependence {
            AxisDependence::Linear(_) if all_values_count => AxisDependence::Independent,
            other => other,
        };
        let dependence = self
            .box_numbers
            .iter()
            .map(|number| number.axis_dependence().map(of_slope));
        let dependence =
            dependence.reduce(|a, b| std::array::from_fn(|axis| a[axis].with(b[axis])));
        let mut bounds = *region;
        for (axis, dependence) in dependence.into_iter().flatten().enumerate() {
            [bounds.min[axis], bounds.max[axis]] =
                dependence.one_period([region.min[axis], region.max[axis]]);
        }
        let ranges = self.ranges.clone();
        let varying: Vec<usize> = (0..ranges.len())
            .filter(|&slot| self.depends_on(&bounds, slot))
            .collect();
        self.split_ranges = varying;
        self.bounded_sub_box(bounds, ranges, f64::INFINITY)
    }

    /// Reports whether the slope depends on a range, at an arbitrary point.
    fn depends_on(&mut self, bounds: &Bounds, slot: usize) -> bool {
        let fractions = [0.31, 0.43, 0.57];
        let point = std::array::from_fn(|axis| {
            let (lo, hi) = (bounds.min[axis], bounds.max[axis]);
            lo + (hi - lo) * fractions[axis]
        });
        let point = Bounds {
            min: point,
            max: point,
        };
        let mut ranges = self.ranges.clone();
        let (_, wide) = self.squared_slopes(&point, &ranges);
        ranges[slot] = Interval::point(ranges[slot].lo);
        let (_, narrow) = self.squared_slopes(&point, &ranges);
        narrow < wide * 0.999
    }

    /// Returns the smallest and the largest squared slope in a box, at the values that matter.
    fn squared_slopes(&mut self, bounds: &Bounds, ranges: &[Interval]) -> (f64, f64) {
        let (mut lower, mut upper) = (0.0_f64, 0.0_f64);
        let (mut is_within, mut is_outside) = (true, false);
        for number in &mut self.box_numbers {
            let Dual { value, gradient } = number.eval(bounds, ranges);
            for component in [gradient.x, gradient.y, gradient.z] {
                lower += component.abs().lo.powi(2);
            }
            upper += number.gradient_norm_bound().powi(2);
            is_within &= self.relevant_values.lo <= value.lo && value.hi <= self.relevant_values.hi;
            is_outside |= value.hi < self.relevant_values.lo || self.relevant_values.hi < value.lo;
        }
        if is_outside {
            return (0.0, 0.0);
        }
        (if is_within { lower } else { 0.0 }, upper)
    }

    /// Creates a node with its bound, given the bound over a node around it.
    fn bounded_sub_box(&mut self, bounds: Bounds, ranges: Vec<Interval>, larger: f64) -> SubBox {
        let (lower, upper) = self.squared_slopes(&bounds, &ranges);
        self.max_square = self.max_square.max(lower);
        let known = self.known.filter(|(region, _)| contains(region, &bounds));
        let larger = known.map_or(larger, |(_, square)| square.min(larger));
        SubBox {
            upper: upper.min(larger),
            bounds,
            ranges,
        }
    }

    /// Samples the slope beside the corners of a node, where that of a polynomial is steepest.
    pub(super) fn sample_corners(&mut self, sub_box: &SubBox) {
        if !sub_box.is_finite() {
            return;
        }
        let SubBox { bounds, ranges, .. } = sub_box;
        let centre = bounds.centre();
        for corner in bounds.corners() {
            let point = std::array::from_fn(|axis| {
                centre[axis] + (corner[axis] - centre[axis]) * CORNER_FRACTION
            });
            let (min, max) = (point, point);
            let square = self.sampled_square(&Bounds { min, max }, ranges);
            self.corner_square = self.corner_square.max(square);
        }
    }

    /// Samples the slope at the centre of a node; returns the square of the steepest slope so far.
    pub(super) fn sample_lower_bound(&mut self, sub_box: &SubBox) -> f64 {
        let square = self.sampled_square(&sub_box.bounds, &sub_box.ranges);
        self.max_square = self.max_square.max(square);
        self.max_square.max(self.corner_square)
    }

    /// Returns the square of the slope at the centre of a box.
    fn sampled_square(&mut self, bounds: &Bounds, ranges: &[Interval]) -> f64 {
        let mut max_square = 0.0_f64;
        let samples = if ranges.is_empty() { 1 } else { 2 };
        for fraction in &SAMPLE_FRACTIONS[..samples] {
            let at_fraction =
                |range: &Interval| Interval::point(range.lo + (range.hi - range.lo) * fraction);
            let ranges: Vec<Interval> = ranges.iter().map(at_fraction).collect();
            let relevant = self.relevant_values;
            let gradients = self.point_numbers.iter_mut().map(|number| {
                let Dual { value, gradient } = number.eval(bounds, &ranges);
                let square = gradient.x.powi(2) + gradient.y.powi(2) + gradient.z.powi(2);
                if relevant.lo <= value && value <= relevant.hi {
                    square
                } else {
                    0.0
                }
            });
            // `max` ignores NaN.
            max_square = max_square.max(gradients.sum());
        }
        max_square
    }

    /// Returns the steepest sampled slope.
    pub(super) fn best_lower_bound(&self) -> f64 {
        self.max_square.sqrt()
    }

    /// Returns the last number at a point and the slope of all of them, with all parameters inside of
    /// their ranges.
    pub(super) fn value_and_slope_at(&mut self, point: [f64; 3]) -> (f64, f64) {
        let duals = self.duals_at(point);
        let (mut last, mut square) = (0.0, 0.0);
        for Dual { value, gradient } in duals {
            last = value;
            square += gradient.x.powi(2) + gradient.y.powi(2) + gradient.z.powi(2);
        }
        (last, square.sqrt())
    }

    /// Returns the numbers at a point with their gradients, with all parameters inside of their ranges.
    pub(super) fn duals_at(&mut self, point: [f64; 3]) -> impl Iterator<Item = Dual<f64>> {
        let (bounds, ranges) = self.inside_of_ranges(point);
        self.point_numbers
            .iter_mut()
            .map(move |number| number.eval(&bounds, &ranges))
    }

    /// Returns the first number and all its operands at a point, in the order of their identifiers.
    pub(super) fn operands_at(&mut self, point: [f64; 3]) -> &[Dual<f64>] {
        let (bounds, ranges) = self.inside_of_ranges(point);
        match self.point_numbers.first_mut() {
            Some(number) => number.eval_all(&bounds, &ranges),
            None => &[],
        }
    }

    /// Returns a point as a box, and a value inside of each range.
    fn inside_of_ranges(&self, point: [f64; 3]) -> (Bounds, Vec<Interval>) {
        let bounds = Bounds {
            min: point,
            max: point,
        };
        let inside =
            |range: &Interval| Interval::point(range.lo + (range.hi - range.lo) * TYPICAL_FRACTION);
        (bounds, self.ranges.iter().map(inside).collect())
    }

    /// Returns the first number and its gradient in a region.
    pub(super) fn first_in_region(&mut self, region: &Bounds) -> Option<Dual<Interval>> {
        let first = self.box_numbers.first_mut()?;
        Some(first.eval(region, &self.ranges))
    }

    /// Splits a node in halves: of space, or of a range where that is better.
    pub(super) fn split(&mut self, sub_box: &SubBox) -> [SubBox; 2] {
        let spaces = sub_box.split_space();
        let mut best =
            spaces.map(|half| self.bounded_sub_box(half, sub_box.ranges.clone(), sub_box.upper));
        let mut max_accepted = max_upper(&best) * MAX_RANGE_RATIO;
        for slot in self.split_ranges.clone() {
            let halves = sub_box.split_range(slot);
            let halves =
                halves.map(|half| self.bounded_sub_box(sub_box.bounds, half, sub_box.upper));
            if max_upper(&halves) < max_accepted {
                max_accepted = max_upper(&halves);
                best = halves;
            }
        }
        best
    }
}

/// Reports whether a box contains another one.
pub(super) fn contains(outer: &Bounds, inner: &Bounds) -> bool {
    (0..3).all(|axis| outer.min[axis] <= inner.min[axis] && inner.max[axis] <= outer.max[axis])
}

/// Returns the bound over both.
fn max_upper(halves: &[SubBox; 2]) -> f64 {
    halves[0].upper.max(halves[1].upper)
}

impl SubBox {
    /// Reports whether halving can converge.
    pub(super) fn is_finite(&self) -> bool {
        self.bounds.is_finite()
    }

    /// Returns the volume of its space. Sides along which the numbers do not vary do not count.
    pub(super) fn volume(&self) -> f64 {
        let sides = (0..3).map(|axis| self.bounds.max[axis] - self.bounds.min[axis]);
        sides.filter(|side| *side > 0.0).product()
    }

    /// Returns the halves of its space across the longest side.
    fn split_space(&self) -> [Bounds; 2] {
        let size = |axis: usize| self.bounds.max[axis] - self.bounds.min[axis];
        let axis = (0..3).max_by(|&a, &b| size(a).total_cmp(&size(b)));
        let axis = axis.unwrap_or(0);
        let (mut low, mut high) = (self.bounds, self.bounds);
        let middle = self.bounds.centre()[axis];
        low.max[axis] = middle;
        high.min[axis] = middle;
        [low, high]
    }

    /// Returns its ranges with either half of one.
    fn split_range(&self, slot: usize) -> [Vec<Interval>; 2] {
        let (mut low, mut high) = (self.ranges.clone(), self.ranges.clone());
        let Interval { lo, hi } = self.ranges[slot];
        let middle = lo + (hi - lo) / 2.0;
        low[slot].hi = middle;
        high[slot].lo = middle;
        [low, high]
    }
}

impl PartialEq for SubBox {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for SubBox {}
impl PartialOrd for SubBox {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
/// The node with the largest bound comes first.
impl Ord for SubBox {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.upper.total_cmp(&other.upper)
    }
}
