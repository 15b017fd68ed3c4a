//! Plane figures: the field at every pixel, by a quadtree over the picture.
//!
//! The picture is cut into blocks of 1,024², those into 8 × 8 squares of 128², and those again into
//! squares of 16². Each time 64 squares are evaluated at once on intervals; where the field has one
//! sign and is far enough from zero, the square is filled, elsewhere the tape is pruned for it.
//! (M. Keeter, *Massively Parallel Rendering of Complex Closed-Form Implicit Surfaces*, 2020.)

use super::{Column, LANES, Points};
use crate::cells::Region;
use crate::crew::share;
use sdfc_vm::program::Program;
use sdfc_vm::tape::choose::{Chooser, Decided};
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::{Clause, Tape};
use std::sync::{Mutex, PoisonError};

/// Squares along a side of what is cut.
const SPLIT: usize = 8;
/// The side of the smallest squares, in pixels.
const SMALL: usize = 16;
/// The side of those that are cut into them.
const MIDDLE: usize = SMALL * SPLIT;
/// The side of a block.
const BLOCK: usize = MIDDLE * SPLIT;

/// A picture's plane: where its pixels are.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// The middle of the upper left pixel.
    pub first: [f32; 3],
    /// From a pixel to the one on its right.
    pub right: [f32; 3],
    /// From a pixel to the one below.
    pub down: [f32; 3],
    /// How many pixels there are along each side.
    pub size: [usize; 2],
}

impl Plane {
    #[inline(always)]
    fn at(&self, axis: usize, x: f32, y: f32) -> f32 {
        self.first[axis] + self.right[axis] * x + self.down[axis] * y
    }

    /// The middles of all pixels, row after row.
    pub fn points(&self) -> Vec<[f32; 3]> {
        let [width, height] = self.size;
        let rows = (0..height).flat_map(|y| (0..width).map(move |x| (x as f32, y as f32)));
        rows.map(|(x, y)| std::array::from_fn(|axis| self.at(axis, x, y)))
            .collect()
    }

    /// The box around a square of pixels.
    fn region(&self, [left, upper]: [usize; 2], side: usize) -> Region {
        let (x0, y0) = (left as f32, upper as f32);
        let (x1, y1) = ((left + side - 1) as f32, (upper + side - 1) as f32);
        let corners = [(x0, y0), (x1, y0), (x0, y1), (x1, y1)];
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for (x, y) in corners {
            for axis in 0..3 {
                low[axis] = low[axis].min(self.at(axis, x, y));
                high[axis] = high[axis].max(self.at(axis, x, y));
            }
        }
        // The corners' own rounding: pixels between them are rounded no worse.
        let slack =
            |axis: usize| (self.first[axis].abs() + low[axis].abs().max(high[axis].abs())) * 3e-7;
        Region {
            low: std::array::from_fn(|axis| low[axis] - slack(axis)),
            high: std::array::from_fn(|axis| high[axis] + slack(axis)),
        }
    }
}

/// The field at all pixels, row after row. In squares where it is `band` or farther from zero, what
/// is given may be any number that far from zero, of its sign.
pub fn sample(program: &Program, tape: &Tape, plane: &Plane, band: f32) -> Vec<f32> {
    let [width, height] = plane.size;
    let job = Job {
        program,
        plane,
        band,
    };
    let blocks = |length: usize| (0..length).step_by(BLOCK);
    let corners: Vec<[usize; 2]> = blocks(height)
        .flat_map(|y| blocks(width).map(move |x| [x, y]))
        .collect();
    let mut values = vec![0.0; width * height];
    for corner in corners {
        let mut chooser = Chooser::new(tape);
        let found = job.choose(&mut chooser, &tape.clauses, corner, MIDDLE);
        let mut parts: [Part; QUARTERS] = Default::default();
        let mut pruner = Pruner::default();
        pruner.reserve(tape.values, tape.points);
        for (quarter, part) in parts.iter_mut().enumerate() {
            let todo = quarter_of(quarter) & job.unfilled(&found, corner, MIDDLE);
            part.prune(chooser.decided(), todo, &tape.clauses, &mut pruner);
        }
        let squares = rows_of_squares(&mut values[corner[1] * width..], width, corner[0]);
        share(
            LANES,
            || Worker::new(tape),
            |worker, lane| {
                // Each is asked for once: nobody waits here.
                let mut rows = squares[lane].lock().unwrap_or_else(PoisonError::into_inner);
                if rows.is_empty() {
                    return;
                }
                if let Some(value) = job.filled(&found, lane) {
                    rows.iter_mut().for_each(|row| row.fill(value));
                    return;
                }
                let mut clauses = std::mem::take(&mut worker.middle);
                let part = &parts[quarter_with(lane)];
                part.square(lane, &mut worker.pruner, &mut clauses);
                worker.middle_square(&job, &clauses, place(corner, MIDDLE, lane), &mut rows);
                worker.middle = clauses;
            },
        );
    }
    values
}

/// The rows of pixels in each of the squares of [`MIDDLE`] pixels that a block is cut into, from the
/// block's first row on; none where a square lies outside the picture.
fn rows_of_squares(values: &mut [f32], width: usize, left: usize) -> Vec<Mutex<Vec<&mut [f32]>>> {
    let mut squares: Vec<Vec<&mut [f32]>> = (0..LANES).map(|_| Vec::new()).collect();
    for (y, row) in values.chunks_mut(width).take(BLOCK).enumerate() {
        let across = row[left..].chunks_mut(MIDDLE).take(SPLIT);
        for (x, part) in across.enumerate() {
            squares[y / MIDDLE * SPLIT + x].push(part);
        }
    }
    squares.into_iter().map(Mutex::new).collect()
}

/// The place of a square in what is cut.
fn place([left, upper]: [usize; 2], side: usize, lane: usize) -> [usize; 2] {
    [left + lane % SPLIT * side, upper + lane / SPLIT * side]
}

/// What is to be sampled.
struct Job<'a> {
    program: &'a Program,
    plane: &'a Plane,
    band: f32,
}

impl Job<'_> {
    /// Whether any pixel of a square with this corner is in the picture.
    fn holds(&self, [left, upper]: [usize; 2]) -> bool {
        left < self.plane.size[0] && upper < self.plane.size[1]
    }

    /// Runs a tape on the squares of what is cut; gives what the field lies between.
    fn choose(
        &self,
        chooser: &mut Chooser,
        tape: &[Clause],
        corner: [usize; 2],
        side: usize,
    ) -> [Column; 2] {
        let boxes = chooser.boxes();
        for lane in 0..LANES {
            self.plane
                .region(place(corner, side, lane), side)
                .put(boxes, lane);
        }
        *chooser.run(self.program, tape, LANES)
    }

    /// The squares in the picture that are not filled, as bits.
    fn unfilled(&self, found: &[Column; 2], corner: [usize; 2], side: usize) -> u64 {
        let lanes = (0..LANES).filter(|&lane| {
            self.holds(place(corner, side, lane)) && self.filled(found, lane).is_none()
        });
        lanes.fold(0, |bits, lane| bits | 1 << lane)
    }

    /// What a square is filled with, if the field is far enough from zero everywhere in it.
    fn filled(&self, [low, high]: &[Column; 2], lane: usize) -> Option<f32> {
        let (low, high) = (low.0[lane], high.0[lane]);
        if low > 0.0 && low >= self.band {
            Some(low)
        } else if high < 0.0 && high <= -self.band {
            Some(high)
        } else {
            None
        }
    }
}

/// Into how many parts the squares of what is cut are put, which are pruned together first.
const QUARTERS: usize = 4;

/// The quarter that a square is in.
fn quarter_with(lane: usize) -> usize {
    let half = SPLIT / 2;
    lane / SPLIT / half * 2 + lane % SPLIT / half
}

/// The squares of a quarter, as bits.
fn quarter_of(quarter: usize) -> u64 {
    let lanes = (0..LANES).filter(|&lane| quarter_with(lane) == quarter);
    lanes.fold(0, |bits, lane| bits | 1 << lane)
}

/// What of a tape matters in any square of a quarter, and what each square decides of it.
#[derive(Default)]
struct Part {
    clauses: Vec<Clause>,
    decided: Decided,
}

impl Part {
    /// Prunes a tape for those squares of a quarter that are to be sampled.
    fn prune(&mut self, decided: &Decided, todo: u64, tape: &[Clause], pruner: &mut Pruner) {
        self.clauses.clear();
        if todo != 0 {
            decided.prune_for(todo, tape, pruner, &mut self.clauses, &mut self.decided);
        }
    }

    /// What of it matters in a square.
    fn square(&self, lane: usize, pruner: &mut Pruner, kept: &mut Vec<Clause>) {
        kept.clear();
        let choice = |place| self.decided.choice(place, lane);
        pruner.prune(&self.clauses, choice, kept);
    }
}

/// The memory of one thread.
struct Worker {
    chooser: Chooser,
    pruner: Pruner,
    machine: Machine<f32>,
    middle: Vec<Clause>,
    part: Part,
    small: Vec<Clause>,
}

impl Worker {
    fn new(tape: &Tape) -> Self {
        let mut worker = Self {
            chooser: Chooser::new(tape),
            pruner: Pruner::default(),
            machine: Machine::new(tape.values, tape.points),
            middle: Vec::new(),
            part: Part::default(),
            small: Vec::new(),
        };
        worker.pruner.reserve(tape.values, tape.points);
        worker
    }

    /// Samples a square of [`MIDDLE`] pixels, of which these rows are in the picture.
    fn middle_square(
        &mut self,
        job: &Job<'_>,
        tape: &[Clause],
        corner: [usize; 2],
        rows: &mut [&mut [f32]],
    ) {
        let found = job.choose(&mut self.chooser, tape, corner, SMALL);
        let unfilled = job.unfilled(&found, corner, SMALL);
        let mut part = std::mem::take(&mut self.part);
        for quarter in 0..QUARTERS {
            let todo = quarter_of(quarter) & unfilled;
            let pruner = &mut self.pruner;
            part.prune(self.chooser.decided(), todo, tape, pruner);
            let lanes = (0..LANES).filter(|&lane| quarter_with(lane) == quarter);
            for lane in lanes {
                let [left, upper] = place([0, 0], SMALL, lane);
                let inside = rows.iter_mut().skip(upper).take(SMALL);
                let inside = inside.filter_map(|row| {
                    let end = row.len().min(left + SMALL);
                    row.get_mut(left..end)
                });
                if let Some(value) = job.filled(&found, lane) {
                    inside.for_each(|row| row.fill(value));
                } else if todo >> lane & 1 == 1 {
                    part.square(lane, &mut self.pruner, &mut self.small);
                    self.small_square(job, [corner[0] + left, corner[1] + upper], inside);
                }
            }
        }
        self.part = part;
    }

    /// Samples a square of [`SMALL`] pixels, four rows at a time.
    fn small_square<'v>(
        &mut self,
        job: &Job<'_>,
        [left, upper]: [usize; 2],
        rows: impl Iterator<Item = &'v mut [f32]>,
    ) {
        const ROWS: usize = LANES / SMALL;
        let mut values = Column::default();
        // What of the coordinates is the same in all rows.
        let mut across = Points::default();
        let mut downwards = Column::default();
        for lane in 0..LANES {
            let x = (left + lane % SMALL) as f32;
            for (axis, column) in across.iter_mut().enumerate() {
                column.0[lane] = job.plane.first[axis] + job.plane.right[axis] * x;
            }
            downwards.0[lane] = (upper + lane / SMALL) as f32;
        }
        for (y, row) in rows.enumerate() {
            if y % ROWS == 0 {
                let points: &mut Points = self.machine.seed();
                for (axis, column) in points.iter_mut().enumerate() {
                    let down = job.plane.down[axis];
                    for lane in 0..LANES {
                        let row = downwards.0[lane] + y as f32;
                        column.0[lane] = across[axis].0[lane] + down * row;
                    }
                }
                values = *self.machine.run(job.program, &self.small, LANES);
            }
            let sampled = &values.0[y % ROWS * SMALL..][..SMALL];
            row.copy_from_slice(&sampled[..row.len()]);
        }
    }
}
