//! How steep a raw field can be: a bound on the length of its gradient over a region, by interval
//! arithmetic on dual numbers.
//!
//! The region is halved, always where the bound is worst, until the bound is within a tenth of a
//! slope that was found at a point, or the budget is spent, or halving does not help, or a point is found
//! where the field is too steep to be marched on. The ranges of parameters are halved with it: in the
//! slope of r · sin(x / r) the two r would else be any two numbers of the range. Of what repeats along an
//! axis one period is searched. A bound that is given holds everywhere in the region and for all values
//! of the parameters. The budget is the scene's, so that a thousand fields take no thousand times as long
//! as one: where it is spent, bounds are less tight.

mod ends;
mod held;
mod jumps;
mod local;
mod pieces;
mod search;
mod shapes;

use crate::bounds::World;
use crate::boxes::{BoxNumber, UniformValue};
use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use search::Search;
use std::collections::BinaryHeap;

pub(crate) use jumps::{Known, has_jumps};
pub(crate) use shapes::{Refuted, ShapeSlopes, margin, near};

/// How many operations are spent on all of a scene before bounds are left as they are; none gets more
/// than half of what is left.
pub const MAX_OPERATIONS: usize = 300_000;
/// How many boxes are looked at most for a bound.
pub const MAX_BOXES: usize = 3_000;
/// After so many boxes, and each time that twice as many were looked at, the bound must have come down
/// to so much of what it was, or it is left as it is.
const PATIENCE: usize = 64;
const WORTH_WHILE: f64 = 0.999;
/// The number of boxes after which a bound that is still endless is given up.
const ENDLESS: usize = 512;

/// A field that is as steep as this is no field to march on, and is said to have no bound.
pub const STEEPEST: f64 = 1e15;

/// A bound this many times as steep as all points that were tried is no bound to march by: at the default of
/// 2,048 steps, a ray comes no farther than with two steps by the slope of those points.
const LOOSE: f64 = 1e3;

/// What is left of the operations that a scene's bounds may take.
#[derive(Clone, Debug)]
pub(crate) struct Budget(usize);

impl Default for Budget {
    fn default() -> Self {
        Self(MAX_OPERATIONS)
    }
}

/// The ranges of the parameters' numbers and of the time, for bounds that hold for all of them.
#[derive(Clone, Debug)]
pub struct Ranges {
    /// By parameter and component.
    params: Vec<Vec<Interval>>,
    time: Interval,
}

impl Ranges {
    /// The ranges that the scene declares; a parameter without one is taken at its value.
    pub(crate) fn of(world: World<'_>) -> Self {
        let params = world.params.iter().map(|param| {
            let components = param.value.iter().map(|&value| match param.range {
                Some((lo, hi)) => Interval::between(lo, hi),
                None => Interval::point(value),
            });
            components.collect()
        });
        let params = params.collect();
        let time = match world.animation {
            Some(animation) => Interval::between(0.0, animation.duration),
            None => Interval::ALL,
        };
        Self { params, time }
    }

    /// The range of a number that depends on nothing else.
    pub(crate) fn of_leaf(&self, expressions: &Expressions, id: ExprId) -> Interval {
        match expressions.get(id) {
            Expression::Constant(v) => Interval::point(*v),
            Expression::Param(param, component) => {
                self.params[param.0 as usize][usize::from(*component)]
            }
            Expression::Time => self.time,
            _ => Interval::ALL,
        }
    }

    /// The range of a uniform number.
    pub fn of_number(&self, expressions: &Expressions, id: ExprId) -> Interval {
        let mut leaf = |id| UniformValue::Known(self.of_leaf(expressions, id));
        let mut number = BoxNumber::<Interval>::new(expressions, id, &mut leaf);
        number.over(&Bounds::EVERYTHING, &[])
    }
}

/// The gradients, with respect to the local point, of one or of several numbers together (the rows
/// of a Jacobian), bounded: the Frobenius norm, which is never less than the map's stretch. `None` where
/// it is not less than [`STEEPEST`], or so loose that no ray could march by it ([`LOOSE`]).
pub(crate) fn bound(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &Ranges,
    budget: &mut Budget,
) -> Option<f64> {
    let search = Search::new(expressions, numbers, ranges);
    let (bound, search) = searched(search, region, budget, [MAX_BOXES, ENDLESS]);
    let is_bound = bound < STEEPEST && !is_loose(bound, search, region);
    is_bound.then_some(bound)
}

/// The bound that a search ends with, and the search.
fn searched(
    mut search: Search,
    region: &Bounds,
    budget: &mut Budget,
    [boxes, patience]: [usize; 2],
) -> (f64, Search) {
    let whole = search.whole(region);
    let is_finite = whole.is_finite();
    let mut queue = BinaryHeap::from([whole]);
    let size = search.cost().max(1);
    let affordable = (budget.0 / 2 / size).min(boxes);
    // What the bound was when half as many boxes had been looked at.
    let mut before = f64::INFINITY;
    for looked_at in 1..=affordable {
        let Some(worst) = queue.pop() else { break };
        let found = search.look_inside(&worst);
        let hopeless = found >= STEEPEST * STEEPEST;
        let slow = looked_at.is_power_of_two() && looked_at >= PATIENCE && {
            let is_endless = worst.upper.is_infinite() && looked_at >= patience;
            let slow = worst.upper > before * WORTH_WHILE || is_endless;
            before = worst.upper;
            slow
        };
        if worst.upper <= found * 1.21 || hopeless || slow || !is_finite {
            queue.push(worst);
            break;
        }
        budget.0 -= size;
        queue.extend(search.halves(&worst));
    }
    let bound = queue.peek().map_or(0.0, |worst| worst.upper.sqrt());
    (bound, search)
}

/// The values of a number around zero, and a bound of its slope where it has one of these.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Capped {
    pub(crate) values: Interval,
    /// `None` where none is known.
    pub(crate) slope: Option<f64>,
}

/// The operations that are spent on a bound of it, and the boxes that are looked at most.
const CAPPED_OPERATIONS: usize = 2 * MAX_OPERATIONS;
const CAPPED_BOXES: usize = 4 * MAX_BOXES;
/// The number of those after which a bound that is still endless is given up: each pole takes some dozens.
const CAPPED_ENDLESS: usize = 1024;
/// The depths below zero up to which values are kept, in units of what half of the points outside do not exceed. By the
/// first, light still sees how deep in a solid it looks.
const DEPTHS: [f64; 2] = [0.5, 0.015625];

/// The values by which rays march on a number whose slope has no bound in a region: it may have poles there. Values beyond
/// them count as their ends, so the bound holds for all of the region. `None` where the number is nowhere above zero.
pub(crate) fn capped(
    expressions: &Expressions,
    number: ExprId,
    region: &Bounds,
    ranges: &Ranges,
) -> Option<Capped> {
    let mut budget = Budget(CAPPED_OPERATIONS);
    let new = || Search::new(expressions, &[number], ranges);
    let mut search = new();
    let values = points(region).map(|point| search.at(point).0);
    let mut outside: Vec<f64> = values.filter(|v| v.is_finite() && *v > 0.0).collect();
    outside.sort_by(f64::total_cmp);
    let usual = *outside.get(outside.len() / 2)?;
    // Ends are numbers of `f32`.
    let is_told = usual < f64::from(f32::MAX) && usual * DEPTHS[1] > f64::from(f32::MIN_POSITIVE);
    if !is_told {
        return None;
    }
    let tops = [f64::INFINITY, usual];
    let range = |depth: f64, hi: f64| Interval {
        lo: -usual * depth,
        hi,
    };
    let all = DEPTHS
        .into_iter()
        .flat_map(|depth| tops.map(|top| range(depth, top)));
    for values in all {
        let (slope, search) = searched(
            new().among(values),
            region,
            &mut budget,
            [CAPPED_BOXES, CAPPED_ENDLESS],
        );
        if slope < STEEPEST && slope <= search.found() * LOOSE {
            let slope = Some(slope);
            return Some(Capped { values, slope });
        }
        // No pole is in the way.
        if slope.is_finite() {
            break;
        }
    }
    Some(Capped {
        values: range(DEPTHS[0], f64::INFINITY),
        slope: None,
    })
}

/// Reports whether a bound is [`LOOSE`]. Where nothing but flat points were found, nothing is known of it.
fn is_loose(bound: f64, search: Search, region: &Bounds) -> bool {
    let found = search.found();
    if bound <= found * LOOSE {
        return false;
    }
    let tried = slopes_at(search, region);
    let steepest = tried.iter().fold(found, |most, (slope, _)| slope.max(most));
    steepest > 0.0 && bound > steepest * LOOSE
}

/// Reports whether a slope is so great that a number has no bound to march by in a region, and none is missed.
pub(crate) fn is_endless(slope: f64) -> bool {
    slope * LOOSE >= STEEPEST
}

/// The halvings that lead to a zero.
const HALVINGS: usize = 12;
/// The number of points at which a slope is tried.
const TRIED_POINTS: usize = 400;

/// Twice the slope that nine tenths of the points tried in a region do not exceed, nor nine tenths of those where a single
/// number is zero. Points where the numbers are flat, as what is clamped is almost everywhere, tell nothing of the rest.
pub(crate) fn tried(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &Ranges,
) -> f64 {
    let mut search = Search::new(expressions, numbers, ranges);
    let points: Vec<_> = points(region)
        .map(|point| (search.at(point), point))
        .collect();
    let usual = |slopes: &mut dyn Iterator<Item = f64>| {
        let mut found: Vec<f64> = slopes
            .filter(|slope| slope.is_finite() && *slope > 0.0)
            .collect();
        found.sort_by(f64::total_cmp);
        found.get(found.len() * 9 / 10).copied()
    };
    let anywhere = usual(&mut points.iter().map(|((_, slope), _)| *slope));
    let pairs = points.windows(2).filter(|_| numbers.len() == 1);
    let mut zeros = pairs.filter_map(|pair| {
        let [((first, _), from), ((second, _), to)] = [pair[0], pair[1]];
        (first * second < 0.0).then(|| slope_at_zero(&mut search, [from, to], first))
    });
    let at_zero = usual(&mut zeros);
    let most = [anywhere, at_zero].into_iter().flatten().reduce(f64::max);
    most.map_or(1.0, |slope| 2.0 * slope)
}

/// The slope where a number changes its sign between two points, and is `first` at the first of them.
fn slope_at_zero(search: &mut Search, [mut from, mut to]: [[f64; 3]; 2], first: f64) -> f64 {
    let mut slope = 0.0;
    for _ in 0..HALVINGS {
        let middle = std::array::from_fn(|axis| (from[axis] + to[axis]) / 2.0);
        let (value, here) = search.at(middle);
        slope = here;
        match value * first > 0.0 {
            true => from = middle,
            false => to = middle,
        }
    }
    slope
}

/// The steepest of the points tried in a region, and the slope there.
pub(crate) fn steepest(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &Ranges,
) -> Option<(f64, [f64; 3])> {
    let tried = slopes_in(expressions, numbers, region, ranges);
    tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The slopes at points of a region, near its middle and far out alike.
fn slopes_in(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &Ranges,
) -> Vec<(f64, [f64; 3])> {
    slopes_at(Search::new(expressions, numbers, ranges), region)
}

/// The slopes at points, by a search that has looked elsewhere.
fn slopes_at(mut search: Search, region: &Bounds) -> Vec<(f64, [f64; 3])> {
    points(region)
        .map(|point| (search.at(point).1, point))
        .filter(|(slope, _)| slope.is_finite())
        .collect()
}

/// Points of a region, near its middle and far out alike.
fn points(region: &Bounds) -> impl Iterator<Item = [f64; 3]> {
    let region = region.common(&Bounds::centred([1e6; 3]));
    let centre = region.centre();
    (0..TRIED_POINTS as u32).map(move |number| {
        let size = 0.25_f64.powi(number as i32 % 4);
        let near =
            |corner: [f64; 3]| std::array::from_fn(|i| centre[i] + (corner[i] - centre[i]) * size);
        let part = Bounds {
            min: near(region.min),
            max: near(region.max),
        };
        part.spread(number + 1)
    })
}
