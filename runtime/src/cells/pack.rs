//! Cells as words, as the interpreter on a GPU reads them: see [`sdfc_shaders::interpreter::tape`].

use super::{CELL, Cells, EMPTY, FULL, NODE, Region, Split};
use sdfc_shaders::interpreter::tape::{Registers, clause_words, constant, node};
use sdfc_shaders::layout::Grid;
use sdfc_vm::tape::{Clause, Tape};
use std::collections::HashMap;

/// The cells of a scene's programs in the same box, as words.
#[derive(Clone, Debug)]
pub struct Packed {
    /// Where they are, and where each program's begin.
    pub grid: Grid,
    /// The children of all cells.
    pub nodes: Vec<u32>,
    /// All tapes, each behind its length.
    pub tapes: Vec<[u32; 2]>,
    /// How many registers they take.
    pub registers: Registers,
}

impl Packed {
    /// Nothing yet, in this box, of tapes that take no more registers than these.
    pub fn new(region: &Region, split: Split, registers: Registers) -> Self {
        let scale = |axis: usize| {
            let side = region.high[axis] - region.low[axis];
            (1_u32 << split.bits()) as f32 / side.max(f32::MIN_POSITIVE)
        };
        let mut scales = std::array::from_fn(scale);
        if split == Split::Square {
            scales[2] = 0.0;
        }
        Self {
            grid: Grid {
                low: region.low,
                scale: scales,
                bits: split.bits(),
                digit: split.digit(),
                ..Grid::default()
            },
            nodes: Vec::new(),
            tapes: Vec::new(),
            registers,
        }
    }

    /// Adds the cells of the distance.
    pub fn add_distance(&mut self, tape: &Tape, cells: &Cells) {
        let [root, whole] = self.add(tape, cells, 0, true);
        self.grid.distance = root;
        self.grid.distance_whole = whole;
    }

    /// Adds the cells of surfaces, whose program's instructions begin at `base`.
    pub fn add_surface(&mut self, tape: &Tape, cells: &Cells, base: u32) {
        let [root, whole] = self.add(tape, cells, base, false);
        self.grid.surface = root;
        self.grid.surface_whole = whole;
    }

    /// How many bytes the larger of the two lists takes.
    pub fn largest(&self) -> usize {
        size_of_val(&*self.nodes).max(size_of_val(&*self.tapes))
    }

    /// Adds cells; gives the words of the first one and of the whole tape. Where cells keep nothing
    /// but a sign, that is given as a `constant` distance, or the whole tape is.
    fn add(&mut self, tape: &Tape, cells: &Cells, base: u32, constants: bool) -> [u32; 2] {
        let whole = self.add_tape(&tape.clauses, base);
        let mut known = HashMap::from([(cells.cells[0].tape.key(), whole)]);
        let first = (self.nodes.len() / super::CHILDREN) as u32;
        for parent in &cells.nodes {
            for &child in &parent.children {
                let word = match child {
                    NODE.. => node(first + child - NODE),
                    CELL.. => {
                        let cell = child - CELL;
                        let key = cells.cell(cell).tape.key();
                        *known
                            .entry(key)
                            .or_insert_with(|| self.add_tape(cells.tape(cell), base))
                    }
                    EMPTY if constants => constant(false),
                    FULL if constants => constant(true),
                    _ => whole,
                };
                self.nodes.push(word);
            }
        }
        let root = if cells.nodes.is_empty() {
            whole
        } else {
            node(first + cells.root)
        };
        [root, whole]
    }

    /// Adds a tape; gives where it begins.
    fn add_tape(&mut self, clauses: &[Clause], base: u32) -> u32 {
        let start = self.tapes.len() as u32;
        self.tapes.push([clauses.len() as u32, 0]);
        let bits = self.registers.bits();
        let words = |clause| clause_words(clause, base, bits);
        self.tapes.extend(clauses.iter().map(words));
        start
    }
}

/// The registers that all cells of a tape do with: pruning never needs more.
pub fn registers(tape: &Tape) -> Registers {
    Registers {
        values: tape.values,
        points: tape.points,
    }
}
