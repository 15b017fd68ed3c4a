//! Bounds of changes near a point, for numbers without a slope bound. They occur around the axis of an angle,
//! beside a pole, and at the branch point of a root.
//!
//! Within a distance `d`, the number changes by at most `slope · d / (1 − growth · d)`. Sums, products
//! and quotients of such numbers have such a bound again, and so have elementary functions of them. The
//! bounds are themselves numbers of the point.

use super::region_bounds::RegionBounds;
use crate::analysis::box_eval::HeldBranches;
use crate::expression::{ExprId, Expression, Expressions};
use crate::scene::NO_SURFACE_DISTANCE;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Bound of a number's changes around a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalBound {
    /// Slope at the point.
    pub(super) slope: ExprId,
    /// Reciprocal of the distance at which the bound becomes infinite; `None` for zero.
    pub(super) growth: Option<ExprId>,
    /// Distance up to which the bound holds; `None` if it holds for all distances.
    pub(super) radius: Option<ExprId>,
}

impl LocalBound {
    /// Returns one bound for all points.
    pub(super) fn everywhere(expressions: &mut Expressions, slope: f64) -> Self {
        Self {
            slope: expressions.constant(slope),
            growth: None,
            radius: None,
        }
    }

    /// Returns the slope, if it is one number that holds for all points and distances.
    pub(super) fn everywhere_slope(&self, expressions: &Expressions) -> Option<f64> {
        let holds = self.growth.is_none() && self.radius.is_none();
        expressions.as_constant(self.slope).filter(|_| holds)
    }

    /// Reports whether it is one bound for all points.
    pub(super) fn is_constant(&self, expressions: &Expressions) -> bool {
        self.growth.is_none() && expressions.as_constant(self.slope).is_some()
    }
}

/// Returns a bound of a number's changes around each point, or a constant bound if that is not much
/// worse. Discontinuous operations and choices are held. `None` if there is neither a rule nor a constant bound.
pub(super) fn local_bound(
    expressions: &mut Expressions,
    number: ExprId,
    held: HeldBranches,
    region_bounds: &mut RegionBounds,
) -> Option<LocalBound> {
    LocalBoundBuilder::new(expressions, held, region_bounds).bound(number)
}

/// Returns the same for a number that is known to have no bound throughout.
pub(super) fn bound_without_global(
    expressions: &mut Expressions,
    number: ExprId,
    held: HeldBranches,
    region_bounds: &mut RegionBounds,
) -> Option<LocalBound> {
    LocalBoundBuilder::new(expressions, held, region_bounds).operation_bound(number)
}

struct LocalBoundBuilder<'a, 'b> {
    e: &'a mut Expressions,
    held: HeldBranches,
    region_bounds: &'a mut RegionBounds<'b>,
    cached: HashMap<ExprId, Option<LocalBound>>,
    /// Bounds of the square roots of numbers.
    cached_roots: HashMap<ExprId, Option<LocalBound>>,
}

impl<'a, 'b> LocalBoundBuilder<'a, 'b> {
    fn new(
        e: &'a mut Expressions,
        held: HeldBranches,
        region_bounds: &'a mut RegionBounds<'b>,
    ) -> Self {
        Self {
            e,
            held,
            region_bounds,
            cached: HashMap::new(),
            cached_roots: HashMap::new(),
        }
    }

    /// Bounds the changes of a number around each point, and caches the bound. It recurses over operands.
    fn bound(&mut self, number: ExprId) -> Option<LocalBound> {
        if let Some(&cached) = self.cached.get(&number) {
            return cached;
        }
        let bound = self.region_bounds.slope(self.e, &[number], self.held);
        let is_near_median =
            bound.is_some_and(|slope| !self.region_bounds.exceeds_median(self.e, number, slope));
        let mut operation = None;
        if !is_near_median {
            operation = self.operation_bound(number);
        }
        let operation = operation.or_else(|| Some(LocalBound::everywhere(self.e, bound?)));
        self.cached.insert(number, operation);
        operation
    }

    fn operation_bound(&mut self, number: ExprId) -> Option<LocalBound> {
        let Expression::Apply { op, values, .. } = self.e.get(number).clone() else {
            return None;
        };
        match (op, values.as_slice()) {
            (Op::Floor | Op::Less, _) => Some(LocalBound::everywhere(self.e, 0.0)),
            (Op::Neg | Op::Abs | Op::Fract | Op::Sin | Op::Cos | Op::Atan | Op::Tanh, &[a]) => {
                self.bound(a)
            }
            (Op::Modulo, &[a, b]) => self.remainder_bound(number, a, b),
            (Op::Add | Op::Sub, &[a, b]) => self.combined_bound(a, b, Op::Add),
            (Op::Min | Op::Max, &[a, b]) => match [a, b].map(|id| self.e.as_constant(id)) {
                [None, Some(_)] => self.clamped_bound(number, a),
                [Some(_), None] => self.clamped_bound(number, b),
                _ => self.combined_bound(a, b, Op::Max),
            },
            (Op::Clamp, &[a, low, high])
                if [low, high]
                    .map(|id| self.e.as_constant(id))
                    .iter()
                    .all(Option::is_some) =>
            {
                self.clamped_bound(number, a)
            }
            (Op::Select, &[condition, a, b]) => self.choice_bound(condition, a, b),
            (Op::Mul, &[a, b]) => self.product_bound(a, b),
            (Op::Div, &[a, b]) => self.quotient_bound(a, b),
            (Op::Square, &[a]) => self.product_bound(a, a),
            (Op::Atan2, &[y, x]) => self.angle_bound(y, x),
            // tan(a + h) − tan(a) = (1 + tan²(a)) tan(h) / (1 − tan(a) tan(h)), and tan(h) ≤ h / (1 −
            // 2h/π).
            (Op::Tan, &[a]) => {
                let square = self.call(Op::Mul, &[number, number]);
                let slope = self.plus_constant(square, 1.0);
                let size = self.call(Op::Abs, &[number]);
                let growth = self.plus_constant(size, std::f64::consts::FRAC_2_PI);
                self.composed_bound(a, slope, growth)
            }
            // With x = h/a: −ln(1 − x) ≤ x / (1 − x).
            (Op::Ln | Op::Log2, &[a]) => {
                let growth = self.quotient_by_magnitude(a, 1.0);
                let slope = self.quotient_by_magnitude(a, std::f64::consts::LOG2_E);
                self.composed_bound(a, if op == Op::Ln { growth } else { slope }, growth)
            }
            // exp(h) − 1 ≤ h / (1 − h/2).
            (Op::Exp | Op::Exp2, &[a]) => {
                let base = if op == Op::Exp {
                    1.0
                } else {
                    std::f64::consts::LN_2
                };
                self.power_bound(number, a, base)
            }
            (Op::Pow, &[base, a]) if self.e.as_constant(base).is_some_and(|base| base > 0.0) => {
                let base = self.e.as_constant(base)?.ln();
                self.power_bound(number, a, base.abs())
            }
            // 1 − √(1 − x) ≤ (x/2) / (1 − x/2).
            (Op::Sqrt, &[a]) => {
                if let Some(root) = self.root_bound(a) {
                    return Some(root);
                }
                let (slope, growth) = (
                    self.quotient_by_magnitude(number, 0.5),
                    self.quotient_by_magnitude(a, 0.5),
                );
                self.composed_bound(a, slope, growth)
            }
            // 1/√(1 − x) − 1 ≤ (x/2) / (1 − x).
            (Op::InverseSqrt, &[a]) => {
                let cube = self.call(Op::Mul, &[number, number]);
                let cube = self.call(Op::Mul, &[cube, number]);
                let half = self.e.constant(0.5);
                let slope = self.call(Op::Mul, &[cube, half]);
                let growth = self.quotient_by_magnitude(a, 1.0);
                self.composed_bound(a, slope, growth)
            }
            // With x = h / (1 − |a|): 2 − 2√(1 − x) ≤ x / (1 − x/2).
            (Op::Asin | Op::Acos, &[a]) => {
                let unit = self.e.constant(1.0);
                let size = self.call(Op::Abs, &[a]);
                let one_minus_size = self.call(Op::Sub, &[unit, size]);
                let one_minus_size = self.call(Op::Abs, &[one_minus_size]);
                let one_plus_size = self.call(Op::Add, &[unit, size]);
                let square = self.call(Op::Mul, &[one_minus_size, one_plus_size]);
                let root = self.call(Op::Sqrt, &[square]);
                let (slope, growth) = (
                    self.quotient_by_magnitude(root, 1.0),
                    self.quotient_by_magnitude(one_minus_size, 0.5),
                );
                self.composed_bound(a, slope, growth)
            }
            _ => None,
        }
    }

    fn combined_bound(&mut self, a: ExprId, b: ExprId, op: Op) -> Option<LocalBound> {
        let (a, b) = (self.bound(a)?, self.bound(b)?);
        let slope = self.call(op, &[a.slope, b.slope]);
        Some(self.with_both_limits(slope, a, b))
    }

    /// Bounds one of two numbers, while the choice stays the same.
    fn choice_bound(&mut self, condition: ExprId, a: ExprId, b: ExprId) -> Option<LocalBound> {
        let (a, b) = (self.bound(a)?, self.bound(b)?);
        let mut select_option = |a: Option<ExprId>, b: Option<ExprId>, neither: f64| {
            a.or(b)?;
            let neither = self.e.constant(neither);
            let operands = [condition, a.unwrap_or(neither), b.unwrap_or(neither)];
            Some(self.e.call(Op::Select, &operands))
        };
        Some(LocalBound {
            slope: select_option(Some(a.slope), Some(b.slope), 0.0)?,
            growth: select_option(a.growth, b.growth, 0.0),
            radius: select_option(a.radius, b.radius, NO_SURFACE_DISTANCE),
        })
    }

    /// Bounds a number that is clamped from one side. Far beyond the limit nothing changes until the
    /// number is back at it.
    fn clamped_bound(&mut self, number: ExprId, a: ExprId) -> Option<LocalBound> {
        let local = self.bound(a)?;
        let Some(growth) = local.growth else {
            return Some(local);
        };
        let excess = self.call(Op::Sub, &[a, number]);
        let excess = self.call(Op::Abs, &[excess]);
        let slope_growth = self.call(Op::Mul, &[growth, excess]);
        let slope = self.call(Op::Add, &[local.slope, slope_growth]);
        let return_distance = self.call(Op::Div, &[excess, slope]);
        let return_distance = self.combine_options(Op::Min, Some(return_distance), local.radius)?;
        // Fraction of the distance at which the bound becomes infinite.
        let fraction = self.call(Op::Mul, &[return_distance, growth]);
        let [zero, half, no_surface] =
            [0.0, 0.5, NO_SURFACE_DISTANCE].map(|value| self.e.constant(value));
        let is_beyond = self.call(Op::Less, &[half, fraction]);
        let radius = local.radius.unwrap_or(no_surface);
        Some(LocalBound {
            slope: self.call(Op::Select, &[is_beyond, zero, local.slope]),
            growth: local.growth,
            radius: Some(self.call(Op::Select, &[is_beyond, return_distance, radius])),
        })
    }

    /// Bounds a remainder, by the integer number of divisors that it subtracts.
    fn remainder_bound(&mut self, number: ExprId, a: ExprId, b: ExprId) -> Option<LocalBound> {
        let (divided, divisor) = (self.bound(a)?, self.bound(b)?);
        if self.e.as_constant(divisor.slope) == Some(0.0) {
            return Some(divided);
        }
        let subtracted = self.call(Op::Sub, &[a, number]);
        let divisor_count = self.call(Op::Div, &[subtracted, b]);
        let divisor_count = self.call(Op::Abs, &[divisor_count]);
        let divisor_slope = self.call(Op::Mul, &[divisor_count, divisor.slope]);
        let slope = self.call(Op::Add, &[divided.slope, divisor_slope]);
        Some(self.with_both_limits(slope, divided, divisor))
    }

    fn product_bound(&mut self, a: ExprId, b: ExprId) -> Option<LocalBound> {
        let (first, second) = (self.bound(a)?, self.bound(b)?);
        let [a, b] = [a, b].map(|value| self.call(Op::Abs, &[value]));
        let first_term = self.call(Op::Mul, &[a, second.slope]);
        let second_term = self.call(Op::Mul, &[b, first.slope]);
        let slope = self.call(Op::Add, &[first_term, second_term]);
        // Both factors change at once.
        let joint_slope = self.call(Op::Mul, &[first.slope, second.slope]);
        let growth = match self.e.as_constant(joint_slope) {
            Some(0.0) => None,
            _ => Some(self.call(Op::Div, &[joint_slope, slope])),
        };
        let operands = self.with_both_limits(slope, first, second);
        Some(LocalBound {
            growth: self.combine_options(Op::Add, operands.growth, growth),
            ..operands
        })
    }

    fn quotient_bound(&mut self, a: ExprId, b: ExprId) -> Option<LocalBound> {
        let (dividend, divisor) = (self.bound(a)?, self.bound(b)?);
        let size = self.call(Op::Abs, &[b]);
        let quotient = self.call(Op::Div, &[a, b]);
        let quotient = self.call(Op::Abs, &[quotient]);
        let quotient_slope = self.call(Op::Mul, &[quotient, divisor.slope]);
        let sum = self.call(Op::Add, &[dividend.slope, quotient_slope]);
        let growth = self.call(Op::Div, &[divisor.slope, size]);
        let slope = self.call(Op::Div, &[sum, size]);
        let operands = self.with_both_limits(slope, dividend, divisor);
        Some(LocalBound {
            growth: self.combine_options(Op::Add, operands.growth, Some(growth)),
            ..operands
        })
    }

    /// Bounds the direction of a vector, up to the distance at which the vector may be zero: asin(x) ≤
    /// x / (1 − (1 − 2/π) x) there.
    fn angle_bound(&mut self, y: ExprId, x: ExprId) -> Option<LocalBound> {
        let slope = self.region_bounds.slope(self.e, &[y, x], self.held)?;
        let [y, x] = [y, x].map(|v| self.call(Op::Mul, &[v, v]));
        let square = self.call(Op::Add, &[y, x]);
        let length = self.call(Op::Sqrt, &[square]);
        let factor = self.e.constant(1.0 / slope);
        Some(LocalBound {
            slope: self.quotient_by_magnitude(length, slope),
            growth: Some(
                self.quotient_by_magnitude(length, slope * (1.0 - std::f64::consts::FRAC_2_PI)),
            ),
            radius: Some(self.call(Op::Mul, &[length, factor])),
        })
    }

    /// Bounds the square root of a sum of squares, or of the least or largest of such sums. √min(a, b) is
    /// min(√a, √b), so its slope stays finite where the root is zero. Recursion over minima and maxima.
    fn root_bound(&mut self, square: ExprId) -> Option<LocalBound> {
        if let Some(&cached) = self.cached_roots.get(&square) {
            return cached;
        }
        let root = self.root_bound_by_operands(square);
        self.cached_roots.insert(square, root);
        root
    }

    fn root_bound_by_operands(&mut self, square: ExprId) -> Option<LocalBound> {
        if let Some(components) = self.squared_terms(square) {
            return self.length_bound(&components);
        }
        let Expression::Apply { op, values, .. } = self.e.get(square).clone() else {
            return None;
        };
        match (op, values.as_slice()) {
            (Op::Min | Op::Max, &[a, b]) => {
                let (a, b) = (self.root_bound(a)?, self.root_bound(b)?);
                let slope = self.call(Op::Max, &[a.slope, b.slope]);
                Some(self.with_both_limits(slope, a, b))
            }
            _ => None,
        }
    }

    /// Returns the numbers whose squares a number adds. Recursion over sums.
    fn squared_terms(&self, id: ExprId) -> Option<Vec<ExprId>> {
        let Expression::Apply { op, values, .. } = self.e.get(id) else {
            return None;
        };
        match (op, values.as_slice()) {
            (Op::Add, &[a, b]) => Some([self.squared_terms(a)?, self.squared_terms(b)?].concat()),
            (Op::Mul, &[a, b]) if a == b => Some(vec![a]),
            (Op::Square, &[a]) => Some(vec![a]),
            _ => None,
        }
    }

    /// Bounds the length of a vector.
    fn length_bound(&mut self, components: &[ExprId]) -> Option<LocalBound> {
        let mut length: Option<LocalBound> = None;
        for &component in components {
            let local = self.bound(component)?;
            let square = self.call(Op::Mul, &[local.slope, local.slope]);
            length = Some(match length {
                Some(length) => {
                    let sum = self.call(Op::Add, &[length.slope, square]);
                    self.with_both_limits(sum, length, local)
                }
                None => LocalBound {
                    slope: square,
                    ..local
                },
            });
        }
        let length = length?;
        Some(LocalBound {
            slope: self.call(Op::Sqrt, &[length.slope]),
            ..length
        })
    }

    /// Bounds an exponential of a number, by the logarithm of its base.
    fn power_bound(&mut self, number: ExprId, a: ExprId, base: f64) -> Option<LocalBound> {
        let [factor, growth] = [base, base / 2.0].map(|value| self.e.constant(value));
        let slope = self.call(Op::Mul, &[number, factor]);
        self.composed_bound(a, slope, growth)
    }

    /// Bounds a function of a number, by its slope and its growth in that number.
    fn composed_bound(&mut self, a: ExprId, slope: ExprId, growth: ExprId) -> Option<LocalBound> {
        let local = self.bound(a)?;
        let added_growth = self.call(Op::Mul, &[growth, local.slope]);
        Some(LocalBound {
            slope: self.call(Op::Mul, &[slope, local.slope]),
            growth: self.combine_options(Op::Add, local.growth, Some(added_growth)),
            radius: local.radius,
        })
    }

    fn quotient_by_magnitude(&mut self, a: ExprId, value: f64) -> ExprId {
        let value = self.e.constant(value);
        let size = self.call(Op::Abs, &[a]);
        self.call(Op::Div, &[value, size])
    }

    fn plus_constant(&mut self, a: ExprId, value: f64) -> ExprId {
        let value = self.e.constant(value);
        self.call(Op::Add, &[a, value])
    }

    /// Returns a bound with this slope that holds where the bounds of both numbers do.
    fn with_both_limits(&mut self, slope: ExprId, a: LocalBound, b: LocalBound) -> LocalBound {
        LocalBound {
            slope,
            growth: self.combine_options(Op::Max, a.growth, b.growth),
            radius: self.combine_options(Op::Min, a.radius, b.radius),
        }
    }

    fn combine_options(&mut self, op: Op, a: Option<ExprId>, b: Option<ExprId>) -> Option<ExprId> {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.call(op, &[a, b])),
            (first, second) => first.or(second),
        }
    }

    fn call(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        self.e.call(op, values)
    }
}
