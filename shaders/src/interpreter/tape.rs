//! The interpreter of tapes: the same functions as [`super::interpreter`] gives, which look up the
//! cell that a point lies in and run that cell's tape.
//!
//! # Words
//! ```text
//! a clause   x: 0‥2 form   3‥7 point   8‥ third operand, instruction
//!            y: 0‥ result, below, first operand, second operand
//! a tape     x: how many clauses follow
//! a child    31 set: 0‥30 the node with its children
//!            30 set: no tape, but the sign of the field: 0 set where it is negative
//!            else where its tape begins
//! a node     64 children: the digits of x, y and z from the lowest up
//! ```
//! A value's register takes 6 bits, or 8 where there are more than 64 ([`Registers::bits`]). A clause
//! names an instruction of the program that lies beside; a register that is not there has all bits
//! set and is read as the last one, which nothing looks at then. The whole program is a tape like
//! any other.

use super::operation::{
    Names, Numbers, apply_paint, arity, blends, case, constant_operands, declare_paint, frame,
    surface_blend, widest,
};
use super::{Function, Record, code_bindings};
use crate::layout::Grid;
use sdfc_vm::library::Library;
use sdfc_vm::program::{Code, Needs};
use sdfc_vm::surface::tie_line;
use sdfc_vm::tape::{Clause, Form};
use std::fmt::Write;

/// The binding of the nodes.
pub const NODES_SLOT: u32 = 19;
/// The binding of the tapes.
pub const TAPES_SLOT: u32 = 20;
/// The binding of the [`Grid`].
pub const GRID_SLOT: u32 = 21;

const NODE: u32 = 1 << 31;
const CONSTANT: u32 = 1 << 30;

/// The distance that stands for one that is far away.
const FAR: &str = "1e30";

/// How many registers of each kind a kernel has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Registers {
    /// For values.
    pub values: usize,
    /// For points.
    pub points: usize,
}

impl Registers {
    /// As many as a kernel is made for: programs that need about as many share it.
    pub fn class(self) -> Self {
        Self {
            values: self.values.max(4).next_power_of_two(),
            points: self.points.max(1).next_power_of_two(),
        }
    }
    /// The bits that name a value's register.
    pub const fn bits(self) -> u32 {
        if self.values > 64 { 8 } else { 6 }
    }
    /// Whether words can name so many registers, and so many instructions.
    pub fn fit(self, instructions: usize) -> bool {
        self.values <= 256 && self.points <= 32 && instructions <= 1 << (24 - self.bits())
    }
    /// Those that do for both.
    pub fn join(self, other: Self) -> Self {
        Self {
            values: self.values.max(other.values),
            points: self.points.max(other.points),
        }
    }
}

/// The word of a child that has children.
pub fn node(number: u32) -> u32 {
    NODE | number
}

/// The word of a child of which only the sign is known.
pub fn constant(negative: bool) -> u32 {
    CONSTANT | u32::from(negative)
}

/// The words of a clause, of a program whose instructions begin at `base`; a register is named by so
/// many bits.
pub fn clause_words(clause: &Clause, base: u32, bits: u32) -> [u32; 2] {
    let form = match clause.form {
        Form::Whole => 0,
        Form::Alone => 1,
        Form::Negated => 2,
        Form::Blend => 3,
        Form::Copy => 4,
        Form::Negate => 5,
    };
    let register = |r: u16| u32::from(r) & ((1 << bits) - 1);
    let [a, b, c] = clause.operands;
    [
        form | (u32::from(clause.point) & 31) << 3
            | register(c) << 8
            | (clause.at + base) << (8 + bits),
        register(clause.out)
            | register(clause.below) << bits
            | register(a) << (2 * bits)
            | register(b) << (3 * bits),
    ]
}

/// The bindings that this interpreter reads, and the function that looks cells up.
pub fn bindings(memory: super::Memory) -> String {
    format!(
        "{}{}@group(0) @binding({NODES_SLOT}) var<storage, read> nodes: array<u32>;
@group(0) @binding({TAPES_SLOT}) var<storage, read> tapes: array<vec2u>;
@group(0) @binding({GRID_SLOT}) var<uniform> grid: Grid;

// The word of the cell that a point lies in, from that of the first one on.
fn cell_at(p: vec3f, first: u32, whole: u32) -> u32 {{
    let at = (p - grid.low) * grid.scale;
    let most = f32(1u << grid.bits);
    if !(all(at >= vec3f(0.0)) && all(at < vec3f(most))) {{ return whole; }}
    let place = vec3u(at);
    var word = first;
    var within = grid.bits;
    while word >= {NODE}u {{
        within -= grid.digit;
        let digit = (place >> vec3u(within)) & vec3u((1u << grid.digit) - 1u);
        let child = digit.x | digit.y << grid.digit | digit.z << (2u * grid.digit);
        word = nodes[((word & {}u) << 6u) + child];
    }}
    return word;
}}
",
        Grid::WGSL,
        code_bindings(memory),
        NODE - 1,
    )
}

/// The interpreter as one function; what it calls is marked in `library`.
pub fn interpreter(
    needs: &Needs,
    registers: Registers,
    record: Record,
    function: Function,
    library: &mut Library,
) -> String {
    let numbers = function.numbers();
    let surface = function == Function::Surface;
    let (value, point) = (numbers.value(), numbers.point());
    numbers.declare(library);
    let Registers { values, points } = registers;
    let several = points > 1;
    let mut text = String::new();
    let mut line = |indent: usize, content: &str| {
        let _ = writeln!(text, "{:indent$}{content}", "", indent = indent * 4);
    };
    let (head, cells) = match function {
        Function::Distance => (
            "fn scene_distance(origin: vec3f) -> f32 {",
            "grid.distance, grid.distance_whole",
        ),
        Function::Gradient => (
            "fn scene_gradient(origin: vec3f) -> vec4f {",
            "grid.distance, grid.distance_whole",
        ),
        Function::Surface => (
            "fn scene_surface(origin: vec3f, n: vec3f) -> Surface {",
            "grid.surface, grid.surface_whole",
        ),
    };
    line(0, head);
    line(1, &format!("let cell = cell_at(origin, {cells});"));
    if function == Function::Distance {
        line(
            1,
            &format!(
                "if cell >= {CONSTANT}u {{ return select({FAR}, -{FAR}, (cell & 1u) == 1u); }}"
            ),
        );
    }
    let start = if numbers == Numbers::Gradients {
        "DualPoint(origin, vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0))"
    } else {
        "origin"
    };
    if several {
        line(1, &format!("var points: array<{point}, {points}>;"));
        line(1, &format!("points[0] = {start};"));
    } else {
        line(1, &format!("var p = {start};"));
    }
    line(1, &format!("var values: array<{value}, {values}>;"));
    if surface {
        line(1, &format!("var materials: array<Surface, {values}>;"));
        line(1, "materials[0] = unpainted_surface();");
        line(1, &tie_line("origin"));
        line(1, "var channels: array<vec4f, 9>;");
    }
    line(1, "let end = cell + tapes[cell].x;");
    line(1, "for (var at = cell + 1u; at <= end; at += 1u) {");
    step(
        needs, registers, record, numbers, surface, library, &mut line,
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

/// So few registers are read and written with choices among all of them: a device keeps an array in
/// registers of its own only if no number that it computes says which element is meant.
const FEW: usize = 4;

/// The value of a register.
fn read(values: usize, register: &str) -> String {
    if values > FEW {
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

/// What puts `placed` into the register `out`.
fn write(values: usize) -> Vec<String> {
    if values > FEW {
        return vec!["values[out] = placed;".to_owned()];
    }
    let one = |n| format!("values[{n}] = select(values[{n}], placed, out == {n}u);");
    (0..values).map(one).collect()
}

/// What is done for the clause `at`, up to where its result is kept.
pub(super) fn step(
    needs: &Needs,
    registers: Registers,
    record: Record,
    numbers: Numbers,
    surface: bool,
    library: &mut Library,
    line: &mut impl FnMut(usize, &str),
) {
    let Registers { values, points } = registers;
    let bits = registers.bits();
    let register = |number: u32| format!("(clause.y >> {}u) & {}u", number * bits, values - 1);
    let several = points > 1;
    line(2, "let clause = tapes[at];");
    line(2, &format!("let number = clause.x >> {}u;", 8 + bits));
    line(2, "let word = code[number].x;");
    line(2, &format!("let record = number * {}u;", record.size()));
    for k in 0..widest(needs) {
        let place = record.parameters_at() + k as u32;
        line(2, &format!("let k{k} = pool[record + {place}u];"));
    }
    if needs.constant_operands || !needs.kernels.is_empty() {
        line(2, "let c = pool[record];");
    }
    if several {
        let last = points - 1;
        line(2, &format!("let p = points[(clause.x >> 3u) & {last}u];"));
    }
    let place = format!("record + {}u", record.frame_at());
    frame(needs, numbers, &place, library, line);
    line(2, "let form = clause.x & 7u;");
    line(2, &format!("let out = {};", register(0)));
    line(2, &format!("let r0 = {};", register(2)));
    line(2, &format!("let v0 = {};", read(values, "r0")));
    if arity(needs) > 1 {
        line(2, &format!("let r1 = {};", register(3)));
        line(2, &format!("let v1 = {};", read(values, "r1")));
    }
    if arity(needs) > 2 {
        line(2, &format!("let r2 = (clause.x >> 8u) & {}u;", values - 1));
        line(2, &format!("let v2 = {};", read(values, "r2")));
    }
    if arity(needs) > 1 {
        line(2, "var a = v0;");
        line(2, "var b = v1;");
        constant_operands(needs, numbers, line);
    }
    line(2, "var result = v0;");
    if surface {
        let first = if needs.constant_operands {
            "materials[select(r0, r1, constant_operand == 2u)]"
        } else {
            "materials[r0]"
        };
        line(2, &format!("var painted = {first};"));
        declare_paint(line);
    }
    let moves = needs.codes.iter().any(|code| code.gives_point());
    if moves {
        line(2, "var moved = p;");
    }
    let names = Names {
        point: "moved",
        one: "v0",
        two: ["a", "b"],
        three: ["v0", "v1", "v2"],
        both: "constant_operand == 0u",
        materials: Some(["materials[r0]", "materials[r1]"]),
    };
    line(2, "switch select(word & 255u, 256u, form > 2u) {");
    // Without surfaces to give, those of surfaces hand on their operand; guards are for whole programs.
    let idle = |code: &&Code| {
        matches!(code, Code::Load | Code::Store | Code::Take | Code::Guard)
            || code.is_surface() && !surface
    };
    for &code in needs.codes.iter().filter(|code| !idle(code)) {
        let body = case(code, needs, numbers, surface, &names, library);
        line(3, &format!("case {}u: {{ {body} }}", code.number()));
    }
    line(3, "default: {}");
    line(2, "}");
    if surface {
        apply_paint(needs, &names, library, line);
    }
    let negated = match numbers {
        Numbers::Plain | Numbers::Gradients => "-result",
        Numbers::Intervals => "-result.yx",
    };
    line(
        2,
        &format!("if form == 2u || form == 5u {{ result = {negated}; }}"),
    );
    if !needs.kernels.is_empty() {
        line(2, &format!("let rb = {};", register(1)));
        line(2, &format!("let below = {};", read(values, "rb")));
        line(
            2,
            "let kernel = select(0u, (word >> 8u) & 7u, form == 0u || form == 3u);",
        );
    }
    blends(needs, numbers, library, line);
    if surface {
        surface_blend(needs, "materials[rb]", library, line);
    }
    let channels = surface && needs.codes.contains(&Code::Channel);
    let open = if moves || channels {
        line(2, "if (word & 0x800u) == 0u {");
        3
    } else {
        2
    };
    for text in write(values) {
        line(open, &text);
    }
    if surface {
        line(open, "materials[out] = painted;");
    }
    if moves {
        let condition = if channels {
            format!(" if (word & 255u) != {}u", Code::Channel.number())
        } else {
            String::new()
        };
        line(2, &format!("}} else{condition} {{"));
        line(3, &format!("points[clause.y & {}u] = moved;", points - 1));
    }
    if moves || channels {
        line(2, "}");
    }
}
