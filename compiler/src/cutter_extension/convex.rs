//! Convexity of shapes, by their operations and by the corners of polygons.

use super::TOUCH_TOLERANCE;
use super::section::corners;
use crate::scene::{Scene, ShapeId, ShapeKind};
use glam::DVec2;
use sdfc_vm::table::Op;

/// Reports whether a shape is convex. Recursion over nested shapes, whose depth the elaborator bounds.
pub(super) fn is_convex(scene: &Scene, id: ShapeId) -> bool {
    match &scene.shapes[id.0 as usize].kind {
        ShapeKind::Painted { child, .. }
        | ShapeKind::Frame { child, .. }
        | ShapeKind::Distance {
            op: Op::Extrude | Op::RoundedExtrude,
            child,
            ..
        } => is_convex(scene, *child),
        ShapeKind::Combine {
            op: Op::Intersection,
            children,
            ..
        } => children.iter().all(|&child| is_convex(scene, child)),
        ShapeKind::Polygon { .. } => {
            corners(scene, id).is_some_and(|corners| is_convex_polygon(&corners))
        }
        ShapeKind::Primitive { op, .. } => op.row().facts.is_convex,
        _ => false,
    }
}

/// Reports whether a polygon turns in one direction at all corners, with winding number ±1.
fn is_convex_polygon(corners: &[DVec2]) -> bool {
    let count = corners.len();
    let edge = |index: usize| corners[(index + 1) % count] - corners[index % count];
    let exterior_angle = |index: usize| {
        let (a, b) = (edge(index), edge(index + 1));
        a.perp_dot(b).atan2(a.dot(b))
    };
    let angles: Vec<f64> = (0..count).map(exterior_angle).collect();
    let sum: f64 = angles.iter().sum();
    let is_once = (sum.abs() - std::f64::consts::TAU).abs() < 1e-6;
    is_once
        && angles
            .iter()
            .all(|exterior_angle| exterior_angle * sum >= -TOUCH_TOLERANCE)
}
