//! Subject of automatic cameras: the solid without floors, skies and unbounded fields.
//!
//! Intervals bound its extent. The boxes that extend farthest are tested first for negative values of the
//! field. Thus thin and nested shapes are framed as closely as plain ones.

mod extremes;
mod finite;
mod linear_bound;
mod pruned;

use crate::analysis::bounds::ShapeBounds;
use crate::analysis::climb::SurfaceClimb;
use crate::analysis::extents::SolidParts;
use crate::scene::{Scene, SceneRef, ShapeId};
use finite::FiniteFinder;
use glam::DVec3;
use linear_bound::LinearBound;
use pruned::{PARTS, PrunedField};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::gradient;
use sdfc_vm::interval::Interval;
use sdfc_vm::outline::{Outline, directions};
use sdfc_vm::program::Program;
use sdfc_vm::tape::stack::TapeSpan;
use sdfc_vm::vector::V3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Maximum level of the octree.
const MAX_LEVEL: u32 = 6;
/// Maximum excess of an extent over that of a point inside, in half diagonals of the searched box.
const PRECISION: f64 = 1.0 / 32.0;
/// Minimum decrease of a box's extent by bounds of the gradient for other boxes to come first, in units of the precision.
const MIN_PROGRESS: f64 = 0.125;
/// Maximum distance of a surface from a box that is near it, in sums of the box's sides.
const MAX_SURFACE_DISTANCE: f64 = 4.0;
/// Minimum number of boxes that are evaluated for one direction, for long programs.
const MIN_BOXES: usize = 150;
/// Maximum number of boxes that are evaluated for one direction.
const MAX_BOXES: usize = 1000;
/// Maximum number of instructions that are run on boxes for one direction.
const MAX_INSTRUCTIONS: usize = 75_000;
/// The search restarts in the outline's box if its half diagonal is at most this fraction of the previous
/// one.
const MAX_RESTART_RATIO: f64 = 0.7;
/// Maximum number of restarts.
const MAX_RESTARTS: usize = 4;
/// Maximum number of box centres from which points of the solid are searched.
const MAX_STARTS: usize = 1500;
/// Maximum number of instructions of a single run from all of these centres.
const MAX_START_INSTRUCTIONS: usize = 100_000;
/// Excess of intervals over points from which the points are used, in half diagonals of the points.
const MAX_EXCESS: f64 = 0.12;
/// Margin that is added to the extent of points, in their half diagonals.
const CLIMB_MARGIN: f64 = 0.06;

/// Returns the shape without its unbounded operands, and its bounding box; `None` if nothing is left. Returns its
/// parts, too.
pub(crate) fn subject(
    scene: &mut Scene,
    boxes: &mut ShapeBounds,
    id: ShapeId,
) -> (Option<(ShapeId, Bounds)>, SolidParts) {
    let mut finder = FiniteFinder::new(scene, boxes);
    let part = finder.finite_part(id);
    let subject = part.and_then(|part| {
        let bounds = finder.bounds(part);
        bounds.is_finite().then_some((part, bounds))
    });
    let unions = finder.into_unions();
    let finite_part = subject.map(|(part, _)| part);
    let parts = SolidParts::new(SceneRef::from(&*scene), boxes, id, finite_part, unions);
    (subject, parts)
}

/// Returns the outline of a solid within a box; `None` if intervals prove the box empty.
///
/// Points of the solid replace intervals in directions where these are too loose.
pub(crate) fn outline(program: &Program, bounds: &Bounds) -> Option<Outline> {
    let mut search = OutlineSearch::new(program, *bounds);
    let mut widest = Outline::from_support(|direction| search.extent(direction));
    // In a loose box, only few cells are near the solid.
    for _ in 0..MAX_RESTARTS {
        if search.is_empty() {
            return None;
        }
        let inner_bounds = widest.bounds().intersection(&search.bounds);
        if inner_bounds.half_diagonal() > search.bounds.half_diagonal() * MAX_RESTART_RATIO {
            break;
        }
        search = OutlineSearch::new(program, inner_bounds);
        widest = Outline::from_support(|direction| {
            search.extent(direction).min(widest.support(direction))
        });
    }
    if !search.is_incomplete {
        return Some(widest);
    }
    let starts = search.undecided_centres();
    let Some(mut climb) = SurfaceClimb::new(program, &search.bounds, &starts) else {
        return Some(widest);
    };
    let slack = MAX_EXCESS * climb.size;
    let climb_extents = climb.extents(directions());
    let supports = std::array::from_fn(|number| {
        let length = DVec3::from(directions()[number]).length();
        let (upper_extent, climb_extent) = (widest.supports[number], climb_extents[number]);
        match upper_extent > climb_extent + slack * length {
            true => climb_extent + CLIMB_MARGIN * climb.size * length,
            false => upper_extent,
        }
    });
    Some(Outline { supports })
}

/// A box of the octree: its level, and its index along each axis.
type SubjectCell = (u32, [u32; 3]);

/// Index of the octree's root, which has no siblings.
const ROOT: usize = 0;

/// A box that was reached. The eight parts of a box are successive nodes.
struct Node {
    cell: SubjectCell,
    parent: usize,
    /// Index of the first part; zero before the parts are reached.
    first_part: usize,
    state: NodeState,
}

enum NodeState {
    NotEvaluated,
    Empty,
    /// The field may be negative in the box. The program is pruned to it.
    Undecided(TapeSpan, LinearBound),
}

struct OutlineSearch<'a> {
    program: &'a Program,
    bounds: Bounds,
    field: PrunedField<'a>,
    /// Nodes of the octree, the root first.
    nodes: Vec<Node>,
    /// Points that are proved to be inside.
    inside_points: Vec<[f64; 3]>,
    /// Maximum number of boxes that are evaluated for one direction.
    max_boxes: usize,
    /// True if a direction was given up, so that its extent may be much smaller.
    is_incomplete: bool,
}

/// An entry of the queue of boxes, by extent.
struct Candidate {
    extent: f64,
    cell: SubjectCell,
    node: usize,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.extent
            .total_cmp(&other.extent)
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

impl<'a> OutlineSearch<'a> {
    fn new(program: &'a Program, bounds: Bounds) -> Self {
        Self {
            program,
            bounds,
            field: PrunedField::new(program),
            nodes: vec![Node {
                cell: (0, [0; 3]),
                parent: ROOT,
                first_part: 0,
                state: NodeState::NotEvaluated,
            }],
            inside_points: Vec::new(),
            max_boxes: (MAX_INSTRUCTIONS / program.code.len().max(1)).clamp(MIN_BOXES, MAX_BOXES),
            is_incomplete: false,
        }
    }

    /// Reports whether the box is proved empty.
    fn is_empty(&self) -> bool {
        let mut pending = vec![ROOT];
        while let Some(node) = pending.pop() {
            let Node {
                state, first_part, ..
            } = &self.nodes[node];
            match state {
                NodeState::Empty => {}
                NodeState::Undecided(..) if *first_part > 0 => {
                    pending.extend(*first_part..first_part + PARTS);
                }
                NodeState::Undecided(..) | NodeState::NotEvaluated => return false,
            }
        }
        true
    }

    /// Returns the centres of boxes that may contain a part of the solid, found level by level.
    fn undecided_centres(&mut self) -> Vec<[f64; 3]> {
        let max_cells = MAX_START_INSTRUCTIONS / self.program.code.len().max(1);
        let max_cells = max_cells.clamp(8, MAX_STARTS);
        let mut nodes = vec![ROOT];
        loop {
            let mut next = Vec::with_capacity(nodes.len() * PARTS);
            for &node in &nodes {
                let parts = self.parts(node);
                next.extend(parts.filter(|&part| self.bound(part).is_some()));
            }
            let is_last = next
                .first()
                .is_none_or(|&node| self.nodes[node].cell.0 >= MAX_LEVEL);
            if next.len() <= max_cells && !next.is_empty() {
                nodes = next;
            }
            if is_last || nodes.len() > max_cells / 8 {
                break;
            }
        }
        let middle = |&node: &usize| self.middle(self.nodes[node].cell);
        nodes.iter().map(middle).collect()
    }

    fn extent(&mut self, direction: [f64; 3]) -> f64 {
        let candidate = |search: &Self, node: usize| {
            let cell = search.nodes[node].cell;
            Candidate {
                extent: search.upper_extent(cell, direction),
                cell,
                node,
            }
        };
        let mut queue = BinaryHeap::from([candidate(self, ROOT)]);
        let mut evaluated_boxes = 0;
        // The largest extent of points that are proved to be inside, and the number of those that were compared.
        let (mut inside_extent, mut compared) = (f64::NEG_INFINITY, 0);
        let precision = self.bounds.half_diagonal() * DVec3::from(direction).length() * PRECISION;
        while let Some(Candidate { extent, cell, node }) = queue.pop() {
            let (level, _) = cell;
            evaluated_boxes += 1;
            if evaluated_boxes > self.max_boxes {
                self.is_incomplete |= level < MAX_LEVEL;
                return extent;
            }
            let Some(bound) = self.bound(node) else {
                continue;
            };
            for point in &self.inside_points[compared..] {
                inside_extent = inside_extent.max(dot(direction, *point));
            }
            compared = self.inside_points.len();
            if extent <= inside_extent + precision {
                return extent;
            }
            let reached = self.upper_extent(cell, direction) - bound.unreached(direction);
            if reached < extent - precision * MIN_PROGRESS {
                // Other boxes may extend farther.
                queue.push(Candidate {
                    extent: reached,
                    cell,
                    node,
                });
                continue;
            }
            if level == MAX_LEVEL {
                self.is_incomplete |= !self.is_near_surface(cell);
                return extent;
            }
            let parts = self.parts(node);
            queue.extend(parts.map(|part| {
                let part = candidate(self, part);
                Candidate {
                    extent: part.extent.min(extent),
                    ..part
                }
            }));
        }
        // The box is empty: its own extent is returned.
        self.upper_extent(self.nodes[ROOT].cell, direction)
    }

    /// Reports whether the value in the middle of a box is that of a nearby surface.
    ///
    /// Intervals decide nothing where a field has discontinuities, as angles and polygons do.
    ///
    fn is_near_surface(&self, cell: SubjectCell) -> bool {
        let sides = [0, 1, 2].map(|axis| self.range(cell, axis));
        let [x, y, z] = self.middle(cell);
        let sample = gradient::<f64>(self.program, V3::new(x, y, z));
        let V3 { x, y, z } = sample.gradient;
        let slope = DVec3::new(x, y, z).length();
        let size: f64 = sides.iter().map(|side| side.hi - side.lo).sum();
        sample.value <= slope * size * MAX_SURFACE_DISTANCE
    }

    fn range(&self, (level, index): SubjectCell, axis: usize) -> Interval {
        let (low, high) = (self.bounds.min[axis], self.bounds.max[axis]);
        let side = (high - low) / f64::from(1 << level);
        let lo = low + f64::from(index[axis]) * side;
        Interval { lo, hi: lo + side }
    }

    fn middle(&self, cell: SubjectCell) -> [f64; 3] {
        [0, 1, 2].map(|axis| {
            let Interval { lo, hi } = self.range(cell, axis);
            lo + (hi - lo) / 2.0
        })
    }

    fn upper_extent(&self, cell: SubjectCell, direction: [f64; 3]) -> f64 {
        let max_product = |axis: usize| {
            let range = self.range(cell, axis);
            (direction[axis] * range.lo).max(direction[axis] * range.hi)
        };
        (0..3).map(max_product).sum()
    }

    /// Returns the parts of a box.
    fn parts(&mut self, node: usize) -> Range<usize> {
        if self.nodes[node].first_part == 0 {
            self.nodes[node].first_part = self.nodes.len();
            let parts = parts_of(self.nodes[node].cell);
            self.nodes.extend(parts.map(|cell| Node {
                cell,
                parent: node,
                first_part: 0,
                state: NodeState::NotEvaluated,
            }));
        }
        let first = self.nodes[node].first_part;
        first..first + PARTS
    }

    /// Returns bounds of the field in a box, and `None` if intervals exclude that it contains a part of the solid. The
    /// parts of its parent are evaluated together.
    fn bound(&mut self, node: usize) -> Option<LinearBound> {
        if let NodeState::NotEvaluated = self.nodes[node].state {
            self.evaluate(node);
        }
        match &self.nodes[node].state {
            NodeState::Undecided(_, bound) => Some(*bound),
            NodeState::Empty | NodeState::NotEvaluated => None,
        }
    }

    /// Evaluates a box and its siblings.
    fn evaluate(&mut self, node: usize) {
        let parent = self.nodes[node].parent;
        let siblings = match node {
            ROOT => ROOT..ROOT + 1,
            _ => self.parts(parent),
        };
        let program = match &self.nodes[parent].state {
            NodeState::Undecided(program, _) => program.clone(),
            NodeState::NotEvaluated | NodeState::Empty => self.field.root(),
        };
        let boxes = std::array::from_fn(|part| {
            let sibling = siblings.start + part.min(siblings.len() - 1);
            let [x, y, z] = [0, 1, 2].map(|axis| self.range(self.nodes[sibling].cell, axis));
            V3 { x, y, z }
        });
        for (sibling, part) in siblings.zip(self.field.parts(&program, &boxes)) {
            if part
                .as_ref()
                .is_some_and(|(_, bound)| bound.is_middle_inside)
            {
                let middle = self.middle(self.nodes[sibling].cell);
                self.inside_points.push(middle);
            }
            self.nodes[sibling].state = part.map_or(NodeState::Empty, |(program, bound)| {
                NodeState::Undecided(program, bound)
            });
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    DVec3::from(a).dot(DVec3::from(b))
}

/// Returns the eight parts of a box.
fn parts_of((level, index): SubjectCell) -> [SubjectCell; PARTS] {
    std::array::from_fn(|corner| {
        let child = [0, 1, 2].map(|axis| index[axis] * 2 + (corner as u32 >> axis & 1));
        (level + 1, child)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_vm::evaluate::evaluate_f64;
    use sdfc_vm::listing::parse;
    use sdfc_vm::real::Vector3;

    /// Returns the points where a plane crosses the edges of a box, by linear interpolation.
    fn crossings(program: &Program, bounds: &Bounds) -> Vec<[f64; 3]> {
        let corner = |index: usize| {
            [0, 1, 2].map(|axis| match index >> axis & 1 {
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

    /// The outline contains each corner that a plane cuts off a box.
    #[test]
    fn small_corners_are_within_the_outline() {
        // `sdfc-trials` depends on this crate, so its generator cannot be used here.
        let mut state = 3_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1 << 30) - 1.0
        };
        let mut tried = 0;
        for _ in 0..200 {
            let normal = V3::new(random(), random(), random()).normalize();
            let V3 { x, y, z } = normal;
            let listing = format!("0000 plane [{x:?}, {y:?}, {z:?}, {:?}]", -random());
            let program = parse(&listing).expect("a program");
            let bounds = Bounds {
                min: [0, 1, 2].map(|_| -random().abs()),
                max: [0, 1, 2].map(|_| random().abs()),
            };
            let Some(outline) = outline(&program, &bounds) else {
                assert!(crossings(&program, &bounds).is_empty(), "{listing}");
                continue;
            };
            for p in crossings(&program, &bounds) {
                tried += 1;
                for (direction, reach) in directions().into_iter().zip(outline.supports) {
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
