//! Cells after an edit: what the edit does not reach is kept.
//!
//! An edit that only changes constants (a primitive moved, a radius, a colour) leaves the program's
//! instructions where they are. A cell whose tape holds none of those that changed, now as before, is
//! what it was, with all that it is cut into.

use super::build::{MOST_CLAUSES, Parent, deepen};
use super::{CELL, Cells, Cut, NODE};
use sdfc_vm::program::{Frame, Instruction, Operands, Place, Program};
use sdfc_vm::tape::{Clause, Tape};
use std::sync::Arc;

/// How many times as many cells as were made at first, and clauses as there may be, are kept before
/// all are made anew: those that edits replaced stay in memory.
const GROWTH: usize = 2;
/// So few cells may be replaced many times.
const FEW: usize = 4096;

/// The cells of a program that was edited, from those `before` the edit, of which the first cell is
/// cut as it was then. `None` where the edit is not of this kind; then all cells are to be made anew.
pub fn again(
    before: &Arc<Cells>,
    old: (&Program, &Tape),
    new: (&Program, &Tape),
    cut: &Cut<'_>,
) -> Option<Arc<Cells>> {
    let same_cut = *before.region() == cut.region
        && before.split == cut.split
        && before.band.to_bits() == cut.band.to_bits();
    let large = before.short > 0
        || before.cells.len() > GROWTH * before.first.max(FEW)
        || before.clauses() > GROWTH * MOST_CLAUSES;
    if !same_cut || large || old.1 != new.1 {
        return None;
    }
    let changed = changed(old.0, new.0)?;
    if !reaches(before.tape(0), &changed) {
        return Some(before.clone());
    }
    let mut cells = Cells::clone(before);
    let count = cells.cells.len();
    let whole = Parent {
        cell: 0,
        entry: None,
        before: (!cells.nodes.is_empty()).then_some(cells.root),
    };
    let node = cells.nodes.len() as u32;
    deepen(&mut cells, vec![whole], new.0, new.1, cut, &changed);
    if cells.short > 0 {
        return None;
    }
    cells.root = node;
    // Those that turned out as they were before do not count.
    let fresh = &cells.cells[count..];
    cells.made = fresh.iter().filter(|cell| cell.leaf).count()
        + cells
            .nodes
            .iter()
            .filter(|node| node.cell as usize >= count)
            .count();
    Some(Arc::new(cells))
}

/// Which instructions have other constants; `None` if more than that is different.
pub fn changed(old: &Program, new: &Program) -> Option<Vec<bool>> {
    if old.code.len() != new.code.len() {
        return None;
    }
    let pairs = old.code.iter().zip(&new.code);
    let bare = |i: &Instruction| Instruction {
        parameters: 0,
        frame: match i.frame {
            Frame::Same => Frame::Same,
            Frame::Moved(_) => Frame::Moved(0),
            Frame::Mapped(_) => Frame::Mapped(0),
        },
        operands: match i.operands {
            Operands::Stack => Operands::Stack,
            Operands::Left(_) => Operands::Left(0),
            Operands::Right(_) => Operands::Right(0),
        },
        place: match i.place {
            Place::Push => Place::Push,
            Place::Blend { kernel, .. } => Place::Blend { kernel, index: 0 },
        },
        ..*i
    };
    pairs
        .map(|(a, b)| (bare(a) == bare(b)).then(|| !constants(old, a).eq(constants(new, b))))
        .collect()
}

/// The bits of all constants that an instruction reads.
fn constants<'a>(program: &'a Program, i: &Instruction) -> impl Iterator<Item = u32> + 'a {
    let of = |from: u32, count: usize| {
        let from = from as usize;
        program.pool[from..from + count].as_flattened().iter()
    };
    let frame = match i.frame {
        Frame::Same => of(0, 0),
        Frame::Moved(index) => of(index, 1),
        Frame::Mapped(index) => of(index, 3),
    };
    let operand = match i.operands {
        Operands::Stack => of(0, 0),
        Operands::Left(index) | Operands::Right(index) => of(index, 1),
    };
    let blend = match i.place {
        Place::Push => of(0, 0),
        Place::Blend { index, .. } => of(index, 1),
    };
    let parameters = of(i.parameters, i.code.pool_width());
    let all = parameters.chain(frame).chain(operand).chain(blend);
    all.map(|number| number.to_bits())
}

/// Whether a tape holds an instruction that changed.
fn reaches(tape: &[Clause], changed: &[bool]) -> bool {
    tape.iter().any(|clause| changed[clause.at as usize])
}

impl Cells {
    /// Whether a child is what it was before an edit, and so is all that it was cut into.
    pub(super) fn is_as_before(&self, old: u32, new: u32, changed: &[bool]) -> bool {
        if old < CELL || new < CELL {
            return old == new;
        }
        let old = match old {
            NODE.. => self.nodes[(old - NODE) as usize].cell,
            _ => old - CELL,
        };
        let tape = self.tape(new - CELL);
        self.tape(old) == tape && !reaches(tape, changed)
    }

    /// Leaves out a child that was replaced.
    pub(super) fn forget_child(&mut self, child: u32) {
        match child {
            NODE.. => self.forget(Some(child - NODE)),
            CELL.. => self.cells[(child - CELL) as usize].leaf = false,
            _ => {}
        }
    }

    /// Leaves out what was cut from a cell that was replaced.
    pub(super) fn forget(&mut self, node: Option<u32>) {
        let Some(node) = node else { return };
        for child in self.nodes[node as usize].children {
            self.forget_child(child);
        }
    }
}
