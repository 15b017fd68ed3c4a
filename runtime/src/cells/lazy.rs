//! Cells that are made when a point is first asked for: the way for points that come in no order,
//! as those of shadow rays do. Every part of space has its tape here, with a surface in it or not,
//! since a shadow's edge needs the distance itself.

use super::find::{BITS, DIGIT, Grid, OUTSIDE, child_at};
use super::{CHILDREN, Region, Split};
use sdfc_vm::lanes::{LANES, Points};
use sdfc_vm::program::Program;
use sdfc_vm::tape::choose::{Chooser, Decided};
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::{Clause, Tape};

/// A tape of no more clauses is short enough.
const SHORT: usize = 12;
/// The most levels.
const LEVELS: u32 = 7;
/// The most cells; then all are forgotten, and made again where they are asked for.
const MOST: usize = 60_000;
/// The most clauses of all.
const MOST_CLAUSES: usize = 2_000_000;

/// The cell of a child that nobody asked for yet.
const UNKNOWN: u32 = u32::MAX;

/// How often a cell is looked up before it is cut: cutting takes about as long as so many batches.
const VISITS: u32 = 12;
/// A tape of so many clauses is never run twice where it can be cut.
const LONG: usize = 256;

/// A part of space and its tape.
struct Cell {
    region: Region,
    clauses: Vec<Clause>,
    /// How often it was looked up and not cut.
    visits: u32,
    /// How many levels in a row left next to nothing out.
    stale: u32,
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
    /// How many clauses they have together, without the whole.
    clauses: usize,
    chooser: Chooser,
    pruner: Pruner,
    last: Last,
}

/// The cell of the last point: neighbours most often lie in the same.
#[derive(Clone, Copy)]
struct Last {
    place: [u32; 3],
    /// The bits of a place that do not matter in it.
    within: u32,
    cell: u32,
}

impl Lazy {
    /// The cells of a tape in a box; outside, the whole tape holds.
    pub fn new(tape: &Tape, region: Region) -> Self {
        let mut lazy = Self {
            grid: Grid::of(&region),
            cells: vec![Cell {
                region,
                clauses: tape.clauses.clone(),
                visits: VISITS,
                stale: 0,
                children: None,
            }],
            clauses: 0,
            chooser: Chooser::new(tape),
            pruner: Pruner::default(),
            last: Last {
                place: [0; 3],
                within: 0,
                cell: 0,
            },
        };
        lazy.pruner.reserve(tape.values, tape.points);
        // The whole is right for every place, so nothing is remembered that is not so.
        lazy.last.within = 0;
        lazy
    }

    /// For each point the cell whose tape holds there.
    pub fn find(
        &mut self,
        program: &Program,
        points: &Points,
        count: usize,
        found: &mut [u32; LANES],
    ) {
        let enough = self.cells.len() >= MOST || self.clauses >= MOST_CLAUSES;
        if enough {
            self.forget();
        }
        let places = self.grid.places(points);
        for lane in 0..count {
            let place: [u32; 3] = std::array::from_fn(|axis| places[axis][lane]);
            found[lane] = if place[0] == OUTSIDE {
                0
            } else {
                self.at(program, place)
            };
        }
    }

    /// Keeps the whole only.
    fn forget(&mut self) {
        self.cells.truncate(1);
        self.cells[0].children = None;
        self.clauses = 0;
        self.last.within = 0;
        self.last.cell = 0;
    }

    /// The tape of a cell.
    pub fn tape(&self, cell: u32) -> &[Clause] {
        &self.cells[cell as usize].clauses
    }

    #[inline(always)]
    fn at(&mut self, program: &Program, place: [u32; 3]) -> u32 {
        let last = self.last;
        let [x, y, z] = [0, 1, 2].map(|axis| place[axis] ^ last.place[axis]);
        if (x | y | z) >> last.within != 0 {
            self.descend(program, place);
        }
        self.last.cell
    }

    fn descend(&mut self, program: &Program, place: [u32; 3]) {
        let (mut cell, mut within) = (0_u32, BITS);
        while within > BITS - DIGIT * LEVELS {
            let here = &mut self.cells[cell as usize];
            if here.clauses.len() <= SHORT || here.stale > 1 {
                break;
            }
            here.visits += 1;
            if here.visits < VISITS && here.clauses.len() < LONG {
                break;
            }
            let child = child_at(place, within - DIGIT);
            let known = match &self.cells[cell as usize].children {
                Some(children) => children.cells[child],
                None => UNKNOWN,
            };
            let next = if known == UNKNOWN {
                self.make(program, cell, child)
            } else {
                known
            };
            cell = next;
            within -= DIGIT;
        }
        self.last = Last {
            place,
            within,
            cell,
        };
    }

    /// Makes a child.
    fn make(&mut self, program: &Program, parent: u32, child: usize) -> u32 {
        let number = self.cells.len() as u32;
        let cell = &mut self.cells[parent as usize];
        let chooser = &mut self.chooser;
        let children = cell.children.get_or_insert_with(|| {
            let boxes = chooser.boxes();
            for lane in 0..CHILDREN {
                let child = cell.region.child(lane, Split::Cube);
                child.with_margin(Split::Cube).put(boxes, lane);
            }
            chooser.run(program, &cell.clauses, LANES);
            Box::new(Children {
                cells: [UNKNOWN; CHILDREN],
                decided: chooser.decided().clone(),
            })
        });
        let mut clauses = Vec::new();
        let decided = &children.decided;
        self.pruner.prune(
            &cell.clauses,
            |place| decided.choice(place, child),
            &mut clauses,
        );
        clauses.shrink_to_fit();
        self.clauses += clauses.len();
        children.cells[child] = number;
        let region = cell.region.child(child, Split::Cube);
        let little = clauses.len() * 10 > cell.clauses.len() * 9;
        let stale = if little { cell.stale + 1 } else { 0 };
        self.cells.push(Cell {
            region,
            clauses,
            visits: 0,
            stale,
            children: None,
        });
        number
    }
}
