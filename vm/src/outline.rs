//! The support function of a solid along fixed directions: the polytope that cameras frame.

use crate::bounds::Bounds;
use serde::{Deserialize, Serialize};

/// The number of directions.
pub const DIRECTIONS: usize = 26;

/// The supports of a solid in the directions from a cube's centre to its faces, edges and corners.
///
/// A support is the largest `d · p` over its points, for `d` with components −1, 0 and 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outline {
    /// The supports, in the order of [`directions`].
    pub supports: [f64; DIRECTIONS],
}

/// Returns the directions, which are not normalized.
pub fn directions() -> [[f64; 3]; DIRECTIONS] {
    std::array::from_fn(|number| {
        // The middle one of 27 is the zero vector.
        let number = if number < DIRECTIONS / 2 {
            number
        } else {
            number + 1
        };
        [number / 9, number / 3 % 3, number % 3].map(|digit| digit as f64 - 1.0)
    })
}

/// Returns the index of a direction in the list of all.
fn direction_index(direction: [f64; 3]) -> usize {
    let number = direction
        .iter()
        .fold(0, |number, &v| number * 3 + (v + 1.0) as usize);
    number - usize::from(number > DIRECTIONS / 2)
}

impl Outline {
    /// Creates the outline of a solid from its support function.
    pub fn from_support(reach: impl FnMut([f64; 3]) -> f64) -> Self {
        Self {
            supports: directions().map(reach),
        }
    }

    /// Creates the outline of a box.
    pub fn from_bounds(bounds: &Bounds) -> Self {
        Self::from_support(|direction| {
            let corner = |i: usize| match direction[i] > 0.0 {
                true => bounds.max[i],
                false => bounds.min[i],
            };
            (0..3)
                .filter(|&i| direction[i] != 0.0)
                .map(|i| direction[i] * corner(i))
                .sum()
        })
    }

    /// Returns an upper bound of the largest `n · p` over the solid's points.
    ///
    /// `n` is a sum of three of the directions with non-negative factors: those to a face, an edge and a
    /// corner of the surrounding cube.
    pub fn support(&self, n: [f64; 3]) -> f64 {
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| n[b].abs().total_cmp(&n[a].abs()));
        let mut direction = [0.0; 3];
        let mut sum = 0.0;
        for (i, &axis) in axes.iter().enumerate() {
            direction[axis] = 1.0_f64.copysign(n[axis]);
            let next = axes.get(i + 1).map_or(0.0, |&next| n[next].abs());
            let factor = n[axis].abs() - next;
            if factor > 0.0 {
                sum += factor * self.supports[direction_index(direction)];
            }
        }
        sum
    }

    /// Returns the bounding box.
    pub fn bounds(&self) -> Bounds {
        let along = |i: usize, sign: f64| {
            let mut direction = [0.0; 3];
            direction[i] = sign;
            sign * self.support(direction)
        };
        Bounds {
            min: std::array::from_fn(|i| along(i, -1.0)),
            max: std::array::from_fn(|i| along(i, 1.0)),
        }
    }
}
