//! A shape as a separate scene, with the claims stated about it.

use crate::oracle::{Point, elaborate_if_valid};
use sdfc_compiler::compile::{Compiled, Options, compile};
use sdfc_compiler::cutter_extension::extend_cutters;
use sdfc_compiler::expression::ExprId;
use sdfc_compiler::graph::{Graph, GraphNode, GraphNumber, NodeId};
use sdfc_compiler::scene::{Scene, Shape, ShapeId, ShapeKind};
use sdfc_compiler::schedule::schedule;
use sdfc_trials::oracle::{Oracle, children};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::program::Program;
use sdfc_vm::row::Exactness;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::path::Path;

/// Half the side of the cube of all points that rays can reach, in sizes of the scene.
const RAY_RANGE_SIZES: f64 = 1e6;

/// A region of space with the stated slope bound.
#[derive(Clone, Copy, Debug)]
pub(super) struct StatedSlope {
    pub(super) region: Bounds,
    pub(super) slope: f64,
}

/// A value and its gradient.
pub(super) struct ValueAndGradient {
    pub(super) value: f64,
    pub(super) gradient: Point,
}

/// A shape as a separate scene.
pub(super) struct TestShape {
    /// Name for messages.
    pub(super) name: String,
    /// Program of the value as written.
    pub(super) written: Program,
    /// Program of the marching step.
    pub(super) step: Program,
    /// Stated slope bounds of the written value.
    pub(super) slopes: Vec<StatedSlope>,
    /// Set if the compiler states that a slope bound is only estimated where rays may pass.
    pub(super) has_estimated_bound: bool,
    /// Bound of the slope of the value, in units of the stated ones.
    pub(super) max_slope: f64,
    /// Bound of the slope of the marching step.
    pub(super) max_step_slope: f64,
    /// Bounding box at the current values of the parameters.
    pub(super) bounds: Bounds,
    /// All boxes stated to contain the shape.
    pub(super) boxes: Vec<Bounds>,
    /// Set if the state differs from that of compilation.
    pub(super) is_at_other_state: bool,
    /// Compiled scene.
    pub(super) compiled: Compiled,
    /// Independent evaluator.
    pub(super) oracle: Oracle,
    /// Set if the rows promise the values, and all copies are copies of exact distances.
    pub(super) has_known_values: bool,
    /// Approximate half size of the visible scene.
    pub(super) size: f64,
}

/// Returns the scene of a text, or `None` if it has errors.
pub(super) fn parse_scene(text: &str) -> Option<Scene> {
    elaborate_if_valid(Path::new("."), text)
}

/// Returns the root shape of a text, or `None` if it has errors.
pub(super) fn parse_shape(text: &str) -> Option<TestShape> {
    let scene = parse_scene(text)?;
    let root = scene.root?;
    TestShape::new(&scene, root, text)
}

/// Returns the root shape of a text.
///
/// Panics if the text has errors.
pub(super) fn valid_shape(text: &str) -> TestShape {
    parse_shape(text).unwrap_or_else(|| panic!("{text} is refused"))
}

/// Returns the solids of a scene, from the root down.
pub(super) fn solids(scene: &Scene) -> Vec<ShapeId> {
    let Some(root) = scene.root else {
        return Vec::new();
    };
    let ids = (0..=root.0).rev().map(ShapeId);
    let is_solid = |id: &ShapeId| {
        let shape = &scene.shapes[id.0 as usize];
        !shape.is_2d && !matches!(shape.kind, ShapeKind::Nothing)
    };
    ids.filter(is_solid).collect()
}

/// Values of live parameters, and a time.
#[derive(Clone, Debug, Default)]
pub(super) struct ParamState {
    /// Values by parameter. If empty, parameters keep their own values.
    pub(super) values: Vec<Vec<f64>>,
    /// Time in seconds.
    pub(super) time: f64,
}

impl ParamState {
    /// Applies the state to a compiled scene. Returns the results of its uniform program.
    fn apply_to(&self, compiled: &mut Compiled) -> Vec<f32> {
        let params = &mut compiled.module.settings.params;
        for (param, value) in params.iter_mut().zip(&self.values) {
            param.value.clone_from(value);
        }
        let uniform_values = compiled.update(self.time);
        uniform_values.into_iter().map(|v| v as f32).collect()
    }

    /// Returns the scene with these values of its parameters.
    fn scene_with(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        for (param, value) in scene.params.iter_mut().zip(&self.values) {
            param.value.clone_from(value);
        }
        scene
    }
}

impl TestShape {
    /// Compiles a shape of a scene, or returns `None` if it cannot be compiled.
    pub(super) fn new(scene: &Scene, id: ShapeId, name: &str) -> Option<Self> {
        Self::new_at(scene, id, name, &ParamState::default())
    }

    /// Compiles a shape of a scene, then applies another state to it.
    pub(super) fn new_at(
        scene: &Scene,
        id: ShapeId,
        name: &str,
        state: &ParamState,
    ) -> Option<Self> {
        let mut scene = scene.clone();
        scene.root = Some(id);
        let (compiled, _) = compile(scene.clone(), &Options::default());
        let mut compiled = compiled?;
        state.apply_to(&mut compiled);
        let settings = &compiled.module.settings;
        let bounds = settings.current_bounds.bounds;
        let max_step_slope = settings.max_slope();
        let mut boxes = vec![bounds, settings.bounds_for_all_params];
        let is_at_other_state = !state.values.is_empty() || state.time != 0.0;
        if !is_at_other_state {
            boxes.push(settings.bounds);
        }

        // An offset by zero makes the compiler keep the values below it as written.
        let zero = scene.expressions.constant(0.0);
        let outer = &scene.shapes[id.0 as usize];
        let unnormalized = Shape {
            kind: ShapeKind::Distance {
                op: Op::Offset,
                child: id,
                parameters: vec![zero],
            },
            ..outer.clone()
        };
        // The oracle evaluates the lengthened cutters, as they are compiled.
        let mut with_long_cutters = state.scene_with(&scene);
        let root_id = extend_cutters(&mut with_long_cutters, id);
        let oracle = Oracle::new(&with_long_cutters, root_id, state.time);
        let has_known_values = !repeats_inexact_distances(&scene, id);
        scene.shapes.push(unnormalized);
        scene.root = Some(ShapeId(scene.shapes.len() as u32 - 1));
        let mut unnormalized = compile(scene, &Options::default()).0?;
        let max_slope = unnormalized.module.settings.max_slope();
        let has_estimated_bound = max_slope.max(max_step_slope).is_infinite();
        let uniform_values = state.apply_to(&mut unnormalized);
        let size = largest_finite_coordinate(&bounds);
        let ray_range = Bounds::centred([RAY_RANGE_SIZES * size; 3]);
        let (root, slopes) = stated_slopes(&unnormalized.graph, ray_range);
        let mut graph = unnormalized.graph;
        graph.root = root;
        let mut written = schedule(&graph);
        written.patch(&uniform_values);
        Some(Self {
            name: name.to_owned(),
            written,
            step: compiled.module.distance.clone(),
            slopes,
            has_estimated_bound,
            max_slope,
            max_step_slope,
            bounds,
            boxes,
            is_at_other_state,
            compiled,
            oracle,
            has_known_values,
            size,
        })
    }

    /// Returns the value as written.
    pub(super) fn value(&self, p: Point) -> f64 {
        evaluate_f64(&self.written, p)
    }

    /// Returns the marching step.
    pub(super) fn step(&self, p: Point) -> f64 {
        evaluate_f64(&self.step, p)
    }

    /// Returns the value as written and its gradient.
    pub(super) fn gradient(&self, p: Point) -> ValueAndGradient {
        value_and_gradient(&self.written, p)
    }
}

/// Returns a program's value and gradient at a point.
pub(super) fn value_and_gradient(program: &Program, [x, y, z]: Point) -> ValueAndGradient {
    let dual = gradient::<f64>(program, V3::new(x, y, z));
    let V3 { x, y, z } = dual.gradient;
    ValueAndGradient {
        value: dual.value,
        gradient: [x, y, z],
    }
}

/// Returns the largest finite coordinate of a box, or 1 if that is larger.
fn largest_finite_coordinate(bounds: &Bounds) -> f64 {
    let corners = bounds.min.iter().chain(&bounds.max);
    let finite = corners.filter(|v| v.is_finite());
    finite.fold(1.0, |size, v| size.max(v.abs()))
}

/// Returns the node of the written value, and the slope bounds that the compiler divides by.
fn stated_slopes(graph: &Graph, ray_range: Bounds) -> (NodeId, Vec<StatedSlope>) {
    let slope_in = |region: Bounds, slope: f64| StatedSlope { region, slope };
    let GraphNode::Apply {
        op,
        values,
        parameters,
        ..
    } = graph.get(graph.root)
    else {
        return (graph.root, vec![slope_in(Bounds::ALL_SPACE, 1.0)]);
    };
    let numbers: Vec<f64> = parameters
        .iter()
        .map(|number| match number {
            GraphNumber::Constant(v) => f64::from(*v),
            GraphNumber::Uniform(_) => f64::NAN,
        })
        .collect();
    match op {
        Op::FieldDistance => (values[0], vec![slope_in(ray_range, 1.0 / numbers[0])]),
        Op::FieldGrowth => {
            let [side, exponent, fraction, inverse, point_along] =
                std::array::from_fn(|number| numbers[number]);
            // Growth of a step in the field, and its safety factor.
            let factor = 0.8 / point_along / (1.0 + fraction).powf(exponent);
            let cubes = (0..20).map(|n| f64::from(1 << n));
            let outer = cubes.map(|cube| {
                let region = Bounds::centred([side * cube; 3]).intersection(&ray_range);
                slope_in(region, factor * cube.powf(exponent))
            });
            let inner = slope_in(Bounds::centred([side; 3]), 1.0 / inverse);
            (values[0], std::iter::once(inner).chain(outer).collect())
        }
        // No bound is stated for a discontinuous value.
        Op::Piecewise => (values[0], Vec::new()),
        Op::Bounded => {
            let inner = Bounds {
                min: [0, 1, 2].map(|i| numbers[i] - numbers[4 + i] - numbers[3]),
                max: [0, 1, 2].map(|i| numbers[i] + numbers[4 + i] + numbers[3]),
            };
            let mut child_graph = graph.clone();
            child_graph.root = values[0];
            let (root, slopes) = stated_slopes(&child_graph, inner);
            let slopes = slopes.into_iter().map(|s| slope_in(inner, s.slope));
            (root, slopes.collect())
        }
        _ => (graph.root, vec![slope_in(Bounds::ALL_SPACE, 1.0)]),
    }
}

/// Reports whether a shape contains copies of a shape whose values are not distances.
///
/// Copies are evaluated where they may be nearest, by boxes. A value below the distance may be the minimum
/// in a copy that is farther away.
fn repeats_inexact_distances(scene: &Scene, id: ShapeId) -> bool {
    let kind = &scene.shapes[id.0 as usize].kind;
    let repeats_inexact = match kind {
        ShapeKind::Repeat { child, .. } | ShapeKind::Polar { child, .. } => {
            !is_distance(scene, *child)
        }
        _ => false,
    };
    repeats_inexact
        || children(kind)
            .iter()
            .any(|&child| repeats_inexact_distances(scene, child))
}

/// Reports whether a shape's values are distances, at least outside.
fn is_distance(scene: &Scene, id: ShapeId) -> bool {
    let kind = &scene.shapes[id.0 as usize].kind;
    let is_preserved = match kind {
        ShapeKind::Primitive { op, .. } => matches!(
            op.row().facts.exactness,
            Exactness::Exact | Exactness::ExactOutside
        ),
        ShapeKind::Polygon { .. } | ShapeKind::Painted { .. } => true,
        ShapeKind::Combine { op, .. } => *op == Op::Union,
        ShapeKind::Distance { op, .. } => *op == Op::Extrude,
        ShapeKind::Domain { op, .. } => *op == Op::Revolve,
        ShapeKind::Frame { matrix, scale, .. } => preserves_distances(scene, matrix, *scale),
        ShapeKind::Repeat { .. } | ShapeKind::Polar { .. } => true,
        ShapeKind::Field { .. }
        | ShapeKind::Warp { .. }
        | ShapeKind::Displace { .. }
        | ShapeKind::Nothing => false,
    };
    is_preserved
        && children(kind)
            .iter()
            .all(|&child| is_distance(scene, child))
}

/// Reports whether a map preserves distances: its rows times the scale are orthonormal.
fn preserves_distances(scene: &Scene, matrix: &[ExprId; 12], scale: ExprId) -> bool {
    let number = |id: ExprId| scene.expressions.as_constant(id).unwrap_or(f64::NAN);
    let row =
        |index: usize| [0, 1, 2].map(|column| number(matrix[4 * index + column]) * number(scale));
    let dot = |a: usize, b: usize| -> f64 { (0..3).map(|i| row(a)[i] * row(b)[i]).sum() };
    let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    pairs.iter().all(|&(a, b)| {
        let expected = if a == b { 1.0 } else { 0.0 };
        (dot(a, b) - expected).abs() < 1e-9
    })
}
