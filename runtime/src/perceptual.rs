//! Perceived difference of two images when a viewer flips between them: ꟻLIP, by P. Andersson and others,
//! *ꟻLIP: A Difference Evaluator for Alternating Images* (2020), for images of bytes.
//!
//! Both images are blurred like the human eye does at a viewing distance. That is done in an opponent colour
//! space, with a separate contrast sensitivity for each channel. Colours are then compared in a space where
//! equal distances look equally different (L\*a\*b\* with Hunt's adjustment, and the HyAB distance). Edges
//! and points that exist in only one image increase a difference. The result is 0 for an invisible
//! difference, and 1 for the largest possible one, that of pure green and pure blue. All constants are those
//! of the paper.

use crate::work_stealing::parallel_map_with;
use serde::Serialize;

/// Pixels per degree of the visual field: a 0.7 m wide screen of 3,840 pixels, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

/// Summary of the perceived difference of two images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PerceptualDifference {
    /// The mean over all pixels, from 0 to 1.
    pub mean: f64,
    /// The maximum over all pixels.
    pub max: f64,
}

impl PerceptualDifference {
    /// Summarizes the differences of pixels; 0 for an empty list.
    pub fn from_pixels(pixels: &[f64]) -> Self {
        Self {
            mean: pixels.iter().sum::<f64>() / pixels.len().max(1) as f64,
            max: pixels.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// Returns the difference of each pixel, from 0 to 1 and row by row, of two images with `width` pixels in a row.
/// The images are red, green, blue and alpha bytes in sRGB. Alpha is ignored. Rows that one of the images lacks
/// are not compared.
pub fn pixel_differences(width: usize, reference: &[u8], image: &[u8]) -> Vec<f64> {
    let row = 4 * width.max(1);
    let height = reference.len().min(image.len()) / row;
    let (a, b) = (&reference[..height * row], &image[..height * row]);
    let [a, b] = [a, b].map(|bytes| PerceivedImage::new(width.max(1), bytes));
    let largest = hyab(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0])).powf(COLOR_EXPONENT);
    let pixel = |index: usize| {
        let color = hyab(a.lab[index], b.lab[index]).powf(COLOR_EXPONENT);
        let edges = (a.edges[index] - b.edges[index]).abs();
        let points = (a.points[index] - b.points[index]).abs();
        let feature = (edges.max(points) / 2.0_f64.sqrt())
            .powf(FEATURE_EXPONENT)
            .min(1.0);
        compressed(color, largest).powf(1.0 - feature)
    };
    (0..height * width).map(pixel).collect()
}

/// The exponent of colour distances.
const COLOR_EXPONENT: f64 = 0.7;
/// The exponent of differences of edges and points.
const FEATURE_EXPONENT: f64 = 0.5;
/// Fraction of the largest colour distance up to which a distance is small.
const KNEE_FRACTION: f64 = 0.4;
/// Fraction of the range to which small distances are mapped.
const KNEE_OUTPUT: f64 = 0.95;
/// Width of the detectors of edges and points, in degrees.
const FEATURE_WIDTH_DEGREES: f64 = 0.082;

/// An image as perceived by a viewer. All lists are by pixels.
struct PerceivedImage {
    /// The blurred colours, in L\*a\*b\* with Hunt's adjustment.
    lab: Vec<[f64; 3]>,
    /// Strength of an edge.
    edges: Vec<f64>,
    /// Strength of a point or line.
    points: Vec<f64>,
}

impl PerceivedImage {
    fn new(width: usize, bytes: &[u8]) -> Self {
        let opponent: Vec<[f64; 3]> = bytes
            .chunks_exact(4)
            .map(|pixel| to_opponent([pixel[0], pixel[1], pixel[2]].map(linear)))
            .collect();
        let channel = |i: usize| Channel {
            width,
            values: opponent.iter().map(|color| color[i]).collect(),
        };
        // Two of the channels are blurred by one Gaussian, the third by the sum of two.
        let [y, cx, cz] = [
            blurred(&channel(0), &[(1.0, 0.0047)]),
            blurred(&channel(1), &[(1.0, 0.0053)]),
            blurred(&channel(2), &[(34.1, 0.04), (13.5, 0.025)]),
        ];
        let lab = (0..opponent.len())
            .map(|index| {
                hunt(from_opponent([y[index], cx[index], cz[index]]).map(|v| v.clamp(0.0, 1.0)))
            })
            .collect();
        let mut grey = channel(0);
        for value in &mut grey.values {
            *value = (*value + 16.0) / 116.0;
        }
        let detector = FeatureDetector::new();
        Self {
            lab,
            edges: detector.strength(&grey, &detector.edge),
            points: detector.strength(&grey, &detector.point),
        }
    }
}

/// One channel of an image.
struct Channel {
    width: usize,
    values: Vec<f64>,
}

impl Channel {
    /// Filters each row, then each column, by an odd number of weights around each pixel. Beyond the border
    /// the border pixels are repeated.
    fn filtered(&self, across: &[f64], down: &[f64]) -> Vec<f64> {
        let (width, height) = (self.width, self.values.len() / self.width);
        let clamped_index = |index: usize, offset: usize, radius: usize, count: usize| {
            (index + offset).saturating_sub(radius).min(count - 1)
        };
        let rows = parallel_map_with(
            height,
            || (),
            |(), y| {
                let row = &self.values[y * width..(y + 1) * width];
                let value = |x| {
                    let weighted = across.iter().enumerate();
                    let radius = across.len() / 2;
                    weighted
                        .map(|(i, weight)| weight * row[clamped_index(x, i, radius, width)])
                        .sum::<f64>()
                };
                (0..width).map(value).collect::<Vec<f64>>()
            },
        );
        let columns = parallel_map_with(
            height,
            || (),
            |(), y| {
                let mut sums = vec![0.0; width];
                for (i, weight) in down.iter().enumerate() {
                    let row = &rows[clamped_index(y, i, down.len() / 2, height)];
                    for (sum, value) in sums.iter_mut().zip(row) {
                        *sum += weight * value;
                    }
                }
                sums
            },
        );
        columns.concat()
    }
}

/// Blurs a channel by a sum of Gaussians. Each has a weight, and a width as defined by the contrast sensitivity
/// function.
fn blurred(channel: &Channel, curves: &[(f64, f64)]) -> Vec<f64> {
    const MAX_WIDTH: f64 = 0.04;
    let pi = std::f64::consts::PI;
    let radius = (3.0 * (MAX_WIDTH / 2.0).sqrt() / pi * PIXELS_PER_DEGREE).ceil() as i32;
    let bell = |width: f64| -> Vec<f64> {
        (-radius..=radius)
            .map(|i| {
                let degrees = f64::from(i) / PIXELS_PER_DEGREE;
                (-(pi * degrees).powi(2) / width).exp()
            })
            .collect()
    };
    let mut result = vec![0.0; channel.values.len()];
    let mut total_weight = 0.0;
    for &(weight, width) in curves {
        let (bell, weight) = (bell(width), weight * (pi / width).sqrt());
        total_weight += weight * bell.iter().sum::<f64>().powi(2);
        for (sum, value) in result.iter_mut().zip(channel.filtered(&bell, &bell)) {
            *sum += weight * value;
        }
    }
    for value in &mut result {
        *value /= total_weight;
    }
    result
}

/// Detector of edges and points: the first and the second derivative of a Gaussian along one axis, and the
/// Gaussian itself along the other.
struct FeatureDetector {
    bell: Vec<f64>,
    edge: Vec<f64>,
    point: Vec<f64>,
}

impl FeatureDetector {
    fn new() -> Self {
        let deviation = 0.5 * FEATURE_WIDTH_DEGREES * PIXELS_PER_DEGREE;
        let radius = (3.0 * deviation).ceil() as i32;
        let offsets = || (-radius..=radius).map(|i| f64::from(i) / deviation);
        let bell = |x: f64| (-x * x / 2.0).exp();
        let sum: f64 = offsets().map(bell).sum();
        Self {
            bell: offsets().map(|x| bell(x) / sum).collect(),
            edge: normalized(offsets().map(|x| -x * bell(x)).collect()),
            point: normalized(offsets().map(|x| (x * x - 1.0) * bell(x)).collect()),
        }
    }

    /// Returns the response of each pixel to a derivative, combined over both axes.
    fn strength(&self, channel: &Channel, derivative: &[f64]) -> Vec<f64> {
        let across = channel.filtered(derivative, &self.bell);
        let down = channel.filtered(&self.bell, derivative);
        across.iter().zip(down).map(|(x, y)| x.hypot(y)).collect()
    }
}

/// Scales weights so that the positive ones sum to 1 and the negative ones to −1.
fn normalized(weights: Vec<f64>) -> Vec<f64> {
    let positive: f64 = weights.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = weights.iter().filter(|w| **w < 0.0).sum();
    let scaled = |w: f64| if w > 0.0 { w / positive } else { -w / negative };
    weights.into_iter().map(scaled).collect()
}

/// Maps a colour distance to 0 to 1; small distances take most of the range.
fn compressed(distance: f64, max_distance: f64) -> f64 {
    let knee = KNEE_FRACTION * max_distance;
    if distance < knee {
        distance * KNEE_OUTPUT / knee
    } else {
        KNEE_OUTPUT + (distance - knee) / (max_distance - knee) * (1.0 - KNEE_OUTPUT)
    }
}

/// Returns the HyAB distance of two colours of L\*a\*b\*: the sum of the lightness and the chroma distance.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Converts a colour of linear light to L\*a\*b\*, with less saturation in dark colours.
fn hunt(linear: [f64; 3]) -> [f64; 3] {
    let f = |t: f64| {
        let delta: f64 = 6.0 / 29.0;
        if t > delta.powi(3) {
            t.cbrt()
        } else {
            t / (3.0 * delta * delta) + 4.0 / 29.0
        }
    };
    let [x, y, z] = to_xyz(linear).map(f);
    let lightness = 116.0 * y - 16.0;
    let saturation = 0.01 * lightness;
    [
        lightness,
        saturation * 500.0 * (x - y),
        saturation * 200.0 * (y - z),
    ]
}

/// Converts a byte of sRGB to linear light.
fn linear(byte: u8) -> f64 {
    let v = f64::from(byte) / 255.0;
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// The matrix from linear sRGB to XYZ, with white at (0.950…, 1, 1.088…).
const TO_XYZ: [[f64; 3]; 3] = [
    [
        10_135_552.0 / 24_577_794.0,
        8_788_810.0 / 24_577_794.0,
        4_435_075.0 / 24_577_794.0,
    ],
    [
        2_613_072.0 / 12_288_897.0,
        8_788_810.0 / 12_288_897.0,
        887_015.0 / 12_288_897.0,
    ],
    [
        1_425_312.0 / 73_733_382.0,
        8_788_810.0 / 73_733_382.0,
        70_074_185.0 / 73_733_382.0,
    ],
];

/// Converts linear light to XYZ relative to white.
fn to_xyz(linear: [f64; 3]) -> [f64; 3] {
    TO_XYZ.map(|row| {
        let sum: f64 = row.iter().zip(linear).map(|(m, v)| m * v).sum();
        sum / row.iter().sum::<f64>()
    })
}

/// Converts linear light to lightness, red against green, and blue against yellow: a linearized L\*a\*b\*.
fn to_opponent(linear: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = to_xyz(linear);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Converts an opponent colour to linear light.
fn from_opponent([lightness, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (lightness + 16.0) / 116.0;
    let (x, z) = (y + cx / 500.0, y - cz / 200.0);
    let xyz: [f64; 3] = {
        let white = TO_XYZ.map(|row| row.iter().sum::<f64>());
        [x * white[0], y * white[1], z * white[2]]
    };
    solve(&TO_XYZ, xyz)
}

/// Returns the vector that a matrix maps to this one, by Cramer's rule.
fn solve(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    let determinant = |m: &[[f64; 3]; 3]| {
        let minor = |i: usize, j: usize| m[1][i] * m[2][j] - m[1][j] * m[2][i];
        m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
    };
    let full_determinant = determinant(m);
    std::array::from_fn(|column| {
        let mut replaced = *m;
        for (row, value) in replaced.iter_mut().zip(v) {
            row[column] = value;
        }
        determinant(&replaced) / full_determinant
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 32;

    fn filled(color: [u8; 3]) -> Vec<u8> {
        let [r, g, b] = color;
        [r, g, b, 255].repeat(WIDTH * WIDTH)
    }

    fn mean(a: &[u8], b: &[u8]) -> f64 {
        PerceptualDifference::from_pixels(&pixel_differences(WIDTH, a, b)).mean
    }

    /// Draws stripes and a square, with this contrast around a middle grey.
    fn pattern(contrast: u8) -> Vec<u8> {
        let pixels = (0..WIDTH * WIDTH).flat_map(|index| {
            let (x, y) = (index % WIDTH, index / WIDTH);
            let is_bright = (x / 5 + y / 7) % 2 == 0;
            let grey = if is_bright {
                120 + contrast
            } else {
                120 - contrast
            };
            [grey, grey, 120, 255]
        });
        pixels.collect()
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        for picture in [filled([3, 200, 77]), pattern(90)] {
            let total =
                PerceptualDifference::from_pixels(&pixel_differences(WIDTH, &picture, &picture));
            assert_eq!(total, PerceptualDifference::default());
        }
        assert_eq!(
            PerceptualDifference::from_pixels(&[]),
            PerceptualDifference::default()
        );
    }

    #[test]
    fn green_and_blue_differ_most() {
        let differences = pixel_differences(WIDTH, &filled([0, 255, 0]), &filled([0, 0, 255]));
        assert_eq!(differences.len(), WIDTH * WIDTH);
        for pixel in differences {
            assert!((pixel - 1.0).abs() < 1e-6, "{pixel}");
        }
    }

    /// Black and white have a distance of 100. With L\*a\*b\* of green (87.73, −86.18, 83.18) and blue
    /// (32.30, 79.19, −107.86) from textbooks, the largest distance is 203.25. 100^0.7 lies beyond the knee
    /// at 0.4 · 203.25^0.7.
    #[test]
    fn black_and_white_have_the_difference_of_the_formulas() {
        let (distance, largest) = (100.0_f64.powf(0.7), 203.25_f64.powf(0.7));
        let expected = 0.95 + (distance / largest - 0.4) / 0.6 * 0.05;
        let difference = mean(&filled([0; 3]), &filled([255; 3]));
        assert!(
            (difference - expected).abs() < 1e-3,
            "{difference}, not {expected}"
        );
    }

    #[test]
    fn differences_are_symmetric_and_grow_with_a_disturbance() {
        let reference = pattern(40);
        let mut previous = 0.0;
        for contrast in [41, 43, 48, 60, 90] {
            let other = pattern(contrast);
            let difference = mean(&reference, &other);
            assert!((difference - mean(&other, &reference)).abs() < 1e-12);
            assert!(
                difference > previous,
                "{contrast}: {difference} after {previous}"
            );
            previous = difference;
        }
    }

    /// The eye blurs a single pixel; the difference stays near it.
    #[test]
    fn differences_stay_where_they_are() {
        let reference = filled([90; 3]);
        let mut dotted = reference.clone();
        let index = 16 * WIDTH + 16;
        dotted[4 * index..4 * index + 3].fill(255);
        let differences = pixel_differences(WIDTH, &reference, &dotted);
        let peak = differences[index];
        assert!(peak > 0.1, "{peak}");
        assert!(differences[0] < 1e-3 * peak, "{}", differences[0]);
        assert!(differences.iter().all(|pixel| (0.0..=1.0).contains(pixel)));
    }

    #[test]
    fn colours_come_back_from_the_opponent_space() {
        for color in [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.2, 0.7, 0.05]] {
            let back = from_opponent(to_opponent(color));
            for (a, b) in color.iter().zip(back) {
                assert!((a - b).abs() < 1e-12, "{color:?} became {back:?}");
            }
        }
    }
}
