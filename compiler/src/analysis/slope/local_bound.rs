//! Bounds of changes near a point, for numbers without a slope bound. They occur around the axis of an angle,
//! beside a pole, and at the branch point of a root.
//!
//! Within a distance `d`, the number changes by at most `(slope · d + curvature · d²) / (1 − growth · d)`.
//! Sums, products and quotients of such numbers have such a bound again, and so have elementary functions of
//! them. The bounds are themselves numbers of the point.
//!
//! Only poles and branch points need `growth`. The product of two factors that are zero changes by the
//! square of the distance. Its slope is zero, and without `curvature` its growth would be infinite.

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
    /// Coefficient of the squared distance; `None` for zero.
    pub(super) curvature: Option<ExprId>,
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
            curvature: None,
            growth: None,
            radius: None,
        }
    }

    /// Returns the slope, if it is one number that holds for all points and distances.
    pub(super) fn everywhere_slope(&self, expressions: &Expressions) -> Option<f64> {
        self.constant_slope(expressions)
            .filter(|_| self.radius.is_none())
    }

    /// Returns the slope, if it is one number for all points.
    pub(super) fn constant_slope(&self, expressions: &Expressions) -> Option<f64> {
        let is_linear = self.growth.is_none() && self.curvature.is_none();
        expressions.as_constant(self.slope).filter(|_| is_linear)
    }

    /// Reports whether the number is the same at all points.
    pub(super) fn is_zero(&self, expressions: &Expressions) -> bool {
        self.constant_slope(expressions) == Some(0.0)
    }

    /// Returns a distance within which the number changes by at most `size`, wherever the bound holds: the
    /// root of `slope · d + curvature · d² = size · (1 − growth · d)`.
    pub(super) fn distance_for_change(&self, e: &mut Expressions, size: ExprId) -> ExprId {
        let mut slope = self.slope;
        if let Some(growth) = self.growth {
            let added_slope = e.call(Op::Mul, &[growth, size]);
            slope = e.call(Op::Add, &[slope, added_slope]);
        }
        let Some(curvature) = self.curvature else {
            return e.call(Op::Div, &[size, slope]);
        };
        let [two, four] = [2.0, 4.0].map(|value| e.constant(value));
        let square = e.call(Op::Mul, &[slope, slope]);
        let product = e.call(Op::Mul, &[curvature, size]);
        let product = e.call(Op::Mul, &[four, product]);
        let discriminant = e.call(Op::Add, &[square, product]);
        let root = e.call(Op::Sqrt, &[discriminant]);
        let divisor = e.call(Op::Add, &[slope, root]);
        let dividend = e.call(Op::Mul, &[two, size]);
        e.call(Op::Div, &[dividend, divisor])
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
    let mut builder = LocalBoundBuilder::new(expressions, held, region_bounds);
    builder.root = Some(number);
    builder.operation_bound(number)
}

/// Distance up to which curved factors are bounded by lines, in usual distances to the surface. Longer ones make
/// the lines steeper, and shorter ones limit the step.
const SCALE_DISTANCES: f64 = 4.0;

struct LocalBoundBuilder<'a, 'b> {
    e: &'a mut Expressions,
    /// Number whose value divided by its slope is about the distance to the surface; `None` if there is none.
    root: Option<ExprId>,
    /// Distance up to which curved factors of products are bounded by lines, once one was met.
    scale: Option<ExprId>,
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
            root: None,
            scale: None,
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
        Some(self.joined_bound(op, a, b))
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
            curvature: select_option(a.curvature, b.curvature, 0.0),
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
        let return_distance = local.distance_for_change(self.e, excess);
        let return_distance = self.combine_options(Op::Min, Some(return_distance), local.radius)?;
        // Fraction of the distance at which the bound becomes infinite.
        let fraction = self.call(Op::Mul, &[return_distance, growth]);
        let [zero, half, no_surface] =
            [0.0, 0.5, NO_SURFACE_DISTANCE].map(|value| self.e.constant(value));
        let is_beyond = self.call(Op::Less, &[half, fraction]);
        let radius = local.radius.unwrap_or(no_surface);
        Some(LocalBound {
            slope: self.call(Op::Select, &[is_beyond, zero, local.slope]),
            curvature: local
                .curvature
                .map(|curvature| self.call(Op::Select, &[is_beyond, zero, curvature])),
            growth: local.growth,
            radius: Some(self.call(Op::Select, &[is_beyond, return_distance, radius])),
        })
    }

    /// Bounds a remainder, by the integer number of divisors that it subtracts.
    fn remainder_bound(&mut self, number: ExprId, a: ExprId, b: ExprId) -> Option<LocalBound> {
        let (divided, divisor) = (self.bound(a)?, self.bound(b)?);
        if divisor.is_zero(self.e) {
            return Some(divided);
        }
        let subtracted = self.call(Op::Sub, &[a, number]);
        let divisor_count = self.call(Op::Div, &[subtracted, b]);
        let divisor_count = self.call(Op::Abs, &[divisor_count]);
        let subtracted_bound = self.scaled_bound(divisor_count, divisor);
        Some(self.joined_bound(Op::Add, divided, subtracted_bound))
    }

    fn product_bound(&mut self, a: ExprId, b: ExprId) -> Option<LocalBound> {
        let (first, second) = (self.bound(a)?, self.bound(b)?);
        let [a, b] = [a, b].map(|value| self.call(Op::Abs, &[value]));
        let first_term = self.scaled_bound(a, second);
        let second_term = self.scaled_bound(b, first);
        let bound = self.joined_bound(Op::Add, first_term, second_term);
        let is_scaled = [first, second].iter().any(|factor| factor.is_zero(self.e));
        if is_scaled {
            return Some(bound);
        }
        // Both factors change at once.
        let [first_slope, second_slope] = [first, second].map(|factor| self.linear_slope(factor));
        let joint_slope = self.call(Op::Mul, &[first_slope, second_slope]);
        let curved_factors = [first, second].map(|factor| factor.curvature.is_some());
        let curved_factors = curved_factors.into_iter().filter(|&is_curved| is_curved);
        let pole = match curved_factors.count() {
            0 => None,
            count => {
                let count = self.e.constant(count as f64);
                let scale = self.scale();
                Some(self.call(Op::Div, &[count, scale]))
            }
        };
        let mut growth = bound.growth;
        if let Some(operand_growth) = growth {
            // `1 / (1 − x)²` is at most `1 / (1 − 2x)`. A pole at the distance at which the joint change equals
            // the linear one serves, too.
            let joint_growth = self.call(Op::Div, &[joint_slope, bound.slope]);
            let added_growth = self.call(Op::Min, &[operand_growth, joint_growth]);
            growth = Some(self.call(Op::Add, &[operand_growth, added_growth]));
        }
        Some(LocalBound {
            curvature: self.combine_options(Op::Add, bound.curvature, Some(joint_slope)),
            growth: self.combine_options(Op::Add, growth, pole),
            ..bound
        })
    }

    /// Returns the slope of a bound without curvature, beside that of its growth. With a pole at the distance
    /// `scale`, it exceeds the curved one: `s + c · d ≤ (s + c · scale) / (1 − d / scale)`.
    fn linear_slope(&mut self, bound: LocalBound) -> ExprId {
        let Some(curvature) = bound.curvature else {
            return bound.slope;
        };
        let scale = self.scale();
        let added_slope = self.call(Op::Mul, &[curvature, scale]);
        self.call(Op::Add, &[bound.slope, added_slope])
    }

    /// Returns the distance up to which curved factors are bounded by lines. It is a multiple of the usual distance
    /// to the surface, or the size of the scene.
    fn scale(&mut self) -> ExprId {
        if let Some(scale) = self.scale {
            return scale;
        }
        let by_slope = self.root.and_then(|root| {
            let slope = self.region_bounds.median_slope(self.e, root)?;
            slope.is_normal().then_some((root, slope))
        });
        let scale = match by_slope {
            Some((root, slope)) => {
                let value = self.call(Op::Abs, &[root]);
                let factor = self.e.constant(SCALE_DISTANCES / slope);
                self.call(Op::Mul, &[value, factor])
            }
            None => self.e.constant(self.region_bounds.size),
        };
        self.scale = Some(scale);
        scale
    }

    fn quotient_bound(&mut self, a: ExprId, b: ExprId) -> Option<LocalBound> {
        let (dividend, divisor) = (self.bound(a)?, self.bound(b)?);
        let size = self.call(Op::Abs, &[b]);
        let quotient = self.call(Op::Div, &[a, b]);
        let quotient = self.call(Op::Abs, &[quotient]);
        let divisor_term = self.scaled_bound(quotient, divisor);
        let sum = self.joined_bound(Op::Add, dividend, divisor_term);
        let mut growth = sum.growth;
        if !divisor.is_zero(self.e) {
            let pole = self.call(Op::Div, &[divisor.slope, size]);
            growth = self.combine_options(Op::Add, growth, Some(pole));
        }
        if let Some(curvature) = divisor.curvature {
            // The divisor is zero where `x + y² = 1`. There, `x + y` is at least one.
            let square = self.call(Op::Div, &[curvature, size]);
            let root = self.call(Op::Sqrt, &[square]);
            growth = self.combine_options(Op::Add, growth, Some(root));
        }
        Some(LocalBound {
            slope: self.call(Op::Div, &[sum.slope, size]),
            curvature: sum
                .curvature
                .map(|curvature| self.call(Op::Div, &[curvature, size])),
            growth,
            radius: sum.radius,
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
            curvature: None,
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
                Some(self.joined_bound(Op::Max, a, b))
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

    /// Bounds the length of a vector: by the lengths of its slopes and of its curvatures.
    fn length_bound(&mut self, components: &[ExprId]) -> Option<LocalBound> {
        let mut squares: Option<LocalBound> = None;
        for &component in components {
            let local = self.bound(component)?;
            let squared = LocalBound {
                slope: self.call(Op::Mul, &[local.slope, local.slope]),
                curvature: local
                    .curvature
                    .map(|curvature| self.call(Op::Mul, &[curvature, curvature])),
                ..local
            };
            squares = Some(match squares {
                Some(sum) => self.joined_bound(Op::Add, sum, squared),
                None => squared,
            });
        }
        let squares = squares?;
        Some(LocalBound {
            slope: self.call(Op::Sqrt, &[squares.slope]),
            curvature: squares
                .curvature
                .map(|square| self.call(Op::Sqrt, &[square])),
            ..squares
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
        let mut added_growth = self.call(Op::Mul, &[growth, local.slope]);
        if let Some(curvature) = local.curvature {
            // The function's bound is infinite where `x + y² = 1`. There, `x + y` is at least one.
            let square = self.call(Op::Mul, &[growth, curvature]);
            let root = self.call(Op::Sqrt, &[square]);
            added_growth = self.call(Op::Add, &[added_growth, root]);
        }
        let scaled = self.scaled_bound(slope, local);
        Some(LocalBound {
            growth: self.combine_options(Op::Add, local.growth, Some(added_growth)),
            ..scaled
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

    /// Returns the bound of a number times a factor that is at least zero and does not change.
    fn scaled_bound(&mut self, factor: ExprId, bound: LocalBound) -> LocalBound {
        if bound.is_zero(self.e) {
            return bound;
        }
        LocalBound {
            slope: self.call(Op::Mul, &[factor, bound.slope]),
            curvature: bound
                .curvature
                .map(|curvature| self.call(Op::Mul, &[factor, curvature])),
            ..bound
        }
    }

    /// Returns the sum or the maximum of two bounds, which holds where both do.
    fn joined_bound(&mut self, op: Op, a: LocalBound, b: LocalBound) -> LocalBound {
        LocalBound {
            slope: self.call(op, &[a.slope, b.slope]),
            curvature: self.combine_options(op, a.curvature, b.curvature),
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
