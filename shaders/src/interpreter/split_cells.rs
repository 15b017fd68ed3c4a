//! The kernels that split cells on a device: [`kernel`] splits the listed cells, one workgroup for each. It
//! lists those of their children that are split in turn. [`plan`] runs before it and determines the number of
//! cells. Host and kernels share four buffers besides those of [`super::tape`]:
//!
//! ```text
//! instruction_info   4 words for each instruction: the slopes of the two operands of its choice (0 where
//!                    intervals decide), the support of its blend kernel, and bits (below)
//! scratch            8 words, then the choices: 2 bits for each clause, 16 clauses to a word, the words of
//!                    the 64 children of a cell beside each other
//! job_queue          a `SplitParams`, 4 words, then the list of `CellJob`s
//! arguments          of the indirect dispatch
//! nodes              after the children of all nodes, for each node the tape of its cell
//! ```
//! | word | `scratch`, counted up from initial values | `job_queue` |
//! |---|---|---|
//! | 0 | nodes | first cell of the present dispatch |
//! | 1 | words of tapes | first cell of the next dispatch |
//! | 2 | cells with tapes | listed cells |
//! | 3 | clauses of those tapes | clauses of the waiting cells |
//! | 4 | cells without memory for a shorter tape | |
//! | 5 | words of choices in use | |
//!
//! After an edit, new nodes follow the old ones. A child with an equal tape that contains no
//! [changed](mark_changed) instruction is itself unchanged, with all its descendants. Its new entry is its
//! old one.
//!
//! Choices are decided as in [`sdfc_vm::tape::trace`], by slopes or by intervals ([`PruneMethod`]). Tapes are
//! pruned as in [`sdfc_vm::tape::prune`]. A device may round more than the CPU does: slopes have twice the
//! slack; intervals are those of [`sdfc_vm::wgsl_interval`].

use super::operation::NumberKind;
use super::tape::{KernelRegisters, NODES_SLOT, TAPES_SLOT, constant_word, emit_clause, node_word};
use super::{ConstantLayout, ProgramStorage, code_bindings};
use crate::layout::{CellJob, NO_OLD_ENTRY, SplitParams};
use sdfc_vm::program::{KernelRequirements, Program};
use sdfc_vm::tape::trace::ChoiceTest;
use sdfc_vm::tape::{Clause, Tape, flags};
use sdfc_vm::wgsl_interval::MAX_BOUNDED;
use sdfc_vm::wgsl_library::WgslLibrary;
use std::fmt::Write;

/// Binding of the instruction info.
pub const INSTRUCTION_INFO_SLOT: u32 = 22;
/// Binding of the counters and the choices.
pub const SCRATCH_SLOT: u32 = 23;
/// Binding of the job queue.
pub const JOB_QUEUE_SLOT: u32 = 24;
/// Binding of the arguments of the indirect dispatch.
pub const ARGUMENTS_SLOT: u32 = 25;

/// Maximum number of storage buffers that they bind.
pub const MAX_STORAGE_BUFFERS: u32 = 7;

/// Number of words before the choices.
pub const SCRATCH_HEADER_WORDS: usize = 8;
/// Names of the first of these words: nodes, words of tapes, cells, clauses, and cells without memory for a
/// shorter tape.
pub const COUNTERS: [&str; 5] = ["NODES", "TAPES", "CELLS", "CLAUSES", "OUT_OF_MEMORY"];
/// Number of words between the [`SplitParams`] and the list.
pub const JOB_QUEUE_STATE_WORDS: usize = 4;

/// Number of successive levels that each removed less than a tenth of the clauses, after which splitting stops.
/// The first is for tapes of more than half of the program, the second for shorter ones.
pub const MAX_STALLED_LEVELS: [u32; 2] = [3, 1];
/// Number of tenths of a tape's clauses. A tape with more than these is hardly shorter.
pub const STALLED_LENGTH_TENTHS: u32 = 9;
/// Divisor of the program's number of clauses. A tape with at most the quotient counts as pruned.
pub const PRUNED_DIVISOR: u32 = 2;
/// Absolute value of the field, in sides of a cell, from which the cell is not split. A step is about as long
/// as the value, so that rays take few samples in it.
pub const MAX_FIELD_SIDES: f32 = 2.0;
/// Minimum distance of a cell from the camera, in sides. It also applies to a camera inside the cell.
pub const MIN_CAMERA_DISTANCE_SIDES: f32 = 0.25;

/// Maximum number of clauses of a tape. Three passes over it are fewer iterations than software devices allow
/// (65,535). If 2¹⁸ concurrent invocations reserve memory for that many clauses, they count to at most 2³².
pub const MAX_TAPE_CLAUSES: usize = 15_000;

/// Maximum number of value registers that are renamed.
const MAX_VALUE_REGISTERS: usize = 128;

const CHOICE: u32 = 1;
const NEGATES: u32 = 2;
const FIRST_NEGATIVE: u32 = 4;
const SECOND_NEGATIVE: u32 = 8;
const RETURNS_POINT: u32 = 16;
const CHANNEL: u32 = 32;
const PAINT: u32 = 64;
const READS_POINT: u32 = 128;
const BLENDS: u32 = 256;
const FIRST_OPERAND: u32 = 512;
const SECOND_OPERAND: u32 = 1024;
const THIRD_OPERAND: u32 = 2048;
const CHANGED: u32 = 4096;

/// Method of deciding choices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PruneMethod {
    /// By the value at the centre of a box, and slopes.
    Lipschitz,
    /// By bounds over the box.
    Interval,
}

impl PruneMethod {
    /// Returns the method for a tape and all tapes that it is pruned to.
    pub fn for_tape(tape: &Tape) -> Self {
        if tape.lipschitz.is_bounded() {
            Self::Lipschitz
        } else {
            Self::Interval
        }
    }
}

/// Reports whether these kernels prune tapes with these registers.
pub fn fits(registers: KernelRegisters) -> bool {
    registers.values <= MAX_VALUE_REGISTERS
}

/// Returns the data for pruning of each instruction of a program, as words.
pub fn instruction_info(program: &Program, tape: &Tape) -> Vec<[u32; 4]> {
    let mut words = vec![[0; 4]; program.code.len()];
    for clause in &tape.clauses {
        words[clause.instruction as usize] = info_words(
            clause,
            ChoiceTest::for_clause(program, &tape.lipschitz, clause),
        );
    }
    words
}

/// Marks instructions that an edit changed.
pub fn mark_changed<'a>(info: &mut [[u32; 4]], changed: impl IntoIterator<Item = &'a bool>) {
    for (words, changed) in info.iter_mut().zip(changed) {
        words[3] |= if *changed { CHANGED } else { 0 };
    }
}

/// Returns the words of a clause that is its complete instruction.
fn info_words(clause: &Clause, test: Option<ChoiceTest>) -> [u32; 4] {
    let is_present = |register: u16| register != sdfc_vm::tape::NO_REGISTER;
    let flag = |flag: u8| clause.flags & flag != 0;
    let [a, b, c] = clause.operands.map(is_present);
    let test_has = |holds: fn(&ChoiceTest) -> bool| test.as_ref().is_some_and(holds);
    let bits = [
        (test.is_some(), CHOICE),
        (flag(flags::NEGATES), NEGATES),
        (test_has(|test| test.signs[0] < 0.0), FIRST_NEGATIVE),
        (test_has(|test| test.signs[1] < 0.0), SECOND_NEGATIVE),
        (flag(flags::RETURNS_POINT), RETURNS_POINT),
        (flag(flags::CHANNEL), CHANNEL),
        (flag(flags::PAINT), PAINT),
        (is_present(clause.point), READS_POINT),
        (is_present(clause.accumulator), BLENDS),
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

/// Returns the kernel that splits cells of a program with these requirements, with tapes of these registers.
pub fn kernel(
    requirements: &KernelRequirements,
    registers: KernelRegisters,
    layout: ConstantLayout,
    memory: ProgramStorage,
    method: PruneMethod,
) -> String {
    let mut library = WgslLibrary::default();
    let run_tape = run_tape(requirements, registers, layout, method, &mut library);
    let bits = registers.name_bits();
    let mask = (1 << bits) - 1;
    let shift = 8 + bits;
    let mut text = format!(
        "// The kernel `split_cells`.\n\n{}{}@group(0) @binding({INSTRUCTION_INFO_SLOT}) var<storage, read> instruction_info: array<vec4u>;
@group(0) @binding({NODES_SLOT}) var<storage, read_write> nodes: array<u32>;
@group(0) @binding({TAPES_SLOT}) var<storage, read_write> tapes: array<vec2u>;
",
        shared_declarations(),
        code_bindings(memory),
    );
    let constants = [
        ("CHOICE", CHOICE),
        ("NEGATES", NEGATES),
        ("FIRST_NEGATIVE", FIRST_NEGATIVE),
        ("SECOND_NEGATIVE", SECOND_NEGATIVE),
        ("RETURNS_POINT", RETURNS_POINT),
        ("CHANNEL", CHANNEL),
        ("PAINT", PAINT),
        ("READS_POINT", READS_POINT),
        ("BLENDS", BLENDS),
        ("FIRST_OPERAND", FIRST_OPERAND),
        ("SECOND_OPERAND", SECOND_OPERAND),
        ("THIRD_OPERAND", THIRD_OPERAND),
        ("CHANGED", CHANGED),
        ("NODE", node_word(0)),
        ("SIGN_ONLY", constant_word(false)),
        ("NO_OLD_ENTRY", NO_OLD_ENTRY),
        ("MAX_STALLED_FULL", MAX_STALLED_LEVELS[0]),
        ("MAX_STALLED_PRUNED", MAX_STALLED_LEVELS[1]),
        ("STALLED_LENGTH_TENTHS", STALLED_LENGTH_TENTHS),
        ("PRUNED_DIVISOR", PRUNED_DIVISOR),
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
    let _ = writeln!(
        text,
        "const MAX_FIELD_SIDES = {MAX_FIELD_SIDES:?};\nconst MIN_CAMERA_DISTANCE_SIDES = {MIN_CAMERA_DISTANCE_SIDES:?};"
    );
    let decision_text = match method {
        PruneMethod::Lipschitz => {
            // Rounding errors of a value, relative to it and to the coordinates.
            text.push_str("const RELATIVE_SLACK = 4e-6;\nconst COORDINATE_SLACK = 8e-6;\n\n");
            include_str!("../kernels/prune_by_slopes.wgsl")
        }
        PruneMethod::Interval => {
            let _ = writeln!(text, "const MAX_BOUNDED = {MAX_BOUNDED:e};\n");
            include_str!("../kernels/prune_by_intervals.wgsl")
        }
    };
    for part in [
        &library.text_with_prelude(),
        &run_tape,
        "\n",
        decision_text,
        "\n",
        include_str!("../kernels/split_rule.wgsl"),
        "\n",
    ] {
        text.push_str(part);
    }
    text.push_str(include_str!("../kernels/split_cells.wgsl"));
    text
}

/// Returns the kernel that determines the number of listed cells that are split next.
pub fn plan() -> String {
    format!(
        "// The kernel `plan_dispatch`.\n\n{}@group(0) @binding({ARGUMENTS_SLOT}) var<storage, read_write> arguments: array<u32>;\n\n{}",
        shared_declarations(),
        include_str!("../kernels/plan_dispatch.wgsl")
    )
}

/// Returns the declarations of both kernels.
fn shared_declarations() -> String {
    let mut text = format!(
        "{}{}struct JobQueue {{
    params: SplitParams,
    state: array<atomic<u32>, {JOB_QUEUE_STATE_WORDS}>,
    jobs: array<CellJob>,
}}
struct Scratch {{
    state: array<atomic<u32>, {SCRATCH_HEADER_WORDS}>,
    choices: array<u32>,
}}
@group(0) @binding({SCRATCH_SLOT}) var<storage, read_write> scratch: Scratch;
@group(0) @binding({JOB_QUEUE_SLOT}) var<storage, read_write> job_queue: JobQueue;
",
        SplitParams::WGSL,
        CellJob::WGSL
    );
    let scratch_counters = COUNTERS.into_iter().chain(["CHOICE_WORDS"]).zip(0..);
    let queue_counters = ["FIRST", "NEXT", "LISTED", "WAITING_CLAUSES"]
        .into_iter()
        .zip(0..);
    for (name, index) in scratch_counters.chain(queue_counters) {
        let _ = writeln!(text, "const {name} = {index}u;");
    }
    text
}

/// Returns the function that runs a tape at a point, or on a box, and stores its choices.
fn run_tape(
    requirements: &KernelRequirements,
    registers: KernelRegisters,
    layout: ConstantLayout,
    method: PruneMethod,
    library: &mut WgslLibrary,
) -> String {
    let KernelRegisters { values, points } = registers;
    let (numbers, decision) = match method {
        PruneMethod::Lipschitz => (
            NumberKind::Plain,
            "decide_choice(info, first, second, radius, slack)",
        ),
        PruneMethod::Interval => (NumberKind::Intervals, "decide_choice(info, first, second)"),
    };
    let (value, point) = (numbers.value(), numbers.point());
    numbers.declare(library);
    let mut text = String::new();
    let mut line = |indent: usize, content: &str| {
        let _ = writeln!(text, "{:indent$}{content}", "", indent = indent * 4);
    };
    let extra_parameters = match method {
        PruneMethod::Lipschitz => ", radius: f32, slack: f32",
        PruneMethod::Interval => "",
    };
    line(
        0,
        &format!(
            "fn run_tape(tape: u32, length: u32, choices: u32, origin: {point}{extra_parameters}) -> {value} {{"
        ),
    );
    if points > 1 {
        line(1, &format!("var points: array<{point}, {points}>;"));
        line(1, "points[0] = origin;");
    } else {
        line(1, "var p = origin;");
    }
    line(1, &format!("var values: array<{value}, {values}>;"));
    line(1, "var choices_word = 0u;");
    line(1, "let end = tape + length;");
    line(
        1,
        "for (var index = tape + 1u; index <= end; index += 1u) {",
    );
    emit_clause(
        requirements,
        registers,
        layout,
        numbers,
        false,
        library,
        &mut line,
    );
    line(2, "let clause_index = index - tape - 1u;");
    let has_pairs = requirements.codes.iter().any(|code| code.arity() > 1);
    let has_blends = !requirements.blend_kernels.is_empty();
    let pair = match (has_pairs, has_blends) {
        (true, true) => Some([
            "select(a, accumulator, (info.w & BLENDS) != 0u)",
            "select(b, result, (info.w & BLENDS) != 0u)",
        ]),
        (true, false) => Some(["a", "b"]),
        (false, true) => Some(["accumulator", "result"]),
        (false, false) => None,
    };
    if let Some([first, second]) = pair {
        line(
            2,
            &format!(
                "let info = instruction_info[clause.x >> {}u];",
                8 + registers.name_bits()
            ),
        );
        line(2, &format!("let first = {first};"));
        line(2, &format!("let second = {second};"));
        line(
            2,
            "if (info.w & CHOICE) != 0u && (kind == 0u || kind == 3u) {",
        );
        line(
            3,
            &format!("choices_word |= {decision} << (2u * (clause_index & 15u));"),
        );
        line(2, "}");
    }
    line(2, "if (clause_index & 15u) == 15u || index == end {");
    line(
        3,
        "scratch.choices[choices + (clause_index >> 4u) * 64u] = choices_word;",
    );
    line(3, "choices_word = 0u;");
    line(2, "}");
    line(1, "}");
    line(1, "return values[0];");
    line(0, "}");
    text
}
