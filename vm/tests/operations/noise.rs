//! How steep and how high noise can be: a proof, whatever gradients the hash gives to the corners
//! of a cell.
//!
//! Along a direction u, the slope of the noise at the place p in its cell is the sum over the
//! corners c of g · M u, where g is the corner's gradient and M = w·1 + (p − c) ∇wᵀ, with the
//! corner's weight w. The gradients are the twelve directions to the edges of a cube, so g · v is at
//! most the sum of the two largest components of v, over √2. Call the sum of these over the corners
//! F(p, u); the largest F for any place and any direction of length one bounds the slope.
//!
//! A cell is symmetric: it is enough to look at p in an eighth of it and at directions along
//! (1, s, t) with s and t in [-1, 1]. All places are cut into boxes until the bound holds on each.
//! On a box of places the entries of M, which are products of functions of one coordinate each, are
//! ranges; on a box of directions F is largest at a corner, since it is convex in u. (Rounding, at
//! 1e-15, is nothing against the margin of a hundredth.)

use crate::fixture::Random;
use sdfc_vm::elementary::perlin;
use sdfc_vm::interval::{NOISE_SLOPE, NOISE_STEEPNESS};
use sdfc_vm::vector::V3;
use std::f64::consts::FRAC_1_SQRT_2;

/// The smallest and the largest value of something.
type Range = [f64; 2];

/// How the weight of a high corner grows, its derivative, and the derivative's own.
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

/// The range of a function from its value in the middle and a bound of its derivative.
fn around(f: impl Fn(f64) -> f64, [low, high]: Range, derivative: f64) -> Range {
    let (middle, way) = (f((low + high) / 2.0), derivative * (high - low) / 2.0);
    [middle - way, middle + way]
}

/// What the entries of M are made of, along one axis, for the low and the high corner: the weight,
/// its derivative, the weight times p − c, and the derivative of that.
struct Axis {
    weight: [Range; 2],
    change: [Range; 2],
    arm: [Range; 2],
    arm_change: [Range; 2],
}

impl Axis {
    /// For p in a range within [0, 0.5], where `fade` and `slope` grow.
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
            let most = (2.0 * d[0] + second[0])
                .abs()
                .max((2.0 * d[1] + second[1]).abs());
            around(|t| weight(t, c) + sign(c) * slope(t) * (t - c), p, most)
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

/// g · v at most, given the magnitudes of the components of v.
fn along_gradient([x, y, z]: [f64; 3]) -> f64 {
    (x + y).max((y + z).max(z + x)) * FRAC_1_SQRT_2
}

/// F(p, u) at most.
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

/// Whether F(p, u) is at most so much for all directions of a box, cut at most `depth` times.
fn holds(corners: &Matrices, s: Range, t: Range, most: f64, depth: u32) -> bool {
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
        .all(|s| t.into_iter().all(|t| at(s, t) <= most * shortest))
    {
        return true;
    }
    let middle = |r: Range| (r[0] + r[1]) / 2.0;
    let (m, n) = (middle(s), middle(t));
    // Where a single direction fails, cutting them does not help.
    depth > 0
        && at(m, n) <= most * length(m, n)
        && halves(s).into_iter().all(|s| {
            halves(t)
                .into_iter()
                .all(|t| holds(corners, s, t, most, depth - 1))
        })
}

#[test]
fn noise_is_no_steeper_than_is_said() {
    let mut pending = vec![[[0.0, 0.5]; 3]];
    let mut boxes = 0;
    while let Some(places) = pending.pop() {
        boxes += 1;
        assert!(boxes < 100_000, "no proof at {places:?}");
        let corners = matrices(places);
        if holds(&corners, [-1.0, 1.0], [-1.0, 1.0], NOISE_STEEPNESS, 4) {
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
    // Along an axis it is no steeper than in any direction.
    const { assert!(NOISE_SLOPE >= NOISE_STEEPNESS) };
}

/// The height is the sum over the corners of the weight times g · (p − c).
#[test]
fn noise_is_never_higher_than_one() {
    let mut pending = vec![[[0.0, 0.5]; 3]];
    while let Some(places) = pending.pop() {
        let axes = places.map(Axis::over);
        let height: f64 = (0..8)
            .map(|corner: usize| {
                let side = |i: usize| corner >> i & 1;
                let weight = |i: usize| axes[i].weight[side(i)][1];
                let off = |i: usize| match side(i) {
                    0 => places[i][1],
                    _ => 1.0 - places[i][0],
                };
                weight(0) * weight(1) * weight(2) * along_gradient([off(0), off(1), off(2)])
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

/// What is proved is of the noise that there is, and not far from what it reaches.
#[test]
fn noise_comes_near_to_what_is_said() {
    let mut random = Random::new(50);
    let (mut steepest, mut highest) = (0.0_f64, 0.0_f64);
    for _ in 0..200_000 {
        // The steepest places are in the middle of cells.
        let (cell, inner) = (random.point(5000.0), random.point(0.15));
        let [x, y, z] = [0, 1, 2].map(|i| cell[i].floor() + 0.5 + inner[i]);
        let (value, slope) = perlin::<f64>(V3::of(x, y, z), 3.0);
        steepest = steepest.max(slope.x.hypot(slope.y).hypot(slope.z));
        highest = highest.max(value.abs());
    }
    assert!(steepest <= NOISE_STEEPNESS, "{steepest}");
    assert!(steepest > 0.8 * NOISE_STEEPNESS, "{steepest}");
    assert!(highest < 1.0, "{highest}");
}

/// The number of an edge's direction, of twelve.
fn direction(cell: [i32; 3], seed: i32) -> usize {
    let [x, y, z] = sdfc_vm::elementary::edge(cell.map(|c| c as f32), seed as f32);
    let axis = ((x - 1.0) * 3.0) as usize;
    axis * 4 + usize::from(y < 0.0) * 2 + usize::from(z < 0.0)
}

/// Directions of corners are independent of those of the corners around and of other seeds: the
/// pairs of directions are spread evenly, by Pearson's test with 143 degrees of freedom. Of 200 tests
/// of numbers that are random, one in a million or so has a largest value above 260.
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
            for place in 0..SIDE.pow(3) {
                let step = [place % SIDE, place / SIDE % SIDE, place / SIDE / SIDE];
                let cell = [0, 1, 2].map(|i| start[i] + step[i]);
                let other = [0, 1, 2].map(|i| cell[i] + shift[i]);
                pairs[direction(cell, 5)][direction(other, 5 + shift[3])] += 1;
            }
            let expected = f64::from(SIDE.pow(3)) / 144.0;
            let off = |count: &u32| (f64::from(*count) - expected).powi(2) / expected;
            let spread: f64 = pairs.iter().flatten().map(off).sum();
            assert!(spread < 260.0, "{start:?}, {shift:?}: {spread}");
        }
    }
}
