//! Opens engines for editing.

use super::EngineOpener;
use sdfc_runtime::engine::{self, Engine, EngineError, EngineKind};
use sdfc_runtime::gpu::{AdapterPreference, DeviceKind, Gpu};
use sdfc_runtime::render::Mode;

/// Returns an opener for engines that draw edits without delay. On hardware the interpreter gets
/// precompiled kernels that run every scene, so edits create no pipelines. Software devices execute all
/// operations of a kernel at each instruction, so their kernels contain only the operations of the scene.
pub fn editing_engines() -> EngineOpener {
    Box::new(|kind| match kind {
        EngineKind::Interp => interpreter(),
        _ => engine::open(kind),
    })
}

fn interpreter() -> Result<Box<dyn Engine>, EngineError> {
    let gpu = Gpu::open(AdapterPreference::Any)?;
    if gpu.info().kind == DeviceKind::Software {
        return Ok(engine::open_on(EngineKind::Interp, gpu));
    }
    let mut general = engine::open_generic(gpu);
    general.warm_up(&[Mode::Shaded])?;
    Ok(general)
}
