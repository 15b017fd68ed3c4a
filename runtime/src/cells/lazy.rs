//! Cells that are made when a point is first asked for: the way for points that come in no order,
//! as those of shadow rays do. Every part of space has its tape here, with a surface in it or not,
//! since a shadow's edge needs the distance itself.

use super::find::{BITS, DIGIT, Grid};
use super::{CHILDREN, Region, Split};
use sdfc_vm::lanes::{CHUNK, LANES, Points};
use sdfc_vm::program::Program;
use sdfc_vm::tape::choose::{Chooser, Decided};
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::{Clause, Tape};
use sdfc_vm::widest;

/// A tape of no more clauses is short enough.
const SHORT: usize = 16;
/// The most levels.
const LEVELS: u32 = 7;
/// The most cells; then all are forgotten, and made again where they are asked for.
const MOST: usize = 150_000;
/// The most clauses of all.
const MOST_CLAUSES: usize = 3_000_000;

/// The cell of a child that nobody asked for yet.
const UNKNOWN: u32 = u32::MAX;

/// A cell is cut when this many times its tape's length of clauses have been run in it: cutting takes
/// about as long.
const WORTH: usize = 12;
/// What it takes to collect points and to start a tape, in clauses run on a chunk.
const START: usize = 3;
/// What it takes to sort a chunk of points into cells and their values back, in clauses run on it.
/// Measured: 1 µs for 64 points, in which 88 clauses are run on a chunk.
const SORTING: usize = 22;
/// After so many points it is looked at whether the shorter tapes pay.
const TRIAL: usize = 1 << 16;

/// A part of space and its tape.
struct Cell {
    region: Region,
    /// Where its clauses are.
    start: u32,
    len: u32,
    /// How many clauses have been run in it, by chunks of lanes.
    work: usize,
    /// Its children, if there was a point in one: their cells, and what they decide.
    children: Option<Box<Children>>,
}

struct Children {
    cells: [u32; CHILDREN],
    decided: Decided,
}

/// Cells that are made by need. Each thread has its own.
pub struct Lazy {
    grid: Grid,
    cells: Vec<Cell>,
    /// The tapes of all, the whole's first.
    clauses: Vec<Clause>,
    chooser: Chooser,
    pruner: Pruner,
    /// The clauses of the cell that is being made.
    kept: Vec<Clause>,
    /// The points that are asked about, in the order of their places.
    keys: Vec<Key>,
    /// Those that are still to be brought to a cell.
    todo: Vec<Group>,
    /// What the present trial took.
    trial: Trial,
    pays: bool,
}

/// What so many points took, in clauses run on a chunk of lanes.
#[derive(Default)]
struct Trial {
    points: usize,
    /// With cells.
    took: usize,
    /// What the whole tape would have taken.
    whole: usize,
}

/// What it takes to run so many clauses on so many points.
fn cost(clauses: usize, points: usize) -> usize {
    (clauses + 1) * points.div_ceil(CHUNK) + START
}

/// Points that lie in the same cell: neighbours in the order of places.
#[derive(Clone, Copy)]
struct Group {
    cell: u32,
    /// How many levels of cells there are above it.
    level: u32,
    from: u32,
    to: u32,
}

/// The most blocks of 64 points at once.
pub const BLOCKS: usize = 64;
/// The bits of a lane's number.
const LANE_BITS: u32 = (BLOCKS * LANES).ilog2();
/// The key of a place outside, without the lane.
const OUTSIDE: u64 = u64::MAX << LANE_BITS;

/// A point's place, as which child it lies in on each level, and its lane in the lowest bits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key(u64);

impl Key {
    /// The point's block and lane.
    #[inline(always)]
    pub fn lane(self) -> (usize, usize) {
        let lane = self.0 as usize % (BLOCKS * LANES);
        (lane / LANES, lane % LANES)
    }

    /// Which child of its cell it lies in, that many levels down.
    #[inline(always)]
    fn child(self, level: u32) -> usize {
        let digits = (LEVELS - 1 - level) * 3 * DIGIT;
        (self.0 >> (LANE_BITS + digits)) as usize % CHILDREN
    }
}

widest! {
    /// Keys of the points of a block.
    fn keys_of(grid: &Grid, points: &Points, block: usize, keys: &mut [Key; LANES]) = keys_body;
}

#[inline(always)]
fn keys_body(grid: &Grid, points: &Points, block: usize, keys: &mut [Key; LANES]) {
    let (places, inside) = grid.places(points);
    for (lane, key) in keys.iter_mut().enumerate() {
        let digits = |axis: usize| spread(places[axis][lane] >> (BITS - LEVELS * DIGIT));
        let place = digits(0) | digits(1) << DIGIT | digits(2) << (2 * DIGIT);
        let place = if inside[lane] == 0 {
            OUTSIDE
        } else {
            place << LANE_BITS
        };
        *key = Key(place | (block * LANES + lane) as u64);
    }
}

/// The digits of a place with room for those of two others between each and the next.
#[inline(always)]
fn spread(place: u32) -> u64 {
    let place = u64::from(place);
    let place = (place | place << 16) & 0x3f00_00ff;
    let place = (place | place << 8) & 0x30_0f00_f00f;
    (place | place << 4) & 0x30_c30c_30c3
}

const _: () = assert!(DIGIT == 2 && LEVELS == 7);

impl Lazy {
    /// The cells of a tape in a box; outside, the whole tape holds.
    pub fn new(tape: &Tape, region: Region) -> Self {
        let mut lazy = Self {
            grid: Grid::of(&region),
            cells: vec![Cell {
                region,
                start: 0,
                len: tape.clauses.len() as u32,
                work: 0,
                children: None,
            }],
            clauses: tape.clauses.clone(),
            chooser: Chooser::new(tape),
            pruner: Pruner::default(),
            kept: Vec::new(),
            keys: Vec::new(),
            todo: Vec::new(),
            trial: Trial::default(),
            pays: true,
        };
        lazy.pruner.reserve(tape.values, tape.points);
        lazy
    }

    /// Whether its cells took less time lately than the whole tape would have: where they leave little
    /// out, as of fields that are the same everywhere, sorting points into them is for nothing.
    pub fn pays(&self) -> bool {
        self.pays
    }

    /// Hands the first `count` points of at most [`BLOCKS`] blocks to `run`, at most 64 at a time,
    /// with a tape that holds where they are. Points are kept together as long as that is cheaper
    /// than the shorter tapes of smaller cells are.
    pub fn each(
        &mut self,
        program: &Program,
        points: &[Points],
        count: usize,
        mut run: impl FnMut(&[Key], &[Clause]),
    ) {
        if self.cells.len() >= MOST || self.clauses.len() >= MOST_CLAUSES {
            self.forget();
        }
        let mut keys = std::mem::take(&mut self.keys);
        keys.resize(points.len() * LANES, Key(0));
        for (block, (points, keys)) in points.iter().zip(keys.as_chunks_mut().0).enumerate() {
            keys_of(&self.grid, points, block, keys);
        }
        keys.truncate(count);
        self.tried(count);
        keys.sort_unstable();
        let inside = keys.partition_point(|key| key.0 < OUTSIDE);
        for keys in keys[inside..].chunks(LANES) {
            run(keys, self.tape(0));
        }
        self.todo.push(Group {
            cell: 0,
            level: 0,
            from: 0,
            to: inside as u32,
        });
        while let Some(group) = self.todo.pop() {
            if !self.split(program, &keys, group) {
                let length = self.cells[group.cell as usize].len as usize;
                self.trial.took += cost(length, (group.to - group.from) as usize);
                let clauses = self.tape(group.cell);
                for keys in keys[group.from as usize..group.to as usize].chunks(LANES) {
                    run(keys, clauses);
                }
            }
        }
        self.keys = keys;
    }

    /// So many points are asked for; ends a trial that is long enough.
    fn tried(&mut self, points: usize) {
        let trial = &mut self.trial;
        if trial.points >= TRIAL {
            self.pays = trial.took < trial.whole;
            *trial = Trial::default();
        }
        trial.points += points;
        trial.took += SORTING * points.div_ceil(CHUNK);
        trial.whole += cost(self.cells[0].len as usize, points);
    }

    /// Keeps the whole only.
    fn forget(&mut self) {
        self.cells.truncate(1);
        self.cells[0].children = None;
        self.clauses.truncate(self.cells[0].len as usize);
    }

    fn tape(&self, cell: u32) -> &[Clause] {
        let Cell { start, len, .. } = self.cells[cell as usize];
        &self.clauses[start as usize..(start + len) as usize]
    }

    /// Puts a cell's points on the list by the children that they lie in, if that pays.
    fn split(&mut self, program: &Program, keys: &[Key], group: Group) -> bool {
        let here = &mut self.cells[group.cell as usize];
        let length = here.len as usize;
        if length <= SHORT || group.level >= LEVELS || group.from == group.to {
            return false;
        }
        let whole = cost(length, (group.to - group.from) as usize);
        here.work += whole;
        if here.work < WORTH * length {
            return false;
        }
        let child_of = |place: u32| keys[place as usize].child(group.level);
        let (first, mut from, mut sum) = (self.todo.len(), group.from, 0);
        while from < group.to {
            let child = child_of(from);
            let to = if child_of(group.to - 1) == child {
                group.to
            } else {
                (from + 1..group.to)
                    .find(|&place| child_of(place) != child)
                    .unwrap_or(group.to)
            };
            let known = match &self.cells[group.cell as usize].children {
                Some(children) => children.cells[child],
                None => UNKNOWN,
            };
            let cell = if known == UNKNOWN {
                self.make(program, group.cell, child)
            } else {
                known
            };
            // What is left to cut will be cut where that pays, down to about this.
            let length = (self.cells[cell as usize].len as usize).min(2 * SHORT);
            sum += cost(length, (to - from) as usize);
            self.todo.push(Group {
                cell,
                level: group.level + 1,
                from,
                to,
            });
            from = to;
        }
        let pays = sum < whole || self.todo.len() == first + 1;
        if !pays {
            self.todo.truncate(first);
        }
        pays
    }

    /// Makes a child.
    fn make(&mut self, program: &Program, parent: u32, child: usize) -> u32 {
        let number = self.cells.len() as u32;
        let Cell { start, len, .. } = self.cells[parent as usize];
        let tape = start as usize..(start + len) as usize;
        let cell = &mut self.cells[parent as usize];
        let (region, chooser) = (cell.region, &mut self.chooser);
        let children = cell.children.get_or_insert_with(|| {
            let boxes = chooser.boxes();
            for lane in 0..CHILDREN {
                let child = region.child(lane, Split::Cube);
                child.with_margin(Split::Cube).put(boxes, lane);
            }
            chooser.run(program, &self.clauses[tape.clone()], LANES);
            Box::new(Children {
                cells: [UNKNOWN; CHILDREN],
                decided: chooser.decided().clone(),
            })
        });
        let first = self.clauses.len();
        let decided = &children.decided;
        let choice = |place| decided.choice(place, child);
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        self.pruner.prune(&self.clauses[tape], choice, &mut kept);
        self.clauses.extend_from_slice(&kept);
        self.kept = kept;
        let kept = (self.clauses.len() - first) as u32;
        children.cells[child] = number;
        self.cells.push(Cell {
            region: region.child(child, Split::Cube),
            start: first as u32,
            len: kept,
            work: 0,
            children: None,
        });
        number
    }
}
