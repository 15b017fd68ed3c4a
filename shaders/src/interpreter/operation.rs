//! What is the same in both interpreters: an instruction's frame, its operation and its blends.

use sdfc_vm::apply::wgsl_name;
use sdfc_vm::kernel::Kernel;
use sdfc_vm::library::{GUARD_NAME, Library, blend_name};
use sdfc_vm::program::{Code, Needs};
use sdfc_vm::row::{Category, Input, Output, ParameterType, Row};
use sdfc_vm::surface::precedence;
use sdfc_vm::table::Op;
use std::fmt::Write;

/// What an interpreter computes with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Numbers {
    /// Values at points.
    Plain,
    /// Values at points, and their gradients.
    Gradients,
    /// Bounds of values over boxes of points.
    Intervals,
}

impl Numbers {
    /// The type of a value.
    pub(super) fn value(self) -> &'static str {
        match self {
            Self::Plain => "f32",
            Self::Gradients => "vec4f",
            Self::Intervals => "vec2f",
        }
    }

    /// The type of a point.
    pub(super) fn point(self) -> &'static str {
        match self {
            Self::Plain => "vec3f",
            Self::Gradients => "DualPoint",
            Self::Intervals => "BoxPoint",
        }
    }

    /// What stands behind the names of functions.
    fn suffix(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Gradients => "_gradient",
            Self::Intervals => "_interval",
        }
    }

    /// Marks the declaration of points as used.
    pub(super) fn declare(self, library: &mut Library) {
        match self {
            Self::Plain => {}
            Self::Gradients => library.use_points(),
            Self::Intervals => library.use_boxes(),
        }
    }

    fn use_operation(self, op: Op, library: &mut Library) {
        match self {
            Self::Plain => library.use_value(op),
            Self::Gradients => library.use_gradient(op),
            Self::Intervals => library.use_interval(op),
        }
    }

    fn use_blend(self, kernel: Kernel, library: &mut Library) {
        match self {
            Self::Plain => library.use_blend(kernel),
            Self::Gradients => library.use_blend_gradient(kernel),
            Self::Intervals => library.use_blend_interval(kernel),
        }
    }
}

/// What material the value of a row has, if it is not that of its last operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Paint {
    /// That of what nothing was painted on.
    Unpainted = 1,
    /// Both operands', by the row's derivatives.
    Mixed = 2,
    /// The first of two operands'.
    First = 3,
}

impl Paint {
    fn of(row: &Row) -> Option<Self> {
        match row.arity() {
            _ if row.output != Output::Value => None,
            0 => Some(Self::Unpainted),
            2 if row.meta.category == Category::Combine => Some(Self::Mixed),
            2 => Some(Self::First),
            _ => None,
        }
    }
}

/// Declares what the cases of surfaces say of the material, in front of the `switch`.
pub(super) fn declare_paint(line: &mut impl FnMut(usize, &str)) {
    line(2, "var paint = 0u;");
    line(2, "var weights = vec4f();");
}

/// The material of a row's value, behind the `switch`: materials are large, and a driver that runs all
/// cases would move them in each.
pub(super) fn apply_paint(
    needs: &Needs,
    names: &Names<'_>,
    library: &mut Library,
    line: &mut impl FnMut(usize, &str),
) {
    let has = |paint: Paint| {
        let mut codes = needs.codes.iter();
        codes.any(|code| matches!(code, Code::Op(op) if Paint::of(op.row()) == Some(paint)))
    };
    let mut becomes = |paint: Paint, condition: &str, material: String| {
        let number = paint as u32;
        line(
            2,
            &format!("if paint == {number}u{condition} {{ painted = {material}; }}"),
        );
    };
    if has(Paint::Unpainted) {
        becomes(Paint::Unpainted, "", "unpainted_surface()".to_owned());
    }
    let Some([first, second]) = names.materials else {
        return;
    };
    let both = if needs.constant_operands {
        format!(" && {}", names.both)
    } else {
        String::new()
    };
    if has(Paint::Mixed) {
        library.use_mixed_surface();
        let mixed = format!("mixed_surface({first}, {second}, weights)");
        becomes(Paint::Mixed, &both, mixed);
    }
    if has(Paint::First) {
        becomes(Paint::First, &both, first.to_owned());
    }
}

/// How the text calls the operands of operations.
pub(super) struct Names<'a> {
    /// Where a point goes that an operation gives.
    pub(super) point: &'a str,
    /// The only one.
    pub(super) one: &'static str,
    /// Two.
    pub(super) two: [&'static str; 2],
    /// Three.
    pub(super) three: [&'static str; 3],
    /// Whether neither of two is a constant, if any may be.
    pub(super) both: &'static str,
    /// The materials of two, if there is room for so many.
    pub(super) materials: Option<[&'static str; 2]>,
}

/// The point through the instruction's frame, as `q`, with constants from `place` on.
pub(super) fn frame(
    needs: &Needs,
    numbers: Numbers,
    place: &str,
    library: &mut Library,
    line: &mut impl FnMut(usize, &str),
) {
    if !needs.moved && !needs.mapped {
        line(2, "let q = p;");
        return;
    }
    line(2, "let frame = (word >> 14u) & 3u;");
    line(2, &format!("let f0 = pool[{place}];"));
    line(2, "var q = p;");
    if needs.moved {
        line(
            2,
            match numbers {
                Numbers::Plain => "q = select(p, p + f0.xyz, frame == 1u);",
                Numbers::Gradients => "q.p = select(p.p, p.p + f0.xyz, frame == 1u);",
                Numbers::Intervals => {
                    library.use_moved_interval();
                    "if frame == 1u { q = moved_interval(p, f0.xyz); }"
                }
            },
        );
    }
    if needs.mapped {
        line(2, &format!("let f1 = pool[{place} + 1u];"));
        line(2, &format!("let f2 = pool[{place} + 2u];"));
        line(2, "let rows = transpose(mat3x3f(f0.xyz, f1.xyz, f2.xyz));");
        line(2, "let shift = vec3f(f0.w, f1.w, f2.w);");
        line(
            2,
            match numbers {
                Numbers::Plain => {
                    library.use_mapped();
                    "q = select(q, mapped(p, rows, shift), frame == 2u);"
                }
                Numbers::Gradients => {
                    library.use_mapped_gradient();
                    "if frame == 2u { q = mapped_gradient(p, rows, shift); }"
                }
                Numbers::Intervals => {
                    library.use_mapped_interval();
                    "if frame == 2u { q = mapped_interval(p, rows[0], rows[1], rows[2], shift); }"
                }
            },
        );
    }
}

/// What an opcode does: it sets `result`, or the point, and in surfaces perhaps the material.
pub(super) fn case(
    code: Code,
    needs: &Needs,
    numbers: Numbers,
    surface: bool,
    names: &Names<'_>,
    library: &mut Library,
) -> String {
    let slot = "(word >> 24u)";
    match code {
        Code::Op(op) => {
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
                0 | 1 => [names.one, "", ""],
                2 => [names.two[0], names.two[1], ""],
                _ => names.three,
            };
            let target = if row.output == Output::Point {
                names.point
            } else {
                "result"
            };
            let mut body = format!("{target} = {};", call("q", values));
            if surface && let Some(paint) = Paint::of(row) {
                let _ = write!(body, " paint = {}u;", paint as u32);
                if paint == Paint::Mixed {
                    // The point stays: only the operands' shares are asked for.
                    let still = "DualPoint(q.p, vec3f(), vec3f(), vec3f())";
                    let first = format!("first_seed(a, b, tie * {:.1})", precedence(op));
                    let seeds = [&*first, "vec4f(0.0, 1.0, 0.0, b.w)", ""];
                    let _ = write!(body, " weights = {};", call(still, seeds));
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
        Code::Guard => {
            library.use_guard();
            // Only tapes run on intervals, and they have no guards.
            let (point, value) = match numbers {
                Numbers::Plain | Numbers::Intervals => ("q", ""),
                Numbers::Gradients => ("q.p", ".w"),
            };
            format!(
                "if {GUARD_NAME}({point}, {}{value}, k0.xyz, k0.w, k1.xyz, k1.w) > 0.0 \
                 {{ at += instruction.w; }}",
                names.one
            )
        }
        Code::Channel => format!("channels[{slot}] = {};", names.one),
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
                "result = {}; painted = Surface(vec3f({}, {}, {}), {}, vec3f({}, {}, {}), {}, {bump}, k2.x);",
                names.one,
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

/// The most operands of an operation.
pub(super) fn arity(needs: &Needs) -> usize {
    let arities = needs.codes.iter().map(|code| code.arity());
    arities.max().unwrap_or(0)
}

/// Puts a constant in the place of one of the operands `a` and `b`, where the instruction says so.
pub(super) fn constant_operands(
    needs: &Needs,
    numbers: Numbers,
    line: &mut impl FnMut(usize, &str),
) {
    if !needs.constant_operands {
        return;
    }
    let constant = match numbers {
        Numbers::Plain => "c.x",
        Numbers::Gradients => "vec4f(0.0, 0.0, 0.0, c.x)",
        Numbers::Intervals => "vec2f(c.x)",
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

/// How many vectors of constants the widest operation reads.
pub(super) fn widest(needs: &Needs) -> usize {
    let widths = needs.codes.iter().map(|code| code.pool_width());
    widths.max().unwrap_or(0)
}

/// `value` with all blends done that the instruction may want, `below` being what it is blended
/// into.
pub(super) fn blends(
    needs: &Needs,
    numbers: Numbers,
    library: &mut Library,
    line: &mut impl FnMut(usize, &str),
) {
    line(2, "var placed = result;");
    for &kernel in &needs.kernels {
        let call = blend(kernel, numbers, library, "below", "result");
        line(
            2,
            &format!(
                "placed = select(placed, {call}, kernel == {}u);",
                kernel.number()
            ),
        );
    }
}

/// The material of a blend: both operands', by the blend's derivatives. `under` is that of what is
/// below.
pub(super) fn surface_blend(
    needs: &Needs,
    under: &str,
    library: &mut Library,
    line: &mut impl FnMut(usize, &str),
) {
    if needs.kernels.is_empty() {
        return;
    }
    library.use_mixed_surface();
    line(2, "if kernel != 0u {");
    line(3, "let seed_a = first_seed(below, result, tie * c.x);");
    line(3, "let seed_b = vec4f(0.0, 1.0, 0.0, result.w);");
    line(3, "var weights = vec4f();");
    for &kernel in &needs.kernels {
        let call = blend(kernel, Numbers::Gradients, library, "seed_a", "seed_b");
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

fn blend(kernel: Kernel, numbers: Numbers, library: &mut Library, a: &str, b: &str) -> String {
    numbers.use_blend(kernel, library);
    format!(
        "{}{}({a}, {b}, c.x, c.y, c.z, c.w)",
        blend_name(kernel),
        numbers.suffix()
    )
}
