//! Errors of a picture compared with the truth.

use super::{GroundTruth, Outcome, PixelClass};
use crate::comparison::Percentiles;
use crate::render::{Geometry, Image, Status};
use glam::DVec3;
use serde::Serialize;

/// The compared channels of a picture, pixel by pixel, row after row.
#[derive(Clone, Copy, Debug)]
pub struct RenderedPixels<'a> {
    /// Distance of each pixel's surface along its ray; infinite where there is none.
    pub depth: &'a [f32],
    /// Unit normals; zero where there is none.
    pub normal: &'a [[f32; 3]],
    /// Status of the rays; empty if it is not known.
    pub status: &'a [Status],
}

impl<'a> From<&'a Image> for RenderedPixels<'a> {
    fn from(image: &'a Image) -> Self {
        Self {
            depth: &image.depth,
            normal: &image.normal,
            status: &image.status,
        }
    }
}

impl<'a> From<&'a Geometry> for RenderedPixels<'a> {
    fn from(geometry: &'a Geometry) -> Self {
        Self {
            depth: &geometry.depth,
            normal: &geometry.normal,
            status: &[],
        }
    }
}

/// Differences between a picture and the truth. Undecided rays are not compared. [`PixelClass`] defines
/// silhouettes and smooth pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PictureErrors {
    /// Number of pixels.
    pub pixels: usize,
    /// Pixels whose rays are proved to hit.
    pub hits: usize,
    /// Pixels whose rays are proved to miss.
    pub misses: usize,
    /// Pixels whose rays are undecided.
    pub undecided: usize,
    /// Pixels not at a silhouette.
    pub inside: usize,
    /// Rays that hit in the picture and miss in truth.
    pub false_hits: usize,
    /// Rays that miss in the picture and hit in truth.
    pub false_misses: usize,
    /// False hits and false misses not at a silhouette.
    pub mismatches_inside: usize,
    /// Relative errors of the depth where both hit.
    pub depth: Percentiles,
    /// Relative errors of the depth at smooth pixels.
    pub depth_smooth: Percentiles,
    /// Errors of the depth at smooth pixels, in units of the last place of the depth in `f32`.
    pub depth_ulps: Percentiles,
    /// Angles between the normals in degrees, at smooth pixels whose truth has no edge within half a pixel;
    /// 180 where the picture has no normal.
    pub normals: Percentiles,
    /// Pixels whose depth or normal is NaN, or whose ray met a NaN distance.
    pub nans: usize,
    /// Rays of the picture that ran out of steps; zero if that is not known.
    pub step_caps: usize,
}

impl PictureErrors {
    /// Returns the number of rays that hit in only one of picture and truth.
    pub fn mismatches(&self) -> usize {
        self.false_hits + self.false_misses
    }
}

/// Compares a picture of one sample per pixel with the truth of the same view. Pixels that one of them lacks
/// are not compared.
pub fn compare<'a>(truth: &GroundTruth, drawn: impl Into<RenderedPixels<'a>>) -> PictureErrors {
    let drawn = drawn.into();
    let pixels = truth.rays.len().min(drawn.depth.len());
    let mut errors = PictureErrors {
        pixels,
        ..PictureErrors::default()
    };
    let (mut depth, mut depth_smooth) = (Vec::new(), Vec::new());
    let (mut depth_ulps, mut normals) = (Vec::new(), Vec::new());
    for pixel in 0..pixels {
        let t = drawn.depth[pixel];
        let normal = drawn.normal.get(pixel).copied().unwrap_or_default();
        let status = drawn.status.get(pixel).copied().unwrap_or_default();
        let nan = t.is_nan() || normal.iter().any(|v| v.is_nan());
        errors.nans += usize::from(nan || status == Status::NotANumber);
        errors.step_caps += usize::from(status == Status::StepCap);
        let class = truth.places[pixel];
        errors.inside += usize::from(class != PixelClass::Silhouette);
        let ray = &truth.rays[pixel];
        let (t0, t1) = match (ray.outcome, t.is_finite()) {
            (Outcome::Undecided { .. }, _) => {
                errors.undecided += 1;
                continue;
            }
            (Outcome::Miss, false) => {
                errors.misses += 1;
                continue;
            }
            (Outcome::Miss, true) => {
                errors.misses += 1;
                errors.false_hits += 1;
                errors.mismatches_inside += usize::from(class != PixelClass::Silhouette);
                continue;
            }
            (Outcome::Hit { .. }, false) => {
                errors.hits += 1;
                errors.false_misses += 1;
                errors.mismatches_inside += usize::from(class != PixelClass::Silhouette);
                continue;
            }
            (Outcome::Hit { t0, t1 }, true) => (t0, t1),
        };
        errors.hits += 1;
        let (middle, t) = (t0 + (t1 - t0) / 2.0, f64::from(t));
        let difference = (t - middle).abs();
        let relative = difference / middle.max(f64::MIN_POSITIVE);
        depth.push(relative);
        if class != PixelClass::Smooth {
            continue;
        }
        depth_smooth.push(relative);
        depth_ulps.push(difference / ulp(middle as f32));
        if let (Some(true_normal), false) = (ray.normal, ray.edge) {
            normals.push(degrees_between(true_normal, normal.map(f64::from)));
        }
    }
    PictureErrors {
        depth: Percentiles::from_values(depth),
        depth_smooth: Percentiles::from_values(depth_smooth),
        depth_ulps: Percentiles::from_values(depth_ulps),
        normals: Percentiles::from_values(normals),
        ..errors
    }
}

/// Returns the distance from a number to the next larger one.
fn ulp(v: f32) -> f64 {
    let v = v.abs().max(f32::MIN_POSITIVE);
    f64::from(v.next_up()) - f64::from(v)
}

/// Returns the angle between a unit vector and a vector in degrees, accurate also where the cosine is not.
fn degrees_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (DVec3::from(a), DVec3::from(b));
    let length = b.length();
    if length == 0.0 || length.is_nan() {
        return 180.0;
    }
    (2.0 * (a.distance(b / length) / 2.0).min(1.0).asin()).to_degrees()
}
