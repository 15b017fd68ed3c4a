//! sdfc by itself: what a frame costs with the number of primitives and of pixels, on each engine,
//! after an edit, and without each of the passes.

mod edit;
mod engines;
mod passes;
mod primitives;
mod resolution;
mod scene;

use crate::clock::repeated;
use crate::contestant::ours::{Compiled, pool};
use crate::report::{Form, note};
use clap::ValueEnum;
use sdfc_runtime::engine::{self, Engine, EngineKind};
use sdfc_runtime::settings::Overrides;
use std::path::PathBuf;

/// A part of the measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Part {
    /// Cost against the number of primitives.
    Primitives,
    /// Cost against the number of pixels.
    Resolution,
    /// The engines against each other.
    Engines,
    /// The time from an edit to a frame.
    Edit,
    /// The same scene without each of the passes.
    Passes,
}

/// What is measured.
pub(crate) struct Options {
    /// Which parts; all of them if empty.
    pub(crate) parts: Vec<Part>,
    /// How many rounds count.
    pub(crate) rounds: usize,
    /// After how many seconds no more rounds are begun.
    pub(crate) patience: f64,
    /// The most primitives.
    pub(crate) most: u32,
    /// How many threads the CPU engine has.
    pub(crate) threads: usize,
    /// The engines of the tables that are about one engine.
    pub(crate) engines: Vec<EngineKind>,
    /// The folder for charts.
    pub(crate) charts: Option<PathBuf>,
}

/// Runs everything and prints it.
pub(crate) fn run(options: &Options, form: Form) -> Result<(), String> {
    if let Some(folder) = &options.charts {
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("{} cannot be made: {error}", folder.display()))?;
    }
    let chosen = match options.parts.as_slice() {
        [] => Part::value_variants(),
        some => some,
    };
    pool(options.threads)?.install(|| {
        chosen.iter().try_for_each(|part| match part {
            Part::Primitives => primitives::run(options, form),
            Part::Resolution => resolution::run(options, form),
            Part::Engines => engines::run(options, form),
            Part::Edit => edit::run(options, form),
            Part::Passes => passes::run(options, form),
        })
    })
}

/// The engines among these that this machine has.
fn present(kinds: &[EngineKind]) -> Vec<Box<dyn Engine>> {
    let open = |kind: &EngineKind| match engine::open(*kind) {
        Ok(engine) => Some(engine),
        Err(error) => {
            note(&format!("engine {kind} is not measured: {error}"));
            None
        }
    };
    kinds.iter().filter_map(open).collect()
}

/// The milliseconds of loading a scene, and of a frame of the scene that is loaded.
struct Times {
    load: f64,
    frame: f64,
}

/// Loads and draws a scene, again and again.
fn times(
    engine: &mut dyn Engine,
    compiled: &Compiled,
    size: [u32; 2],
    options: &Options,
) -> Result<Times, String> {
    let settings = compiled.settings(&Overrides {
        size: Some(size),
        ..Overrides::default()
    })?;
    let load = repeated(options.rounds, options.patience / 2.0, || {
        let loaded = engine.load(&compiled.loaded());
        loaded.map_err(|error| error.to_string())
    })?;
    let frame = repeated(options.rounds, options.patience, || {
        let frame = engine.render(&settings, &|_| {});
        frame.map(drop).map_err(|error| error.to_string())
    })?;
    Ok(Times { load, frame })
}

/// A problem if a frame took so long that one which costs three times as much is not waited for.
fn patient(frame_ms: f64, options: &Options) -> Result<(), String> {
    if frame_ms <= options.patience * 1e3 / 3.0 {
        return Ok(());
    }
    let seconds = frame_ms / 1e3;
    Err(format!(
        "a frame takes {seconds:.0} s, and `--patience` is {}: what costs more is left out",
        options.patience
    ))
}

/// Milliseconds in a table.
fn ms(time: f64) -> String {
    format!("{time:.1}")
}
