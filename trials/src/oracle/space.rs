//! Changes of the point: copies, turns and folds.

use super::extent::Extent;
use super::point::{Flat, Point, norm2};
use std::f64::consts::TAU;

/// The fewest cells that are looked at to each side of a point's own.
const MIN_CELLS_ASIDE: f64 = 2.0;
/// The most cells that are looked at to each side.
const MAX_CELLS_ASIDE: f64 = 64.0;

/// Copies along the axes.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// The way from one copy to the next, or zero along axes with a single one.
    spacing: Point,
    /// The number of the last copy, counted from zero, which is infinite in endless grids.
    last: Point,
}

impl Grid {
    /// An endless grid, or one of `last + 1` copies along each axis around the origin.
    pub(super) fn new(spacing: Point, last: Option<Point>) -> Self {
        Self {
            spacing: spacing.map(f64::abs),
            last: last.unwrap_or([f64::INFINITY; 3]),
        }
    }

    /// The box around all copies of what a box holds.
    pub(super) fn extent(&self, child: &Extent) -> Extent {
        let reach = [0, 1, 2].map(|i| match self.spacing[i] {
            0.0 => 0.0,
            spacing => spacing * self.last[i] / 2.0,
        });
        child.widened(reach)
    }

    /// Visits the points that the copies near a point see, nearest cells first.
    ///
    /// `visit` gives the value so far, by which copies with farther boxes are left out. The result is
    /// the least distance to a copy that was left out.
    pub(super) fn each(
        &self,
        child: &Extent,
        p: Point,
        mut visit: impl FnMut(Point) -> f64,
    ) -> f64 {
        let axes = [0, 1, 2].map(|axis| Axis::new(self, child, p, axis));
        let mut beside = axes.iter().map(|a| a.beside).fold(f64::INFINITY, f64::min);
        let mut limit = f64::INFINITY;
        for x in axes[0].places() {
            for y in axes[1].places() {
                for z in axes[2].places() {
                    let q = [x, y, z];
                    let distance = child.distance(q);
                    if distance > 0.0 && child.rate * distance >= limit {
                        beside = beside.min(distance);
                    } else {
                        limit = visit(q);
                    }
                }
            }
        }
        beside
    }
}

/// The copies along one axis that are near a point.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// The coordinate that the nearest copy sees.
    nearest: f64,
    spacing: f64,
    /// The numbers of copies below and above it.
    below: f64,
    above: f64,
    /// The number of them that are looked at, to each side.
    aside: f64,
    /// The distance to the nearest copy that is not looked at.
    beside: f64,
}

impl Axis {
    fn new(grid: &Grid, child: &Extent, p: Point, axis: usize) -> Self {
        let (low, high) = (child.low[axis], child.high[axis]);
        let (spacing, last) = (grid.spacing[axis], grid.last[axis]);
        if spacing == 0.0 {
            return Self {
                nearest: p[axis],
                spacing,
                below: 0.0,
                above: 0.0,
                aside: 0.0,
                beside: f64::INFINITY,
            };
        }
        let is_ended = low.is_finite() && high.is_finite();
        let middle = if is_ended { 0.5 * (low + high) } else { 0.0 };
        let (number, first) = if last.is_finite() {
            let first = -0.5 * last * spacing;
            let number = ((p[axis] - middle - first) / spacing).round();
            (number.clamp(0.0, last), first)
        } else {
            (((p[axis] - middle) / spacing).round(), 0.0)
        };
        let nearest = p[axis] - first - number * spacing;
        let (below, above) = match last.is_finite() {
            true => (number, last - number),
            false => (f64::INFINITY, f64::INFINITY),
        };
        let needed = if is_ended {
            ((high - low) / spacing).ceil() + 1.0
        } else {
            0.0
        };
        let aside = needed.clamp(MIN_CELLS_ASIDE, MAX_CELLS_ASIDE);
        let way = (aside + 1.0) * spacing;
        let mut beside = f64::INFINITY;
        if above > aside {
            beside = beside.min(low - (nearest - way));
        }
        if below > aside {
            beside = beside.min(nearest + way - high);
        }
        Self {
            nearest,
            spacing,
            below,
            above,
            aside,
            beside: if is_ended {
                beside.max(0.0)
            } else {
                0.5 * spacing
            },
        }
    }

    /// The coordinates that the copies see, nearest cells first.
    fn places(self) -> impl Iterator<Item = f64> {
        let count = 2 * self.aside as usize + 1;
        (0..count).filter_map(move |at| {
            let cells = at.div_ceil(2) as f64;
            let is_above = at % 2 == 1;
            let there = if is_above { self.above } else { self.below };
            let way = if is_above { -cells } else { cells };
            (cells <= there).then_some(self.nearest + way * self.spacing)
        })
    }
}

/// Copies around an axis.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    /// The cosine and the sine of each copy's angle.
    turns: Vec<Flat>,
    /// The number of the coordinate across x, which is 1 in the plane and 2 around the y axis.
    across: usize,
}

impl Ring {
    /// As many copies as sectors of this angle make a whole turn.
    pub(super) fn new(sector: f64, across: usize) -> Self {
        let count = (TAU / sector).round().max(1.0) as usize;
        let turn = |at: usize| {
            let (sine, cosine) = (TAU * at as f64 / count as f64).sin_cos();
            [cosine, sine]
        };
        Self {
            turns: (0..count).map(turn).collect(),
            across,
        }
    }

    /// The axis that the copies stand around.
    pub(super) fn axis(&self) -> usize {
        3 - self.across
    }

    /// Visits the points that the copies see, the nearest copies first, as [`Grid::each`] does.
    pub(super) fn each(
        &self,
        child: &Extent,
        p: Point,
        mut visit: impl FnMut(Point) -> f64,
    ) -> f64 {
        let (x, y) = (p[0], p[self.across]);
        let middle = [0, self.across].map(|i| child.low[i] + child.high[i]);
        let count = self.turns.len();
        let first = match middle.iter().all(|v| v.is_finite()) {
            true => (y.atan2(x) - middle[1].atan2(middle[0])) / TAU * count as f64,
            false => 0.0,
        };
        let first = (first.round() as i64).rem_euclid(count as i64) as usize;
        let (mut beside, mut limit) = (f64::INFINITY, f64::INFINITY);
        for at in 0..count {
            let steps = at.div_ceil(2);
            let number = if at % 2 == 1 {
                first + steps
            } else {
                first + count - steps
            };
            let [cosine, sine] = self.turns[number % count];
            let mut q = p;
            q[0] = cosine * x + sine * y;
            q[self.across] = cosine * y - sine * x;
            let distance = child.distance(q);
            if distance > 0.0 && child.rate * distance >= limit {
                beside = beside.min(distance);
            } else {
                limit = visit(q);
            }
        }
        beside
    }
}

/// The point that a shape turned by an angle about an axis sees. Angles are right-handed.
pub(super) fn turned(p: Point, about: usize, angle: f64) -> Point {
    let (sine, cosine) = angle.sin_cos();
    let (i, j) = ((about + 1) % 3, (about + 2) % 3);
    let mut q = p;
    q[i] = cosine * p[i] + sine * p[j];
    q[j] = cosine * p[j] - sine * p[i];
    q
}

/// A radius around a point whose image under a turn of `rate` per unit is within `safe`.
///
/// At a distance ρ from the axis such a turn stretches by no more than 1 + |rate| · ρ.
pub(super) fn before_turn(safe: f64, rate: f64, radius: f64) -> f64 {
    let rate = rate.abs();
    let stretch = 1.0 + rate * radius;
    if !safe.is_finite() {
        return safe;
    }
    // The positive root of rate · r² + stretch · r = safe.
    2.0 * safe / (stretch + (stretch * stretch + 4.0 * rate * safe).sqrt())
}

/// The half plane of a partial revolution that a point belongs to, or that of the nearer end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wedge {
    /// The cosine and the sine of half the angle.
    pub(super) end: Flat,
}

impl Wedge {
    /// The coordinates along and across the end on the point's side.
    pub(super) fn along_end(self, p: Point) -> Flat {
        let [cosine, sine] = self.end;
        let side = p[2].abs();
        [p[0] * cosine + side * sine, side * cosine - p[0] * sine]
    }

    /// Tells if the point is in the wedge. Both angles are at most half a turn.
    pub(super) fn holds(self, p: Point) -> bool {
        p[0] * self.end[1] >= p[2].abs() * self.end[0]
    }

    /// The distance from the axis that the point has in its half plane.
    pub(super) fn radius(self, p: Point) -> f64 {
        if self.holds(p) {
            norm2(p[0], p[2])
        } else {
            self.along_end(p)[0]
        }
    }

    /// The distance to the wedge's ends.
    pub(super) fn to_ends(self, p: Point) -> f64 {
        let [along, across] = self.along_end(p);
        if along > 0.0 {
            across.abs()
        } else {
            norm2(p[0], p[2])
        }
    }
}
