//! What is known of each shape while the scene is being built: its box, and whether it stands
//! still.

use super::Elaborator;
use crate::bounds::World;
use crate::expression::ExprId;
use crate::scene::{ShapeId, ShapeKind, children};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

impl<'a> Elaborator<'a> {
    /// The scene as far as it is built.
    pub(crate) fn world(&self) -> World<'_> {
        World {
            shapes: &self.shapes,
            expressions: &self.graph,
            params: &self.params,
            animation: self.animation,
        }
    }

    /// The box of a shape at the present values of the parameters.
    pub(crate) fn bounds_of(&mut self, id: ShapeId) -> Bounds {
        let mut boxes = std::mem::take(&mut self.boxes);
        let bounds = boxes.of(self.world(), id);
        self.boxes = boxes;
        bounds
    }

    /// Whether nothing about a shape follows a live parameter or the time.
    pub(crate) fn is_constant_shape(&mut self, id: ShapeId) -> bool {
        let mut boxes = std::mem::take(&mut self.boxes);
        while self.is_still.len() <= id.0 as usize {
            let (world, kind) = (self.world(), &self.shapes[self.is_still.len()].kind);
            let is_still = numbers(kind).iter().all(|&n| !boxes.is_live(world, n))
                && children(kind).iter().all(|id| self.is_still[id.0 as usize]);
            self.is_still.push(is_still);
        }
        self.boxes = boxes;
        self.is_still[id.0 as usize]
    }

    /// Whether a number follows a live parameter or the time.
    pub(crate) fn follows_params(&mut self, id: ExprId) -> bool {
        let mut boxes = std::mem::take(&mut self.boxes);
        let follows = boxes.is_live(self.world(), id);
        self.boxes = boxes;
        follows
    }

    /// All values that a number of a point may have in a region.
    pub(crate) fn range_of(&mut self, id: ExprId, region: &Bounds) -> Interval {
        let (graph, params, time) = (&self.graph, &self.params, self.options.time);
        let present = &mut self.present;
        let mut value = |id| present.value(graph, params, time, id);
        crate::range::range(graph, id, region, &mut value)
    }
}

/// The numbers of a shape's own that move its surface.
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
