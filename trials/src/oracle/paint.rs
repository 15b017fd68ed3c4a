//! Paints: the material that a surface shows at a point of it.

use super::combine::Set;
use super::point::Point;
use super::tree::{Kind, NodeId, Tree};
use sdfc_compiler::scene::MaterialId;

impl Tree {
    /// The material of a shape at a point, if there is a paint.
    ///
    /// Of operands whose values differ by no more than `tolerance` the first counts.
    pub(super) fn paint(&self, id: NodeId, p: Point, tolerance: f64) -> Option<MaterialId> {
        let node = self.node(id);
        if !node.is_painted {
            return None;
        }
        match &node.kind {
            Kind::Painted(_, material) => Some(*material),
            Kind::Union { children, .. } => {
                let least = self.value(id, p);
                let is_near = |&&child: &&NodeId| {
                    let extent = &self.node(child).extent;
                    let distance = extent.distance(p);
                    let is_far = distance > 0.0 && extent.rate * distance > least + tolerance;
                    !is_far && self.value(child, p) <= least + tolerance
                };
                let nearest = children.iter().find(is_near)?;
                self.paint(*nearest, p, tolerance)
            }
            Kind::Combine { set, children } => self.combined_paint(*set, children, p, tolerance),
            Kind::Grid(child, grid) => {
                let extent = &self.node(*child).extent;
                let q = self.nearest_copy(*child, |visit| grid.each(extent, p, visit));
                self.paint(*child, q.unwrap_or(p), tolerance)
            }
            Kind::Ring(child, ring) => {
                let extent = &self.node(*child).extent;
                let q = self.nearest_copy(*child, |visit| ring.each(extent, p, visit));
                self.paint(*child, q.unwrap_or(p), tolerance)
            }
            Kind::Frame { child, scale, .. } => {
                let tolerance = tolerance / scale.abs().max(f64::MIN_POSITIVE);
                self.paint(*child, self.seen(node, p), tolerance)
            }
            Kind::Mirror(child, _)
            | Kind::Twist(child, _)
            | Kind::Bend(child, _)
            | Kind::Elongate(child, _)
            | Kind::Elongated { child, .. }
            | Kind::Revolve(child, _)
            | Kind::RevolvePart(child, _, _)
            | Kind::RevolveClose(child, _)
            | Kind::Slice(child)
            | Kind::Extrude(child, _)
            | Kind::RoundedExtrude(child, _, _)
            | Kind::Complement(child)
            | Kind::Offset(child, _)
            | Kind::Shell(child, _)
            | Kind::Scale(child, _)
            | Kind::Warp(child, _)
            | Kind::Displace(child, _) => self.paint(*child, self.seen(node, p), tolerance),
            Kind::Leaf(_) | Kind::Field(_) | Kind::Nothing => None,
        }
    }

    /// The point that the nearest copy sees.
    fn nearest_copy(
        &self,
        child: NodeId,
        each: impl FnOnce(&mut dyn FnMut(Point) -> f64) -> f64,
    ) -> Option<Point> {
        let mut nearest = None;
        let mut least = f64::INFINITY;
        each(&mut |q| {
            let value = self.value(child, q);
            if value < least {
                (least, nearest) = (value, Some(q));
            }
            least
        });
        nearest
    }

    /// The material of a combination. An operand without paint only cuts, and shows no face.
    fn combined_paint(
        &self,
        set: Set,
        children: &[NodeId],
        p: Point,
        tolerance: f64,
    ) -> Option<MaterialId> {
        let mut shown: Option<(NodeId, f64)> = None;
        for (at, &child) in children.iter().enumerate() {
            let value = self.value(child, p);
            // The smaller, the more it shows.
            let hidden = match set {
                Set::Union(_) => value,
                Set::Xor => value.abs(),
                Set::Morph(share) => {
                    if (at == 0) == (share < 0.5) {
                        0.0
                    } else {
                        1.0
                    }
                }
                // The body that something is taken from is no cutter, painted or not.
                Set::Intersection(_) if !self.node(child).is_painted => continue,
                Set::Subtraction(_) if at > 0 && !self.node(child).is_painted => continue,
                Set::Intersection(_) => -value,
                Set::Subtraction(_) => {
                    if at == 0 {
                        -value
                    } else {
                        value
                    }
                }
            };
            let least = shown.map_or(f64::INFINITY, |(_, least)| least);
            if hidden < least - tolerance {
                shown = Some((child, hidden));
            }
        }
        shown.and_then(|(child, _)| self.paint(child, p, tolerance))
    }
}
