//! The interpreter on a GPU. Both programs of a scene are words and constants in buffers, and a kernel
//! contains only the operations that they need. Another scene that needs no other operations runs in the same
//! kernel, so an edit is a write to a buffer.
//!
//! If cells are profitable, the kernel runs tapes ([`sdfc_shaders::interpreter::tape`]), and each render
//! begins by splitting its part of space into cells ([`cells`]). They are split on the CPU, or, where kernels
//! run on another processor, on the device after the first levels ([`super::cell_builder`]).
//!
//! In *generic* mode kernels run any scene's tape, with or without cells; without cells, the tape of the
//! whole program is used everywhere. No scene then needs another kernel, except one whose tapes take more
//! registers than [`GENERIC_REGISTERS`]; it gets specialized kernels.

mod cells;

use super::cell_builder::{self, GpuCellBuilder};
use super::driver::{BindingAccess, Buffer, BufferBinding, BufferUsage, Gpu};
use super::kernel_cache::{self, SceneWgsl};
use super::scene::{GpuScene, KernelMode, default_material_wgsl};
use crate::cells::policy;
use crate::cells::{GpuCells, required_registers};
use crate::engine::{EngineError, EngineKind, SceneInput};
use crate::render::{CellMode, CellStats, RenderJob};
use cells::{CacheKey, CellCache, CellUpload, DeferredSplit};
use sdfc_shaders::assemble::SceneFunction;
use sdfc_shaders::interpreter::split_cells::{instruction_info, mark_changed};
use sdfc_shaders::interpreter::tape::{self, GRID_SLOT, KernelRegisters, NODES_SLOT, TAPES_SLOT};
use sdfc_shaders::interpreter::{
    CODE_SLOT, ConstantLayout, InterpreterFunction, POOL_SLOT, PROGRAM_RANGES_SLOT, ProgramStorage,
    bindings, interpreter,
};
use sdfc_shaders::layout;
use sdfc_vm::program::{KernelRequirements, Module, Program};
use sdfc_vm::tape::Tape;
use sdfc_vm::wgsl_library::WgslLibrary;
use std::sync::Arc;

/// Registers of generic kernels for distances and gradients. The scenes of this repository take at most 18
/// values and 3 points, except for a 2-D shape of 6,000 clauses. With twice as many registers, software
/// Vulkan takes twice as long to compile a kernel.
const GENERIC_REGISTERS: KernelRegisters = KernelRegisters {
    values: 32,
    points: 8,
};

/// Registers of generic kernels for surfaces, whose materials are large. The scenes take at most 11 values.
/// With four times as many registers a kernel takes a minute to compile.
const GENERIC_SURFACE_REGISTERS: KernelRegisters = KernelRegisters {
    values: 16,
    points: 8,
};

/// Both must use the same encoding of registers in words.
const _: () = assert!(GENERIC_REGISTERS.name_bits() == GENERIC_SURFACE_REGISTERS.name_bits());

/// A scene's programs in an interpreter's buffers.
pub(super) struct Interpreter {
    /// The range of scenes that the kernels run.
    kernel_mode: KernelMode,
    /// The requirements that the kernels support.
    distance: KernelRequirements,
    surface: Option<KernelRequirements>,
    memory: ProgramStorage,
    /// The distance and the surface program, with their current constants.
    programs: [Option<Arc<Program>>; 2],
    /// The tapes of both programs, built on first use.
    tapes: Option<[Option<Arc<Tape>>; 2]>,
    /// The buffers of instructions and constants.
    program_buffers: [(BufferBinding, Buffer); 2],
    length: (BufferBinding, Buffer),
    cells: CellBuffers,
    /// The cells of the last image, as built on the CPU.
    cell_cache: CellCache,
    cell_builder: GpuCellBuilder,
    /// The input that the buffers of the kernels hold.
    uploaded_input: UploadedInput,
    /// The buffers that kernels read now: the program buffers, with the length or the cells.
    buffers: Vec<(BufferBinding, Buffer)>,
}

/// The input of the kernels.
#[derive(Clone, Debug, PartialEq)]
enum UploadedInput {
    /// Undecided or out of date.
    Unset,
    /// The stack programs, without tapes.
    Programs,
    /// The tapes of the whole programs, used everywhere.
    FullTapes,
    /// The tapes of cells.
    Cells(CacheKey),
}

/// Cells on the device.
#[derive(Default)]
struct CellBuffers {
    /// Nodes, tapes and grid. Each buffer only grows.
    buffers: Vec<(BufferBinding, Buffer)>,
    /// The registers of the kernels.
    registers: KernelRegisters,
}

impl GpuScene for Interpreter {
    const KIND: EngineKind = EngineKind::Interp;

    fn load(
        gpu: &Gpu,
        scene: &SceneInput<'_>,
        kernel_mode: KernelMode,
        previous: Option<Self>,
    ) -> Result<Self, EngineError> {
        let module = scene.module;
        let programs = [Some(&module.distance), module.surface.as_ref()];
        Self::upload(
            gpu,
            programs.map(|p| p.cloned().map(Arc::new)),
            kernel_mode,
            previous,
        )
    }

    fn empty_generic(gpu: &Gpu, previous: Option<Self>) -> Result<Option<Self>, EngineError> {
        let empty = Program {
            code: Vec::new(),
            pool: Vec::new(),
            patches: Vec::new(),
            slots: 0,
        };
        let programs = [Some(Arc::new(empty)), None];
        let mut interpreter = Self::upload(gpu, programs, KernelMode::Generic, previous)?;
        let (requirements, memory) = (&interpreter.distance, interpreter.memory);
        interpreter.cell_builder.warm_up(
            gpu,
            requirements,
            GENERIC_REGISTERS,
            interpreter.constant_layout(),
            memory,
        )?;
        Ok(Some(interpreter))
    }

    fn is_generic(&self) -> bool {
        self.kernel_mode == KernelMode::Generic
    }

    fn update(&mut self, gpu: &Gpu, module: &Module, _: &[f64]) -> Result<(), EngineError> {
        let new_programs = [Some(&module.distance), module.surface.as_ref()];
        let old_programs = self.programs.each_ref().map(|p| p.as_deref());
        let code = |program: Option<&Program>| program.map(|program| program.code.clone());
        if new_programs.map(code) != old_programs.map(code) {
            return Err(EngineError::SceneMismatch);
        }
        self.programs = new_programs.map(|program| program.cloned().map(Arc::new));
        // Other constants prune to other tapes.
        self.tapes = None;
        if matches!(self.uploaded_input, UploadedInput::Cells(_)) {
            self.uploaded_input = UploadedInput::Unset;
        }
        let constants = self.constant_layout().constants(existing(&self.programs));
        Ok(gpu.write(&self.program_buffers[1].1, &constants)?)
    }

    fn prepare(&mut self, gpu: &Gpu, job: Option<&RenderJob>) -> Result<bool, EngineError> {
        let planned = job.filter(|job| self.may_use_cells(job));
        let planned = planned.zip(self.registers()).and_then(|(job, registers)| {
            let on_device = cell_builder::is_supported(gpu.info(), registers)
                && match job.cells {
                    CellMode::Gpu => true,
                    CellMode::Cpu => false,
                    _ => cell_builder::splits_by_default(gpu.info()),
                };
            Some((registers, CacheKey::for_job(job, on_device)?))
        });
        let Some((registers, key)) = planned else {
            return self.upload_without_cells(gpu);
        };
        if self.uploaded_input == UploadedInput::Cells(key.clone()) {
            return Ok(false);
        }
        // Cells that exceed a buffer's limit are not used.
        let limits = gpu.info().limits;
        let buffer_limit = limits.storage_binding.min(limits.buffer);
        let tapes = self.tapes.clone().unwrap_or_default();
        let fill = self.cell_builder.buffer_fill(gpu)?;
        let upload = self
            .cell_cache
            .upload_for(&self.programs, &tapes, &key, registers, fill);
        let Some(upload) =
            upload.filter(|upload| upload.packed.max_buffer_bytes() as u64 <= buffer_limit)
        else {
            // The device no longer holds the cached cells.
            self.cell_builder.reset(CellStats::default());
            return self.upload_without_cells(gpu);
        };
        self.upload_cells(gpu, upload)?;
        self.uploaded_input = UploadedInput::Cells(key);
        Ok(true)
    }

    fn cells(&mut self, gpu: &Gpu) -> Result<CellStats, EngineError> {
        match self.uploaded_input {
            UploadedInput::Cells(_) => self.cell_builder.counts(gpu),
            UploadedInput::Unset | UploadedInput::Programs | UploadedInput::FullTapes => {
                Ok(CellStats::default())
            }
        }
    }

    fn variant(&self) -> u32 {
        if self.is_generic() {
            return kernel_cache::GENERIC_VARIANT;
        }
        if !self.runs_tapes() {
            return 0;
        }
        let KernelRegisters { values, points } = self.cells.registers;
        1 + (values << 8 | points) as u32
    }

    fn source(&self, functions: &[SceneFunction]) -> SceneWgsl {
        let mut library = WgslLibrary::default();
        let mut text = String::new();
        for function in functions {
            let (requirements, function) = match function {
                SceneFunction::Distance => (&self.distance, InterpreterFunction::Distance),
                SceneFunction::Gradient => (&self.distance, InterpreterFunction::Gradient),
                SceneFunction::Surface => (
                    self.surface.as_ref().unwrap_or(&self.distance),
                    InterpreterFunction::Surface,
                ),
            };
            let registers = match function {
                InterpreterFunction::Surface if self.is_generic() => GENERIC_SURFACE_REGISTERS,
                _ => self.cells.registers,
            };
            text.push_str(&if self.runs_tapes() {
                tape::interpreter(
                    requirements,
                    registers,
                    self.constant_layout(),
                    function,
                    &mut library,
                )
            } else {
                interpreter(requirements, function, &mut library)
            });
            text.push('\n');
        }
        let (called, calls) = library.text();
        let default_material = default_material_wgsl(functions);
        let bindings = if self.runs_tapes() {
            tape::bindings(self.memory)
        } else {
            bindings(self.memory)
        };
        SceneWgsl {
            text: format!("{bindings}\n{default_material}{called}{text}"),
            calls,
        }
    }

    fn buffers(&self) -> &[(BufferBinding, Buffer)] {
        &self.buffers
    }

    fn iterations(&self, function: SceneFunction) -> usize {
        let [distance, surface] = &self.programs;
        let program = match function {
            SceneFunction::Distance | SceneFunction::Gradient => distance,
            SceneFunction::Surface => surface,
        };
        let lookup = if self.runs_tapes() {
            MAX_LOOKUP_ITERATIONS
        } else {
            0
        };
        program.as_ref().map_or(0, |program| program.code.len()) + lookup
    }
}

/// Maximum number of iterations of the loop that looks up a cell.
const MAX_LOOKUP_ITERATIONS: usize = 10;

/// Kernels for two programs, and the memory in which they read them.
struct KernelPlan {
    kernel_mode: KernelMode,
    distance: KernelRequirements,
    surface: Option<KernelRequirements>,
    memory: ProgramStorage,
    /// Tapes of the whole programs, if generic kernels were considered.
    tapes: Option<[Option<Arc<Tape>>; 2]>,
    /// Buffers of cells, which are kept with their kernels.
    cells: CellBuffers,
}

impl KernelPlan {
    /// Chooses generic kernels if they are requested and have enough registers. Keeps the kernels of the previous
    /// scene if they support this one.
    fn new(
        programs: &[Option<Arc<Program>>; 2],
        kernel_mode: KernelMode,
        previous: Option<Interpreter>,
    ) -> Self {
        let code = instruction_counts(programs).iter().sum();
        let tapes = (kernel_mode == KernelMode::Generic).then(|| tapes(programs));
        let tape_fits = |(tape, available): (&Option<Arc<Tape>>, KernelRegisters)| {
            let needed = tape.as_ref().map(|tape| required_registers(tape));
            needed.is_none_or(|needed| {
                needed.union(available) == available && available.fits_words(code)
            })
        };
        let registers_available = [GENERIC_REGISTERS, GENERIC_SURFACE_REGISTERS];
        let is_generic = tapes
            .as_ref()
            .is_some_and(|tapes| tapes.iter().zip(registers_available).all(tape_fits));
        let previous = previous.filter(|previous| previous.is_generic() == is_generic);
        match is_generic {
            true => Self::generic(tapes, previous),
            false => Self::specialized(programs, code, tapes, previous),
        }
    }

    fn generic(tapes: Option<[Option<Arc<Tape>>; 2]>, previous: Option<Interpreter>) -> Self {
        let all_requirements = KernelRequirements::all();
        let cells = previous.map(|previous| previous.cells).unwrap_or_default();
        Self {
            kernel_mode: KernelMode::Generic,
            distance: all_requirements.clone(),
            surface: Some(all_requirements),
            memory: ProgramStorage::Storage,
            tapes,
            cells: CellBuffers {
                registers: GENERIC_REGISTERS,
                ..cells
            },
        }
    }

    fn specialized(
        programs: &[Option<Arc<Program>>; 2],
        code: usize,
        tapes: Option<[Option<Arc<Tape>>; 2]>,
        previous: Option<Interpreter>,
    ) -> Self {
        let pool = |distance: &KernelRequirements, surface: &Option<KernelRequirements>| {
            code * constant_layout(distance, surface.as_ref()).size() as usize
        };
        let [distance, surface] = programs
            .each_ref()
            .map(|p| p.as_ref().map(|p| p.requirements()));
        let distance = distance.unwrap_or_default();
        // Kernels that support this scene are kept, even if they support more.
        let reusable = previous.filter(|previous| {
            previous.distance.covers(&distance)
                && match (&previous.surface, &surface) {
                    (Some(available), Some(needed)) => available.covers(needed),
                    (None, None) => true,
                    _ => false,
                }
                && is_large_enough(
                    previous.memory,
                    code,
                    pool(&previous.distance, &previous.surface),
                )
        });
        let (distance, surface, memory, cells) = match reusable {
            Some(previous) => (
                previous.distance,
                previous.surface,
                previous.memory,
                previous.cells,
            ),
            None => {
                let memory = ProgramStorage::for_program(code, pool(&distance, &surface));
                (distance, surface, memory, CellBuffers::default())
            }
        };
        Self {
            kernel_mode: KernelMode::Specialized,
            distance,
            surface,
            memory,
            tapes,
            cells,
        }
    }
}

/// Returns the numbers of instructions of two programs.
fn instruction_counts(programs: &[Option<Arc<Program>>; 2]) -> [usize; 2] {
    let count = |program: &Option<Arc<Program>>| program.as_ref().map_or(0, |p| p.code.len());
    programs.each_ref().map(count)
}

/// Creates the buffers of instructions, of constants and of both programs' lengths, and fills them.
fn program_buffers(
    gpu: &Gpu,
    programs: &[Option<Arc<Program>>; 2],
    layout: &ConstantLayout,
    memory: ProgramStorage,
) -> Result<[(BufferBinding, Buffer); 3], EngineError> {
    let counts = instruction_counts(programs);
    let constants = layout.constants(existing(programs));
    let (usage, access, code_size, pool_size) = match memory {
        ProgramStorage::Uniform { code, pool } => (
            BufferUsage::Uniform,
            BindingAccess::Uniform,
            code as usize,
            pool as usize,
        ),
        ProgramStorage::Storage => (
            BufferUsage::Storage,
            BindingAccess::StorageRead,
            counts.iter().sum(),
            constants.len(),
        ),
    };
    let [first, second] = counts.map(|count| count as u32);
    let ranges = [first, first, first + second, 0];
    let buffer = |slot, label, usage, access, size: usize| {
        let buffer = gpu.buffer(label, usage, 16 * size.max(1) as u64)?;
        Ok::<_, EngineError>((BufferBinding { slot, access }, buffer))
    };
    let length = buffer(
        PROGRAM_RANGES_SLOT,
        "program length",
        BufferUsage::Storage,
        BindingAccess::StorageRead,
        1,
    )?;
    let code = buffer(CODE_SLOT, "code", usage, access, code_size)?;
    let pool = buffer(POOL_SLOT, "pool", usage, access, pool_size)?;
    gpu.write(&code.1, &layout.words(existing(programs)))?;
    gpu.write(&pool.1, &constants)?;
    gpu.write(&length.1, &ranges)?;
    Ok([code, pool, length])
}

impl Interpreter {
    /// Uploads programs, reusing kernels and buffers of the previous scene where possible.
    fn upload(
        gpu: &Gpu,
        programs: [Option<Arc<Program>>; 2],
        kernel_mode: KernelMode,
        mut previous: Option<Self>,
    ) -> Result<Self, EngineError> {
        let (mut cell_builder, cell_cache) = previous
            .as_mut()
            .map(|previous| {
                (
                    std::mem::take(&mut previous.cell_builder),
                    std::mem::take(&mut previous.cell_cache),
                )
            })
            .unwrap_or_default();
        let plan = KernelPlan::new(&programs, kernel_mode, previous);
        if plan.cells.buffers.is_empty() {
            cell_builder.reset(CellStats::default());
        }
        let layout = constant_layout(&plan.distance, plan.surface.as_ref());
        let [code, pool, length] = program_buffers(gpu, &programs, &layout, plan.memory)?;
        Ok(Self {
            kernel_mode: plan.kernel_mode,
            distance: plan.distance,
            surface: plan.surface,
            memory: plan.memory,
            programs,
            tapes: plan.tapes,
            program_buffers: [code, pool],
            length,
            cells: plan.cells,
            cell_cache,
            cell_builder,
            uploaded_input: UploadedInput::Unset,
            buffers: Vec::new(),
        })
    }

    /// Returns the layout of the constants in the pool buffer.
    fn constant_layout(&self) -> ConstantLayout {
        constant_layout(&self.distance, self.surface.as_ref())
    }

    /// Reports whether the current kernels run tapes.
    fn runs_tapes(&self) -> bool {
        self.is_generic() || matches!(self.uploaded_input, UploadedInput::Cells(_))
    }

    /// Uploads the whole programs. Reports whether buffers were replaced.
    fn upload_without_cells(&mut self, gpu: &Gpu) -> Result<bool, EngineError> {
        let input = if self.is_generic() {
            UploadedInput::FullTapes
        } else {
            UploadedInput::Programs
        };
        if self.uploaded_input == input {
            return Ok(false);
        }
        if self.is_generic() {
            let programs = &self.programs;
            let tapes = self.tapes.get_or_insert_with(|| tapes(programs));
            let tapes = tapes.each_ref().map(|tape| tape.as_deref());
            let base = programs[0].as_ref().map_or(0, |program| program.code.len());
            let packed = GpuCells::single_tape(tapes, base as u32, self.cells.registers);
            self.upload_cells(
                gpu,
                CellUpload {
                    packed,
                    parts: Vec::new(),
                    changed: None,
                },
            )?;
        } else {
            self.buffers = self.program_buffers.to_vec();
            self.buffers.push(self.length.clone());
        }
        self.uploaded_input = input;
        Ok(true)
    }

    /// Reports whether the settings request cells and these programs can have them.
    fn may_use_cells(&mut self, job: &RenderJob) -> bool {
        if job.cells == CellMode::Never {
            return false;
        }
        let programs = &self.programs;
        let tapes = self.tapes.get_or_insert_with(|| tapes(programs));
        let ([Some(program), _], [Some(tape), _]) = (programs, tapes) else {
            return false;
        };
        policy::uses_cells(job, program, tape) && self.registers().is_some()
    }

    /// Returns the registers of kernels for these programs' tapes, including those of the current kernels if that
    /// is possible. `None` if no kernel has as many.
    fn registers(&self) -> Option<KernelRegisters> {
        if self.is_generic() {
            return Some(GENERIC_REGISTERS);
        }
        let tapes = self.tapes.iter().flatten().flatten();
        let tapes = tapes.map(|tape| required_registers(tape));
        // A kernel with more operations needs a register for the points that these return.
        let requirements = std::iter::once(&self.distance).chain(&self.surface);
        let mut codes = requirements.flat_map(|requirements| &requirements.codes);
        let min_registers = KernelRegisters {
            values: 0,
            points: 1 + usize::from(codes.any(|code| code.returns_point())),
        };
        let needed = tapes.fold(min_registers, KernelRegisters::union);
        let code = self.programs.iter().flatten().map(|p| p.code.len()).sum();
        [needed.union(self.cells.registers), needed]
            .map(KernelRegisters::size_class)
            .into_iter()
            .find(|registers| registers.fits_words(code))
    }

    /// Returns metadata of all instructions, which a device requires to prune tapes.
    fn instruction_info(&self) -> Vec<[u32; 4]> {
        let tapes = self.tapes.iter().flatten().flatten();
        let pairs = self.programs.iter().flatten().zip(tapes);
        pairs
            .flat_map(|(program, tape)| instruction_info(program, tape))
            .collect()
    }

    /// Uploads cells, and splits the deferred ones on the device.
    fn upload_cells(&mut self, gpu: &Gpu, upload: CellUpload) -> Result<(), EngineError> {
        let CellUpload {
            packed,
            parts,
            changed,
        } = upload;
        let mut instruction_info = if parts.is_empty() {
            Vec::new()
        } else {
            self.instruction_info()
        };
        mark_changed(&mut instruction_info, changed.iter().flatten());
        let constant_layout = self.constant_layout();
        let cells = &mut self.cells;
        let storage = |slot| BufferBinding {
            slot,
            access: BindingAccess::StorageRead,
        };
        let grid = BufferBinding {
            slot: GRID_SLOT,
            access: BindingAccess::Uniform,
        };
        let [nodes_before, words_before] = packed.base_offsets.map(u64::from);
        let used = [
            256 * nodes_before + 4 * packed.nodes.len() as u64,
            8 * (words_before + packed.tapes.len() as u64),
        ];
        // Buffers cannot be empty.
        let mut capacity = used.map(|size| size.max(4));
        // An incremental update reuses buffers that already have spare capacity.
        if !parts.is_empty() && changed.is_none() {
            capacity = cell_builder::buffer_sizes(gpu.info(), capacity, instruction_info.len());
        }
        let sizes = [
            (storage(NODES_SLOT), capacity[0]),
            (storage(TAPES_SLOT), capacity[1]),
            (grid, size_of::<layout::GridUniforms>() as u64),
        ];
        for (index, (binding, size)) in sizes.into_iter().enumerate() {
            if cells
                .buffers
                .get(index)
                .is_some_and(|(_, b)| b.size() >= size)
            {
                continue;
            }
            let usage = match binding.access {
                BindingAccess::Uniform => BufferUsage::Uniform,
                _ => BufferUsage::Storage,
            };
            let buffer = gpu.buffer("cells", usage, size)?;
            match cells.buffers.get_mut(index) {
                Some(slot) => slot.1 = buffer,
                None => cells.buffers.push((binding, buffer)),
            }
        }
        gpu.write_at(&cells.buffers[0].1, 256 * nodes_before, &packed.nodes)?;
        gpu.write_at(&cells.buffers[1].1, 8 * words_before, &packed.tapes)?;
        gpu.write(&cells.buffers[2].1, &[packed.grid])?;
        cells.registers = packed.registers;
        self.buffers = self
            .program_buffers
            .iter()
            .chain(&cells.buffers)
            .cloned()
            .collect();
        if parts.is_empty() {
            self.cell_builder.reset(packed.counts);
            return Ok(());
        }
        let requirements = |part: &DeferredSplit| match &self.surface {
            Some(surface) if part.is_surface => surface,
            _ => &self.distance,
        };
        let job = cell_builder::SplitRequest {
            instruction_info,
            registers: packed.registers,
            constant_layout,
            memory: self.memory,
            program_buffers: &self.program_buffers,
            nodes: &cells.buffers[0].1,
            tapes: &cells.buffers[1].1,
            used: [used[0] / 256, used[1] / 8].map(|used| used as u32),
            is_edit: changed.is_some(),
            parts: parts
                .iter()
                .map(|part| cell_builder::ProgramSplit {
                    requirements: requirements(part),
                    method: part.method,
                    params: part.params,
                    jobs: part.jobs(),
                })
                .collect(),
            cpu_counts: packed.counts,
        };
        self.cell_builder.build(gpu, &job)
    }
}

fn is_large_enough(memory: ProgramStorage, code: usize, pool: usize) -> bool {
    match memory {
        ProgramStorage::Uniform {
            code: code_capacity,
            pool: pool_capacity,
        } => code <= code_capacity as usize && pool <= pool_capacity as usize,
        ProgramStorage::Storage => true,
    }
}

/// Compiles the tapes of both programs.
fn tapes(programs: &[Option<Arc<Program>>; 2]) -> [Option<Arc<Tape>>; 2] {
    let tape = |program: &Option<Arc<Program>>| program.as_deref().map(Tape::new).map(Arc::new);
    programs.each_ref().map(tape)
}

/// Returns the programs that exist.
fn existing(programs: &[Option<Arc<Program>>; 2]) -> impl Iterator<Item = &Program> {
    programs.iter().flatten().map(|program| &**program)
}

/// Returns the layout with room for the constants of both programs' instructions.
fn constant_layout(
    distance: &KernelRequirements,
    surface: Option<&KernelRequirements>,
) -> ConstantLayout {
    let layout = ConstantLayout::for_requirements(distance);
    surface.map_or(layout, |surface| {
        layout.union(ConstantLayout::for_requirements(surface))
    })
}
