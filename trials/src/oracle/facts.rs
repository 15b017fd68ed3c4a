//! Influence boxes, slope bounds and trusted radii of shapes, derived from those of their operands.

use super::combine::SetOp;
use super::influence_box::{InfluenceBox, stretch_range};
use super::tree::{NodeKind, ShapeTree, TreeNode, TreeNodeId};

/// Smallest number of trusted radii along the diagonal of a box.
const MIN_TRUSTED_RADII_PER_DIAGONAL: f64 = 500.0;

/// Creates the node of a kind whose operands are among `nodes`.
pub(super) fn node(nodes: &[TreeNode], kind: NodeKind) -> TreeNode {
    let rules = ShapeFacts { nodes };
    let has_material = |id: &TreeNodeId| rules.node(*id).has_material;
    TreeNode {
        bounds: rules.bounds(&kind),
        slope_bound: rules.slope_bound(&kind),
        trusted_radius: f64::INFINITY,
        has_material: matches!(kind, NodeKind::WithMaterial(..))
            || operands(&kind).iter().any(has_material),
        kind,
    }
}

/// Rules that derive facts of a shape from the nodes of its operands.
struct ShapeFacts<'n> {
    nodes: &'n [TreeNode],
}

impl ShapeFacts<'_> {
    fn node(&self, id: TreeNodeId) -> &TreeNode {
        &self.nodes[id as usize]
    }

    fn bounds(&self, kind: &NodeKind) -> InfluenceBox {
        let child_bounds = |id: TreeNodeId| self.node(id).bounds;
        match kind {
            NodeKind::Leaf(leaf) => leaf.bounds,
            NodeKind::Union { children, .. } => hull(children.iter().map(|&id| child_bounds(id))),
            NodeKind::Combine { set_op, children } => {
                let mut operand_bounds = children.iter().map(|&id| child_bounds(id));
                match set_op {
                    SetOp::Union(profile) => {
                        let max_offset = profile.max_offset() * (children.len() - 1) as f64;
                        hull(operand_bounds).grown(max_offset)
                    }
                    SetOp::Intersection(_) => operand_bounds
                        .reduce(|a, b| a.intersection(&b))
                        .unwrap_or(InfluenceBox::ALL_SPACE),
                    SetOp::Subtraction(_) => {
                        operand_bounds.next().unwrap_or(InfluenceBox::ALL_SPACE)
                    }
                    SetOp::Xor | SetOp::Morph(_) => hull(operand_bounds),
                }
            }
            NodeKind::Frame {
                child,
                matrix,
                scale,
                ..
            } => child_bounds(*child).affine_image(matrix, *scale, stretch_range(matrix)[0]),
            NodeKind::CopyGrid(child, grid) => grid.bounds(&child_bounds(*child)),
            NodeKind::CopyRing(child, ring) => child_bounds(*child).revolved_about(ring.axis()),
            NodeKind::Mirror(child, axes) => {
                let mut bounds = child_bounds(*child);
                for axis in (0..3).filter(|&axis| axes[axis]) {
                    bounds.high[axis] = bounds.high[axis].max(0.0);
                    bounds.low[axis] = -bounds.high[axis];
                }
                bounds
            }
            NodeKind::Twist(child, _) => child_bounds(*child).revolved_about(1),
            NodeKind::Bend(child, _) => child_bounds(*child).revolved_about(2),
            NodeKind::Elongate(child, half) => child_bounds(*child).widened(*half),
            NodeKind::Revolve(child, offset) => revolved_bounds(&child_bounds(*child), *offset),
            NodeKind::RevolveClose(child, _) => match &self.node(*child).kind {
                NodeKind::RevolvePart(shape_2d, offset, _) => {
                    revolved_bounds(&child_bounds(*shape_2d), *offset)
                }
                _ => InfluenceBox::ALL_SPACE,
            },
            NodeKind::Slice(child) => extruded_bounds(&child_bounds(*child), f64::INFINITY),
            NodeKind::Extrude(child, half) => extruded_bounds(&child_bounds(*child), *half),
            NodeKind::RoundedExtrude(child, half, _) => {
                let bounds = extruded_bounds(&child_bounds(*child), *half);
                bounds.with_distance_ratio(bounds.distance_ratio * std::f64::consts::FRAC_1_SQRT_2)
            }
            NodeKind::Offset(child, by) => child_bounds(*child).grown(*by),
            NodeKind::Shell(child, half) => child_bounds(*child).grown(*half),
            NodeKind::Scale(child, factor) => {
                let bounds = child_bounds(*child);
                bounds.with_distance_ratio(bounds.distance_ratio * factor)
            }
            NodeKind::ElongateCorrect { child, .. } | NodeKind::WithMaterial(child, _) => {
                child_bounds(*child)
            }
            NodeKind::Displace(child, amount) => {
                let [amount, ..] = amount.range([0.0; 3], f64::INFINITY);
                match amount.low.is_finite() {
                    true => child_bounds(*child).grown(-amount.low),
                    false => InfluenceBox::ALL_SPACE,
                }
            }
            NodeKind::Field(_)
            | NodeKind::RevolvePart(..)
            | NodeKind::Complement(_)
            | NodeKind::Warp(..)
            | NodeKind::Nothing => InfluenceBox::ALL_SPACE,
        }
    }

    fn slope_bound(&self, kind: &NodeKind) -> f64 {
        let child_bounds = |id: TreeNodeId| self.node(id).slope_bound;
        match kind {
            NodeKind::Leaf(leaf) => leaf.slope_bound,
            NodeKind::Union { children, .. } => children
                .iter()
                .map(|&id| child_bounds(id))
                .fold(0.0, f64::max),
            NodeKind::Combine { set_op, children } => {
                let slope_bounds = children.iter().map(|&id| child_bounds(id));
                let combined = slope_bounds.reduce(|a, b| set_op.slope_bound(a, b));
                combined.unwrap_or(1.0)
            }
            NodeKind::Frame {
                child,
                scale,
                stretch,
                ..
            } => child_bounds(*child) * scale.abs() * stretch,
            NodeKind::Scale(child, factor) => child_bounds(*child) * factor.abs(),
            NodeKind::ElongateCorrect { child, .. }
            | NodeKind::RevolveClose(child, _)
            | NodeKind::Extrude(child, _)
            | NodeKind::RoundedExtrude(child, _, _) => child_bounds(*child).max(1.0),
            NodeKind::CopyGrid(child, _)
            | NodeKind::CopyRing(child, _)
            | NodeKind::Mirror(child, _)
            | NodeKind::Elongate(child, _)
            | NodeKind::Revolve(child, _)
            | NodeKind::RevolvePart(child, _, _)
            | NodeKind::Slice(child)
            | NodeKind::Complement(child)
            | NodeKind::Offset(child, _)
            | NodeKind::Shell(child, _)
            | NodeKind::WithMaterial(child, _) => child_bounds(*child),
            NodeKind::Field(_)
            | NodeKind::Twist(..)
            | NodeKind::Bend(..)
            | NodeKind::Warp(..)
            | NodeKind::Displace(..) => f64::INFINITY,
            NodeKind::Nothing => 0.0,
        }
    }
}

/// Returns the operands of a node.
fn operands(kind: &NodeKind) -> &[TreeNodeId] {
    match kind {
        NodeKind::Union { children, .. } | NodeKind::Combine { children, .. } => children,
        NodeKind::Frame { child, .. }
        | NodeKind::ElongateCorrect { child, .. }
        | NodeKind::CopyGrid(child, _)
        | NodeKind::CopyRing(child, _)
        | NodeKind::Mirror(child, _)
        | NodeKind::Twist(child, _)
        | NodeKind::Bend(child, _)
        | NodeKind::Elongate(child, _)
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
        | NodeKind::Displace(child, _)
        | NodeKind::WithMaterial(child, _) => std::slice::from_ref(child),
        NodeKind::Leaf(_) | NodeKind::Field(_) | NodeKind::Nothing => &[],
    }
}

fn hull(operand_bounds: impl Iterator<Item = InfluenceBox>) -> InfluenceBox {
    operand_bounds
        .reduce(|a, b| a.hull(&b))
        .unwrap_or(InfluenceBox::ALL_SPACE)
}

/// Returns the box of a revolved 2-D shape.
fn revolved_bounds(shape_2d: &InfluenceBox, offset: f64) -> InfluenceBox {
    let radius = (shape_2d.high[0] + offset).max(0.0);
    InfluenceBox {
        low: [-radius, shape_2d.low[1], -radius],
        high: [radius, shape_2d.high[1], radius],
        distance_ratio: shape_2d.distance_ratio.min(1.0),
    }
}

/// Returns the box of a 2-D shape extruded by this length on both sides of its plane.
fn extruded_bounds(shape_2d: &InfluenceBox, half: f64) -> InfluenceBox {
    InfluenceBox {
        low: [shape_2d.low[0], shape_2d.low[1], -half],
        high: [shape_2d.high[0], shape_2d.high[1], half],
        distance_ratio: shape_2d.distance_ratio.min(1.0),
    }
}

/// Sets the trusted radii: a fixed fraction of the smallest finite box around each node.
pub(super) fn assign_trusted_radii(tree: &mut ShapeTree) {
    for index in (0..tree.nodes.len()).rev() {
        let node = &tree.nodes[index];
        let box_radius = match node.bounds.diagonal() {
            Some(size) if node.bounds.is_finite() => size / MIN_TRUSTED_RADII_PER_DIAGONAL,
            _ => f64::INFINITY,
        };
        let trusted_radius = node.trusted_radius.min(box_radius);
        let child_bounds = match &node.kind {
            NodeKind::Frame { matrix, .. } => trusted_radius * stretch_range(matrix)[0],
            _ => trusted_radius,
        };
        let child_bounds = if child_bounds > 0.0 {
            child_bounds
        } else {
            trusted_radius
        };
        let inner_ids = operands(&node.kind).to_vec();
        tree.nodes[index].trusted_radius = trusted_radius;
        for id in inner_ids {
            let child = &mut tree.nodes[id as usize];
            child.trusted_radius = child.trusted_radius.min(child_bounds);
        }
    }
}
