//! Boxes of the parts of an endless solid, from which the length of rays follows.

use crate::analysis::bounds::ShapeBounds;
use crate::scene::{SceneRef, ShapeId, ShapeKind};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::SetOperation;
use sdfc_vm::settings::Extents;
use std::collections::HashSet;

/// Maximum number of boxes of endless operands.
const MAX_ENDLESS: usize = 64;

/// Returns the boxes of an endless solid's finite part and of each endless operand of its unions. They hold for all
/// values of the parameters. A finite solid has none.
pub(crate) fn extents(
    scene: SceneRef<'_>,
    boxes: &mut ShapeBounds,
    root: ShapeId,
    finite_part: Option<ShapeId>,
) -> Extents {
    let mut extents = Extents::default();
    if boxes.get(scene, root).is_finite() {
        return extents;
    }
    let finite = finite_part.map(|part| boxes.get(scene, part));
    extents.finite = finite.filter(Bounds::is_finite);
    let mut visited = HashSet::new();
    let mut pending = vec![root];
    while let Some(id) = pending.pop() {
        if !visited.insert(id) || extents.endless.len() == MAX_ENDLESS {
            continue;
        }
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Combine { op, children, .. }
                if op.row().facts.set == Some(SetOperation::Union) =>
            {
                pending.extend(children);
            }
            ShapeKind::Painted { child, .. } => pending.push(*child),
            _ => {
                let bounds = boxes.get(scene, id);
                let is_endless = !bounds.is_finite() && !bounds.is_empty();
                if is_endless && !extents.endless.contains(&bounds) {
                    extents.endless.push(bounds);
                }
            }
        }
    }
    extents
}
