//! Rendering on a GPU: runs the stages of `sdfc_shaders::assemble`, tile by tile. The size of tiles and the
//! evaluations per dispatch follow the time budget ([`super::work_budget`]). The image does not depend on how
//! it was divided.

use super::driver::{Batch, BoundKernel, BufferBinding, Extent};
use super::kernel_cache::KernelId;
use super::runner::SceneRunner;
use super::scene::GpuScene;
use super::tiles::TileRect;
use crate::engine::EngineError;
use crate::render::ray::{distance_from_camera, ends_at_far};
use crate::render::{Image, RenderJob, Status, Surface};
use sdfc_shaders::assemble::{
    BufferSlot, RenderStage, SceneFunction, invocation_count, queue_capacity, queue_header, stages,
};
use sdfc_shaders::beam;
use sdfc_shaders::features::{Features, MAX_GENERIC_LIGHTS, Mode};
use sdfc_shaders::layout::{self, OcclusionState, RayState, ShadowRayState};
use sdfc_shaders::marching::SHOWN;
use sdfc_shaders::normals;
use sdfc_shaders::shadow::DONE_FLAG;
use std::ops::Range;
use std::time::Instant;

/// Maximum size of all buffers of a tile together, in bytes.
const MAX_TILE_BYTES: u64 = 512 << 20;

/// The stages of a render with their kernels.
pub(super) struct StagePlan {
    stages: Vec<(RenderStage, KernelId)>,
    /// Cost per pixel of the most expensive stage that runs in a single dispatch, in evaluations of the
    /// distance.
    pub(super) weight: u32,
    /// Maximum number of pixels of a tile for which the device has memory.
    pub(super) max_tile_pixels: u64,
    /// Maximum number of evaluations in one invocation of the resumable stages.
    max_evaluations: u32,
    /// Minimum number of lights that its kernels declare.
    min_lights: u64,
}

impl StagePlan {
    /// Reports whether any stage evaluates materials.
    fn calls_surface(&self, features: &Features) -> bool {
        let functions = |(stage, _): &(RenderStage, KernelId)| stage.scene_functions(features);
        self.stages
            .iter()
            .flat_map(functions)
            .any(|function| function == SceneFunction::Surface)
    }

    fn has(&self, stage: RenderStage) -> bool {
        self.stages.iter().any(|(other, _)| *other == stage)
    }
}

/// Returns the maximum number of evaluations of the scene that nearly all invocations of a stage need.
fn typical_evaluations(stage: RenderStage, features: &Features) -> u32 {
    match stage {
        RenderStage::Normal => normals::taps(features.normals).len().max(1) as u32,
        RenderStage::RefineRoots => stage.evaluations(features) / 2,
        stage => stage.evaluations(features),
    }
}

/// Returns the cost of a function, in evaluations of the distance.
fn weight(function: SceneFunction) -> u32 {
    match function {
        SceneFunction::Distance => 1,
        SceneFunction::Gradient => 4,
        SceneFunction::Surface => 8,
    }
}

impl<S: GpuScene> SceneRunner<S> {
    /// Checks the limits and compiles missing kernels.
    pub(super) fn plan(&mut self, job: &RenderJob) -> Result<StagePlan, EngineError> {
        let features = &job.features;
        for stage in stages(features) {
            for function in stage.scene_functions(features) {
                self.check_loop_limit(function, stage.evaluations(features).max(1), stage.name())?;
            }
        }
        let scene = self.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
        let bindings: Vec<BufferBinding> = scene
            .gpu_scene
            .buffers()
            .iter()
            .map(|(binding, _)| *binding)
            .collect();
        let mut plan = StagePlan {
            stages: Vec::new(),
            weight: 1,
            max_tile_pixels: self.largest_tile(job),
            max_evaluations: self.max_evaluations(&scene.gpu_scene),
            min_lights: if features.generic {
                MAX_GENERIC_LIGHTS as u64
            } else {
                0
            },
        };
        let kernel_features = if features.generic {
            features.for_generic_kernels()
        } else {
            features.clone()
        };
        for stage in stages(features) {
            let functions = stage.scene_functions(&kernel_features);
            let source = || scene.gpu_scene.source(&functions);
            let variant = scene.gpu_scene.variant();
            let kernel = self.kernels.stage(
                &self.gpu,
                stage,
                &kernel_features,
                variant,
                source,
                &bindings,
            )?;
            plan.stages.push((stage, kernel));
            let heaviest = functions
                .iter()
                .map(|&function| weight(function))
                .max()
                .unwrap_or(0);
            plan.weight = plan
                .weight
                .max(heaviest * typical_evaluations(stage, features));
        }
        Ok(plan)
    }

    /// Returns the maximum number of pixels of a tile whose buffers fit the device.
    fn largest_tile(&self, job: &RenderJob) -> u64 {
        let limits = self.gpu.info().limits;
        let lights = job.lights.len() as u64;
        let binding = limits.storage_binding.min(limits.buffer);
        let [width, height] = job.size.map(u64::from);
        let mut pixels = width * height;
        let takes = |pixels: u64| BufferSlot::ALL.map(|slot| slot.bytes(pixels, lights));
        while pixels > 64
            && (takes(pixels).iter().any(|&bytes| bytes > binding)
                || takes(pixels).iter().sum::<u64>() > MAX_TILE_BYTES)
        {
            pixels /= 2;
        }
        pixels
    }

    /// Renders a tile: adds these passes to the sums of the passes before.
    pub(super) fn render_tile(
        &mut self,
        plan: &StagePlan,
        job: &RenderJob,
        inner_tile: TileRect,
        passes: Range<u32>,
        image: &mut Image,
    ) -> Result<(), EngineError> {
        let features = &job.features;
        // Edge lines between pixels need one more pixel than the tile that is kept.
        let tile = match features.mode {
            Mode::Edges => inner_tile.with_neighbours(job.size),
            _ => inner_tile,
        };
        let lights = job.lights.len() as u64;
        self.ensure_tile_buffers(plan, tile, lights)?;
        if let Some(buffer) = self.buffers.get(BufferSlot::Lights) {
            // Kernels that read the number of lights find it in the first one.
            let none = [layout::LightRecord::default()];
            let lights = if job.lights.is_empty() {
                &none
            } else {
                &*job.lights
            };
            self.gpu.write(&buffer, lights)?;
        }
        if let (1.., Some(buffer)) = (passes.start, self.buffers.get(BufferSlot::Colors)) {
            let mut sums = vec![[0.0; 4]; tile.pixels() as usize];
            for (tile_index, image_index) in pixel_indices(tile, inner_tile, image.width) {
                sums[tile_index] = image.color[image_index];
            }
            self.gpu.write(&buffer, &sums)?;
        }
        for sample in passes.clone() {
            self.run_stages(plan, features, &tile_uniforms(job, sample, tile), tile)?;
            self.read_back(plan, job, sample, [tile, inner_tile], image)?;
        }
        let colors: Vec<[f32; 4]> = self.read(BufferSlot::Colors, tile.pixels())?;
        for (tile_index, image_index) in pixel_indices(tile, inner_tile, image.width) {
            image.color[image_index] = colors[tile_index].map(|sum| sum / passes.end as f32);
        }
        Ok(())
    }

    /// Samples the field on a tile of a 2-D shape's plane.
    pub(super) fn sample_plane_tile(
        &mut self,
        plan: &StagePlan,
        job: &RenderJob,
        tile: TileRect,
        values: &mut [f32],
    ) -> Result<(), EngineError> {
        self.ensure_tile_buffers(plan, tile, 0)?;
        self.run_stages(plan, &job.features, &tile_uniforms(job, 0, tile), tile)?;
        let rays: Vec<RayState> = self.read(BufferSlot::Rays, tile.pixels())?;
        for (tile_index, image_index) in pixel_indices(tile, tile, job.size[0] as usize) {
            values[image_index] = rays[tile_index].field;
        }
        Ok(())
    }

    /// Ensures that a tile's buffers exist.
    fn ensure_tile_buffers(
        &mut self,
        plan: &StagePlan,
        tile: TileRect,
        lights: u64,
    ) -> Result<(), EngineError> {
        for &(_, kernel) in &plan.stages {
            for slot in self.kernels.get(kernel).slots().to_vec() {
                let lights = match slot {
                    BufferSlot::Lights => lights.max(plan.min_lights),
                    _ => lights,
                };
                self.buffers
                    .ensure(&self.gpu, slot, tile.pixels(), lights)?;
            }
        }
        Ok(())
    }

    /// Runs all stages once over a tile.
    fn run_stages(
        &mut self,
        plan: &StagePlan,
        features: &Features,
        uniforms: &layout::FrameUniforms,
        tile: TileRect,
    ) -> Result<(), EngineError> {
        let lights = u64::from(uniforms.light_count);
        self.write_uniforms(uniforms)?;
        let mut pending: Vec<(RenderStage, KernelId)> = Vec::new();
        for &(stage, kernel) in &plan.stages {
            if stage.is_resumable() {
                self.submit_pending(&mut pending, tile, lights)?;
                self.run_until_done(plan, stage, features, kernel, uniforms, tile)?;
            } else {
                pending.push((stage, kernel));
            }
        }
        self.submit_pending(&mut pending, tile, lights)
    }

    /// Submits the pending stages together, with one dispatch each.
    fn submit_pending(
        &mut self,
        pending: &mut Vec<(RenderStage, KernelId)>,
        tile: TileRect,
        lights: u64,
    ) -> Result<(), EngineError> {
        if pending.is_empty() {
            return Ok(());
        }
        let mut all_warm = true;
        let mut calls = Vec::new();
        for (stage, kernel) in pending.drain(..) {
            all_warm &= std::mem::replace(&mut self.kernels.get(kernel).is_warm, true);
            calls.push((
                self.bound_kernel(kernel)?,
                invocation_count(stage, tile.size, lights),
            ));
        }
        let mut batch: Batch<'_> = self.gpu.batch();
        for (call, invocations) in &calls {
            batch.dispatch(call, Extent::Line(*invocations))?;
        }
        let start = Instant::now();
        batch.submit_and_wait()?;
        if all_warm {
            self.budget.observe_tile(start.elapsed().as_secs_f64());
        }
        Ok(())
    }

    /// Dispatches a resumable stage until its queue of rays is empty.
    fn run_until_done(
        &mut self,
        plan: &StagePlan,
        stage: RenderStage,
        features: &Features,
        kernel: KernelId,
        uniforms: &layout::FrameUniforms,
        tile: TileRect,
    ) -> Result<(), EngineError> {
        let call = self.bound_kernel(kernel)?;
        let queue = self
            .buffers
            .get(BufferSlot::Queue)
            .ok_or(EngineError::NothingLoaded)?;
        let max_budget = match stage {
            RenderStage::Beam => plan.max_evaluations.min(beam::MAX_STEPS),
            RenderStage::Occlusion => plan.max_evaluations.min(features.occlusion.taps().max(1)),
            RenderStage::Shadow => plan.max_evaluations.min(uniforms.max_shadow_steps.max(1)),
            _ => plan.max_evaluations.min(uniforms.max_steps.max(1)),
        };
        let mut invocation_count =
            invocation_count(stage, tile.size, u64::from(uniforms.light_count));
        let (mut listed, mut half) = (0, 0);
        loop {
            let budget = self
                .budget
                .evaluations_per_invocation(invocation_count, max_budget);
            self.gpu
                .write(&queue, &queue_header(budget, listed, half))?;
            let warm = std::mem::replace(&mut self.kernels.get(kernel).is_warm, true);
            let mut batch = self.gpu.batch();
            batch.dispatch(&call, Extent::Line(invocation_count))?;
            let start = Instant::now();
            batch.submit_and_wait()?;
            let seconds = start.elapsed().as_secs_f64();
            let remaining = self
                .gpu
                .read_first::<u32>(&queue, 1)?
                .first()
                .copied()
                .unwrap_or(0);
            if warm {
                // Rays still queued used their whole budget; of the others nothing is certain.
                let budget = u64::from(budget);
                self.budget.observe(
                    u64::from(remaining) * budget,
                    invocation_count * budget,
                    seconds,
                );
            }
            if remaining == 0 {
                return Ok(());
            }
            invocation_count = u64::from(remaining);
            listed = remaining;
            half = 1 - half;
        }
    }

    /// Copies the results of a pass into the image.
    fn read_back(
        &self,
        plan: &StagePlan,
        job: &RenderJob,
        sample: u32,
        [tile, inner_tile]: [TileRect; 2],
        image: &mut Image,
    ) -> Result<(), EngineError> {
        let features = &job.features;
        let has_surface_program = self
            .scene
            .as_ref()
            .is_some_and(|scene| scene.has_surface_program);
        let pixels = tile.pixels();
        let rays: Vec<RayState> = self.read(BufferSlot::Rays, pixels)?;
        let pass = job.pass_uniforms(sample);
        for (tile_index, image_index) in pixel_indices(tile, inner_tile, image.width) {
            let at_far = || ends_at_far(&pass, pixel_coordinates(image_index, image.width));
            image
                .stats
                .count(Status::from_word(rays[tile_index].status), at_far);
        }
        image.stats.evaluations += self.evaluations(plan, job, [tile, inner_tile], &rays)?;
        if sample > 0 {
            return Ok(());
        }
        let normals: Option<Vec<[f32; 4]>> = plan
            .has(RenderStage::Normal)
            .then(|| self.read(BufferSlot::Normals, pixels))
            .transpose()?;
        let has_surfaces = plan.calls_surface(features);
        let surfaces: Option<Vec<Surface>> = has_surfaces
            .then(|| self.read(BufferSlot::Surfaces, pixels))
            .transpose()?;
        for (tile_index, image_index) in pixel_indices(tile, inner_tile, image.width) {
            let ray = &rays[tile_index];
            image.status[image_index] = Status::from_word(ray.status);
            image.steps[image_index] = ray.steps;
            if ray.status & SHOWN == 0 {
                continue;
            }
            let position = pixel_coordinates(image_index, image.width);
            image.depth[image_index] = distance_from_camera(&job.uniforms, position, ray.t);
            if let Some(normals) = &normals {
                let [x, y, z, _] = normals[tile_index];
                image.normal[image_index] = [x, y, z];
            }
            image.id[image_index] = match &surfaces {
                Some(surfaces) => surfaces[tile_index].id as u32,
                None if has_surface_program => 0,
                None => job.uniforms.id as u32,
            };
        }
        Ok(())
    }

    /// Returns the number of evaluations of the scene in a pass, for the pixels of the inner tile. Neighbours
    /// shared by two tiles count once, so the sum does not depend on the tiles.
    fn evaluations(
        &self,
        plan: &StagePlan,
        job: &RenderJob,
        [tile, inner_tile]: [TileRect; 2],
        rays: &[RayState],
    ) -> Result<u64, EngineError> {
        let features = &job.features;
        // Generic kernels evaluate materials where there are none; that is not counted.
        let has_surface_program = self
            .scene
            .as_ref()
            .is_some_and(|scene| scene.has_surface_program);
        let pixels = || pixel_indices(tile, inner_tile, 0).map(|(tile_index, _)| tile_index);
        let is_shown = |&pixel: &usize| rays[pixel].status & SHOWN != 0;
        let shown = pixels().filter(is_shown).count() as u64;
        let mut evaluations: u64 = pixels().map(|pixel| u64::from(rays[pixel].steps)).sum();
        for &(stage, _) in &plan.stages {
            evaluations += match stage {
                RenderStage::Surface if !has_surface_program => 0,
                // Additional evaluations for pixels with a doubtful gradient are not counted.
                RenderStage::Normal | RenderStage::Surface => {
                    shown * u64::from(typical_evaluations(stage, features))
                }
                RenderStage::Occlusion => {
                    let occlusion_rays: Vec<OcclusionState> =
                        self.read(BufferSlot::Occlusion, tile.pixels())?;
                    let shown = pixels().filter(is_shown);
                    shown.map(|pixel| occlusion_rays[pixel].steps as u64).sum()
                }
                RenderStage::Plane
                    if has_surface_program && stage.scene_functions(features).len() > 1 =>
                {
                    inner_tile.pixels()
                }
                RenderStage::Shadow => {
                    let lights = job.lights.len() as u64;
                    let steps: Vec<ShadowRayState> =
                        self.read(BufferSlot::Shadows, tile.pixels() * lights)?;
                    let per_light = steps.chunks_exact(rays.len());
                    per_light
                        .flat_map(|light| pixels().map(|pixel| light[pixel].steps & !DONE_FLAG))
                        .map(u64::from)
                        .sum()
                }
                RenderStage::Beam => {
                    let beams: Vec<layout::Beam> =
                        self.read(BufferSlot::Beams, invocation_count(stage, tile.size, 1))?;
                    let steps = beam_block_indices(tile, inner_tile)
                        .map(|block| u64::from(beams[block].steps));
                    steps.sum()
                }
                RenderStage::March | RenderStage::RefineRoots | RenderStage::Plane => 0,
                RenderStage::Shade | RenderStage::View | RenderStage::Edges => 0,
            };
        }
        Ok(evaluations)
    }

    fn write_uniforms(&self, uniforms: &layout::FrameUniforms) -> Result<(), EngineError> {
        let buffer = self
            .buffers
            .get(BufferSlot::Frame)
            .ok_or(EngineError::NothingLoaded)?;
        Ok(self.gpu.write(&buffer, std::slice::from_ref(uniforms))?)
    }

    /// Returns the kernel bound to the buffers of the image and the scene.
    fn bound_kernel(&mut self, kernel: KernelId) -> Result<BoundKernel, EngineError> {
        let scene = self.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
        let buffers = &self.buffers;
        Ok(self.kernels.get(kernel).bound_kernel(
            &self.gpu,
            buffers.generation,
            |slot| buffers.get(slot),
            scene.gpu_scene.buffers(),
        )?)
    }

    fn read<T: bytemuck::Pod>(&self, slot: BufferSlot, count: u64) -> Result<Vec<T>, EngineError> {
        let buffer = self.buffers.get(slot).ok_or(EngineError::NothingLoaded)?;
        Ok(self.gpu.read_first(&buffer, count as usize)?)
    }
}

/// Returns the uniforms of a pass over a tile.
fn tile_uniforms(job: &RenderJob, sample: u32, tile: TileRect) -> layout::FrameUniforms {
    let lights = job.lights.len() as u64;
    layout::FrameUniforms {
        tile: [tile.corner[0], tile.corner[1], tile.size[0], tile.size[1]],
        queue_capacity: queue_capacity(tile.pixels(), lights) as u32,
        ..job.pass_uniforms(sample)
    }
}

/// Returns the column and the row of the pixel with this index.
fn pixel_coordinates(index: usize, width: usize) -> [f32; 2] {
    [(index % width) as f32, (index / width) as f32]
}

/// Returns the pixels of the inner tile: their indices in the tile and in the whole image.
fn pixel_indices(
    tile: TileRect,
    inner_tile: TileRect,
    width: usize,
) -> impl Iterator<Item = (usize, usize)> {
    let [left, upper] = inner_tile.corner.map(|n| n as usize);
    let [columns, rows] = inner_tile.size.map(|n| n as usize);
    let row = tile.size[0] as usize;
    (0..rows)
        .flat_map(move |y| (0..columns).map(move |x| (y * row + x, (upper + y) * width + left + x)))
}

/// Returns the indices, among a tile's blocks of 8 × 8 pixels, of those that contain pixels of the inner tile.
fn beam_block_indices(tile: TileRect, inner_tile: TileRect) -> impl Iterator<Item = usize> {
    let row = tile.size[0].div_ceil(8) as usize;
    let [columns, rows] = inner_tile.size.map(|n| n.div_ceil(8) as usize);
    (0..rows).flat_map(move |y| (0..columns).map(move |x| y * row + x))
}
