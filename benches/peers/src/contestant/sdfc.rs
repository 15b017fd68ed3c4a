//! sdfc: a compiled model, and an engine that draws it.

use super::{Contestant, not_drawn};
use crate::model::{Model, ModelSource};
use crate::picture::{ComparedImage, SurfacePixel};
use rayon::ThreadPool;
use sdfc_compiler::fidget_text::parse_fidget_text;
use sdfc_compiler::compile::{self, GeneratedSource};
use sdfc_compiler::export;
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::passes::PassOptions;
use sdfc_lang::{Diagnostic, Diagnostics, Sources, Style};
use sdfc_runtime::engine::{self, Engine, EngineError, EngineKind, SceneInput};
use sdfc_runtime::render::{CellMode, Geometry, Mode, RenderSettings};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;

/// A compiled scene in the form that engines load.
pub(crate) struct EngineScene {
    /// Programs of the scene.
    compiled: compile::Compiled,
    /// Results of its uniform program.
    pub(crate) uniform_values: Vec<f64>,
    /// Functions as source for the engine `wgsl`, empty for the others.
    generated: GeneratedSource,
}

impl EngineScene {
    /// Compiles a text in sdfc's language.
    pub(crate) fn from_text(
        text: &str,
        passes: &PassOptions,
        kind: EngineKind,
    ) -> Result<Self, String> {
        let mut sources = Sources::new();
        let file = sources.add("scene".to_owned(), text.to_owned());
        let (scene, diagnostics) = elaborate(&mut sources, file, &elaborate::Options::default());
        Self::compile_elaborated(scene, diagnostics, &sources, passes, kind)
    }

    /// Compiles a `.vm` file.
    pub(crate) fn from_clauses(text: &str, kind: EngineKind) -> Result<Self, String> {
        let mut sources = Sources::new();
        let file = sources.add("model".to_owned(), text.to_owned());
        let (scene, diagnostics) = parse_fidget_text(&sources, file);
        Self::compile_elaborated(scene, diagnostics, &sources, &PassOptions::default(), kind)
    }

    fn compile_elaborated(
        scene: Option<sdfc_compiler::scene::Scene>,
        mut diagnostics: Vec<Diagnostic>,
        sources: &Sources,
        passes: &PassOptions,
        kind: EngineKind,
    ) -> Result<Self, String> {
        let options = compile::Options {
            passes: passes.clone(),
            ..compile::Options::default()
        };
        let compiled = scene.and_then(|scene| {
            let (compiled, compile_diagnostics) = compile::compile(scene, &options);
            diagnostics.extend(compile_diagnostics);
            compiled
        });
        let Some(compiled) = compiled else {
            let diagnostics: Diagnostics = diagnostics.into_iter().collect();
            return Err(diagnostics.render(sources, Style::Plain));
        };
        let generated = match kind {
            EngineKind::Wgsl => compiled.generated(),
            EngineKind::Cpu | EngineKind::Interp | EngineKind::Reference => {
                GeneratedSource::default()
            }
        };
        let mut compiled = compiled;
        let uniform_values = compiled.update(0.0);
        Ok(Self {
            compiled,
            uniform_values,
            generated,
        })
    }

    /// Returns the scene as clauses of Fidget.
    pub(crate) fn clauses(&self) -> Result<String, String> {
        export::fidget_clauses(&self.compiled).map_err(|error| error.to_string())
    }

    /// Programs of the scene.
    pub(crate) fn module(&self) -> &Module {
        &self.compiled.module
    }

    /// Sets every parameter to this value.
    pub(crate) fn set_params(&mut self, value: f64) {
        for param in &mut self.compiled.module.settings.params {
            param.value = vec![value];
        }
        self.uniform_values = self.compiled.update(0.0);
    }

    /// Returns the scene in the form that engines load.
    pub(crate) fn scene_input(&self) -> SceneInput<'_> {
        SceneInput {
            module: self.module(),
            uniform_values: &self.uniform_values,
            generated: SceneSource {
                text: &self.generated.text,
                calls: &self.generated.calls,
            },
        }
    }

    /// Returns the settings of its picture, with some overridden.
    pub(crate) fn settings(&self, overrides: &Overrides) -> Result<RenderSettings, String> {
        resolve(self.module(), &self.uniform_values, overrides).map_err(|error| error.to_string())
    }
}

/// Settings of sdfc's rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RaySettings {
    /// Distance to a surface at which rays stop, in half pixels.
    pub(crate) cone: f64,
    /// Use of cells by the rays.
    pub(crate) cells: CellMode,
}

/// A model on an engine.
pub(crate) struct SdfcEngine<'a> {
    model: &'a Model,
    size: u32,
    rays: RaySettings,
    engine: Box<dyn Engine>,
    prepared: Option<PreparedFrame>,
    frame_data: Option<FrameData>,
}

/// Result of a frame. As Fidget's, it is data instead of a picture with colours.
enum FrameData {
    /// Field value at each pixel.
    Distances(Vec<f32>),
    /// Depths and normals.
    Solid(Geometry),
}

/// Input of frames.
struct PreparedFrame {
    compiled: EngineScene,
    settings: RenderSettings,
}

impl<'a> SdfcEngine<'a> {
    /// Opens a model on an engine of this kind. A CPU engine uses the threads of the current pool.
    pub(crate) fn open(
        kind: EngineKind,
        model: &'a Model,
        size: u32,
        rays: RaySettings,
    ) -> Result<Self, String> {
        Ok(Self {
            model,
            size,
            rays,
            engine: engine::open(kind).map_err(|error| error.to_string())?,
            prepared: None,
            frame_data: None,
        })
    }

    fn settings(&self, compiled: &EngineScene) -> Result<RenderSettings, String> {
        let mode = if self.model.is_2d {
            Mode::Mask
        } else {
            Mode::Normal
        };
        let settings = compiled.settings(&Overrides {
            size: Some([self.size; 2]),
            aa: Some(1),
            steps: Some(MAX_RAY_STEPS),
            far: Some(self.model.view.far()),
            mode,
            ..Overrides::default()
        })?;
        Ok(RenderSettings {
            view: self.model.view.camera(),
            is_2d: self.model.is_2d,
            threshold_fraction: self.rays.cone,
            cells: self.rays.cells,
            ..settings
        })
    }

    fn draw(&mut self) -> Result<(), String> {
        let prepared = self.prepared.as_ref().ok_or_else(not_drawn)?;
        let to_message = |error: EngineError| error.to_string();
        self.frame_data = Some(if self.model.is_2d {
            let distances = self
                .engine
                .sample_plane(&prepared.settings, 0.0)
                .map_err(to_message)?;
            FrameData::Distances(distances.ok_or("the figure is not seen face on")?)
        } else {
            FrameData::Solid(self.engine.geometry(&prepared.settings).map_err(to_message)?)
        });
        Ok(())
    }
}

/// Maximum number of steps of a ray, large enough for fields that are not distances.
const MAX_RAY_STEPS: u32 = 4096;

impl Contestant for SdfcEngine<'_> {
    fn device(&self) -> String {
        self.engine.device()
    }

    fn prepare(&mut self) -> Result<(), String> {
        let kind = self.engine.kind();
        let compiled = match &self.model.source {
            ModelSource::Clauses(text) => EngineScene::from_clauses(text, kind)?,
            ModelSource::Scene { text, .. } => EngineScene::from_text(text, &PassOptions::default(), kind)?,
            ModelSource::Boxes(boxes) => EngineScene::from_text(&boxes.text(), &PassOptions::default(), kind)?,
        };
        let settings = self.settings(&compiled)?;
        self.prepared = Some(PreparedFrame { compiled, settings });
        Ok(())
    }

    fn frame(&mut self) -> Result<(), String> {
        let prepared = self.prepared.as_ref().ok_or_else(not_drawn)?;
        if self.engine.kind() == EngineKind::Cpu {
            // An engine that has drawn the scene before would keep its cells.
            self.engine = engine::open(EngineKind::Cpu).map_err(|error| error.to_string())?;
        }
        let scene_input = self.engine.load(&prepared.compiled.scene_input());
        scene_input.map_err(|error| error.to_string())?;
        self.draw()
    }

    fn redraw(&mut self) -> Option<Result<(), String>> {
        Some(self.draw())
    }

    fn picture(&self) -> Result<ComparedImage, String> {
        let solid = match self.frame_data.as_ref().ok_or_else(not_drawn)? {
            FrameData::Distances(distances) => {
                return Ok(ComparedImage::Plane(distances.iter().map(|&v| v < 0.0).collect()));
            }
            FrameData::Solid(solid) => solid,
        };
        let view = &self.model.view;
        let pixels = solid.depth.iter().zip(&solid.normal);
        let surface = pixels.map(|(&depth, &normal)| SurfacePixel {
            voxel: match depth.is_finite() {
                true => view.voxel(depth, self.size),
                false => 0,
            },
            normal: view.to_view_axes(normal),
        });
        Ok(ComparedImage::Solid(surface.collect()))
    }
}

/// Creates a pool of `threads` threads, with stacks deep enough to compile on.
pub(crate) fn pool(threads: usize) -> Result<ThreadPool, String> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(256 << 20);
    pool.build().map_err(|error| error.to_string())
}
