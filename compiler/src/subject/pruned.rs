//! Bounds of a field in boxes, by the part of its program that matters there.

use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::parts::{Part, Parts};
use sdfc_vm::tape::single::{Registers, run};
use sdfc_vm::vector::V3;

/// The most clauses that are kept for all boxes together: about 10 MiB of them.
const MAX_CLAUSES: usize = 1 << 19;

/// A field and the programs of its boxes.
pub(super) struct Field<'a> {
    program: &'a Program,
    parts: Parts,
    values: Registers<Interval>,
    slopes: Registers<Dual<Interval>>,
}

impl<'a> Field<'a> {
    pub(super) fn new(program: &'a Program) -> Self {
        let tape = Tape::of(program);
        let zero = Interval::point(0.0);
        let origin = V3::of(zero, zero, zero);
        Self {
            program,
            parts: Parts::of(&tape),
            values: Registers::new(tape.values, tape.points, origin),
            slopes: Registers::new(tape.values, tape.points, DualVec3::fixed(origin)),
        }
    }

    /// The whole program.
    pub(super) fn whole(&self) -> Part {
        self.parts.whole()
    }

    /// Bounds of the field in a box whose program is `part`.
    pub(super) fn over(&mut self, part: &Part, region: V3<Interval>) -> Interval {
        let (parts, values) = (&mut self.parts, &mut self.values);
        parts.over(self.program, part, values, region, |value| value)
    }

    /// The program of the box that was asked last, pruned from `part` where there is room for it.
    pub(super) fn prune(&mut self, part: &Part) -> Part {
        if self.parts.count() + part.len() > MAX_CLAUSES {
            return part.clone();
        }
        self.parts.prune(part)
    }

    /// Forgets the program of a box that was pruned last, from `around`.
    pub(super) fn forget(&mut self, part: &Part, around: &Part) {
        if part != around {
            self.parts.forget_from(part.start);
        }
    }

    /// Bounds of the gradient in a box whose program is `part`.
    pub(super) fn gradient(&mut self, part: &Part, region: V3<Interval>) -> V3<Interval> {
        let (tape, point) = (self.parts.tape(part), DualVec3::seed(region));
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
