//! Longer operands of unions whose values inside show.
//!
//! The smaller of the values of two operands that touch, or overlap a little, is near zero deep inside the solid. An
//! inset, a shell or a blend by such values opens a gap at the seam. So a face of an operand is moved into the others
//! where they hold all that this adds: the solid is the same set of points.

use super::{Cut, Lengthening, size};
use crate::scene::{Scene, ShapeId, ShapeKind, children, children_mut};
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::HashSet;

impl Lengthening<'_> {
    /// Makes operands longer in the shapes of which a shape shows values inside.
    pub(super) fn join_inner(&mut self, kind: &mut ShapeKind) {
        let shows_inside = match kind {
            ShapeKind::Distance {
                op: Op::Offset,
                parameters,
                ..
            } => {
                let by = self.scene.expressions.as_constant(parameters[0]);
                by.is_none_or(|by| by < 0.0)
            }
            ShapeKind::Distance {
                op: Op::Shell | Op::RoundedExtrude,
                ..
            }
            | ShapeKind::Displace { .. } => true,
            ShapeKind::Combine { op, .. } => {
                !matches!(op, Op::Intersection | Op::Subtraction)
                    && op.row().meta.set != Some(SetOperation::Union)
            }
            _ => false,
        };
        if !shows_inside {
            return;
        }
        let is_subtraction = matches!(kind, ShapeKind::Combine { op, .. }
            if op.row().meta.set == Some(SetOperation::Subtraction));
        // Of a cutter, values outside show.
        let shown = if is_subtraction { 1 } else { usize::MAX };
        for child in children_mut(kind).iter_mut().take(shown) {
            *child = self.joined(*child);
        }
    }

    /// A shape with longer operands where its unions hold what that adds.
    fn joined(&mut self, id: ShapeId) -> ShapeId {
        // What is added might show another paint where the solid is cut.
        if !has_seams(self.scene, id) || !has_one_paint(self.scene, id) {
            return id;
        }
        let mut cut = Cut {
            body: None,
            size: size(&self.bounds(id)),
            present_size: f64::NAN,
            reach: 0.0,
            others: Vec::new(),
        };
        self.cutter(id, &mut Vec::new(), &mut cut)
    }
}

/// Reports whether a shape has parts that may touch each other. Recursion over shapes within shapes, whose depth the
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

/// Reports whether all parts of a shape have the same paint, or none.
fn has_one_paint(scene: &Scene, id: ShapeId) -> bool {
    let mut paints = HashSet::new();
    let mut seen = HashSet::from([id]);
    let mut open = vec![id];
    while let Some(id) = open.pop() {
        let kind = &scene.shapes[id.0 as usize].kind;
        match kind {
            ShapeKind::Painted { material, .. } => {
                paints.insert(Some(*material));
            }
            _ if children(kind).is_empty() => {
                paints.insert(None);
            }
            _ => open.extend(children(kind).iter().filter(|&&child| seen.insert(child))),
        }
    }
    paints.len() <= 1
}
