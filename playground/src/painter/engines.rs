//! How engines are opened for editing.

use super::Opener;
use sdfc_runtime::engine::{self, Engine, EngineError, EngineKind};
use sdfc_runtime::frame::Mode;
use sdfc_runtime::gpu::{DeviceKind, Gpu, Preference};

/// Opens engines so that edits do not wait: on hardware the interpreter has kernels that run every
/// scene, made beforehand, so that no edit makes a pipeline. Software devices run all operations of a
/// kernel at each instruction; there its kernels have only what a scene needs.
pub fn engines() -> Opener {
    Box::new(|kind| match kind {
        EngineKind::Interp => interpreter(),
        _ => engine::open(kind),
    })
}

fn interpreter() -> Result<Box<dyn Engine>, EngineError> {
    let gpu = Gpu::open(Preference::Any)?;
    if gpu.info().kind == DeviceKind::Software {
        return Ok(engine::on(EngineKind::Interp, gpu));
    }
    let mut general = engine::general(gpu);
    general.warm_up(&[Mode::Shaded])?;
    Ok(general)
}
