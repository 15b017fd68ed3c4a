//! sdfc by itself: cost of a frame by primitives, by pixels, on each engine, after an edit, and without
//! each pass.

mod edit;
mod engines;
mod passes;
mod primitives;
mod resolution;
mod scene;

use crate::clock::repeated;
use crate::contestant::sdfc::{EngineScene, pool};
use crate::report::{OutputFormat, note};
use clap::ValueEnum;
use sdfc_runtime::engine::{self, Engine, EngineKind};
use sdfc_runtime::settings::Overrides;
use std::path::PathBuf;

/// A part of the measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum SoloPart {
    /// Cost against the number of primitives.
    Primitives,
    /// Cost against the number of pixels.
    Resolution,
    /// The engines against each other.
    Engines,
    /// The time from an edit to a frame.
    Edit,
    /// The scene without each of the passes.
    Passes,
}

/// Options of the measurements.
pub(crate) struct SoloOptions {
    /// Parts to measure, or all if empty.
    pub(crate) parts: Vec<SoloPart>,
    /// Number of measured rounds.
    pub(crate) rounds: usize,
    /// Time after which no more rounds begin, in seconds.
    pub(crate) patience: f64,
    /// Maximum number of primitives.
    pub(crate) most: u32,
    /// Number of threads of the CPU engine.
    pub(crate) threads: usize,
    /// Engines of the tables about a single engine.
    pub(crate) engines: Vec<EngineKind>,
    /// Folder for charts.
    pub(crate) charts: Option<PathBuf>,
}

/// Runs the measurements and prints them.
pub(crate) fn run(options: &SoloOptions, format: OutputFormat) -> Result<(), String> {
    if let Some(folder) = &options.charts {
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("{} cannot be made: {error}", folder.display()))?;
    }
    let parts = match options.parts.as_slice() {
        [] => SoloPart::value_variants(),
        parts => parts,
    };
    pool(options.threads)?.install(|| {
        parts.iter().try_for_each(|part| match part {
            SoloPart::Primitives => primitives::run(options, format),
            SoloPart::Resolution => resolution::run(options, format),
            SoloPart::Engines => engines::run(options, format),
            SoloPart::Edit => edit::run(options, format),
            SoloPart::Passes => passes::run(options, format),
        })
    })
}

/// Opens those of the engines that are available on this machine.
fn available_engines(kinds: &[EngineKind]) -> Vec<Box<dyn Engine>> {
    let open = |kind: &EngineKind| match engine::open(*kind) {
        Ok(engine) => Some(engine),
        Err(error) => {
            note(&format!("engine {kind} is not measured: {error}"));
            None
        }
    };
    kinds.iter().filter_map(open).collect()
}

/// Times of loading a scene and of a frame of the loaded scene, in milliseconds.
struct LoadFrameTimes {
    load: f64,
    frame: f64,
}

/// Measures the loading and drawing of a scene.
fn measure_times(
    engine: &mut dyn Engine,
    compiled: &EngineScene,
    size: [u32; 2],
    options: &SoloOptions,
) -> Result<LoadFrameTimes, String> {
    let settings = compiled.settings(&Overrides {
        size: Some(size),
        ..Overrides::default()
    })?;
    let load = repeated(options.rounds, options.patience / 2.0, || {
        let loaded = engine.load(&compiled.scene_input());
        loaded.map_err(|error| error.to_string())
    })?;
    let frame = repeated(options.rounds, options.patience, || {
        let frame = engine.render(&settings, &|_| {});
        frame.map(drop).map_err(|error| error.to_string())
    })?;
    Ok(LoadFrameTimes { load, frame })
}

/// Returns an error if a frame took so long that a three times longer one exceeds the patience.
fn check_patience(frame_ms: f64, options: &SoloOptions) -> Result<(), String> {
    if frame_ms <= options.patience * 1e3 / 3.0 {
        return Ok(());
    }
    let seconds = frame_ms / 1e3;
    Err(format!(
        "a frame takes {seconds:.0} s, and `--patience` is {}: what costs more is left out",
        options.patience
    ))
}

/// Formats milliseconds for a table.
fn ms(time: f64) -> String {
    format!("{time:.1}")
}
