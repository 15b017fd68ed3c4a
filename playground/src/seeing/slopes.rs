//! Slopes: where the field breaks its promise, and where it makes rays slow.
//!
//! A march is safe if the field changes no faster than its bound says
//! ([`FieldFacts::slope`](sdfc_runtime::frame::FieldFacts), nearly always 1: fields that could be
//! steeper are divided by a bound where they stand). Where the gradient is longer all the same, the
//! scene states a bound that does not hold (`lipschitz:`), or none could be found, and rays may step
//! over a surface. Where it is less than half of the bound, rays take more than twice the steps that
//! they would have to.

use super::ink::{Color, hex, lay};
use sdfc_runtime::engine::Sample;

/// A gradient in `f32` is off by less than this share of the bound: it is made of sums of slopes none
/// of which is much larger than the bound.
const ROUNDING: f32 = 1e-3;
/// What is less than this share of the bound makes rays slow.
const SLOW: f32 = 0.5;

/// What a slope is, compared with its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slope {
    /// As steep as the bound allows, or not much less.
    Good,
    /// Less than half as steep: steps are shorter than they need to be.
    Slow,
    /// Steeper than the bound, by more than rounding: steps may be too long.
    Steep,
    /// Not a number.
    Unknown,
}

/// What the slope at a point is, compared with the bound.
pub fn slope(sample: &Sample, bound: f32) -> Slope {
    let steepness = steepness(sample);
    if !steepness.is_finite() {
        Slope::Unknown
    } else if steepness > bound * (1.0 + ROUNDING) {
        Slope::Steep
    } else if steepness < bound * SLOW {
        Slope::Slow
    } else {
        Slope::Good
    }
}

/// How fast the field changes at a point, per unit of the way.
pub fn steepness(sample: &Sample) -> f32 {
    let [x, y, z] = sample.gradient;
    (x * x + y * y + z * z).sqrt()
}

/// The slopes at many points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Count {
    /// How many points there are.
    pub points: usize,
    /// Those at which the field is steeper than its bound.
    pub steep: usize,
    /// Those at which it is less than half as steep.
    pub slow: usize,
    /// Those at which the slope is not a number.
    pub unknown: usize,
    /// The largest slope, and the point where it is.
    pub steepest: f32,
    /// That point.
    pub place: [f32; 3],
}

/// Counts slopes. `samples` are what an engine gave for the points.
pub fn count(points: &[[f32; 3]], samples: &[Sample], bound: f32) -> Count {
    let mut count = Count::default();
    for (&point, sample) in points.iter().zip(samples) {
        count.points += 1;
        match slope(sample, bound) {
            Slope::Good => {}
            Slope::Slow => count.slow += 1,
            Slope::Steep => count.steep += 1,
            Slope::Unknown => count.unknown += 1,
        }
        let steepness = steepness(sample);
        if steepness > count.steepest {
            (count.steepest, count.place) = (steepness, point);
        }
    }
    count
}

/// The colours of the marks: of slopes that are too steep, that are slow, and that are no numbers.
pub const MARKS: [[u8; 4]; 3] = [[224, 16, 48, 255], [122, 72, 214, 255], [208, 0, 111, 255]];

/// How much a mark hides.
const STRONG: f32 = 0.85;
const FAINT: f32 = 0.3;

/// Marks slopes in a picture: red where they are too steep, a faint violet where they are slow.
pub fn draw(picture: &mut [u8], pixels: &[u32], samples: &[Sample], bound: f32) {
    for (&pixel, sample) in pixels.iter().zip(samples) {
        let (ink, share) = match slope(sample, bound) {
            Slope::Good => continue,
            Slope::Steep => (STEEP, STRONG),
            Slope::Slow => (TOO_FLAT, FAINT),
            Slope::Unknown => (NOT_A_NUMBER, STRONG),
        };
        lay(picture, pixel as usize, ink, share);
    }
}

const STEEP: Color = hex(0xe01030);
const TOO_FLAT: Color = hex(0x7a48d6);
const NOT_A_NUMBER: Color = hex(0xd0006f);
