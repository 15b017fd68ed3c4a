//! Moves set operations above maps of space.
//!
//! A bent or stretched shape is divided by a slope bound of the entire shape (`lower/step.rs`). A union takes
//! the minimum: an operand with a large constant factor would hide a nearer operand from light, or be hidden
//! by it. Hard unions, intersections and subtractions are therefore moved above the map, where each operand
//! has a slope bound of its own. The values that the scene defines stay the same.

use crate::scene::{Scene, ShapeId, ShapeKind, children, children_mut};
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Moves set operations in a shape above maps. Returns the same shape if nothing changes, else a new one
/// after all others.
pub(crate) fn distribute_maps(scene: &mut Scene, root: ShapeId) -> ShapeId {
    let mut distribution = MapDistributor {
        scene,
        results: HashMap::new(),
        scaled: HashMap::new(),
    };
    distribution.distribute(root)
}

struct MapDistributor<'s> {
    scene: &'s mut Scene,
    /// Results of `distribute`.
    results: HashMap<ShapeId, ShapeId>,
    /// Cached results of `has_scaled_values`.
    scaled: HashMap<ShapeId, bool>,
}

impl MapDistributor<'_> {
    /// Distributes the maps of space in a shape over the operands below them. It recurses over nested shapes,
    /// whose depth the elaborator bounds; the same holds for the functions below.
    fn distribute(&mut self, id: ShapeId) -> ShapeId {
        if let Some(&result) = self.results.get(&id) {
            return result;
        }
        let original = self.kind(id).clone();
        let mut kind = original.clone();
        for child in children_mut(&mut kind) {
            *child = self.distribute(*child);
        }
        let is_same = children(&original) == children(&kind);
        let mut new = if is_same {
            id
        } else {
            self.scene.derived(id, kind)
        };
        if is_space_map(self.kind(new)) {
            new = self.lift_combination(new);
        }
        self.results.insert(id, new);
        new
    }

    /// Replaces a map of a set operation by the set operation of maps.
    fn lift_combination(&mut self, id: ShapeId) -> ShapeId {
        let Some(&child) = children(self.kind(id)).first() else {
            return id;
        };
        let Some((op, operands)) = self.liftable_operands(child) else {
            return id;
        };
        // A displacement would be added to both sides of a subtraction, where it does not cancel.
        if matches!(self.kind(id), ShapeKind::Displace { .. }) && op == Op::Subtraction {
            return id;
        }
        let mapped = operands
            .into_iter()
            .map(|operand| {
                let mapped = self.with_child(id, operand);
                self.lift_combination(mapped)
            })
            .collect();
        let kind = ShapeKind::Combine {
            op,
            children: mapped,
            parameters: Vec::new(),
        };
        self.scene.derived(id, kind)
    }

    /// Returns the set operation and the operands of a shape, if the slopes of their values may differ from 1.
    fn liftable_operands(&mut self, id: ShapeId) -> Option<(Op, Vec<ShapeId>)> {
        match self.kind(id).clone() {
            ShapeKind::Combine { op, children, .. } => {
                let is_hard = matches!(op, Op::Union | Op::Intersection | Op::Subtraction);
                (is_hard && self.has_scaled_values(id))
                    .then(|| (op, self.group_distances(id, op, children)))
            }
            ShapeKind::Painted { child, .. } | ShapeKind::Frame { child, .. } => {
                let (op, operands) = self.liftable_operands(child)?;
                let operands = operands
                    .into_iter()
                    .map(|operand| self.with_child(id, operand));
                Some((op, operands.collect()))
            }
            _ => None,
        }
    }

    /// Groups adjacent operands whose values are distances. The order stays, since it decides the material.
    fn group_distances(&mut self, id: ShapeId, op: Op, operands: Vec<ShapeId>) -> Vec<ShapeId> {
        if op.row().facts.set == Some(SetOperation::Subtraction) {
            return operands;
        }
        let mut groups: Vec<(bool, Vec<ShapeId>)> = Vec::new();
        for operand in operands {
            let is_scaled = self.has_scaled_values(operand);
            match groups.last_mut() {
                Some((false, group)) if !is_scaled => group.push(operand),
                _ => groups.push((is_scaled, vec![operand])),
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

    /// Reports whether a shape contains values whose slopes may differ from 1.
    fn has_scaled_values(&mut self, id: ShapeId) -> bool {
        if let Some(&result) = self.scaled.get(&id) {
            return result;
        }
        let kind = self.kind(id).clone();
        let is_scaled = matches!(kind, ShapeKind::Field { .. })
            || is_space_map(&kind)
            || children(&kind)
                .iter()
                .any(|&child| self.has_scaled_values(child));
        self.scaled.insert(id, is_scaled);
        is_scaled
    }

    fn kind(&self, id: ShapeId) -> &ShapeKind {
        &self.scene.shapes[id.0 as usize].kind
    }

    /// Replaces the child of a shape.
    fn with_child(&mut self, id: ShapeId, child: ShapeId) -> ShapeId {
        let mut kind = self.kind(id).clone();
        for operand in children_mut(&mut kind) {
            *operand = child;
        }
        self.scene.derived(id, kind)
    }
}

/// Reports whether a shape is lowered to a step together with everything inside it.
pub(crate) fn is_space_map(kind: &ShapeKind) -> bool {
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
