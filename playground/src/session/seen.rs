//! What a window shows of a session.

use super::{Knob, Session, Stage};
use crate::build::Source;
use crate::camera::Camera;
use crate::painter::{Picked, Picture, Show};
use crate::session::{Choice, Devices};
use crate::timeline::Timeline;
use sdfc_runtime::engine::EngineKind;
use sdfc_vm::bounds::Bounds;
use std::time::Duration;

/// What is known of the picture that is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// What drew it.
    pub engine: EngineKind,
    /// What that runs on.
    pub device: String,
    /// How fine it is.
    pub stage: Stage,
    /// Its width and height.
    pub size: [usize; 2],
    /// What it shows.
    pub show: Show,
    /// Reading the scene's files.
    pub reading: Duration,
    /// From text to programs.
    pub compiling: Duration,
    /// Bringing words and constants to the engine.
    pub loading: Duration,
    /// Drawing.
    pub drawing: Duration,
    /// How many instructions the programs have: that of the distance, and that of surfaces.
    pub instructions: [usize; 2],
    /// How many constants.
    pub constants: usize,
    /// Evaluations of the field for each ray.
    pub evaluations: f64,
    /// Cells that space was cut into.
    pub cells: u64,
    /// Pipelines that the engine created so far.
    pub pipelines: u64,
}

impl Session {
    /// The last good picture, and its number: another one has another number.
    pub fn seen(&self) -> Option<(&Picture, u64)> {
        let shown = self.shown.as_ref()?;
        Some((&shown.picture, self.version))
    }

    /// What is known of it.
    pub fn facts(&self) -> Option<Facts> {
        let shown = self.shown.as_ref()?;
        let scene = self.scene.as_ref()?;
        let module = &scene.opened.compiled.module;
        let stats = &shown.picture.frame.stats;
        let [reading, compiling] = self.built;
        let programs = [Some(&module.distance), module.surface.as_ref()];
        Some(Facts {
            engine: shown.engine,
            device: shown.picture.device.clone(),
            stage: shown.stage,
            size: shown.picture.size,
            show: shown.show,
            reading,
            compiling,
            loading: shown.times.loading,
            drawing: shown.times.drawing,
            instructions: programs.map(|p| p.map_or(0, |program| program.code.len())),
            constants: programs
                .iter()
                .flatten()
                .map(|program| program.pool.len() * 4)
                .sum(),
            evaluations: stats.evaluations as f64 / stats.rays().max(1) as f64,
            cells: stats.cells.made,
            pipelines: self.pipelines.get(&shown.engine).copied().unwrap_or(0),
        })
    }

    /// What is shown.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// All that there is to say about the scene, as `sdfc check` says it, or why it gives no picture;
    /// empty if nothing.
    pub fn report(&self) -> &str {
        match &self.problem {
            Some((_, problem)) if !self.broken => problem,
            _ => &self.report,
        }
    }

    /// Whether the scene, as it is now, gives no picture: then the one that is seen is an old one.
    pub fn is_broken(&self) -> bool {
        self.broken || self.problem.is_some()
    }

    /// Whether something is under way: a build, or a picture that is not yet as fine as it will be.
    pub fn is_busy(&self) -> bool {
        self.building.is_some() || self.rebuild || self.settled.is_some() || self.flight.is_some()
    }

    /// The picture that is being drawn is so fine.
    pub fn refining(&self) -> Option<Stage> {
        self.flight.as_ref().map(|flight| flight.stage)
    }

    /// The params.
    pub fn knobs(&self) -> &[Knob] {
        self.knobs.all()
    }

    /// The camera, once there is a picture.
    pub fn camera(&self) -> Option<&Camera> {
        self.camera.as_ref()
    }

    /// Whether the camera was moved away from the scene's own.
    pub fn has_own_view(&self) -> bool {
        self.own_view
    }

    /// The names of the scene's cameras, and which of them is shown.
    pub fn cameras(&self) -> (Vec<&str>, Option<&str>) {
        let names = self.scene.as_ref().map_or(Vec::new(), |scene| {
            let cameras = &scene.opened.compiled.module.settings.cameras;
            cameras.iter().map(|camera| camera.name.as_str()).collect()
        });
        let first = names.first().copied();
        (names, self.camera_name.as_deref().or(first))
    }

    /// The time, where the scene moves.
    pub fn timeline(&self) -> Option<&Timeline> {
        self.timeline.as_ref()
    }

    /// What is to be shown.
    pub fn show(&self) -> Show {
        self.show
    }

    /// What was found where something was picked.
    pub fn picked(&self) -> Option<&Picked> {
        self.picked.as_ref()
    }

    /// The box that the scene lies in, as far as is known.
    pub fn bounds(&self) -> Option<&Bounds> {
        let scene = self.scene.as_ref()?;
        Some(scene.opened.compiled.module.settings.space())
    }

    /// Which engine was asked for.
    pub fn choice(&self) -> Choice {
        self.tiers.choice()
    }

    /// What runs here.
    pub fn devices(&self) -> Devices {
        self.tiers.devices()
    }

    /// How long the same picture takes the engine that shows edits at once, and the one that has to be
    /// made ready, once both are known.
    pub fn compared(&self) -> Option<[Duration; 2]> {
        self.tiers.compared()
    }

    /// The engine that is being made ready, if one is.
    pub fn preparing(&self) -> Option<EngineKind> {
        if self.tiers.is_warming_up() {
            return Some(EngineKind::Interp);
        }
        self.tiers.preparing().map(|_| EngineKind::Wgsl)
    }

    /// Why engines are not used that failed.
    pub fn failures(&self) -> Vec<(EngineKind, &str)> {
        self.tiers.failures().collect()
    }

    /// What was last said: what was done, or why it was not.
    pub fn said(&self) -> Option<Result<&str, &str>> {
        let said = self.said.as_ref()?;
        Some(said.as_ref().map(String::as_str).map_err(String::as_str))
    }

    /// A text for the clipboard, once.
    pub fn take_exported(&mut self) -> Option<String> {
        self.exported.take()
    }
}
