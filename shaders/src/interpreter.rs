//! The interpreter: a loop that runs the words of a program. Its WGSL functions have the names and types of
//! those generated for a scene.
//!
//! The text contains only what its programs require: the opcodes, the blend kernels, point transforms, a
//! stack, saved points and slots. Constants are loaded before the `switch` and results are stored after it,
//! since software devices run every `case`. For the same reason the stack's bookkeeping is free of branches.
//! The word layout is described in [`sdfc_vm::program`]. A guard continues the loop after its block; each
//! lane skips individually.

mod constant_layout;
mod operation;
pub mod split_cells;
pub mod tape;

pub use constant_layout::ConstantLayout;

use operation::{
    NumberKind, OperandNames, apply_material_rule, declare_material_rule, emit_blends,
    emit_constant_operands, emit_surface_blend, emit_transform, max_arity, max_pool_width,
    operation_case,
};
use sdfc_vm::material_weights::tie_wgsl;
use sdfc_vm::program::KernelRequirements;
use sdfc_vm::wgsl_library::WgslLibrary;
use std::fmt::Write;

/// Binding of the instructions.
pub const CODE_SLOT: u32 = 16;
/// Binding of the constants.
pub const POOL_SLOT: u32 = 17;
/// Binding of the programs' ranges among the instructions: the distance's from 0 to x, that of surfaces from
/// y to z. They are in storage: if the end of a loop depended on a uniform, software Vulkan would compile the
/// kernel again for each new value.
pub const PROGRAM_RANGES_SLOT: u32 = 18;

/// Address space of instructions and constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ProgramStorage {
    /// Uniform buffers of fixed sizes, which all lanes of a device read at once; at most 4,096 instructions
    /// and 4,096 constants.
    Uniform {
        /// Number of instructions.
        code: u32,
        /// Number of constants.
        pool: u32,
    },
    /// Storage buffers.
    Storage,
}

impl ProgramStorage {
    /// Returns the smallest storage for programs with these numbers of instructions and constants.
    pub fn for_program(code: usize, pool: usize) -> Self {
        let size_class = |n: usize| {
            [64, 256, 1024, 4096]
                .into_iter()
                .find(|&size| n <= size as usize)
        };
        match (size_class(code), size_class(pool)) {
            (Some(code), Some(pool)) => Self::Uniform { code, pool },
            _ => Self::Storage,
        }
    }
}

/// A function of the scene that the interpreter implements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InterpreterFunction {
    /// `scene_distance(p: vec3f) -> f32`
    Distance,
    /// `scene_gradient(p: vec3f) -> vec4f`
    Gradient,
    /// `scene_surface(p: vec3f, n: vec3f) -> Surface`
    Surface,
}

impl InterpreterFunction {
    /// Returns the kind of its numbers.
    fn number_kind(self) -> NumberKind {
        match self {
            Self::Distance => NumberKind::Plain,
            Self::Gradient | Self::Surface => NumberKind::Gradients,
        }
    }
}

/// Returns the bindings of the stack interpreter.
pub fn bindings(memory: ProgramStorage) -> String {
    format!(
        "{}@group(0) @binding({PROGRAM_RANGES_SLOT}) var<storage, read> program_ranges: vec4u;
",
        code_bindings(memory)
    )
}

/// Returns the bindings of both interpreters.
fn code_bindings(memory: ProgramStorage) -> String {
    let (code, pool) = match memory {
        ProgramStorage::Uniform { code, pool } => (
            format!("var<uniform> code: array<vec4u, {code}>"),
            format!("var<uniform> pool: array<vec4f, {pool}>"),
        ),
        ProgramStorage::Storage => (
            "var<storage, read> code: array<vec4u>".to_owned(),
            "var<storage, read> pool: array<vec4f>".to_owned(),
        ),
    };
    format!(
        "@group(0) @binding({CODE_SLOT}) {code};
@group(0) @binding({POOL_SLOT}) {pool};
"
    )
}

/// Returns the interpreter as one function, and marks the functions that it calls in `library`.
pub fn interpreter(
    requirements: &KernelRequirements,
    function: InterpreterFunction,
    library: &mut WgslLibrary,
) -> String {
    let numbers = function.number_kind();
    let surface = function == InterpreterFunction::Surface;
    let (value, point) = (numbers.value(), numbers.point());
    numbers.declare(library);
    // One entry more than the depth: the top is always written above the stack, even if it does not stay
    // there.
    let stack = requirements.depth > 1;
    let size = (requirements.depth + 1).next_power_of_two();
    let mut text = String::new();
    let mut line = |indent: usize, content: &str| {
        let _ = writeln!(text, "{:indent$}{content}", "", indent = indent * 4);
    };
    line(
        0,
        match function {
            InterpreterFunction::Distance => "fn scene_distance(origin: vec3f) -> f32 {",
            InterpreterFunction::Gradient => "fn scene_gradient(origin: vec3f) -> vec4f {",
            InterpreterFunction::Surface => {
                "fn scene_surface(origin: vec3f, n: vec3f) -> Surface {"
            }
        },
    );
    if numbers == NumberKind::Gradients {
        line(
            1,
            "var p = DualPoint(origin, vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0));",
        );
    } else {
        line(1, "var p = origin;");
    }
    line(1, &format!("var top = {value}();"));
    if stack {
        line(1, &format!("var stack: array<{value}, {size}>;"));
        line(1, "var depth = 0u;");
    }
    if requirements.points > 0 {
        line(
            1,
            &format!(
                "var points: array<{point}, {}>;",
                requirements.points.next_power_of_two()
            ),
        );
        line(1, "var point_count = 0u;");
    }
    if requirements.slots > 0 {
        line(
            1,
            &format!(
                "var slots: array<{value}, {}>;",
                requirements.slots.next_power_of_two()
            ),
        );
    }
    if surface {
        line(1, "var material = unpainted_surface();");
        line(1, &tie_wgsl("origin"));
        line(1, "var channels: array<vec4f, 9>;");
        if stack {
            line(1, &format!("var materials: array<Surface, {size}>;"));
        }
        if requirements.slots > 0 {
            let slots = requirements.slots.next_power_of_two();
            line(1, &format!("var slot_materials: array<Surface, {slots}>;"));
        }
    }
    let (first, end) = if surface {
        ("program_ranges.y", "z")
    } else {
        ("0u", "x")
    };
    line(
        1,
        &format!("for (var index = {first}; index < program_ranges.{end}; index += 1u) {{"),
    );
    line(2, "let instruction = code[index];");
    line(2, "let word = instruction.x;");
    for k in 0..max_pool_width(requirements) {
        line(2, &format!("let k{k} = pool[instruction.y + {k}u];"));
    }
    if requirements.constant_operands || !requirements.blend_kernels.is_empty() {
        line(2, "let c = pool[instruction.w];");
    }
    if requirements.points > 0 {
        line(2, "let point_pops = (word >> 16u) & 31u;");
        line(2, "if point_pops > 0u {");
        line(3, "point_count -= point_pops;");
        line(3, "p = points[point_count];");
        line(2, "}");
        line(2, "if (word & 0x800000u) != 0u {");
        line(3, "points[point_count] = p;");
        line(3, "point_count += 1u;");
        line(2, "}");
    }
    emit_transform(requirements, numbers, "instruction.z", library, &mut line);
    if stack {
        line(2, "let popped = (word >> 21u) & 3u;");
        line(2, "stack[depth] = top;");
        if surface {
            line(2, "materials[depth] = material;");
        }
        line(2, "let accumulator = stack[depth - popped];");
    } else {
        line(2, "let accumulator = top;");
    }
    emit_operands(requirements, stack, numbers, &mut line);
    line(2, &format!("var result = {value}();"));
    if surface {
        line(2, "var result_material = material;");
        declare_material_rule(&mut line);
    }
    let names = OperandNames {
        point: "p",
        single: "top",
        pair: ["a", "b"],
        triple: ["s", "a", "b"],
        no_constant: "popped == 2u",
        materials: stack.then_some(["materials[depth - 1u]", "material"]),
    };
    line(2, "switch word & 255u {");
    for &code in &requirements.codes {
        let body = operation_case(code, requirements, numbers, surface, &names, library);
        line(3, &format!("case {}u: {{ {body} }}", code.number()));
    }
    line(3, "default: {}");
    line(2, "}");
    if surface {
        apply_material_rule(requirements, &names, library, &mut line);
    }
    emit_result(requirements, numbers, surface, stack, library, &mut line);
    line(1, "}");
    line(
        1,
        if surface {
            "return material;"
        } else {
            "return top;"
        },
    );
    line(0, "}");
    text
}

/// Emits the operands of the operations: `top` alone; `a` and `b` of two; `s`, `a`, `b` of three.
fn emit_operands(
    requirements: &KernelRequirements,
    stack: bool,
    numbers: NumberKind,
    line: &mut impl FnMut(usize, &str),
) {
    if max_arity(requirements) >= 3 && stack {
        line(2, "let s = stack[max(depth, 2u) - 2u];");
    }
    if max_arity(requirements) < 2 {
        return;
    }
    let first_operand = if stack {
        "stack[max(depth, 1u) - 1u]"
    } else {
        "top"
    };
    line(2, &format!("var a = {first_operand};"));
    line(2, "var b = top;");
    emit_constant_operands(requirements, numbers, line);
    if requirements.constant_operands {
        // The only value on the stack is then the first.
        line(2, "a = select(a, top, constant_operand == 1u);");
    }
}

/// Emits the destination of the result: pushed, or blended into the accumulator. An instruction without a
/// value restores the accumulator.
fn emit_result(
    requirements: &KernelRequirements,
    numbers: NumberKind,
    surface: bool,
    stack: bool,
    library: &mut WgslLibrary,
    line: &mut impl FnMut(usize, &str),
) {
    let may_have_no_value = requirements.codes.iter().any(|code| code.has_no_value());
    if !requirements.blend_kernels.is_empty() {
        line(2, "let blend_kernel = (word >> 8u) & 7u;");
    }
    emit_blends(requirements, numbers, library, line);
    if surface {
        let accumulator_material = if stack {
            "materials[depth - popped]"
        } else {
            "material"
        };
        emit_surface_blend(requirements, accumulator_material, library, line);
    }
    if may_have_no_value {
        line(2, "let has_no_value = (word & 0x800u) != 0u;");
        if surface {
            let restored = if stack {
                "materials[depth - popped]"
            } else {
                "material"
            };
            line(
                2,
                &format!("if has_no_value {{ result_material = {restored}; }}"),
            );
        }
        line(2, "top = select(blended, accumulator, has_no_value);");
    } else {
        line(2, "top = blended;");
    }
    if surface {
        line(2, "material = result_material;");
    }
    if stack {
        let pushes = match (requirements.blend_kernels.is_empty(), may_have_no_value) {
            (true, false) => "1u".to_owned(),
            (false, false) => "select(0u, 1u, blend_kernel == 0u)".to_owned(),
            (true, true) => "select(1u, 0u, has_no_value)".to_owned(),
            (false, true) => "select(0u, 1u, blend_kernel == 0u && !has_no_value)".to_owned(),
        };
        line(2, &format!("depth = depth - popped + {pushes};"));
    }
}
