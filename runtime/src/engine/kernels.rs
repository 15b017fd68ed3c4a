//! Kernels, compiled when they are first needed and kept: by their text, so that what has the same
//! text is one pipeline whatever picture or scene asks for it.

use super::driver::SceneText;
use crate::gpu::{Access, Binding, BoundKernel, Buffer, Gpu, GpuError, Kernel, KernelSource};
use sdfc_shaders::assemble::{self, SceneFunction, SceneSource, Slot, Stage};
use sdfc_shaders::features::Features;
use std::collections::HashMap;

/// Kernels kept before those of earlier scenes are dropped.
const MOST: usize = 96;

/// All kernels of an engine.
#[derive(Default)]
pub(super) struct Kernels {
    entries: Vec<Entry>,
    by_text: HashMap<String, usize>,
    /// The kernels of the present scene's pictures.
    stages: HashMap<(Stage, Features, u32), usize>,
    /// Those that ask one function of it.
    queries: HashMap<(SceneFunction, u32), usize>,
}

/// The variant of scenes whose functions and bindings are those of all others of this variant: their
/// kernels are kept when another scene takes a scene's place.
pub(super) const GENERAL: u32 = u32::MAX;

/// A kernel and what it is run with.
pub(super) struct Entry {
    kernel: Kernel,
    /// The picture's buffers that it uses.
    slots: Vec<Slot>,
    /// Whether it calls the scene.
    scene: bool,
    /// Whether it ran before. A driver may compile in the first run.
    pub(super) warm: bool,
    /// With the buffers of this generation.
    bound: Option<(u64, BoundKernel)>,
}

/// Where an [`Entry`] is.
#[derive(Clone, Copy, Debug)]
pub(super) struct KernelId(usize);

impl Kernels {
    /// Another scene takes the place of the present one.
    pub(super) fn forget_scene(&mut self) {
        self.stages.retain(|(_, _, variant), _| *variant == GENERAL);
        self.queries.retain(|(_, variant), _| *variant == GENERAL);
        if self.entries.len() <= MOST {
            return;
        }
        // General kernels stay, under new numbers.
        let mut kept: Vec<usize> = self.stages.values().copied().collect();
        kept.extend(self.queries.values());
        kept.sort_unstable();
        kept.dedup();
        let mut at = 0..;
        self.entries
            .retain(|_| at.next().is_some_and(|at| kept.binary_search(&at).is_ok()));
        let place = |at: &usize| kept.binary_search(at).ok();
        self.by_text
            .retain(|_, at| place(at).map(|new| *at = new).is_some());
        for at in self.stages.values_mut().chain(self.queries.values_mut()) {
            *at = place(at).unwrap_or(0);
        }
    }

    pub(super) fn get(&mut self, id: KernelId) -> &mut Entry {
        &mut self.entries[id.0]
    }

    /// The kernel of a stage, with the scene functions that it calls; `variant` names their text and
    /// bindings among those of the present scene.
    pub(super) fn stage(
        &mut self,
        gpu: &Gpu,
        stage: Stage,
        features: &Features,
        variant: u32,
        scene: impl FnOnce() -> SceneText,
        scene_bindings: &[Binding],
    ) -> Result<KernelId, GpuError> {
        let key = (stage, features.clone(), variant);
        if let Some(&at) = self.stages.get(&key) {
            return Ok(KernelId(at));
        }
        let calls_scene = !stage.scene_functions(features).is_empty();
        let scene = if calls_scene {
            scene()
        } else {
            SceneText::default()
        };
        let source = SceneSource {
            text: &scene.text,
            calls: &scene.calls,
        };
        let kernel = assemble::kernel(stage, features, &source);
        let mut bindings: Vec<Binding> = kernel.bindings.iter().map(binding).collect();
        if calls_scene {
            bindings.extend(scene_bindings);
        }
        let slots = kernel.bindings.iter().map(|(slot, _)| *slot).collect();
        let at = self.compile(
            gpu,
            kernel.label,
            kernel.text,
            &bindings,
            slots,
            calls_scene,
        )?;
        self.stages.insert(key, at.0);
        Ok(at)
    }

    /// The kernel that asks one function of a scene of this variant.
    pub(super) fn query(
        &mut self,
        function: SceneFunction,
        variant: u32,
        make: impl FnOnce(&mut Self) -> Result<KernelId, GpuError>,
    ) -> Result<KernelId, GpuError> {
        if let Some(&at) = self.queries.get(&(function, variant)) {
            return Ok(KernelId(at));
        }
        let made = make(self)?;
        self.queries.insert((function, variant), made.0);
        Ok(made)
    }

    /// The kernel of this text.
    pub(super) fn compile(
        &mut self,
        gpu: &Gpu,
        label: &str,
        text: String,
        bindings: &[Binding],
        slots: Vec<Slot>,
        scene: bool,
    ) -> Result<KernelId, GpuError> {
        if let Some(&at) = self.by_text.get(&text) {
            return Ok(KernelId(at));
        }
        let kernel = gpu.kernel(&KernelSource {
            label,
            wgsl: &text,
            entry: "main",
            bindings,
        })?;
        self.entries.push(Entry {
            kernel,
            slots,
            scene,
            warm: false,
            bound: None,
        });
        self.by_text.insert(text, self.entries.len() - 1);
        Ok(KernelId(self.entries.len() - 1))
    }
}

impl Entry {
    /// The picture's buffers that it uses.
    pub(super) fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// The kernel with its buffers; `generation` names all buffers there are.
    pub(super) fn bound(
        &mut self,
        gpu: &Gpu,
        generation: u64,
        picture: impl Fn(Slot) -> Option<Buffer>,
        scene: &[(Binding, Buffer)],
    ) -> Result<BoundKernel, GpuError> {
        if let Some((of, bound)) = &self.bound
            && *of == generation
        {
            return Ok(bound.clone());
        }
        let filled = |&slot: &Slot| picture(slot).map(|buffer| (slot as u32, buffer));
        let mut buffers: Vec<(u32, Buffer)> = self.slots.iter().filter_map(filled).collect();
        if self.scene {
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

    /// The kernel with buffers of its own.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        buffers: &[(u32, &Buffer)],
    ) -> Result<BoundKernel, GpuError> {
        gpu.bind(&self.kernel, buffers)
    }
}

fn binding((slot, access): &(Slot, assemble::Access)) -> Binding {
    let access = match access {
        assemble::Access::Uniform => Access::Uniform,
        assemble::Access::Read => Access::StorageRead,
        assemble::Access::ReadWrite => Access::StorageReadWrite,
    };
    Binding {
        slot: *slot as u32,
        access,
    }
}
