//! A shape as a scene of its own, with what is stated of it.

use crate::oracle::{Point, elaborated_if_right};
use sdfc_compiler::compile::{Compiled, Options, compile};
use sdfc_compiler::cutters::lengthened;
use sdfc_compiler::expression::ExprId;
use sdfc_compiler::graph::{Graph, Node, NodeId, Number};
use sdfc_compiler::scene::{Scene, Shape, ShapeId, ShapeKind};
use sdfc_compiler::schedule::schedule;
use sdfc_trials::oracle::Oracle;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::program::Program;
use sdfc_vm::row::Exactness;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::path::Path;

/// The half side of the cube that holds all that rays reach, in sizes of the scene.
const REACH_SIZES: f64 = 1e6;

/// A region of space, and the bound on the slope that is stated for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct StatedSlope {
    pub(super) region: Bounds,
    pub(super) slope: f64,
}

/// A value and its gradient.
pub(super) struct Slope {
    pub(super) value: f64,
    pub(super) gradient: Point,
}

/// A shape as a scene of its own.
pub(super) struct Subject {
    /// The name for messages.
    pub(super) name: String,
    /// The program of the value as it is written.
    pub(super) written: Program,
    /// The program that engines march by.
    pub(super) step: Program,
    /// The bounds on the slope of the written value.
    pub(super) slopes: Vec<StatedSlope>,
    /// Set if a bound is a guess, of which the compiler warned.
    pub(super) is_guessed: bool,
    /// The box at the present values of the parameters.
    pub(super) bounds: Bounds,
    /// All boxes that are stated to hold the shape.
    pub(super) boxes: Vec<Bounds>,
    /// Set at another moment than that of compilation.
    pub(super) is_moved: bool,
    /// The module's settings and programs.
    pub(super) compiled: Compiled,
    /// The second evaluator.
    pub(super) oracle: Oracle,
    /// Set if rows promise the values, and all copies are copies of distances.
    pub(super) has_known_values: bool,
    /// About half the size of what is seen.
    pub(super) size: f64,
}

/// The scene of a text, unless something is wrong with it.
pub(super) fn scene_of(text: &str) -> Option<Scene> {
    elaborated_if_right(Path::new("."), text)
}

/// The subject of a text's whole, unless something is wrong with it.
pub(super) fn subject_of(text: &str) -> Option<Subject> {
    let scene = scene_of(text)?;
    let root = scene.root?;
    Subject::new(&scene, root, text)
}

/// The same for a text with which nothing may be wrong.
pub(super) fn right(text: &str) -> Subject {
    subject_of(text).unwrap_or_else(|| panic!("{text} is refused"))
}

/// The solids of a scene that the root is made of, from the root down.
pub(super) fn solids(scene: &Scene) -> Vec<ShapeId> {
    let Some(root) = scene.root else {
        return Vec::new();
    };
    let ids = (0..=root.0).rev().map(ShapeId);
    let is_solid = |id: &ShapeId| {
        let shape = &scene.shapes[id.0 as usize];
        !shape.plane && !matches!(shape.kind, ShapeKind::Nothing)
    };
    ids.filter(is_solid).collect()
}

/// A moment: values of live parameters, and a time.
#[derive(Clone, Debug, Default)]
pub(super) struct Moment {
    /// Values by parameter; without any, parameters keep their own.
    pub(super) values: Vec<Vec<f64>>,
    /// The time in seconds.
    pub(super) time: f64,
}

impl Moment {
    /// Brings a compiled scene to this moment; gives the results of its uniform program.
    fn bring(&self, compiled: &mut Compiled) -> Vec<f32> {
        let params = &mut compiled.module.settings.params;
        for (param, value) in params.iter_mut().zip(&self.values) {
            param.value.clone_from(value);
        }
        let outputs = compiled.update(self.time);
        outputs.into_iter().map(|v| v as f32).collect()
    }

    /// The scene with these values of its parameters.
    fn of(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        for (param, value) in scene.params.iter_mut().zip(&self.values) {
            param.value.clone_from(value);
        }
        scene
    }
}

impl Subject {
    /// The subject of a shape of a scene, unless it cannot be compiled.
    pub(super) fn new(scene: &Scene, id: ShapeId, name: &str) -> Option<Self> {
        Self::at(scene, id, name, &Moment::default())
    }

    /// The same at another moment than that for which it is compiled.
    pub(super) fn at(scene: &Scene, id: ShapeId, name: &str, moment: &Moment) -> Option<Self> {
        let mut scene = scene.clone();
        scene.root = Some(id);
        let (compiled, _) = compile(scene.clone(), &Options::default());
        let mut compiled = compiled?;
        moment.bring(&mut compiled);
        let settings = &compiled.module.settings;
        let bounds = settings.found.bounds;
        let mut boxes = vec![bounds, settings.reach];
        let is_moved = !moment.values.is_empty() || moment.time != 0.0;
        if !is_moved {
            boxes.push(settings.bounds);
        }

        // An offset by nothing makes the compiler keep the values below it as they are written.
        let zero = scene.expressions.constant(0.0);
        let outer = &scene.shapes[id.0 as usize];
        let kept = Shape {
            kind: ShapeKind::Distance {
                op: Op::Offset,
                child: id,
                parameters: vec![zero],
            },
            ..outer.clone()
        };
        // The oracle of values takes the cutters that are compiled; those of sets take the text's.
        let mut longer = moment.of(&scene);
        let whole = lengthened(&mut longer, id);
        let oracle = Oracle::new(&longer, whole, moment.time);
        let has_known_values = !repeats_bounds(&scene, id);
        scene.shapes.push(kept);
        scene.root = Some(ShapeId(scene.shapes.len() as u32 - 1));
        let (kept, found) = compile(scene, &Options::default());
        let mut kept = kept?;
        let is_guessed = found
            .iter()
            .any(|found| found.code == sdfc_lang::codes::W0501);
        let outputs = moment.bring(&mut kept);
        let size = size_of(&bounds);
        let reached = Bounds::centred([REACH_SIZES * size; 3]);
        let (root, slopes) = stated(&kept.graph, reached);
        let mut graph = kept.graph;
        graph.root = root;
        let mut written = schedule(&graph);
        written.patch(&outputs);
        Some(Self {
            name: name.to_owned(),
            written,
            step: compiled.module.distance.clone(),
            slopes,
            is_guessed,
            bounds,
            boxes,
            is_moved,
            compiled,
            oracle,
            has_known_values,
            size,
        })
    }

    /// The value as it is written.
    pub(super) fn value(&self, p: Point) -> f64 {
        evaluate_f64(&self.written, p)
    }

    /// The step that engines march by.
    pub(super) fn step(&self, p: Point) -> f64 {
        evaluate_f64(&self.step, p)
    }

    /// The value as it is written, and its gradient.
    pub(super) fn gradient(&self, p: Point) -> Slope {
        slope_of(&self.written, p)
    }
}

/// A program's value and gradient at a point.
pub(super) fn slope_of(program: &Program, [x, y, z]: Point) -> Slope {
    let found = gradient::<f64>(program, V3::of(x, y, z));
    let V3 { x, y, z } = found.gradient;
    Slope {
        value: found.value,
        gradient: [x, y, z],
    }
}

/// The farthest finite corner of a box from the origin, or one if that is less.
fn size_of(bounds: &Bounds) -> f64 {
    let corners = bounds.min.iter().chain(&bounds.max);
    let finite = corners.filter(|v| v.is_finite());
    finite.fold(1.0, |size, v| size.max(v.abs()))
}

/// The node of the written value, and the bounds on its slope that the compiler divides by.
fn stated(graph: &Graph, reached: Bounds) -> (NodeId, Vec<StatedSlope>) {
    let inside = |region: Bounds, slope: f64| StatedSlope { region, slope };
    let Node::Apply {
        op,
        values,
        parameters,
        ..
    } = graph.get(graph.root)
    else {
        return (graph.root, vec![inside(Bounds::EVERYTHING, 1.0)]);
    };
    let numbers: Vec<f64> = parameters
        .iter()
        .map(|number| match number {
            Number::Constant(v) => f64::from(*v),
            Number::Uniform(_) => f64::NAN,
        })
        .collect();
    match op {
        Op::FieldDistance => (values[0], vec![inside(reached, 1.0 / numbers[0])]),
        Op::FieldGrowth => {
            let [side, exponent, share, inverse, beyond] =
                std::array::from_fn(|number| numbers[number]);
            // What a step in the field grows by, and what it is shorter by.
            let factor = 0.8 / beyond / (1.0 + share).powf(exponent);
            let cubes = (0..20).map(|n| f64::from(1 << n));
            let grown = cubes.map(|cube| {
                let region = Bounds::centred([side * cube; 3]).common(&reached);
                inside(region, factor * cube.powf(exponent))
            });
            let near = inside(Bounds::centred([side; 3]), 1.0 / inverse);
            (values[0], std::iter::once(near).chain(grown).collect())
        }
        // No bound is stated of a value that jumps.
        Op::Piecewise => (values[0], Vec::new()),
        Op::Bounded => {
            let near = Bounds {
                min: [0, 1, 2].map(|i| numbers[i] - numbers[4 + i] - numbers[3]),
                max: [0, 1, 2].map(|i| numbers[i] + numbers[4 + i] + numbers[3]),
            };
            let mut below = graph.clone();
            below.root = values[0];
            let (root, slopes) = stated(&below, near);
            let slopes = slopes.into_iter().map(|s| inside(near, s.slope));
            (root, slopes.collect())
        }
        _ => (graph.root, vec![inside(Bounds::EVERYTHING, 1.0)]),
    }
}

/// Tells if a shape has copies of something whose values are no distances.
///
/// Copies are evaluated where they may be the nearest, by boxes. A value that is less than the distance may be
/// the least one in a copy that is farther away.
fn repeats_bounds(scene: &Scene, id: ShapeId) -> bool {
    let kind = &scene.shapes[id.0 as usize].kind;
    let of_bound = match kind {
        ShapeKind::Repeat { child, .. } | ShapeKind::Polar { child, .. } => {
            !is_distance(scene, *child)
        }
        _ => false,
    };
    of_bound
        || children(kind)
            .iter()
            .any(|&child| repeats_bounds(scene, child))
}

/// Tells if a shape's values are distances, at least outside.
fn is_distance(scene: &Scene, id: ShapeId) -> bool {
    let kind = &scene.shapes[id.0 as usize].kind;
    let is_kept = match kind {
        ShapeKind::Primitive { op, .. } => matches!(
            op.row().meta.exactness,
            Exactness::Exact | Exactness::ExactOutside
        ),
        ShapeKind::Polygon { .. } | ShapeKind::Painted { .. } => true,
        ShapeKind::Combine { op, .. } => *op == Op::Union,
        ShapeKind::Distance { op, .. } => *op == Op::Extrude,
        ShapeKind::Domain { op, .. } => *op == Op::Revolve,
        ShapeKind::Frame { matrix, scale, .. } => is_even(scene, matrix, *scale),
        ShapeKind::Repeat { .. } | ShapeKind::Polar { .. } => true,
        ShapeKind::Field { .. }
        | ShapeKind::Warp { .. }
        | ShapeKind::Displace { .. }
        | ShapeKind::Nothing => false,
    };
    is_kept
        && children(kind)
            .iter()
            .all(|&child| is_distance(scene, child))
}

/// Tells if a frame keeps distances: its rows are as long as its scale undoes, and at right angles.
fn is_even(scene: &Scene, matrix: &[ExprId; 12], scale: ExprId) -> bool {
    let number = |id: ExprId| scene.expressions.as_constant(id).unwrap_or(f64::NAN);
    let row = |at: usize| [0, 1, 2].map(|column| number(matrix[4 * at + column]) * number(scale));
    let dot = |a: usize, b: usize| -> f64 { (0..3).map(|i| row(a)[i] * row(b)[i]).sum() };
    let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    pairs.iter().all(|&(a, b)| {
        let wanted = if a == b { 1.0 } else { 0.0 };
        (dot(a, b) - wanted).abs() < 1e-9
    })
}

/// The shapes that a shape is made of.
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
