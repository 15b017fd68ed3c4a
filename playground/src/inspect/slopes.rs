//! Slope overlay: points where the field exceeds its slope bound, and points where it slows rays down.
//!
//! Sphere tracing is safe if the field is Lipschitz with constant `MAX_SLOPE`; steeper fields are divided by
//! a bound. If the bound is exceeded nevertheless, the scene states a wrong bound (`lipschitz:`) or no bound
//! could be found. Rays may then step through a surface. Two tests detect this: the length of the gradient at
//! a point, and the difference between the values of adjacent points. The second one also finds
//! discontinuities, as at the seam of a repetition.
//!
//! If the gradient is shorter than half the bound, rays take more than twice the required number of
//! steps.

use super::QueryPoints;
use super::ink::{Color, blend_over, bytes, hex};
use glam::Vec3;
use sdfc_runtime::engine::FieldSample;

/// Bound of every field's slope.
const MAX_SLOPE: f32 = 1.0;
/// Maximum rounding error of a gradient in `f32`, relative to the bound. The gradient is a sum of slopes
/// none of which is much larger than the bound.
const MAX_GRADIENT_ROUNDING: f32 = 1e-3;
/// Maximum rounding error of a value in `f32`, relative to its coordinates and to itself.
const MAX_VALUE_ROUNDING: f32 = 4e-6;
/// Slopes below this fraction of the bound slow rays down.
const MAX_SLOW_FRACTION: f32 = 0.5;

/// Classification of a slope with respect to its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlopeClass {
    /// Close to the bound.
    Good,
    /// Less than half the bound: steps are shorter than required.
    Slow,
    /// Above the bound by more than rounding: steps may be too long.
    Steep,
    /// Within the bound here, but the value at an adjacent point differs by more than the bound allows.
    Discontinuity,
    /// Not a number.
    Unknown,
}

impl SlopeClass {
    /// Classifies the slope at a point by its gradient.
    fn from_sample(sample: &FieldSample) -> Self {
        let gradient_length = gradient_length(sample);
        if !gradient_length.is_finite() || !sample.distance.is_finite() {
            Self::Unknown
        } else if gradient_length > MAX_SLOPE * (1.0 + MAX_GRADIENT_ROUNDING) {
            Self::Steep
        } else if gradient_length < MAX_SLOPE * MAX_SLOW_FRACTION {
            Self::Slow
        } else {
            Self::Good
        }
    }
}

/// Returns the length of the gradient.
pub fn gradient_length(sample: &FieldSample) -> f32 {
    Vec3::from(sample.gradient).length()
}

/// Slope classes of a list of points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointSlopes {
    /// Class of each point.
    pub classes: Vec<SlopeClass>,
    /// Number of points in each class.
    pub counts: SlopeCounts,
}

/// Number of points in each slope class.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlopeCounts {
    /// Number of points.
    pub points: usize,
    /// Number of points at which the field is steeper than its bound.
    pub steep: usize,
    /// Number of points at which the difference to an adjacent point exceeds the bound.
    pub discontinuities: usize,
    /// Number of points at which the slope is below half the bound.
    pub slow: usize,
    /// Number of points at which the slope is not a number.
    pub unknown: usize,
    /// Largest slope of all points.
    pub max_slope: f32,
    /// Point with the largest slope.
    pub max_slope_point: [f32; 3],
}

/// Divides samples by the ratio of a stated slope to the estimate that the field was divided by
/// ([`Settings::slope_over_estimate`](sdfc_vm::settings::Settings::slope_over_estimate)). The bound of their slopes is then
/// one.
pub fn divide_by_stated_slope(samples: &mut [FieldSample], ratio: Option<f64>) {
    let ratio = ratio.filter(|ratio| ratio.is_finite()).unwrap_or(1.0);
    let factor = (1.0 / ratio) as f32;
    for sample in samples {
        sample.distance *= factor;
        sample.gradient = sample.gradient.map(|v| v * factor);
    }
}

/// Classifies slopes by their bound. `samples` are the engine's results for the points; a row of the
/// picture has `width` pixels.
pub fn classify_slopes(
    query_points: &QueryPoints,
    samples: &[FieldSample],
    width: usize,
) -> PointSlopes {
    let mut classes: Vec<SlopeClass> = samples
        .iter()
        .take(query_points.points.len())
        .map(SlopeClass::from_sample)
        .collect();
    for i in 0..classes.len() {
        for neighbour in neighbours(query_points, i, width).into_iter().flatten() {
            let is_sampled = neighbour < classes.len();
            if is_sampled
                && is_discontinuous([i, neighbour].map(|i| (query_points.points[i], samples[i])))
            {
                for end in [i, neighbour] {
                    if matches!(classes[end], SlopeClass::Good | SlopeClass::Slow) {
                        classes[end] = SlopeClass::Discontinuity;
                    }
                }
            }
        }
    }
    let mut counts = SlopeCounts {
        points: classes.len(),
        ..SlopeCounts::default()
    };
    for ((class, sample), &point) in classes.iter().zip(samples).zip(&query_points.points) {
        match class {
            SlopeClass::Good => {}
            SlopeClass::Slow => counts.slow += 1,
            SlopeClass::Steep => counts.steep += 1,
            SlopeClass::Discontinuity => counts.discontinuities += 1,
            SlopeClass::Unknown => counts.unknown += 1,
        }
        let gradient_length = gradient_length(sample);
        if gradient_length > counts.max_slope {
            (counts.max_slope, counts.max_slope_point) = (gradient_length, point);
        }
    }
    PointSlopes { classes, counts }
}

/// Returns the indices of the points at the pixels to the right and below, if they exist.
fn neighbours(query_points: &QueryPoints, i: usize, width: usize) -> [Option<usize>; 2] {
    let pixel = query_points.pixels[i] as usize;
    let right = query_points.pixels.get(i + 1).map(|&pixel| pixel as usize);
    let is_last = width == 0 || pixel % width == width - 1;
    let right = (!is_last && right == Some(pixel + 1)).then_some(i + 1);
    // Pixels are ascending, so the one below follows within one row's width.
    let following = query_points.pixels.get(i + 1..).unwrap_or_default();
    let following = following
        .get(..width.min(following.len()))
        .unwrap_or_default();
    let below = following.binary_search(&((pixel + width) as u32));
    [right, below.ok().map(|index| i + 1 + index)]
}

/// Reports whether the values at two points differ by more than the bound allows.
fn is_discontinuous([a, b]: [([f32; 3], FieldSample); 2]) -> bool {
    let distance = Vec3::from(a.0).distance(b.0.into());
    let difference = (a.1.distance - b.1.distance).abs();
    let numbers = a.0.iter().chain(&b.0).chain([&a.1.distance, &b.1.distance]);
    let largest = numbers.fold(0.0_f32, |max, v| max.max(v.abs()));
    difference > MAX_SLOPE * distance * (1.0 + MAX_GRADIENT_ROUNDING) + largest * MAX_VALUE_ROUNDING
}

/// Opacity of a mark.
const STRONG_OPACITY: f32 = 0.85;
const FAINT_OPACITY: f32 = 0.3;

const STEEP_COLOR: Color = hex(0xe01030);
const DISCONTINUITY_COLOR: Color = hex(0xff7a00);
const SLOW_COLOR: Color = hex(0x7a48d6);
const NAN_COLOR: Color = hex(0xd0006f);

impl SlopeClass {
    /// Returns the colour and opacity of the mark, if the class has one.
    fn mark(self) -> Option<(Color, f32)> {
        match self {
            Self::Good => None,
            Self::Slow => Some((SLOW_COLOR, FAINT_OPACITY)),
            Self::Steep => Some((STEEP_COLOR, STRONG_OPACITY)),
            Self::Discontinuity => Some((DISCONTINUITY_COLOR, STRONG_OPACITY)),
            Self::Unknown => Some((NAN_COLOR, STRONG_OPACITY)),
        }
    }

    /// Returns the colour of the mark for a legend.
    pub fn color(self) -> Option<[u8; 4]> {
        self.mark().map(|(color, _)| bytes(color))
    }
}

impl PointSlopes {
    /// Marks slopes in a picture: red where they are too steep, orange at discontinuities, faint violet
    /// where they slow rays down.
    pub fn draw(&self, picture: &mut [u8], query_points: &QueryPoints) {
        for (&pixel, class) in query_points.pixels.iter().zip(&self.classes) {
            if let Some((ink, fraction)) = class.mark() {
                blend_over(picture, pixel as usize, ink, fraction);
            }
        }
    }
}
