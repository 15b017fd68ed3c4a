//! Slopes: where the field breaks its promise, and where it makes rays slow.
//!
//! A march is safe if the field changes no faster than the point moves (`MAX_SLOPE`): what could be
//! steeper is divided by a bound. Where it does all the same, the scene states a
//! bound that does not hold (`lipschitz:`), or none could be found, and rays may step over a surface.
//! There are two tests of that: how long the gradient is at a point, and how far the values of
//! neighbouring points are apart, which also tells of jumps, as at the seam of a repetition.
//!
//! Where the gradient is less than half as long as the bound, rays take more than twice the steps that
//! they would have to.

use super::Asked;
use super::ink::{Color, bytes, hex, lay};
use sdfc_runtime::engine::Sample;

/// The bound of every field's slope.
const MAX_SLOPE: f32 = 1.0;
/// A gradient in `f32` is off by less than this share of the bound: it is made of sums of slopes none
/// of which is much larger than the bound.
const ROUNDING: f32 = 1e-3;
/// A value in `f32` is off by less than this share of its coordinates and of itself.
const ROUNDING_OF_VALUES: f32 = 4e-6;
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
    /// Not too steep here, but the value at a neighbouring point is farther off than the bound allows.
    Jump,
    /// Not a number.
    Unknown,
}

impl Slope {
    /// What the slope at a point is by its gradient.
    fn of(sample: &Sample) -> Self {
        let steepness = steepness(sample);
        if !steepness.is_finite() || !sample.distance.is_finite() {
            Self::Unknown
        } else if steepness > MAX_SLOPE * (1.0 + ROUNDING) {
            Self::Steep
        } else if steepness < MAX_SLOPE * SLOW {
            Self::Slow
        } else {
            Self::Good
        }
    }
}

/// How fast the field changes at a point, per unit of the way.
pub fn steepness(sample: &Sample) -> f32 {
    let [x, y, z] = sample.gradient;
    (x * x + y * y + z * z).sqrt()
}

/// The slopes at many points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Slopes {
    /// What the slope is at each point.
    pub slopes: Vec<Slope>,
    /// How many there are of each kind.
    pub count: Count,
}

/// How many slopes are what.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Count {
    /// How many points there are.
    pub points: usize,
    /// Those at which the field is steeper than its bound.
    pub steep: usize,
    /// Those between which and a neighbour it changes by more than the bound allows.
    pub jumps: usize,
    /// Those at which it is less than half as steep.
    pub slow: usize,
    /// Those at which it is not a number.
    pub unknown: usize,
    /// The largest slope at a point.
    pub steepest: f32,
    /// The point where that is.
    pub place: [f32; 3],
}

/// Compares slopes with the bound. `samples` are what an engine gave for the
/// points; a row of the picture has `width` pixels.
pub fn slopes(asked: &Asked, samples: &[Sample], width: usize) -> Slopes {
    let mut slopes: Vec<Slope> = samples
        .iter()
        .take(asked.points.len())
        .map(Slope::of)
        .collect();
    for i in 0..slopes.len() {
        for neighbour in neighbours(asked, i, width).into_iter().flatten() {
            let known = neighbour < slopes.len();
            if known && jumps([i, neighbour].map(|i| (asked.points[i], samples[i]))) {
                for end in [i, neighbour] {
                    if matches!(slopes[end], Slope::Good | Slope::Slow) {
                        slopes[end] = Slope::Jump;
                    }
                }
            }
        }
    }
    let mut count = Count {
        points: slopes.len(),
        ..Count::default()
    };
    for ((slope, sample), &point) in slopes.iter().zip(samples).zip(&asked.points) {
        match slope {
            Slope::Good => {}
            Slope::Slow => count.slow += 1,
            Slope::Steep => count.steep += 1,
            Slope::Jump => count.jumps += 1,
            Slope::Unknown => count.unknown += 1,
        }
        let steepness = steepness(sample);
        if steepness > count.steepest {
            (count.steepest, count.place) = (steepness, point);
        }
    }
    Slopes { slopes, count }
}

/// The points at the pixels on the right and below, where there are any.
fn neighbours(asked: &Asked, i: usize, width: usize) -> [Option<usize>; 2] {
    let here = asked.pixels[i] as usize;
    let right = asked.pixels.get(i + 1).map(|&pixel| pixel as usize);
    let is_last = width == 0 || here % width == width - 1;
    let right = (!is_last && right == Some(here + 1)).then_some(i + 1);
    // Pixels rise, so the one below is at most a row's width further on.
    let rest = asked.pixels.get(i + 1..).unwrap_or_default();
    let rest = rest.get(..width.min(rest.len())).unwrap_or_default();
    let below = rest.binary_search(&((here + width) as u32));
    [right, below.ok().map(|at| i + 1 + at)]
}

/// Whether the values at two points are farther apart than the bound allows.
fn jumps([a, b]: [([f32; 3], Sample); 2]) -> bool {
    let way = (0..3)
        .map(|i| (a.0[i] - b.0[i]).powi(2))
        .sum::<f32>()
        .sqrt();
    let apart = (a.1.distance - b.1.distance).abs();
    let numbers = a.0.iter().chain(&b.0).chain([&a.1.distance, &b.1.distance]);
    let largest = numbers.fold(0.0_f32, |most, v| most.max(v.abs()));
    apart > MAX_SLOPE * way * (1.0 + ROUNDING) + largest * ROUNDING_OF_VALUES
}

/// How much a mark hides.
const STRONG: f32 = 0.85;
const FAINT: f32 = 0.3;

const STEEP: Color = hex(0xe01030);
const JUMP: Color = hex(0xff7a00);
const TOO_FLAT: Color = hex(0x7a48d6);
const NOT_A_NUMBER: Color = hex(0xd0006f);

impl Slope {
    /// The colour of its mark, if it has one, and how much that hides.
    fn mark(self) -> Option<(Color, f32)> {
        match self {
            Self::Good => None,
            Self::Slow => Some((TOO_FLAT, FAINT)),
            Self::Steep => Some((STEEP, STRONG)),
            Self::Jump => Some((JUMP, STRONG)),
            Self::Unknown => Some((NOT_A_NUMBER, STRONG)),
        }
    }

    /// The colour of its mark, for a legend.
    pub fn color(self) -> Option<[u8; 4]> {
        self.mark().map(|(color, _)| bytes(color))
    }
}

impl Slopes {
    /// Marks slopes in a picture: red where they are too steep, orange where the field jumps, a faint
    /// violet where it is slow.
    pub fn draw(&self, picture: &mut [u8], asked: &Asked) {
        for (&pixel, slope) in asked.pixels.iter().zip(&self.slopes) {
            if let Some((ink, share)) = slope.mark() {
                lay(picture, pixel as usize, ink, share);
            }
        }
    }
}
