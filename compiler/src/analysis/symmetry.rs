//! Symmetries of shapes that follow from their construction: mirror symmetry, and rotational symmetry about
//! an axis. Of copies of such a shape, only the nearest needs to be evaluated.
//!
//! A symmetry that is found holds for all values of the live parameters. Not every symmetry is found.

use crate::expression::{ExprId, Expressions};
use crate::scene::{Shape, ShapeId, ShapeKind};
use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::row::Category;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// Shapes whose symmetries are tested.
#[derive(Clone, Copy)]
pub(crate) struct Symmetries<'s> {
    pub(crate) shapes: &'s [Shape],
    pub(crate) expressions: &'s Expressions,
}

impl Symmetries<'_> {
    /// Reports whether a shape is its own mirror image in the plane across `axis` at `position`.
    pub(crate) fn is_mirror_symmetric(&self, id: ShapeId, axis: usize, position: f64) -> bool {
        let shape = &self.shapes[id.0 as usize];
        let is_symmetric = |child: ShapeId| self.is_mirror_symmetric(child, axis, position);
        match &shape.kind {
            ShapeKind::Nothing => true,
            ShapeKind::Primitive { op, parameters } => {
                shape.is_2d && axis == 2
                    || position == 0.0 && self.is_even_primitive(*op, parameters, axis)
            }
            ShapeKind::Polygon { points } => {
                axis == 2 || self.is_even_polygon(points, axis, position)
            }
            ShapeKind::Combine { children, .. } => {
                children.iter().all(|&child| is_symmetric(child))
            }
            ShapeKind::Painted { child, .. } => is_symmetric(*child),
            ShapeKind::Frame { child, matrix, .. } => self
                .plane_in_frame(matrix, axis, position)
                .is_some_and(|(axis, position)| self.is_mirror_symmetric(*child, axis, position)),
            ShapeKind::Repeat { child, .. } => position == 0.0 && is_symmetric(*child),
            ShapeKind::Distance { op, child, .. } => match op {
                Op::Extrude | Op::RoundedExtrude if axis == 2 => position == 0.0,
                _ => is_symmetric(*child),
            },
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => match op {
                Op::Mirror => {
                    position == 0.0
                        && (self.constant(parameters[axis]) == Some(1.0) || is_symmetric(*child))
                }
                Op::Elongate | Op::ElongateCorrect => position == 0.0 && is_symmetric(*child),
                Op::Slice => axis == 2 || is_symmetric(*child),
                Op::Revolve => match axis {
                    1 => is_symmetric(*child),
                    _ => position == 0.0,
                },
                _ => false,
            },
            ShapeKind::Polar {
                child, parameters, ..
            } => {
                let (radial_axis, lateral_axis) = (0, if shape.is_2d { 1 } else { 2 });
                match axis {
                    _ if axis == lateral_axis || axis == radial_axis => {
                        position == 0.0
                            && self.is_even_ring(
                                *child,
                                parameters[0],
                                axis,
                                radial_axis,
                                lateral_axis,
                            )
                    }
                    _ => is_symmetric(*child),
                }
            }
            ShapeKind::Field { .. } | ShapeKind::Warp { .. } | ShapeKind::Displace { .. } => false,
        }
    }

    /// Reports whether copies about an axis, `sector` apart, are mirror symmetric across `axis`. If each copy
    /// is symmetric across the other axis, its image is the copy on the opposite side.
    fn is_even_ring(
        &self,
        child: ShapeId,
        sector: ExprId,
        axis: usize,
        radial_axis: usize,
        lateral_axis: usize,
    ) -> bool {
        let other = radial_axis + lateral_axis - axis;
        self.is_mirror_symmetric(child, axis, 0.0)
            || self.is_mirror_symmetric(child, other, 0.0)
                && self.constant(sector).is_some_and(|sector| {
                    let half = std::f64::consts::PI / sector;
                    (half - half.round()).abs() < 1e-9
                })
    }

    /// Reports whether a shape is rotationally symmetric about the y axis; for a 2-D shape, about the origin.
    pub(crate) fn is_round(&self, id: ShapeId) -> bool {
        let shape = &self.shapes[id.0 as usize];
        match &shape.kind {
            ShapeKind::Nothing => true,
            ShapeKind::Primitive { op, .. } => {
                let axis = if shape.is_2d { 2 } else { 1 };
                op.row().facts.axis_of_revolution == Some(axis)
            }
            ShapeKind::Combine { children, .. } => children.iter().all(|&id| self.is_round(id)),
            ShapeKind::Painted { child, .. } => self.is_round(*child),
            ShapeKind::Frame { child, matrix, .. } => {
                let axis = if shape.is_2d { 2 } else { 1 };
                let keeps_axis = self
                    .plane_in_frame(matrix, axis, 0.0)
                    .is_some_and(|(inner_axis, _)| inner_axis == axis);
                let is_centred = (0..3)
                    .filter(|&row| row != axis)
                    .all(|row| self.constant(matrix[4 * row + 3]) == Some(0.0));
                keeps_axis && is_centred && self.is_round(*child)
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

    /// Returns the plane across `axis` at `position` in the coordinates of a frame, if the frame keeps that axis
    /// separate from the others.
    fn plane_in_frame(
        &self,
        matrix: &[ExprId; 12],
        axis: usize,
        position: f64,
    ) -> Option<(usize, f64)> {
        let entry = |row: usize, column: usize| self.constant(matrix[4 * row + column]);
        let row = (0..3).find(|&row| entry(row, axis).is_some_and(|v| v != 0.0))?;
        let is_separate = (0..3).all(|other| {
            (other == row || entry(other, axis) == Some(0.0))
                && (other == axis || entry(row, other) == Some(0.0))
        });
        let shift = entry(row, 3)?;
        let scaled = entry(row, axis).unwrap_or(1.0) * position;
        // Shifts that cancel leave their rounding.
        let is_zero = (scaled + shift).abs() <= MAX_RELATIVE_ROUNDING * shift.abs();
        let position = if is_zero { 0.0 } else { scaled + shift };
        is_separate.then_some((row, position))
    }

    /// Reports whether a primitive's formula is even along an axis. The test compares values at sample
    /// points: a formula without branches that is even at that many points is even everywhere.
    fn is_even_primitive(&self, op: Op, parameters: &[ExprId], axis: usize) -> bool {
        let category = op.row().facts.category;
        if !matches!(category, Category::Shape3 | Category::Shape2) {
            return false;
        }
        // Parameters do not affect the symmetry: a few values are tested.
        SAMPLE_VALUES.iter().all(|&value| {
            let numbers: Vec<f64> = parameters
                .iter()
                .map(|&id| self.constant(id).unwrap_or(value))
                .collect();
            let numbers = pack_parameters(op, &numbers);
            (0..SAMPLE_POINTS).all(|number| {
                let p = point(number);
                let mut q = p;
                q[axis] = -q[axis];
                let value_at =
                    |[x, y, z]: [f64; 3]| match apply(op, V3::new(x, y, z), [0.0; 3], &numbers) {
                        OpResult::Value(value) => value,
                        OpResult::Point(_) => f64::NAN,
                    };
                (value_at(p) - value_at(q)).abs() <= 1e-12 * value_at(p).abs().max(1e-3)
            })
        })
    }

    /// Reports whether a polygon's sides are mapped to each other by a reflection.
    fn is_even_polygon(&self, points: &[[ExprId; 2]], axis: usize, position: f64) -> bool {
        let corner = |p: &[ExprId; 2]| Some([self.constant(p[0])?, self.constant(p[1])?]);
        let Some(corners) = points.iter().map(corner).collect::<Option<Vec<_>>>() else {
            return false;
        };
        let image = |mut p: [f64; 2]| {
            p[axis] = 2.0 * position - p[axis];
            p
        };
        let sides = || (0..corners.len()).map(|i| [corners[i], corners[(i + 1) % corners.len()]]);
        sides().all(|[a, b]| {
            let (a, b) = (image(a), image(b));
            sides().any(|side| side == [b, a] || side == [a, b])
        })
    }
}

/// Maximum sum of two positions that cancel, relative to one of them.
const MAX_RELATIVE_ROUNDING: f64 = 1e-14;
/// Sample values of live parameters.
const SAMPLE_VALUES: [f64; 2] = [0.375, 1.25];
/// Number of sample points of a formula.
const SAMPLE_POINTS: u32 = 48;

/// Returns a generic sample point: fractional parts of multiples of irrational numbers.
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
