//! Complements of half spaces as half spaces, whose boxes and distances are known: `!plane(Y)` is `plane(-Y)`.

use crate::expression::{ExprId, Expressions};
use crate::scene::{Scene, ShapeId, ShapeKind, children_mut};
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Replaces complements of half spaces in a shape. Returns the same shape if nothing changes, else a new one after all
/// others.
pub(crate) fn without_complements(scene: &mut Scene, root: ShapeId) -> ShapeId {
    let mut replaced = HashMap::new();
    replace(scene, root, &mut replaced)
}

/// Recurses over nested shapes, whose depth the elaborator bounds; the same holds for the function below.
fn replace(scene: &mut Scene, id: ShapeId, replaced: &mut HashMap<ShapeId, ShapeId>) -> ShapeId {
    if let Some(&result) = replaced.get(&id) {
        return result;
    }
    let mut kind = scene.shapes[id.0 as usize].kind.clone();
    let opposite = match kind {
        ShapeKind::Distance {
            op: Op::Complement,
            child,
            ..
        } => opposite_half_space(scene, child),
        _ => None,
    };
    let result = opposite.unwrap_or_else(|| {
        let mut changes = false;
        for child in children_mut(&mut kind) {
            let new = replace(scene, *child, replaced);
            changes |= new != *child;
            *child = new;
        }
        match changes {
            true => scene.derived(id, kind),
            false => id,
        }
    });
    replaced.insert(id, result);
    result
}

/// Returns the complement of a half space; `None` of any other shape.
fn opposite_half_space(scene: &mut Scene, id: ShapeId) -> Option<ShapeId> {
    let mut kind = scene.shapes[id.0 as usize].kind.clone();
    match &mut kind {
        ShapeKind::Frame { child, .. } => *child = opposite_half_space(scene, *child)?,
        ShapeKind::Primitive {
            op: Op::Plane,
            parameters,
        } => *parameters = negated(&mut scene.expressions, parameters),
        _ => return None,
    }
    Some(scene.derived(id, kind))
}

fn negated(expressions: &mut Expressions, numbers: &[ExprId]) -> Vec<ExprId> {
    let negated = numbers
        .iter()
        .map(|&number| expressions.call(Op::Neg, &[number]));
    negated.collect()
}
