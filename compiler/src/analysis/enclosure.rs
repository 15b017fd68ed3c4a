//! A box and half spaces that together enclose an endless solid, by which rays end.

use crate::analysis::bounds::ShapeBounds;
use crate::expression::ExprId;
use crate::scene::{SceneRef, ShapeId, ShapeKind};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::{BoundsRule, SetOperation};
use sdfc_vm::settings::{Enclosure, MAX_HALF_SPACES};
use sdfc_vm::table::Op;
use std::collections::HashSet;

/// Margin of a half space, as a fraction of the distance of its plane from the origin.
const MARGIN_FRACTION: f64 = 1e-5;

/// Returns an enclosure of a solid at the current values, or `None` if none is known.
///
/// Outside of it, each operand of the unions is proved to be positive, and a blend of them, too.
pub(crate) fn enclosure(
    scene: SceneRef<'_>,
    boxes: &mut ShapeBounds,
    root: ShapeId,
) -> Option<Enclosure> {
    let mut finite = Bounds::EMPTY;
    let (mut solid, mut others) = (Vec::new(), Vec::new());
    let mut solid_depth = 0.0;
    let mut visited = HashSet::new();
    let mut pending = vec![(root, 0.0)];
    while let Some((id, level)) = pending.pop() {
        if !visited.insert((id, f64::to_bits(level))) {
            continue;
        }
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Painted { child, .. } => pending.push((*child, level)),
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } if op.row().facts.set == Some(SetOperation::Union) => {
                let [near, far] = union_levels(scene, boxes, *op, parameters, children)?;
                for &child in children {
                    let is_finite = boxes.get(scene, child).is_finite();
                    pending.push((child, level + if is_finite { near } else { far }));
                }
            }
            _ => {
                let bounds = boxes.sublevel_bounds(scene, id, level);
                if bounds.is_finite() {
                    finite = finite.hull(&bounds);
                } else if !bounds.is_empty() {
                    let half_space = half_space(scene, boxes, id, level, &bounds)?;
                    if is_half_space(scene, id) {
                        solid_depth = f64::max(solid_depth, level);
                        solid.push(half_space);
                    } else {
                        others.push(half_space);
                    }
                }
            }
        }
        if solid.len() + others.len() > MAX_HALF_SPACES {
            return None;
        }
    }
    let solid_half_spaces = solid.len();
    let half_spaces = [solid, others].concat();
    (!half_spaces.is_empty()).then_some(Enclosure {
        finite,
        half_spaces,
        solid_half_spaces,
        solid_depth,
    })
}

/// Returns levels for the operands of a union: for finite ones, and for endless ones. Where each operand is above its
/// level, the union is above zero.
///
/// A single endless operand keeps its own surface where all others are farther away than a blend reaches.
fn union_levels(
    scene: SceneRef<'_>,
    boxes: &mut ShapeBounds,
    op: Op,
    parameters: &[ExprId],
    children: &[ShapeId],
) -> Option<[f64; 2]> {
    let numbers: Vec<f64> = parameters
        .iter()
        .map(|&id| boxes.number(scene, id))
        .collect();
    let facts = &op.row().facts;
    let growth = facts.hull_growth(&numbers, children.len())?;
    let mut is_endless = |id: ShapeId| {
        let bounds = boxes.get(scene, id);
        !bounds.is_finite() && !bounds.is_empty()
    };
    let endless = children.iter().filter(|&&id| is_endless(id)).count();
    let width = numbers.first().copied().unwrap_or(0.0);
    let reach = facts.blend.map(|blend| blend.kernel.support(width));
    match reach {
        Some(reach) if endless == 1 && reach.is_finite() => Some([growth + reach, 0.0]),
        _ => Some([growth, growth]),
    }
}

/// Returns a half space outside of which a shape's value exceeds `level`: below a plane of the shape, or beside its box.
fn half_space(
    scene: SceneRef<'_>,
    boxes: &mut ShapeBounds,
    id: ShapeId,
    level: f64,
    bounds: &Bounds,
) -> Option<[f64; 4]> {
    let (normal, offset) = match lower_plane(scene, boxes, id) {
        Some([x, y, z, offset]) => (DVec3::new(x, y, z), offset - level),
        None => {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z];
            let upper = (0..3).map(|axis| (axes[axis], -bounds.max[axis]));
            let lower = (0..3).map(|axis| (-axes[axis], bounds.min[axis]));
            upper.chain(lower).find(|(_, offset)| offset.is_finite())?
        }
    };
    let offset = offset / normal.length();
    let [x, y, z] = (normal / normal.length()).to_array();
    let plane = [x, y, z, offset - offset.abs() * MARGIN_FRACTION];
    plane.iter().all(|v| v.is_finite()).then_some(plane)
}

/// Reports whether a shape is a half space in frames.
fn is_half_space(scene: SceneRef<'_>, id: ShapeId) -> bool {
    match &scene.shapes[id.0 as usize].kind {
        ShapeKind::Primitive { op: Op::Plane, .. } => true,
        ShapeKind::Painted { child, .. } | ShapeKind::Frame { child, .. } => {
            is_half_space(scene, *child)
        }
        _ => false,
    }
}

/// Returns a linear function that a shape's value is at least: of a half space, in frames and cut by others. Recursion
/// over nested shapes, whose depth the elaborator bounds.
fn lower_plane(scene: SceneRef<'_>, boxes: &mut ShapeBounds, id: ShapeId) -> Option<[f64; 4]> {
    match &scene.shapes[id.0 as usize].kind {
        ShapeKind::Primitive {
            op: Op::Plane,
            parameters,
        } => {
            let [x, y, z, at] = *parameters.as_slice() else {
                return None;
            };
            let [x, y, z, at] = [x, y, z, at].map(|n| boxes.number(scene, n));
            Some([x, y, z, -at])
        }
        ShapeKind::Painted { child, .. } => lower_plane(scene, boxes, *child),
        ShapeKind::Frame {
            child,
            matrix,
            scale,
        } => {
            let [x, y, z, offset] = lower_plane(scene, boxes, *child)?;
            let scale = boxes.number(scene, *scale);
            let m = matrix.map(|n| boxes.number(scene, n));
            let column = |i: usize| scale * (x * m[i] + y * m[4 + i] + z * m[8 + i]);
            let offset = column(3) + scale * offset;
            Some([column(0), column(1), column(2), offset])
        }
        ShapeKind::Combine { op, children, .. } => match op.row().facts.bounds {
            BoundsRule::Intersection => children
                .iter()
                .find_map(|&child| lower_plane(scene, boxes, child)),
            BoundsRule::FirstOperand => lower_plane(scene, boxes, *children.first()?),
            _ => None,
        },
        _ => None,
    }
}
