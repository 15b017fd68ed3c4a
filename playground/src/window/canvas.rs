//! Draws the picture on screen: a texture and a shader that only samples it.
//!
//! The picture is not drawn as an egui image, because software Vulkan executes both sides of every
//! branch. The branches of egui's shader make a pixel about ten times as expensive.

use eframe::egui::{PaintCallback, PaintCallbackInfo, Rect};
use eframe::egui_wgpu::{
    Callback, CallbackResources, CallbackTrait, RenderState, ScreenDescriptor,
};
use eframe::wgpu;
use std::sync::Arc;

/// A picture with its version number.
#[derive(Clone)]
pub(super) struct CanvasPicture {
    /// Version; different pictures have different numbers.
    pub(super) number: u64,
    /// Width and height; neither is zero.
    pub(super) size: [u32; 2],
    /// Red, green, blue and alpha of each pixel, in rows from the upper left.
    pub(super) rgba: Arc<Vec<u8>>,
}

/// Resources on the device.
struct CanvasResources {
    plain: wgpu::RenderPipeline,
    dimmed: wgpu::RenderPipeline,
    groups: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    format: wgpu::TextureFormat,
    texture: Option<PictureTexture>,
}

/// Texture of a picture.
struct PictureTexture {
    number: u64,
    texture: wgpu::Texture,
    group: wgpu::BindGroup,
}

/// Creates the resources for showing pictures on a device.
pub(super) fn prepare(state: &RenderState) {
    let device = &state.device;
    let module = device.create_shader_module(wgpu::include_wgsl!("canvas.wgsl"));
    let groups = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("picture"),
        entries: &[
            wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: true },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            },
            wgpu::BindGroupLayoutEntry {
                binding: 1,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                count: None,
            },
        ],
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("picture"),
        bind_group_layouts: &[Some(&groups)],
        immediate_size: 0,
    });
    let pipeline = |entry| {
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(entry),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                entry_point: Some("corner"),
                module: &module,
                buffers: &[],
                compilation_options: wgpu::PipelineCompilationOptions::default(),
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(entry),
                targets: &[Some(state.target_format.into())],
                compilation_options: wgpu::PipelineCompilationOptions::default(),
            }),
            multiview_mask: None,
            cache: None,
        })
    };
    let resources = CanvasResources {
        plain: pipeline("plain"),
        dimmed: pipeline("dimmed"),
        groups,
        sampler: device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        }),
        // An sRGB target encodes its input, so the texture must decode the picture's bytes.
        format: match state.target_format.is_srgb() {
            true => wgpu::TextureFormat::Rgba8UnormSrgb,
            false => wgpu::TextureFormat::Rgba8Unorm,
        },
        texture: None,
    };
    state.renderer.write().callback_resources.insert(resources);
}

/// Returns a callback that paints a picture, optionally dimmed, on a [prepared](prepare) device.
pub(super) fn paint(area: Rect, picture: CanvasPicture, dimmed: bool) -> PaintCallback {
    Callback::new_paint_callback(area, PicturePaint { picture, dimmed })
}

struct PicturePaint {
    picture: CanvasPicture,
    dimmed: bool,
}

impl CallbackTrait for PicturePaint {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(resources) = resources.get_mut::<CanvasResources>() {
            resources.upload(device, queue, &self.picture);
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let Some(resources) = resources.get::<CanvasResources>() else {
            return;
        };
        let Some(texture) = &resources.texture else {
            return;
        };
        pass.set_pipeline(if self.dimmed {
            &resources.dimmed
        } else {
            &resources.plain
        });
        pass.set_bind_group(0, &texture.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl CanvasResources {
    /// Uploads a picture if it is not on the device.
    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, picture: &CanvasPicture) {
        if self
            .texture
            .as_ref()
            .is_some_and(|texture| texture.number == picture.number)
        {
            return;
        }
        let [width, height] = picture.size;
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        };
        let previous = self.texture.take();
        let reusable = previous.filter(|texture| texture.texture.size() == size);
        let texture = reusable.unwrap_or_else(|| self.create_texture(device, size));
        queue.write_texture(
            texture.texture.as_image_copy(),
            &picture.rgba,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * width),
                rows_per_image: Some(height),
            },
            size,
        );
        self.texture = Some(PictureTexture {
            number: picture.number,
            ..texture
        });
    }

    /// Creates a texture of this size.
    fn create_texture(&self, device: &wgpu::Device, size: wgpu::Extent3d) -> PictureTexture {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("picture"),
            layout: &self.groups,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&view),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(&self.sampler),
                },
            ],
        });
        PictureTexture {
            number: 0,
            texture,
            group,
        }
    }
}
