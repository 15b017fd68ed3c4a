//! Range of a number of a point in a box, by interval arithmetic.
//!
//! One evaluation ignores dependencies between operands: x · x over [−3, 3] becomes [−9, 9], and
//! exp(−60 x · x) extends to e⁵⁴⁰. So the box is halved where the bounds exceed the sampled values by
//! the most. It stops once the bounds are at most three times as wide as the sampled range. Bounds that
//! fulfil this at once are not refined.

use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

/// Maximum number of bisections.
const MAX_BISECTIONS: usize = 64;
const MAX_OPERATIONS: usize = 200_000;

/// Returns bounds on a number while its point is in a box, which may be infinite. `value` returns
/// uniform numbers.
pub fn range(
    expressions: &Expressions,
    id: ExprId,
    region: &Bounds,
    value: &mut dyn FnMut(ExprId) -> f64,
) -> Interval {
    let mut number = BoxNumber::<Interval>::new(expressions, id, &mut |id| {
        UniformInput::Known(Interval::point(value(id)))
    });
    let mut sub_boxes = vec![(*region, number.eval(region, &[]))];
    let mut sampled = sampled_range(&mut number, region);
    // A half is also evaluated at its faces.
    let affordable = MAX_OPERATIONS / (16 * number.cost());
    for _ in 0..affordable.min(MAX_BISECTIONS) {
        let above = |bounds: &Interval| bounds.hi - sampled.hi;
        let below = |bounds: &Interval| sampled.lo - bounds.lo;
        let excess = |bounds: &Interval| above(bounds).max(below(bounds));
        let worst = (0..sub_boxes.len()).max_by(|&a, &b| {
            let [a, b] = [a, b].map(|piece| excess(&sub_boxes[piece].1));
            a.total_cmp(&b)
        });
        let Some(worst) = worst else { break };
        // NaN is no reason to continue.
        let is_loose = excess(&sub_boxes[worst].1) > sampled.hi - sampled.lo;
        let Some(halves) = is_loose.then(|| halves(&sub_boxes[worst].0)).flatten() else {
            break;
        };
        sub_boxes.swap_remove(worst);
        for half in halves {
            sampled = sampled.hull(sampled_range(&mut number, &half));
            sub_boxes.push((half, number.eval(&half, &[])));
        }
    }
    let ranges = sub_boxes.into_iter().map(|(_, range)| range);
    ranges.reduce(Interval::hull).unwrap_or(Interval::ALL)
}

/// Returns bounds on a number while its point is in a box, for all values of the parameters, by one
/// evaluation.
pub(crate) fn range_over(
    expressions: &Expressions,
    id: ExprId,
    region: &Bounds,
    ranges: &ParamRanges,
) -> Interval {
    let mut number = BoxNumber::<Interval>::new(expressions, id, &mut |id| {
        UniformInput::Known(ranges.leaf(expressions, id))
    });
    number.eval(region, &[])
}

/// Returns the two halves of a box across its longest finite side; `None` for a point.
fn halves(region: &Bounds) -> Option<[Bounds; 2]> {
    let size = |axis: &usize| region.max[*axis] - region.min[*axis];
    let sides = (0..3).filter(|axis| size(axis).is_finite() && size(axis) > 0.0);
    let axis = sides.max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let (mut low, mut high) = (*region, *region);
    let midpoint = region.centre()[axis];
    low.max[axis] = midpoint;
    high.min[axis] = midpoint;
    Some([low, high])
}

/// Returns the range of samples of a number in a box: at its centre, and at its finite faces.
fn sampled_range(number: &mut BoxNumber<Interval>, region: &Bounds) -> Interval {
    let mut value_at = |point: [f64; 3]| {
        let point = Bounds {
            min: point,
            max: point,
        };
        number.eval(&point, &[])
    };
    let finite = |v: f64| if v.is_finite() { v } else { 0.0 };
    let centre: [f64; 3] =
        std::array::from_fn(|axis| finite(region.min[axis]) / 2.0 + finite(region.max[axis]) / 2.0);
    let mut sampled = value_at(centre);
    for axis in 0..3 {
        for end in [region.min[axis], region.max[axis]] {
            if end.is_finite() {
                let mut point = centre;
                point[axis] = end;
                sampled = sampled.hull(value_at(point));
            }
        }
    }
    sampled
}
