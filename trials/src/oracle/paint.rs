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

    /// The material of a combination: that of the operand whose surface is nearest, if it has a paint there.
    ///
    /// A face without a paint that a cutter makes shows the paint of the body, and one of an intersection that of
    /// the nearest other operand.
    fn combined_paint(
        &self,
        set: Set,
        children: &[NodeId],
        p: Point,
        tolerance: f64,
    ) -> Option<MaterialId> {
        // The smaller, the more an operand shows.
        let hidden = |at: usize, child: NodeId| match set {
            Set::Union(_) => self.value(child, p),
            Set::Xor => self.value(child, p).abs(),
            Set::Morph(share) => f64::from((at == 0) != (share < 0.5)),
            Set::Intersection(_) => -self.value(child, p),
            Set::Subtraction(_) if at == 0 => -self.value(child, p),
            Set::Subtraction(_) => self.value(child, p),
        };
        let nearest = |is_left_out: &dyn Fn(usize) -> bool| {
            let mut shown: Option<(usize, f64)> = None;
            for (at, &child) in children.iter().enumerate() {
                let least = shown.map_or(f64::INFINITY, |(_, least)| least);
                if !is_left_out(at) && hidden(at, child) < least - tolerance {
                    shown = Some((at, hidden(at, child)));
                }
            }
            shown.map(|(at, _)| at)
        };
        let paint = |at: usize| self.paint(children[at], p, tolerance);
        let first = nearest(&|_| false)?;
        paint(first).or_else(|| match set {
            Set::Subtraction(_) => paint(0),
            Set::Intersection(_) => {
                let is_other = |at| at != first && self.node(children[at]).is_painted;
                nearest(&|at| !is_other(at)).and_then(paint)
            }
            Set::Union(_) | Set::Xor | Set::Morph(_) => None,
        })
    }
}
