//! Cells: a sparse hierarchy of boxes, each with the program pruned to the operations that matter in it.
//!
//! A cell has 64 children, which are evaluated at once, one per lane. A child in which the field is at least
//! [`CellSpec::band`] from zero stores only the sign. Every other child gets its parent's tape, pruned by the
//! choices that the box decides. It is split again where [`SplitRule`] requests it. Inside its cell a
//! pruned tape gives the same bits as the full program.
//!
//! Method: M. Keeter, *Massively Parallel Rendering of Complex Closed-Form Implicit Surfaces*, 2020; W.
//! Barbier and others, *Lipschitz Pruning*, 2025.

mod build;
pub(crate) mod gradient_slack;
mod incremental;
mod lookup;
mod on_demand;
mod pack;
pub(crate) mod policy;
pub(crate) mod split_rule;
pub(crate) mod trial;

pub use build::{CellSpec, build};
pub use incremental::{changed_instructions, rebuild_after_edit};
pub use lookup::{CellInfo, Occupancy};
pub use on_demand::{MAX_BLOCKS, MortonKey, OnDemandCells};
pub use pack::{DeferredCell, GpuCells, required_registers};
pub use split_rule::SplitRule;

use crate::render::CellStats;
use sdfc_vm::lanes::F32x64;
use sdfc_vm::tape::Clause;
use std::sync::Arc;

/// Number of children of a cell.
pub const CHILDREN: usize = 64;

/// Arrangement of the children of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CellSplit {
    /// 4 × 4 × 4 children.
    #[default]
    Volume,
    /// 8 × 8 children along x and y, for points that all lie in a plane.
    Plane,
}

impl CellSplit {
    /// Number of bits that select a child along each split axis.
    pub const fn digit_bits(self) -> u32 {
        match self {
            Self::Volume => 2,
            Self::Plane => 3,
        }
    }
    /// Largest number of levels. Coordinates of deeper cells would hardly differ in `f32`.
    pub const fn max_levels(self) -> u32 {
        match self {
            Self::Volume => 10,
            Self::Plane => 6,
        }
    }
    /// Number of bits of a grid coordinate.
    pub const fn coordinate_bits(self) -> u32 {
        self.digit_bits() * self.max_levels()
    }
    fn child_counts(self) -> [usize; 3] {
        match self {
            Self::Volume => [4; 3],
            Self::Plane => [8, 8, 1],
        }
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aabb {
    /// The lower corner.
    pub low: [f32; 3],
    /// The upper corner.
    pub high: [f32; 3],
}

impl Aabb {
    /// Returns the bounding box of points.
    pub fn around(points: impl Iterator<Item = [f32; 3]>) -> Self {
        let empty = Self {
            low: [f32::INFINITY; 3],
            high: [f32::NEG_INFINITY; 3],
        };
        points.fold(empty, |region, p| Self {
            low: std::array::from_fn(|axis| region.low[axis].min(p[axis])),
            high: std::array::from_fn(|axis| region.high[axis].max(p[axis])),
        })
    }
    /// Returns the length of the longest side.
    pub fn longest_side(&self) -> f32 {
        (0..3).fold(0.0, |side, axis| {
            f32::max(side, self.high[axis] - self.low[axis])
        })
    }
    /// Reports whether the box contains a point.
    pub fn contains(&self, p: [f32; 3]) -> bool {
        (0..3).all(|axis| self.low[axis] <= p[axis] && p[axis] <= self.high[axis])
    }
    /// Returns the box of a child, counted along x, then y, then z.
    pub fn child(&self, index: usize, split: CellSplit) -> Self {
        let child_counts = split.child_counts();
        let [x, y, _] = child_counts;
        let coordinates = [index % x, index / x % y, index / x / y];
        let face_coordinate = |axis: usize, n: usize| {
            let size = (self.high[axis] - self.low[axis]) / child_counts[axis] as f32;
            if n == child_counts[axis] {
                self.high[axis]
            } else {
                self.low[axis] + size * n as f32
            }
        };
        Self {
            low: std::array::from_fn(|axis| face_coordinate(axis, coordinates[axis])),
            high: std::array::from_fn(|axis| face_coordinate(axis, coordinates[axis] + 1)),
        }
    }
    /// Returns a box that is larger by a distance, and by what rounding puts on the wrong side of a face.
    pub fn with_margin(&self, split: CellSplit, distance: f32) -> Self {
        let farthest = (0..3).fold(0.0, |largest, axis| {
            f32::max(largest, self.low[axis].abs().max(self.high[axis].abs()))
        });
        let margin = distance + self.longest_side() / 64.0 + farthest * 1e-6;
        let child_counts = split.child_counts();
        let margin = |axis: usize| if child_counts[axis] > 1 { margin } else { 0.0 };
        Self {
            low: std::array::from_fn(|axis| self.low[axis] - margin(axis)),
            high: std::array::from_fn(|axis| self.high[axis] + margin(axis)),
        }
    }
    /// Writes the box to a lane of `boxes`: the lower corner, then the upper one.
    pub fn write_lane(&self, boxes: &mut [F32x64; 6], lane: usize) {
        for axis in 0..3 {
            boxes[axis].0[lane] = self.low[axis];
            boxes[axis + 3].0[lane] = self.high[axis];
        }
    }
}

/// Location of a cell's tape in the arenas.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct TapeRange {
    arena: u32,
    start: u32,
    len: u32,
}

impl TapeRange {
    /// Returns a key that identifies the tape.
    fn key(self) -> (u32, u32) {
        (self.arena, self.start)
    }
}

/// A cell that may contain a surface.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Box of the cell.
    pub region: Aabb,
    /// Bound of the field's slope in the cell. Where none is known, it is one, as for the whole program.
    pub slope: f32,
    /// Bounds of the field's gradient in the cell, along each axis, if they are known.
    pub gradient: Option<[[f32; 2]; 3]>,
    /// Set where the field may have a discontinuity in the cell, or a slope without a bound: its gradient is unbounded
    /// there.
    pub may_be_discontinuous: bool,
    tape: TapeRange,
    /// Number of consecutive levels that removed less than a tenth of their parents' tapes.
    stalled_levels: u32,
    /// Set if the cell has no children.
    is_leaf: bool,
    /// Set if another stage splits the cell ([`SplitRule::defers`]).
    is_deferred: bool,
}

/// The children of a cell.
#[derive(Clone, Debug)]
struct CellNode {
    /// Cell whose children these are.
    cell: u32,
    /// For each child [`EMPTY`], [`FULL`], [`LEAF`] plus a cell's index, or [`NODE`] plus a node's index.
    children: [u32; CHILDREN],
}

/// The child is entirely outside the solid.
const EMPTY: u32 = 0;
/// The child is entirely inside the solid.
const FULL: u32 = 1;
/// The child is a leaf.
const LEAF: u32 = 2;
/// The child has children.
const NODE: u32 = 1 << 31;

/// A scene's cells.
#[derive(Clone, Debug)]
pub struct Cells {
    split: CellSplit,
    band: f32,
    margin: f32,
    /// All cells; the first is the root.
    cells: Vec<Cell>,
    /// Children of the split cells.
    nodes: Vec<CellNode>,
    /// Node of the root cell, if that is split.
    root: u32,
    arenas: Vec<Arc<Vec<Clause>>>,
    /// Number of cells of the last build or rebuild, and number of cells of the first build.
    rebuilt_count: usize,
    initial_count: usize,
    /// Number of cells that a limit on cells or clauses kept from being split.
    over_budget_count: usize,
    /// Set where the field may have a discontinuity in the root cell.
    may_be_discontinuous: bool,
    /// Bound of the program's slope; infinite if only an estimate is known.
    max_slope: f32,
}

impl Cells {
    /// Returns the box of the root cell.
    pub fn region(&self) -> &Aabb {
        &self.cells[0].region
    }
    /// Returns the arrangement of children.
    pub fn split(&self) -> CellSplit {
        self.split
    }
    /// Returns the bound of the program's slope; infinite if only an estimate is known.
    pub(crate) fn max_slope(&self) -> f32 {
        self.max_slope
    }
    /// Reports whether the field may have a discontinuity in the root cell, or a slope without a bound. Empty spheres
    /// are then valid only within their cell.
    pub fn may_be_discontinuous(&self) -> bool {
        self.may_be_discontinuous
    }
    /// Returns the number of cells of the last build: all cells, or those that an edit affected.
    pub fn rebuilt_count(&self) -> usize {
        self.rebuilt_count
    }
    /// Returns the number of cells that kept their tapes because a limit on cells or clauses was reached.
    pub fn over_budget_count(&self) -> usize {
        self.over_budget_count
    }
    /// Counts the cells, and the clauses of distinct tapes. `fresh` is 0; the caller fills it in.
    pub fn stats(&self) -> CellStats {
        CellStats {
            count: self.cells.len() as u64,
            clauses: self.clause_count() as u64,
            out_of_memory: self.over_budget_count as u64,
            fresh: 0,
        }
    }
    /// Returns the tape of a cell.
    pub fn tape(&self, cell: u32) -> &[Clause] {
        let TapeRange { arena, start, len } = self.cells[cell as usize].tape;
        &self.arenas[arena as usize][start as usize..(start + len) as usize]
    }
    /// Returns an identifier that cells with the same tape share.
    pub fn tape_key(&self, cell: u32) -> u64 {
        let (arena, start) = self.cells[cell as usize].tape.key();
        u64::from(arena) << 32 | u64::from(start)
    }
    /// Returns a cell.
    pub fn cell(&self, cell: u32) -> &Cell {
        &self.cells[cell as usize]
    }
    /// Returns the indices of the cells without children.
    pub fn leaves(&self) -> impl Iterator<Item = u32> {
        let cells = self.cells.iter().zip(0..);
        cells.filter_map(|(cell, number)| cell.is_leaf.then_some(number))
    }
    /// Returns the memory of cells, nodes and clauses, in bytes.
    pub fn size_bytes(&self) -> usize {
        self.cells.len() * size_of::<Cell>()
            + self.nodes.len() * size_of::<CellNode>()
            + self.clause_count() * size_of::<Clause>()
    }
    /// Returns the number of clauses of the tapes of all cells that were split.
    pub(crate) fn split_clauses(&self) -> u64 {
        let lengths = self.nodes.iter().map(|node| self.tape(node.cell).len());
        lengths.sum::<usize>() as u64
    }
    /// Returns the mean, over all leaves, of the remaining fraction of the work of finding a surface. In a
    /// leaf it is the tape's length over that of the full tape, times the leaf's slope bound.
    pub fn mean_work_fraction(&self) -> f32 {
        let root_clauses = self.tape(0).len().max(1) as f32;
        let (mut sum, mut count) = (0.0, 0);
        for leaf in self.leaves() {
            sum += self.tape(leaf).len() as f32 / root_clauses * self.cell(leaf).slope;
            count += 1;
        }
        sum / count.max(1) as f32
    }
    /// Returns the number of clauses of all tapes.
    fn clause_count(&self) -> usize {
        self.arenas.iter().map(|arena| arena.len()).sum()
    }
}
