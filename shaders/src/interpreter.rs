//! The interpreter: a program's words run by a loop, as WGSL functions of the same names and types
//! as those that are generated for a scene.
//!
//! The text holds only what the programs it is made for need: the opcodes, the blend kernels,
//! frames, a stack, kept points and slots. Constants are loaded in front of the `switch` and
//! results are stored behind it, since software devices run every `case`; for the same reason the
//! stack's bookkeeping is free of branches. The word layout is drawn in [`sdfc_vm::program`].

use sdfc_vm::apply::wgsl_name;
use sdfc_vm::kernel::Kernel;
use sdfc_vm::library::{Library, blend_name};
use sdfc_vm::program::{Code, Needs};
use sdfc_vm::row::{Category, Input, Output, ParameterType, Row};
use std::fmt::Write;

/// The binding of the instructions.
pub const CODE_SLOT: u32 = 16;
/// The binding of the constants.
pub const POOL_SLOT: u32 = 17;
/// The binding of where programs lie among the instructions: the distance's from 0 to x, that of
/// surfaces from y to z.
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

/// The bindings that an interpreter reads.
pub fn bindings(memory: Memory) -> String {
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
@group(0) @binding({LENGTH_SLOT}) var<uniform> program_length: vec4u;
"
    )
}

/// The interpreter as one function; what it calls is marked in `library`.
pub fn interpreter(needs: &Needs, function: Function, library: &mut Library) -> String {
    let dual = function != Function::Distance;
    let surface = function == Function::Surface;
    let value = if dual { "vec4f" } else { "f32" };
    let point = if dual { "DualPoint" } else { "vec3f" };
    if dual {
        library.use_points();
    }
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
    if dual {
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
    line(2, "let word = code[at];");
    let widest = needs
        .codes
        .iter()
        .map(|code| code.pool_width())
        .max()
        .unwrap_or(0);
    for k in 0..widest {
        line(2, &format!("let k{k} = pool[word.y + {k}u];"));
    }
    if needs.constant_operands || !needs.kernels.is_empty() {
        line(2, "let c = pool[word.w];");
    }
    if needs.points > 0 {
        line(2, "let back = (word.x >> 16u) & 31u;");
        line(2, "if back > 0u {");
        line(3, "kept -= back;");
        line(3, "p = points[kept];");
        line(2, "}");
        line(2, "if (word.x & 0x800000u) != 0u {");
        line(3, "points[kept] = p;");
        line(3, "kept += 1u;");
        line(2, "}");
    }
    frame(needs, dual, library, &mut line);
    if stack {
        line(2, "let taken = (word.x >> 21u) & 3u;");
        line(2, "stack[depth] = top;");
        if surface {
            line(2, "materials[depth] = material;");
        }
        line(2, "let below = stack[depth - taken];");
    } else {
        line(2, "let below = top;");
    }
    operands(needs, stack, dual, &mut line);
    line(2, &format!("var result = {value}();"));
    if surface {
        line(2, "var painted = material;");
    }
    line(2, "switch word.x & 255u {");
    for &code in &needs.codes {
        let body = case(code, needs, dual, surface, stack, library);
        line(3, &format!("case {}u: {{ {body} }}", code.number()));
    }
    line(3, "default: {}");
    line(2, "}");
    place(needs, dual, surface, stack, library, &mut line);
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

/// The point through the instruction's frame, as `q`.
fn frame(needs: &Needs, dual: bool, library: &mut Library, line: &mut impl FnMut(usize, &str)) {
    if !needs.moved && !needs.mapped {
        line(2, "let q = p;");
        return;
    }
    line(2, "let frame = (word.x >> 14u) & 3u;");
    line(2, "let f0 = pool[word.z];");
    line(2, "var q = p;");
    if needs.moved {
        let target = if dual { "q.p" } else { "q" };
        let from = if dual { "p.p" } else { "p" };
        line(
            2,
            &format!("{target} = select({from}, {from} + f0.xyz, frame == 1u);"),
        );
    }
    if needs.mapped {
        line(2, "let f1 = pool[word.z + 1u];");
        line(2, "let f2 = pool[word.z + 2u];");
        line(2, "let rows = transpose(mat3x3f(f0.xyz, f1.xyz, f2.xyz));");
        line(2, "let shift = vec3f(f0.w, f1.w, f2.w);");
        if dual {
            library.use_mapped_gradient();
            line(2, "if frame == 2u { q = mapped_gradient(p, rows, shift); }");
        } else {
            library.use_mapped();
            line(2, "q = select(q, mapped(p, rows, shift), frame == 2u);");
        }
    }
}

/// The operands of the operations: `u` alone; `a` and `b` of two; `s`, `a`, `b` of three.
fn operands(needs: &Needs, stack: bool, dual: bool, line: &mut impl FnMut(usize, &str)) {
    let arity = needs
        .codes
        .iter()
        .map(|code| code.arity())
        .max()
        .unwrap_or(0);
    if arity >= 3 && stack {
        line(2, "let s = stack[max(depth, 2u) - 2u];");
    }
    if arity >= 2 {
        line(
            2,
            &format!(
                "var a = {};",
                if stack {
                    "stack[max(depth, 1u) - 1u]"
                } else {
                    "top"
                }
            ),
        );
        line(2, "var b = top;");
        if needs.constant_operands {
            let constant = if dual {
                "vec4f(0.0, 0.0, 0.0, c.x)"
            } else {
                "c.x"
            };
            line(2, "let constant_operand = (word.x >> 12u) & 3u;");
            line(
                2,
                &format!("b = select(b, {constant}, constant_operand == 1u);"),
            );
            line(2, "a = select(a, top, constant_operand == 1u);");
            line(
                2,
                &format!("a = select(a, {constant}, constant_operand == 2u);"),
            );
        }
    }
}

/// What an opcode does: it sets `result`, or the point, and in surfaces perhaps the material.
fn case(
    code: Code,
    needs: &Needs,
    dual: bool,
    surface: bool,
    stack: bool,
    library: &mut Library,
) -> String {
    let slot = "(word.x >> 24u)";
    match code {
        Code::Op(op) => {
            let row = op.row();
            let call = |point: &str, values: [&str; 3]| {
                let suffix = if dual { "_gradient" } else { "" };
                format!(
                    "{}{suffix}({})",
                    wgsl_name(op),
                    arguments(row, point, values)
                )
            };
            if dual {
                library.use_gradient(op);
            } else {
                library.use_value(op);
            }
            let values = match row.arity() {
                0 | 1 => ["top", "", ""],
                2 => ["a", "b", ""],
                _ => ["s", "a", "b"],
            };
            let target = if row.output == Output::Point {
                "p"
            } else {
                "result"
            };
            let mut body = format!("{target} = {};", call("q", values));
            if surface && row.output == Output::Value {
                match row.arity() {
                    0 => body.push_str(" painted = unpainted_surface();"),
                    2 if row.meta.category == Category::Combine && stack => {
                        library.use_mixed_surface();
                        // The point stays: only the operands' shares are asked for.
                        let still = "DualPoint(q.p, vec3f(), vec3f(), vec3f())";
                        let seeds = ["vec4f(1.0, 0.0, 0.0, a.w)", "vec4f(0.0, 1.0, 0.0, b.w)", ""];
                        let weights = call(still, seeds);
                        let mixed =
                            format!("mixed_surface(materials[depth - 1u], material, {weights})");
                        let _ = if needs.constant_operands {
                            write!(body, " if taken == 2u {{ painted = {mixed}; }}")
                        } else {
                            write!(body, " painted = {mixed};")
                        };
                    }
                    2 if stack => {
                        body.push_str(" if taken == 2u { painted = materials[depth - 1u]; }")
                    }
                    _ => {}
                }
            }
            body
        }
        Code::Load => {
            let mut body = format!("result = slots[{slot}];");
            if surface {
                let _ = write!(body, " painted = slot_materials[{slot}];");
            }
            body
        }
        Code::Store => {
            let mut body = format!("slots[{slot}] = top; result = top;");
            if surface {
                let _ = write!(body, " slot_materials[{slot}] = material;");
            }
            body
        }
        Code::Take => "result = top;".to_owned(),
        Code::Normal => {
            library.use_local_normal();
            format!("result = vec4f(0.0, 0.0, 0.0, local_normal(q.dx, q.dy, q.dz, n)[{slot}]);")
        }
        Code::Channel => format!("channels[{slot}] = top;"),
        Code::Paint => {
            let channels = needs.codes.contains(&Code::Channel);
            let number = |channel: u32, constant: &str| {
                if channels {
                    format!(
                        "select({constant}, channels[{channel}].w, ({slot} & {}u) != 0u)",
                        1 << channel
                    )
                } else {
                    constant.to_owned()
                }
            };
            let bump = if channels {
                "select(vec3f(0.0), channels[8].xyz, k2.y != 0.0)"
            } else {
                "vec3f(0.0)"
            };
            format!(
                "result = top; painted = Surface(vec3f({}, {}, {}), {}, vec3f({}, {}, {}), {}, {bump}, k2.x);",
                number(0, "k0.x"),
                number(1, "k0.y"),
                number(2, "k0.z"),
                number(3, "k0.w"),
                number(4, "k1.x"),
                number(5, "k1.y"),
                number(6, "k1.z"),
                number(7, "k1.w"),
            )
        }
    }
}

/// The arguments of a row's function, read from the loaded constants.
fn arguments(row: &Row, point: &str, values: [&str; 3]) -> String {
    let mut values = values.into_iter();
    let mut list: Vec<String> = Vec::new();
    for input in row.inputs {
        match input {
            Input::Point => list.push(point.to_owned()),
            Input::Value => list.extend(values.next().map(str::to_owned)),
        }
    }
    for (parameter, offset) in row.parameters.iter().zip(row.offsets()) {
        let (vector, start) = (offset / 4, offset % 4);
        let letters = &"xyzw"[start..start + parameter.ty.width()];
        let constant = format!("k{vector}.{letters}");
        list.push(match parameter.ty {
            ParameterType::Scalar | ParameterType::Vec2 | ParameterType::Vec3 => constant,
        });
    }
    list.join(", ")
}

/// What becomes of the result: pushed, or blended into what is below; without one, what is below
/// comes back.
fn place(
    needs: &Needs,
    dual: bool,
    surface: bool,
    stack: bool,
    library: &mut Library,
    line: &mut impl FnMut(usize, &str),
) {
    let none = needs
        .codes
        .iter()
        .any(|code| code.gives_point() || *code == Code::Channel);
    if needs.kernels.is_empty() {
        line(2, "var placed = result;");
    } else {
        line(2, "let kernel = (word.x >> 8u) & 7u;");
        line(2, "var placed = result;");
        for &kernel in &needs.kernels {
            let call = blend(kernel, dual, library, "below", "result");
            line(
                2,
                &format!(
                    "placed = select(placed, {call}, kernel == {}u);",
                    kernel.number()
                ),
            );
        }
    }
    if surface {
        surface_place(needs, stack, library, line);
    }
    if none {
        line(2, "let none = (word.x & 0x800u) != 0u;");
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

/// The material of a blend: both operands', by the blend's derivatives.
fn surface_place(
    needs: &Needs,
    stack: bool,
    library: &mut Library,
    line: &mut impl FnMut(usize, &str),
) {
    if needs.kernels.is_empty() {
        return;
    }
    library.use_mixed_surface();
    let under = if stack {
        "materials[depth - taken]"
    } else {
        "material"
    };
    line(2, "if kernel != 0u {");
    line(3, "let seed_a = vec4f(1.0, 0.0, 0.0, below.w);");
    line(3, "let seed_b = vec4f(0.0, 1.0, 0.0, result.w);");
    line(3, "var weights = vec4f();");
    for &kernel in &needs.kernels {
        let call = blend(kernel, true, library, "seed_a", "seed_b");
        line(
            3,
            &format!(
                "weights = select(weights, {call}, kernel == {}u);",
                kernel.number()
            ),
        );
    }
    line(
        3,
        &format!("painted = mixed_surface({under}, painted, weights);"),
    );
    line(2, "}");
}

fn blend(kernel: Kernel, dual: bool, library: &mut Library, a: &str, b: &str) -> String {
    let suffix = if dual { "_gradient" } else { "" };
    if dual {
        library.use_blend_gradient(kernel);
    } else {
        library.use_blend(kernel);
    }
    format!(
        "{}{suffix}({a}, {b}, c.x, c.y, c.z, c.w)",
        blend_name(kernel)
    )
}
