//! Tapes: programs in the form that the CPU runs and that cells prune.
//!
//! A tape says of each instruction of a [`Program`] where its operands are and where its result
//! goes: registers instead of a stack. What the instruction does (operation, constants, frame)
//! stays in the program, so a clause is small, and a pruned tape is a list of those clauses that
//! matter in some region of space. Moves between stack and slots leave no clause behind.
//!
//! A tape's result is in register 0, and the point where it is evaluated is point 0.

mod build;
pub mod choose;
pub mod machine;
pub mod parts;
pub mod prune;
pub mod single;
pub mod steep;

use crate::program::Program;
use std::sync::Arc;
use steep::Slopes;

/// A register that holds nothing.
pub const NONE: u16 = u16::MAX;

/// What a clause does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Form {
    /// All that its instruction says.
    Whole,
    /// Its instruction's operation, without the blend.
    Alone,
    /// Its instruction's operation, without the blend, and with the other sign.
    Negated,
    /// Only its instruction's blend, of the first operand into what is below.
    Blend,
    /// It hands on the first operand.
    Copy,
    /// It hands on the first operand with the other sign.
    Negate,
}

/// One step of a tape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clause<R = u16> {
    /// Which instruction of the program.
    pub at: u32,
    /// What of it is done.
    pub form: Form,
    /// What pruning has to know of it; see [`flags`].
    pub flags: u8,
    /// Where the result goes: a value's register, or a point's.
    pub out: R,
    /// What the result is blended into.
    pub below: R,
    /// The operands.
    pub operands: [R; 3],
    /// The point it looks at.
    pub point: R,
}

/// What pruning has to know of a clause, as bits.
pub mod flags {
    /// Its result is a point.
    pub const GIVES_POINT: u8 = 1;
    /// It is a hard or smooth minimum or maximum that a region may decide: of `below` and the
    /// value, or of the first two operands.
    pub const CHOICE: u8 = 2;
    /// Where the second of the two is chosen, its sign changes.
    pub const NEGATES: u8 = 4;
    /// It sets a channel of the next material.
    pub const CHANNEL: u8 = 8;
    /// It paints, with the channels set since the clause that painted before.
    pub const PAINT: u8 = 16;
    /// It is an operation of the table at the point as it is, and its value is blended into nothing: what
    /// fields written with coordinates consist of.
    pub const BARE: u8 = 32;
}

/// A whole program as a tape.
#[derive(Clone, Debug, PartialEq)]
pub struct Tape {
    /// Its steps.
    pub clauses: Vec<Clause>,
    /// How many value registers it uses.
    pub values: usize,
    /// How many point registers it uses.
    pub points: usize,
    /// How steep what its choices are between is.
    pub slopes: Arc<Slopes>,
}

impl Tape {
    /// The tape of a verified program with its present constants.
    pub fn of(program: &Program) -> Self {
        let (clauses, values, points) = build::clauses(program);
        let mut pruner = prune::Pruner::default();
        pruner.reserve(values, points);
        let mut kept = Vec::with_capacity(clauses.len());
        let needs = pruner.prune(&clauses, |_| prune::Choice::Both, &mut kept);
        Self {
            clauses: kept,
            values: needs.values,
            points: needs.points,
            slopes: Arc::new(Slopes::of(program, &clauses, values, points)),
        }
    }
}
