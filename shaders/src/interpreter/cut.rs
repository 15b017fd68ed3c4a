//! The kernels that cut cells on a device: [`kernel`] refines the cells of a list, a workgroup for
//! each, and lists those of their children that are to be refined in turn; [`plan`] runs before it and
//! says how many it takes. Host and kernels share four buffers besides those of [`super::tape`]:
//!
//! ```text
//! facts   4 words for each instruction:
//!         the slopes of the two operands of its choice (0 where intervals decide), the support of its
//!         kernel, and bits (below)
//! space   8 words, then the choices: 2 bits for each clause, 16 clauses to a word, the words of the
//!         64 children of a cell beside each other
//! work    a `Cut`, 4 words, then the list of `Job`s
//! arguments   of the indirect dispatch
//! nodes   behind the children of all nodes that there is room for, the tape of the cell that each is of
//! ```
//! The words of `space` are counted up from what is there already: nodes, words of tapes, cells with
//! tapes, clauses of their own, cells with longer tapes than they need; then the words of choices in
//! use. Those of `work`: the first cell of the present dispatch, that of the next one, how many are
//! listed, and how many clauses those have that wait.
//!
//! After an edit, new nodes lie behind the old ones. Where a child's tape is what it was and holds no
//! instruction that the edit [`changed`](mark), the child is what it was too, with all that it was cut
//! into: its new entry is its old one.
//!
//! Choices are decided as in [`sdfc_vm::tape::choose`], by the value at the middle of a box and slopes or
//! by intervals ([`Way`]), and what is left is found as in [`sdfc_vm::tape::prune`]. A device may round
//! more than the processor does: by slopes, twice as much is allowed for it; intervals are those of
//! [`sdfc_vm::outward`].

use super::operation::Numbers;
use super::tape::{NODES_SLOT, Registers, TAPES_SLOT, constant, node, step};
use super::{Memory, Record, code_bindings};
use crate::layout::{Cut, Job, NONE_BEFORE};
use sdfc_vm::library::Library;
use sdfc_vm::outward::KNOWN;
use sdfc_vm::program::{Needs, Program};
use sdfc_vm::tape::choose::Test;
use sdfc_vm::tape::{Clause, Tape, flags};
use std::fmt::Write;

/// The binding of the facts.
pub const FACTS_SLOT: u32 = 22;
/// The binding of what is counted, and of the choices.
pub const SPACE_SLOT: u32 = 23;
/// The binding of the list.
pub const WORK_SLOT: u32 = 24;
/// The binding of the arguments of the indirect dispatch.
pub const ARGUMENTS_SLOT: u32 = 25;

/// The most storage buffers that they bind.
pub const STORAGE_BUFFERS: u32 = 7;

/// How many words stand before the choices.
pub const SPACE_WORDS: usize = 8;
/// Which of them count nodes, words of tapes, cells, clauses, and cells with longer tapes than they
/// need.
pub const COUNTS: [&str; 5] = ["NODES", "TAPES", "MADE", "CLAUSES", "SHORT"];
/// How many words stand between the [`Cut`] and the list.
pub const WORK_WORDS: usize = 4;

/// After so many levels in a row that left next to nothing out of their tapes, the next ones will not
/// either: of tapes that are still most of the program, and of others.
pub const STALE: [u32; 2] = [3, 1];

/// The most clauses of a tape that invocations walk through. Three walks through it are fewer rounds
/// than software devices allow (65,535), and 2¹⁸ invocations at once that ask for room for as many
/// clauses count no farther than to 2³².
pub const LONGEST: usize = 15_000;

/// The most registers for values that are named anew.
const MOST_VALUES: usize = 128;

const CHOICE: u32 = 1;
const NEGATES: u32 = 2;
const FIRST_NEGATIVE: u32 = 4;
const SECOND_NEGATIVE: u32 = 8;
const GIVES_POINT: u32 = 16;
const CHANNEL: u32 = 32;
const PAINT: u32 = 64;
const READS_POINT: u32 = 128;
const BLENDS: u32 = 256;
const FIRST_OPERAND: u32 = 512;
const SECOND_OPERAND: u32 = 1024;
const THIRD_OPERAND: u32 = 2048;
const CHANGED: u32 = 4096;

/// How choices are decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Way {
    /// By the value at the middle of a box, and slopes.
    Slopes,
    /// By bounds over the box.
    Intervals,
}

impl Way {
    /// How those of a tape are, and of what it is pruned to.
    pub fn of(tape: &Tape) -> Self {
        if tape.slopes.known() {
            Self::Slopes
        } else {
            Self::Intervals
        }
    }
}

/// Whether these kernels prune tapes of so many registers.
pub fn fits(registers: Registers) -> bool {
    registers.values <= MOST_VALUES
}

/// What pruning has to know of each instruction of a program, as words.
pub fn facts(program: &Program, tape: &Tape) -> Vec<[u32; 4]> {
    let mut facts = vec![[0; 4]; program.code.len()];
    for clause in &tape.clauses {
        facts[clause.at as usize] = fact(clause, Test::of(program, &tape.slopes, clause));
    }
    facts
}

/// Marks the facts of instructions that an edit changed.
pub fn mark<'a>(facts: &mut [[u32; 4]], changed: impl IntoIterator<Item = &'a bool>) {
    for (fact, changed) in facts.iter_mut().zip(changed) {
        fact[3] |= if *changed { CHANGED } else { 0 };
    }
}

/// The fact of a clause that is all of its instruction.
fn fact(clause: &Clause, test: Option<Test>) -> [u32; 4] {
    let there = |register: u16| register != sdfc_vm::tape::NONE;
    let flag = |flag: u8| clause.flags & flag != 0;
    let [a, b, c] = clause.operands.map(there);
    let of_test = |holds: fn(&Test) -> bool| test.as_ref().is_some_and(holds);
    let bits = [
        (test.is_some(), CHOICE),
        (flag(flags::NEGATES), NEGATES),
        (of_test(|test| test.signs[0] < 0.0), FIRST_NEGATIVE),
        (of_test(|test| test.signs[1] < 0.0), SECOND_NEGATIVE),
        (flag(flags::GIVES_POINT), GIVES_POINT),
        (flag(flags::CHANNEL), CHANNEL),
        (flag(flags::PAINT), PAINT),
        (there(clause.point), READS_POINT),
        (there(clause.below), BLENDS),
        (a, FIRST_OPERAND),
        (b, SECOND_OPERAND),
        (c, THIRD_OPERAND),
    ];
    let bits = bits.into_iter().filter(|(holds, _)| *holds);
    let [first, second, support] = test.map_or([0.0; 3], |test| {
        let [first, second] = test.slopes;
        [first, second, test.support]
    });
    [
        first.to_bits(),
        second.to_bits(),
        support.to_bits(),
        bits.fold(0, |word, (_, bit)| word | bit),
    ]
}

/// The kernel that cuts cells of a program that needs these, with tapes of these registers.
pub fn kernel(
    needs: &Needs,
    registers: Registers,
    record: Record,
    memory: Memory,
    way: Way,
) -> String {
    let mut library = Library::default();
    let run = run(needs, registers, record, way, &mut library);
    let bits = registers.bits();
    let mask = (1 << bits) - 1;
    let shift = 8 + bits;
    let mut text = format!(
        "// The kernel `cut`.\n\n{}{}@group(0) @binding({FACTS_SLOT}) var<storage, read> facts: array<vec4u>;
@group(0) @binding({NODES_SLOT}) var<storage, read_write> nodes: array<u32>;
@group(0) @binding({TAPES_SLOT}) var<storage, read_write> tapes: array<vec2u>;
",
        shared(),
        code_bindings(memory),
    );
    let constants = [
        ("CHOICE", CHOICE),
        ("NEGATES", NEGATES),
        ("FIRST_NEGATIVE", FIRST_NEGATIVE),
        ("SECOND_NEGATIVE", SECOND_NEGATIVE),
        ("GIVES_POINT", GIVES_POINT),
        ("CHANNEL", CHANNEL),
        ("PAINT", PAINT),
        ("READS_POINT", READS_POINT),
        ("BLENDS", BLENDS),
        ("FIRST_OPERAND", FIRST_OPERAND),
        ("SECOND_OPERAND", SECOND_OPERAND),
        ("THIRD_OPERAND", THIRD_OPERAND),
        ("CHANGED", CHANGED),
        ("NODE", node(0)),
        ("CONSTANT", constant(false)),
        ("NONE_BEFORE", NONE_BEFORE),
        ("STALE_WHOLE", STALE[0]),
        ("STALE_PART", STALE[1]),
        ("FLAT_DIGIT", 3),
        ("VALUE_WORDS", registers.values.div_ceil(4) as u32),
        ("POINT_WORDS", registers.points.div_ceil(4) as u32),
        ("REGISTER_BITS", bits),
        ("REGISTER_MASK", mask),
        ("INSTRUCTION_SHIFT", shift),
        ("INSTRUCTION_MASK", !0 << shift),
        ("NO_POINT_AND_THIRD", 31 << 3 | mask << 8),
        ("NO_OPERANDS", !0 << bits),
    ];
    for (name, value) in constants {
        let _ = writeln!(text, "const {name} = {value}u;");
    }
    let deciding = match way {
        Way::Slopes => {
            // What rounding may put into a value, as a share of it and of the coordinates.
            text.push_str("const SHARE = 4e-6;\nconst SLACK = 8e-6;\n\n");
            include_str!("../kernels/cut_by_slopes.wgsl")
        }
        Way::Intervals => {
            let _ = writeln!(text, "const KNOWN = {KNOWN:e};\n");
            include_str!("../kernels/cut_by_intervals.wgsl")
        }
    };
    for part in [&library.whole(), &run, "\n", deciding, "\n"] {
        text.push_str(part);
    }
    text.push_str(include_str!("../kernels/cut.wgsl"));
    text
}

/// The kernel that says how many cells of the list are cut next.
pub fn plan() -> String {
    format!(
        "// The kernel `cut_plan`.\n\n{}@group(0) @binding({ARGUMENTS_SLOT}) var<storage, read_write> arguments: array<u32>;\n\n{}",
        shared(),
        include_str!("../kernels/cut_plan.wgsl")
    )
}

/// What both kernels declare.
fn shared() -> String {
    let mut text = format!(
        "{}{}struct Work {{
    cut: Cut,
    state: array<atomic<u32>, {WORK_WORDS}>,
    jobs: array<Job>,
}}
struct Space {{
    state: array<atomic<u32>, {SPACE_WORDS}>,
    choices: array<u32>,
}}
@group(0) @binding({SPACE_SLOT}) var<storage, read_write> space: Space;
@group(0) @binding({WORK_SLOT}) var<storage, read_write> work: Work;
",
        Cut::WGSL,
        Job::WGSL
    );
    let of_space = COUNTS.into_iter().chain(["USED"]).zip(0..);
    let of_work = ["FIRST", "NEXT", "LISTED", "LOAD"].into_iter().zip(0..);
    for (name, at) in of_space.chain(of_work) {
        let _ = writeln!(text, "const {name} = {at}u;");
    }
    text
}

/// The function that runs a tape at a point, or on a box of them, and keeps its choices.
fn run(
    needs: &Needs,
    registers: Registers,
    record: Record,
    way: Way,
    library: &mut Library,
) -> String {
    let Registers { values, points } = registers;
    let (numbers, decided) = match way {
        Way::Slopes => (
            Numbers::Plain,
            "decided(fact, first, second, radius, slack)",
        ),
        Way::Intervals => (Numbers::Intervals, "decided(fact, first, second)"),
    };
    let (value, point) = (numbers.value(), numbers.point());
    numbers.declare(library);
    let mut text = String::new();
    let mut line = |indent: usize, content: &str| {
        let _ = writeln!(text, "{:indent$}{content}", "", indent = indent * 4);
    };
    let more = match way {
        Way::Slopes => ", radius: f32, slack: f32",
        Way::Intervals => "",
    };
    line(
        0,
        &format!(
            "fn run(tape: u32, length: u32, choices: u32, origin: {point}{more}) -> {value} {{"
        ),
    );
    if points > 1 {
        line(1, &format!("var points: array<{point}, {points}>;"));
        line(1, "points[0] = origin;");
    } else {
        line(1, "var p = origin;");
    }
    line(1, &format!("var values: array<{value}, {values}>;"));
    line(1, "var bits = 0u;");
    line(1, "let end = tape + length;");
    line(1, "for (var at = tape + 1u; at <= end; at += 1u) {");
    step(needs, registers, record, numbers, false, library, &mut line);
    line(2, "let place = at - tape - 1u;");
    let pushed = needs.codes.iter().any(|code| code.arity() > 1);
    let blended = !needs.kernels.is_empty();
    let pair = match (pushed, blended) {
        (true, true) => Some([
            "select(a, below, (fact.w & BLENDS) != 0u)",
            "select(b, result, (fact.w & BLENDS) != 0u)",
        ]),
        (true, false) => Some(["a", "b"]),
        (false, true) => Some(["below", "result"]),
        (false, false) => None,
    };
    if let Some([first, second]) = pair {
        line(
            2,
            &format!("let fact = facts[clause.x >> {}u];", 8 + registers.bits()),
        );
        line(2, &format!("let first = {first};"));
        line(2, &format!("let second = {second};"));
        line(
            2,
            "if (fact.w & CHOICE) != 0u && (form == 0u || form == 3u) {",
        );
        line(3, &format!("bits |= {decided} << (2u * (place & 15u));"));
        line(2, "}");
    }
    line(2, "if (place & 15u) == 15u || at == end {");
    line(3, "space.choices[choices + (place >> 4u) * 64u] = bits;");
    line(3, "bits = 0u;");
    line(2, "}");
    line(1, "}");
    line(1, "return values[0];");
    line(0, "}");
    text
}
