//! What is known of each shape while the scene is being built: its box, and whether it stands
//! still.

use super::Elaborator;
use crate::bounds::bounds_of;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use std::collections::HashSet;

/// What is known of a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measure {
    bounds: Bounds,
    is_constant: bool,
}

impl<'a> Elaborator<'a> {
    /// The box of a shape at the present values of the parameters.
    pub(crate) fn bounds_of(&mut self, id: ShapeId) -> Bounds {
        self.measure(id).bounds
    }

    /// Whether nothing about a shape follows a live parameter or the time.
    pub(crate) fn is_constant_shape(&mut self, id: ShapeId) -> bool {
        self.measure(id).is_constant
    }

    /// Shapes are measured in order, each once.
    fn measure(&mut self, id: ShapeId) -> Measure {
        while self.measures.len() <= id.0 as usize {
            let shape = &self.shapes[self.measures.len()];
            let (graph, params, time) = (&self.graph, &self.params, self.options.time);
            let present = &mut self.present;
            let mut value = |id| present.value(graph, params, time, id);
            let bounds = bounds_of(shape, &self.boxes, graph, &mut value);
            let numbers_are_constant = numbers(&shape.kind)
                .iter()
                .all(|&id| follows_nothing(graph, id));
            let children = children(&shape.kind);
            let is_constant = numbers_are_constant
                && children
                    .iter()
                    .all(|id| self.measures[id.0 as usize].is_constant);
            self.boxes.push(bounds);
            self.measures.push(Measure {
                bounds,
                is_constant,
            });
        }
        self.measures[id.0 as usize]
    }

    /// All values that a number of a point may have in a region.
    pub(crate) fn range_of(&mut self, id: ExprId, region: &Bounds) -> Interval {
        let (graph, params, time) = (&self.graph, &self.params, self.options.time);
        let present = &mut self.present;
        let mut value = |id| present.value(graph, params, time, id);
        crate::bounds::range(graph, id, region, &mut value)
    }
}

/// The shapes that a shape is made of.
pub(crate) fn children(kind: &ShapeKind) -> &[ShapeId] {
    match kind {
        ShapeKind::Primitive { .. }
        | ShapeKind::Field { .. }
        | ShapeKind::Polygon { .. }
        | ShapeKind::Nothing => &[],
        ShapeKind::Combine { children, .. } => children,
        ShapeKind::Frame { child, .. }
        | ShapeKind::Domain { child, .. }
        | ShapeKind::Warp { child, .. }
        | ShapeKind::Distance { child, .. }
        | ShapeKind::Displace { child, .. }
        | ShapeKind::Painted { child, .. } => std::slice::from_ref(child),
    }
}

/// Whether a number depends on no parameter and on no time; on a point it may.
fn follows_nothing(graph: &Expressions, id: ExprId) -> bool {
    if graph.stage(id) == Stage::Constant {
        return true;
    }
    let mut seen = HashSet::new();
    let mut pending = vec![id];
    while let Some(id) = pending.pop() {
        if !seen.insert(id) {
            continue;
        }
        match graph.get(id) {
            Expression::Param(..) | Expression::Time => return false,
            Expression::Constant(_)
            | Expression::Coordinate(_)
            | Expression::NormalComponent(_) => {}
            Expression::Apply {
                point,
                values,
                parameters,
                ..
            } => {
                pending.extend(point.iter().flatten().chain(values).chain(parameters));
            }
        }
    }
    true
}

/// The numbers of a shape's own that move its surface.
fn numbers(kind: &ShapeKind) -> Vec<ExprId> {
    match kind {
        ShapeKind::Primitive { parameters, .. }
        | ShapeKind::Combine { parameters, .. }
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
