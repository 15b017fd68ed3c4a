//! Evaluation of a scene at points, on a GPU. Three kernels share a text, one for each of the scene's
//! functions: a single kernel would take as long to compile as all three together.

use super::driver::{BindingAccess, Buffer, BufferBinding, BufferUsage, Extent};
use super::kernel_cache::{KernelId, SceneWgsl};
use super::runner::SceneRunner;
use super::scene::GpuScene;
use crate::engine::{EngineError, FieldSample};
use sdfc_shaders::assemble::{BufferSlot, SceneFunction};
use sdfc_shaders::layout::{FrameUniforms, Surface};
use sdfc_vm::prelude;
use std::fmt::Write;

/// The text of the three kernels.
const KERNEL: &str = include_str!("query.wgsl");

/// Maximum number of points of a submission.
const MAX_POINTS: usize = 1 << 20;
/// Cost of all three functions together, relative to a distance.
const QUERY_WEIGHT: u32 = 13;

/// Evaluates the scene at all points.
pub(super) fn query<S: GpuScene>(
    runner: &mut SceneRunner<S>,
    points: &[[f32; 3]],
) -> Result<Vec<FieldSample>, EngineError> {
    runner.prepare(None)?;
    let has_surface_program = runner
        .scene
        .as_ref()
        .ok_or(EngineError::NothingLoaded)?
        .has_surface_program;
    let mut functions = vec![SceneFunction::Distance, SceneFunction::Gradient];
    if has_surface_program {
        functions.push(SceneFunction::Surface);
    }
    for &function in &functions {
        runner.check_loop_limit(function, 1, "a query")?;
    }
    let mut samples = Vec::with_capacity(points.len());
    let mut remaining = points;
    while !remaining.is_empty() {
        let max_points = (runner.budget.tile_pixels(QUERY_WEIGHT) as usize).min(MAX_POINTS);
        let (chunk, after) = remaining.split_at(max_points.min(remaining.len()));
        remaining = after;
        samples.extend(query_chunk(runner, chunk, &functions)?);
    }
    Ok(samples)
}

/// Evaluates the scene at the points of one submission.
fn query_chunk<S: GpuScene>(
    runner: &mut SceneRunner<S>,
    points: &[[f32; 3]],
    functions: &[SceneFunction],
) -> Result<Vec<FieldSample>, EngineError> {
    let count = points.len();
    let kernels = functions
        .iter()
        .map(|&function| query_kernel(runner, function));
    let kernels = kernels.collect::<Result<Vec<KernelId>, _>>()?;
    let gpu = &runner.gpu;
    let scene = runner.scene.as_ref().ok_or(EngineError::NothingLoaded)?;

    let uniforms = FrameUniforms {
        albedo: scene.default_material.albedo,
        roughness: scene.default_material.roughness,
        emission: scene.default_material.emission,
        metallic: scene.default_material.metallic,
        id: scene.default_material.id,
        ..FrameUniforms::default()
    };
    let padded: Vec<[f32; 4]> = points.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect();
    let output_buffer =
        |label, bytes: usize| gpu.buffer(label, BufferUsage::Storage, (bytes * count) as u64);
    let frame = gpu.buffer_with("frame", BufferUsage::Uniform, &[uniforms])?;
    let point_buffer = gpu.buffer_with("points", BufferUsage::Storage, &padded)?;
    let distances = output_buffer("distances", size_of::<f32>())?;
    let gradients = output_buffer("gradients", size_of::<[f32; 4]>())?;
    let surfaces = output_buffer("surfaces", size_of::<Surface>())?;

    let mut batch = gpu.batch();
    for (&function, &kernel) in functions.iter().zip(&kernels) {
        let mut slots: Vec<(u32, &Buffer)> = vec![(0, &frame), (1, &point_buffer)];
        slots.extend(match function {
            SceneFunction::Distance => vec![(2, &distances)],
            SceneFunction::Gradient => vec![(3, &gradients)],
            SceneFunction::Surface => vec![(3, &gradients), (4, &surfaces)],
        });
        let buffers = scene.gpu_scene.buffers();
        slots.extend(
            buffers
                .iter()
                .map(|(binding, buffer)| (binding.slot, buffer)),
        );
        let call = runner.kernels.get(kernel).bind(gpu, &slots)?;
        batch.dispatch(&call, Extent::Line(count as u64))?;
    }
    batch.submit_and_wait()?;

    let distances: Vec<f32> = gpu.read_first(&distances, count)?;
    let gradients: Vec<[f32; 4]> = gpu.read_first(&gradients, count)?;
    let surfaces: Vec<Surface> = if scene.has_surface_program {
        gpu.read_first(&surfaces, count)?
    } else {
        vec![scene.default_material; count]
    };
    let sample = |i: usize| {
        let [x, y, z, _] = gradients[i];
        FieldSample::new(distances[i], [x, y, z], surfaces[i])
    };
    Ok((0..count).map(sample).collect())
}

/// Returns the kernel that evaluates one function.
fn query_kernel<S: GpuScene>(
    runner: &mut SceneRunner<S>,
    function: SceneFunction,
) -> Result<KernelId, EngineError> {
    let scene = runner.scene.as_ref().ok_or(EngineError::NothingLoaded)?;
    let variant = scene.gpu_scene.variant();
    let gpu = &runner.gpu;
    let id = runner.kernels.query(function, variant, |kernels| {
        let text = kernel_text(&scene.gpu_scene.source(&[function]), function);
        let storage = |slot, access| BufferBinding { slot, access };
        let (read, write) = (BindingAccess::StorageRead, BindingAccess::StorageReadWrite);
        let mut bindings = vec![
            storage(BufferSlot::Frame as u32, BindingAccess::Uniform),
            storage(1, read),
        ];
        bindings.extend(match function {
            SceneFunction::Distance => vec![storage(2, write)],
            SceneFunction::Gradient => vec![storage(3, write)],
            SceneFunction::Surface => vec![storage(3, read), storage(4, write)],
        });
        let buffers = scene.gpu_scene.buffers();
        bindings.extend(buffers.iter().map(|(binding, _)| *binding));
        kernels.compile(gpu, "query", text, &bindings, Vec::new(), &[function])
    });
    Ok(id?)
}

/// Writes the complete module of the kernel that evaluates one function.
fn kernel_text(scene: &SceneWgsl, function: SceneFunction) -> String {
    let (define, structs) = match function {
        SceneFunction::Distance => ("distance", ""),
        SceneFunction::Gradient => ("gradient", ""),
        SceneFunction::Surface => ("surface", Surface::WGSL),
    };
    let mut text = format!("{}\n{structs}\n", FrameUniforms::WGSL);
    text.push_str("@group(0) @binding(0) var<uniform> frame: FrameUniforms;\n\n");
    for function in prelude::functions(scene.calls.iter().copied()) {
        let _ = writeln!(text, "{}", function.text);
    }
    text.push_str(&scene.text);
    let mut is_active = true;
    for line in KERNEL.lines() {
        match line.strip_prefix("#if ") {
            Some(word) => is_active = word == define,
            None if line == "#end" => is_active = true,
            None if is_active => {
                text.push_str(line);
                text.push('\n');
            }
            None => {}
        }
    }
    text
}
