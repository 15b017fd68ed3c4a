//! Boxes around shapes, by which a point leaves out shapes that are too far to matter.

use super::point::Point;

/// A box around a shape, and how fast the shape's value grows outside of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// The lower corner.
    pub(super) low: Point,
    /// The upper corner.
    pub(super) high: Point,
    /// The least ratio of the value and the distance to the box, outside of it.
    pub(super) rate: f64,
}

impl Extent {
    /// All of space, for shapes of which nothing is known.
    pub(super) const EVERYWHERE: Self = Self {
        low: [f64::NEG_INFINITY; 3],
        high: [f64::INFINITY; 3],
        rate: 0.0,
    };

    /// The box around the origin with these half sizes, of a shape that knows its distance.
    pub(super) fn centred(half: Point) -> Self {
        Self {
            low: half.map(|v| -v),
            high: half,
            rate: 1.0,
        }
    }

    /// The same box with another rate.
    pub(super) fn with_rate(self, rate: f64) -> Self {
        Self { rate, ..self }
    }

    /// The distance of a point to the box, which is zero within.
    pub(super) fn distance(&self, p: Point) -> f64 {
        let mut square = 0.0;
        for (axis, &v) in p.iter().enumerate() {
            let gap = (self.low[axis] - v).max(v - self.high[axis]).max(0.0);
            square += gap * gap;
        }
        square.sqrt()
    }

    /// Tells if it ends along all axes.
    pub(super) fn is_finite(&self) -> bool {
        self.low.iter().chain(&self.high).all(|v| v.is_finite())
    }

    /// The length of the diagonal along the axes on which it ends, if there are any.
    pub(super) fn diagonal(&self) -> Option<f64> {
        let sizes = (0..3).map(|axis| self.high[axis] - self.low[axis]);
        let squares: Vec<f64> = sizes.filter(|s| s.is_finite()).map(|s| s * s).collect();
        let sum: f64 = squares.iter().sum();
        (sum > 0.0).then(|| sum.sqrt())
    }

    /// The box around both.
    pub(super) fn hull(&self, other: &Self) -> Self {
        Self {
            low: [0, 1, 2].map(|i| self.low[i].min(other.low[i])),
            high: [0, 1, 2].map(|i| self.high[i].max(other.high[i])),
            rate: self.rate.min(other.rate),
        }
    }

    /// The box of the larger of both values.
    pub(super) fn common(&self, other: &Self) -> Self {
        let (a, b) = (self, other);
        // The common box may be farther than each by √2. What knows nothing of its value adds
        // nothing.
        let rate = match (a.rate > 0.0, b.rate > 0.0) {
            (true, true) => a.rate.min(b.rate) * std::f64::consts::FRAC_1_SQRT_2,
            (true, false) => return *a,
            (false, true) => return *b,
            (false, false) => 0.0,
        };
        let low = [0, 1, 2].map(|i| a.low[i].max(b.low[i]));
        let high = [0, 1, 2].map(|i| a.high[i].min(b.high[i]));
        if (0..3).any(|i| low[i] > high[i]) {
            return *a;
        }
        Self { low, high, rate }
    }

    /// The box of the shape when its value is less by `by`.
    pub(super) fn grown(&self, by: f64) -> Self {
        if by <= 0.0 {
            return *self;
        }
        if self.rate <= 0.0 {
            return Self::EVERYWHERE;
        }
        let by = by / self.rate;
        Self {
            low: self.low.map(|v| v - by),
            high: self.high.map(|v| v + by),
            rate: self.rate,
        }
    }

    /// The box widened by these lengths on both sides of each axis.
    pub(super) fn widened(&self, by: Point) -> Self {
        Self {
            low: [0, 1, 2].map(|i| self.low[i] - by[i]),
            high: [0, 1, 2].map(|i| self.high[i] + by[i]),
            rate: self.rate,
        }
    }

    /// The box around all turns of this one about an axis.
    pub(super) fn turned(&self, about: usize) -> Self {
        let mut square = 0.0;
        for axis in (0..3).filter(|&axis| axis != about) {
            let farthest = self.low[axis].abs().max(self.high[axis].abs());
            square += farthest * farthest;
        }
        let mut turned = *self;
        for axis in (0..3).filter(|&axis| axis != about) {
            turned.low[axis] = -square.sqrt();
            turned.high[axis] = square.sqrt();
        }
        turned
    }

    /// The box around the affine image of this one. `matrix` leads back from the image.
    pub(super) fn mapped(&self, matrix: &[f64; 12], scale: f64, least_stretch: f64) -> Self {
        let Some(forth) = inverse(matrix) else {
            return Self::EVERYWHERE;
        };
        let mut image = Self {
            low: [0.0; 3],
            high: [0.0; 3],
            rate: self.rate * scale.abs() * least_stretch,
        };
        for row in 0..3 {
            let shift = forth[row * 4 + 3];
            (image.low[row], image.high[row]) = (shift, shift);
            for column in 0..3 {
                let factor = forth[row * 4 + column];
                if factor == 0.0 {
                    continue;
                }
                let ends = [factor * self.low[column], factor * self.high[column]];
                image.low[row] += ends[0].min(ends[1]);
                image.high[row] += ends[0].max(ends[1]);
            }
        }
        // Rounding must not cut anything off.
        let slack = |low: f64, high: f64| {
            let size = low.abs().max(high.abs());
            if size.is_finite() { size * 1e-12 } else { 0.0 }
        };
        let by = [0, 1, 2].map(|i| slack(image.low[i], image.high[i]));
        image.widened(by)
    }
}

/// The inverse of an affine map, unless it is flat.
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

/// The least and the most that an affine map stretches any vector.
pub(super) fn stretches(m: &[f64; 12]) -> [f64; 2] {
    let column = |i: usize| [m[i], m[4 + i], m[8 + i]];
    let (a, b, c) = (column(0), column(1), column(2));
    // The eigenvalues of the map times its transpose, by Jacobi's rotations.
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
