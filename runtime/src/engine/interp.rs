//! The interpreter on a GPU: both programs of a scene as words and constants in buffers, and a
//! kernel with only the operations they need. Another scene that needs no more runs in the same
//! kernel, so an edit is a write to a buffer.
//!
//! Where cells pay, the kernel is the one that runs tapes ([`sdfc_shaders::interpreter::tape`]), and
//! a picture begins with cutting its part of space ([`cells`]): on the processor, or, where that is
//! not what runs the kernels, on the device after the first cuts ([`super::cutter`]).
//!
//! In the *general* form kernels run any scene's tape, cells or none: without, the tape of the whole
//! program is everywhere. Then no scene needs another kernel, but one whose tapes take more registers
//! than these have ([`GENERAL`]); that one gets kernels of its own.

mod cells;

use super::cutter::{self, Cutter};
use super::driver::{Form, OnDevice, SceneText, unpainted_surface};
use super::{EngineError, EngineKind, Loaded, cut, kernels};
use crate::cells::{Packed, registers};
use crate::frame::{CellStats, CellUse, Picture};
use crate::gpu::{Access, Binding, Buffer, Gpu, Usage};
use cells::{Kept, MadeFor, Part, Work};
use sdfc_shaders::assemble::SceneFunction;
use sdfc_shaders::interpreter::cut::{facts, mark};
use sdfc_shaders::interpreter::tape::{self, GRID_SLOT, NODES_SLOT, Registers, TAPES_SLOT};
use sdfc_shaders::interpreter::{
    CODE_SLOT, Function, LENGTH_SLOT, Memory, POOL_SLOT, Record, bindings, interpreter,
};
use sdfc_shaders::layout;
use sdfc_vm::library::Library;
use sdfc_vm::program::{Module, Needs, Program};
use sdfc_vm::tape::Tape;
use std::sync::Arc;

/// The registers of general kernels for distances and gradients. The scenes of this repository take 18
/// values and 3 points at most, but for a figure of 6,000 clauses; with twice as many, software Vulkan
/// compiles a kernel for twice as long.
const GENERAL: Registers = Registers {
    values: 32,
    points: 8,
};

/// Those for surfaces, whose materials are large: the scenes take 11 values at most, and with four
/// times as many a kernel takes a minute to compile.
const GENERAL_SURFACES: Registers = Registers {
    values: 16,
    points: 8,
};

/// Words name registers alike for both.
const _: () = assert!(GENERAL.bits() == GENERAL_SURFACES.bits());

/// A scene's programs in an interpreter's buffers.
pub(super) struct Interpreter {
    /// Whether kernels run any scene.
    form: Form,
    /// What the kernels are made for.
    distance: Needs,
    surface: Option<Needs>,
    memory: Memory,
    /// The programs with their present constants; the second one is that of surfaces.
    programs: [Option<Arc<Program>>; 2],
    /// Their tapes, once they are asked for.
    tapes: Option<[Option<Arc<Tape>>; 2]>,
    /// Instructions and constants.
    words: [(Binding, Buffer); 2],
    length: (Binding, Buffer),
    cells: CellBuffers,
    /// The cells of the last picture on the processor.
    kept: Kept,
    cutter: Cutter,
    /// What the buffers of kernels hold.
    reads: Reads,
    /// What kernels read now: the above, with the length or the cells.
    buffers: Vec<(Binding, Buffer)>,
}

/// What kernels read.
#[derive(Clone, Debug, PartialEq)]
enum Reads {
    /// It is not decided, or what they read is out of date.
    Nothing,
    /// Programs as they are.
    Programs,
    /// Tapes, of which the whole ones are everywhere.
    Whole,
    /// The tapes of cells.
    Cells(MadeFor),
}

/// Cells on the device.
#[derive(Default)]
struct CellBuffers {
    /// Nodes, tapes and grid, as large as was needed so far.
    buffers: Vec<(Binding, Buffer)>,
    /// What kernels are made for.
    registers: Registers,
}

impl OnDevice for Interpreter {
    const KIND: EngineKind = EngineKind::Interp;

    fn load(
        gpu: &Gpu,
        scene: &Loaded<'_>,
        form: Form,
        before: Option<Self>,
    ) -> Result<Self, EngineError> {
        let module = scene.module;
        let programs = [Some(&module.distance), module.surface.as_ref()];
        Self::of(
            gpu,
            programs.map(|p| p.cloned().map(Arc::new)),
            form,
            before,
        )
    }

    fn nothing(gpu: &Gpu, before: Option<Self>) -> Result<Option<Self>, EngineError> {
        let empty = Program {
            code: Vec::new(),
            pool: Vec::new(),
            patches: Vec::new(),
            slots: 0,
        };
        let programs = [Some(Arc::new(empty)), None];
        let mut made = Self::of(gpu, programs, Form::General, before)?;
        let (needs, memory) = (&made.distance, made.memory);
        made.cutter
            .warm_up(gpu, needs, GENERAL, made.record(), memory)?;
        Ok(Some(made))
    }

    fn is_general(&self) -> bool {
        self.form == Form::General
    }

    fn update(&mut self, gpu: &Gpu, module: &Module, _: &[f64]) -> Result<(), EngineError> {
        let now = [Some(&module.distance), module.surface.as_ref()];
        let before = self.programs.each_ref().map(|p| p.as_deref());
        let code = |program: Option<&Program>| program.map(|program| program.code.clone());
        if now.map(code) != before.map(code) {
            return Err(EngineError::AnotherScene);
        }
        self.programs = now.map(|program| program.cloned().map(Arc::new));
        // Other constants prune to other tapes.
        self.tapes = None;
        if matches!(self.reads, Reads::Cells(_)) {
            self.reads = Reads::Nothing;
        }
        let constants = self.record().constants(present(&self.programs));
        Ok(gpu.write(&self.words[1].1, &constants)?)
    }

    fn prepare(&mut self, gpu: &Gpu, picture: Option<&Picture>) -> Result<bool, EngineError> {
        let wanted = picture.filter(|picture| self.may_cut(picture));
        let wanted = wanted
            .zip(self.registers())
            .and_then(|(picture, registers)| {
                let on_device = cutter::possible(gpu.info(), registers)
                    && match picture.cells {
                        CellUse::Device => true,
                        CellUse::Processor => false,
                        _ => cutter::pays(gpu.info()),
                    };
                Some((registers, MadeFor::of(picture, on_device)?))
            });
        let Some((registers, made_for)) = wanted else {
            return self.without_cells(gpu);
        };
        if self.reads == Reads::Cells(made_for.clone()) {
            return Ok(false);
        }
        // What the device has no room for is drawn without.
        let limits = gpu.info().limits;
        let most = limits.storage_binding.min(limits.buffer);
        let tapes = self.tapes.clone().unwrap_or_default();
        let filled = self.cutter.filled(gpu)?;
        let work = self
            .kept
            .packed(&self.programs, &tapes, &made_for, registers, filled);
        let Some(work) = work.filter(|work| work.packed.largest() as u64 <= most) else {
            // What the device has is not what was kept.
            self.cutter.reset(CellStats::default());
            return self.without_cells(gpu);
        };
        self.with_cells(gpu, work)?;
        self.reads = Reads::Cells(made_for);
        Ok(true)
    }

    fn cells(&mut self, gpu: &Gpu) -> Result<CellStats, EngineError> {
        match self.reads {
            Reads::Cells(_) => self.cutter.counts(gpu),
            Reads::Nothing | Reads::Programs | Reads::Whole => Ok(CellStats::default()),
        }
    }

    fn variant(&self) -> u32 {
        if self.is_general() {
            return kernels::GENERAL;
        }
        if !self.reads_tapes() {
            return 0;
        }
        let Registers { values, points } = self.cells.registers;
        1 + (values << 8 | points) as u32
    }

    fn source(&self, functions: &[SceneFunction]) -> SceneText {
        let mut library = Library::default();
        let mut text = String::new();
        for function in functions {
            let (needs, function) = match function {
                SceneFunction::Distance => (&self.distance, Function::Distance),
                SceneFunction::Gradient => (&self.distance, Function::Gradient),
                SceneFunction::Surface => (
                    self.surface.as_ref().unwrap_or(&self.distance),
                    Function::Surface,
                ),
            };
            let registers = match function {
                Function::Surface if self.is_general() => GENERAL_SURFACES,
                _ => self.cells.registers,
            };
            text.push_str(&if self.reads_tapes() {
                tape::interpreter(needs, registers, self.record(), function, &mut library)
            } else {
                interpreter(needs, function, &mut library)
            });
            text.push('\n');
        }
        let (called, calls) = library.text();
        let unpainted = unpainted_surface(functions);
        let bindings = if self.reads_tapes() {
            tape::bindings(self.memory)
        } else {
            bindings(self.memory)
        };
        SceneText {
            text: format!("{bindings}\n{unpainted}{called}{text}"),
            calls,
        }
    }

    fn buffers(&self) -> &[(Binding, Buffer)] {
        &self.buffers
    }

    fn iterations(&self, function: SceneFunction) -> usize {
        let [distance, surface] = &self.programs;
        let program = match function {
            SceneFunction::Distance | SceneFunction::Gradient => distance,
            SceneFunction::Surface => surface,
        };
        let lookup = if self.reads_tapes() { LOOKUP } else { 0 };
        program.as_ref().map_or(0, |program| program.code.len()) + lookup
    }
}

/// The rounds of the loop that looks a cell up.
const LOOKUP: usize = 10;

impl Interpreter {
    /// These programs on a device.
    fn of(
        gpu: &Gpu,
        programs: [Option<Arc<Program>>; 2],
        form: Form,
        mut before: Option<Self>,
    ) -> Result<Self, EngineError> {
        let lengths = programs
            .each_ref()
            .map(|p| p.as_ref().map_or(0, |p| p.code.len()));
        let code = lengths.iter().sum();
        let pool = |distance: &Needs, surface: &Option<Needs>| {
            code * record(distance, surface.as_ref()).size() as usize
        };
        let (mut cutter, kept) = before
            .as_mut()
            .map(|before| {
                (
                    std::mem::take(&mut before.cutter),
                    std::mem::take(&mut before.kept),
                )
            })
            .unwrap_or_default();

        let tapes = (form == Form::General).then(|| tapes(&programs));
        let fits = |(tape, room): (&Option<Arc<Tape>>, Registers)| {
            let need = tape.as_ref().map(|tape| registers(tape));
            need.is_none_or(|need| need.join(room) == room && room.fit(code))
        };
        let rooms = [GENERAL, GENERAL_SURFACES];
        let general = tapes
            .as_ref()
            .is_some_and(|tapes| tapes.iter().zip(rooms).all(fits));
        let before = before.filter(|before| before.is_general() == general);
        let cells = |before: Option<Self>| before.map(|before| before.cells).unwrap_or_default();
        let (distance, surface, memory, cells) = if general {
            let everything = Needs::everything();
            let cells = CellBuffers {
                registers: GENERAL,
                ..cells(before)
            };
            (everything.clone(), Some(everything), Memory::Storage, cells)
        } else {
            let [distance, surface] = programs.each_ref().map(|p| p.as_ref().map(|p| p.needs()));
            let distance = distance.unwrap_or_default();
            // Kernels that do for this scene are kept, whatever else they can do.
            let kept = before.filter(|before| {
                before.distance.cover(&distance)
                    && match (&before.surface, &surface) {
                        (Some(have), Some(need)) => have.cover(need),
                        (None, None) => true,
                        _ => false,
                    }
                    && holds(before.memory, code, pool(&before.distance, &before.surface))
            });
            match kept {
                Some(before) => (before.distance, before.surface, before.memory, before.cells),
                None => {
                    let memory = Memory::for_program(code, pool(&distance, &surface));
                    (distance, surface, memory, CellBuffers::default())
                }
            }
        };
        if cells.buffers.is_empty() {
            cutter.reset(CellStats::default());
        }

        let record = record(&distance, surface.as_ref());
        let constants = record.constants(present(&programs));
        let (usage, access, code_size, pool_size) = match memory {
            Memory::Uniform { code, pool } => (
                Usage::Uniform,
                Access::Uniform,
                code as usize,
                pool as usize,
            ),
            Memory::Storage => (Usage::Storage, Access::StorageRead, code, constants.len()),
        };
        let [first, second] = lengths.map(|length| length as u32);
        let lengths = [first, first, first + second, 0];
        let buffer = |slot, label, usage, access, size: usize| {
            let buffer = gpu.buffer(label, usage, 16 * size.max(1) as u64)?;
            Ok::<_, EngineError>((Binding { slot, access }, buffer))
        };
        let length = buffer(
            LENGTH_SLOT,
            "program length",
            Usage::Storage,
            Access::StorageRead,
            1,
        )?;
        let in_memory = [
            buffer(CODE_SLOT, "code", usage, access, code_size)?,
            buffer(POOL_SLOT, "pool", usage, access, pool_size)?,
        ];
        gpu.write(&in_memory[0].1, &record.words(present(&programs)))?;
        gpu.write(&in_memory[1].1, &constants)?;
        gpu.write(&length.1, &lengths)?;
        Ok(Self {
            form: if general {
                Form::General
            } else {
                Form::Special
            },
            distance,
            surface,
            memory,
            programs,
            tapes,
            words: in_memory,
            length,
            cells,
            kept,
            cutter,
            reads: Reads::Nothing,
            buffers: Vec::new(),
        })
    }

    /// Whether kernels run tapes.
    /// How the constants lie in which kernels read them.
    fn record(&self) -> Record {
        record(&self.distance, self.surface.as_ref())
    }

    fn reads_tapes(&self) -> bool {
        self.is_general() || matches!(self.reads, Reads::Cells(_))
    }

    /// Lets kernels run whole programs; whether the buffers are others now.
    fn without_cells(&mut self, gpu: &Gpu) -> Result<bool, EngineError> {
        let wanted = if self.is_general() {
            Reads::Whole
        } else {
            Reads::Programs
        };
        if self.reads == wanted {
            return Ok(false);
        }
        if self.is_general() {
            let programs = &self.programs;
            let tapes = self.tapes.get_or_insert_with(|| tapes(programs));
            let tapes = tapes.each_ref().map(|tape| tape.as_deref());
            let base = programs[0].as_ref().map_or(0, |program| program.code.len());
            let packed = Packed::whole(tapes, base as u32, self.cells.registers);
            self.with_cells(
                gpu,
                Work {
                    packed,
                    parts: Vec::new(),
                    changed: None,
                },
            )?;
        } else {
            self.buffers = self.words.to_vec();
            self.buffers.push(self.length.clone());
        }
        self.reads = wanted;
        Ok(true)
    }

    /// Whether cells are wanted, and possible with these programs.
    fn may_cut(&mut self, picture: &Picture) -> bool {
        if picture.cells == CellUse::Never {
            return false;
        }
        let programs = &self.programs;
        let tapes = self.tapes.get_or_insert_with(|| tapes(programs));
        let ([Some(program), _], [Some(tape), _]) = (programs, tapes) else {
            return false;
        };
        cut::wanted(picture, program, tape) && self.registers().is_some()
    }

    /// The registers of kernels that run these programs' tapes, and what ran before if they can.
    fn registers(&self) -> Option<Registers> {
        if self.is_general() {
            return Some(GENERAL);
        }
        let tapes = self.tapes.iter().flatten().flatten();
        let tapes = tapes.map(|tape| registers(tape));
        // A kernel that was made for more has a place for the points that its operations give.
        let needs = std::iter::once(&self.distance).chain(&self.surface);
        let mut codes = needs.flat_map(|needs| &needs.codes);
        let least = Registers {
            values: 0,
            points: 1 + usize::from(codes.any(|code| code.gives_point())),
        };
        let own = tapes.fold(least, Registers::join);
        let code = self.programs.iter().flatten().map(|p| p.code.len()).sum();
        [own.join(self.cells.registers), own]
            .map(Registers::class)
            .into_iter()
            .find(|registers| registers.fit(code))
    }

    /// What the device has to know of all instructions to prune tapes.
    fn facts(&self) -> Vec<[u32; 4]> {
        let tapes = self.tapes.iter().flatten().flatten();
        let pairs = self.programs.iter().flatten().zip(tapes);
        pairs
            .flat_map(|(program, tape)| facts(program, tape))
            .collect()
    }

    /// Brings cells to the device, and cuts there what is left.
    fn with_cells(&mut self, gpu: &Gpu, work: Work) -> Result<(), EngineError> {
        let Work {
            packed,
            parts,
            changed,
        } = work;
        let mut facts = if parts.is_empty() {
            Vec::new()
        } else {
            self.facts()
        };
        mark(&mut facts, changed.iter().flatten());
        let record = self.record();
        let cells = &mut self.cells;
        let storage = |slot| Binding {
            slot,
            access: Access::StorageRead,
        };
        let grid = Binding {
            slot: GRID_SLOT,
            access: Access::Uniform,
        };
        let [nodes_behind, words_behind] = packed.behind.map(u64::from);
        let used = [
            256 * nodes_behind + 4 * packed.nodes.len() as u64,
            8 * (words_behind + packed.tapes.len() as u64),
        ];
        // One entry at least, for buffers cannot be empty.
        let mut room = used.map(|size| size.max(4));
        // What an edit goes on with has its room.
        if !parts.is_empty() && changed.is_none() {
            room = cutter::sizes(gpu.info(), room, facts.len());
        }
        let sizes = [
            (storage(NODES_SLOT), room[0]),
            (storage(TAPES_SLOT), room[1]),
            (grid, size_of::<layout::Grid>() as u64),
        ];
        for (at, (binding, size)) in sizes.into_iter().enumerate() {
            if cells.buffers.get(at).is_some_and(|(_, b)| b.size() >= size) {
                continue;
            }
            let usage = match binding.access {
                Access::Uniform => Usage::Uniform,
                _ => Usage::Storage,
            };
            let buffer = gpu.buffer("cells", usage, size)?;
            match cells.buffers.get_mut(at) {
                Some(place) => place.1 = buffer,
                None => cells.buffers.push((binding, buffer)),
            }
        }
        gpu.write_at(&cells.buffers[0].1, 256 * nodes_behind, &packed.nodes)?;
        gpu.write_at(&cells.buffers[1].1, 8 * words_behind, &packed.tapes)?;
        gpu.write(&cells.buffers[2].1, &[packed.grid])?;
        cells.registers = packed.registers;
        self.buffers = self.words.iter().chain(&cells.buffers).cloned().collect();
        if parts.is_empty() {
            self.cutter.reset(packed.counts);
            return Ok(());
        }
        let needs = |part: &Part| match &self.surface {
            Some(surface) if part.surface => surface,
            _ => &self.distance,
        };
        let task = cutter::Task {
            facts,
            registers: packed.registers,
            record,
            memory: self.memory,
            words: &self.words,
            nodes: &cells.buffers[0].1,
            tapes: &cells.buffers[1].1,
            used: [used[0] / 256, used[1] / 8].map(|used| used as u32),
            is_edit: changed.is_some(),
            parts: parts
                .iter()
                .map(|part| cutter::Part {
                    needs: needs(part),
                    way: part.way,
                    cut: part.cut,
                    jobs: part.jobs(),
                })
                .collect(),
            made: packed.counts,
        };
        self.cutter.run(gpu, &task)
    }
}

fn holds(memory: Memory, code: usize, pool: usize) -> bool {
    match memory {
        Memory::Uniform {
            code: most,
            pool: most_pool,
        } => code <= most as usize && pool <= most_pool as usize,
        Memory::Storage => true,
    }
}

/// The tapes of both programs.
fn tapes(programs: &[Option<Arc<Program>>; 2]) -> [Option<Arc<Tape>>; 2] {
    let tape = |program: &Option<Arc<Program>>| program.as_deref().map(Tape::of).map(Arc::new);
    programs.each_ref().map(tape)
}

/// The programs that there are.
fn present(programs: &[Option<Arc<Program>>; 2]) -> impl Iterator<Item = &Program> {
    programs.iter().flatten().map(|program| &**program)
}

/// What has room for the constants of both programs' instructions.
fn record(distance: &Needs, surface: Option<&Needs>) -> Record {
    let own = Record::of(distance);
    surface.map_or(own, |surface| own.join(Record::of(surface)))
}
