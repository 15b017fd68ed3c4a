//! Tapes: the form of programs that the CPU evaluates and that cells prune.
//!
//! For each instruction of a [`Program`], a tape lists the registers of its operands and of its result;
//! there is no stack. The operation, its constants and its point transform stay in the program, so a clause
//! is small. A pruned tape holds only the clauses that matter in some region of space. Moves between stack
//! and slots need no clause.
//!
//! The result of a tape is in register 0. Point 0 is the point of evaluation.

mod build;
pub mod evaluator;
pub mod lipschitz;
pub mod prune;
pub mod scalar;
pub mod stack;
pub mod trace;

use crate::program::Program;
use lipschitz::LipschitzBounds;
use std::sync::Arc;

/// Marks an operand without a register.
pub const NO_REGISTER: u16 = u16::MAX;

/// The part of its instruction that a clause executes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ClauseKind {
    /// The whole instruction.
    Full,
    /// The operation, without the blend.
    OpOnly,
    /// The negated operation, without the blend.
    NegatedOp,
    /// Only the blend, of the first operand into the accumulator.
    Blend,
    /// A copy of the first operand.
    Copy,
    /// The first operand, negated.
    Negate,
}

/// One step of a tape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clause<R = u16> {
    /// Index of the instruction in the program.
    pub instruction: u32,
    /// The part of the instruction that it executes.
    pub kind: ClauseKind,
    /// Properties that pruning needs; see [`flags`].
    pub flags: u8,
    /// Destination: the register of a value or of a point.
    pub dst: R,
    /// The register that the result is blended into.
    pub accumulator: R,
    /// The registers of the operands; [`NO_REGISTER`] for constant or missing ones.
    pub operands: [R; 3],
    /// The register of the point of evaluation.
    pub point: R,
}

/// Properties of a clause that pruning needs, as bits.
pub mod flags {
    /// The result is a point.
    pub const RETURNS_POINT: u8 = 1;
    /// A hard or smooth minimum or maximum that a region may decide. Its operands are the accumulator and
    /// the value, or the first two operands.
    pub const CHOICE: u8 = 2;
    /// The second operand is negated where it is chosen.
    pub const NEGATES: u8 = 4;
    /// The clause sets a channel of the next material.
    pub const CHANNEL: u8 = 8;
    /// The clause assigns a material, with the channels set since the previous assignment.
    pub const PAINT: u8 = 16;
    /// A pure operation of the table: no point transform and no blend. Fields written with coordinates
    /// consist of these.
    pub const SIMPLE_OP: u8 = 32;
}

/// The tape of a complete program.
#[derive(Clone, Debug, PartialEq)]
pub struct Tape {
    /// The clauses, in order of evaluation.
    pub clauses: Vec<Clause>,
    /// Number of value registers.
    pub values: usize,
    /// Number of point registers.
    pub points: usize,
    /// Lipschitz bounds of the two operands of every choice.
    pub lipschitz: Arc<LipschitzBounds>,
}

impl Tape {
    /// Builds the tape of a verified program with its current constants.
    pub fn new(program: &Program) -> Self {
        let (clauses, values, points) = build::clauses(program);
        let mut pruner = prune::Pruner::default();
        pruner.reserve(values, points);
        let mut kept = Vec::with_capacity(clauses.len());
        let needs = pruner.prune(&clauses, |_| prune::Choice::Both, &mut kept);
        Self {
            clauses: kept,
            values: needs.values,
            points: needs.points,
            lipschitz: Arc::new(LipschitzBounds::new(program, &clauses, values, points)),
        }
    }
}
