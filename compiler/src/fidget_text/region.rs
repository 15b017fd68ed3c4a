//! The part of space in which a `.vm` file is shown.
//!
//! Fidget shows the square or cube from −1 to 1. A shape that is proved to lie in it is shown as there. Any other shape
//! is shown in its extent, which is searched by intervals. Where it is infinite, it ends at the smallest cube, doubled
//! from that one, beyond which no sample lies inside. If there is no such cube, it ends as far away as its farthest
//! finite side.

use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::analysis::extent::extent;
use crate::expression::{ExprId, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

/// Half sides of the tried cubes.
const HALF_SIDES: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];
/// Maximum number of operations for the samples of one cube; longer files are sampled at fewer points.
const MAX_SAMPLING_OPERATIONS: usize = 3_000_000;
/// Maximum number of operations for the proof that nothing lies beyond a cube.
const MAX_PROOF_OPERATIONS: usize = 400_000;
/// Minimum number of boxes of that proof, for long files.
const MIN_PROOF_BOXES: usize = 200;
/// Distance from a cube, in its half sides, within which a shape counts as touching it from inside.
const MAX_TOUCHING_DISTANCE: f64 = 1e-6;
/// Range of the number of samples along a side.
const SAMPLES_PER_SIDE: [usize; 2] = [6, 24];

/// The part of space in which a file is shown.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShownRegion {
    pub(super) bounds: Bounds,
    /// The axes along which the solid may continue beyond the bounds.
    pub(super) is_cut: [bool; 3],
}

impl ShownRegion {
    fn complete(bounds: Bounds) -> Self {
        Self {
            bounds,
            is_cut: [false; 3],
        }
    }
}

/// Returns the region in which a number of the point is shown as a solid where it is below zero.
pub(super) fn shown_region(expressions: &Expressions, value: ExprId, is_2d: bool) -> ShownRegion {
    let max_points = MAX_SAMPLING_OPERATIONS / (6 * expressions.len().max(1));
    let [least, most] = SAMPLES_PER_SIDE;
    let mut samples = CubeSamples {
        field: field(expressions, value),
        is_2d,
        per_side: max_points.isqrt().clamp(least, most),
    };
    let [unit, .., largest_cube] = HALF_SIDES;
    let found = extent(expressions, value, &mut |id| uniform_range(expressions, id));
    if found.is_empty() {
        return ShownRegion::complete(samples.cube(unit));
    }
    let max_boxes = (MAX_PROOF_OPERATIONS / expressions.len().max(1)).max(MIN_PROOF_BOXES);
    let axes = if is_2d { 0..2 } else { 0..3 };
    let is_endless = axes
        .clone()
        .any(|axis| found.min[axis].is_infinite() || found.max[axis].is_infinite());
    let is_within = if is_endless {
        // Samples must suffice.
        let searched = found.intersection(&samples.cube(largest_cube));
        samples.content_beyond(unit, &searched, max_boxes) != Content::Some
            && !samples.extends_beyond(unit)
    } else {
        samples.content_beyond(unit, &found, max_boxes) == Content::None
    };
    if is_within && samples.is_inside(unit) {
        return ShownRegion::complete(samples.cube(unit));
    }
    let mut is_cut = [false; 3];
    let mut bounds = found;
    let ends = |axis: usize| [-found.min[axis], found.max[axis]];
    let finite_ends = axes.clone().flat_map(ends).filter(|end| end.is_finite());
    let largest = finite_ends.fold(unit, f64::max);
    if is_endless {
        // An infinite shape extends beyond every cube.
        let half_side = HALF_SIDES
            .into_iter()
            .find(|&half| !samples.extends_beyond(half));
        let end = half_side.unwrap_or(largest);
        for axis in axes {
            // A shape beside the origin is shown as far as it is away from it.
            let [low, high] = ends(axis);
            is_cut[axis] = half_side.is_none() && (low.is_infinite() || high.is_infinite());
            if low.is_infinite() {
                bounds.min[axis] = -end - (-high).max(0.0);
            }
            if high.is_infinite() {
                bounds.max[axis] = end + (-low).max(0.0);
            }
        }
    }
    ShownRegion { bounds, is_cut }
}

/// Returns a program for the values of a number in boxes.
pub(super) fn field(expressions: &Expressions, value: ExprId) -> BoxNumber<Interval> {
    let mut uniform = |id| UniformInput::Known(uniform_range(expressions, id));
    BoxNumber::new(expressions, value, &mut uniform)
}

/// Returns the range of a number that depends on no point. Files have no parameters, so it is a constant.
fn uniform_range(expressions: &Expressions, id: ExprId) -> Interval {
    expressions
        .as_constant(id)
        .map_or(Interval::ALL, Interval::point)
}

/// Content of a part of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    /// It is proved to be empty.
    None,
    /// A point of the shape lies there.
    Some,
    /// Neither is known.
    Unknown,
}

/// Values of a field in cubes around the origin, and on their faces.
struct CubeSamples {
    field: BoxNumber<Interval>,
    is_2d: bool,
    per_side: usize,
}

impl CubeSamples {
    /// Returns the cube, or the square in the plane.
    fn cube(&self, half_side: f64) -> Bounds {
        let depth = if self.is_2d { f64::INFINITY } else { half_side };
        Bounds::centred([half_side, half_side, depth])
    }

    /// Returns the box that is evaluated for a cube, or for a point: the plane has no depth.
    fn range(&mut self, mut bounds: Bounds) -> Interval {
        if self.is_2d {
            (bounds.min[2], bounds.max[2]) = (0.0, 0.0);
        }
        self.field.eval(&bounds, &[])
    }

    /// Reports whether a part of the shape lies in a box but beyond a cube, by at most this number of boxes.
    fn content_beyond(&mut self, half_side: f64, region: &Bounds, max_boxes: usize) -> Content {
        let side = half_side * (1.0 + MAX_TOUCHING_DISTANCE);
        let axes = if self.is_2d { 0..2 } else { 0..3 };
        let slabs = axes.flat_map(|axis| {
            let (mut below, mut above) = (*region, *region);
            below.max[axis] = below.max[axis].min(-side);
            above.min[axis] = above.min[axis].max(side);
            [below, above]
        });
        let mut pending: Vec<Bounds> = slabs.filter(|slab| !slab.is_empty()).collect();
        let mut evaluated = 0;
        while let Some(part) = pending.pop() {
            evaluated += 1;
            if evaluated > max_boxes {
                return Content::Unknown;
            }
            let range = self.range(part);
            if range.lo > 0.0 {
                continue;
            }
            let centre = part.centre();
            let (min, max) = (centre, centre);
            if range.hi < 0.0 || self.range(Bounds { min, max }).hi < 0.0 {
                return Content::Some;
            }
            let sides = [0, 1, 2].map(|axis| match self.is_2d && axis == 2 {
                true => 0.0,
                false => part.max[axis] - part.min[axis],
            });
            let longest = (0..3).max_by(|&a, &b| sides[a].total_cmp(&sides[b]));
            let longest = longest.unwrap_or(0);
            let (mut low, mut high) = (part, part);
            low.max[longest] = centre[longest];
            high.min[longest] = centre[longest];
            pending.extend([low, high]);
        }
        Content::None
    }

    /// Reports whether a point of a grid is inside, given its coordinates along each axis. Parts on which intervals
    /// decide are not sampled.
    fn is_any_inside(&mut self, grid: [&[f64]; 3]) -> bool {
        let range = self.range(Bounds {
            min: grid.map(|axis| axis[0]),
            max: grid.map(|axis| axis[axis.len() - 1]),
        });
        let longest = (0..3).max_by_key(|&axis| grid[axis].len()).unwrap_or(0);
        if range.hi < 0.0 || range.lo > 0.0 || grid[longest].len() == 1 {
            return range.hi < 0.0;
        }
        let (low, high) = grid[longest].split_at(grid[longest].len() / 2);
        [low, high].into_iter().any(|part| {
            let mut grid = grid;
            grid[longest] = part;
            self.is_any_inside(grid)
        })
    }

    /// Reports whether a point of a grid in the cube is inside.
    fn is_inside(&mut self, half_side: f64) -> bool {
        let steps = self.steps(half_side);
        let depths: &[f64] = if self.is_2d { &[0.0] } else { &steps };
        self.is_any_inside([&steps, &steps, depths])
    }

    /// Reports whether a point of a grid on the faces of the cube is inside.
    fn extends_beyond(&mut self, half_side: f64) -> bool {
        let axes = if self.is_2d { 0..2 } else { 0..3 };
        let steps = self.steps(half_side);
        let depths: &[f64] = if self.is_2d { &[0.0] } else { &steps };
        axes.flat_map(|axis| [(axis, -half_side), (axis, half_side)])
            .any(|(axis, side)| {
                let mut grid = [&steps, &steps, depths];
                let face = [side];
                grid[axis] = &face;
                self.is_any_inside(grid)
            })
    }

    fn steps(&self, half_side: f64) -> Vec<f64> {
        let last = (self.per_side - 1) as f64;
        (0..self.per_side)
            .map(|i| half_side * (2.0 * i as f64 / last - 1.0))
            .collect()
    }
}
