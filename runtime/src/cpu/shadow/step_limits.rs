//! Distances between samples on steps towards a light, for scenes whose slopes are only estimated.
//!
//! A value that was divided by an estimate is no distance, and a step may lead over surfaces. Samples on it prove that
//! there is none. In a cell, bounds of the gradient turn a value into a distance, up to the cell's faces. A cell without a
//! surface needs one sample beyond it. Elsewhere, samples are about half a pixel apart, and farther far away.

use crate::cells::{Aabb, Cell, CellSplit, Cells, Neighbourhood};
use crate::cpu::packet::directional_bounds;
use sdfc_shaders::layout::{self, FrameUniforms};
use sdfc_shaders::marching;
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;

/// Distance of a sample beyond a face, as a fraction of the largest coordinate there: in `f32`, it lies in the next cell.
const BEYOND_FACE: f32 = 4.0 * f32::EPSILON;
/// Least distance between samples in a cell with a surface, in minimum steps: half a pixel.
const LEAST_MIN_STEPS: f32 = 16.0;
/// Minimum of that distance, as a fraction of the distance from the start of the ray: rays to the horizon end, too.
const LEAST_FRACTION: f32 = 0.01;

/// Cells that limit steps.
#[derive(Clone, Copy)]
pub(super) struct StepLimits<'a> {
    cells: &'a Cells,
}

impl<'a> StepLimits<'a> {
    /// Returns the limits for a picture; `None` if its values or its statements prove steps, or without cells.
    pub(super) fn new(frame: &FrameUniforms, cells: Option<&'a Cells>) -> Option<Self> {
        let is_estimated = frame.flags & layout::ESTIMATE_FLAG != 0;
        let is_proved = marching::proves_steps(frame.step_factor);
        let cells = cells.filter(|cells| cells.split() == CellSplit::Volume)?;
        (is_estimated && !is_proved).then_some(Self { cells })
    }

    /// Returns the least distance between samples at `t` along a ray, whose steps have the minimum `min_step`.
    pub(super) fn least(t: f32, min_step: f32) -> f32 {
        (min_step * LEAST_MIN_STEPS).max(t * LEAST_FRACTION)
    }

    /// Returns the longest distance to the next sample from a point on a ray; `value` is the field there. In a cell with a
    /// surface it is at least `least`.
    pub(super) fn limit(
        self,
        (point, direction): (V3<f32>, V3<f32>),
        value: f32,
        least: f32,
    ) -> f32 {
        let point = point.to_array();
        let Some(Neighbourhood { region, leaf }) = self.cells.neighbourhood_at(point) else {
            return f32::INFINITY;
        };
        let to_next = distance_to_next(&region, point, direction.to_array());
        let Some(leaf) = leaf else {
            return to_next;
        };
        clear_distance(leaf, value, direction.to_array())
            .min(to_next)
            .max(least)
    }
}

/// Returns the distance in a leaf along which a field with this value keeps its sign.
fn clear_distance(leaf: &Cell, value: f32, direction: [f32; 3]) -> f32 {
    let Some(gradient) = leaf.gradient else {
        return 0.0;
    };
    let bounds = (leaf.slope, Some(gradient));
    let changes = directional_bounds(bounds, direction, value.sign_nonzero());
    value.abs() / changes.decrease_max
}

/// Returns the distance along a ray from a point in a box to just beyond the face through which it leaves.
fn distance_to_next(region: &Aabb, point: [f32; 3], direction: [f32; 3]) -> f32 {
    let mut exit = f32::INFINITY;
    let mut size: f32 = 0.0;
    for axis in 0..3 {
        let face = match direction[axis] > 0.0 {
            true => region.high[axis],
            false => region.low[axis],
        };
        let distance = (face - point[axis]) / direction[axis];
        // Along an axis at a right angle there is no face: the quotient is infinite or NaN.
        exit = exit.min(distance.max(0.0));
        size = size.max(face.abs());
    }
    exit + size * BEYOND_FACE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::leaf_bins::tests::cells;
    use sdfc_vm::real::Vector3;

    /// The bounds of a gradient limit how fast a value falls along a ray.
    #[test]
    fn values_are_distances_where_gradients_are_bounded() {
        let cells = cells();
        let leaf = cells.leaves().next().expect("a leaf");
        let mut cell = *cells.cell(leaf);
        assert_eq!(clear_distance(&cell, 0.3, [-1.0, 0.0, 0.0]), 0.0);
        (cell.slope, cell.gradient) = (2.0, Some([[1.0, 2.0], [0.0, 0.0], [0.0, 0.0]]));
        let towards = clear_distance(&cell, 0.3, [-1.0, 0.0, 0.0]);
        assert!((0.149..=0.15).contains(&towards), "{towards}");
        assert!(clear_distance(&cell, 0.3, [1.0, 0.0, 0.0]) > 1e3);
        let inside = clear_distance(&cell, -0.3, [1.0, 0.0, 0.0]);
        assert!((0.149..=0.15).contains(&inside), "{inside}");
    }

    /// A sample lies in the next cell, or before, wherever the last one was.
    #[test]
    fn samples_lie_in_the_next_cell_or_before() {
        let cells = cells();
        let limits = StepLimits { cells: &cells };
        let direction = V3::new(0.48, 0.6, -0.64);
        let mut visited = 0;
        for start in [[-0.9, -0.8, 0.9], [-0.3, -0.95, 0.4], [0.2, -0.6, 0.8]] {
            let mut point = V3::new(start[0], start[1], start[2]);
            while let Some(here) = cells.neighbourhood_at(point.to_array()) {
                let step = limits.limit((point, direction), 1e3, 16e-6);
                let mut end = point + direction * step;
                if here.leaf.is_some_and(|leaf| leaf.gradient.is_none()) {
                    assert!((step - 16e-6).abs() < 1e-7, "{step}");
                    end = point
                        + direction
                            * distance_to_next(
                                &here.region,
                                point.to_array(),
                                direction.to_array(),
                            );
                }
                let beyond = (end - point).dot(direction) - 4e-6;
                assert!(
                    here.region
                        .contains((point + direction * beyond.max(0.0)).to_array())
                );
                assert_ne!(
                    cells
                        .neighbourhood_at(end.to_array())
                        .map(|next| next.region),
                    Some(here.region)
                );
                point = end;
                visited += 1;
            }
        }
        assert!(visited > 6, "{visited} cells");
    }
}
