//! Polygons with corners that follow live parameters, whose outermost edge follows the body's face.

use super::linear::Linear;
use super::live::Turn;
use super::{Cut, Lengthening, TOUCHING};
use crate::expression::ExprId;
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::table::Op;

type Corner = [ExprId; 2];

impl Lengthening<'_> {
    /// A polygon whose edges across x and y stand farther out where they follow the body's faces.
    pub(super) fn sketch_out_of(&mut self, id: ShapeId, path: &[Turn], cut: &Cut) -> ShapeId {
        let ShapeKind::Polygon { points } = self.kind(id) else {
            return id;
        };
        let mut points = points.clone();
        let mut is_wider = false;
        for axis in [0, 1] {
            for side in [-1.0, 1.0] {
                is_wider |= self.move_outermost(&mut points, (axis, side), path, cut);
            }
        }
        if !is_wider {
            return id;
        }
        self.scene.derived(id, ShapeKind::Polygon { points })
    }

    /// Moves the outermost edge on a side and reports whether that was possible.
    fn move_outermost(
        &mut self,
        points: &mut [Corner],
        (axis, side): (usize, f64),
        path: &[Turn],
        cut: &Cut,
    ) -> bool {
        let count = points.len();
        let reach = |this: &Self, point: &Corner| {
            Linear::of(&this.scene.expressions, point[axis]).times(side)
        };
        let reaches: Vec<Linear> = points.iter().map(|point| reach(self, point)).collect();
        let behind = |this: &Self, at: usize, edge: &Linear| {
            this.least(&edge.clone().plus(&reaches[at], -1.0))
        };
        let edge = (0..count).find(|&at| {
            let (edge, next) = (&reaches[at], (at + 1) % count);
            let others = (0..count).filter(|&other| other != at && other != next);
            let step = edge.clone().plus(&reaches[next], -1.0).as_constant();
            step.is_some_and(|step| step.abs() <= TOUCHING)
                && others
                    .into_iter()
                    .all(|other| behind(self, other, edge) > TOUCHING)
        });
        let Some(at) = edge else { return false };
        let next = (at + 1) % count;
        let out = cut.present_size;
        let Some((face, side_of_body, scale)) = self.outside((axis, side), &reaches[at], path)
        else {
            return false;
        };
        let is_flush = cut
            .body
            .and_then(|body| self.reach(body, side_of_body))
            .is_some_and(|reach| self.stands_between(&face.plus(&reach, -1.0), out));
        let ways = [((at + count - 1) % count, at), ((next + 1) % count, next)]
            .map(|(from, to)| self.way(points[from], points[to], (axis, side)));
        let ([Some(first), Some(last)], true) = (ways, is_flush) else {
            return false;
        };
        let across = 1 - axis;
        let width = Linear::of(&self.scene.expressions, points[next][across]).plus(
            &Linear::of(&self.scene.expressions, points[at][across]),
            -1.0,
        );
        let by = out * scale;
        // Walls that narrow may not meet.
        let narrowing = |sign: f64| {
            let left = width.clone().times(sign);
            let change = Linear::constant((last - first) * by * sign);
            self.least(&left) > 0.0 && self.least(&left.plus(&change, 1.0)) > 0.0
        };
        if !narrowing(1.0) && !narrowing(-1.0) {
            return false;
        }
        for (at, way) in [(at, first), (next, last)] {
            let mut shift = [0.0; 2];
            (shift[axis], shift[across]) = (side * by, way * by);
            let expressions = &mut self.scene.expressions;
            points[at] = std::array::from_fn(|i| {
                let more = expressions.constant(shift[i]);
                expressions.call(Op::Add, &[points[at][i], more])
            });
        }
        true
    }

    /// The way of a wall across an axis per unit outwards along it, if it is the same for all values.
    fn way(&self, from: Corner, to: Corner, (axis, side): (usize, f64)) -> Option<f64> {
        let of = |id: ExprId| Linear::of(&self.scene.expressions, id);
        let rise = of(to[axis]).plus(&of(from[axis]), -1.0).times(side);
        let across = of(to[1 - axis]).plus(&of(from[1 - axis]), -1.0);
        match (rise.as_constant(), across.as_constant()?) {
            (Some(rise), across) if rise > 0.0 => Some(across / rise),
            (None, 0.0) if self.least(&rise) > 0.0 => Some(0.0),
            _ => None,
        }
    }
}
