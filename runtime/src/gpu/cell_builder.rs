//! Cells split on the device. The cells of the first levels, built on the CPU, are split there level by level
//! by the kernels of [`sdfc_shaders::interpreter::split_cells`]. Nothing is read back in between: a kernel
//! writes the number of workgroups of the next dispatch. The counters are read once, after the image is done.
//!
//! All memory is allocated beforehand, within the limits stated here and those of the device. A cell for
//! which no memory remains keeps its parent's tape.

use super::driver::{
    BindingAccess, Buffer, BufferBinding, BufferUsage, DeviceInfo, DeviceKind, Extent, Gpu, Kernel,
    KernelSource,
};
use crate::engine::EngineError;
use crate::render::CellStats;
use sdfc_shaders::interpreter::split_cells::{
    self, ARGUMENTS_SLOT, COUNTERS, INSTRUCTION_INFO_SLOT, JOB_QUEUE_SLOT, JOB_QUEUE_STATE_WORDS,
    PruneMethod, SCRATCH_HEADER_WORDS, SCRATCH_SLOT,
};
use sdfc_shaders::interpreter::tape::{KernelRegisters, NODES_SLOT, TAPES_SLOT};
use sdfc_shaders::interpreter::{CODE_SLOT, ConstantLayout, POOL_SLOT, ProgramStorage};
use sdfc_shaders::layout::{CellJob, SplitParams};
use sdfc_vm::program::KernelRequirements;

/// Maximum number of cells that are split: each takes a node (8 MiB together) and a slot in the job queue (1
/// MiB).
const MAX_NEW_NODES: u64 = 1 << 15;
/// The words of 64 children, and the tape of the cell that is split.
const NODE_BYTES: u64 = 260;
/// Capacity for tapes, in clauses per instruction of the program, within the limits that follow. A thousand
/// blended boxes at 640×360 took 3,400.
const CLAUSES_PER_INSTRUCTION: u64 = 1 << 15;
/// Minimum capacity for tapes, in clauses: 32 MiB.
const MIN_TAPE_CAPACITY_CLAUSES: u64 = 1 << 22;
/// Maximum capacity for tapes, in clauses: 128 MiB.
const MAX_TAPE_CAPACITY_CLAUSES: u64 = 1 << 24;
/// Maximum number of words for choices: 24 MiB.
const MAX_CHOICE_WORDS: u64 = 6 << 20;
/// Maximum number of clauses of the cells of one dispatch. Each of 64 invocations walks through them three
/// times, some milliseconds on a small graphics card.
const MAX_DISPATCH_CLAUSES: u64 = 1 << 20;
/// Maximum number of dispatches; most of them find no jobs left.
const MAX_DISPATCHES: usize = 48;
/// Maximum number of cached kernels.
const MAX_KERNELS: usize = 16;

/// Returns the index of a counter in the scratch header.
fn counter_index(name: &str) -> usize {
    COUNTERS
        .iter()
        .position(|counter| *counter == name)
        .unwrap_or(0)
}

/// Bytes of the job queue before its first job.
const QUEUE_HEADER_BYTES: u64 = (size_of::<SplitParams>() + 4 * JOB_QUEUE_STATE_WORDS) as u64;

/// All that determines the text of a kernel that splits cells.
#[derive(Clone, Debug, PartialEq)]
struct SplitKernelKey {
    requirements: KernelRequirements,
    registers: KernelRegisters,
    constant_layout: ConstantLayout,
    memory: ProgramStorage,
    method: PruneMethod,
}

/// Builds cells on a device, and counts them.
#[derive(Default)]
pub(super) struct GpuCellBuilder {
    /// Kernels by key; without a key, the kernel that plans dispatches.
    kernels: Vec<(Option<SplitKernelKey>, Kernel)>,
    instruction_info: Option<Buffer>,
    scratch: Option<Buffer>,
    arguments: Option<Buffer>,
    /// The job queue of each program.
    job_queues: [Option<Buffer>; 2],
    /// Number of job queues in use whose counters were not read yet.
    unread: usize,
    counts: CellStats,
    /// Capacity of the buffers, in nodes and in words of tapes.
    capacity: [u32; 2],
    /// Number of nodes and words of tapes in use, once the counters were read.
    used: Option<[u32; 2]>,
}

/// Fill level of the buffers of nodes and tapes.
#[derive(Clone, Copy, Debug)]
pub(super) struct BufferFill {
    /// Number of nodes and words of tapes in use.
    pub(super) used: [u32; 2],
    /// Capacity, in nodes and in words of tapes.
    pub(super) capacity: [u32; 2],
}

/// A request to split cells.
pub(super) struct SplitRequest<'a> {
    /// Metadata of all instructions.
    pub(super) instruction_info: Vec<[u32; 4]>,
    /// The registers of the kernels.
    pub(super) registers: KernelRegisters,
    pub(super) constant_layout: ConstantLayout,
    pub(super) memory: ProgramStorage,
    /// The buffers of instructions and constants.
    pub(super) program_buffers: &'a [(BufferBinding, Buffer); 2],
    /// The buffers of nodes and tapes.
    pub(super) nodes: &'a Buffer,
    pub(super) tapes: &'a Buffer,
    /// Number of nodes and words of tapes already in use.
    pub(super) used: [u32; 2],
    /// Set if cells from before an edit are revisited.
    pub(super) is_edit: bool,
    /// One entry per program.
    pub(super) parts: Vec<ProgramSplit<'a>>,
    /// Counts of the cells built on the CPU.
    pub(super) cpu_counts: CellStats,
}

/// The cells of one program that are split.
pub(super) struct ProgramSplit<'a> {
    pub(super) requirements: &'a KernelRequirements,
    pub(super) method: PruneMethod,
    pub(super) params: SplitParams,
    pub(super) jobs: Vec<CellJob>,
}

/// Reports whether cells are split on a device by default: only on devices that are not the CPU.
pub(super) fn splits_by_default(device: &DeviceInfo) -> bool {
    device.kind != DeviceKind::Software
}

/// Reports whether a device can split cells with tapes of these registers.
pub(super) fn is_supported(device: &DeviceInfo, registers: KernelRegisters) -> bool {
    let limits = &device.limits;
    limits.storage_buffers >= split_cells::MAX_STORAGE_BUFFERS
        && limits.workgroup_invocations >= 64
        && max_buffer_bytes(device) >= QUEUE_HEADER_BYTES + size_of::<CellJob>() as u64
        && split_cells::fits(registers)
}

/// Returns the maximum size of a buffer, in bytes.
fn max_buffer_bytes(device: &DeviceInfo) -> u64 {
    device.limits.storage_binding.min(device.limits.buffer)
}

/// Returns the sizes of the buffers of nodes and tapes for programs of `program` instructions, in bytes. The
/// first `filled` bytes of each are in use.
pub(super) fn buffer_sizes(device: &DeviceInfo, filled: [u64; 2], program: usize) -> [u64; 2] {
    let clauses = (program as u64 * CLAUSES_PER_INSTRUCTION)
        .clamp(MIN_TAPE_CAPACITY_CLAUSES, MAX_TAPE_CAPACITY_CLAUSES);
    let [nodes, tapes] = filled;
    let nodes = nodes.div_ceil(256) + MAX_NEW_NODES;
    [NODE_BYTES * nodes, tapes + 8 * clauses].map(|size| size.min(max_buffer_bytes(device)))
}

impl GpuCellBuilder {
    /// Splits cells and waits until it is done, since the next dispatch is timed.
    pub(super) fn build(
        &mut self,
        gpu: &Gpu,
        request: &SplitRequest<'_>,
    ) -> Result<(), EngineError> {
        let info = gpu.info();
        let buffer_limit = max_buffer_bytes(info);
        // Cells from before an edit stay in memory.
        self.counts = match request.is_edit {
            true => self.counts(gpu)?.with_fresh(request.cpu_counts.fresh),
            false => request.cpu_counts,
        };
        self.unread = 0;
        self.used = None;
        self.capacity = [
            (request.nodes.size() / NODE_BYTES) as u32,
            (request.tapes.size() / 8) as u32,
        ];
        let choices = MAX_CHOICE_WORDS.min((buffer_limit - 4 * SCRATCH_HEADER_WORDS as u64) / 4);
        let mut head = [0_u32; SCRATCH_HEADER_WORDS];
        head[counter_index("NODES")] = request.used[0];
        head[counter_index("TAPES")] = request.used[1];
        let head_bytes = size_of_val(&head) as u64;
        let scratch = ensure_capacity(
            gpu,
            &mut self.scratch,
            BufferUsage::Storage,
            head_bytes + 4 * choices,
        )?;
        let arguments = ensure_capacity(gpu, &mut self.arguments, BufferUsage::Arguments, 16)?;
        let info_bytes = size_of_val(&*request.instruction_info) as u64;
        let instruction_info = ensure_capacity(
            gpu,
            &mut self.instruction_info,
            BufferUsage::Storage,
            info_bytes,
        )?;
        gpu.write(&scratch, &head)?;
        gpu.write(&instruction_info, &request.instruction_info)?;
        let mut batch = gpu.batch();
        for (part, number) in request.parts.iter().zip(0..) {
            // Jobs beyond the capacity of the queue are dropped: their cells keep their tapes.
            let queue_slots = (buffer_limit - QUEUE_HEADER_BYTES) / size_of::<CellJob>() as u64;
            let jobs = &part.jobs[..part.jobs.len().min(queue_slots as usize)];
            self.counts.out_of_memory += (part.jobs.len() - jobs.len()) as u64;
            let queue_slots = queue_slots.min(jobs.len() as u64 + MAX_NEW_NODES);
            let bytes = QUEUE_HEADER_BYTES + size_of::<CellJob>() as u64 * queue_slots;
            let job_queue = ensure_capacity(
                gpu,
                &mut self.job_queues[number],
                BufferUsage::Storage,
                bytes,
            )?;
            let params = SplitParams {
                node_capacity: self.capacity[0],
                tape_capacity: self.capacity[1],
                choice_capacity: choices as u32,
                queue_capacity: queue_slots as u32,
                // A clause has four words of choices; the rest is a reserve for longer tapes.
                clause_budget: MAX_DISPATCH_CLAUSES.min(choices / 4 * 3 / 4) as u32,
                max_groups_per_axis: info.limits.workgroups_per_axis,
                ..part.params
            };
            let queued_clauses: u64 = jobs
                .iter()
                .map(|queued| padded_clauses(queued.length))
                .sum();
            let state = [
                0,
                0,
                jobs.len() as u32,
                queued_clauses.min(u32::MAX.into()) as u32,
            ];
            gpu.write(&job_queue, &[params])?;
            gpu.write_at(&job_queue, size_of::<SplitParams>() as u64, &state)?;
            gpu.write_at(&job_queue, QUEUE_HEADER_BYTES, jobs)?;

            let shared = [(SCRATCH_SLOT, &scratch), (JOB_QUEUE_SLOT, &job_queue)];
            let plan_buffers = [&shared[..], &[(ARGUMENTS_SLOT, &arguments)]].concat();
            let cell_buffers = [
                (NODES_SLOT, request.nodes),
                (TAPES_SLOT, request.tapes),
                (INSTRUCTION_INFO_SLOT, &instruction_info),
            ];
            let program_buffers = request
                .program_buffers
                .each_ref()
                .map(|(binding, buffer)| (binding.slot, buffer));
            let split_buffers = [&shared[..], &cell_buffers, &program_buffers].concat();
            let key = SplitKernelKey {
                requirements: part.requirements.clone(),
                registers: request.registers,
                constant_layout: request.constant_layout,
                memory: request.memory,
                method: part.method,
            };
            let plan = gpu.bind(self.kernel(gpu, None)?, &plan_buffers)?;
            let kernel = gpu.bind(self.kernel(gpu, Some(key))?, &split_buffers)?;
            for _ in 0..MAX_DISPATCHES {
                batch.dispatch(&plan, Extent::Workgroups([1, 1, 1]))?;
                batch.dispatch_indirect(&kernel, &arguments);
            }
            self.unread = number + 1;
        }
        Ok(batch.submit_and_wait()?)
    }

    /// Returns the counts of cells, reading them back on the first call after a build.
    pub(super) fn counts(&mut self, gpu: &Gpu) -> Result<CellStats, EngineError> {
        if let (Some(scratch), 1..) = (&self.scratch, self.unread) {
            let head: Vec<u32> = gpu.read_first(scratch, SCRATCH_HEADER_WORDS)?;
            let count = |name| u64::from(head[counter_index(name)]);
            self.counts = self.counts.sum(CellStats {
                fresh: count("CELLS"),
                count: count("CELLS"),
                clauses: count("CLAUSES"),
                out_of_memory: count("OUT_OF_MEMORY"),
            });
            for job_queue in self.job_queues[..self.unread].iter().flatten() {
                let front: Vec<u32> = gpu.read_first(job_queue, QUEUE_HEADER_BYTES as usize / 4)?;
                let state = size_of::<SplitParams>() / 4;
                let queue_capacity = std::mem::offset_of!(SplitParams, queue_capacity) / 4;
                // Jobs that still wait when no dispatch is left.
                let listed = front[state + 2].min(front[queue_capacity]);
                self.counts.out_of_memory += u64::from(listed.saturating_sub(front[state + 1]));
            }
            self.used = Some(["NODES", "TAPES"].map(|name| head[counter_index(name)]));
        }
        self.unread = 0;
        Ok(self.counts)
    }

    /// Replaces the counts where no cells were split on the device.
    pub(super) fn reset(&mut self, counts: CellStats) {
        self.unread = 0;
        self.used = None;
        self.counts = counts;
    }

    /// Returns the fill level of the buffers. `None` unless all cells found room and at least half of the
    /// capacity is left for edits.
    pub(super) fn buffer_fill(&mut self, gpu: &Gpu) -> Result<Option<BufferFill>, EngineError> {
        let counts = self.counts(gpu)?;
        let filled = self.used.map(|used| BufferFill {
            used,
            capacity: self.capacity,
        });
        Ok(filled.filter(|BufferFill { used, capacity }| {
            counts.out_of_memory == 0
                && used
                    .iter()
                    .zip(capacity)
                    .all(|(used, capacity)| 2 * used <= *capacity)
        }))
    }

    /// Creates the kernels that split cells of programs with these requirements, if they are missing and the
    /// device can run them. The interval kernel is created only where devices split cells by default. It is
    /// large, and software takes as long to compile it as for half of all other kernels.
    pub(super) fn warm_up(
        &mut self,
        gpu: &Gpu,
        requirements: &KernelRequirements,
        registers: KernelRegisters,
        constant_layout: ConstantLayout,
        memory: ProgramStorage,
    ) -> Result<(), EngineError> {
        if !is_supported(gpu.info(), registers) {
            return Ok(());
        }
        self.kernel(gpu, None)?;
        let methods = [
            Some(PruneMethod::Lipschitz),
            splits_by_default(gpu.info()).then_some(PruneMethod::Interval),
        ];
        for method in methods.into_iter().flatten() {
            let key = SplitKernelKey {
                requirements: requirements.clone(),
                registers,
                constant_layout,
                memory,
                method,
            };
            self.kernel(gpu, Some(key))?;
        }
        Ok(())
    }

    /// Returns the kernel for a key; without a key, the one that plans dispatches.
    fn kernel(&mut self, gpu: &Gpu, key: Option<SplitKernelKey>) -> Result<&Kernel, EngineError> {
        let cached = self.kernels.iter().position(|(cached, _)| *cached == key);
        let index = match cached {
            Some(index) => index,
            None => {
                let (label, wgsl) = match &key {
                    Some(key) => (
                        "split_cells",
                        split_cells::kernel(
                            &key.requirements,
                            key.registers,
                            key.constant_layout,
                            key.memory,
                            key.method,
                        ),
                    ),
                    None => ("plan_dispatch", split_cells::plan()),
                };
                let kernel = gpu.kernel(&KernelSource {
                    label,
                    wgsl: &wgsl,
                    entry: "main",
                    bindings: &bindings(key.as_ref()),
                    as_written: false,
                })?;
                if self.kernels.len() >= MAX_KERNELS {
                    // The planning kernel and those from the warm-up stay.
                    self.kernels.truncate(3);
                }
                self.kernels.push((key, kernel));
                self.kernels.len() - 1
            }
        };
        Ok(&self.kernels[index].1)
    }
}

/// Returns the bindings of the kernel for a key; without a key, of the one that plans dispatches.
fn bindings(key: Option<&SplitKernelKey>) -> Vec<BufferBinding> {
    let binding = |access| move |slot| BufferBinding { slot, access };
    let write = binding(BindingAccess::StorageReadWrite);
    let mut bindings = [SCRATCH_SLOT, JOB_QUEUE_SLOT].map(write).to_vec();
    let Some(key) = key else {
        bindings.push(write(ARGUMENTS_SLOT));
        return bindings;
    };
    let words = match key.memory {
        ProgramStorage::Uniform { .. } => BindingAccess::Uniform,
        ProgramStorage::Storage => BindingAccess::StorageRead,
    };
    bindings.extend([NODES_SLOT, TAPES_SLOT].map(write));
    bindings.push(binding(BindingAccess::StorageRead)(INSTRUCTION_INFO_SLOT));
    bindings.extend([CODE_SLOT, POOL_SLOT].map(binding(words)));
    bindings
}

/// Returns the number of clauses that a tape occupies in the choices, which take whole words.
fn padded_clauses(length: u32) -> u64 {
    u64::from(length).next_multiple_of(16)
}

/// Returns a buffer of at least `size` bytes, replacing the one in the slot if it is smaller.
fn ensure_capacity(
    gpu: &Gpu,
    slot: &mut Option<Buffer>,
    usage: BufferUsage,
    size: u64,
) -> Result<Buffer, EngineError> {
    if let Some(buffer) = slot.as_ref().filter(|buffer| buffer.size() >= size) {
        return Ok(buffer.clone());
    }
    // The old buffer is dropped first: both together may exceed the memory.
    *slot = None;
    let buffer = gpu.buffer("split_cells", usage, size)?;
    *slot = Some(buffer.clone());
    Ok(buffer)
}
