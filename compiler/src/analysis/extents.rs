//! Boxes and distances of the parts of a solid, from which the length of rays and rounding follow.

use crate::analysis::bounds::ShapeBounds;
use crate::analysis::enclosure::enclosure;
use crate::analysis::shape_range::ShapeRange;
use crate::expression::ExprId;
use crate::scene::{SceneRef, ShapeId, ShapeKind, children};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::SetOperation;
use sdfc_vm::settings::{EndlessPart, Extents};
use std::collections::{HashMap, HashSet};

/// Maximum number of endless operands, and of boxes of finite ones.
const MAX_PARTS: usize = 64;
/// Distance of the points at which a gradient is measured, as a fraction of the value at the origin.
const GRADIENT_STEP: f64 = 1e-3;
/// Directions in which a field is compared with a plane.
const PROBE_DIRECTIONS: [[f64; 3]; 3] = [[3.1, -1.3, 0.7], [-0.9, 2.3, 1.7], [0.4, -0.6, -2.9]];
/// Maximum difference of a field from a plane, relative to its value at the origin.
const MAX_LINEAR_ERROR: f64 = 1e-6;

/// Parts of a solid: the operands of its unions.
#[derive(Clone, Debug, Default)]
pub(crate) struct SolidParts {
    /// The solid without its endless operands.
    subject: Option<ShapeId>,
    finite: Vec<ShapeId>,
    endless: Vec<ShapeId>,
    /// Unions that fields are equivalent to, by field.
    unions: HashMap<ShapeId, ShapeId>,
}

impl SolidParts {
    /// Returns the parts of a solid. `subject` is what is finite of it.
    pub(super) fn new(
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        root: ShapeId,
        subject: Option<ShapeId>,
        unions: HashMap<ShapeId, ShapeId>,
    ) -> Self {
        let mut parts = Self {
            subject,
            ..Self::default()
        };
        let mut visited = HashSet::new();
        let mut pending = vec![root];
        while let Some(id) = pending.pop() {
            if !visited.insert(id) {
                continue;
            }
            match &scene.shapes[id.0 as usize].kind {
                ShapeKind::Combine { op, children, .. }
                    if op.row().facts.set == Some(SetOperation::Union) =>
                {
                    pending.extend(children);
                }
                ShapeKind::Painted { child, .. } => pending.push(*child),
                ShapeKind::Field { .. } if unions.contains_key(&id) => pending.push(unions[&id]),
                _ if boxes.get(scene, id).is_finite() => parts.finite.push(id),
                _ if boxes.get(scene, id).is_empty() => {}
                _ if parts.endless.len() < MAX_PARTS => parts.endless.push(id),
                _ => {}
            }
        }
        parts.unions = unions;
        parts
    }
}

/// Returns the extents of a solid at the current values.
pub(crate) fn extents(
    scene: SceneRef<'_>,
    boxes: &mut ShapeBounds,
    root: ShapeId,
    parts: &SolidParts,
) -> Extents {
    let all = boxes.get(scene, root);
    let finite = match parts.subject {
        Some(subject) if !all.is_finite() => boxes.get(scene, subject),
        _ => all,
    };
    let finite_parts = parts
        .finite
        .iter()
        .map(|&id| boxes.get(scene, id))
        .collect();
    let endless = parts.endless.iter().map(|&id| EndlessPart {
        bounds: boxes.get(scene, id),
        plane: nearest_plane(scene, boxes, id),
    });
    Extents {
        endless: endless.collect(),
        finite: Some(finite).filter(Bounds::is_finite),
        finite_parts: largest_boxes(finite_parts),
        enclosure: match all.is_finite() {
            true => None,
            false => enclosure(scene, boxes, root, &parts.unions),
        },
    }
}

/// Returns the largest boxes, and a box around all others.
fn largest_boxes(mut boxes: Vec<Bounds>) -> Vec<Bounds> {
    boxes.sort_by(|a, b| b.half_diagonal().total_cmp(&a.half_diagonal()));
    if boxes.len() > MAX_PARTS {
        let rest = boxes.split_off(MAX_PARTS);
        let around = |a: Bounds, b: Bounds| a.hull(&b);
        boxes.extend(rest.into_iter().reduce(around));
    }
    boxes
}

/// Returns the plane that a shape's distance is near the origin: its normal, and the distance of the origin. It is
/// known for shapes without written fields and without maps that stretch space, and for fields that are planes.
fn nearest_plane(scene: SceneRef<'_>, boxes: &mut ShapeBounds, id: ShapeId) -> Option<[f64; 4]> {
    let mut uniform = |id: ExprId| Interval::point(boxes.number(scene, id));
    let mut range = ShapeRange::new(scene, &mut uniform);
    let mut value_at = |p: [f64; 3]| {
        let value = range.range_in_box(id, &Bounds { min: p, max: p });
        value.lo / 2.0 + value.hi / 2.0
    };
    let value = value_at([0.0; 3]);
    let size = value.abs().max(1.0);
    let slope = |axis: usize| {
        let mut p = [0.0; 3];
        p[axis] = GRADIENT_STEP * size;
        (value_at(p) - value) / p[axis]
    };
    let gradient = DVec3::from([0, 1, 2].map(slope));
    let length = match is_measured(scene, id) {
        true => 1.0,
        false => {
            let is_linear = PROBE_DIRECTIONS.into_iter().all(|direction| {
                let p = DVec3::from(direction) * size;
                let expected = value + gradient.dot(p);
                (value_at(p.into()) - expected).abs() <= MAX_LINEAR_ERROR * size * gradient.length()
            });
            is_linear.then(|| gradient.length())?
        }
    };
    let plane = [gradient.x, gradient.y, gradient.z, value].map(|v| v / length);
    plane.iter().all(|v| v.is_finite()).then_some(plane)
}

/// Reports whether values of a shape are distances: it contains no written fields and no maps that stretch space.
fn is_measured(scene: SceneRef<'_>, id: ShapeId) -> bool {
    let kind = &scene.shapes[id.0 as usize].kind;
    match kind {
        ShapeKind::Field { .. }
        | ShapeKind::Displace { .. }
        | ShapeKind::Warp { .. }
        | ShapeKind::Domain { .. } => false,
        _ => children(kind)
            .iter()
            .all(|&child| is_measured(scene, child)),
    }
}
