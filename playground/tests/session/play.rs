//! A session whose tasks are done here and now.

use sdfc_playground::build::{Source, build};
use sdfc_playground::files::Files;
use sdfc_playground::painter::{DrawTask, Drawn, Painter, Samples};
use sdfc_playground::session::{Devices, Done, Errand, Event, Session, Task};
use sdfc_runtime::engine::{self, EngineKind};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A small picture.
pub(crate) const SIZE: [u32; 2] = [48, 32];

/// Files in memory.
#[derive(Default)]
pub(crate) struct Memory(Mutex<HashMap<PathBuf, String>>);

impl Memory {
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

impl Files for Memory {
    fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        let files = self.0.lock().unwrap();
        let text = files.get(path).ok_or("there is no such file")?;
        Ok(text.clone().into_bytes())
    }
    fn replace(&self, path: &Path, before: &str, text: &str) -> Result<(), String> {
        if self.read(path)? != before.as_bytes() {
            return Err("it has changed meanwhile".to_owned());
        }
        self.write(path, text.as_bytes())
    }
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), String> {
        self.put(path.to_str().unwrap(), std::str::from_utf8(bytes).unwrap());
        Ok(())
    }
}

/// What a session asked for, in short.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
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
pub(crate) struct Play {
    pub(crate) session: Session,
    pub(crate) files: Arc<Memory>,
    pub(crate) now: Duration,
    pub(crate) log: Vec<Asked>,
    painter: Painter,
    /// How long pictures of each engine are said to have taken, for each ray.
    pub(crate) pretend: HashMap<EngineKind, Duration>,
}

impl Play {
    /// A session of `a.sdf` with this text.
    pub(crate) fn of(text: &str) -> Self {
        Self::on(text, Devices::default())
    }

    /// The same on such devices; all engines are the CPU in truth.
    pub(crate) fn on(text: &str, devices: Devices) -> Self {
        let files = Arc::new(Memory::default());
        files.put("a.sdf", text);
        let mut play = Self {
            session: Session::new(Source::File(PathBuf::from("a.sdf")), devices),
            files,
            now: Duration::ZERO,
            log: Vec::new(),
            painter: Painter::new(Box::new(|_| engine::open(EngineKind::Cpu))),
            pretend: HashMap::new(),
        };
        play.handle(Event::Resized(SIZE));
        play
    }

    pub(crate) fn handle(&mut self, event: Event) {
        self.session.handle(event, self.now);
    }

    /// Saves the scene, and lets it settle.
    pub(crate) fn save(&mut self, text: &str) {
        self.files.put("a.sdf", text);
        self.handle(Event::FilesChanged);
        self.pass(50);
    }

    pub(crate) fn pass(&mut self, milliseconds: u64) {
        self.now += Duration::from_millis(milliseconds);
    }

    /// Tasks that are to be done now.
    pub(crate) fn tasks(&mut self) -> Vec<Task> {
        let tasks = self.session.tasks(self.now);
        self.log.extend(tasks.iter().map(asked));
        tasks
    }

    fn draw(&mut self, task: &DrawTask) -> Drawn {
        let mut drawn = self.painter.draw(task);
        if let Some(ray) = self.pretend.get(&task.engine) {
            drawn.times.drawing = *ray * rays(task);
        }
        drawn
    }

    /// Says that a picture of the engine takes so long in full, however fast it is.
    pub(crate) fn takes(&mut self, engine: EngineKind, full: Duration) {
        self.pretend.insert(engine, full / (SIZE[0] * SIZE[1]));
    }

    /// Does a task.
    pub(crate) fn perform(&mut self, task: Task) -> Option<Done> {
        Some(match task {
            Task::Build(task) => Done::Built(build(&task, &*self.files)),
            Task::Draw(task) => Done::Drawn(self.draw(&task)),
            Task::WarmUp(engine) => Done::Warm(engine, Ok(())),
            Task::Prepare(task) => Done::Prepared(self.draw(&task)),
            Task::Pick(task) => Done::Picked(self.painter.pick(&task)),
            Task::Watch(_) => return None,
            Task::Errand(errand) => match errand {
                Errand::Replace {
                    path,
                    before,
                    after,
                    said,
                } => Done::Said(self.files.replace(&path, &before, &after).map(|()| said)),
                Errand::Save { path, .. } => Done::Said(Ok(format!("saved {}", path.display()))),
                Errand::Export(..) => Done::Exported(Ok("text".to_owned())),
            },
        })
    }

    /// Does all there is to do at this moment; what it was asked for.
    pub(crate) fn run(&mut self) -> Vec<Asked> {
        let from = self.log.len();
        for round in 0.. {
            assert!(round < 100, "it wants something for ever: {:?}", self.log);
            let tasks = self.tasks();
            if tasks.is_empty() {
                break;
            }
            for task in tasks {
                if let Some(done) = self.perform(task) {
                    self.session.done(done, self.now);
                }
            }
        }
        self.log[from..].to_vec()
    }

    /// Does what is asked for in so many turns, with 16 ms between them.
    pub(crate) fn run_for(&mut self, turns: usize) -> Vec<Asked> {
        let from = self.log.len();
        for _ in 0..turns {
            for task in self.tasks() {
                if let Some(done) = self.perform(task) {
                    self.session.done(done, self.now);
                }
            }
            self.pass(16);
        }
        self.log[from..].to_vec()
    }

    /// Lets time pass until the session wants nothing any more; what it was asked for.
    pub(crate) fn rest(&mut self) -> Vec<Asked> {
        let from = self.log.len();
        self.run();
        for round in 0.. {
            assert!(round < 100, "it never rests: {:?}", self.log);
            match self.session.wakes(self.now) {
                Some(at) => self.now = self.now.max(at),
                None => break,
            }
            self.run();
        }
        self.log[from..].to_vec()
    }

    /// The bytes of the picture that is seen.
    pub(crate) fn seen(&self) -> Pixels {
        Pixels(Arc::clone(&self.session.seen().expect("a picture").0.rgba))
    }
}

/// The bytes of a picture.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Pixels(Arc<Vec<u8>>);

impl std::fmt::Debug for Pixels {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} bytes", self.0.len())
    }
}

fn rays(task: &DrawTask) -> u32 {
    let [w, h] = task.look.size.unwrap();
    let all = task.look.aa.unwrap_or(2).pow(2);
    let samples = match task.samples {
        Samples::All => all,
        Samples::First => 1,
        Samples::Rest(_) => all - 1,
    };
    w * h * samples
}

fn asked(task: &Task) -> Asked {
    match task {
        Task::Build(_) => Asked::Build,
        Task::Draw(task) => Asked::Draw(task.engine, task.look.size.unwrap()),
        Task::WarmUp(engine) => Asked::WarmUp(*engine),
        Task::Prepare(_) => Asked::Prepare,
        Task::Pick(_) => Asked::Pick,
        Task::Watch(files) => Asked::Watch(files.clone()),
        Task::Errand(Errand::Replace { path, .. }) => Asked::Replace(path.clone()),
        Task::Errand(Errand::Save { .. }) => Asked::Save,
        Task::Errand(Errand::Export(..)) => Asked::Export,
    }
}
