//! Draws what a session asks for: holds engines, loads scenes into them, brings params and time up
//! to date, and turns frames into pixels.
//!
//! A painter is used by one thread at a time. It never panics on a scene: what an engine panicked
//! with becomes a problem, and the engine is opened anew.

use crate::build::Scene;
use sdfc_runtime::engine::{Engine, EngineError, EngineKind, Loaded};
use sdfc_runtime::frame::{Frame, Progress, RenderSettings};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;
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
    /// What replaces the scene's own settings.
    pub look: Overrides,
    /// Stops it.
    pub stop: Stop,
}

/// How long the parts of a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// Bringing the scene to the engine: words and constants into buffers.
    pub loading: Duration,
    /// Drawing it.
    pub drawing: Duration,
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
    /// The pipelines that were created for it.
    pub pipelines: u64,
}

/// A picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height.
    pub size: [usize; 2],
    /// Red, green, blue and alpha of each pixel, by rows from the upper left.
    pub rgba: Vec<u8>,
    /// What is known of each pixel.
    pub frame: Arc<Frame>,
    /// How it was drawn.
    pub settings: RenderSettings,
    /// What the engine runs on.
    pub device: String,
}

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Problem {
    /// It was stopped.
    Stopped,
    /// Something is wrong with the scene's numbers, or it is too much for the engine.
    Scene(String),
    /// The engine cannot run here, or no longer.
    Engine(String),
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stopped => f.write_str("stopped"),
            Self::Scene(why) | Self::Engine(why) => f.write_str(why),
        }
    }
}

impl From<EngineError> for Problem {
    fn from(error: EngineError) -> Self {
        match error {
            EngineError::Stopped => Self::Stopped,
            EngineError::Gpu(_) => Self::Engine(error.to_string()),
            EngineError::TooLong { .. }
            | EngineError::NothingLoaded
            | EngineError::AnotherScene => Self::Scene(error.to_string()),
        }
    }
}

/// How engines are opened.
pub type Opener = Box<dyn Fn(EngineKind) -> Result<Box<dyn Engine>, EngineError> + Send>;

/// Engines, and what is loaded in them.
pub struct Painter {
    opener: Opener,
    held: HashMap<EngineKind, Held>,
}

/// An engine and what is loaded in it.
struct Held {
    engine: Box<dyn Engine>,
    loaded: Option<Now>,
}

/// A scene at a moment.
struct Now {
    number: u64,
    moment: Moment,
    module: Module,
    outputs: Vec<f64>,
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
        }
    }

    /// Draws a picture.
    pub fn draw(&mut self, task: &DrawTask) -> Drawn {
        let mut times = Times::default();
        let attempt = AssertUnwindSafe(|| self.attempt(task, &mut times));
        let picture = catch_unwind(attempt).unwrap_or_else(|_| {
            let what = format!("this is a bug in sdfc: the engine {} panicked", task.engine);
            Err(Problem::Engine(what))
        });
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
        let settings = held.settings(task)?;
        let started = Instant::now();
        let frame = held.engine.render(&settings, &task.stop)?;
        times.drawing = started.elapsed();
        Ok(Picture {
            size: [frame.width, frame.height],
            rgba: frame.rgba8(),
            frame: Arc::new(frame),
            settings,
            device: held.engine.device(),
        })
    }

    /// An engine, opened if it is not yet.
    fn held(&mut self, kind: EngineKind) -> Result<&mut Held, Problem> {
        if !self.held.contains_key(&kind) {
            let engine = (self.opener)(kind)?;
            self.held.insert(
                kind,
                Held {
                    engine,
                    loaded: None,
                },
            );
        }
        let missing = || Problem::Engine(format!("engine {kind} is not open"));
        self.held.get_mut(&kind).ok_or_else(missing)
    }
}

impl Held {
    /// Brings a scene and its moment to the engine: all of it, or only numbers, or nothing.
    fn bring(&mut self, scene: &Scene, moment: &Moment) -> Result<(), Problem> {
        match &mut self.loaded {
            Some(now) if now.number == scene.number => {
                if now.moment == *moment {
                    return Ok(());
                }
                now.update(scene, moment);
                let done = self.engine.update(&now.module, &now.outputs);
                if done.is_err() {
                    self.loaded = None;
                }
                Ok(done?)
            }
            _ => {
                self.loaded = None;
                let mut now = Now {
                    number: scene.number,
                    moment: moment.clone(),
                    module: scene.opened.compiled.module.clone(),
                    outputs: Vec::new(),
                };
                now.update(scene, moment);
                let generated = match self.engine.kind() {
                    EngineKind::Wgsl => SceneSource {
                        text: &scene.generated().text,
                        calls: &scene.generated().calls,
                    },
                    _ => SceneSource::default(),
                };
                self.engine.load(&Loaded {
                    module: &now.module,
                    outputs: &now.outputs,
                    generated,
                })?;
                self.loaded = Some(now);
                Ok(())
            }
        }
    }

    /// How the task's picture is drawn.
    fn settings(&self, task: &DrawTask) -> Result<RenderSettings, Problem> {
        let now = self.loaded.as_ref();
        let now = now.ok_or_else(|| Problem::from(EngineError::NothingLoaded))?;
        resolve(&now.module, &now.outputs, &task.look)
            .map_err(|error| Problem::Scene(error.to_string()))
    }
}

impl Now {
    fn update(&mut self, scene: &Scene, moment: &Moment) {
        for (param, value) in self
            .module
            .settings
            .params
            .iter_mut()
            .zip(&*moment.values)
        {
            param.value.clone_from(value);
        }
        self.outputs = scene.opened.compiled.bring(&mut self.module, moment.time);
        self.moment = moment.clone();
    }
}
