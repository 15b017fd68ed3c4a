//! The interpreter: a program's words run by a loop, as WGSL functions of the same names and types
//! as those that are generated for a scene.
//!
//! The text holds only what the programs it is made for need: the opcodes, the blend kernels,
//! frames, a stack, kept points and slots. Constants are loaded in front of the `switch` and
//! results are stored behind it, since software devices run every `case`; for the same reason the
//! stack's bookkeeping is free of branches. The word layout is drawn in [`sdfc_vm::program`]. Where a
//! guard skips, the loop goes on behind its block; each lane skips for itself.

pub mod cut;
mod operation;
mod record;
pub mod tape;

pub use record::Record;

use operation::{
    Names, Numbers, apply_paint, arity, blends, case, constant_operands, declare_paint, frame,
    surface_blend, widest,
};
use sdfc_vm::library::Library;
use sdfc_vm::program::Needs;
use sdfc_vm::surface::tie_line;
use std::fmt::Write;

/// The binding of the instructions.
pub const CODE_SLOT: u32 = 16;
/// The binding of the constants.
pub const POOL_SLOT: u32 = 17;
/// The binding of where programs lie among the instructions: the distance's from 0 to x, that of
/// surfaces from y to z. In storage, since software Vulkan compiles a kernel again for each new
/// value of a uniform that a loop's end depends on.
pub const LENGTH_SLOT: u32 = 18;

/// Where instructions and constants lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Memory {
    /// In uniform buffers of these many instructions and constants, which every lane of a device
    /// reads at once; they hold 4,096 of either at most.
    Uniform {
        /// Instructions.
        code: u32,
        /// Constants.
        pool: u32,
    },
    /// In storage buffers.
    Storage,
}

impl Memory {
    /// The smallest memory for programs of so many instructions and constants.
    pub fn for_program(code: usize, pool: usize) -> Self {
        let class = |n: usize| {
            [64, 256, 1024, 4096]
                .into_iter()
                .find(|&size| n <= size as usize)
        };
        match (class(code), class(pool)) {
            (Some(code), Some(pool)) => Self::Uniform { code, pool },
            _ => Self::Storage,
        }
    }
}

/// Which function is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Function {
    /// `scene_distance(p: vec3f) -> f32`
    Distance,
    /// `scene_gradient(p: vec3f) -> vec4f`
    Gradient,
    /// `scene_surface(p: vec3f, n: vec3f) -> Surface`
    Surface,
}

impl Function {
    /// What it computes with.
    fn numbers(self) -> Numbers {
        match self {
            Self::Distance => Numbers::Plain,
            Self::Gradient | Self::Surface => Numbers::Gradients,
        }
    }
}

/// The bindings that the interpreter of stacks reads.
pub fn bindings(memory: Memory) -> String {
    format!(
        "{}@group(0) @binding({LENGTH_SLOT}) var<storage, read> program_length: vec4u;
",
        code_bindings(memory)
    )
}

/// The bindings that both interpreters read.
fn code_bindings(memory: Memory) -> String {
    let (code, pool) = match memory {
        Memory::Uniform { code, pool } => (
            format!("var<uniform> code: array<vec4u, {code}>"),
            format!("var<uniform> pool: array<vec4f, {pool}>"),
        ),
        Memory::Storage => (
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

/// The interpreter as one function; what it calls is marked in `library`.
pub fn interpreter(needs: &Needs, function: Function, library: &mut Library) -> String {
    let numbers = function.numbers();
    let surface = function == Function::Surface;
    let (value, point) = (numbers.value(), numbers.point());
    numbers.declare(library);
    // One entry more than the depth: the top is written above the stack before it is known whether
    // it stays there.
    let stack = needs.depth > 1;
    let size = (needs.depth + 1).next_power_of_two();
    let mut text = String::new();
    let mut line = |indent: usize, content: &str| {
        let _ = writeln!(text, "{:indent$}{content}", "", indent = indent * 4);
    };
    line(
        0,
        match function {
            Function::Distance => "fn scene_distance(origin: vec3f) -> f32 {",
            Function::Gradient => "fn scene_gradient(origin: vec3f) -> vec4f {",
            Function::Surface => "fn scene_surface(origin: vec3f, n: vec3f) -> Surface {",
        },
    );
    if numbers == Numbers::Gradients {
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
    if needs.points > 0 {
        line(
            1,
            &format!(
                "var points: array<{point}, {}>;",
                needs.points.next_power_of_two()
            ),
        );
        line(1, "var kept = 0u;");
    }
    if needs.slots > 0 {
        line(
            1,
            &format!(
                "var slots: array<{value}, {}>;",
                needs.slots.next_power_of_two()
            ),
        );
    }
    if surface {
        line(1, "var material = unpainted_surface();");
        line(1, &tie_line("origin"));
        line(1, "var channels: array<vec4f, 9>;");
        if stack {
            line(1, &format!("var materials: array<Surface, {size}>;"));
        }
        if needs.slots > 0 {
            let slots = needs.slots.next_power_of_two();
            line(1, &format!("var slot_materials: array<Surface, {slots}>;"));
        }
    }
    let (first, end) = if surface {
        ("program_length.y", "z")
    } else {
        ("0u", "x")
    };
    line(
        1,
        &format!("for (var at = {first}; at < program_length.{end}; at += 1u) {{"),
    );
    line(2, "let instruction = code[at];");
    line(2, "let word = instruction.x;");
    for k in 0..widest(needs) {
        line(2, &format!("let k{k} = pool[instruction.y + {k}u];"));
    }
    if needs.constant_operands || !needs.kernels.is_empty() {
        line(2, "let c = pool[instruction.w];");
    }
    if needs.points > 0 {
        line(2, "let back = (word >> 16u) & 31u;");
        line(2, "if back > 0u {");
        line(3, "kept -= back;");
        line(3, "p = points[kept];");
        line(2, "}");
        line(2, "if (word & 0x800000u) != 0u {");
        line(3, "points[kept] = p;");
        line(3, "kept += 1u;");
        line(2, "}");
    }
    frame(needs, numbers, "instruction.z", library, &mut line);
    if stack {
        line(2, "let taken = (word >> 21u) & 3u;");
        line(2, "stack[depth] = top;");
        if surface {
            line(2, "materials[depth] = material;");
        }
        line(2, "let below = stack[depth - taken];");
    } else {
        line(2, "let below = top;");
    }
    operands(needs, stack, numbers, &mut line);
    line(2, &format!("var result = {value}();"));
    if surface {
        line(2, "var painted = material;");
        declare_paint(&mut line);
    }
    let names = Names {
        point: "p",
        one: "top",
        two: ["a", "b"],
        three: ["s", "a", "b"],
        both: "taken == 2u",
        materials: stack.then_some(["materials[depth - 1u]", "material"]),
    };
    line(2, "switch word & 255u {");
    for &code in &needs.codes {
        let body = case(code, needs, numbers, surface, &names, library);
        line(3, &format!("case {}u: {{ {body} }}", code.number()));
    }
    line(3, "default: {}");
    line(2, "}");
    if surface {
        apply_paint(needs, &names, library, &mut line);
    }
    place(needs, numbers, surface, stack, library, &mut line);
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

/// The operands of the operations: `top` alone; `a` and `b` of two; `s`, `a`, `b` of three.
fn operands(needs: &Needs, stack: bool, numbers: Numbers, line: &mut impl FnMut(usize, &str)) {
    if arity(needs) >= 3 && stack {
        line(2, "let s = stack[max(depth, 2u) - 2u];");
    }
    if arity(needs) < 2 {
        return;
    }
    let under = if stack {
        "stack[max(depth, 1u) - 1u]"
    } else {
        "top"
    };
    line(2, &format!("var a = {under};"));
    line(2, "var b = top;");
    constant_operands(needs, numbers, line);
    if needs.constant_operands {
        // The one value on the stack is then the first.
        line(2, "a = select(a, top, constant_operand == 1u);");
    }
}

/// What becomes of the result: pushed, or blended into what is below; without one, what is below
/// comes back.
fn place(
    needs: &Needs,
    numbers: Numbers,
    surface: bool,
    stack: bool,
    library: &mut Library,
    line: &mut impl FnMut(usize, &str),
) {
    let none = needs.codes.iter().any(|code| code.gives_none());
    if !needs.kernels.is_empty() {
        line(2, "let kernel = (word >> 8u) & 7u;");
    }
    blends(needs, numbers, library, line);
    if surface {
        let under = if stack {
            "materials[depth - taken]"
        } else {
            "material"
        };
        surface_blend(needs, under, library, line);
    }
    if none {
        line(2, "let none = (word & 0x800u) != 0u;");
        if surface {
            let restored = if stack {
                "materials[depth - taken]"
            } else {
                "material"
            };
            line(2, &format!("if none {{ painted = {restored}; }}"));
        }
        line(2, "top = select(placed, below, none);");
    } else {
        line(2, "top = placed;");
    }
    if surface {
        line(2, "material = painted;");
    }
    if stack {
        let stays = match (needs.kernels.is_empty(), none) {
            (true, false) => "1u".to_owned(),
            (false, false) => "select(0u, 1u, kernel == 0u)".to_owned(),
            (true, true) => "select(1u, 0u, none)".to_owned(),
            (false, true) => "select(0u, 1u, kernel == 0u && !none)".to_owned(),
        };
        line(2, &format!("depth = depth - taken + {stays};"));
    }
}
