//! Extends operands of unions whose inner values have a visible effect.
//!
//! The minimum of the values of two operands that touch, or overlap slightly, is near zero deep inside the
//! solid. An inset, a shell or a blend by such values opens a gap at the seam. So a face of an operand is
//! moved into the other operands where they contain the whole extension. The solid stays the same set of
//! points.

use super::{CutContext, CutterExtension, size};
use crate::scene::{Scene, ShapeId, ShapeKind, children, children_mut};
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::HashSet;

impl CutterExtension<'_> {
    /// Extends operands inside the children of a shape whose inner values have a visible effect.
    pub(super) fn extend_inner_operands(&mut self, kind: &mut ShapeKind) {
        let inner_values_show = match kind {
            ShapeKind::Distance {
                op: Op::Offset,
                parameters,
                ..
            } => {
                let offset = self.scene.expressions.as_constant(parameters[0]);
                offset.is_none_or(|offset| offset < 0.0)
            }
            ShapeKind::Distance {
                op: Op::Shell | Op::RoundedExtrude,
                ..
            }
            | ShapeKind::Displace { .. } => true,
            ShapeKind::Combine { op, .. } => {
                !matches!(op, Op::Intersection | Op::Subtraction)
                    && op.row().facts.set != Some(SetOperation::Union)
            }
            _ => false,
        };
        if !inner_values_show {
            return;
        }
        let is_subtraction = matches!(kind, ShapeKind::Combine { op, .. }
            if op.row().facts.set == Some(SetOperation::Subtraction));
        // Of a cutter, the outer values have an effect.
        let count = if is_subtraction { 1 } else { usize::MAX };
        for child in children_mut(kind).iter_mut().take(count) {
            *child = self.extend_operands(*child);
        }
    }

    /// Extends the operands of unions in a shape where other operands contain the extension.
    fn extend_operands(&mut self, id: ShapeId) -> ShapeId {
        // An extension may show another material where the solid is cut.
        if !has_seams(self.scene, id) || !has_one_material(self.scene, vec![id]) {
            return id;
        }
        let mut cut = CutContext {
            body: None,
            size: size(&self.bounds(id)),
            current_size: f64::NAN,
            blend_radius: 0.0,
            other_cutters: Vec::new(),
            has_one_material: true,
            clips: Vec::new(),
        };
        self.extend_cutter(id, &mut Vec::new(), &mut cut)
    }
}

/// Reports whether a shape has parts that may touch each other. Recursion over nested shapes, whose depth the
/// elaborator bounds.
fn has_seams(scene: &Scene, id: ShapeId) -> bool {
    let kind = &scene.shapes[id.0 as usize].kind;
    let joins = matches!(
        kind,
        ShapeKind::Combine { op: Op::Union, .. }
            | ShapeKind::Domain {
                op: Op::Mirror | Op::Revolve,
                ..
            }
    );
    joins || children(kind).iter().any(|&child| has_seams(scene, child))
}

/// Reports whether all parts of shapes have the same material, or none.
pub(super) fn has_one_material(scene: &Scene, mut pending: Vec<ShapeId>) -> bool {
    let mut materials = HashSet::new();
    let mut visited: HashSet<ShapeId> = pending.iter().copied().collect();
    while let Some(id) = pending.pop() {
        let kind = &scene.shapes[id.0 as usize].kind;
        match kind {
            ShapeKind::Painted { material, .. } => {
                materials.insert(Some(*material));
            }
            _ if children(kind).is_empty() => {
                materials.insert(None);
            }
            _ => pending.extend(
                children(kind)
                    .iter()
                    .filter(|&&child| visited.insert(child)),
            ),
        }
    }
    materials.len() <= 1
}
