//! Syntax tree → scene: names, units, types and compile-time loops are resolved here.
//!
//! The pipeline is [`elaborate`]: the file and its imports are parsed, names are looked over once
//! without running anything, and then the files are evaluated from top to bottom. A parameter whose
//! value turns out to be needed while compiling (a loop count, a list's length) becomes structural,
//! and evaluation starts again with it known, until no new one turns up.
//!
//! Evaluation never panics on a scene and always ends: it has a budget of steps, a depth of calls,
//! and limits on loops and shapes, each with a message of its own.

mod annotation;
mod arguments;
mod blend;
mod blocks;
mod bound;
mod calls;
mod copies;
mod csg;
mod curves;
mod diagnose;
mod display;
mod evaluate;
mod field;
mod finish;
mod items;
mod lists;
mod math;
mod measure;
mod modules;
mod motion;
mod names;
mod normalized;
mod numbers;
mod params;
mod reference;
mod scope;
mod shapes;
mod stage;
mod transform;
mod value;
mod vectors;
mod vocabulary;

use crate::bounds::{Boxes, Present};
use crate::expression::{ExprId, Expressions};
use crate::scene::{
    Animation, Camera, Check, Light, Material, MaterialId, Param, Render, Scene, Shape, ShapeId,
    Sky,
};
use diagnose::Reports;
use items::Globals;
use modules::{Module, Modules};
use motion::Moment;
use params::Override;
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes};
use std::collections::{BTreeSet, HashMap, HashSet};

pub(crate) use bound::short;
pub use modules::{Loader, NoFiles};
pub use reference::{Entry, reference};

/// The stack that evaluation runs on: calls within calls, each a few levels of expressions.
const STACK_BYTES: usize = 192 << 20;

/// What elaboration depends on besides the text.
#[derive(Clone)]
pub struct Options<'o> {
    /// Values of parameters, as `name` and the text of the value: a number with its unit, a colour,
    /// a vector, `true` or `false`.
    pub overrides: Vec<(String, String)>,
    /// The time in seconds at which checks are made and boxes measured.
    pub time: f64,
    /// Where imported files come from.
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

/// The scene that a file describes, and everything there is to say about it. There is a scene if and
/// only if no diagnostic is an error.
pub fn elaborate(
    sources: &mut Sources,
    file: FileId,
    options: &Options<'_>,
) -> (Option<Scene>, Vec<Diagnostic>) {
    let mut found = Vec::new();
    let overrides: Vec<Override> = options
        .overrides
        .iter()
        .map(|(name, text)| Override::read(sources, name, text))
        .collect();
    let Some(modules) = modules::load(sources, file, options.loader, &mut found) else {
        return (None, found);
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
        Err(why) => {
            let message = format!("no memory to evaluate the scene: {why}");
            let span = Span::new(file, 0, 0);
            (None, vec![Diagnostic::error(codes::E0415, span, message)])
        }
    };
    found.extend(messages);
    let fails = found.iter().any(Diagnostic::is_error);
    if fails {
        // What is not used may be used by what could not be read.
        found.retain(|d| d.code != codes::W0201);
    }
    (scene.filter(|_| !fails), found)
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
        let mut run = Elaborator::new(
            sources,
            &modules.all,
            overrides,
            options,
            structural.clone(),
        );
        names::look_over(&modules.all, &mut run.reports);
        let is_done = run.run().is_ok();
        let demanded = std::mem::take(&mut run.demanded);
        if !is_done || demanded.is_subset(&structural) {
            return run.finish(is_done);
        }
        structural.extend(demanded);
    }
}

/// A call of a scene's function that has not ended.
#[derive(Clone, Copy, Debug)]
struct Active<'a> {
    /// Where it is called.
    site: Span,
    /// What is called.
    name: &'a str,
    /// Its body, which tells functions apart.
    body: Span,
}

/// What makes two materials the same.
type MaterialKey = ([ExprId; 3], [ExprId; 3], [Option<ExprId>; 3], String);

/// The state of one evaluation; the files next to this one say what it does.
struct Elaborator<'a> {
    sources: &'a Sources,
    modules: &'a [Module],
    overrides: &'a [Override],
    options: &'a Options<'a>,
    /// The parameters that are structural, and those that turned out to be.
    structural: BTreeSet<u32>,
    demanded: BTreeSet<u32>,
    /// Millimetres per scene unit.
    unit: f64,
    z_up: bool,

    graph: Expressions,
    present: Present,
    params: Vec<Param>,
    shapes: Vec<Shape>,
    /// How many shapes each stands for.
    occurrences: Vec<u32>,
    /// The boxes of shapes at the present values of the parameters. (Of what moves they are guesses:
    /// a displacement may turn out to be steeper over all values.)
    boxes: Boxes,
    is_still: Vec<bool>,
    /// The same at other values.
    moments: HashMap<Moment, Boxes>,
    materials: Vec<Material>,
    known_materials: HashMap<MaterialKey, MaterialId>,
    cameras: Vec<Camera>,
    lights: Vec<Light>,
    sky: Option<Sky>,
    render: Option<Render>,
    animation: Option<Animation>,
    checks: Vec<Check>,
    checked: HashSet<(ExprId, bool)>,
    printed: Vec<String>,
    parts: Vec<(String, ShapeId)>,
    only: Vec<ShapeId>,
    ghosts: Vec<ShapeId>,
    root: Option<ShapeId>,

    globals: Vec<Globals<'a>>,
    calls: Vec<Active<'a>>,
    /// The conditions on parameters under which what is evaluated counts.
    guards: Vec<ExprId>,
    steps: u64,
    nesting: u32,
    /// How many functions of the point are being called.
    at_point: u32,
    reports: Reports,
}

impl<'a> Elaborator<'a> {
    fn new(
        sources: &'a Sources,
        modules: &'a [Module],
        overrides: &'a [Override],
        options: &'a Options<'a>,
        structural: BTreeSet<u32>,
    ) -> Self {
        let mut graph = Expressions::default();
        let mut c = |v: f64| graph.constant(v);
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
            unit: 1000.0,
            z_up: false,
            graph,
            present: Present::default(),
            params: Vec::new(),
            shapes: Vec::new(),
            occurrences: Vec::new(),
            boxes: Boxes::at(options.time, HashMap::new()),
            is_still: Vec::new(),
            moments: HashMap::new(),
            materials: vec![default_material],
            known_materials: HashMap::new(),
            cameras: Vec::new(),
            lights: Vec::new(),
            sky: None,
            render: None,
            animation: None,
            checks: Vec::new(),
            checked: HashSet::new(),
            printed: Vec::new(),
            parts: Vec::new(),
            only: Vec::new(),
            ghosts: Vec::new(),
            root: None,
            globals: Vec::new(),
            calls: Vec::new(),
            guards: Vec::new(),
            steps: 0,
            nesting: 0,
            at_point: 0,
            reports: Reports::default(),
        }
    }

    /// The scene's own module: the last one, after all that it imports.
    fn root(&self) -> usize {
        self.modules.len() - 1
    }

    /// Tells the user. What is wrong inside a library is told at the call that led there.
    fn report(&mut self, mut diagnostic: Diagnostic) {
        let root = self.modules[self.root()].file.id;
        if diagnostic.span.file != root
            && let Some(call) = self.calls.iter().rev().find(|call| call.site.file == root)
        {
            let span = diagnostic.span;
            let place = self.sources.line_col(span.file, span.start);
            let line = self.sources.line_index(span.file, span.start);
            let start = self.sources.line_start(span.file, line);
            let end = self.sources.line_start(span.file, line + 1);
            let text = self.sources.slice(Span::new(span.file, start, end)).trim();
            let name = self.sources.name(span.file);
            let note = format!(
                "in `{}`, {name}:{}:{}: {text}",
                call.name, place.line, place.column
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
