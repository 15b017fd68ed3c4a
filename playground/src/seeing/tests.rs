//! What is seen of scenes whose fields are known in closed form.

use super::*;
use sdfc_compiler::compile::{Compiled, Options, compile};
use sdfc_compiler::elaborate::{self, NoFiles, elaborate};
use sdfc_compiler::origins::{Origins, origins};
use sdfc_lang::Sources;
use sdfc_runtime::engine::{Engine, EngineKind, Loaded, Sample, open};
use sdfc_runtime::frame::CellUse;
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;

mod engines;
mod picks;
mod slices;
mod views;

/// A scene in the engine `cpu`, and its leaves in another one.
struct Stage {
    sources: Sources,
    compiled: Compiled,
    outputs: Vec<f64>,
    settings: RenderSettings,
    engine: Box<dyn Engine>,
    origins: Origins,
    leaves: Box<dyn Engine>,
}

impl Stage {
    fn of(text: &str, size: [u32; 2]) -> Self {
        let mut sources = Sources::new();
        let file = sources.add("scene.sdf", text);
        let options = elaborate::Options {
            overrides: Vec::new(),
            time: 0.0,
            loader: &NoFiles,
        };
        let (scene, found) = elaborate(&mut sources, file, &options);
        let scene = scene.unwrap_or_else(|| panic!("{found:?}"));
        let (compiled, found) = compile(scene.clone(), &Options::default());
        let mut compiled = compiled.unwrap_or_else(|| panic!("{found:?}"));
        let outputs = compiled.update(0.0);
        let (origins, _) = origins(scene, &Options::default());
        let mut origins = origins.expect("a scene that compiles has leaves");
        let leaf_outputs = origins.compiled.update(0.0);
        let overrides = Overrides {
            size: Some(size),
            aa: Some(1),
            ..Overrides::default()
        };
        let settings = resolve(&compiled.module, &outputs, &overrides).expect("a picture");
        Self {
            engine: loaded(&compiled, &outputs),
            leaves: loaded(&origins.compiled, &leaf_outputs),
            sources,
            compiled,
            outputs,
            settings,
            origins,
        }
    }

    fn frame(&mut self) -> Frame {
        self.engine
            .render(&self.settings, &|_| {})
            .expect("the CPU draws")
    }

    fn ask(&mut self, asked: &Asked) -> Vec<Sample> {
        self.engine.query(&asked.points).expect("the CPU answers")
    }
}

fn loaded(compiled: &Compiled, outputs: &[f64]) -> Box<dyn Engine> {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let scene = Loaded {
        module: &compiled.module,
        outputs,
        generated: SceneSource::default(),
    };
    engine.load(&scene).expect("loads");
    engine
}
