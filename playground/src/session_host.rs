//! Runs the tasks of a session on worker threads: one for builds, one per engine, one for files. Results
//! are queued until the session takes them.

use crate::build::{BuildTask, build};
use crate::renderer::{DrawTask, EngineOpener, PickTask, Renderer};
use crate::session::{Event, OneOffTask, Session, Task, TaskResult};
use sdfc_compiler::export::translate;
use sdfc_io::files::Files;
use sdfc_io::png_encoding::encode_png;
use sdfc_io::watcher::{Watcher, changed_since};
use sdfc_runtime::engine::EngineKind;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

/// Stack size of worker threads in bytes. Syntax and expression trees are walked by recursion, to a depth
/// that the compiler bounds.
const WORKER_STACK_BYTES: usize = 256 << 20;

/// A session with its worker threads and its file watcher.
pub struct SessionHost {
    session: Session,
    started_at: Instant,
    workers: Workers,
    events: Receiver<WorkerEvent>,
    watcher: Watcher,
    watched: Vec<PathBuf>,
    /// Time at which the last build was started.
    build_started_at: SystemTime,
    /// Events received while waiting.
    received: Vec<WorkerEvent>,
}

impl std::fmt::Debug for SessionHost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SessionHost")
            .field("session", &self.session)
            .finish_non_exhaustive()
    }
}

/// An event sent by a worker thread.
enum WorkerEvent {
    Done(Box<TaskResult>),
    FilesChanged,
}

/// Channels to the worker threads, which end when these are dropped.
struct Workers {
    builds: Sender<BuildTask>,
    /// Channels to the render threads, indexed by engine.
    pictures: [Sender<EngineJob>; EngineKind::ALL.len()],
    one_off_tasks: Sender<OneOffTask>,
}

impl Workers {
    /// Sends a job to the thread of an engine. Returns false if that thread has ended.
    fn send(&self, engine: EngineKind, job: EngineJob) -> bool {
        self.pictures[engine as usize].send(job).is_ok()
    }
}

/// A job for a render thread.
enum EngineJob {
    Draw(DrawTask),
    WarmUp,
    Prepare(DrawTask),
    Pick(Box<PickTask>),
}

/// Sends events to the host and wakes its thread.
#[derive(Clone)]
struct EventSender {
    event_sender: Sender<WorkerEvent>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl EventSender {
    /// Sends an event. Returns false if the host was dropped.
    fn send(&self, event: WorkerEvent) -> bool {
        let is_open = self.event_sender.send(event).is_ok();
        if is_open {
            (self.wake)();
        }
        is_open
    }

    fn send_result(&self, done: TaskResult) -> bool {
        self.send(WorkerEvent::Done(Box::new(done)))
    }
}

impl SessionHost {
    /// Creates a host for a session. Files are read through `files`; `opener` creates the engine opener
    /// of each render thread. `wake` is called from any thread when an event was sent.
    ///
    /// # Errors
    ///
    /// An error message if a thread cannot be started or the file watcher is unavailable.
    pub fn new(
        session: Session,
        files: Arc<dyn Files>,
        opener: impl Fn() -> EngineOpener,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self, String> {
        let (event_sender, events) = channel();
        let sender = EventSender {
            event_sender,
            wake: Arc::new(wake),
        };
        let watcher_sender = sender.clone();
        let watcher = Watcher::new(move || {
            watcher_sender.send(WorkerEvent::FilesChanged);
        })?;
        let builds = {
            let (sender, files) = (sender.clone(), Arc::clone(&files));
            spawn_worker("build", move || {
                move |task: BuildTask| sender.send_result(TaskResult::Built(build(&task, &*files)))
            })?
        };
        let spawn_renderer = |kind: EngineKind| {
            let sender = sender.clone();
            let opener = opener();
            spawn_worker(kind.name(), move || {
                let mut renderer = Renderer::new(opener);
                move |job: EngineJob| {
                    sender.send_result(match job {
                        EngineJob::Draw(task) => TaskResult::Drawn(renderer.draw(&task)),
                        EngineJob::WarmUp => TaskResult::Warm(kind, renderer.open(kind)),
                        EngineJob::Pick(task) => TaskResult::Picked(renderer.pick(&task)),
                        EngineJob::Prepare(task) => {
                            // The first picture loads and compiles; the second one is timed.
                            let first = renderer.draw(&task);
                            let drawn = match &first.picture {
                                Ok(_) => renderer.draw(&task),
                                Err(_) => first,
                            };
                            TaskResult::Prepared(drawn)
                        }
                    })
                }
            })
        };
        let [cpu, interp, wgsl, reference] = EngineKind::ALL.map(spawn_renderer);
        let pictures = [cpu?, interp?, wgsl?, reference?];
        let one_off_tasks = spawn_worker("write", move || {
            move |task: OneOffTask| sender.send_result(run_one_off(task, &*files))
        })?;
        Ok(Self {
            session,
            started_at: Instant::now(),
            workers: Workers {
                builds,
                pictures,
                one_off_tasks,
            },
            events,
            watcher,
            watched: Vec::new(),
            build_started_at: SystemTime::now(),
            received: Vec::new(),
        })
    }

    /// Returns the session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Returns the session mutably, for values that can be taken only once.
    pub fn session_mut(&mut self) -> &mut Session {
        &mut self.session
    }

    /// Returns the session's current time.
    pub fn now(&self) -> Duration {
        self.started_at.elapsed()
    }

    /// Passes an event to the session.
    pub fn handle(&mut self, event: Event) {
        let now = self.now();
        self.session.handle(event, now);
    }

    /// Passes all received events to the session and starts its tasks. Returns the delay until the next
    /// required call if no event arrives earlier; `None` at rest.
    pub fn turn(&mut self) -> Option<Duration> {
        let now = self.now();
        let received = std::mem::take(&mut self.received);
        let mut files_changed = false;
        for event in received.into_iter().chain(self.events.try_iter()) {
            match event {
                WorkerEvent::Done(done) => self.session.finish_task(*done, now),
                WorkerEvent::FilesChanged => files_changed = true,
            }
        }
        if files_changed {
            // Folders may have appeared or vanished.
            self.watch(now);
            self.session.handle(Event::FilesChanged, now);
        }
        for task in self.session.tasks(now) {
            self.start(task, now);
        }
        let next_wakeup = self.session.next_wakeup(now)?;
        Some(next_wakeup.saturating_sub(now))
    }

    /// Waits at most `timeout` for an event. Returns whether one was received.
    pub fn wait(&mut self, timeout: Duration) -> bool {
        match self.events.recv_timeout(timeout) {
            Ok(event) => {
                self.received.push(event);
                true
            }
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => false,
        }
    }

    fn start(&mut self, task: Task, now: Duration) {
        let workers = &self.workers;
        // A failed send means that the thread has ended because the window is closing.
        let _ = match task {
            Task::Build(task) => {
                self.build_started_at = SystemTime::now();
                workers.builds.send(task).is_ok()
            }
            Task::Draw(task) => workers.send(task.engine, EngineJob::Draw(task)),
            Task::WarmUp(engine) => workers.send(engine, EngineJob::WarmUp),
            Task::Prepare(task) => workers.send(task.engine, EngineJob::Prepare(task)),
            Task::Pick(task) => workers.send(task.engine, EngineJob::Pick(task)),
            Task::Watch(files) => {
                let previously_watched = std::mem::replace(&mut self.watched, files);
                self.watch(now);
                // Newly imported files were not watched until now.
                let new = self
                    .watched
                    .iter()
                    .filter(|file| !previously_watched.contains(file));
                let new: Vec<PathBuf> = new.cloned().collect();
                if changed_since(&new, self.build_started_at) {
                    self.session.handle(Event::FilesChanged, now);
                }
                true
            }
            Task::OneOff(task) => workers.one_off_tasks.send(task).is_ok(),
        };
    }

    /// Watches the scene's files at their current locations.
    fn watch(&mut self, now: Duration) {
        if let Err(problem) = self.watcher.watch(&self.watched) {
            self.session
                .finish_task(TaskResult::Message(Err(problem)), now);
        }
    }
}

/// Spawns a thread that processes tasks in order until its receiver is gone. `start` creates the task
/// function on that thread.
fn spawn_worker<T: Send + 'static, W: FnMut(T) -> bool>(
    name: &str,
    start: impl FnOnce() -> W + Send + 'static,
) -> Result<Sender<T>, String> {
    let (task_sender, tasks) = channel();
    thread::Builder::new()
        .name(name.to_owned())
        .stack_size(WORKER_STACK_BYTES)
        .spawn(move || {
            let mut work = start();
            while let Ok(task) = tasks.recv() {
                if !work(task) {
                    return;
                }
            }
        })
        .map_err(|error| format!("no thread could be started: {error}"))?;
    Ok(task_sender)
}

fn run_one_off(task: OneOffTask, files: &dyn Files) -> TaskResult {
    match task {
        OneOffTask::Replace {
            path,
            expected,
            replacement,
            message,
        } => TaskResult::Message(match files.replace(&path, &expected, &replacement) {
            Ok(()) => Ok(message),
            Err(why) => Err(format!("{} was not written: {why}", path.display())),
        }),
        OneOffTask::Save { path, size, rgba } => {
            let written = encode_png(size, &rgba).and_then(|bytes| files.write(&path, &bytes));
            TaskResult::Message(match written {
                Ok(()) => Ok(format!("saved {}", path.display())),
                Err(why) => Err(format!("{} was not written: {why}", path.display())),
            })
        }
        OneOffTask::Export(target, scene) => {
            let text = translate(&scene.opened.compiled, target)
                .map_err(|error| error.to_string())
                .and_then(|bytes| {
                    String::from_utf8(bytes).map_err(|_| "it is not text".to_owned())
                });
            TaskResult::Exported(text)
        }
    }
}
