//! Tests of the overlays on scenes whose fields have a closed form.

use super::slopes::divide_by_stated_slope;
use super::*;
use sdfc_compiler::compile::{Compiled, Options, compile};
use sdfc_compiler::elaborate::{self, NoFiles, elaborate};
use sdfc_compiler::provenance::{Provenance, compile_provenance};
use sdfc_lang::Sources;
use sdfc_runtime::engine::{Engine, EngineKind, FieldSample, SceneInput, open};
use sdfc_runtime::render::CellMode;
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;

mod engines;
mod picks;
mod slices;
mod views;

/// A scene loaded in the engine `cpu`, and its leaves in another one.
struct Fixture {
    sources: Sources,
    compiled: Compiled,
    uniform_values: Vec<f64>,
    settings: RenderSettings,
    engine: Box<dyn Engine>,
    origins: Provenance,
    leaves: Box<dyn Engine>,
}

impl Fixture {
    fn new(text: &str, size: [u32; 2]) -> Self {
        let mut sources = Sources::new();
        let file = sources.add("scene.sdf", text);
        let options = elaborate::Options {
            overrides: Vec::new(),
            time: 0.0,
            loader: &NoFiles,
        };
        let (scene, diagnostics) = elaborate(&mut sources, file, &options);
        let scene = scene.unwrap_or_else(|| panic!("{diagnostics:?}"));
        let (compiled, diagnostics) = compile(scene.clone(), &Options::default());
        let mut compiled = compiled.unwrap_or_else(|| panic!("{diagnostics:?}"));
        let uniform_values = compiled.update(0.0);
        let (origins, _) = compile_provenance(scene, &Options::default());
        let mut origins = origins.expect("a scene that compiles has leaves");
        let leaf_outputs = origins.compiled.update(0.0);
        let overrides = Overrides {
            size: Some(size),
            aa: Some(1),
            ..Overrides::default()
        };
        let settings = resolve(&compiled.module, &uniform_values, &overrides).expect("a picture");
        Self {
            engine: loaded(&compiled, &uniform_values),
            leaves: loaded(&origins.compiled, &leaf_outputs),
            sources,
            compiled,
            uniform_values,
            settings,
            origins,
        }
    }

    fn image(&mut self) -> Image {
        self.engine
            .render(&self.settings, &|_| {})
            .expect("the CPU draws")
    }

    fn sample(&mut self, query_points: &QueryPoints) -> Vec<FieldSample> {
        let mut samples = self
            .engine
            .query(&query_points.points)
            .expect("the CPU answers");
        let ratio = self.compiled.module.settings.slope_over_estimate;
        divide_by_stated_slope(&mut samples, ratio);
        samples
    }
}

fn loaded(compiled: &Compiled, uniform_values: &[f64]) -> Box<dyn Engine> {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let scene = SceneInput {
        module: &compiled.module,
        uniform_values,
        generated: SceneSource::default(),
    };
    engine.load(&scene).expect("loads");
    engine
}
