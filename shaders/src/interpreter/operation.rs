//! The shared text of both interpreters: an instruction's point transform, its operation and its blends.

use sdfc_vm::apply::wgsl_name;
use sdfc_vm::blend::BlendKernel;
use sdfc_vm::material_weights::tie_signs;
use sdfc_vm::program::{KernelRequirements, Opcode};
use sdfc_vm::row::{Category, Input, Output, ParameterType};
use sdfc_vm::table::{Op, Row};
use sdfc_vm::wgsl_library::{GUARD_NAME, WgslLibrary, blend_name};
use std::fmt::Write;

/// Kind of numbers of an interpreter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberKind {
    /// Values at points.
    Plain,
    /// Values at points, and their gradients.
    Gradients,
    /// Bounds of values over boxes.
    Intervals,
}

impl NumberKind {
    /// Returns the type of a value.
    pub(super) fn value(self) -> &'static str {
        match self {
            Self::Plain => "f32",
            Self::Gradients => "vec4f",
            Self::Intervals => "vec2f",
        }
    }

    /// Returns the type of a point.
    pub(super) fn point(self) -> &'static str {
        match self {
            Self::Plain => "vec3f",
            Self::Gradients => "DualPoint",
            Self::Intervals => "BoxPoint",
        }
    }

    /// Returns the suffix of the names of functions.
    fn suffix(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Gradients => "_gradient",
            Self::Intervals => "_interval",
        }
    }

    /// Marks the declaration of points as used.
    pub(super) fn declare(self, library: &mut WgslLibrary) {
        match self {
            Self::Plain => {}
            Self::Gradients => library.use_points(),
            Self::Intervals => library.use_boxes(),
        }
    }

    fn use_operation(self, op: Op, library: &mut WgslLibrary) {
        match self {
            Self::Plain => library.use_value(op),
            Self::Gradients => library.use_gradient(op),
            Self::Intervals => library.use_interval(op),
        }
    }

    fn use_blend(self, kernel: BlendKernel, library: &mut WgslLibrary) {
        match self {
            Self::Plain => library.use_blend(kernel),
            Self::Gradients => library.use_blend_gradient(kernel),
            Self::Intervals => library.use_blend_interval(kernel),
        }
    }
}

/// Rule for the material of an operation, if it differs from that of the last operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MaterialRule {
    /// The default material.
    Unpainted = 1,
    /// A mix of both operands', weighted by the operation's derivatives.
    Mixed = 2,
    /// The first of two operands'.
    First = 3,
}

impl MaterialRule {
    fn for_row(row: &Row) -> Option<Self> {
        match row.arity() {
            _ if row.output != Output::Value => None,
            0 => Some(Self::Unpainted),
            2 if row.facts.category == Category::Combine => Some(Self::Mixed),
            2 => Some(Self::First),
            _ => None,
        }
    }
}

/// Emits the variables for the material rule and its weights, before the `switch`.
pub(super) fn declare_material_rule(line: &mut impl FnMut(usize, &str)) {
    line(2, "var material_rule = 0u;");
    line(2, "var weights = vec4f();");
}

/// Emits the material of an operation's value, after the `switch`: materials are large, and a driver that
/// runs all cases would move them in each.
pub(super) fn apply_material_rule(
    requirements: &KernelRequirements,
    names: &OperandNames<'_>,
    library: &mut WgslLibrary,
    line: &mut impl FnMut(usize, &str),
) {
    let is_used = |rule: MaterialRule| {
        let mut codes = requirements.codes.iter();
        codes.any(
            |code| matches!(code, Opcode::Op(op) if MaterialRule::for_row(op.row()) == Some(rule)),
        )
    };
    let mut emit_rule = |rule: MaterialRule, condition: &str, material: String| {
        let number = rule as u32;
        line(
            2,
            &format!(
                "if material_rule == {number}u{condition} {{ result_material = {material}; }}"
            ),
        );
    };
    if is_used(MaterialRule::Unpainted) {
        emit_rule(
            MaterialRule::Unpainted,
            "",
            "unpainted_surface()".to_owned(),
        );
    }
    let Some([first, second]) = names.materials else {
        return;
    };
    let condition = if requirements.constant_operands {
        format!(" && {}", names.no_constant)
    } else {
        String::new()
    };
    if is_used(MaterialRule::Mixed) {
        library.use_mixed_surface();
        let mixed = format!("mixed_surface({first}, {second}, weights)");
        emit_rule(MaterialRule::Mixed, &condition, mixed);
    }
    if is_used(MaterialRule::First) {
        emit_rule(MaterialRule::First, &condition, first.to_owned());
    }
}

/// Names of the operands of operations.
pub(super) struct OperandNames<'a> {
    /// The destination of a point result.
    pub(super) point: &'a str,
    /// The operand of unary operations.
    pub(super) single: &'static str,
    /// The operands of binary operations.
    pub(super) pair: [&'static str; 2],
    /// The operands of ternary operations.
    pub(super) triple: [&'static str; 3],
    /// The condition that neither of two operands is a constant.
    pub(super) no_constant: &'static str,
    /// The materials of two operands, if they are stored.
    pub(super) materials: Option<[&'static str; 2]>,
}

/// Emits the instruction's point transform, with the result `q` and constants from `offset` on.
pub(super) fn emit_transform(
    requirements: &KernelRequirements,
    numbers: NumberKind,
    offset: &str,
    library: &mut WgslLibrary,
    line: &mut impl FnMut(usize, &str),
) {
    if !requirements.translates && !requirements.maps_affinely {
        line(2, "let q = p;");
        return;
    }
    line(2, "let transform = (word >> 14u) & 3u;");
    line(2, &format!("let f0 = pool[{offset}];"));
    line(2, "var q = p;");
    if requirements.translates {
        line(
            2,
            match numbers {
                NumberKind::Plain => "q = select(p, p + f0.xyz, transform == 1u);",
                NumberKind::Gradients => "q.p = select(p.p, p.p + f0.xyz, transform == 1u);",
                NumberKind::Intervals => {
                    library.use_moved_interval();
                    "if transform == 1u { q = moved_interval(p, f0.xyz); }"
                }
            },
        );
    }
    if requirements.maps_affinely {
        line(2, &format!("let f1 = pool[{offset} + 1u];"));
        line(2, &format!("let f2 = pool[{offset} + 2u];"));
        line(2, "let rows = transpose(mat3x3f(f0.xyz, f1.xyz, f2.xyz));");
        line(2, "let shift = vec3f(f0.w, f1.w, f2.w);");
        line(
            2,
            match numbers {
                NumberKind::Plain => {
                    library.use_mapped();
                    "q = select(q, mapped(p, rows, shift), transform == 2u);"
                }
                NumberKind::Gradients => {
                    library.use_mapped_gradient();
                    "if transform == 2u { q = mapped_gradient(p, rows, shift); }"
                }
                NumberKind::Intervals => {
                    library.use_mapped_interval();
                    "if transform == 2u { q = mapped_interval(p, rows[0], rows[1], rows[2], shift); }"
                }
            },
        );
    }
}

/// Returns the case of an opcode: it assigns `result`, or the point, and in surfaces possibly the material.
pub(super) fn operation_case(
    code: Opcode,
    requirements: &KernelRequirements,
    numbers: NumberKind,
    surface: bool,
    names: &OperandNames<'_>,
    library: &mut WgslLibrary,
) -> String {
    let slot = "(word >> 24u)";
    match code {
        Opcode::Op(op) => {
            let row = op.row();
            let call = |point: &str, values: [&str; 3]| {
                format!(
                    "{}{}({})",
                    wgsl_name(op),
                    numbers.suffix(),
                    arguments(row, point, values)
                )
            };
            numbers.use_operation(op, library);
            let values = match row.arity() {
                0 | 1 => [names.single, "", ""],
                2 => [names.pair[0], names.pair[1], ""],
                _ => names.triple,
            };
            let target = if row.output == Output::Point {
                names.point
            } else {
                "result"
            };
            let mut body = format!("{target} = {};", call("q", values));
            if surface && let Some(rule) = MaterialRule::for_row(row) {
                let _ = write!(body, " material_rule = {}u;", rule as u32);
                if rule == MaterialRule::Mixed {
                    // The point is fixed: only the weights of the operands are needed.
                    let fixed_point = "DualPoint(q.p, vec3f(), vec3f(), vec3f())";
                    let first = first_seed(op);
                    let seeds = [&*first, "vec4f(0.0, 1.0, 0.0, b.w)", ""];
                    let _ = write!(body, " weights = {};", call(fixed_point, seeds));
                }
            }
            body
        }
        Opcode::Load => {
            let mut body = format!("result = slots[{slot}];");
            if surface {
                let _ = write!(body, " result_material = slot_materials[{slot}];");
            }
            body
        }
        Opcode::Store => {
            let mut body = format!("slots[{slot}] = top; result = top;");
            if surface {
                let _ = write!(body, " slot_materials[{slot}] = material;");
            }
            body
        }
        Opcode::Top => "result = top;".to_owned(),
        Opcode::Normal => {
            library.use_local_normal();
            format!("result = vec4f(0.0, 0.0, 0.0, local_normal(q.dx, q.dy, q.dz, n)[{slot}]);")
        }
        Opcode::Guard => {
            library.use_guard();
            // Only tapes run on intervals, and they have no guards.
            let (point, value) = match numbers {
                NumberKind::Plain | NumberKind::Intervals => ("q", ""),
                NumberKind::Gradients => ("q.p", ".w"),
            };
            format!(
                "if {GUARD_NAME}({point}, {}{value}, k0.xyz, k0.w, k1.xyz, k1.w) > 0.0 \
                 {{ index += instruction.w; }}",
                names.single
            )
        }
        Opcode::Channel => format!("channels[{slot}] = {};", names.single),
        Opcode::Paint => {
            let channels = requirements.codes.contains(&Opcode::Channel);
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
                "result = {}; result_material = Surface(vec3f({}, {}, {}), {}, vec3f({}, {}, {}), {}, {bump}, k2.x);",
                names.single,
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

/// Returns the arguments of an operation's function, from the loaded constants.
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

/// Returns the maximum number of operands of an operation.
pub(super) fn max_arity(requirements: &KernelRequirements) -> usize {
    let arities = requirements.codes.iter().map(|code| code.arity());
    arities.max().unwrap_or(0)
}

/// Emits the replacement of an operand `a` or `b` by the constant of the instruction.
pub(super) fn emit_constant_operands(
    requirements: &KernelRequirements,
    numbers: NumberKind,
    line: &mut impl FnMut(usize, &str),
) {
    if !requirements.constant_operands {
        return;
    }
    let constant = match numbers {
        NumberKind::Plain => "c.x",
        NumberKind::Gradients => "vec4f(0.0, 0.0, 0.0, c.x)",
        NumberKind::Intervals => "vec2f(c.x)",
    };
    line(2, "let constant_operand = (word >> 12u) & 3u;");
    line(
        2,
        &format!("b = select(b, {constant}, constant_operand == 1u);"),
    );
    line(
        2,
        &format!("a = select(a, {constant}, constant_operand == 2u);"),
    );
}

/// Returns the maximum number of constant vectors of an operation.
pub(super) fn max_pool_width(requirements: &KernelRequirements) -> usize {
    let widths = requirements.codes.iter().map(|code| code.pool_width());
    widths.max().unwrap_or(0)
}

/// Emits `blended`: the result, blended into the accumulator by the kernel of the instruction, if any.
pub(super) fn emit_blends(
    requirements: &KernelRequirements,
    numbers: NumberKind,
    library: &mut WgslLibrary,
    line: &mut impl FnMut(usize, &str),
) {
    line(2, "var blended = result;");
    for &kernel in &requirements.blend_kernels {
        let call = blend(kernel, numbers, library, "accumulator", "result");
        line(
            2,
            &format!(
                "blended = select(blended, {call}, blend_kernel == {}u);",
                kernel.number()
            ),
        );
    }
}

/// Returns the seed of the first operand of an operation, which is visible where faces coincide.
fn first_seed(op: Op) -> String {
    let [tie, second] = tie_signs(op);
    format!("first_seed(a, b * {second:.1}, tie * {tie:.1})")
}

/// Emits the material of a blend: a mix of both operands', weighted by the blend's derivatives.
pub(super) fn emit_surface_blend(
    requirements: &KernelRequirements,
    accumulator_material: &str,
    library: &mut WgslLibrary,
    line: &mut impl FnMut(usize, &str),
) {
    if requirements.blend_kernels.is_empty() {
        return;
    }
    library.use_mixed_surface();
    line(2, "if blend_kernel != 0u {");
    line(
        3,
        "let seed_a = first_seed(accumulator, result * c.y, tie * c.x);",
    );
    line(3, "let seed_b = vec4f(0.0, 1.0, 0.0, result.w);");
    line(3, "var weights = vec4f();");
    for &kernel in &requirements.blend_kernels {
        let call = blend(kernel, NumberKind::Gradients, library, "seed_a", "seed_b");
        line(
            3,
            &format!(
                "weights = select(weights, {call}, blend_kernel == {}u);",
                kernel.number()
            ),
        );
    }
    line(
        3,
        &format!(
            "result_material = mixed_surface({accumulator_material}, result_material, weights);"
        ),
    );
    line(2, "}");
}

fn blend(
    kernel: BlendKernel,
    numbers: NumberKind,
    library: &mut WgslLibrary,
    a: &str,
    b: &str,
) -> String {
    numbers.use_blend(kernel, library);
    format!(
        "{}{}({a}, {b}, c.x, c.y, c.z, c.w)",
        blend_name(kernel),
        numbers.suffix()
    )
}
