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

mod event;
mod pace;
mod params;
mod seen;
mod tiers;

pub use event::{CameraEvent, Done, Event, Task, TimeEvent};
pub use pace::Stage;
pub use params::Knob;
pub use seen::Facts;
pub use tiers::{Choice, Devices, Tier};

use crate::build::{BuildTask, Built, Scene, Source};
use crate::camera::{Camera, Place};
use crate::painter::{
    DrawTask, Drawn, Moment, PickTask, Picked, Picture, Problem, Show, Stop, Times,
};
use crate::timeline::Timeline;
use pace::Pace;
use params::{Change, Knobs};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::settings::Overrides;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tiers::{Key, Tiers};

/// How long files must have been quiet before they are read: editors write in several steps.
const SETTLING: Duration = Duration::from_millis(12);
/// How long a scene must have been at rest before the second engine is made ready for it.
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
    changed: Duration,
    shown: Option<Shown>,
    /// Counts the pictures that were shown.
    version: u64,
    pictures: u64,
    flights: HashMap<Tier, Flight>,
    pace: HashMap<Tier, Pace>,
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

/// A picture that is being drawn.
#[derive(Clone, Debug)]
struct Flight {
    number: u64,
    wish: u64,
    stage: Stage,
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
            changed: Duration::ZERO,
            shown: None,
            version: 0,
            pictures: 0,
            flights: HashMap::new(),
            pace: HashMap::new(),
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
                    self.wishes(now);
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
                if show != self.show {
                    // A plane is moved by hand.
                    let same = std::mem::discriminant(&show) == std::mem::discriminant(&self.show);
                    self.show = show;
                    if same {
                        self.moves(now);
                    } else {
                        self.wishes(now);
                    }
                }
            }
            Event::Pick(place) => self.pick(place),
            Event::Unpick => {
                self.picked = None;
                if self.show == Show::Objects {
                    self.wishes(now);
                }
            }
            Event::Engine(choice) => {
                self.tiers.choose(choice);
                self.pace.clear();
                self.wishes(now);
            }
            Event::Save(path) => self.save(path),
            Event::Export(target) => {
                if let Some(scene) = &self.scene {
                    self.tasks.push(Task::Export(target, Arc::clone(scene)));
                }
            }
            Event::Dismiss => self.said = None,
        }
    }

    /// A task was done.
    pub fn done(&mut self, done: Done, now: Duration) {
        match done {
            Done::Built(built) => self.take_build(built, now),
            Done::Drawn(tier, drawn) => self.take_picture(tier, drawn, now),
            Done::Prepared(drawn) => self.take_prepared(drawn),
            Done::Picked(picked) => {
                self.picked = Some(picked);
                if self.show == Show::Objects {
                    self.wishes(now);
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
        let settled = self.settled;
        let rest = self.pace.values().filter_map(|pace| pace.rests_at(now));
        let prepare = self.wants_prepared().map(|_| self.changed + UNHURRIED);
        // The next frame follows the one that is drawn now.
        let plays = self.plays() && self.flights.is_empty();
        let next = plays.then_some(now);
        let prepare = prepare.filter(|at| *at > now);
        rest.chain(settled).chain(prepare).chain(next).min()
    }

    fn open(&mut self, source: Source) {
        if source == self.source && self.scene.is_some() {
            return;
        }
        self.source = source;
        self.scene = None;
        self.knobs = Knobs::default();
        self.camera = None;
        self.camera_name = None;
        self.own_view = false;
        self.timeline = None;
        self.picked = None;
        self.pace.clear();
        self.rebuild = true;
    }

    /// What is to be seen is another.
    fn wishes(&mut self, now: Duration) {
        self.wish += 1;
        self.changed = now;
    }

    /// The same, by hand, and perhaps again soon.
    fn moves(&mut self, now: Duration) {
        self.wishes(now);
        for tier in [Tier::Instant, Tier::Prepared] {
            self.pace.entry(tier).or_default().moved(now);
        }
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
        let instant = self.tiers.engine(Tier::Instant);
        self.tasks.push(Task::Build(BuildTask {
            number: self.builds,
            source: self.source.clone(),
            overrides: self.knobs.overrides(),
            time: self.time(),
            part: None,
            guards: instant == Some(EngineKind::Interp),
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
            self.rebuild = true;
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
        // Its leaves are others, and may lie elsewhere.
        self.picked = None;
        self.wishes(now);
    }

    /// The time of the animation.
    fn time(&self) -> f64 {
        self.timeline.as_ref().map_or(0.0, Timeline::time)
    }

    fn plays(&self) -> bool {
        self.timeline.as_ref().is_some_and(Timeline::is_playing)
    }

    /// Lets the animation go on, once the picture of its last moment is there.
    fn advance(&mut self, now: Duration) {
        if !self.plays() {
            self.clock = None;
            return;
        }
        if !self.flights.is_empty() {
            return;
        }
        let elapsed = self
            .clock
            .map_or(Duration::ZERO, |at| now.saturating_sub(at));
        self.clock = Some(now);
        let moved = self
            .timeline
            .as_mut()
            .is_some_and(|timeline| timeline.advance(elapsed));
        if moved {
            self.moves(now);
        }
    }

    fn move_time(&mut self, event: TimeEvent, now: Duration) {
        let Some(timeline) = &mut self.timeline else {
            return;
        };
        let before = timeline.time();
        match event {
            TimeEvent::Toggle => {
                timeline.toggle();
                self.clock = Some(now);
            }
            TimeEvent::Scrub(time) => timeline.scrub(time),
            TimeEvent::Step(frames) => timeline.step(frames),
            TimeEvent::Repeat(repeats) => timeline.set_repeats(repeats),
            TimeEvent::Speed(speed) => timeline.set_speed(speed),
        }
        if timeline.time() != before {
            self.moves(now);
        }
    }

    fn aspect(&self) -> f64 {
        f64::from(self.size[0]) / f64::from(self.size[1])
    }

    /// How far the ray goes that is seen at a place.
    fn depth(&self, place: Place) -> Option<f64> {
        let frame = &self.shown.as_ref()?.picture.frame;
        let at = pixel(place, [frame.width, frame.height])?;
        let depth = frame.depth.get(at[1] * frame.width + at[0])?;
        depth.is_finite().then_some(f64::from(*depth))
    }

    fn move_camera(&mut self, event: CameraEvent, now: Duration) {
        if let CameraEvent::Scene(name) = event {
            self.camera_name = name;
            self.camera = None;
            self.own_view = false;
            self.wishes(now);
            return;
        }
        let aspect = self.aspect();
        let place = match &event {
            CameraEvent::Pan(place, _)
            | CameraEvent::Zoom(_, place)
            | CameraEvent::Focus(place) => *place,
            _ => [0.0; 2],
        };
        let depth = self.depth(place);
        let bounds = self.scene.as_ref().map(|scene| {
            let settings = &scene.opened.compiled.module.settings;
            *settings.space()
        });
        let (Some(camera), Some(bounds)) = (&mut self.camera, bounds) else {
            return;
        };
        match event {
            CameraEvent::Orbit([right, up]) => camera.orbit(right, up),
            CameraEvent::Pan(from, to) => {
                let held = depth.map(|depth| camera.point_under(from, Some(depth), aspect));
                camera.pan([to[0] - from[0], to[1] - from[1]], held, aspect);
            }
            CameraEvent::Zoom(factor, place) => camera.zoom(factor, place, depth, aspect),
            CameraEvent::Fit => camera.fit(&bounds, aspect),
            CameraEvent::Focus(place) => {
                if let Some(depth) = depth {
                    camera.focus(camera.point_under(place, Some(depth), aspect));
                }
            }
            CameraEvent::Face(side) => camera.face(side),
            CameraEvent::ToggleLens => camera.toggle_lens(&bounds),
            CameraEvent::Scene(_) => {}
        }
        self.own_view = true;
        self.moves(now);
    }

    fn key(&self) -> Option<Key> {
        let scene = self.scene.as_ref()?.number;
        Some(Key {
            scene,
            mode: self.show.mode(),
        })
    }

    /// A picture of what is to be seen now.
    fn picture(&mut self, scene: Arc<Scene>, engine: EngineKind, stage: Stage) -> DrawTask {
        self.pictures += 1;
        DrawTask {
            number: self.pictures,
            scene,
            moment: Moment {
                values: self.knobs.values(),
                time: self.time(),
            },
            engine,
            look: Overrides {
                size: Some(stage.size(self.size)),
                aa: (stage != Stage::Fine).then_some(1),
                camera: self.camera_name.clone(),
                view: self
                    .camera
                    .as_ref()
                    .filter(|_| self.own_view)
                    .map(Camera::view),
                ..Overrides::default()
            },
            show: self.show,
            leaf: self.leaf(),
            stop: Stop::default(),
        }
    }

    /// Asks for the next picture, if there is one to ask for.
    fn draw(&mut self, now: Duration) {
        let (Some(scene), Some(key)) = (self.scene.clone(), self.key()) else {
            return;
        };
        if self
            .problem
            .as_ref()
            .is_some_and(|(wish, _)| *wish == self.wish)
        {
            return;
        }
        // The params of a scene that is about to be replaced are not its own.
        if !self.knobs.fit(&scene) {
            return;
        }
        let mut tier = self.tiers.tier(key);
        let only = self.show.engine();
        if self.tiers.preparing().is_some() || only.is_some() {
            tier = Tier::Instant;
        }
        let wish = self.wish;
        let pace = self.pace.entry(tier).or_default();
        if let Some(flight) = self.flights.values().next() {
            let [w, h] = flight.stage.size(self.size);
            let long = pace
                .estimate(u64::from(w) * u64::from(h))
                .is_none_or(|time| time > WORTH_STOPPING);
            if flight.wish != wish && flight.stage > Stage::Coarse(u32::MAX) && long {
                flight.stop.now();
            }
            return;
        }
        let Some(engine) = only.or(self.tiers.engine(tier)) else {
            return;
        };
        let samples = if self.show.is_exact() {
            1
        } else {
            scene.opened.compiled.module.settings.render.aa
        };
        let moves = pace.moves(now);
        let done = self
            .shown
            .as_ref()
            .filter(|shown| shown.wish == wish)
            .map(|shown| shown.stage);
        let Some(stage) = pace.next(done, self.size, samples, moves) else {
            return;
        };
        let task = self.picture(scene, engine, stage);
        self.flights.insert(
            tier,
            Flight {
                number: task.number,
                wish,
                stage,
                stop: task.stop.clone(),
                show: self.show,
            },
        );
        self.tasks.push(Task::Draw(tier, task));
    }

    fn take_picture(&mut self, tier: Tier, drawn: Drawn, now: Duration) {
        let flight = self.flights.get(&tier);
        let Some(flight) = flight
            .filter(|flight| flight.number == drawn.number)
            .cloned()
        else {
            return;
        };
        self.flights.remove(&tier);
        self.pipelines.insert(drawn.engine, drawn.pipelines);
        match drawn.picture {
            Ok(picture) => {
                let samples = u64::from(picture.settings.aa).pow(2);
                let rays = (picture.size[0] * picture.size[1]) as u64 * samples;
                self.pace
                    .entry(tier)
                    .or_default()
                    .took(rays, drawn.times.drawing);
                if self
                    .scene
                    .as_ref()
                    .is_none_or(|scene| scene.number != drawn.scene)
                {
                    return;
                }
                self.problem = None;
                if self.camera.is_none() {
                    let settings = self.scene.as_ref().map(|scene| {
                        let settings = &scene.opened.compiled.module.settings;
                        (settings.z_up, settings.plane)
                    });
                    if let Some((z_up, plane)) = settings {
                        self.camera = Some(Camera::new(picture.settings.view, z_up, plane));
                    }
                }
                self.version += 1;
                self.shown = Some(Shown {
                    picture,
                    wish: flight.wish,
                    stage: flight.stage,
                    engine: drawn.engine,
                    times: drawn.times,
                    show: flight.show,
                });
            }
            Err(Problem::Stopped) => {}
            Err(Problem::Scene(why)) => {
                // The same again would be no better.
                self.problem = Some((flight.wish, format!("error: {why}\n")));
            }
            Err(Problem::Engine(why)) => {
                if self.tiers.fail(drawn.engine, why.clone()) {
                    self.said = Some(Err(format!("engine {}: {why}", drawn.engine)));
                    self.wishes(now);
                } else {
                    self.problem = Some((flight.wish, format!("error: {why}\n")));
                }
            }
        }
    }

    /// What the second engine should be made ready for, if anything.
    fn wants_prepared(&self) -> Option<Key> {
        let key = self.key()?;
        let rested = self.building.is_none() && !self.rebuild && self.problem.is_none();
        (rested && self.tiers.is_to_prepare(key)).then_some(key)
    }

    /// Has the second engine made ready once nothing has changed for a while.
    fn prepare(&mut self, now: Duration) {
        if now < self.changed + UNHURRIED {
            return;
        }
        let wanted = self.wants_prepared().zip(self.scene.clone());
        let Some((key, scene)) = wanted else {
            return;
        };
        let Some(engine) = self.tiers.engine(Tier::Prepared) else {
            return;
        };
        let task = self.picture(scene, engine, Stage::Full);
        self.tiers.prepares(key);
        self.tasks.push(Task::Prepare(task));
    }

    fn take_prepared(&mut self, drawn: Drawn) {
        self.pipelines.insert(drawn.engine, drawn.pipelines);
        let Some(key) = self.tiers.preparing() else {
            return;
        };
        match drawn.picture {
            Ok(picture) if key.scene == drawn.scene => {
                let rays = (picture.size[0] * picture.size[1]) as u64;
                let second = drawn.times.drawing;
                let mut pace = Pace::default();
                pace.took(rays, second);
                self.pace.insert(Tier::Prepared, pace);
                let first = self.pace.get(&Tier::Instant);
                let first = first.and_then(|pace| pace.estimate(rays));
                self.tiers.prepared(first.map(|first| [first, second]));
            }
            Err(Problem::Engine(why)) => {
                self.tiers.unprepared();
                self.tiers.fail(drawn.engine, why);
            }
            Err(Problem::Scene(why)) => {
                // Too long for it: the first one goes on.
                self.tiers.unprepared();
                self.tiers.fail(drawn.engine, why);
            }
            Ok(_) | Err(Problem::Stopped) => self.tiers.unprepared(),
        }
    }

    /// Asks about what is seen at a place.
    fn pick(&mut self, place: Place) {
        let scene = self.scene.clone();
        let (Some(scene), Some(shown)) = (scene, &self.shown) else {
            return;
        };
        let picture = &shown.picture;
        let Some([column, row]) = pixel(place, picture.size) else {
            return;
        };
        let Some(engine) = self.tiers.engine(Tier::Instant) else {
            return;
        };
        self.tasks.push(Task::Pick(Box::new(PickTask {
            scene,
            moment: Moment {
                values: self.knobs.values(),
                time: self.time(),
            },
            engine,
            frame: Arc::clone(&picture.frame),
            settings: picture.settings.clone(),
            pixel: [column as u32, row as u32],
        })));
    }

    /// The leaf that was picked.
    fn leaf(&self) -> Option<u32> {
        let found = self.picked.as_ref()?.found.as_ref().ok()?.as_ref()?;
        Some(found.leaf).filter(|leaf| *leaf > 0)
    }

    fn save(&mut self, path: PathBuf) {
        if let Some(shown) = &self.shown {
            self.tasks.push(Task::Save {
                path,
                size: shown.picture.size.map(|side| side as u32),
                rgba: Arc::new(shown.picture.rgba.clone()),
            });
        }
    }

    /// Writes the values of params into their texts, one edit a file.
    fn write_back(&mut self, indices: &[usize]) {
        let Some(scene) = self.scene.clone() else {
            return;
        };
        let mut edits: HashMap<_, Vec<_>> = HashMap::new();
        for &index in indices {
            let Some(knob) = self.knobs.all().get(index).filter(|knob| knob.is_changed()) else {
                continue;
            };
            let Some(written) = &knob.written else {
                let why = format!("`{}` is not in a text", knob.spec.name);
                self.said = Some(Err(why));
                continue;
            };
            let edit = (
                scene.sources.range(written.span),
                knob.text(),
                knob.spec.name.clone(),
            );
            edits.entry(written.span.file).or_default().push(edit);
        }
        for (file, mut edits) in edits {
            // From the last to the first, so that places stay true.
            edits.sort_by_key(|(range, ..)| std::cmp::Reverse(range.start));
            let before = scene.sources.text(file);
            let mut after = before.to_owned();
            let mut names = Vec::new();
            for (range, text, name) in edits {
                after.replace_range(range, &text);
                names.push(format!("{name} = {text}"));
            }
            names.reverse();
            let name = scene.sources.name(file);
            match &mut self.source {
                Source::Text { name: own, text } if own == name => {
                    *text = after;
                    self.rebuild = true;
                }
                _ => self.tasks.push(Task::Replace {
                    path: PathBuf::from(name),
                    before: before.into(),
                    after,
                    said: format!("{name}: {}", names.join(", ")),
                }),
            }
        }
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
