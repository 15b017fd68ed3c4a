//! Longer cutters where that leaves the solid as it is.
//!
//! `a - b` is the larger of a's value and the negative of b's. Where a flat face of `b` ends in a face of `a`, or
//! a little beyond it, both are small there with nothing near: offsets and shells close the hole, light sees an
//! edge that is not there, and rays take short steps. So a flat face of a cutter is moved outwards, by the size of
//! the body, if boxes prove that nothing of what is cut lies in what that adds, or intervals that another cutter
//! takes it away. The solid is the same set of points; its field is nearer to the distance.
//!
//! Walls that are straight at the face stay as they are (`straight`); those that slope are prolonged (`sloping` for
//! solids, `sketch` for polygons). A face that follows live parameters is moved where the body's outermost face
//! follows them in the same way (`live`).

mod copies;
mod cover;
mod halves;
mod inner;
mod linear;
mod live;
mod live_sketch;
mod mapped;
mod room;
mod section;
mod sketch;
mod sloping;
mod straight;

use crate::bounds::{Boxes, World, inverse};
use crate::expression::{ExprId, Expression};
use crate::scene::{Scene, ShapeId, ShapeKind, children_mut};
use crate::slope::Ranges;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::real::Vector3;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// The fractions of the body's size by which a face may be moved, the first that is possible.
const FRACTIONS: [f64; 4] = [1.0, 0.25, 0.0625, 0.015625];
/// The overlap of two boxes that counts as none, as a fraction of their coordinates: the error of sums in `f64`.
const TOUCHING: f64 = 1e-9;
/// The value that counts as zero, as a fraction of the coordinates: operations round their parameters to `f32`.
const ROUNDED: f64 = 4.0 * f32::EPSILON as f64;
/// The most boxes that are compared for a scene.
const MOST_BOXES: usize = 2_000_000;
/// The most operations on intervals that are run for a scene.
const MOST_OPERATIONS: usize = 6_000_000;

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
    let follows = |node: &Expression| matches!(node, Expression::Param(..) | Expression::Time);
    let is_live = scene.expressions.since(0).any(|(_, node, _)| follows(node));
    let mut lengthening = Lengthening {
        boxes,
        known: HashMap::new(),
        left: MOST_BOXES,
        operations: MOST_OPERATIONS,
        present: Boxes::at(0.0, HashMap::new()),
        ranges: Ranges::of(World::from(&*scene)),
        is_live,
        scene,
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
    /// The operations on intervals that may still be run.
    operations: usize,
    /// Boxes at the present values of the parameters.
    present: Boxes,
    /// The ranges of the parameters.
    ranges: Ranges,
    /// A number of the scene follows a live parameter or the time.
    is_live: bool,
}

/// A step from a part of a cutter outwards.
#[derive(Clone)]
enum Step {
    /// A map of points.
    Map(Rows),
    /// Copies by a row, or a turn that differs from point to point.
    Copies { op: Op, numbers: Vec<f64> },
    /// A turn of the plane around the y axis, after a shift along x.
    Revolve(f64),
    /// A cut to a box.
    Within(Bounds),
}

/// The body that a cutter cuts, its size, and the other cutters.
struct Cut {
    /// Absent where all of space is to be kept.
    body: Option<ShapeId>,
    size: f64,
    /// The size at the present values of the parameters.
    present_size: f64,
    /// The distance from cutters as far as which they are blended with the body.
    reach: f64,
    others: Vec<Other>,
}

/// A cutter beside the one that grows.
#[derive(Clone, Copy)]
struct Other {
    id: ShapeId,
    /// The number of steps from the body to its frame.
    depth: usize,
    /// Its box in the body's frame; all of space where several maps lead there.
    bounds: Bounds,
    /// The part that grows lies in it.
    is_grown: bool,
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
        match &mut kind {
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } if op.row().meta.set == Some(SetOperation::Subtraction) => {
                let reach = match (*op, parameters.first()) {
                    (Op::Subtraction, _) => Some(0.0),
                    // One that is exponential has no end.
                    (Op::ExponentialSubtraction, _) | (_, None) => None,
                    (_, Some(&width)) => self.scene.expressions.as_constant(width),
                };
                let (body, cutters) = children.split_at_mut(1);
                if let Some(reach) = reach {
                    self.cut(body[0], cutters, reach);
                }
            }
            ShapeKind::Combine {
                op: Op::Intersection,
                children,
                ..
            } => self.complements(id, children),
            _ => {}
        }
        self.join_inner(&mut kind);
        let new = self.with(id, kind);
        self.known.insert(id, new);
        new
    }

    /// Makes the cutters of a body longer, which are blended with it as far as `reach` away from them.
    fn cut(&mut self, body: ShapeId, cutters: &mut [ShapeId], reach: f64) {
        let within = self.cutters_within(body);
        let shapes: Vec<ShapeId> = [body].into_iter().chain(cutters.iter().copied()).collect();
        let mut cut = Cut {
            body: Some(body),
            size: size_of(&shapes, |id| self.bounds(id)),
            present_size: size_of(&shapes, |id| self.present.of(World::from(&*self.scene), id)),
            reach,
            others: Vec::new(),
        };
        self.cutters(cutters, &mut Vec::new(), &mut cut, &within);
        if self.is_live && reach == 0.0 {
            for cutter in cutters {
                *cutter = self.followed(*cutter, &mut Vec::new(), &cut);
            }
        }
    }

    /// Makes the complements in an intersection longer: each cuts what the others have in common.
    fn complements(&mut self, id: ShapeId, children: &mut [ShapeId]) {
        let inner = |this: &Self, child: ShapeId| match this.kind(child) {
            ShapeKind::Distance {
                op: Op::Complement,
                child,
                ..
            } => Some(*child),
            _ => None,
        };
        let (cutters, bodies): (Vec<usize>, Vec<usize>) =
            (0..children.len()).partition(|&at| inner(self, children[at]).is_some());
        let mut inside: Vec<ShapeId> = cutters
            .iter()
            .filter_map(|&at| inner(self, children[at]))
            .collect();
        let bodies: Vec<ShapeId> = bodies.into_iter().map(|at| children[at]).collect();
        let body = match (bodies.as_slice(), inside.is_empty()) {
            (_, true) | ([], _) => return,
            ([body], _) => *body,
            _ => {
                let mut kind = self.kind(id).clone();
                if let ShapeKind::Combine { children, .. } = &mut kind {
                    *children = bodies;
                }
                self.scene.derived(id, kind)
            }
        };
        self.cut(body, &mut inside, 0.0);
        for (at, cutter) in cutters.into_iter().zip(inside) {
            let mut kind = self.kind(children[at]).clone();
            for child in children_mut(&mut kind) {
                *child = cutter;
            }
            children[at] = self.with(children[at], kind);
        }
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
        self.scene.derived(id, kind)
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

    /// Cutters with longer parts, each beside all others and those in `more`.
    fn cutters(
        &mut self,
        cutters: &mut [ShapeId],
        path: &mut Vec<Step>,
        cut: &mut Cut,
        more: &[ShapeId],
    ) {
        let rows = rows_of(path);
        let first = cut.others.len();
        for &id in cutters.iter().chain(more) {
            let bounds = match &rows {
                Some(rows) => self.bounds(id).mapped(rows),
                None => Bounds::EVERYTHING,
            };
            cut.others.push(Other {
                id,
                depth: path.len(),
                bounds,
                is_grown: false,
            });
        }
        for (at, cutter) in cutters.iter_mut().enumerate() {
            cut.others[first + at].is_grown = true;
            *cutter = self.cutter(*cutter, path, cut);
            cut.others[first + at].is_grown = false;
        }
        cut.others.truncate(first);
    }

    /// A cutter with longer parts; `path` leads from it to what is cut, the last step first.
    fn cutter(&mut self, id: ShapeId, path: &mut Vec<Step>, cut: &mut Cut) -> ShapeId {
        let mut kind = self.kind(id).clone();
        let step = match &mut kind {
            // A blend reaches beyond what bounds a part of such cutters.
            ShapeKind::Combine {
                op: Op::Intersection | Op::Subtraction,
                ..
            }
            | ShapeKind::Domain { .. }
                if cut.reach > 0.0 =>
            {
                return id;
            }
            ShapeKind::Distance { .. } if cut.reach > 0.0 => return self.longer(id, path, cut),
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } => {
                self.cutters(children, path, cut, &[]);
                return self.with(id, kind);
            }
            ShapeKind::Combine {
                op: Op::Intersection,
                children,
                ..
            } => {
                // One after the other: what is added to one is cut to what the others are by then.
                for at in 0..children.len() {
                    let others = (0..children.len()).filter(|&other| other != at);
                    let others: Vec<ShapeId> = others.map(|other| children[other]).collect();
                    children[at] = self.opened(children[at], &others, path, cut);
                    let within = others
                        .iter()
                        .map(|&other| self.bounds(other))
                        .fold(Bounds::EVERYTHING, |common, own| common.common(&own));
                    path.push(Step::Within(within));
                    children[at] = self.cutter(children[at], path, cut);
                    path.pop();
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
            ShapeKind::Primitive { .. } => {
                let id = self.longer(id, path, cut);
                return match cut.reach > 0.0 {
                    true => id,
                    false => self.farther(id, path, cut),
                };
            }
            ShapeKind::Polygon { .. } if cut.reach > 0.0 => return id,
            ShapeKind::Polygon { .. } => return self.wider(id, path, cut),
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
                op: op @ (Op::Mirror | Op::Twist),
                parameters,
                ..
            } => {
                let Some(numbers) = self.constants(parameters) else {
                    return id;
                };
                Some(Step::Copies { op: *op, numbers })
            }
            ShapeKind::Domain {
                op: Op::Revolve | Op::RevolvePart,
                parameters,
                ..
            } => match self.scene.expressions.as_constant(parameters[0]) {
                Some(offset) => Some(Step::Revolve(offset)),
                None => return id,
            },
            // What the ends of a turn cut off is not left out.
            ShapeKind::Distance {
                op: Op::RevolveClose,
                ..
            } => None,
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
}

/// The map from the frame in which a path begins to that where it ends, if it is one map.
fn rows_of(path: &[Step]) -> Option<Rows> {
    path.iter().rev().try_fold(SAME, |rows, step| match step {
        Step::Map(map) => Some(composed(map, &rows)),
        Step::Copies { .. } | Step::Revolve(_) | Step::Within(_) => None,
    })
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

/// The size of a body; of the largest of its cutters, which follow it, where the body has no end.
fn size_of(shapes: &[ShapeId], mut bounds: impl FnMut(ShapeId) -> Bounds) -> f64 {
    let mut sizes = shapes.iter().map(|&id| size(&bounds(id)));
    match sizes.next() {
        Some(body) if body.is_finite() => body,
        _ => sizes.fold(f64::NEG_INFINITY, f64::max),
    }
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
        Step::Copies { .. } | Step::Revolve(_) | Step::Within(_) => 1.0,
    };
    path.iter().map(volume).product::<f64>().cbrt()
}
