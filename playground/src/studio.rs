//! Does the tasks of a session on threads of its own: one that builds, one for each engine that draws,
//! one that writes. What they are done with waits until it is taken.

use crate::build::{BuildTask, build};
use crate::files::Files;
use crate::painter::{DrawTask, Opener, Painter, PickTask};
use crate::picture::png;
use crate::session::{Done, Errand, Event, Session, Task};
use crate::watcher::{Watcher, changed_since};
use sdfc_compiler::export::translate;
use sdfc_runtime::engine::EngineKind;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

/// The stack of threads that build: trees of syntax and of expressions are walked by recursion, to a
/// depth that the compiler bounds.
const STACK: usize = 256 << 20;

/// A session with all that works for it.
pub struct Studio {
    session: Session,
    started: Instant,
    workers: Workers,
    news: Receiver<News>,
    watcher: Watcher,
    watched: Vec<PathBuf>,
    /// When the last build was asked for.
    asked: SystemTime,
    /// News that was taken while waiting.
    waiting: Vec<News>,
}

impl std::fmt::Debug for Studio {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Studio")
            .field("session", &self.session)
            .finish_non_exhaustive()
    }
}

/// What threads have to tell.
enum News {
    Done(Box<Done>),
    FilesChanged,
}

/// Ways to the threads; they end when these are dropped.
struct Workers {
    builds: Sender<BuildTask>,
    /// By engine.
    pictures: [Sender<Order>; EngineKind::ALL.len()],
    errands: Sender<Errand>,
}

impl Workers {
    /// Gives an order to the thread of an engine; whether it is there.
    fn paint(&self, engine: EngineKind, order: Order) -> bool {
        self.pictures[engine as usize].send(order).is_ok()
    }
}

/// What is wanted of a thread that draws.
enum Order {
    Draw(DrawTask),
    WarmUp,
    Prepare(DrawTask),
    Pick(Box<PickTask>),
}

/// Tells news, and wakes whoever waits for it.
#[derive(Clone)]
struct Teller {
    to: Sender<News>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl Teller {
    /// Whether somebody still listens.
    fn tell(&self, news: News) -> bool {
        let heard = self.to.send(news).is_ok();
        if heard {
            (self.wake)();
        }
        heard
    }

    fn done(&self, done: Done) -> bool {
        self.tell(News::Done(Box::new(done)))
    }
}

impl Studio {
    /// A studio for a session. Files are read from `files`, engines opened with what `opener` gives;
    /// `wake` is called from any thread when there is news.
    ///
    /// # Errors
    ///
    /// Says why no thread can be started, or no file be watched.
    pub fn new(
        session: Session,
        files: Arc<dyn Files>,
        opener: impl Fn() -> Opener,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self, String> {
        let (to, news) = channel();
        let teller = Teller {
            to,
            wake: Arc::new(wake),
        };
        let changed = teller.clone();
        let watcher = Watcher::new(move || {
            changed.tell(News::FilesChanged);
        })?;
        let builds = {
            let (teller, files) = (teller.clone(), Arc::clone(&files));
            worker("build", move || {
                move |task: BuildTask| teller.done(Done::Built(build(&task, &*files)))
            })?
        };
        let painter = |kind: EngineKind| {
            let teller = teller.clone();
            let opener = opener();
            worker(kind.name(), move || {
                let mut painter = Painter::new(opener);
                move |order: Order| {
                    teller.done(match order {
                        Order::Draw(task) => Done::Drawn(painter.draw(&task)),
                        Order::WarmUp => Done::Warm(kind, painter.open(kind)),
                        Order::Pick(task) => Done::Picked(painter.pick(&task)),
                        Order::Prepare(task) => {
                            // The first one makes all ready.
                            let first = painter.draw(&task);
                            let drawn = match &first.picture {
                                Ok(_) => painter.draw(&task),
                                Err(_) => first,
                            };
                            Done::Prepared(drawn)
                        }
                    })
                }
            })
        };
        let [cpu, interp, wgsl, reference] = EngineKind::ALL.map(painter);
        let pictures = [cpu?, interp?, wgsl?, reference?];
        let errands = worker("write", move || {
            move |errand: Errand| teller.done(run(errand, &*files))
        })?;
        Ok(Self {
            session,
            started: Instant::now(),
            workers: Workers {
                builds,
                pictures,
                errands,
            },
            news,
            watcher,
            watched: Vec::new(),
            asked: SystemTime::now(),
            waiting: Vec::new(),
        })
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The session, to take from it what is given once.
    pub fn session_mut(&mut self) -> &mut Session {
        &mut self.session
    }

    /// The time that the session goes by.
    pub fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// Tells the session that something happened.
    pub fn handle(&mut self, event: Event) {
        let now = self.now();
        self.session.handle(event, now);
    }

    /// Tells the session all news, has done what it asks for, and says when it wants to be asked
    /// again if nothing happens before: so much later, or never.
    pub fn turn(&mut self) -> Option<Duration> {
        let now = self.now();
        let waiting = std::mem::take(&mut self.waiting);
        let mut changed = false;
        for news in waiting.into_iter().chain(self.news.try_iter()) {
            match news {
                News::Done(done) => self.session.done(*done, now),
                News::FilesChanged => changed = true,
            }
        }
        if changed {
            // Folders may have come or gone.
            self.watch(now);
            self.session.handle(Event::FilesChanged, now);
        }
        for task in self.session.tasks(now) {
            self.start(task, now);
        }
        let wakes = self.session.wakes(now)?;
        Some(wakes.saturating_sub(now))
    }

    /// Waits for news, for no longer than this; whether there is any.
    pub fn wait(&mut self, at_most: Duration) -> bool {
        match self.news.recv_timeout(at_most) {
            Ok(news) => {
                self.waiting.push(news);
                true
            }
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => false,
        }
    }

    fn start(&mut self, task: Task, now: Duration) {
        let workers = &self.workers;
        // A thread that is gone has nobody to tell; the window is closing.
        let _ = match task {
            Task::Build(task) => {
                self.asked = SystemTime::now();
                workers.builds.send(task).is_ok()
            }
            Task::Draw(task) => workers.paint(task.engine, Order::Draw(task)),
            Task::WarmUp(engine) => workers.paint(engine, Order::WarmUp),
            Task::Prepare(task) => workers.paint(task.engine, Order::Prepare(task)),
            Task::Pick(task) => workers.paint(task.engine, Order::Pick(task)),
            Task::Watch(files) => {
                let before = std::mem::replace(&mut self.watched, files);
                self.watch(now);
                // Until now nobody watched what the scene imports for the first time.
                let new = self.watched.iter().filter(|file| !before.contains(file));
                let new: Vec<PathBuf> = new.cloned().collect();
                if changed_since(&new, self.asked) {
                    self.session.handle(Event::FilesChanged, now);
                }
                true
            }
            Task::Errand(errand) => workers.errands.send(errand).is_ok(),
        };
    }

    /// Has the scene's files watched wherever they are now.
    fn watch(&mut self, now: Duration) {
        if let Err(problem) = self.watcher.watch(&self.watched) {
            self.session.done(Done::Said(Err(problem)), now);
        }
    }
}

/// A thread that does what it is sent, in order, until nobody listens, with what `start` gives there.
fn worker<T: Send + 'static, W: FnMut(T) -> bool>(
    name: &str,
    start: impl FnOnce() -> W + Send + 'static,
) -> Result<Sender<T>, String> {
    let (to, todo) = channel();
    thread::Builder::new()
        .name(name.to_owned())
        .stack_size(STACK)
        .spawn(move || {
            let mut work = start();
            while let Ok(task) = todo.recv() {
                if !work(task) {
                    return;
                }
            }
        })
        .map_err(|error| format!("no thread could be started: {error}"))?;
    Ok(to)
}

fn run(errand: Errand, files: &dyn Files) -> Done {
    match errand {
        Errand::Replace {
            path,
            before,
            after,
            said,
        } => Done::Said(match files.replace(&path, &before, &after) {
            Ok(()) => Ok(said),
            Err(why) => Err(format!("{} was not written: {why}", path.display())),
        }),
        Errand::Save { path, size, rgba } => {
            let written = png(size, &rgba).and_then(|bytes| files.write(&path, &bytes));
            Done::Said(match written {
                Ok(()) => Ok(format!("saved {}", path.display())),
                Err(why) => Err(format!("{} was not written: {why}", path.display())),
            })
        }
        Errand::Export(target, scene) => {
            let text = translate(&scene.opened.compiled, target)
                .map_err(|error| error.to_string())
                .and_then(|bytes| String::from_utf8(bytes).map_err(|_| "it is no text".to_owned()));
            Done::Exported(text)
        }
    }
}
