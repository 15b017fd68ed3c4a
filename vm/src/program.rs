//! A program: instructions, constants, and what fills the constants in when a parameter changes.
//!
//! # The machine
//! A stack of values whose top is kept in a variable, a current point on a stack of points, and
//! numbered slots for values that are read more than once. An instruction does up to four things:
//! 1. it goes back to an earlier point (`pops`) and may keep the current one for later (`push`);
//! 2. it looks at the current point through a frame: as it is, moved, or mapped by a 3×4 matrix;
//! 3. it runs an operation of the table on that point, on operands popped from the stack (the last
//!    one on top; one of two may be a constant instead), and on parameters from the pool;
//! 4. it pushes the result, or blends it into the value below: all hard and smooth minima and
//!    maxima are `s · (min(s·a, s·b) − kernel(|a − b|))`. An operation that gives a point replaces
//!    the current point.
//!
//! So a moved, rotated box that is smoothly united with what came before is one instruction, and a
//! chain of unions never touches the stack in memory.
//!
//! The only jumps are those of guards ([`crate::guard`]), and they lead forward: a program of n
//! instructions runs n steps at most. The block of instructions that a guard may skip leaves both
//! stacks as high as it found them and keeps nothing for later; it only blends into the value on
//! top, which is what it gives back, in every bit, wherever it is skipped.
//!
//! # Words
//! ```text
//! word 0   0‥7 opcode   8‥10 blend   11 gives no value   12‥13 constant operand   14‥15 frame
//!          16‥20 pops   21‥22 values taken   23 push   24‥31 slot
//! word 1   pool index of the parameters
//! word 2   pool index of the frame
//! word 3   pool index of the blend, or of the constant operand; for a guard, how many instructions
//!          it may skip
//! ```
//! The values taken and whether there is a result follow from the opcode; they stand in the word so
//! that a kernel need not look them up.

use crate::kernel::Kernel;
use crate::row::Output;
use crate::settings::Settings;
use crate::table::{Op, ROWS};
use crate::tape::steep::is_raw;
use crate::uniform::UniformProgram;

/// The most values on the stack at once.
pub const MAX_DEPTH: usize = 64;
/// The most points on their stack at once.
pub const MAX_POINTS: usize = 16;
/// The most slots.
pub const MAX_SLOTS: usize = 256;
/// The most guards whose blocks lie in one another.
pub const MAX_GUARDS: usize = 32;
/// The most instructions. Engines may allow fewer: some devices end loops after 65,535 rounds.
pub const MAX_INSTRUCTIONS: usize = 250_000;
/// How many numbers describe a surface; see [`Code::Channel`].
pub const CHANNELS: usize = 9;

/// What an instruction runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Code {
    /// A row of the table.
    Op(Op),
    /// The value of the slot.
    Load,
    /// Keeps the value on top in the slot, and leaves it where it is.
    Store,
    /// The value on top itself: for blending two values that are both on the stack.
    Take,
    /// A component of the normal in the current point's frame; the slot says which. Only in
    /// programs of surfaces.
    Normal,
    /// Takes the value on top away and makes it a number of the next material: the slot says which
    /// of albedo's three, roughness, emission's three, metallic, and the bump's height. Only in
    /// programs of surfaces.
    Channel,
    /// Gives the shape on top the material of three constants in the pool, with the channels set
    /// since the last one in place of them; the slot is a mask of those. Only in programs of
    /// surfaces.
    Paint,
    /// Skips the instructions behind it where the point, through the frame, lies beyond the reach of
    /// what they blend into the value on top ([`crate::guard`]). Its parameters are the middle of a
    /// box and the reach, then the box's half size and the factor.
    Guard,
}

/// The opcodes that are not rows, from the top down.
pub(crate) const MACHINE: [Code; 7] = [
    Code::Load,
    Code::Store,
    Code::Take,
    Code::Normal,
    Code::Channel,
    Code::Paint,
    Code::Guard,
];

impl Code {
    /// Its number.
    pub fn number(self) -> u8 {
        match self {
            Code::Op(op) => op as u8,
            machine => {
                let index = MACHINE.iter().position(|&code| code == machine);
                255 - index.map_or(0, |i| i as u8)
            }
        }
    }
    /// The code with this number.
    pub fn from_number(number: u8) -> Option<Self> {
        MACHINE
            .get(usize::from(255 - number))
            .copied()
            .or_else(|| Op::from_code(number).map(Code::Op))
    }
    /// Its name in a listing.
    pub fn name(self) -> &'static str {
        match self {
            Code::Op(op) => op.row().name,
            Code::Load => "load",
            Code::Store => "store",
            Code::Take => "take",
            Code::Normal => "normal",
            Code::Channel => "channel",
            Code::Paint => "paint",
            Code::Guard => "guard",
        }
    }
    /// The code of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        MACHINE
            .into_iter()
            .find(|code| code.name() == name)
            .or_else(|| Op::from_name(name).map(Code::Op))
    }
    /// How many values it reads.
    pub fn arity(self) -> usize {
        match self {
            Code::Op(op) => op.row().arity(),
            Code::Load | Code::Normal | Code::Guard => 0,
            Code::Store | Code::Take | Code::Channel | Code::Paint => 1,
        }
    }
    /// Whether it reads the current point.
    pub fn reads_point(self) -> bool {
        match self {
            Code::Op(op) => op.row().reads_point(),
            Code::Normal | Code::Guard => true,
            _ => false,
        }
    }
    /// Whether its result is a point.
    pub fn gives_point(self) -> bool {
        matches!(self, Code::Op(op) if op.row().output == Output::Point)
    }
    /// Whether it leaves no value: it gives a point, only sets a channel, or decides what runs.
    pub fn gives_none(self) -> bool {
        self.gives_point() || matches!(self, Code::Channel | Code::Guard)
    }
    /// Whether its slot field says something.
    pub fn has_slot(self) -> bool {
        !matches!(self, Code::Op(_) | Code::Take | Code::Guard)
    }
    /// How many vec4 constants its parameters take.
    pub fn pool_width(self) -> usize {
        match self {
            Code::Op(op) => op.row().parameter_width().div_ceil(4),
            Code::Paint => 3,
            Code::Guard => 2,
            _ => 0,
        }
    }
    /// Whether only programs of surfaces may hold it.
    pub fn is_surface(self) -> bool {
        matches!(self, Code::Normal | Code::Channel | Code::Paint)
    }
}

/// Through what an instruction looks at the current point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Frame {
    /// As it is.
    Same,
    /// Moved by the constant at this pool index.
    Moved(u32),
    /// Mapped by the three rows from this pool index on: factors, and a shift in w.
    Mapped(u32),
}

/// Where a two-operand operation finds its operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operands {
    /// All on the stack.
    Stack,
    /// The second is the x of the constant at this pool index.
    Right(u32),
    /// The first is the x of the constant at this pool index.
    Left(u32),
}

/// What becomes of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Place {
    /// It is pushed.
    Push,
    /// It is blended into the value below.
    Blend {
        /// The kernel.
        kernel: Kernel,
        /// Where sign, sign of the second operand, width and coefficient lie in the pool.
        index: u32,
    },
}

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Instruction {
    /// What it runs.
    pub code: Code,
    /// How many points it goes back first.
    pub pops: u8,
    /// Whether it keeps the current point for later.
    pub push: bool,
    /// Through what it looks at the point.
    pub frame: Frame,
    /// Where its operands are.
    pub operands: Operands,
    /// What becomes of its value.
    pub place: Place,
    /// The slot, channel, axis or mask.
    pub slot: u8,
    /// Where its parameters lie in the pool.
    pub parameters: u32,
    /// How many instructions a guard may skip; zero for all others.
    pub skips: u32,
}

impl Instruction {
    /// An instruction that runs `code` and pushes its result.
    pub fn new(code: Code) -> Self {
        Self {
            code,
            pops: 0,
            push: false,
            frame: Frame::Same,
            operands: Operands::Stack,
            place: Place::Push,
            slot: 0,
            parameters: 0,
            skips: 0,
        }
    }
    /// Whether it leaves no value; see [`Code::gives_none`].
    pub fn gives_none(&self) -> bool {
        self.code.gives_none()
    }
    /// How many values it takes off the stack for its operation.
    pub fn taken(&self) -> usize {
        self.code
            .arity()
            .saturating_sub(usize::from(self.operands != Operands::Stack))
    }
}

/// A number of the pool that follows the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Which number of the pool, counted in numbers.
    pub at: u32,
    /// Which result of the uniform program.
    pub output: u32,
}

/// A program: one value (a distance) per point, and in a program of surfaces a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// The instructions, in order.
    pub code: Vec<Instruction>,
    /// The constants, by fours.
    pub pool: Vec<[f32; 4]>,
    /// Which of them follow the parameters.
    pub patches: Vec<Patch>,
    /// How many slots it uses.
    pub slots: u32,
}

impl Program {
    /// Writes the results of the uniform program into the constants.
    pub fn patch(&mut self, outputs: &[f32]) {
        let pool = self.pool.as_flattened_mut();
        for patch in &self.patches {
            pool[patch.at as usize] = outputs[patch.output as usize];
        }
    }

    /// Reports whether it holds raw fields, whose gradients may be of any length: steps of them, or coordinates.
    pub fn is_raw(&self) -> bool {
        let is_raw = |op| is_raw(op) || matches!(op, Op::X | Op::Y | Op::Z);
        self.code
            .iter()
            .any(|i| matches!(i.code, Code::Op(op) if is_raw(op)))
    }

    /// What a kernel has to provide to run this program.
    pub fn needs(&self) -> Needs {
        let mut needs = Needs::default();
        let (mut depth, mut points) = (0_usize, 0_usize);
        for i in &self.code {
            needs.add(i);
            points -= usize::from(i.pops);
            points += usize::from(i.push);
            needs.points = needs.points.max(points);
            depth -= i.taken();
            match i.place {
                _ if i.gives_none() => {}
                Place::Push => depth += 1,
                Place::Blend { .. } => {}
            }
            needs.depth = needs.depth.max(depth);
        }
        needs.slots = self.slots as usize;
        needs
    }
}

/// What a kernel has to provide to run a program: it contains nothing else.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Needs {
    /// The codes, each once, by number.
    pub codes: Vec<Code>,
    /// The kernels of its blends, each once.
    pub kernels: Vec<Kernel>,
    /// Whether a frame moves.
    pub moved: bool,
    /// Whether a frame maps.
    pub mapped: bool,
    /// Whether an operand is a constant.
    pub constant_operands: bool,
    /// The most values on the stack.
    pub depth: usize,
    /// The most points kept.
    pub points: usize,
    /// The slots.
    pub slots: usize,
}

impl Needs {
    /// What runs any program's tape: all codes and kernels. How much is kept of values and points
    /// is for a tape's registers to say, so nothing of that is counted here.
    pub fn everything() -> Self {
        let mut codes: Vec<Code> = (0..=u8::MAX).filter_map(Code::from_number).collect();
        codes.sort_by_key(|code| code.number());
        Self {
            codes,
            kernels: Kernel::ALL.to_vec(),
            moved: true,
            mapped: true,
            constant_operands: true,
            ..Self::default()
        }
    }
    fn add(&mut self, i: &Instruction) {
        if let Err(at) = self
            .codes
            .binary_search_by_key(&i.code.number(), |code| code.number())
        {
            self.codes.insert(at, i.code);
        }
        if let Place::Blend { kernel, .. } = i.place
            && let Err(at) = self.kernels.binary_search(&kernel)
        {
            self.kernels.insert(at, kernel);
        }
        self.moved |= matches!(i.frame, Frame::Moved(_));
        self.mapped |= matches!(i.frame, Frame::Mapped(_));
        self.constant_operands |= i.operands != Operands::Stack;
    }
    /// Whether a kernel made for `self` runs programs that need `other`.
    pub fn cover(&self, other: &Self) -> bool {
        other.codes.iter().all(|code| self.codes.contains(code))
            && other
                .kernels
                .iter()
                .all(|kernel| self.kernels.contains(kernel))
            && self.moved >= other.moved
            && self.mapped >= other.mapped
            && self.constant_operands >= other.constant_operands
            && self.depth >= other.depth
            && self.points >= other.points
            && self.slots >= other.slots
    }
    /// What both need together.
    pub fn join(&self, other: &Self) -> Self {
        let mut joined = self.clone();
        for code in &other.codes {
            if let Err(at) = joined
                .codes
                .binary_search_by_key(&code.number(), |c| c.number())
            {
                joined.codes.insert(at, *code);
            }
        }
        for kernel in &other.kernels {
            if let Err(at) = joined.kernels.binary_search(kernel) {
                joined.kernels.insert(at, *kernel);
            }
        }
        joined.moved |= other.moved;
        joined.mapped |= other.mapped;
        joined.constant_operands |= other.constant_operands;
        joined.depth = joined.depth.max(other.depth);
        joined.points = joined.points.max(other.points);
        joined.slots = joined.slots.max(other.slots);
        joined
    }
}

/// A scene, compiled: its programs, what feeds their constants, and how it is to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Module {
    /// The distance.
    pub distance: Program,
    /// The distance and the material; `None` where all of the scene has one constant material.
    pub surface: Option<Program>,
    /// What the constants of both, and the settings' numbers, are computed by.
    pub uniforms: UniformProgram,
    /// How it is drawn.
    pub settings: Settings,
}

impl Module {
    /// Runs the uniform program for the present parameters at this time, writes the results into
    /// both programs' constants, and gives them. Nothing else changes with a parameter.
    pub fn update(&mut self, time: f64) -> Vec<f64> {
        let outputs = self.uniforms.run(&self.settings.param_numbers(), time);
        self.settings.time = time;
        let narrow: Vec<f32> = outputs.iter().map(|&v| v as f32).collect();
        self.distance.patch(&narrow);
        if let Some(surface) = &mut self.surface {
            surface.patch(&narrow);
        }
        outputs
    }
}

/// The rows must leave room for the machine's own codes.
const _: () = assert!(ROWS.len() + MACHINE.len() <= 256);
