//! Scene → graph: shapes become operations on points.
//!
//! Rigid motions, scales and other affine maps are composed on the way down and never stand in the
//! graph one after the other.
//!
//! A shape has the value that the scene writes wherever that value matters: under offsets, shells, blends
//! and displacements. Set operations without a blend compare signs alone. There, and at the root, a shape
//! whose value could change faster than the point moves (a raw field, a twist, a displacement) is turned
//! into a safe step to its surface (`step`), so that only this shape is slowed down. Bounds and slopes
//! therefore never move a surface.
//!
//! The same scene is lowered twice: once for its distance, once for its surface, where paints stay
//! in the graph, or where each leaf has a paint of its own ([`crate::origins`]).

mod copies;
mod paint;
mod step;

use crate::bounds::{Boxes, World};
use crate::expression::{ExprId, Expression, Expressions};
use crate::graph::{Graph, Node, NodeId, Number, Origin};
use crate::origins::Trail;
use crate::scene::{Material, MaterialId, NO_EDGE, NOWHERE, Scene, ShapeId, ShapeKind};
use crate::slope::ShapeSlopes;
use crate::uniforms::{Uniforms, operands_first};
use paint::Coverage;
use sdfc_lang::Diagnostic;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::{HashMap, HashSet};

/// The point a shape is evaluated at: a node of the graph, seen through an affine map.
#[derive(Clone, Copy)]
struct At {
    base: NodeId,
    frame: Option<[ExprId; 12]>,
    /// Units of the local frame per unit of the world, as far as that is known.
    unit: f64,
    /// The size in the world of what has the size one in the local frame; none where nothing was scaled.
    scale: Option<ExprId>,
    /// A box in the local frame, outside of which others decide what is solid.
    region: Bounds,
}

impl At {
    /// A point of the world.
    fn world(base: NodeId) -> Self {
        Self {
            base,
            frame: None,
            unit: 1.0,
            scale: None,
            region: Bounds::EVERYTHING,
        }
    }

    /// Another point of the graph, which is on the scale of this one.
    fn moved_to(self, base: NodeId) -> Self {
        Self {
            base,
            frame: None,
            region: Bounds::EVERYTHING,
            ..self
        }
    }
}

/// The values that are wanted of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wanted {
    /// Those that the scene writes.
    Written,
    /// A safe step towards the surface, with the shape's sign: no steeper than one.
    Step,
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
/// `boxes` and `slopes` are those that hold for all values of the parameters.
pub(crate) fn lower(
    scene: &mut Scene,
    shape: ShapeId,
    purpose: Purpose,
    slopes: &mut ShapeSlopes,
    uniforms: &mut Uniforms,
    boxes: &mut Boxes,
) -> (Graph, Vec<Diagnostic>) {
    let (graph, _, diagnostics) = walk(scene, shape, purpose, slopes, uniforms, boxes);
    (graph, diagnostics)
}

/// Lowers a shape as for its surface, but each leaf has a material of its own, in place of all paints
/// of the scene; gives what the materials' numbers stand for.
pub(crate) fn lower_origins(
    scene: &mut Scene,
    shape: ShapeId,
    slopes: &mut ShapeSlopes,
    uniforms: &mut Uniforms,
    boxes: &mut Boxes,
) -> (Graph, Trail) {
    let (graph, trail, _) = walk(scene, shape, Purpose::Origins, slopes, uniforms, boxes);
    (graph, trail)
}

fn walk(
    scene: &mut Scene,
    shape: ShapeId,
    purpose: Purpose,
    slopes: &mut ShapeSlopes,
    uniforms: &mut Uniforms,
    boxes: &mut Boxes,
) -> (Graph, Trail, Vec<Diagnostic>) {
    let paints = paints(scene);
    let coverage = paint::coverage(scene);
    let mut graph = Graph::default();
    let world = graph.add(Node::World);
    let mut lowering = Lowering {
        slopes,
        scene,
        boxes,
        paints,
        coverage,
        underlay: None,
        doublings: 0,
        uniforms,
        graph,
        purpose,
        trail: Trail::default(),
        unbounded: HashSet::new(),
        entered: HashSet::new(),
        diagnostics: Vec::new(),
    };
    let root = lowering.shape(shape, At::world(world), Wanted::Step);
    lowering.graph.root = root;
    lowering.report_refuted();
    (lowering.graph, lowering.trail, lowering.diagnostics)
}

struct Lowering<'a> {
    slopes: &'a mut ShapeSlopes,
    scene: &'a mut Scene,
    boxes: &'a mut Boxes,
    paints: Vec<Paints>,
    coverage: Vec<Coverage>,
    /// The value whose paint shapes without one show.
    underlay: Option<NodeId>,
    /// The number of operations around the present shape whose operands are lowered twice.
    doublings: u32,
    uniforms: &'a mut Uniforms,
    graph: Graph,
    purpose: Purpose,
    /// The leaves met so far, and the shapes around the present one; only for [`Purpose::Origins`].
    trail: Trail,
    /// Shapes whose slope has no bound.
    unbounded: HashSet<ShapeId>,
    /// The fields of which it was asked whether they have an inside.
    entered: HashSet<ShapeId>,
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
        let linear =
            [0, 1, 2, 4, 5, 6, 8, 9, 10].map(|i| self.scene.expressions.as_constant(matrix[i]));
        let stretch = linear.iter().flatten().map(|v| v * v).sum::<f64>() / 3.0;
        let map: Option<Vec<f64>> = matrix
            .iter()
            .map(|&id| self.scene.expressions.as_constant(id))
            .collect();
        let region = map.map_or(Bounds::EVERYTHING, |map| {
            let row = |r: usize| std::array::from_fn(|column| map[4 * r + column]);
            at.region.mapped(&[row(0), row(1), row(2)])
        });
        At {
            base: at.base,
            frame: Some(frame),
            unit: at.unit * stretch.sqrt(),
            region,
            ..at
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

    /// A shape; one without paint shows that of the underlay, if there is one.
    fn shape(&mut self, id: ShapeId, at: At, wanted: Wanted) -> NodeId {
        let Some(underlay) = self.underlay else {
            return self.shape_alone(id, at, wanted);
        };
        match self.coverage[id.0 as usize] {
            Coverage::Partial => self.shape_alone(id, at, wanted),
            Coverage::Full => self.shape_over(None, id, at, wanted),
            Coverage::None => {
                let node = self.shape_over(None, id, at, wanted);
                self.painted_like(underlay, node, at)
            }
        }
    }

    /// Recursion over shapes within shapes, whose depth the elaborator bounds.
    fn shape_alone(&mut self, id: ShapeId, at: At, wanted: Wanted) -> NodeId {
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
            ShapeKind::Field { value, .. } => {
                let node = self.field(value, at);
                self.given(node, id, at, wanted)
            }
            ShapeKind::Polygon { points } => self.polygon(&points, at),
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let node = self.combine(op, &children, &parameters, at, inner(op, wanted));
                self.changed(node, op, id, at, wanted)
            }
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let mut inner = self.framed(at, matrix);
                if self.scene.expressions.as_constant(scale) != Some(1.0) {
                    inner.scale = Some(self.times(scale, at.scale));
                }
                let node = self.shape(child, inner, wanted);
                let scale = self.number(scale);
                if scale.is(1.0) {
                    node
                } else {
                    self.apply(Op::ScaleDistance, at, vec![node], vec![scale])
                }
            }
            ShapeKind::Repeat { .. } | ShapeKind::Polar { .. } => self.copies(id, at, wanted),
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => {
                let parameters = self.numbers(&parameters);
                let point = self.apply(op, at, Vec::new(), parameters);
                let at_child = at.moved_to(point);
                // What stretches space is turned into a step with all that lies behind it.
                if matches!(op, Op::Twist | Op::Bend) {
                    let node = self.shape(child, at_child, Wanted::Written);
                    self.given(node, id, at, wanted)
                } else {
                    self.shape(child, at_child, wanted)
                }
            }
            ShapeKind::Warp { child, point } => {
                let coordinates = point.map(|number| self.field(number, at));
                let point = self.apply(Op::MakePoint, at, coordinates.to_vec(), Vec::new());
                let node = self.shape(child, at.moved_to(point), Wanted::Written);
                self.given(node, id, at, wanted)
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let anywhere = At {
                    region: Bounds::EVERYTHING,
                    ..at
                };
                let node = self.shape(child, anywhere, inner(op, wanted));
                let parameters = self.numbers(&parameters);
                let node = self.apply(op, at, vec![node], parameters);
                self.changed(node, op, id, at, wanted)
            }
            ShapeKind::Displace { child, amount } => {
                let node = self.shape(child, at, Wanted::Written);
                let amount = self.field(amount, at);
                let sum = self.apply(Op::Add, at, vec![node, amount], Vec::new());
                self.given(sum, id, at, wanted)
            }
            ShapeKind::Painted { child, material } => {
                let node = self.shape(child, at, wanted);
                match self.purpose {
                    Purpose::Distance | Purpose::Origins => node,
                    Purpose::Surface => self.paint(node, material, at),
                }
            }
            ShapeKind::Nothing => {
                let nowhere = Number::Constant(NOWHERE as f32);
                self.graph.add(Node::Constant(nowhere))
            }
        };
        self.graph.set_origin(node, origin);
        match outer {
            Some(outer) => self.leave(id, outer, node),
            None => node,
        }
    }

    /// Shapes combined from left to right.
    fn combine(
        &mut self,
        op: Op,
        children: &[ShapeId],
        parameters: &[ExprId],
        at: At,
        wanted: Wanted,
    ) -> NodeId {
        let parameters = self.numbers(parameters);
        let places = self.within(op, children, at, wanted);
        if self.purpose == Purpose::Surface && self.shows_through(op, children) {
            return self.combine_painted(op, children, &parameters, at, places, wanted);
        }
        let first = children[0];
        let [at_first, at_others] = places;
        let mut left = self.shape(first, at_first, wanted);
        let mut paints = self.paints[first.0 as usize];
        for &child in &children[1..] {
            let right = self.shape(child, at_others, wanted);
            let other = self.paints[child.0 as usize];
            let cut = self.apply(op, at, vec![left, right], parameters.clone());
            // What only cuts leaves no paint of its own: the face it makes shows what is cut there. The body
            // that something is taken from is no cutter.
            use SetOperation::{Intersection, Subtraction};
            let set = op
                .row()
                .meta
                .set
                .filter(|_| self.purpose == Purpose::Surface);
            let shown = match (set, paints, other) {
                (_, Paints::None, Paints::None) => None,
                (Some(Intersection | Subtraction), _, Paints::None) => Some(left),
                (Some(Intersection), Paints::None, _) => Some(right),
                _ => None,
            };
            left = match shown {
                Some(shown) => self.painted_like(shown, cut, at),
                None => cut,
            };
            paints = paints.join(other);
        }
        left
    }

    /// The places at which an operation evaluates its first operand and the others. All operands of an intersection
    /// bound the region of each. A cutter is left whole: where it ended, it would have a face that light sees.
    fn within(&mut self, op: Op, children: &[ShapeId], at: At, wanted: Wanted) -> [At; 2] {
        use SetOperation::{Intersection, Subtraction, Union};
        let anywhere = At {
            region: Bounds::EVERYTHING,
            ..at
        };
        match op.row().meta.set.filter(|_| wanted == Wanted::Step) {
            Some(Union) => [at; 2],
            Some(Subtraction) => [at, anywhere],
            Some(Intersection) => {
                let scene = &*self.scene;
                let boxes = children
                    .iter()
                    .map(|&child| self.boxes.of(World::from(scene), child));
                let region = boxes.fold(at.region, |common, bounds| common.common(&bounds));
                [At { region, ..at }; 2]
            }
            None => [anywhere; 2],
        }
    }

    /// A value made by an operation of operands as they were wanted for it, as it is wanted itself.
    fn changed(&mut self, node: NodeId, op: Op, id: ShapeId, at: At, wanted: Wanted) -> NodeId {
        match inner(op, wanted) {
            Wanted::Step => node,
            Wanted::Written => self.given(node, id, at, wanted),
        }
    }

    /// A shape's value as it is written, or as a step where that is wanted.
    fn given(&mut self, node: NodeId, id: ShapeId, at: At, wanted: Wanted) -> NodeId {
        match wanted {
            Wanted::Written => node,
            Wanted::Step => self.step(node, id, at),
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
                        Some(p) => at.moved_to(self.made_point(p, &nodes, at)),
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
        let mut value = self
            .graph
            .add(Node::Constant(Number::Constant(NO_EDGE as f32)));
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            let parameters = vec![a[0], a[1], b[0], b[1]];
            value = self.apply(Op::PolygonEdge, at, vec![value], parameters);
        }
        value
    }

    /// A number times a scale, if there is one.
    fn times(&mut self, number: ExprId, scale: Option<ExprId>) -> ExprId {
        match scale {
            Some(scale) => self.scene.expressions.call(Op::Mul, &[number, scale]),
            None => number,
        }
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
            // Heights grow with what they stand on.
            let bump = match at.scale {
                Some(_) => self.times(bump, at.scale),
                None => bump,
            };
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

/// The values that an operation wants of its operands.
fn inner(op: Op, wanted: Wanted) -> Wanted {
    if op.row().meta.only_signs {
        wanted
    } else {
        Wanted::Written
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
            | ShapeKind::Repeat { child, .. }
            | ShapeKind::Polar { child, .. }
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
