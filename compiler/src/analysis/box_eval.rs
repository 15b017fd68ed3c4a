//! Numbers of the point, compiled for repeated evaluation over boxes. The result is the range of values
//! and, with dual numbers, the range of gradients. Operands are resolved once, so that a search through
//! thousands of boxes runs arithmetic only.

mod blend;
mod held_branches;
mod norm;
mod period;
mod power;
mod relative;

pub(crate) use held_branches::HeldBranches;
pub(crate) use period::AxisDependence;

use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::uniforms::postorder;
use relative::Relative;
use sdfc_vm::apply::{Apply, OpResult, apply, pack_parameters};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::operation_body;
use sdfc_vm::real::Vector3;
use sdfc_vm::row::SlopeRule;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// Value of a number over a box: its range, with or without the range of its gradient.
pub(crate) trait BoxValue: Apply {
    /// Returns a number that is the same at all points, within a range.
    fn from_range(range: Interval) -> Self;
    /// Returns a coordinate.
    fn coordinate(axis: usize, range: Interval) -> Self;
    /// Returns the range of values.
    fn range(&self) -> Interval;
    /// Returns a number whose range contains zero, too.
    fn with_zero(self) -> Self {
        self
    }
    /// Narrows the result of a step by the relative gradients of earlier steps, and returns its own.
    fn refined(
        &mut self,
        _step: &BoxStep<Self>,
        _steps: &[BoxStep<Self>],
        _previous: &[Self],
        _relative: &[Option<Relative>],
    ) -> Option<Relative> {
        None
    }
    /// Returns the result of a step with its discontinuities held; see [`held_branches`].
    fn hold_branches(self, _step: &BoxStep<Self>, _previous: &[Self], _held: HeldBranches) -> Self {
        self
    }
}

impl BoxValue for Interval {
    fn from_range(range: Interval) -> Self {
        range
    }
    fn coordinate(_: usize, range: Interval) -> Self {
        range
    }
    fn range(&self) -> Interval {
        *self
    }
    fn with_zero(self) -> Self {
        self.hull(Self::point(0.0))
    }
}

/// Value at the centre of the box, and at the centre of each range.
impl BoxValue for Dual<f64> {
    fn from_range(range: Interval) -> Self {
        Self::fixed(midpoint(range))
    }
    fn coordinate(axis: usize, range: Interval) -> Self {
        let component = |other: usize| if other == axis { 1.0 } else { 0.0 };
        Self {
            value: midpoint(range),
            gradient: V3::new(component(0), component(1), component(2)),
        }
    }
    fn range(&self) -> Interval {
        Interval::point(self.value)
    }
}

/// Returns the midpoint of a range, which may be infinite.
fn midpoint(range: Interval) -> f64 {
    if range.lo == range.hi {
        return range.lo;
    }
    let end = |v: f64| v.clamp(-f64::MAX, f64::MAX);
    end(range.lo) / 2.0 + end(range.hi) / 2.0
}

impl BoxValue for Dual<Interval> {
    fn from_range(range: Interval) -> Self {
        Self::fixed(range)
    }
    fn coordinate(axis: usize, range: Interval) -> Self {
        let along = |other: usize| Interval::point(if other == axis { 1.0 } else { 0.0 });
        Self {
            value: range,
            gradient: V3::new(along(0), along(1), along(2)),
        }
    }
    fn range(&self) -> Interval {
        self.value
    }
    fn refined(
        &mut self,
        step: &BoxStep<Self>,
        steps: &[BoxStep<Self>],
        previous: &[Self],
        relative: &[Option<Relative>],
    ) -> Option<Relative> {
        relative::refine(self, step, steps, previous, relative)
    }
    fn hold_branches(self, step: &BoxStep<Self>, previous: &[Self], held: HeldBranches) -> Self {
        held_branches::hold_branches(step, previous, self, held)
    }
}

/// Value of a number that depends on no point.
#[derive(Clone, Copy, Debug)]
pub(crate) enum UniformInput {
    /// A range, the same in all boxes.
    Known(Interval),
    /// Index into the ranges that come with a box.
    Input(usize),
}

/// Program that computes a number over boxes: one step per operand, operands first.
pub(crate) struct BoxNumber<R> {
    steps: Vec<BoxStep<R>>,
    /// Results of the steps in the last box.
    values: Vec<R>,
    /// Relative gradients of those that are positive in the last box.
    relative: Vec<Option<Relative>>,
    /// Set if relative gradients are computed: there is an exponential or a logarithm.
    needs_relative: bool,
    /// Set if the length of a gradient has a tighter bound than by its components.
    has_norms: bool,
    /// Set if discontinuities are held.
    held: Option<HeldBranches>,
    /// For each step, whether it is the same at all points. A jump between values of a parameter is no gradient.
    is_uniform: Vec<bool>,
}

/// One step of a program; operands are indices of earlier steps.
pub(crate) enum BoxStep<R> {
    /// A value that is the same in all boxes.
    Known(R),
    /// Index into the ranges that come with the box.
    Input(usize),
    /// Coordinate of the point.
    Coordinate(usize),
    /// Length of a vector of two or three numbers. Its slope is bounded at zero, too.
    Length(Vec<usize>),
    /// First number times the square of the second, which is written as two products.
    TimesSquare([usize; 2]),
    /// Result of an operation of the table.
    Apply {
        op: Op,
        point: Option<[usize; 3]>,
        values: Vec<usize>,
        parameters: Vec<f32>,
    },
}

impl<R: BoxValue> BoxNumber<R> {
    /// Compiles a number. `uniform` returns the values of constants, parameters and the time.
    pub(crate) fn new(
        expressions: &Expressions,
        id: ExprId,
        uniform: &mut dyn FnMut(ExprId) -> UniformInput,
    ) -> Self {
        let order = postorder(expressions, id, |_| false);
        let step_index = |id: &ExprId| match order.binary_search(id) {
            Ok(index) | Err(index) => index,
        };
        let mut number = Self {
            steps: Vec::with_capacity(order.len()),
            values: Vec::with_capacity(order.len()),
            relative: Vec::with_capacity(order.len()),
            needs_relative: false,
            has_norms: false,
            held: None,
            is_uniform: Vec::with_capacity(order.len()),
        };
        for &id in &order {
            let step = match expressions.get(id) {
                Expression::Constant(_) | Expression::Param(..) | Expression::Time => {
                    match uniform(id) {
                        UniformInput::Known(range) => BoxStep::Known(R::from_range(range)),
                        UniformInput::Input(slot) => BoxStep::Input(slot),
                    }
                }
                Expression::Coordinate(axis) => BoxStep::Coordinate(usize::from(*axis)),
                Expression::NormalComponent(_) => {
                    BoxStep::Known(R::from_range(Interval { lo: -1.0, hi: 1.0 }))
                }
                Expression::Apply {
                    op: Op::Sqrt,
                    values,
                    ..
                } if let Some(vector) = squared_summands(expressions, values[0]) => {
                    BoxStep::Length(vector.iter().map(step_index).collect())
                }
                Expression::Apply {
                    op: Op::Mul,
                    values,
                    ..
                } if let Some(pair) = square_factor(expressions, values) => {
                    BoxStep::TimesSquare(pair.map(|id| step_index(&id)))
                }
                // The difference of a number and itself, where it is defined.
                Expression::Apply {
                    op: Op::Sub,
                    values,
                    ..
                } if values[0] == values[1] => BoxStep::Known(R::from_range(Interval::point(0.0))),
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    // The parameters of such operations (a noise's seed) are replaced by the midpoint
                    // of their range: no slope depends on them. They do not depend on the point.
                    let numbers: Vec<f64> = parameters
                        .iter()
                        .map(|id| {
                            number
                                .constant_range(step_index(id))
                                .unwrap_or(Interval::ALL)
                        })
                        .map(midpoint)
                        .collect();
                    BoxStep::Apply {
                        op: *op,
                        point: point.map(|point| point.map(|id| step_index(&id))),
                        values: values.iter().map(step_index).collect(),
                        parameters: pack_parameters(*op, &numbers),
                    }
                }
            };
            number
                .is_uniform
                .push(expressions.stage(id) <= Stage::Uniform);
            number.add(step);
        }
        number
    }

    /// Returns the same number with its discontinuities held; see [`held_branches`].
    pub(crate) fn with_held_branches(self, held: HeldBranches) -> Self {
        Self {
            held: Some(held),
            ..self
        }
    }

    /// Adds a step, or its result where that is the same in all boxes.
    fn add(&mut self, step: BoxStep<R>) {
        let is_known = |&index: &usize| self.constant_range(index).is_some();
        let is_same = match &step {
            BoxStep::Known(_) => true,
            BoxStep::Input(_) | BoxStep::Coordinate(_) => false,
            BoxStep::Length(values) => values.iter().all(is_known),
            BoxStep::TimesSquare(pair) => pair.iter().all(is_known),
            BoxStep::Apply { point, values, .. } => {
                point.iter().flatten().chain(values).all(is_known)
            }
        };
        match &step {
            BoxStep::Length(_) => self.has_norms = true,
            BoxStep::Apply { op, point, .. } if !is_same => {
                let uses_relative = matches!(
                    op,
                    Op::Exp | Op::Exp2 | Op::Ln | Op::Log2 | Op::Cosh | Op::Pow
                );
                // Only one of the compared operands contributes its gradient.
                let is_choice = matches!(op, Op::Min | Op::Max | Op::Clamp | Op::Smoothstep);
                self.needs_relative |= uses_relative;
                let has_rule =
                    matches!(op.row().facts.slope, SlopeRule::Constant(_)) && point.is_some();
                self.has_norms |= uses_relative || is_choice || has_rule;
            }
            _ => {}
        }
        let value = match is_same {
            true => step.value(&Bounds::ALL_SPACE, &[], &self.values),
            false => R::from_range(Interval::ALL),
        };
        self.values.push(value);
        self.relative.push(None);
        self.steps
            .push(if is_same { BoxStep::Known(value) } else { step });
    }

    /// Returns the result of a step, if it is the same in all boxes.
    fn constant_range(&self, index: usize) -> Option<Interval> {
        match &self.steps[index] {
            BoxStep::Known(value) => Some(value.range()),
            _ => None,
        }
    }

    /// Evaluates the number in a box, which may be infinite, with these ranges of other numbers.
    pub(crate) fn eval(&mut self, bounds: &Bounds, ranges: &[Interval]) -> R {
        let last = self.eval_all(bounds, ranges).last();
        last.copied()
            .unwrap_or_else(|| R::from_range(Interval::ALL))
    }

    /// Evaluates the number and all its operands in a box, in the order of their identifiers.
    pub(crate) fn eval_all(&mut self, bounds: &Bounds, ranges: &[Interval]) -> &[R] {
        self.values.clear();
        self.relative.clear();
        for (step, &is_uniform) in self.steps.iter().zip(&self.is_uniform) {
            let mut value = step.value(bounds, ranges, &self.values);
            if is_uniform {
                value = R::from_range(value.range());
            }
            if let Some(held) = self.held {
                value = value.hold_branches(step, &self.values, held);
            }
            let relative = match self.needs_relative {
                true => value.refined(step, &self.steps, &self.values, &self.relative),
                false => None,
            };
            self.values.push(value);
            self.relative.push(relative);
        }
        &self.values
    }

    /// Returns the cost of an evaluation, in sums and products; at least one.
    pub(crate) fn cost(&self) -> usize {
        let costs = self.steps.iter().map(|step| match step {
            BoxStep::Known(_) | BoxStep::Input(_) | BoxStep::Coordinate(_) => 0,
            BoxStep::Length(_) | BoxStep::TimesSquare(_) => 2,
            BoxStep::Apply { op, .. } => cost(*op),
        });
        costs.sum::<usize>().max(1)
    }
}

/// Returns the numbers whose squares a sum adds, at most three.
fn squared_summands(expressions: &Expressions, sum: ExprId) -> Option<Vec<ExprId>> {
    match expressions.get(sum) {
        Expression::Apply {
            op: Op::Square,
            values,
            ..
        } => Some(values.clone()),
        Expression::Apply {
            op: Op::Add,
            values,
            ..
        } => {
            let operand = |index: usize| squared_summands(expressions, values[index]);
            let summands = [operand(0)?, operand(1)?].concat();
            (summands.len() <= 3).then_some(summands)
        }
        _ => None,
    }
}

/// Returns the number and the factor of a product in which a factor occurs twice. Interval products may
/// change the sign of each product; a square may not, so that even powers are bounded below.
fn square_factor(expressions: &Expressions, factors: &[ExprId]) -> Option<[ExprId; 2]> {
    let &[a, b] = factors else { return None };
    let varies = |id: ExprId| expressions.stage(id) > Stage::Uniform;
    [(a, b), (b, a)].into_iter().find_map(|(product, factor)| {
        let Expression::Apply {
            op: Op::Mul,
            values,
            ..
        } = expressions.get(product)
        else {
            return None;
        };
        let index = values
            .iter()
            .position(|&value| value == factor && varies(value))?;
        Some([values[1 - index], factor])
    })
}

/// Returns the cost of an operation on ranges with gradients, in products of such ranges. The costs are
/// measured, with a margin for the slower code for infinite ranges.
fn cost(op: Op) -> usize {
    match op {
        Op::Gyroid | Op::Diamond | Op::Noise | Op::NoiseOctave | Op::RidgeOctave => 40,
        Op::SchwarzP => 20,
        Op::Pow | Op::Atan2 | Op::Asin | Op::Acos | Op::Sinh | Op::Cosh | Op::Tanh => 4,
        Op::Tan | Op::Atan | Op::Sin | Op::Cos | Op::Exp | Op::Exp2 | Op::Ln | Op::Log2 => 2,
        _ => 1,
    }
}

/// Returns the result of an operation that most fields consist of, without the dispatch over the table.
#[inline(always)]
fn frequent<R: BoxValue>(op: Op, values: &[usize], previous: &[R]) -> Option<R> {
    macro_rules! result_of {
        ($($op:ident($($index:literal),+)),+) => {
            match op {
                $(Op::$op => Some(operation_body!($op)($(previous[values[$index]]),+)),)+
                _ => None,
            }
        };
    }
    result_of!(
        Add(0, 1),
        Sub(0, 1),
        Mul(0, 1),
        Min(0, 1),
        Max(0, 1),
        Neg(0),
        Abs(0),
        Square(0)
    )
}

impl<R: BoxValue> BoxStep<R> {
    /// Returns the result in a box, from the results of earlier steps.
    fn value(&self, bounds: &Bounds, ranges: &[Interval], previous: &[R]) -> R {
        match self {
            Self::Known(value) => *value,
            Self::Input(slot) => R::from_range(ranges.get(*slot).copied().unwrap_or(Interval::ALL)),
            Self::Coordinate(axis) => {
                let (lo, hi) = (bounds.min[*axis], bounds.max[*axis]);
                R::coordinate(*axis, Interval { lo, hi })
            }
            Self::Length(values) => {
                let component = |component_index: usize| match values.get(component_index) {
                    Some(&index) => previous[index],
                    None => R::from_range(Interval::point(0.0)),
                };
                R::Vec3::new(component(0), component(1), component(2)).length()
            }
            Self::TimesSquare([number, factor]) => previous[*number] * previous[*factor].square(),
            Self::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                if let Some(value) = frequent(*op, values, previous) {
                    return value;
                }
                let everywhere = R::from_range(Interval::ALL);
                let [x, y, z] = point.map_or([everywhere; 3], |p| p.map(|index| previous[index]));
                let mut operands = [R::from_range(Interval::point(0.0)); 3];
                for (slot, &index) in operands.iter_mut().zip(values) {
                    *slot = previous[index];
                }
                match apply(*op, R::Vec3::new(x, y, z), operands, parameters) {
                    OpResult::Value(power) if *op == Op::Pow => {
                        let [base, exponent] = [operands[0], operands[1]].map(|it| it.range());
                        // Powers of zero are rounded up.
                        match base.lo <= 0.0 && exponent.lo > 0.0 {
                            true => power.with_zero(),
                            false => power,
                        }
                    }
                    OpResult::Value(value) => value,
                    OpResult::Point(_) => everywhere,
                }
            }
        }
    }
}
