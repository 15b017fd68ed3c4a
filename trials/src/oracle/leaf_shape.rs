//! Solids and 2-D shapes as distance functions with parameters.

use super::influence_box::InfluenceBox;
use super::point::Point;

/// Distance of a shape as a function of its parameters and the point.
pub(super) type DistanceFn = fn(&[f64], Point) -> f64;

/// A solid or a 2-D shape, given by a distance function and parameters.
#[derive(Clone, Debug)]
pub(super) struct LeafShape {
    /// Signed distance.
    pub(super) distance: DistanceFn,
    /// Values of its parameters.
    pub(super) parameters: Vec<f64>,
    /// Influence box.
    pub(super) bounds: InfluenceBox,
    /// Bound of the slope of its value.
    pub(super) slope_bound: f64,
}
