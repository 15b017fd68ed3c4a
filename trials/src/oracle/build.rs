//! The way from the elaborated scene to the tree.
//!
//! Every number that does not depend on the point is computed here, once.

use super::combine::{Edge, Set, set};
use super::extent::{Extent, stretches};
use super::facts;
use super::figures::{figure, polygon};
use super::hierarchy::Hierarchy;
use super::number::{Formula, Numbers};
use super::solids::{Leaf, solid};
use super::space::{Grid, Ring, Wedge};
use super::tree::{Kind, Node, NodeId, Tree};
use sdfc_compiler::scene::{Scene, Shape, ShapeId, ShapeKind};
use sdfc_vm::table::Op;

/// The solid or figure of a row, if it is one.
pub(super) fn leaf(op: Op, numbers: &[f64]) -> Option<Leaf> {
    solid(op, numbers).or_else(|| figure(op, numbers))
}

/// The change of the point or of the value that a row makes, if it makes one.
pub(super) fn change(op: Op, child: NodeId, k: &[f64], is_plane: bool) -> Option<Kind> {
    let wedge = |cosine: f64, sine: f64| Wedge {
        end: [cosine, sine],
    };
    let triple = |at: usize| [k[at], k[at + 1], k[at + 2]];
    Some(match op {
        Op::Mirror => Kind::Mirror(child, triple(0).map(|v| v != 0.0)),
        Op::Repeat => Kind::Grid(child, Grid::new(triple(0), None)),
        Op::RepeatLimited => Kind::Grid(child, Grid::new(triple(0), Some(triple(6)))),
        Op::Polar => Kind::Ring(child, Ring::new(k[0], 2)),
        Op::PolarPlane => Kind::Ring(child, Ring::new(k[0], 1)),
        Op::Elongate => Kind::Elongate(child, triple(0)),
        Op::Twist => Kind::Twist(child, k[0]),
        Op::Bend => Kind::Bend(child, k[0]),
        Op::Revolve => Kind::Revolve(child, k[0]),
        Op::RevolvePart => Kind::RevolvePart(child, k[0], wedge(k[1], k[2])),
        Op::RevolveClose => Kind::RevolveClose(child, wedge(k[0], k[1])),
        Op::Slice => Kind::Slice(child),
        Op::Extrude => Kind::Extrude(child, k[0]),
        Op::RoundedExtrude => Kind::RoundedExtrude(child, k[0], k[1]),
        Op::Complement => Kind::Complement(child),
        Op::Offset => Kind::Offset(child, k[0]),
        Op::Shell => Kind::Shell(child, k[0]),
        Op::ElongateCorrect => Kind::Elongated {
            child,
            half: triple(0),
            axes: if is_plane { 2 } else { 3 },
        },
        Op::ScaleDistance => Kind::Scale(child, k[0]),
        _ => return None,
    })
}

/// A tree that is being built.
pub(super) struct Builder<'s> {
    scene: &'s Scene,
    numbers: Numbers,
    nodes: Vec<Node>,
    /// The node of each shape that the root uses.
    places: Vec<Option<NodeId>>,
}

/// The tree of a shape of the scene at a time.
pub(super) fn build(scene: &Scene, root: ShapeId, time: f64) -> Tree {
    let mut builder = Builder {
        scene,
        numbers: Numbers::new(scene, time),
        nodes: Vec::new(),
        places: vec![None; scene.shapes.len()],
    };
    let mut is_used = vec![false; scene.shapes.len()];
    is_used[root.0 as usize] = true;
    for at in (0..=root.0 as usize).rev() {
        if is_used[at] {
            for child in children(&scene.shapes[at].kind) {
                is_used[child.0 as usize] = true;
            }
        }
    }
    for (at, shape) in scene.shapes.iter().enumerate() {
        if is_used[at] {
            let kind = builder.kind(shape);
            builder.places[at] = Some(builder.add(kind));
        }
    }
    let root = builder.place(root);
    let mut tree = Tree {
        nodes: builder.nodes,
        root,
    };
    facts::refine(&mut tree);
    tree
}

/// The operands of a shape.
fn children(kind: &ShapeKind) -> &[ShapeId] {
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

impl Builder<'_> {
    /// The node of a shape that was added before.
    fn place(&self, id: ShapeId) -> NodeId {
        self.places[id.0 as usize].unwrap_or_else(|| panic!("{id:?} stands behind its user"))
    }

    fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id as usize]
    }

    fn kind(&self, shape: &Shape) -> Kind {
        let number = |id| self.numbers.one(id);
        let formula = |ids: &[_]| Formula::new(&self.scene.expressions, &self.numbers, ids);
        match &shape.kind {
            ShapeKind::Primitive { op, parameters } => {
                let leaf = leaf(*op, &self.numbers.all(parameters));
                Kind::Leaf(leaf.unwrap_or_else(|| panic!("{op:?} is no shape")))
            }
            ShapeKind::Polygon { points } => {
                let points: Vec<[f64; 2]> = points.iter().map(|p| p.map(number)).collect();
                Kind::Leaf(polygon(&points))
            }
            ShapeKind::Field { value, .. } => Kind::Field(formula(&[*value])),
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let set = set(*op, &self.numbers.all(parameters));
                let set = set.unwrap_or_else(|| panic!("{op:?} is no combination"));
                let children = children.iter().map(|&id| self.place(id)).collect();
                self.combination(set, children)
            }
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let matrix = matrix.map(number);
                Kind::Frame {
                    child: self.place(*child),
                    matrix,
                    scale: number(*scale),
                    stretch: stretches(&matrix)[1],
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
                let numbers = self.numbers.all(parameters);
                let kind = change(*op, self.place(*child), &numbers, shape.plane);
                kind.unwrap_or_else(|| panic!("{op:?} changes no shape"))
            }
            ShapeKind::Warp { child, point } => Kind::Warp(self.place(*child), formula(point)),
            ShapeKind::Displace { child, amount } => {
                Kind::Displace(self.place(*child), formula(&[*amount]))
            }
            ShapeKind::Painted { child, material } => Kind::Painted(self.place(*child), *material),
            ShapeKind::Nothing => Kind::Nothing,
        }
    }

    /// The kind of a combination. Hard unions get a hierarchy of all that they unite.
    fn combination(&self, set: Set, children: Vec<NodeId>) -> Kind {
        if set != Set::Union(Edge::Hard) {
            return Kind::Combine { set, children };
        }
        let mut united: Vec<NodeId> = Vec::new();
        let mut pending: Vec<NodeId> = children.iter().rev().copied().collect();
        while let Some(id) = pending.pop() {
            match &self.node(id).kind {
                Kind::Union { children, .. } => pending.extend(children.iter().rev()),
                Kind::Painted(child, _) => pending.push(*child),
                _ => united.push(id),
            }
        }
        united.sort_unstable();
        united.dedup();
        let operands: Vec<(NodeId, Extent)> = united
            .into_iter()
            .map(|id| (id, self.node(id).extent))
            .collect();
        Kind::Union {
            hierarchy: Hierarchy::new(&operands),
            children,
        }
    }

    fn add(&mut self, kind: Kind) -> NodeId {
        self.nodes.push(facts::node(&self.nodes, kind));
        self.nodes.len() as NodeId - 1
    }
}
