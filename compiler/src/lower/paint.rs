//! Paints of cut faces.
//!
//! A face without a paint that an operand makes shows the paint of what it cuts there, and the operand's own paint
//! where it has one. Operands may be painted in part: their shapes without paint take on that of the *underlay*,
//! the value of what is cut.

use super::{At, Lowering, Wanted};
use crate::graph::{NodeId, Number};
use crate::scene::{Scene, ShapeId, ShapeKind, children};
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;

/// The deepest nesting of operations whose operands are lowered twice.
const MAX_DOUBLINGS: u32 = 8;

/// The part of a shape's surface that has a paint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coverage {
    None,
    Partial,
    Full,
}

/// The coverage of every shape.
pub(super) fn coverage(scene: &Scene) -> Vec<Coverage> {
    let mut all: Vec<Coverage> = Vec::with_capacity(scene.shapes.len());
    for shape in &scene.shapes {
        let of = |id: &ShapeId| all[id.0 as usize];
        let coverage = match &shape.kind {
            ShapeKind::Painted { .. } => Coverage::Full,
            ShapeKind::Combine { op, children, .. } => {
                let is_full = match op.row().meta.set {
                    Some(SetOperation::Intersection) => {
                        children.iter().any(|id| of(id) == Coverage::Full)
                    }
                    Some(SetOperation::Subtraction) => of(&children[0]) == Coverage::Full,
                    Some(SetOperation::Union) | None => {
                        children.iter().all(|id| of(id) == Coverage::Full)
                    }
                };
                if is_full {
                    Coverage::Full
                } else if children.iter().all(|id| of(id) == Coverage::None) {
                    Coverage::None
                } else {
                    Coverage::Partial
                }
            }
            // A shape with one operand has that of this.
            other => children(other).first().map_or(Coverage::None, of),
        };
        all.push(coverage);
    }
    all
}

impl Lowering<'_> {
    /// Tells if an operand without paint, or a part of one, shows the paint of one operand among others.
    pub(super) fn shows_through(&self, op: Op, children: &[ShapeId]) -> bool {
        let of = |id: &ShapeId| self.coverage[id.0 as usize];
        let is_partial = |id: &ShapeId| of(id) == Coverage::Partial;
        let painted = children.iter().filter(|id| of(id) != Coverage::None);
        if self.doublings >= MAX_DOUBLINGS {
            return false;
        }
        match op.row().meta.set {
            Some(SetOperation::Intersection) => {
                painted.clone().count() > 1 && children.iter().any(is_partial)
            }
            Some(SetOperation::Subtraction) => {
                let cutters = &children[1..];
                let is_body_painted = self.underlay.is_some() || of(&children[0]) != Coverage::None;
                let is_mixed = cutters.iter().any(|id| of(id) == Coverage::None)
                    && cutters.iter().any(|id| of(id) != Coverage::None);
                is_body_painted && (is_mixed || cutters.iter().any(is_partial))
            }
            Some(SetOperation::Union) | None => false,
        }
    }

    /// Shapes combined from left to right, where parts without paint show what they cut.
    pub(super) fn combine_painted(
        &mut self,
        op: Op,
        children: &[ShapeId],
        parameters: &[Number],
        at: At,
        [at_first, at_others]: [At; 2],
        wanted: Wanted,
    ) -> NodeId {
        let place = |number: usize| if number == 0 { at_first } else { at_others };
        let coverage = |lowering: &Self, number: usize| {
            let child: ShapeId = children[number];
            lowering.coverage[child.0 as usize]
        };
        let chain = |lowering: &mut Self, values: &[NodeId]| {
            let rest = values[1..].iter();
            rest.fold(values[0], |left, &right| {
                lowering.apply(op, at, vec![left, right], parameters.to_vec())
            })
        };
        self.doublings += 1;
        let first = self.shape(children[0], at_first, wanted);
        let mut shown = vec![first];
        if op.row().meta.set == Some(SetOperation::Subtraction) {
            for &child in &children[1..] {
                shown.push(self.shape_over(Some(first), child, at_others, wanted));
            }
        } else {
            for (number, &child) in children.iter().enumerate().skip(1) {
                shown.push(self.shape(child, place(number), wanted));
            }
            let plain = shown.clone();
            for (number, &child) in children.iter().enumerate() {
                let is_painted = |&other: &usize| coverage(self, other) != Coverage::None;
                let others = (0..children.len()).filter(|&other| other != number);
                let others: Vec<_> = others.filter(is_painted).map(|i| plain[i]).collect();
                if !others.is_empty() && coverage(self, number) != Coverage::Full {
                    let below = chain(self, &others);
                    shown[number] = self.shape_over(Some(below), child, place(number), wanted);
                }
            }
        }
        self.doublings -= 1;
        chain(self, &shown)
    }

    /// A shape over an underlay.
    pub(super) fn shape_over(
        &mut self,
        underlay: Option<NodeId>,
        id: ShapeId,
        at: At,
        wanted: Wanted,
    ) -> NodeId {
        let outer = std::mem::replace(&mut self.underlay, underlay);
        let node = self.shape(id, at, wanted);
        self.underlay = outer;
        node
    }

    /// A value with the paint of another one.
    pub(super) fn painted_like(&mut self, paint: NodeId, value: NodeId, at: At) -> NodeId {
        // Arithmetic hands on the paint of its first operand.
        let difference = self.apply(Op::Sub, at, vec![paint, value], Vec::new());
        self.apply(Op::Sub, at, vec![paint, difference], Vec::new())
    }
}
