//! Opening of an engine by its kind.

use super::{Engine, EngineError, EngineKind};
use crate::cpu::engine::CpuEngine;
use crate::gpu::engine::{open_generated, open_generic_interpreter, open_interpreter};
use crate::gpu::{AdapterPreference, Arithmetic, Gpu};
use crate::reference::engine::ReferenceEngine;

/// Opens an engine. GPU engines use hardware if there is any, else software Vulkan.
pub fn open(kind: EngineKind) -> Result<Box<dyn Engine>, EngineError> {
    open_with(kind, Arithmetic::Default)
}

/// Opens an engine with strict or default arithmetic. Strict engines produce identical bits. The CPU engine
/// is always strict.
pub fn open_with(kind: EngineKind, arithmetic: Arithmetic) -> Result<Box<dyn Engine>, EngineError> {
    Ok(match kind {
        EngineKind::Cpu => Box::new(CpuEngine::default()),
        EngineKind::Reference => Box::new(ReferenceEngine::default()),
        EngineKind::Interp | EngineKind::Wgsl => {
            open_on(kind, Gpu::open_with(AdapterPreference::Any, arithmetic)?)
        }
    })
}

/// Opens the interpreter on the given device, with kernels that run every scene. After [`Engine::warm_up`] no
/// pipeline is created, whatever is loaded and whatever is changed in these modes: lights and their shadows,
/// occlusion, fog, materials, normals. The images are those of [`EngineKind::Interp`], whose kernels contain
/// only what a scene needs.
///
/// Hardware skips the operations that a scene does not have. Software Vulkan runs all of them at each
/// instruction and is many times slower. The kernels have registers for 32 values and 8 points of a scene's
/// tape (materials: 16 values), and for [`sdfc_shaders::features::MAX_GENERIC_LIGHTS`] lights. A scene that needs
/// more gets specialized kernels.
pub fn open_generic(gpu: Gpu) -> Box<dyn Engine> {
    open_generic_interpreter(gpu)
}

/// Opens an engine of this kind on the given device. CPU engines do not use it.
pub fn open_on(kind: EngineKind, gpu: Gpu) -> Box<dyn Engine> {
    match kind {
        EngineKind::Cpu => Box::new(CpuEngine::default()),
        EngineKind::Reference => Box::new(ReferenceEngine::default()),
        EngineKind::Interp => open_interpreter(gpu),
        EngineKind::Wgsl => open_generated(gpu),
    }
}
