//! Tapes of nested regions. A choice that is decided in a region is decided in all regions within it. So
//! the tape of a region is pruned from that of the enclosing region.

use super::prune::{Choice, Pruner};
use super::scalar::{Registers, decide_choice, eval};
use super::{Clause, Tape};
use crate::apply::Apply;
use crate::interval::Interval;
use crate::program::Program;
use std::ops::Range;

/// The range of a tape's clauses in [`TapeStack`].
pub type TapeSpan = Range<usize>;

/// Shorter tapes are not pruned.
const MIN_PRUNED_CLAUSES: usize = 3;

/// A program's full tape and the tapes pruned from it.
pub struct TapeStack {
    /// The clauses of all tapes, the full one first.
    clauses: Vec<Clause>,
    root_len: usize,
    pruner: Pruner,
    /// The choices of the last evaluated region, by clause.
    choices: Vec<Choice>,
}

impl TapeStack {
    /// Creates a stack with only the full tape.
    pub fn new(tape: &Tape) -> Self {
        let mut pruner = Pruner::default();
        pruner.reserve(tape.values, tape.points);
        Self {
            root_len: tape.clauses.len(),
            clauses: tape.clauses.clone(),
            pruner,
            choices: Vec::new(),
        }
    }

    /// Returns the span of the full tape.
    pub fn root(&self) -> TapeSpan {
        0..self.root_len
    }

    /// Returns the number of clauses of all tapes together.
    pub fn clause_count(&self) -> usize {
        self.clauses.len()
    }

    /// Returns the clauses of a tape.
    pub fn tape(&self, span: &TapeSpan) -> &[Clause] {
        &self.clauses[span.clone()]
    }

    /// Evaluates the tape `span` of `program` over a region, whose choices are decided by the `range` of
    /// numbers.
    pub fn eval_over<R: Apply>(
        &mut self,
        program: &Program,
        span: &TapeSpan,
        registers: &mut Registers<R>,
        region: R::Vec3,
        range: impl Fn(R) -> Interval,
    ) -> R {
        let tape = &self.clauses[span.clone()];
        let choices = &mut self.choices;
        choices.clear();
        choices.resize(tape.len(), Choice::Both);
        eval(
            program,
            tape,
            registers,
            region,
            |index, kernel, numbers, operands| {
                choices[index] = decide_choice(kernel, numbers, operands.map(&range));
            },
        )
    }

    /// Prunes the tape of the last evaluated region from `span`, the tape that it was evaluated with.
    pub fn prune(&mut self, span: &TapeSpan) -> TapeSpan {
        let is_decided = |choice: &Choice| *choice != Choice::Both;
        if span.len() < MIN_PRUNED_CLAUSES || !self.choices.iter().any(is_decided) {
            return span.clone();
        }
        let start = self.clauses.len();
        let (parent, choices) = (&self.clauses[span.clone()], &self.choices);
        let mut pruned = Vec::with_capacity(parent.len());
        self.pruner
            .prune(parent, |index| choices[index], &mut pruned);
        self.clauses.append(&mut pruned);
        start..self.clauses.len()
    }

    /// Removes the tapes whose clauses begin at `clause` or later.
    pub fn truncate(&mut self, clause: usize) {
        self.clauses.truncate(clause.max(self.root_len));
    }
}
