//! Cells that are built when a point in them is first evaluated: for points in no particular order, such as
//! those of shadow rays. Every box has its tape here, with a surface in it or not, since a shadow's edge
//! depends on the distance itself.

use super::lookup::{COORDINATE_BITS, CellGrid, DIGIT_BITS};
use super::{Aabb, CHILDREN, CellSplit};
use sdfc_vm::lanes::{CHUNK, LANES, Points};
use sdfc_vm::multiversion;
use sdfc_vm::program::Program;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::trace::{Trace, Tracer};
use sdfc_vm::tape::{Clause, Tape};

/// Cells whose tape has at most this number of clauses are not split.
const MAX_UNSPLIT_CLAUSES: usize = 16;
/// Maximum number of levels.
const MAX_LEVELS: u32 = 7;
/// Maximum number of cells. Beyond it all but the root are discarded, and rebuilt on demand.
const MAX_CELLS: usize = 150_000;
/// Maximum number of clauses of all tapes together.
const MAX_CLAUSES: usize = 3_000_000;

/// Marks a child without a cell.
const NOT_BUILT: u32 = u32::MAX;

/// Number of evaluations of a cell's tape, each of a chunk of lanes, after which it is split. A split costs
/// about as much.
const SPLIT_AFTER_RUNS: usize = 12;
/// Cost of collecting points and starting a tape, in clauses run on a chunk of lanes.
const BATCH_OVERHEAD_CLAUSES: usize = 3;
/// Cost of grouping a chunk of points by cell and scattering the values back, in clauses run on a chunk of
/// lanes. Measured while points were sorted, which takes longer: 1 µs for 64 points, in which 88 clauses are run
/// on a chunk.
const GROUPING_COST_CLAUSES: usize = 22;
/// Number of points of a trial, after which the costs with and without cells are compared.
const TRIAL_POINTS: usize = 1 << 16;

/// A box and its tape.
struct LazyCell {
    region: Aabb,
    /// First clause of the tape.
    start: u32,
    len: u32,
    /// Number of clauses that were run in it, per chunk of lanes.
    work: usize,
    /// Children and the choices that their boxes decide, once a point lay in one.
    children: Option<Box<Children>>,
}

struct Children {
    cells: [u32; CHILDREN],
    trace: Trace,
}

/// Cells that are built on demand. Each thread has its own.
pub struct OnDemandCells {
    grid: CellGrid,
    cells: Vec<LazyCell>,
    /// Clauses of all tapes, the root's first.
    clauses: Vec<Clause>,
    tracer: Tracer,
    pruner: Pruner,
    /// Clauses of the cell under construction.
    pruned: Vec<Clause>,
    /// Keys of the points to evaluate. Those of a batch follow each other.
    keys: Vec<MortonKey>,
    /// Keys of a batch while they are grouped by child.
    grouped_keys: Vec<MortonKey>,
    /// Batches that are not yet evaluated.
    pending: Vec<CellBatch>,
    /// Costs of the current trial.
    trial: CostTrial,
    are_cheaper: bool,
}

/// Cost of evaluating the points of the current trial, in clauses run on a chunk of lanes.
#[derive(Default)]
struct CostTrial {
    points: usize,
    /// Cost with cells.
    cell_cost: usize,
    /// Cost of the full tape.
    full_tape_cost: usize,
}

/// Returns the cost of running a tape on points, in clauses run on a chunk of lanes.
fn cost(clauses: usize, points: usize) -> usize {
    (clauses + 1) * points.div_ceil(CHUNK) + BATCH_OVERHEAD_CLAUSES
}

/// Points that lie in the same cell: a range of the keys.
#[derive(Clone, Copy)]
struct CellBatch {
    cell: u32,
    /// Level of the cell; the root's is 0.
    level: u32,
    from: u32,
    to: u32,
}

/// Maximum number of blocks of 64 points per call.
pub const MAX_BLOCKS: usize = 64;
/// Number of bits of a point's index.
const LANE_BITS: u32 = (MAX_BLOCKS * LANES).ilog2();
/// Key of a point outside the root cell, without the index.
const OUTSIDE: u64 = u64::MAX << LANE_BITS;

/// Key of a point: its child on each level, the coarsest first, and its index in the lowest bits.
#[derive(Clone, Copy)]
pub struct MortonKey(u64);

impl MortonKey {
    /// Returns the point's block and lane.
    #[inline(always)]
    pub fn block_and_lane(self) -> (usize, usize) {
        let lane = self.0 as usize % (MAX_BLOCKS * LANES);
        (lane / LANES, lane % LANES)
    }

    /// Returns the child that contains the point, of its cell at `level`.
    #[inline(always)]
    fn child(self, level: u32) -> usize {
        let shift = (MAX_LEVELS - 1 - level) * 3 * DIGIT_BITS;
        (self.0 >> (LANE_BITS + shift)) as usize % CHILDREN
    }
}

multiversion! {
    /// Computes the keys of the points of a block.
    fn morton_keys(grid: &CellGrid, points: &Points, block: usize, keys: &mut [MortonKey; LANES]) = morton_keys_body;
}

#[inline(always)]
fn morton_keys_body(grid: &CellGrid, points: &Points, block: usize, keys: &mut [MortonKey; LANES]) {
    let (coordinates, inside) = grid.lane_coordinates(points);
    for (lane, key) in keys.iter_mut().enumerate() {
        let digits = |axis: usize| {
            spread_digits(coordinates[axis][lane] >> (COORDINATE_BITS - MAX_LEVELS * DIGIT_BITS))
        };
        let morton_code = digits(0) | digits(1) << DIGIT_BITS | digits(2) << (2 * DIGIT_BITS);
        let morton_code = if inside[lane] == 0 {
            OUTSIDE
        } else {
            morton_code << LANE_BITS
        };
        *key = MortonKey(morton_code | (block * LANES + lane) as u64);
    }
}

/// Spreads the digits of a coordinate, with room for those of two other coordinates between them.
#[inline(always)]
fn spread_digits(digits: u32) -> u64 {
    let digits = u64::from(digits);
    let digits = (digits | digits << 16) & 0x3f00_00ff;
    let digits = (digits | digits << 8) & 0x30_0f00_f00f;
    (digits | digits << 4) & 0x30_c30c_30c3
}

const _: () = assert!(DIGIT_BITS == 2 && MAX_LEVELS == 7);

/// Moves the keys of points inside the root cell before all others, and returns their number.
fn move_inside_to_front(keys: &mut [MortonKey]) -> usize {
    let is_inside = |key: MortonKey| key.0 < OUTSIDE;
    let mut inside = 0;
    for index in 0..keys.len() {
        if is_inside(keys[index]) {
            keys.swap(inside, index);
            inside += 1;
        }
    }
    inside
}

/// Counts the points in each child of their cell at `level`.
fn child_counts(keys: &[MortonKey], level: u32) -> [u32; CHILDREN] {
    // Neighbours often have the same child. Two counters let one addition begin before the other has ended.
    let (mut counts, mut odd_counts) = ([0; CHILDREN], [0; CHILDREN]);
    let (pairs, rest) = keys.as_chunks();
    for [even, odd] in pairs {
        counts[even.child(level)] += 1;
        odd_counts[odd.child(level)] += 1;
    }
    for key in rest {
        counts[key.child(level)] += 1;
    }
    for (count, odd_count) in counts.iter_mut().zip(odd_counts) {
        *count += odd_count;
    }
    counts
}

/// Groups the keys of a cell at `level` by child, given the numbers of points in each.
fn group_by_child(
    keys: &mut [MortonKey],
    level: u32,
    counts: &[u32; CHILDREN],
    grouped: &mut Vec<MortonKey>,
) {
    let mut next = [0; CHILDREN];
    for child in 1..CHILDREN {
        next[child] = next[child - 1] + counts[child - 1] as usize;
    }
    if grouped.len() < keys.len() {
        grouped.resize(keys.len(), MortonKey(0));
    }
    let grouped = &mut grouped[..keys.len()];
    for &key in &*keys {
        let place = &mut next[key.child(level)];
        grouped[*place] = key;
        *place += 1;
    }
    keys.copy_from_slice(grouped);
}

impl OnDemandCells {
    /// Creates the root cell of a tape in a box. Points outside use the full tape.
    pub fn new(tape: &Tape, region: Aabb) -> Self {
        let mut cells = Self {
            grid: CellGrid::new(&region),
            cells: vec![LazyCell {
                region,
                start: 0,
                len: tape.clauses.len() as u32,
                work: 0,
                children: None,
            }],
            clauses: tape.clauses.clone(),
            tracer: Tracer::new(tape),
            pruner: Pruner::default(),
            pruned: Vec::new(),
            keys: Vec::new(),
            grouped_keys: Vec::new(),
            pending: Vec::new(),
            trial: CostTrial::default(),
            are_cheaper: true,
        };
        cells.pruner.reserve(tape.values, tape.points);
        cells
    }

    /// Reports whether cells were cheaper than the full tape in the last trial. Where pruning removes little,
    /// as for fields that are the same everywhere, grouping points by cell is not profitable.
    pub fn are_cheaper_than_full_tape(&self) -> bool {
        self.are_cheaper
    }

    /// Calls `run` with batches of at most 64 of the first `count` points, each with a tape that is valid
    /// there. `points` has at most [`MAX_BLOCKS`] blocks. Points share a batch as long as that is cheaper
    /// than the shorter tapes of smaller cells.
    pub fn for_each_batch(
        &mut self,
        program: &Program,
        points: &[Points],
        count: usize,
        mut run: impl FnMut(&[MortonKey], &[Clause]),
    ) {
        if self.cells.len() >= MAX_CELLS || self.clauses.len() >= MAX_CLAUSES {
            self.discard_children();
        }
        let mut keys = std::mem::take(&mut self.keys);
        keys.resize(points.len() * LANES, MortonKey(0));
        for (block, (points, keys)) in points.iter().zip(keys.as_chunks_mut().0).enumerate() {
            morton_keys(&self.grid, points, block, keys);
        }
        keys.truncate(count);
        self.record_trial(count);
        let inside = move_inside_to_front(&mut keys);
        for keys in keys[inside..].chunks(LANES) {
            run(keys, self.tape(0));
        }
        self.pending.push(CellBatch {
            cell: 0,
            level: 0,
            from: 0,
            to: inside as u32,
        });
        while let Some(batch) = self.pending.pop() {
            if !self.split_batch(program, &mut keys, batch) {
                let tape_length = self.cells[batch.cell as usize].len as usize;
                self.trial.cell_cost += cost(tape_length, (batch.to - batch.from) as usize);
                let clauses = self.tape(batch.cell);
                for keys in keys[batch.from as usize..batch.to as usize].chunks(LANES) {
                    run(keys, clauses);
                }
            }
        }
        self.keys = keys;
    }

    /// Adds points to the current trial, after ending a trial that is long enough.
    fn record_trial(&mut self, points: usize) {
        let trial = &mut self.trial;
        if trial.points >= TRIAL_POINTS {
            self.are_cheaper = trial.cell_cost < trial.full_tape_cost;
            *trial = CostTrial::default();
        }
        trial.points += points;
        trial.cell_cost += GROUPING_COST_CLAUSES * points.div_ceil(CHUNK);
        trial.full_tape_cost += cost(self.cells[0].len as usize, points);
    }

    /// Discards all cells but the root.
    fn discard_children(&mut self) {
        self.cells.truncate(1);
        self.cells[0].children = None;
        self.clauses.truncate(self.cells[0].len as usize);
    }

    fn tape(&self, cell: u32) -> &[Clause] {
        let LazyCell { start, len, .. } = self.cells[cell as usize];
        &self.clauses[start as usize..(start + len) as usize]
    }

    /// Pushes a batch's points as batches of the children, if that is cheaper. Reports whether it is. Only then
    /// its keys are grouped by child.
    fn split_batch(&mut self, program: &Program, keys: &mut [MortonKey], batch: CellBatch) -> bool {
        let parent = &mut self.cells[batch.cell as usize];
        let tape_length = parent.len as usize;
        if tape_length <= MAX_UNSPLIT_CLAUSES || batch.level >= MAX_LEVELS || batch.from == batch.to
        {
            return false;
        }
        let unsplit_cost = cost(tape_length, (batch.to - batch.from) as usize);
        parent.work += unsplit_cost;
        if parent.work < SPLIT_AFTER_RUNS * tape_length {
            return false;
        }
        let keys = &mut keys[batch.from as usize..batch.to as usize];
        let counts = child_counts(keys, batch.level);
        let (first_pending, mut from, mut split_cost) = (self.pending.len(), batch.from, 0);
        for (child, count) in counts
            .into_iter()
            .enumerate()
            .filter(|&(_, count)| count > 0)
        {
            let child_cell = match &self.cells[batch.cell as usize].children {
                Some(children) => children.cells[child],
                None => NOT_BUILT,
            };
            let cell = if child_cell == NOT_BUILT {
                self.build_child(program, batch.cell, child)
            } else {
                child_cell
            };
            // Longer tapes are split later where that is profitable, down to about this length.
            let tape_length = (self.cells[cell as usize].len as usize).min(2 * MAX_UNSPLIT_CLAUSES);
            split_cost += cost(tape_length, count as usize);
            let to = from + count;
            self.pending.push(CellBatch {
                cell,
                level: batch.level + 1,
                from,
                to,
            });
            from = to;
        }
        let has_one_child = self.pending.len() == first_pending + 1;
        let is_cheaper = split_cost < unsplit_cost || has_one_child;
        if !is_cheaper {
            self.pending.truncate(first_pending);
        } else if !has_one_child {
            group_by_child(keys, batch.level, &counts, &mut self.grouped_keys);
        }
        is_cheaper
    }

    /// Builds a child and returns its index.
    fn build_child(&mut self, program: &Program, parent: u32, child: usize) -> u32 {
        let index = self.cells.len() as u32;
        let LazyCell { start, len, .. } = self.cells[parent as usize];
        let tape = start as usize..(start + len) as usize;
        let cell = &mut self.cells[parent as usize];
        let (region, tracer) = (cell.region, &mut self.tracer);
        let children = cell.children.get_or_insert_with(|| {
            let boxes = tracer.boxes();
            for lane in 0..CHILDREN {
                let child = region.child(lane, CellSplit::Volume);
                child
                    .with_margin(CellSplit::Volume, 0.0)
                    .write_lane(boxes, lane);
            }
            tracer.run(program, &self.clauses[tape.clone()], LANES);
            Box::new(Children {
                cells: [NOT_BUILT; CHILDREN],
                trace: tracer.trace().clone(),
            })
        });
        let first = self.clauses.len();
        let trace = &children.trace;
        let choice = |clause| trace.choice(clause, child);
        let mut pruned = std::mem::take(&mut self.pruned);
        pruned.clear();
        self.pruner.prune(&self.clauses[tape], choice, &mut pruned);
        self.clauses.extend_from_slice(&pruned);
        self.pruned = pruned;
        let pruned = (self.clauses.len() - first) as u32;
        children.cells[child] = index;
        self.cells.push(LazyCell {
            region: region.child(child, CellSplit::Volume),
            start: first as u32,
            len: pruned,
            work: 0,
            children: None,
        });
        index
    }
}
