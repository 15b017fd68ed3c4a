//! Queries about shapes while the scene is built: bounding boxes and dependence on parameters.

use super::Elaborator;
use crate::expression::ExprId;
use crate::scene::{SceneRef, ShapeId, ShapeKind, children};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

impl<'a> Elaborator<'a> {
    /// Returns a view of the scene as built so far.
    pub(crate) fn scene_ref(&self) -> SceneRef<'_> {
        SceneRef {
            shapes: &self.shapes,
            expressions: &self.expressions,
            params: &self.params,
            animation: self.animation,
        }
    }

    /// Returns the bounding box of a shape at the current values of the parameters.
    pub(crate) fn bounds_of(&mut self, id: ShapeId) -> Bounds {
        let mut boxes = std::mem::take(&mut self.bounds_cache);
        let bounds = boxes.get(self.scene_ref(), id);
        self.bounds_cache = boxes;
        bounds
    }

    /// Reports whether a shape depends on no live parameter and not on the time.
    pub(crate) fn is_constant_shape(&mut self, id: ShapeId) -> bool {
        let mut boxes = std::mem::take(&mut self.bounds_cache);
        while self.constant_shapes.len() <= id.0 as usize {
            let (scene, kind) = (
                self.scene_ref(),
                &self.shapes[self.constant_shapes.len()].kind,
            );
            let is_still = numbers(kind).iter().all(|&n| !boxes.is_live(scene, n))
                && children(kind)
                    .iter()
                    .all(|id| self.constant_shapes[id.0 as usize]);
            self.constant_shapes.push(is_still);
        }
        self.bounds_cache = boxes;
        self.constant_shapes[id.0 as usize]
    }

    /// Reports whether a number depends on a live parameter or the time.
    pub(crate) fn depends_on_params(&mut self, id: ExprId) -> bool {
        let mut boxes = std::mem::take(&mut self.bounds_cache);
        let follows = boxes.is_live(self.scene_ref(), id);
        self.bounds_cache = boxes;
        follows
    }

    /// Bounds a number of the point over a region, at the current values of the parameters.
    pub(crate) fn point_range(&mut self, id: ExprId, region: &Bounds) -> Interval {
        let (expressions, params, time) = (&self.expressions, &self.params, self.options.time);
        let present = &mut self.uniform_values;
        let mut value = |id| present.value(expressions, params, time, id);
        crate::analysis::range::range(expressions, id, region, &mut value)
    }
}

/// Returns the numbers of the shape itself, without its children, that affect its surface.
pub(crate) fn numbers(kind: &ShapeKind) -> Vec<ExprId> {
    match kind {
        ShapeKind::Primitive { parameters, .. }
        | ShapeKind::Combine { parameters, .. }
        | ShapeKind::Repeat { parameters, .. }
        | ShapeKind::Polar { parameters, .. }
        | ShapeKind::Domain { parameters, .. }
        | ShapeKind::Distance { parameters, .. } => parameters.clone(),
        ShapeKind::Field { value, .. } => vec![*value],
        ShapeKind::Polygon { points } => points.iter().flatten().copied().collect(),
        ShapeKind::Frame { matrix, scale, .. } => matrix.iter().copied().chain([*scale]).collect(),
        ShapeKind::Warp { point, .. } => point.to_vec(),
        ShapeKind::Displace { amount, .. } => vec![*amount],
        ShapeKind::Painted { .. } | ShapeKind::Nothing => Vec::new(),
    }
}
