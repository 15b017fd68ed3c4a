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

/// Classifies the pixels of a picture with `width` pixels per row.
pub(super) fn places(rays: &[RayEnd], width: usize, camera: &ReferenceCamera) -> Vec<PixelClass> {
    let points: Vec<Option<[f64; 3]>> = (0..rays.len())
        .map(|index| {
            let pixel = [(index % width) as f64, (index / width) as f64];
            let t = rays[index].depth?;
            Some(camera.ray(pixel, [0.0, 0.0]).at(t))
        })
        .collect();
    let classify_at = |index| classify(rays, &points, width, index, camera);
    (0..rays.len()).map(classify_at).collect()
}

fn classify(
    rays: &[RayEnd],
    points: &[Option<[f64; 3]>],
    width: usize,
    index: usize,
    camera: &ReferenceCamera,
) -> PixelClass {
    let (x, y) = (index % width, index / width);
    let columns = x.saturating_sub(1)..(x + 2).min(width);
    let rows = y.saturating_sub(1)..(y + 2).min(rays.len() / width);
    let neighborhood = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
    let mut class = PixelClass::Smooth;
    for neighbor in neighborhood {
        match (rays[index].outcome, rays[neighbor].outcome) {
            (Outcome::Hit { t0, .. }, Outcome::Hit { .. }) => {
                let max_distance = 2.0 * camera.half_pixel(t0);
                if !is_on_tangent_plane(
                    rays[index].normal,
                    points[index],
                    points[neighbor],
                    max_distance,
                ) {
                    class = PixelClass::Inside;
                }
            }
            (Outcome::Miss, Outcome::Miss) => class = PixelClass::Inside,
            _ => return PixelClass::Silhouette,
        }
    }
    class
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
