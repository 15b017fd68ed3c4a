//! How far a picture is from the truth.

use super::{Outcome, Place, Truth};
use crate::cpu::Geometry;
use crate::frame::{Frame, Status};
use crate::verify::Spread;
use serde::Serialize;

/// What of a picture is compared, pixel by pixel, row after row.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// How far along its ray each pixel's surface is; infinite where there is none.
    pub depth: &'a [f32],
    /// The unit normals; zero where there is none.
    pub normal: &'a [[f32; 3]],
    /// How the rays ended; empty where that is not known.
    pub status: &'a [Status],
}

impl<'a> From<&'a Frame> for Drawn<'a> {
    fn from(frame: &'a Frame) -> Self {
        Self {
            depth: &frame.depth,
            normal: &frame.normal,
            status: &frame.status,
        }
    }
}

impl<'a> From<&'a Geometry> for Drawn<'a> {
    fn from(geometry: &'a Geometry) -> Self {
        Self {
            depth: &geometry.depth,
            normal: &geometry.normal,
            status: &[],
        }
    }
}

/// How a picture differs from the truth. Undecided rays are compared in nothing. What silhouettes
/// and smooth pixels are says [`Place`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// How many pixels there are.
    pub pixels: usize,
    /// Those whose rays are proved to hit.
    pub hits: usize,
    /// Those whose rays are proved to miss.
    pub misses: usize,
    /// Those whose rays are neither.
    pub undecided: usize,
    /// Pixels that are at no silhouette.
    pub inside: usize,
    /// Rays that hit in the picture and miss in truth.
    pub false_hits: usize,
    /// Rays that miss in the picture and hit in truth.
    pub false_misses: usize,
    /// Both of these at no silhouette.
    pub mismatches_inside: usize,
    /// The errors of the depth where both hit, as a share of the depth.
    pub depth: Spread,
    /// The same at smooth pixels.
    pub depth_smooth: Spread,
    /// The same at smooth pixels, in units of the last place of the depth in `f32`.
    pub depth_ulps: Spread,
    /// The angles between the normals in degrees, at smooth pixels whose truth has no edge within
    /// half a pixel; 180 where the picture has none.
    pub normals: Spread,
    /// Pixels whose depth or normal is not a number, or whose ray met such a distance.
    pub nans: usize,
    /// Rays of the picture that ran out of steps; zero where that is not known.
    pub step_caps: usize,
}

impl Errors {
    /// Rays that hit in one of both only.
    pub fn mismatches(&self) -> usize {
        self.false_hits + self.false_misses
    }
}

/// Compares a picture of one sample per pixel with the truth of the same view. Pixels that one of
/// them lacks are not compared.
pub fn compare<'a>(truth: &Truth, drawn: impl Into<Drawn<'a>>) -> Errors {
    let drawn = drawn.into();
    let pixels = truth.rays.len().min(drawn.depth.len());
    let mut errors = Errors {
        pixels,
        ..Errors::default()
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
        let place = truth.places[pixel];
        errors.inside += usize::from(place != Place::Silhouette);
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
                errors.mismatches_inside += usize::from(place != Place::Silhouette);
                continue;
            }
            (Outcome::Hit { .. }, false) => {
                errors.hits += 1;
                errors.false_misses += 1;
                errors.mismatches_inside += usize::from(place != Place::Silhouette);
                continue;
            }
            (Outcome::Hit { t0, t1 }, true) => (t0, t1),
        };
        errors.hits += 1;
        let (middle, t) = (t0 + (t1 - t0) / 2.0, f64::from(t));
        let apart = (t - middle).abs();
        let relative = apart / middle.max(f64::MIN_POSITIVE);
        depth.push(relative);
        if place != Place::Smooth {
            continue;
        }
        depth_smooth.push(relative);
        depth_ulps.push(apart / ulp(middle as f32));
        if let (Some(of_truth), false) = (ray.normal, ray.edge) {
            normals.push(degrees_between(of_truth, normal.map(f64::from)));
        }
    }
    Errors {
        depth: Spread::of(depth),
        depth_smooth: Spread::of(depth_smooth),
        depth_ulps: Spread::of(depth_ulps),
        normals: Spread::of(normals),
        ..errors
    }
}

/// The distance from a number to the next larger one.
fn ulp(v: f32) -> f64 {
    let v = v.abs().max(f32::MIN_POSITIVE);
    f64::from(v.next_up()) - f64::from(v)
}

/// The angle between a unit vector and a vector in degrees, also where it is too small for a
/// cosine.
fn degrees_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let length = b.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length == 0.0 || length.is_nan() {
        return 180.0;
    }
    let apart: f64 = (0..3).map(|i| (a[i] - b[i] / length).powi(2)).sum();
    (2.0 * (apart.sqrt() / 2.0).min(1.0).asin()).to_degrees()
}
