//! Cutters that depend on live parameters in the same way as the body.
//!
//! A face of a cutter is moved outwards if it is at or beyond the body's outermost face on that side. The
//! condition must hold for all values of the parameters. Both positions are linear forms of the parameters. A
//! plate of the height `h` and a cutter of that height end in the same plane, whatever `h` is.
//!
//! Between cutter and body may be a blend of any width. All of the body lies behind the face. There, the walls of the
//! cutter are straight, so its values outside of it stay the same. Inside of it they decrease. No blend kernel for
//! subtractions is less than the larger one of its operands, so these points and those beyond the face stay empty.

use super::linear::LinearForm;
use super::{CutContext, CutterExtension, TOUCH_TOLERANCE};
use crate::expression::ExprId;
use crate::scene::{ShapeId, ShapeKind, children_mut};
use sdfc_vm::row::{AxisExtent, BoundsRule, SetOperation};
use sdfc_vm::table::Op;

/// A side of a shape: an axis of its frame, and 1 or −1.
type Side = (usize, f64);

/// Fraction of the extension from which a face counts as protruding already.
const MAX_PROTRUSION: f64 = 0.25;

/// A step from a part of a cutter outwards that keeps axes separate.
#[derive(Clone, Copy)]
pub(super) enum AxisStep {
    /// A matrix that maps outer to inner points.
    Frame([ExprId; 12]),
    /// Copies along the marked axes. Faces across the other axes keep their positions.
    Copies([bool; 3]),
}

impl CutterExtension<'_> {
    /// Moves the faces of a cutter outwards that are flush with those of the body. Recursion over nested
    /// shapes, whose depth the elaborator bounds; the same holds for the functions below.
    pub(super) fn extend_live_cutter(
        &mut self,
        id: ShapeId,
        path: &mut Vec<AxisStep>,
        cut: &CutContext,
    ) -> ShapeId {
        let mut kind = self.kind(id).clone();
        let step = match &kind {
            ShapeKind::Combine { op: Op::Union, .. } | ShapeKind::Painted { .. } => None,
            ShapeKind::Frame { matrix, .. } => Some(AxisStep::Frame(*matrix)),
            ShapeKind::Polar { op, .. } => Some(AxisStep::Copies(match op {
                Op::Polar => [true, false, true],
                _ => [true, true, false],
            })),
            ShapeKind::Repeat { parameters, .. } => {
                let spacing =
                    [0, 1, 2].map(|axis| self.scene.expressions.as_constant(parameters[axis]));
                Some(AxisStep::Copies(
                    spacing.map(|spacing| spacing != Some(0.0)),
                ))
            }
            // A rotation about the y axis keeps the positions of faces across it.
            ShapeKind::Domain {
                op: Op::Revolve | Op::RevolvePart | Op::Twist,
                ..
            } => Some(AxisStep::Copies([true, false, true])),
            ShapeKind::Distance {
                op: Op::RevolveClose,
                ..
            } => None,
            ShapeKind::Polygon { .. } => return self.extend_live_polygon(id, path, cut),
            ShapeKind::Distance {
                op: Op::Extrude, ..
            } => None,
            ShapeKind::Primitive { .. } => return self.extend_live_faces(id, path, cut),
            _ => return id,
        };
        let steps = path.len();
        path.extend(step);
        for child in children_mut(&mut kind) {
            *child = self.extend_live_cutter(*child, path, cut);
        }
        path.truncate(steps);
        let id = self.with_kind(id, kind);
        match self.kind(id) {
            ShapeKind::Distance {
                op: Op::Extrude, ..
            } => self.extend_live_faces(id, path, cut),
            _ => id,
        }
    }

    /// Moves the faces of a part outwards that are flush with those of the body.
    fn extend_live_faces(&mut self, id: ShapeId, path: &[AxisStep], cut: &CutContext) -> ShapeId {
        let max_step = cut.current_size;
        if !max_step.is_finite() || max_step <= 0.0 {
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
        for flat in op.row().facts.flats {
            let half_extent = LinearForm::from_expr(&self.scene.expressions, parameters[flat.half]);
            let mut shifts = [0.0; 2];
            for (side, shifts) in [-1.0, 1.0].into_iter().zip(&mut shifts) {
                if let Some((face, side, scale)) =
                    self.face_in_body_frame((flat.axis, side), &half_extent, path)
                    && let Some(extent) = cut.body.and_then(|body| self.extent_on_side(body, side))
                    && self.is_flush_with(&face.plus_scaled(&extent, -1.0), max_step)
                {
                    *shifts = max_step * scale;
                }
            }
            if shifts != [0.0; 2] {
                let expressions = &mut self.scene.expressions;
                let growth = expressions.constant((shifts[0] + shifts[1]) / 2.0);
                parameters[flat.half] = expressions.call(Op::Add, &[parameters[flat.half], growth]);
                centre[flat.axis] = (shifts[1] - shifts[0]) / 2.0;
                is_longer = true;
            }
        }
        if !is_longer {
            return id;
        }
        let child = self.scene.derived(id, kind);
        self.translated(id, child, centre)
    }

    /// Returns the position of a face in the body's frame. It consists of its distance from the origin, its side,
    /// and the units of the part's frame per unit of the body's.
    pub(super) fn face_in_body_frame(
        &self,
        (mut axis, mut side): Side,
        half_extent: &LinearForm,
        path: &[AxisStep],
    ) -> Option<(LinearForm, Side, f64)> {
        let mut face = half_extent.clone();
        let mut scale = 1.0;
        for step in path.iter().rev() {
            match step {
                AxisStep::Frame(matrix) => {
                    let (outer, factor) = self.outer_axis(matrix, axis)?;
                    let shift =
                        LinearForm::from_expr(&self.scene.expressions, matrix[4 * axis + 3]);
                    face = face.plus_scaled(&shift, -side).scaled(1.0 / factor.abs());
                    side *= factor.signum();
                    scale *= factor.abs();
                    axis = outer;
                }
                AxisStep::Copies(has_copies) => {
                    if has_copies[axis] {
                        return None;
                    }
                }
            }
        }
        Some((face, (axis, side), scale))
    }

    /// Returns the outer axis that a matrix maps to an inner one, with the factor, if the matrix keeps axes
    /// separate.
    fn outer_axis(&self, matrix: &[ExprId; 12], inner: usize) -> Option<(usize, f64)> {
        let value = |row: usize, column: usize| {
            self.scene.expressions.as_constant(matrix[4 * row + column])
        };
        let mut match_ = None;
        for column in 0..3 {
            let factor = value(inner, column)?;
            if factor.abs() > TOUCH_TOLERANCE {
                if match_.is_some() {
                    return None;
                }
                match_ = Some((column, factor));
            }
        }
        let (outer, factor) = match_?;
        let others = (0..3).filter(|&row| row != inner);
        let mut is_alone = true;
        for row in others {
            is_alone &= value(row, outer)?.abs() <= TOUCH_TOLERANCE;
        }
        is_alone.then_some((outer, factor))
    }

    /// Returns an upper bound of the extent of a shape on a side of its frame.
    pub(super) fn extent_on_side(&mut self, id: ShapeId, side: Side) -> Option<LinearForm> {
        let (axis, sign) = side;
        let by_box = |extension: &mut Self| {
            let bounds = extension.bounds(id);
            let extent = if sign > 0.0 {
                bounds.max[axis]
            } else {
                -bounds.min[axis]
            };
            extent.is_finite().then(|| LinearForm::constant(extent))
        };
        match self.kind(id).clone() {
            ShapeKind::Primitive {
                op: Op::Plane,
                parameters,
            } => {
                let [x, y, z, offset] = parameters.as_slice() else {
                    return None;
                };
                let normal = [x, y, z].map(|&id| self.scene.expressions.as_constant(id));
                let is_across = (0..3)
                    .all(|other| normal[other] == Some(if other == axis { sign } else { 0.0 }));
                is_across.then(|| LinearForm::from_expr(&self.scene.expressions, *offset))
            }
            ShapeKind::Primitive { op, parameters } => {
                let form = |&index: &usize| {
                    LinearForm::from_expr(&self.scene.expressions, parameters[index])
                };
                match op.row().facts.bounds {
                    BoundsRule::Centred(extents) => match extents[axis] {
                        AxisExtent::Sum(indices) => {
                            let sum =
                                |sum: LinearForm, next: LinearForm| sum.plus_scaled(&next, 1.0);
                            indices.iter().map(form).reduce(sum)
                        }
                        AxisExtent::Largest(indices) => {
                            self.largest_of(indices.iter().map(form).collect())
                        }
                        AxisExtent::Function(_) | AxisExtent::Infinite => by_box(self),
                    },
                    _ => by_box(self),
                }
            }
            ShapeKind::Polygon { points } => {
                if axis == 2 {
                    return None;
                }
                let expressions = &self.scene.expressions;
                let coordinate = |point: &[ExprId; 2]| {
                    LinearForm::from_expr(expressions, point[axis]).scaled(sign)
                };
                self.largest_of(points.iter().map(coordinate).collect())
            }
            ShapeKind::Domain {
                op: op @ (Op::Revolve | Op::RevolvePart | Op::Twist),
                child,
                parameters,
            } => match axis {
                1 => self.extent_on_side(child, side),
                _ if op == Op::Twist => by_box(self),
                _ => {
                    let offset = LinearForm::from_expr(&self.scene.expressions, parameters[0]);
                    Some(
                        self.extent_on_side(child, (0, 1.0))?
                            .plus_scaled(&offset, 1.0),
                    )
                }
            },
            ShapeKind::Polar { op, child, .. } if axis == if op == Op::Polar { 1 } else { 2 } => {
                self.extent_on_side(child, side)
            }
            ShapeKind::Distance {
                op: Op::RevolveClose,
                child,
                ..
            } => self.extent_on_side(child, side),
            ShapeKind::Distance {
                op: op @ (Op::Extrude | Op::RoundedExtrude),
                child,
                parameters,
            } => match axis {
                2 if op == Op::Extrude => Some(LinearForm::from_expr(
                    &self.scene.expressions,
                    parameters[0],
                )),
                2 => by_box(self),
                _ => self.extent_on_side(child, side),
            },
            ShapeKind::Painted { child, .. } => self.extent_on_side(child, side),
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
                let inner_extent = self.extent_on_side(child, (inner, inner_side))?;
                let shift = LinearForm::from_expr(&self.scene.expressions, matrix[4 * inner + 3]);
                Some(
                    inner_extent
                        .plus_scaled(&shift, -inner_side)
                        .scaled(1.0 / factor.abs()),
                )
            }
            ShapeKind::Combine { op, children, .. } => {
                match op.row().facts.set {
                    // A blend may extend beyond its operands.
                    Some(SetOperation::Union) if op != Op::Union => by_box(self),
                    Some(SetOperation::Union) => {
                        let extents: Option<Vec<LinearForm>> = children
                            .iter()
                            .map(|&child| self.extent_on_side(child, side))
                            .collect();
                        self.largest_of(extents?)
                    }
                    Some(SetOperation::Subtraction) => self.extent_on_side(children[0], side),
                    Some(SetOperation::Intersection) => children
                        .iter()
                        .find_map(|&child| self.extent_on_side(child, side)),
                    None => by_box(self),
                }
            }
            _ => by_box(self),
        }
    }

    /// Returns the largest of linear forms, if it is the same one for all values of the parameters.
    fn largest_of(&self, candidates: Vec<LinearForm>) -> Option<LinearForm> {
        let is_farther = |a: &LinearForm, b: &LinearForm| {
            self.min_value(&a.clone().plus_scaled(b, -1.0)) >= -TOUCH_TOLERANCE
        };
        let largest = candidates
            .iter()
            .reduce(|best, next| if is_farther(next, best) { next } else { best })?;
        let is_largest = candidates.iter().all(|b| is_farther(largest, b));
        is_largest.then(|| largest.clone())
    }

    /// Returns a lower bound of a linear form over all values of the parameters.
    pub(super) fn min_value(&self, sum: &LinearForm) -> f64 {
        sum.range(|id| self.ranges.number(&self.scene.expressions, id))
            .lo
    }

    /// Reports whether a face is at or beyond another one, but at a minimum distance below the protrusion
    /// limit.
    pub(super) fn is_flush_with(&self, distance: &LinearForm, max_step: f64) -> bool {
        let min_distance = self.min_value(distance);
        min_distance >= -TOUCH_TOLERANCE * max_step && min_distance < MAX_PROTRUSION * max_step
    }
}
