//! A number of the point, evaluated over boxes of points: all values it may have there, and with dual
//! numbers all gradients. What it is computed from is looked up once, so that a search through thousands
//! of boxes does nothing but arithmetic.

mod blend;
mod held;
mod norm;
mod period;
mod relative;

pub(crate) use held::Held;
pub(crate) use period::Along;

use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::uniforms::operands_first;
use relative::Relative;
use sdfc_vm::apply::{Applied, Apply, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Vector3;
use sdfc_vm::row::Slope;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// What a number is over a box: its values, with or without their gradients.
pub(crate) trait OverBox: Apply {
    /// A number that is the same at all points, somewhere in a range.
    fn same(range: Interval) -> Self;
    /// A coordinate.
    fn coordinate(axis: usize, range: Interval) -> Self;
    /// All values.
    fn range(&self) -> Interval;
    /// Narrows the result of a step by the relative gradients of earlier ones, and returns its own.
    fn refined(
        &mut self,
        _step: &Step<Self>,
        _steps: &[Step<Self>],
        _before: &[Self],
        _relative: &[Option<Relative>],
    ) -> Option<Relative> {
        None
    }
    /// The result of a step with its jumps held; see [`held`].
    fn held(self, _step: &Step<Self>, _before: &[Self], _held: Held) -> Self {
        self
    }
}

impl OverBox for Interval {
    fn same(range: Interval) -> Self {
        range
    }
    fn coordinate(_: usize, range: Interval) -> Self {
        range
    }
    fn range(&self) -> Interval {
        *self
    }
}

/// At the middle of the box, and of the range of each number that has one.
impl OverBox for Dual<f64> {
    fn same(range: Interval) -> Self {
        Self::fixed(middle(range))
    }
    fn coordinate(axis: usize, range: Interval) -> Self {
        let along = |other: usize| if other == axis { 1.0 } else { 0.0 };
        Self {
            value: middle(range),
            gradient: V3::of(along(0), along(1), along(2)),
        }
    }
    fn range(&self) -> Interval {
        Interval::point(self.value)
    }
}

/// The number in the middle of a range, which may be endless.
fn middle(range: Interval) -> f64 {
    if range.lo == range.hi {
        return range.lo;
    }
    let end = |v: f64| v.clamp(-f64::MAX, f64::MAX);
    end(range.lo) / 2.0 + end(range.hi) / 2.0
}

impl OverBox for Dual<Interval> {
    fn same(range: Interval) -> Self {
        Self::fixed(range)
    }
    fn coordinate(axis: usize, range: Interval) -> Self {
        let along = |other: usize| Interval::point(if other == axis { 1.0 } else { 0.0 });
        Self {
            value: range,
            gradient: V3::of(along(0), along(1), along(2)),
        }
    }
    fn range(&self) -> Interval {
        self.value
    }
    fn refined(
        &mut self,
        step: &Step<Self>,
        steps: &[Step<Self>],
        before: &[Self],
        relative: &[Option<Relative>],
    ) -> Option<Relative> {
        relative::refine(self, step, steps, before, relative)
    }
    fn held(self, step: &Step<Self>, before: &[Self], held: Held) -> Self {
        held::held(step, before, self, held)
    }
}

/// What a number that depends on no point is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum UniformValue {
    /// It is in a range, the same in all boxes.
    Known(Interval),
    /// Its range is one of those that come with a box.
    Ranged(usize),
}

/// A number with all that it is computed from, operands first.
pub(crate) struct BoxNumber<R> {
    steps: Vec<Step<R>>,
    /// What the steps gave in the last box.
    values: Vec<R>,
    /// The relative gradients of those that are positive in it.
    relative: Vec<Option<Relative>>,
    /// Set where relative gradients are computed: there is an exponential or a logarithm.
    relates: bool,
    /// Set where the length of a gradient is bounded more closely than by its components.
    has_norms: bool,
    /// Set where jumps are held.
    held: Option<Held>,
}

/// How one of the numbers is found; operands are places of earlier steps.
pub(crate) enum Step<R> {
    /// It is the same in all boxes.
    Known(R),
    /// It is one of the ranges that come with the box.
    Ranged(usize),
    /// It is a coordinate of the point.
    Coordinate(usize),
    /// It is the length of a vector of two or three numbers, whose slope is bounded at zero, too.
    Length(Vec<usize>),
    /// It is the first number times the square of the second, which is written as two products.
    TimesSquare([usize; 2]),
    /// It is what a row gives.
    Apply {
        op: Op,
        point: Option<[usize; 3]>,
        values: Vec<usize>,
        parameters: Vec<f32>,
    },
}

impl<R: OverBox> BoxNumber<R> {
    /// `uniform` gives the values of constants, parameters and the time.
    pub(crate) fn new(
        expressions: &Expressions,
        id: ExprId,
        uniform: &mut dyn FnMut(ExprId) -> UniformValue,
    ) -> Self {
        let order = operands_first(expressions, id, |_| false);
        let place = |id: &ExprId| match order.binary_search(id) {
            Ok(at) | Err(at) => at,
        };
        let mut field = Self {
            steps: Vec::with_capacity(order.len()),
            values: Vec::with_capacity(order.len()),
            relative: Vec::with_capacity(order.len()),
            relates: false,
            has_norms: false,
            held: None,
        };
        for &id in &order {
            let step = match expressions.get(id) {
                Expression::Constant(_) | Expression::Param(..) | Expression::Time => {
                    match uniform(id) {
                        UniformValue::Known(range) => Step::Known(R::same(range)),
                        UniformValue::Ranged(slot) => Step::Ranged(slot),
                    }
                }
                Expression::Coordinate(axis) => Step::Coordinate(usize::from(*axis)),
                Expression::NormalComponent(_) => {
                    Step::Known(R::same(Interval { lo: -1.0, hi: 1.0 }))
                }
                Expression::Apply {
                    op: Op::Sqrt,
                    values,
                    ..
                } if let Some(vector) = squared(expressions, values[0]) => {
                    Step::Length(vector.iter().map(place).collect())
                }
                Expression::Apply {
                    op: Op::Mul,
                    values,
                    ..
                } if let Some(pair) = times_square(expressions, values) => {
                    Step::TimesSquare(pair.map(|id| place(&id)))
                }
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    // Parameters of such rows (a noise's seed) are taken at the middle of their
                    // range: no row's slope depends on them. They do not depend on the point.
                    let numbers: Vec<f64> = parameters
                        .iter()
                        .map(|id| field.known(place(id)).unwrap_or(Interval::ALL))
                        .map(middle)
                        .collect();
                    Step::Apply {
                        op: *op,
                        point: point.map(|point| point.map(|id| place(&id))),
                        values: values.iter().map(place).collect(),
                        parameters: laid_out(*op, &numbers),
                    }
                }
            };
            field.add(step);
        }
        field
    }

    /// The same number with its jumps held; see [`held`].
    pub(crate) fn holding(self, held: Held) -> Self {
        Self {
            held: Some(held),
            ..self
        }
    }

    /// Adds a step, or what it gives where that is the same in all boxes.
    fn add(&mut self, step: Step<R>) {
        let value = step.value(&Bounds::EVERYTHING, &[], &self.values);
        let known = |&at: &usize| self.known(at).is_some();
        let same = match &step {
            Step::Known(_) => true,
            Step::Ranged(_) | Step::Coordinate(_) => false,
            Step::Length(values) => values.iter().all(known),
            Step::TimesSquare(pair) => pair.iter().all(known),
            Step::Apply { point, values, .. } => point.iter().flatten().chain(values).all(known),
        };
        match &step {
            Step::Length(_) => self.has_norms = true,
            Step::Apply { op, point, .. } if !same => {
                let relates = matches!(
                    op,
                    Op::Exp | Op::Exp2 | Op::Ln | Op::Log2 | Op::Cosh | Op::Pow
                );
                // Of the gradients of what is compared, one counts.
                let chooses = matches!(op, Op::Min | Op::Max | Op::Clamp | Op::Smoothstep);
                self.relates |= relates;
                let has_rule = matches!(op.row().meta.slope, Slope::Constant(_)) && point.is_some();
                self.has_norms |= relates || chooses || has_rule;
            }
            _ => {}
        }
        self.values.push(value);
        self.relative.push(None);
        self.steps
            .push(if same { Step::Known(value) } else { step });
    }

    /// The number at a place, if it is the same in all boxes.
    fn known(&self, at: usize) -> Option<Interval> {
        match &self.steps[at] {
            Step::Known(value) => Some(value.range()),
            _ => None,
        }
    }

    /// What it is in a box, which may be endless, and with these ranges of other numbers.
    pub(crate) fn over(&mut self, bounds: &Bounds, ranges: &[Interval]) -> R {
        self.values.clear();
        self.relative.clear();
        for step in &self.steps {
            let mut value = step.value(bounds, ranges, &self.values);
            if let Some(held) = self.held {
                value = value.held(step, &self.values, held);
            }
            let relative = match self.relates {
                true => value.refined(step, &self.steps, &self.values, &self.relative),
                false => None,
            };
            self.values.push(value);
            self.relative.push(relative);
        }
        let last = self.values.last();
        last.copied().unwrap_or_else(|| R::same(Interval::ALL))
    }

    /// What an evaluation costs, in sums and products; at least one.
    pub(crate) fn cost(&self) -> usize {
        let costs = self.steps.iter().map(|step| match step {
            Step::Known(_) | Step::Ranged(_) | Step::Coordinate(_) => 0,
            Step::Length(_) | Step::TimesSquare(_) => 2,
            Step::Apply { op, .. } => cost(*op),
        });
        costs.sum::<usize>().max(1)
    }
}

/// The numbers whose squares are summed, at most three.
fn squared(expressions: &Expressions, sum: ExprId) -> Option<Vec<ExprId>> {
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
            let of = |at: usize| squared(expressions, values[at]);
            let all = [of(0)?, of(1)?].concat();
            (all.len() <= 3).then_some(all)
        }
        _ => None,
    }
}

/// The number and the factor of a product in which a factor occurs twice. By itself each product of ranges may
/// change its sign; a square may not, so that even powers are bounded below.
fn times_square(expressions: &Expressions, factors: &[ExprId]) -> Option<[ExprId; 2]> {
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
        let at = values
            .iter()
            .position(|&value| value == factor && varies(value))?;
        Some([values[1 - at], factor])
    })
}

/// How many products of ranges with their gradients take as long as an operation on them: measured, and
/// with room for what is slower where a range is endless.
fn cost(op: Op) -> usize {
    match op {
        Op::Gyroid | Op::Diamond | Op::Noise | Op::NoiseOctave | Op::RidgeOctave => 40,
        Op::SchwarzP => 20,
        Op::Pow | Op::Atan2 | Op::Asin | Op::Acos | Op::Sinh | Op::Cosh | Op::Tanh => 4,
        Op::Tan | Op::Atan | Op::Sin | Op::Cos | Op::Exp | Op::Exp2 | Op::Ln | Op::Log2 => 2,
        _ => 1,
    }
}

impl<R: OverBox> Step<R> {
    /// What it gives in a box, from what the steps before it gave.
    fn value(&self, bounds: &Bounds, ranges: &[Interval], before: &[R]) -> R {
        match self {
            Self::Known(value) => *value,
            Self::Ranged(slot) => R::same(ranges.get(*slot).copied().unwrap_or(Interval::ALL)),
            Self::Coordinate(axis) => {
                let (lo, hi) = (bounds.min[*axis], bounds.max[*axis]);
                R::coordinate(*axis, Interval { lo, hi })
            }
            Self::Length(values) => {
                let component = |at: usize| match values.get(at) {
                    Some(&place) => before[place],
                    None => R::same(Interval::point(0.0)),
                };
                R::Vec3::new(component(0), component(1), component(2)).length()
            }
            Self::TimesSquare([number, factor]) => before[*number] * before[*factor].square(),
            Self::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let everywhere = R::same(Interval::ALL);
                let [x, y, z] = point.map_or([everywhere; 3], |p| p.map(|place| before[place]));
                let mut operands = [R::same(Interval::point(0.0)); 3];
                for (slot, &place) in operands.iter_mut().zip(values) {
                    *slot = before[place];
                }
                match apply(*op, R::Vec3::new(x, y, z), operands, parameters) {
                    Applied::Value(value) => value,
                    Applied::Point(_) => everywhere,
                }
            }
        }
    }
}
