//! A session whose tasks are done here and now.

use sdfc_playground::build::{Source, build};
use sdfc_playground::files::Files;
use sdfc_playground::painter::{DrawTask, Painter};
use sdfc_playground::session::{Devices, Done, Event, Session, Task, Tier};
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
    Draw(Tier, EngineKind, [u32; 2]),
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
    /// How long pictures of each tier are said to have taken, for each ray.
    pub(crate) pretend: [Option<Duration>; 2],
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
            pretend: [None; 2],
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

    /// Does a task.
    pub(crate) fn perform(&mut self, task: Task) -> Option<Done> {
        Some(match task {
            Task::Build(task) => Done::Built(build(&task, &*self.files)),
            Task::Draw(tier, task) => {
                let mut drawn = self.painter.draw(&task);
                if let Some(ray) = self.pretend[tier as usize] {
                    drawn.times.drawing = ray * rays(&task);
                }
                Done::Drawn(tier, drawn)
            }
            Task::Prepare(task) => {
                let mut drawn = self.painter.draw(&task);
                if let Some(ray) = self.pretend[1] {
                    drawn.times.drawing = ray * rays(&task);
                }
                Done::Prepared(drawn)
            }
            Task::Pick(task) => Done::Picked(self.painter.pick(&task)),
            Task::Watch(_) => return None,
            Task::Replace {
                path,
                before,
                after,
                said,
            } => Done::Said(self.files.replace(&path, &before, &after).map(|()| said)),
            Task::Save { path, .. } => Done::Said(Ok(format!("saved {}", path.display()))),
            Task::Export(..) => Done::Exported(Ok("text".to_owned())),
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
        Pixels(self.session.seen().expect("a picture").0.rgba.clone())
    }
}

/// The bytes of a picture.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Pixels(Vec<u8>);

impl std::fmt::Debug for Pixels {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} bytes", self.0.len())
    }
}

fn rays(task: &DrawTask) -> u32 {
    let [w, h] = task.look.size.unwrap();
    let samples = task.look.aa.unwrap_or(2);
    w * h * samples * samples
}

fn asked(task: &Task) -> Asked {
    match task {
        Task::Build(_) => Asked::Build,
        Task::Draw(tier, task) => Asked::Draw(*tier, task.engine, task.look.size.unwrap()),
        Task::Prepare(_) => Asked::Prepare,
        Task::Pick(_) => Asked::Pick,
        Task::Watch(files) => Asked::Watch(files.clone()),
        Task::Replace { path, .. } => Asked::Replace(path.clone()),
        Task::Save { .. } => Asked::Save,
        Task::Export(..) => Asked::Export,
    }
}
