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
/// silhouettes and smooth pixels. With the truth of a sample, numbers of pixels are estimates for the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PictureErrors {
    /// Number of pixels.
    pub pixels: usize,
    /// Number of pixels whose truth is known.
    pub sampled: usize,
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
    let mut counts = Counts::default();
    let (mut depth, mut depth_smooth) = (Vec::new(), Vec::new());
    let (mut depth_ulps, mut normals) = (Vec::new(), Vec::new());
    let known = truth.pixels.iter();
    for pixel in known.filter(|pixel| pixel.index < drawn.depth.len()) {
        let (weight, ray) = (pixel.weight, &pixel.ray);
        let t = drawn.depth[pixel.index];
        let is_silhouette = pixel.class == PixelClass::Silhouette;
        counts.sampled += 1;
        counts.pixels += weight;
        counts.inside += if is_silhouette { 0.0 } else { weight };
        let mismatch_inside = if is_silhouette { 0.0 } else { weight };
        let (t0, t1) = match (ray.outcome, t.is_finite()) {
            (Outcome::Undecided { .. }, _) => {
                counts.undecided += weight;
                continue;
            }
            (Outcome::Miss, false) => {
                counts.misses += weight;
                continue;
            }
            (Outcome::Miss, true) => {
                counts.misses += weight;
                counts.false_hits += weight;
                counts.mismatches_inside += mismatch_inside;
                continue;
            }
            (Outcome::Hit { .. }, false) => {
                counts.hits += weight;
                counts.false_misses += weight;
                counts.mismatches_inside += mismatch_inside;
                continue;
            }
            (Outcome::Hit { t0, t1 }, true) => (t0, t1),
        };
        counts.hits += weight;
        let (middle, t) = (t0 + (t1 - t0) / 2.0, f64::from(t));
        let difference = (t - middle).abs();
        let relative = difference / middle.max(f64::MIN_POSITIVE);
        depth.push((relative, weight));
        if pixel.class != PixelClass::Smooth {
            continue;
        }
        depth_smooth.push((relative, weight));
        depth_ulps.push((difference / ulp(middle as f32), weight));
        if let (Some(true_normal), false) = (ray.normal, ray.edge) {
            let normal = drawn.normal.get(pixel.index).copied().unwrap_or_default();
            let angle = degrees_between(true_normal, normal.map(f64::from));
            normals.push((angle, weight));
        }
    }
    PictureErrors {
        depth: Percentiles::from_weighted(depth),
        depth_smooth: Percentiles::from_weighted(depth_smooth),
        depth_ulps: Percentiles::from_weighted(depth_ulps),
        normals: Percentiles::from_weighted(normals),
        nans: drawn.nans(),
        step_caps: drawn.count(Status::StepCap),
        ..counts.rounded()
    }
}

/// Weighted numbers of pixels.
#[derive(Default)]
struct Counts {
    sampled: usize,
    pixels: f64,
    hits: f64,
    misses: f64,
    undecided: f64,
    inside: f64,
    false_hits: f64,
    false_misses: f64,
    mismatches_inside: f64,
}

impl Counts {
    /// Returns the errors with these numbers alone.
    fn rounded(&self) -> PictureErrors {
        let round = |count: f64| count.round() as usize;
        PictureErrors {
            sampled: self.sampled,
            pixels: round(self.pixels),
            hits: round(self.hits),
            misses: round(self.misses),
            undecided: round(self.undecided),
            inside: round(self.inside),
            false_hits: round(self.false_hits),
            false_misses: round(self.false_misses),
            mismatches_inside: round(self.mismatches_inside),
            ..PictureErrors::default()
        }
    }
}

impl RenderedPixels<'_> {
    /// Returns the number of pixels with this status.
    fn count(&self, status: Status) -> usize {
        self.status.iter().filter(|&&other| other == status).count()
    }

    /// Returns the number of pixels whose depth or normal is NaN, or whose ray met a NaN distance.
    fn nans(&self) -> usize {
        let is_nan = |index: &usize| {
            let normal = self.normal.get(*index).copied().unwrap_or_default();
            let status = self.status.get(*index).copied().unwrap_or_default();
            self.depth[*index].is_nan()
                || normal.iter().any(|v| v.is_nan())
                || status == Status::NotANumber
        };
        (0..self.depth.len()).filter(is_nan).count()
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
