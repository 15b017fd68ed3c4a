//! Values of numbers at sampled points, which show the plateaus that they have.
//!
//! Two plateaus may share no part of space. The distance to a box is a length that is zero within it, plus a number that
//! is zero outside of it. The sum is zero on its surface alone.

use crate::analysis::param_ranges::ParamRanges;
use crate::analysis::terms::{Sum, Term};
use crate::expression::{ExprId, Expression, Expressions};
use crate::uniforms::postorder;
use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::{HashMap, HashSet};

/// Maximum number of points.
const MAX_COUNT: usize = 256;
/// Minimum number of points, in fields of many operations.
const MIN_COUNT: usize = 64;
/// Number of values of all operations of a field, above which points are left out.
const MAX_VALUES: usize = 4_000_000;
/// Maximum number of operations that are sampled before another one. Fields by many cases have more.
const MAX_NUMBERS: usize = 30_000;
/// Minimum number of points at which a live number has one value on a plateau.
const MIN_REPETITIONS: usize = 3;
/// Decimal exponents of the least and the largest coordinate.
const EXPONENTS: [f64; 2] = [-2.0, 3.0];
/// Maximum rounding of a sum, relative to the sum of the magnitudes of its terms.
const TOLERANCE: f64 = 1e-14;

/// Values at the sampled points, by number.
pub(super) struct SampledValues<'a> {
    ranges: &'a ParamRanges,
    points: Vec<[f64; 3]>,
    values: HashMap<ExprId, Vec<f64>>,
    /// Numbers that depend on live parameters or on the time.
    live: HashSet<ExprId>,
}

impl<'a> SampledValues<'a> {
    /// Prepares points at all scales around the origin.
    pub(super) fn new(ranges: &'a ParamRanges) -> Self {
        Self {
            ranges,
            points: Vec::new(),
            values: HashMap::new(),
            live: HashSet::new(),
        }
    }

    /// Reports whether a number has this value at a sampled point. The values of a number that depends on live parameters
    /// differ from those of the samples. Then any value that it has at several points counts.
    pub(super) fn show_plateau(&mut self, e: &Expressions, number: ExprId, value: f64) -> bool {
        if self.values.len() > MAX_NUMBERS {
            return false;
        }
        let terms = Sum::of(e, number).map_or(Vec::new(), |sum| sum.terms);
        let mut magnitudes = vec![value.abs(); self.of(e, number).len()];
        for Term { number, factor } in terms {
            for (magnitude, value) in magnitudes.iter_mut().zip(self.of(e, number)) {
                *magnitude += (factor * value).abs();
            }
        }
        let is_live = self.live.contains(&number);
        let values = self.of(e, number);
        if is_live {
            let mut sorted: Vec<f64> = values.iter().copied().filter(|it| it.is_finite()).collect();
            sorted.sort_by(f64::total_cmp);
            return sorted
                .windows(MIN_REPETITIONS)
                .any(|values| values[0] == values[MIN_REPETITIONS - 1]);
        }
        let is_plateau = |(other, magnitude): (&f64, f64)| {
            let difference = (other - value).abs();
            difference.is_finite() && difference <= TOLERANCE * magnitude
        };
        values.iter().zip(magnitudes).any(is_plateau)
    }

    fn of(&mut self, e: &Expressions, number: ExprId) -> &[f64] {
        let order = postorder(e, number, |id| self.values.contains_key(&id));
        if self.points.is_empty() {
            let count = (MAX_VALUES / order.len().max(1)).clamp(MIN_COUNT, MAX_COUNT);
            self.points = (0..count).map(point).collect();
        }
        for id in order {
            if self.is_live(e, id) {
                self.live.insert(id);
            }
            let values = self.evaluated(e, id);
            self.values.insert(id, values);
        }
        &self.values[&number]
    }

    fn is_live(&self, e: &Expressions, id: ExprId) -> bool {
        match e.get(id) {
            Expression::Param(..) | Expression::Time => true,
            Expression::Apply {
                point,
                values,
                parameters,
                ..
            } => {
                let mut operands = point.iter().flatten().chain(values).chain(parameters);
                operands.any(|id| self.live.contains(id))
            }
            _ => false,
        }
    }

    fn evaluated(&self, e: &Expressions, id: ExprId) -> Vec<f64> {
        match e.get(id) {
            Expression::Coordinate(axis) => {
                let axis = usize::from(*axis);
                self.points.iter().map(|point| point[axis]).collect()
            }
            Expression::Apply {
                op,
                point,
                values,
                parameters,
            } => self.applied(*op, *point, values, parameters),
            _ => {
                let range = self.ranges.leaf(e, id);
                let middle = range.lo.max(-f64::MAX) / 2.0 + range.hi.min(f64::MAX) / 2.0;
                vec![middle; self.points.len()]
            }
        }
    }

    fn applied(
        &self,
        op: Op,
        point: Option<[ExprId; 3]>,
        values: &[ExprId],
        parameters: &[ExprId],
    ) -> Vec<f64> {
        let column = |id: &ExprId| self.values[id].as_slice();
        let point = point.map(|point| point.map(|id| column(&id)));
        let operands: Vec<&[f64]> = values.iter().map(column).collect();
        // Parameters are the same at all points.
        let parameters: Vec<f64> = parameters.iter().map(|id| column(id)[0]).collect();
        let parameters = pack_parameters(op, &parameters);
        let value = |index: usize| {
            let p = point.map_or(V3::new(0.0, 0.0, 0.0), |[x, y, z]| {
                V3::new(x[index], y[index], z[index])
            });
            let mut numbers = [0.0; 3];
            for (number, operand) in numbers.iter_mut().zip(&operands) {
                *number = operand[index];
            }
            match apply::<f64>(op, p, numbers, &parameters) {
                OpResult::Value(value) => value,
                OpResult::Point(_) => f64::NAN,
            }
        };
        (0..self.points.len()).map(value).collect()
    }
}

/// Returns a point: a low-discrepancy sequence of directions and of distances, by their logarithms.
fn point(index: usize) -> [f64; 3] {
    // Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences": powers of the root of x⁴ = x + 1.
    let fraction = |step: f64| ((index as f64 + 0.5) * step).fract();
    let [low, high] = EXPONENTS;
    let distance = 10_f64.powf(low + (high - low) * fraction(0.819_172_513_396_164_4));
    let z = 2.0 * fraction(0.671_043_606_703_789_2) - 1.0;
    let angle = std::f64::consts::TAU * fraction(0.549_700_477_901_970_4);
    let radius = (1.0 - z * z).sqrt();
    [radius * angle.cos(), radius * angle.sin(), z].map(|axis| axis * distance)
}
