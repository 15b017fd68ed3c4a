//! Kernels: WGSL becomes a compute pipeline; a pipeline with its buffers can be dispatched.

use std::borrow::Cow;
use std::num::NonZeroU64;
use std::sync::atomic::Ordering;

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

use super::error::{panic_text, within};
use super::{Arithmetic, Gpu, GpuError, Rounding, strict};

/// Maximum length of a kernel's text, in bytes. About ten thousand primitives take a tenth of it.
const MAX_TEXT_BYTES: usize = 4 << 20;

/// Stack of the compiler: a base size, and an amount per byte of text. naga limits the recursion of its
/// parser, but not that of later passes. A chain such as `~~~…~x` has a level per byte, and a level takes a
/// few hundred bytes of stack. Only used pages become memory.
const BASE_STACK_BYTES: usize = 16 << 20;
const STACK_BYTES_PER_TEXT_BYTE: usize = 1 << 10;

/// The source of a kernel.
#[derive(Clone, Copy, Debug)]
pub struct KernelSource<'a> {
    /// Name of the kernel in errors and in GPU debuggers.
    pub label: &'a str,
    /// The complete module.
    pub wgsl: &'a str,
    /// The entry point's name.
    pub entry: &'a str,
    /// The buffers it uses, all in group 0.
    pub bindings: &'a [BufferBinding],
    /// Set if a device with default arithmetic must not fuse or reorder its operations either. It rounds
    /// quotients and roots as it does elsewhere.
    pub as_written: bool,
}

/// A binding point for a buffer: `@group(0) @binding(slot)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferBinding {
    /// The number in `@binding(…)`.
    pub slot: u32,
    /// The declared access to the buffer.
    pub access: BindingAccess,
}

impl BufferBinding {
    /// Returns bindings with this access, whose slots are numbered from 0.
    pub fn numbered(access: &[BindingAccess]) -> Vec<Self> {
        (0..)
            .zip(access)
            .map(|(slot, &access)| Self { slot, access })
            .collect()
    }
}

/// The declaration of a buffer in a kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingAccess {
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
    pub(super) layout: wgpu::BindGroupLayout,
}

impl Kernel {
    /// Returns the label that the kernel was created with.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Returns the invocations per workgroup along each axis, from the entry point's `@workgroup_size`.
    pub fn workgroup_size(&self) -> [u32; 3] {
        self.workgroup_size
    }

    pub(super) fn pipeline(&self) -> &wgpu::ComputePipeline {
        &self.pipeline
    }
}

impl Gpu {
    /// Compiles a kernel. WGSL that does not parse or validate is [`GpuError::Shader`] with the line; so are,
    /// under strict arithmetic, operations that cannot be strict. Bindings that do not match the module are
    /// [`GpuError::Validation`]. The time grows with the square of the longest expression, so text should
    /// have short expressions.
    pub fn kernel(&self, source: &KernelSource<'_>) -> Result<Kernel, GpuError> {
        let what = format!("the length of kernel `{}` in bytes", source.label);
        within(what, source.wgsl.len() as u64, MAX_TEXT_BYTES as u64)?;
        let kernel = on_large_stack(
            BASE_STACK_BYTES + STACK_BYTES_PER_TEXT_BYTE * source.wgsl.len(),
            || {
                let (module, info, workgroup_size) = parse(source)?;
                let (code, sizes) = match self.arithmetic_of(source) {
                    Arithmetic::Default => (
                        ModuleCode::Module(Box::new(module)),
                        vec![None; source.bindings.len()],
                    ),
                    strict => self.strict_code(source, strict, (module, info, workgroup_size))?,
                };
                self.error_tracker
                    .scoped(&self.device, || self.pipeline(source, code, &sizes))
                    .map(|(pipeline, layout)| Kernel {
                        label: source.label.to_owned(),
                        workgroup_size,
                        pipeline,
                        layout,
                    })
            },
        )?;
        self.pipelines.fetch_add(1, Ordering::Relaxed);
        Ok(kernel)
    }

    /// Returns the arithmetic of a kernel on this device.
    fn arithmetic_of(&self, source: &KernelSource<'_>) -> Arithmetic {
        match self.arithmetic {
            Arithmetic::Default if source.as_written && self.has_passthrough => Arithmetic::Strict,
            Arithmetic::Default if source.as_written => Arithmetic::Portable,
            arithmetic => arithmetic,
        }
    }

    /// Returns the code of a strict kernel, and the minimum sizes of its buffers where they are known.
    fn strict_code(
        &self,
        source: &KernelSource<'_>,
        arithmetic: Arithmetic,
        (mut module, mut info, workgroup_size): ParsedModule,
    ) -> Result<(ModuleCode, Vec<Option<NonZeroU64>>), GpuError> {
        let shader_error = |text| GpuError::Shader {
            label: source.label.to_owned(),
            text,
        };
        let internal_error = |text| GpuError::Internal(format!("strict kernels: {text}"));
        strict::exact::check(&module, &info).map_err(shader_error)?;
        let mut rewrites = strict::rewriter::Rewrites {
            barriers: arithmetic == Arithmetic::Portable,
            rounding: None,
        };
        if self.rounding == Rounding::Software {
            let wgsl = strict::rounding::with_functions(source.wgsl);
            (module, info, _) = parse(&KernelSource {
                wgsl: &wgsl,
                ..*source
            })?;
            rewrites.rounding = strict::rounding::RoundingFunctions::find(&module);
        }
        if rewrites.any() {
            module = strict::rewriter::rewrite(&module, &info, source.entry, rewrites)
                .map_err(shader_error)?;
        }
        if arithmetic == Arithmetic::Portable {
            // wgpu validates it.
            let sizes = vec![None; source.bindings.len()];
            return Ok((ModuleCode::Module(Box::new(module)), sizes));
        }
        if rewrites.any() {
            info = validator()
                .validate(&module)
                .map_err(|error| internal_error(error.into_inner().to_string()))?;
        }
        let sizes = strict::binding_sizes(&module, source.label, source.bindings)?;
        self.check_workgroup(source.label, &module, workgroup_size)?;
        let words = strict::spirv_words(&module, &info, source.bindings)?;
        Ok((ModuleCode::Words(words), sizes))
    }

    fn pipeline(
        &self,
        source: &KernelSource<'_>,
        code: ModuleCode,
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

    fn shader(&self, source: &KernelSource<'_>, code: ModuleCode) -> wgpu::ShaderModule {
        let label = Some(source.label);
        match code {
            // Passing the parsed module avoids parsing the text twice.
            ModuleCode::Module(module) => {
                self.device
                    .create_shader_module(wgpu::ShaderModuleDescriptor {
                        label,
                        source: wgpu::ShaderSource::Naga(Cow::Owned(*module)),
                    })
            }
            ModuleCode::Words(words) => {
                let entry = wgpu::PassthroughShaderEntryPoint {
                    name: source.entry.into(),
                    // Read only by Metal.
                    workgroup_size: (0, 0, 0),
                };
                let descriptor = wgpu::ShaderModuleDescriptorPassthrough {
                    label,
                    entry_points: Cow::Owned(vec![entry]),
                    spirv: Some(Cow::Owned(words)),
                    ..Default::default()
                };
                // SAFETY: the words are those that naga wrote for a module after validating it. They have all
                // checks at run time that wgpu requests from naga. Added decorations are valid where they
                // stand. `strict::binding_sizes` and `strict::check_workgroup` checked that the bound buffers
                // are those the module declares, and that workgroups keep the limits.
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

/// The code of a shader module.
enum ModuleCode {
    /// Compiled by wgpu.
    Module(Box<naga::Module>),
    /// SPIR-V words that are passed to the driver unchanged.
    Words(Vec<u32>),
}

/// Returns a validator of plain WGSL without extensions.
fn validator() -> Validator {
    Validator::new(ValidationFlags::all(), Capabilities::empty())
}

/// A valid module, facts about it, and the workgroup size of its entry point.
type ParsedModule = (naga::Module, ModuleInfo, [u32; 3]);

/// Parses the text, validates it against plain WGSL without extensions, and finds the workgroup size of the
/// entry point.
fn parse(source: &KernelSource<'_>) -> Result<ParsedModule, GpuError> {
    let shader_error = |text: String| GpuError::Shader {
        label: source.label.to_owned(),
        text,
    };
    let module = naga::front::wgsl::parse_str(source.wgsl)
        .map_err(|error| shader_error(error.emit_to_string_with_path(source.wgsl, source.label)))?;
    let info = validator()
        .validate(&module)
        .map_err(|error| shader_error(error.emit_to_string_with_path(source.wgsl, source.label)))?;
    let is_entry = |entry: &&naga::EntryPoint| {
        entry.stage == naga::ShaderStage::Compute && entry.name == source.entry
    };
    let Some(entry) = module.entry_points.iter().find(is_entry) else {
        return Err(shader_error(format!(
            "there is no compute entry point `{}`",
            source.entry
        )));
    };
    let workgroup_size = entry.workgroup_size;
    Ok((module, info, workgroup_size))
}

/// Returns the layout entry of a binding whose buffer has at least `size` bytes; without a size, wgpu checks
/// itself.
fn layout_entry(binding: &BufferBinding, size: Option<NonZeroU64>) -> wgpu::BindGroupLayoutEntry {
    let ty = match binding.access {
        BindingAccess::Uniform => wgpu::BufferBindingType::Uniform,
        BindingAccess::StorageRead => wgpu::BufferBindingType::Storage { read_only: true },
        BindingAccess::StorageReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
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
