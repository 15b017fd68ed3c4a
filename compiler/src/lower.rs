//! Scene → graph: shapes become operations on points.
//!
//! Rigid motions, scales and other affine maps are composed on the way down and never follow each other
//! in the graph.
//!
//! A shape has the value that the scene writes wherever that value matters: under offsets, shells, blends and
//! displacements. Set operations without a blend compare signs only. There, and at the root, a value may
//! change faster than the point moves: that of a raw field, a twist, a displacement. It becomes a safe step
//! to its surface (`step`). So only this shape is slowed down. Bounds and slopes therefore never move a
//! surface.
//!
//! A scene is lowered twice: for its distance, and for its surface. In the graph of the surface,
//! material assignments stay, or each leaf has a material of its own ([`crate::provenance`]).

mod copies;
mod paint;
mod step;

use crate::analysis::bounds::ShapeBounds;
use crate::analysis::param_ranges::ParamRanges;
use crate::analysis::slope::ShapeSlopes;
use crate::expression::{ExprId, Expression, Expressions};
use crate::graph::{Graph, GraphNode, GraphNumber, NodeId, Origin, Purpose};
use crate::leaves::LeafTracker;
use crate::scene::{MaterialId, NO_EDGE, NO_SURFACE_DISTANCE, Scene, SceneRef, ShapeId, ShapeKind};
use crate::uniforms::{Uniforms, postorder};
use paint::Coverage;
use rustc_hash::FxHashMap;
use sdfc_lang::Diagnostic;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::HashSet;

/// Point at which a shape is evaluated: a node of the graph with a pending affine map.
#[derive(Clone, Copy)]
struct LocalPoint {
    base: NodeId,
    transform: Option<[ExprId; 12]>,
    /// Units of the local frame per unit of the world, if known, and 1 otherwise.
    unit: f64,
    /// World size of one unit of the local frame; `None` if nothing was scaled.
    scale: Option<ExprId>,
    /// Box in the local frame outside of which other shapes determine what is solid.
    region: Bounds,
}

impl LocalPoint {
    /// Returns a point of the world.
    fn world(base: NodeId) -> Self {
        Self {
            base,
            transform: None,
            unit: 1.0,
            scale: None,
            region: Bounds::ALL_SPACE,
        }
    }

    /// Returns another point of the graph with the same scale.
    fn moved_to(self, base: NodeId) -> Self {
        Self {
            base,
            transform: None,
            region: Bounds::ALL_SPACE,
            ..self
        }
    }
}

/// Use of a shape's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ValueUse {
    /// The value that the scene writes.
    Written,
    /// A safe step towards the surface, with the shape's sign: its slope is at most one.
    Step,
}

/// Lowers a shape of the scene, and collects the uniform numbers that it reads in `uniforms`. `boxes`
/// and `slopes` hold for all values of the parameters.
pub(crate) fn lower(
    scene: &mut Scene,
    shape: ShapeId,
    purpose: Purpose,
    slopes: &mut ShapeSlopes,
    uniforms: &mut Uniforms,
    boxes: &mut ShapeBounds,
) -> (Graph, Vec<Diagnostic>) {
    let (graph, _, diagnostics) = lower_for(scene, shape, purpose, slopes, uniforms, boxes);
    (graph, diagnostics)
}

/// Lowers a shape as for its surface, with a material per leaf in place of all material assignments of
/// the scene. Returns the leaves that the material numbers stand for.
pub(crate) fn lower_leaf_ids(
    scene: &mut Scene,
    shape: ShapeId,
    slopes: &mut ShapeSlopes,
    uniforms: &mut Uniforms,
    boxes: &mut ShapeBounds,
) -> (Graph, LeafTracker) {
    let (graph, leaf_tracker, _) =
        lower_for(scene, shape, Purpose::LeafIds, slopes, uniforms, boxes);
    (graph, leaf_tracker)
}

fn lower_for(
    scene: &mut Scene,
    shape: ShapeId,
    purpose: Purpose,
    slopes: &mut ShapeSlopes,
    uniforms: &mut Uniforms,
    boxes: &mut ShapeBounds,
) -> (Graph, LeafTracker, Vec<Diagnostic>) {
    let material_sets = material_sets(scene);
    let coverage = paint::coverage(scene);
    let has_painted_cutters = paint::has_painted_cutters(scene, &coverage);
    let mut graph = Graph::default();
    let world = graph.add(GraphNode::World);
    let mut lowering = Lowering {
        slopes,
        scene,
        boxes,
        material_sets,
        coverage,
        has_painted_cutters,
        has_operands: false,
        is_uncut: false,
        underlay: None,
        doublings: 0,
        uniforms,
        graph,
        purpose,
        leaf_tracker: LeafTracker::default(),
        unbounded: HashSet::new(),
        checked_for_inside: HashSet::new(),
        diagnostics: Vec::new(),
    };
    let is_combination = |_, kind: &ShapeKind| matches!(kind, ShapeKind::Combine { .. });
    lowering.has_operands = lowering.find_shape(shape, is_combination);
    let root = lowering.shape(shape, LocalPoint::world(world), ValueUse::Step);
    lowering.graph.root = root;
    lowering.warn_refuted_slopes(shape);
    (lowering.graph, lowering.leaf_tracker, lowering.diagnostics)
}

struct Lowering<'a> {
    slopes: &'a mut ShapeSlopes,
    scene: &'a mut Scene,
    boxes: &'a mut ShapeBounds,
    material_sets: Vec<MaterialSet>,
    coverage: Vec<Coverage>,
    /// For each shape, whether operands with a paint cut it or a part of it.
    has_painted_cutters: Vec<bool>,
    /// Set if the shape contains combinations of several operands.
    has_operands: bool,
    /// Set while bodies are lowered without their cutters, for their paint alone.
    is_uncut: bool,
    /// Value whose paint is shown by shapes without one.
    underlay: Option<NodeId>,
    /// Number of enclosing operations whose operands are lowered twice.
    doublings: u32,
    uniforms: &'a mut Uniforms,
    graph: Graph,
    purpose: Purpose,
    /// Leaves so far, and the enclosing shapes; only for [`Purpose::LeafIds`].
    leaf_tracker: LeafTracker,
    /// Shapes whose slope has no bound.
    unbounded: HashSet<ShapeId>,
    /// Fields that were tested for an inside.
    checked_for_inside: HashSet<ShapeId>,
    diagnostics: Vec<Diagnostic>,
}

impl Lowering<'_> {
    fn number(&mut self, id: ExprId) -> GraphNumber {
        self.uniforms.intern(&self.scene.expressions, id)
    }

    fn numbers(&mut self, ids: &[ExprId]) -> Vec<GraphNumber> {
        ids.iter().map(|&id| self.number(id)).collect()
    }

    /// Returns the node of the point itself, for operations that read it.
    fn point(&mut self, local_point: LocalPoint) -> NodeId {
        let Some(transform) = local_point.transform else {
            return local_point.base;
        };
        let rows: [GraphNumber; 12] = transform.map(|id| self.number(id));
        let linear_is_identity = (0..12)
            .filter(|i| i % 4 != 3)
            .all(|i| rows[i].is(if i % 4 == i / 4 { 1.0 } else { 0.0 }));
        if !linear_is_identity {
            return self.graph.add(GraphNode::Mapped {
                point: local_point.base,
                rows,
            });
        }
        let shift = [rows[3], rows[7], rows[11]];
        if shift.iter().all(|n| n.is(0.0)) {
            return local_point.base;
        }
        self.graph.add(GraphNode::Moved {
            point: local_point.base,
            by: shift,
        })
    }

    /// Returns `local_point` with one more affine map.
    fn under_transform(&mut self, local_point: LocalPoint, matrix: [ExprId; 12]) -> LocalPoint {
        let transform = match local_point.transform {
            Some(outer) => compose(&mut self.scene.expressions, &matrix, &outer),
            None => matrix,
        };
        let ranges = ParamRanges::for_scene(SceneRef::from(&*self.scene));
        let rows = matrix.map(|id| ranges.number(&self.scene.expressions, id));
        let linear = (0..12).filter(|i| i % 4 != 3).map(|i| rows[i]);
        let mean_square = linear
            .map(|range| range.lo.abs().max(range.hi.abs()).powi(2))
            .sum::<f64>()
            / 3.0;
        // A live scale without a limit says nothing about sizes.
        let stretch = match mean_square.is_normal() {
            true => mean_square.sqrt(),
            false => 1.0,
        };
        LocalPoint {
            base: local_point.base,
            transform: Some(transform),
            unit: local_point.unit * stretch,
            region: local_point.region.mapped_within(&rows),
            ..local_point
        }
    }

    fn apply(
        &mut self,
        op: Op,
        local_point: LocalPoint,
        values: Vec<NodeId>,
        parameters: Vec<GraphNumber>,
    ) -> NodeId {
        let point = op.row().reads_point().then(|| self.point(local_point));
        self.graph.add(GraphNode::Apply {
            op,
            point,
            values,
            parameters,
        })
    }

    /// Lowers a shape; without a paint, it shows that of the underlay, if there is one.
    fn shape(&mut self, id: ShapeId, local_point: LocalPoint, value_use: ValueUse) -> NodeId {
        let Some(underlay) = self.underlay else {
            return self.shape_without_underlay(id, local_point, value_use);
        };
        match self.coverage[id.0 as usize] {
            Coverage::Partial => self.shape_without_underlay(id, local_point, value_use),
            Coverage::Full => self.shape_over(None, id, local_point, value_use),
            Coverage::None => {
                let node = self.shape_over(None, id, local_point, value_use);
                self.with_paint_of(underlay, node, local_point)
            }
        }
    }

    /// Lowers a shape without its underlay. It recurses over nested shapes, whose depth the elaborator bounds.
    fn shape_without_underlay(
        &mut self,
        id: ShapeId,
        local_point: LocalPoint,
        value_use: ValueUse,
    ) -> NodeId {
        let shape = &self.scene.shapes[id.0 as usize];
        let origin = Origin {
            name: shape.name.clone(),
            span: Some(shape.span),
        };
        let outer = match self.purpose {
            Purpose::Distance | Purpose::Surface => None,
            Purpose::LeafIds => Some(self.leaf_tracker.enter(shape)),
        };
        let node = match shape.kind.clone() {
            ShapeKind::Primitive { op, parameters } => {
                let parameters = self.numbers(&parameters);
                self.apply(op, local_point, Vec::new(), parameters)
            }
            ShapeKind::Field { value, .. } => {
                let node = self.field(value, local_point);
                self.convert_value(node, id, local_point, value_use)
            }
            ShapeKind::Polygon { points } => self.polygon(&points, local_point),
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let node = self.combine(
                    op,
                    &children,
                    &parameters,
                    local_point,
                    operand_use(op, value_use),
                );
                self.convert_result(node, op, id, local_point, value_use)
            }
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let mut inner = self.under_transform(local_point, matrix);
                if self.scene.expressions.as_constant(scale) != Some(1.0) {
                    inner.scale = Some(self.times(scale, local_point.scale));
                }
                let node = self.shape(child, inner, value_use);
                let scale = self.number(scale);
                if scale.is(1.0) {
                    node
                } else {
                    self.apply(Op::ScaleDistance, local_point, vec![node], vec![scale])
                }
            }
            ShapeKind::Repeat { .. } | ShapeKind::Polar { .. } => {
                self.copies(id, local_point, value_use)
            }
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => {
                let parameters = self.numbers(&parameters);
                let point = self.apply(op, local_point, Vec::new(), parameters);
                let child_point = local_point.moved_to(point);
                // An operation that stretches space becomes a step together with everything below it.
                if matches!(op, Op::Twist | Op::Bend) {
                    let node = self.shape(child, child_point, ValueUse::Written);
                    self.convert_value(node, id, local_point, value_use)
                } else {
                    self.shape(child, child_point, value_use)
                }
            }
            ShapeKind::Warp { child, point } => {
                let coordinates = point.map(|number| self.field(number, local_point));
                let point =
                    self.apply(Op::MakePoint, local_point, coordinates.to_vec(), Vec::new());
                let node = self.shape(child, local_point.moved_to(point), ValueUse::Written);
                self.convert_value(node, id, local_point, value_use)
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let unbounded = LocalPoint {
                    region: Bounds::ALL_SPACE,
                    ..local_point
                };
                let node = self.shape(child, unbounded, operand_use(op, value_use));
                let parameters = self.numbers(&parameters);
                let node = self.apply(op, local_point, vec![node], parameters);
                self.convert_result(node, op, id, local_point, value_use)
            }
            ShapeKind::Displace { child, amount } => {
                let node = self.shape(child, local_point, ValueUse::Written);
                let amount = self.field(amount, local_point);
                let sum = self.apply(Op::Add, local_point, vec![node, amount], Vec::new());
                self.convert_value(sum, id, local_point, value_use)
            }
            ShapeKind::Painted { child, material } => {
                let node = self.shape(child, local_point, value_use);
                match self.purpose {
                    Purpose::Distance | Purpose::LeafIds => node,
                    Purpose::Surface => self.paint(node, material, local_point),
                }
            }
            ShapeKind::Nothing => {
                let no_surface = GraphNumber::Constant(NO_SURFACE_DISTANCE as f32);
                self.graph.add(GraphNode::Constant(no_surface))
            }
        };
        self.graph.set_origin(node, origin);
        match outer {
            Some(outer) => self.exit_shape(id, outer, node),
            None => node,
        }
    }

    /// Combines shapes from left to right.
    fn combine(
        &mut self,
        op: Op,
        children: &[ShapeId],
        parameters: &[ExprId],
        local_point: LocalPoint,
        value_use: ValueUse,
    ) -> NodeId {
        let parameters = self.numbers(parameters);
        let operand_points = self.operand_points(op, children, local_point, value_use);
        if self.is_uncut && op.row().facts.set == Some(SetOperation::Subtraction) {
            return self.shape(children[0], operand_points[0], value_use);
        }
        if self.purpose == Purpose::Surface && self.shows_through(op, children) {
            return self.combine_painted(
                op,
                children,
                &parameters,
                local_point,
                operand_points,
                value_use,
            );
        }
        let first = children[0];
        let [first_point, other_point] = operand_points;
        let mut left = self.shape(first, first_point, value_use);
        let mut materials = self.material_sets[first.0 as usize];
        for &child in &children[1..] {
            let right = self.shape(child, other_point, value_use);
            let other = self.material_sets[child.0 as usize];
            let combined = self.apply(op, local_point, vec![left, right], parameters.clone());
            // A cutter without a paint of its own shows the paint of the body on the face it cuts. The
            // first operand of a subtraction is no cutter.
            use SetOperation::{Intersection, Subtraction};
            let set = op
                .row()
                .facts
                .set
                .filter(|_| self.purpose == Purpose::Surface);
            let paint_source = match (set, materials, other) {
                (_, MaterialSet::None, MaterialSet::None) => None,
                (Some(Intersection | Subtraction), _, MaterialSet::None) => Some(left),
                (Some(Intersection), MaterialSet::None, _) => Some(right),
                _ => None,
            };
            left = match paint_source {
                Some(paint_source) => self.with_paint_of(paint_source, combined, local_point),
                None => combined,
            };
            materials = materials.join(other);
        }
        left
    }

    /// Returns the points at which an operation evaluates its first operand and the others. All
    /// operands of an intersection bound the region of each. A cutter keeps its region: where that
    /// ended, it would have a face that light sees.
    fn operand_points(
        &mut self,
        op: Op,
        children: &[ShapeId],
        local_point: LocalPoint,
        value_use: ValueUse,
    ) -> [LocalPoint; 2] {
        use SetOperation::{Intersection, Subtraction, Union};
        let unbounded = LocalPoint {
            region: Bounds::ALL_SPACE,
            ..local_point
        };
        match op.row().facts.set.filter(|_| value_use == ValueUse::Step) {
            Some(Union) => [local_point; 2],
            Some(Subtraction) => [local_point, unbounded],
            Some(Intersection) => {
                let scene = &*self.scene;
                let boxes = children
                    .iter()
                    .map(|&child| self.boxes.get(SceneRef::from(scene), child));
                let region = boxes.fold(local_point.region, |common, bounds| {
                    common.intersection(&bounds)
                });
                [LocalPoint {
                    region,
                    ..local_point
                }; 2]
            }
            None => [unbounded; 2],
        }
    }

    /// Converts the result of an operation to the requested use.
    fn convert_result(
        &mut self,
        node: NodeId,
        op: Op,
        id: ShapeId,
        local_point: LocalPoint,
        value_use: ValueUse,
    ) -> NodeId {
        match operand_use(op, value_use) {
            ValueUse::Step => node,
            ValueUse::Written => self.convert_value(node, id, local_point, value_use),
        }
    }

    /// Returns a shape's written value, or a step where that is requested.
    fn convert_value(
        &mut self,
        node: NodeId,
        id: ShapeId,
        local_point: LocalPoint,
        value_use: ValueUse,
    ) -> NodeId {
        match value_use {
            ValueUse::Written => node,
            ValueUse::Step => self.step(node, id, local_point),
        }
    }

    /// Leaves a shape; a leaf is painted with its number.
    fn exit_shape(&mut self, id: ShapeId, outer: Option<u32>, node: NodeId) -> NodeId {
        self.leaf_tracker.leave(outer);
        let shape = &self.scene.shapes[id.0 as usize];
        let Some(number) = self.leaf_tracker.number(shape) else {
            return node;
        };
        let mut constants = [GraphNumber::Constant(0.0); 12];
        constants[8] = GraphNumber::Constant(number as f32);
        self.graph.add(GraphNode::Paint {
            value: node,
            constants,
            channels: Vec::new(),
        })
    }

    /// Lowers a number of point stage to values of the graph.
    fn field(&mut self, id: ExprId, local_point: LocalPoint) -> NodeId {
        let order = postorder(&self.scene.expressions, id, |_| false);
        let mut nodes = FxHashMap::default();
        for id in order {
            // A uniform number is one constant, whatever its definition.
            if self.scene.expressions.stage(id) <= crate::expression::Stage::Uniform {
                continue;
            }
            let node = match self.scene.expressions.get(id).clone() {
                Expression::Coordinate(axis) => {
                    let op = [Op::X, Op::Y, Op::Z][usize::from(axis)];
                    self.apply(op, local_point, Vec::new(), Vec::new())
                }
                Expression::NormalComponent(axis) => {
                    let point = self.point(local_point);
                    self.graph.add(GraphNode::Normal { point, axis })
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
                    let local_point = match point {
                        Some(p) => local_point.moved_to(self.point_from_coordinates(
                            p,
                            &nodes,
                            local_point,
                        )),
                        None => local_point,
                    };
                    self.apply(op, local_point, values, parameters)
                }
                Expression::Constant(_) | Expression::Param(..) | Expression::Time => {
                    unreachable!("known before the point is")
                }
            };
            nodes.insert(id, node);
        }
        self.operand(id, &nodes)
    }

    /// Returns a number that was lowered before, or a uniform one.
    fn operand(&mut self, id: ExprId, nodes: &FxHashMap<ExprId, NodeId>) -> NodeId {
        match nodes.get(&id) {
            Some(&node) => node,
            None => {
                let number = self.number(id);
                self.graph.add(GraphNode::Constant(number))
            }
        }
    }

    /// Returns the point with these coordinates. If they only scale or move the current point, that is
    /// one instruction instead of four.
    fn point_from_coordinates(
        &mut self,
        coordinates: [ExprId; 3],
        nodes: &FxHashMap<ExprId, NodeId>,
        local_point: LocalPoint,
    ) -> NodeId {
        if let Some(matrix) = affine(&mut self.scene.expressions, coordinates) {
            let transformed = self.under_transform(local_point, matrix);
            return self.point(transformed);
        }
        let values = coordinates.map(|id| self.operand(id, nodes)).to_vec();
        self.graph.add(GraphNode::Apply {
            op: Op::MakePoint,
            point: None,
            values,
            parameters: Vec::new(),
        })
    }

    fn polygon(&mut self, points: &[[ExprId; 2]], local_point: LocalPoint) -> NodeId {
        let corners: Vec<[GraphNumber; 2]> =
            points.iter().map(|p| p.map(|id| self.number(id))).collect();
        let mut value = self
            .graph
            .add(GraphNode::Constant(GraphNumber::Constant(NO_EDGE as f32)));
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            let parameters = vec![a[0], a[1], b[0], b[1]];
            value = self.apply(Op::PolygonEdge, local_point, vec![value], parameters);
        }
        value
    }

    /// Multiplies a number by a scale, if there is one.
    fn times(&mut self, number: ExprId, scale: Option<ExprId>) -> ExprId {
        match scale {
            Some(scale) => self.scene.expressions.call(Op::Mul, &[number, scale]),
            None => number,
        }
    }

    fn paint(&mut self, value: NodeId, id: MaterialId, local_point: LocalPoint) -> NodeId {
        let material = self.scene.materials[id.0 as usize].clone();
        let mut constants = [GraphNumber::Constant(0.0); 12];
        let mut channels = Vec::new();
        for (channel, &number) in material.channel_numbers().iter().enumerate() {
            if self.scene.expressions.stage(number) <= crate::expression::Stage::Uniform {
                constants[channel] = self.number(number);
            } else {
                channels.push((channel as u8, self.field(number, local_point)));
            }
        }
        constants[8] = GraphNumber::Constant(id.0 as f32);
        if let Some(bump) = material.bump {
            // Heights scale with the surface below them.
            let bump = match local_point.scale {
                Some(_) => self.times(bump, local_point.scale),
                None => bump,
            };
            channels.push((8, self.field(bump, local_point)));
            constants[9] = GraphNumber::Constant(1.0);
        }
        self.graph.add(GraphNode::Paint {
            value,
            constants,
            channels,
        })
    }
}

/// Returns the use of an operation's operands.
fn operand_use(op: Op, value_use: ValueUse) -> ValueUse {
    if op.row().facts.uses_only_signs {
        value_use
    } else {
        ValueUse::Written
    }
}

/// Materials assigned to a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MaterialSet {
    /// No material.
    None,
    /// This one, wherever there is one.
    One(MaterialId),
    /// Several materials.
    Many,
}

impl MaterialSet {
    fn join(self, other: Self) -> Self {
        match (self, other) {
            (materials, MaterialSet::None) | (MaterialSet::None, materials) => materials,
            (a, b) if a == b => a,
            _ => MaterialSet::Many,
        }
    }
}

/// Returns the materials of every shape.
fn material_sets(scene: &Scene) -> Vec<MaterialSet> {
    let mut sets: Vec<MaterialSet> = Vec::with_capacity(scene.shapes.len());
    for shape in &scene.shapes {
        sets.push(match &shape.kind {
            ShapeKind::Painted { material, .. } => MaterialSet::One(*material),
            ShapeKind::Combine { children, .. } => children
                .iter()
                .map(|child| sets[child.0 as usize])
                .fold(MaterialSet::None, MaterialSet::join),
            ShapeKind::Frame { child, .. }
            | ShapeKind::Repeat { child, .. }
            | ShapeKind::Polar { child, .. }
            | ShapeKind::Domain { child, .. }
            | ShapeKind::Warp { child, .. }
            | ShapeKind::Distance { child, .. }
            | ShapeKind::Displace { child, .. } => sets[child.0 as usize],
            ShapeKind::Primitive { .. }
            | ShapeKind::Field { .. }
            | ShapeKind::Polygon { .. }
            | ShapeKind::Nothing => MaterialSet::None,
        });
    }
    sets
}

/// Returns `inner` after `outer`: 3×4 matrices by rows.
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

/// Returns the matrix of a point whose coordinates are sums or products of coordinates and uniform
/// numbers, as in `p * 0.18 + offset`.
fn affine(e: &mut Expressions, coordinates: [ExprId; 3]) -> Option<[ExprId; 12]> {
    let rows = [
        affine_row(e, coordinates[0], 8)?,
        affine_row(e, coordinates[1], 8)?,
        affine_row(e, coordinates[2], 8)?,
    ];
    Some(std::array::from_fn(|i| rows[i / 4][i % 4]))
}

/// Returns the factors of the three coordinates, and a shift; terms nest at most `depth` deep.
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
