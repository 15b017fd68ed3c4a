//! Programs: instructions, constants, and the sources of constants that depend on parameters.
//!
//! # The machine
//! The machine has a stack of values, a stack of points, and numbered slots for values that are read more than
//! once. The top of the values is kept in a variable, the *accumulator*. The top of the points is the current
//! point. An instruction has up to four steps:
//! 1. It returns to an earlier point (`pops`) and may save the current one (`push`).
//! 2. It transforms the current point: not at all, by a translation, or by a 3×4 matrix.
//! 3. It runs an operation of the table on that point, on operands popped from the stack, and on parameters from
//!    the pool. The last operand is on top; one of two operands may be a constant instead.
//! 4. It pushes the result, or blends it into the value below. All hard and smooth minima and maxima are
//!    `s · (min(s·a, s·b) − kernel(|a − b|))`. An operation that returns a point replaces the current point.
//!
//! So a translated, rotated box that is smoothly united with the preceding shapes is one instruction. A
//! chain of unions never touches the stack in memory.
//!
//! The only jumps are those of guards ([`crate::guard`]), and they lead forward: a program of n
//! instructions runs at most n steps. The block of instructions that a guard may skip leaves the height of
//! both stacks unchanged and stores no value that is loaded after it. It only blends into the value on top.
//! A guard skips it only if the block would leave that value with the same bits.
//!
//! # Words
//! ```text
//! word 0   0‥7 opcode   8‥10 blend   11 no value   12‥13 constant operand   14‥15 point transform
//!          16‥20 pops   21‥22 values popped   23 push   24‥31 slot
//! word 1   pool index of the parameters
//! word 2   pool index of the point transform
//! word 3   pool index of the blend, or of the constant operand; for a guard, the number of instructions
//!          that it may skip
//! ```
//! The number of values popped and the existence of a result follow from the opcode. They are stored in the
//! word so that a kernel needs no lookup.

use crate::blend::BlendKernel;
use crate::row::Output;
use crate::settings::Settings;
use crate::table::{Op, ROWS};
use crate::uniform::UniformProgram;

/// Maximum number of values on the stack.
pub const MAX_STACK_VALUES: usize = 64;
/// Maximum number of points on the stack of points.
pub const MAX_STACK_POINTS: usize = 16;
/// Maximum number of slots.
pub const MAX_SLOTS: usize = 256;
/// Maximum nesting depth of guards.
pub const MAX_GUARDS: usize = 32;
/// Maximum number of instructions. Engines may allow fewer: some devices end loops after 65,535 iterations.
pub const MAX_INSTRUCTIONS: usize = 250_000;
/// Number of channels that describe a surface; see [`Opcode::Channel`].
pub const CHANNELS: usize = 9;

/// The operation of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Opcode {
    /// A row of the table.
    Op(Op),
    /// Returns the value of the slot.
    Load,
    /// Stores the value on top in the slot, and leaves it on the stack.
    Store,
    /// The value on top itself, to blend two values that are both on the stack.
    Top,
    /// Returns a component of the normal in the current point's local frame; the slot is the axis. Only in
    /// surface programs.
    Normal,
    /// Pops the value on top and stores it in a channel of the next material. The slot is the channel:
    /// albedo's three, roughness, emission's three, metallic, and the bump's height. Only in surface
    /// programs.
    Channel,
    /// Assigns to the shape on top the material of three constants in the pool. Channels that were set
    /// since the last assignment replace constants; the slot is their mask. Only in surface programs.
    Paint,
    /// Skips the next instructions where the transformed point is outside the influence radius of the
    /// shapes that they blend into the value on top ([`crate::guard`]). Its parameters are the centre of a
    /// box and the influence radius, then the box's half size and the scale.
    Guard,
}

/// The opcodes that are not rows, from the top down.
pub(crate) const MACHINE_CODES: [Opcode; 7] = [
    Opcode::Load,
    Opcode::Store,
    Opcode::Top,
    Opcode::Normal,
    Opcode::Channel,
    Opcode::Paint,
    Opcode::Guard,
];

impl Opcode {
    /// Returns the code's number.
    pub fn number(self) -> u8 {
        match self {
            Opcode::Op(op) => op as u8,
            machine => {
                let index = MACHINE_CODES.iter().position(|&code| code == machine);
                255 - index.map_or(0, |i| i as u8)
            }
        }
    }
    /// Returns the code with this number.
    pub fn from_number(number: u8) -> Option<Self> {
        MACHINE_CODES
            .get(usize::from(255 - number))
            .copied()
            .or_else(|| Op::from_code(number).map(Opcode::Op))
    }
    /// Returns the code's name in a listing.
    pub fn name(self) -> &'static str {
        match self {
            Opcode::Op(op) => op.row().name,
            Opcode::Load => "load",
            Opcode::Store => "store",
            Opcode::Top => "take",
            Opcode::Normal => "normal",
            Opcode::Channel => "channel",
            Opcode::Paint => "paint",
            Opcode::Guard => "guard",
        }
    }
    /// Returns the code with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        MACHINE_CODES
            .into_iter()
            .find(|code| code.name() == name)
            .or_else(|| Op::from_name(name).map(Opcode::Op))
    }
    /// Returns the number of values that it reads.
    pub fn arity(self) -> usize {
        match self {
            Opcode::Op(op) => op.row().arity(),
            Opcode::Load | Opcode::Normal | Opcode::Guard => 0,
            Opcode::Store | Opcode::Top | Opcode::Channel | Opcode::Paint => 1,
        }
    }
    /// Reports whether it reads the current point.
    pub fn reads_point(self) -> bool {
        match self {
            Opcode::Op(op) => op.row().reads_point(),
            Opcode::Normal | Opcode::Guard => true,
            _ => false,
        }
    }
    /// Reports whether its result is a point.
    pub fn returns_point(self) -> bool {
        matches!(self, Opcode::Op(op) if op.row().output == Output::Point)
    }
    /// Reports whether it has no value: it returns a point, only sets a channel, or is a guard.
    pub fn has_no_value(self) -> bool {
        self.returns_point() || matches!(self, Opcode::Channel | Opcode::Guard)
    }
    /// Reports whether it uses the slot field.
    pub fn has_slot(self) -> bool {
        !matches!(self, Opcode::Op(_) | Opcode::Top | Opcode::Guard)
    }
    /// Returns the number of vec4 constants that its parameters occupy.
    pub fn pool_width(self) -> usize {
        match self {
            Opcode::Op(op) => op.row().parameter_width().div_ceil(4),
            Opcode::Paint => 3,
            Opcode::Guard => 2,
            _ => 0,
        }
    }
    /// Reports whether it is only allowed in surface programs.
    pub fn is_surface(self) -> bool {
        matches!(self, Opcode::Normal | Opcode::Channel | Opcode::Paint)
    }
}

/// The transform of the current point before an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PointTransform {
    /// No transform.
    Identity,
    /// A translation by the constant at this pool index.
    Translate(u32),
    /// An affine map by the three rows from this pool index on: factors in xyz, and a shift in w.
    Affine(u32),
}

/// The sources of an operation's operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operands {
    /// All on the stack.
    Stack,
    /// The second is the x of the constant at this pool index.
    Right(u32),
    /// The first is the x of the constant at this pool index.
    Left(u32),
}

/// The destination of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Destination {
    /// The value is pushed.
    Push,
    /// The value is blended into the one below.
    Blend {
        /// Kernel of the smooth minimum.
        kernel: BlendKernel,
        /// Pool index of the sign, the second operand's sign, the width and the coefficient.
        index: u32,
    },
}

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Instruction {
    /// Opcode: a row of the table, or an operation of the machine.
    pub code: Opcode,
    /// Number of points that it pops first.
    pub pops: u8,
    /// Set if it saves the current point on the stack of points.
    pub push: bool,
    /// The transform of the current point.
    pub transform: PointTransform,
    /// The sources of its operands.
    pub operands: Operands,
    /// The destination of its value.
    pub destination: Destination,
    /// The slot, channel, axis or mask.
    pub slot: u8,
    /// Pool index of its parameters.
    pub parameters: u32,
    /// Number of instructions that a guard may skip; zero for all others.
    pub skips: u32,
}

impl Instruction {
    /// Creates an instruction that runs `code` and pushes its result.
    pub fn new(code: Opcode) -> Self {
        Self {
            code,
            pops: 0,
            push: false,
            transform: PointTransform::Identity,
            operands: Operands::Stack,
            destination: Destination::Push,
            slot: 0,
            parameters: 0,
            skips: 0,
        }
    }
    /// Reports whether it has no value; see [`Opcode::has_no_value`].
    pub fn has_no_value(&self) -> bool {
        self.code.has_no_value()
    }
    /// Returns the number of values that it pops for its operation.
    pub fn pop_count(&self) -> usize {
        self.code
            .arity()
            .saturating_sub(usize::from(self.operands != Operands::Stack))
    }
}

/// A number of the pool that depends on the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Index of the number in the pool, counted in numbers.
    pub index: u32,
    /// Index of the result of the uniform program.
    pub output: u32,
}

/// A program: one value (a distance) per point, and in a surface program also a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// The instructions, in order.
    pub code: Vec<Instruction>,
    /// The constants, in groups of four.
    pub pool: Vec<[f32; 4]>,
    /// The constants that depend on the parameters.
    pub patches: Vec<Patch>,
    /// Number of slots that it uses.
    pub slots: u32,
}

impl Program {
    /// Writes the results of the uniform program to the constants.
    pub fn patch(&mut self, uniform_values: &[f32]) {
        let pool = self.pool.as_flattened_mut();
        for patch in &self.patches {
            pool[patch.index as usize] = uniform_values[patch.output as usize];
        }
    }

    /// Reports whether the program contains raw fields, whose gradients may have any length: divided fields
    /// or coordinates.
    pub fn has_raw_fields(&self) -> bool {
        let is_raw = |op: Op| op.is_raw_distance() || matches!(op, Op::X | Op::Y | Op::Z);
        self.code
            .iter()
            .any(|i| matches!(i.code, Opcode::Op(op) if is_raw(op)))
    }

    /// Returns the features that a kernel must support to run this program.
    pub fn requirements(&self) -> KernelRequirements {
        let mut needs = KernelRequirements::default();
        let (mut depth, mut points) = (0_usize, 0_usize);
        for i in &self.code {
            needs.add(i);
            points -= usize::from(i.pops);
            points += usize::from(i.push);
            needs.points = needs.points.max(points);
            depth -= i.pop_count();
            match i.destination {
                _ if i.has_no_value() => {}
                Destination::Push => depth += 1,
                Destination::Blend { .. } => {}
            }
            needs.depth = needs.depth.max(depth);
        }
        needs.slots = self.slots as usize;
        needs
    }
}

/// The features that a kernel must support to run a program; a specialized kernel contains no others.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct KernelRequirements {
    /// The codes, each once, sorted by number.
    pub codes: Vec<Opcode>,
    /// The kernels of its blends, each once.
    pub blend_kernels: Vec<BlendKernel>,
    /// Set if a point transform is a translation.
    pub translates: bool,
    /// Set if a point transform is an affine map.
    pub maps_affinely: bool,
    /// Set if an operand is a constant.
    pub constant_operands: bool,
    /// Maximum number of values on the stack.
    pub depth: usize,
    /// Maximum number of points on the stack of points.
    pub points: usize,
    /// Number of slots.
    pub slots: usize,
}

impl KernelRequirements {
    /// Returns the requirements of any program's tape: all codes and blend kernels. A tape stores values and
    /// points in registers, so the sizes of stacks and slots stay zero.
    pub fn all() -> Self {
        let mut codes: Vec<Opcode> = (0..=u8::MAX).filter_map(Opcode::from_number).collect();
        codes.sort_by_key(|code| code.number());
        Self {
            codes,
            blend_kernels: BlendKernel::ALL.to_vec(),
            translates: true,
            maps_affinely: true,
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
        if let Destination::Blend { kernel, .. } = i.destination
            && let Err(at) = self.blend_kernels.binary_search(&kernel)
        {
            self.blend_kernels.insert(at, kernel);
        }
        self.translates |= matches!(i.transform, PointTransform::Translate(_));
        self.maps_affinely |= matches!(i.transform, PointTransform::Affine(_));
        self.constant_operands |= i.operands != Operands::Stack;
    }
    /// Reports whether a kernel with these features runs programs that require `other`.
    pub fn covers(&self, other: &Self) -> bool {
        other.codes.iter().all(|code| self.codes.contains(code))
            && other
                .blend_kernels
                .iter()
                .all(|kernel| self.blend_kernels.contains(kernel))
            && self.translates >= other.translates
            && self.maps_affinely >= other.maps_affinely
            && self.constant_operands >= other.constant_operands
            && self.depth >= other.depth
            && self.points >= other.points
            && self.slots >= other.slots
    }
    /// Returns the requirements of both together.
    pub fn union(&self, other: &Self) -> Self {
        let mut joined = self.clone();
        for code in &other.codes {
            if let Err(at) = joined
                .codes
                .binary_search_by_key(&code.number(), |c| c.number())
            {
                joined.codes.insert(at, *code);
            }
        }
        for kernel in &other.blend_kernels {
            if let Err(at) = joined.blend_kernels.binary_search(kernel) {
                joined.blend_kernels.insert(at, *kernel);
            }
        }
        joined.translates |= other.translates;
        joined.maps_affinely |= other.maps_affinely;
        joined.constant_operands |= other.constant_operands;
        joined.depth = joined.depth.max(other.depth);
        joined.points = joined.points.max(other.points);
        joined.slots = joined.slots.max(other.slots);
        joined
    }
}

/// A compiled scene: its programs, the program that computes their constants, and its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Module {
    /// The distance program.
    pub distance: Program,
    /// The program of distance and material; `None` if the scene has one constant material.
    pub surface: Option<Program>,
    /// The uniform program: it computes the constants of both programs and the numbers of the settings.
    pub uniforms: UniformProgram,
    /// The settings of the scene and of its rendering.
    pub settings: Settings,
}

impl Module {
    /// Runs the uniform program for the current parameters at this time, writes its results to both
    /// programs' constants, and returns them. A parameter changes nothing else.
    pub fn update(&mut self, time: f64) -> Vec<f64> {
        let uniform_values = self.uniforms.run(&self.settings.param_numbers(), time);
        self.settings.time = time;
        let narrow: Vec<f32> = uniform_values.iter().map(|&v| v as f32).collect();
        self.distance.patch(&narrow);
        if let Some(surface) = &mut self.surface {
            surface.patch(&narrow);
        }
        uniform_values
    }
}

/// Returns a number that depends on every row's name, inputs, output and parameters, and on the
/// machine's own codes. A program is only readable with the table that wrote it.
pub fn table_hash() -> u32 {
    let mut hash: u32 = 0x811c_9dc5;
    let mut feed = |text: &str| {
        for byte in text.bytes().chain([0]) {
            hash = (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    };
    for row in ROWS {
        feed(row.name);
        feed(&format!(
            "{:?}{:?}{:?}",
            row.inputs, row.output, row.parameters
        ));
    }
    for code in MACHINE_CODES {
        feed(code.name());
    }
    hash
}

/// The rows must leave room for the machine's own codes.
const _: () = assert!(ROWS.len() + MACHINE_CODES.len() <= 256);
