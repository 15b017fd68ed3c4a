//! Lookup of cells by grid coordinates: integers with the digits of all levels of cells. Two bits per level
//! select a child along each axis, so the lookup of a point takes no arithmetic but shifts.

use super::{Aabb, CHILDREN, CellSplit, Cells, EMPTY, FULL, LEAF, NODE};
use sdfc_vm::lanes::{LANES, Points};

/// Number of bits of a level's digit.
pub(super) const DIGIT_BITS: u32 = CellSplit::Volume.digit_bits();
/// Number of bits of all levels.
pub(super) const COORDINATE_BITS: u32 = CellSplit::Volume.coordinate_bits();
/// Only cells that are split along all axes are looked up here.
const _: () = assert!(CHILDREN == 1 << (3 * DIGIT_BITS));

/// Returns the child of a cell that contains grid coordinates, whose low `shift` bits lie within the child.
#[inline(always)]
pub(super) fn child_index(coordinates: [u32; 3], shift: u32) -> usize {
    let digit = |axis: usize| (coordinates[axis] >> shift) as usize % (1 << DIGIT_BITS);
    digit(0) | digit(1) << DIGIT_BITS | digit(2) << (2 * DIGIT_BITS)
}

/// Maps points to grid coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellGrid {
    low: [f32; 3],
    scale: [f32; 3],
}

impl CellGrid {
    pub(super) fn new(region: &Aabb) -> Self {
        let scale = |axis: usize| {
            let side = region.high[axis] - region.low[axis];
            (1_u32 << COORDINATE_BITS) as f32 / side.max(f32::MIN_POSITIVE)
        };
        Self {
            low: region.low,
            scale: std::array::from_fn(scale),
        }
    }

    fn grid_coordinates(&self, p: [f32; 3]) -> Option<[u32; 3]> {
        let scaled = |axis: usize| (p[axis] - self.low[axis]) * self.scale[axis];
        let end = (1_u32 << COORDINATE_BITS) as f32;
        let inside = (0..3).all(|axis| scaled(axis) >= 0.0 && scaled(axis) < end);
        inside.then(|| std::array::from_fn(|axis| scaled(axis) as u32))
    }

    /// Returns the grid coordinates of points, and a mask: all bits are set for points inside the box, none
    /// outside.
    #[inline(always)]
    pub(super) fn lane_coordinates(&self, points: &Points) -> ([[u32; LANES]; 3], [u32; LANES]) {
        let end = (1_u32 << COORDINATE_BITS) as f32;
        let mut inside = [u32::MAX; LANES];
        let mut coordinates = [[0; LANES]; 3];
        for axis in 0..3 {
            for lane in 0..LANES {
                let scaled = (points[axis].0[lane] - self.low[axis]) * self.scale[axis];
                let is_inside = if (scaled >= 0.0) & (scaled < end) {
                    u32::MAX
                } else {
                    0
                };
                inside[lane] &= is_inside;
                // The last bits of the sum are the integer. A conversion that must define the result for all
                // inputs takes dozens of instructions.
                coordinates[axis][lane] = (scaled.floor() + INTEGER_OFFSET).to_bits()
                    & ((1 << COORDINATE_BITS) - 1)
                    & is_inside;
            }
        }
        (coordinates, inside)
    }
}

/// Summand that leaves an integer in the last bits of the sum: 2²³.
const INTEGER_OFFSET: f32 = 8_388_608.0;
const _: () = assert!(COORDINATE_BITS < 23);

/// Content of the cell at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occupancy {
    /// Entirely outside the solid.
    Empty,
    /// Entirely inside the solid.
    Full,
    /// Perhaps some of the surface: the index of the leaf.
    Leaf(u32),
}

/// A cell as it is shown to a user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellInfo {
    /// The box that the cell occupies, in scene units.
    pub region: Aabb,
    /// Number of clauses of the tape that is evaluated there; `None` where the field's sign is known and
    /// nothing is evaluated.
    pub clauses: Option<usize>,
}

impl Cells {
    /// Returns the content of the cell at a point. Points outside all cells belong to the root's tape.
    pub fn occupancy_at(&self, p: [f32; 3]) -> Occupancy {
        match self.child_entry_at(p) {
            Some((_, _, EMPTY)) => Occupancy::Empty,
            Some((_, _, FULL)) => Occupancy::Full,
            Some((_, _, entry)) => Occupancy::Leaf(entry - LEAF),
            None => Occupancy::Leaf(0),
        }
    }

    /// Returns the box that contains a point; `None` outside all cells.
    pub fn info_at(&self, p: [f32; 3]) -> Option<CellInfo> {
        let cell_info = |cell: u32| CellInfo {
            region: self.cell(cell).region,
            clauses: Some(self.tape(cell).len()),
        };
        match self.child_entry_at(p) {
            Some((parent, child, EMPTY | FULL)) => Some(CellInfo {
                region: self.cell(parent).region.child(child, self.split),
                clauses: None,
            }),
            Some((_, _, entry)) => Some(cell_info(entry - LEAF)),
            None => self.region().contains(p).then(|| cell_info(0)),
        }
    }

    /// Returns the cell in whose child a point lies, the index of that child, and the child's entry: empty,
    /// full or a leaf. Returns `None` outside, and if the root is not split.
    fn child_entry_at(&self, p: [f32; 3]) -> Option<(u32, usize, u32)> {
        let coordinates = CellGrid::new(self.region()).grid_coordinates(p)?;
        let mut shift = COORDINATE_BITS;
        let mut node = self.nodes.get(self.root as usize)?;
        loop {
            shift -= DIGIT_BITS;
            let child = child_index(coordinates, shift);
            match node.children[child] {
                inner @ NODE.. => node = &self.nodes[(inner - NODE) as usize],
                entry => return Some((node.cell, child, entry)),
            }
        }
    }
}
