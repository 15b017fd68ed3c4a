//! Kernels: WGSL text becomes a compute pipeline, and a pipeline with its buffers something that
//! can be dispatched.

use std::borrow::Cow;
use std::num::NonZeroU64;
use std::sync::atomic::Ordering;

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

use super::error::{panic_text, within};
use super::{Arithmetic, Buffer, Gpu, GpuError, strict};

/// The longest text that is compiled, in bytes. Some ten thousand primitives take a tenth of it.
const LONGEST_TEXT: usize = 4 << 20;

/// Stack for the compiler: so many bytes, and more for each byte of text. naga limits how deep its
/// parser recurses but not how it walks what was parsed: a chain such as `~~~…~x` has a level for
/// each byte, and a level takes a few hundred bytes of stack. Only what is used becomes memory.
const STACK: usize = 16 << 20;
const STACK_PER_BYTE: usize = 1 << 10;

/// What a kernel is made from.
#[derive(Clone, Copy, Debug)]
pub struct KernelSource<'a> {
    /// Names the kernel in errors and in GPU debuggers.
    pub label: &'a str,
    /// The whole module.
    pub wgsl: &'a str,
    /// The entry point's name.
    pub entry: &'a str,
    /// The buffers it uses, all in group 0.
    pub bindings: &'a [Binding],
}

/// A place for a buffer: `@group(0) @binding(slot)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// The number in `@binding(…)`.
    pub slot: u32,
    /// How the kernel declares the buffer.
    pub access: Access,
}

/// How a kernel declares a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `var<uniform>`
    Uniform,
    /// `var<storage, read>`
    StorageRead,
    /// `var<storage, read_write>`
    StorageReadWrite,
}

/// A compiled kernel.
#[derive(Clone, Debug)]
pub struct Kernel {
    label: String,
    workgroup_size: [u32; 3],
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

/// A kernel with a buffer in each of its slots. Cheap to clone; it keeps the buffers alive.
#[derive(Clone, Debug)]
pub struct BoundKernel {
    pub(super) kernel: Kernel,
    pub(super) group: wgpu::BindGroup,
}

impl Kernel {
    /// The label it was made with.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Invocations per workgroup along each axis, from the entry point's `@workgroup_size`.
    pub fn workgroup_size(&self) -> [u32; 3] {
        self.workgroup_size
    }

    pub(super) fn pipeline(&self) -> &wgpu::ComputePipeline {
        &self.pipeline
    }
}

impl Gpu {
    /// Compiles a kernel. WGSL that does not parse or validate is [`GpuError::Shader`] and shows
    /// the line, and so is what cannot be strict where arithmetic is; bindings that do not fit the module are [`GpuError::Validation`]. The time it takes
    /// grows with the square of the longest expression, so text should have short ones.
    pub fn kernel(&self, source: &KernelSource<'_>) -> Result<Kernel, GpuError> {
        let what = format!("the length of kernel `{}` in bytes", source.label);
        within(what, source.wgsl.len() as u64, LONGEST_TEXT as u64)?;
        let kernel = on_large_stack(STACK + STACK_PER_BYTE * source.wgsl.len(), || {
            let (module, info, workgroup_size) = parse(source)?;
            let refuse = |text| GpuError::Shader {
                label: source.label.to_owned(),
                text,
            };
            if self.arithmetic.is_strict() {
                strict::exact::check(&module, &info).map_err(refuse)?;
            }
            let (code, sizes) = match self.arithmetic {
                Arithmetic::Default => (
                    Code::Module(Box::new(module)),
                    vec![None; source.bindings.len()],
                ),
                Arithmetic::Strict => {
                    let sizes = strict::resources(&module, source.label, source.bindings)?;
                    self.check_workgroup(source.label, &module, workgroup_size)?;
                    let words = strict::words(&module, &info, source.bindings)?;
                    (Code::Words(words), sizes)
                }
                Arithmetic::Portable => {
                    let module = strict::portable::rewritten(&module, &info, source.entry)
                        .map_err(refuse)?;
                    (
                        Code::Module(Box::new(module)),
                        vec![None; source.bindings.len()],
                    )
                }
            };
            self.faults
                .scoped(&self.device, || self.pipeline(source, code, &sizes))
                .map(|(pipeline, layout)| Kernel {
                    label: source.label.to_owned(),
                    workgroup_size,
                    pipeline,
                    layout,
                })
        })?;
        self.pipelines.fetch_add(1, Ordering::Relaxed);
        Ok(kernel)
    }

    /// Puts buffers into a kernel's slots. A slot without a buffer, or a buffer of the wrong
    /// usage, is [`GpuError::Validation`].
    pub fn bind(
        &self,
        kernel: &Kernel,
        buffers: &[(u32, &Buffer)],
    ) -> Result<BoundKernel, GpuError> {
        let entries: Vec<_> = buffers
            .iter()
            .map(|(slot, buffer)| wgpu::BindGroupEntry {
                binding: *slot,
                resource: buffer.raw.as_entire_binding(),
            })
            .collect();
        let group = self.faults.scoped(&self.device, || {
            self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(&kernel.label),
                layout: &kernel.layout,
                entries: &entries,
            })
        })?;
        Ok(BoundKernel {
            kernel: kernel.clone(),
            group,
        })
    }

    fn pipeline(
        &self,
        source: &KernelSource<'_>,
        code: Code,
        sizes: &[Option<NonZeroU64>],
    ) -> (wgpu::ComputePipeline, wgpu::BindGroupLayout) {
        let label = Some(source.label);
        let pairs = source.bindings.iter().zip(sizes);
        let entries: Vec<_> = pairs.map(|(b, &size)| layout_entry(b, size)).collect();
        let layout = self
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label,
                entries: &entries,
            });
        let pipeline_layout = self
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label,
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
        let shader = self.shader(source, code);
        let pipeline = self
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label,
                layout: Some(&pipeline_layout),
                module: &shader,
                entry_point: Some(source.entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
        (pipeline, layout)
    }

    fn shader(&self, source: &KernelSource<'_>, code: Code) -> wgpu::ShaderModule {
        let label = Some(source.label);
        match code {
            // The parsed module is handed over, so the text is not parsed twice.
            Code::Module(module) => {
                self.device
                    .create_shader_module(wgpu::ShaderModuleDescriptor {
                        label,
                        source: wgpu::ShaderSource::Naga(Cow::Owned(*module)),
                    })
            }
            Code::Words(words) => {
                let entry = wgpu::PassthroughShaderEntryPoint {
                    name: source.entry.into(),
                    // Read for Metal only.
                    workgroup_size: (0, 0, 0),
                };
                let descriptor = wgpu::ShaderModuleDescriptorPassthrough {
                    label,
                    entry_points: Cow::Owned(vec![entry]),
                    spirv: Some(Cow::Owned(words)),
                    ..Default::default()
                };
                // SAFETY: the words are those that naga wrote for a module that it found valid, with
                // all checks at run time that wgpu asks it for, and with decorations that are valid
                // where they stand. That the buffers bound are those the module declares, and that
                // workgroups keep the limits, was checked by `strict::resources` and
                // `strict::check_workgroup`.
                unsafe { self.device.create_shader_module_passthrough(descriptor) }
            }
        }
    }

    fn check_workgroup(
        &self,
        label: &str,
        module: &naga::Module,
        size: [u32; 3],
    ) -> Result<(), GpuError> {
        let limits = self.device.limits();
        let sides = [
            limits.max_compute_workgroup_size_x,
            limits.max_compute_workgroup_size_y,
            limits.max_compute_workgroup_size_z,
        ];
        strict::check_workgroup(module, label, size, &self.info.limits, sides)
    }
}

/// What a shader module is made from.
enum Code {
    /// By wgpu, as it likes.
    Module(Box<naga::Module>),
    /// From words that are passed on as they are.
    Words(Vec<u32>),
}

/// Parses and validates the text against plain WGSL, without any extension, and finds the entry
/// point's workgroup size.
fn parse(source: &KernelSource<'_>) -> Result<(naga::Module, ModuleInfo, [u32; 3]), GpuError> {
    let refuse = |text: String| GpuError::Shader {
        label: source.label.to_owned(),
        text,
    };
    let module = naga::front::wgsl::parse_str(source.wgsl)
        .map_err(|error| refuse(error.emit_to_string_with_path(source.wgsl, source.label)))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .map_err(|error| refuse(error.emit_to_string_with_path(source.wgsl, source.label)))?;
    let is_entry = |entry: &&naga::EntryPoint| {
        entry.stage == naga::ShaderStage::Compute && entry.name == source.entry
    };
    let Some(entry) = module.entry_points.iter().find(is_entry) else {
        return Err(refuse(format!(
            "there is no compute entry point `{}`",
            source.entry
        )));
    };
    let workgroup_size = entry.workgroup_size;
    Ok((module, info, workgroup_size))
}

/// A binding's place, whose buffer has at least `size` bytes; without one wgpu looks itself.
fn layout_entry(binding: &Binding, size: Option<NonZeroU64>) -> wgpu::BindGroupLayoutEntry {
    let ty = match binding.access {
        Access::Uniform => wgpu::BufferBindingType::Uniform,
        Access::StorageRead => wgpu::BufferBindingType::Storage { read_only: true },
        Access::StorageReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
    };
    wgpu::BindGroupLayoutEntry {
        binding: binding.slot,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: size,
        },
        count: None,
    }
}

/// Runs `work` on a thread with a stack of `stack` bytes.
fn on_large_stack<R: Send>(
    stack: usize,
    work: impl FnOnce() -> Result<R, GpuError> + Send,
) -> Result<R, GpuError> {
    std::thread::scope(|scope| {
        std::thread::Builder::new()
            .name("kernel compiler".to_owned())
            .stack_size(stack)
            .spawn_scoped(scope, work)
            .map_err(|error| GpuError::Internal(format!("no thread for the compiler: {error}")))?
            .join()
            .unwrap_or_else(|panic| Err(GpuError::Internal(panic_text(panic.as_ref()))))
    })
}
