//! Cells: a sparse hierarchy of boxes, each with the part of the program that matters in it.
//!
//! A cell is cut into 64 children, which are evaluated at once, in as many lanes. A child in which
//! the field is farther from zero than anyone asks for ([`Cut::band`]) is done: nothing but its sign
//! is kept. Every other one gets its parent's tape, pruned by the choices that the box decides, and
//! is cut again where [`Refine`] asks for it. What a tape gives inside its cell is what the whole
//! program gives, in every bit.
//!
//! Method: M. Keeter, *Massively Parallel Rendering of Complex Closed-Form Implicit Surfaces*, 2020;
//! W. Barbier and others, *Lipschitz Pruning*, 2025.

mod again;
mod build;
mod find;
mod lazy;
mod pack;

pub use again::{again, changed};
pub use build::{Cut, Refine, build};
pub use find::{Held, Part};
pub use lazy::{BLOCKS, Key, Lazy};
pub use pack::{Left, Packed, registers};

use crate::frame::CellStats;
use sdfc_vm::lanes::Column;
use sdfc_vm::tape::Clause;
use std::sync::Arc;

/// How many children a cell has.
pub const CHILDREN: usize = 64;

/// How a cell is cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Split {
    /// Into 4 × 4 × 4 children.
    #[default]
    Cube,
    /// Into 8 × 8 along x and y: all points that are asked for lie in a plane.
    Square,
}

impl Split {
    /// The bits that say which child a place lies in, along each axis that is cut.
    pub const fn digit(self) -> u32 {
        match self {
            Self::Cube => 2,
            Self::Square => 3,
        }
    }
    /// How many levels of cells there are at most: the coordinates of deeper ones would hardly
    /// differ in `f32`.
    pub const fn levels(self) -> u32 {
        match self {
            Self::Cube => 10,
            Self::Square => 6,
        }
    }
    /// The bits of a place.
    pub const fn bits(self) -> u32 {
        self.digit() * self.levels()
    }
    fn counts(self) -> [usize; 3] {
        match self {
            Self::Cube => [4; 3],
            Self::Square => [8, 8, 1],
        }
    }
}

/// A box.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Region {
    /// The lower corner.
    pub low: [f32; 3],
    /// The upper corner.
    pub high: [f32; 3],
}

impl Region {
    /// Its longest side.
    pub fn side(&self) -> f32 {
        (0..3).fold(0.0, |side, axis| {
            f32::max(side, self.high[axis] - self.low[axis])
        })
    }
    /// Whether a point lies in it.
    pub fn holds(&self, p: [f32; 3]) -> bool {
        (0..3).all(|axis| self.low[axis] <= p[axis] && p[axis] <= self.high[axis])
    }
    /// One of its children: counted along x, then y, then z.
    pub fn child(&self, index: usize, split: Split) -> Self {
        let counts = split.counts();
        let [x, y, _] = counts;
        let place = [index % x, index / x % y, index / x / y];
        let at = |axis: usize, n: usize| {
            let size = (self.high[axis] - self.low[axis]) / counts[axis] as f32;
            if n == counts[axis] {
                self.high[axis]
            } else {
                self.low[axis] + size * n as f32
            }
        };
        Self {
            low: std::array::from_fn(|axis| at(axis, place[axis])),
            high: std::array::from_fn(|axis| at(axis, place[axis] + 1)),
        }
    }
    /// The box that is looked at for a cell in this one: a little larger, for what rounding puts on
    /// the wrong side of a face.
    pub fn with_margin(&self, split: Split) -> Self {
        let farthest = (0..3).fold(0.0, |most, axis| {
            f32::max(most, self.low[axis].abs().max(self.high[axis].abs()))
        });
        let margin = self.side() / 64.0 + farthest * 1e-6;
        let counts = split.counts();
        let margin = |axis: usize| if counts[axis] > 1 { margin } else { 0.0 };
        Self {
            low: std::array::from_fn(|axis| self.low[axis] - margin(axis)),
            high: std::array::from_fn(|axis| self.high[axis] + margin(axis)),
        }
    }
    /// Writes it to a lane of boxes.
    pub fn put(&self, boxes: &mut [Column; 6], lane: usize) {
        for axis in 0..3 {
            boxes[axis].0[lane] = self.low[axis];
            boxes[axis + 3].0[lane] = self.high[axis];
        }
    }
}

/// Where the clauses of a cell's tape are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Kept {
    arena: u32,
    start: u32,
    len: u32,
}

impl Kept {
    /// Names the list.
    fn key(self) -> (u32, u32) {
        (self.arena, self.start)
    }
}

/// A cell that may hold a surface.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Where it is.
    pub region: Region,
    /// A bound of the field's slope in it, no more than one.
    pub slope: f32,
    /// Bounds of the field's gradient in it, where they were found out.
    pub gradient: Option<[[f32; 2]; 3]>,
    /// Set where the field may jump in it: its gradient has no bound there.
    pub jumps: bool,
    tape: Kept,
    /// How many levels in a row left next to nothing of their parents' tapes out.
    stale: u32,
    /// Whether it is not cut further.
    leaf: bool,
    /// Whether that is left to somebody else ([`Refine::leaves`]).
    left: bool,
}

/// The children of a cell.
#[derive(Clone, Debug)]
struct Node {
    /// Whose children they are.
    cell: u32,
    /// [`EMPTY`], [`FULL`], a cell's number from [`CELL`] on, or that of a node from [`NODE`] on.
    children: [u32; CHILDREN],
}

/// The child is all outside.
const EMPTY: u32 = 0;
/// The child is all inside.
const FULL: u32 = 1;
/// The child is a leaf.
const CELL: u32 = 2;
/// The child has children.
const NODE: u32 = 1 << 31;

/// A scene's cells.
#[derive(Clone, Debug)]
pub struct Cells {
    split: Split,
    band: f32,
    /// The first is the whole.
    cells: Vec<Cell>,
    /// The children of all that are cut.
    nodes: Vec<Node>,
    /// The node of the whole, if it is cut.
    root: u32,
    arenas: Vec<Arc<Vec<Clause>>>,
    /// How many cells were made last, and how many when all were.
    made: usize,
    first: usize,
    /// How many were not cut for want of memory.
    short: usize,
    /// Reports whether the field may jump anywhere in them.
    jumps: bool,
}

impl Cells {
    /// The box that they fill.
    pub fn region(&self) -> &Region {
        &self.cells[0].region
    }
    /// How they are cut.
    pub fn split(&self) -> Split {
        self.split
    }
    /// Reports whether the field may jump in the box that they fill: a value tells nothing beyond its cell then.
    pub fn jumps(&self) -> bool {
        self.jumps
    }
    /// How many cells were made last: all, or those that an edit reached.
    pub fn made(&self) -> usize {
        self.made
    }
    /// How many cells were not cut for want of memory, so that they kept the tapes that they had.
    pub fn short(&self) -> usize {
        self.short
    }
    /// How many cells there are, and how many clauses their tapes have that they do not share with
    /// the cell around them. How many of them are fresh, who asked for them knows.
    pub fn counts(&self) -> CellStats {
        CellStats {
            made: self.cells.len() as u64,
            clauses: self.clauses() as u64,
            short: self.short as u64,
            fresh: 0,
        }
    }
    /// The tape of a cell.
    pub fn tape(&self, cell: u32) -> &[Clause] {
        let Kept { arena, start, len } = self.cells[cell as usize].tape;
        &self.arenas[arena as usize][start as usize..(start + len) as usize]
    }
    /// What is the same for cells that share one tape.
    pub fn tape_key(&self, cell: u32) -> u64 {
        let (arena, start) = self.cells[cell as usize].tape.key();
        u64::from(arena) << 32 | u64::from(start)
    }
    /// A cell.
    pub fn cell(&self, cell: u32) -> &Cell {
        &self.cells[cell as usize]
    }
    /// The numbers of the cells that are not cut further.
    pub fn leaves(&self) -> impl Iterator<Item = u32> {
        let cells = self.cells.iter().zip(0..);
        cells.filter_map(|(cell, number)| cell.leaf.then_some(number))
    }
    /// How much memory they take, in bytes.
    pub fn size(&self) -> usize {
        self.cells.len() * size_of::<Cell>()
            + self.nodes.len() * size_of::<Node>()
            + self.clauses() * size_of::<Clause>()
    }
    /// The share of the work of finding a surface that is left in a leaf, in the mean over all: how much of
    /// the whole tape, times how steep the field can be there.
    pub fn share(&self) -> f32 {
        let whole = self.tape(0).len().max(1) as f32;
        let (mut sum, mut count) = (0.0, 0);
        for leaf in self.leaves() {
            sum += self.tape(leaf).len() as f32 / whole * self.cell(leaf).slope;
            count += 1;
        }
        sum / count.max(1) as f32
    }
    /// How many clauses all lists have together.
    fn clauses(&self) -> usize {
        self.arenas.iter().map(|arena| arena.len()).sum()
    }
}
