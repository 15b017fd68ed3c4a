//! A session whose tasks are performed synchronously.

use sdfc_io::files::Files;
use sdfc_playground::build::{SceneOrigin, build};
use sdfc_playground::renderer::{DrawResult, DrawTask, Renderer, SampleSet};
use sdfc_playground::session::{Devices, Event, OneOffTask, Session, Task, TaskResult};
use sdfc_runtime::engine::{self, EngineKind};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Size of the picture, small for speed.
pub(crate) const SIZE: [u32; 2] = [48, 32];

/// Files in memory.
#[derive(Default)]
pub(crate) struct MemoryFiles(Mutex<HashMap<PathBuf, String>>);

impl MemoryFiles {
    pub(crate) fn put(&self, path: &str, text: &str) {
        let mut files = self.0.lock().unwrap();
        files.insert(PathBuf::from(path), text.to_owned());
    }
    pub(crate) fn remove(&self, path: &str) {
        self.0.lock().unwrap().remove(Path::new(path));
    }
    pub(crate) fn text(&self, path: &str) -> String {
        self.0.lock().unwrap()[Path::new(path)].clone()
    }
}

impl Files for MemoryFiles {
    fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        let files = self.0.lock().unwrap();
        let text = files.get(path).ok_or("there is no such file")?;
        Ok(text.clone().into_bytes())
    }
    fn replace(&self, path: &Path, previous: &str, text: &str) -> Result<(), String> {
        if self.read(path)? != previous.as_bytes() {
            return Err("it has changed meanwhile".to_owned());
        }
        self.write(path, text.as_bytes())
    }
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), String> {
        self.put(path.to_str().unwrap(), std::str::from_utf8(bytes).unwrap());
        Ok(())
    }
}

/// Kind of a task, for comparison in tests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum TaskKind {
    Build,
    Draw(EngineKind, [u32; 2]),
    WarmUp(EngineKind),
    Prepare,
    Pick,
    Watch(Vec<PathBuf>),
    Replace(PathBuf),
    Save,
    Export,
}

/// A session, its files and its clock.
pub(crate) struct Harness {
    pub(crate) session: Session,
    pub(crate) files: Arc<MemoryFiles>,
    pub(crate) now: Duration,
    pub(crate) log: Vec<TaskKind>,
    renderer: Renderer,
    /// Simulated time per ray of each engine.
    pub(crate) ray_times: HashMap<EngineKind, Duration>,
}

impl Harness {
    /// Creates a session of `a.sdf` with this text.
    pub(crate) fn new(text: &str) -> Self {
        Self::with_devices(text, Devices::default())
    }

    /// Creates a session of `a.sdf` with these devices; all engines are actually the CPU.
    pub(crate) fn with_devices(text: &str, devices: Devices) -> Self {
        let files = Arc::new(MemoryFiles::default());
        files.put("a.sdf", text);
        let mut harness = Self {
            session: Session::new(SceneOrigin::File(PathBuf::from("a.sdf")), devices),
            files,
            now: Duration::ZERO,
            log: Vec::new(),
            renderer: Renderer::new(Box::new(|_| engine::open(EngineKind::Cpu))),
            ray_times: HashMap::new(),
        };
        harness.handle(Event::Resized(SIZE));
        harness
    }

    pub(crate) fn handle(&mut self, event: Event) {
        self.session.handle(event, self.now);
    }

    /// Saves the scene and lets the change settle.
    pub(crate) fn save(&mut self, text: &str) {
        self.files.put("a.sdf", text);
        self.handle(Event::FilesChanged);
        self.advance(50);
    }

    pub(crate) fn advance(&mut self, milliseconds: u64) {
        self.now += Duration::from_millis(milliseconds);
    }

    /// Returns the tasks to start now.
    pub(crate) fn tasks(&mut self) -> Vec<Task> {
        let tasks = self.session.tasks(self.now);
        self.log.extend(tasks.iter().map(task_kind));
        tasks
    }

    fn draw(&mut self, task: &DrawTask) -> DrawResult {
        let mut drawn = self.renderer.draw(task);
        if let Some(ray) = self.ray_times.get(&task.engine) {
            drawn.times.drawing = *ray * rays(task);
        }
        drawn
    }

    /// Simulates a fixed time of a full-resolution picture on an engine.
    pub(crate) fn set_frame_time(&mut self, engine: EngineKind, full: Duration) {
        self.ray_times.insert(engine, full / (SIZE[0] * SIZE[1]));
    }

    /// Performs a task and returns its result.
    pub(crate) fn perform(&mut self, task: Task) -> Option<TaskResult> {
        Some(match task {
            Task::Build(task) => TaskResult::Built(build(&task, &*self.files)),
            Task::Draw(task) => TaskResult::Drawn(self.draw(&task)),
            Task::WarmUp(engine) => TaskResult::Warm(engine, Ok(())),
            Task::Prepare(task) => TaskResult::Prepared(self.draw(&task)),
            Task::Pick(task) => TaskResult::Picked(self.renderer.pick(&task)),
            Task::Watch(_) => return None,
            Task::OneOff(task) => match task {
                OneOffTask::Replace {
                    path,
                    expected,
                    replacement,
                    message,
                } => TaskResult::Message(
                    self.files
                        .replace(&path, &expected, &replacement)
                        .map(|()| message),
                ),
                OneOffTask::Save { path, .. } => {
                    TaskResult::Message(Ok(format!("saved {}", path.display())))
                }
                OneOffTask::Export(..) => TaskResult::Exported(Ok("text".to_owned())),
            },
        })
    }

    /// Performs all tasks due now and returns their kinds.
    pub(crate) fn run(&mut self) -> Vec<TaskKind> {
        let log_start = self.log.len();
        for round in 0.. {
            assert!(round < 100, "it wants something for ever: {:?}", self.log);
            let tasks = self.tasks();
            if tasks.is_empty() {
                break;
            }
            for task in tasks {
                if let Some(result) = self.perform(task) {
                    self.session.finish_task(result, self.now);
                }
            }
        }
        self.log[log_start..].to_vec()
    }

    /// Performs the tasks of `turns` turns, with 16 ms between them, and returns their kinds.
    pub(crate) fn run_for(&mut self, turns: usize) -> Vec<TaskKind> {
        let log_start = self.log.len();
        for _ in 0..turns {
            for task in self.tasks() {
                if let Some(result) = self.perform(task) {
                    self.session.finish_task(result, self.now);
                }
            }
            self.advance(16);
        }
        self.log[log_start..].to_vec()
    }

    /// Advances the time until the session is at rest and returns the kinds of all tasks.
    pub(crate) fn run_to_rest(&mut self) -> Vec<TaskKind> {
        let log_start = self.log.len();
        self.run();
        for round in 0.. {
            assert!(round < 100, "it never rests: {:?}", self.log);
            match self.session.next_wakeup(self.now) {
                Some(time) => self.now = self.now.max(time),
                None => break,
            }
            self.run();
        }
        self.log[log_start..].to_vec()
    }

    /// Returns the bytes of the displayed picture.
    pub(crate) fn picture_bytes(&self) -> PixelBytes {
        PixelBytes(Arc::clone(
            &self.session.picture().expect("a picture").0.rgba,
        ))
    }
}

/// Bytes of a picture.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct PixelBytes(Arc<Vec<u8>>);

impl std::fmt::Debug for PixelBytes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} bytes", self.0.len())
    }
}

fn rays(task: &DrawTask) -> u32 {
    let [w, h] = task.overrides.size.unwrap();
    let samples_per_pixel = task.overrides.aa.unwrap_or(2).pow(2);
    let samples = match task.samples {
        SampleSet::All => samples_per_pixel,
        SampleSet::First => 1,
        SampleSet::Remaining(_) => samples_per_pixel - 1,
    };
    w * h * samples
}

fn task_kind(task: &Task) -> TaskKind {
    match task {
        Task::Build(_) => TaskKind::Build,
        Task::Draw(task) => TaskKind::Draw(task.engine, task.overrides.size.unwrap()),
        Task::WarmUp(engine) => TaskKind::WarmUp(*engine),
        Task::Prepare(_) => TaskKind::Prepare,
        Task::Pick(_) => TaskKind::Pick,
        Task::Watch(files) => TaskKind::Watch(files.clone()),
        Task::OneOff(OneOffTask::Replace { path, .. }) => TaskKind::Replace(path.clone()),
        Task::OneOff(OneOffTask::Save { .. }) => TaskKind::Save,
        Task::OneOff(OneOffTask::Export(..)) => TaskKind::Export,
    }
}
