//! The work of evaluations, counted for the trial of cells.
//!
//! The unit is half a clause for eight points. Six fields of 15 to 130 clauses were measured on a processor with
//! AVX2. Relative to a clause on numbers, [`RANGE_WORK`] was 1.5 to 2.5, [`GRADIENT_RANGE_WORK`] 4.5 to 10, and
//! [`STEP_WORK`] 20 to 32.

use super::LANES;
use sdfc_vm::tape::Clause;

/// Work of a clause on numbers.
const VALUE_WORK: u64 = 1;
/// Work of a clause on intervals.
pub(super) const RANGE_WORK: u64 = 2;
/// Work of a clause on intervals with gradients.
pub(super) const GRADIENT_RANGE_WORK: u64 = 6;
/// Work of a step of eight rays, besides the field.
const STEP_WORK: u64 = 25;

/// Returns the work of a step of `count` rays, on a tape whose clauses each take `clause_work`.
pub(super) fn step_work(tape: &[Clause], count: usize, clause_work: u64) -> u64 {
    // Groups of eight points, and the fixed cost of a clause.
    let groups = 2 * count.div_ceil(8) as u64 + 3;
    (STEP_WORK + clause_work * tape.len() as u64) * groups
}

/// Returns the work of a step of `count` rays on numbers.
pub(super) fn value_work(tape: &[Clause], count: usize) -> u64 {
    step_work(tape, count, VALUE_WORK)
}

/// Returns the work of a step of `count` rays in a stream, which fills all lanes as long as there are rays.
pub(super) fn streamed_work(tape: &[Clause], count: usize) -> u64 {
    value_work(tape, LANES) * count as u64 / LANES as u64
}
