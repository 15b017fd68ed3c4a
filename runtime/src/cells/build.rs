//! Building cells, level by level, on all cores.

use super::{CELL, CHILDREN, Cell, Cells, EMPTY, FULL, Kept, NODE, Node, Region, Split};
use crate::crew::share;
use sdfc_shaders::interpreter::cut::STALE;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::FloatInterval;
use sdfc_vm::lanes::{Column, LANES};
use sdfc_vm::program::Program;
use sdfc_vm::tape::choose::Chooser;
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::steep::{divides_raw, may_jump};
use sdfc_vm::tape::{Clause, Tape};
use std::sync::Arc;

/// The most cells; those that are not cut for it keep the tape that they have.
const MOST: usize = 400_000;
/// The most clauses of all tapes together.
pub(super) const MOST_CLAUSES: usize = 6_000_000;

/// Decides which cells are cut further.
pub trait Refine: Sync {
    /// Whether this one is, with a tape of so many clauses; in all of it the field is `away` from
    /// zero or farther.
    fn cut(&self, region: &Region, clauses: usize, away: f32) -> bool;

    /// Whether cutting it further is left to somebody else, with a tape of so many clauses.
    fn leaves(&self, _clauses: usize) -> bool {
        false
    }
}

/// What is cut, and how far.
#[derive(Clone, Copy)]
pub struct Cut<'a> {
    /// The box that is cut.
    pub region: Region,
    /// How cells are cut.
    pub split: Split,
    /// Where the field is this far from zero or farther, nothing but its sign is kept. With 0 the
    /// cells that may hold a surface are kept, with infinity all are.
    pub band: f32,
    /// How small they get.
    pub refine: &'a dyn Refine,
}

/// The cells of a program.
pub fn build(program: &Program, tape: &Tape, cut: &Cut<'_>) -> Cells {
    let region = cut.region;
    let mut cells = Cells {
        split: cut.split,
        band: cut.band,
        made: 0,
        first: 0,
        root: 0,
        short: 0,
        jumps: false,
        cells: vec![Cell {
            region,
            slope: 1.0,
            gradient: None,
            jumps: false,
            tape: Kept {
                arena: 0,
                start: 0,
                len: tape.clauses.len() as u32,
            },
            stale: 0,
            leaf: true,
            left: false,
        }],
        nodes: Vec::new(),
        arenas: vec![Arc::new(tape.clauses.clone())],
    };
    let whole = Parent {
        cell: 0,
        entry: None,
        before: None,
    };
    deepen(&mut cells, vec![whole], program, tape, cut, &[]);
    cells.made = cells.cells.len();
    cells.first = cells.made;
    cells
}

/// Cuts these cells, and what they are cut into. `changed` says of each instruction whether it is
/// another than when the cells were cut before.
pub(super) fn deepen(
    cells: &mut Cells,
    mut parents: Vec<Parent>,
    program: &Program,
    tape: &Tape,
    cut: &Cut<'_>,
    changed: &[bool],
) {
    // Raw fields are divided by a bound of their slope that holds everywhere; in a cell it may be
    // far smaller. Distances have a slope of one nearly everywhere, which needs no finding out.
    // Only who looks for the surface asks.
    let slopes = cut.band == 0.0 && program.code.iter().any(divides_raw);
    let jumps = slopes && program.code.iter().any(may_jump);
    cells.jumps = jumps && Worker::new(program, tape).jumps(cells.region(), tape);
    let looks = Looks { slopes, jumps };
    // What edits left behind is no reason to cut less.
    let before = cells.clauses();
    let mut next = Vec::new();
    for _ in 0..cut.split.levels() {
        let mut rest = parents.as_slice();
        while !rest.is_empty() {
            if cells.cells.len() > MOST || cells.clauses() - before > MOST_CLAUSES {
                cells.short += rest.len() + next.len();
                for parent in rest.iter().chain(&next) {
                    cells.forget(parent.before);
                }
                return;
            }
            let (group, others) = rest.split_at(affordable(cells, rest));
            rest = others;
            let length = group.len().div_ceil(rayon::current_num_threads() * 8);
            let pieces: Vec<&[Parent]> = group.chunks(length.clamp(1, 64)).collect();
            let parts = share(
                pieces.len(),
                || Worker::new(program, tape),
                |worker, piece| worker.cut_all(cells, pieces[piece], cut, looks),
            );
            for part in parts {
                add(cells, part, changed, &mut next);
            }
        }
        parents.clear();
        std::mem::swap(&mut parents, &mut next);
    }
}

/// Findings about cells besides the range of the field.
#[derive(Clone, Copy)]
struct Looks {
    /// Bounds of the slope and the gradient.
    slopes: bool,
    /// Set where the field may jump.
    jumps: bool,
}

/// How many of these cells are cut before clauses are counted again: so few that, even if nothing could be
/// left out of any tape, there would be no more than [`MOST_CLAUSES`] beyond what is allowed, or than
/// those of one cell.
fn affordable(cells: &Cells, parents: &[Parent]) -> usize {
    let mut clauses = 0;
    let fitting = parents.iter().take_while(|parent| {
        clauses += cells.tape(parent.cell).len() * CHILDREN;
        clauses <= MOST_CLAUSES
    });
    fitting.count().max(1)
}

/// A cell that is to be cut, and the entry of a node that will point to its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parent {
    pub(super) cell: u32,
    pub(super) entry: Option<(u32, u32)>,
    /// What it was cut into before an edit.
    pub(super) before: Option<u32>,
}

/// What became of some parents, in their order.
#[derive(Default)]
struct Part {
    clauses: Vec<Clause>,
    cells: Vec<(Cell, bool)>,
    /// With numbers of this part's own cells.
    nodes: Vec<[u32; CHILDREN]>,
    parents: Vec<Parent>,
}

impl Part {
    /// A tape of its own.
    fn tape(&self, kept: Kept) -> Option<&[Clause]> {
        let from = kept.start as usize;
        (kept.arena == OWN).then(|| &self.clauses[from..from + kept.len as usize])
    }

    /// Keeps the last tape, which begins at `start`, unless a cell from the `first` on has the same: boxes
    /// side by side often do.
    fn keep_once(&mut self, first: usize, start: usize) -> Kept {
        let (before, last) = self.clauses.split_at(start);
        let alike = self.cells[first..].iter().rev().map(|(cell, _)| cell.tape);
        let alike = alike.filter(|kept| kept.arena == OWN).find(|kept| {
            let from = kept.start as usize;
            kept.len as usize == last.len() && before[from..from + last.len()] == *last
        });
        if alike.is_some() {
            self.clauses.truncate(start);
        }
        alike.unwrap_or(Kept {
            arena: OWN,
            start: start as u32,
            len: (self.clauses.len() - start) as u32,
        })
    }
}

/// The arena of a part's own tapes, until it is known.
const OWN: u32 = u32::MAX;

/// Takes a part over; the cells that are to be cut are added to `next`.
fn add(cells: &mut Cells, part: Part, changed: &[bool], next: &mut Vec<Parent>) {
    let first = cells.cells.len() as u32;
    let arena = cells.arenas.len() as u32;
    cells.arenas.push(Arc::new(part.clauses));
    let cuts: Vec<bool> = part.cells.iter().map(|&(_, cut)| cut).collect();
    cells
        .cells
        .extend(part.cells.into_iter().map(|(mut cell, _)| {
            if cell.tape.arena == OWN {
                cell.tape.arena = arena;
            }
            cell
        }));
    for (parent, mut children) in part.parents.into_iter().zip(part.nodes) {
        let node = cells.nodes.len() as u32;
        if let Some((above, entry)) = parent.entry {
            cells.nodes[above as usize].children[entry as usize] = NODE + node;
        }
        cells.cells[parent.cell as usize].leaf = false;
        for (child, entry) in children.iter_mut().zip(0..) {
            let cut = *child >= CELL && cuts[(*child - CELL) as usize];
            if *child >= CELL {
                *child += first;
            }
            let mut before = None;
            if let Some(parent) = parent.before {
                let old = cells.nodes[parent as usize].children[entry as usize];
                if cells.is_as_before(old, *child, changed) {
                    if *child >= CELL {
                        cells.cells[(*child - CELL) as usize].leaf = false;
                    }
                    *child = old;
                    continue;
                }
                before = (old >= NODE).then(|| old - NODE);
                if !cut || before.is_none() {
                    cells.forget_child(old);
                    before = None;
                }
            }
            if cut {
                next.push(Parent {
                    cell: *child - CELL,
                    entry: Some((node, entry)),
                    before,
                });
            }
        }
        cells.nodes.push(Node {
            cell: parent.cell,
            children,
        });
    }
}

/// How much farther from its value in the middle of a box a field is taken to be than it can be.
const SURELY: f32 = 1.01;

/// Bounds of a field's slope and of its gradient.
type Steepness = (f32, Option<[[f32; 2]; 3]>);

/// The memory of one thread.
struct Worker<'a> {
    program: &'a Program,
    chooser: Chooser,
    pruner: Pruner,
    gradient: Machine<Dual<FloatInterval>>,
    values: Machine<f32>,
}

impl<'a> Worker<'a> {
    fn new(program: &'a Program, tape: &Tape) -> Self {
        let mut worker = Self {
            program,
            chooser: Chooser::new(tape),
            pruner: Pruner::default(),
            gradient: Machine::new(tape.values, tape.points),
            values: Machine::new(tape.values, tape.points),
        };
        worker.pruner.reserve(tape.values, tape.points);
        worker
    }

    fn cut_all(&mut self, cells: &Cells, parents: &[Parent], cut: &Cut<'_>, looks: Looks) -> Part {
        let mut part = Part::default();
        for &parent in parents {
            self.cut(cells, parent.cell, cut, looks, &mut part);
            part.parents.push(parent);
        }
        part
    }

    fn cut(&mut self, cells: &Cells, parent: u32, cut: &Cut<'_>, looks: Looks, part: &mut Part) {
        let region = cells.cell(parent).region;
        let (tape, whole) = (cells.tape(parent), cells.tape(0).len());
        let boxes = self.chooser.boxes();
        for lane in 0..CHILDREN {
            let child = region.child(lane, cut.split);
            child.with_margin(cut.split).put(boxes, lane);
        }
        let seed = *boxes;
        let [mut low, mut high] = *self.chooser.run(self.program, tape, LANES);
        let empty = |low: f32| low > 0.0 && low >= cut.band;
        let full = |high: f32| high < 0.0 && high <= -cut.band;
        let mut steepness = [(1.0, None); LANES];
        let slopes = looks.slopes && self.is_raw(tape);
        if slopes {
            let open = |&lane: &usize| !empty(low.0[lane]) && !full(high.0[lane]);
            let open: Vec<usize> = (0..CHILDREN).filter(open).collect();
            self.look_closely(tape, &seed, &open, &mut steepness, [&mut low, &mut high]);
        }
        let mut children = [EMPTY; CHILDREN];
        let first = part.cells.len();
        let mut away = [0.0; LANES];
        for (lane, entry) in children.iter_mut().enumerate() {
            let (low, high) = (low.0[lane], high.0[lane]);
            if empty(low) {
                continue;
            }
            if full(high) {
                *entry = FULL;
                continue;
            }
            let start = part.clauses.len();
            let decided = self.chooser.decided();
            if decided.any(lane) {
                let choice = |place| decided.choice(place, lane);
                self.pruner.prune(tape, choice, &mut part.clauses);
            }
            let len = part.clauses.len() - start;
            let kept = if len == 0 || len == tape.len() {
                part.clauses.truncate(start);
                cells.cell(parent).tape
            } else {
                part.keep_once(first, start)
            };
            away[part.cells.len() - first] = low.max(-high).max(0.0);
            *entry = CELL + part.cells.len() as u32;
            let cell = Cell {
                region: region.child(lane, cut.split),
                slope: steepness[lane].0,
                gradient: steepness[lane].1,
                jumps: looks.jumps && slopes && steepness[lane].1.is_none(),
                tape: kept,
                stale: 0,
                leaf: true,
                left: false,
            };
            part.cells.push((cell, false));
        }
        // A child that kept all is no reason to stop where the others are rid of most: it is large still, and
        // what is in it is small.
        let made = &part.cells[first..];
        let lengths = made.iter().map(|(cell, _)| cell.tape.len as usize);
        let is_stale = lengths.sum::<usize>() * 10 > made.len() * tape.len() * 9;
        for (place, away) in (first..part.cells.len()).zip(away) {
            let kept = part.cells[place].0.tape;
            let len = kept.len as usize;
            let stale = match is_stale && len * 10 > tape.len() * 9 {
                true => cells.cell(parent).stale + 1,
                false => 0,
            };
            let most = STALE[usize::from(len * 2 <= whole)];
            // Smaller cells have closer bounds of slopes, too.
            let pays = stale < most || slopes && self.is_raw(part.tape(kept).unwrap_or(tape));
            let (cell, is_cut) = &mut part.cells[place];
            let wanted = pays && cut.refine.cut(&cell.region, len, away);
            cell.stale = stale;
            cell.left = wanted && cut.refine.leaves(len);
            *is_cut = wanted && !cell.left;
        }
        part.nodes.push(children);
    }

    /// Reports whether the field may jump in a box: its gradient has no bound there.
    fn jumps(&mut self, region: &Region, tape: &Tape) -> bool {
        let mut boxes = [Column::default(); 6];
        region.put(&mut boxes, 0);
        let [(_, gradient), ..] = self.slopes(&tape.clauses, &boxes, 1);
        gradient.is_none()
    }

    /// Whether a tape divides a raw field.
    fn is_raw(&self, tape: &[Clause]) -> bool {
        let raw = |clause: &Clause| divides_raw(&self.program.code[clause.at as usize]);
        tape.iter().any(raw)
    }

    /// Finds how steep the field is in the boxes in these lanes, and makes its bounds there closer: nowhere is
    /// it farther from its value in the middle than its gradient lets it go from there (the mean value form
    /// of interval arithmetic: R. Moore, *Interval Analysis*, 1966).
    fn look_closely(
        &mut self,
        tape: &[Clause],
        boxes: &[Column; 6],
        lanes: &[usize],
        steepness: &mut [Steepness; LANES],
        [low, high]: [&mut Column; 2],
    ) {
        let mut near = [Column::default(); 6];
        let middles = self.values.seed();
        for (place, &lane) in lanes.iter().enumerate() {
            for axis in 0..3 {
                let (from, to) = (boxes[axis].0[lane], boxes[axis + 3].0[lane]);
                (near[axis].0[place], near[axis + 3].0[place]) = (from, to);
                middles[axis].0[place] = from + (to - from) * 0.5;
            }
        }
        let values = *self.values.run(self.program, tape, lanes.len());
        let found = self.slopes(tape, &near, lanes.len());
        for (place, &lane) in lanes.iter().enumerate() {
            steepness[lane] = found[place];
            let (slope, Some(gradient)) = found[place] else {
                continue;
            };
            let (mut way, mut far) = (0.0, 0.0);
            for (axis, [least, greatest]) in gradient.iter().enumerate() {
                let (from, to) = (near[axis].0[place], near[axis + 3].0[place]);
                way += least.abs().max(greatest.abs()) * (to - from) * 0.5;
                far += from.abs().max(to.abs());
            }
            // What is rounded is the middle and the value there. Comparing with NaN keeps what is known.
            let (most, value) = (way * SURELY + far * slope * 4e-6, values.0[place]);
            low.0[lane] = low.0[lane].max(value - most);
            high.0[lane] = high.0[lane].min(value + most);
        }
    }

    /// Bounds of the field's slope and of its gradient in the first `count` boxes.
    fn slopes(&mut self, tape: &[Clause], boxes: &[Column; 6], count: usize) -> [Steepness; LANES] {
        let seed = self.gradient.seed();
        *seed = <[[Column; 6]; 4]>::default();
        seed[0] = *boxes;
        for axis in 0..3 {
            seed[axis + 1][axis] = Column([1.0; LANES]);
            seed[axis + 1][axis + 3] = Column([1.0; LANES]);
        }
        let [x, y, z, _] = self.gradient.run(self.program, tape, count);
        std::array::from_fn(|lane| {
            let square = |[low, high]: &[Column; 2]| {
                let most = low.0[lane].abs().max(high.0[lane].abs());
                most * most
            };
            // Gradients are rounded without care for the direction; this is far more than that.
            let slope = (square(x) + square(y) + square(z)).sqrt() * 1.001;
            if !slope.is_finite() {
                return (1.0, None);
            }
            let slack = slope * 1e-3;
            let gradient = [x, y, z].map(|[low, high]| [low.0[lane] - slack, high.0[lane] + slack]);
            (slope.clamp(1e-6, 1.0), Some(gradient))
        })
    }
}
