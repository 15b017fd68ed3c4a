//! Polygons with live corners, whose outermost edge moves together with the body's face.

use super::linear::LinearForm;
use super::live::AxisStep;
use super::{CutContext, CutterExtension, TOUCH_TOLERANCE};
use crate::expression::ExprId;
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::table::Op;

type Corner = [ExprId; 2];

impl CutterExtension<'_> {
    /// Moves the edges of a polygon across x and y outwards, where they are flush with the body's faces.
    pub(super) fn extend_live_polygon(
        &mut self,
        id: ShapeId,
        path: &[AxisStep],
        cut: &CutContext,
    ) -> ShapeId {
        // Its other sides may slope: prolonged ones change values beside the polygon, which a blend reads.
        if cut.blend_radius > 0.0 {
            return id;
        }
        let ShapeKind::Polygon { points } = self.kind(id) else {
            return id;
        };
        let mut points = points.clone();
        let mut is_extended = false;
        for axis in [0, 1] {
            for side in [-1.0, 1.0] {
                is_extended |= self.move_outermost_edge(&mut points, (axis, side), path, cut);
            }
        }
        if !is_extended {
            return id;
        }
        self.scene.derived(id, ShapeKind::Polygon { points })
    }

    /// Moves the outermost edge on a side outwards. Returns whether that was possible.
    fn move_outermost_edge(
        &mut self,
        points: &mut [Corner],
        (axis, side): (usize, f64),
        path: &[AxisStep],
        cut: &CutContext,
    ) -> bool {
        let count = points.len();
        let extent = |this: &Self, point: &Corner| {
            LinearForm::from_expr(&this.scene.expressions, point[axis]).scaled(side)
        };
        let extents: Vec<LinearForm> = points.iter().map(|point| extent(self, point)).collect();
        let depth_behind = |this: &Self, edge_index: usize, edge: &LinearForm| {
            this.min_value(&edge.clone().plus_scaled(&extents[edge_index], -1.0))
        };
        let edge = (0..count).find(|&edge_index| {
            let (edge, next) = (&extents[edge_index], (edge_index + 1) % count);
            let others = (0..count).filter(|&other| other != edge_index && other != next);
            let step = edge.clone().plus_scaled(&extents[next], -1.0).as_constant();
            step.is_some_and(|step| step.abs() <= TOUCH_TOLERANCE)
                && others
                    .into_iter()
                    .all(|other| depth_behind(self, other, edge) > TOUCH_TOLERANCE)
        });
        let Some(edge_index) = edge else { return false };
        let next = (edge_index + 1) % count;
        let max_step = cut.current_size;
        let Some((face, side_of_body, scale)) =
            self.face_in_body_frame((axis, side), &extents[edge_index], path)
        else {
            return false;
        };
        let is_flush = cut
            .body
            .and_then(|body| self.extent_on_side(body, side_of_body))
            .is_some_and(|extent| self.is_flush_with(&face.plus_scaled(&extent, -1.0), max_step));
        let slopes = [
            ((edge_index + count - 1) % count, edge_index),
            ((next + 1) % count, next),
        ]
        .map(|(from, to)| self.lateral_slope(points[from], points[to], (axis, side)));
        let ([Some(first), Some(last)], true) = (slopes, is_flush) else {
            return false;
        };
        let lateral_axis = 1 - axis;
        let width = LinearForm::from_expr(&self.scene.expressions, points[next][lateral_axis])
            .plus_scaled(
                &LinearForm::from_expr(&self.scene.expressions, points[edge_index][lateral_axis]),
                -1.0,
            );
        let distance = max_step * scale;
        // Converging walls must not meet.
        let narrowing = |sign: f64| {
            let remaining_width = width.clone().scaled(sign);
            let change = LinearForm::constant((last - first) * distance * sign);
            self.min_value(&remaining_width) > 0.0
                && self.min_value(&remaining_width.plus_scaled(&change, 1.0)) > 0.0
        };
        if !narrowing(1.0) && !narrowing(-1.0) {
            return false;
        }
        for (edge_index, slope) in [(edge_index, first), (next, last)] {
            let mut shift = [0.0; 2];
            (shift[axis], shift[lateral_axis]) = (side * distance, slope * distance);
            let expressions = &mut self.scene.expressions;
            points[edge_index] = std::array::from_fn(|i| {
                let offset = expressions.constant(shift[i]);
                expressions.call(Op::Add, &[points[edge_index][i], offset])
            });
        }
        true
    }

    /// Returns the lateral displacement of a wall per unit outwards, if it is the same for all parameter values.
    fn lateral_slope(&self, from: Corner, to: Corner, (axis, side): (usize, f64)) -> Option<f64> {
        let linear_form = |id: ExprId| LinearForm::from_expr(&self.scene.expressions, id);
        let rise = linear_form(to[axis])
            .plus_scaled(&linear_form(from[axis]), -1.0)
            .scaled(side);
        let across = linear_form(to[1 - axis]).plus_scaled(&linear_form(from[1 - axis]), -1.0);
        match (rise.as_constant(), across.as_constant()?) {
            (Some(rise), across) if rise > 0.0 => Some(across / rise),
            (None, 0.0) if self.min_value(&rise) > 0.0 => Some(0.0),
            _ => None,
        }
    }
}
