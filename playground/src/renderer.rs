//! Executes draw tasks: holds engines, loads scenes into them, updates params and time, and converts
//! images to pixels.
//!
//! A renderer is used by one thread at a time. A panic of an engine becomes an error, and the engine is
//! opened again.

mod loaded_engine;
mod openers;
mod view_mode;

pub use openers::editing_engines;
pub use view_mode::{SlicePlane, ViewMode};

use crate::build::BuiltScene;
use crate::inspect::QueryPoints;
use crate::inspect::pick::{self, Pick, PixelHit};
use loaded_engine::{LoadedEngine, ScenePrograms};
use sdfc_compiler::compile::{GeneratedSource, Options};
use sdfc_compiler::provenance::{Provenance, compile_provenance};
use sdfc_runtime::engine::{Engine, EngineError, EngineKind};
use sdfc_runtime::render::{self, CellMode, Image, RenderProgress, RenderSettings};
use sdfc_runtime::settings::Overrides;
use std::collections::HashMap;
use std::fmt;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Cancels a picture that is no longer needed.
#[derive(Clone, Debug, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// Cancels the picture.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl RenderProgress for CancelToken {
    fn report(&self, _share: f32) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

/// Inputs of a scene: the values of its params, and the time.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneInputs {
    /// Numbers of each param, in the order of declaration.
    pub values: Arc<Vec<Vec<f64>>>,
    /// Animation time in seconds.
    pub time: f64,
}

/// A picture to be drawn.
#[derive(Clone, Debug)]
pub struct DrawTask {
    /// Picture number; later pictures have larger numbers.
    pub number: u64,
    /// Scene to be drawn, with its programs.
    pub scene: Arc<BuiltScene>,
    /// Values of the params, and the time.
    pub inputs: SceneInputs,
    /// Engine that draws.
    pub engine: EngineKind,
    /// Overrides of the scene's own settings. The view mode is set by `show`.
    pub overrides: Overrides,
    /// Samples to draw; all of them if the view mode [is exact](ViewMode::is_exact).
    pub samples: SampleSet,
    /// View mode of the picture.
    pub show: ViewMode,
    /// Leaf that is highlighted in the object view; see [`crate::inspect::objects`].
    pub leaf: Option<u32>,
    /// Token that stops the drawing.
    pub stop: CancelToken,
}

/// Selects which samples of a picture are drawn.
#[derive(Clone, Debug)]
pub enum SampleSet {
    /// All samples.
    All,
    /// The first sample of each pixel.
    First,
    /// All other samples, added to this image of the first ones.
    Remaining(Arc<Image>),
}

impl SampleSet {
    fn for_engine(&self) -> render::Samples<'_> {
        match self {
            Self::All => render::Samples::All,
            Self::First => render::Samples::First,
            Self::Remaining(first) => render::Samples::Remaining(first),
        }
    }
}

/// Times of the stages of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawTimes {
    /// Time for uploading the scene to the engine.
    pub loading: Duration,
    /// Time for drawing.
    pub drawing: Duration,
}

impl std::ops::Add for DrawTimes {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            loading: self.loading + other.loading,
            drawing: self.drawing + other.drawing,
        }
    }
}

/// Result of a draw task.
#[derive(Clone, Debug)]
pub struct DrawResult {
    /// Number of the picture.
    pub number: u64,
    /// Build number of the scene.
    pub scene: u64,
    /// Engine that drew the picture.
    pub engine: EngineKind,
    /// Finished picture, or the reason why there is none.
    pub picture: Result<Picture, DrawError>,
    /// Times of the picture.
    pub times: DrawTimes,
    /// Number of pipelines that the engine has created so far.
    pub pipelines: u64,
}

/// A drawn picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height.
    pub size: [usize; 2],
    /// Red, green, blue and alpha of each pixel, in rows from the upper left.
    pub rgba: Arc<Vec<u8>>,
    /// Rendered image with all channels.
    pub image: Arc<Image>,
    /// Settings of the picture.
    pub settings: RenderSettings,
    /// Device that the engine runs on.
    pub device: String,
    /// Legend of the colours, where required.
    pub legend: Vec<([u8; 4], String)>,
    /// Notes about the picture, one line each.
    pub notes: Vec<String>,
    /// Numbers that the colours stand for, if there is one for each pixel.
    pub values: Option<PixelValues>,
}

/// Numbers behind the colours of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelValues {
    /// Number of each pixel; not finite where there is none.
    pub values: Vec<f32>,
    /// Unit of the numbers.
    pub unit: &'static str,
}

impl PixelValues {
    /// Creates the numbers of a picture of this size from those at some points.
    fn new(
        query_points: &QueryPoints,
        values: impl Iterator<Item = f32>,
        size: [usize; 2],
        unit: &'static str,
    ) -> Self {
        let mut by_pixel = vec![f32::NAN; size[0] * size[1]];
        for (&pixel, value) in query_points.pixels.iter().zip(values) {
            if let Some(slot) = by_pixel.get_mut(pixel as usize) {
                *slot = value;
            }
        }
        Self {
            values: by_pixel,
            unit,
        }
    }
}

impl Picture {
    /// Returns the number at a position, from 0 in the upper left corner to 1, with its unit.
    pub fn value_at(&self, position: [f32; 2]) -> Option<(f32, &'static str)> {
        let values = self.values.as_ref()?;
        let [column, row] =
            [0, 1].map(|axis| (position[axis] * self.size[axis] as f32).floor() as usize);
        if position.iter().any(|v| !(0.0..1.0).contains(v)) {
            return None;
        }
        let value = *values.values.get(row * self.size[0] + column)?;
        value.is_finite().then_some((value, values.unit))
    }

    /// Returns the pixels for drawing over them.
    fn pixels(&mut self) -> &mut [u8] {
        Arc::make_mut(&mut self.rgba).as_mut_slice()
    }
}

/// A task that picks a pixel.
#[derive(Clone, Debug)]
pub struct PickTask {
    /// The scene.
    pub scene: Arc<BuiltScene>,
    /// Values of the params, and the time.
    pub inputs: SceneInputs,
    /// Engine that samples the point.
    pub engine: EngineKind,
    /// Image that contains the pixel.
    pub image: Arc<Image>,
    /// Settings of that image.
    pub settings: RenderSettings,
    /// Column and row of the pixel.
    pub pixel: [u32; 2],
}

/// Result of picking a pixel.
#[derive(Clone, Debug)]
pub struct PickResult {
    /// Column and row of the pixel.
    pub pixel: [u32; 2],
    /// Width and height of the picture.
    pub size: [usize; 2],
    /// Description of the surface point; `None` for the sky.
    pub result: Result<Option<Box<Pick>>, DrawError>,
}

/// Reason for a missing picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DrawError {
    /// It was cancelled.
    Stopped,
    /// The scene's numbers are invalid.
    Scene(String),
    /// The scene exceeds the limits of this engine; another engine may draw it.
    TooLong(String),
    /// The engine cannot run here, or has failed.
    Engine(String),
}

impl fmt::Display for DrawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stopped => f.write_str("stopped"),
            Self::Scene(why) | Self::TooLong(why) | Self::Engine(why) => f.write_str(why),
        }
    }
}

impl From<EngineError> for DrawError {
    fn from(error: EngineError) -> Self {
        match error {
            EngineError::Stopped => Self::Stopped,
            EngineError::Gpu(_) => Self::Engine(error.to_string()),
            EngineError::TooLong { .. } => Self::TooLong(error.to_string()),
            EngineError::NothingLoaded | EngineError::SceneMismatch => {
                Self::Scene(error.to_string())
            }
        }
    }
}

/// Function that opens engines.
pub type EngineOpener = Box<dyn Fn(EngineKind) -> Result<Box<dyn Engine>, EngineError> + Send>;

/// Engines with their loaded scenes.
pub struct Renderer {
    opener: EngineOpener,
    engines: HashMap<EngineKind, LoadedEngine>,
    /// Leaves of a scene and its build number, computed on first use; `None` for scenes without a text.
    origins: Option<(u64, Option<Arc<Provenance>>)>,
    /// Engine that has the leaf program loaded.
    leaf_engine: Option<LoadedEngine>,
}

impl fmt::Debug for Renderer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.engines.keys()).finish()
    }
}

impl Renderer {
    /// Creates a renderer that opens engines on demand.
    pub fn new(opener: EngineOpener) -> Self {
        Self {
            opener,
            engines: HashMap::new(),
            origins: None,
            leaf_engine: None,
        }
    }

    /// Opens an engine and prepares it for all scenes, if it is not open.
    ///
    /// # Errors
    ///
    /// A [`DrawError`] if the engine cannot run here.
    pub fn open(&mut self, kind: EngineKind) -> Result<(), DrawError> {
        let guarded_call = AssertUnwindSafe(|| self.loaded_engine(kind).map(|_| ()));
        catch_unwind(guarded_call).unwrap_or_else(|_| Err(panicked(kind)))
    }

    /// Draws a picture.
    pub fn draw(&mut self, task: &DrawTask) -> DrawResult {
        let mut times = DrawTimes::default();
        let guarded_call = AssertUnwindSafe(|| self.try_draw(task, &mut times));
        let picture = catch_unwind(guarded_call).unwrap_or_else(|_| Err(panicked(task.engine)));
        // A failed engine may be in any state.
        let mut pipelines = 0;
        if let Some(loaded) = self.engines.get_mut(&task.engine) {
            pipelines = loaded.engine.pipelines_created();
        }
        if matches!(picture, Err(DrawError::Engine(_))) {
            self.engines.remove(&task.engine);
        }
        DrawResult {
            number: task.number,
            scene: task.scene.number,
            engine: task.engine,
            picture,
            times,
            pipelines,
        }
    }

    fn try_draw(&mut self, task: &DrawTask, times: &mut DrawTimes) -> Result<Picture, DrawError> {
        let loaded = self.loaded_engine(task.engine)?;
        let started = Instant::now();
        loaded.load_scene(&task.scene, &task.inputs)?;
        times.loading = started.elapsed();
        let overrides = Overrides {
            mode: task.show.mode(),
            cells: match task.show {
                ViewMode::Cells => CellMode::Always,
                _ => task.overrides.cells,
            },
            ..task.overrides.clone()
        };
        let settings = loaded.settings(&overrides)?;
        let started = Instant::now();
        let samples = task.samples.for_engine();
        let image = loaded
            .engine
            .render_samples(&settings, samples, &task.stop)?;
        let mut picture = Picture {
            size: [image.width, image.height],
            rgba: Arc::new(image.rgba8()),
            image: Arc::new(image),
            settings,
            device: loaded.engine.device(),
            legend: Vec::new(),
            notes: Vec::new(),
            values: None,
        };
        self.draw_view_mode(task, &mut picture)?;
        times.drawing = started.elapsed();
        Ok(picture)
    }

    /// Describes the surface point at a pixel.
    pub fn pick(&mut self, task: &PickTask) -> PickResult {
        let guarded_call = AssertUnwindSafe(|| self.try_pick(task));
        let result = catch_unwind(guarded_call).unwrap_or_else(|_| {
            self.engines.clear();
            self.leaf_engine = None;
            let message = "this is a bug in sdfc: looking at a pixel panicked";
            Err(DrawError::Scene(message.to_owned()))
        });
        PickResult {
            pixel: task.pixel,
            size: [task.image.width, task.image.height],
            result,
        }
    }

    fn try_pick(&mut self, task: &PickTask) -> Result<Option<Box<Pick>>, DrawError> {
        let Some(hit) = PixelHit::from_image(&task.image, &task.settings, task.pixel) else {
            return Ok(None);
        };
        let Some(point) = hit.point() else {
            return Ok(None);
        };
        let leaf = match self.leaf_engine(&task.scene, &task.inputs)? {
            Some((loaded, _)) => loaded.engine.query(&[point])?.first().copied(),
            None => None,
        };
        let leaf = leaf.map_or(0, |sample| sample.surface.id.max(0.0) as u32);
        let origins = self.origins(&task.scene);
        let loaded = self.loaded_engine(task.engine)?;
        loaded.load_scene(&task.scene, &task.inputs)?;
        let Some(sample) = loaded.engine.query(&[point])?.first().copied() else {
            return Ok(None);
        };
        let current = loaded.loaded_scene()?;
        let scene = pick::PickContext {
            module: &current.module,
            uniform_values: &current.uniform_values,
            settings: &task.settings,
            sources: &task.scene.sources,
            origins: origins.as_deref(),
        };
        Ok(pick::describe(&hit, &scene, &sample, leaf).map(Box::new))
    }

    /// Returns the leaves of a scene; `None` for scenes without a text.
    fn origins(&mut self, scene: &BuiltScene) -> Option<Arc<Provenance>> {
        if let Some((number, origins)) = &self.origins
            && *number == scene.number
        {
            return origins.clone();
        }
        let text = scene.opened.compiled.scene().cloned();
        let result = text.and_then(|text| compile_provenance(text, &Options::default()).0);
        let result = result.map(Arc::new);
        self.origins = Some((scene.number, result.clone()));
        result
    }

    /// Returns the engine that identifies the leaves of a scene. It is always the CPU, because speed does
    /// not matter and the leaf program differs from the scene's own.
    fn leaf_engine(
        &mut self,
        scene: &BuiltScene,
        inputs: &SceneInputs,
    ) -> Result<Option<(&mut LoadedEngine, Arc<Provenance>)>, DrawError> {
        let Some(origins) = self.origins(scene) else {
            return Ok(None);
        };
        if self.leaf_engine.is_none() {
            self.leaf_engine = Some(LoadedEngine::new((self.opener)(EngineKind::Cpu)?));
        }
        let no_source = GeneratedSource::default();
        let programs = ScenePrograms {
            number: scene.number,
            compiled: &origins.compiled,
            generated: &|| &no_source,
        };
        let Some(loaded) = &mut self.leaf_engine else {
            return Ok(None);
        };
        loaded.load_programs(&programs, inputs)?;
        Ok(Some((loaded, origins)))
    }

    /// Returns an engine and opens it if required.
    fn loaded_engine(&mut self, kind: EngineKind) -> Result<&mut LoadedEngine, DrawError> {
        if !self.engines.contains_key(&kind) {
            let engine = (self.opener)(kind)?;
            self.engines.insert(kind, LoadedEngine::new(engine));
        }
        let missing = || DrawError::Engine(format!("engine {kind} is not open"));
        self.engines.get_mut(&kind).ok_or_else(missing)
    }
}

fn panicked(kind: EngineKind) -> DrawError {
    DrawError::Engine(format!("this is a bug in sdfc: the engine {kind} panicked"))
}
