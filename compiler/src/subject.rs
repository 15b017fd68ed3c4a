//! The subject of open cameras: the solid without floors, skies and endless fields.
//!
//! Intervals find its reach: boxes that reach farthest are asked first whether the field can be below zero
//! there, so that thin and nested shapes are framed as closely as plain ones.

mod extremes;
mod finite;
mod pruned;

use crate::bounds::Boxes;
use crate::climb::Climb;
use crate::scene::{Scene, ShapeId};
use finite::Finder;
use pruned::Field;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::gradient;
use sdfc_vm::interval::Interval;
use sdfc_vm::outline::Outline;
use sdfc_vm::program::Program;
use sdfc_vm::tape::parts::Part;
use sdfc_vm::vector::V3;
use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

/// The most halvings of a box along each axis.
const LEVELS: u32 = 8;
/// The fewest halvings that tell a reach well enough.
const CLOSE_LEVEL: u32 = 6;
/// The largest distance of a surface from a box that reaches it, in sums of the box's sides.
const MAX_BESIDE: f64 = 4.0;
/// The fewest and the most boxes that are evaluated for one direction.
const BOXES: [usize; 2] = [300, 3000];
/// The most instructions that are run on boxes for one direction.
const MAX_INSTRUCTIONS: usize = 150_000;
/// The ratio of the outline's box to the one given below which the search starts anew in it.
const WORTH_RESTART: f64 = 0.7;
/// The most such restarts.
const MAX_RESTARTS: usize = 4;
/// The most boxes from whose centres points of the solid are looked for.
const MAX_STARTS: usize = 1500;
/// The most instructions of programs that are run once from each of these centres.
const MAX_START_INSTRUCTIONS: usize = 100_000;
/// The excess of intervals over points from which on these count, in half diagonals of the points.
const LOOSE: f64 = 0.12;
/// The length that is added to the reach of points, in half diagonals of them.
const MARGIN: f64 = 0.06;

/// The shape without its operands that have no end, and a box around it; none where nothing is left.
pub(crate) fn subject(
    scene: &mut Scene,
    boxes: &mut Boxes,
    id: ShapeId,
) -> Option<(ShapeId, Bounds)> {
    let mut finder = Finder::new(scene, boxes);
    let part = finder.find(id)?;
    let bounds = finder.bounds(part);
    bounds.is_finite().then_some((part, bounds))
}

/// The outline of a solid within a box; none where intervals prove that nothing of it is there.
///
/// Points of the solid stand for it along directions in which intervals tell too little.
pub(crate) fn outline(program: &Program, bounds: &Bounds) -> Option<Outline> {
    let mut search = Search::new(program, *bounds);
    let mut widest = Outline::by(|direction| search.reach(direction));
    // Of a loose box only few cells are near the solid.
    for _ in 0..MAX_RESTARTS {
        if search.is_empty() {
            return None;
        }
        let within = widest.bounds().common(&search.bounds);
        if within.half_diagonal() > search.bounds.half_diagonal() * WORTH_RESTART {
            break;
        }
        search = Search::new(program, within);
        widest = Outline::by(|direction| search.reach(direction).min(widest.reach(direction)));
    }
    if !search.is_cut_short {
        return Some(widest);
    }
    let starts = search.undecided();
    let Some(climb) = Climb::new(program, &search.bounds, &starts) else {
        return Some(widest);
    };
    let slack = LOOSE * climb.size;
    Some(Outline::by(|direction| {
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let (farthest, reach) = (widest.reach(direction), climb.reach(direction));
        match farthest > reach + slack * length {
            true => reach + MARGIN * climb.size * length,
            false => farthest,
        }
    }))
}

/// A box of the octree: its level, and its number along each axis.
type Cell = (u32, [u32; 3]);

struct Search<'a> {
    program: &'a Program,
    bounds: Bounds,
    field: Field<'a>,
    /// The boxes that were evaluated; of those in which the field can be below zero, the program of what is in them.
    known: HashMap<Cell, Option<Part>>,
    /// The most boxes that are evaluated for one direction.
    max_boxes: usize,
    /// A direction was given up, and its reach may be far less.
    is_cut_short: bool,
}

/// A box on the list of those that may reach farthest.
struct Candidate {
    reach: f64,
    cell: Cell,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.reach
            .total_cmp(&other.reach)
            .then_with(|| self.cell.cmp(&other.cell))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl<'a> Search<'a> {
    fn new(program: &'a Program, bounds: Bounds) -> Self {
        let [fewest, most] = BOXES;
        Self {
            program,
            bounds,
            field: Field::new(program),
            known: HashMap::new(),
            max_boxes: (MAX_INSTRUCTIONS / program.code.len().max(1)).clamp(fewest, most),
            is_cut_short: false,
        }
    }

    /// Reports whether nothing can be inside of the box.
    fn is_empty(&self) -> bool {
        let whole = (0, [0; 3]);
        let parts = |(level, at): Cell| {
            (0..8).map(move |corner| {
                let part = [0, 1, 2].map(|axis| at[axis] * 2 + (corner >> axis & 1));
                (level + 1, part)
            })
        };
        let mut open = vec![whole];
        while let Some(cell) = open.pop() {
            match self.known.get(&cell) {
                Some(None) => {}
                Some(Some(_)) if cell.0 < LEVELS => open.extend(parts(cell)),
                Some(Some(_)) | None => return false,
            }
        }
        true
    }

    /// The centres of boxes that may hold something, found level by level.
    fn undecided(&mut self) -> Vec<[f64; 3]> {
        let most = MAX_START_INSTRUCTIONS / self.program.code.len().max(1);
        let most = most.clamp(8, MAX_STARTS);
        let mut cells: Vec<Cell> = vec![(0, [0; 3])];
        loop {
            let mut next = Vec::with_capacity(cells.len() * 8);
            for &(level, at) in &cells {
                for corner in 0..8 {
                    let part = [0, 1, 2].map(|axis| at[axis] * 2 + (corner >> axis & 1));
                    if self.may_be_inside((level + 1, part)) {
                        next.push((level + 1, part));
                    }
                }
            }
            let is_last = next.first().is_none_or(|&(level, _)| level >= CLOSE_LEVEL);
            if next.len() <= most && !next.is_empty() {
                cells = next;
            }
            if is_last || cells.len() > most / 8 {
                break;
            }
        }
        let centre = |&cell: &Cell| {
            [0, 1, 2].map(|axis| {
                let range = self.range(cell, axis);
                range.lo + (range.hi - range.lo) / 2.0
            })
        };
        cells.iter().map(centre).collect()
    }

    fn reach(&mut self, direction: [f64; 3]) -> f64 {
        let candidate = |search: &Self, cell: Cell| Candidate {
            reach: search.farthest(cell, direction),
            cell,
        };
        let whole = (0, [0; 3]);
        let mut open = BinaryHeap::from([candidate(self, whole)]);
        let mut asked = 0;
        while let Some(Candidate { reach, cell }) = open.pop() {
            let (level, at) = cell;
            asked += 1;
            if asked > self.max_boxes {
                self.is_cut_short |= level < CLOSE_LEVEL;
                return reach;
            }
            if !self.may_be_inside(cell) {
                continue;
            }
            if level == LEVELS {
                self.is_cut_short |= !self.is_near_surface(cell);
                return reach;
            }
            for corner in 0..8 {
                let part = [0, 1, 2].map(|axis| at[axis] * 2 + (corner >> axis & 1));
                open.push(candidate(self, (level + 1, part)));
            }
        }
        // Nothing is inside: the box stands for it.
        self.farthest(whole, direction)
    }

    /// Reports whether the value in the middle of a box is that of a surface beside it.
    ///
    /// Intervals decide nothing where a field is torn, as angles and polygons are.
    fn is_near_surface(&self, cell: Cell) -> bool {
        let sides = [0, 1, 2].map(|axis| self.range(cell, axis));
        let [x, y, z] = sides.map(|side| side.lo + (side.hi - side.lo) / 2.0);
        let here = gradient::<f64>(self.program, V3::of(x, y, z));
        let V3 { x, y, z } = here.gradient;
        let slope = (x * x + y * y + z * z).sqrt();
        let size: f64 = sides.iter().map(|side| side.hi - side.lo).sum();
        here.value <= slope * size * MAX_BESIDE
    }

    fn range(&self, (level, at): Cell, axis: usize) -> Interval {
        let (low, high) = (self.bounds.min[axis], self.bounds.max[axis]);
        let side = (high - low) / f64::from(1 << level);
        let lo = low + f64::from(at[axis]) * side;
        Interval { lo, hi: lo + side }
    }

    fn farthest(&self, cell: Cell, direction: [f64; 3]) -> f64 {
        let along = |axis: usize| {
            let range = self.range(cell, axis);
            (direction[axis] * range.lo).max(direction[axis] * range.hi)
        };
        (0..3).map(along).sum()
    }

    fn may_be_inside(&mut self, cell: Cell) -> bool {
        if let Some(known) = self.known.get(&cell) {
            return known.is_some();
        }
        let [x, y, z] = [0, 1, 2].map(|axis| self.range(cell, axis));
        let region = V3 { x, y, z };
        let around = self.part_around(cell);
        if self.field.over(&around, region).lo > 0.0 {
            self.known.insert(cell, None);
            return false;
        }
        let part = self.field.prune(&around);
        let falls_short = self.falls_short(&part, region);
        if falls_short {
            self.field.forget(&part, &around);
        }
        self.known.insert(cell, (!falls_short).then_some(part));
        !falls_short
    }

    /// The program of the box around one.
    fn part_around(&self, (level, at): Cell) -> Part {
        let around = level
            .checked_sub(1)
            .map(|level| (level, at.map(|number| number / 2)));
        let known = around.and_then(|around| self.known.get(&around)?.clone());
        known.unwrap_or_else(|| self.field.whole())
    }

    /// Tells if the field, from its value in the middle of a box, cannot fall to zero within the box.
    fn falls_short(&mut self, part: &Part, region: V3<Interval>) -> bool {
        let sides = [region.x, region.y, region.z];
        let [x, y, z] = sides.map(|side| Interval::point(side.lo + (side.hi - side.lo) / 2.0));
        let middle = self.field.over(part, V3 { x, y, z });
        if middle.lo <= 0.0 {
            return false;
        }
        let V3 { x, y, z } = self.field.gradient(part, region);
        let fall = [x, y, z].into_iter().zip(sides);
        let fall: f64 = fall
            .map(|(slope, side)| slope.magnitude() * (side.hi - side.lo) / 2.0)
            .sum();
        // What is not a number does not fall short.
        fall < middle.lo
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_vm::evaluate::evaluate_f64;
    use sdfc_vm::listing::parse;
    use sdfc_vm::outline::directions;
    use sdfc_vm::real::Vector3;

    /// The places where a plane crosses the edges of a box.
    fn crossings(program: &Program, bounds: &Bounds) -> Vec<[f64; 3]> {
        let corner = |number: usize| {
            [0, 1, 2].map(|axis| match number >> axis & 1 {
                0 => bounds.min[axis],
                _ => bounds.max[axis],
            })
        };
        let edges = (0..8).flat_map(|from| (0..3).map(move |axis| (from, from ^ 1 << axis)));
        let crossing = |(from, to): (usize, usize)| {
            let ends = [corner(from), corner(to)];
            let [a, b] = ends.map(|p| evaluate_f64(program, p));
            let [from, to] = ends;
            (a > 0.0 && b < 0.0)
                .then(|| [0, 1, 2].map(|i| from[i] + (to[i] - from[i]) * a / (a - b)))
        };
        edges.filter_map(crossing).collect()
    }

    /// The outline holds all of a corner that a plane cuts off a box.
    #[test]
    fn small_corners_are_within_the_outline() {
        let mut state = 3_u64;
        let mut number = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1 << 30) - 1.0
        };
        let mut tried = 0;
        for _ in 0..200 {
            let normal = V3::of(number(), number(), number()).normalize();
            let V3 { x, y, z } = normal;
            let listing = format!("0000 plane [{x:?}, {y:?}, {z:?}, {:?}]", -number());
            let program = parse(&listing).expect("a program");
            let bounds = Bounds {
                min: [0, 1, 2].map(|_| -number().abs()),
                max: [0, 1, 2].map(|_| number().abs()),
            };
            let Some(outline) = outline(&program, &bounds) else {
                assert!(crossings(&program, &bounds).is_empty(), "{listing}");
                continue;
            };
            for p in crossings(&program, &bounds) {
                tried += 1;
                for (direction, reach) in directions().into_iter().zip(outline.reaches) {
                    let along: f64 = (0..3).map(|axis| direction[axis] * p[axis]).sum();
                    assert!(
                        along <= reach + 1e-6,
                        "{listing} in {bounds:?}: {p:?} is {} beyond {direction:?}",
                        along - reach
                    );
                }
            }
        }
        assert!(tried > 300, "only {tried} places");
    }
}
