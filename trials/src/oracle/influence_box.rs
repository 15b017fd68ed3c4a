//! Influence boxes of shapes, used to skip shapes that are too far from a point to matter.

use super::point::Point;

/// Bounding box of a shape, with a lower bound on the growth of the shape's value outside it.
#[derive(Clone, Copy, Debug)]
pub(super) struct InfluenceBox {
    /// Lower corner.
    pub(super) low: Point,
    /// Upper corner.
    pub(super) high: Point,
    /// Smallest ratio of value to distance from the box, outside the box.
    pub(super) distance_ratio: f64,
}

impl InfluenceBox {
    /// All of space, for shapes without known bounds.
    pub(super) const ALL_SPACE: Self = Self {
        low: [f64::NEG_INFINITY; 3],
        high: [f64::INFINITY; 3],
        distance_ratio: 0.0,
    };

    /// Creates a box around the origin from its half sizes, for a shape with exact distances.
    pub(super) fn centred(half: Point) -> Self {
        Self {
            low: half.map(|v| -v),
            high: half,
            distance_ratio: 1.0,
        }
    }

    /// Returns the box with another distance ratio.
    pub(super) fn with_distance_ratio(self, distance_ratio: f64) -> Self {
        Self {
            distance_ratio,
            ..self
        }
    }

    /// Returns the distance from a point to the box, which is zero inside.
    pub(super) fn distance(&self, p: Point) -> f64 {
        let mut square = 0.0;
        for (axis, &v) in p.iter().enumerate() {
            let gap = (self.low[axis] - v).max(v - self.high[axis]).max(0.0);
            square += gap * gap;
        }
        square.sqrt()
    }

    /// Reports whether the box is finite along all axes.
    pub(super) fn is_finite(&self) -> bool {
        self.low.iter().chain(&self.high).all(|v| v.is_finite())
    }

    /// Returns the length of the diagonal over the finite axes, unless it is zero.
    pub(super) fn diagonal(&self) -> Option<f64> {
        let sizes = (0..3).map(|axis| self.high[axis] - self.low[axis]);
        let squares: Vec<f64> = sizes.filter(|s| s.is_finite()).map(|s| s * s).collect();
        let sum: f64 = squares.iter().sum();
        (sum > 0.0).then(|| sum.sqrt())
    }

    /// Returns the box around both boxes.
    pub(super) fn hull(&self, other: &Self) -> Self {
        Self {
            low: [0, 1, 2].map(|i| self.low[i].min(other.low[i])),
            high: [0, 1, 2].map(|i| self.high[i].max(other.high[i])),
            distance_ratio: self.distance_ratio.min(other.distance_ratio),
        }
    }

    /// Returns the influence box of the maximum of two values.
    pub(super) fn intersection(&self, other: &Self) -> Self {
        let (a, b) = (self, other);
        // The intersection may be farther away than each box by a factor of √2. A box with ratio 0 adds
        // nothing.
        let distance_ratio = match (a.distance_ratio > 0.0, b.distance_ratio > 0.0) {
            (true, true) => {
                a.distance_ratio.min(b.distance_ratio) * std::f64::consts::FRAC_1_SQRT_2
            }
            (true, false) => return *a,
            (false, true) => return *b,
            (false, false) => 0.0,
        };
        let low = [0, 1, 2].map(|i| a.low[i].max(b.low[i]));
        let high = [0, 1, 2].map(|i| a.high[i].min(b.high[i]));
        if (0..3).any(|i| low[i] > high[i]) {
            return *a;
        }
        Self {
            low,
            high,
            distance_ratio,
        }
    }

    /// Returns the influence box after the value is reduced by `amount`.
    pub(super) fn grown(&self, amount: f64) -> Self {
        if amount <= 0.0 {
            return *self;
        }
        if self.distance_ratio <= 0.0 {
            return Self::ALL_SPACE;
        }
        let amount = amount / self.distance_ratio;
        Self {
            low: self.low.map(|v| v - amount),
            high: self.high.map(|v| v + amount),
            distance_ratio: self.distance_ratio,
        }
    }

    /// Returns the box extended by these lengths on both sides of each axis.
    pub(super) fn widened(&self, amount: Point) -> Self {
        Self {
            low: [0, 1, 2].map(|i| self.low[i] - amount[i]),
            high: [0, 1, 2].map(|i| self.high[i] + amount[i]),
            distance_ratio: self.distance_ratio,
        }
    }

    /// Returns the box around all rotations of this one about an axis.
    pub(super) fn revolved_about(&self, axis_index: usize) -> Self {
        let mut square = 0.0;
        for axis in (0..3).filter(|&axis| axis != axis_index) {
            let farthest = self.low[axis].abs().max(self.high[axis].abs());
            square += farthest * farthest;
        }
        let mut result = *self;
        for axis in (0..3).filter(|&axis| axis != axis_index) {
            result.low[axis] = -square.sqrt();
            result.high[axis] = square.sqrt();
        }
        result
    }

    /// Returns the box around the affine image of this one. `matrix` maps from the image back.
    pub(super) fn affine_image(&self, matrix: &[f64; 12], scale: f64, min_stretch: f64) -> Self {
        let Some(forward) = inverse(matrix) else {
            return Self::ALL_SPACE;
        };
        let mut image = Self {
            low: [0.0; 3],
            high: [0.0; 3],
            distance_ratio: self.distance_ratio * scale.abs() * min_stretch,
        };
        for row in 0..3 {
            let shift = forward[row * 4 + 3];
            (image.low[row], image.high[row]) = (shift, shift);
            for column in 0..3 {
                let factor = forward[row * 4 + column];
                if factor == 0.0 {
                    continue;
                }
                let ends = [factor * self.low[column], factor * self.high[column]];
                image.low[row] += ends[0].min(ends[1]);
                image.high[row] += ends[0].max(ends[1]);
            }
        }
        // Slack for rounding.
        let slack = |low: f64, high: f64| {
            let size = low.abs().max(high.abs());
            if size.is_finite() { size * 1e-12 } else { 0.0 }
        };
        let amount = [0, 1, 2].map(|i| slack(image.low[i], image.high[i]));
        image.widened(amount)
    }
}

/// Returns the inverse of an affine map, or `None` if it is singular.
fn inverse(m: &[f64; 12]) -> Option<[f64; 12]> {
    let row = |i: usize| [m[i * 4], m[i * 4 + 1], m[i * 4 + 2]];
    let (a, b, c) = (row(0), row(1), row(2));
    let columns = [
        super::point::cross(b, c),
        super::point::cross(c, a),
        super::point::cross(a, b),
    ];
    let determinant = super::point::dot(a, columns[0]);
    if determinant == 0.0 || !determinant.is_finite() {
        return None;
    }
    let mut inverse = [0.0; 12];
    for i in 0..3 {
        for (j, column) in columns.iter().enumerate() {
            inverse[i * 4 + j] = column[i] / determinant;
        }
    }
    for i in 0..3 {
        let shift: f64 = (0..3).map(|j| inverse[i * 4 + j] * m[j * 4 + 3]).sum();
        inverse[i * 4 + 3] = -shift;
    }
    Some(inverse)
}

/// Returns the smallest and the largest singular value of an affine map.
pub(super) fn stretch_range(m: &[f64; 12]) -> [f64; 2] {
    let column = |i: usize| [m[i], m[4 + i], m[8 + i]];
    let (a, b, c) = (column(0), column(1), column(2));
    // Eigenvalues of the transposed map times the map, by Jacobi rotations.
    let dot = super::point::dot;
    let mut s = [
        [dot(a, a), dot(a, b), dot(a, c)],
        [dot(b, a), dot(b, b), dot(b, c)],
        [dot(c, a), dot(c, b), dot(c, c)],
    ];
    for _ in 0..12 {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            if s[i][j] == 0.0 {
                continue;
            }
            let angle = 0.5 * (2.0 * s[i][j]).atan2(s[i][i] - s[j][j]);
            let (sine, cosine) = angle.sin_cos();
            for row in &mut s {
                let (x, y) = (row[i], row[j]);
                row[i] = cosine * x + sine * y;
                row[j] = cosine * y - sine * x;
            }
            let (x, y) = (s[i], s[j]);
            for k in 0..3 {
                s[i][k] = cosine * x[k] + sine * y[k];
                s[j][k] = cosine * y[k] - sine * x[k];
            }
        }
    }
    let [x, y, z] = [s[0][0], s[1][1], s[2][2]].map(|v| v.max(0.0).sqrt());
    [x.min(y).min(z), x.max(y).max(z)]
}
