//! 2-D shapes: the field at every pixel of a plane, by a quadtree over the picture.
//!
//! The picture is divided into blocks of 1,024² pixels, those into 8 × 8 squares of 128², and those again
//! into squares of 16². Each time 64 squares are evaluated at once on intervals. Where the field has one sign
//! and is far enough from zero, the square is filled; elsewhere the tape is pruned for it. (M. Keeter,
//! *Massively Parallel Rendering of Complex Closed-Form Implicit Surfaces*, 2020.)

use super::plane_edges::{PlanePicture, PlaneValues, cover};
use super::{F32x64, LANES, Points};
use crate::cells::Aabb;
use crate::render::{ExactValues, PixelPlane};
use crate::work_stealing::parallel_map_with;
use rayon::prelude::*;
use sdfc_vm::program::Program;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::trace::{Trace, Tracer};
use sdfc_vm::tape::{Clause, Tape};
use std::sync::{Mutex, PoisonError};

/// Number of squares along a side of a split square.
const SQUARES_PER_SIDE: usize = 8;
/// Side of the smallest squares, in pixels.
const SMALL_SIDE: usize = 16;
/// Side of the squares that are divided into the smallest, in pixels.
const MIDDLE_SIDE: usize = SMALL_SIDE * SQUARES_PER_SIDE;
/// Side of a block, in pixels.
const BLOCK_SIDE: usize = MIDDLE_SIDE * SQUARES_PER_SIDE;

/// Returns the bounding box of a square of pixels and of `border` pixels around it.
fn square_region(plane: &PixelPlane, [left, upper]: [usize; 2], side: usize, border: u32) -> Aabb {
    let border = border as f32;
    let (x0, y0) = (left as f32 - border, upper as f32 - border);
    let [x1, y1] = [left, upper].map(|first| (first + side - 1) as f32 + border);
    let corners = [(x0, y0), (x1, y0), (x0, y1), (x1, y1)];
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for (x, y) in corners {
        for axis in 0..3 {
            low[axis] = low[axis].min(plane.coordinate(axis, x, y));
            high[axis] = high[axis].max(plane.coordinate(axis, x, y));
        }
    }
    // The slack covers the rounding of the corners; pixels between them are rounded no worse.
    let slack =
        |axis: usize| (plane.first[axis].abs() + low[axis].abs().max(high[axis].abs())) * 3e-7;
    Aabb {
        low: std::array::from_fn(|axis| low[axis] - slack(axis)),
        high: std::array::from_fn(|axis| high[axis] + slack(axis)),
    }
}

/// Samples the field at all pixels, row after row. A square without values that must be exact has one value.
pub fn sample(program: &Program, tape: &Tape, plane: &PixelPlane, exact: ExactValues) -> Vec<f32> {
    let job = SamplingJob {
        program,
        plane,
        exact,
    };
    sample_squares(&job, tape).0
}

/// Returns the samples of [`sample`], and how much of each pixel is covered if `exact` asks for it.
pub fn picture(
    program: &Program,
    tape: &Tape,
    plane: &PixelPlane,
    exact: ExactValues,
) -> PlanePicture {
    let job = SamplingJob {
        program,
        plane,
        exact,
    };
    let (values, edge_squares) = sample_squares(&job, tape);
    let mut picture = PlanePicture {
        values,
        covered: Vec::new(),
        width: plane.size[0],
        border: usize::from(exact.edges.is_some()),
    };
    if let Some(samples) = exact.edges {
        cover_squares(&job, tape, samples, &edge_squares, &mut picture);
    }
    picture
}

/// A square of [`SMALL_SIDE`] pixels whose values are exact, with the tape that is pruned for it.
struct EdgeSquare {
    corner: [usize; 2],
    tape: Box<[Clause]>,
}

/// Computes how much of each pixel is covered. Outside the edge squares, all or nothing is.
fn cover_squares(
    job: &SamplingJob<'_>,
    tape: &Tape,
    samples: u32,
    squares: &[EdgeSquare],
    picture: &mut PlanePicture,
) {
    let [width, height] = job.plane.size;
    let by_sign = |value: &f32| f32::from(u8::from(*value < 0.0));
    picture.covered = picture.values.par_iter().map(by_sign).collect();
    let values = PlaneValues {
        values: &picture.values,
        width,
    };
    // The border has no neighbours, and is not seen.
    let sides = |square: &EdgeSquare| {
        let [left, upper] = square.corner;
        let columns = left.max(1)..(left + SMALL_SIDE).min(width - 1);
        (columns, upper.max(1)..(upper + SMALL_SIDE).min(height - 1))
    };
    let covered = parallel_map_with(
        squares.len(),
        || TapeEvaluator::<f32>::new(tape.values, tape.points),
        |evaluator, index| {
            let square = &squares[index];
            let (columns, rows) = sides(square);
            let pixels = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
            let mut covered = [0.0; SMALL_SIDE * SMALL_SIDE];
            cover(values, pixels, samples, &mut covered, |positions| {
                let points: &mut Points = evaluator.inputs_mut();
                for (axis, column) in points.iter_mut().enumerate() {
                    for lane in 0..LANES {
                        let [x, y] = positions[lane.min(positions.len() - 1)];
                        column.0[lane] = job.plane.coordinate(axis, x, y);
                    }
                }
                *evaluator.run(job.program, &square.tape, positions.len())
            });
            covered
        },
    );
    for (square, covered) in squares.iter().zip(covered) {
        let (columns, rows) = sides(square);
        for (y, covered) in rows.zip(covered.chunks(columns.len().max(1))) {
            let first = y * width;
            let row = &mut picture.covered[first + columns.start..first + columns.end];
            row.copy_from_slice(&covered[..row.len()]);
        }
    }
}

/// Samples the field at all pixels. If coverage is computed, also returns the squares with edges.
fn sample_squares(job: &SamplingJob<'_>, tape: &Tape) -> (Vec<f32>, Vec<EdgeSquare>) {
    let plane = job.plane;
    let [width, height] = plane.size;
    let mut edge_squares = Vec::new();
    let blocks = |length: usize| (0..length).step_by(BLOCK_SIDE);
    let corners: Vec<[usize; 2]> = blocks(height)
        .flat_map(|y| blocks(width).map(move |x| [x, y]))
        .collect();
    let mut values = vec![0.0; width * height];
    for corner in corners {
        let mut tracer = Tracer::new(tape);
        let ranges = job.trace_squares(&mut tracer, &tape.clauses, corner, MIDDLE_SIDE);
        let mut quarter_tapes: [QuarterTape; QUARTERS] = Default::default();
        let mut pruner = Pruner::default();
        pruner.reserve(tape.values, tape.points);
        for (quarter, quarter_tape) in quarter_tapes.iter_mut().enumerate() {
            let unfilled_mask = quarter_mask(quarter) & job.unfilled(&ranges, corner, MIDDLE_SIDE);
            quarter_tape.prune(tracer.trace(), unfilled_mask, &tape.clauses, &mut pruner);
        }
        let squares = rows_of_squares(&mut values[corner[1] * width..], width, corner[0]);
        let found = parallel_map_with(
            LANES,
            || Worker::new(tape),
            |worker, lane| {
                // Each square is taken once, so no thread waits here.
                let mut rows = squares[lane].lock().unwrap_or_else(PoisonError::into_inner);
                if rows.is_empty() {
                    return Vec::new();
                }
                if let Some(value) = job.filled(&ranges, lane) {
                    rows.iter_mut().for_each(|row| row.fill(value));
                    return Vec::new();
                }
                let mut clauses = std::mem::take(&mut worker.middle_tape);
                let quarter_tape = &quarter_tapes[quarter_containing(lane)];
                quarter_tape.prune_for_square(lane, &mut worker.pruner, &mut clauses);
                worker.middle_square(
                    job,
                    &clauses,
                    square_corner(corner, MIDDLE_SIDE, lane),
                    &mut rows,
                );
                worker.middle_tape = clauses;
                std::mem::take(&mut worker.edge_squares)
            },
        );
        edge_squares.extend(found.into_iter().flatten());
    }
    (values, edge_squares)
}

/// Returns the rows of pixels in each of the 64 squares of a block, from the block's first row on. Squares
/// outside the picture have no rows.
fn rows_of_squares(values: &mut [f32], width: usize, left: usize) -> Vec<Mutex<Vec<&mut [f32]>>> {
    let mut squares: Vec<Vec<&mut [f32]>> = (0..LANES).map(|_| Vec::new()).collect();
    for (y, row) in values.chunks_mut(width).take(BLOCK_SIDE).enumerate() {
        let pieces = row[left..].chunks_mut(MIDDLE_SIDE).take(SQUARES_PER_SIDE);
        for (x, piece) in pieces.enumerate() {
            squares[y / MIDDLE_SIDE * SQUARES_PER_SIDE + x].push(piece);
        }
    }
    squares.into_iter().map(Mutex::new).collect()
}

/// Returns the upper left pixel of a square of a split square.
fn square_corner([left, upper]: [usize; 2], side: usize, lane: usize) -> [usize; 2] {
    [
        left + lane % SQUARES_PER_SIDE * side,
        upper + lane / SQUARES_PER_SIDE * side,
    ]
}

/// Inputs of a sampling run.
struct SamplingJob<'a> {
    program: &'a Program,
    plane: &'a PixelPlane,
    exact: ExactValues,
}

impl SamplingJob<'_> {
    /// Reports whether any pixel of a square with this corner is in the picture.
    fn contains_pixel(&self, [left, upper]: [usize; 2]) -> bool {
        left < self.plane.size[0] && upper < self.plane.size[1]
    }

    /// Runs a tape on the 64 squares of a split square; returns the range of the field in each.
    fn trace_squares(
        &self,
        tracer: &mut Tracer,
        tape: &[Clause],
        corner: [usize; 2],
        side: usize,
    ) -> [F32x64; 2] {
        let boxes = tracer.boxes();
        for lane in 0..LANES {
            let corner = square_corner(corner, side, lane);
            square_region(self.plane, corner, side, self.exact.pixels_around_edges())
                .write_lane(boxes, lane);
        }
        *tracer.run(self.program, tape, LANES)
    }

    /// Returns the mask of the squares in the picture that are not filled.
    fn unfilled(&self, ranges: &[F32x64; 2], corner: [usize; 2], side: usize) -> u64 {
        let lanes = (0..LANES).filter(|&lane| {
            self.contains_pixel(square_corner(corner, side, lane))
                && self.filled(ranges, lane).is_none()
        });
        lanes.fold(0, |bits, lane| bits | 1 << lane)
    }

    /// Returns the value to fill a square with, if the field is far enough from zero everywhere in it.
    fn filled(&self, [low, high]: &[F32x64; 2], lane: usize) -> Option<f32> {
        let (low, high) = (low.0[lane], high.0[lane]);
        if low > 0.0 && low >= self.exact.band {
            Some(low)
        } else if high < 0.0 && high <= -self.exact.band {
            Some(high)
        } else {
            None
        }
    }
}

/// Number of groups of squares; each group's tape is pruned before those of its squares.
const QUARTERS: usize = 4;

/// Returns the quarter that contains a square.
fn quarter_containing(lane: usize) -> usize {
    let half = SQUARES_PER_SIDE / 2;
    lane / SQUARES_PER_SIDE / half * 2 + lane % SQUARES_PER_SIDE / half
}

/// Returns the mask of the squares of a quarter.
fn quarter_mask(quarter: usize) -> u64 {
    let lanes = (0..LANES).filter(|&lane| quarter_containing(lane) == quarter);
    lanes.fold(0, |bits, lane| bits | 1 << lane)
}

/// A tape pruned for a quarter, and the choices that each of its squares decides in it.
#[derive(Default)]
struct QuarterTape {
    clauses: Vec<Clause>,
    trace: Trace,
}

impl QuarterTape {
    /// Prunes a tape for those squares of a quarter that are to be sampled.
    fn prune(&mut self, trace: &Trace, mask: u64, tape: &[Clause], pruner: &mut Pruner) {
        self.clauses.clear();
        if mask != 0 {
            trace.prune_for(mask, tape, pruner, &mut self.clauses, &mut self.trace);
        }
    }

    /// Prunes the quarter's tape for a square.
    fn prune_for_square(&self, lane: usize, pruner: &mut Pruner, pruned: &mut Vec<Clause>) {
        pruned.clear();
        let choice = |index| self.trace.choice(index, lane);
        pruner.prune(&self.clauses, choice, pruned);
    }
}

/// Evaluators and buffers of one thread.
struct Worker {
    tracer: Tracer,
    pruner: Pruner,
    evaluator: TapeEvaluator<f32>,
    middle_tape: Vec<Clause>,
    quarter_tape: QuarterTape,
    small_tape: Vec<Clause>,
    edge_squares: Vec<EdgeSquare>,
}

impl Worker {
    fn new(tape: &Tape) -> Self {
        let mut worker = Self {
            tracer: Tracer::new(tape),
            pruner: Pruner::default(),
            evaluator: TapeEvaluator::new(tape.values, tape.points),
            middle_tape: Vec::new(),
            quarter_tape: QuarterTape::default(),
            small_tape: Vec::new(),
            edge_squares: Vec::new(),
        };
        worker.pruner.reserve(tape.values, tape.points);
        worker
    }

    /// Samples a square of [`MIDDLE_SIDE`] pixels; `rows` are its rows in the picture.
    fn middle_square(
        &mut self,
        job: &SamplingJob<'_>,
        tape: &[Clause],
        corner: [usize; 2],
        rows: &mut [&mut [f32]],
    ) {
        let ranges = job.trace_squares(&mut self.tracer, tape, corner, SMALL_SIDE);
        let unfilled = job.unfilled(&ranges, corner, SMALL_SIDE);
        let mut quarter_tape = std::mem::take(&mut self.quarter_tape);
        for quarter in 0..QUARTERS {
            let mask = quarter_mask(quarter) & unfilled;
            let pruner = &mut self.pruner;
            quarter_tape.prune(self.tracer.trace(), mask, tape, pruner);
            let lanes = (0..LANES).filter(|&lane| quarter_containing(lane) == quarter);
            for lane in lanes {
                let [left, upper] = square_corner([0, 0], SMALL_SIDE, lane);
                let square_rows = rows.iter_mut().skip(upper).take(SMALL_SIDE);
                let square_rows = square_rows.filter_map(|row| {
                    let end = row.len().min(left + SMALL_SIDE);
                    row.get_mut(left..end)
                });
                if let Some(value) = job.filled(&ranges, lane) {
                    square_rows.for_each(|row| row.fill(value));
                } else if mask >> lane & 1 == 1 {
                    quarter_tape.prune_for_square(lane, &mut self.pruner, &mut self.small_tape);
                    self.small_square(job, [corner[0] + left, corner[1] + upper], square_rows);
                }
            }
        }
        self.quarter_tape = quarter_tape;
    }

    /// Samples a square of [`SMALL_SIDE`] pixels, four rows at a time.
    fn small_square<'v>(
        &mut self,
        job: &SamplingJob<'_>,
        [left, upper]: [usize; 2],
        rows: impl Iterator<Item = &'v mut [f32]>,
    ) {
        const ROWS: usize = LANES / SMALL_SIDE;
        if job.exact.edges.is_some() {
            self.edge_squares.push(EdgeSquare {
                corner: [left, upper],
                tape: self.small_tape.as_slice().into(),
            });
        }
        let mut values = F32x64::default();
        // Parts of the coordinates that are the same in all rows.
        let mut row_points = Points::default();
        let mut row_numbers = F32x64::default();
        for lane in 0..LANES {
            let x = (left + lane % SMALL_SIDE) as f32;
            for (axis, column) in row_points.iter_mut().enumerate() {
                column.0[lane] = job.plane.first[axis] + job.plane.right[axis] * x;
            }
            row_numbers.0[lane] = (upper + lane / SMALL_SIDE) as f32;
        }
        for (y, row) in rows.enumerate() {
            if y % ROWS == 0 {
                let points: &mut Points = self.evaluator.inputs_mut();
                for (axis, column) in points.iter_mut().enumerate() {
                    let down_step = job.plane.down[axis];
                    for lane in 0..LANES {
                        let row = row_numbers.0[lane] + y as f32;
                        column.0[lane] = row_points[axis].0[lane] + down_step * row;
                    }
                }
                values = *self.evaluator.run(job.program, &self.small_tape, LANES);
            }
            let sampled = &values.0[y % ROWS * SMALL_SIDE..][..SMALL_SIDE];
            row.copy_from_slice(&sampled[..row.len()]);
        }
    }
}
