//! Cutters that follow live parameters as what they cut does.
//!
//! A face of a cutter that stands no nearer than the outermost face of the body on that side, for all values of
//! the parameters, is moved outwards. Both are sums of multiples of the parameters: a plate of the height `h`
//! and a cutter of that height end in the same plane, whatever `h` is.

use super::linear::Linear;
use super::{Cut, Lengthening, TOUCHING};
use crate::expression::ExprId;
use crate::scene::{ShapeId, ShapeKind, children_mut};
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;

/// A side of a shape: an axis of its frame, and 1 or −1.
type Side = (usize, f64);

/// The share of the way by which a face is moved at which it counts as standing out already.
const STANDS_OUT: f64 = 0.25;

/// A step from a part of a cutter outwards that keeps axes apart.
#[derive(Clone, Copy)]
pub(super) enum Turn {
    /// A matrix from the outer to the inner point.
    Frame([ExprId; 12]),
    /// Copies, whose faces across the other axes stay where they are.
    Copies([bool; 3]),
}

impl Lengthening<'_> {
    /// A cutter whose faces that follow those of the body stand farther out. Recursion over shapes within shapes,
    /// whose depth the elaborator bounds; so are those below.
    pub(super) fn followed(&mut self, id: ShapeId, path: &mut Vec<Turn>, cut: &Cut) -> ShapeId {
        let mut kind = self.kind(id).clone();
        let turn = match &kind {
            ShapeKind::Combine { op: Op::Union, .. } | ShapeKind::Painted { .. } => None,
            ShapeKind::Frame { matrix, .. } => Some(Turn::Frame(*matrix)),
            ShapeKind::Polar { op, .. } => Some(Turn::Copies(match op {
                Op::Polar => [true, false, true],
                _ => [true, true, false],
            })),
            ShapeKind::Repeat { parameters, .. } => {
                let spacing =
                    [0, 1, 2].map(|axis| self.scene.expressions.as_constant(parameters[axis]));
                Some(Turn::Copies(spacing.map(|spacing| spacing != Some(0.0))))
            }
            // A turn around the y axis leaves faces across it where they are.
            ShapeKind::Domain {
                op: Op::Revolve | Op::RevolvePart | Op::Twist,
                ..
            } => Some(Turn::Copies([true, false, true])),
            ShapeKind::Distance {
                op: Op::RevolveClose,
                ..
            } => None,
            ShapeKind::Polygon { .. } => return self.sketch_out_of(id, path, cut),
            ShapeKind::Distance {
                op: Op::Extrude, ..
            } => None,
            ShapeKind::Primitive { .. } => return self.out_of(id, path, cut),
            _ => return id,
        };
        let steps = path.len();
        path.extend(turn);
        for child in children_mut(&mut kind) {
            *child = self.followed(*child, path, cut);
        }
        path.truncate(steps);
        let id = self.with(id, kind);
        match self.kind(id) {
            ShapeKind::Distance {
                op: Op::Extrude, ..
            } => self.out_of(id, path, cut),
            _ => id,
        }
    }

    /// A part whose faces stand farther out where they follow the body's.
    fn out_of(&mut self, id: ShapeId, path: &[Turn], cut: &Cut) -> ShapeId {
        let out = cut.present_size;
        if !out.is_finite() || out <= 0.0 {
            return id;
        }
        let mut kind = self.kind(id).clone();
        let (ShapeKind::Primitive { op, parameters } | ShapeKind::Distance { op, parameters, .. }) =
            &mut kind
        else {
            return id;
        };
        let mut centre = [0.0; 3];
        let mut is_longer = false;
        for flat in op.row().meta.flats {
            let half = Linear::of(&self.scene.expressions, parameters[flat.half]);
            let mut by = [0.0; 2];
            for (side, by) in [-1.0, 1.0].into_iter().zip(&mut by) {
                if let Some((face, side, scale)) = self.outside((flat.axis, side), &half, path)
                    && let Some(reach) = cut.body.and_then(|body| self.reach(body, side))
                    && self.stands_between(&face.plus(&reach, -1.0), out)
                {
                    *by = out * scale;
                }
            }
            if by != [0.0; 2] {
                let expressions = &mut self.scene.expressions;
                let more = expressions.constant((by[0] + by[1]) / 2.0);
                parameters[flat.half] = expressions.call(Op::Add, &[parameters[flat.half], more]);
                centre[flat.axis] = (by[1] - by[0]) / 2.0;
                is_longer = true;
            }
        }
        if !is_longer {
            return id;
        }
        let child = self.scene.derived(id, kind);
        self.moved(id, child, centre)
    }

    /// The place of a face in the body's frame: its distance from the origin, its side, and the units of the part's
    /// frame per unit there.
    pub(super) fn outside(
        &self,
        (mut axis, mut side): Side,
        half: &Linear,
        path: &[Turn],
    ) -> Option<(Linear, Side, f64)> {
        let mut face = half.clone();
        let mut scale = 1.0;
        for turn in path.iter().rev() {
            match turn {
                Turn::Frame(matrix) => {
                    let (outer, factor) = self.outer_axis(matrix, axis)?;
                    let shift = Linear::of(&self.scene.expressions, matrix[4 * axis + 3]);
                    face = face.plus(&shift, -side).times(1.0 / factor.abs());
                    side *= factor.signum();
                    scale *= factor.abs();
                    axis = outer;
                }
                Turn::Copies(apart) => {
                    if apart[axis] {
                        return None;
                    }
                }
            }
        }
        Some((face, (axis, side), scale))
    }

    /// The outer axis that a matrix takes to an inner one, if it keeps axes apart, and the factor.
    fn outer_axis(&self, matrix: &[ExprId; 12], inner: usize) -> Option<(usize, f64)> {
        let value = |row: usize, column: usize| {
            self.scene.expressions.as_constant(matrix[4 * row + column])
        };
        let mut found = None;
        for column in 0..3 {
            let factor = value(inner, column)?;
            if factor.abs() > TOUCHING {
                if found.is_some() {
                    return None;
                }
                found = Some((column, factor));
            }
        }
        let (outer, factor) = found?;
        let others = (0..3).filter(|&row| row != inner);
        let mut alone = true;
        for row in others {
            alone &= value(row, outer)?.abs() <= TOUCHING;
        }
        alone.then_some((outer, factor))
    }

    /// The reach of a shape on a side of its frame, or more.
    pub(super) fn reach(&mut self, id: ShapeId, side: Side) -> Option<Linear> {
        let (axis, sign) = side;
        let by_box = |lengthening: &mut Self| {
            let own = lengthening.bounds(id);
            let end = if sign > 0.0 {
                own.max[axis]
            } else {
                -own.min[axis]
            };
            end.is_finite().then(|| Linear::constant(end))
        };
        match self.kind(id).clone() {
            ShapeKind::Primitive {
                op: Op::Plane,
                parameters,
            } => {
                let [x, y, z, at] = parameters.as_slice() else {
                    return None;
                };
                let normal = [x, y, z].map(|&id| self.scene.expressions.as_constant(id));
                let is_across = (0..3)
                    .all(|other| normal[other] == Some(if other == axis { sign } else { 0.0 }));
                is_across.then(|| Linear::of(&self.scene.expressions, *at))
            }
            ShapeKind::Primitive { op, parameters } => {
                let of = |at: &usize| Linear::of(&self.scene.expressions, parameters[*at]);
                let ends = extents(op, axis);
                match ends.is_empty() {
                    true => by_box(self),
                    false => self.farthest(ends.iter().map(of).collect()),
                }
            }
            ShapeKind::Polygon { points } => {
                if axis == 2 {
                    return None;
                }
                let expressions = &self.scene.expressions;
                let place = |point: &[ExprId; 2]| Linear::of(expressions, point[axis]).times(sign);
                self.farthest(points.iter().map(place).collect())
            }
            ShapeKind::Domain {
                op: op @ (Op::Revolve | Op::RevolvePart | Op::Twist),
                child,
                parameters,
            } => match axis {
                1 => self.reach(child, side),
                _ if op == Op::Twist => by_box(self),
                _ => {
                    let offset = Linear::of(&self.scene.expressions, parameters[0]);
                    Some(self.reach(child, (0, 1.0))?.plus(&offset, 1.0))
                }
            },
            ShapeKind::Polar { op, child, .. } if axis == if op == Op::Polar { 1 } else { 2 } => {
                self.reach(child, side)
            }
            ShapeKind::Distance {
                op: Op::RevolveClose,
                child,
                ..
            } => self.reach(child, side),
            ShapeKind::Distance {
                op: op @ (Op::Extrude | Op::RoundedExtrude),
                child,
                parameters,
            } => match axis {
                2 if op == Op::Extrude => Some(Linear::of(&self.scene.expressions, parameters[0])),
                2 => by_box(self),
                _ => self.reach(child, side),
            },
            ShapeKind::Painted { child, .. } => self.reach(child, side),
            ShapeKind::Frame { child, matrix, .. } => {
                let inner = (0..3).find(|&row| {
                    self.outer_axis(&matrix, row)
                        .is_some_and(|(outer, _)| outer == axis)
                });
                let Some(inner) = inner else {
                    return by_box(self);
                };
                let (_, factor) = self.outer_axis(&matrix, inner)?;
                let inner_side = sign * factor.signum();
                let reach = self.reach(child, (inner, inner_side))?;
                let shift = Linear::of(&self.scene.expressions, matrix[4 * inner + 3]);
                Some(reach.plus(&shift, -inner_side).times(1.0 / factor.abs()))
            }
            ShapeKind::Combine { op, children, .. } => {
                match op.row().meta.set {
                    // A blend reaches farther than its operands.
                    Some(SetOperation::Union) if op != Op::Union => by_box(self),
                    Some(SetOperation::Union) => {
                        let reaches: Option<Vec<Linear>> = children
                            .iter()
                            .map(|&child| self.reach(child, side))
                            .collect();
                        self.farthest(reaches?)
                    }
                    Some(SetOperation::Subtraction) => self.reach(children[0], side),
                    Some(SetOperation::Intersection) => {
                        children.iter().find_map(|&child| self.reach(child, side))
                    }
                    None => by_box(self),
                }
            }
            _ => by_box(self),
        }
    }

    /// The largest of sums, if it is the same one for all values of the parameters.
    fn farthest(&self, reaches: Vec<Linear>) -> Option<Linear> {
        let is_farther =
            |one: &Linear, other: &Linear| self.least(&one.clone().plus(other, -1.0)) >= -TOUCHING;
        let farthest = reaches
            .iter()
            .reduce(|best, next| if is_farther(next, best) { next } else { best })?;
        let is_known = reaches.iter().all(|other| is_farther(farthest, other));
        is_known.then(|| farthest.clone())
    }

    /// The least value of a sum, for all values of the parameters.
    pub(super) fn least(&self, sum: &Linear) -> f64 {
        sum.range(|id| self.ranges.of_number(&self.scene.expressions, id))
            .lo
    }

    /// Reports whether a face stands out by this, but not far.
    pub(super) fn stands_between(&self, by: &Linear, out: f64) -> bool {
        let least = self.least(by);
        least >= -TOUCHING * out && least < STANDS_OUT * out
    }
}

/// The positions of the numbers of a row, the largest of which is its reach on both sides of an axis.
fn extents(op: Op, axis: usize) -> &'static [usize] {
    match (op, axis) {
        (Op::Sphere, _) | (Op::Circle, 0 | 1) => &[0],
        (Op::Cylinder | Op::RoundedCylinder, 1) => &[1],
        (Op::Cylinder | Op::RoundedCylinder, _) => &[0],
        (Op::Cone, 1) => &[2],
        (Op::Cone, _) => &[0, 1],
        (Op::Pyramid, 1) => &[1],
        (Op::Pyramid, _) => &[0],
        (Op::Prism, 1) => &[4],
        (Op::Cuboid | Op::RoundedCuboid, _) | (Op::Rect | Op::RoundedRect, 0 | 1) => match axis {
            0 => &[0],
            1 => &[1],
            _ => &[2],
        },
        _ => &[],
    }
}
