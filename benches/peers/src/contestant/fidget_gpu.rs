//! Fidget on a GPU, on the adapter of its own choice.

use super::fidget_cpu::{FidgetImage, expression, plane_config, solid_config};
use super::{Contestant, not_drawn};
use crate::model::Model;
use crate::picture::ComparedImage;
use fidget::vm::VmShape;
use fidget::wgpu::{Gpu, RenderShape, pixel, voxel};

/// A model with the pipelines and buffers that draw its pictures.
struct FidgetGpu<'a> {
    model: &'a Model,
    size: u32,
    adapter: String,
    kernels: FidgetKernels,
    shape: Option<RenderShape>,
    image: Option<FidgetImage>,
}

/// Pipelines, buffers, and the buffer from which pictures are read.
enum FidgetKernels {
    Plane {
        context: Box<pixel::Context>,
        workspace: Box<pixel::Workspace>,
        out: fidget::wgpu::buf::ReadBuffer<pixel::PixelBufferTag>,
    },
    Solid {
        context: Box<voxel::Context>,
        workspace: Box<voxel::Workspace>,
        out: fidget::wgpu::buf::ReadBuffer<voxel::GeomBufferTag>,
    },
}

/// Opens a model on the GPU.
pub(super) fn open(model: &Model, size: u32) -> Result<Box<dyn Contestant + '_>, String> {
    let gpu = pollster::block_on(Gpu::init())
        .or_else(|_| pollster::block_on(Gpu::init_basic()))
        .map_err(|error| format!("fidget-wgpu: {error}"))?;
    let kernels = if model.is_2d {
        let context = Box::new(pixel::Context::new(&gpu));
        FidgetKernels::Plane {
            workspace: Box::new(context.workspace()),
            context,
            out: gpu.read_buffer("picture"),
        }
    } else {
        let context = Box::new(voxel::Context::new(&gpu));
        FidgetKernels::Solid {
            workspace: Box::new(context.workspace()),
            context,
            out: gpu.read_buffer("picture"),
        }
    };
    Ok(Box::new(FidgetGpu {
        model,
        size,
        adapter: gpu.device.adapter_info().name,
        kernels,
        shape: None,
        image: None,
    }))
}

impl Contestant for FidgetGpu<'_> {
    fn device(&self) -> String {
        self.adapter.clone()
    }

    fn prepare(&mut self) -> Result<(), String> {
        let (context, node) = expression(self.model)?;
        let shape = VmShape::new(&context, node).map_err(|error| error.to_string())?;
        self.shape = Some(RenderShape::new(&shape).map_err(|error| error.to_string())?);
        Ok(())
    }

    fn frame(&mut self) -> Result<(), String> {
        let shape = self.shape.as_ref().ok_or_else(not_drawn)?;
        let image = match &mut self.kernels {
            FidgetKernels::Plane {
                context,
                workspace,
                out,
            } => {
                let config = plane_config(self.model, self.size);
                context
                    .run(shape, workspace, out, config)
                    .map(FidgetImage::Plane)
                    .map_err(|error| error.to_string())
            }
            FidgetKernels::Solid {
                context,
                workspace,
                out,
            } => {
                let config = solid_config(self.model, self.size);
                context
                    .run(shape, workspace, out, config)
                    .map(FidgetImage::Solid)
                    .map_err(|error| error.to_string())
            }
        };
        self.image = Some(image?);
        Ok(())
    }

    fn picture(&self) -> Result<ComparedImage, String> {
        self.image
            .as_ref()
            .map(FidgetImage::picture)
            .ok_or_else(not_drawn)
    }
}
