//! The boxes that a search for slopes looks at: parts of space together with parts of the ranges of
//! parameters.

use super::Ranges;
use crate::boxes::{BoxNumber, Held, UniformValue};
use crate::expression::{ExprId, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;

/// How far into each range the numbers are taken with which slopes at points are found: at the end,
/// where most are steepest, and somewhere in between.
const SAMPLES: [f64; 2] = [1.0, 0.38];

/// Halving a range must bring the bound down to so much of what halving space does.
const RANGE_PAYS: f64 = 0.95;

/// A box: a part of space, and of the range of each parameter that matters.
pub(super) struct Piece {
    /// A bound on the square of the slope in it.
    pub(super) upper: f64,
    bounds: Bounds,
    ranges: Vec<Interval>,
}

/// The numbers that are searched, over boxes and at points.
pub(super) struct Search {
    over: Vec<BoxNumber<Dual<Interval>>>,
    at: Vec<BoxNumber<Dual<f64>>>,
    /// Which of a piece's ranges are worth halving.
    halved: Vec<usize>,
    /// All ranges.
    ranges: Vec<Interval>,
    /// The square of the steepest slope that was found.
    found: f64,
    /// The values at which the slope matters.
    values: Interval,
}

impl Search {
    pub(super) fn new(expressions: &Expressions, numbers: &[ExprId], ranges: &Ranges) -> Self {
        let mut ranged = Vec::new();
        let mut uniform = |id| {
            let range = ranges.of_leaf(expressions, id);
            if range.lo == range.hi || !(range.hi - range.lo).is_finite() {
                return UniformValue::Known(range);
            }
            let slot = ranged.iter().position(|&(of, _)| of == id);
            UniformValue::Ranged(slot.unwrap_or_else(|| {
                ranged.push((id, range));
                ranged.len() - 1
            }))
        };
        let over = numbers
            .iter()
            .map(|&id| BoxNumber::new(expressions, id, &mut uniform))
            .collect();
        let at = numbers
            .iter()
            .map(|&id| BoxNumber::new(expressions, id, &mut uniform))
            .collect();
        Self {
            over,
            at,
            halved: Vec::new(),
            ranges: ranged.into_iter().map(|(_, range)| range).collect(),
            found: 0.0,
            values: Interval::ALL,
        }
    }

    /// The same search with slopes that matter only where all numbers are in a range.
    pub(super) fn among(self, values: Interval) -> Self {
        Self { values, ..self }
    }

    /// The same search of the numbers' pieces, with their jumps held.
    pub(super) fn holding(self, held: Held) -> Self {
        let over = self.over.into_iter();
        let over = over.map(|number| number.holding(held)).collect();
        Self { over, ..self }
    }

    /// What looking at a box costs.
    pub(super) fn cost(&self) -> usize {
        let once: usize = self.over.iter().map(BoxNumber::cost).sum();
        once * (1 + self.halved.len())
    }

    /// The first box: this region, or a smaller one in which the numbers are all that they are in it.
    pub(super) fn whole(&mut self, region: &Bounds) -> Piece {
        let along = self.over.iter().map(BoxNumber::along);
        let along = along.reduce(|a, b| std::array::from_fn(|axis| a[axis].with(b[axis])));
        let mut bounds = *region;
        for (axis, along) in along.into_iter().flatten().enumerate() {
            [bounds.min[axis], bounds.max[axis]] =
                along.enough_of([region.min[axis], region.max[axis]]);
        }
        let ranges = self.ranges.clone();
        let matters: Vec<usize> = (0..ranges.len())
            .filter(|&slot| self.matters(&bounds, slot))
            .collect();
        self.halved = matters;
        self.piece(bounds, ranges, f64::INFINITY)
    }

    /// Whether the slope depends on a range, at some point in no special place.
    fn matters(&mut self, bounds: &Bounds, slot: usize) -> bool {
        let place = [0.31, 0.43, 0.57];
        let point = std::array::from_fn(|axis| {
            let (lo, hi) = (bounds.min[axis], bounds.max[axis]);
            lo + (hi - lo) * place[axis]
        });
        let point = Bounds {
            min: point,
            max: point,
        };
        let mut ranges = self.ranges.clone();
        let (_, wide) = self.squares(&point, &ranges);
        ranges[slot] = Interval::point(ranges[slot].lo);
        let (_, narrow) = self.squares(&point, &ranges);
        narrow < wide * 0.999
    }

    /// The least and the largest square of the slope that may be in a box, where it matters.
    fn squares(&mut self, bounds: &Bounds, ranges: &[Interval]) -> (f64, f64) {
        let (mut lower, mut upper) = (0.0_f64, 0.0_f64);
        let (mut is_within, mut is_without) = (true, false);
        for number in &mut self.over {
            let Dual { value, gradient } = number.over(bounds, ranges);
            for component in [gradient.x, gradient.y, gradient.z] {
                lower += component.abs().lo.powi(2);
            }
            upper += number.steepest().powi(2);
            is_within &= self.values.lo <= value.lo && value.hi <= self.values.hi;
            is_without |= value.hi < self.values.lo || self.values.hi < value.lo;
        }
        if is_without {
            return (0.0, 0.0);
        }
        (if is_within { lower } else { 0.0 }, upper)
    }

    /// A box with the bound over it, given that over a larger one.
    fn piece(&mut self, bounds: Bounds, ranges: Vec<Interval>, larger: f64) -> Piece {
        let (lower, upper) = self.squares(&bounds, &ranges);
        self.found = self.found.max(lower);
        Piece {
            upper: upper.min(larger),
            bounds,
            ranges,
        }
    }

    /// Looks how steep the numbers are in the middle of a box; gives the square of the steepest slope
    /// found so far.
    pub(super) fn look_inside(&mut self, piece: &Piece) -> f64 {
        let samples = if piece.ranges.is_empty() { 1 } else { 2 };
        for share in &SAMPLES[..samples] {
            let at = |range: &Interval| Interval::point(range.lo + (range.hi - range.lo) * share);
            let ranges: Vec<Interval> = piece.ranges.iter().map(at).collect();
            let matter = self.values;
            let gradients = self.at.iter_mut().map(|number| {
                let Dual { value, gradient } = number.over(&piece.bounds, &ranges);
                let square = gradient.x.powi(2) + gradient.y.powi(2) + gradient.z.powi(2);
                if matter.lo <= value && value <= matter.hi {
                    square
                } else {
                    0.0
                }
            });
            // What is not a number was not found.
            self.found = self.found.max(gradients.sum());
        }
        self.found
    }

    /// The steepest slope that was found.
    pub(super) fn found(&self) -> f64 {
        self.found.sqrt()
    }

    /// The last number at a point and the slope of all of them, with all parameters in the middle of their ranges.
    pub(super) fn at(&mut self, point: [f64; 3]) -> (f64, f64) {
        let all = self.duals_at(point);
        let (mut last, mut square) = (0.0, 0.0);
        for Dual { value, gradient } in all {
            last = value;
            square += gradient.x.powi(2) + gradient.y.powi(2) + gradient.z.powi(2);
        }
        (last, square.sqrt())
    }

    /// The numbers at a point with their gradients, with all parameters in the middle of their ranges.
    pub(super) fn duals_at(&mut self, point: [f64; 3]) -> impl Iterator<Item = Dual<f64>> {
        let bounds = Bounds {
            min: point,
            max: point,
        };
        let middle = |range: &Interval| Interval::point(range.lo + (range.hi - range.lo) / 2.0);
        let ranges: Vec<Interval> = self.ranges.iter().map(middle).collect();
        self.at
            .iter_mut()
            .map(move |number| number.over(&bounds, &ranges))
    }

    /// The first number and its gradient in a region.
    pub(super) fn first_over(&mut self, region: &Bounds) -> Option<Dual<Interval>> {
        let first = self.over.first_mut()?;
        Some(first.over(region, &self.ranges))
    }

    /// Both halves of a box: of space, or of a range where that pays.
    pub(super) fn halves(&mut self, of: &Piece) -> [Piece; 2] {
        let spaces = of.space_halved();
        let mut best = spaces.map(|half| self.piece(half, of.ranges.clone(), of.upper));
        let mut most = worse(&best) * RANGE_PAYS;
        for slot in self.halved.clone() {
            let halves = of.range_halved(slot);
            let halves = halves.map(|half| self.piece(of.bounds, half, of.upper));
            if worse(&halves) < most {
                most = worse(&halves);
                best = halves;
            }
        }
        best
    }
}

/// The bound over both.
fn worse(halves: &[Piece; 2]) -> f64 {
    halves[0].upper.max(halves[1].upper)
}

impl Piece {
    /// Whether halving leads anywhere.
    pub(super) fn is_finite(&self) -> bool {
        self.bounds.is_finite()
    }

    /// Both halves of its space, across the longest side.
    fn space_halved(&self) -> [Bounds; 2] {
        let size = |axis: usize| self.bounds.max[axis] - self.bounds.min[axis];
        let axis = (0..3).max_by(|&a, &b| size(a).total_cmp(&size(b)));
        let axis = axis.unwrap_or(0);
        let (mut low, mut high) = (self.bounds, self.bounds);
        let middle = self.bounds.centre()[axis];
        low.max[axis] = middle;
        high.min[axis] = middle;
        [low, high]
    }

    /// Its ranges with either half of one.
    fn range_halved(&self, slot: usize) -> [Vec<Interval>; 2] {
        let (mut low, mut high) = (self.ranges.clone(), self.ranges.clone());
        let Interval { lo, hi } = self.ranges[slot];
        let middle = lo + (hi - lo) / 2.0;
        low[slot].hi = middle;
        high[slot].lo = middle;
        [low, high]
    }
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Piece {}
impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
/// The worst is looked at first.
impl Ord for Piece {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.upper.total_cmp(&other.upper)
    }
}
