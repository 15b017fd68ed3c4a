//! Programs of regions within regions: what a choice leaves out of a region it leaves out of all within, so the program
//! of a region is pruned from that of the region around it.

use super::prune::{Choice, Pruner};
use super::single::{Registers, decide, run};
use super::{Clause, Tape};
use crate::apply::Apply;
use crate::interval::Interval;
use crate::program::Program;
use std::ops::Range;

/// The place of a region's program in [`Parts`].
pub type Part = Range<usize>;

/// Programs shorter than this are not worth pruning.
const SHORT: usize = 3;

/// A whole program and those that were pruned from it.
pub struct Parts {
    /// The clauses of all programs, the whole one first.
    clauses: Vec<Clause>,
    whole: usize,
    pruner: Pruner,
    /// The choices of the region that was asked last, by clause.
    choices: Vec<Choice>,
}

impl Parts {
    /// A whole program alone.
    pub fn of(tape: &Tape) -> Self {
        let mut pruner = Pruner::default();
        pruner.reserve(tape.values, tape.points);
        Self {
            whole: tape.clauses.len(),
            clauses: tape.clauses.clone(),
            pruner,
            choices: Vec::new(),
        }
    }

    /// The whole program.
    pub fn whole(&self) -> Part {
        0..self.whole
    }

    /// The number of clauses of all programs together.
    pub fn count(&self) -> usize {
        self.clauses.len()
    }

    /// The clauses of a program.
    pub fn tape(&self, part: &Part) -> &[Clause] {
        &self.clauses[part.clone()]
    }

    /// The value over a region of the program `part` of `program`, whose choices are decided by the `range` of numbers.
    pub fn over<R: Apply>(
        &mut self,
        program: &Program,
        part: &Part,
        registers: &mut Registers<R>,
        region: R::Vec3,
        range: impl Fn(R) -> Interval,
    ) -> R {
        let tape = &self.clauses[part.clone()];
        let choices = &mut self.choices;
        choices.clear();
        choices.resize(tape.len(), Choice::Both);
        run(
            program,
            tape,
            registers,
            region,
            |at, kernel, numbers, two| {
                choices[at] = decide(kernel, numbers, two.map(&range));
            },
        )
    }

    /// The program of the region that was asked last, pruned from `part`, by which it was asked.
    pub fn prune(&mut self, part: &Part) -> Part {
        let is_decided = |choice: &Choice| *choice != Choice::Both;
        if part.len() < SHORT || !self.choices.iter().any(is_decided) {
            return part.clone();
        }
        let start = self.clauses.len();
        let (before, choices) = (&self.clauses[part.clone()], &self.choices);
        let mut kept = Vec::with_capacity(before.len());
        self.pruner.prune(before, |at| choices[at], &mut kept);
        self.clauses.append(&mut kept);
        start..self.clauses.len()
    }

    /// Forgets the programs whose clauses begin there or later.
    pub fn forget_from(&mut self, clause: usize) {
        self.clauses.truncate(clause.max(self.whole));
    }
}
