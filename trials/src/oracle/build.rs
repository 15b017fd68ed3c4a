//! Converts the elaborated scene into a [`ShapeTree`].
//!
//! Numbers that do not depend on the point are computed here, once.

use super::bvh::UnionBvh;
use super::combine::{EdgeProfile, SetOp, set_op};
use super::facts;
use super::formula::{PointFormula, SceneNumbers};
use super::influence_box::{InfluenceBox, stretch_range};
use super::leaf_shape::{LeafShape, shape_by_body};
use super::shapes_2d::{polygon, shape_2d};
use super::solids::solid;
use super::space::{CopyGrid, CopyRing, Wedge};
use super::tree::{NodeKind, ShapeTree, TreeNode, TreeNodeId};
use sdfc_compiler::scene::{Scene, Shape, ShapeId, ShapeKind};
use sdfc_vm::table::Op;

/// Returns the solid or 2-D shape of a row, or `None` for other rows.
pub(super) fn leaf_shape(op: Op, numbers: &[f64]) -> Option<LeafShape> {
    solid(op, numbers)
        .or_else(|| shape_2d(op, numbers))
        .or_else(|| shape_by_body(op, numbers))
}

/// Returns the node for a row that transforms the point or the value, or `None` for other rows.
pub(super) fn transform(op: Op, child: TreeNodeId, k: &[f64], is_2d: bool) -> Option<NodeKind> {
    let wedge = |cosine: f64, sine: f64| Wedge {
        end: [cosine, sine],
    };
    let triple = |index: usize| [k[index], k[index + 1], k[index + 2]];
    Some(match op {
        Op::Mirror => NodeKind::Mirror(child, triple(0).map(|v| v != 0.0)),
        Op::Repeat => NodeKind::CopyGrid(child, CopyGrid::new(triple(0), None)),
        Op::RepeatLimited => NodeKind::CopyGrid(child, CopyGrid::new(triple(0), Some(triple(6)))),
        Op::Polar => NodeKind::CopyRing(child, CopyRing::new(k[0], 2)),
        Op::PolarPlane => NodeKind::CopyRing(child, CopyRing::new(k[0], 1)),
        Op::Elongate => NodeKind::Elongate(child, triple(0)),
        Op::Twist => NodeKind::Twist(child, k[0]),
        Op::Bend => NodeKind::Bend(child, k[0]),
        Op::Revolve => NodeKind::Revolve(child, k[0]),
        Op::RevolvePart => NodeKind::RevolvePart(child, k[0], wedge(k[1], k[2])),
        Op::RevolveClose => NodeKind::RevolveClose(child, wedge(k[0], k[1])),
        Op::Slice => NodeKind::Slice(child),
        Op::Extrude => NodeKind::Extrude(child, k[0]),
        Op::RoundedExtrude => NodeKind::RoundedExtrude(child, k[0], k[1]),
        Op::Complement => NodeKind::Complement(child),
        Op::Offset => NodeKind::Offset(child, k[0]),
        Op::Shell => NodeKind::Shell(child, k[0]),
        Op::ElongateCorrect => NodeKind::ElongateCorrect {
            child,
            half: triple(0),
            axes: if is_2d { 2 } else { 3 },
        },
        Op::ScaleDistance => NodeKind::Scale(child, k[0]),
        _ => return None,
    })
}

/// Builder of a shape tree.
pub(super) struct TreeBuilder<'s> {
    scene: &'s Scene,
    numbers: SceneNumbers,
    nodes: Vec<TreeNode>,
    /// Node of each shape that the root uses.
    node_ids: Vec<Option<TreeNodeId>>,
}

/// Builds the tree of a shape of the scene at a time in seconds.
pub(super) fn build(scene: &Scene, root: ShapeId, time: f64) -> ShapeTree {
    let mut builder = TreeBuilder {
        scene,
        numbers: SceneNumbers::new(scene, time),
        nodes: Vec::new(),
        node_ids: vec![None; scene.shapes.len()],
    };
    let mut is_used = vec![false; scene.shapes.len()];
    is_used[root.0 as usize] = true;
    for index in (0..=root.0 as usize).rev() {
        if is_used[index] {
            for child in children(&scene.shapes[index].kind) {
                is_used[child.0 as usize] = true;
            }
        }
    }
    for (index, shape) in scene.shapes.iter().enumerate() {
        if is_used[index] {
            let kind = builder.kind(shape);
            builder.node_ids[index] = Some(builder.add(kind));
        }
    }
    let root = builder.node_id(root);
    let mut tree = ShapeTree {
        nodes: builder.nodes,
        root,
    };
    facts::assign_trusted_radii(&mut tree);
    tree
}

/// Returns the operands of a shape.
pub fn children(kind: &ShapeKind) -> &[ShapeId] {
    match kind {
        ShapeKind::Combine { children, .. } => children,
        ShapeKind::Frame { child, .. }
        | ShapeKind::Repeat { child, .. }
        | ShapeKind::Polar { child, .. }
        | ShapeKind::Domain { child, .. }
        | ShapeKind::Warp { child, .. }
        | ShapeKind::Distance { child, .. }
        | ShapeKind::Displace { child, .. }
        | ShapeKind::Painted { child, .. } => std::slice::from_ref(child),
        ShapeKind::Primitive { .. }
        | ShapeKind::Field { .. }
        | ShapeKind::Polygon { .. }
        | ShapeKind::Nothing => &[],
    }
}

impl TreeBuilder<'_> {
    /// Returns the node of a shape that was added earlier.
    fn node_id(&self, id: ShapeId) -> TreeNodeId {
        self.node_ids[id.0 as usize].unwrap_or_else(|| panic!("{id:?} stands behind its user"))
    }

    fn node(&self, id: TreeNodeId) -> &TreeNode {
        &self.nodes[id as usize]
    }

    fn kind(&self, shape: &Shape) -> NodeKind {
        let number = |id| self.numbers.get(id);
        let formula = |ids: &[_]| PointFormula::new(&self.scene.expressions, &self.numbers, ids);
        match &shape.kind {
            ShapeKind::Primitive { op, parameters } => {
                let leaf_shape = leaf_shape(*op, &self.numbers.get_all(parameters));
                NodeKind::Leaf(leaf_shape.unwrap_or_else(|| panic!("{op:?} is no shape")))
            }
            ShapeKind::Polygon { points } => {
                let points: Vec<[f64; 2]> = points.iter().map(|p| p.map(number)).collect();
                NodeKind::Leaf(polygon(&points))
            }
            ShapeKind::Field { value, .. } => NodeKind::Field(formula(&[*value])),
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let set_op = set_op(*op, &self.numbers.get_all(parameters));
                let set_op = set_op.unwrap_or_else(|| panic!("{op:?} is no combination"));
                let children = children.iter().map(|&id| self.node_id(id)).collect();
                self.combination(set_op, children)
            }
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let matrix = matrix.map(number);
                NodeKind::Frame {
                    child: self.node_id(*child),
                    matrix,
                    scale: number(*scale),
                    stretch: stretch_range(&matrix)[1],
                }
            }
            ShapeKind::Repeat {
                op,
                child,
                parameters,
                ..
            }
            | ShapeKind::Polar {
                op,
                child,
                parameters,
                ..
            }
            | ShapeKind::Domain {
                op,
                child,
                parameters,
            }
            | ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let numbers = self.numbers.get_all(parameters);
                let kind = transform(*op, self.node_id(*child), &numbers, shape.is_2d);
                kind.unwrap_or_else(|| panic!("{op:?} changes no shape"))
            }
            ShapeKind::Warp { child, point } => {
                NodeKind::Warp(self.node_id(*child), formula(point))
            }
            ShapeKind::Displace { child, amount } => {
                NodeKind::Displace(self.node_id(*child), formula(&[*amount]))
            }
            ShapeKind::Painted { child, material } => {
                NodeKind::WithMaterial(self.node_id(*child), *material)
            }
            ShapeKind::Nothing => NodeKind::Nothing,
        }
    }

    /// Creates the kind of a combination. Hard unions get a BVH over all their operands, nested unions
    /// included.
    fn combination(&self, set_op: SetOp, children: Vec<TreeNodeId>) -> NodeKind {
        if set_op != SetOp::Union(EdgeProfile::Hard) {
            return NodeKind::Combine { set_op, children };
        }
        let mut united: Vec<TreeNodeId> = Vec::new();
        let mut pending: Vec<TreeNodeId> = children.iter().rev().copied().collect();
        while let Some(id) = pending.pop() {
            match &self.node(id).kind {
                NodeKind::Union { children, .. } => pending.extend(children.iter().rev()),
                NodeKind::WithMaterial(child, _) => pending.push(*child),
                _ => united.push(id),
            }
        }
        united.sort_unstable();
        united.dedup();
        let operands: Vec<(TreeNodeId, InfluenceBox)> = united
            .into_iter()
            .map(|id| (id, self.node(id).bounds))
            .collect();
        NodeKind::Union {
            bvh: UnionBvh::new(&operands),
            children,
        }
    }

    fn add(&mut self, kind: NodeKind) -> TreeNodeId {
        self.nodes.push(facts::node(&self.nodes, kind));
        self.nodes.len() as TreeNodeId - 1
    }
}
