//! Facts of shapes that follow from those of their operands: boxes and slopes.

use super::combine::Set;
use super::extent::{Extent, stretches};
use super::tree::{Kind, Node, NodeId, Tree};

/// The fewest formulas' radii across a box.
const MIN_GRAINS_PER_BOX: f64 = 500.0;

/// The node of a kind, whose operands are among these nodes.
pub(super) fn node(nodes: &[Node], kind: Kind) -> Node {
    let facts = Facts { nodes };
    let is_painted = |id: &NodeId| facts.node(*id).is_painted;
    Node {
        extent: facts.extent(&kind),
        steepness: facts.steepness(&kind),
        grain: f64::INFINITY,
        is_painted: matches!(kind, Kind::Painted(..)) || operands(&kind).iter().any(is_painted),
        kind,
    }
}

/// The nodes that operands are among.
struct Facts<'n> {
    nodes: &'n [Node],
}

impl Facts<'_> {
    fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id as usize]
    }

    fn extent(&self, kind: &Kind) -> Extent {
        let inner = |id: NodeId| self.node(id).extent;
        match kind {
            Kind::Leaf(leaf) => leaf.extent,
            Kind::Union { children, .. } => hull(children.iter().map(|&id| inner(id))),
            Kind::Combine { set, children } => {
                let mut extents = children.iter().map(|&id| inner(id));
                match set {
                    Set::Union(edge) => {
                        let depth = edge.depth() * (children.len() - 1) as f64;
                        hull(extents).grown(depth)
                    }
                    Set::Intersection(_) => extents
                        .reduce(|a, b| a.common(&b))
                        .unwrap_or(Extent::EVERYWHERE),
                    Set::Subtraction(_) => extents.next().unwrap_or(Extent::EVERYWHERE),
                    Set::Xor | Set::Morph(_) => hull(extents),
                }
            }
            Kind::Frame {
                child,
                matrix,
                scale,
                ..
            } => inner(*child).mapped(matrix, *scale, stretches(matrix)[0]),
            Kind::Grid(child, grid) => grid.extent(&inner(*child)),
            Kind::Ring(child, ring) => inner(*child).turned(ring.axis()),
            Kind::Mirror(child, axes) => {
                let mut extent = inner(*child);
                for axis in (0..3).filter(|&axis| axes[axis]) {
                    extent.high[axis] = extent.high[axis].max(0.0);
                    extent.low[axis] = -extent.high[axis];
                }
                extent
            }
            Kind::Twist(child, _) => inner(*child).turned(1),
            Kind::Bend(child, _) => inner(*child).turned(2),
            Kind::Elongate(child, half) => inner(*child).widened(*half),
            Kind::Revolve(child, offset) => revolved(&inner(*child), *offset),
            Kind::RevolveClose(child, _) => match &self.node(*child).kind {
                Kind::RevolvePart(figure, offset, _) => revolved(&inner(*figure), *offset),
                _ => Extent::EVERYWHERE,
            },
            Kind::Slice(child) => flat(&inner(*child), f64::INFINITY),
            Kind::Extrude(child, half) => flat(&inner(*child), *half),
            Kind::RoundedExtrude(child, half, _) => {
                let extent = flat(&inner(*child), *half);
                extent.with_rate(extent.rate * std::f64::consts::FRAC_1_SQRT_2)
            }
            Kind::Offset(child, by) => inner(*child).grown(*by),
            Kind::Shell(child, half) => inner(*child).grown(*half),
            Kind::Scale(child, factor) => {
                let extent = inner(*child);
                extent.with_rate(extent.rate * factor)
            }
            Kind::Elongated { child, .. } | Kind::Painted(child, _) => inner(*child),
            Kind::Displace(child, amount) => {
                let [amount, ..] = amount.range([0.0; 3], f64::INFINITY);
                match amount.low.is_finite() {
                    true => inner(*child).grown(-amount.low),
                    false => Extent::EVERYWHERE,
                }
            }
            Kind::Field(_)
            | Kind::RevolvePart(..)
            | Kind::Complement(_)
            | Kind::Warp(..)
            | Kind::Nothing => Extent::EVERYWHERE,
        }
    }

    fn steepness(&self, kind: &Kind) -> f64 {
        let inner = |id: NodeId| self.node(id).steepness;
        match kind {
            Kind::Leaf(leaf) => leaf.steepness,
            Kind::Union { children, .. } => {
                children.iter().map(|&id| inner(id)).fold(0.0, f64::max)
            }
            Kind::Combine { set, children } => {
                let steepnesses = children.iter().map(|&id| inner(id));
                let combined = steepnesses.reduce(|a, b| set.steepness(a, b));
                combined.unwrap_or(1.0)
            }
            Kind::Frame {
                child,
                scale,
                stretch,
                ..
            } => inner(*child) * scale.abs() * stretch,
            Kind::Scale(child, factor) => inner(*child) * factor.abs(),
            Kind::Elongated { child, .. }
            | Kind::RevolveClose(child, _)
            | Kind::Extrude(child, _)
            | Kind::RoundedExtrude(child, _, _) => inner(*child).max(1.0),
            Kind::Grid(child, _)
            | Kind::Ring(child, _)
            | Kind::Mirror(child, _)
            | Kind::Elongate(child, _)
            | Kind::Revolve(child, _)
            | Kind::RevolvePart(child, _, _)
            | Kind::Slice(child)
            | Kind::Complement(child)
            | Kind::Offset(child, _)
            | Kind::Shell(child, _)
            | Kind::Painted(child, _) => inner(*child),
            Kind::Field(_)
            | Kind::Twist(..)
            | Kind::Bend(..)
            | Kind::Warp(..)
            | Kind::Displace(..) => f64::INFINITY,
            Kind::Nothing => 0.0,
        }
    }
}

/// The operands of a node.
fn operands(kind: &Kind) -> &[NodeId] {
    match kind {
        Kind::Union { children, .. } | Kind::Combine { children, .. } => children,
        Kind::Frame { child, .. }
        | Kind::Elongated { child, .. }
        | Kind::Grid(child, _)
        | Kind::Ring(child, _)
        | Kind::Mirror(child, _)
        | Kind::Twist(child, _)
        | Kind::Bend(child, _)
        | Kind::Elongate(child, _)
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
        | Kind::Displace(child, _)
        | Kind::Painted(child, _) => std::slice::from_ref(child),
        Kind::Leaf(_) | Kind::Field(_) | Kind::Nothing => &[],
    }
}

fn hull(extents: impl Iterator<Item = Extent>) -> Extent {
    extents
        .reduce(|a, b| a.hull(&b))
        .unwrap_or(Extent::EVERYWHERE)
}

/// The box of a figure's revolution.
fn revolved(figure: &Extent, offset: f64) -> Extent {
    let radius = (figure.high[0] + offset).max(0.0);
    Extent {
        low: [-radius, figure.low[1], -radius],
        high: [radius, figure.high[1], radius],
        rate: figure.rate.min(1.0),
    }
}

/// The box of a figure, this far to both sides of its plane.
fn flat(figure: &Extent, half: f64) -> Extent {
    Extent {
        low: [figure.low[0], figure.low[1], -half],
        high: [figure.high[0], figure.high[1], half],
        rate: figure.rate.min(1.0),
    }
}

/// Sets the radii to trust formulas with: a share of the smallest box that each is in.
pub(super) fn refine(tree: &mut Tree) {
    for at in (0..tree.nodes.len()).rev() {
        let node = &tree.nodes[at];
        let box_grain = match node.extent.diagonal() {
            Some(size) if node.extent.is_finite() => size / MIN_GRAINS_PER_BOX,
            _ => f64::INFINITY,
        };
        let grain = node.grain.min(box_grain);
        let inner = match &node.kind {
            Kind::Frame { matrix, .. } => grain * stretches(matrix)[0],
            _ => grain,
        };
        let inner = if inner > 0.0 { inner } else { grain };
        let inner_ids = operands(&node.kind).to_vec();
        tree.nodes[at].grain = grain;
        for id in inner_ids {
            let child = &mut tree.nodes[id as usize];
            child.grain = child.grain.min(inner);
        }
    }
}
