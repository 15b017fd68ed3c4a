//! Which engine runs a scene, and what its failures mean.

use crate::failure::Failure;
use crate::scene::Opened;
use sdfc_runtime::engine::{self, Engine, EngineError, EngineKind};
use sdfc_runtime::gpu::Arithmetic;

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

/// What engines may do to arithmetic.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct Tier {
    /// Do all arithmetic as it is written: the same bits on every engine and device. Without Vulkan a
    /// GPU takes longer for it.
    #[arg(long)]
    strict: bool,
}

impl Tier {
    pub(crate) fn arithmetic(self) -> Arithmetic {
        if self.strict {
            Arithmetic::Strict
        } else {
            Arithmetic::Default
        }
    }
}

/// Opens the engine that is asked for.
pub(crate) fn chosen(choice: Choice, tier: Tier) -> Result<Box<dyn Engine>, Failure> {
    match choice {
        Choice::Auto => Ok(engine::open_auto_with(tier.arithmetic())),
        Choice::Cpu => open(EngineKind::Cpu, tier),
        Choice::Interp => open(EngineKind::Interp, tier),
        Choice::Wgsl => open(EngineKind::Wgsl, tier),
        Choice::Reference => open(EngineKind::Reference, tier),
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
pub(crate) fn open(kind: EngineKind, tier: Tier) -> Result<Box<dyn Engine>, Failure> {
    engine::open_with(kind, tier.arithmetic()).map_err(|error| match failed(error) {
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
        EngineError::TooLong { .. }
        | EngineError::Stopped
        | EngineError::NothingLoaded
        | EngineError::AnotherScene => Failure::Input(error.to_string()),
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
            assert_eq!(failed(error.into()).code(), ENVIRONMENT);
        }
        let long = EngineError::TooLong {
            kind: EngineKind::Interp,
            what: "a picture",
            need: 2,
            allowed: 1,
        };
        assert_eq!(failed(long).code(), INPUT);
    }
}
