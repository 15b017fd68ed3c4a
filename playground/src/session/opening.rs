//! Opening of another scene. The current scene remains until the other one is built, and after a failure.

use super::Session;
use super::params::ParamStates;
use crate::build::{BuildResult, SceneOrigin};

impl Session {
    /// Opens another scene. Without a current one, its files are followed even if it has errors.
    pub(super) fn open(&mut self, source: SceneOrigin) {
        let is_opening = self.opening.take().is_some();
        // A build in progress belongs to the previous scene, which may remain.
        let was_building = self.building.take().is_some();
        self.needs_rebuild |= was_building && !is_opening;
        if self.scene.is_none() {
            self.switch_to(source);
        } else if source != self.source {
            self.opening = Some(source);
        }
    }

    /// Takes the source of the scene to be opened if its build succeeded. Reports whether the build is that
    /// of the current scene.
    pub(super) fn finish_opening(&mut self, built: &BuildResult) -> bool {
        let Some(source) = self.opening.take() else {
            return true;
        };
        if built.scene.is_some() {
            self.switch_to(source);
            self.needs_rebuild = false;
            return true;
        }
        let path = source.path().display();
        let why = first_error(&built.report);
        self.message = Some(Err(format!("{path} was not opened: {why}")));
        false
    }

    fn switch_to(&mut self, source: SceneOrigin) {
        self.source = source;
        self.scene = None;
        self.params = ParamStates::default();
        self.camera = None;
        self.camera_name = None;
        self.is_camera_moved = false;
        self.timeline = None;
        self.picked = None;
        self.ray_costs.clear();
        self.needs_rebuild = true;
    }
}

/// Returns the first error of a report, with its place if it has one.
fn first_error(report: &str) -> String {
    let mut lines = report.lines();
    let error = lines.find(|line| line.starts_with("error")).unwrap_or("");
    let (_, error) = error.split_once(": ").unwrap_or(("", error));
    let place = lines
        .next()
        .and_then(|line| line.trim_start().strip_prefix("--> "));
    match place {
        Some(place) => format!("{error} ({place})"),
        None => error.to_owned(),
    }
}
