//! Where in a picture pixels lie: at a silhouette, on a smooth piece of surface, or elsewhere.

use super::camera::Camera;
use super::{Ended, Outcome};
use serde::Serialize;

/// Where in the truth a pixel lies, by the 3 × 3 pixels around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// Some of them hit and some miss, or one is undecided.
    Silhouette,
    /// All miss; or all hit, but on surfaces that do not belong together.
    Inside,
    /// All hit one piece of surface: they are within a pixel's size of the tangent plane.
    Smooth,
}

/// The places of the pixels of a picture with this many in a row.
pub(super) fn places(rays: &[Ended], width: usize, camera: &Camera) -> Vec<Place> {
    let points: Vec<Option<[f64; 3]>> = (0..rays.len())
        .map(|at| {
            let pixel = [(at % width) as f64, (at / width) as f64];
            let t = rays[at].depth?;
            Some(camera.ray(pixel, [0.0, 0.0]).at(t))
        })
        .collect();
    let place = |at| place(rays, &points, width, at, camera);
    (0..rays.len()).map(place).collect()
}

fn place(
    rays: &[Ended],
    points: &[Option<[f64; 3]>],
    width: usize,
    at: usize,
    camera: &Camera,
) -> Place {
    let (x, y) = (at % width, at / width);
    let columns = x.saturating_sub(1)..(x + 2).min(width);
    let rows = y.saturating_sub(1)..(y + 2).min(rays.len() / width);
    let around = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
    let mut place = Place::Smooth;
    for near in around {
        match (rays[at].outcome, rays[near].outcome) {
            (Outcome::Hit { t0, .. }, Outcome::Hit { .. }) => {
                let most = 2.0 * camera.half_pixel(t0);
                if !belong(rays[at].normal, points[at], points[near], most) {
                    place = Place::Inside;
                }
            }
            (Outcome::Miss, Outcome::Miss) => place = Place::Inside,
            _ => return Place::Silhouette,
        }
    }
    place
}

/// Whether a point is no farther than this from a tangent plane.
fn belong(
    normal: Option<[f64; 3]>,
    here: Option<[f64; 3]>,
    there: Option<[f64; 3]>,
    most: f64,
) -> bool {
    let (Some(n), Some(p), Some(q)) = (normal, here, there) else {
        return false;
    };
    let apart: f64 = (0..3).map(|axis| (q[axis] - p[axis]) * n[axis]).sum();
    apart.abs() <= most
}
