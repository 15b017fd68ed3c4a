//! Syntax tree → scene: names, units, types and compile-time loops are resolved here.
//!
//! The pipeline is [`elaborate`]. It parses the file and its imports, checks the names once without
//! running anything, and evaluates the files from top to bottom. A parameter whose value is
//! required at compile time (a loop count, a list's length) becomes structural. Evaluation then
//! restarts with that value as a constant, until the set of structural parameters no longer grows.
//!
//! The files can be read from the ground up: values, arguments, numbers, shapes, bound arguments,
//! built-in functions, the vocabulary, calls, expressions, items. Only evaluation itself is mutually
//! recursive, by methods: functions such as `map` call the functions that they are given.
//!
//! Evaluation never panics on a scene and always terminates. The number of steps, the depth of
//! calls, loops and shapes are limited, each with a message of its own.

mod angles;
mod annotation;
mod argument_conversion;
mod arguments;
mod assemble_scene;
mod blend_spec;
mod blocks;
mod builtins;
mod calls;
mod constness;
mod diagnose;
mod dialects;
mod display;
mod elements;
mod evaluate;
mod function_docs;
mod items;
mod modules;
mod names;
mod numbers;
mod params;
mod sampled_bounds;
mod scope;
mod shape_info;
mod shapes;
mod value;
mod vocabulary;

use crate::analysis::bounds::{ShapeBounds, UniformValues};
use crate::expression::{ExprId, Expressions};
use crate::scene::{
    Animation, Material, MaterialId, Scene, SceneCamera, SceneCheck, SceneLight, SceneParam,
    SceneRender, SceneSky, Shape, ShapeId,
};
use diagnose::Reports;
use items::Globals;
use modules::{ImportedModule, Modules};
use params::Override;
use sampled_bounds::AssignmentKey;
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes};
use std::collections::{BTreeSet, HashMap, HashSet};

pub(crate) use diagnose::nearest;
pub(crate) use display::format_short;
pub use function_docs::{FunctionDoc, function_docs};
pub use modules::{Loader, NoFiles};
pub(crate) use shapes::field_without_inside;

/// Stack size of the evaluation thread: nested calls, each a few levels of expressions.
const STACK_BYTES: usize = 192 << 20;

/// Inputs of elaboration besides the text.
#[derive(Clone)]
pub struct Options<'o> {
    /// Values of parameters, as `name` and the text of the value: a number with its unit, a colour,
    /// a vector, `true` or `false`.
    pub overrides: Vec<(String, String)>,
    /// Time in seconds at which checks are evaluated and boxes are computed.
    pub time: f64,
    /// Source of imported files.
    pub loader: &'o dyn Loader,
}

impl Default for Options<'static> {
    fn default() -> Self {
        Self {
            overrides: Vec::new(),
            time: 0.0,
            loader: &NoFiles,
        }
    }
}

/// Elaborates a file into a scene and diagnostics. A scene is returned if and only if no diagnostic
/// is an error.
pub fn elaborate(
    sources: &mut Sources,
    file: FileId,
    options: &Options<'_>,
) -> (Option<Scene>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let overrides: Vec<Override> = options
        .overrides
        .iter()
        .map(|(name, text)| Override::parse(sources, name, text))
        .collect();
    let Some(modules) = modules::load(sources, file, options.loader, &mut diagnostics) else {
        return (None, diagnostics);
    };
    let sources = &*sources;
    let work = || evaluate(sources, &modules, &overrides, options);
    let result = std::thread::scope(|scope| {
        let builder = std::thread::Builder::new().stack_size(STACK_BYTES);
        builder.spawn_scoped(scope, work).map(|thread| {
            thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    });
    let (scene, messages) = match result {
        Ok(result) => result,
        Err(_) => {
            let message = "there is not enough memory to evaluate the scene";
            let span = Span::new(file, 0, 0);
            (None, vec![Diagnostic::error(codes::E0415, span, message)])
        }
    };
    diagnostics.extend(messages);
    let fails = diagnostics.iter().any(Diagnostic::is_error);
    if fails {
        // A definition without uses may be used by a file that could not be read.
        diagnostics.retain(|d| d.code != codes::W0201);
    }
    (scene.filter(|_| !fails), diagnostics)
}

/// Evaluates until the set of structural parameters no longer grows.
fn evaluate(
    sources: &Sources,
    modules: &Modules,
    overrides: &[Override],
    options: &Options<'_>,
) -> (Option<Scene>, Vec<Diagnostic>) {
    let mut structural = BTreeSet::new();
    loop {
        let mut elaborator = Elaborator::new(
            sources,
            &modules.all,
            overrides,
            options,
            structural.clone(),
        );
        names::check_names(&modules.all, &mut elaborator.reports);
        let is_done = elaborator.run().is_ok();
        let demanded = std::mem::take(&mut elaborator.demanded);
        if !is_done || demanded.is_subset(&structural) {
            return elaborator.finish(is_done);
        }
        structural.extend(demanded);
    }
}

/// An active call of a function of the scene.
#[derive(Clone, Copy, Debug)]
struct CallFrame<'a> {
    /// Span of the call in the text.
    site: Span,
    /// Name of the function.
    name: &'a str,
    /// Span of the body, which identifies the function.
    body: Span,
}

/// Key by which equal materials are shared.
type MaterialKey = ([ExprId; 3], [ExprId; 3], [Option<ExprId>; 3], String);

/// State of one evaluation. The submodules implement it.
struct Elaborator<'a> {
    sources: &'a Sources,
    modules: &'a [ImportedModule],
    overrides: &'a [Override],
    options: &'a Options<'a>,
    /// Structural parameters of this run, and the parameters whose values the run required.
    structural: BTreeSet<u32>,
    demanded: BTreeSet<u32>,
    /// Millimetres per scene unit.
    unit_mm: f64,
    z_up: bool,

    expressions: Expressions,
    uniform_values: UniformValues,
    params: Vec<SceneParam>,
    /// Indices in `params` by name.
    param_indices: HashMap<String, usize>,
    shapes: Vec<Shape>,
    /// Number of shapes that each shape represents, counted with multiplicity.
    occurrences: Vec<u32>,
    /// Boxes of shapes at the current values of the parameters. For live shapes they are estimates:
    /// a displacement may turn out to be steeper over all values.
    bounds_cache: ShapeBounds,
    constant_shapes: Vec<bool>,
    /// Boxes of shapes at other values of the parameters and the time.
    sampled_bounds_caches: HashMap<AssignmentKey, ShapeBounds>,
    materials: Vec<Material>,
    material_ids: HashMap<MaterialKey, MaterialId>,
    cameras: Vec<SceneCamera>,
    camera_names: HashSet<String>,
    /// Indices of the cameras with a target and a height: a 2-D shape needs no position.
    plane_cameras: Vec<usize>,
    lights: Vec<SceneLight>,
    sky: Option<SceneSky>,
    render: Option<SceneRender>,
    animation: Option<Animation>,
    checks: Vec<SceneCheck>,
    emitted_checks: HashSet<(ExprId, bool)>,
    printed: Vec<String>,
    parts: Vec<(String, ShapeId)>,
    part_names: HashSet<&'a str>,
    only: Vec<ShapeId>,
    ghosts: Vec<ShapeId>,
    root: Option<ShapeId>,

    globals: Vec<Globals<'a>>,
    calls: Vec<CallFrame<'a>>,
    /// Conditions on parameters under which the current evaluation takes effect.
    path_conditions: Vec<ExprId>,
    steps: u64,
    nesting: u32,
    /// Number of active calls of functions of the point.
    point_function_depth: u32,
    reports: Reports,
}

impl<'a> Elaborator<'a> {
    fn new(
        sources: &'a Sources,
        modules: &'a [ImportedModule],
        overrides: &'a [Override],
        options: &'a Options<'a>,
        structural: BTreeSet<u32>,
    ) -> Self {
        let mut expressions = Expressions::default();
        let mut c = |v: f64| expressions.constant(v);
        let default_material = Material {
            name: String::new(),
            albedo: [c(0.62), c(0.62), c(0.6)],
            roughness: c(0.55),
            metallic: c(0.0),
            emission: [c(0.0); 3],
            bump: None,
        };
        Self {
            sources,
            modules,
            overrides,
            options,
            structural,
            demanded: BTreeSet::new(),
            unit_mm: 1000.0,
            z_up: false,
            expressions,
            uniform_values: UniformValues::default(),
            params: Vec::new(),
            param_indices: HashMap::new(),
            shapes: Vec::new(),
            occurrences: Vec::new(),
            bounds_cache: ShapeBounds::at_time_and_values(options.time, HashMap::new()),
            constant_shapes: Vec::new(),
            sampled_bounds_caches: HashMap::new(),
            materials: vec![default_material],
            material_ids: HashMap::new(),
            cameras: Vec::new(),
            camera_names: HashSet::new(),
            plane_cameras: Vec::new(),
            lights: Vec::new(),
            sky: None,
            render: None,
            animation: None,
            checks: Vec::new(),
            emitted_checks: HashSet::new(),
            printed: Vec::new(),
            parts: Vec::new(),
            part_names: HashSet::new(),
            only: Vec::new(),
            ghosts: Vec::new(),
            root: None,
            globals: Vec::new(),
            calls: Vec::new(),
            path_conditions: Vec::new(),
            steps: 0,
            nesting: 0,
            point_function_depth: 0,
            reports: Reports::default(),
        }
    }

    /// Returns the index of the scene's own module: the last one, after all imports.
    fn root(&self) -> usize {
        self.modules.len() - 1
    }

    /// Reports a diagnostic. An error inside a library is reported at the call that led there.
    fn report(&mut self, mut diagnostic: Diagnostic) {
        let root = self.modules[self.root()].file.id;
        if diagnostic.span.file != root
            && let Some(call) = self.calls.iter().rev().find(|call| call.site.file == root)
        {
            let span = diagnostic.span;
            let line_col = self.sources.line_col(span.file, span.start);
            let line = self.sources.line_index(span.file, span.start);
            let start = self.sources.line_start(span.file, line);
            let end = self.sources.line_start(span.file, line + 1);
            let text = self.sources.slice(Span::new(span.file, start, end)).trim();
            let name = self.sources.name(span.file);
            let note = format!(
                "in `{}`, {name}:{}:{}: {text}",
                call.name, line_col.line, line_col.column
            );
            diagnostic.notes.push(note);
            diagnostic.span = call.site;
            diagnostic.label = "in this call".to_owned();
            diagnostic.labels.retain(|label| label.span.file == root);
            diagnostic.fixes.clear();
        } else if let Some(call) = self.calls.last()
            && diagnostic.span.file == call.site.file
            && !call.site.contains(diagnostic.span)
        {
            diagnostic = diagnostic.label(call.site, "in this call");
        }
        self.reports.push(diagnostic);
    }
}
