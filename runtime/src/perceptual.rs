//! How different two pictures look to a person who flips between them: ꟻLIP, by P. Andersson and
//! others, *ꟻLIP: A Difference Evaluator for Alternating Images* (2020), for pictures of bytes.
//!
//! Both pictures are blurred as the eye blurs them at a viewing distance, in an opponent colour
//! space with a contrast sensitivity of its own for each channel; colours are then compared in a
//! space where equal distances look equally different (L\*a\*b\* with Hunt's adjustment, and the
//! HyAB distance). Edges and points that are in one picture only make a difference larger. The
//! result is 0 where nothing can be seen, and 1 for the largest difference there is, that of pure
//! green and pure blue. All constants are those of the paper.

use crate::crew::share;
use serde::Serialize;

/// How many pixels a degree of the visual field has: a 0.7 m wide screen of 3,840 pixels, seen from
/// 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

/// What the difference of two pictures comes to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Difference {
    /// The mean over all pixels, from 0 to 1.
    pub mean: f64,
    /// That of the pixel that differs most.
    pub max: f64,
}

impl Difference {
    /// Of the differences of pixels; none differ by nothing.
    pub fn of(pixels: &[f64]) -> Self {
        Self {
            mean: pixels.iter().sum::<f64>() / pixels.len().max(1) as f64,
            max: pixels.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// The difference of each pixel, row after row, of two pictures with so many pixels in a row: red,
/// green, blue and alpha bytes in sRGB, alpha being left out of it. What one of them lacks is not
/// compared.
pub fn difference(width: usize, reference: &[u8], picture: &[u8]) -> Vec<f64> {
    let row = 4 * width.max(1);
    let height = reference.len().min(picture.len()) / row;
    let (a, b) = (&reference[..height * row], &picture[..height * row]);
    let [a, b] = [a, b].map(|bytes| Seen::of(width.max(1), bytes));
    let largest = hyab(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0])).powf(COLOR_EXPONENT);
    let pixel = |at: usize| {
        let color = hyab(a.lab[at], b.lab[at]).powf(COLOR_EXPONENT);
        let edges = (a.edges[at] - b.edges[at]).abs();
        let points = (a.points[at] - b.points[at]).abs();
        let feature = (edges.max(points) / 2.0_f64.sqrt())
            .powf(FEATURE_EXPONENT)
            .min(1.0);
        stretched(color, largest).powf(1.0 - feature)
    };
    (0..height * width).map(pixel).collect()
}

/// The exponent of colour distances.
const COLOR_EXPONENT: f64 = 0.7;
/// The exponent of differences of edges and points.
const FEATURE_EXPONENT: f64 = 0.5;
/// Colour distances up to this share of the largest one
const KNEE: f64 = 0.4;
/// fill so much of the range.
const BELOW_KNEE: f64 = 0.95;
/// How wide the detectors of edges and points are, in degrees.
const FEATURE_WIDTH: f64 = 0.082;

/// A picture as the eye sees it; all lists are by pixels.
struct Seen {
    /// The blurred colours, in L\*a\*b\* with Hunt's adjustment.
    lab: Vec<[f64; 3]>,
    /// How strong an edge there is.
    edges: Vec<f64>,
    /// How strong a point or line.
    points: Vec<f64>,
}

impl Seen {
    fn of(width: usize, bytes: &[u8]) -> Self {
        let opponent: Vec<[f64; 3]> = bytes
            .chunks_exact(4)
            .map(|pixel| to_opponent([pixel[0], pixel[1], pixel[2]].map(linear)))
            .collect();
        let channel = |i: usize| Plane {
            width,
            values: opponent.iter().map(|color| color[i]).collect(),
        };
        // Two of the channels are blurred by one bell curve, the third by the sum of two.
        let [y, cx, cz] = [
            blurred(&channel(0), &[(1.0, 0.0047)]),
            blurred(&channel(1), &[(1.0, 0.0053)]),
            blurred(&channel(2), &[(34.1, 0.04), (13.5, 0.025)]),
        ];
        let lab = (0..opponent.len())
            .map(|at| hunt(from_opponent([y[at], cx[at], cz[at]]).map(|v| v.clamp(0.0, 1.0))))
            .collect();
        let mut grey = channel(0);
        for value in &mut grey.values {
            *value = (*value + 16.0) / 116.0;
        }
        let bell = Detector::of();
        Self {
            lab,
            edges: bell.strength(&grey, &bell.edge),
            points: bell.strength(&grey, &bell.point),
        }
    }
}

/// One channel of a picture.
struct Plane {
    width: usize,
    values: Vec<f64>,
}

impl Plane {
    /// Each row, then each column, weighted by a kernel of odd length around each pixel; beyond its
    /// edges the picture goes on as it ends.
    fn filtered(&self, across: &[f64], down: &[f64]) -> Vec<f64> {
        let (width, height) = (self.width, self.values.len() / self.width);
        let near = |at: usize, offset: usize, radius: usize, count: usize| {
            (at + offset).saturating_sub(radius).min(count - 1)
        };
        let rows = share(
            height,
            || (),
            |(), y| {
                let row = &self.values[y * width..(y + 1) * width];
                let value = |x| {
                    let weighted = across.iter().enumerate();
                    let radius = across.len() / 2;
                    weighted
                        .map(|(i, weight)| weight * row[near(x, i, radius, width)])
                        .sum::<f64>()
                };
                (0..width).map(value).collect::<Vec<f64>>()
            },
        );
        let columns = share(
            height,
            || (),
            |(), y| {
                let mut sums = vec![0.0; width];
                for (i, weight) in down.iter().enumerate() {
                    let row = &rows[near(y, i, down.len() / 2, height)];
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

/// A channel blurred by a sum of bell curves: for each its weight, and its width as the contrast
/// sensitivity function has it.
fn blurred(plane: &Plane, curves: &[(f64, f64)]) -> Vec<f64> {
    const WIDEST: f64 = 0.04;
    let pi = std::f64::consts::PI;
    let radius = (3.0 * (WIDEST / 2.0).sqrt() / pi * PIXELS_PER_DEGREE).ceil() as i32;
    let bell = |width: f64| -> Vec<f64> {
        (-radius..=radius)
            .map(|i| {
                let degrees = f64::from(i) / PIXELS_PER_DEGREE;
                (-(pi * degrees).powi(2) / width).exp()
            })
            .collect()
    };
    let mut result = vec![0.0; plane.values.len()];
    let mut whole = 0.0;
    for &(weight, width) in curves {
        let (bell, weight) = (bell(width), weight * (pi / width).sqrt());
        whole += weight * bell.iter().sum::<f64>().powi(2);
        for (sum, value) in result.iter_mut().zip(plane.filtered(&bell, &bell)) {
            *sum += weight * value;
        }
    }
    for value in &mut result {
        *value /= whole;
    }
    result
}

/// What finds edges and points: the first and the second derivative of a bell curve along one axis,
/// and the curve itself along the other.
struct Detector {
    bell: Vec<f64>,
    edge: Vec<f64>,
    point: Vec<f64>,
}

impl Detector {
    fn of() -> Self {
        let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let radius = (3.0 * deviation).ceil() as i32;
        let places = || (-radius..=radius).map(|i| f64::from(i) / deviation);
        let bell = |x: f64| (-x * x / 2.0).exp();
        let sum: f64 = places().map(bell).sum();
        Self {
            bell: places().map(|x| bell(x) / sum).collect(),
            edge: balanced(places().map(|x| -x * bell(x)).collect()),
            point: balanced(places().map(|x| (x * x - 1.0) * bell(x)).collect()),
        }
    }

    /// How strongly each pixel answers to a derivative, along both axes together.
    fn strength(&self, plane: &Plane, derivative: &[f64]) -> Vec<f64> {
        let across = plane.filtered(derivative, &self.bell);
        let down = plane.filtered(&self.bell, derivative);
        across.iter().zip(down).map(|(x, y)| x.hypot(y)).collect()
    }
}

/// A kernel whose positive weights sum to 1 and whose negative ones to −1.
fn balanced(weights: Vec<f64>) -> Vec<f64> {
    let positive: f64 = weights.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = weights.iter().filter(|w| **w < 0.0).sum();
    let scaled = |w: f64| if w > 0.0 { w / positive } else { -w / negative };
    weights.into_iter().map(scaled).collect()
}

/// A colour distance from 0 to 1: small ones take most of the range.
fn stretched(distance: f64, largest: f64) -> f64 {
    let knee = KNEE * largest;
    if distance < knee {
        distance * BELOW_KNEE / knee
    } else {
        BELOW_KNEE + (distance - knee) / (largest - knee) * (1.0 - BELOW_KNEE)
    }
}

/// The distance of two colours of L\*a\*b\*: lightness and colour each by themselves.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// A colour of linear light in L\*a\*b\*, in which what is dark has less colour.
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

/// Linear light from a byte of sRGB.
fn linear(byte: u8) -> f64 {
    let v = f64::from(byte) / 255.0;
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// From linear sRGB to XYZ, white being (0.950…, 1, 1.088…).
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

/// XYZ as shares of white.
fn to_xyz(linear: [f64; 3]) -> [f64; 3] {
    TO_XYZ.map(|row| {
        let sum: f64 = row.iter().zip(linear).map(|(m, v)| m * v).sum();
        sum / row.iter().sum::<f64>()
    })
}

/// Lightness, red against green, and blue against yellow: a linearized L\*a\*b\*.
fn to_opponent(linear: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = to_xyz(linear);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The linear light of an opponent colour.
fn from_opponent([lightness, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (lightness + 16.0) / 116.0;
    let (x, z) = (y + cx / 500.0, y - cz / 200.0);
    let xyz: [f64; 3] = {
        let white = TO_XYZ.map(|row| row.iter().sum::<f64>());
        [x * white[0], y * white[1], z * white[2]]
    };
    solved(&TO_XYZ, xyz)
}

/// The vector that a matrix takes to this one, by Cramer's rule.
fn solved(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    let determinant = |m: &[[f64; 3]; 3]| {
        let minor = |i: usize, j: usize| m[1][i] * m[2][j] - m[1][j] * m[2][i];
        m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
    };
    let whole = determinant(m);
    std::array::from_fn(|column| {
        let mut replaced = *m;
        for (row, value) in replaced.iter_mut().zip(v) {
            row[column] = value;
        }
        determinant(&replaced) / whole
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
        Difference::of(&difference(WIDTH, a, b)).mean
    }

    /// Stripes and a square, with this much of grey around the middle one.
    fn pattern(contrast: u8) -> Vec<u8> {
        let pixels = (0..WIDTH * WIDTH).flat_map(|at| {
            let (x, y) = (at % WIDTH, at / WIDTH);
            let lit = (x / 5 + y / 7) % 2 == 0;
            let grey = if lit { 120 + contrast } else { 120 - contrast };
            [grey, grey, 120, 255]
        });
        pixels.collect()
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        for picture in [filled([3, 200, 77]), pattern(90)] {
            let found = Difference::of(&difference(WIDTH, &picture, &picture));
            assert_eq!(found, Difference::default());
        }
        assert_eq!(Difference::of(&[]), Difference::default());
    }

    #[test]
    fn green_and_blue_differ_most() {
        let found = difference(WIDTH, &filled([0, 255, 0]), &filled([0, 0, 255]));
        assert_eq!(found.len(), WIDTH * WIDTH);
        for pixel in found {
            assert!((pixel - 1.0).abs() < 1e-6, "{pixel}");
        }
    }

    /// Black and white are 100 apart. With L\*a\*b\* of green (87.73, −86.18, 83.18) and blue
    /// (32.30, 79.19, −107.86) from textbooks, the largest distance is 203.25: 100^0.7 lies behind
    /// the knee at 0.4 · 203.25^0.7.
    #[test]
    fn black_and_white_are_as_far_apart_as_the_formulas_say() {
        let (distance, largest) = (100.0_f64.powf(0.7), 203.25_f64.powf(0.7));
        let expected = 0.95 + (distance / largest - 0.4) / 0.6 * 0.05;
        let found = mean(&filled([0; 3]), &filled([255; 3]));
        assert!((found - expected).abs() < 1e-3, "{found}, not {expected}");
    }

    #[test]
    fn it_is_the_same_from_both_sides_and_grows_with_a_disturbance() {
        let plain = pattern(40);
        let mut before = 0.0;
        for contrast in [41, 43, 48, 60, 90] {
            let other = pattern(contrast);
            let found = mean(&plain, &other);
            assert!((found - mean(&other, &plain)).abs() < 1e-12);
            assert!(found > before, "{contrast}: {found} after {before}");
            before = found;
        }
    }

    /// A single pixel is blurred by the eye, and an edge that moves is seen where it moved only.
    #[test]
    fn differences_stay_where_they_are() {
        let plain = filled([90; 3]);
        let mut dotted = plain.clone();
        let at = 16 * WIDTH + 16;
        dotted[4 * at..4 * at + 3].fill(255);
        let found = difference(WIDTH, &plain, &dotted);
        let nearest = found[at];
        assert!(nearest > 0.1, "{nearest}");
        assert!(found[0] < 1e-3 * nearest, "{}", found[0]);
        assert!(found.iter().all(|pixel| (0.0..=1.0).contains(pixel)));
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
