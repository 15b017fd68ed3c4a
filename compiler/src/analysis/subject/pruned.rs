//! Bounds of a field in the eight parts of a box, by programs pruned to boxes. The parts are evaluated together.

use super::linear_bound::LinearBound;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::{FloatInterval, Interval};
use sdfc_vm::lanes::{F32x64, LaneNumber, with_identity_jacobian_of_boxes};
use sdfc_vm::program::Program;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::stack::TapeSpan;
use sdfc_vm::tape::trace::Tracer;
use sdfc_vm::tape::{Clause, Tape};
use sdfc_vm::vector::V3;

/// Number of parts of a box.
pub(super) const PARTS: usize = 8;
/// Maximum number of clauses of all boxes together: about 10 MiB.
const MAX_CLAUSES: usize = 1 << 19;

/// A box, as the range of each coordinate.
pub(super) type PartBox = V3<Interval>;

/// A field and the pruned programs of its boxes.
pub(super) struct PrunedField<'a> {
    program: &'a Program,
    /// Clauses of all programs, the unpruned one first.
    clauses: Vec<Clause>,
    root: TapeSpan,
    tracer: Tracer,
    pruner: Pruner,
    values: TapeEvaluator<FloatInterval>,
    slopes: TapeEvaluator<Dual<FloatInterval>>,
}

impl<'a> PrunedField<'a> {
    pub(super) fn new(program: &'a Program) -> Self {
        let tape = Tape::new(program);
        let mut pruner = Pruner::default();
        pruner.reserve(tape.values, tape.points);
        Self {
            program,
            root: 0..tape.clauses.len(),
            tracer: Tracer::new(&tape),
            pruner,
            values: TapeEvaluator::new(tape.values, tape.points),
            slopes: TapeEvaluator::new(tape.values, tape.points),
            clauses: tape.clauses,
        }
    }

    /// Returns the span of the unpruned tape.
    pub(super) fn root(&self) -> TapeSpan {
        self.root.clone()
    }

    /// Returns for each part of a box its pruned program and bounds of the field, and `None` where that is proved to be
    /// above zero. The program `parent` is that of the box.
    pub(super) fn parts(
        &mut self,
        parent: &TapeSpan,
        parts: &[PartBox; PARTS],
    ) -> [Option<(TapeSpan, LinearBound)>; PARTS] {
        let tape = &self.clauses[parent.clone()];
        write_boxes(self.tracer.boxes(), parts);
        let [low, _] = *self.tracer.run(self.program, tape, PARTS);
        let is_positive: [bool; PARTS] = std::array::from_fn(|part| low.0[part] > 0.0);
        if !is_positive.contains(&false) {
            return [const { None }; PARTS];
        }
        let bounds = self.linear_bounds(parent, parts);
        std::array::from_fn(|part| {
            let bound = bounds[part];
            let is_empty = is_positive[part] || bound.is_positive();
            (!is_empty).then(|| (self.prune(parent, part), bound))
        })
    }

    /// Bounds the field in the parts by its value in the middle and by its gradient.
    fn linear_bounds(&mut self, tape: &TapeSpan, parts: &[PartBox; PARTS]) -> [LinearBound; PARTS] {
        let tape = &self.clauses[tape.clone()];
        let sides = parts.map(|V3 { x, y, z }| [x, y, z]);
        let centres = sides.map(|sides| {
            let [x, y, z] = sides.map(|side| Interval::point(side.lo + (side.hi - side.lo) / 2.0));
            V3 { x, y, z }
        });
        write_boxes(self.values.inputs_mut(), &centres);
        let values = *self.values.run(self.program, tape, PARTS);
        let mut boxes = [F32x64::default(); 6];
        write_boxes(&mut boxes, parts);
        *self.slopes.inputs_mut() = with_identity_jacobian_of_boxes(&boxes);
        let slopes = self.slopes.run(self.program, tape, PARTS);
        std::array::from_fn(|part| {
            let Dual { gradient, .. } = Dual::<FloatInterval>::load(slopes, part);
            let wide = |FloatInterval { lo, hi, .. }| [f64::from(lo), f64::from(hi)];
            LinearBound {
                value: f64::from(values[0].0[part]),
                is_middle_inside: values[1].0[part] < 0.0,
                gradient: [gradient.x, gradient.y, gradient.z].map(wide),
                half_sides: sides[part].map(|side| (side.hi - side.lo) / 2.0),
            }
        })
    }

    /// Prunes the program of a box to one of its parts, which were evaluated last, unless the clause limit is
    /// exceeded.
    fn prune(&mut self, parent: &TapeSpan, part: usize) -> TapeSpan {
        let trace = self.tracer.trace();
        if !trace.has_decision(part) || self.clauses.len() + parent.len() > MAX_CLAUSES {
            return parent.clone();
        }
        let mut pruned = Vec::with_capacity(parent.len());
        let tape = &self.clauses[parent.clone()];
        let choice = |clause| trace.choice(clause, part);
        self.pruner.prune(tape, choice, &mut pruned);
        let start = self.clauses.len();
        self.clauses.extend(pruned);
        start..self.clauses.len()
    }
}

/// Writes boxes to columns of the lower corners, then of the upper ones, rounded outward.
fn write_boxes(columns: &mut [F32x64; 6], boxes: &[PartBox; PARTS]) {
    for (lane, V3 { x, y, z }) in boxes.iter().enumerate() {
        for (axis, side) in [x, y, z].into_iter().enumerate() {
            columns[axis].0[lane] = rounded_down(side.lo);
            columns[axis + 3].0[lane] = -rounded_down(-side.hi);
        }
    }
}

/// Returns the largest `f32` that is at most a number.
fn rounded_down(number: f64) -> f32 {
    let nearest = number as f32;
    match f64::from(nearest) > number {
        true => nearest.next_down(),
        false => nearest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_vm::evaluate::evaluate_f64;
    use sdfc_vm::listing::parse;
    use sdfc_vm::tape::scalar::{Registers, eval};

    /// A sphere, a box, a torus minus a sphere, and a cylinder blended with them.
    const LISTING: &str = "\
0000  sphere                [1.0]
0001  cuboid                [0.25, 0.25, 0.25]  moved [-1.0, 0.0, 0.0]  blend hard [1.0, 1.0, 0.0, 0.0]
0002  torus                 [0.8, 0.1]  moved [0.0, -1.0, 0.0]
0003  sphere                [0.4]  moved [-0.8, -1.0, 0.0]  blend hard [-1.0, -1.0, 0.0, 0.0]
0004  take                  blend hard [1.0, 1.0, 0.0, 0.0]
0005  cylinder              [0.2, 1.5]  blend quadratic [1.0, 1.0, 0.8, 0.3125]
";

    /// Returns part `number` of a box, by a bit for each axis.
    fn part_of(sides: [Interval; 3], number: usize) -> [Interval; 3] {
        std::array::from_fn(|axis| {
            let Interval { lo, hi } = sides[axis];
            let centre = lo + (hi - lo) / 2.0;
            match number >> axis & 1 {
                0 => Interval::between(lo, centre),
                _ => Interval::between(centre, hi),
            }
        })
    }

    /// Boxes are divided towards a point, and their programs evaluated at their centres.
    #[test]
    fn pruned_programs_keep_their_values() {
        let program = parse(LISTING).expect("a program");
        let tape = Tape::new(&program);
        let mut registers = Registers::new(tape.values, tape.points, V3::new(0.0, 0.0, 0.0));
        let mut field = PrunedField::new(&program);
        let (mut shorter, mut outside) = (0, 0);
        for number in 0..512_usize {
            let mut parent = field.root();
            let mut sides = [Interval::between(-2.0, 2.0); 3];
            for level in 0..3 {
                let boxes = std::array::from_fn(|part| {
                    let [x, y, z] = part_of(sides, part);
                    V3 { x, y, z }
                });
                let parts = field.parts(&parent, &boxes);
                let chosen = number >> (3 * level) & 7;
                sides = part_of(sides, chosen);
                let centre = sides.map(|side| side.lo + (side.hi - side.lo) / 2.0);
                let expected = evaluate_f64(&program, centre);
                let Some((part, _)) = &parts[chosen] else {
                    assert!(expected > 0.0, "{sides:?}");
                    outside += 1;
                    break;
                };
                let [x, y, z] = centre;
                let clauses = &field.clauses[part.clone()];
                let no_hook = |_, _, _, _: [f64; 2]| {};
                let value = eval(&program, clauses, &mut registers, V3::new(x, y, z), no_hook);
                assert!((value - expected).abs() < 1e-9, "{number} in {sides:?}");
                shorter += usize::from(part.len() < field.root().len());
                parent = part.clone();
            }
        }
        assert!(shorter > 300, "only {shorter} programs were pruned");
        assert!(
            outside > 50,
            "only {outside} boxes are proved to be outside"
        );
    }

    #[test]
    fn boxes_in_single_precision_contain_the_boxes() {
        for number in [0.1, -0.1, 1e-60, 3.0, 1e300] {
            let low = rounded_down(number);
            assert!(
                f64::from(low) <= number && f64::from(low.next_up()) > number,
                "{number}"
            );
        }
    }
}
