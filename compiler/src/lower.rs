//! Scene → graph: shapes become operations on points.
//!
//! Rigid motions, scales and other affine maps are composed on the way down and never stand in the
//! graph one after the other. A shape whose distance could change faster than the point moves (a
//! raw field, a twist, a displacement) is divided by a bound on its slope where it stands, so that
//! every value that a ray marches on is safe and only the shape concerned is slowed down.
//!
//! The same scene is lowered twice: once for its distance, once for its surface, where paints stay
//! in the graph, or where each leaf has a paint of its own ([`crate::origins`]).

use crate::bounds::{Boxes, World};
use crate::expression::{ExprId, Expression, Expressions};
use crate::graph::{Graph, Node, NodeId, Number, Origin};
use crate::origins::Trail;
use crate::scene::{Material, MaterialId, Scene, ShapeId, ShapeKind};
use crate::uniforms::{Uniforms, operands_first};
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::table::Op;
use std::collections::{HashMap, HashSet};

/// What the polygon's chain starts from: a distance longer than any in a scene.
const FAR: f32 = 1e30;

/// The point a shape is evaluated at: a node of the graph, seen through an affine map.
#[derive(Clone, Copy)]
struct At {
    base: NodeId,
    frame: Option<[ExprId; 12]>,
}

/// Which graph is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The distance alone.
    Distance,
    /// The distance and the material.
    Surface,
    /// The distance and the leaf that made it.
    Origins,
}

/// Lowers a shape of the scene; the uniform numbers that it reads are collected in `uniforms`.
/// `boxes` are those that hold for all values of the parameters.
pub(crate) fn lower(
    scene: &mut Scene,
    shape: ShapeId,
    purpose: Purpose,
    uniforms: &mut Uniforms,
    boxes: &mut Boxes,
) -> (Graph, Vec<Diagnostic>) {
    let (graph, _, diagnostics) = walk(scene, shape, purpose, uniforms, boxes);
    (graph, diagnostics)
}

/// Lowers a shape as for its surface, but each leaf has a material of its own, in place of all paints
/// of the scene; gives what the materials' numbers stand for.
pub(crate) fn lower_origins(
    scene: &mut Scene,
    shape: ShapeId,
    uniforms: &mut Uniforms,
    boxes: &mut Boxes,
) -> (Graph, Trail) {
    let (graph, trail, _) = walk(scene, shape, Purpose::Origins, uniforms, boxes);
    (graph, trail)
}

fn walk(
    scene: &mut Scene,
    shape: ShapeId,
    purpose: Purpose,
    uniforms: &mut Uniforms,
    boxes: &mut Boxes,
) -> (Graph, Trail, Vec<Diagnostic>) {
    let paints = paints(scene);
    let mut graph = Graph::default();
    let world = graph.add(Node::World);
    let mut lowering = Lowering {
        scene,
        boxes,
        paints,
        uniforms,
        graph,
        purpose,
        trail: Trail::default(),
        unbounded: HashSet::new(),
        diagnostics: Vec::new(),
    };
    let root = lowering.shape(
        shape,
        At {
            base: world,
            frame: None,
        },
    );
    lowering.graph.root = root;
    (lowering.graph, lowering.trail, lowering.diagnostics)
}

struct Lowering<'a> {
    scene: &'a mut Scene,
    boxes: &'a mut Boxes,
    paints: Vec<Paints>,
    uniforms: &'a mut Uniforms,
    graph: Graph,
    purpose: Purpose,
    /// The leaves met so far, and the shapes around the present one; only for [`Purpose::Origins`].
    trail: Trail,
    /// Shapes whose slope has no bound.
    unbounded: HashSet<ShapeId>,
    diagnostics: Vec<Diagnostic>,
}

impl Lowering<'_> {
    fn number(&mut self, id: ExprId) -> Number {
        self.uniforms.number(&self.scene.expressions, id)
    }

    fn numbers(&mut self, ids: &[ExprId]) -> Vec<Number> {
        ids.iter().map(|&id| self.number(id)).collect()
    }

    /// The node of the point itself, for operations that read it.
    fn point(&mut self, at: At) -> NodeId {
        let Some(frame) = at.frame else {
            return at.base;
        };
        let rows: [Number; 12] = frame.map(|id| self.number(id));
        let linear_is_identity = (0..12)
            .filter(|i| i % 4 != 3)
            .all(|i| rows[i].is(if i % 4 == i / 4 { 1.0 } else { 0.0 }));
        if !linear_is_identity {
            return self.graph.add(Node::Mapped {
                point: at.base,
                rows,
            });
        }
        let by = [rows[3], rows[7], rows[11]];
        if by.iter().all(|n| n.is(0.0)) {
            return at.base;
        }
        self.graph.add(Node::Moved { point: at.base, by })
    }

    /// `at`, seen through one more affine map.
    fn framed(&mut self, at: At, matrix: [ExprId; 12]) -> At {
        let frame = match at.frame {
            Some(outer) => compose(&mut self.scene.expressions, &matrix, &outer),
            None => matrix,
        };
        At {
            base: at.base,
            frame: Some(frame),
        }
    }

    fn apply(&mut self, op: Op, at: At, values: Vec<NodeId>, parameters: Vec<Number>) -> NodeId {
        let point = op.row().reads_point().then(|| self.point(at));
        self.graph.add(Node::Apply {
            op,
            point,
            values,
            parameters,
        })
    }

    /// Recursion over shapes within shapes, whose depth the elaborator bounds.
    fn shape(&mut self, id: ShapeId, at: At) -> NodeId {
        let shape = &self.scene.shapes[id.0 as usize];
        let origin = Origin {
            name: shape.name.clone(),
            span: Some(shape.span),
        };
        let outer = match self.purpose {
            Purpose::Distance | Purpose::Surface => None,
            Purpose::Origins => Some(self.trail.enter(shape)),
        };
        let node = match shape.kind.clone() {
            ShapeKind::Primitive { op, parameters } => {
                let parameters = self.numbers(&parameters);
                self.apply(op, at, Vec::new(), parameters)
            }
            ShapeKind::Field { value, slope, .. } => {
                let node = self.field(value, at);
                let slope = match slope {
                    Some(slope) => self.reciprocal(slope),
                    None => {
                        let slope = self.slope(id);
                        Number::Constant((1.0 / slope) as f32)
                    }
                };
                self.apply(Op::FieldDistance, at, vec![node], vec![slope])
            }
            ShapeKind::Polygon { points } => self.polygon(&points, at),
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let parameters = self.numbers(&parameters);
                let mut children = children.into_iter();
                let first = children.next().expect("a combination has operands");
                let mut left = self.shape(first, at);
                let mut paints = self.paints[first.0 as usize];
                for child in children {
                    let mut right = self.shape(child, at);
                    let other = self.paints[child.0 as usize];
                    if self.purpose == Purpose::Surface && cuts(op) {
                        // What only cuts leaves no paint of its own: the face it makes has the
                        // material of what is cut.
                        match (paints, other) {
                            (Paints::One(material), Paints::None) => {
                                right = self.paint(right, material, at);
                            }
                            (Paints::None, Paints::One(material)) => {
                                left = self.paint(left, material, at);
                            }
                            _ => {}
                        }
                    }
                    paints = paints.join(other);
                    left = self.apply(op, at, vec![left, right], parameters.clone());
                }
                left
            }
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let inner = self.framed(at, matrix);
                let node = self.shape(child, inner);
                let scale = self.number(scale);
                if scale.is(1.0) {
                    node
                } else {
                    self.apply(Op::ScaleDistance, at, vec![node], vec![scale])
                }
            }
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => {
                let stretch = self.slope(id);
                let parameters = self.numbers(&parameters);
                let point = self.apply(op, at, Vec::new(), parameters);
                let node = self.shape(
                    child,
                    At {
                        base: point,
                        frame: None,
                    },
                );
                self.slowed(node, stretch, at)
            }
            ShapeKind::Warp { child, point } => {
                let stretch = self.slope(id);
                let coordinates = point.map(|number| self.field(number, at));
                let point = self.apply(Op::MakePoint, at, coordinates.to_vec(), Vec::new());
                let node = self.shape(
                    child,
                    At {
                        base: point,
                        frame: None,
                    },
                );
                self.slowed(node, stretch, at)
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let node = self.shape(child, at);
                let parameters = self.numbers(&parameters);
                self.apply(op, at, vec![node], parameters)
            }
            ShapeKind::Displace { child, amount } => {
                let slope = self.slope(id);
                let node = self.shape(child, at);
                let amount = self.field(amount, at);
                let sum = self.apply(Op::Add, at, vec![node, amount], Vec::new());
                self.slowed(sum, 1.0 + slope, at)
            }
            ShapeKind::Painted { child, material } => {
                let node = self.shape(child, at);
                match self.purpose {
                    Purpose::Distance | Purpose::Origins => node,
                    Purpose::Surface => self.paint(node, material, at),
                }
            }
            // Farther than anything that a ray can meet.
            ShapeKind::Nothing => self.graph.add(Node::Constant(Number::Constant(1e9))),
        };
        self.graph.set_origin(node, origin);
        match outer {
            Some(outer) => self.leave(id, outer, node),
            None => node,
        }
    }

    /// Comes out of a shape; a leaf is painted with its number.
    fn leave(&mut self, id: ShapeId, outer: Option<u32>, node: NodeId) -> NodeId {
        self.trail.leave(outer);
        let shape = &self.scene.shapes[id.0 as usize];
        let Some(number) = self.trail.number(shape) else {
            return node;
        };
        let mut constants = [Number::Constant(0.0); 12];
        constants[8] = Number::Constant(number as f32);
        self.graph.add(Node::Paint {
            value: node,
            constants,
            channels: Vec::new(),
        })
    }

    /// The value divided by a slope bound above one.
    fn slowed(&mut self, node: NodeId, slope: f64, at: At) -> NodeId {
        if slope <= 1.0 + 1e-9 {
            return node;
        }
        let inverse = Number::Constant((1.0 / slope) as f32);
        self.apply(Op::FieldDistance, at, vec![node], vec![inverse])
    }

    /// One divided by a uniform number.
    fn reciprocal(&mut self, id: ExprId) -> Number {
        let expressions = &mut self.scene.expressions;
        let one = expressions.constant(1.0);
        let inverse = expressions.call(Op::Div, &[one, id]);
        self.number(inverse)
    }

    /// The slope of what a shape is computed from; where there is no bound, that is told once, and
    /// the shape is taken as it is.
    fn slope(&mut self, id: ShapeId) -> f64 {
        if let Some(slope) = self.boxes.slope(World::from(&*self.scene), id) {
            return slope;
        }
        let shape = &self.scene.shapes[id.0 as usize];
        // Nothing marches on a figure that is the whole scene.
        if !(shape.plane && self.scene.plane) && self.unbounded.insert(id) {
            self.diagnostics.push(
                Diagnostic::warning(
                    codes::W0501,
                    shape.span,
                    "the slope of this field cannot be bounded",
                )
                .primary("it may rise arbitrarily fast, so rays may step over it")
                .help(
                    "state a bound, `field(…, lipschitz: 2)`, or keep away from poles with `max`",
                ),
            );
        }
        1.0
    }

    /// A number of point stage as values of the graph.
    fn field(&mut self, id: ExprId, at: At) -> NodeId {
        let order = operands_first(&self.scene.expressions, id, |_| false);
        let mut nodes: HashMap<ExprId, NodeId> = HashMap::with_capacity(order.len());
        for id in order {
            // What is uniform is one constant, however it is computed.
            if self.scene.expressions.stage(id) <= crate::expression::Stage::Uniform {
                continue;
            }
            let node = match self.scene.expressions.get(id).clone() {
                Expression::Coordinate(axis) => {
                    let op = [Op::X, Op::Y, Op::Z][usize::from(axis)];
                    self.apply(op, at, Vec::new(), Vec::new())
                }
                Expression::NormalComponent(axis) => {
                    let point = self.point(at);
                    self.graph.add(Node::Normal { point, axis })
                }
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    let parameters = self.numbers(&parameters);
                    let values = values
                        .iter()
                        .map(|&v| self.operand(v, &nodes))
                        .collect::<Vec<_>>();
                    let at = match point {
                        Some(p) => At {
                            base: self.made_point(p, &nodes, at),
                            frame: None,
                        },
                        None => at,
                    };
                    self.apply(op, at, values, parameters)
                }
                Expression::Constant(_) | Expression::Param(..) | Expression::Time => {
                    unreachable!("known before the point is")
                }
            };
            nodes.insert(id, node);
        }
        self.operand(id, &nodes)
    }

    /// A number that was lowered before, or a uniform one.
    fn operand(&mut self, id: ExprId, nodes: &HashMap<ExprId, NodeId>) -> NodeId {
        match nodes.get(&id) {
            Some(&node) => node,
            None => {
                let number = self.number(id);
                self.graph.add(Node::Constant(number))
            }
        }
    }

    /// The point with these coordinates; the current one, perhaps scaled or moved, where they say
    /// no more than that, which costs an instruction instead of four.
    fn made_point(
        &mut self,
        coordinates: [ExprId; 3],
        nodes: &HashMap<ExprId, NodeId>,
        at: At,
    ) -> NodeId {
        if let Some(matrix) = affine(&mut self.scene.expressions, coordinates) {
            let framed = self.framed(at, matrix);
            return self.point(framed);
        }
        let values = coordinates.map(|id| self.operand(id, nodes)).to_vec();
        self.graph.add(Node::Apply {
            op: Op::MakePoint,
            point: None,
            values,
            parameters: Vec::new(),
        })
    }

    fn polygon(&mut self, points: &[[ExprId; 2]], at: At) -> NodeId {
        let corners: Vec<[Number; 2]> =
            points.iter().map(|p| p.map(|id| self.number(id))).collect();
        let mut value = self.graph.add(Node::Constant(Number::Constant(FAR)));
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            let parameters = vec![a[0], a[1], b[0], b[1]];
            value = self.apply(Op::PolygonEdge, at, vec![value], parameters);
        }
        value
    }

    fn paint(&mut self, value: NodeId, id: MaterialId, at: At) -> NodeId {
        let material = self.scene.materials[id.0 as usize].clone();
        let mut constants = [Number::Constant(0.0); 12];
        let mut channels = Vec::new();
        for (channel, &number) in channel_numbers(&material).iter().enumerate() {
            if self.scene.expressions.stage(number) <= crate::expression::Stage::Uniform {
                constants[channel] = self.number(number);
            } else {
                channels.push((channel as u8, self.field(number, at)));
            }
        }
        constants[8] = Number::Constant(id.0 as f32);
        if let Some(bump) = material.bump {
            channels.push((8, self.field(bump, at)));
            constants[9] = Number::Constant(1.0);
        }
        self.graph.add(Node::Paint {
            value,
            constants,
            channels,
        })
    }
}

/// Which materials a shape was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Paints {
    /// None anywhere.
    None,
    /// This one, wherever it has one.
    One(MaterialId),
    /// Several.
    Many,
}

impl Paints {
    fn join(self, other: Self) -> Self {
        match (self, other) {
            (paints, Paints::None) | (Paints::None, paints) => paints,
            (a, b) if a == b => a,
            _ => Paints::Many,
        }
    }
}

/// The paints of every shape.
fn paints(scene: &Scene) -> Vec<Paints> {
    let mut all: Vec<Paints> = Vec::with_capacity(scene.shapes.len());
    for shape in &scene.shapes {
        all.push(match &shape.kind {
            ShapeKind::Painted { material, .. } => Paints::One(*material),
            ShapeKind::Combine { children, .. } => children
                .iter()
                .map(|child| all[child.0 as usize])
                .fold(Paints::None, Paints::join),
            ShapeKind::Frame { child, .. }
            | ShapeKind::Domain { child, .. }
            | ShapeKind::Warp { child, .. }
            | ShapeKind::Distance { child, .. }
            | ShapeKind::Displace { child, .. } => all[child.0 as usize],
            ShapeKind::Primitive { .. }
            | ShapeKind::Field { .. }
            | ShapeKind::Polygon { .. }
            | ShapeKind::Nothing => Paints::None,
        });
    }
    all
}

/// Whether an operation takes away from its operands: an intersection or a difference.
fn cuts(op: Op) -> bool {
    match op.row().meta.blend {
        Some(blend) => blend.sign < 0.0,
        None => matches!(
            op,
            Op::ChamferIntersection
                | Op::ChamferSubtraction
                | Op::RoundIntersection
                | Op::RoundSubtraction
                | Op::StairsIntersection
                | Op::StairsSubtraction
        ),
    }
}

/// A material's numbers in the order of the channels.
pub fn channel_numbers(material: &Material) -> [ExprId; 8] {
    let ([r, g, b], [er, eg, eb]) = (material.albedo, material.emission);
    [r, g, b, material.roughness, er, eg, eb, material.metallic]
}

/// `inner` after `outer`: 3×4 matrices by rows.
fn compose(e: &mut Expressions, inner: &[ExprId; 12], outer: &[ExprId; 12]) -> [ExprId; 12] {
    std::array::from_fn(|i| {
        let (row, column) = (i / 4, i % 4);
        let mut sum = if column == 3 {
            inner[row * 4 + 3]
        } else {
            e.constant(0.0)
        };
        for k in 0..3 {
            let product = multiply(e, inner[row * 4 + k], outer[k * 4 + column]);
            sum = add(e, sum, product);
        }
        sum
    })
}

fn add(e: &mut Expressions, a: ExprId, b: ExprId) -> ExprId {
    match (e.as_constant(a), e.as_constant(b)) {
        (Some(0.0), _) => b,
        (_, Some(0.0)) => a,
        _ => e.call(Op::Add, &[a, b]),
    }
}

fn multiply(e: &mut Expressions, a: ExprId, b: ExprId) -> ExprId {
    match (e.as_constant(a), e.as_constant(b)) {
        (Some(0.0), _) | (_, Some(0.0)) => e.constant(0.0),
        (Some(1.0), _) => b,
        (_, Some(1.0)) => a,
        _ => e.call(Op::Mul, &[a, b]),
    }
}

/// The matrix of a point whose coordinates are each a uniform number, a coordinate, or a product or
/// sum of such, as in `p * 0.18 + offset`.
fn affine(e: &mut Expressions, coordinates: [ExprId; 3]) -> Option<[ExprId; 12]> {
    let rows = [
        affine_row(e, coordinates[0], 8)?,
        affine_row(e, coordinates[1], 8)?,
        affine_row(e, coordinates[2], 8)?,
    ];
    Some(std::array::from_fn(|i| rows[i / 4][i % 4]))
}

/// Factors of the three coordinates, and a shift; terms nest at most `depth` deep.
fn affine_row(e: &mut Expressions, id: ExprId, depth: u32) -> Option<[ExprId; 4]> {
    let zero = e.constant(0.0);
    if e.stage(id) <= crate::expression::Stage::Uniform {
        return Some([zero, zero, zero, id]);
    }
    if depth == 0 {
        return None;
    }
    match e.get(id).clone() {
        Expression::Coordinate(axis) => {
            let one = e.constant(1.0);
            Some(std::array::from_fn(|i| {
                if i == usize::from(axis) { one } else { zero }
            }))
        }
        Expression::Apply {
            op: Op::Add,
            values,
            ..
        } => {
            let a = affine_row(e, values[0], depth - 1)?;
            let b = affine_row(e, values[1], depth - 1)?;
            Some(std::array::from_fn(|i| add(e, a[i], b[i])))
        }
        Expression::Apply {
            op: Op::Mul,
            values,
            ..
        } => {
            let uniform = |e: &Expressions, id| e.stage(id) <= crate::expression::Stage::Uniform;
            let (factor, row) = match (uniform(e, values[0]), uniform(e, values[1])) {
                (true, _) => (values[0], affine_row(e, values[1], depth - 1)?),
                (_, true) => (values[1], affine_row(e, values[0], depth - 1)?),
                _ => return None,
            };
            Some(row.map(|number| multiply(e, number, factor)))
        }
        _ => None,
    }
}
