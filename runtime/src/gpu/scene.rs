//! A scene on a device, in the form of one engine: its WGSL functions and the buffers that they read.

use super::driver::{Buffer, BufferBinding, Gpu};
use super::kernel_cache::SceneWgsl;
use crate::engine::{EngineError, EngineKind, SceneInput};
use crate::render::{CellStats, RenderJob};
use sdfc_shaders::assemble::SceneFunction;
use sdfc_vm::program::Module;

/// The range of scenes that the kernels of an engine support.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KernelMode {
    /// One scene and one image: kernels contain only what these need.
    Specialized,
    /// All scenes and images, within the limits of the engine.
    Generic,
}

/// A scene on a device: its WGSL functions and the buffers they read.
pub(super) trait GpuScene: Sized {
    /// The engine that runs it.
    const KIND: EngineKind;
    /// Uploads a scene; `previous` is the scene that it replaces.
    fn load(
        gpu: &Gpu,
        scene: &SceneInput<'_>,
        kernel_mode: KernelMode,
        previous: Option<Self>,
    ) -> Result<Self, EngineError>;
    /// Uploads an empty scene in generic mode and creates all that scenes need, except the kernels of their
    /// images. `previous` is the scene that it replaces. Returns `None` where there is no generic mode.
    fn empty_generic(_gpu: &Gpu, _previous: Option<Self>) -> Result<Option<Self>, EngineError> {
        Ok(None)
    }
    /// Reports whether its functions are those of all scenes. [`GpuScene::variant`] is then
    /// [`super::kernel_cache::GENERIC_VARIANT`].
    fn is_generic(&self) -> bool {
        false
    }
    /// Writes the uniform values to the device after a live parameter or the time changed.
    fn update(
        &mut self,
        gpu: &Gpu,
        module: &Module,
        uniform_values: &[f64],
    ) -> Result<(), EngineError>;
    /// Prepares a render, or a query if there is no job. Reports whether buffers were replaced. The constants
    /// are those of the last load or update.
    fn prepare(&mut self, _gpu: &Gpu, _picture: Option<&RenderJob>) -> Result<bool, EngineError> {
        Ok(false)
    }
    /// Returns a number that changes whenever [`GpuScene::source`] or the bindings change.
    fn variant(&self) -> u32 {
        0
    }
    /// Returns the WGSL of these functions and of all they need.
    fn source(&self, functions: &[SceneFunction]) -> SceneWgsl;
    /// Returns the buffers declared by [`GpuScene::source`].
    fn buffers(&self) -> &[(BufferBinding, Buffer)];
    /// Returns the counts of the cells split for the last image.
    fn cells(&mut self, _gpu: &Gpu) -> Result<CellStats, EngineError> {
        Ok(CellStats::default())
    }
    /// Returns the number of loop iterations of one evaluation.
    fn iterations(&self, function: SceneFunction) -> usize;
}

/// Returns the WGSL of `unpainted_surface` for kernels whose functions can call it: the material in the frame
/// uniforms.
pub(super) fn default_material_wgsl(functions: &[SceneFunction]) -> &'static str {
    if functions.contains(&SceneFunction::Surface) {
        DEFAULT_MATERIAL_WGSL
    } else {
        ""
    }
}

const DEFAULT_MATERIAL_WGSL: &str = "fn unpainted_surface() -> Surface {
    return Surface(
        frame.albedo, frame.roughness, frame.emission, frame.metallic, vec3f(0.0), frame.id
    );
}

";
