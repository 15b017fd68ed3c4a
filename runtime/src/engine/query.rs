//! What a scene is at points, on a GPU: three kernels that share a text, one for each of the
//! scene's functions, since a kernel with all of them would take as long to compile as they do
//! together.

use super::driver::{GpuEngine, OnDevice, SceneText};
use super::kernels::KernelId;
use super::{EngineError, Sample};
use crate::gpu::{Access, Binding, Buffer, Extent, Usage};
use sdfc_shaders::assemble::{SceneFunction, Slot};
use sdfc_shaders::layout::{Frame, Surface};
use sdfc_vm::prelude;
use std::fmt::Write;

/// The text of the three kernels.
const KERNEL: &str = include_str!("query.wgsl");

/// The most points of a submission.
const MOST_POINTS: usize = 1 << 20;
/// How much longer than a distance all three functions take together.
const WEIGHT: u32 = 13;

/// The direction of a gradient; up where there is none. The kernel's function of this name.
pub(super) fn direction(gradient: [f32; 3]) -> [f32; 3] {
    let largest = gradient.iter().fold(0.0_f32, |most, v| most.max(v.abs()));
    if !(largest > 1e-30 && largest < 1e30) {
        return [0.0, 1.0, 0.0];
    }
    let [x, y, z] = gradient.map(|v| v * (1.0 / largest));
    let scale = 1.0 / (x * x + y * y + z * z).sqrt();
    [x * scale, y * scale, z * scale]
}

/// Asks the scene about all points.
pub(super) fn query<S: OnDevice>(
    engine: &mut GpuEngine<S>,
    points: &[[f32; 3]],
) -> Result<Vec<Sample>, EngineError> {
    engine.prepare(None)?;
    let painted = engine
        .scene
        .as_ref()
        .ok_or(EngineError::NothingLoaded)?
        .painted;
    let mut functions = vec![SceneFunction::Distance, SceneFunction::Gradient];
    if painted {
        functions.push(SceneFunction::Surface);
    }
    for &function in &functions {
        engine.fits(function, 1, "a query")?;
    }
    let mut samples = Vec::with_capacity(points.len());
    let mut rest = points;
    while !rest.is_empty() {
        let most = (engine.rate.pixels(WEIGHT) as usize).min(MOST_POINTS);
        let (chunk, after) = rest.split_at(most.min(rest.len()));
        rest = after;
        samples.extend(ask(engine, chunk, &functions)?);
    }
    Ok(samples)
}

/// Asks the scene about some points.
fn ask<S: OnDevice>(
    engine: &mut GpuEngine<S>,
    points: &[[f32; 3]],
    functions: &[SceneFunction],
) -> Result<Vec<Sample>, EngineError> {
    let count = points.len();
    let kernels = functions.iter().map(|&function| kernel(engine, function));
    let kernels = kernels.collect::<Result<Vec<KernelId>, _>>()?;
    let gpu = &engine.gpu;
    let scene = engine.scene.as_ref().ok_or(EngineError::NothingLoaded)?;

    let uniforms = Frame {
        albedo: scene.unpainted.albedo,
        roughness: scene.unpainted.roughness,
        emission: scene.unpainted.emission,
        metallic: scene.unpainted.metallic,
        id: scene.unpainted.id,
        ..Frame::default()
    };
    let padded: Vec<[f32; 4]> = points.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect();
    let made = |label, bytes: usize| gpu.buffer(label, Usage::Storage, (bytes * count) as u64);
    let frame = gpu.buffer_with("frame", Usage::Uniform, &[uniforms])?;
    let asked = gpu.buffer_with("points", Usage::Storage, &padded)?;
    let distances = made("distances", size_of::<f32>())?;
    let gradients = made("gradients", size_of::<[f32; 4]>())?;
    let surfaces = made("surfaces", size_of::<Surface>())?;

    let mut batch = gpu.batch();
    for (&function, &kernel) in functions.iter().zip(&kernels) {
        let mut slots: Vec<(u32, &Buffer)> = vec![(0, &frame), (1, &asked)];
        slots.extend(match function {
            SceneFunction::Distance => vec![(2, &distances)],
            SceneFunction::Gradient => vec![(3, &gradients)],
            SceneFunction::Surface => vec![(3, &gradients), (4, &surfaces)],
        });
        let buffers = scene.on_device.buffers();
        slots.extend(
            buffers
                .iter()
                .map(|(binding, buffer)| (binding.slot, buffer)),
        );
        let call = engine.kernels.get(kernel).bind(gpu, &slots)?;
        batch.dispatch(&call, Extent::Line(count as u64))?;
    }
    batch.submit_and_wait()?;

    let distances: Vec<f32> = gpu.read_first(&distances, count)?;
    let gradients: Vec<[f32; 4]> = gpu.read_first(&gradients, count)?;
    let surfaces: Vec<Surface> = if scene.painted {
        gpu.read_first(&surfaces, count)?
    } else {
        vec![scene.unpainted; count]
    };
    let sample = |i: usize| {
        let [x, y, z, _] = gradients[i];
        Sample {
            distance: distances[i],
            gradient: [x, y, z],
            surface: surfaces[i],
        }
    };
    Ok((0..count).map(sample).collect())
}

/// The kernel that asks one function.
fn kernel<S: OnDevice>(
    engine: &mut GpuEngine<S>,
    function: SceneFunction,
) -> Result<KernelId, EngineError> {
    let scene = engine.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
    let variant = scene.on_device.variant();
    let gpu = &engine.gpu;
    let made = engine.kernels.query(function, variant, |kernels| {
        let text = text(&scene.on_device.source(&[function]), function);
        let storage = |slot, access| Binding { slot, access };
        let (read, write) = (Access::StorageRead, Access::StorageReadWrite);
        let mut bindings = vec![
            storage(Slot::Frame as u32, Access::Uniform),
            storage(1, read),
        ];
        bindings.extend(match function {
            SceneFunction::Distance => vec![storage(2, write)],
            SceneFunction::Gradient => vec![storage(3, write)],
            SceneFunction::Surface => vec![storage(3, read), storage(4, write)],
        });
        let buffers = scene.on_device.buffers();
        bindings.extend(buffers.iter().map(|(binding, _)| *binding));
        kernels.compile(gpu, "query", text, &bindings, Vec::new(), true)
    });
    Ok(made?)
}

/// The whole module of the kernel that asks one function.
fn text(scene: &SceneText, function: SceneFunction) -> String {
    let (wanted, structs) = match function {
        SceneFunction::Distance => ("distance", ""),
        SceneFunction::Gradient => ("gradient", ""),
        SceneFunction::Surface => ("surface", Surface::WGSL),
    };
    let mut text = format!("{}\n{structs}\n", Frame::WGSL);
    text.push_str("@group(0) @binding(0) var<uniform> frame: Frame;\n\n");
    for function in prelude::functions(scene.calls.iter().copied()) {
        let _ = writeln!(text, "{}", function.text);
    }
    text.push_str(&scene.text);
    let mut kept = true;
    for line in KERNEL.lines() {
        match line.strip_prefix("#if ") {
            Some(word) => kept = word == wanted,
            None if line == "#end" => kept = true,
            None if kept => {
                text.push_str(line);
                text.push('\n');
            }
            None => {}
        }
    }
    text
}
