//! Axis-aligned bounding boxes, finite or not.

use crate::interval::Interval;
use glam::DVec3;

/// A bounding box of a solid. It is empty if a lower corner exceeds the upper one, and may be infinite.
///
/// An empty box still marks the region where its shape's distance is small. Two disjoint spheres have an
/// empty intersection, yet the distance of the intersection is smallest between them, and a blend may fill
/// the gap. Growing such a box by half its gap reduces it to a single point.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Bounds {
    /// The lower corner.
    pub min: [f64; 3],
    /// The upper corner.
    pub max: [f64; 3],
}

impl Bounds {
    /// All of space.
    pub const ALL_SPACE: Self = Self {
        min: [f64::NEG_INFINITY; 3],
        max: [f64::INFINITY; 3],
    };
    /// The empty box that stays empty when it grows.
    pub const EMPTY: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    /// Creates the box from `-half` to `half`.
    pub fn centred(half: [f64; 3]) -> Self {
        Self {
            min: half.map(|h| -h),
            max: half,
        }
    }
    /// Reports whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|i| self.min[i] > self.max[i])
    }
    /// Reports whether all corners are finite and the box is not empty.
    pub fn is_finite(&self) -> bool {
        !self.is_empty() && self.min.iter().chain(&self.max).all(|v| v.is_finite())
    }
    /// Returns the smallest box around both.
    pub fn hull(&self, other: &Self) -> Self {
        let mut hull = *self;
        for i in 0..3 {
            hull.min[i] = self.min[i].min(other.min[i]);
            hull.max[i] = self.max[i].max(other.max[i]);
        }
        hull
    }
    /// Returns the intersection of both.
    pub fn intersection(&self, other: &Self) -> Self {
        let mut common = *self;
        for i in 0..3 {
            common.min[i] = self.min[i].max(other.min[i]);
            common.max[i] = self.max[i].min(other.max[i]);
        }
        common
    }
    /// Reports whether the box is as empty as [`Self::EMPTY`]: it stays empty when it grows.
    pub fn is_void(&self) -> bool {
        (0..3).any(|i| self.min[i] == f64::INFINITY || self.max[i] == f64::NEG_INFINITY)
    }
    /// Returns the box grown by `by` on every side.
    pub fn grown(&self, by: f64) -> Self {
        if self.is_void() {
            return *self;
        }
        Self {
            min: self.min.map(|v| v - by),
            max: self.max.map(|v| v + by),
        }
    }
    /// Returns the smallest box around this one and a point.
    pub fn including(&self, p: [f64; 3]) -> Self {
        self.hull(&Self { min: p, max: p })
    }
    /// Returns a point of a finite box, by its index in a low-discrepancy sequence.
    ///
    /// Its steps are powers of 1/φ, where φ⁴ = φ + 1 (M. Roberts, *The Unreasonable Effectiveness of
    /// Quasirandom Sequences*, 2018).
    pub fn quasi_random_point(&self, number: u32) -> [f64; 3] {
        let steps = [
            0.819_172_513_396_164_4,
            0.671_043_606_703_789_2,
            0.549_700_477_901_97,
        ];
        std::array::from_fn(|axis| {
            let fraction = (f64::from(number) * steps[axis]).fract();
            self.min[axis] + (self.max[axis] - self.min[axis]) * fraction
        })
    }
    /// Returns the eight corners.
    pub fn corners(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|i| {
            std::array::from_fn(|axis| {
                if i >> axis & 1 == 0 {
                    self.min[axis]
                } else {
                    self.max[axis]
                }
            })
        })
    }
    /// Returns the centre.
    pub fn centre(&self) -> [f64; 3] {
        ((DVec3::from(self.min) + DVec3::from(self.max)) / 2.0).into()
    }
    /// Returns the distance from the centre to a corner.
    pub fn half_diagonal(&self) -> f64 {
        ((DVec3::from(self.max) - DVec3::from(self.min)) / 2.0).length()
    }
    /// Returns the distance from a point to the box; zero inside.
    pub fn distance(&self, p: [f64; 3]) -> f64 {
        let gap = |i: usize| (self.min[i] - p[i]).max(p[i] - self.max[i]).max(0.0);
        DVec3::new(gap(0), gap(1), gap(2)).length()
    }
    /// Returns the largest distance of a point inside from the y axis.
    pub fn radius_about_y(&self) -> f64 {
        let reach = |i: usize| self.min[i].abs().max(self.max[i].abs());
        reach(0).hypot(reach(2))
    }
    /// Returns a bounding box of all points `m · p + t` for `p` inside; `t` is the fourth column of the
    /// rows.
    pub fn mapped(&self, rows: &[[f64; 4]; 3]) -> Self {
        if self.is_void() {
            return *self;
        }
        let mut result = Self::EMPTY;
        for (axis, row) in rows.iter().enumerate() {
            let (mut lo, mut hi) = (row[3], row[3]);
            // A zero coefficient drops even an infinite side.
            let factors = row.iter().take(3).enumerate().filter(|(_, f)| **f != 0.0);
            let is_single = factors.clone().count() == 1;
            for (i, factor) in factors {
                let (a, b) = (factor * self.min[i], factor * self.max[i]);
                // An empty side of a single axis stays empty.
                let is_turned = if is_single { *factor < 0.0 } else { a > b };
                let (a, b) = if is_turned { (b, a) } else { (a, b) };
                lo += a;
                hi += b;
            }
            result.min[axis] = lo;
            result.max[axis] = hi;
        }
        result
    }
    /// Returns a bounding box of the images of a box under all maps whose rows lie within ranges.
    pub fn mapped_within(&self, rows: &[Interval; 12]) -> Self {
        if rows.iter().all(|range| range.lo == range.hi) {
            let row = |row: usize| std::array::from_fn(|column| rows[4 * row + column].lo);
            return self.mapped(&[row(0), row(1), row(2)]);
        }
        if self.is_empty() {
            return Self::ALL_SPACE;
        }
        let coordinate = |row: usize| {
            let term = |axis: usize| match rows[4 * row + axis] {
                Interval { lo: 0.0, hi: 0.0 } => Interval::point(0.0),
                factor => factor * Interval::between(self.min[axis], self.max[axis]),
            };
            term(0) + term(1) + term(2) + rows[4 * row + 3]
        };
        let coordinates = [0, 1, 2].map(coordinate);
        Self {
            min: coordinates.map(|range| range.lo),
            max: coordinates.map(|range| range.hi),
        }
    }
}
