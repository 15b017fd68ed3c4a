//! Which picture is asked for next, of which engine, and what is done with those that come.

use super::pace::{Pace, Stage};
use super::tiers::{Key, Tier};
use super::{Flight, Session, Shown, Task, UNHURRIED, WORTH_STOPPING};
use crate::build::Scene;
use crate::camera::Camera;
use crate::painter::{DrawTask, Drawn, Moment, Problem, Stop};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::settings::Overrides;
use std::sync::Arc;
use std::time::Duration;

impl Session {
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
    pub(super) fn draw(&mut self, now: Duration) {
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

    pub(super) fn take_picture(&mut self, tier: Tier, drawn: Drawn, now: Duration) {
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
    pub(super) fn wants_prepared(&self) -> Option<Key> {
        let key = self.key()?;
        let rested = self.building.is_none() && !self.rebuild && self.problem.is_none();
        (rested && self.tiers.is_to_prepare(key)).then_some(key)
    }

    /// Has the second engine made ready once nothing has changed for a while.
    pub(super) fn prepare(&mut self, now: Duration) {
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

    pub(super) fn take_prepared(&mut self, drawn: Drawn) {
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
}
