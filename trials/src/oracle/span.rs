//! Spans of a shape's value within a radius of a point, to prove that its sign stays.

use super::combine::{Edge, Set};
use super::point::{Point, norm, norm2};
use super::range::Range;
use super::solids::extruded;
use super::tree::{Kind, Node, NodeId, Tree};

impl Tree {
    /// The span of a shape's value within a radius of a point.
    pub(super) fn span(&self, id: NodeId, p: Point, radius: f64) -> Range {
        let node = self.node(id);
        if node.steepness.is_finite() {
            return Range::around(self.value(id, p), node.steepness * radius);
        }
        self.made_span(node, p, radius)
    }

    /// The span for a shape whose steepness is not known.
    pub(super) fn made_span(&self, node: &Node, p: Point, radius: f64) -> Range {
        let same = |child: NodeId| self.span(child, p, radius);
        let seen = |child: NodeId, radius: f64| self.span(child, self.seen(node, p), radius);
        match &node.kind {
            Kind::Field(formula) => formula.range(p, radius)[0],
            Kind::Displace(child, formula) => same(*child).plus(formula.range(p, radius)[0]),
            Kind::Warp(child, formula) => {
                let image = formula.range(p, radius);
                let middle = image.map(|r| 0.5 * (r.low + r.high));
                let reach = norm(image.map(|r| 0.5 * (r.high - r.low)));
                if !reach.is_finite() {
                    return Range::EVERYTHING;
                }
                self.span(*child, middle, reach)
            }
            Kind::Twist(child, rate) => {
                let stretch = 1.0 + rate.abs() * (norm2(p[0], p[2]) + radius);
                seen(*child, radius * stretch)
            }
            Kind::Bend(child, rate) => {
                let stretch = 1.0 + rate.abs() * (norm2(p[0], p[1]) + radius);
                seen(*child, radius * stretch)
            }
            Kind::Frame {
                child,
                scale,
                stretch,
                ..
            } => seen(*child, radius * stretch).rising(|v| v * scale.abs()),
            Kind::Offset(child, by) => same(*child).rising(|v| v - by),
            Kind::Shell(child, half) => same(*child).magnitude().rising(|v| v - half),
            Kind::Complement(child) => same(*child).negated(),
            Kind::Scale(child, factor) => same(*child).rising(|v| v * factor.abs()),
            Kind::Extrude(child, half) => {
                let height = Range::around(p[2], radius).magnitude().rising(|v| v - half);
                let figure = same(*child);
                Range::new(
                    extruded(figure.low, height.low),
                    extruded(figure.high, height.high),
                )
            }
            Kind::RoundedExtrude(child, half, round) => {
                let height = Range::around(p[2], radius).magnitude();
                let at = |figure: f64, height: f64| {
                    extruded(figure + round, height - half + round) - round
                };
                let figure = same(*child);
                Range::new(at(figure.low, height.low), at(figure.high, height.high))
            }
            Kind::Union { children, .. } => {
                let spans = children.iter().map(|&child| same(child));
                spans.reduce(Range::least).unwrap_or(Range::EVERYTHING)
            }
            Kind::Combine { set, children } => {
                let spans = children.iter().map(|&child| same(child));
                let combined = spans.reduce(|a, b| set.span(a, b));
                combined.unwrap_or(Range::EVERYTHING)
            }
            Kind::Mirror(child, _)
            | Kind::Elongate(child, _)
            | Kind::Revolve(child, _)
            | Kind::RevolvePart(child, _, _)
            | Kind::Slice(child) => seen(*child, radius),
            Kind::Painted(child, _) => same(*child),
            Kind::Leaf(_)
            | Kind::Grid(..)
            | Kind::Ring(..)
            | Kind::Elongated { .. }
            | Kind::RevolveClose(..)
            | Kind::Nothing => Range::EVERYTHING,
        }
    }
}

impl Set {
    /// The span of the value of two.
    fn span(self, a: Range, b: Range) -> Range {
        let union = |edge: Edge, a: Range, b: Range| {
            let hard = a.least(b);
            Range::new(hard.low - edge.depth(), hard.high)
        };
        match self {
            Self::Union(edge) => union(edge, a, b),
            Self::Intersection(edge) => union(edge, a.negated(), b.negated()).negated(),
            Self::Subtraction(edge) => union(edge, a.negated(), b).negated(),
            Self::Xor => a.least(b).greatest(a.greatest(b).negated()),
            Self::Morph(share) => {
                let part = |range: Range, share: f64| range.rising(|v| v * share);
                part(a, 1.0 - share).plus(part(b, share))
            }
        }
    }
}
