//! The subject of open cameras: the solid without floors, skies and endless fields.
//!
//! Intervals find its reach: boxes that reach farthest are asked first whether the field can be below zero
//! there, so that thin and nested shapes are framed as closely as plain ones.

use crate::bounds::{Boxes, World};
use crate::climb::Climb;
use crate::scene::{Scene, Shape, ShapeId, ShapeKind};
use crate::seen::found;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate, gradient};
use sdfc_vm::interval::Interval;
use sdfc_vm::outline::Outline;
use sdfc_vm::program::Program;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

/// The most halvings of a box along each axis.
const LEVELS: u32 = 6;
/// The most boxes that are asked for one direction.
const MOST_BOXES: usize = 300;
/// The ratio of a box to the points that are found in it from which on these count.
const LOOSE: f64 = 4.0;
/// The length that is added to the reach of points, in half diagonals of them.
const MARGIN: f64 = 0.1;

/// The shape without its operands that have no end, and a box around it; none where nothing is left.
pub(crate) fn subject(
    scene: &mut Scene,
    boxes: &mut Boxes,
    id: ShapeId,
) -> Option<(ShapeId, Bounds)> {
    let bounds = boxes.of(World::from(&*scene), id);
    if bounds.is_empty() {
        return None;
    }
    if bounds.is_finite() {
        return Some((id, bounds));
    }
    let shape = scene.shapes[id.0 as usize].clone();
    let mut kind = shape.kind.clone();
    match &mut kind {
        ShapeKind::Combine { op, children, .. } if set(*op) == Some(SetOperation::Union) => {
            let all = std::mem::take(children);
            let left: Vec<_> = all
                .into_iter()
                .filter_map(|child| subject(scene, boxes, child))
                .collect();
            if let [only] = *left {
                return Some(only);
            }
            if left.is_empty() {
                return None;
            }
            *children = left.iter().map(|(child, _)| *child).collect();
            let hull = left
                .iter()
                .fold(Bounds::EMPTY, |hull, (_, bounds)| hull.hull(bounds));
            let (id, bounds) = made(scene, boxes, shape, kind);
            Some((id, bounds.common(&hull)))
        }
        // What is cut away has no end of its own.
        ShapeKind::Combine { op, children, .. } if set(*op) == Some(SetOperation::Subtraction) => {
            let (body, within) = subject(scene, boxes, children[0])?;
            children[0] = body;
            let (id, bounds) = made(scene, boxes, shape, kind);
            Some((id, bounds.common(&within)))
        }
        ShapeKind::Frame { child, .. }
        | ShapeKind::Displace { child, .. }
        | ShapeKind::Painted { child, .. }
        | ShapeKind::Distance { child, .. }
            if !is_complement(&shape.kind) =>
        {
            *child = subject(scene, boxes, *child)?.0;
            let (id, bounds) = made(scene, boxes, shape, kind);
            found(scene, id, &bounds).map(|bounds| (id, bounds))
        }
        // Their boxes follow from intervals.
        ShapeKind::Field { .. } | ShapeKind::Warp { .. } => {
            found(scene, id, &bounds).map(|bounds| (id, bounds))
        }
        _ => None,
    }
}

/// Tells if a kind is a complement, which has no end.
fn is_complement(kind: &ShapeKind) -> bool {
    matches!(
        kind,
        ShapeKind::Distance {
            op: Op::Complement,
            ..
        }
    )
}

/// A new shape of a kind, and its box.
fn made(scene: &mut Scene, boxes: &mut Boxes, like: Shape, kind: ShapeKind) -> (ShapeId, Bounds) {
    scene.shapes.push(Shape { kind, ..like });
    let id = ShapeId(scene.shapes.len() as u32 - 1);
    (id, boxes.of(World::from(&*scene), id))
}

/// The set operation of a row.
fn set(op: Op) -> Option<SetOperation> {
    op.row().meta.set
}

/// The outline of a solid within a box.
///
/// Points of the solid stand for it if intervals bound it far too widely.
pub(crate) fn outline(program: &Program, bounds: &Bounds) -> Outline {
    let mut search = Search {
        program,
        bounds,
        known: HashMap::new(),
        is_cut_short: false,
    };
    let widest = Outline::by(|direction| search.reach(direction));
    if !search.is_cut_short {
        return widest;
    }
    match Climb::new(program, bounds) {
        Some(climb) if bounds.half_diagonal() > LOOSE * climb.size => {
            let margin = MARGIN * climb.size;
            Outline::by(|direction| {
                let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
                let reach = climb.reach(direction) + margin * length;
                reach.min(widest.reach(direction))
            })
        }
        _ => widest,
    }
}

/// A box of the octree: its level, and its number along each axis.
type Cell = (u32, [u32; 3]);

struct Search<'a> {
    program: &'a Program,
    bounds: &'a Bounds,
    /// The boxes that were asked, and if the field can be below zero there.
    known: HashMap<Cell, bool>,
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

impl Search<'_> {
    fn reach(&mut self, direction: [f64; 3]) -> f64 {
        let candidate = |search: &Self, cell: Cell| Candidate {
            reach: search.farthest(cell, direction),
            cell,
        };
        let whole = (0, [0; 3]);
        let mut open = BinaryHeap::from([candidate(self, whole)]);
        let mut asked = 0;
        while let Some(Candidate { reach, cell }) = open.pop() {
            asked += 1;
            if asked > MOST_BOXES {
                self.is_cut_short = true;
                return reach;
            }
            if !self.may_be_inside(cell) {
                continue;
            }
            let (level, at) = cell;
            if level == LEVELS {
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
        if let Some(&known) = self.known.get(&cell) {
            return known;
        }
        let [x, y, z] = [0, 1, 2].map(|axis| self.range(cell, axis));
        let region = V3 { x, y, z };
        let value = evaluate::<Interval>(self.program, region);
        let is_outside = value.lo > 0.0 || self.falls_short(region);
        self.known.insert(cell, !is_outside);
        !is_outside
    }

    /// Tells if the field, from its value in the middle of a box, cannot fall to zero within the box.
    fn falls_short(&self, region: V3<Interval>) -> bool {
        let sides = [region.x, region.y, region.z];
        let [x, y, z] = sides.map(|side| Interval::point(side.lo + (side.hi - side.lo) / 2.0));
        let middle = evaluate::<Interval>(self.program, V3 { x, y, z });
        if middle.lo <= 0.0 {
            return false;
        }
        let V3 { x, y, z } = gradient::<Interval>(self.program, region).gradient;
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
            let outline = outline(&program, &bounds);
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
