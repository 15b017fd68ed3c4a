//! Shapes whose values change by at most one per unit of length.
//!
//! Only their boxes shrink by an inward offset. Steeper fields reach its level nearer to their surface.

use super::ShapeBounds;
use crate::scene::{SceneRef, ShapeId, ShapeKind, children};
use sdfc_vm::row::SlopeRule;

impl ShapeBounds {
    /// Reports whether the rules of the table bound the slope of a shape's value by one, for all values of the
    /// parameters. The result is cached. It recurses over nested shapes, whose depth the elaborator bounds.
    pub(super) fn has_distance_slope(&mut self, scene: SceneRef<'_>, id: ShapeId) -> bool {
        if let Some(&cached) = self.distance_slopes.get(&id) {
            return cached;
        }
        let kind = &scene.shapes[id.0 as usize].kind;
        let is_distance = match kind {
            ShapeKind::Field { .. } | ShapeKind::Warp { .. } | ShapeKind::Displace { .. } => false,
            ShapeKind::Domain { op, .. } => matches!(op.row().facts.slope, SlopeRule::Fold),
            ShapeKind::Primitive { op, .. }
            | ShapeKind::Combine { op, .. }
            | ShapeKind::Distance { op, .. } => {
                let operands = vec![1.0; children(kind).len().min(2)];
                let slope = op.row().facts.slope;
                slope.bound(&operands, 1.0, |_| f64::INFINITY) <= 1.0
            }
            ShapeKind::Polygon { .. }
            | ShapeKind::Frame { .. }
            | ShapeKind::Repeat { .. }
            | ShapeKind::Polar { .. }
            | ShapeKind::Painted { .. }
            | ShapeKind::Nothing => true,
        };
        let is_distance = is_distance
            && children(kind)
                .iter()
                .all(|&child| self.has_distance_slope(scene, child));
        self.distance_slopes.insert(id, is_distance);
        is_distance
    }
}
