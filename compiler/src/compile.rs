//! Pipeline from a scene to a module.

use crate::analysis::bounds::ShapeBounds;
use crate::analysis::extents::{SolidParts, extents};
use crate::analysis::overflow::limit_overflow;
use crate::analysis::param_ranges::ParamRanges;
use crate::analysis::slope::ShapeSlopes;
use crate::analysis::subject::{outline, subject};
use crate::analysis::visible_bounds::scene_size;
use crate::cutter_extension::extend_cutters_with_bounds;
use crate::distribute::distribute_maps;
use crate::expression::{ExprId, ParamId, Stage};
use crate::field_factors::{remove_factors, uses_below};
use crate::graph::{Graph, GraphNode, GraphNumber, Purpose};
use crate::half_spaces::without_complements;
use crate::leaves::LeafTracker;
use crate::lower::{lower, lower_leaf_ids};
use crate::passes::lod::LodTarget;
use crate::passes::{Context, PassOptions, PassReport, optimize};
use crate::scene::{MaterialId, Scene, SceneParam, SceneRef, ShapeId, ShapeKind};
use crate::schedule::schedule;
use crate::seams::SeamSearch;
use crate::uniforms::Uniforms;
use crate::wgsl;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::settings::{self, CurrentBounds, SettingValue, Settings};
use sdfc_vm::verify::{VerifyError, verify};
use sdfc_vm::wgsl_library::WgslLibrary;
use std::collections::HashMap;
use std::sync::Arc;

/// Options of a compilation.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Named output to compile; `None` for the scene's result.
    pub part: Option<String>,
    /// Passes to run.
    pub passes: PassOptions,
    /// Time of the first picture, in seconds.
    pub time: f64,
    /// View for which detail that is too small to be visible may be simplified; see
    /// [`crate::passes::lod`].
    pub lod_target: Option<LodTarget>,
    /// Set if a view that frames the scene is needed even if all of its cameras have positions.
    pub needs_subject: bool,
}

/// Compiled scene.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// Module for the engines.
    pub module: Module,
    /// Graph as it was lowered.
    pub graph: Graph,
    /// Graph after the passes.
    pub optimized: Graph,
    /// Graph of surfaces after the passes, if the scene has more than one material.
    pub surface: Option<Graph>,
    /// Reports of the passes on the graph of the distance.
    pub passes: Vec<PassReport>,
    /// Source of bounding boxes, if compiled from a scene's text.
    pub(crate) bounds_context: Option<Arc<BoundsContext>>,
}

/// Scene and root from which boxes for other parameter values are computed.
#[derive(Debug)]
pub(crate) struct BoundsContext {
    scene: Scene,
    root: ShapeId,
    parts: SolidParts,
}

/// The scene's functions as WGSL.
#[derive(Clone, Debug, Default)]
pub struct GeneratedSource {
    /// The functions and the operations they call. They read `uniforms`. With surfaces, they also call
    /// `unpainted_surface()` and use the struct `Surface`.
    pub text: String,
    /// Elementary functions that they call; see [`sdfc_vm::prelude`].
    pub calls: Vec<&'static str>,
}

impl Compiled {
    /// Updates the module to the current values of its parameters and a time. That changes the
    /// constants and the bounding box of the solid, by which rays and cells are limited. Returns the
    /// results of the uniform program. No program changes.
    pub fn update(&mut self, time: f64) -> Vec<f64> {
        let context = self.bounds_context.clone();
        apply_params(&mut self.module, context.as_deref(), time)
    }

    /// Updates `module`, a copy of this scene's module, as [`Self::update`] does.
    pub fn update_module(&self, module: &mut Module, time: f64) -> Vec<f64> {
        apply_params(module, self.bounds_context.as_deref(), time)
    }

    /// Returns the source scene, if there was a text.
    pub fn scene(&self) -> Option<&Scene> {
        self.bounds_context.as_ref().map(|context| &context.scene)
    }

    /// Returns the source scene and its root, if there was a text.
    pub(crate) fn source(&self) -> Option<(&Scene, ShapeId)> {
        self.bounds_context
            .as_ref()
            .map(|context| (&context.scene, context.root))
    }

    /// Returns the scene's functions as WGSL: `scene_distance`, `scene_gradient` and, if the scene has
    /// more than one material, `scene_surface`.
    pub fn generated(&self) -> GeneratedSource {
        let mut library = WgslLibrary::default();
        let mut scene = wgsl::write(&self.optimized, wgsl::WgslFunction::Distance, &mut library);
        scene.push('\n');
        scene.push_str(&wgsl::write(
            &self.optimized,
            wgsl::WgslFunction::Gradient,
            &mut library,
        ));
        if let Some(surface) = &self.surface {
            scene.push('\n');
            scene.push_str(&wgsl::write(
                surface,
                wgsl::WgslFunction::Surface,
                &mut library,
            ));
        }
        let (text, calls) = library.text();
        GeneratedSource {
            text: text + &scene,
            calls,
        }
    }
}

/// Updates a module to the current values of its parameters and a time.
fn apply_params(
    module: &mut Module,
    bounds_context: Option<&BoundsContext>,
    time: f64,
) -> Vec<f64> {
    if let Some(context) = bounds_context {
        let BoundsContext { scene, root, parts } = context;
        let params = Some(module.settings.params.as_slice());
        module.settings.current_bounds = current_bounds(scene.into(), *root, parts, time, params);
    }
    module.update(time)
}

/// Compiles a scene. There is no result if a diagnostic is an error.
pub fn compile(scene: Scene, options: &Options) -> (Option<Compiled>, Vec<Diagnostic>) {
    compile_with(scene, options, None)
}

/// Compiles a scene. With a leaf tracker, surfaces have leaf ids instead of materials, and the tracker
/// receives the leaves.
pub(crate) fn compile_with(
    mut scene: Scene,
    options: &Options,
    leaf_tracker: Option<&mut LeafTracker>,
) -> (Option<Compiled>, Vec<Diagnostic>) {
    let Some(root) = select_root(&scene, options) else {
        return (None, vec![nothing_to_draw(&scene, options)]);
    };
    let param_ranges = ParamRanges::for_scene(SceneRef::from(&scene));
    let uses = uses_below(&scene, root);
    let removed = remove_factors(&mut scene, &uses, &param_ranges);
    limit_overflow(&mut scene, root, &uses, &param_ranges);
    let mut uniforms = Uniforms::new(scene.params.iter().map(|param| param.value.len()));
    let mut bounds_for_all_params = ShapeBounds::for_all_params();
    let root = extend_cutters_with_bounds(&mut scene, &mut bounds_for_all_params, root);
    let root = without_complements(&mut scene, root);
    let root = distribute_maps(&mut scene, root);
    let mut current_boxes = ShapeBounds::at_time_and_values(0.0, HashMap::new());
    let (subject, parts) = subject(&mut scene, &mut current_boxes, root);
    let size = scene_size(&scene, &mut current_boxes, root, subject);
    let mut slopes = ShapeSlopes::new(SceneRef::from(&scene), size, removed.written);
    let (graph, mut diagnostics) = lower(
        &mut scene,
        root,
        Purpose::Distance,
        &mut slopes,
        &mut uniforms,
        &mut bounds_for_all_params,
    );
    diagnostics.extend(removed.warnings);
    let context = |purpose| Context {
        purpose,
        lod_target: options.lod_target,
    };
    let (optimized, passes) = optimize(&graph, &context(Purpose::Distance), &options.passes);
    let (materials, fallback) = materials(&scene, root);
    let reports_seams = leaf_tracker.is_none();
    let surface = match leaf_tracker {
        Some(leaf_tracker) => {
            let (graph, new_tracker) = lower_leaf_ids(
                &mut scene,
                root,
                &mut slopes,
                &mut uniforms,
                &mut bounds_for_all_params,
            );
            *leaf_tracker = new_tracker;
            Some((graph, Purpose::LeafIds))
        }
        None if materials > 1 => {
            let (graph, _) = lower(
                &mut scene,
                root,
                Purpose::Surface,
                &mut slopes,
                &mut uniforms,
                &mut bounds_for_all_params,
            );
            Some((graph, Purpose::Surface))
        }
        None => None,
    };
    let surface = surface.map(|(graph, purpose)| {
        let mut passes = options.passes.clone();
        if purpose == Purpose::LeafIds {
            // With a paint per leaf, guards would exceed the format's maximum program length.
            passes.disabled.push("guards".to_owned());
        }
        optimize(&graph, &context(purpose), &passes).0
    });
    if reports_seams {
        let params = param_values(&scene.params);
        diagnostics.extend(
            SeamSearch {
                scene: &mut scene,
                bounds_cache: &mut bounds_for_all_params,
                current_bounds: &mut current_boxes,
                slopes: &mut slopes,
                params: &params,
                time: options.time,
            }
            .warnings(root),
        );
    }
    let has_automatic_camera = scene.cameras.iter().any(|camera| camera.auto_framed);
    let needs_subject = has_automatic_camera || options.needs_subject;
    let subject = subject.filter(|_| needs_subject).map(|(subject, bounds)| {
        // The root already has a graph, and its warnings were reported.
        let graph = (subject != root).then(|| {
            let purpose = Purpose::Distance;
            lower(
                &mut scene,
                subject,
                purpose,
                &mut slopes,
                &mut uniforms,
                &mut bounds_for_all_params,
            )
            .0
        });
        (graph, bounds)
    });
    let bounds = SolidBounds {
        at_defaults: current_boxes.get(SceneRef::from(&scene), root),
        for_all_params: bounds_for_all_params.get(SceneRef::from(&scene), root),
        current: current_bounds(SceneRef::from(&scene), root, &parts, options.time, None),
    };
    let settings = build_settings(&mut scene, fallback, bounds, &slopes, &mut uniforms);
    let mut module = Module {
        distance: schedule(&optimized),
        surface: surface.as_ref().map(schedule),
        uniforms: uniforms.finish(),
        settings,
    };
    let uniform_values = module.update(0.0);
    module.settings.subject = subject.and_then(|(graph, bounds)| match graph {
        Some(graph) => {
            let mut program = schedule(&graph);
            let uniform_values_f32: Vec<f32> = uniform_values.iter().map(|&v| v as f32).collect();
            program.patch(&uniform_values_f32);
            outline(&program, &bounds)
        }
        None => outline(&module.distance, &bounds),
    });
    let span = scene.shapes[root.0 as usize].span;
    diagnostics.extend(verification_errors(&module, span));
    diagnostics.extend(failed_checks(&scene, &module, &uniform_values));
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
            bounds_context: Some(Arc::new(BoundsContext { scene, root, parts })),
        }),
        diagnostics,
    )
}

/// Returns the shape that the options select.
fn select_root(scene: &Scene, options: &Options) -> Option<ShapeId> {
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
            let known_parts = if names.is_empty() {
                "it has no parts".to_owned()
            } else {
                format!("its parts are {}", names.join(", "))
            };
            Diagnostic::error(
                codes::E0503,
                scene
                    .root
                    .map_or(span, |root| scene.shapes[root.0 as usize].span),
                format!("the scene has no part `{part}`: {known_parts}"),
            )
        }
        None => Diagnostic::error(codes::E0502, span, "the file has no shape to draw")
            .help("end it with an expression, such as `sphere(1)`, or name a `part`"),
    }
}

/// Returns the number of visible materials of a shape, and the material that covers all of it if there
/// is only one.
fn materials(scene: &Scene, root: ShapeId) -> (usize, MaterialId) {
    let mut found_materials: Vec<MaterialId> = Vec::new();
    let mut visited = vec![false; scene.shapes.len()];
    let mut pending = vec![root];
    let mut is_constant = true;
    while let Some(id) = pending.pop() {
        if std::mem::replace(&mut visited[id.0 as usize], true) {
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
            is_constant &=
                material.bump.is_none() && material.channel_numbers().into_iter().all(uniform);
            if !found_materials.contains(&id) {
                found_materials.push(id);
            }
        }
    }
    match found_materials.as_slice() {
        [only] if is_constant => (1, *only),
        [] => (1, MaterialId(0)),
        _ => (2, MaterialId(0)),
    }
}

/// Returns the numbers of a scene's parameters.
fn param_values(params: &[SceneParam]) -> Vec<f64> {
    let numbers = params.iter().flat_map(|param| &param.value);
    numbers.copied().collect()
}

/// Returns the boxes of the solid at a time, for the scene's own values of the parameters or for others.
fn current_bounds(
    scene: SceneRef<'_>,
    root: ShapeId,
    parts: &SolidParts,
    time: f64,
    params: Option<&[settings::Param]>,
) -> CurrentBounds {
    let values: Vec<_> = match params {
        Some(params) => params.iter().map(|param| param.value.clone()).collect(),
        None => scene
            .params
            .iter()
            .map(|param| param.value.clone())
            .collect(),
    };
    let params = values.iter().flatten().copied().collect();
    let mut boxes = ShapeBounds::at_time_and_values(time, (0..).map(ParamId).zip(values).collect());
    CurrentBounds {
        bounds: boxes.get(scene, root),
        extents: extents(scene, &mut boxes, root, parts),
        params,
        time,
    }
}

/// Bounding boxes of the solid.
struct SolidBounds {
    at_defaults: Bounds,
    for_all_params: Bounds,
    current: CurrentBounds,
}

/// Returns the scene's settings, with numbers that engines can read.
fn build_settings(
    scene: &mut Scene,
    fallback: MaterialId,
    bounds: SolidBounds,
    slopes: &ShapeSlopes,
    uniforms: &mut Uniforms,
) -> Settings {
    let expressions = &scene.expressions;
    let mut setting = |id: ExprId| match expressions.as_constant(id) {
        Some(v) => SettingValue::Constant(v),
        None => match uniforms.intern(expressions, id) {
            GraphNumber::Constant(v) => SettingValue::Constant(v.into()),
            GraphNumber::Uniform(output) => SettingValue::Uniform(output),
        },
    };
    let cameras = scene.cameras.iter().map(|camera| camera.map(&mut setting));
    let cameras = cameras.collect();
    let lights = scene.lights.iter().map(|light| light.map(&mut setting));
    let lights = lights.collect();
    let sky = scene.sky.map(&mut setting);
    let render = scene.render.map(&mut setting);
    let checks = scene
        .checks
        .iter()
        .map(|check| settings::Check {
            value: setting(check.value),
            strict: check.strict,
            message: check.message.clone(),
        })
        .collect();
    let material = scene.materials[fallback.0 as usize]
        .channel_numbers()
        .map(&mut setting);
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
        is_2d: scene.is_2d,
        z_up: scene.z_up,
        bounds: bounds.at_defaults,
        subject: None,
        bounds_for_all_params: bounds.for_all_params,
        current_bounds: bounds.current,
        slope_over_estimate: slopes.slope_over_estimate,
        has_loose_slopes: slopes.meets_loose_bounds || slopes.slope_over_estimate.is_some(),
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

/// Returns the verifier's errors as diagnostics: a compiled program can only exceed the format's
/// limits.
fn verification_errors(module: &Module, span: Span) -> Vec<Diagnostic> {
    let output_count = module.uniforms.outputs.len();
    let check = |program: &Program, surface: bool| verify(program, output_count, surface).err();
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

/// Returns the checks that fail for the current values of the parameters.
fn failed_checks(scene: &Scene, module: &Module, uniform_values: &[f64]) -> Vec<Diagnostic> {
    let checks = module.settings.checks.iter().zip(&scene.checks);
    checks
        .filter_map(|(check, from)| {
            let message = check.failure(uniform_values)?;
            Some(Diagnostic::error(codes::E0504, from.span, message))
        })
        .collect()
}

/// Returns the number of operations of each kind in a graph, by name.
pub fn operation_counts(graph: &Graph) -> Vec<(&'static str, usize)> {
    let mut counts = std::collections::BTreeMap::new();
    let uses = graph.uses();
    for (id, node) in graph.nodes() {
        if uses[id.0 as usize] > 0
            && let GraphNode::Apply { op, .. } = node
        {
            *counts.entry(op.row().name).or_insert(0) += 1;
        }
    }
    counts.into_iter().collect()
}
