//! Cells cut on the device: what the processor's first cuts left is refined there, level after level,
//! by the kernels of [`sdfc_shaders::interpreter::cut`]. Nothing is read back in between: a kernel
//! writes how many workgroups the next dispatch has. What became of it is read once, when a picture
//! is done.
//!
//! All memory is taken beforehand, as much as is stated here and a device allows. A cell that finds no
//! room keeps the tape that it has.

use super::EngineError;
use crate::frame::CellStats;
use crate::gpu::{
    Access, Binding, Buffer, DeviceInfo, DeviceKind, Extent, Gpu, Kernel, KernelSource, Usage,
};
use sdfc_shaders::interpreter::cut::{
    self, ARGUMENTS_SLOT, COUNTS, FACTS_SLOT, SPACE_SLOT, SPACE_WORDS, WORK_SLOT, WORK_WORDS, Way,
};
use sdfc_shaders::interpreter::tape::{NODES_SLOT, Registers, TAPES_SLOT};
use sdfc_shaders::interpreter::{CODE_SLOT, Memory, POOL_SLOT, Record};
use sdfc_shaders::layout::{Cut, Job};
use sdfc_vm::program::Needs;

/// Room for so many cells that are cut: a node and a place in the list for each. 8 MiB and 1 MiB.
const NODES: u64 = 1 << 15;
/// The words of 64 children, and the tape of the cell that they are cut from.
const NODE_BYTES: u64 = 260;
/// Room for so many clauses for each of the program, and the least and the most room: 32 to 128 MiB.
/// A thousand blended boxes at 640×360 took 3,400 for each.
const CLAUSES_FOR_EACH: u64 = 1 << 15;
const CLAUSES: [u64; 2] = [1 << 22, 1 << 24];
/// Room for so many words of choices: 24 MiB.
const CHOICES: u64 = 6 << 20;
/// The cells of a dispatch have so many clauses together: walked through three times by 64
/// invocations each, some milliseconds on a small graphics card.
const BUDGET: u64 = 1 << 20;
/// So many dispatches there are, most of which find nothing left to do.
const DISPATCHES: usize = 48;
/// Kernels kept.
const MOST_KERNELS: usize = 16;

/// Where the counts of a word of space end up.
fn place(count: &str) -> usize {
    COUNTS.iter().position(|name| *name == count).unwrap_or(0)
}

/// Bytes of the list before its first cell.
const HEAD: u64 = (size_of::<Cut>() + 4 * WORK_WORDS) as u64;

/// What a kernel that cuts is made for.
#[derive(Clone, Debug, PartialEq)]
struct Programs {
    needs: Needs,
    registers: Registers,
    record: Record,
    memory: Memory,
    way: Way,
}

/// What cuts cells on a device, and what it counted.
#[derive(Default)]
pub(super) struct Cutter {
    /// By what they cut for; without that, the one that plans.
    kernels: Vec<(Option<Programs>, Kernel)>,
    facts: Option<Buffer>,
    space: Option<Buffer>,
    arguments: Option<Buffer>,
    /// Of each program.
    work: [Option<Buffer>; 2],
    /// How many of those were used, until they are read.
    unread: usize,
    counts: CellStats,
    /// How many nodes and words of tapes there is room for.
    room: [u32; 2],
    /// How many are there, once that is read.
    used: Option<[u32; 2]>,
}

/// What is in the buffers of nodes and tapes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Filled {
    /// How many nodes and words of tapes there are.
    pub(super) used: [u32; 2],
    /// How many there is room for.
    pub(super) room: [u32; 2],
}

/// What is cut.
pub(super) struct Task<'a> {
    /// Of all instructions.
    pub(super) facts: Vec<[u32; 4]>,
    /// What kernels are made for.
    pub(super) registers: Registers,
    pub(super) record: Record,
    pub(super) memory: Memory,
    /// The buffers of instructions and constants.
    pub(super) words: &'a [(Binding, Buffer); 2],
    /// The buffers of nodes and tapes.
    pub(super) nodes: &'a Buffer,
    pub(super) tapes: &'a Buffer,
    /// How many nodes and words of tapes are there already.
    pub(super) used: [u32; 2],
    /// Whether what was cut before is looked at again.
    pub(super) is_edit: bool,
    /// For each program.
    pub(super) parts: Vec<Part<'a>>,
    /// What the processor made.
    pub(super) made: CellStats,
}

/// What is cut of a program.
pub(super) struct Part<'a> {
    pub(super) needs: &'a Needs,
    pub(super) way: Way,
    pub(super) cut: Cut,
    pub(super) jobs: Vec<Job>,
}

/// Whether a picture's cells are cut on a device by themselves: where that is not the processor.
pub(super) fn pays(device: &DeviceInfo) -> bool {
    device.kind != DeviceKind::Software
}

/// Whether a device can cut cells with tapes of these registers.
pub(super) fn possible(device: &DeviceInfo, registers: Registers) -> bool {
    let limits = &device.limits;
    limits.storage_buffers >= cut::STORAGE_BUFFERS
        && limits.workgroup_invocations >= 64
        && room(device) >= HEAD + size_of::<Job>() as u64
        && cut::fits(registers)
}

/// The most bytes of a buffer.
fn room(device: &DeviceInfo) -> u64 {
    device.limits.storage_binding.min(device.limits.buffer)
}

/// How large the buffers of nodes and tapes are to be, of which so many bytes are filled, for programs
/// of so many clauses.
pub(super) fn sizes(device: &DeviceInfo, filled: [u64; 2], program: usize) -> [u64; 2] {
    let [least, most] = CLAUSES;
    let clauses = (program as u64 * CLAUSES_FOR_EACH).clamp(least, most);
    let [nodes, tapes] = filled;
    let nodes = nodes.div_ceil(256) + NODES;
    [NODE_BYTES * nodes, tapes + 8 * clauses].map(|size| size.min(room(device)))
}

impl Cutter {
    /// Cuts cells. It is done when this returns, since what runs next is timed.
    pub(super) fn run(&mut self, gpu: &Gpu, task: &Task<'_>) -> Result<(), EngineError> {
        let info = gpu.info();
        let most = room(info);
        // What was there before an edit stays in memory.
        self.counts = match task.is_edit {
            true => self.counts(gpu)?.with_fresh(task.made.fresh),
            false => task.made,
        };
        self.unread = 0;
        self.used = None;
        self.room = [
            (task.nodes.size() / NODE_BYTES) as u32,
            (task.tapes.size() / 8) as u32,
        ];
        let choices = CHOICES.min((most - 4 * SPACE_WORDS as u64) / 4);
        let mut head = [0_u32; SPACE_WORDS];
        head[place("NODES")] = task.used[0];
        head[place("TAPES")] = task.used[1];
        let head_bytes = size_of_val(&head) as u64;
        let space = grown(
            gpu,
            &mut self.space,
            Usage::Storage,
            head_bytes + 4 * choices,
        )?;
        let arguments = grown(gpu, &mut self.arguments, Usage::Arguments, 16)?;
        let facts_bytes = size_of_val(&*task.facts) as u64;
        let facts = grown(gpu, &mut self.facts, Usage::Storage, facts_bytes)?;
        gpu.write(&space, &head)?;
        gpu.write(&facts, &task.facts)?;
        let mut batch = gpu.batch();
        for (part, number) in task.parts.iter().zip(0..) {
            // What the list has no room for stays as it is.
            let places = (most - HEAD) / size_of::<Job>() as u64;
            let jobs = &part.jobs[..part.jobs.len().min(places as usize)];
            self.counts.short += (part.jobs.len() - jobs.len()) as u64;
            let places = places.min(jobs.len() as u64 + NODES);
            let bytes = HEAD + size_of::<Job>() as u64 * places;
            let work = grown(gpu, &mut self.work[number], Usage::Storage, bytes)?;
            let cut = Cut {
                nodes: self.room[0],
                tapes: self.room[1],
                choices: choices as u32,
                queue: places as u32,
                // A clause has four words of choices; some room is left for longer tapes.
                budget: BUDGET.min(choices / 4 * 3 / 4) as u32,
                per_axis: info.limits.workgroups_per_axis,
                filler: 0,
                ..part.cut
            };
            let load: u64 = jobs.iter().map(|job| choice_clauses(job.length)).sum();
            let state = [0, 0, jobs.len() as u32, load.min(u32::MAX.into()) as u32];
            gpu.write(&work, &[cut])?;
            gpu.write_at(&work, size_of::<Cut>() as u64, &state)?;
            gpu.write_at(&work, HEAD, jobs)?;

            let both = [(SPACE_SLOT, &space), (WORK_SLOT, &work)];
            let planned = [&both[..], &[(ARGUMENTS_SLOT, &arguments)]].concat();
            let own = [
                (NODES_SLOT, task.nodes),
                (TAPES_SLOT, task.tapes),
                (FACTS_SLOT, &facts),
            ];
            let words = task
                .words
                .each_ref()
                .map(|(binding, buffer)| (binding.slot, buffer));
            let cutting = [&both[..], &own, &words].concat();
            let programs = Programs {
                needs: part.needs.clone(),
                registers: task.registers,
                record: task.record,
                memory: task.memory,
                way: part.way,
            };
            let plan = gpu.bind(self.kernel(gpu, None)?, &planned)?;
            let kernel = gpu.bind(self.kernel(gpu, Some(programs))?, &cutting)?;
            for _ in 0..DISPATCHES {
                batch.dispatch(&plan, Extent::Workgroups([1, 1, 1]))?;
                batch.dispatch_indirect(&kernel, &arguments);
            }
            self.unread = number + 1;
        }
        Ok(batch.submit_and_wait()?)
    }

    /// What came of it: read the first time that somebody asks.
    pub(super) fn counts(&mut self, gpu: &Gpu) -> Result<CellStats, EngineError> {
        if let (Some(space), 1..) = (&self.space, self.unread) {
            let head: Vec<u32> = gpu.read_first(space, SPACE_WORDS)?;
            let count = |name| u64::from(head[place(name)]);
            self.counts = self.counts.and(CellStats {
                fresh: count("MADE"),
                made: count("MADE"),
                clauses: count("CLAUSES"),
                short: count("SHORT"),
            });
            for work in self.work[..self.unread].iter().flatten() {
                let front: Vec<u32> = gpu.read_first(work, HEAD as usize / 4)?;
                let state = size_of::<Cut>() / 4;
                let queue = std::mem::offset_of!(Cut, queue) / 4;
                // Those that wait when no dispatch is left.
                let listed = front[state + 2].min(front[queue]);
                self.counts.short += u64::from(listed.saturating_sub(front[state + 1]));
            }
            self.used = Some(["NODES", "TAPES"].map(|name| head[place(name)]));
        }
        self.unread = 0;
        Ok(self.counts)
    }

    /// Forgets what was counted: there are no cells of this making now.
    pub(super) fn reset(&mut self, counts: CellStats) {
        self.unread = 0;
        self.used = None;
        self.counts = counts;
    }

    /// What is in the buffers, where all cells found room and half of it is left for what edits make anew.
    pub(super) fn filled(&mut self, gpu: &Gpu) -> Result<Option<Filled>, EngineError> {
        let counts = self.counts(gpu)?;
        let filled = self.used.map(|used| Filled {
            used,
            room: self.room,
        });
        Ok(filled.filter(|Filled { used, room }| {
            counts.short == 0 && used.iter().zip(room).all(|(used, room)| 2 * used <= *room)
        }))
    }

    /// Makes the kernels that cut programs which need these, if they are not there yet and the device
    /// can run them. By intervals, only where devices cut by themselves: that kernel is large, and takes
    /// software as long to make as half of all others.
    pub(super) fn warm_up(
        &mut self,
        gpu: &Gpu,
        needs: &Needs,
        registers: Registers,
        record: Record,
        memory: Memory,
    ) -> Result<(), EngineError> {
        if !possible(gpu.info(), registers) {
            return Ok(());
        }
        self.kernel(gpu, None)?;
        let ways = [
            Some(Way::Slopes),
            pays(gpu.info()).then_some(Way::Intervals),
        ];
        for way in ways.into_iter().flatten() {
            let programs = Programs {
                needs: needs.clone(),
                registers,
                record,
                memory,
                way,
            };
            self.kernel(gpu, Some(programs))?;
        }
        Ok(())
    }

    /// The kernel that cuts cells of these programs; without, the one that plans.
    fn kernel(&mut self, gpu: &Gpu, of: Option<Programs>) -> Result<&Kernel, EngineError> {
        let known = self.kernels.iter().position(|(known, _)| *known == of);
        let at = match known {
            Some(at) => at,
            None => {
                let (label, wgsl) = match &of {
                    Some(of) => (
                        "cut",
                        cut::kernel(&of.needs, of.registers, of.record, of.memory, of.way),
                    ),
                    None => ("cut_plan", cut::plan()),
                };
                let kernel = gpu.kernel(&KernelSource {
                    label,
                    wgsl: &wgsl,
                    entry: "main",
                    bindings: &bindings(of.as_ref()),
                })?;
                if self.kernels.len() >= MOST_KERNELS {
                    // The one that plans stays, and those that were warmed up.
                    self.kernels.truncate(3);
                }
                self.kernels.push((of, kernel));
                self.kernels.len() - 1
            }
        };
        Ok(&self.kernels[at].1)
    }
}

/// The bindings of the kernel that cuts cells of these programs, or of the one that plans.
fn bindings(of: Option<&Programs>) -> Vec<Binding> {
    let binding = |access| move |slot| Binding { slot, access };
    let write = binding(Access::StorageReadWrite);
    let mut bindings = [SPACE_SLOT, WORK_SLOT].map(write).to_vec();
    let Some(of) = of else {
        bindings.push(write(ARGUMENTS_SLOT));
        return bindings;
    };
    let words = match of.memory {
        Memory::Uniform { .. } => Access::Uniform,
        Memory::Storage => Access::StorageRead,
    };
    bindings.extend([NODES_SLOT, TAPES_SLOT].map(write));
    bindings.push(binding(Access::StorageRead)(FACTS_SLOT));
    bindings.extend([CODE_SLOT, POOL_SLOT].map(binding(words)));
    bindings
}

/// How many clauses a tape counts for: choices take whole words.
fn choice_clauses(length: u32) -> u64 {
    u64::from(length).next_multiple_of(16)
}

/// A buffer of so many bytes at least, made if the one there is smaller.
fn grown(
    gpu: &Gpu,
    place: &mut Option<Buffer>,
    usage: Usage,
    size: u64,
) -> Result<Buffer, EngineError> {
    if let Some(buffer) = place.as_ref().filter(|buffer| buffer.size() >= size) {
        return Ok(buffer.clone());
    }
    // The old one goes first: both together may be too much.
    *place = None;
    let buffer = gpu.buffer("cutting", usage, size)?;
    *place = Some(buffer.clone());
    Ok(buffer)
}
