//! Paints of cut faces.
//!
//! A face cut by an operand without a paint shows the paint of the body there; an operand with a paint
//! shows its own. Operands may be painted in part: their shapes without paint show the *underlay*, the
//! value of the body. Paints of earlier cutters lie on their faces alone: the underlay is the uncut body.

use super::{LocalPoint, Lowering, ValueUse};
use crate::graph::{GraphNumber, NodeId};
use crate::scene::{Scene, ShapeId, ShapeKind, children};
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;

/// Maximum nesting of operations whose operands are lowered twice.
const MAX_DOUBLINGS: u32 = 8;

/// Part of a shape's surface that has a paint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coverage {
    None,
    Partial,
    Full,
}

/// Returns the coverage of every shape.
pub(super) fn coverage(scene: &Scene) -> Vec<Coverage> {
    let mut coverages: Vec<Coverage> = Vec::with_capacity(scene.shapes.len());
    for shape in &scene.shapes {
        let child_coverage = |id: &ShapeId| coverages[id.0 as usize];
        let coverage = match &shape.kind {
            ShapeKind::Painted { .. } => Coverage::Full,
            ShapeKind::Combine { op, children, .. } => {
                let is_full = match op.row().facts.set {
                    Some(SetOperation::Intersection) => children
                        .iter()
                        .any(|id| child_coverage(id) == Coverage::Full),
                    Some(SetOperation::Subtraction) => {
                        child_coverage(&children[0]) == Coverage::Full
                    }
                    Some(SetOperation::Union) | None => children
                        .iter()
                        .all(|id| child_coverage(id) == Coverage::Full),
                };
                if is_full {
                    Coverage::Full
                } else if children
                    .iter()
                    .all(|id| child_coverage(id) == Coverage::None)
                {
                    Coverage::None
                } else {
                    Coverage::Partial
                }
            }
            // A shape with one operand has the operand's coverage.
            other => children(other)
                .first()
                .map_or(Coverage::None, child_coverage),
        };
        coverages.push(coverage);
    }
    coverages
}

/// Returns for every shape whether operands with a paint cut it or a part of it.
pub(super) fn has_painted_cutters(scene: &Scene, coverage: &[Coverage]) -> Vec<bool> {
    let mut flags: Vec<bool> = Vec::with_capacity(scene.shapes.len());
    for shape in &scene.shapes {
        let is_painted = |id: &ShapeId| coverage[id.0 as usize] != Coverage::None;
        let flag = |id: &ShapeId| flags[id.0 as usize];
        let has_painted_cutters = match &shape.kind {
            ShapeKind::Painted { .. } => false,
            ShapeKind::Combine { op, children, .. }
                if op.row().facts.set == Some(SetOperation::Subtraction) =>
            {
                flag(&children[0]) || children[1..].iter().any(is_painted)
            }
            other => children(other).iter().any(flag),
        };
        flags.push(has_painted_cutters);
    }
    flags
}

impl Lowering<'_> {
    /// Reports whether an operand without paint, or a part of one, shows the paint of one operand among
    /// several.
    pub(super) fn shows_through(&self, op: Op, children: &[ShapeId]) -> bool {
        let child_coverage = |id: &ShapeId| self.coverage[id.0 as usize];
        let is_partial = |id: &ShapeId| child_coverage(id) == Coverage::Partial;
        let is_unpainted = |id: &ShapeId| child_coverage(id) == Coverage::None;
        let is_cut = |id: &ShapeId| self.has_painted_cutters[id.0 as usize];
        let painted = children
            .iter()
            .filter(|id| child_coverage(id) != Coverage::None);
        if self.doublings >= MAX_DOUBLINGS {
            return false;
        }
        match op.row().facts.set {
            Some(SetOperation::Intersection) => {
                painted.clone().count() > 1 && children.iter().any(is_partial)
                    || children.iter().any(is_unpainted) && children.iter().any(is_cut)
            }
            Some(SetOperation::Subtraction) => {
                let cutters = &children[1..];
                let is_body_painted =
                    self.underlay.is_some() || child_coverage(&children[0]) != Coverage::None;
                let is_later_cut = is_cut(&children[0])
                    || cutters
                        .iter()
                        .any(|id| child_coverage(id) != Coverage::None);
                is_body_painted && cutters.iter().any(is_partial)
                    || is_later_cut && cutters.iter().any(is_unpainted)
            }
            Some(SetOperation::Union) | None => false,
        }
    }

    /// Combines shapes from left to right, where parts without paint show the body that they cut.
    pub(super) fn combine_painted(
        &mut self,
        op: Op,
        children: &[ShapeId],
        parameters: &[GraphNumber],
        local_point: LocalPoint,
        [first_point, other_point]: [LocalPoint; 2],
        value_use: ValueUse,
    ) -> NodeId {
        let operand_point = |number: usize| {
            if number == 0 {
                first_point
            } else {
                other_point
            }
        };
        let coverage = |lowering: &Self, number: usize| {
            let child: ShapeId = children[number];
            lowering.coverage[child.0 as usize]
        };
        let chain = |lowering: &mut Self, values: &[NodeId]| {
            let other_values = values[1..].iter();
            other_values.fold(values[0], |left, &right| {
                lowering.apply(op, local_point, vec![left, right], parameters.to_vec())
            })
        };
        self.doublings += 1;
        let first = self.shape(children[0], first_point, value_use);
        let mut painted_values = vec![first];
        if op.row().facts.set == Some(SetOperation::Subtraction) {
            let underlay = self.uncut(children[0], first, first_point, value_use);
            for &child in &children[1..] {
                painted_values.push(self.shape_over(Some(underlay), child, other_point, value_use));
            }
        } else {
            for (number, &child) in children.iter().enumerate().skip(1) {
                painted_values.push(self.shape(child, operand_point(number), value_use));
            }
            let mut underlays = painted_values.clone();
            for (number, &child) in children.iter().enumerate() {
                let node = underlays[number];
                underlays[number] = self.uncut(child, node, operand_point(number), value_use);
            }
            for (number, &child) in children.iter().enumerate() {
                let is_painted = |&other: &usize| coverage(self, other) != Coverage::None;
                let others = (0..children.len()).filter(|&other| other != number);
                let others: Vec<_> = others.filter(is_painted).map(|i| underlays[i]).collect();
                if !others.is_empty() && coverage(self, number) != Coverage::Full {
                    let underlay = chain(self, &others);
                    painted_values[number] =
                        self.shape_over(Some(underlay), child, operand_point(number), value_use);
                }
            }
        }
        self.doublings -= 1;
        chain(self, &painted_values)
    }

    /// Returns the value of a body without its cutters, whose paint shows where others cut it; `node` is the value with
    /// them.
    fn uncut(
        &mut self,
        id: ShapeId,
        node: NodeId,
        local_point: LocalPoint,
        value_use: ValueUse,
    ) -> NodeId {
        if !self.has_painted_cutters[id.0 as usize] {
            return node;
        }
        let outer = std::mem::replace(&mut self.is_uncut, true);
        let uncut = self.shape(id, local_point, value_use);
        self.is_uncut = outer;
        uncut
    }

    /// Lowers a shape over an underlay.
    pub(super) fn shape_over(
        &mut self,
        underlay: Option<NodeId>,
        id: ShapeId,
        local_point: LocalPoint,
        value_use: ValueUse,
    ) -> NodeId {
        let outer = std::mem::replace(&mut self.underlay, underlay);
        let node = self.shape(id, local_point, value_use);
        self.underlay = outer;
        node
    }

    /// Returns a value with the paint of another one.
    pub(super) fn with_paint_of(
        &mut self,
        paint: NodeId,
        value: NodeId,
        local_point: LocalPoint,
    ) -> NodeId {
        // The result of arithmetic has the paint of its first operand.
        let difference = self.apply(Op::Sub, local_point, vec![paint, value], Vec::new());
        self.apply(Op::Sub, local_point, vec![paint, difference], Vec::new())
    }
}
