//! Maps of combined shapes, as combinations of mapped shapes.
//!
//! A bent or stretched shape is divided by a bound of its slope as a whole (`lower/step.rs`). Of a union the
//! smallest value counts, so one operand that is written times a constant would hide another that is nearer from light,
//! or be hidden by it. Hard unions, intersections and subtractions therefore go above the map, where each operand has
//! a bound of its own. The values that the scene writes stay the same.

use crate::scene::{Scene, ShapeId, ShapeKind, children, children_mut};
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// The shape with its combinations above its maps: the same one where nothing changes, else a new one behind all others.
pub(crate) fn distributed(scene: &mut Scene, root: ShapeId) -> ShapeId {
    let mut distribution = Distribution {
        scene,
        known: HashMap::new(),
        uneven: HashMap::new(),
    };
    distribution.all(root)
}

struct Distribution<'s> {
    scene: &'s mut Scene,
    /// The shapes that were looked at, and what they became.
    known: HashMap<ShapeId, ShapeId>,
    /// The shapes of which it is known whether their values are of different steepness than distances.
    uneven: HashMap<ShapeId, bool>,
}

impl Distribution<'_> {
    /// Recursion over shapes within shapes, whose depth the elaborator bounds; so are those below.
    fn all(&mut self, id: ShapeId) -> ShapeId {
        if let Some(&known) = self.known.get(&id) {
            return known;
        }
        let old = self.kind(id).clone();
        let mut kind = old.clone();
        for child in children_mut(&mut kind) {
            *child = self.all(*child);
        }
        let is_same = children(&old) == children(&kind);
        let mut new = if is_same {
            id
        } else {
            self.scene.derived(id, kind)
        };
        if is_map(self.kind(new)) {
            new = self.above(new);
        }
        self.known.insert(id, new);
        new
    }

    /// A map of a combination as a combination of maps.
    fn above(&mut self, id: ShapeId) -> ShapeId {
        let Some(&child) = children(self.kind(id)).first() else {
            return id;
        };
        let Some((op, operands)) = self.operands(child) else {
            return id;
        };
        // What a displacement adds to both sides of a difference does not cancel.
        if matches!(self.kind(id), ShapeKind::Displace { .. }) && op == Op::Subtraction {
            return id;
        }
        let mapped = operands
            .into_iter()
            .map(|operand| {
                let mapped = self.like(id, operand);
                self.above(mapped)
            })
            .collect();
        let kind = ShapeKind::Combine {
            op,
            children: mapped,
            parameters: Vec::new(),
        };
        self.scene.derived(id, kind)
    }

    /// The operation and the operands that a shape is made of, if their values are of different steepness.
    fn operands(&mut self, id: ShapeId) -> Option<(Op, Vec<ShapeId>)> {
        match self.kind(id).clone() {
            ShapeKind::Combine { op, children, .. } => {
                let is_hard = matches!(op, Op::Union | Op::Intersection | Op::Subtraction);
                (is_hard && self.is_uneven(id)).then(|| (op, self.grouped(id, op, children)))
            }
            ShapeKind::Painted { child, .. } | ShapeKind::Frame { child, .. } => {
                let (op, operands) = self.operands(child)?;
                let operands = operands.into_iter().map(|operand| self.like(id, operand));
                Some((op, operands.collect()))
            }
            _ => None,
        }
    }

    /// Operands side by side whose values are distances, as one operand. Their order stays: it decides the material.
    fn grouped(&mut self, id: ShapeId, op: Op, operands: Vec<ShapeId>) -> Vec<ShapeId> {
        if op.row().meta.set == Some(SetOperation::Subtraction) {
            return operands;
        }
        let mut groups: Vec<(bool, Vec<ShapeId>)> = Vec::new();
        for operand in operands {
            let is_uneven = self.is_uneven(operand);
            match groups.last_mut() {
                Some((false, group)) if !is_uneven => group.push(operand),
                _ => groups.push((is_uneven, vec![operand])),
            }
        }
        let groups = groups.into_iter().map(|(_, group)| match group[..] {
            [operand] => operand,
            _ => {
                let kind = ShapeKind::Combine {
                    op,
                    children: group,
                    parameters: Vec::new(),
                };
                self.scene.derived(id, kind)
            }
        });
        groups.collect()
    }

    /// Reports whether a shape holds values that are no distances.
    fn is_uneven(&mut self, id: ShapeId) -> bool {
        if let Some(&known) = self.uneven.get(&id) {
            return known;
        }
        let kind = self.kind(id).clone();
        let is_uneven = matches!(kind, ShapeKind::Field { .. })
            || is_map(&kind)
            || children(&kind).iter().any(|&child| self.is_uneven(child));
        self.uneven.insert(id, is_uneven);
        is_uneven
    }

    fn kind(&self, id: ShapeId) -> &ShapeKind {
        &self.scene.shapes[id.0 as usize].kind
    }

    /// A shape with another child.
    fn like(&mut self, id: ShapeId, child: ShapeId) -> ShapeId {
        let mut kind = self.kind(id).clone();
        for own in children_mut(&mut kind) {
            *own = child;
        }
        self.scene.derived(id, kind)
    }
}

/// Reports whether a shape is turned into a step with all that lies behind it.
fn is_map(kind: &ShapeKind) -> bool {
    matches!(
        kind,
        ShapeKind::Warp { .. }
            | ShapeKind::Displace { .. }
            | ShapeKind::Domain {
                op: Op::Twist | Op::Bend,
                ..
            }
    )
}
