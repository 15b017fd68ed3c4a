//! The interpreter on a GPU: both programs of a scene as words and constants in buffers, and a
//! kernel with only the operations they need. Another scene that needs no more runs in the same
//! kernel, so an edit is a write to a buffer.
//!
//! Where cells pay, the kernel is the one that runs tapes ([`sdfc_shaders::interpreter::tape`]), and
//! a picture begins with cutting its part of space: on the processor, or, where that is not what runs
//! the kernels and all slopes are known, on the device after the first cuts ([`super::cutter`]).

use super::cutter::{self, Cutter};
use super::driver::{OnDevice, SceneText, unpainted_surface};
use super::{EngineError, EngineKind, Loaded, cut};
use crate::cells::{self, Cut, Packed};
use crate::frame::{CellStats, CellUse, Picture};
use crate::gpu::{Access, Binding, Buffer, Gpu, Usage};
use sdfc_shaders::assemble::SceneFunction;
use sdfc_shaders::features::Features;
use sdfc_shaders::interpreter::cut::facts;
use sdfc_shaders::interpreter::tape::{
    self, GRID_SLOT, NODES_SLOT, Registers, TAPES_SLOT, constant,
};
use sdfc_shaders::interpreter::{
    CODE_SLOT, Function, LENGTH_SLOT, Memory, POOL_SLOT, bindings, interpreter,
};
use sdfc_shaders::layout;
use sdfc_vm::encode::{encode, encode_behind};
use sdfc_vm::library::Library;
use sdfc_vm::program::{Module, Needs, Program};
use sdfc_vm::tape::Tape;

/// Constants that may be read behind the last one: an instruction's are loaded before it is known
/// how many it has.
const PADDING: usize = 4;

/// A scene's programs in an interpreter's buffers.
pub(super) struct Interpreter {
    /// What the kernels are made for.
    distance: Needs,
    surface: Option<Needs>,
    memory: Memory,
    /// The programs with their present constants; the second one is that of surfaces.
    programs: [Option<Program>; 2],
    /// Their tapes, once they are asked for.
    tapes: Option<[Option<Tape>; 2]>,
    /// Instructions and constants.
    words: [(Binding, Buffer); 2],
    length: (Binding, Buffer),
    cells: CellBuffers,
    cutter: Cutter,
    /// What kernels read now: the above, with the length or the cells.
    buffers: Vec<(Binding, Buffer)>,
}

/// All of a picture that its cells depend on.
#[derive(Clone, Debug, PartialEq)]
struct MadeFor {
    uniforms: layout::Frame,
    features: Features,
    band: Option<f32>,
    on_device: bool,
}

impl MadeFor {
    fn of(picture: &Picture, on_device: bool) -> Self {
        Self {
            on_device,
            uniforms: picture.uniforms,
            features: picture.features.clone(),
            band: picture.band,
        }
    }
}

/// Cells on the device.
#[derive(Default)]
struct CellBuffers {
    /// Nodes, tapes and grid, as large as was needed so far.
    buffers: Vec<(Binding, Buffer)>,
    /// What they were made for, if kernels read them now.
    used: Option<MadeFor>,
    /// What kernels are made for.
    registers: Registers,
}

impl OnDevice for Interpreter {
    const KIND: EngineKind = EngineKind::Interp;

    fn load(gpu: &Gpu, scene: &Loaded<'_>, before: Option<Self>) -> Result<Self, EngineError> {
        let module = scene.module;
        let surface = module.surface.as_ref();
        let distance_needs = module.distance.needs();
        let surface_needs = surface.map(|program| program.needs());
        let programs = [Some(module.distance.clone()), module.surface.clone()];
        let lengths = programs
            .each_ref()
            .map(|p| p.as_ref().map_or(0, |p| p.code.len()));
        let code = lengths.iter().sum();
        let pool = pool(module);
        let memory = Memory::for_program(code, pool.len());

        // Kernels that do for this scene are kept, whatever else they can do.
        let mut before = before;
        let cutter = before
            .as_mut()
            .map(|before| std::mem::take(&mut before.cutter));
        let kept = before.filter(|before| {
            before.distance.cover(&distance_needs)
                && match (&before.surface, &surface_needs) {
                    (Some(have), Some(need)) => have.cover(need),
                    (None, None) => true,
                    _ => false,
                }
                && holds(before.memory, code, pool.len())
        });
        let (distance_needs, surface_needs, memory, cells) = match kept {
            Some(before) => (before.distance, before.surface, before.memory, before.cells),
            None => (
                distance_needs,
                surface_needs,
                memory,
                CellBuffers::default(),
            ),
        };

        let words = words(module);
        let (usage, access, code_size, pool_size) = match memory {
            Memory::Uniform { code, pool } => (
                Usage::Uniform,
                Access::Uniform,
                code as usize,
                pool as usize,
            ),
            Memory::Storage => (Usage::Storage, Access::StorageRead, code, pool.len()),
        };
        let [first, second] = lengths.map(|length| length as u32);
        let lengths = [first, first, first + second, 0];
        let buffer = |slot, label, usage, access, size: usize| {
            let buffer = gpu.buffer(label, usage, 16 * size as u64)?;
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
        gpu.write(&in_memory[0].1, &words)?;
        gpu.write(&in_memory[1].1, &pool)?;
        gpu.write(&length.1, &lengths)?;
        let mut loaded = Self {
            distance: distance_needs,
            surface: surface_needs,
            memory,
            programs,
            tapes: None,
            words: in_memory,
            length,
            cells,
            cutter: cutter.unwrap_or_default(),
            buffers: Vec::new(),
        };
        loaded.without_cells();
        Ok(loaded)
    }

    fn update(&mut self, gpu: &Gpu, module: &Module, _: &[f64]) -> Result<(), EngineError> {
        let now = [Some(&module.distance), module.surface.as_ref()];
        let code = |program: Option<&Program>| program.map(|program| program.code.clone());
        if now.map(code) != self.programs.each_ref().map(|p| code(p.as_ref())) {
            return Err(EngineError::AnotherScene);
        }
        self.programs = now.map(|program| program.cloned());
        // Other constants prune to other tapes.
        self.tapes = None;
        self.cells.used = None;
        Ok(gpu.write(&self.words[1].1, &pool(module))?)
    }

    fn prepare(&mut self, gpu: &Gpu, picture: Option<&Picture>) -> Result<bool, EngineError> {
        let had_cells = self.has_cells();
        let wanted = picture.filter(|picture| self.may_cut(picture));
        let Some((picture, registers)) = wanted.zip(self.registers()) else {
            self.without_cells();
            return Ok(had_cells);
        };
        let on_device = cutter::possible(gpu.info(), registers)
            && match picture.cells {
                CellUse::Device => true,
                CellUse::Processor => false,
                _ => cutter::pays(gpu.info()),
            };
        let made_for = MadeFor::of(picture, on_device);
        if had_cells && self.cells.used.as_ref() == Some(&made_for) {
            return Ok(false);
        }
        // What the device has no room for is drawn without.
        let limits = gpu.info().limits;
        let most = limits.storage_binding.min(limits.buffer);
        let packed = self.packed(picture, registers, on_device);
        let Some((packed, parts)) = packed.filter(|(packed, _)| packed.largest() as u64 <= most)
        else {
            self.without_cells();
            return Ok(had_cells);
        };
        self.with_cells(gpu, &packed, &parts)?;
        self.cells.used = Some(made_for);
        Ok(true)
    }

    fn cells(&mut self, gpu: &Gpu) -> Result<CellStats, EngineError> {
        if !self.has_cells() {
            return Ok(CellStats::default());
        }
        self.cutter.counts(gpu)
    }

    fn variant(&self) -> u32 {
        if !self.has_cells() {
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
            text.push_str(&if self.has_cells() {
                tape::interpreter(needs, self.cells.registers, function, &mut library)
            } else {
                interpreter(needs, function, &mut library)
            });
            text.push('\n');
        }
        let (called, calls) = library.text();
        let unpainted = unpainted_surface(functions);
        let bindings = if self.has_cells() {
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
        let lookup = if self.has_cells() { LOOKUP } else { 0 };
        program.as_ref().map_or(0, |program| program.code.len()) + lookup
    }
}

/// The rounds of the loop that looks a cell up.
const LOOKUP: usize = 10;

impl Interpreter {
    fn has_cells(&self) -> bool {
        self.buffers.len() > 3
    }

    /// Lets kernels run whole programs.
    fn without_cells(&mut self) {
        self.cells.used = None;
        self.buffers = self.words.to_vec();
        self.buffers.push(self.length.clone());
    }

    /// Whether cells are wanted, and possible with these programs.
    fn may_cut(&mut self, picture: &Picture) -> bool {
        if picture.cells == CellUse::Never {
            return false;
        }
        let programs = &self.programs;
        let tapes: &[Option<Tape>; 2] = self
            .tapes
            .get_or_insert_with(|| programs.each_ref().map(|p| p.as_ref().map(Tape::of)));
        let [Some(program), _] = programs else {
            return false;
        };
        let [Some(tape), _] = tapes else {
            return false;
        };
        let wanted = cut::wanted(picture, program, tape);
        wanted && self.registers().is_some()
    }

    /// The registers of kernels that run these programs' tapes, and what ran before if they can.
    fn registers(&self) -> Option<Registers> {
        let tapes = self.tapes.iter().flatten().flatten().map(cells::registers);
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

    /// The cells of a picture, as words, and what of each program is left to be cut on the device.
    fn packed(
        &self,
        picture: &Picture,
        registers: Registers,
        on_device: bool,
    ) -> Option<(Packed, Vec<Part>)> {
        let space = cut::Space::of(picture)?;
        let [distance, surface] = &self.programs;
        let [distance_tape, surface_tape] = self.tapes.as_ref()?;
        let (program, tape) = (distance.as_ref()?, distance_tape.as_ref()?);
        let mut packed = Packed::new(&space.distance(), registers);
        let mut parts = Vec::new();
        let first = cut::First(&space);
        let build = |program, tape: &Tape, cut: Cut<'_>| {
            // By intervals, the processor goes to the end.
            let first_only = on_device && tape.slopes.known();
            let refine = if first_only { &first } else { cut.refine };
            cells::build(program, tape, &Cut { refine, ..cut })
        };
        let jobs = packed.add_distance(tape, &build(program, tape, space.distance()));
        if !jobs.is_empty() {
            let cut = layout::Cut {
                empty: constant(false),
                full: constant(true),
                ..space.on_device(tape, space.distance().band)
            };
            parts.push(Part {
                surface: false,
                cut,
                jobs,
            });
        }
        if let (Some(program), Some(tape)) = (surface, surface_tape)
            && picture.features.materials
        {
            // Its instructions lie behind those of the distance.
            let base = distance.as_ref()?.code.len() as u32;
            let cells = build(program, tape, space.surface());
            let jobs = packed.add_surface(tape, &cells, base);
            if !jobs.is_empty() {
                let whole = packed.grid.surface_whole;
                let cut = layout::Cut {
                    empty: whole,
                    full: whole,
                    ..space.on_device(tape, space.surface().band)
                };
                parts.push(Part {
                    surface: true,
                    cut,
                    jobs,
                });
            }
        }
        Some((packed, parts))
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
    fn with_cells(
        &mut self,
        gpu: &Gpu,
        packed: &Packed,
        parts: &[Part],
    ) -> Result<(), EngineError> {
        let facts = self.facts();
        let cells = &mut self.cells;
        let storage = |slot| Binding {
            slot,
            access: Access::StorageRead,
        };
        let grid = Binding {
            slot: GRID_SLOT,
            access: Access::Uniform,
        };
        // One entry at least, for buffers cannot be empty.
        let mut nodes = packed.nodes.clone();
        nodes.resize(nodes.len().max(1), 0);
        let mut room = [4 * nodes.len(), 8 * packed.tapes.len()].map(|size| size as u64);
        if !parts.is_empty() {
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
        gpu.write(&cells.buffers[0].1, &nodes)?;
        gpu.write(&cells.buffers[1].1, &packed.tapes)?;
        gpu.write(&cells.buffers[2].1, &[packed.grid])?;
        cells.registers = packed.registers;
        self.buffers = self.words.iter().chain(&cells.buffers).cloned().collect();
        self.cutter.reset(packed.counts);
        if parts.is_empty() {
            return Ok(());
        }
        let needs = |part: &Part| match &self.surface {
            Some(surface) if part.surface => surface,
            _ => &self.distance,
        };
        let task = cutter::Task {
            facts,
            registers: packed.registers,
            memory: self.memory,
            words: &self.words,
            nodes: (&cells.buffers[0].1, packed.nodes.len()),
            tapes: (&cells.buffers[1].1, packed.tapes.len()),
            parts: parts
                .iter()
                .map(|part| cutter::Part {
                    needs: needs(part),
                    cut: part.cut,
                    jobs: &part.jobs,
                })
                .collect(),
            made: packed.counts,
        };
        self.cutter.run(gpu, &task)
    }
}

/// What of a program's cells is left to be cut on the device.
struct Part {
    /// Whether it is the program of surfaces.
    surface: bool,
    cut: layout::Cut,
    jobs: Vec<layout::Job>,
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

/// The instructions of both programs, the second one's constants behind the first one's.
fn words(module: &Module) -> Vec<u32> {
    let mut words = encode(&module.distance.code);
    if let Some(surface) = &module.surface {
        let base = module.distance.pool.len() as u32;
        words.extend(encode_behind(&surface.code, base));
    }
    words
}

/// The constants of both programs.
fn pool(module: &Module) -> Vec<[f32; 4]> {
    let mut pool = module.distance.pool.clone();
    pool.extend(module.surface.iter().flat_map(|program| &program.pool));
    pool.resize(pool.len() + PADDING, [0.0; 4]);
    pool
}
