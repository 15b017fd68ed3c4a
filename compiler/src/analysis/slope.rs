//! Slope bounds of raw fields: a bound on the length of the gradient over a region, by interval
//! arithmetic on dual numbers.
//!
//! A branch-and-bound search halves the region, always where the bound is largest. It ends when the
//! bound is within a tenth of a slope that was sampled, or when the budget is spent. It also ends when
//! halving does not help, or when a sample is too steep to march. The ranges of parameters are halved
//! with the region: in the slope of r · sin(x / r) the two r would otherwise be independent. Along an
//! axis on which the field is periodic, one period is searched. A returned bound holds everywhere in
//! the region and for all values of the parameters. The budget is the scene's, so that a thousand
//! fields do not take a thousand times as long as one. Once it is spent, bounds are less tight.

mod discontinuities;
mod envelope;
mod local_bound;
mod pieces;
mod region_bounds;
mod search;
mod shapes;

use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use search::{SlopeSearch, SubBox, contains};
use std::collections::BinaryHeap;

pub(crate) use discontinuities::{SlopeScope, has_discontinuities};
pub(crate) use shapes::{RefutedSlope, ShapeSlopes, WrittenField, margin, near_region};

/// Maximum number of operations for the bounds of a scene; one bound takes at most half of the
/// remaining ones.
pub const MAX_OPERATIONS: usize = 300_000;
/// Maximum number of boxes that are evaluated for one bound.
pub const MAX_BOXES: usize = 3_000;
/// Number of boxes from which on the search may stop, at every doubling.
const MIN_BOXES_BEFORE_STALL: usize = 64;
/// Number of boxes that cost as much as the steps of one picture, at every doubling. The search stops unless twice as many
/// boxes are expected to save more than they cost, from what the last doubling saved.
///
/// A box takes about 120 ns per operation. At 512×512, a picture takes about 20 steps per ray of 0.25 ns per operation, and
/// about a third of them depend on this bound.
const BOXES_PER_PICTURE: f64 = 4000.0;
/// Number of boxes from which on a search without a bound may stop, at every doubling. It stops unless the volume
/// of the boxes without one has come down to this fraction. Around a pole, it is halved at least.
const MIN_BOXES_BEFORE_END: usize = 32;
const MAX_STALLED_VOLUME: f64 = 0.9;
/// Number of boxes after which a search whose bound is still infinite stops.
const MAX_BOXES_WHILE_INFINITE: usize = 512;

/// Slope from which on a field cannot be marched and counts as unbounded.
pub const MAX_SLOPE: f64 = 1e15;

/// Maximum ratio of a bound to the steepest sampled slope; a larger bound is useless for marching. At the
/// default of 3,072 steps, a ray advances no farther than by about three steps with the sampled slope.
const MAX_SLOPE_RATIO: f64 = 1e3;

/// Maximum ratio of a close bound to the steepest sampled slope.
const MAX_CLOSE_RATIO: f64 = 4.0;

/// Slope bound that a search has found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FoundSlope {
    pub(crate) bound: f64,
    /// Set if the bound is at most [`MAX_CLOSE_RATIO`] times the steepest sampled slope.
    pub(crate) is_close: bool,
}

impl FoundSlope {
    fn new(bound: f64, steepest_sample: f64) -> Self {
        Self {
            bound,
            is_close: bound <= steepest_sample * MAX_CLOSE_RATIO,
        }
    }
}

/// Number of operations that remain for the bounds of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Budget(usize);

impl Default for Budget {
    fn default() -> Self {
        Self(MAX_OPERATIONS)
    }
}

/// Returns a bound on the gradients, by the local point, of one number or of several together (the rows
/// of a Jacobian). `known` is a bound in a part of the region. It is the Frobenius norm, which is at least the map's stretch. `None` if it is at
/// least [`MAX_SLOPE`], or too loose to march by ([`MAX_SLOPE_RATIO`]).
pub(crate) fn slope_bound(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    known: Option<(Bounds, f64)>,
    ranges: &ParamRanges,
    budget: &mut Budget,
) -> Option<FoundSlope> {
    let search = SlopeSearch::new(expressions, numbers, ranges).with_known(known);
    let (bound, search) = run_search(
        search,
        region,
        budget,
        [MAX_BOXES, MAX_BOXES_WHILE_INFINITE],
    );
    let best_sample = search.best_lower_bound();
    found_slope(bound, best_sample, || {
        steepest_of(search_slopes(search, region))
    })
}

/// Runs a search and returns its final bound. Arguments: the maximum number of boxes, and the maximum
/// while the bound is infinite.
fn run_search(
    mut search: SlopeSearch,
    region: &Bounds,
    budget: &mut Budget,
    [max_boxes, max_boxes_while_infinite]: [usize; 2],
) -> (f64, SlopeSearch) {
    let root = search.root(region);
    search.sample_corners(&root);
    let is_finite = root.is_finite();
    let mut queue = BinaryHeap::from([root]);
    let size = search.cost().max(1);
    let affordable = (budget.0 / 2 / size).min(max_boxes);
    // Bound at half as many boxes, and the volume of the boxes without one.
    let (mut previous_bound, mut previous_volume) = (f64::INFINITY, f64::INFINITY);
    for evaluated in 1..=affordable {
        let Some(worst) = queue.pop() else { break };
        let lower_bound = search.sample_lower_bound(&worst);
        let is_unbounded = lower_bound >= MAX_SLOPE * MAX_SLOPE;
        let is_stalled = evaluated.is_power_of_two() && evaluated >= MIN_BOXES_BEFORE_STALL && {
            let is_endless = worst.upper.is_infinite() && evaluated >= max_boxes_while_infinite;
            let saved_steps = 1.0 - (worst.upper / previous_bound).sqrt();
            // Not a number while both are infinite.
            let is_worthless = saved_steps * BOXES_PER_PICTURE <= evaluated as f64;
            let is_stalled = is_worthless || is_endless;
            previous_bound = worst.upper;
            is_stalled
        };
        let is_endless = evaluated.is_power_of_two() && {
            let volume = unbounded_volume(&worst, &queue);
            let is_endless = volume > 0.0 && volume > previous_volume * MAX_STALLED_VOLUME;
            previous_volume = volume;
            is_endless && evaluated >= MIN_BOXES_BEFORE_END
        };
        if worst.upper <= lower_bound * 1.21
            || is_unbounded
            || is_stalled
            || is_endless
            || !is_finite
        {
            queue.push(worst);
            break;
        }
        budget.0 -= size;
        queue.extend(search.split(&worst));
    }
    let bound = queue.peek().map_or(0.0, |worst| worst.upper.sqrt());
    (bound, search)
}

/// Returns the volume of the boxes whose slope has no bound below [`MAX_SLOPE`].
fn unbounded_volume(worst: &SubBox, others: &BinaryHeap<SubBox>) -> f64 {
    let boxes = others.iter().chain([worst]);
    let unbounded = boxes.filter(|it| it.upper >= MAX_SLOPE * MAX_SLOPE);
    unbounded.map(SubBox::volume).sum()
}

/// Range of a number around zero, and a bound of its slope where its values are in that range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CappedField {
    pub(crate) values: Interval,
    /// `None` if unknown.
    pub(crate) slope: Option<f64>,
}

/// Maximum numbers of operations and of boxes for one capped field.
const MAX_CAPPED_OPERATIONS: usize = 2 * MAX_OPERATIONS;
const MAX_CAPPED_BOXES: usize = 4 * MAX_BOXES;
/// Number of boxes after which a capped search whose bound is still infinite stops: each pole takes
/// some dozens.
const MAX_CAPPED_BOXES_WHILE_INFINITE: usize = 1024;
/// Depths below zero down to which values are kept, in units of the median value of the sample points
/// outside. With the first, light still distinguishes depths inside a solid.
const CAP_DEPTHS: [f64; 2] = [0.5, 0.015625];

/// Returns the values by which rays march on a number whose slope has no bound in a region, as at a
/// pole. Values outside of the range are clamped to it, so that the bound holds for all of the region.
/// `None` if no sample is above zero, or if their median is out of the range of `f32`.
pub(crate) fn capped_field(
    expressions: &Expressions,
    number: ExprId,
    region: &Bounds,
    ranges: &ParamRanges,
) -> Option<CappedField> {
    let mut budget = Budget(MAX_CAPPED_OPERATIONS);
    let new_search = || SlopeSearch::new(expressions, &[number], ranges);
    let mut search = new_search();
    let values = sample_points(region).map(|point| search.value_and_slope_at(point).0);
    let mut outside: Vec<f64> = values.filter(|v| v.is_finite() && *v > 0.0).collect();
    outside.sort_by(f64::total_cmp);
    let median = *outside.get(outside.len() / 2)?;
    // Endpoints must be `f32` values.
    let is_representable =
        median < f64::from(f32::MAX) && median * CAP_DEPTHS[1] > f64::from(f32::MIN_POSITIVE);
    if !is_representable {
        return None;
    }
    let upper_ends = [f64::INFINITY, median];
    let range = |depth: f64, hi: f64| Interval {
        lo: -median * depth,
        hi,
    };
    let candidates = CAP_DEPTHS
        .into_iter()
        .flat_map(|depth| upper_ends.map(|top| range(depth, top)));
    for values in candidates {
        let (slope, search) = run_search(
            new_search().within_values(values),
            region,
            &mut budget,
            [MAX_CAPPED_BOXES, MAX_CAPPED_BOXES_WHILE_INFINITE],
        );
        if slope < MAX_SLOPE && slope <= search.best_lower_bound() * MAX_SLOPE_RATIO {
            let slope = Some(slope);
            return Some(CappedField { values, slope });
        }
        // A finite bound: no pole is the cause.
        if slope.is_finite() {
            break;
        }
    }
    Some(CappedField {
        values: range(CAP_DEPTHS[0], f64::INFINITY),
        slope: None,
    })
}

/// Returns the bound of a search unless it is useless for marching, see [`MAX_SLOPE_RATIO`]. Where all samples are flat,
/// it is not known to be. `best_sample` is the steepest slope that the search has met, and `steepest_sample` returns
/// that at the sample points of the region.
fn found_slope(
    bound: f64,
    best_sample: f64,
    steepest_sample: impl FnOnce() -> f64,
) -> Option<FoundSlope> {
    if bound >= MAX_SLOPE {
        return None;
    }
    let found = FoundSlope::new(bound, best_sample);
    if found.is_close {
        return Some(found);
    }
    let steepest = best_sample.max(steepest_sample());
    let is_useless = steepest > 0.0 && bound > steepest * MAX_SLOPE_RATIO;
    (!is_useless).then(|| FoundSlope::new(bound, steepest))
}

/// Returns the steepest of sampled slopes; zero for none.
fn steepest_of(samples: Vec<(f64, [f64; 3])>) -> f64 {
    samples.iter().fold(0.0, |max, (slope, _)| slope.max(max))
}

/// Reports whether a slope is so large that a bound [`MAX_SLOPE_RATIO`] times as large is no bound to
/// march by.
pub(crate) fn is_unmarchable(slope: f64) -> bool {
    slope * MAX_SLOPE_RATIO >= MAX_SLOPE
}

/// Number of bisections towards a zero.
const BISECTION_COUNT: usize = 12;
/// Number of points at which slopes are sampled.
const SAMPLE_POINTS: usize = 400;

/// Returns twice the slope that nine tenths of the sample points in a region do not exceed. Of a
/// single number, nine tenths of the points where it is zero do not exceed it either.
pub(crate) fn estimated_slope(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &ParamRanges,
) -> f64 {
    let [at_points, at_zeros] = slope_samples(expressions, numbers, region, ranges);
    let ninth_decile = |sorted: Vec<f64>| sorted.get(sorted.len() * 9 / 10).copied();
    let deciles = [at_points, at_zeros].into_iter().filter_map(ninth_decile);
    let largest = deciles.reduce(f64::max);
    largest.map_or(1.0, |slope| 2.0 * slope)
}

/// Half side of the cube in which infinite shapes are sampled for the slope at their surface.
const SURFACE_HALF_SIDE: f64 = 4.0;

/// Returns the median slope of a number where it is zero, for a shape with these bounds. Where no zero is found, it
/// is the median of sample points. A number times a factor has the median times the factor.
pub(crate) fn surface_slope(
    expressions: &Expressions,
    number: ExprId,
    bounds: &Bounds,
    ranges: &ParamRanges,
) -> Option<f64> {
    let near = bounds.intersection(&Bounds::centred([SURFACE_HALF_SIDE; 3]));
    // No other size may be used here: those of a scene depend on how well bounds are found.
    let region = near_region(match bounds.is_finite() || near.is_empty() {
        true => bounds,
        false => &near,
    });
    let [at_points, at_zeros] = slope_samples(expressions, &[number], &region, ranges);
    let median = |sorted: Vec<f64>| sorted.get(sorted.len() / 2).copied();
    median(at_zeros).or_else(|| median(at_points))
}

/// Returns the slopes of numbers at the sample points of a region, and those of a single number at zeros between
/// them. Both are in ascending order. Points at which the numbers are flat are left out: clamped numbers
/// are flat almost everywhere.
fn slope_samples(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &ParamRanges,
) -> [Vec<f64>; 2] {
    let mut search = SlopeSearch::new(expressions, numbers, ranges);
    let points: Vec<_> = sample_points(region)
        .map(|point| (search.value_and_slope_at(point), point))
        .collect();
    let at_points = points.iter().map(|((_, slope), _)| *slope).collect();
    let pairs = points.windows(2).filter(|_| numbers.len() == 1);
    let at_zeros = pairs.filter_map(|pair| {
        let [((first, _), from), ((second, _), to)] = [pair[0], pair[1]];
        (first * second < 0.0).then(|| slope_at_zero(&mut search, [from, to], first))
    });
    [at_points, at_zeros.collect()].map(|mut slopes: Vec<f64>| {
        slopes.retain(|slope| slope.is_finite() && *slope > 0.0);
        slopes.sort_by(f64::total_cmp);
        slopes
    })
}

/// Returns the slope where a number changes its sign between two points; its value at the first one is
/// `first`.
fn slope_at_zero(search: &mut SlopeSearch, [mut from, mut to]: [[f64; 3]; 2], first: f64) -> f64 {
    let mut slope = 0.0;
    for _ in 0..BISECTION_COUNT {
        let middle = std::array::from_fn(|axis| (from[axis] + to[axis]) / 2.0);
        let (value, slope_here) = search.value_and_slope_at(middle);
        slope = slope_here;
        match value * first > 0.0 {
            true => from = middle,
            false => to = middle,
        }
    }
    slope
}

/// Returns the steepest slope of the sample points in a region, and its point.
pub(crate) fn steepest_sample(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &ParamRanges,
) -> Option<(f64, [f64; 3])> {
    let samples = sampled_slopes(expressions, numbers, region, ranges);
    samples.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
}

/// Samples slopes at points of a region, near its centre and far out alike.
fn sampled_slopes(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &ParamRanges,
) -> Vec<(f64, [f64; 3])> {
    search_slopes(SlopeSearch::new(expressions, numbers, ranges), region)
}

/// Samples slopes at points, by an existing search.
fn search_slopes(mut search: SlopeSearch, region: &Bounds) -> Vec<(f64, [f64; 3])> {
    sample_points(region)
        .map(|point| (search.value_and_slope_at(point).1, point))
        .filter(|(slope, _)| slope.is_finite())
        .collect()
}

/// Returns sample points of a region, near its centre and far out alike.
fn sample_points(region: &Bounds) -> impl Iterator<Item = [f64; 3]> {
    let region = region.intersection(&Bounds::centred([1e6; 3]));
    let centre = region.centre();
    (0..SAMPLE_POINTS as u32).map(move |number| {
        let size = 0.25_f64.powi(number as i32 % 4);
        let scaled =
            |corner: [f64; 3]| std::array::from_fn(|i| centre[i] + (corner[i] - centre[i]) * size);
        let sub_region = Bounds {
            min: scaled(region.min),
            max: scaled(region.max),
        };
        sub_region.quasi_random_point(number + 1)
    })
}
