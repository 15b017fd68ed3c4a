//! Scene → module: the pipeline behind the language.

use crate::bounds::{Boxes, World};
use crate::cutters::lengthened_within;
use crate::distribute::distributed;
use crate::expression::{ExprId, ParamId, Stage};
use crate::graph::{Graph, Node, Number};
use crate::lower::{Purpose, channel_numbers, lower, lower_origins};
use crate::origins::Trail;
use crate::passes::lod::Sight;
use crate::passes::{Context, Done, PassOptions, optimize};
use crate::scene::{MaterialId, Scene, ShapeId, ShapeKind};
use crate::schedule::schedule;
use crate::seams::Seams;
use crate::seen::size;
use crate::slope::ShapeSlopes;
use crate::subject::{outline, subject};
use crate::uniforms::Uniforms;
use crate::wgsl;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::library::Library;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::settings::{self, FoundBounds, Setting, Settings};
use sdfc_vm::verify::{VerifyError, verify};
use std::collections::HashMap;
use std::sync::Arc;

/// What is compiled, and how.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The named output; without one, the scene's result.
    pub part: Option<String>,
    /// Which passes run.
    pub passes: PassOptions,
    /// The time at which it is to be drawn first.
    pub time: f64,
    /// Who looks at it, where what is too small to be seen may be made simpler; see
    /// [`crate::passes::lod`].
    pub sight: Option<Sight>,
}

/// A scene, compiled.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// What engines run.
    pub module: Module,
    /// The graph as it was lowered.
    pub graph: Graph,
    /// The graph after the passes.
    pub optimized: Graph,
    /// The graph of surfaces after the passes, where the scene has more than one material.
    pub surface: Option<Graph>,
    /// What the passes did to the graph of the distance.
    pub passes: Vec<Done>,
    /// What boxes follow from, where there is a scene's text.
    pub(crate) known: Option<Arc<Known>>,
}

/// What is left of a scene to find boxes for other values of its parameters.
#[derive(Debug)]
pub(crate) struct Known {
    scene: Scene,
    root: ShapeId,
}

/// The scene's functions as WGSL.
#[derive(Clone, Debug, Default)]
pub struct GeneratedSource {
    /// The functions and the operations they call. They read `uniforms`, and, where there are
    /// surfaces, call `unpainted_surface()` and use the struct `Surface`.
    pub text: String,
    /// The elementary functions they call; see [`sdfc_vm::prelude`].
    pub calls: Vec<&'static str>,
}

impl Compiled {
    /// Brings the module to the present values of its parameters and a time: the constants, and the
    /// box around the solid, without which rays and cells would have no bounds. Gives the results of
    /// the uniform program. No program changes.
    pub fn update(&mut self, time: f64) -> Vec<f64> {
        let known = self.known.clone();
        bring(&mut self.module, known.as_deref(), time)
    }

    /// The same for a copy of the module.
    pub fn bring(&self, module: &mut Module, time: f64) -> Vec<f64> {
        bring(module, self.known.as_deref(), time)
    }

    /// The scene that it was made of, where there was a text.
    pub fn scene(&self) -> Option<&Scene> {
        self.known.as_ref().map(|known| &known.scene)
    }

    /// The scene's functions as WGSL: `scene_distance`, `scene_gradient` and, where the scene has
    /// more than one material, `scene_surface`.
    pub fn generated(&self) -> GeneratedSource {
        let mut library = Library::default();
        let mut scene = wgsl::write(&self.optimized, wgsl::Function::Distance, &mut library);
        scene.push('\n');
        scene.push_str(&wgsl::write(
            &self.optimized,
            wgsl::Function::Gradient,
            &mut library,
        ));
        if let Some(surface) = &self.surface {
            scene.push('\n');
            scene.push_str(&wgsl::write(surface, wgsl::Function::Surface, &mut library));
        }
        let (text, calls) = library.text();
        GeneratedSource {
            text: text + &scene,
            calls,
        }
    }
}

/// Brings a module to the present values of its parameters and a time.
fn bring(module: &mut Module, known: Option<&Known>, time: f64) -> Vec<f64> {
    if let Some(known) = known {
        let params = &module.settings.params;
        let values = params.iter().map(|param| param.value.clone());
        let values = (0..).map(ParamId).zip(values).collect();
        let mut boxes = Boxes::at(time, values);
        module.settings.found = FoundBounds {
            bounds: boxes.of(World::from(&known.scene), known.root),
            params: module.settings.param_numbers(),
            time,
        };
    }
    module.update(time)
}

/// Compiles a scene. There is no result if a diagnostic is an error.
pub fn compile(scene: Scene, options: &Options) -> (Option<Compiled>, Vec<Diagnostic>) {
    compile_with(scene, options, None)
}

/// Compiles a scene; with a trail, its surfaces tell leaves apart instead of materials, and the trail
/// says which.
pub(crate) fn compile_with(
    mut scene: Scene,
    options: &Options,
    trail: Option<&mut Trail>,
) -> (Option<Compiled>, Vec<Diagnostic>) {
    let Some(root) = chosen(&scene, options) else {
        return (None, vec![nothing_to_draw(&scene, options)]);
    };
    let mut uniforms = Uniforms::new(scene.params.iter().map(|param| param.value.len()));
    let mut boxes = Boxes::lasting();
    let root = lengthened_within(&mut scene, &mut boxes, root);
    let root = distributed(&mut scene, root);
    let mut present = Boxes::at(0.0, HashMap::new());
    let subject = subject(&mut scene, &mut present, root);
    let size = size(&scene, &mut present, root, subject);
    let mut slopes = ShapeSlopes::new(World::from(&scene), size);
    let (graph, mut diagnostics) = lower(
        &mut scene,
        root,
        Purpose::Distance,
        &mut slopes,
        &mut uniforms,
        &mut boxes,
    );
    let context = |purpose| Context {
        purpose,
        sight: options.sight,
    };
    let (optimized, passes) = optimize(&graph, &context(Purpose::Distance), &options.passes);
    let (materials, fallback) = materials(&scene, root);
    let is_seen = trail.is_none();
    let surface = match trail {
        Some(trail) => {
            let (graph, found) =
                lower_origins(&mut scene, root, &mut slopes, &mut uniforms, &mut boxes);
            *trail = found;
            Some((graph, Purpose::Origins))
        }
        None if materials > 1 => {
            let purpose = Purpose::Surface;
            let (graph, _) = lower(
                &mut scene,
                root,
                purpose,
                &mut slopes,
                &mut uniforms,
                &mut boxes,
            );
            Some((graph, purpose))
        }
        None => None,
    };
    let surface = surface.map(|(graph, purpose)| {
        let mut passes = options.passes.clone();
        if purpose == Purpose::Origins {
            // With a paint for each leaf, guards would make programs longer than the format allows.
            passes.without.push("bounding".to_owned());
        }
        optimize(&graph, &context(purpose), &passes).0
    });
    if is_seen {
        let params = params_of(&scene);
        diagnostics.extend(
            Seams {
                scene: &mut scene,
                boxes: &mut boxes,
                present: &mut present,
                slopes: &mut slopes,
                params: &params,
                time: options.time,
            }
            .warnings(root),
        );
    }
    let is_framed = scene.cameras.iter().any(|camera| camera.automatic);
    let subject = subject.filter(|_| is_framed).map(|(subject, bounds)| {
        // Of the whole there is a graph, and what there is to say was said of it.
        let graph = (subject != root).then(|| {
            let purpose = Purpose::Distance;
            lower(
                &mut scene,
                subject,
                purpose,
                &mut slopes,
                &mut uniforms,
                &mut boxes,
            )
            .0
        });
        (graph, bounds)
    });
    let world = World::from(&scene);
    let found = FoundBounds {
        bounds: Boxes::at(options.time, HashMap::new()).of(world, root),
        params: params_of(&scene),
        time: options.time,
    };
    let bounds = present.of(world, root);
    let reach = boxes.of(world, root);
    let settings = settings_of(
        &mut scene,
        fallback,
        ([bounds, reach], found),
        &mut uniforms,
    );
    let mut module = Module {
        distance: schedule(&optimized),
        surface: surface.as_ref().map(schedule),
        uniforms: uniforms.finish(),
        settings,
    };
    let outputs = module.update(0.0);
    module.settings.subject = subject.and_then(|(graph, bounds)| match graph {
        Some(graph) => {
            let mut program = schedule(&graph);
            let narrow: Vec<f32> = outputs.iter().map(|&v| v as f32).collect();
            program.patch(&narrow);
            outline(&program, &bounds)
        }
        None => outline(&module.distance, &bounds),
    });
    let span = scene.shapes[root.0 as usize].span;
    diagnostics.extend(unverified(&module, span));
    diagnostics.extend(violated(&scene, &module, &outputs));
    if diagnostics.iter().any(Diagnostic::is_error) {
        return (None, diagnostics);
    }
    (
        Some(Compiled {
            module,
            graph,
            optimized,
            surface,
            passes,
            known: Some(Arc::new(Known { scene, root })),
        }),
        diagnostics,
    )
}

/// The shape that the options ask for.
fn chosen(scene: &Scene, options: &Options) -> Option<ShapeId> {
    match &options.part {
        Some(part) => scene
            .parts
            .iter()
            .find(|(name, _)| name == part)
            .map(|&(_, id)| id),
        None => scene.root,
    }
}

fn nothing_to_draw(scene: &Scene, options: &Options) -> Diagnostic {
    let span = scene
        .shapes
        .first()
        .map_or(Span::default(), |shape| shape.span);
    match &options.part {
        Some(part) => {
            let names: Vec<&str> = scene.parts.iter().map(|(name, _)| name.as_str()).collect();
            let known = if names.is_empty() {
                "it has no parts".to_owned()
            } else {
                format!("its parts are {}", names.join(", "))
            };
            Diagnostic::error(
                codes::E0503,
                span,
                format!("the scene has no part `{part}`: {known}"),
            )
        }
        None => Diagnostic::error(codes::E0502, span, "the file has no shape to draw")
            .help("end it with an expression, such as `sphere(1)`, or name a `part`"),
    }
}

/// How many materials a shape shows, and the one that covers all of it if it is one.
fn materials(scene: &Scene, root: ShapeId) -> (usize, MaterialId) {
    let mut found: Vec<MaterialId> = Vec::new();
    let mut seen = vec![false; scene.shapes.len()];
    let mut pending = vec![root];
    let mut constant = true;
    while let Some(id) = pending.pop() {
        if std::mem::replace(&mut seen[id.0 as usize], true) {
            continue;
        }
        let material = match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Painted { material, .. } => Some(*material),
            ShapeKind::Combine { children, .. } => {
                pending.extend(children);
                None
            }
            ShapeKind::Frame { child, .. }
            | ShapeKind::Repeat { child, .. }
            | ShapeKind::Polar { child, .. }
            | ShapeKind::Domain { child, .. }
            | ShapeKind::Warp { child, .. }
            | ShapeKind::Distance { child, .. }
            | ShapeKind::Displace { child, .. } => {
                pending.push(*child);
                None
            }
            ShapeKind::Primitive { .. } | ShapeKind::Field { .. } | ShapeKind::Polygon { .. } => {
                Some(MaterialId(0))
            }
            ShapeKind::Nothing => None,
        };
        if let Some(id) = material {
            let material = &scene.materials[id.0 as usize];
            let uniform = |number: ExprId| scene.expressions.stage(number) <= Stage::Uniform;
            constant &=
                material.bump.is_none() && channel_numbers(material).into_iter().all(uniform);
            if !found.contains(&id) {
                found.push(id);
            }
        }
    }
    match found.as_slice() {
        [only] if constant => (1, *only),
        [] => (1, MaterialId(0)),
        _ => (2, MaterialId(0)),
    }
}

/// The numbers of a scene's parameters.
fn params_of(scene: &Scene) -> Vec<f64> {
    let numbers = scene.params.iter().flat_map(|param| &param.value);
    numbers.copied().collect()
}

/// The scene's settings, with numbers that engines can read.
fn settings_of(
    scene: &mut Scene,
    fallback: MaterialId,
    ([bounds, reach], found): ([Bounds; 2], FoundBounds),
    uniforms: &mut Uniforms,
) -> Settings {
    let expressions = &scene.expressions;
    let mut one = |id: ExprId| match expressions.as_constant(id) {
        Some(v) => Setting::Constant(v),
        None => match uniforms.number(expressions, id) {
            Number::Constant(v) => Setting::Constant(v.into()),
            Number::Uniform(output) => Setting::Uniform(output),
        },
    };
    let cameras = scene.cameras.iter().map(|camera| camera.map(&mut one));
    let cameras = cameras.collect();
    let lights = scene.lights.iter().map(|light| light.map(&mut one));
    let lights = lights.collect();
    let sky = scene.sky.map(&mut one);
    let render = scene.render.map(&mut one);
    let checks = scene
        .checks
        .iter()
        .map(|check| settings::Check {
            value: one(check.value),
            strict: check.strict,
            message: check.message.clone(),
        })
        .collect();
    let material = channel_numbers(&scene.materials[fallback.0 as usize]).map(&mut one);
    let params = scene
        .params
        .iter()
        .map(|param| settings::Param {
            name: param.name.clone(),
            doc: param.doc.clone(),
            kind: param.kind,
            value: param.value.clone(),
            default: param.default.clone(),
            range: param.range,
            inclusive: param.inclusive,
            step: param.step,
            structural: param.structural,
        })
        .collect();
    Settings {
        params,
        checks,
        cameras,
        lights,
        sky,
        render,
        animation: scene.animation,
        plane: scene.plane,
        z_up: scene.z_up,
        bounds,
        subject: None,
        reach,
        found,
        time: 0.0,
        material,
        material_id: fallback.0,
        materials: scene
            .materials
            .iter()
            .map(|material| material.name.clone())
            .collect(),
        parts: scene.parts.iter().map(|(name, _)| name.clone()).collect(),
    }
}

/// What the verifier has to say, as diagnostics: only limits of the format can be passed by a
/// program that the compiler made.
fn unverified(module: &Module, span: Span) -> Vec<Diagnostic> {
    let outputs = module.uniforms.outputs.len();
    let check = |program: &Program, surface: bool| verify(program, outputs, surface).err();
    let mut errors = vec![check(&module.distance, false)];
    errors.push(
        module
            .surface
            .as_ref()
            .and_then(|program| check(program, true)),
    );
    errors
        .into_iter()
        .flatten()
        .map(|error| {
            let message = match &error {
                VerifyError::Constant { .. } => {
                    "a number of the compiled scene is infinite or not a number".to_owned()
                }
                error => error.to_string(),
            };
            Diagnostic::error(codes::E0501, span, message)
        })
        .take(1)
        .collect()
}

/// Conditions that the parameters' present values violate.
fn violated(scene: &Scene, module: &Module, outputs: &[f64]) -> Vec<Diagnostic> {
    let checks = module.settings.checks.iter().zip(&scene.checks);
    checks
        .filter(|(check, _)| {
            let value = check.value.value(outputs);
            if check.strict {
                value.is_nan() || value <= 0.0
            } else {
                value.is_nan() || value < 0.0
            }
        })
        .map(|(check, from)| Diagnostic::error(codes::E0504, from.span, check.message.clone()))
        .collect()
}

/// How many operations of each kind a graph has, by name.
pub fn operation_counts(graph: &Graph) -> Vec<(&'static str, usize)> {
    let mut counts = std::collections::BTreeMap::new();
    let uses = graph.uses();
    for (id, node) in graph.nodes() {
        if uses[id.0 as usize] > 0
            && let Node::Apply { op, .. } = node
        {
            *counts.entry(op.row().name).or_insert(0) += 1;
        }
    }
    counts.into_iter().collect()
}
