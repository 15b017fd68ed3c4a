//! The reach of a solid along fixed directions: the polytope that cameras frame.

use crate::bounds::Bounds;
use serde::{Deserialize, Serialize};

/// The number of directions.
pub const DIRECTIONS: usize = 26;

/// The reaches of a solid in the directions from a cube's centre to its faces, edges and corners.
///
/// A reach is the largest `d · p` of its points, for `d` with components −1, 0 and 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outline {
    /// The reaches, in the order of [`directions`].
    pub reaches: [f64; DIRECTIONS],
}

/// The directions, not of length one.
pub fn directions() -> [[f64; 3]; DIRECTIONS] {
    std::array::from_fn(|number| {
        // The middle one of 27 is no direction.
        let number = if number < DIRECTIONS / 2 {
            number
        } else {
            number + 1
        };
        [number / 9, number / 3 % 3, number % 3].map(|digit| digit as f64 - 1.0)
    })
}

/// The place of a direction in the list of all.
fn place(direction: [f64; 3]) -> usize {
    let number = direction
        .iter()
        .fold(0, |number, &v| number * 3 + (v + 1.0) as usize);
    number - usize::from(number > DIRECTIONS / 2)
}

impl Outline {
    /// The outline of a solid whose reach along a direction is known.
    pub fn by(reach: impl FnMut([f64; 3]) -> f64) -> Self {
        Self {
            reaches: directions().map(reach),
        }
    }

    /// The outline of a box.
    pub fn of_box(bounds: &Bounds) -> Self {
        Self::by(|direction| {
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

    /// No less than the largest `n · p` of the solid's points.
    ///
    /// `n` is a sum of three of the directions with factors that are not negative: those to a face, an
    /// edge and a corner of the cube around it.
    pub fn reach(&self, n: [f64; 3]) -> f64 {
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| n[b].abs().total_cmp(&n[a].abs()));
        let mut direction = [0.0; 3];
        let mut sum = 0.0;
        for (i, &axis) in axes.iter().enumerate() {
            direction[axis] = 1.0_f64.copysign(n[axis]);
            let next = axes.get(i + 1).map_or(0.0, |&next| n[next].abs());
            let factor = n[axis].abs() - next;
            if factor > 0.0 {
                sum += factor * self.reaches[place(direction)];
            }
        }
        sum
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        let along = |i: usize, sign: f64| {
            let mut direction = [0.0; 3];
            direction[i] = sign;
            sign * self.reach(direction)
        };
        Bounds {
            min: std::array::from_fn(|i| along(i, -1.0)),
            max: std::array::from_fn(|i| along(i, 1.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_stand_at_their_places() {
        for (at, direction) in directions().into_iter().enumerate() {
            assert_eq!(place(direction), at, "{direction:?}");
        }
    }

    #[test]
    fn the_outline_of_a_box_is_exact_and_that_of_a_ball_is_close() {
        let bounds = Bounds {
            min: [-1.0, 0.5, 2.0],
            max: [3.0, 0.75, 9.0],
        };
        let outline = Outline::of_box(&bounds);
        assert_eq!(outline.bounds(), bounds);
        let ball = Outline::by(|d| d.iter().map(|v| v * v).sum::<f64>().sqrt());
        for n in [
            [0.3, -0.7, 0.2],
            [1.0, 0.0, 0.0],
            [-0.5, 0.4, 0.45],
            [0.0, 2.0, 1.0],
        ] {
            let corners = bounds.corners();
            let along = corners.map(|c| (0..3).map(|i| c[i] * n[i]).sum::<f64>());
            let most = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
            assert!((outline.reach(n) - most).abs() < 1e-12, "{n:?}");
            let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
            let reach = ball.reach(n) / length;
            assert!((1.0 - 1e-12..1.13).contains(&reach), "{n:?}: {reach}");
        }
    }
}
