//! Size of the visible part of a scene.
//!
//! Boxes of written fields come from intervals, which are loose in rotated and folded space. There a
//! box is far larger than its content. The signs of values at sample points are tighter, but prove
//! nothing. The size selects the regions in which slopes are bounded.

use crate::analysis::bounds::{ShapeBounds, UniformValues};
use crate::analysis::climb::fibonacci_direction;
use crate::analysis::shape_range::ShapeRange;
use crate::scene::{Scene, SceneRef, ShapeId};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

/// Minimum size, in units, from which a box may be due to loose intervals.
const MIN_LOOSE_SIZE: f64 = 64.0;
/// Minimum size of a scene without a subject, in units.
const MIN_SIZE: f64 = 1.0;
/// Exponents of the sampled distances from the origin, which are powers of two.
const DISTANCE_EXPONENTS: std::ops::Range<i32> = -6..14;
/// Number of sample points at each distance.
const POINTS_PER_DISTANCE: u32 = 96;
/// Directions along which infinite shapes most often extend, possibly thinly.
const AXES: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];
/// Minimum value at the largest distance where no shape is infinite, as a fraction of that distance. Below
/// it, a sheet or a column may pass between the sample points.
const MIN_FINITE_FRACTION: f64 = 0.05;
/// Maximum number of operations.
const MAX_OPERATIONS: usize = 400_000;

/// Returns about half the size of the visible part of a scene. It is the distance of its subject's farthest
/// corner from the origin, or the distance of cameras.
///
/// For a scene without a subject the axis with the nearest end counts: a hill falls forever.
pub(crate) fn scene_size(
    scene: &Scene,
    boxes: &mut ShapeBounds,
    root: ShapeId,
    subject: Option<(ShapeId, Bounds)>,
) -> f64 {
    let extent = match subject {
        Some((id, bounds)) => {
            let farthest_corner =
                |bounds: &Bounds| farthest(bounds.min.into_iter().chain(bounds.max));
            match farthest_corner(&bounds) {
                Some(distance) if distance > MIN_LOOSE_SIZE => sampled_bounds(scene, id, &bounds)
                    .as_ref()
                    .and_then(farthest_corner),
                distance => distance,
            }
        }
        None => {
            let Bounds { min, max } = boxes.get(SceneRef::from(scene), root);
            let extent = (0..3).filter_map(|axis| farthest([min[axis], max[axis]]));
            extent.reduce(f64::min)
        }
    };
    let cameras = scene.cameras.iter().filter(|camera| !camera.auto_framed);
    let camera_distances = cameras.flat_map(|camera| camera.from.into_iter().chain(camera.look));
    let camera_distances =
        farthest(camera_distances.filter_map(|id| scene.expressions.as_constant(id)));
    let largest = [extent, camera_distances]
        .into_iter()
        .flatten()
        .fold(0.0, f64::max);
    match subject {
        // A scene in other units is drawn in the same way.
        Some(_) if largest > 0.0 => largest,
        _ => largest.max(MIN_SIZE),
    }
}

/// Returns the largest magnitude of the finite numbers.
pub(crate) fn farthest(numbers: impl IntoIterator<Item = f64>) -> Option<f64> {
    let finite = numbers.into_iter().filter(|v| v.is_finite());
    finite.map(f64::abs).reduce(f64::max)
}

/// Returns the part of a box around the origin in which sample points of a shape are inside; `None` if
/// that is infinite.
pub(crate) fn sampled_bounds(scene: &Scene, id: ShapeId, bounds: &Bounds) -> Option<Bounds> {
    let sampled = sampled_radius(scene, id).map_or(*bounds, |radius| {
        bounds.intersection(&Bounds::centred([radius; 3]))
    });
    sampled.is_finite().then_some(sampled)
}

/// Returns the half side of a cube around the origin that holds all sample points inside a shape. It is
/// infinite where they extend to the largest distance, and `None` where there are none.
fn sampled_radius(scene: &Scene, id: ShapeId) -> Option<f64> {
    let mut uniform_values = UniformValues::default();
    let mut uniform =
        |id| Interval::point(uniform_values.value(&scene.expressions, &scene.params, 0.0, id));
    let mut range = ShapeRange::new(SceneRef::from(scene), &mut uniform);
    for power in DISTANCE_EXPONENTS.rev() {
        let radius = f64::from(power).exp2();
        let directions =
            (0..POINTS_PER_DISTANCE).map(|number| fibonacci_direction(number, POINTS_PER_DISTANCE));
        for direction in AXES.into_iter().chain(directions) {
            let p = direction.map(|v| v * radius);
            let value = range.range_in_box(id, &Bounds { min: p, max: p });
            let is_farthest = power + 1 == DISTANCE_EXPONENTS.end;
            // At a discontinuity of a field the range at a point says nothing.
            if is_farthest && value.hi < radius * MIN_FINITE_FRACTION {
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
