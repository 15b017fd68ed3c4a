//! Places: coordinates as whole numbers with the digits of all levels of cells. Two bits a level say
//! which child it is, so that looking a point up takes no arithmetic but shifts.

use super::{CELL, CHILDREN, Cells, EMPTY, FULL, NODE, Region, Split};
use sdfc_vm::lanes::{LANES, Points};

/// Bits of a level's digit.
pub(super) const DIGIT: u32 = Split::Cube.digit();
/// Bits of all levels.
pub(super) const BITS: u32 = Split::Cube.bits();
/// Only cells that are cut along all axes are looked up here.
const _: () = assert!(CHILDREN == 1 << (3 * DIGIT));

/// Which child of a cell a place lies in, where so many bits are within the child.
#[inline(always)]
pub(super) fn child_at(place: [u32; 3], within: u32) -> usize {
    let digit = |axis: usize| (place[axis] >> within) as usize % (1 << DIGIT);
    digit(0) | digit(1) << DIGIT | digit(2) << (2 * DIGIT)
}

/// From coordinates to places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    low: [f32; 3],
    scale: [f32; 3],
}

impl Grid {
    pub(super) fn of(region: &Region) -> Self {
        let scale = |axis: usize| {
            let side = region.high[axis] - region.low[axis];
            (1_u32 << BITS) as f32 / side.max(f32::MIN_POSITIVE)
        };
        Self {
            low: region.low,
            scale: std::array::from_fn(scale),
        }
    }

    fn place(&self, p: [f32; 3]) -> Option<[u32; 3]> {
        let at = |axis: usize| (p[axis] - self.low[axis]) * self.scale[axis];
        let most = (1_u32 << BITS) as f32;
        let inside = (0..3).all(|axis| at(axis) >= 0.0 && at(axis) < most);
        inside.then(|| std::array::from_fn(|axis| at(axis) as u32))
    }

    /// Places of points, and a mask of those that are inside: all bits are set there, and none outside.
    #[inline(always)]
    pub(super) fn places(&self, points: &Points) -> ([[u32; LANES]; 3], [u32; LANES]) {
        let most = (1_u32 << BITS) as f32;
        let mut inside = [u32::MAX; LANES];
        let mut places = [[0; LANES]; 3];
        for axis in 0..3 {
            for lane in 0..LANES {
                let at = (points[axis].0[lane] - self.low[axis]) * self.scale[axis];
                let within = if (at >= 0.0) & (at < most) {
                    u32::MAX
                } else {
                    0
                };
                inside[lane] &= within;
                // The last bits of the sum are the whole number; a conversion that must say what becomes
                // of others takes dozens of instructions.
                places[axis][lane] = (at.floor() + WHOLE).to_bits() & ((1 << BITS) - 1) & within;
            }
        }
        (places, inside)
    }
}

/// The summand that makes the last bits of the sum a whole number: 2²³.
const WHOLE: f32 = 8_388_608.0;
const _: () = assert!(BITS < 23);

/// The content of a part of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// Nothing of the solid.
    Nothing,
    /// The solid alone.
    Solid,
    /// Perhaps some of the surface: the cell whose tape tells.
    Leaf(u32),
}

/// A part of space, as cells divide it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Where it is.
    pub region: Region,
    /// How many clauses the program has that is run there; `None` where the field's sign is known and
    /// nothing is run.
    pub clauses: Option<usize>,
}

impl Cells {
    /// Tells what is known of the solid where a point lies.
    pub fn held_at(&self, p: [f32; 3]) -> Held {
        match self.child_at(p) {
            Some((_, _, EMPTY)) => Held::Nothing,
            Some((_, _, FULL)) => Held::Solid,
            Some((_, _, entry)) => Held::Leaf(entry - CELL),
            None => Held::Leaf(0),
        }
    }

    /// The part of space that a point lies in; `None` outside of all cells.
    pub fn part_at(&self, p: [f32; 3]) -> Option<Part> {
        let of = |cell: u32| Part {
            region: self.cell(cell).region,
            clauses: Some(self.tape(cell).len()),
        };
        match self.child_at(p) {
            Some((parent, child, EMPTY | FULL)) => Some(Part {
                region: self.cell(parent).region.child(child, self.split),
                clauses: None,
            }),
            Some((_, _, entry)) => Some(of(entry - CELL)),
            None => self.region().holds(p).then(|| of(0)),
        }
    }

    /// The cell in whose child a point lies, the number of that child, and what the child is: empty,
    /// full or a leaf. `None` outside, and where nothing is cut.
    fn child_at(&self, p: [f32; 3]) -> Option<(u32, usize, u32)> {
        let place = Grid::of(self.region()).place(p)?;
        let mut within = BITS;
        let mut node = self.nodes.get(self.root as usize)?;
        loop {
            within -= DIGIT;
            let child = child_at(place, within);
            match node.children[child] {
                inner @ NODE.. => node = &self.nodes[(inner - NODE) as usize],
                entry => return Some((node.cell, child, entry)),
            }
        }
    }
}
