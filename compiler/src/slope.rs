//! How steep a raw field can be: a bound on the length of its gradient over a region, by interval
//! arithmetic on dual numbers.
//!
//! The region is halved, always where the bound is worst, until the bound is within a tenth of a
//! slope that was found at a point, or the budget is spent, or a point is found where the field is too
//! steep to be marched on. A bound that is given holds everywhere in the region and for all values of the
//! parameters. The budget is the scene's, so that a thousand
//! fields take no thousand times as long as one: where it is spent, bounds are less tight.

use crate::bounds::World;
use crate::boxes::{Field, OverBox};
use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use std::collections::BinaryHeap;

/// How many operations are spent on all of a scene before bounds are left as they are; none gets more
/// than half of what is left.
pub const MAX_OPERATIONS: usize = 1_200_000;
/// How many boxes are looked at most for a bound.
pub const MAX_BOXES: usize = 3_000;

/// A field that is as steep as this is no field to march on, and is said to have no bound.
pub const STEEPEST: f64 = 1e6;

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
        self.field::<Interval>(expressions, id)
            .over(&Bounds::EVERYTHING)
    }

    /// A number, ready to be evaluated over boxes.
    fn field<R: OverBox>(&self, expressions: &Expressions, id: ExprId) -> Field<R> {
        Field::new(expressions, id, &mut |id| match expressions.get(id) {
            Expression::Constant(v) => Interval::point(*v),
            Expression::Param(param, _) => self.params[param.0 as usize],
            Expression::Time => self.time,
            _ => Interval::ALL,
        })
    }
}

/// The gradients, with respect to the local point, of one or of several numbers together (the rows
/// of a Jacobian), bounded: the Frobenius norm, which is never less than the map's stretch. `None` where
/// it is not less than [`STEEPEST`].
pub(crate) fn bound(
    expressions: &Expressions,
    numbers: &[ExprId],
    region: &Bounds,
    ranges: &Ranges,
    budget: &mut Budget,
) -> Option<f64> {
    let mut fields: Vec<Field<Dual<Interval>>> = numbers
        .iter()
        .map(|&id| ranges.field(expressions, id))
        .collect();
    let size: usize = fields.iter().map(Field::cost).sum();
    let size = size.max(1);
    let mut squares = |bounds: &Bounds| {
        let (mut upper, mut lower) = (0.0_f64, 0.0_f64);
        for field in &mut fields {
            let gradient = field.over(bounds).gradient;
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
    let start = std::time::Instant::now(); let mut n = 0; let b0 = budget.0;
    for _ in 0..(budget.0 / 2 / size).min(MAX_BOXES) {
        let Some(worst) = queue.pop() else { break };
        let hopeless = best >= STEEPEST * STEEPEST;
        if worst.upper <= best * 1.21 || hopeless || !region.is_finite() {
            queue.push(worst);
            break;
        }
        budget.0 -= size; n += 1;
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
    let bound = queue.peek().map_or(0.0, |worst| worst.upper.sqrt());
    if std::env::var("SLOPES").is_ok() { eprintln!("SLOPE boxes {n} size {size} spent {} took {:?} bound {bound:.4} best {:.4} ratio {:.3}", b0 - budget.0, start.elapsed(), best.sqrt(), bound / best.sqrt()); }
    (bound < STEEPEST).then_some(bound)
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
