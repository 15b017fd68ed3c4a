//! All values that a number of a point may have in a box, by interval arithmetic.
//!
//! One evaluation knows nothing of operands that go together: x · x over [−3, 3] is [−9, 9] to it, and
//! exp(−60 x · x) reaches e⁵⁴⁰. So the box is halved where the bounds are farthest from values that
//! were found, until they are at most three times as wide as these; bounds that are so from the beginning
//! are left as they are.

use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::vector::V3;
use std::collections::{BTreeSet, HashMap};

/// How often the box is halved at most, and how many operations that may take.
const HALVINGS: usize = 64;
const OPERATIONS: usize = 200_000;

/// Bounds on a number while its point is in a box, which may be endless; `value` gives numbers that
/// depend on no point.
pub fn range(
    graph: &Expressions,
    id: ExprId,
    region: &Bounds,
    value: &mut dyn FnMut(ExprId) -> f64,
) -> Interval {
    let mut number = Number::new(graph, id, value);
    let mut pieces = vec![(*region, number.over(region))];
    let mut found = number.found_in(region);
    // A half is evaluated at its ends, too.
    let affordable = OPERATIONS / (16 * number.order.len().max(1));
    for _ in 0..affordable.min(HALVINGS) {
        let above = |of: &Interval| of.hi - found.hi;
        let below = |of: &Interval| found.lo - of.lo;
        let beyond = |of: &Interval| above(of).max(below(of));
        let worst = (0..pieces.len()).max_by(|&a, &b| {
            let [a, b] = [a, b].map(|piece| beyond(&pieces[piece].1));
            a.total_cmp(&b)
        });
        let Some(worst) = worst else { break };
        // What is not a number is no reason to go on.
        let far = beyond(&pieces[worst].1) > found.hi - found.lo;
        let Some(halves) = far.then(|| halves(&pieces[worst].0)).flatten() else {
            break;
        };
        pieces.swap_remove(worst);
        for half in halves {
            found = found.hull(number.found_in(&half));
            pieces.push((half, number.over(&half)));
        }
    }
    let ranges = pieces.into_iter().map(|(_, range)| range);
    ranges.reduce(Interval::hull).unwrap_or(Interval::ALL)
}

/// Both halves of a box, across its longest side that has an end; nothing of a point.
fn halves(region: &Bounds) -> Option<[Bounds; 2]> {
    let size = |axis: &usize| region.max[*axis] - region.min[*axis];
    let sides = (0..3).filter(|axis| size(axis).is_finite() && size(axis) > 0.0);
    let axis = sides.max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let (mut low, mut high) = (*region, *region);
    let middle = region.centre()[axis];
    low.max[axis] = middle;
    high.min[axis] = middle;
    Some([low, high])
}

/// A number with all that it is computed from.
struct Number<'a> {
    graph: &'a Expressions,
    /// Operands come before what uses them.
    order: BTreeSet<ExprId>,
    value: &'a mut dyn FnMut(ExprId) -> f64,
}

impl<'a> Number<'a> {
    fn new(graph: &'a Expressions, id: ExprId, value: &'a mut dyn FnMut(ExprId) -> f64) -> Self {
        let mut order = BTreeSet::new();
        let mut pending = vec![id];
        while let Some(id) = pending.pop() {
            if order.insert(id)
                && let Expression::Apply { point, values, .. } = graph.get(id)
            {
                pending.extend(point.iter().flatten().chain(values));
            }
        }
        Self {
            graph,
            order,
            value,
        }
    }

    /// Values that it has in a box: at its middle, and at its ends along each axis that has some.
    fn found_in(&mut self, region: &Bounds) -> Interval {
        let finite = |v: f64| if v.is_finite() { v } else { 0.0 };
        let middle: [f64; 3] = std::array::from_fn(|axis| {
            finite(region.min[axis]) / 2.0 + finite(region.max[axis]) / 2.0
        });
        let mut found = self.at(middle);
        for axis in 0..3 {
            for end in [region.min[axis], region.max[axis]] {
                if end.is_finite() {
                    let mut point = middle;
                    point[axis] = end;
                    found = found.hull(self.at(point));
                }
            }
        }
        found
    }

    fn at(&mut self, point: [f64; 3]) -> Interval {
        self.over(&Bounds {
            min: point,
            max: point,
        })
    }

    /// What one evaluation says of a box.
    fn over(&mut self, region: &Bounds) -> Interval {
        let mut known: HashMap<ExprId, Interval> = HashMap::with_capacity(self.order.len());
        let mut last = Interval::ALL;
        for &id in &self.order {
            last = match self.graph.get(id) {
                Expression::Constant(_) | Expression::Param(..) | Expression::Time => {
                    Interval::point((self.value)(id))
                }
                Expression::Coordinate(axis) => {
                    let axis = usize::from(*axis);
                    Interval {
                        lo: region.min[axis],
                        hi: region.max[axis],
                    }
                }
                Expression::NormalComponent(_) => Interval { lo: -1.0, hi: 1.0 },
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    let get = |id: &ExprId| known.get(id).copied().unwrap_or(Interval::ALL);
                    let p = point.map_or([Interval::ALL; 3], |p| [0, 1, 2].map(|i| get(&p[i])));
                    let mut operands = [Interval::point(0.0); 3];
                    for (slot, id) in operands.iter_mut().zip(values) {
                        *slot = get(id);
                    }
                    let parameters: Vec<f64> =
                        parameters.iter().map(|&id| (self.value)(id)).collect();
                    let [x, y, z] = p;
                    match apply(*op, V3::of(x, y, z), operands, &laid_out(*op, &parameters)) {
                        Applied::Value(range) => range,
                        Applied::Point(_) => Interval::ALL,
                    }
                }
            };
            known.insert(id, last);
        }
        last
    }
}
