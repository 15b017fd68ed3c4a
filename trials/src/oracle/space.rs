//! Transforms of the point: copies, rotations and wedges.

use super::influence_box::InfluenceBox;
use super::point::{Point, Point2, norm2};
use std::f64::consts::TAU;

/// Smallest number of cells visited on each side of the nearest cell.
const MIN_VISITED_CELLS_PER_SIDE: f64 = 2.0;
/// Largest number of cells visited on each side of the nearest cell.
const MAX_VISITED_CELLS_PER_SIDE: f64 = 64.0;

/// Copies along the axes.
#[derive(Clone, Debug)]
pub(super) struct CopyGrid {
    /// Distance between adjacent copies, or zero along axes with a single copy.
    spacing: Point,
    /// Index of the last copy, from zero, which is infinite in an infinite grid.
    last: Point,
}

impl CopyGrid {
    /// Creates an infinite grid, or one of `last + 1` copies along each axis around the origin.
    pub(super) fn new(spacing: Point, last: Option<Point>) -> Self {
        Self {
            spacing: spacing.map(f64::abs),
            last: last.unwrap_or([f64::INFINITY; 3]),
        }
    }

    /// Returns the box around all copies of a child's box.
    pub(super) fn bounds(&self, child: &InfluenceBox) -> InfluenceBox {
        let half_span = [0, 1, 2].map(|i| match self.spacing[i] {
            0.0 => 0.0,
            spacing => spacing * self.last[i] / 2.0,
        });
        child.widened(half_span)
    }

    /// Visits the local points of the copies near a point, nearest cells first.
    ///
    /// `visit` returns the value so far, which is used to skip copies with distant boxes. Returns the
    /// smallest distance to a skipped copy.
    pub(super) fn for_each_copy(
        &self,
        child: &InfluenceBox,
        p: Point,
        mut visit: impl FnMut(Point) -> f64,
    ) -> f64 {
        let axes = [0, 1, 2].map(|axis| GridAxis::new(self, child, p, axis));
        let mut skipped_distance = axes
            .iter()
            .map(|a| a.skipped_distance)
            .fold(f64::INFINITY, f64::min);
        let mut limit = f64::INFINITY;
        for x in axes[0].coordinates() {
            for y in axes[1].coordinates() {
                for z in axes[2].coordinates() {
                    let q = [x, y, z];
                    let distance = child.distance(q);
                    if distance > 0.0 && child.distance_ratio * distance >= limit {
                        skipped_distance = skipped_distance.min(distance);
                    } else {
                        limit = visit(q);
                    }
                }
            }
        }
        skipped_distance
    }
}

/// Copies along one axis that are near a point.
#[derive(Clone, Copy, Debug)]
struct GridAxis {
    /// Local coordinate in the nearest copy.
    nearest: f64,
    spacing: f64,
    /// Numbers of copies below and above the nearest one.
    copies_below: f64,
    copies_above: f64,
    /// Number of copies visited on each side.
    visited_per_side: f64,
    /// Distance to the nearest copy that is not visited.
    skipped_distance: f64,
}

impl GridAxis {
    fn new(grid: &CopyGrid, child: &InfluenceBox, p: Point, axis: usize) -> Self {
        let (low, high) = (child.low[axis], child.high[axis]);
        let (spacing, last) = (grid.spacing[axis], grid.last[axis]);
        if spacing == 0.0 {
            return Self {
                nearest: p[axis],
                spacing,
                copies_below: 0.0,
                copies_above: 0.0,
                visited_per_side: 0.0,
                skipped_distance: f64::INFINITY,
            };
        }
        let is_bounded = low.is_finite() && high.is_finite();
        let centre = if is_bounded { 0.5 * (low + high) } else { 0.0 };
        let (number, first) = if last.is_finite() {
            let first = -0.5 * last * spacing;
            let number = ((p[axis] - centre - first) / spacing).round();
            (number.clamp(0.0, last), first)
        } else {
            (((p[axis] - centre) / spacing).round(), 0.0)
        };
        let nearest = p[axis] - first - number * spacing;
        let (copies_below, copies_above) = match last.is_finite() {
            true => (number, last - number),
            false => (f64::INFINITY, f64::INFINITY),
        };
        let required = if is_bounded {
            ((high - low) / spacing).ceil() + 1.0
        } else {
            0.0
        };
        let visited_per_side =
            required.clamp(MIN_VISITED_CELLS_PER_SIDE, MAX_VISITED_CELLS_PER_SIDE);
        let visited_length = (visited_per_side + 1.0) * spacing;
        let mut skipped_distance = f64::INFINITY;
        if copies_above > visited_per_side {
            skipped_distance = skipped_distance.min(low - (nearest - visited_length));
        }
        if copies_below > visited_per_side {
            skipped_distance = skipped_distance.min(nearest + visited_length - high);
        }
        Self {
            nearest,
            spacing,
            copies_below,
            copies_above,
            visited_per_side,
            skipped_distance: if is_bounded {
                skipped_distance.max(0.0)
            } else {
                0.5 * spacing
            },
        }
    }

    /// Returns the local coordinates of the copies, nearest cells first.
    fn coordinates(self) -> impl Iterator<Item = f64> {
        let count = 2 * self.visited_per_side as usize + 1;
        (0..count).filter_map(move |index| {
            let cells = index.div_ceil(2) as f64;
            let is_above = index % 2 == 1;
            let available = if is_above {
                self.copies_above
            } else {
                self.copies_below
            };
            let offset = if is_above { -cells } else { cells };
            (cells <= available).then_some(self.nearest + offset * self.spacing)
        })
    }
}

/// Copies around an axis.
#[derive(Clone, Debug)]
pub(super) struct CopyRing {
    /// Cosine and sine of each copy's angle.
    rotations: Vec<Point2>,
    /// Index of the second coordinate of the plane of rotation: 1 in 2-D, 2 around the y axis.
    second_axis: usize,
}

impl CopyRing {
    /// Creates one copy for each sector of this angle in a full turn.
    pub(super) fn new(sector: f64, second_axis: usize) -> Self {
        let count = (TAU / sector).round().max(1.0) as usize;
        let turn = |index: usize| {
            let (sine, cosine) = (TAU * index as f64 / count as f64).sin_cos();
            [cosine, sine]
        };
        Self {
            rotations: (0..count).map(turn).collect(),
            second_axis,
        }
    }

    /// Returns the axis of rotation.
    pub(super) fn axis(&self) -> usize {
        3 - self.second_axis
    }

    /// Visits the local points of the copies, nearest copies first, as [`CopyGrid::for_each_copy`] does.
    pub(super) fn for_each_copy(
        &self,
        child: &InfluenceBox,
        p: Point,
        mut visit: impl FnMut(Point) -> f64,
    ) -> f64 {
        let (x, y) = (p[0], p[self.second_axis]);
        let centre = [0, self.second_axis].map(|i| child.low[i] + child.high[i]);
        let count = self.rotations.len();
        let first = match centre.iter().all(|v| v.is_finite()) {
            true => (y.atan2(x) - centre[1].atan2(centre[0])) / TAU * count as f64,
            false => 0.0,
        };
        let first = (first.round() as i64).rem_euclid(count as i64) as usize;
        let (mut skipped_distance, mut limit) = (f64::INFINITY, f64::INFINITY);
        for index in 0..count {
            let steps = index.div_ceil(2);
            let number = if index % 2 == 1 {
                first + steps
            } else {
                first + count - steps
            };
            let [cosine, sine] = self.rotations[number % count];
            let mut q = p;
            q[0] = cosine * x + sine * y;
            q[self.second_axis] = cosine * y - sine * x;
            let distance = child.distance(q);
            if distance > 0.0 && child.distance_ratio * distance >= limit {
                skipped_distance = skipped_distance.min(distance);
            } else {
                limit = visit(q);
            }
        }
        skipped_distance
    }
}

/// Returns the local point of a shape rotated by a right-handed angle about an axis.
pub(super) fn rotated(p: Point, axis: usize, angle: f64) -> Point {
    let (sine, cosine) = angle.sin_cos();
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut q = p;
    q[i] = cosine * p[i] + sine * p[j];
    q[j] = cosine * p[j] - sine * p[i];
    q
}

/// Returns a radius around a point whose image under a twist of `rate` per unit is within `image_radius`.
///
/// At a distance ρ from the axis, such a twist stretches by at most 1 + |rate| · ρ.
pub(super) fn radius_before_turn(image_radius: f64, distance_ratio: f64, radius: f64) -> f64 {
    let distance_ratio = distance_ratio.abs();
    let stretch = 1.0 + distance_ratio * radius;
    if !image_radius.is_finite() {
        return image_radius;
    }
    // Positive root of rate · r² + stretch · r = image_radius.
    2.0 * image_radius
        / (stretch + (stretch * stretch + 4.0 * distance_ratio * image_radius).sqrt())
}

/// Wedge of a partial revolution. Points outside it belong to the nearer end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wedge {
    /// Cosine and sine of half the angle.
    pub(super) end: Point2,
}

impl Wedge {
    /// Returns the coordinates along and perpendicular to the end on the point's side.
    pub(super) fn along_end(self, p: Point) -> Point2 {
        let [cosine, sine] = self.end;
        let side = p[2].abs();
        [p[0] * cosine + side * sine, side * cosine - p[0] * sine]
    }

    /// Reports whether the point is in the wedge. Both angles are at most half a turn.
    pub(super) fn contains(self, p: Point) -> bool {
        p[0] * self.end[1] >= p[2].abs() * self.end[0]
    }

    /// Returns the distance from the axis in the point's half plane.
    pub(super) fn radius(self, p: Point) -> f64 {
        if self.contains(p) {
            norm2(p[0], p[2])
        } else {
            self.along_end(p)[0]
        }
    }

    /// Returns the distance to the wedge's ends.
    pub(super) fn distance_to_ends(self, p: Point) -> f64 {
        let [along, second_axis] = self.along_end(p);
        if along > 0.0 {
            second_axis.abs()
        } else {
            norm2(p[0], p[2])
        }
    }
}
