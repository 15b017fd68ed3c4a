//! Ranges of a shape's value within a radius of a point, to prove that its sign is constant.

use super::combine::{EdgeProfile, SetOp};
use super::point::{Point, norm, norm2};
use super::range::ValueRange;
use super::solids::extrusion_distance;
use super::tree::{NodeKind, ShapeTree, TreeNode, TreeNodeId};

impl ShapeTree {
    /// Returns the range of a shape's value within a radius of a point.
    pub(super) fn span(&self, id: TreeNodeId, p: Point, radius: f64) -> ValueRange {
        let node = self.node(id);
        if node.slope_bound.is_finite() {
            return ValueRange::centred(self.value(id, p), node.slope_bound * radius);
        }
        self.derived_span(node, p, radius)
    }

    /// Returns the range for a shape derived from other values or formulas, by interval arithmetic.
    pub(super) fn derived_span(&self, node: &TreeNode, p: Point, radius: f64) -> ValueRange {
        let unmoved = |child: TreeNodeId| self.span(child, p, radius);
        let child_point =
            |child: TreeNodeId, radius: f64| self.span(child, self.child_point(node, p), radius);
        match &node.kind {
            NodeKind::Field(formula) => formula.range(p, radius)[0],
            NodeKind::Displace(child, formula) => unmoved(*child).plus(formula.range(p, radius)[0]),
            NodeKind::Warp(child, formula) => {
                let image = formula.range(p, radius);
                let image_centre = image.map(|r| 0.5 * (r.low + r.high));
                let image_radius = norm(image.map(|r| 0.5 * (r.high - r.low)));
                if !image_radius.is_finite() {
                    return ValueRange::UNBOUNDED;
                }
                self.span(*child, image_centre, image_radius)
            }
            NodeKind::Twist(child, distance_ratio) => {
                let stretch = 1.0 + distance_ratio.abs() * (norm2(p[0], p[2]) + radius);
                child_point(*child, radius * stretch)
            }
            NodeKind::Bend(child, distance_ratio) => {
                let stretch = 1.0 + distance_ratio.abs() * (norm2(p[0], p[1]) + radius);
                child_point(*child, radius * stretch)
            }
            NodeKind::Frame {
                child,
                scale,
                stretch,
                ..
            } => child_point(*child, radius * stretch).map_increasing(|v| v * scale.abs()),
            NodeKind::Offset(child, by) => unmoved(*child).map_increasing(|v| v - by),
            NodeKind::Shell(child, half) => unmoved(*child).abs().map_increasing(|v| v - half),
            NodeKind::Complement(child) => unmoved(*child).negated(),
            NodeKind::Scale(child, factor) => unmoved(*child).map_increasing(|v| v * factor.abs()),
            NodeKind::Extrude(child, half) => {
                let height = ValueRange::centred(p[2], radius)
                    .abs()
                    .map_increasing(|v| v - half);
                let shape_2d = unmoved(*child);
                ValueRange::new(
                    extrusion_distance(shape_2d.low, height.low),
                    extrusion_distance(shape_2d.high, height.high),
                )
            }
            NodeKind::RoundedExtrude(child, half, round) => {
                let height = ValueRange::centred(p[2], radius).abs();
                let rounded_extrusion = |shape_2d: f64, height: f64| {
                    extrusion_distance(shape_2d + round, height - half + round) - round
                };
                let shape_2d = unmoved(*child);
                ValueRange::new(
                    rounded_extrusion(shape_2d.low, height.low),
                    rounded_extrusion(shape_2d.high, height.high),
                )
            }
            NodeKind::Union { children, .. } => {
                let spans = children.iter().map(|&child| unmoved(child));
                spans
                    .reduce(ValueRange::min)
                    .unwrap_or(ValueRange::UNBOUNDED)
            }
            NodeKind::Combine { set_op, children } => {
                let spans = children.iter().map(|&child| unmoved(child));
                let combined = spans.reduce(|a, b| set_op.span(a, b));
                combined.unwrap_or(ValueRange::UNBOUNDED)
            }
            NodeKind::Mirror(child, _)
            | NodeKind::Elongate(child, _)
            | NodeKind::Revolve(child, _)
            | NodeKind::RevolvePart(child, _, _)
            | NodeKind::Slice(child) => child_point(*child, radius),
            NodeKind::WithMaterial(child, _) => unmoved(*child),
            NodeKind::Leaf(_)
            | NodeKind::CopyGrid(..)
            | NodeKind::CopyRing(..)
            | NodeKind::ElongateCorrect { .. }
            | NodeKind::RevolveClose(..)
            | NodeKind::Nothing => ValueRange::UNBOUNDED,
        }
    }
}

impl SetOp {
    /// Returns the range of the combined value.
    fn span(self, a: ValueRange, b: ValueRange) -> ValueRange {
        let union = |profile: EdgeProfile, a: ValueRange, b: ValueRange| {
            let hard = a.min(b);
            ValueRange::new(hard.low - profile.max_offset(), hard.high)
        };
        match self {
            Self::Union(profile) => union(profile, a, b),
            Self::Intersection(profile) => union(profile, a.negated(), b.negated()).negated(),
            Self::Subtraction(profile) => union(profile, a.negated(), b).negated(),
            Self::Xor => a.min(b).max(a.max(b).negated()),
            Self::Morph(share) => {
                let part = |range: ValueRange, share: f64| range.map_increasing(|v| v * share);
                part(a, 1.0 - share).plus(part(b, share))
            }
        }
    }
}
