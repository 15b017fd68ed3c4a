//! The largest slope and the largest value of noise: a proof for any assignment of gradients to the corners
//! of a cell.
//!
//! Let p be a position in the cell. Along a direction u, the slope of the noise there is the sum over the
//! corners c of g · M u. Here g is the corner's gradient and M = w·1 + (p − c) ∇wᵀ, with the corner's
//! weight w. The gradients are the twelve directions to the edges of a cube. So g · v is at most the sum of
//! the two largest components of v, over √2. Let F(p, u) be the sum of these bounds over the corners. The
//! largest F over all positions and unit directions bounds the slope.
//!
//! A cell is symmetric. It suffices to consider p in an eighth of it, and directions along (1, s, t) with s
//! and t in [-1, 1]. The positions are subdivided into boxes until the bound holds on each. On a box of
//! positions, the entries of M, which are products of functions of one coordinate each, are ranges. On a box
//! of directions, F is largest at a corner, since it is convex in u. (Rounding, at 1e-15, is negligible
//! against the margin of a hundredth.)

use crate::fixture::Random;
use sdfc_vm::elementary::perlin;
use sdfc_vm::interval::{MAX_NOISE_SLOPE, MAX_NOISE_STEEPNESS};
use sdfc_vm::vector::V3;
use std::f64::consts::FRAC_1_SQRT_2;

/// The smallest and the largest value of a quantity.
type Range = [f64; 2];

/// The weight of a high corner; below, its first and its second derivative.
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}
fn slope(t: f64) -> f64 {
    30.0 * (t * (t - 1.0)).powi(2)
}
fn bend(t: f64) -> f64 {
    60.0 * t * (t - 1.0) * (2.0 * t - 1.0)
}

fn times(a: Range, b: Range) -> Range {
    let products = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
    [
        products.into_iter().fold(f64::INFINITY, f64::min),
        products.into_iter().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// Returns the range of a function from its value at the centre and a bound of its derivative.
fn around(f: impl Fn(f64) -> f64, [low, high]: Range, derivative: f64) -> Range {
    let (middle, radius) = (f((low + high) / 2.0), derivative * (high - low) / 2.0);
    [middle - radius, middle + radius]
}

/// The factors of the entries of M along one axis, for the low and the high corner. They are the weight, its
/// derivative, the weight times p − c, and the derivative of that.
struct Axis {
    weight: [Range; 2],
    change: [Range; 2],
    arm: [Range; 2],
    arm_change: [Range; 2],
}

impl Axis {
    /// Returns the factors for p in a range within [0, 0.5], where `fade` and `slope` increase.
    fn over(p: Range) -> Self {
        let [low, high] = p;
        let weight = |t: f64, c: f64| if c == 1.0 { fade(t) } else { 1.0 - fade(t) };
        let sign = |c: f64| 2.0 * c - 1.0;
        let (w, d) = ([fade(low), fade(high)], [slope(low), slope(high)]);
        // The bend is largest here.
        let crest = 0.5 - 12.0_f64.sqrt().recip();
        let ends = [bend(low), bend(high)];
        let top = if low < crest && crest < high {
            bend(crest)
        } else {
            ends[0].max(ends[1])
        };
        let bends = [ends[0].min(ends[1]), top];
        let arm_change = [0.0, 1.0].map(|c| {
            // Its derivative is ±(2 · slope + bend · (p − c)).
            let second = times(bends, [low - c, high - c]);
            let bound = (2.0 * d[0] + second[0])
                .abs()
                .max((2.0 * d[1] + second[1]).abs());
            around(|t| weight(t, c) + sign(c) * slope(t) * (t - c), p, bound)
        });
        let arm = [0.0, 1.0].map(|c| {
            let [a, b] = arm_change[c as usize];
            around(|t| weight(t, c) * (t - c), p, a.abs().max(b.abs()))
        });
        Self {
            weight: [[1.0 - w[1], 1.0 - w[0]], w],
            change: [[-d[1], -d[0]], d],
            arm,
            arm_change,
        }
    }
}

/// The matrices M of the eight corners.
type Matrices = [[[Range; 3]; 3]; 8];

fn matrices(places: [Range; 3]) -> Matrices {
    let axes = places.map(Axis::over);
    std::array::from_fn(|corner| {
        let side = |i: usize| corner >> i & 1;
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if i == j {
                    let others = [(i + 1) % 3, (i + 2) % 3].map(|k| axes[k].weight[side(k)]);
                    times(times(others[0], others[1]), axes[i].arm_change[side(i)])
                } else {
                    let k = 3 - i - j;
                    let both = times(axes[j].change[side(j)], axes[i].arm[side(i)]);
                    times(both, axes[k].weight[side(k)])
                }
            })
        })
    })
}

/// Returns an upper bound of g · v, given the magnitudes of the components of v.
fn along_gradient([x, y, z]: [f64; 3]) -> f64 {
    (x + y).max((y + z).max(z + x)) * FRAC_1_SQRT_2
}

/// Returns an upper bound of F(p, u).
fn steepest(corners: &Matrices, u: [f64; 3]) -> f64 {
    let mut sum = 0.0;
    for rows in corners {
        let v = rows.map(|row| {
            let (mut low, mut high) = (0.0, 0.0);
            for (entry, u) in row.iter().zip(u) {
                let (a, b) = (entry[0] * u, entry[1] * u);
                (low, high) = (low + a.min(b), high + a.max(b));
            }
            f64::max(-low, high)
        });
        sum += along_gradient(v);
    }
    sum
}

fn halves([low, high]: Range) -> [Range; 2] {
    let middle = (low + high) / 2.0;
    [[low, middle], [middle, high]]
}

/// Reports whether F(p, u) is at most `bound` for all directions of a box, subdivided at most `depth` times.
fn holds(corners: &Matrices, s: Range, t: Range, bound: f64, depth: u32) -> bool {
    let at = |s: f64, t: f64| steepest(corners, [1.0, s, t]);
    let nearest = |r: Range| {
        if r[0] * r[1] <= 0.0 {
            0.0
        } else {
            r[0].abs().min(r[1].abs())
        }
    };
    let length = |s: f64, t: f64| (1.0 + s * s + t * t).sqrt();
    let shortest = length(nearest(s), nearest(t));
    if s.into_iter()
        .all(|s| t.into_iter().all(|t| at(s, t) <= bound * shortest))
    {
        return true;
    }
    let middle = |r: Range| (r[0] + r[1]) / 2.0;
    let (m, n) = (middle(s), middle(t));
    // Where a single direction fails, subdivision does not help.
    depth > 0
        && at(m, n) <= bound * length(m, n)
        && halves(s).into_iter().all(|s| {
            halves(t)
                .into_iter()
                .all(|t| holds(corners, s, t, bound, depth - 1))
        })
}

#[test]
fn noise_is_no_steeper_than_its_bound() {
    let mut pending = vec![[[0.0, 0.5]; 3]];
    let mut boxes = 0;
    while let Some(places) = pending.pop() {
        boxes += 1;
        assert!(boxes < 100_000, "no proof at {places:?}");
        let corners = matrices(places);
        if holds(&corners, [-1.0, 1.0], [-1.0, 1.0], MAX_NOISE_STEEPNESS, 4) {
            continue;
        }
        let size = |i: usize| places[i][1] - places[i][0];
        let widest = if size(0) >= size(1).max(size(2)) {
            0
        } else if size(1) >= size(2) {
            1
        } else {
            2
        };
        for half in halves(places[widest]) {
            let mut part = places;
            part[widest] = half;
            pending.push(part);
        }
    }
    // The slope along an axis is at most that in any direction.
    const { assert!(MAX_NOISE_SLOPE >= MAX_NOISE_STEEPNESS) };
}

/// The value is the sum over the corners of the weight times g · (p − c).
#[test]
fn noise_is_never_higher_than_one() {
    let mut pending = vec![[[0.0, 0.5]; 3]];
    while let Some(places) = pending.pop() {
        let axes = places.map(Axis::over);
        let height: f64 = (0..8)
            .map(|corner: usize| {
                let side = |i: usize| corner >> i & 1;
                let weight = |i: usize| axes[i].weight[side(i)][1];
                let deviation = |i: usize| match side(i) {
                    0 => places[i][1],
                    _ => 1.0 - places[i][0],
                };
                weight(0)
                    * weight(1)
                    * weight(2)
                    * along_gradient([deviation(0), deviation(1), deviation(2)])
            })
            .sum();
        if height > 1.0 {
            assert!(places[0][1] - places[0][0] > 1e-3, "no proof at {places:?}");
            for corner in 0..8_usize {
                pending.push(std::array::from_fn(|i| halves(places[i])[corner >> i & 1]));
            }
        }
    }
}

/// The proved bounds hold for the actual noise, and are close to its extremes.
#[test]
fn noise_comes_near_to_its_bounds() {
    let mut random = Random::new(50);
    let (mut steepest, mut highest) = (0.0_f64, 0.0_f64);
    for _ in 0..200_000 {
        // The steepest positions are in the middle of cells.
        let (cell, inner) = (random.point(5000.0), random.point(0.15));
        let [x, y, z] = [0, 1, 2].map(|i| cell[i].floor() + 0.5 + inner[i]);
        let (value, slope) = perlin::<f64>(V3::new(x, y, z), 3.0);
        steepest = steepest.max(slope.x.hypot(slope.y).hypot(slope.z));
        highest = highest.max(value.abs());
    }
    assert!(steepest <= MAX_NOISE_STEEPNESS, "{steepest}");
    assert!(steepest > 0.8 * MAX_NOISE_STEEPNESS, "{steepest}");
    assert!(highest < 1.0, "{highest}");
}

/// Returns the index of an edge's direction, of twelve.
fn direction(cell: [i32; 3], seed: i32) -> usize {
    let [x, y, z] = sdfc_vm::elementary::edge(cell.map(|c| c as f32), seed as f32);
    let axis = ((x - 1.0) * 3.0) as usize;
    axis * 4 + usize::from(y < 0.0) * 2 + usize::from(z < 0.0)
}

/// Directions of corners are independent of those of neighbouring corners and of other seeds. The pairs of
/// directions are distributed evenly, by Pearson's test with 143 degrees of freedom. For 200 tests of
/// random numbers, the probability of a largest value above 260 is about one in a million.
#[test]
fn directions_of_corners_are_independent_of_each_other() {
    const SIDE: i32 = 48;
    let mut shifts = vec![];
    for x in -3..=3 {
        for y in -3..=3 {
            for z in 0..=3 {
                if (z, y, x) > (0, 0, 0) {
                    shifts.push([x, y, z, 0]);
                }
            }
        }
    }
    shifts.extend([1, 2, 7, 100].map(|seed| [0, 0, 0, seed]));
    for start in [[-24; 3], [1000, -7, 90_000]] {
        for shift in &shifts {
            let mut pairs = [[0_u32; 12]; 12];
            for index in 0..SIDE.pow(3) {
                let step = [index % SIDE, index / SIDE % SIDE, index / SIDE / SIDE];
                let cell = [0, 1, 2].map(|i| start[i] + step[i]);
                let other = [0, 1, 2].map(|i| cell[i] + shift[i]);
                pairs[direction(cell, 5)][direction(other, 5 + shift[3])] += 1;
            }
            let expected = f64::from(SIDE.pow(3)) / 144.0;
            let deviation = |count: &u32| (f64::from(*count) - expected).powi(2) / expected;
            let statistic: f64 = pairs.iter().flatten().map(deviation).sum();
            assert!(statistic < 260.0, "{start:?}, {shift:?}: {statistic}");
        }
    }
}
