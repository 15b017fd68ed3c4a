//! Preimages of boxes under the maps that a scene writes.

use crate::analysis::box_eval::{AxisDependence, BoxNumber, UniformInput};
use crate::analysis::contraction::{Contraction, NumberLimit};
use crate::analysis::extent::{MAX_OPERATIONS, search_extent};
use crate::expression::{ExprId, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

/// Returns a box outside of which a map of the point to three numbers leads out of `image`.
pub(crate) fn extent_of_preimage(
    expressions: &Expressions,
    map: [ExprId; 3],
    image: &Bounds,
    uniform: &mut dyn FnMut(ExprId) -> Interval,
) -> Bounds {
    if image.is_empty() {
        return Bounds::EMPTY;
    }
    let limits: [NumberLimit; 3] = std::array::from_fn(|axis| NumberLimit {
        number: map[axis],
        range: Interval {
            lo: image.min[axis],
            hi: image.max[axis],
        },
    });
    let mut numbers = map.map(|id| {
        BoxNumber::<Interval>::new(expressions, id, &mut |id| UniformInput::Known(uniform(id)))
    });
    let unused = std::array::from_fn(|axis| {
        numbers
            .iter()
            .all(|number| number.axis_dependence()[axis] == AxisDependence::Independent)
    });
    let cost: usize = numbers.iter().map(BoxNumber::cost).sum();
    let over = &mut |bounds: &Bounds| {
        let (mut is_outside, mut is_within) = (false, true);
        for (number, limit) in numbers.iter_mut().zip(&limits) {
            let range = number.eval(bounds, &[]);
            is_outside |= range.hi < limit.range.lo || range.lo > limit.range.hi;
            is_within &= range.lo >= limit.range.lo && range.hi <= limit.range.hi;
        }
        Interval {
            lo: if is_outside { 1.0 } else { -1.0 },
            hi: if is_within { -1.0 } else { 1.0 },
        }
    };
    search_extent(unused, MAX_OPERATIONS / cost, over, &mut |bounds| {
        Contraction::new(expressions, &map, uniform).contracted(&limits, bounds)
    })
}
