//! Building cells, level by level, on all cores.

use super::gradient_slack::{clamped_slope, with_slack};
use super::split_rule::{SiblingTapes, SplitDecision, SplitRule};
use super::{Aabb, CHILDREN, Cell, CellNode, CellSplit, Cells, EMPTY, FULL, LEAF, NODE, TapeRange};
use crate::work_stealing::parallel_map_with;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::FloatInterval;
use sdfc_vm::lanes::{F32x64, LANES, with_identity_jacobian_of_boxes};
use sdfc_vm::program::Program;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::lipschitz::{divides_raw, may_be_discontinuous};
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::trace::Tracer;
use sdfc_vm::tape::{Clause, Tape};
use std::sync::Arc;

/// Maximum number of cells. Cells that are not split because of it keep their tapes.
const MAX_CELLS: usize = 400_000;
/// Maximum number of clauses of all tapes together.
pub(super) const MAX_CLAUSES: usize = 6_000_000;

/// Region, arrangement and splitting rule of the cells to build.
#[derive(Clone, Copy)]
pub struct CellSpec<'a> {
    /// Box of the root cell.
    pub region: Aabb,
    /// Arrangement of the children.
    pub split: CellSplit,
    /// Beyond this distance from zero only the field's sign is stored. With 0 the cells that may contain a
    /// surface are kept, with infinity all are.
    pub band: f32,
    /// Distance by which boxes are enlarged before their sign is stored.
    pub margin: f32,
    /// Decides which cells are split.
    pub rule: &'a dyn SplitRule,
    /// Bound of the program's slope; infinite if only an estimate is known.
    pub max_slope: f32,
    /// Maximum number of clauses of the cells that are split. Cells beyond it are not split.
    pub max_split_clauses: u64,
}

impl CellSpec<'_> {
    /// Reports whether only the sign of a cell is stored, which is positive. Without a value below zero there is no
    /// surface, even where the field is zero.
    fn is_empty(&self, low: f32) -> bool {
        low >= self.band
    }

    /// Reports whether only the sign of a cell is stored, which is negative.
    fn is_full(&self, high: f32) -> bool {
        high < 0.0 && high <= -self.band
    }
}

/// Builds the cells of a program.
pub fn build(program: &Program, tape: &Tape, spec: &CellSpec<'_>) -> Cells {
    let region = spec.region;
    let mut cells = Cells {
        split: spec.split,
        band: spec.band,
        margin: spec.margin,
        rebuilt_count: 0,
        initial_count: 0,
        root: 0,
        over_budget_count: 0,
        may_be_discontinuous: false,
        max_slope: spec.max_slope,
        cells: vec![Cell {
            region,
            slope: 1.0,
            gradient: None,
            may_be_discontinuous: false,
            tape: TapeRange {
                arena: 0,
                start: 0,
                len: tape.clauses.len() as u32,
            },
            stalled_levels: 0,
            is_leaf: true,
            is_deferred: false,
        }],
        nodes: Vec::new(),
        arenas: vec![Arc::new(tape.clauses.clone())],
    };
    let root_parent = SplitParent {
        cell: 0,
        entry: None,
        previous_node: None,
    };
    split_levels(&mut cells, vec![root_parent], program, tape, spec, &[]);
    cells.rebuilt_count = cells.cells.len();
    cells.initial_count = cells.rebuilt_count;
    cells
}

/// Splits cells level by level. `changed` flags the instructions whose constants differ from those of the
/// previous build.
pub(super) fn split_levels(
    cells: &mut Cells,
    mut parents: Vec<SplitParent>,
    program: &Program,
    tape: &Tape,
    spec: &CellSpec<'_>,
    changed: &[bool],
) {
    // Slopes are bounded per cell only for raw fields, whose global divisor is often far too large there.
    // Distances have a slope of one nearly everywhere. Only cells near the surface, with a band of zero, use
    // slopes.
    let slopes = spec.band == 0.0 && program.code.iter().any(divides_raw);
    let is_bounded = spec.max_slope < f32::INFINITY;
    let check_discontinuities =
        slopes && (!is_bounded || program.code.iter().any(may_be_discontinuous));
    cells.may_be_discontinuous = check_discontinuities
        && (!is_bounded
            || Worker::new(program, tape, spec.max_slope)
                .may_be_discontinuous(cells.region(), tape));
    let analysis = CellAnalysis {
        slopes,
        discontinuities: check_discontinuities,
    };
    // Clauses of discarded cells do not count against the limit.
    let clauses_before = cells.clause_count();
    let mut split_clauses = 0;
    let mut next = Vec::new();
    for _ in 0..spec.split.max_levels() {
        let mut remaining = parents.as_slice();
        while !remaining.is_empty() {
            let (batch, others) = remaining.split_at(batch_within_budget(cells, remaining));
            let batch_clauses = batch.iter().map(|parent| cells.tape(parent.cell).len());
            split_clauses += batch_clauses.sum::<usize>() as u64;
            if cells.cells.len() > MAX_CELLS
                || cells.clause_count() - clauses_before > MAX_CLAUSES
                || split_clauses > spec.max_split_clauses
            {
                cells.over_budget_count += remaining.len() + next.len();
                for parent in remaining.iter().chain(&next) {
                    cells.discard_subtree(parent.previous_node);
                }
                return;
            }
            remaining = others;
            let length = batch.len().div_ceil(rayon::current_num_threads() * 8);
            let chunks: Vec<&[SplitParent]> = batch.chunks(length.clamp(1, 64)).collect();
            let outputs = parallel_map_with(
                chunks.len(),
                || Worker::new(program, tape, spec.max_slope),
                |worker, chunk| worker.split_batch(cells, chunks[chunk], spec, analysis),
            );
            for output in outputs {
                merge_output(cells, output, changed, &mut next);
            }
        }
        parents.clear();
        std::mem::swap(&mut parents, &mut next);
    }
}

/// Properties that are computed for cells besides the range of the field.
#[derive(Clone, Copy)]
struct CellAnalysis {
    /// Bounds of the slope and of the gradient.
    slopes: bool,
    /// Possible discontinuities of the field.
    discontinuities: bool,
}

/// Returns the number of leading cells to split before clauses are counted again. Even if nothing could
/// be pruned, their children have at most [`MAX_CLAUSES`] clauses, or those of one cell's children.
fn batch_within_budget(cells: &Cells, parents: &[SplitParent]) -> usize {
    let mut clauses = 0;
    let fitting = parents.iter().take_while(|parent| {
        clauses += cells.tape(parent.cell).len() * CHILDREN;
        clauses <= MAX_CLAUSES
    });
    fitting.count().max(1)
}

/// A cell to split, and the entry of the node that will point to its own node.
#[derive(Clone, Copy, Debug)]
pub(super) struct SplitParent {
    pub(super) cell: u32,
    pub(super) entry: Option<(u32, u32)>,
    /// Node of the cell that this one replaces after an edit.
    pub(super) previous_node: Option<u32>,
}

/// Results of splitting a batch of cells, in their order.
#[derive(Default)]
struct WorkerOutput {
    clauses: Vec<Clause>,
    cells: Vec<(Cell, bool)>,
    /// Children as indices into this output's own cells.
    nodes: Vec<[u32; CHILDREN]>,
    parents: Vec<SplitParent>,
}

impl WorkerOutput {
    /// Returns a tape that is stored in this output.
    fn tape(&self, range: TapeRange) -> Option<&[Clause]> {
        let from = range.start as usize;
        (range.arena == LOCAL_ARENA).then(|| &self.clauses[from..from + range.len as usize])
    }

    /// Returns the range of the last tape, which begins at `start`, or of an equal tape of the cells from
    /// `first_cell` on. Adjacent boxes often have the same tape.
    fn deduplicate_last_tape(&mut self, first_cell: usize, start: usize) -> TapeRange {
        let (earlier, last) = self.clauses.split_at(start);
        let equal_tape = self.cells[first_cell..]
            .iter()
            .rev()
            .map(|(cell, _)| cell.tape);
        let equal_tape = equal_tape
            .filter(|range| range.arena == LOCAL_ARENA)
            .find(|range| {
                let from = range.start as usize;
                range.len as usize == last.len() && earlier[from..from + last.len()] == *last
            });
        if equal_tape.is_some() {
            self.clauses.truncate(start);
        }
        equal_tape.unwrap_or(TapeRange {
            arena: LOCAL_ARENA,
            start: start as u32,
            len: (self.clauses.len() - start) as u32,
        })
    }
}

/// Placeholder for the arena of a worker's tapes until it is appended to the cells.
const LOCAL_ARENA: u32 = u32::MAX;

/// Appends a worker's output to the cells. The cells to split are added to `next`.
fn merge_output(
    cells: &mut Cells,
    output: WorkerOutput,
    changed: &[bool],
    next: &mut Vec<SplitParent>,
) {
    let first = cells.cells.len() as u32;
    let arena = cells.arenas.len() as u32;
    cells.arenas.push(Arc::new(output.clauses));
    let is_split: Vec<bool> = output
        .cells
        .iter()
        .map(|&(_, should_split)| should_split)
        .collect();
    cells
        .cells
        .extend(output.cells.into_iter().map(|(mut cell, _)| {
            if cell.tape.arena == LOCAL_ARENA {
                cell.tape.arena = arena;
            }
            cell
        }));
    for (parent, mut children) in output.parents.into_iter().zip(output.nodes) {
        let node = cells.nodes.len() as u32;
        if let Some((parent_node, entry)) = parent.entry {
            cells.nodes[parent_node as usize].children[entry as usize] = NODE + node;
        }
        cells.cells[parent.cell as usize].is_leaf = false;
        for (child, entry) in children.iter_mut().zip(0..) {
            let should_split = *child >= LEAF && is_split[(*child - LEAF) as usize];
            if *child >= LEAF {
                *child += first;
            }
            let mut previous_node = None;
            if let Some(parent) = parent.previous_node {
                let old = cells.nodes[parent as usize].children[entry as usize];
                if cells.is_unchanged(old, *child, changed) {
                    if *child >= LEAF {
                        cells.cells[(*child - LEAF) as usize].is_leaf = false;
                    }
                    *child = old;
                    continue;
                }
                previous_node = (old >= NODE).then(|| old - NODE);
                if !should_split || previous_node.is_none() {
                    cells.discard_child(old);
                    previous_node = None;
                }
            }
            if should_split {
                next.push(SplitParent {
                    cell: *child - LEAF,
                    entry: Some((node, entry)),
                    previous_node,
                });
            }
        }
        cells.nodes.push(CellNode {
            cell: parent.cell,
            children,
        });
    }
}

/// Safety factor of the largest difference from the value at the centre of a box.
const GRADIENT_SAFETY: f32 = 1.01;

/// Bounds of a field's slope and of its gradient along each axis.
type SlopeAndGradient = (f32, Option<[[f32; 2]; 3]>);

/// Evaluators and buffers of one thread.
struct Worker<'a> {
    program: &'a Program,
    max_slope: f32,
    tracer: Tracer,
    pruner: Pruner,
    gradient: TapeEvaluator<Dual<FloatInterval>>,
    values: TapeEvaluator<f32>,
}

impl<'a> Worker<'a> {
    fn new(program: &'a Program, tape: &Tape, max_slope: f32) -> Self {
        let mut worker = Self {
            program,
            max_slope,
            tracer: Tracer::new(tape),
            pruner: Pruner::default(),
            gradient: TapeEvaluator::new(tape.values, tape.points),
            values: TapeEvaluator::new(tape.values, tape.points),
        };
        worker.pruner.reserve(tape.values, tape.points);
        worker
    }

    fn split_batch(
        &mut self,
        cells: &Cells,
        parents: &[SplitParent],
        spec: &CellSpec<'_>,
        analysis: CellAnalysis,
    ) -> WorkerOutput {
        let mut output = WorkerOutput::default();
        for &parent in parents {
            self.split_cell(cells, parent.cell, spec, analysis, &mut output);
            output.parents.push(parent);
        }
        output
    }

    /// Runs a cell's tape on its children, enlarged by a distance; returns the range of the field in each.
    fn run_children(
        &mut self,
        cells: &Cells,
        parent: u32,
        spec: &CellSpec<'_>,
        margin: f32,
    ) -> &[F32x64; 2] {
        let region = cells.cell(parent).region;
        let boxes = self.tracer.boxes();
        for lane in 0..CHILDREN {
            let child = region.child(lane, spec.split);
            child
                .with_margin(spec.split, margin)
                .write_lane(boxes, lane);
        }
        self.tracer.run(self.program, cells.tape(parent), LANES)
    }

    /// Returns, for each child, whether its values are needed for those of neighbours.
    fn children_beside_values(
        &mut self,
        cells: &Cells,
        parent: u32,
        spec: &CellSpec<'_>,
    ) -> [bool; CHILDREN] {
        if spec.margin == 0.0 {
            return [false; CHILDREN];
        }
        let [low, high] = self.run_children(cells, parent, spec, spec.margin);
        std::array::from_fn(|lane| !spec.is_empty(low.0[lane]) && !spec.is_full(high.0[lane]))
    }

    fn split_cell(
        &mut self,
        cells: &Cells,
        parent: u32,
        spec: &CellSpec<'_>,
        analysis: CellAnalysis,
        output: &mut WorkerOutput,
    ) {
        let region = cells.cell(parent).region;
        let (tape, root_clauses) = (cells.tape(parent), cells.tape(0).len());
        let is_kept = self.children_beside_values(cells, parent, spec);
        let [mut low, mut high] = *self.run_children(cells, parent, spec, 0.0);
        let inputs = *self.tracer.boxes();
        let empty = |lane: usize, low: f32| !is_kept[lane] && spec.is_empty(low);
        let full = |lane: usize, high: f32| !is_kept[lane] && spec.is_full(high);
        let mut slopes_and_gradients = [(1.0, None); LANES];
        let slopes = analysis.slopes && self.is_raw(tape);
        if slopes {
            let open = |&lane: &usize| !empty(lane, low.0[lane]) && !full(lane, high.0[lane]);
            let open: Vec<usize> = (0..CHILDREN).filter(open).collect();
            self.tighten_by_gradient(
                tape,
                &inputs,
                &open,
                &mut slopes_and_gradients,
                [&mut low, &mut high],
            );
        }
        let mut children = [EMPTY; CHILDREN];
        let first = output.cells.len();
        let mut min_abs_field = [0.0; LANES];
        for (lane, entry) in children.iter_mut().enumerate() {
            let (low, high) = (low.0[lane], high.0[lane]);
            if empty(lane, low) {
                continue;
            }
            if full(lane, high) {
                *entry = FULL;
                continue;
            }
            let start = output.clauses.len();
            let trace = self.tracer.trace();
            if trace.has_decision(lane) {
                let choice = |index| trace.choice(index, lane);
                self.pruner.prune(tape, choice, &mut output.clauses);
            }
            let len = output.clauses.len() - start;
            let range = if len == 0 || len == tape.len() {
                output.clauses.truncate(start);
                cells.cell(parent).tape
            } else {
                output.deduplicate_last_tape(first, start)
            };
            min_abs_field[output.cells.len() - first] = low.max(-high).max(0.0);
            *entry = LEAF + output.cells.len() as u32;
            let cell = Cell {
                region: region.child(lane, spec.split),
                slope: slopes_and_gradients[lane].0,
                gradient: slopes_and_gradients[lane].1,
                may_be_discontinuous: analysis.discontinuities
                    && slopes
                    && slopes_and_gradients[lane].1.is_none(),
                tape: range,
                stalled_levels: 0,
                is_leaf: true,
                is_deferred: false,
            };
            output.cells.push((cell, false));
        }
        let new_cells = &output.cells[first..];
        let siblings = SiblingTapes::new(
            tape.len(),
            cells.cell(parent).stalled_levels,
            root_clauses,
            new_cells.iter().map(|(cell, _)| cell.tape.len as usize),
        );
        for (index, min_abs_field) in (first..output.cells.len()).zip(min_abs_field) {
            let Cell {
                region,
                tape: range,
                ..
            } = &output.cells[index].0;
            let clauses = range.len as usize;
            let decision =
                siblings.decide_split(spec.rule, (region, clauses, min_abs_field), || {
                    slopes && self.is_raw(output.tape(*range).unwrap_or(tape))
                });
            let (cell, is_split) = &mut output.cells[index];
            cell.stalled_levels = siblings.stalled_levels(clauses);
            cell.is_deferred = decision == SplitDecision::Defer;
            *is_split = decision == SplitDecision::Split;
        }
        output.nodes.push(children);
    }

    /// Reports whether the field may have a discontinuity in a box: its gradient has no bound there.
    fn may_be_discontinuous(&mut self, region: &Aabb, tape: &Tape) -> bool {
        let mut boxes = [F32x64::default(); 6];
        region.write_lane(&mut boxes, 0);
        let [(_, gradient), ..] = self.slope_bounds(&tape.clauses, &boxes, 1);
        gradient.is_none()
    }

    /// Reports whether a tape divides a raw field by a slope bound.
    fn is_raw(&self, tape: &[Clause]) -> bool {
        let raw = |clause: &Clause| divides_raw(&self.program.code[clause.instruction as usize]);
        tape.iter().any(raw)
    }

    /// Computes slope and gradient bounds in the boxes of `lanes`, and tightens the range of the field there.
    /// The field differs from its value at the centre by at most what its gradient allows (the mean value
    /// form of interval arithmetic: R. Moore, *Interval Analysis*, 1966).
    fn tighten_by_gradient(
        &mut self,
        tape: &[Clause],
        boxes: &[F32x64; 6],
        lanes: &[usize],
        slopes_and_gradients: &mut [SlopeAndGradient; LANES],
        [low, high]: [&mut F32x64; 2],
    ) {
        let mut open_boxes = [F32x64::default(); 6];
        let centres = self.values.inputs_mut();
        for (slot, &lane) in lanes.iter().enumerate() {
            for axis in 0..3 {
                let (from, to) = (boxes[axis].0[lane], boxes[axis + 3].0[lane]);
                (open_boxes[axis].0[slot], open_boxes[axis + 3].0[slot]) = (from, to);
                centres[axis].0[slot] = from + (to - from) * 0.5;
            }
        }
        let values = *self.values.run(self.program, tape, lanes.len());
        let computed = self.slope_bounds(tape, &open_boxes, lanes.len());
        for (slot, &lane) in lanes.iter().enumerate() {
            slopes_and_gradients[lane] = computed[slot];
            let (slope, Some(gradient)) = computed[slot] else {
                continue;
            };
            let (mut max_change, mut coordinate_sum) = (0.0, 0.0);
            for (axis, [min, max]) in gradient.iter().enumerate() {
                let (from, to) = (open_boxes[axis].0[slot], open_boxes[axis + 3].0[slot]);
                max_change += min.abs().max(max.abs()) * (to - from) * 0.5;
                coordinate_sum += from.abs().max(to.abs());
            }
            // The slack covers rounding of the centre and of the value there. Comparing with NaN keeps the
            // old bound.
            let (slack, value) = (
                max_change * GRADIENT_SAFETY + coordinate_sum * slope * 4e-6,
                values.0[slot],
            );
            low.0[lane] = low.0[lane].max(value - slack);
            high.0[lane] = high.0[lane].min(value + slack);
        }
    }

    /// Returns bounds of the field's slope and of its gradient in the first `count` boxes.
    fn slope_bounds(
        &mut self,
        tape: &[Clause],
        boxes: &[F32x64; 6],
        count: usize,
    ) -> [SlopeAndGradient; LANES] {
        *self.gradient.inputs_mut() = with_identity_jacobian_of_boxes(boxes);
        let [x, y, z, _] = self.gradient.run(self.program, tape, count);
        std::array::from_fn(|lane| {
            let gradient = [x, y, z].map(|[low, high]| [low.0[lane], high.0[lane]]);
            let (slope, gradient) = with_slack(gradient);
            if !slope.is_finite() {
                return (1.0, None);
            }
            (clamped_slope(slope, self.max_slope), Some(gradient))
        })
    }
}
