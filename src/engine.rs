//! Which engine runs a scene, and what its failures mean.

use crate::failure::Failure;
use crate::scene::Opened;
use sdfc_runtime::engine::{self, Engine, EngineError, EngineKind};

/// The engine that is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Choice {
    /// A hardware GPU if there is one, else the CPU.
    #[default]
    Auto,
    /// Batches of points on all cores.
    Cpu,
    /// The program, interpreted on a GPU.
    Interp,
    /// Code generated for the scene, on a GPU.
    Wgsl,
    /// Proved by intervals in double precision, slowly: what others are measured by.
    Reference,
}

/// Opens the engine that is asked for.
pub(crate) fn chosen(choice: Choice) -> Result<Box<dyn Engine>, Failure> {
    match choice {
        Choice::Auto => Ok(engine::open_auto()),
        Choice::Cpu => open(EngineKind::Cpu),
        Choice::Interp => open(EngineKind::Interp),
        Choice::Wgsl => open(EngineKind::Wgsl),
        Choice::Reference => open(EngineKind::Reference),
    }
}

/// Gives a scene to an engine.
pub(crate) fn load(engine: &mut dyn Engine, scene: &Opened) -> Result<(), Failure> {
    let loaded = match engine.kind() {
        EngineKind::Wgsl => scene.loaded(),
        EngineKind::Cpu | EngineKind::Interp | EngineKind::Reference => {
            scene.loaded_without_source()
        }
    };
    engine.load(&loaded).map_err(failed)
}

/// Opens an engine.
pub(crate) fn open(kind: EngineKind) -> Result<Box<dyn Engine>, Failure> {
    engine::open(kind).map_err(|error| match failed(error) {
        Failure::Environment(problem) => Failure::Environment(format!(
            "engine {kind} cannot be opened: {problem}\nengine cpu needs none"
        )),
        other => other,
    })
}

/// What an engine's failure is to the user: the device's fault, or the scene's.
pub(crate) fn failed(error: EngineError) -> Failure {
    match error {
        EngineError::Gpu(_) => Failure::Environment(error.to_string()),
        EngineError::TooLong { .. } | EngineError::NothingLoaded | EngineError::AnotherScene => {
            Failure::Input(error.to_string())
        }
    }
}
