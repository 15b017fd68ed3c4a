//! Cells as words in the layout that the interpreter on a GPU reads: see [`sdfc_shaders::interpreter::tape`].

use super::{CHILDREN, CellSpec, CellSplit, Cells, EMPTY, FULL, LEAF, NODE};
use crate::render::CellStats;
use sdfc_shaders::interpreter::tape::{KernelRegisters, clause_words, constant_word, node_word};
use sdfc_shaders::layout::{CellJob, GridUniforms, NO_OLD_ENTRY};
use sdfc_vm::tape::{Clause, Tape};
use std::collections::{HashMap, HashSet};

/// The cells of a scene's programs in the same box, as words.
#[derive(Clone, Debug)]
pub struct GpuCells {
    /// Number of nodes and of words of tapes that precede these in the buffers.
    pub base_offsets: [u32; 2],
    /// Position of the cells in space, and root entries of each program.
    pub grid: GridUniforms,
    /// Children of all cells.
    pub nodes: Vec<u32>,
    /// All tapes, each preceded by its length.
    pub tapes: Vec<[u32; 2]>,
    /// Numbers of registers that the tapes use.
    pub registers: KernelRegisters,
    /// Statistics of the cells.
    pub counts: CellStats,
}

/// A cell that another stage splits.
#[derive(Clone, Copy, Debug)]
pub struct DeferredCell {
    /// Index of the cell, which it keeps as long as edits leave it unchanged.
    pub cell: u32,
    /// Job that splits it.
    pub job: CellJob,
}

impl GpuCells {
    /// Creates empty cells. The buffers hold the number of nodes and words of tapes in `base_offsets` before
    /// them.
    pub fn new(spec: &CellSpec<'_>, registers: KernelRegisters, base_offsets: [u32; 2]) -> Self {
        let (region, split) = (&spec.region, spec.split);
        let scale = |axis: usize| {
            let side = region.high[axis] - region.low[axis];
            (1_u32 << split.coordinate_bits()) as f32 / side.max(f32::MIN_POSITIVE)
        };
        let mut scales = std::array::from_fn(scale);
        if split == CellSplit::Plane {
            scales[2] = 0.0;
        }
        Self {
            base_offsets,
            grid: GridUniforms {
                low: region.low,
                scale: scales,
                coordinate_bits: split.coordinate_bits(),
                digit_bits: split.digit_bits(),
                ..GridUniforms::default()
            },
            nodes: Vec::new(),
            tapes: Vec::new(),
            registers,
            counts: CellStats::default(),
        }
    }

    /// Creates the full tapes of both programs without cells. The second program's instructions begin at
    /// `base`.
    pub fn single_tape(tapes: [Option<&Tape>; 2], base: u32, registers: KernelRegisters) -> Self {
        let mut cells = Self {
            base_offsets: [0; 2],
            grid: GridUniforms::default(),
            nodes: Vec::new(),
            tapes: Vec::new(),
            registers,
            counts: CellStats::default(),
        };
        let [distance, surface] = tapes;
        let clauses: &[Clause] = distance.map_or(&[], |tape| &tape.clauses);
        let entry = cells.add_tape(clauses, 0);
        cells.grid.distance_root = entry;
        cells.grid.distance_full_tape = entry;
        cells.add_single_surface_tape(surface, base);
        cells
    }

    /// Adds the full tape of surfaces for all points, or one that leaves the default material everywhere.
    pub fn add_single_surface_tape(&mut self, tape: Option<&Tape>, base: u32) {
        let entry = self.add_tape(tape.map_or(&[], |tape| &tape.clauses), base);
        self.grid.surface_root = entry;
        self.grid.surface_full_tape = entry;
    }

    /// Adds the cells of the distance, `fresh` of which are new in this picture. Returns the cells whose
    /// split is deferred.
    pub fn add_distance(&mut self, tape: &Tape, cells: &Cells, fresh: usize) -> Vec<DeferredCell> {
        let ([root, full_tape], deferred) = self.add_cells(tape, cells, 0, true);
        self.counts.fresh += fresh as u64;
        self.grid.distance_root = root;
        self.grid.distance_full_tape = full_tape;
        deferred
    }

    /// Adds the cells of surfaces, whose program's instructions begin at `base`.
    pub fn add_surface(
        &mut self,
        tape: &Tape,
        cells: &Cells,
        base: u32,
        fresh: usize,
    ) -> Vec<DeferredCell> {
        let ([root, full_tape], deferred) = self.add_cells(tape, cells, base, false);
        self.counts.fresh += fresh as u64;
        self.grid.surface_root = root;
        self.grid.surface_full_tape = full_tape;
        deferred
    }

    /// Returns the size of the larger of the two lists, in bytes.
    pub fn max_buffer_bytes(&self) -> usize {
        size_of_val(&*self.nodes).max(size_of_val(&*self.tapes))
    }

    /// Adds cells. Returns the entries of the root and of the full tape, and the deferred cells. Where cells
    /// store only a sign, the entry is a constant distance if `store_constants` is set, or else the full tape.
    fn add_cells(
        &mut self,
        tape: &Tape,
        cells: &Cells,
        base: u32,
        store_constants: bool,
    ) -> ([u32; 2], Vec<DeferredCell>) {
        let full_tape = self.add_tape(&tape.clauses, base);
        let mut entry_of_tape = HashMap::from([(cells.cells[0].tape.key(), full_tape)]);
        // Tapes of split cells are not stored, but count.
        let mut inner_tapes = HashSet::new();
        let mut counts = CellStats {
            count: 1,
            clauses: tape.clauses.len() as u64,
            out_of_memory: cells.over_budget_count() as u64,
            fresh: 0,
        };
        let [base_node, _] = self.base_offsets;
        let first_node = base_node + (self.nodes.len() / CHILDREN) as u32;
        let digit = cells.split.digit_bits();
        // Nodes reachable from the root, in the order of their indices, each with its level and its
        // coordinates among the cells of that level. Nodes that edits discarded are not reachable.
        let mut nodes = Vec::new();
        if !cells.nodes.is_empty() {
            nodes.push((cells.root, 0, [0; 3]));
        }
        let mut deferred = Vec::new();
        let mut visited = 0;
        while let Some(&(node_index, level, coordinates)) = nodes.get(visited) {
            visited += 1;
            for (lane, &child) in (0..).zip(&cells.nodes[node_index as usize].children) {
                let digit_of = |axis: u32| lane >> (axis * digit) & ((1 << digit) - 1);
                let child_digits: [u32; 3] = std::array::from_fn(|axis| digit_of(axis as u32));
                let child_coordinates =
                    std::array::from_fn(|axis| coordinates[axis] << digit | child_digits[axis]);
                let word = match child {
                    NODE.. => {
                        let inner_node = child - NODE;
                        let cell = cells.nodes[inner_node as usize].cell;
                        let key = cells.cell(cell).tape.key();
                        counts.count += 1;
                        if !entry_of_tape.contains_key(&key) && inner_tapes.insert(key) {
                            counts.clauses += cells.tape(cell).len() as u64;
                        }
                        nodes.push((inner_node, level + 1, child_coordinates));
                        node_word(first_node + nodes.len() as u32 - 1)
                    }
                    LEAF.. => {
                        let cell = cells.cell(child - LEAF);
                        let clauses = cells.tape(child - LEAF);
                        let key = cell.tape.key();
                        counts.count += 1;
                        let word = *entry_of_tape.entry(key).or_insert_with(|| {
                            if !inner_tapes.contains(&key) {
                                counts.clauses += clauses.len() as u64;
                            }
                            self.add_tape(clauses, base)
                        });
                        if cell.is_deferred {
                            let job = CellJob {
                                node_entry: base_node * CHILDREN as u32 + self.nodes.len() as u32,
                                tape: word,
                                length: clauses.len() as u32,
                                level: level + 1,
                                x: child_coordinates[0],
                                y: child_coordinates[1],
                                z: child_coordinates[2],
                                stalled_levels: cell.stalled_levels,
                                old_entry: NO_OLD_ENTRY,
                            };
                            deferred.push(DeferredCell {
                                cell: child - LEAF,
                                job,
                            });
                        }
                        word
                    }
                    EMPTY if store_constants => constant_word(false),
                    FULL if store_constants => constant_word(true),
                    _ => full_tape,
                };
                self.nodes.push(word);
            }
        }
        self.counts = self.counts.sum(counts);
        let root = if cells.nodes.is_empty() {
            full_tape
        } else {
            node_word(first_node)
        };
        ([root, full_tape], deferred)
    }

    /// Adds a tape and returns the position of its first word, its length.
    fn add_tape(&mut self, clauses: &[Clause], base: u32) -> u32 {
        let start = self.base_offsets[1] + self.tapes.len() as u32;
        self.tapes.push([clauses.len() as u32, 0]);
        let bits = self.registers.name_bits();
        let words = |clause| clause_words(clause, base, bits);
        self.tapes.extend(clauses.iter().map(words));
        start
    }
}

/// Returns the numbers of registers that suffice for all cells of a tape: pruning never needs more.
pub fn required_registers(tape: &Tape) -> KernelRegisters {
    KernelRegisters {
        values: tape.values,
        points: tape.points,
    }
}
