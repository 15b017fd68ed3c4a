//! Schedules pictures: selects engine and refinement stage, and accepts the results.

use super::engine_selection::{EngineChoice, EngineTier, PreparedKey};
use super::refinement::{RayCost, RefinementStage};
use super::{DisplayedPicture, InFlight, MIN_CANCELLED_TIME, PREPARE_DELAY, Session, Task};
use crate::build::BuiltScene;
use crate::camera::OrbitCamera;
use crate::renderer::{
    CancelToken, DrawError, DrawResult, DrawTask, DrawTimes, Picture, SampleSet, SceneInputs,
};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::settings::Overrides;
use std::sync::Arc;
use std::time::Duration;

impl Session {
    /// Returns the scene if its programs match the current params, and the key that engines are prepared
    /// for.
    pub(super) fn drawable(&self) -> Option<(&Arc<BuiltScene>, PreparedKey)> {
        // While a scene is about to be replaced, the current params are not its own.
        let scene = self
            .scene
            .as_ref()
            .filter(|scene| self.params.matches_structure(scene))?;
        let key = PreparedKey {
            scene: scene.number,
            mode: self.show.mode(),
        };
        Some((scene, key))
    }

    /// Creates the task that draws the current view.
    fn draw_task(
        &mut self,
        scene: Arc<BuiltScene>,
        engine: EngineKind,
        stage: RefinementStage,
    ) -> DrawTask {
        self.last_picture += 1;
        let single = matches!(stage, RefinementStage::Coarse(_)) || self.show.is_exact();
        let samples = match stage {
            _ if single => SampleSet::All,
            RefinementStage::Full => SampleSet::First,
            _ => match &self.displayed {
                Some(displayed)
                    if displayed.view_revision == self.view_revision
                        && displayed.is_first_part(engine) =>
                {
                    SampleSet::Remaining(Arc::clone(&displayed.picture.image))
                }
                _ => SampleSet::All,
            },
        };
        DrawTask {
            number: self.last_picture,
            scene,
            inputs: SceneInputs {
                values: self.params.values(),
                time: self.time(),
            },
            engine,
            overrides: Overrides {
                size: Some(stage.size(self.size)),
                aa: single.then_some(1),
                camera: self.camera_name.clone(),
                view: self
                    .camera
                    .as_ref()
                    .filter(|_| self.is_camera_moved)
                    .map(OrbitCamera::view),
                ..Overrides::default()
            },
            samples,
            show: self.show,
            leaf: self.leaf(),
            stop: CancelToken::default(),
        }
    }

    /// Emits the task for the next picture, if one is due.
    pub(super) fn draw(&mut self, now: Duration) {
        let Some((scene, key)) = self.drawable() else {
            return;
        };
        let scene = Arc::clone(scene);
        let view_revision = self.view_revision;
        if self
            .problem
            .as_ref()
            .is_some_and(|(of, _)| *of == view_revision)
        {
            return;
        }
        if let Some(in_flight) = &self.in_flight {
            let ray_cost = self.ray_costs.get(&in_flight.engine);
            let time = ray_cost.and_then(|ray_cost| ray_cost.estimate(in_flight.rays));
            let is_long = time.is_none_or(|time| time > MIN_CANCELLED_TIME);
            if in_flight.view_revision != view_revision && !in_flight.stage.is_coarse() && is_long {
                in_flight.stop.cancel();
            }
            return;
        }
        let tier = match self.engine_selection.preparing() {
            Some(_) => EngineTier::Instant,
            None => self.engine_selection.tier_for(key),
        };
        let Some(engine) = self.show.engine().or(self.engine_selection.engine(tier)) else {
            return;
        };
        let samples = if self.show.is_exact() {
            1
        } else {
            scene.opened.compiled.module.settings.render.aa
        };
        let displayed = self
            .displayed
            .as_ref()
            .filter(|displayed| displayed.view_revision == view_revision);
        let displayed_stage = displayed.map(|displayed| displayed.stage);
        let previous_times = displayed.map_or(DrawTimes::default(), |displayed| displayed.times);
        let is_moving = self.rests_at(now).is_some();
        let ray_cost = self.ray_costs.entry(engine).or_default();
        let Some(stage) = ray_cost.next_stage(displayed_stage, self.size, samples, is_moving)
        else {
            return;
        };
        let task = self.draw_task(scene, engine, stage);
        let [width, height] = stage.size(self.size).map(u64::from);
        let rays_per_pixel = match (&task.samples, task.overrides.aa) {
            (SampleSet::First, _) | (_, Some(1)) => 1,
            (SampleSet::All, _) => u64::from(samples).pow(2),
            (SampleSet::Remaining(_), _) => u64::from(samples).pow(2) - 1,
        };
        self.in_flight = Some(InFlight {
            number: task.number,
            view_revision,
            stage,
            engine,
            rays: width * height * rays_per_pixel,
            previous_times: match task.samples {
                SampleSet::Remaining(_) => previous_times,
                SampleSet::All | SampleSet::First => DrawTimes::default(),
            },
            stop: task.stop.clone(),
            show: self.show,
        });
        self.tasks.push(Task::Draw(task));
    }

    pub(super) fn take_picture(&mut self, drawn: DrawResult) {
        self.pipelines.insert(drawn.engine, drawn.pipelines);
        let in_flight = self
            .in_flight
            .take_if(|in_flight| in_flight.number == drawn.number);
        let Some(in_flight) = in_flight else {
            return;
        };
        let is_current = self.is_current(&drawn);
        let engine = drawn.engine;
        match drawn.picture {
            Ok(picture) => {
                let ray_cost = self.ray_costs.entry(engine).or_default();
                ray_cost.observe(in_flight.rays, drawn.times.drawing);
                if is_current {
                    self.problem = None;
                    self.init_camera(&picture);
                    self.picture_version += 1;
                    self.displayed = Some(DisplayedPicture {
                        picture,
                        view_revision: in_flight.view_revision,
                        stage: in_flight.stage,
                        engine,
                        times: in_flight.previous_times + drawn.times,
                        show: in_flight.show,
                    });
                }
            }
            Err(DrawError::Engine(why)) if engine != EngineKind::Cpu => {
                self.message = Some(Err(format!("engine {engine}: {why}")));
                self.engine_selection.fail(engine, why);
                self.invalidate_view();
            }
            Err(DrawError::TooLong(why)) if engine != EngineKind::Cpu => {
                if is_current {
                    self.engine_selection.fail_this_build(engine, why);
                    self.invalidate_view();
                }
            }
            Err(DrawError::Stopped) => {}
            // A retry would give the same error.
            Err(problem) => {
                self.problem = Some((in_flight.view_revision, format!("error: {problem}\n")))
            }
        }
    }

    /// Reports whether a result belongs to the current build of the scene.
    fn is_current(&self, drawn: &DrawResult) -> bool {
        let scene = self.scene.as_ref();
        scene.is_some_and(|scene| scene.number == drawn.scene)
    }

    /// Initialises the camera from the view of the scene's first picture.
    fn init_camera(&mut self, picture: &Picture) {
        if let (None, Some(scene)) = (&self.camera, &self.scene) {
            let settings = &scene.opened.compiled.module.settings;
            let camera = OrbitCamera::new(picture.settings.view, settings.z_up, settings.is_2d);
            self.camera = Some(camera);
        }
    }

    /// Returns the key that the prepared engine should be made ready for, if any.
    pub(super) fn key_to_prepare(&self) -> Option<PreparedKey> {
        let (_, key) = self.drawable()?;
        let rested = self.building.is_none() && !self.needs_rebuild && self.problem.is_none();
        (rested && self.engine_selection.should_prepare(key)).then_some(key)
    }

    /// Prepares engines: the instant one at once, the other one [`PREPARE_DELAY`] after the last change
    /// of scene, engine or view mode.
    pub(super) fn prepare(&mut self, now: Duration) {
        if let Some(engine) = self.engine_selection.start_warm_up() {
            self.tasks.push(Task::WarmUp(engine));
        }
        if now < self.engines_invalidated_at + PREPARE_DELAY {
            return;
        }
        let key_and_scene = self.key_to_prepare().zip(self.scene.clone());
        let engine = self.engine_selection.engine(EngineTier::Prepared);
        if let (Some((key, scene)), Some(engine)) = (key_and_scene, engine) {
            let task = self.draw_task(scene, engine, RefinementStage::Full);
            self.engine_selection.start_preparing(key);
            self.tasks.push(Task::Prepare(task));
        }
    }

    /// Accepts the result of a warm-up.
    pub(super) fn take_warm(&mut self, engine: EngineKind, outcome: Result<(), DrawError>) {
        match outcome {
            Ok(()) => self.engine_selection.set_warm(),
            Err(problem) => self.engine_selection.fail(engine, problem.to_string()),
        }
    }

    pub(super) fn take_prepared(&mut self, drawn: DrawResult) {
        self.pipelines.insert(drawn.engine, drawn.pipelines);
        let is_current = self.is_current(&drawn);
        match drawn.picture {
            Ok(picture) => {
                let rays = (picture.size[0] * picture.size[1]) as u64;
                let prepared_time = drawn.times.drawing;
                let mut ray_cost = RayCost::default();
                ray_cost.observe(rays, prepared_time);
                self.ray_costs.insert(drawn.engine, ray_cost);
                let instant_time = self.engine_selection.engine(EngineTier::Instant);
                let instant_time =
                    instant_time.and_then(|engine| self.ray_costs.get(&engine)?.estimate(rays));
                self.engine_selection.finish_preparing(
                    instant_time.map(|instant_time| [instant_time, prepared_time]),
                );
                let is_requested = self.engine_choice() == EngineChoice::Only(drawn.engine);
                let drew = self.displayed.as_ref().map(|displayed| displayed.engine);
                if is_requested && drew != Some(drawn.engine) {
                    // The picture at rest is that of the engine that was chosen.
                    self.invalidate_view();
                }
            }
            Err(problem) => {
                self.engine_selection.cancel_preparing();
                match problem {
                    DrawError::Engine(why) => self.engine_selection.fail(drawn.engine, why),
                    // The instant engine continues to draw.
                    DrawError::Scene(why) | DrawError::TooLong(why) if is_current => {
                        self.engine_selection.fail_this_build(drawn.engine, why);
                    }
                    DrawError::Scene(_) | DrawError::TooLong(_) | DrawError::Stopped => {}
                }
            }
        }
    }
}
