//! Incremental rebuild of cells after an edit: cells that the edit does not affect are kept.
//!
//! An edit that only changes constants (a primitive moved, a radius, a colour) leaves the program's
//! instructions where they are. A cell is unchanged, with its subtree, if its new tape equals the old one and
//! contains no changed instruction.

use super::build::{MAX_CLAUSES, SplitParent, split_levels};
use super::{CellSpec, Cells, LEAF, NODE};
use sdfc_vm::program::{Destination, Instruction, Operands, PointTransform, Program};
use sdfc_vm::tape::{Clause, Tape};
use std::sync::Arc;

/// Largest growth of the number of cells, and of clauses over their limit, before all cells are rebuilt.
/// Cells that edits replaced stay in memory.
const MAX_GROWTH_FACTOR: usize = 2;
/// Cells below this number are not counted as growth: few cells may be replaced many times.
const MIN_COUNTED_CELLS: usize = 4096;

/// Returns the cells of an edited program, reusing the `previous` ones. Returns `None` where all cells must
/// be rebuilt. Then the instructions or the region changed, too many replaced cells are in memory, or a limit
/// was reached.
pub fn rebuild_after_edit(
    previous: &Arc<Cells>,
    old: (&Program, &Tape),
    new: (&Program, &Tape),
    spec: &CellSpec<'_>,
) -> Option<Arc<Cells>> {
    let same_cut = *previous.region() == spec.region
        && previous.split == spec.split
        && previous.band.to_bits() == spec.band.to_bits()
        && previous.margin.to_bits() == spec.margin.to_bits()
        && previous.max_slope.to_bits() == spec.max_slope.to_bits();
    let is_too_large = previous.over_budget_count > 0
        || previous.cells.len() > MAX_GROWTH_FACTOR * previous.initial_count.max(MIN_COUNTED_CELLS)
        || previous.clause_count() > MAX_GROWTH_FACTOR * MAX_CLAUSES;
    if !same_cut || is_too_large || old.1 != new.1 {
        return None;
    }
    let changed = changed_instructions(old.0, new.0)?;
    if !contains_changed(previous.tape(0), &changed) {
        return Some(previous.clone());
    }
    let mut cells = Cells::clone(previous);
    let count = cells.cells.len();
    let root_parent = SplitParent {
        cell: 0,
        entry: None,
        previous_node: (!cells.nodes.is_empty()).then_some(cells.root),
    };
    let new_root = cells.nodes.len() as u32;
    split_levels(&mut cells, vec![root_parent], new.0, new.1, spec, &changed);
    if cells.over_budget_count > 0 {
        return None;
    }
    cells.root = new_root;
    // Cells that turned out unchanged do not count.
    let new_cells = &cells.cells[count..];
    cells.rebuilt_count = new_cells.iter().filter(|cell| cell.is_leaf).count()
        + cells
            .nodes
            .iter()
            .filter(|node| node.cell as usize >= count)
            .count();
    Some(Arc::new(cells))
}

/// Flags the instructions whose constants changed. Returns `None` if anything else changed.
pub fn changed_instructions(old: &Program, new: &Program) -> Option<Vec<bool>> {
    if old.code.len() != new.code.len() {
        return None;
    }
    let pairs = old.code.iter().zip(&new.code);
    let without_constants = |i: &Instruction| Instruction {
        parameters: 0,
        transform: match i.transform {
            PointTransform::Identity => PointTransform::Identity,
            PointTransform::Translate(_) => PointTransform::Translate(0),
            PointTransform::Affine(_) => PointTransform::Affine(0),
        },
        operands: match i.operands {
            Operands::Stack => Operands::Stack,
            Operands::Left(_) => Operands::Left(0),
            Operands::Right(_) => Operands::Right(0),
        },
        destination: match i.destination {
            Destination::Push => Destination::Push,
            Destination::Blend { kernel, .. } => Destination::Blend { kernel, index: 0 },
        },
        ..*i
    };
    pairs
        .map(|(a, b)| {
            (without_constants(a) == without_constants(b))
                .then(|| !constants(old, a).eq(constants(new, b)))
        })
        .collect()
}

/// Returns the bits of all constants that an instruction reads.
fn constants<'a>(program: &'a Program, i: &Instruction) -> impl Iterator<Item = u32> + 'a {
    let pool_words = |from: u32, count: usize| {
        let from = from as usize;
        program.pool[from..from + count].as_flattened().iter()
    };
    let frame = match i.transform {
        PointTransform::Identity => pool_words(0, 0),
        PointTransform::Translate(index) => pool_words(index, 1),
        PointTransform::Affine(index) => pool_words(index, 3),
    };
    let operand = match i.operands {
        Operands::Stack => pool_words(0, 0),
        Operands::Left(index) | Operands::Right(index) => pool_words(index, 1),
    };
    let blend = match i.destination {
        Destination::Push => pool_words(0, 0),
        Destination::Blend { index, .. } => pool_words(index, 1),
    };
    let parameters = pool_words(i.parameters, i.code.pool_width());
    let numbers = parameters.chain(frame).chain(operand).chain(blend);
    numbers.map(|number| number.to_bits())
}

/// Reports whether a tape contains a changed instruction.
fn contains_changed(tape: &[Clause], changed: &[bool]) -> bool {
    tape.iter()
        .any(|clause| changed[clause.instruction as usize])
}

impl Cells {
    /// Reports whether a child, and so its subtree, is the same as before an edit.
    pub(super) fn is_unchanged(&self, old: u32, new: u32, changed: &[bool]) -> bool {
        if old < LEAF || new < LEAF {
            return old == new;
        }
        let old = match old {
            NODE.. => self.nodes[(old - NODE) as usize].cell,
            _ => old - LEAF,
        };
        let tape = self.tape(new - LEAF);
        self.tape(old) == tape && !contains_changed(tape, changed)
    }

    /// Discards a replaced child with its subtree.
    pub(super) fn discard_child(&mut self, child: u32) {
        match child {
            NODE.. => self.discard_subtree(Some(child - NODE)),
            LEAF.. => self.cells[(child - LEAF) as usize].is_leaf = false,
            _ => {}
        }
    }

    /// Discards the subtree of a replaced cell.
    pub(super) fn discard_subtree(&mut self, node: Option<u32>) {
        let Some(node) = node else { return };
        for child in self.nodes[node as usize].children {
            self.discard_child(child);
        }
    }
}
