//! Cells: a sparse hierarchy of boxes, each with the part of the program that matters in it.
//!
//! A cell is cut into 4 × 4 × 4 children, which are evaluated at once, in 64 lanes, on intervals
//! that bound what `f32` gives anywhere in a child. A child in which the field has one sign is done:
//! nothing but its sign and the least magnitude of the field are kept. A child that may hold a
//! surface gets its parent's tape, pruned by the choices that the box decides, and is cut again
//! where [`Refine`] asks for it. What a tape gives inside its cell is what the whole program gives,
//! in every bit.
//!
//! Method: M. Keeter, *Massively Parallel Rendering of Complex Closed-Form Implicit Surfaces*, 2020;
//! W. Barbier and others, *Lipschitz Pruning*, 2025.

mod build;
mod find;
mod lazy;

pub use build::{Refine, build};
pub use lazy::Lazy;

use sdfc_vm::lanes::Column;
use sdfc_vm::tape::Clause;

/// How many children a cell has along each axis.
pub const SPLIT: usize = 4;
/// How many children a cell has.
pub const CHILDREN: usize = SPLIT * SPLIT * SPLIT;

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
    /// One of its children: counted along x, then y, then z.
    pub fn child(&self, index: usize) -> Self {
        let place = [index % SPLIT, index / SPLIT % SPLIT, index / SPLIT / SPLIT];
        let at = |axis: usize, n: usize| {
            let size = (self.high[axis] - self.low[axis]) / SPLIT as f32;
            if n == SPLIT {
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
    pub fn with_margin(&self) -> Self {
        let farthest = (0..3).fold(0.0, |most, axis| {
            f32::max(most, self.low[axis].abs().max(self.high[axis].abs()))
        });
        let margin = self.side() / 64.0 + farthest * 1e-6;
        Self {
            low: self.low.map(|v| v - margin),
            high: self.high.map(|v| v + margin),
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

/// A cell that may hold a surface.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Where it is.
    pub region: Region,
    /// A bound of the field's slope in it, no more than one.
    pub slope: f32,
    tape: Kept,
    /// How many levels in a row left next to nothing of their parents' tapes out.
    stale: u32,
    /// Whether it is not cut further.
    leaf: bool,
}

/// The children of a cell.
#[derive(Clone, Debug)]
struct Node {
    /// [`EMPTY`], [`FULL`], a leaf's number from [`CELL`] on, or that of a node from [`NODE`] on.
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
    /// The first is the whole.
    cells: Vec<Cell>,
    /// The first is the whole's, if it is cut.
    nodes: Vec<Node>,
    arenas: Vec<Vec<Clause>>,
}

impl Cells {
    /// The box that they fill.
    pub fn region(&self) -> &Region {
        &self.cells[0].region
    }
    /// The tape of a cell.
    pub fn tape(&self, cell: u32) -> &[Clause] {
        let Kept { arena, start, len } = self.cells[cell as usize].tape;
        &self.arenas[arena as usize][start as usize..(start + len) as usize]
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
        let clauses: usize = self.arenas.iter().map(Vec::len).sum();
        self.cells.len() * size_of::<Cell>()
            + self.nodes.len() * size_of::<Node>()
            + clauses * size_of::<Clause>()
    }
}
