//! Cells as words, as the interpreter on a GPU reads them: see [`sdfc_shaders::interpreter::tape`].

use super::{CELL, CHILDREN, Cells, Cut, EMPTY, FULL, NODE, Split};
use crate::frame::CellStats;
use sdfc_shaders::interpreter::tape::{Registers, clause_words, constant, node};
use sdfc_shaders::layout::{Grid, Job, NONE_BEFORE};
use sdfc_vm::tape::{Clause, Tape};
use std::collections::{HashMap, HashSet};

/// The cells of a scene's programs in the same box, as words.
#[derive(Clone, Debug)]
pub struct Packed {
    /// How many nodes and words of tapes lie before these.
    pub behind: [u32; 2],
    /// Where they are, and where each program's begin.
    pub grid: Grid,
    /// The children of all cells.
    pub nodes: Vec<u32>,
    /// All tapes, each behind its length.
    pub tapes: Vec<[u32; 2]>,
    /// How many registers they take.
    pub registers: Registers,
    /// How many cells there are.
    pub counts: CellStats,
}

/// A cell whose cutting is left to somebody else.
#[derive(Clone, Copy, Debug)]
pub struct Left {
    /// Its number, which it keeps as long as edits leave it as it is.
    pub cell: u32,
    /// What there is to be done.
    pub job: Job,
}

impl Packed {
    /// Nothing yet of what is cut like this, with tapes that take no more registers than these, behind
    /// so many nodes and words of tapes.
    pub fn new(cut: &Cut<'_>, registers: Registers, behind: [u32; 2]) -> Self {
        let (region, split) = (&cut.region, cut.split);
        let scale = |axis: usize| {
            let side = region.high[axis] - region.low[axis];
            (1_u32 << split.bits()) as f32 / side.max(f32::MIN_POSITIVE)
        };
        let mut scales = std::array::from_fn(scale);
        if split == Split::Square {
            scales[2] = 0.0;
        }
        Self {
            behind,
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
            counts: CellStats::default(),
        }
    }

    /// No cells, but the whole tapes of both programs everywhere, the second one's instructions from
    /// `base` on.
    pub fn whole(tapes: [Option<&Tape>; 2], base: u32, registers: Registers) -> Self {
        let mut packed = Self {
            behind: [0; 2],
            grid: Grid::default(),
            nodes: Vec::new(),
            tapes: Vec::new(),
            registers,
            counts: CellStats::default(),
        };
        let [distance, surface] = tapes;
        let clauses: &[Clause] = distance.map_or(&[], |tape| &tape.clauses);
        let whole = packed.add_tape(clauses, 0);
        packed.grid.distance = whole;
        packed.grid.distance_whole = whole;
        packed.add_whole_surface(surface, base);
        packed
    }

    /// Lets the whole tape of surfaces be everywhere, or one that leaves everything unpainted.
    pub fn add_whole_surface(&mut self, tape: Option<&Tape>, base: u32) {
        let whole = self.add_tape(tape.map_or(&[], |tape| &tape.clauses), base);
        self.grid.surface = whole;
        self.grid.surface_whole = whole;
    }

    /// Adds the cells of the distance, of which so many are not those of the picture before; gives
    /// those whose cutting was left to somebody else.
    pub fn add_distance(&mut self, tape: &Tape, cells: &Cells, fresh: usize) -> Vec<Left> {
        let ([root, whole], left) = self.add(tape, cells, 0, true);
        self.counts.fresh += fresh as u64;
        self.grid.distance = root;
        self.grid.distance_whole = whole;
        left
    }

    /// The same for surfaces, whose program's instructions begin at `base`.
    pub fn add_surface(
        &mut self,
        tape: &Tape,
        cells: &Cells,
        base: u32,
        fresh: usize,
    ) -> Vec<Left> {
        let ([root, whole], left) = self.add(tape, cells, base, false);
        self.counts.fresh += fresh as u64;
        self.grid.surface = root;
        self.grid.surface_whole = whole;
        left
    }

    /// How many bytes the larger of the two lists takes.
    pub fn largest(&self) -> usize {
        size_of_val(&*self.nodes).max(size_of_val(&*self.tapes))
    }

    /// Adds cells; gives the words of the first one and of the whole tape, and the cells that are
    /// left. Where cells keep nothing but a sign, that is given as a `constant` distance, or the
    /// whole tape is.
    fn add(
        &mut self,
        tape: &Tape,
        cells: &Cells,
        base: u32,
        constants: bool,
    ) -> ([u32; 2], Vec<Left>) {
        let whole = self.add_tape(&tape.clauses, base);
        let mut known = HashMap::from([(cells.cells[0].tape.key(), whole)]);
        // Tapes of cells that are cut are not words, but count.
        let mut above = HashSet::new();
        let mut counts = CellStats {
            made: 1,
            clauses: tape.clauses.len() as u64,
            short: cells.short() as u64,
            fresh: 0,
        };
        let [behind, _] = self.behind;
        let first = behind + (self.nodes.len() / CHILDREN) as u32;
        let digit = cells.split.digit();
        // The nodes that are reached from the root, in the order of their numbers, each with its level
        // and its place among the cells of that level. What edits left behind is not reached.
        let mut nodes = Vec::new();
        if !cells.nodes.is_empty() {
            nodes.push((cells.root, 0, [0; 3]));
        }
        let mut left = Vec::new();
        let mut done = 0;
        while let Some(&(number, level, place)) = nodes.get(done) {
            done += 1;
            for (lane, &child) in (0..).zip(&cells.nodes[number as usize].children) {
                let of = |axis: u32| lane >> (axis * digit) & ((1 << digit) - 1);
                let inner: [u32; 3] = std::array::from_fn(|axis| of(axis as u32));
                let at = std::array::from_fn(|axis| place[axis] << digit | inner[axis]);
                let word = match child {
                    NODE.. => {
                        let below = child - NODE;
                        let cell = cells.nodes[below as usize].cell;
                        let key = cells.cell(cell).tape.key();
                        counts.made += 1;
                        if !known.contains_key(&key) && above.insert(key) {
                            counts.clauses += cells.tape(cell).len() as u64;
                        }
                        nodes.push((below, level + 1, at));
                        node(first + nodes.len() as u32 - 1)
                    }
                    CELL.. => {
                        let cell = cells.cell(child - CELL);
                        let clauses = cells.tape(child - CELL);
                        let key = cell.tape.key();
                        counts.made += 1;
                        let word = *known.entry(key).or_insert_with(|| {
                            if !above.contains(&key) {
                                counts.clauses += clauses.len() as u64;
                            }
                            self.add_tape(clauses, base)
                        });
                        if cell.left {
                            let job = Job {
                                entry: behind * CHILDREN as u32 + self.nodes.len() as u32,
                                tape: word,
                                length: clauses.len() as u32,
                                level: level + 1,
                                x: at[0],
                                y: at[1],
                                z: at[2],
                                stale: cell.stale,
                                before: NONE_BEFORE,
                            };
                            left.push(Left {
                                cell: child - CELL,
                                job,
                            });
                        }
                        word
                    }
                    EMPTY if constants => constant(false),
                    FULL if constants => constant(true),
                    _ => whole,
                };
                self.nodes.push(word);
            }
        }
        self.counts = self.counts.and(counts);
        let root = if cells.nodes.is_empty() {
            whole
        } else {
            node(first)
        };
        ([root, whole], left)
    }

    /// Adds a tape; gives where it begins.
    fn add_tape(&mut self, clauses: &[Clause], base: u32) -> u32 {
        let start = self.behind[1] + self.tapes.len() as u32;
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
