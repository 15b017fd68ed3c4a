//! Symmetries of shapes that follow from how they are made: what is its own mirror image, and what is
//! round about an axis. Copies of such a shape need not be looked at beyond the nearest one.
//!
//! A symmetry that is found is one whatever the live parameters; one that is not found may still be there.

use crate::expression::{ExprId, Expressions};
use crate::scene::{Shape, ShapeId, ShapeKind};
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::row::Category;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// The shapes whose symmetries are looked for.
#[derive(Clone, Copy)]
pub(crate) struct Symmetries<'s> {
    pub(crate) shapes: &'s [Shape],
    pub(crate) expressions: &'s Expressions,
}

impl Symmetries<'_> {
    /// Whether a shape is its own mirror image in the plane across `axis` at `at`.
    pub(crate) fn mirrored(&self, id: ShapeId, axis: usize, at: f64) -> bool {
        let shape = &self.shapes[id.0 as usize];
        let own = |child: ShapeId| self.mirrored(child, axis, at);
        match &shape.kind {
            ShapeKind::Nothing => true,
            ShapeKind::Primitive { op, parameters } => {
                shape.plane && axis == 2 || at == 0.0 && self.is_even(*op, parameters, axis)
            }
            ShapeKind::Polygon { points } => axis == 2 || self.is_even_polygon(points, axis, at),
            ShapeKind::Combine { children, .. } => children.iter().all(|&child| own(child)),
            ShapeKind::Painted { child, .. } => own(*child),
            ShapeKind::Frame { child, matrix, .. } => self
                .through(matrix, axis, at)
                .is_some_and(|(axis, at)| self.mirrored(*child, axis, at)),
            ShapeKind::Repeat { child, .. } => at == 0.0 && own(*child),
            ShapeKind::Distance { op, child, .. } => match op {
                Op::Extrude | Op::RoundedExtrude if axis == 2 => at == 0.0,
                _ => own(*child),
            },
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => match op {
                Op::Mirror => {
                    at == 0.0 && (self.constant(parameters[axis]) == Some(1.0) || own(*child))
                }
                Op::Elongate | Op::ElongateCorrect => at == 0.0 && own(*child),
                Op::Slice => axis == 2 || own(*child),
                Op::Revolve => match axis {
                    1 => own(*child),
                    _ => at == 0.0,
                },
                _ => false,
            },
            ShapeKind::Polar {
                child, parameters, ..
            } => {
                let (along, across) = (0, if shape.plane { 1 } else { 2 });
                match axis {
                    _ if axis == across || axis == along => {
                        at == 0.0 && self.is_even_ring(*child, parameters[0], axis, along, across)
                    }
                    _ => own(*child),
                }
            }
            ShapeKind::Field { .. } | ShapeKind::Warp { .. } | ShapeKind::Displace { .. } => false,
        }
    }

    /// Whether copies about an axis, of this angle each, are their own mirror image across `axis`. The image
    /// of a copy that is even across the other axis is that copy on the far side.
    fn is_even_ring(
        &self,
        child: ShapeId,
        sector: ExprId,
        axis: usize,
        along: usize,
        across: usize,
    ) -> bool {
        let other = along + across - axis;
        self.mirrored(child, axis, 0.0)
            || self.mirrored(child, other, 0.0)
                && self.constant(sector).is_some_and(|sector| {
                    let half = std::f64::consts::PI / sector;
                    (half - half.round()).abs() < 1e-9
                })
    }

    /// Whether a shape is round about the y axis, or for figures about the origin.
    pub(crate) fn is_round(&self, id: ShapeId) -> bool {
        let shape = &self.shapes[id.0 as usize];
        match &shape.kind {
            ShapeKind::Nothing => true,
            ShapeKind::Primitive { op, .. } => is_turned(*op) || *op == Op::Circle,
            ShapeKind::Combine { children, .. } => children.iter().all(|&id| self.is_round(id)),
            ShapeKind::Painted { child, .. } => self.is_round(*child),
            ShapeKind::Frame { child, matrix, .. } => {
                let along = if shape.plane { 2 } else { 1 };
                let decoupled = self
                    .through(matrix, along, 0.0)
                    .is_some_and(|(axis, _)| axis == along);
                let still = (0..3)
                    .filter(|&row| row != along)
                    .all(|row| self.constant(matrix[4 * row + 3]) == Some(0.0));
                decoupled && still && self.is_round(*child)
            }
            ShapeKind::Domain {
                op: Op::Revolve, ..
            } => true,
            ShapeKind::Distance { op, child, .. } => match op {
                Op::Extrude | Op::RoundedExtrude | Op::RevolveClose => false,
                _ => self.is_round(*child),
            },
            ShapeKind::Polygon { .. }
            | ShapeKind::Domain { .. }
            | ShapeKind::Repeat { .. }
            | ShapeKind::Polar { .. }
            | ShapeKind::Field { .. }
            | ShapeKind::Warp { .. }
            | ShapeKind::Displace { .. } => false,
        }
    }

    fn constant(&self, id: ExprId) -> Option<f64> {
        self.expressions.as_constant(id)
    }

    /// The plane across `axis` at `at` as a frame sees it, where the frame keeps that axis apart from the
    /// others.
    fn through(&self, matrix: &[ExprId; 12], axis: usize, at: f64) -> Option<(usize, f64)> {
        let entry = |row: usize, column: usize| self.constant(matrix[4 * row + column]);
        let row = (0..3).find(|&row| entry(row, axis).is_some_and(|v| v != 0.0))?;
        let apart = (0..3).all(|other| {
            (other == row || entry(other, axis) == Some(0.0))
                && (other == axis || entry(row, other) == Some(0.0))
        });
        let shift = entry(row, 3)?;
        apart.then(|| (row, entry(row, axis).unwrap_or(1.0) * at + shift))
    }

    /// Whether a primitive's formula gives the same on both sides of the origin along an axis. A formula
    /// without branches of its own that agrees at so many points does so everywhere.
    fn is_even(&self, op: Op, parameters: &[ExprId], axis: usize) -> bool {
        let category = op.row().meta.category;
        if !matches!(category, Category::Shape3 | Category::Shape2) {
            return false;
        }
        // What a live parameter changes keeps its symmetry at any value: a few are tried.
        TRIED_VALUES.iter().all(|&value| {
            let numbers: Vec<f64> = parameters
                .iter()
                .map(|&id| self.constant(id).unwrap_or(value))
                .collect();
            let numbers = laid_out(op, &numbers);
            (0..TRIED_POINTS).all(|number| {
                let p = point(number);
                let mut q = p;
                q[axis] = -q[axis];
                let at = |[x, y, z]: [f64; 3]| match apply(op, V3::of(x, y, z), [0.0; 3], &numbers)
                {
                    Applied::Value(value) => value,
                    Applied::Point(_) => f64::NAN,
                };
                (at(p) - at(q)).abs() <= 1e-12 * at(p).abs().max(1e-3)
            })
        })
    }

    /// Whether a polygon's sides are their own mirror images.
    fn is_even_polygon(&self, points: &[[ExprId; 2]], axis: usize, at: f64) -> bool {
        let corner = |p: &[ExprId; 2]| Some([self.constant(p[0])?, self.constant(p[1])?]);
        let Some(corners) = points.iter().map(corner).collect::<Option<Vec<_>>>() else {
            return false;
        };
        let image = |mut p: [f64; 2]| {
            p[axis] = 2.0 * at - p[axis];
            p
        };
        let sides = || (0..corners.len()).map(|i| [corners[i], corners[(i + 1) % corners.len()]]);
        sides().all(|[a, b]| {
            let (a, b) = (image(a), image(b));
            sides().any(|side| side == [b, a] || side == [a, b])
        })
    }
}

/// Numbers that stand for those of live parameters.
const TRIED_VALUES: [f64; 2] = [0.375, 1.25];
/// The number of points at which a formula is tried.
const TRIED_POINTS: u32 = 48;

/// A point in no special place: the fractional parts of multiples of irrational numbers.
fn point(number: u32) -> [f64; 3] {
    let n = f64::from(number) + 1.0;
    let scale = [0.5, 2.0, 8.0][number as usize % 3];
    [
        0.819_172_513_396_164_4,
        0.671_043_606_703_789_2,
        0.549_700_477_901_97,
    ]
    .map(|step| ((n * step).fract() - 0.5) * 2.0 * scale)
}

/// Reports whether an operation makes a solid of revolution around the y axis.
pub(crate) fn is_turned(op: Op) -> bool {
    matches!(
        op,
        Op::Sphere
            | Op::Capsule
            | Op::Torus
            | Op::Cylinder
            | Op::RoundedCylinder
            | Op::InfiniteCone
            | Op::Cone
            | Op::RoundedCone
            | Op::RoundCone
            | Op::Revolve
    )
}
