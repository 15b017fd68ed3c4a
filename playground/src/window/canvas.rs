//! Brings the picture to the screen: a texture, and a shader that does nothing but look it up.
//!
//! egui could draw it as one of its images. Software Vulkan, however, runs both sides of every branch, and
//! the shader of egui has some, so that a pixel took it about ten times as long.

use eframe::egui::{PaintCallback, PaintCallbackInfo, Rect};
use eframe::egui_wgpu::{
    Callback, CallbackResources, CallbackTrait, RenderState, ScreenDescriptor,
};
use eframe::wgpu;
use std::sync::Arc;

/// A picture with a number of its own.
#[derive(Clone)]
pub(super) struct Pixels {
    /// Another picture has another number.
    pub(super) number: u64,
    /// Its width and height; neither is zero.
    pub(super) size: [u32; 2],
    /// Red, green, blue and alpha of each pixel, by rows from the upper left.
    pub(super) rgba: Arc<Vec<u8>>,
}

/// What the device holds for it.
struct Held {
    plain: wgpu::RenderPipeline,
    dimmed: wgpu::RenderPipeline,
    groups: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    format: wgpu::TextureFormat,
    shown: Option<Shown>,
}

/// The texture of a picture.
struct Shown {
    number: u64,
    texture: wgpu::Texture,
    group: wgpu::BindGroup,
}

/// Makes a device ready to show pictures.
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
    let held = Held {
        plain: pipeline("plain"),
        dimmed: pipeline("dimmed"),
        groups,
        sampler: device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        }),
        // A target that encodes what it is given wants what pictures hold decoded.
        format: match state.target_format.is_srgb() {
            true => wgpu::TextureFormat::Rgba8UnormSrgb,
            false => wgpu::TextureFormat::Rgba8Unorm,
        },
        shown: None,
    };
    state.renderer.write().callback_resources.insert(held);
}

/// What paints a picture at a place of the window, dimmed or not, on a device that is [prepared](prepare).
pub(super) fn paint(place: Rect, pixels: Pixels, dimmed: bool) -> PaintCallback {
    Callback::new_paint_callback(place, Painting { pixels, dimmed })
}

struct Painting {
    pixels: Pixels,
    dimmed: bool,
}

impl CallbackTrait for Painting {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(held) = resources.get_mut::<Held>() {
            held.bring(device, queue, &self.pixels);
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let Some(held) = resources.get::<Held>() else {
            return;
        };
        let Some(shown) = &held.shown else {
            return;
        };
        pass.set_pipeline(if self.dimmed {
            &held.dimmed
        } else {
            &held.plain
        });
        pass.set_bind_group(0, &shown.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl Held {
    /// Brings a picture to the device, if it is not there.
    fn bring(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, pixels: &Pixels) {
        if self
            .shown
            .as_ref()
            .is_some_and(|shown| shown.number == pixels.number)
        {
            return;
        }
        let [width, height] = pixels.size;
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        };
        let before = self.shown.take();
        let fits = before.filter(|shown| shown.texture.size() == size);
        let shown = fits.unwrap_or_else(|| self.room(device, size));
        queue.write_texture(
            shown.texture.as_image_copy(),
            &pixels.rgba,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * width),
                rows_per_image: Some(height),
            },
            size,
        );
        self.shown = Some(Shown {
            number: pixels.number,
            ..shown
        });
    }

    /// A texture of this size.
    fn room(&self, device: &wgpu::Device, size: wgpu::Extent3d) -> Shown {
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
        Shown {
            number: 0,
            texture,
            group,
        }
    }
}
