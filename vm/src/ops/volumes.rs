//! Bounding volumes of the shapes, from their parameters.

use crate::bounds::Bounds;

/// The box itself: half sizes.
pub fn cuboid(a: &[f64]) -> Bounds {
    Bounds::centred([a[0], a[1], a[2]])
}
