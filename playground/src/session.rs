//! The state machine of the playground: what has happened goes in ([`Event`], [`Done`]), what is to
//! be done comes out ([`Task`]), and what is to be seen can be read at any time.
//!
//! It holds:
//! - **The last good picture stays.** A scene that does not compile leaves the picture as it is, with
//!   a report over it; the next one that does clears the report.
//! - **An edit waits for nothing.** It is built and drawn by the engine that needs no preparation;
//!   the other one takes over when it is ready for this very scene, and faster.
//! - **A change is seen at once, and finely when it has come to rest** ([`Stage`]). A fine picture of
//!   what is no longer to be seen is stopped.
//! - **At rest it wants nothing**: no tasks and no clock.
//!
//! Time is given from outside, as the time since any moment that stays the same.

mod drawing;
mod errands;
mod event;
mod moves;
mod pace;
mod params;
mod seen;
mod tiers;

pub use event::{CameraEvent, Done, Errand, Event, Task, TimeEvent};
pub use pace::Stage;
pub use params::Knob;
pub use seen::Facts;
pub use tiers::{Choice, Devices};

use crate::build::{BuildTask, Built, Scene, Source};
use crate::camera::{Camera, Place};
use crate::painter::{Picked, Picture, Show, Stop, Times};
use crate::timeline::Timeline;
use crate::watcher::SETTLING;
use moves::Held;
use pace::Pace;
use params::{Change, Knobs};
use sdfc_runtime::engine::EngineKind;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tiers::{Tier, Tiers};

/// How long a scene must have been the same before the second engine is made ready for it.
const UNHURRIED: Duration = Duration::from_millis(400);
/// Pictures that are estimated to take longer are stopped when they are no longer wanted.
const WORTH_STOPPING: Duration = Duration::from_millis(30);
/// The space that is filled until its size is known.
const SIZE: [u32; 2] = [640, 360];

/// A session; see [the module](self).
#[derive(Debug)]
pub struct Session {
    source: Source,
    /// The number of the last build that was asked for.
    builds: u64,
    building: Option<u64>,
    /// When files will have been quiet for long enough, if they changed.
    settled: Option<Duration>,
    rebuild: bool,
    files: Vec<PathBuf>,
    watched: bool,
    scene: Option<Arc<Scene>>,
    report: String,
    /// Whether the report is about a text that gives no scene.
    broken: bool,
    /// Why the scene gives no picture as it is, and what was wished for then.
    problem: Option<(u64, String)>,
    built: [Duration; 2],

    knobs: Knobs,
    camera: Option<Camera>,
    /// The name of the scene's camera that is shown; its first one, if none.
    camera_name: Option<String>,
    /// Whether the camera was moved away from the scene's.
    own_view: bool,
    timeline: Option<Timeline>,
    clock: Option<Duration>,
    show: Show,
    picked: Option<Picked>,
    size: [u32; 2],

    /// What is to be seen has changed so many times.
    wish: u64,
    /// When it last moved by hand or played.
    moved: Option<Duration>,
    held: Option<Held>,
    /// When the scene, what is shown or the engine was last another.
    renewed: Duration,
    shown: Option<Shown>,
    /// Counts the pictures that were shown.
    version: u64,
    pictures: u64,
    flight: Option<Flight>,
    paces: HashMap<EngineKind, Pace>,
    tiers: Tiers,
    pipelines: HashMap<EngineKind, u64>,
    said: Option<Result<String, String>>,
    exported: Option<String>,
    tasks: Vec<Task>,
}

/// The picture that is seen.
#[derive(Debug)]
struct Shown {
    picture: Picture,
    wish: u64,
    stage: Stage,
    engine: EngineKind,
    times: Times,
    show: Show,
}

impl Shown {
    /// Whether it is what this engine's fine picture begins with.
    fn is_first_part(&self, engine: EngineKind) -> bool {
        self.stage == Stage::Full && self.engine == engine
    }
}

/// A picture that is being drawn.
#[derive(Debug)]
struct Flight {
    number: u64,
    wish: u64,
    stage: Stage,
    engine: EngineKind,
    /// How many rays it takes.
    rays: u64,
    /// What the samples took that it adds to.
    before: Times,
    stop: Stop,
    show: Show,
}

impl Session {
    /// A session that shows a source, on what runs here.
    pub fn new(source: Source, devices: Devices) -> Self {
        Self {
            source,
            builds: 0,
            building: None,
            settled: None,
            rebuild: true,
            files: Vec::new(),
            watched: true,
            scene: None,
            report: String::new(),
            broken: false,
            problem: None,
            built: [Duration::ZERO; 2],
            knobs: Knobs::default(),
            camera: None,
            camera_name: None,
            own_view: false,
            timeline: None,
            clock: None,
            show: Show::default(),
            picked: None,
            size: SIZE,
            wish: 1,
            moved: None,
            held: None,
            renewed: Duration::ZERO,
            shown: None,
            version: 0,
            pictures: 0,
            flight: None,
            paces: HashMap::new(),
            tiers: Tiers::new(devices),
            pipelines: HashMap::new(),
            said: None,
            exported: None,
            tasks: Vec::new(),
        }
    }

    /// Something happened.
    pub fn handle(&mut self, event: Event, now: Duration) {
        match event {
            Event::Open(source) => self.open(source),
            Event::FilesChanged => self.settled = Some(now + SETTLING),
            Event::Resized(size) => {
                let size = size.map(|side| side.clamp(1, 8192));
                if size != self.size {
                    self.size = size;
                    self.wishes();
                }
            }
            Event::Set(index, value) => {
                let change = self.knobs.set(index, value);
                self.turned(change, now);
            }
            Event::Reset(index) => {
                let change = self.knobs.reset(index);
                self.turned(change, now);
            }
            Event::ResetAll => {
                for index in 0..self.knobs.all().len() {
                    let change = self.knobs.reset(index);
                    self.turned(change, now);
                }
            }
            Event::WriteBack(indices) => self.write_back(&indices),
            Event::Camera(event) => self.move_camera(event, now),
            Event::Time(event) => self.move_time(event, now),
            Event::Show(show) => {
                let before = std::mem::replace(&mut self.show, show);
                if show.is_moved(before) {
                    self.moves(now);
                } else if show != before {
                    self.renews(now);
                }
            }
            Event::Pick(place) => self.pick(place),
            Event::Unpick => {
                self.picked = None;
                if self.show == Show::Objects {
                    self.wishes();
                }
            }
            Event::Engine(choice) => {
                self.tiers.choose(choice);
                self.renews(now);
            }
            Event::Save(path) => self.save(path),
            Event::Export(target) => {
                if let Some(scene) = &self.scene {
                    let errand = Errand::Export(target, Arc::clone(scene));
                    self.tasks.push(Task::Errand(errand));
                }
            }
            Event::Dismiss => self.said = None,
        }
    }

    /// A task was done.
    pub fn done(&mut self, done: Done, now: Duration) {
        match done {
            Done::Built(built) => self.take_build(built, now),
            Done::Drawn(drawn) => self.take_picture(drawn),
            Done::Warm(engine, outcome) => self.take_warm(engine, outcome),
            Done::Prepared(drawn) => self.take_prepared(drawn),
            Done::Picked(picked) => {
                self.picked = Some(picked);
                if self.show == Show::Objects {
                    self.wishes();
                }
            }
            Done::Said(said) => self.said = Some(said),
            Done::Exported(Ok(text)) => {
                self.said = Some(Ok("copied".to_owned()));
                self.exported = Some(text);
            }
            Done::Exported(Err(why)) => self.said = Some(Err(why)),
        }
    }

    /// What is to be done now.
    pub fn tasks(&mut self, now: Duration) -> Vec<Task> {
        if self.settled.is_some_and(|at| now >= at) {
            self.settled = None;
            self.rebuild = true;
        }
        self.advance(now);
        if self.rebuild && self.building.is_none() {
            self.build();
        }
        if !self.watched {
            self.watched = true;
            self.tasks.push(Task::Watch(self.files.clone()));
        }
        self.draw(now);
        self.prepare(now);
        std::mem::take(&mut self.tasks)
    }

    /// When [`Session::tasks`] should be asked again if nothing happens before; never, if at rest.
    pub fn wakes(&self, now: Duration) -> Option<Duration> {
        let rest = self.rests_at(now);
        let prepare = self.wants_prepared().map(|_| self.renewed + UNHURRIED);
        let prepare = prepare.filter(|at| *at > now);
        // The next frame follows the one that is drawn now.
        let next = (self.plays() && self.flight.is_none()).then_some(now);
        let all = [rest, self.settled, prepare, next];
        all.into_iter().flatten().min()
    }

    fn open(&mut self, source: Source) {
        if source == self.source && self.scene.is_some() {
            return;
        }
        self.source = source;
        // What is built now is the scene of before.
        self.building = None;
        self.scene = None;
        self.knobs = Knobs::default();
        self.camera = None;
        self.camera_name = None;
        self.own_view = false;
        self.timeline = None;
        self.picked = None;
        self.paces.clear();
        self.rebuild = true;
    }

    /// What is to be seen is another.
    fn wishes(&mut self) {
        self.wish += 1;
    }

    /// The same, and engines may have to be made ready for it.
    fn renews(&mut self, now: Duration) {
        self.wishes();
        self.renewed = now;
    }

    fn turned(&mut self, change: Change, now: Duration) {
        match change {
            Change::None => {}
            Change::Live => self.moves(now),
            Change::Structural => self.rebuild = true,
        }
    }

    fn build(&mut self) {
        self.builds += 1;
        self.rebuild = false;
        self.building = Some(self.builds);
        self.tasks.push(Task::Build(BuildTask {
            number: self.builds,
            source: self.source.clone(),
            overrides: self.knobs.overrides(),
            time: self.time(),
            part: None,
        }));
    }

    fn take_build(&mut self, built: Built, now: Duration) {
        if self.building != Some(built.number) {
            return;
        }
        self.building = None;
        if built.files != self.files {
            self.files.clone_from(&built.files);
            self.watched = false;
        }
        self.broken = built.scene.is_none();
        self.problem = None;
        self.report = built.report;
        self.built = [built.reading, built.compiling];
        let Some(scene) = built.scene else {
            return;
        };
        self.knobs.take(&scene);
        if !self.knobs.fit(&scene) {
            let present = self.knobs.overrides();
            match built.refused {
                // They would be again.
                Some(refused) if refused.overrides == present => {
                    self.broken = true;
                    self.report = refused.report;
                }
                _ => self.rebuild = true,
            }
        }
        let settings = &scene.opened.compiled.module.settings;
        self.timeline = match (self.timeline.take(), settings.animation) {
            (Some(mut timeline), Some(animation)) => {
                timeline.change(animation);
                Some(timeline)
            }
            (None, Some(animation)) => Some(Timeline::new(animation)),
            (_, None) => None,
        };
        let is_named = |name: &String| settings.cameras.iter().any(|camera| camera.name == *name);
        self.camera_name = self.camera_name.take().filter(is_named);
        let before = self.scene.as_ref().map(|scene| {
            let settings = &scene.opened.compiled.module.settings;
            (settings.plane, settings.z_up)
        });
        if before.is_some_and(|before| before != (settings.plane, settings.z_up)) {
            self.own_view = false;
        }
        if !self.own_view {
            self.camera = None;
        }
        self.scene = Some(scene);
        // Its leaves are others, and may lie elsewhere, as all of it may.
        self.picked = None;
        self.held = None;
        self.tiers.try_again();
        self.renews(now);
    }
}

/// The pixel at a place of a picture of this size, as column and row.
fn pixel(place: Place, size: [usize; 2]) -> Option<[usize; 2]> {
    let along = |v: f64, side: usize| {
        let at = ((v + 1.0) / 2.0 * side as f64).floor();
        (at >= 0.0 && at < side as f64).then_some(at as usize)
    };
    Some([along(place[0], size[0])?, along(-place[1], size[1])?])
}
