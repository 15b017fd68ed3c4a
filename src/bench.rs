//! Speed against error: scenes drawn with many settings of the march, on each engine, timed, and compared
//! with the truth that `sdfc_runtime::reference` proves.
//!
//! [`measure_scene`](scene_report::measure_scene) measures a scene, [`BenchReport`] holds the measurements of
//! several, and [`html`] and [`markdown`] format it. One setting is changed at a time, relative to the
//! scene's own, plus a few combinations ([`variants`]). Errors are of one picture and the same on every
//! machine with the same arithmetic. Times are medians of pictures, each from a slightly different camera, so
//! that no results are reused between them.

mod chart;
pub(crate) mod charts;
mod findings;
pub(crate) mod html;
mod machine;
pub(crate) mod markdown;
mod measure;
mod pareto;
pub(crate) mod scene_report;
mod suite;
mod table;
pub(crate) mod tolerance;
pub(crate) mod variants;

use scene_report::SceneReport;
use serde::Serialize;
use suite::Suite;

/// Measurements, with their command and machine.
#[derive(Debug, Serialize)]
pub(crate) struct BenchReport {
    /// The command that reproduces it.
    pub(crate) command: String,
    /// Version of sdfc.
    pub(crate) version: &'static str,
    /// The day in UTC, year first.
    pub(crate) date: String,
    /// The processor and its cores.
    pub(crate) machine: String,
    /// The device of each engine.
    pub(crate) devices: Vec<EngineDevice>,
    /// Maximum number of pictures in the median of a time.
    pub(crate) rounds: usize,
    /// The requested error of settings, in pixels.
    pub(crate) tolerance: Option<f64>,
    /// Each scene.
    pub(crate) scenes: Vec<SceneReport>,
    /// Each setting over all scenes.
    pub(crate) suite: Suite,
}

/// An engine and its device.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct EngineDevice {
    /// Name of the engine.
    pub(crate) engine: &'static str,
    /// Description of the device, for people.
    pub(crate) device: String,
}

impl BenchReport {
    /// Returns the report of scenes measured now, on this machine, by this command.
    pub(crate) fn new(
        command: String,
        devices: Vec<EngineDevice>,
        options: &scene_report::MeasureOptions,
        scenes: Vec<SceneReport>,
    ) -> Self {
        Self {
            command,
            version: env!("CARGO_PKG_VERSION"),
            date: machine::today(),
            machine: machine::processor(),
            devices,
            rounds: options.rounds,
            tolerance: options.tolerance,
            suite: Suite::from_scenes(&scenes),
            scenes,
        }
    }
}
