//! Bounds of a field in boxes, by the part of its program that matters there.
//!
//! What a choice leaves out of a box it leaves out of all boxes within: each box has a program of its own, pruned
//! from that of the box around it.

use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::tape::prune::{Choice, Pruner};
use sdfc_vm::tape::single::{Registers, decide, run};
use sdfc_vm::tape::{Clause, Tape};
use sdfc_vm::vector::V3;
use std::ops::Range;

/// The most clauses that are kept for all boxes together: 16 MiB of them.
const MAX_CLAUSES: usize = 1 << 19;

/// The clauses of a pruned program.
pub(super) type Part = Range<usize>;

/// A field and its pruned programs.
pub(super) struct Field<'a> {
    program: &'a Program,
    /// The whole program, and behind it those that were pruned.
    clauses: Vec<Clause>,
    whole: usize,
    values: Registers<Interval>,
    slopes: Registers<Dual<Interval>>,
    pruner: Pruner,
    /// What the last box that was asked decided of each clause.
    choices: Vec<Choice>,
}

impl<'a> Field<'a> {
    pub(super) fn new(program: &'a Program) -> Self {
        let Tape {
            clauses,
            values,
            points,
            ..
        } = Tape::of(program);
        let zero = Interval::point(0.0);
        let origin = V3::of(zero, zero, zero);
        let mut pruner = Pruner::default();
        pruner.reserve(values, points);
        Self {
            program,
            whole: clauses.len(),
            clauses,
            values: Registers::new(values, points, origin),
            slopes: Registers::new(values, points, DualVec3::fixed(origin)),
            pruner,
            choices: Vec::new(),
        }
    }

    /// The whole program.
    pub(super) fn whole(&self) -> Part {
        0..self.whole
    }

    /// Bounds of the field in a box whose program is `part`.
    pub(super) fn over(&mut self, part: &Part, region: V3<Interval>) -> Interval {
        let tape = &self.clauses[part.clone()];
        let choices = &mut self.choices;
        choices.clear();
        choices.resize(tape.len(), Choice::Both);
        run(
            self.program,
            tape,
            &mut self.values,
            region,
            |at, kernel, numbers, two| choices[at] = decide(kernel, numbers, two),
        )
    }

    /// What of the program `part` matters in the box that was asked last.
    pub(super) fn prune(&mut self, part: &Part) -> Part {
        let is_decided = |choice: &Choice| *choice != Choice::Both;
        if !self.choices.iter().any(is_decided) || self.clauses.len() + part.len() > MAX_CLAUSES {
            return part.clone();
        }
        let start = self.clauses.len();
        let choices = &self.choices;
        let mut kept = Vec::with_capacity(part.len());
        let before = &self.clauses[part.clone()];
        self.pruner.prune(before, |at| choices[at], &mut kept);
        self.clauses.append(&mut kept);
        start..self.clauses.len()
    }

    /// Bounds of the gradient in a box whose program is `part`.
    pub(super) fn gradient(&mut self, part: &Part, region: V3<Interval>) -> V3<Interval> {
        let tape = &self.clauses[part.clone()];
        let point = DualVec3::seed(region);
        let ignored = |_, _, _, _: [Dual<Interval>; 2]| {};
        run(self.program, tape, &mut self.slopes, point, ignored).gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_vm::evaluate::evaluate;
    use sdfc_vm::listing::parse;

    /// A ball, a block, a ring with a bite in it, and a bar blended into them.
    const LISTING: &str = "\
0000  sphere                [1.0]
0001  cuboid                [0.25, 0.25, 0.25]  moved [-1.0, 0.0, 0.0]  blend hard [1.0, 1.0, 0.0, 0.0]
0002  torus                 [0.8, 0.1]  moved [0.0, -1.0, 0.0]
0003  sphere                [0.4]  moved [-0.8, -1.0, 0.0]  blend hard [-1.0, -1.0, 0.0, 0.0]
0004  take                  blend hard [1.0, 1.0, 0.0, 0.0]
0005  cylinder              [0.2, 1.5]  blend quadratic [1.0, 1.0, 0.8, 0.3125]
";

    /// Boxes are halved towards a corner, each time along another axis, and asked at their middles.
    #[test]
    fn what_is_left_of_a_program_keeps_its_values() {
        let program = parse(LISTING).expect("a program");
        let mut field = Field::new(&program);
        let mut shorter = 0;
        for number in 0..512_u32 {
            let mut part = field.whole();
            let mut sides = [Interval::between(-2.0, 2.0); 3];
            for level in 0..9 {
                let region = V3::of(sides[0], sides[1], sides[2]);
                let bounds = field.over(&part, region);
                part = field.prune(&part);
                shorter += usize::from(part.len() < field.whole().len());
                let middle = sides.map(|side| Interval::point(side.lo + (side.hi - side.lo) / 2.0));
                let middle = V3::of(middle[0], middle[1], middle[2]);
                let [value, expected] = [
                    field.over(&part, middle),
                    evaluate::<Interval>(&program, middle),
                ];
                assert!(
                    (value.lo - expected.lo).abs() < 1e-9,
                    "{number} in {sides:?}"
                );
                assert!(bounds.lo <= value.hi && value.lo <= bounds.hi, "{sides:?}");
                let side = &mut sides[level % 3];
                let half = side.lo + (side.hi - side.lo) / 2.0;
                *side = match number >> level & 1 {
                    0 => Interval::between(side.lo, half),
                    _ => Interval::between(half, side.hi),
                };
            }
        }
        assert!(shorter > 2000, "only {shorter} programs were pruned");
    }
}
