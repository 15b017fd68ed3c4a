//! Bounding boxes of inward offsets: of the points where a shape's value lies below a negative level.
//!
//! A box shrinks by the offset only if the value changes by at most one per unit of length. Steeper fields reach
//! the level nearer to their surface.

use super::ShapeBounds;
use crate::scene::{SceneRef, ShapeId, ShapeKind, children};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::SlopeRule;
use sdfc_vm::table::Op;

impl ShapeBounds {
    /// Returns a box outside of which the values of all `shapes` are at least `-depth`.
    pub(super) fn inset_hull(
        &mut self,
        scene: SceneRef<'_>,
        shapes: &[ShapeId],
        depth: f64,
    ) -> Bounds {
        let boxes = shapes.iter().map(|&id| self.inset(scene, id, depth));
        boxes.fold(Bounds::EMPTY, |hull, inset| hull.hull(&inset))
    }

    /// Returns a box outside of which a shape's value is at least `-depth`. It recurses over nested shapes, whose
    /// depth the elaborator bounds.
    fn inset(&mut self, scene: SceneRef<'_>, id: ShapeId, depth: f64) -> Bounds {
        let outer_box = self.get(scene, id);
        if self.has_distance_slope(scene, id) {
            return outer_box.grown(-depth);
        }
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Painted { child, .. } => self.inset(scene, *child, depth),
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } => self.inset_hull(scene, children, depth),
            _ => self
                .searched_sublevel(scene, id, -depth, &outer_box)
                .intersection(&outer_box),
        }
    }

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
