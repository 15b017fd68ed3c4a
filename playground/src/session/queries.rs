//! Read access to a session for front-ends.

use super::{ParamState, RefinementStage, Session};
use crate::build::SceneOrigin;
use crate::camera::OrbitCamera;
use crate::renderer::{PickResult, Picture, ViewMode};
use crate::session::{Devices, EngineChoice};
use crate::timeline::Timeline;
use sdfc_runtime::engine::EngineKind;
use sdfc_vm::bounds::Bounds;
use std::time::Duration;

/// Statistics of the displayed picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureFacts {
    /// Engine that drew the picture.
    pub engine: EngineKind,
    /// Device that the engine runs on.
    pub device: String,
    /// Refinement stage of the picture.
    pub stage: RefinementStage,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// View mode of the picture.
    pub show: ViewMode,
    /// Time for reading the scene's files.
    pub reading: Duration,
    /// Time for compiling the text into programs.
    pub compiling: Duration,
    /// Time for uploading programs and constants to the engine.
    pub loading: Duration,
    /// Time for drawing.
    pub drawing: Duration,
    /// Number of instructions of the distance program and of the surface program.
    pub instructions: [usize; 2],
    /// Number of constants.
    pub constants: usize,
    /// Mean number of field evaluations per ray.
    pub evaluations: f64,
    /// Number of cells that were built.
    pub cells: u64,
    /// Number of pipelines that the engine has created so far.
    pub pipelines: u64,
}

impl Session {
    /// Returns the last good picture and its version number.
    pub fn picture(&self) -> Option<(&Picture, u64)> {
        let shown = self.displayed.as_ref()?;
        Some((&shown.picture, self.picture_version))
    }

    /// Returns statistics of the displayed picture.
    pub fn facts(&self) -> Option<PictureFacts> {
        let shown = self.displayed.as_ref()?;
        let scene = self.scene.as_ref()?;
        let module = &scene.opened.compiled.module;
        let stats = &shown.picture.image.stats;
        let [reading, compiling] = self.build_times;
        let programs = [Some(&module.distance), module.surface.as_ref()];
        Some(PictureFacts {
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
            cells: stats.cells.count,
            pipelines: self.pipelines.get(&shown.engine).copied().unwrap_or(0),
        })
    }

    /// Returns the source of the scene.
    pub fn source(&self) -> &SceneOrigin {
        &self.source
    }

    /// Returns the diagnostics of the scene in the format of `sdfc check`, or the rendering error; empty
    /// if there are none.
    pub fn report(&self) -> &str {
        match &self.problem {
            Some((_, problem)) if !self.broken => problem,
            _ => &self.report,
        }
    }

    /// Reports whether the current scene gives no picture. The displayed picture is then an older one.
    pub fn is_broken(&self) -> bool {
        self.broken || self.problem.is_some()
    }

    /// Reports whether a build or a picture is in progress or pending.
    pub fn is_busy(&self) -> bool {
        self.building.is_some()
            || self.needs_rebuild
            || self.settles_at.is_some()
            || self.in_flight.is_some()
    }

    /// Reports whether camera, time or params moved so recently that refinement still waits.
    pub fn is_moving(&self, now: Duration) -> bool {
        self.rests_at(now).is_some()
    }

    /// Returns the refinement stage of the picture being drawn.
    pub fn drawing_stage(&self) -> Option<RefinementStage> {
        self.in_flight.as_ref().map(|in_flight| in_flight.stage)
    }

    /// Returns the params.
    pub fn params(&self) -> &[ParamState] {
        self.params.all()
    }

    /// Returns the camera, once a picture exists.
    pub fn camera(&self) -> Option<&OrbitCamera> {
        self.camera.as_ref()
    }

    /// Reports whether the camera was moved away from the scene's own camera.
    pub fn is_camera_moved(&self) -> bool {
        self.is_camera_moved
    }

    /// Returns the names of the scene's cameras and the selected one.
    pub fn cameras(&self) -> (Vec<&str>, Option<&str>) {
        let names = self.scene.as_ref().map_or(Vec::new(), |scene| {
            let cameras = &scene.opened.compiled.module.settings.cameras;
            cameras.iter().map(|camera| camera.name.as_str()).collect()
        });
        let first = names.first().copied();
        (names, self.camera_name.as_deref().or(first))
    }

    /// Returns the timeline of an animated scene.
    pub fn timeline(&self) -> Option<&Timeline> {
        self.timeline.as_ref()
    }

    /// Returns the requested view mode.
    pub fn show(&self) -> ViewMode {
        self.show
    }

    /// Returns the result of the last pick.
    pub fn picked(&self) -> Option<&PickResult> {
        self.picked.as_ref()
    }

    /// Returns the bounding box of the scene, as far as it is bounded.
    pub fn bounds(&self) -> Option<&Bounds> {
        let scene = self.scene.as_ref()?;
        Some(scene.opened.compiled.module.settings.clip_bounds())
    }

    /// Returns the requested engine.
    pub fn engine_choice(&self) -> EngineChoice {
        self.engine_selection.choice()
    }

    /// Returns the available devices.
    pub fn devices(&self) -> Devices {
        self.engine_selection.devices()
    }

    /// Returns the times of the same picture on the instant and on the prepared engine, once both were
    /// measured.
    pub fn compared_times(&self) -> Option<[Duration; 2]> {
        self.engine_selection.compared_times()
    }

    /// Returns the engine that is being prepared.
    pub fn preparing(&self) -> Option<EngineKind> {
        if self.engine_selection.is_warming_up() {
            return Some(EngineKind::Interp);
        }
        self.engine_selection.preparing().map(|_| EngineKind::Wgsl)
    }

    /// Returns the engines that failed, with the reasons.
    pub fn failures(&self) -> Vec<(EngineKind, &str)> {
        self.engine_selection.failures().collect()
    }

    /// Returns the last status message: a success or a failure.
    pub fn message(&self) -> Option<Result<&str, &str>> {
        let message = self.message.as_ref()?;
        Some(message.as_ref().map(String::as_str).map_err(String::as_str))
    }

    /// Takes the exported text for the clipboard.
    pub fn take_exported(&mut self) -> Option<String> {
        self.exported_text.take()
    }
}
