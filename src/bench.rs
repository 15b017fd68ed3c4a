//! Speed against error: scenes drawn with many settings of the march, on each engine, timed, and
//! compared with the truth that `sdfc_runtime::reference` proves.
//!
//! [`study`] measures a scene, [`Report`] holds what was measured of several, and [`html`] and
//! [`markdown`] show it. One knob is turned at a time, from the scene's own settings, and a few
//! combinations beside ([`knobs`]). Errors are of one picture and the same on every machine that
//! computes alike; times are medians, of pictures that are each seen from a slightly different place,
//! so that nothing is kept from one to the next.

mod chart;
mod front;
pub(crate) mod html;
pub(crate) mod knobs;
mod machine;
pub(crate) mod markdown;
mod measure;
pub(crate) mod study;
mod suite;
mod table;
pub(crate) mod tolerance;

use serde::Serialize;
use study::SceneReport;
use suite::Suite;

/// What was measured, of what, on what.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    /// The command that makes it again.
    pub(crate) command: String,
    /// The version of sdfc.
    pub(crate) version: &'static str,
    /// The day in UTC, year first.
    pub(crate) date: String,
    /// The processor and its cores.
    pub(crate) machine: String,
    /// What each engine ran on.
    pub(crate) devices: Vec<Device>,
    /// How many pictures a time is the median of, at most.
    pub(crate) rounds: usize,
    /// The error that settings were to keep, in pixels, if one was asked for.
    pub(crate) tolerance: Option<f64>,
    /// Each scene.
    pub(crate) scenes: Vec<SceneReport>,
    /// Each setting over all scenes.
    pub(crate) suite: Suite,
}

/// An engine and what it ran on.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Device {
    /// Its name.
    pub(crate) engine: &'static str,
    /// What it ran on, for people.
    pub(crate) device: String,
}

impl Report {
    /// Of these scenes, made now on this machine by this command.
    pub(crate) fn of(
        command: String,
        devices: Vec<Device>,
        options: &study::Options,
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
            suite: Suite::of(&scenes),
            scenes,
        }
    }
}
