//! The engine that runs a scene, and the meaning of its failures.

use crate::failure::Failure;
use crate::scene::OpenedScene;
use sdfc_runtime::engine::{self, Engine, EngineError, EngineKind};
use sdfc_runtime::gpu::Arithmetic;

/// The requested engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum EngineArg {
    /// A hardware GPU if there is one, else the CPU.
    #[default]
    Auto,
    /// Batches of points on all cores.
    Cpu,
    /// The program, interpreted on a GPU.
    Interp,
    /// Code generated for the scene, on a GPU.
    Wgsl,
    /// Hits proved by intervals in double precision: slow, and the measure of the other engines.
    Reference,
}

/// Flags for the arithmetic of engines.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct ArithmeticArgs {
    /// Forbid fusing and reordering of arithmetic: the same bits on every engine and device. Without
    /// Vulkan, a GPU takes longer.
    #[arg(long)]
    strict: bool,
}

impl ArithmeticArgs {
    pub(crate) fn arithmetic(self) -> Arithmetic {
        if self.strict {
            Arithmetic::Strict
        } else {
            Arithmetic::Default
        }
    }
}

/// Opens the requested engine.
pub(crate) fn open_choice(
    choice: EngineArg,
    arithmetic: ArithmeticArgs,
) -> Result<Box<dyn Engine>, Failure> {
    match choice {
        EngineArg::Auto => Ok(engine::open_auto_with(arithmetic.arithmetic())),
        EngineArg::Cpu => open(EngineKind::Cpu, arithmetic),
        EngineArg::Interp => open(EngineKind::Interp, arithmetic),
        EngineArg::Wgsl => open(EngineKind::Wgsl, arithmetic),
        EngineArg::Reference => open(EngineKind::Reference, arithmetic),
    }
}

/// Loads a scene into an engine.
pub(crate) fn load(engine: &mut dyn Engine, scene: &OpenedScene) -> Result<(), Failure> {
    let loaded = match engine.kind() {
        EngineKind::Wgsl => scene.loaded(),
        EngineKind::Cpu | EngineKind::Interp | EngineKind::Reference => {
            scene.loaded_scene_without_source()
        }
    };
    engine.load(&loaded).map_err(to_failure)
}

/// Opens an engine.
pub(crate) fn open(
    kind: EngineKind,
    arithmetic: ArithmeticArgs,
) -> Result<Box<dyn Engine>, Failure> {
    engine::open_with(kind, arithmetic.arithmetic()).map_err(|error| match to_failure(error) {
        Failure::Environment(problem) => Failure::Environment(format!(
            "engine {kind} cannot be opened: {problem}\nengine cpu needs none"
        )),
        other => other,
    })
}

/// Classifies an engine's failure: the device's fault, or the scene's.
pub(crate) fn to_failure(error: EngineError) -> Failure {
    match error {
        EngineError::Gpu(_) => Failure::Environment(error.to_string()),
        EngineError::TooLong { .. }
        | EngineError::Stopped
        | EngineError::NothingLoaded
        | EngineError::SceneMismatch => Failure::Input(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::failure::{ENVIRONMENT, INPUT};
    use sdfc_runtime::gpu::GpuError;

    #[test]
    fn devices_that_fail_are_the_machine_and_scenes_that_are_too_long_the_input() {
        let text = || "it broke".to_owned();
        for error in [
            GpuError::NoAdapter,
            GpuError::OutOfMemory(text()),
            GpuError::DeviceLost(text()),
            GpuError::Internal(text()),
            GpuError::Timeout {
                what: text(),
                after: std::time::Duration::from_secs(1),
            },
        ] {
            assert_eq!(to_failure(error.into()).code(), ENVIRONMENT);
        }
        let long = EngineError::TooLong {
            kind: EngineKind::Interp,
            what: "a picture",
            need: 2,
            allowed: 1,
        };
        assert_eq!(to_failure(long).code(), INPUT);
    }
}
