//! Fidget on a GPU, on the adapter that it chooses itself.

use super::fidget_cpu::{Image, expression, plane_config, solid_config};
use super::{Contestant, not_drawn};
use crate::model::Model;
use crate::picture::Picture;
use fidget::vm::VmShape;
use fidget::wgpu::{Gpu, RenderShape, pixel, voxel};

/// A model with the pipelines and buffers that its pictures are drawn with.
struct Device<'a> {
    model: &'a Model,
    size: u32,
    adapter: String,
    kernels: Kernels,
    shape: Option<RenderShape>,
    image: Option<Image>,
}

/// Pipelines, buffers, and the buffer that pictures are read from.
enum Kernels {
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

/// A model on the GPU.
pub(super) fn open(model: &Model, size: u32) -> Result<Box<dyn Contestant + '_>, String> {
    let gpu = pollster::block_on(Gpu::init())
        .or_else(|_| pollster::block_on(Gpu::init_basic()))
        .map_err(|error| format!("fidget-wgpu: {error}"))?;
    let kernels = if model.plane {
        let context = Box::new(pixel::Context::new(&gpu));
        Kernels::Plane {
            workspace: Box::new(context.workspace()),
            context,
            out: gpu.read_buffer("picture"),
        }
    } else {
        let context = Box::new(voxel::Context::new(&gpu));
        Kernels::Solid {
            workspace: Box::new(context.workspace()),
            context,
            out: gpu.read_buffer("picture"),
        }
    };
    Ok(Box::new(Device {
        model,
        size,
        adapter: gpu.device.adapter_info().name,
        kernels,
        shape: None,
        image: None,
    }))
}

impl Contestant for Device<'_> {
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
            Kernels::Plane {
                context,
                workspace,
                out,
            } => {
                let config = plane_config(self.model, self.size);
                context
                    .run(shape, workspace, out, config)
                    .map(Image::Plane)
                    .map_err(|error| error.to_string())
            }
            Kernels::Solid {
                context,
                workspace,
                out,
            } => {
                let config = solid_config(self.model, self.size);
                context
                    .run(shape, workspace, out, config)
                    .map(Image::Solid)
                    .map_err(|error| error.to_string())
            }
        };
        self.image = Some(image?);
        Ok(())
    }

    fn picture(&self) -> Result<Picture, String> {
        self.image
            .as_ref()
            .map(Image::picture)
            .ok_or_else(not_drawn)
    }
}
