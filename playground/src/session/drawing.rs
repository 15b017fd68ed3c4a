//! Which picture is asked for next, of which engine, and what is done with those that come.

use super::pace::{Pace, Stage};
use super::tiers::{Key, Tier};
use super::{Flight, Session, Shown, Task, UNHURRIED, WORTH_STOPPING};
use crate::build::Scene;
use crate::camera::Camera;
use crate::painter::{DrawTask, Drawn, Moment, Picture, Problem, Samples, Stop, Times};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::settings::Overrides;
use std::sync::Arc;
use std::time::Duration;

impl Session {
    /// The scene, if its programs are those of the present params, and what engines are made ready for.
    pub(super) fn drawable(&self) -> Option<(&Arc<Scene>, Key)> {
        // The params of a scene that is about to be replaced are not its own.
        let scene = self.scene.as_ref().filter(|scene| self.knobs.fit(scene))?;
        let key = Key {
            scene: scene.number,
            mode: self.show.mode(),
        };
        Some((scene, key))
    }

    /// A picture of what is to be seen now.
    fn picture(&mut self, scene: Arc<Scene>, engine: EngineKind, stage: Stage) -> DrawTask {
        self.pictures += 1;
        let single = matches!(stage, Stage::Coarse(_)) || self.show.is_exact();
        let samples = match stage {
            _ if single => Samples::All,
            Stage::Full => Samples::First,
            _ => match &self.shown {
                Some(shown) if shown.wish == self.wish && shown.is_first_part(engine) => {
                    Samples::Rest(Arc::clone(&shown.picture.frame))
                }
                _ => Samples::All,
            },
        };
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
                aa: single.then_some(1),
                camera: self.camera_name.clone(),
                view: self
                    .camera
                    .as_ref()
                    .filter(|_| self.own_view)
                    .map(Camera::view),
                ..Overrides::default()
            },
            samples,
            show: self.show,
            leaf: self.leaf(),
            stop: Stop::default(),
        }
    }

    /// Asks for the next picture, if there is one to ask for.
    pub(super) fn draw(&mut self, now: Duration) {
        let Some((scene, key)) = self.drawable() else {
            return;
        };
        let scene = Arc::clone(scene);
        let wish = self.wish;
        if self.problem.as_ref().is_some_and(|(of, _)| *of == wish) {
            return;
        }
        if let Some(flight) = &self.flight {
            let pace = self.paces.get(&flight.engine);
            let time = pace.and_then(|pace| pace.estimate(flight.rays));
            let is_long = time.is_none_or(|time| time > WORTH_STOPPING);
            if flight.wish != wish && !flight.stage.is_coarse() && is_long {
                flight.stop.now();
            }
            return;
        }
        let tier = match self.tiers.preparing() {
            Some(_) => Tier::Instant,
            None => self.tiers.tier(key),
        };
        let Some(engine) = self.show.engine().or(self.tiers.engine(tier)) else {
            return;
        };
        let samples = if self.show.is_exact() {
            1
        } else {
            scene.opened.compiled.module.settings.render.aa
        };
        let shown = self.shown.as_ref().filter(|shown| shown.wish == wish);
        let done = shown.map(|shown| shown.stage);
        let before = shown.map_or(Times::default(), |shown| shown.times);
        let moves = self.rests_at(now).is_some();
        let pace = self.paces.entry(engine).or_default();
        let Some(stage) = pace.next(done, self.size, samples, moves) else {
            return;
        };
        let task = self.picture(scene, engine, stage);
        let [width, height] = stage.size(self.size).map(u64::from);
        let each = match (&task.samples, task.look.aa) {
            (Samples::First, _) | (_, Some(1)) => 1,
            (Samples::All, _) => u64::from(samples).pow(2),
            (Samples::Rest(_), _) => u64::from(samples).pow(2) - 1,
        };
        self.flight = Some(Flight {
            number: task.number,
            wish,
            stage,
            engine,
            rays: width * height * each,
            before: match task.samples {
                Samples::Rest(_) => before,
                Samples::All | Samples::First => Times::default(),
            },
            stop: task.stop.clone(),
            show: self.show,
        });
        self.tasks.push(Task::Draw(task));
    }

    pub(super) fn take_picture(&mut self, drawn: Drawn) {
        self.pipelines.insert(drawn.engine, drawn.pipelines);
        let flight = self.flight.take_if(|flight| flight.number == drawn.number);
        let Some(flight) = flight else {
            return;
        };
        let is_present = self.is_present(&drawn);
        let engine = drawn.engine;
        match drawn.picture {
            Ok(picture) => {
                let pace = self.paces.entry(engine).or_default();
                pace.took(flight.rays, drawn.times.drawing);
                if is_present {
                    self.problem = None;
                    self.first_look(&picture);
                    self.version += 1;
                    self.shown = Some(Shown {
                        picture,
                        wish: flight.wish,
                        stage: flight.stage,
                        engine,
                        times: flight.before + drawn.times,
                        show: flight.show,
                    });
                }
            }
            Err(Problem::Engine(why)) if engine != EngineKind::Cpu => {
                self.said = Some(Err(format!("engine {engine}: {why}")));
                self.tiers.fail(engine, why);
                self.wishes();
            }
            Err(Problem::TooLong(why)) if engine != EngineKind::Cpu => {
                if is_present {
                    self.tiers.fail_for_now(engine, why);
                    self.wishes();
                }
            }
            Err(Problem::Stopped) => {}
            // The same again would be no better.
            Err(problem) => self.problem = Some((flight.wish, format!("error: {problem}\n"))),
        }
    }

    /// Whether something was drawn of the scene as it is now.
    fn is_present(&self, drawn: &Drawn) -> bool {
        let scene = self.scene.as_ref();
        scene.is_some_and(|scene| scene.number == drawn.scene)
    }

    /// Learns where the scene's own camera is from its first picture.
    fn first_look(&mut self, picture: &Picture) {
        if let (None, Some(scene)) = (&self.camera, &self.scene) {
            let settings = &scene.opened.compiled.module.settings;
            let camera = Camera::new(picture.settings.view, settings.z_up, settings.plane);
            self.camera = Some(camera);
        }
    }

    /// What the second engine should be made ready for, if anything.
    pub(super) fn wants_prepared(&self) -> Option<Key> {
        let (_, key) = self.drawable()?;
        let rested = self.building.is_none() && !self.rebuild && self.problem.is_none();
        (rested && self.tiers.is_to_prepare(key)).then_some(key)
    }

    /// Has engines made ready: the first one at once, the second one when scene, engine and what is
    /// shown have been the same for a while.
    pub(super) fn prepare(&mut self, now: Duration) {
        if let Some(engine) = self.tiers.warms_up() {
            self.tasks.push(Task::WarmUp(engine));
        }
        if now < self.renewed + UNHURRIED {
            return;
        }
        let wanted = self.wants_prepared().zip(self.scene.clone());
        let engine = self.tiers.engine(Tier::Prepared);
        if let (Some((key, scene)), Some(engine)) = (wanted, engine) {
            let task = self.picture(scene, engine, Stage::Full);
            self.tiers.prepares(key);
            self.tasks.push(Task::Prepare(task));
        }
    }

    /// An engine is ready for all scenes, or will not be.
    pub(super) fn take_warm(&mut self, engine: EngineKind, outcome: Result<(), Problem>) {
        match outcome {
            Ok(()) => self.tiers.is_warm(),
            Err(problem) => self.tiers.fail(engine, problem.to_string()),
        }
    }

    pub(super) fn take_prepared(&mut self, drawn: Drawn) {
        self.pipelines.insert(drawn.engine, drawn.pipelines);
        let is_present = self.is_present(&drawn);
        match drawn.picture {
            Ok(picture) => {
                let rays = (picture.size[0] * picture.size[1]) as u64;
                let second = drawn.times.drawing;
                let mut pace = Pace::default();
                pace.took(rays, second);
                self.paces.insert(drawn.engine, pace);
                let first = self.tiers.engine(Tier::Instant);
                let first = first.and_then(|engine| self.paces.get(&engine)?.estimate(rays));
                self.tiers.prepared(first.map(|first| [first, second]));
            }
            Err(problem) => {
                self.tiers.unprepared();
                match problem {
                    Problem::Engine(why) => self.tiers.fail(drawn.engine, why),
                    // The first one goes on.
                    Problem::Scene(why) | Problem::TooLong(why) if is_present => {
                        self.tiers.fail_for_now(drawn.engine, why);
                    }
                    Problem::Scene(_) | Problem::TooLong(_) | Problem::Stopped => {}
                }
            }
        }
    }
}
