//! Materials that a surface shows at a point on it.

use super::combine::SetOp;
use super::point::Point;
use super::tree::{NodeKind, ShapeTree, TreeNodeId};
use sdfc_compiler::scene::MaterialId;

/// Rules by which a material is read.
#[derive(Clone, Copy)]
pub(super) struct MaterialRules {
    /// Largest difference of operand values that counts as equal. The first of equal operands counts.
    pub(super) tolerance: f64,
    /// Set if cutters are ignored: a later cut bares the body, and not the faces of earlier cuts.
    pub(super) is_uncut: bool,
}

impl ShapeTree {
    /// Returns the material of a shape at a point, if one is assigned.
    pub(super) fn material_at(
        &self,
        id: TreeNodeId,
        p: Point,
        rules: MaterialRules,
    ) -> Option<MaterialId> {
        let tolerance = rules.tolerance;
        let node = self.node(id);
        if !node.has_material {
            return None;
        }
        match &node.kind {
            NodeKind::WithMaterial(_, material) => Some(*material),
            NodeKind::Union { children, .. } => {
                let min_value = self.value(id, p);
                let is_near = |&&child: &&TreeNodeId| {
                    let bounds = &self.node(child).bounds;
                    let distance = bounds.distance(p);
                    let is_far =
                        distance > 0.0 && bounds.distance_ratio * distance > min_value + tolerance;
                    !is_far && self.value(child, p) <= min_value + tolerance
                };
                let nearest = children.iter().find(is_near)?;
                self.material_at(*nearest, p, rules)
            }
            NodeKind::Combine {
                set_op: SetOp::Subtraction(_),
                children,
            } if rules.is_uncut => self.material_at(children[0], p, rules),
            NodeKind::Combine { set_op, children } => {
                self.combined_material(*set_op, children, p, rules)
            }
            NodeKind::CopyGrid(child, grid) => {
                let bounds = &self.node(*child).bounds;
                let q = self.nearest_copy(*child, |visit| grid.for_each_copy(bounds, p, visit));
                self.material_at(*child, q.unwrap_or(p), rules)
            }
            NodeKind::CopyRing(child, ring) => {
                let bounds = &self.node(*child).bounds;
                let q = self.nearest_copy(*child, |visit| ring.for_each_copy(bounds, p, visit));
                self.material_at(*child, q.unwrap_or(p), rules)
            }
            NodeKind::Frame { child, scale, .. } => {
                let rules = MaterialRules {
                    tolerance: tolerance / scale.abs().max(f64::MIN_POSITIVE),
                    ..rules
                };
                self.material_at(*child, self.child_point(node, p), rules)
            }
            NodeKind::Mirror(child, _)
            | NodeKind::Twist(child, _)
            | NodeKind::Bend(child, _)
            | NodeKind::Elongate(child, _)
            | NodeKind::ElongateCorrect { child, .. }
            | NodeKind::Revolve(child, _)
            | NodeKind::RevolvePart(child, _, _)
            | NodeKind::RevolveClose(child, _)
            | NodeKind::Slice(child)
            | NodeKind::Extrude(child, _)
            | NodeKind::RoundedExtrude(child, _, _)
            | NodeKind::Complement(child)
            | NodeKind::Offset(child, _)
            | NodeKind::Shell(child, _)
            | NodeKind::Scale(child, _)
            | NodeKind::Warp(child, _)
            | NodeKind::Displace(child, _) => {
                self.material_at(*child, self.child_point(node, p), rules)
            }
            NodeKind::Leaf(_) | NodeKind::Field(_) | NodeKind::Nothing => None,
        }
    }

    /// Returns the local point of the nearest copy.
    fn nearest_copy(
        &self,
        child: TreeNodeId,
        for_each_copy: impl FnOnce(&mut dyn FnMut(Point) -> f64) -> f64,
    ) -> Option<Point> {
        let mut nearest = None;
        let mut min_value = f64::INFINITY;
        for_each_copy(&mut |q| {
            let value = self.value(child, q);
            if value < min_value {
                (min_value, nearest) = (value, Some(q));
            }
            min_value
        });
        nearest
    }

    /// Returns the material of a combination: that of the operand with the nearest surface, if it has one.
    ///
    /// A face of a subtraction whose cutter has no material there shows the body's material. A face of an
    /// intersection without one shows that of the nearest other operand.
    fn combined_material(
        &self,
        set_op: SetOp,
        children: &[TreeNodeId],
        p: Point,
        rules: MaterialRules,
    ) -> Option<MaterialId> {
        let tolerance = rules.tolerance;
        // The operand with the smallest rank is visible.
        let depth_rank = |index: usize, child: TreeNodeId| match set_op {
            SetOp::Union(_) => self.value(child, p),
            SetOp::Xor => self.value(child, p).abs(),
            SetOp::Morph(fraction) => f64::from((index == 0) != (fraction < 0.5)),
            SetOp::Intersection(_) => -self.value(child, p),
            SetOp::Subtraction(_) if index == 0 => -self.value(child, p),
            SetOp::Subtraction(_) => self.value(child, p),
        };
        let nearest = |is_excluded: &dyn Fn(usize) -> bool| {
            let mut best: Option<(usize, f64)> = None;
            for (index, &child) in children.iter().enumerate() {
                let min_value = best.map_or(f64::INFINITY, |(_, min_value)| min_value);
                if !is_excluded(index) && depth_rank(index, child) < min_value - tolerance {
                    best = Some((index, depth_rank(index, child)));
                }
            }
            best.map(|(index, _)| index)
        };
        let material_at = |index: usize| self.material_at(children[index], p, rules);
        let uncut_material_at = |index: usize| {
            let rules = MaterialRules {
                is_uncut: true,
                ..rules
            };
            self.material_at(children[index], p, rules)
        };
        let front = nearest(&|_| false)?;
        material_at(front).or_else(|| match set_op {
            SetOp::Subtraction(_) => uncut_material_at(0),
            SetOp::Intersection(_) => {
                let is_other = |index| index != front && self.node(children[index]).has_material;
                nearest(&|index| !is_other(index)).and_then(uncut_material_at)
            }
            SetOp::Union(_) | SetOp::Xor | SetOp::Morph(_) => None,
        })
    }
}
