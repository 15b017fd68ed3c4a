//! How far from the origin a shape is found to reach, by the sign of its values at points.
//!
//! Boxes of written fields follow from intervals, which tell little of turned and folded space: then a box is far
//! larger than what is in it. Points prove nothing, and are asked only how large the regions are worth making
//! within which slopes are bounded.

use crate::bounds::World;
use crate::climb::around;
use crate::expression::ExprId;
use crate::scene::ShapeId;
use crate::shape_range::ShapeRange;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

/// The distances from the origin that are tried: powers of two.
const POWERS: std::ops::Range<i32> = -6..14;
/// The points at each distance.
const POINTS: u32 = 96;
/// The share of the largest distance below which a value there is taken for that of something endless: a sheet or a
/// column may pass between the points.
const BESIDE: f64 = 0.05;
/// The most operations that are run.
const MAX_OPERATIONS: usize = 400_000;

/// The half side of a cube around the origin in which all points of a shape lie that are found; infinite where
/// there are some everywhere, and none where there are none.
pub(crate) fn radius(
    world: World<'_>,
    id: ShapeId,
    uniform: &mut dyn FnMut(ExprId) -> Interval,
) -> Option<f64> {
    let mut range = ShapeRange::new(world, uniform);
    for power in POWERS.rev() {
        let radius = f64::from(power).exp2();
        for number in 0..POINTS {
            let [x, y, z] = around(number, POINTS);
            let p = [x, y, z].map(|v| v * radius);
            let value = range.over(id, &Bounds { min: p, max: p });
            let is_farthest = power + 1 == POWERS.end;
            if is_farthest && value.lo < radius * BESIDE {
                return Some(f64::INFINITY);
            }
            if value.hi < 0.0 {
                return Some(radius * 2.0);
            }
        }
        if range.operations > MAX_OPERATIONS {
            return None;
        }
    }
    None
}
