//! How steep a raw field can be: a bound on the length of its gradient over a region, by interval
//! arithmetic on dual numbers.
//!
//! The region is halved, always where the bound is worst, until the bound is within a tenth of a
//! slope that was found at a point, or the budget is spent; either way the bound holds everywhere
//! in the region and for all values of the parameters. The budget is the scene's, so that a thousand
//! fields take no thousand times as long as one: where it is spent, bounds are less tight.

use crate::bounds::World;
use crate::expression::{ExprId, Expression, Expressions};
use crate::uniforms::operands_first;
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::BinaryHeap;

type DualInterval = Dual<Interval>;

/// How many operations are spent on all of a scene before bounds are left as they are; none gets more
/// than half of what is left.
pub const MAX_OPERATIONS: usize = 1_200_000;
/// How many boxes are looked at most for a bound.
pub const MAX_BOXES: usize = 3_000;

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
    params: Vec<Interval>,
    time: Interval,
}

impl Ranges {
    /// The ranges that the scene declares; a parameter without one is taken at its value.
    pub(crate) fn of(world: World<'_>) -> Self {
        let params = world
            .params
            .iter()
            .map(|param| match param.range {
                Some((lo, hi)) => Interval::between(lo, hi),
                None => param
                    .value
                    .iter()
                    .map(|&v| Interval::point(v))
                    .reduce(Interval::hull)
                    .unwrap_or(Interval::point(0.0)),
            })
            .collect();
        let time = match world.animation {
            Some(animation) => Interval::between(0.0, animation.duration),
            None => Interval::ALL,
        };
        Self { params, time }
    }

    /// The range of a uniform number.
    pub fn of_number(&self, expressions: &Expressions, id: ExprId) -> Interval {
        let everywhere = Bounds {
            min: [0.0; 3],
            max: [0.0; 3],
        };
        Field::new(expressions, id, self).at(&everywhere).value
    }
}

/// A number of point stage, ready to be evaluated over boxes: what it is computed from, operands first.
struct Field {
    steps: Vec<Step>,
    /// What the steps gave in the last box.
    values: Vec<DualInterval>,
}

/// How one of the numbers that a field is computed from is found; operands are places of earlier steps.
enum Step {
    /// It is the same in all boxes.
    Known(DualInterval),
    /// It is a coordinate of the point.
    Coordinate(usize),
    /// It is what a row gives.
    Apply {
        op: Op,
        point: Option<[usize; 3]>,
        values: Vec<usize>,
        parameters: Vec<f32>,
    },
}

impl Field {
    fn new(expressions: &Expressions, id: ExprId, ranges: &Ranges) -> Self {
        let order = operands_first(expressions, id, |_| false);
        let place = |id: &ExprId| match order.binary_search(id) {
            Ok(at) | Err(at) => at,
        };
        let mut field = Self {
            steps: Vec::with_capacity(order.len()),
            values: Vec::with_capacity(order.len()),
        };
        for &id in &order {
            let step = match expressions.get(id) {
                Expression::Constant(v) => Step::Known(Dual::fixed(Interval::point(*v))),
                Expression::Param(param, _) => {
                    Step::Known(Dual::fixed(ranges.params[param.0 as usize]))
                }
                Expression::Time => Step::Known(Dual::fixed(ranges.time)),
                Expression::Coordinate(i) => Step::Coordinate(usize::from(*i)),
                Expression::NormalComponent(_) => {
                    Step::Known(Dual::fixed(Interval { lo: -1.0, hi: 1.0 }))
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
                        .map(|v| {
                            if v.lo == v.hi {
                                v.lo
                            } else {
                                (v.lo + v.hi) / 2.0
                            }
                        })
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

    /// Adds a step, or what it gives where that is the same in all boxes.
    fn add(&mut self, step: Step) {
        let everywhere = DualVec3::fixed(V3::of(Interval::ALL, Interval::ALL, Interval::ALL));
        let value = step.value(&everywhere, &self.values);
        let known = |&at: &usize| self.known(at).is_some();
        let same = match &step {
            Step::Known(_) => true,
            Step::Coordinate(_) => false,
            Step::Apply { point, values, .. } => point.iter().flatten().chain(values).all(known),
        };
        self.values.push(value);
        self.steps
            .push(if same { Step::Known(value) } else { step });
    }

    /// The number at a place, if it is the same in all boxes.
    fn known(&self, at: usize) -> Option<Interval> {
        match self.steps[at] {
            Step::Known(value) => Some(value.value),
            _ => None,
        }
    }

    fn at(&mut self, bounds: &Bounds) -> DualInterval {
        let axis = |i: usize| Interval {
            lo: bounds.min[i],
            hi: bounds.max[i],
        };
        let point = DualVec3::seed(V3::of(axis(0), axis(1), axis(2)));
        self.values.clear();
        for step in &self.steps {
            let value = step.value(&point, &self.values);
            self.values.push(value);
        }
        self.values.last().copied().unwrap_or(Dual::constant(0.0))
    }
}

impl Step {
    /// What it gives at a point, from what the steps before it gave.
    fn value(&self, at: &DualVec3<Interval>, before: &[DualInterval]) -> DualInterval {
        match self {
            Self::Known(value) => *value,
            Self::Coordinate(i) => Dual {
                value: [at.value.x, at.value.y, at.value.z][*i],
                gradient: at.gradients[*i],
            },
            Self::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let p = match point.map(|point| point.map(|place| before[place])) {
                    Some([x, y, z]) => DualVec3 {
                        value: V3::of(x.value, y.value, z.value),
                        gradients: [x.gradient, y.gradient, z.gradient],
                    },
                    None => DualVec3::fixed(V3::of(Interval::ALL, Interval::ALL, Interval::ALL)),
                };
                let mut operands = [Dual::constant(0.0); 3];
                for (slot, &place) in operands.iter_mut().zip(values) {
                    *slot = before[place];
                }
                match apply(*op, p, operands, parameters) {
                    Applied::Value(v) => v,
                    Applied::Point(_) => Dual::fixed(Interval::ALL),
                }
            }
        }
    }
}

/// The gradients, with respect to the local point, of one or of several numbers together (the rows
/// of a Jacobian), bounded: the Frobenius norm, which is never less than the map's stretch.
pub(crate) fn bound(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &Ranges,
    budget: &mut Budget,
) -> f64 {
    let mut fields: Vec<Field> = numbers
        .iter()
        .map(|&id| Field::new(expressions, id, ranges))
        .collect();
    let size: usize = fields.iter().map(|field| field.steps.len()).sum();
    let size = size.max(1);
    let mut squares = |bounds: &Bounds| {
        let (mut upper, mut lower) = (0.0_f64, 0.0_f64);
        for field in &mut fields {
            let gradient = field.at(bounds).gradient;
            for component in [gradient.x, gradient.y, gradient.z] {
                upper += component.magnitude().powi(2);
                lower += component.abs().lo.powi(2);
            }
        }
        (upper, lower)
    };
    let mut queue = BinaryHeap::new();
    let mut found = 0.0_f64;
    let mut push = |queue: &mut BinaryHeap<Piece>, bounds: Bounds| {
        let (upper, lower) = squares(&bounds);
        let centre = bounds.centre();
        let (at_centre, _) = squares(&Bounds {
            min: centre,
            max: centre,
        });
        found = found.max(lower).max(at_centre);
        queue.push(Piece { upper, bounds });
        found
    };
    let mut best = push(&mut queue, *region);
    for _ in 0..(budget.0 / 2 / size).min(MAX_BOXES) {
        let Some(worst) = queue.pop() else { break };
        if worst.upper <= best * 1.21 || !region.is_finite() {
            queue.push(worst);
            break;
        }
        budget.0 -= size;
        let sizes: [f64; 3] = std::array::from_fn(|i| worst.bounds.max[i] - worst.bounds.min[i]);
        let axis = (0..3)
            .max_by(|&a, &b| sizes[a].total_cmp(&sizes[b]))
            .unwrap_or(0);
        let middle = worst.bounds.centre()[axis];
        let (mut low, mut high) = (worst.bounds, worst.bounds);
        low.max[axis] = middle;
        high.min[axis] = middle;
        best = push(&mut queue, low).max(push(&mut queue, high));
    }
    queue.peek().map_or(0.0, |worst| worst.upper.sqrt())
}

/// A box and the bound over it; the worst is looked at first.
struct Piece {
    upper: f64,
    bounds: Bounds,
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
impl Ord for Piece {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.upper.total_cmp(&other.upper)
    }
}
