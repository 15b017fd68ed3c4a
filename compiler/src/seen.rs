//! The size of what is seen of a scene.
//!
//! Boxes of written fields follow from intervals, which tell little of turned and folded space: then a box is far
//! larger than what is in it. The signs of values at points tell more. They prove nothing: sizes say which regions
//! are worth bounding slopes in, and what an open camera looks at.

use crate::bounds::{Boxes, Present, World};
use crate::climb::around;
use crate::scene::{Scene, ShapeId};
use crate::shape_range::ShapeRange;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

/// The size from which on a box may be due to intervals rather than to what is in it.
const VAGUE: f64 = 64.0;
/// The least size that a scene without a subject is taken to have: cameras that are left open stand so far away.
const LEAST_SIZE: f64 = 1.0;
/// The distances from the origin that are tried: powers of two.
const POWERS: std::ops::Range<i32> = -6..14;
/// The points at each distance.
const POINTS: u32 = 96;
/// The directions along which what is endless most often goes on, and may be thin.
const AXES: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];
/// The share of the largest distance below which a value there is taken for that of something endless: a sheet or a
/// column may pass between the points.
const BESIDE: f64 = 0.05;
/// The most operations that are run.
const MAX_OPERATIONS: usize = 400_000;

/// About half the size of what is seen of a scene: the farthest corner of its subject from the origin, or the
/// distance of cameras.
///
/// Of a scene without a subject the axis along which it ends nearest counts: a hill falls away for ever.
pub(crate) fn size(
    scene: &Scene,
    boxes: &mut Boxes,
    root: ShapeId,
    subject: Option<(ShapeId, Bounds)>,
) -> f64 {
    let ends = match subject {
        Some((id, bounds)) => {
            let end = |bounds: &Bounds| farthest(bounds.min.into_iter().chain(bounds.max));
            match end(&bounds) {
                Some(far) if far > VAGUE => found(scene, id, &bounds).as_ref().and_then(end),
                far => far,
            }
        }
        None => {
            let Bounds { min, max } = boxes.of(World::from(scene), root);
            let ends = (0..3).filter_map(|axis| farthest([min[axis], max[axis]]));
            ends.reduce(f64::min)
        }
    };
    let cameras = scene.cameras.iter().filter(|camera| !camera.automatic);
    let places = cameras.flat_map(|camera| camera.from.into_iter().chain(camera.look));
    let places = farthest(places.filter_map(|id| scene.expressions.as_constant(id)));
    let largest = [ends, places].into_iter().flatten().fold(0.0, f64::max);
    match subject {
        // The same scene in other units is drawn in the same way.
        Some(_) if largest > 0.0 => largest,
        _ => largest.max(LEAST_SIZE),
    }
}

/// The largest magnitude of the finite ones among some numbers.
pub(crate) fn farthest(numbers: impl IntoIterator<Item = f64>) -> Option<f64> {
    let finite = numbers.into_iter().filter(|v| v.is_finite());
    finite.map(f64::abs).reduce(f64::max)
}

/// The rest of a box around the origin, within which points of a shape are found; none if that has no end.
pub(crate) fn found(scene: &Scene, id: ShapeId, bounds: &Bounds) -> Option<Bounds> {
    let within = radius(scene, id).map_or(*bounds, |radius| {
        bounds.common(&Bounds::centred([radius; 3]))
    });
    within.is_finite().then_some(within)
}

/// The half side of a cube around the origin in which all points of a shape lie that are found; infinite where
/// there are some everywhere, and none where there are none.
fn radius(scene: &Scene, id: ShapeId) -> Option<f64> {
    let mut present = Present::default();
    let mut uniform =
        |id| Interval::point(present.value(&scene.expressions, &scene.params, 0.0, id));
    let mut range = ShapeRange::new(World::from(scene), &mut uniform);
    for power in POWERS.rev() {
        let radius = f64::from(power).exp2();
        let spread = (0..POINTS).map(|number| around(number, POINTS));
        for direction in AXES.into_iter().chain(spread) {
            let p = direction.map(|v| v * radius);
            let value = range.over(id, &Bounds { min: p, max: p });
            let is_farthest = power + 1 == POWERS.end;
            // The values of a point where a field is torn tell nothing.
            if is_farthest && value.hi < radius * BESIDE {
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
