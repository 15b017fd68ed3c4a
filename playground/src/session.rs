//! The state machine of the playground. Input: events ([`Event`]) and task results ([`TaskResult`]).
//! Output: tasks ([`Task`]). The displayed state can be read at any time.
//!
//! Invariants:
//! - **The last good picture stays.** A scene that does not compile leaves the picture unchanged, with a
//!   report over it. The next scene that compiles clears the report.
//! - **An edit is drawn immediately.** The instant engine, which needs no preparation, builds and draws it.
//!   The prepared engine takes over once it is ready for this scene, if it is faster.
//! - **Changes appear at once and are refined at rest** ([`RefinementStage`]). A fine picture of an outdated
//!   view is cancelled.
//! - **At rest the session is idle**: it emits no tasks and needs no wake-up.
//!
//! Every call takes the current time, measured from an arbitrary fixed start.

mod drawing;
mod engine_selection;
mod event;
mod motion;
mod one_off;
mod opening;
mod params;
mod queries;
mod refinement;

pub use engine_selection::{Devices, EngineChoice};
pub use event::{CameraEvent, Event, OneOffTask, Task, TaskResult, TimeEvent};
pub use params::ParamState;
pub use queries::PictureFacts;
pub use refinement::RefinementStage;

use crate::build::{BuildResult, BuildTask, BuiltScene, SceneOrigin};
use crate::camera::{Ndc, OrbitCamera};
use crate::renderer::{CancelToken, DrawTimes, PickResult, Picture, ViewMode};
use crate::timeline::Timeline;
use engine_selection::{EngineSelection, EngineTier};
use motion::Anchor;
use params::{ParamChange, ParamStates};
use refinement::RayCost;
use sdfc_io::watcher::SETTLE_DELAY;
use sdfc_runtime::engine::EngineKind;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Time without invalidation after which the prepared engine is made ready for a scene.
const PREPARE_DELAY: Duration = Duration::from_millis(400);
/// Minimum estimated render time of an outdated picture that is worth cancelling.
const MIN_CANCELLED_TIME: Duration = Duration::from_millis(30);
/// Size of the picture in pixels until the first resize event.
const DEFAULT_SIZE: [u32; 2] = [640, 360];

/// A playground session; see [the module](self).
#[derive(Debug)]
pub struct Session {
    source: SceneOrigin,
    /// Scene to be opened once it is built.
    opening: Option<SceneOrigin>,
    /// Number of the last build that was started.
    last_build: u64,
    building: Option<u64>,
    /// Time at which changed files count as settled; `None` while no change is pending.
    settles_at: Option<Duration>,
    needs_rebuild: bool,
    files: Vec<PathBuf>,
    is_watching: bool,
    scene: Option<Arc<BuiltScene>>,
    report: String,
    /// True if the last build gave no scene or rejected the current params.
    broken: bool,
    /// Rendering error of the scene and the view revision that it belongs to.
    problem: Option<(u64, String)>,
    build_times: [Duration; 2],

    params: ParamStates,
    camera: Option<OrbitCamera>,
    /// Name of the displayed scene camera; `None` selects the scene's first camera.
    camera_name: Option<String>,
    /// True if the camera was moved away from the scene's own camera.
    is_camera_moved: bool,
    timeline: Option<Timeline>,
    last_tick: Option<Duration>,
    show: ViewMode,
    picked: Option<PickResult>,
    size: [u32; 2],

    /// Revision of the requested view; incremented whenever the displayed picture becomes outdated.
    view_revision: u64,
    /// Time of the last manual or animated motion.
    last_motion: Option<Duration>,
    anchor: Option<Anchor>,
    /// Time of the last change of scene, view mode or engine.
    engines_invalidated_at: Duration,
    displayed: Option<DisplayedPicture>,
    /// Number of pictures displayed so far.
    picture_version: u64,
    last_picture: u64,
    in_flight: Option<InFlight>,
    ray_costs: HashMap<EngineKind, RayCost>,
    engine_selection: EngineSelection,
    pipelines: HashMap<EngineKind, u64>,
    message: Option<Result<String, String>>,
    exported_text: Option<String>,
    tasks: Vec<Task>,
}

/// The displayed picture.
#[derive(Debug)]
struct DisplayedPicture {
    picture: Picture,
    view_revision: u64,
    stage: RefinementStage,
    engine: EngineKind,
    times: DrawTimes,
    show: ViewMode,
}

impl DisplayedPicture {
    /// Reports whether this picture holds the first samples of the engine's fine picture.
    fn is_first_part(&self, engine: EngineKind) -> bool {
        self.stage == RefinementStage::Full && self.engine == engine
    }
}

/// The picture being drawn.
#[derive(Debug)]
struct InFlight {
    number: u64,
    view_revision: u64,
    stage: RefinementStage,
    engine: EngineKind,
    /// Number of rays of the picture.
    rays: u64,
    /// Times of the displayed samples that this picture adds to.
    previous_times: DrawTimes,
    stop: CancelToken,
    show: ViewMode,
}

impl Session {
    /// Creates a session for a scene, given the available devices.
    pub fn new(source: SceneOrigin, devices: Devices) -> Self {
        Self {
            source,
            opening: None,
            last_build: 0,
            building: None,
            settles_at: None,
            needs_rebuild: true,
            files: Vec::new(),
            is_watching: true,
            scene: None,
            report: String::new(),
            broken: false,
            problem: None,
            build_times: [Duration::ZERO; 2],
            params: ParamStates::default(),
            camera: None,
            camera_name: None,
            is_camera_moved: false,
            timeline: None,
            last_tick: None,
            show: ViewMode::default(),
            picked: None,
            size: DEFAULT_SIZE,
            view_revision: 1,
            last_motion: None,
            anchor: None,
            engines_invalidated_at: Duration::ZERO,
            displayed: None,
            picture_version: 0,
            last_picture: 0,
            in_flight: None,
            ray_costs: HashMap::new(),
            engine_selection: EngineSelection::new(devices),
            pipelines: HashMap::new(),
            message: None,
            exported_text: None,
            tasks: Vec::new(),
        }
    }

    /// Handles an event at the time `now`, measured from the same start as in all other calls.
    pub fn handle(&mut self, event: Event, now: Duration) {
        match event {
            Event::Open(source) => self.open(source),
            Event::FilesChanged => self.settles_at = Some(now + SETTLE_DELAY),
            Event::Resized(size) => {
                let size = size.map(|side| side.clamp(1, 8192));
                if size != self.size {
                    self.size = size;
                    self.invalidate_view();
                }
            }
            Event::Set(index, value) => {
                let change = self.params.set(index, value);
                self.on_param_change(change, now);
            }
            Event::Reset(index) => {
                let change = self.params.reset(index);
                self.on_param_change(change, now);
            }
            Event::ResetAll => {
                for index in 0..self.params.all().len() {
                    let change = self.params.reset(index);
                    self.on_param_change(change, now);
                }
            }
            Event::WriteBack(indices) => self.write_back(&indices),
            Event::Camera(event) => self.move_camera(event, now),
            Event::Time(event) => self.move_time(event, now),
            Event::Show(show) => {
                let previous = std::mem::replace(&mut self.show, show);
                if show.is_moved_from(previous) {
                    self.on_motion(now);
                } else if show != previous {
                    self.invalidate_engines(now);
                }
            }
            Event::Pick(ndc) => self.pick(ndc),
            Event::Unpick => {
                self.picked = None;
                if self.show == ViewMode::Objects {
                    self.invalidate_view();
                }
            }
            Event::Engine(choice) => {
                self.engine_selection.set_choice(choice);
                self.invalidate_engines(now);
            }
            Event::Save(path) => self.save(path),
            Event::Export(target) => {
                if let Some(scene) = &self.scene {
                    let task = OneOffTask::Export(target, Arc::clone(scene));
                    self.tasks.push(Task::OneOff(task));
                }
            }
            Event::Dismiss => self.message = None,
        }
    }

    /// Accepts the result of a task.
    pub fn finish_task(&mut self, result: TaskResult, now: Duration) {
        match result {
            TaskResult::Built(built) => self.take_build(built, now),
            TaskResult::Drawn(drawn) => self.take_picture(drawn),
            TaskResult::Warm(engine, outcome) => self.take_warm(engine, outcome),
            TaskResult::Prepared(drawn) => self.take_prepared(drawn),
            TaskResult::Picked(picked) => {
                self.picked = Some(picked);
                if self.show == ViewMode::Objects {
                    self.invalidate_view();
                }
            }
            TaskResult::Message(message) => self.message = Some(message),
            TaskResult::Exported(Ok(text)) => {
                self.message = Some(Ok("copied".to_owned()));
                self.exported_text = Some(text);
            }
            TaskResult::Exported(Err(why)) => self.message = Some(Err(why)),
        }
    }

    /// Returns the tasks to start now.
    pub fn tasks(&mut self, now: Duration) -> Vec<Task> {
        if self.settles_at.is_some_and(|time| now >= time) {
            self.settles_at = None;
            self.needs_rebuild = true;
        }
        self.advance(now);
        if (self.needs_rebuild || self.opening.is_some()) && self.building.is_none() {
            self.build();
        }
        if !self.is_watching {
            self.is_watching = true;
            self.tasks.push(Task::Watch(self.files.clone()));
        }
        self.draw(now);
        self.prepare(now);
        std::mem::take(&mut self.tasks)
    }

    /// Returns the time of the next required call of [`Session::tasks`] if no event arrives earlier;
    /// `None` at rest.
    pub fn next_wakeup(&self, now: Duration) -> Option<Duration> {
        let rest_time = self.rests_at(now);
        let prepare = self
            .key_to_prepare()
            .map(|_| self.engines_invalidated_at + PREPARE_DELAY);
        let prepare = prepare.filter(|time| *time > now);
        // While an animation plays, the next frame follows the frame in flight immediately.
        let next_frame = (self.is_playing() && self.in_flight.is_none()).then_some(now);
        let wakeups = [rest_time, self.settles_at, prepare, next_frame];
        wakeups.into_iter().flatten().min()
    }

    /// Marks the displayed picture as outdated.
    fn invalidate_view(&mut self) {
        self.view_revision += 1;
    }

    /// Marks the displayed picture as outdated and restarts the delay before the second engine is
    /// prepared.
    fn invalidate_engines(&mut self, now: Duration) {
        self.invalidate_view();
        self.engines_invalidated_at = now;
    }

    fn on_param_change(&mut self, change: ParamChange, now: Duration) {
        match change {
            ParamChange::None => {}
            ParamChange::Live => self.on_motion(now),
            ParamChange::Structural => self.needs_rebuild = true,
        }
    }

    fn build(&mut self) {
        self.last_build += 1;
        self.building = Some(self.last_build);
        let (source, overrides, time) = match &self.opening {
            Some(source) => (source.clone(), Vec::new(), 0.0),
            None => {
                self.needs_rebuild = false;
                (self.source.clone(), self.params.overrides(), self.time())
            }
        };
        self.tasks.push(Task::Build(BuildTask {
            number: self.last_build,
            source,
            overrides,
            time,
            part: None,
        }));
    }

    fn take_build(&mut self, built: BuildResult, now: Duration) {
        if self.building != Some(built.number) {
            return;
        }
        self.building = None;
        if !self.finish_opening(&built) {
            return;
        }
        if built.files != self.files {
            self.files.clone_from(&built.files);
            self.is_watching = false;
        }
        self.broken = built.scene.is_none();
        self.problem = None;
        self.report = built.report;
        self.build_times = [built.reading, built.compiling];
        let Some(scene) = built.scene else {
            return;
        };
        self.params.take(&scene);
        if !self.params.matches_structure(&scene) {
            let present = self.params.overrides();
            match built.rejected {
                // Building with these values again would fail again.
                Some(rejected) if rejected.overrides == present => {
                    self.broken = true;
                    self.report = rejected.report;
                }
                _ => self.needs_rebuild = true,
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
        let previous = self.scene.as_ref().map(|scene| {
            let settings = &scene.opened.compiled.module.settings;
            (settings.is_2d, settings.z_up)
        });
        if previous.is_some_and(|previous| previous != (settings.is_2d, settings.z_up)) {
            self.is_camera_moved = false;
        }
        if !self.is_camera_moved {
            self.camera = None;
        }
        let settings = &scene.opened.compiled.module.settings;
        self.engine_selection
            .begin_build(settings.max_slope().is_infinite());
        self.scene = Some(scene);
        // Leaf numbers and positions may have changed with the new scene.
        self.picked = None;
        self.anchor = None;
        self.invalidate_engines(now);
    }
}

/// Returns column and row of the pixel at a point in normalised device coordinates; `None` outside the
/// picture.
fn pixel(ndc: Ndc, size: [usize; 2]) -> Option<[usize; 2]> {
    let pixel_index = |v: f64, side: usize| {
        let index = ((v + 1.0) / 2.0 * side as f64).floor();
        (index >= 0.0 && index < side as f64).then_some(index as usize)
    };
    Some([
        pixel_index(ndc[0], size[0])?,
        pixel_index(-ndc[1], size[1])?,
    ])
}
