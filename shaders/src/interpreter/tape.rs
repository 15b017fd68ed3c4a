//! The interpreter of tapes: the same functions as those of [`super::interpreter`], which look up the cell of
//! a point and run that cell's tape.
//!
//! # Words
//! ```text
//! a clause   x: 0‥2 kind   3‥7 point   8‥ third operand, instruction
//!            y: 0‥ result, accumulator, first operand, second operand
//! a tape     x: number of clauses that follow
//! a child    31 set: 0‥30 the node with its children
//!            30 set: no tape, but the sign of the field: 0 set where it is negative
//!            else the start of its tape
//! a node     64 children: the digits of x, y and z from the lowest up
//! ```
//! A value's register takes 6 bits, or 8 where there are more than 64 ([`KernelRegisters::name_bits`]). A
//! clause names an instruction of the program, which is stored beside. An absent register has all bits set
//! and is read as the last one, whose value is then unused. The whole program is a tape like any other.

use super::operation::{
    NumberKind, OperandNames, apply_material_rule, declare_material_rule, emit_blends,
    emit_constant_operands, emit_surface_blend, emit_transform, max_arity, max_pool_width,
    operation_case,
};
use super::{ConstantLayout, InterpreterFunction, code_bindings};
use crate::layout::GridUniforms;
use sdfc_vm::material_weights::tie_wgsl;
use sdfc_vm::program::{KernelRequirements, Opcode};
use sdfc_vm::tape::{Clause, ClauseKind};
use sdfc_vm::wgsl_library::WgslLibrary;
use std::fmt::Write;

/// Binding of the nodes.
pub const NODES_SLOT: u32 = 19;
/// Binding of the tapes.
pub const TAPES_SLOT: u32 = 20;
/// Binding of the [`GridUniforms`].
pub const GRID_SLOT: u32 = 21;

const NODE: u32 = 1 << 31;
const SIGN_ONLY: u32 = 1 << 30;

/// Magnitude of the field in cells of which only the sign is known.
const SIGN_ONLY_VALUE: &str = "1e30";

/// Number of registers of each kind in a kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct KernelRegisters {
    /// Number for values.
    pub values: usize,
    /// Number for points.
    pub points: usize,
}

impl KernelRegisters {
    /// Returns the size class of kernels: programs with similar requirements share a kernel.
    pub fn size_class(self) -> Self {
        Self {
            values: self.values.max(4).next_power_of_two(),
            points: self.points.max(1).next_power_of_two(),
        }
    }
    /// Returns the number of bits for the name of a value's register.
    pub const fn name_bits(self) -> u32 {
        if self.values > 64 { 8 } else { 6 }
    }
    /// Reports whether words can name these registers, and `instructions` instructions.
    pub fn fits_words(self, instructions: usize) -> bool {
        self.values <= 256 && self.points <= 32 && instructions <= 1 << (24 - self.name_bits())
    }
    /// Returns the registers for both.
    pub fn union(self, other: Self) -> Self {
        Self {
            values: self.values.max(other.values),
            points: self.points.max(other.points),
        }
    }
}

/// Returns the word of a child with children.
pub fn node_word(number: u32) -> u32 {
    NODE | number
}

/// Returns the word of a child of which only the sign is known.
pub fn constant_word(negative: bool) -> u32 {
    SIGN_ONLY | u32::from(negative)
}

/// Returns the words of a clause, in a program whose instructions begin at `base`; a register takes `bits`
/// bits.
pub fn clause_words(clause: &Clause, base: u32, bits: u32) -> [u32; 2] {
    let kind = match clause.kind {
        ClauseKind::Full => 0,
        ClauseKind::OpOnly => 1,
        ClauseKind::NegatedOp => 2,
        ClauseKind::Blend => 3,
        ClauseKind::Copy => 4,
        ClauseKind::Negate => 5,
    };
    let register = |r: u16| u32::from(r) & ((1 << bits) - 1);
    let [a, b, c] = clause.operands;
    [
        kind | (u32::from(clause.point) & 31) << 3
            | register(c) << 8
            | (clause.instruction + base) << (8 + bits),
        register(clause.dst)
            | register(clause.accumulator) << bits
            | register(a) << (2 * bits)
            | register(b) << (3 * bits),
    ]
}

/// Returns the bindings of the tape interpreter, and the function that looks up cells.
pub fn bindings(memory: super::ProgramStorage) -> String {
    format!(
        "{}{}@group(0) @binding({NODES_SLOT}) var<storage, read> nodes: array<u32>;
@group(0) @binding({TAPES_SLOT}) var<storage, read> tapes: array<vec2u>;
@group(0) @binding({GRID_SLOT}) var<uniform> grid: GridUniforms;

// Returns the word of the cell that contains a point, from the root on.
fn cell_at(p: vec3f, root: u32, full_tape: u32) -> u32 {{
    let position = (p - grid.low) * grid.scale;
    let end = f32(1u << grid.coordinate_bits);
    if !(all(position >= vec3f(0.0)) && all(position < vec3f(end))) {{ return full_tape; }}
    let coordinates = vec3u(position);
    var word = root;
    var bits = grid.coordinate_bits;
    while word >= {NODE}u {{
        bits -= grid.digit_bits;
        let digit = (coordinates >> vec3u(bits)) & vec3u((1u << grid.digit_bits) - 1u);
        let child = digit.x | digit.y << grid.digit_bits | digit.z << (2u * grid.digit_bits);
        word = nodes[((word & {}u) << 6u) + child];
    }}
    return word;
}}
",
        GridUniforms::WGSL,
        code_bindings(memory),
        NODE - 1,
    )
}

/// Returns the interpreter as one function, and marks the functions that it calls in `library`.
pub fn interpreter(
    requirements: &KernelRequirements,
    registers: KernelRegisters,
    layout: ConstantLayout,
    function: InterpreterFunction,
    library: &mut WgslLibrary,
) -> String {
    let numbers = function.number_kind();
    let surface = function == InterpreterFunction::Surface;
    let (value, point) = (numbers.value(), numbers.point());
    numbers.declare(library);
    let KernelRegisters { values, points } = registers;
    let has_points_array = points > 1;
    let mut text = String::new();
    let mut line = |indent: usize, content: &str| {
        let _ = writeln!(text, "{:indent$}{content}", "", indent = indent * 4);
    };
    let (head, cells) = match function {
        InterpreterFunction::Distance => (
            "fn scene_distance(origin: vec3f) -> f32 {",
            "grid.distance_root, grid.distance_full_tape",
        ),
        InterpreterFunction::Gradient => (
            "fn scene_gradient(origin: vec3f) -> vec4f {",
            "grid.distance_root, grid.distance_full_tape",
        ),
        InterpreterFunction::Surface => (
            "fn scene_surface(origin: vec3f, n: vec3f) -> Surface {",
            "grid.surface_root, grid.surface_full_tape",
        ),
    };
    line(0, head);
    line(1, &format!("let cell = cell_at(origin, {cells});"));
    if function == InterpreterFunction::Distance {
        line(
            1,
            &format!(
                "if cell >= {SIGN_ONLY}u {{ return select({SIGN_ONLY_VALUE}, -{SIGN_ONLY_VALUE}, (cell & 1u) == 1u); }}"
            ),
        );
    }
    let start = if numbers == NumberKind::Gradients {
        "DualPoint(origin, vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0))"
    } else {
        "origin"
    };
    if has_points_array {
        line(1, &format!("var points: array<{point}, {points}>;"));
        line(1, &format!("points[0] = {start};"));
    } else {
        line(1, &format!("var p = {start};"));
    }
    line(1, &format!("var values: array<{value}, {values}>;"));
    if surface {
        line(1, &format!("var materials: array<Surface, {values}>;"));
        line(1, "materials[0] = unpainted_surface();");
        line(1, &tie_wgsl("origin"));
        line(1, "var channels: array<vec4f, 9>;");
    }
    line(1, "let end = cell + tapes[cell].x;");
    line(
        1,
        "for (var index = cell + 1u; index <= end; index += 1u) {",
    );
    emit_clause(
        requirements,
        registers,
        layout,
        numbers,
        surface,
        library,
        &mut line,
    );
    line(1, "}");
    line(
        1,
        if surface {
            "return materials[0];"
        } else {
            "return values[0];"
        },
    );
    line(0, "}");
    text
}

/// Maximum number of registers that are accessed by selections among all of them. A device keeps an array in
/// hardware registers only if no computed index selects an element.
const MAX_SELECTED_REGISTERS: usize = 4;

/// Returns the expression for the value of a register.
fn read_register(values: usize, register: &str) -> String {
    if values > MAX_SELECTED_REGISTERS {
        return format!("values[{register}]");
    }
    let mut texts: Vec<String> = (0..values).map(|n| format!("values[{n}]")).collect();
    let mut bit = 1;
    while texts.len() > 1 {
        let pairs = texts.chunks(2);
        texts = pairs
            .map(|pair| match pair {
                [even, odd] => format!("select({even}, {odd}, ({register} & {bit}u) != 0u)"),
                _ => pair.concat(),
            })
            .collect();
        bit *= 2;
    }
    texts.concat()
}

/// Returns the statements that store `blended` in the register `out`.
fn write_register(values: usize) -> Vec<String> {
    if values > MAX_SELECTED_REGISTERS {
        return vec!["values[out] = blended;".to_owned()];
    }
    let select_register = |n| format!("values[{n}] = select(values[{n}], blended, out == {n}u);");
    (0..values).map(select_register).collect()
}

/// Emits the evaluation of the clause `index`, with the storage of its result.
pub(super) fn emit_clause(
    requirements: &KernelRequirements,
    registers: KernelRegisters,
    layout: ConstantLayout,
    numbers: NumberKind,
    surface: bool,
    library: &mut WgslLibrary,
    line: &mut impl FnMut(usize, &str),
) {
    let KernelRegisters { values, points } = registers;
    let bits = registers.name_bits();
    let register = |number: u32| format!("(clause.y >> {}u) & {}u", number * bits, values - 1);
    let has_points_array = points > 1;
    line(2, "let clause = tapes[index];");
    line(2, &format!("let instruction = clause.x >> {}u;", 8 + bits));
    line(2, "let word = code[instruction].x;");
    line(
        2,
        &format!("let constants = instruction * {}u;", layout.size()),
    );
    for k in 0..max_pool_width(requirements) {
        let offset = layout.parameters_offset() + k as u32;
        line(2, &format!("let k{k} = pool[constants + {offset}u];"));
    }
    if requirements.constant_operands || !requirements.blend_kernels.is_empty() {
        line(2, "let c = pool[constants];");
    }
    if has_points_array {
        let last = points - 1;
        line(2, &format!("let p = points[(clause.x >> 3u) & {last}u];"));
    }
    let transform_offset = format!("constants + {}u", layout.transform_offset());
    emit_transform(requirements, numbers, &transform_offset, library, line);
    line(2, "let kind = clause.x & 7u;");
    line(2, &format!("let out = {};", register(0)));
    line(2, &format!("let r0 = {};", register(2)));
    line(2, &format!("let v0 = {};", read_register(values, "r0")));
    if max_arity(requirements) > 1 {
        line(2, &format!("let r1 = {};", register(3)));
        line(2, &format!("let v1 = {};", read_register(values, "r1")));
    }
    if max_arity(requirements) > 2 {
        line(2, &format!("let r2 = (clause.x >> 8u) & {}u;", values - 1));
        line(2, &format!("let v2 = {};", read_register(values, "r2")));
    }
    if max_arity(requirements) > 1 {
        line(2, "var a = v0;");
        line(2, "var b = v1;");
        emit_constant_operands(requirements, numbers, line);
    }
    line(2, "var result = v0;");
    if surface {
        let first = if requirements.constant_operands {
            "materials[select(r0, r1, constant_operand == 2u)]"
        } else {
            "materials[r0]"
        };
        line(2, &format!("var result_material = {first};"));
        declare_material_rule(line);
    }
    let returns_points = requirements.codes.iter().any(|code| code.returns_point());
    if returns_points {
        line(2, "var new_point = p;");
    }
    let names = OperandNames {
        point: "new_point",
        single: "v0",
        pair: ["a", "b"],
        triple: ["v0", "v1", "v2"],
        no_constant: "constant_operand == 0u",
        materials: Some(["materials[r0]", "materials[r1]"]),
    };
    line(2, "switch select(word & 255u, 256u, kind > 2u) {");
    // In other functions than surfaces, their operations forward the operand. Guards are for whole programs.
    let is_idle = |code: &&Opcode| {
        matches!(
            code,
            Opcode::Load | Opcode::Store | Opcode::Top | Opcode::Guard
        ) || code.is_surface() && !surface
    };
    for &code in requirements.codes.iter().filter(|code| !is_idle(code)) {
        let body = operation_case(code, requirements, numbers, surface, &names, library);
        line(3, &format!("case {}u: {{ {body} }}", code.number()));
    }
    line(3, "default: {}");
    line(2, "}");
    if surface {
        apply_material_rule(requirements, &names, library, line);
    }
    let negated = match numbers {
        NumberKind::Plain | NumberKind::Gradients => "-result",
        NumberKind::Intervals => "-result.yx",
    };
    line(
        2,
        &format!("if kind == 2u || kind == 5u {{ result = {negated}; }}"),
    );
    if !requirements.blend_kernels.is_empty() {
        line(2, &format!("let r_accumulator = {};", register(1)));
        line(
            2,
            &format!(
                "let accumulator = {};",
                read_register(values, "r_accumulator")
            ),
        );
        line(
            2,
            "let blend_kernel = select(0u, (word >> 8u) & 7u, kind == 0u || kind == 3u);",
        );
    }
    emit_blends(requirements, numbers, library, line);
    if surface {
        emit_surface_blend(requirements, "materials[r_accumulator]", library, line);
    }
    let channels = surface && requirements.codes.contains(&Opcode::Channel);
    let indent = if returns_points || channels {
        line(2, "if (word & 0x800u) == 0u {");
        3
    } else {
        2
    };
    for text in write_register(values) {
        line(indent, &text);
    }
    if surface {
        line(indent, "materials[out] = result_material;");
    }
    if returns_points {
        let condition = if channels {
            format!(" if (word & 255u) != {}u", Opcode::Channel.number())
        } else {
            String::new()
        };
        line(2, &format!("}} else{condition} {{"));
        line(
            3,
            &format!("points[clause.y & {}u] = new_point;", points - 1),
        );
    }
    if returns_points || channels {
        line(2, "}");
    }
}
