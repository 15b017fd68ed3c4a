//! How steep a field is in boxes: bounds of its gradient, by a run on duals of intervals.

use super::LANES;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::FloatInterval;
use sdfc_vm::lanes::Column;
use sdfc_vm::program::Program;
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::tape::{Clause, Tape};
use sdfc_vm::widest;

/// Bounds of a field in 64 boxes.
#[derive(Clone, Debug, Default)]
pub struct Steepness {
    /// Of its slope; infinite where none is known.
    pub slope: Column,
    /// Of each component of its gradient, where one of the slope is known.
    pub gradient: [[Column; 2]; 3],
    /// Of its values.
    pub range: [Column; 2],
}

impl Steepness {
    /// The gradient's bounds in a box, where they are known.
    pub(super) fn gradient(&self, lane: usize) -> Option<[[f32; 2]; 3]> {
        let known = self.slope.0[lane] < f32::INFINITY;
        known.then(|| self.gradient.each_ref().map(|axis| axis.each_ref().map(|end| end.0[lane])))
    }
}

/// The memory that finding it takes.
pub struct SteepnessFinder {
    machine: Machine<Dual<FloatInterval>>,
}

impl SteepnessFinder {
    /// For a tape and what it is pruned to.
    pub fn new(tape: &Tape) -> Self {
        Self {
            machine: Machine::new(tape.values, tape.points),
        }
    }

    /// In the first `count` of these boxes: columns of the lower corners, then of the upper ones.
    pub fn find(
        &mut self,
        program: &Program,
        tape: &[Clause],
        boxes: &[Column; 6],
        count: usize,
        steepness: &mut Steepness,
    ) {
        let seed = self.machine.seed();
        *seed = <[[Column; 6]; 4]>::default();
        seed[0] = *boxes;
        for axis in 0..3 {
            seed[axis + 1][axis] = Column([1.0; LANES]);
            seed[axis + 1][axis + 3] = Column([1.0; LANES]);
        }
        bound(self.machine.run(program, tape, count), steepness);
    }
}

widest! {
    /// Bounds by what duals of intervals gave. Gradients are rounded there without care for the
    /// direction; what is added here is far more than that.
    fn bound(found: &[[Column; 2]; 4], steepness: &mut Steepness) = bound_body;
}

#[inline(always)]
fn bound_body([x, y, z, value]: &[[Column; 2]; 4], steepness: &mut Steepness) {
    for lane in 0..LANES {
        let square = |[low, high]: &[Column; 2]| {
            let most = f32::max(low.0[lane].abs(), high.0[lane].abs());
            most * most
        };
        let slope = (square(x) + square(y) + square(z)).sqrt() * 1.001;
        // Not so if it is not a number, either.
        steepness.slope.0[lane] = if slope < f32::MAX { slope } else { f32::INFINITY };
        let slack = slope * 1e-3;
        for (to, [low, high]) in steepness.gradient.iter_mut().zip([x, y, z]) {
            to[0].0[lane] = low.0[lane] - slack;
            to[1].0[lane] = high.0[lane] + slack;
        }
    }
    steepness.range = *value;
}
