//! Kernels, compiled on first use and cached by their text: the same text is one pipeline, whatever image or
//! scene needs it.

use super::driver::{
    BindingAccess, BoundKernel, Buffer, BufferBinding, Gpu, GpuError, Kernel, KernelSource,
};
use sdfc_shaders::assemble::{self, BufferSlot, RenderStage, SceneFunction, SceneSource};
use sdfc_shaders::features::Features;
use std::collections::HashMap;

/// Maximum number of kernels kept when a scene is replaced.
const MAX_KERNELS: usize = 96;

/// WGSL that declares the scene functions.
#[derive(Clone, Debug, Default)]
pub(super) struct SceneWgsl {
    /// The functions and all declarations they need, including the buffers they read, but neither the prelude
    /// nor the struct `Surface`.
    pub(super) text: String,
    /// The functions of the prelude that it calls.
    pub(super) calls: Vec<&'static str>,
}

/// All kernels of an engine.
#[derive(Default)]
pub(super) struct Kernels {
    entries: Vec<KernelEntry>,
    by_text: HashMap<String, usize>,
    /// The kernels of the current scene's images.
    stages: HashMap<(RenderStage, Features, u32), usize>,
    /// The kernels that evaluate one function of the scene.
    queries: HashMap<(SceneFunction, u32), usize>,
}

/// The variant of scenes that all have the same functions and bindings. Kernels of this variant are kept when
/// the scene is replaced.
pub(super) const GENERIC_VARIANT: u32 = u32::MAX;

/// A kernel and its bindings.
pub(super) struct KernelEntry {
    kernel: Kernel,
    /// The image buffers that it uses.
    slots: Vec<BufferSlot>,
    /// Set if it calls the scene.
    calls_scene: bool,
    /// Set if it ran before. A driver may compile in the first run.
    pub(super) is_warm: bool,
    /// The kernel bound to the buffers of a generation.
    bound: Option<(u64, BoundKernel)>,
}

/// Index of a [`KernelEntry`].
#[derive(Clone, Copy, Debug)]
pub(super) struct KernelId(usize);

impl Kernels {
    /// Removes the kernels of the current scene.
    pub(super) fn drop_scene_kernels(&mut self) {
        self.stages
            .retain(|(_, _, variant), _| *variant == GENERIC_VARIANT);
        self.queries
            .retain(|(_, variant), _| *variant == GENERIC_VARIANT);
        if self.entries.len() <= MAX_KERNELS {
            return;
        }
        // Generic kernels stay, under new indices.
        let mut retained: Vec<usize> = self.stages.values().copied().collect();
        retained.extend(self.queries.values());
        retained.sort_unstable();
        retained.dedup();
        let mut numbers = 0..;
        self.entries.retain(|_| {
            numbers
                .next()
                .is_some_and(|index| retained.binary_search(&index).is_ok())
        });
        let new_index = |index: &usize| retained.binary_search(index).ok();
        self.by_text
            .retain(|_, index| new_index(index).map(|new| *index = new).is_some());
        for index in self.stages.values_mut().chain(self.queries.values_mut()) {
            *index = new_index(index).unwrap_or(0);
        }
    }

    pub(super) fn get(&mut self, id: KernelId) -> &mut KernelEntry {
        &mut self.entries[id.0]
    }

    /// Returns the kernel of a stage, with the scene functions that it calls. `variant` identifies their text
    /// and bindings among those of the current scene.
    pub(super) fn stage(
        &mut self,
        gpu: &Gpu,
        stage: RenderStage,
        features: &Features,
        variant: u32,
        scene: impl FnOnce() -> SceneWgsl,
        scene_bindings: &[BufferBinding],
    ) -> Result<KernelId, GpuError> {
        let key = (stage, features.clone(), variant);
        if let Some(&index) = self.stages.get(&key) {
            return Ok(KernelId(index));
        }
        let functions = stage.scene_functions(features);
        let scene = if functions.is_empty() {
            SceneWgsl::default()
        } else {
            scene()
        };
        let source = SceneSource {
            text: &scene.text,
            calls: &scene.calls,
        };
        let kernel = assemble::kernel(stage, features, &source);
        let mut bindings: Vec<BufferBinding> = kernel.bindings.iter().map(binding).collect();
        if !functions.is_empty() {
            bindings.extend(scene_bindings);
        }
        let slots = kernel.bindings.iter().map(|(slot, _)| *slot).collect();
        let id = self.compile(gpu, kernel.label, kernel.text, &bindings, slots, &functions)?;
        self.stages.insert(key, id.0);
        Ok(id)
    }

    /// Returns the kernel that evaluates one function of a scene of this variant.
    pub(super) fn query(
        &mut self,
        function: SceneFunction,
        variant: u32,
        make: impl FnOnce(&mut Self) -> Result<KernelId, GpuError>,
    ) -> Result<KernelId, GpuError> {
        if let Some(&index) = self.queries.get(&(function, variant)) {
            return Ok(KernelId(index));
        }
        let id = make(self)?;
        self.queries.insert((function, variant), id.0);
        Ok(id)
    }

    /// Returns the kernel with this text, compiling it if it is new. `functions` are those of the scene that it
    /// calls. Materials are evaluated as written: patterns made of large numbers, such as
    /// `fract(sin(x) * 43758.5)`, change wholly where a product is fused with a sum.
    pub(super) fn compile(
        &mut self,
        gpu: &Gpu,
        label: &str,
        text: String,
        bindings: &[BufferBinding],
        slots: Vec<BufferSlot>,
        functions: &[SceneFunction],
    ) -> Result<KernelId, GpuError> {
        if let Some(&index) = self.by_text.get(&text) {
            return Ok(KernelId(index));
        }
        let kernel = gpu.kernel(&KernelSource {
            label,
            wgsl: &text,
            entry: "main",
            bindings,
            as_written: functions.contains(&SceneFunction::Surface),
        })?;
        self.entries.push(KernelEntry {
            kernel,
            slots,
            calls_scene: !functions.is_empty(),
            is_warm: false,
            bound: None,
        });
        self.by_text.insert(text, self.entries.len() - 1);
        Ok(KernelId(self.entries.len() - 1))
    }
}

impl KernelEntry {
    /// Returns the image buffers that the kernel uses.
    pub(super) fn slots(&self) -> &[BufferSlot] {
        &self.slots
    }

    /// Returns the kernel bound to its buffers. `generation` identifies the current set of buffers.
    pub(super) fn bound_kernel(
        &mut self,
        gpu: &Gpu,
        generation: u64,
        image_buffer: impl Fn(BufferSlot) -> Option<Buffer>,
        scene: &[(BufferBinding, Buffer)],
    ) -> Result<BoundKernel, GpuError> {
        if let Some((bound_generation, bound)) = &self.bound
            && *bound_generation == generation
        {
            return Ok(bound.clone());
        }
        let filled = |&slot: &BufferSlot| image_buffer(slot).map(|buffer| (slot as u32, buffer));
        let mut buffers: Vec<(u32, Buffer)> = self.slots.iter().filter_map(filled).collect();
        if self.calls_scene {
            buffers.extend(
                scene
                    .iter()
                    .map(|(binding, buffer)| (binding.slot, buffer.clone())),
            );
        }
        let borrowed: Vec<(u32, &Buffer)> = buffers.iter().map(|(slot, b)| (*slot, b)).collect();
        let bound = gpu.bind(&self.kernel, &borrowed)?;
        self.bound = Some((generation, bound.clone()));
        Ok(bound)
    }

    /// Binds the kernel to the given buffers.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        buffers: &[(u32, &Buffer)],
    ) -> Result<BoundKernel, GpuError> {
        gpu.bind(&self.kernel, buffers)
    }
}

fn binding((slot, access): &(BufferSlot, assemble::BufferAccess)) -> BufferBinding {
    let access = match access {
        assemble::BufferAccess::Uniform => BindingAccess::Uniform,
        assemble::BufferAccess::Read => BindingAccess::StorageRead,
        assemble::BufferAccess::ReadWrite => BindingAccess::StorageReadWrite,
    };
    BufferBinding {
        slot: *slot as u32,
        access,
    }
}
