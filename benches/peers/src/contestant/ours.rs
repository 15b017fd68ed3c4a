//! sdfc: a model compiled, and an engine that draws it.

use super::{Contestant, not_drawn};
use crate::model::{Model, Source};
use crate::picture::{Picture, Seen};
use rayon::ThreadPool;
use sdfc_compiler::clauses::parse_clauses;
use sdfc_compiler::compile::{self, GeneratedSource};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::passes::PassOptions;
use sdfc_lang::{Diagnostic, Diagnostics, Sources, Style};
use sdfc_runtime::cpu::Geometry;
use sdfc_runtime::engine::{self, Engine, EngineError, EngineKind, Loaded};
use sdfc_runtime::frame::{CellUse, Mode, RenderSettings};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;

/// A scene, compiled, as engines take it.
pub(crate) struct Compiled {
    /// Its programs.
    compiled: compile::Compiled,
    /// The results of its uniform program.
    pub(crate) outputs: Vec<f64>,
    /// Its functions as source, for the engine that compiles it; empty for the others.
    generated: GeneratedSource,
}

impl Compiled {
    /// The scene of a text in sdfc's language.
    pub(crate) fn scene(
        text: &str,
        passes: &PassOptions,
        kind: EngineKind,
    ) -> Result<Self, String> {
        let mut sources = Sources::new();
        let file = sources.add("scene".to_owned(), text.to_owned());
        let (scene, found) = elaborate(&mut sources, file, &elaborate::Options::default());
        Self::finish(scene, found, &sources, passes, kind)
    }

    /// The scene of a `.vm` file.
    pub(crate) fn clauses(text: &str, kind: EngineKind) -> Result<Self, String> {
        let mut sources = Sources::new();
        let file = sources.add("model".to_owned(), text.to_owned());
        let (scene, found) = parse_clauses(&sources, file);
        Self::finish(scene, found, &sources, &PassOptions::default(), kind)
    }

    fn finish(
        scene: Option<sdfc_compiler::scene::Scene>,
        mut found: Vec<Diagnostic>,
        sources: &Sources,
        passes: &PassOptions,
        kind: EngineKind,
    ) -> Result<Self, String> {
        let options = compile::Options {
            passes: passes.clone(),
            ..compile::Options::default()
        };
        let compiled = scene.and_then(|scene| {
            let (compiled, more) = compile::compile(scene, &options);
            found.extend(more);
            compiled
        });
        let Some(compiled) = compiled else {
            let found: Diagnostics = found.into_iter().collect();
            return Err(found.render(sources, Style::Plain));
        };
        let generated = match kind {
            EngineKind::Wgsl => compiled.generated(),
            EngineKind::Cpu | EngineKind::Interp | EngineKind::Reference => {
                GeneratedSource::default()
            }
        };
        let mut compiled = compiled;
        let outputs = compiled.update(0.0);
        Ok(Self {
            compiled,
            outputs,
            generated,
        })
    }

    /// Its programs.
    pub(crate) fn module(&self) -> &Module {
        &self.compiled.module
    }

    /// Gives every parameter this value.
    pub(crate) fn set_params(&mut self, value: f64) {
        for param in &mut self.compiled.module.settings.params {
            param.value = vec![value];
        }
        self.outputs = self.compiled.update(0.0);
    }

    /// The scene as engines take it.
    pub(crate) fn loaded(&self) -> Loaded<'_> {
        Loaded {
            module: self.module(),
            outputs: &self.outputs,
            generated: SceneSource {
                text: &self.generated.text,
                calls: &self.generated.calls,
            },
        }
    }

    /// How its picture is drawn, with some settings replaced.
    pub(crate) fn settings(&self, overrides: &Overrides) -> Result<RenderSettings, String> {
        resolve(self.module(), &self.outputs, overrides).map_err(|error| error.to_string())
    }
}

/// How sdfc's rays go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rays {
    /// How near they come to a surface before they stop, in halves of a pixel.
    pub(crate) cone: f64,
    /// Whether they go from cell to cell.
    pub(crate) cells: CellUse,
}

/// A model on an engine.
pub(crate) struct Ours<'a> {
    model: &'a Model,
    size: u32,
    rays: Rays,
    engine: Box<dyn Engine>,
    prepared: Option<Prepared>,
    seen: Option<Found>,
}

/// What a frame found: as Fidget's, it is data and not yet a picture with colours.
enum Found {
    /// The field at each pixel.
    Figure(Vec<f32>),
    /// Depths and normals.
    Solid(Geometry),
}

/// What frames are made of.
struct Prepared {
    compiled: Compiled,
    settings: RenderSettings,
}

impl<'a> Ours<'a> {
    /// A model on an engine of this kind. An engine on the CPU takes the threads of the pool that
    /// it is called from.
    pub(crate) fn open(
        kind: EngineKind,
        model: &'a Model,
        size: u32,
        rays: Rays,
    ) -> Result<Self, String> {
        Ok(Self {
            model,
            size,
            rays,
            engine: engine::open(kind).map_err(|error| error.to_string())?,
            prepared: None,
            seen: None,
        })
    }

    fn settings(&self, compiled: &Compiled) -> Result<RenderSettings, String> {
        let mode = if self.model.plane {
            Mode::Mask
        } else {
            Mode::Normal
        };
        let settings = compiled.settings(&Overrides {
            size: Some([self.size; 2]),
            aa: Some(1),
            steps: Some(STEPS),
            far: Some(self.model.view.far()),
            mode,
            ..Overrides::default()
        })?;
        Ok(RenderSettings {
            view: self.model.view.camera(),
            plane: self.model.plane,
            cone: self.rays.cone,
            cells: self.rays.cells,
            ..settings
        })
    }

    fn draw(&mut self) -> Result<(), String> {
        let prepared = self.prepared.as_ref().ok_or_else(not_drawn)?;
        let failed = |error: EngineError| error.to_string();
        self.seen = Some(if self.model.plane {
            let figure = self
                .engine
                .figure(&prepared.settings, 0.0)
                .map_err(failed)?;
            Found::Figure(figure.ok_or("the figure is not seen face on")?)
        } else {
            Found::Solid(self.engine.geometry(&prepared.settings).map_err(failed)?)
        });
        Ok(())
    }
}

/// The most steps of a ray: enough for fields that are not distances.
const STEPS: u32 = 4096;

impl Contestant for Ours<'_> {
    fn device(&self) -> String {
        self.engine.device()
    }

    fn prepare(&mut self) -> Result<(), String> {
        let kind = self.engine.kind();
        let compiled = match &self.model.source {
            Source::Clauses(text) => match self.model.plane {
                true => Compiled::clauses(text, kind)?,
                // A figure that fills the view from front to back ends at its faces.
                false => Compiled::clauses(&self.model.bounded_clauses(text), kind)?,
            },
            Source::Boxes(boxes) => Compiled::scene(&boxes.text(), &PassOptions::default(), kind)?,
        };
        let settings = self.settings(&compiled)?;
        self.prepared = Some(Prepared { compiled, settings });
        Ok(())
    }

    fn frame(&mut self) -> Result<(), String> {
        let prepared = self.prepared.as_ref().ok_or_else(not_drawn)?;
        if self.engine.kind() == EngineKind::Cpu {
            // One that has drawn this before would keep what it cut.
            self.engine = engine::open(EngineKind::Cpu).map_err(|error| error.to_string())?;
        }
        let loaded = self.engine.load(&prepared.compiled.loaded());
        loaded.map_err(|error| error.to_string())?;
        self.draw()
    }

    fn again(&mut self) -> Option<Result<(), String>> {
        Some(self.draw())
    }

    fn picture(&self) -> Result<Picture, String> {
        let solid = match self.seen.as_ref().ok_or_else(not_drawn)? {
            Found::Figure(field) => {
                return Ok(Picture::Plane(field.iter().map(|&v| v < 0.0).collect()));
            }
            Found::Solid(solid) => solid,
        };
        let view = &self.model.view;
        let pixels = solid.depth.iter().zip(&solid.normal);
        let seen = pixels.map(|(&depth, &normal)| Seen {
            voxel: match depth.is_finite() {
                true => view.voxel(depth, self.size),
                false => 0,
            },
            normal: view.seen(normal),
        });
        Ok(Picture::Solid(seen.collect()))
    }
}

/// A pool of so many threads, whose stacks are deep enough to compile on.
pub(crate) fn pool(threads: usize) -> Result<ThreadPool, String> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(256 << 20);
    pool.build().map_err(|error| error.to_string())
}
