//! Classification of pixels: at a silhouette, on a smooth surface, or elsewhere.

use super::camera::ReferenceCamera;
use super::{Outcome, RayEnd};
use glam::DVec3;
use serde::Serialize;

/// Class of a pixel, by the truth of the 3 × 3 pixels around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PixelClass {
    /// Some of them hit and some miss, or one is undecided.
    Silhouette,
    /// All miss; or all hit, but on surfaces that do not belong together.
    Inside,
    /// All hit one smooth surface: they are within a pixel's size of the tangent plane.
    Smooth,
}

/// Classifies a pixel of a picture with `width` pixels per row, whose ray and its neighbours' are traced.
pub(super) fn classify(
    rays: &[Option<RayEnd>],
    width: usize,
    index: usize,
    camera: &ReferenceCamera,
) -> PixelClass {
    let Some(own) = &rays[index] else {
        return PixelClass::Silhouette;
    };
    let end = |index: usize, depth: Option<f64>| {
        let pixel = [(index % width) as f64, (index / width) as f64];
        Some(camera.ray(pixel, [0.0, 0.0]).at(depth?))
    };
    let point = end(index, own.depth);
    let mut class = PixelClass::Smooth;
    for neighbor_index in neighborhood(index, width, rays.len() / width) {
        let Some(neighbor) = &rays[neighbor_index] else {
            return PixelClass::Silhouette;
        };
        match (own.outcome, neighbor.outcome) {
            (Outcome::Hit { t0, .. }, Outcome::Hit { .. }) => {
                let max_distance = 2.0 * camera.half_pixel(t0);
                let neighbor_point = end(neighbor_index, neighbor.depth);
                if !is_on_tangent_plane(own.normal, point, neighbor_point, max_distance) {
                    class = PixelClass::Inside;
                }
            }
            (Outcome::Miss, Outcome::Miss) => class = PixelClass::Inside,
            _ => return PixelClass::Silhouette,
        }
    }
    class
}

/// Returns the indices of a pixel and of its up to eight neighbours.
pub(super) fn neighborhood(
    index: usize,
    width: usize,
    height: usize,
) -> impl Iterator<Item = usize> {
    let (x, y) = (index % width, index / width);
    let columns = x.saturating_sub(1)..(x + 2).min(width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

/// Reports whether a point is at most `max_distance` from a tangent plane.
fn is_on_tangent_plane(
    normal: Option<[f64; 3]>,
    point: Option<[f64; 3]>,
    neighbor: Option<[f64; 3]>,
    max_distance: f64,
) -> bool {
    let (Some(n), Some(p), Some(q)) = (normal, point, neighbor) else {
        return false;
    };
    let distance = (DVec3::from(q) - DVec3::from(p)).dot(n.into());
    distance.abs() <= max_distance
}
