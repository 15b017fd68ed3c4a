//! Draws what a session asks for: holds engines, loads scenes into them, brings params and time up
//! to date, and turns frames into pixels.
//!
//! A painter is used by one thread at a time. It never panics on a scene: what an engine panicked
//! with becomes a problem, and the engine is opened anew.

mod engines;
mod held;
mod show;

pub use engines::engines;
pub use show::{Show, SliceAt};

use crate::build::Scene;
use crate::seeing::pick::{self, Pick, Spot};
use held::{Held, Programs};
use sdfc_compiler::compile::{GeneratedSource, Options};
use sdfc_compiler::origins::{Origins, origins};
use sdfc_runtime::engine::{Engine, EngineError, EngineKind};
use sdfc_runtime::frame::{self, CellUse, Frame, Progress, RenderSettings};
use sdfc_runtime::settings::Overrides;
use std::collections::HashMap;
use std::fmt;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Stops a picture that nobody waits for any more.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Stops it.
    pub fn now(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Progress for Stop {
    fn is_at(&self, _share: f32) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

/// The moment of a scene: the values of its params, and the time.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Of each param, in order, its numbers.
    pub values: Arc<Vec<Vec<f64>>>,
    /// The time of the animation, in seconds.
    pub time: f64,
}

/// A picture to be drawn.
#[derive(Clone, Debug)]
pub struct DrawTask {
    /// Which picture it is; later ones have larger numbers.
    pub number: u64,
    /// The scene.
    pub scene: Arc<Scene>,
    /// When.
    pub moment: Moment,
    /// What draws.
    pub engine: EngineKind,
    /// What replaces the scene's own settings. What is shown is said by `show`.
    pub look: Overrides,
    /// Which of its samples; all where what is to be seen [is exact](Show::is_exact).
    pub samples: Samples,
    /// What is to be seen.
    pub show: Show,
    /// The leaf that is picked out where leaves are seen; see [`crate::seeing::objects`].
    pub leaf: Option<u32>,
    /// Stops it.
    pub stop: Stop,
}

/// Which of a picture's samples are drawn.
#[derive(Clone, Debug)]
pub enum Samples {
    /// All of them.
    All,
    /// The first one of each pixel.
    First,
    /// All others, added to this picture of the first ones.
    Rest(Arc<Frame>),
}

impl Samples {
    fn of_engine(&self) -> frame::Samples<'_> {
        match self {
            Self::All => frame::Samples::All,
            Self::First => frame::Samples::First,
            Self::Rest(first) => frame::Samples::Rest(first),
        }
    }
}

/// How long the parts of a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// Bringing the scene to the engine: words and constants into buffers.
    pub loading: Duration,
    /// Drawing it.
    pub drawing: Duration,
}

impl std::ops::Add for Times {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            loading: self.loading + other.loading,
            drawing: self.drawing + other.drawing,
        }
    }
}

/// A picture that was drawn, or why it was not.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Which picture it is.
    pub number: u64,
    /// The scene's build.
    pub scene: u64,
    /// What drew it.
    pub engine: EngineKind,
    /// The picture.
    pub picture: Result<Picture, Problem>,
    /// How long it took.
    pub times: Times,
    /// The pipelines that its engine created so far.
    pub pipelines: u64,
}

/// A picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height.
    pub size: [usize; 2],
    /// Red, green, blue and alpha of each pixel, by rows from the upper left.
    pub rgba: Arc<Vec<u8>>,
    /// What is known of each pixel.
    pub frame: Arc<Frame>,
    /// How it was drawn.
    pub settings: RenderSettings,
    /// What the engine runs on.
    pub device: String,
    /// What its colours stand for, where that must be said.
    pub legend: Vec<([u8; 4], String)>,
    /// What there is to say about it, a line each.
    pub notes: Vec<String>,
}

impl Picture {
    /// Its bytes, to be drawn over.
    fn pixels(&mut self) -> &mut [u8] {
        Arc::make_mut(&mut self.rgba).as_mut_slice()
    }
}

/// A pixel about which all is to be told.
#[derive(Clone, Debug)]
pub struct PickTask {
    /// The scene.
    pub scene: Arc<Scene>,
    /// When.
    pub moment: Moment,
    /// What draws.
    pub engine: EngineKind,
    /// The picture that it is a pixel of.
    pub frame: Arc<Frame>,
    /// How that was drawn.
    pub settings: RenderSettings,
    /// Its column and row.
    pub pixel: [u32; 2],
}

/// What was found at a pixel.
#[derive(Clone, Debug)]
pub struct Picked {
    /// The pixel's column and row, and the size of its picture.
    pub pixel: [u32; 2],
    /// The picture's width and height.
    pub size: [usize; 2],
    /// All about it; nothing in the sky.
    pub found: Result<Option<Box<Pick>>, Problem>,
}

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Problem {
    /// It was stopped.
    Stopped,
    /// Something is wrong with the scene's numbers.
    Scene(String),
    /// The scene is too much for the engine, but perhaps not for another one.
    TooLong(String),
    /// The engine cannot run here, or no longer.
    Engine(String),
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stopped => f.write_str("stopped"),
            Self::Scene(why) | Self::TooLong(why) | Self::Engine(why) => f.write_str(why),
        }
    }
}

impl From<EngineError> for Problem {
    fn from(error: EngineError) -> Self {
        match error {
            EngineError::Stopped => Self::Stopped,
            EngineError::Gpu(_) => Self::Engine(error.to_string()),
            EngineError::TooLong { .. } => Self::TooLong(error.to_string()),
            EngineError::NothingLoaded | EngineError::AnotherScene => {
                Self::Scene(error.to_string())
            }
        }
    }
}

/// How engines are opened.
pub type Opener = Box<dyn Fn(EngineKind) -> Result<Box<dyn Engine>, EngineError> + Send>;

/// Engines, and what is loaded in them.
pub struct Painter {
    opener: Opener,
    held: HashMap<EngineKind, Held>,
    /// The leaves of a scene, by its build, once they were asked for: none where it has no text.
    origins: Option<(u64, Option<Arc<Origins>>)>,
    /// The engine that has them loaded.
    leaves: Option<Held>,
}

impl fmt::Debug for Painter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.held.keys()).finish()
    }
}

impl Painter {
    /// A painter that opens engines with this when it needs them.
    pub fn new(opener: Opener) -> Self {
        Self {
            opener,
            held: HashMap::new(),
            origins: None,
            leaves: None,
        }
    }

    /// Opens an engine, with all that its opener makes ready for all scenes, if it is not open.
    ///
    /// # Errors
    ///
    /// Says why it cannot run here.
    pub fn open(&mut self, kind: EngineKind) -> Result<(), Problem> {
        let attempt = AssertUnwindSafe(|| self.held(kind).map(|_| ()));
        catch_unwind(attempt).unwrap_or_else(|_| Err(panicked(kind)))
    }

    /// Draws a picture.
    pub fn draw(&mut self, task: &DrawTask) -> Drawn {
        let mut times = Times::default();
        let attempt = AssertUnwindSafe(|| self.attempt(task, &mut times));
        let picture = catch_unwind(attempt).unwrap_or_else(|_| Err(panicked(task.engine)));
        // What failed may be in any state.
        let mut pipelines = 0;
        if let Some(held) = self.held.get_mut(&task.engine) {
            pipelines = held.engine.pipelines_created();
        }
        if matches!(picture, Err(Problem::Engine(_))) {
            self.held.remove(&task.engine);
        }
        Drawn {
            number: task.number,
            scene: task.scene.number,
            engine: task.engine,
            picture,
            times,
            pipelines,
        }
    }

    fn attempt(&mut self, task: &DrawTask, times: &mut Times) -> Result<Picture, Problem> {
        let held = self.held(task.engine)?;
        let started = Instant::now();
        held.bring(&task.scene, &task.moment)?;
        times.loading = started.elapsed();
        let look = Overrides {
            mode: task.show.mode(),
            cells: match task.show {
                Show::Cells => CellUse::Always,
                _ => task.look.cells,
            },
            ..task.look.clone()
        };
        let settings = held.settings(&look)?;
        let started = Instant::now();
        let samples = task.samples.of_engine();
        let frame = held.engine.render_samples(&settings, samples, &task.stop)?;
        let mut picture = Picture {
            size: [frame.width, frame.height],
            rgba: Arc::new(frame.rgba8()),
            frame: Arc::new(frame),
            settings,
            device: held.engine.device(),
            legend: Vec::new(),
            notes: Vec::new(),
        };
        self.finish(task, &mut picture)?;
        times.drawing = started.elapsed();
        Ok(picture)
    }

    /// Tells all about a pixel.
    pub fn pick(&mut self, task: &PickTask) -> Picked {
        let attempt = AssertUnwindSafe(|| self.found(task));
        let found = catch_unwind(attempt).unwrap_or_else(|_| {
            self.held.clear();
            self.leaves = None;
            let what = "this is a bug in sdfc: looking at a pixel panicked";
            Err(Problem::Scene(what.to_owned()))
        });
        Picked {
            pixel: task.pixel,
            size: [task.frame.width, task.frame.height],
            found,
        }
    }

    fn found(&mut self, task: &PickTask) -> Result<Option<Box<Pick>>, Problem> {
        let Some(spot) = Spot::at(&task.frame, &task.settings, task.pixel) else {
            return Ok(None);
        };
        let Some(point) = spot.point() else {
            return Ok(None);
        };
        let leaf = match self.leaves(&task.scene, &task.moment)? {
            Some((held, _)) => held.engine.query(&[point])?.first().copied(),
            None => None,
        };
        let leaf = leaf.map_or(0, |sample| sample.surface.id.max(0.0) as u32);
        let known = self.origins(&task.scene);
        let held = self.held(task.engine)?;
        held.bring(&task.scene, &task.moment)?;
        let Some(sample) = held.engine.query(&[point])?.first().copied() else {
            return Ok(None);
        };
        let now = held.now()?;
        let scene = pick::Scene {
            module: &now.module,
            outputs: &now.outputs,
            settings: &task.settings,
            sources: &task.scene.sources,
            origins: known.as_deref(),
        };
        Ok(pick::describe(&spot, &scene, &sample, leaf).map(Box::new))
    }

    /// The leaves of a scene; none where it has no text.
    fn origins(&mut self, scene: &Scene) -> Option<Arc<Origins>> {
        if let Some((number, origins)) = &self.origins
            && *number == scene.number
        {
            return origins.clone();
        }
        let text = scene.opened.compiled.scene().cloned();
        let found = text.and_then(|text| origins(text, &Options::default()).0);
        let found = found.map(Arc::new);
        self.origins = Some((scene.number, found.clone()));
        found
    }

    /// The engine that tells the leaves of a scene, which always is the CPU: they need no speed, and
    /// their program is another one than the scene's.
    fn leaves(
        &mut self,
        scene: &Scene,
        moment: &Moment,
    ) -> Result<Option<(&mut Held, Arc<Origins>)>, Problem> {
        let Some(origins) = self.origins(scene) else {
            return Ok(None);
        };
        if self.leaves.is_none() {
            self.leaves = Some(Held::new((self.opener)(EngineKind::Cpu)?));
        }
        let nothing = GeneratedSource::default();
        let programs = Programs {
            number: scene.number,
            compiled: &origins.compiled,
            generated: &|| &nothing,
        };
        let Some(held) = &mut self.leaves else {
            return Ok(None);
        };
        held.bring_programs(&programs, moment)?;
        Ok(Some((held, origins)))
    }

    /// An engine, opened if it is not yet.
    fn held(&mut self, kind: EngineKind) -> Result<&mut Held, Problem> {
        if !self.held.contains_key(&kind) {
            let engine = (self.opener)(kind)?;
            self.held.insert(kind, Held::new(engine));
        }
        let missing = || Problem::Engine(format!("engine {kind} is not open"));
        self.held.get_mut(&kind).ok_or_else(missing)
    }
}

fn panicked(kind: EngineKind) -> Problem {
    Problem::Engine(format!("this is a bug in sdfc: the engine {kind} panicked"))
}
