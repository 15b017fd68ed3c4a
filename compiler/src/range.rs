//! All values that a number of a point may have in a box, by interval arithmetic.
//!
//! One evaluation knows nothing of operands that go together: x · x over [−3, 3] is [−9, 9] to it, and
//! exp(−60 x · x) reaches e⁵⁴⁰. So the box is halved where the bounds are farthest from values that
//! were found, until they are at most three times as wide as these; bounds that are so from the beginning
//! are left as they are.

use crate::boxes::{BoxNumber, UniformValue};
use crate::expression::{ExprId, Expressions};
use crate::slope::Ranges;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

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
    let mut number = BoxNumber::<Interval>::new(graph, id, &mut |id| {
        UniformValue::Known(Interval::point(value(id)))
    });
    let mut pieces = vec![(*region, number.over(region, &[]))];
    let mut found = found_in(&mut number, region);
    // A half is evaluated at its ends, too.
    let affordable = OPERATIONS / (16 * number.cost());
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
            found = found.hull(found_in(&mut number, &half));
            pieces.push((half, number.over(&half, &[])));
        }
    }
    let ranges = pieces.into_iter().map(|(_, range)| range);
    ranges.reduce(Interval::hull).unwrap_or(Interval::ALL)
}

/// Bounds on a number while its point is in a box, for all values of the parameters, by one evaluation.
pub(crate) fn range_over(
    graph: &Expressions,
    id: ExprId,
    region: &Bounds,
    ranges: &Ranges,
) -> Interval {
    let mut number = BoxNumber::<Interval>::new(graph, id, &mut |id| {
        UniformValue::Known(ranges.of_leaf(graph, id))
    });
    number.over(region, &[])
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

/// Values that a number has in a box: at its middle, and at its ends along each axis that has some.
fn found_in(number: &mut BoxNumber<Interval>, region: &Bounds) -> Interval {
    let mut at = |point: [f64; 3]| {
        let point = Bounds {
            min: point,
            max: point,
        };
        number.over(&point, &[])
    };
    let finite = |v: f64| if v.is_finite() { v } else { 0.0 };
    let middle: [f64; 3] =
        std::array::from_fn(|axis| finite(region.min[axis]) / 2.0 + finite(region.max[axis]) / 2.0);
    let mut found = at(middle);
    for axis in 0..3 {
        for end in [region.min[axis], region.max[axis]] {
            if end.is_finite() {
                let mut point = middle;
                point[axis] = end;
                found = found.hull(at(point));
            }
        }
    }
    found
}
