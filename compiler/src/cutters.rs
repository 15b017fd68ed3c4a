//! Longer cutters where that leaves the solid as it is.
//!
//! `a - b` is the larger of a's value and the negative of b's. Where a flat face of `b` ends in a face of `a`, or
//! a little beyond it, both are small there with nothing near: offsets and shells close the hole, light sees an
//! edge that is not there, and rays take short steps. So a flat face of a cutter is moved outwards, by the size of
//! the body, if boxes prove that nothing of what is cut lies in what that adds, or intervals that another cutter
//! takes it away. The solid is the same set of points; its field is nearer to the distance.
//!
//! Numbers that follow live parameters are not looked at: a face that moves stays where it is.

use crate::bounds::{Boxes, World, inverse};
use crate::expression::ExprId;
use crate::scene::{Scene, Shape, ShapeId, ShapeKind, children_mut};
use crate::shape_range::ShapeRange;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Vector3;
use sdfc_vm::row::BoundsRule;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// The fractions of the body's size by which a face may be moved, the first that is possible.
const FRACTIONS: [f64; 4] = [1.0, 0.25, 0.0625, 0.015625];
/// The overlap of two boxes that counts as none, as a fraction of their coordinates: the error of sums in `f64`.
const TOUCHING: f64 = 1e-9;
/// The most boxes that are compared for a scene.
const MOST_BOXES: usize = 2_000_000;

/// Rows of a map of points: three factors and a shift.
type Rows = [[f64; 4]; 3];

const SAME: Rows = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
];

/// The shape with longer cutters: the same one where nothing changes, else a new one behind all others.
pub fn lengthened(scene: &mut Scene, root: ShapeId) -> ShapeId {
    lengthened_within(scene, &mut Boxes::lasting(), root)
}

/// The same with boxes that are known.
pub(crate) fn lengthened_within(scene: &mut Scene, boxes: &mut Boxes, root: ShapeId) -> ShapeId {
    let mut lengthening = Lengthening {
        scene,
        boxes,
        known: HashMap::new(),
        left: MOST_BOXES,
    };
    lengthening.all(root)
}

struct Lengthening<'s> {
    scene: &'s mut Scene,
    boxes: &'s mut Boxes,
    /// The shapes that were looked at, and what they became.
    known: HashMap<ShapeId, ShapeId>,
    /// The boxes that may still be compared.
    left: usize,
}

/// A step from a part of a cutter outwards.
#[derive(Clone)]
enum Step {
    /// A map of points.
    Map(Rows),
    /// Copies by a row.
    Copies { op: Op, numbers: Vec<f64> },
    /// A cut to a box.
    Within(Bounds),
}

/// The body that a cutter cuts, its size, and the other cutters.
struct Cut {
    body: ShapeId,
    size: f64,
    others: Vec<ShapeId>,
}

impl Lengthening<'_> {
    /// A shape with all cutters in it longer. Recursion over shapes within shapes, whose depth the elaborator
    /// bounds; so are those below.
    fn all(&mut self, id: ShapeId) -> ShapeId {
        if let Some(&known) = self.known.get(&id) {
            return known;
        }
        let mut kind = self.kind(id).clone();
        for child in children_mut(&mut kind) {
            *child = self.all(*child);
        }
        if let ShapeKind::Combine {
            op: Op::Subtraction,
            children,
            ..
        } = &mut kind
        {
            let cutters = self.cutters_within(children[0]);
            let size = size(&self.bounds(children[0]));
            let original = children.clone();
            for (at, child) in children.iter_mut().enumerate().skip(1) {
                let beside = (1..original.len()).filter(|&other| other != at);
                let beside = beside.map(|other| original[other]);
                let cut = Cut {
                    body: original[0],
                    size,
                    others: beside.chain(cutters.iter().copied()).collect(),
                };
                *child = self.cutter(*child, &mut Vec::new(), &cut);
            }
        }
        let new = self.with(id, kind);
        self.known.insert(id, new);
        new
    }

    fn kind(&self, id: ShapeId) -> &ShapeKind {
        &self.scene.shapes[id.0 as usize].kind
    }

    /// The shape of a kind: the same one where its operands are.
    fn with(&mut self, id: ShapeId, mut kind: ShapeKind) -> ShapeId {
        let mut old = self.kind(id).clone();
        if children_mut(&mut old) == children_mut(&mut kind) {
            return id;
        }
        self.pushed(id, kind)
    }

    /// A new shape, with the name and the text of another one.
    fn pushed(&mut self, like: ShapeId, kind: ShapeKind) -> ShapeId {
        let shape = self.scene.shapes[like.0 as usize].clone();
        self.scene.shapes.push(Shape { kind, ..shape });
        ShapeId(self.scene.shapes.len() as u32 - 1)
    }

    /// The cutters of a body that was cut before.
    fn cutters_within(&self, mut body: ShapeId) -> Vec<ShapeId> {
        let mut found = Vec::new();
        loop {
            match self.kind(body) {
                ShapeKind::Painted { child, .. } => body = *child,
                ShapeKind::Combine {
                    op: Op::Subtraction,
                    children,
                    ..
                } => {
                    found.extend(&children[1..]);
                    body = children[0];
                }
                _ => return found,
            }
        }
    }

    /// A cutter with longer parts; `path` leads from it to what is cut, the last step first.
    fn cutter(&mut self, id: ShapeId, path: &mut Vec<Step>, cut: &Cut) -> ShapeId {
        let mut kind = self.kind(id).clone();
        let step = match &mut kind {
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } => {
                for child in children {
                    *child = self.cutter(*child, path, cut);
                }
                return self.with(id, kind);
            }
            ShapeKind::Combine {
                op: Op::Subtraction,
                children,
                ..
            } => {
                children[0] = self.cutter(children[0], path, cut);
                return self.with(id, kind);
            }
            ShapeKind::Primitive { .. } => return self.longer(id, path, cut),
            ShapeKind::Painted { .. } => None,
            ShapeKind::Frame { matrix, .. } => match self.constants(matrix) {
                Some(matrix) => match inverse(&matrix) {
                    Some(rows) => Some(Step::Map(rows)),
                    None => return id,
                },
                None => return id,
            },
            ShapeKind::Repeat { op, parameters, .. }
            | ShapeKind::Polar { op, parameters, .. }
            | ShapeKind::Domain {
                op: op @ Op::Mirror,
                parameters,
                ..
            } => {
                let Some(numbers) = self.constants(parameters) else {
                    return id;
                };
                Some(Step::Copies { op: *op, numbers })
            }
            ShapeKind::Distance {
                op: Op::Extrude | Op::RoundedExtrude,
                ..
            } => {
                let mut within = Bounds::EVERYTHING;
                let own = self.bounds(id);
                (within.min[2], within.max[2]) = (own.min[2], own.max[2]);
                Some(Step::Within(within))
            }
            _ => return id,
        };
        let steps = path.len();
        path.extend(step);
        for child in children_mut(&mut kind) {
            *child = self.cutter(*child, path, cut);
        }
        path.truncate(steps);
        let id = self.with(id, kind);
        match self.kind(id) {
            ShapeKind::Distance { .. } => self.longer(id, path, cut),
            _ => id,
        }
    }

    fn constants(&self, ids: &[ExprId]) -> Option<Vec<f64>> {
        let expressions = &self.scene.expressions;
        ids.iter().map(|&id| expressions.as_constant(id)).collect()
    }

    fn bounds(&mut self, id: ShapeId) -> Bounds {
        self.boxes.of(World::from(&*self.scene), id)
    }

    /// A shape whose flat faces stand farther out where that is possible.
    fn longer(&mut self, id: ShapeId, path: &[Step], cut: &Cut) -> ShapeId {
        let mut kind = self.kind(id).clone();
        let (ShapeKind::Primitive { op, parameters } | ShapeKind::Distance { op, parameters, .. }) =
            &mut kind
        else {
            return id;
        };
        let plane = self.scene.shapes[id.0 as usize].plane;
        let mut own = self.bounds(id);
        let mut centre = [0.0; 3];
        let out = cut.size / scale(path);
        if !out.is_finite() {
            return id;
        }
        for flat in op.row().meta.flats {
            let half = parameters[flat.half];
            if self.scene.expressions.as_constant(half).is_none() {
                continue;
            }
            let mut sides = (0..3).filter(|&axis| !(plane && axis == 2));
            if !sides.all(|axis| own.min[axis] < own.max[axis] && own.min[axis].is_finite()) {
                continue;
            }
            let before = own;
            for upper in [true, false] {
                let by = self.room(&own, (flat.axis, upper), out, path, cut);
                let side = match upper {
                    true => &mut own.max[flat.axis],
                    false => &mut own.min[flat.axis],
                };
                *side += if upper { by } else { -by };
            }
            if own != before {
                let (low, high) = (own.min[flat.axis], own.max[flat.axis]);
                centre[flat.axis] = (low + high) / 2.0;
                parameters[flat.half] = self.scene.expressions.constant((high - low) / 2.0);
            }
        }
        if centre == [0.0; 3] && own == self.bounds(id) {
            return id;
        }
        let child = self.pushed(id, kind);
        let mut number = |value: f64| self.scene.expressions.constant(value);
        let matrix = std::array::from_fn(|at| match (at / 4, at % 4) {
            (row, 3) => number(-centre[row]),
            (row, column) => number(f64::from(u8::from(row == column))),
        });
        let scale = number(1.0);
        let kind = ShapeKind::Frame {
            child,
            matrix,
            scale,
        };
        self.pushed(id, kind)
    }

    /// The length by which a face of a box can be moved out, at most `out`; none where it stands out as much.
    fn room(
        &mut self,
        own: &Bounds,
        (axis, upper): (usize, bool),
        out: f64,
        path: &[Step],
        cut: &Cut,
    ) -> f64 {
        let at = if upper { own.max[axis] } else { own.min[axis] };
        let between = |a: f64, b: f64| {
            let mut added = *own;
            (added.min[axis], added.max[axis]) = (a.min(b), a.max(b));
            added
        };
        let way = if upper { out } else { -out };
        let is_long = own.max[axis] - own.min[axis] > out;
        if is_long && self.is_free(&between(at - way, at), path, cut) {
            return 0.0;
        }
        let possible = FRACTIONS
            .into_iter()
            .find(|fraction| self.is_free(&between(at, at + way * fraction), path, cut));
        possible.map_or(0.0, |fraction| out * fraction)
    }

    /// Tells if nothing is left in a box of a part's frame, by which the part grew.
    fn is_free(&mut self, added: &Bounds, path: &[Step], cut: &Cut) -> bool {
        let (mut rows, mut added) = (SAME, *added);
        for step in path.iter().rev() {
            match step {
                Step::Map(map) => rows = composed(map, &rows),
                // The box of all copies: one that grew into the others' cells is not clear.
                Step::Copies { op, numbers } => {
                    let BoundsRule::Map(rule) = op.row().meta.bounds else {
                        return false;
                    };
                    added = rule(numbers, &added.mapped(&rows));
                    rows = SAME;
                }
                Step::Within(within) => {
                    added = added.mapped(&rows).common(within);
                    rows = SAME;
                }
            }
        }
        let Some(back) = inverse(rows.as_flattened()) else {
            return false;
        };
        if self.is_clear(cut.body, &back, &added) {
            return true;
        }
        let outside = added.mapped(&rows);
        cut.others
            .iter()
            .any(|&other| self.is_filled(other, &outside))
    }

    /// Tells if boxes prove that nothing of a shape is in a box; `rows` lead from its frame to that of the box.
    fn is_clear(&mut self, id: ShapeId, rows: &Rows, region: &Bounds) -> bool {
        let Some(left) = self.left.checked_sub(1) else {
            return false;
        };
        self.left = left;
        let own = self.bounds(id);
        if own.is_empty() || are_apart(&own.mapped(rows), region) {
            return true;
        }
        match self.kind(id).clone() {
            ShapeKind::Painted { child, .. } => self.is_clear(child, rows, region),
            ShapeKind::Frame { child, matrix, .. } => {
                let rows_of_child = self.constants(&matrix).and_then(|matrix| inverse(&matrix));
                rows_of_child
                    .is_some_and(|inner| self.is_clear(child, &composed(rows, &inner), region))
            }
            ShapeKind::Combine { op, children, .. } => {
                let mut clear = |child: ShapeId| self.is_clear(child, rows, region);
                match op {
                    Op::Union => children.into_iter().all(clear),
                    Op::Intersection => children.into_iter().any(clear),
                    Op::Subtraction => clear(children[0]),
                    _ => false,
                }
            }
            _ => false,
        }
    }

    /// Tells if intervals prove that a shape fills a box.
    fn is_filled(&mut self, id: ShapeId, region: &Bounds) -> bool {
        let own = self.bounds(id);
        let holds = (0..3).all(|axis| {
            let slack = slack(&own, region, axis);
            own.min[axis] <= region.min[axis] + slack && own.max[axis] >= region.max[axis] - slack
        });
        if !holds || self.left == 0 {
            return false;
        }
        self.left -= 1;
        let largest = (0..3).fold(0.0, |most: f64, axis| most.max(slack(&own, region, axis)));
        let expressions = &self.scene.expressions;
        let mut uniform = |id| {
            expressions
                .as_constant(id)
                .map_or(Interval::ALL, Interval::point)
        };
        let mut range = ShapeRange::new(World::from(&*self.scene), &mut uniform);
        range.over(id, region).hi <= largest
    }
}

/// The map of points that is one after the other.
fn composed(outer: &Rows, inner: &Rows) -> Rows {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let shift = if column == 3 { outer[row][3] } else { 0.0 };
            let sum: f64 = (0..3).map(|i| outer[row][i] * inner[i][column]).sum();
            sum + shift
        })
    })
}

/// The longest side of a box, but for the axes along which it has no end.
fn size(bounds: &Bounds) -> f64 {
    let sides = (0..3).map(|axis| bounds.max[axis] - bounds.min[axis]);
    let finite = sides.filter(|side| side.is_finite());
    finite.fold(f64::NEG_INFINITY, f64::max)
}

/// The length outside of what is one long within.
fn scale(path: &[Step]) -> f64 {
    let volume = |step: &Step| match step {
        Step::Map(rows) => {
            let columns =
                [0, 1, 2].map(|column| V3::of(rows[0][column], rows[1][column], rows[2][column]));
            columns[0].cross(columns[1]).dot(columns[2]).abs()
        }
        Step::Copies { .. } | Step::Within(_) => 1.0,
    };
    path.iter().map(volume).product::<f64>().cbrt()
}

/// The overlap of two boxes along an axis that counts as none.
fn slack(a: &Bounds, b: &Bounds, axis: usize) -> f64 {
    let ends = [a.min[axis], a.max[axis], b.min[axis], b.max[axis]];
    let finite = ends.into_iter().filter(|end| end.is_finite());
    TOUCHING * finite.fold(0.0, |most: f64, end| most.max(end.abs()))
}

/// Tells if two boxes have no more than faces in common.
fn are_apart(a: &Bounds, b: &Bounds) -> bool {
    (0..3).any(|axis| {
        let slack = slack(a, b, axis);
        a.min[axis] + slack >= b.max[axis] || a.max[axis] - slack <= b.min[axis]
    })
}
