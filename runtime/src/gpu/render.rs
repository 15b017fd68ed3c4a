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
use crate::render::{Image, RenderJob, Stats, Status, Surface};
use rayon::prelude::*;
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
            for row in pixel_rows([tile, inner_tile], image.width) {
                let [from, to] = [row.image_start, row.tile_start];
                sums[to..to + row.length].copy_from_slice(&image.color[from..from + row.length]);
            }
            self.gpu.write(&buffer, &sums)?;
        }
        for sample in passes.clone() {
            let start = Instant::now();
            self.run_stages(plan, features, &tile_uniforms(job, sample, tile), tile)?;
            let seconds = start.elapsed().as_secs_f64();
            let stats = self.read_back(plan, job, sample, [tile, inner_tile], image)?;
            self.budget.observe_at_least(stats.evaluations, seconds);
            image.stats = image.stats.plus(stats);
        }
        let (width, tiles) = (image.width, [tile, inner_tile]);
        let passes = passes.end as f32;
        self.with_values(
            BufferSlot::Colors,
            tile.pixels(),
            |colors: &[[f32; 4]]| {
                set_pixels(&mut image.color, width, tiles, |pixel, _, color| {
                    *color = colors[pixel].map(|sum| sum / passes);
                });
            },
        )
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
        let width = job.size[0] as usize;
        self.with_values(BufferSlot::Rays, tile.pixels(), |rays: &[RayState]| {
            set_pixels(values, width, [tile, tile], |pixel, _, value| {
                *value = rays[pixel].field;
            });
        })
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

    /// Copies the results of a pass into the image. Returns its counts.
    fn read_back(
        &self,
        plan: &StagePlan,
        job: &RenderJob,
        sample: u32,
        tiles: [TileRect; 2],
        image: &mut Image,
    ) -> Result<Stats, EngineError> {
        let width = image.width;
        let pixels = tiles[0].pixels();
        let pass = job.pass_uniforms(sample);
        let (statuses, mut stats) =
            self.with_values(BufferSlot::Rays, pixels, |rays: &[RayState]| {
                if sample == 0 {
                    set_pixels(&mut image.status, width, tiles, |pixel, _, status| {
                        *status = Status::from_word(rays[pixel].status);
                    });
                    set_pixels(&mut image.steps, width, tiles, |pixel, _, steps| {
                        *steps = rays[pixel].steps;
                    });
                    set_pixels(&mut image.depth, width, tiles, |pixel, index, depth| {
                        if rays[pixel].status & SHOWN != 0 {
                            let position = pixel_coordinates(index, width);
                            *depth = distance_from_camera(&job.uniforms, position, rays[pixel].t);
                        }
                    });
                }
                let statuses: Vec<u32> = rays.par_iter().map(|ray| ray.status).collect();
                (statuses, count_rays(job, &pass, rays, width, tiles))
            })?;
        let is_shown = |pixel: usize| statuses[pixel] & SHOWN != 0;
        stats.evaluations += self.evaluations(plan, job, tiles, &is_shown)?;
        if sample > 0 {
            return Ok(stats);
        }
        if plan.has(RenderStage::Normal) {
            self.with_values(BufferSlot::Normals, pixels, |normals: &[[f32; 4]]| {
                set_pixels(&mut image.normal, width, tiles, |pixel, _, normal| {
                    if is_shown(pixel) {
                        let [x, y, z, _] = normals[pixel];
                        *normal = [x, y, z];
                    }
                });
            })?;
        }
        if plan.calls_surface(&job.features) {
            self.with_values(BufferSlot::Surfaces, pixels, |surfaces: &[Surface]| {
                set_pixels(&mut image.id, width, tiles, |pixel, _, id| {
                    if is_shown(pixel) {
                        *id = surfaces[pixel].id as u32;
                    }
                });
            })?;
        } else {
            let only = match self.has_surface_program() {
                true => 0,
                false => job.uniforms.id as u32,
            };
            set_pixels(&mut image.id, width, tiles, |pixel, _, id| {
                if is_shown(pixel) {
                    *id = only;
                }
            });
        }
        Ok(stats)
    }

    /// Reports whether the scene has materials. Generic kernels evaluate them where there are none.
    fn has_surface_program(&self) -> bool {
        let scene = self.scene.as_ref();
        scene.is_some_and(|scene| scene.has_surface_program)
    }

    /// Returns the number of evaluations of the scene in a pass besides those of the march, for the pixels of
    /// the inner tile. Neighbours shared by two tiles count once, so the sum does not depend on the tiles.
    fn evaluations(
        &self,
        plan: &StagePlan,
        job: &RenderJob,
        tiles: [TileRect; 2],
        is_shown: &(impl Fn(usize) -> bool + Sync),
    ) -> Result<u64, EngineError> {
        let features = &job.features;
        let pixels = tiles[0].pixels();
        let shown = sum_pixels(tiles, |pixel| u64::from(is_shown(pixel)));
        let mut evaluations = 0;
        for &(stage, _) in &plan.stages {
            evaluations += match stage {
                RenderStage::Surface if !self.has_surface_program() => 0,
                // Additional evaluations for pixels with a doubtful gradient are not counted.
                RenderStage::Normal | RenderStage::Surface => {
                    shown * u64::from(typical_evaluations(stage, features))
                }
                RenderStage::Occlusion => {
                    let slot = BufferSlot::Occlusion;
                    self.with_values(slot, pixels, |rays: &[OcclusionState]| {
                        sum_pixels(tiles, |pixel| match is_shown(pixel) {
                            true => rays[pixel].steps as u64,
                            false => 0,
                        })
                    })?
                }
                RenderStage::Plane
                    if self.has_surface_program() && stage.scene_functions(features).len() > 1 =>
                {
                    tiles[1].pixels()
                }
                RenderStage::Shadow => {
                    let count = pixels * job.lights.len() as u64;
                    self.with_values(BufferSlot::Shadows, count, |rays: &[ShadowRayState]| {
                        let per_light = rays.chunks_exact(pixels as usize);
                        let steps = per_light.map(|light| {
                            sum_pixels(tiles, |pixel| u64::from(light[pixel].steps & !DONE_FLAG))
                        });
                        steps.sum()
                    })?
                }
                RenderStage::Beam => {
                    let count = invocation_count(stage, tiles[0].size, 1);
                    self.with_values(BufferSlot::Beams, count, |beams: &[layout::Beam]| {
                        let [tile, inner_tile] = tiles;
                        let steps = beam_block_indices(tile, inner_tile)
                            .map(|block| u64::from(beams[block].steps));
                        steps.sum()
                    })?
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

    /// Calls `act` with the first `count` values of a buffer of the tile.
    fn with_values<T: bytemuck::Pod, R>(
        &self,
        slot: BufferSlot,
        count: u64,
        act: impl FnOnce(&[T]) -> R,
    ) -> Result<R, EngineError> {
        let buffer = self.buffers.get(slot).ok_or(EngineError::NothingLoaded)?;
        Ok(self.gpu.with_values(&buffer, count as usize, act)?)
    }
}

/// Counts the rays of a pass for the pixels of the inner tile.
fn count_rays(
    job: &RenderJob,
    pass: &layout::FrameUniforms,
    rays: &[RayState],
    width: usize,
    tiles: [TileRect; 2],
) -> Stats {
    let rows: Vec<_> = pixel_rows(tiles, width).collect();
    let count_row = |row: PixelRow| {
        let mut stats = Stats::default();
        for x in 0..row.length {
            let ray = &rays[row.tile_start + x];
            let position = || pixel_coordinates(row.image_start + x, width);
            stats.count(Status::from_word(ray.status), || {
                ends_at_far(job, pass, position())
            });
            stats.evaluations += u64::from(ray.steps);
        }
        stats
    };
    rows.into_par_iter()
        .map(count_row)
        .reduce(Stats::default, Stats::plus)
}

/// Sums counts over the pixels of the inner tile. `count` receives a pixel's index in the tile.
fn sum_pixels(tiles: [TileRect; 2], count: impl Fn(usize) -> u64 + Sync) -> u64 {
    let rows: Vec<_> = pixel_rows(tiles, 0).collect();
    let sum_row = |row: PixelRow| {
        (0..row.length)
            .map(|x| count(row.tile_start + x))
            .sum::<u64>()
    };
    rows.into_par_iter().map(sum_row).sum()
}

/// Sets values of the pixels of the inner tile, in an image of this width. `set` receives a pixel's index in
/// the tile, its index in the image, and its value.
fn set_pixels<T: Send>(
    values: &mut [T],
    width: usize,
    tiles: [TileRect; 2],
    set: impl Fn(usize, usize, &mut T) + Sync,
) {
    let [left, upper] = tiles[1].corner.map(|n| n as usize);
    let rows: Vec<_> = pixel_rows(tiles, width).collect();
    let image_rows = values[upper * width..].par_chunks_mut(width);
    rows.into_par_iter()
        .zip(image_rows)
        .for_each(|(row, values)| {
            let pixels = values[left..left + row.length].iter_mut().enumerate();
            for (x, value) in pixels {
                set(row.tile_start + x, row.image_start + x, value);
            }
        });
}

/// A row of the inner tile.
struct PixelRow {
    /// The first pixel's index in the tile.
    tile_start: usize,
    /// The first pixel's index in the image.
    image_start: usize,
    /// Number of pixels.
    length: usize,
}

/// Returns the rows of the inner tile, in an image of this width.
fn pixel_rows([tile, inner_tile]: [TileRect; 2], width: usize) -> impl Iterator<Item = PixelRow> {
    let [left, upper] = inner_tile.corner.map(|n| n as usize);
    let [columns, rows] = inner_tile.size.map(|n| n as usize);
    let row = tile.size[0] as usize;
    (0..rows).map(move |y| PixelRow {
        tile_start: y * row,
        image_start: (upper + y) * width + left,
        length: columns,
    })
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

/// Returns the indices, among a tile's blocks of 8 × 8 pixels, of those that contain pixels of the inner tile.
fn beam_block_indices(tile: TileRect, inner_tile: TileRect) -> impl Iterator<Item = usize> {
    let row = tile.size[0].div_ceil(8) as usize;
    let [columns, rows] = inner_tile.size.map(|n| n.div_ceil(8) as usize);
    (0..rows).flat_map(move |y| (0..columns).map(move |x| y * row + x))
}
