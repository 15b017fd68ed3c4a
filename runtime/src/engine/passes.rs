//! Pictures on a GPU: runs the stages of `sdfc_shaders::assemble`, tile by tile. A tile is as large,
//! and a dispatch evaluates the scene as often, as takes a moment ([`super::rate`]); nothing depends
//! on how a picture was cut.

use super::EngineError;
use super::driver::{GpuEngine, OnDevice};
use super::kernels::KernelId;
use super::tiles::Tile;
use crate::cpu::{ends_at_far, from_eye};
use crate::frame::{Frame, Picture, Status, Surface};
use crate::gpu::{Batch, Binding, BoundKernel, Extent};
use sdfc_shaders::assemble::{
    SceneFunction, Slot, Stage, invocations, queue_capacity, queue_front, stages,
};
use sdfc_shaders::beam;
use sdfc_shaders::features::{Features, MOST_LIGHTS, Mode};
use sdfc_shaders::layout::{self, OcclusionRay, Ray, ShadowRay};
use sdfc_shaders::marching::SHOWN;
use sdfc_shaders::normals;
use sdfc_shaders::shadow::DONE;
use std::ops::Range;
use std::time::Instant;

/// The most bytes that the buffers of a tile take together.
const MOST_BYTES: u64 = 512 << 20;

/// A picture's stages with their kernels.
pub(super) struct Plan {
    stages: Vec<(Stage, KernelId)>,
    /// How long the longest of the stages that are done in one dispatch works on a pixel, in
    /// evaluations of the distance.
    pub(super) weight: u32,
    /// The most pixels of a tile that the device has memory for.
    pub(super) largest: u64,
    /// The most evaluations in one invocation of the others.
    most_evaluations: u32,
    /// How many lights its kernels declare at least.
    least_lights: u64,
}

impl Plan {
    /// Whether some stage asks for materials and keeps them.
    fn calls_surface(&self, features: &Features) -> bool {
        let functions = |(stage, _): &(Stage, KernelId)| stage.scene_functions(features);
        self.stages
            .iter()
            .flat_map(functions)
            .any(|function| function == SceneFunction::Surface)
    }

    fn has(&self, stage: Stage) -> bool {
        self.stages.iter().any(|(other, _)| *other == stage)
    }
}

/// The most evaluations of the scene that nearly all invocations of a stage take.
fn usual_evaluations(stage: Stage, features: &Features) -> u32 {
    match stage {
        Stage::Normal => normals::taps(features.normals).len().max(1) as u32,
        Stage::Polish => stage.evaluations(features) / 2,
        stage => stage.evaluations(features),
    }
}

/// How long a function takes, in evaluations of the distance.
fn weight(function: SceneFunction) -> u32 {
    match function {
        SceneFunction::Distance => 1,
        SceneFunction::Gradient => 4,
        SceneFunction::Surface => 8,
    }
}

impl<S: OnDevice> GpuEngine<S> {
    /// Checks the limits, and compiles what is not compiled yet.
    pub(super) fn plan(&mut self, picture: &Picture) -> Result<Plan, EngineError> {
        let features = &picture.features;
        for stage in stages(features) {
            for function in stage.scene_functions(features) {
                self.fits(function, stage.evaluations(features).max(1), stage.name())?;
            }
        }
        let scene = self.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
        let bindings: Vec<Binding> = scene
            .on_device
            .buffers()
            .iter()
            .map(|(binding, _)| *binding)
            .collect();
        let mut plan = Plan {
            stages: Vec::new(),
            weight: 1,
            largest: self.largest_tile(picture),
            most_evaluations: self.most_evaluations(&scene.on_device),
            least_lights: if features.general {
                MOST_LIGHTS as u64
            } else {
                0
            },
        };
        let made_for = if features.general {
            features.generally()
        } else {
            features.clone()
        };
        for stage in stages(features) {
            let functions = stage.scene_functions(&made_for);
            let source = || scene.on_device.source(&functions);
            let variant = scene.on_device.variant();
            let kernel = self
                .kernels
                .stage(&self.gpu, stage, &made_for, variant, source, &bindings)?;
            plan.stages.push((stage, kernel));
            let heaviest = functions
                .iter()
                .map(|&function| weight(function))
                .max()
                .unwrap_or(0);
            plan.weight = plan
                .weight
                .max(heaviest * usual_evaluations(stage, features));
        }
        Ok(plan)
    }

    /// The most pixels of a tile whose buffers the device takes.
    fn largest_tile(&self, picture: &Picture) -> u64 {
        let limits = self.gpu.info().limits;
        let lights = picture.lights.len() as u64;
        let binding = limits.storage_binding.min(limits.buffer);
        let [width, height] = picture.size.map(u64::from);
        let mut pixels = width * height;
        let takes = |pixels: u64| Slot::ALL.map(|slot| slot.bytes(pixels, lights));
        while pixels > 64
            && (takes(pixels).iter().any(|&bytes| bytes > binding)
                || takes(pixels).iter().sum::<u64>() > MOST_BYTES)
        {
            pixels /= 2;
        }
        pixels
    }

    /// Makes a part of the picture: these passes, added to what is there of those before.
    pub(super) fn tile(
        &mut self,
        plan: &Plan,
        picture: &Picture,
        kept: Tile,
        passes: Range<u32>,
        frame: &mut Frame,
    ) -> Result<(), EngineError> {
        let features = &picture.features;
        // Lines between pixels need a pixel more than is kept.
        let tile = match features.mode {
            Mode::Edges => kept.with_neighbours(picture.size),
            _ => kept,
        };
        let lights = picture.lights.len() as u64;
        self.provide(plan, tile, lights)?;
        if let Some(buffer) = self.buffers.get(Slot::Lights) {
            // Kernels that read how many there are find it in the first one.
            let none = [layout::Light::default()];
            let lights = if picture.lights.is_empty() {
                &none
            } else {
                &*picture.lights
            };
            self.gpu.write(&buffer, lights)?;
        }
        if let (1.., Some(buffer)) = (passes.start, self.buffers.get(Slot::Colors)) {
            let mut sums = vec![[0.0; 4]; tile.pixels() as usize];
            for (from, to) in places(tile, kept, frame.width) {
                sums[from] = frame.color[to];
            }
            self.gpu.write(&buffer, &sums)?;
        }
        for sample in passes.clone() {
            self.pass(plan, features, &uniforms(picture, sample, tile), tile)?;
            self.collect(plan, picture, sample, [tile, kept], frame)?;
        }
        let colors: Vec<[f32; 4]> = self.read(Slot::Colors, tile.pixels())?;
        for (from, to) in places(tile, kept, frame.width) {
            frame.color[to] = colors[from].map(|sum| sum / passes.end as f32);
        }
        Ok(())
    }

    /// Finds the field on a part of a figure's plane.
    pub(super) fn values(
        &mut self,
        plan: &Plan,
        picture: &Picture,
        tile: Tile,
        values: &mut [f32],
    ) -> Result<(), EngineError> {
        self.provide(plan, tile, 0)?;
        self.pass(plan, &picture.features, &uniforms(picture, 0, tile), tile)?;
        let rays: Vec<Ray> = self.read(Slot::Rays, tile.pixels())?;
        for (from, to) in places(tile, tile, picture.size[0] as usize) {
            values[to] = rays[from].radius;
        }
        Ok(())
    }

    /// Makes sure that a tile's buffers are there.
    fn provide(&mut self, plan: &Plan, tile: Tile, lights: u64) -> Result<(), EngineError> {
        for &(_, kernel) in &plan.stages {
            for slot in self.kernels.get(kernel).slots().to_vec() {
                let lights = match slot {
                    Slot::Lights => lights.max(plan.least_lights),
                    _ => lights,
                };
                self.buffers
                    .provide(&self.gpu, slot, tile.pixels(), lights)?;
            }
        }
        Ok(())
    }

    /// Runs all stages once over a tile.
    fn pass(
        &mut self,
        plan: &Plan,
        features: &Features,
        uniforms: &layout::Frame,
        tile: Tile,
    ) -> Result<(), EngineError> {
        let lights = u64::from(uniforms.lights);
        self.write_uniforms(uniforms)?;
        let mut waiting: Vec<(Stage, KernelId)> = Vec::new();
        for &(stage, kernel) in &plan.stages {
            if stage.is_resumable() {
                self.run_waiting(&mut waiting, tile, lights)?;
                self.run_until_done(plan, stage, features, kernel, uniforms, tile)?;
            } else {
                waiting.push((stage, kernel));
            }
        }
        self.run_waiting(&mut waiting, tile, lights)
    }

    /// Submits the stages that are done in one dispatch each, together.
    fn run_waiting(
        &mut self,
        waiting: &mut Vec<(Stage, KernelId)>,
        tile: Tile,
        lights: u64,
    ) -> Result<(), EngineError> {
        if waiting.is_empty() {
            return Ok(());
        }
        let mut all_warm = true;
        let mut calls = Vec::new();
        for (stage, kernel) in waiting.drain(..) {
            all_warm &= std::mem::replace(&mut self.kernels.get(kernel).warm, true);
            calls.push((self.bound(kernel)?, invocations(stage, tile.size, lights)));
        }
        let mut batch: Batch<'_> = self.gpu.batch();
        for (call, invocations) in &calls {
            batch.dispatch(call, Extent::Line(*invocations))?;
        }
        let start = Instant::now();
        batch.submit_and_wait()?;
        if all_warm {
            self.rate.took(start.elapsed().as_secs_f64());
        }
        Ok(())
    }

    /// Dispatches a resumable stage until no ray is left in its queue.
    fn run_until_done(
        &mut self,
        plan: &Plan,
        stage: Stage,
        features: &Features,
        kernel: KernelId,
        uniforms: &layout::Frame,
        tile: Tile,
    ) -> Result<(), EngineError> {
        let call = self.bound(kernel)?;
        let queue = self
            .buffers
            .get(Slot::Queue)
            .ok_or(EngineError::NothingLoaded)?;
        let most = match stage {
            Stage::Beam => plan.most_evaluations.min(beam::STEPS),
            Stage::Occlusion => plan.most_evaluations.min(features.occlusion.taps().max(1)),
            Stage::Shadow => plan.most_evaluations.min(uniforms.shadow_steps.max(1)),
            _ => plan.most_evaluations.min(uniforms.steps.max(1)),
        };
        let mut line = invocations(stage, tile.size, u64::from(uniforms.lights));
        let (mut listed, mut half) = (0, 0);
        loop {
            let budget = self.rate.budget(line, most);
            self.gpu.write(&queue, &queue_front(budget, listed, half))?;
            let warm = std::mem::replace(&mut self.kernels.get(kernel).warm, true);
            let mut batch = self.gpu.batch();
            batch.dispatch(&call, Extent::Line(line))?;
            let start = Instant::now();
            batch.submit_and_wait()?;
            let seconds = start.elapsed().as_secs_f64();
            let left = self
                .gpu
                .read_first::<u32>(&queue, 1)?
                .first()
                .copied()
                .unwrap_or(0);
            if warm {
                // Those that are left did all they might; of the others nothing is certain.
                let budget = u64::from(budget);
                self.rate
                    .learn(u64::from(left) * budget, line * budget, seconds);
            }
            if left == 0 {
                return Ok(());
            }
            line = u64::from(left);
            listed = left;
            half = 1 - half;
        }
    }

    /// Copies what a pass found into the frame.
    fn collect(
        &self,
        plan: &Plan,
        picture: &Picture,
        sample: u32,
        [tile, kept]: [Tile; 2],
        frame: &mut Frame,
    ) -> Result<(), EngineError> {
        let features = &picture.features;
        let painted = self.scene.as_ref().is_some_and(|scene| scene.painted);
        let pixels = tile.pixels();
        let rays: Vec<Ray> = self.read(Slot::Rays, pixels)?;
        let pass = picture.pass(sample);
        for (from, to) in places(tile, kept, frame.width) {
            let at_far = || ends_at_far(&pass, pixel(to, frame.width));
            frame.stats.count(Status::of(rays[from].status), at_far);
        }
        frame.stats.evaluations += self.evaluations(plan, picture, [tile, kept], &rays)?;
        if sample > 0 {
            return Ok(());
        }
        let normals: Option<Vec<[f32; 4]>> = plan
            .has(Stage::Normal)
            .then(|| self.read(Slot::Normals, pixels))
            .transpose()?;
        let asked = plan.calls_surface(features);
        let surfaces: Option<Vec<Surface>> = asked
            .then(|| self.read(Slot::Surfaces, pixels))
            .transpose()?;
        for (from, to) in places(tile, kept, frame.width) {
            let ray = &rays[from];
            frame.status[to] = Status::of(ray.status);
            frame.steps[to] = ray.steps;
            if ray.status & SHOWN == 0 {
                continue;
            }
            let at = pixel(to, frame.width);
            frame.depth[to] = from_eye(&picture.uniforms, at, ray.t);
            if let Some(normals) = &normals {
                let [x, y, z, _] = normals[from];
                frame.normal[to] = [x, y, z];
            }
            frame.id[to] = match &surfaces {
                Some(surfaces) => surfaces[from].id as u32,
                None if painted => 0,
                None => picture.uniforms.id as u32,
            };
        }
        Ok(())
    }

    /// The evaluations of the scene in a pass, for the pixels that are kept. Neighbours that two tiles
    /// share count once, so the sum does not depend on how the picture was cut.
    fn evaluations(
        &self,
        plan: &Plan,
        picture: &Picture,
        [tile, kept]: [Tile; 2],
        rays: &[Ray],
    ) -> Result<u64, EngineError> {
        let features = &picture.features;
        // General kernels ask for materials where there are none; that counts for nothing.
        let painted = self.scene.as_ref().is_some_and(|scene| scene.painted);
        let pixels = || places(tile, kept, 0).map(|(from, _)| from);
        let is_shown = |&pixel: &usize| rays[pixel].status & SHOWN != 0;
        let shown = pixels().filter(is_shown).count() as u64;
        let mut evaluations: u64 = pixels().map(|pixel| u64::from(rays[pixel].steps)).sum();
        for &(stage, _) in &plan.stages {
            evaluations += match stage {
                Stage::Surface if !painted => 0,
                // Those of pixels whose gradient is in doubt are not told.
                Stage::Normal | Stage::Surface => {
                    shown * u64::from(usual_evaluations(stage, features))
                }
                Stage::Occlusion => {
                    let around: Vec<OcclusionRay> = self.read(Slot::Occlusion, tile.pixels())?;
                    let shown = pixels().filter(is_shown);
                    shown.map(|pixel| around[pixel].steps as u64).sum()
                }
                Stage::Plane if painted && stage.scene_functions(features).len() > 1 => {
                    kept.pixels()
                }
                Stage::Shadow => {
                    let lights = picture.lights.len() as u64;
                    let steps: Vec<ShadowRay> = self.read(Slot::Shadows, tile.pixels() * lights)?;
                    let of_lights = steps.chunks_exact(rays.len());
                    of_lights
                        .flat_map(|light| pixels().map(|pixel| light[pixel].steps & !DONE))
                        .map(u64::from)
                        .sum()
                }
                Stage::Beam => {
                    let beams: Vec<layout::Beam> =
                        self.read(Slot::Beams, invocations(stage, tile.size, 1))?;
                    let steps = blocks(tile, kept).map(|block| u64::from(beams[block].steps));
                    steps.sum()
                }
                Stage::March | Stage::Polish | Stage::Plane => 0,
                Stage::Shade | Stage::View | Stage::Edges => 0,
            };
        }
        Ok(evaluations)
    }

    fn write_uniforms(&self, uniforms: &layout::Frame) -> Result<(), EngineError> {
        let buffer = self
            .buffers
            .get(Slot::Frame)
            .ok_or(EngineError::NothingLoaded)?;
        Ok(self.gpu.write(&buffer, std::slice::from_ref(uniforms))?)
    }

    /// A kernel with the buffers of the picture and the scene.
    fn bound(&mut self, kernel: KernelId) -> Result<BoundKernel, EngineError> {
        let scene = self.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
        let buffers = &self.buffers;
        Ok(self.kernels.get(kernel).bound(
            &self.gpu,
            buffers.generation,
            |slot| buffers.get(slot),
            scene.on_device.buffers(),
        )?)
    }

    fn read<T: bytemuck::Pod>(&self, slot: Slot, count: u64) -> Result<Vec<T>, EngineError> {
        let buffer = self.buffers.get(slot).ok_or(EngineError::NothingLoaded)?;
        Ok(self.gpu.read_first(&buffer, count as usize)?)
    }
}

/// The numbers of a pass over a tile.
fn uniforms(picture: &Picture, sample: u32, tile: Tile) -> layout::Frame {
    let lights = picture.lights.len() as u64;
    layout::Frame {
        tile: [tile.corner[0], tile.corner[1], tile.size[0], tile.size[1]],
        capacity: queue_capacity(tile.pixels(), lights) as u32,
        ..picture.pass(sample)
    }
}

/// Which pixel of a picture comes so many after the first.
fn pixel(number: usize, width: usize) -> [f32; 2] {
    [(number % width) as f32, (number / width) as f32]
}

/// The kept pixels of a tile: where they are in it, and in the whole picture.
fn places(tile: Tile, kept: Tile, width: usize) -> impl Iterator<Item = (usize, usize)> {
    let [left, upper] = kept.corner.map(|n| n as usize);
    let [columns, rows] = kept.size.map(|n| n as usize);
    let row = tile.size[0] as usize;
    (0..rows)
        .flat_map(move |y| (0..columns).map(move |x| (y * row + x, (upper + y) * width + left + x)))
}

/// The places, among a tile's blocks of 8 × 8 pixels, of those that hold kept pixels.
fn blocks(tile: Tile, kept: Tile) -> impl Iterator<Item = usize> {
    let row = tile.size[0].div_ceil(8) as usize;
    let [columns, rows] = kept.size.map(|n| n.div_ceil(8) as usize);
    (0..rows).flat_map(move |y| (0..columns).map(move |x| y * row + x))
}
