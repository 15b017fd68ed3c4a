//! Bounds of a field in boxes, by programs pruned to these boxes.

use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::scalar::{Registers, eval};
use sdfc_vm::tape::stack::{TapeSpan, TapeStack};
use sdfc_vm::vector::V3;

/// Maximum number of clauses of all boxes together: about 10 MiB.
const MAX_CLAUSES: usize = 1 << 19;

/// A field and the pruned programs of its boxes.
pub(super) struct PrunedField<'a> {
    program: &'a Program,
    parts: TapeStack,
    values: Registers<Interval>,
    slopes: Registers<Dual<Interval>>,
}

impl<'a> PrunedField<'a> {
    pub(super) fn new(program: &'a Program) -> Self {
        let tape = Tape::new(program);
        let zero = Interval::point(0.0);
        let origin = V3::new(zero, zero, zero);
        Self {
            program,
            parts: TapeStack::new(&tape),
            values: Registers::new(tape.values, tape.points, origin),
            slopes: Registers::new(tape.values, tape.points, DualVec3::fixed(origin)),
        }
    }

    /// Returns the span of the unpruned tape.
    pub(super) fn root(&self) -> TapeSpan {
        self.parts.root()
    }

    /// Bounds the field in a box with the program `part`.
    pub(super) fn over(&mut self, part: &TapeSpan, region: V3<Interval>) -> Interval {
        let (parts, values) = (&mut self.parts, &mut self.values);
        parts.eval_over(self.program, part, values, region, |value| value)
    }

    /// Prunes the program `part` to the box evaluated last, unless the clause limit is exceeded.
    pub(super) fn prune(&mut self, part: &TapeSpan) -> TapeSpan {
        if self.parts.clause_count() + part.len() > MAX_CLAUSES {
            return part.clone();
        }
        self.parts.prune(part)
    }

    /// Discards the program of a box that was pruned last, from that of its parent.
    pub(super) fn discard(&mut self, part: &TapeSpan, parent: &TapeSpan) {
        if part != parent {
            self.parts.truncate(part.start);
        }
    }

    /// Bounds the gradient in a box with the program `part`.
    pub(super) fn gradient(&mut self, part: &TapeSpan, region: V3<Interval>) -> V3<Interval> {
        let (tape, point) = (self.parts.tape(part), DualVec3::seed(region));
        let no_hook = |_, _, _, _: [Dual<Interval>; 2]| {};
        eval(self.program, tape, &mut self.slopes, point, no_hook).gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_vm::evaluate::evaluate;
    use sdfc_vm::listing::parse;

    /// A sphere, a box, a torus minus a sphere, and a cylinder blended with them.
    const LISTING: &str = "\
0000  sphere                [1.0]
0001  cuboid                [0.25, 0.25, 0.25]  moved [-1.0, 0.0, 0.0]  blend hard [1.0, 1.0, 0.0, 0.0]
0002  torus                 [0.8, 0.1]  moved [0.0, -1.0, 0.0]
0003  sphere                [0.4]  moved [-0.8, -1.0, 0.0]  blend hard [-1.0, -1.0, 0.0, 0.0]
0004  take                  blend hard [1.0, 1.0, 0.0, 0.0]
0005  cylinder              [0.2, 1.5]  blend quadratic [1.0, 1.0, 0.8, 0.3125]
";

    /// Boxes are halved towards a corner, along the axes in turn, and evaluated at their centres.
    #[test]
    fn pruned_programs_keep_their_values() {
        let program = parse(LISTING).expect("a program");
        let mut field = PrunedField::new(&program);
        let mut shorter = 0;
        for number in 0..512_u32 {
            let mut part = field.root();
            let mut sides = [Interval::between(-2.0, 2.0); 3];
            for level in 0..9 {
                let region = V3::new(sides[0], sides[1], sides[2]);
                let bounds = field.over(&part, region);
                part = field.prune(&part);
                shorter += usize::from(part.len() < field.root().len());
                let centre = sides.map(|side| Interval::point(side.lo + (side.hi - side.lo) / 2.0));
                let centre = V3::new(centre[0], centre[1], centre[2]);
                let [value, expected] = [
                    field.over(&part, centre),
                    evaluate::<Interval>(&program, centre),
                ];
                assert!(
                    (value.lo - expected.lo).abs() < 1e-9,
                    "{number} in {sides:?}"
                );
                assert!(bounds.lo <= value.hi && value.lo <= bounds.hi, "{sides:?}");
                let side = &mut sides[level % 3];
                let centre = side.lo + (side.hi - side.lo) / 2.0;
                *side = match number >> level & 1 {
                    0 => Interval::between(side.lo, centre),
                    _ => Interval::between(centre, side.hi),
                };
            }
        }
        assert!(shorter > 2000, "only {shorter} programs were pruned");
    }
}
