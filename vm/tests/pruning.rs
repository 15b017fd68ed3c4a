//! Pruning at its tightest: boxes that barely contain a tie, or the end of a kernel. Each program is the
//! smallest that requires one of the bounds by which choices are decided.

use sdfc_vm::lanes::{F32x64, LANES, Points};
use sdfc_vm::listing;
use sdfc_vm::program::Program;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::lipschitz::LipschitzBounds;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::trace::Tracer;
use sdfc_vm::tape::{Clause, Tape};
use std::sync::Arc;

/// Number of sample points of a box along each axis: its corners, and points between.
const SIDE: usize = 4;

/// A box: its lower and its upper corner.
type Corners = [[f32; 3]; 2];

/// Returns the values of a tape at points.
fn values(program: &Program, tape: &Tape, clauses: &[Clause], points: &Points) -> F32x64 {
    let mut evaluator = TapeEvaluator::<f32>::new(tape.values, tape.points);
    *evaluator.inputs_mut() = *points;
    *evaluator.run(program, clauses, LANES)
}

/// Returns points of a box in a grid, including its corners.
fn grid([low, high]: Corners) -> Points {
    let mut points = Points::default();
    for lane in 0..LANES {
        let digits = [lane % SIDE, lane / SIDE % SIDE, lane / SIDE / SIDE];
        for axis in 0..3 {
            let fraction = digits[axis] as f32 / (SIDE - 1) as f32;
            let at = low[axis] + (high[axis] - low[axis]) * fraction;
            points[axis].0[lane] = if fraction == 1.0 { high[axis] } else { at };
        }
    }
    points
}

/// Asserts that the pruned tape of each box gives the bits of the full one, and that the range contains the
/// values. Returns the number of boxes in which a clause was pruned.
fn check(text: &str, tape: &Tape, program: &Program, boxes: &[Corners]) -> usize {
    let (mut tracer, mut pruner) = (Tracer::new(tape), Pruner::default());
    pruner.reserve(tape.values, tape.points);
    let mut shorter = 0;
    for group in boxes.chunks(LANES) {
        for (lane, [low, high]) in group.iter().enumerate() {
            for axis in 0..3 {
                tracer.boxes()[axis].0[lane] = low[axis];
                tracer.boxes()[axis + 3].0[lane] = high[axis];
            }
        }
        let [low, high] = *tracer.run(program, &tape.clauses, group.len());
        for (lane, &corners) in group.iter().enumerate() {
            let mut pruned = Vec::new();
            let choice = |index| tracer.trace().choice(index, lane);
            pruner.prune(&tape.clauses, choice, &mut pruned);
            shorter += usize::from(pruned.len() < tape.clauses.len());
            let points = grid(corners);
            let full_values = values(program, tape, &tape.clauses, &points);
            let pruned_values = values(program, tape, &pruned, &points);
            for at in 0..LANES {
                let (a, b) = (full_values.0[at], pruned_values.0[at]);
                let p = [0, 1, 2].map(|axis| points[axis].0[at]);
                assert!(
                    a == b,
                    "{a} by all, {b} by what was kept at {p:?} of {corners:?}\n{text}"
                );
                let (low, high) = (low.0[lane], high.0[lane]);
                assert!(
                    low <= a && a <= high,
                    "{a} outside of {low} to {high} at {p:?}\n{text}"
                );
            }
        }
    }
    shorter
}

/// Checks a program by both methods of pruning; some of the boxes must be decided and some must not.
fn check_both(text: &str, boxes: &[Corners]) {
    let numbered: String = (0..)
        .zip(text.lines())
        .map(|(at, line)| format!("{at:04}  {line}\n"))
        .collect();
    let program = listing::parse(&numbered).unwrap_or_else(|error| panic!("{error:?}\n{text}"));
    let tape = Tape::new(&program);
    assert!(tape.lipschitz.is_bounded(), "{text}");
    let unknown = LipschitzBounds {
        result: f32::INFINITY,
        ..LipschitzBounds::default()
    };
    let by_intervals = Tape {
        lipschitz: Arc::new(unknown),
        ..tape.clone()
    };
    for tape in [&tape, &by_intervals] {
        let shorter = check(text, tape, &program, boxes);
        assert!(
            0 < shorter && shorter < boxes.len(),
            "{shorter} of {} boxes were decided\n{text}",
            boxes.len()
        );
    }
}

/// Returns boxes of many sizes along the diagonal through a point. They begin at it, or at a fraction of
/// their size before it. Along the diagonal, a value changes by as much as its slope bound allows.
fn boxes_from(tie: [f32; 3]) -> Vec<Corners> {
    let mut boxes = Vec::new();
    for size in 0..24 {
        let side = 1.3_f32.powi(-size);
        for fraction in [-0.6, -0.1, -0.01, 0.0, 0.0, 0.01, 0.1, 0.6, 0.9] {
            for steps in 0..4 {
                let from = tie.map(|v| {
                    let from = v + side * fraction;
                    (0..steps).fold(from, |v, _| v.next_up())
                });
                boxes.push([from, from.map(|v| v + side)]);
                boxes.push([from.map(|v| v - side), from]);
            }
        }
    }
    boxes
}

/// Returns two spheres along the diagonal, combined by this blend.
fn balls(at: f32, apart: f32, [first, second]: [f32; 2], blend: &str) -> String {
    let (a, b) = (-(at - apart), -(at + apart));
    format!(
        "sphere [{first:?}] moved [{a:?}, {a:?}, {a:?}]\n\
         sphere [{second:?}] moved [{b:?}, {b:?}, {b:?}] blend {blend}\n"
    )
}

#[test]
fn ties_are_decided_where_values_are_rounded() {
    for at in [0.0, 10.0, 1001.5, 12_345.5] {
        let text = balls(at, 1.5, [1.0, 1.0], "hard [1.0, 1.0, 0.0, 0.0]");
        check_both(&text, &boxes_from([at; 3]));
    }
}

#[test]
fn frames_stretch_what_they_hold() {
    let text = "sphere [1.0] mapped [2.0, 0.0, 0.0, -3.0, 0.0, 2.0, 0.0, -3.0, 0.0, 0.0, 2.0, -3.0]\n\
                sphere [1.0] mapped [2.0, 0.0, 0.0, 3.0, 0.0, 2.0, 0.0, 3.0, 0.0, 0.0, 2.0, 3.0] \
                blend hard [1.0, 1.0, 0.0, 0.0]\n";
    check_both(text, &boxes_from([0.0; 3]));
}

#[test]
fn profiles_are_steeper_than_their_operands() {
    // With two equal operands, a chamfer is steeper by the root of two.
    let one = |v: f32| format!("sphere [1.0] moved [{v:?}, {v:?}, {v:?}]\n");
    for profile in ["chamfer_union [20.0]", "round_union [20.0]"] {
        let pair = |v: f32| format!("{}{}{profile}", one(v), one(v));
        let text = format!(
            "{}\n{} blend hard [1.0, 1.0, 0.0, 0.0]\n",
            pair(-3.0),
            pair(3.0)
        );
        check_both(&text, &boxes_from([0.0; 3]));
    }
}

#[test]
fn kernels_end_where_they_add_nothing() {
    // At the surface of the first sphere, where the kernel's offset is not lost to rounding, the other one
    // is `ahead` farther.
    let root = 3.0_f32.sqrt();
    for ahead in [0.3_f32, 1.0] {
        let radii = [1.5 * root, 1.5 * root - ahead];
        let kernels = [
            format!("quadratic [1.0, 1.0, {ahead:?}, {:?}]", 0.25 / ahead),
            format!(
                "cubic [1.0, 1.0, {ahead:?}, {:?}]",
                1.0 / (6.0 * ahead * ahead)
            ),
            format!("circular [1.0, 1.0, {ahead:?}, {:?}]", 1.0 / ahead),
            format!(
                "exponential [1.0, 1.0, {:?}, {:?}]",
                ahead / 24.0,
                24.0 / ahead
            ),
            format!(
                "exponential [1.0, 1.0, {:?}, {:?}]",
                ahead / 26.0,
                26.0 / ahead
            ),
        ];
        for kernel in kernels {
            check_both(&balls(10.0, 1.5, radii, &kernel), &boxes_from([10.0; 3]));
        }
    }
}

#[test]
fn subtracted_shapes_keep_their_signs() {
    let text = balls(0.0, 0.3, [1.0, 1.0], "hard [-1.0, -1.0, 0.0, 0.0]");
    let flat = "sphere [1.0] moved [0.3, 0.3, 0.3]\n\
                sphere [1.0] moved [-0.3, -0.3, -0.3]\n\
                subtraction\n";
    // On the diagonal, the first sphere and the complement of the second are equal at a distance of one.
    let tie = 1.0 / 3.0_f32.sqrt();
    let boxes = [boxes_from([tie; 3]), boxes_from([-tie; 3])].concat();
    for text in [text.as_str(), flat] {
        check_both(text, &boxes);
    }
}
