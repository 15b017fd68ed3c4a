//! Traces: the minima and maxima of a tape that are decided in each of 64 boxes.
//!
//! A choice is decided in a box if its operands differ everywhere in it by more than the kernel's support.
//! The kernel then adds exactly zero and the minimum is exactly the smaller operand. So pruning cannot
//! change a bit of the result. The difference is bounded by one of two methods:
//! - With Lipschitz bounds of all values ([`super::lipschitz`]): one evaluation at the centre of the box. No value
//!   differs from its centre value by more than its bound times the box's half diagonal (W. Barbier and others,
//!   *Lipschitz Pruning*, 2025).
//! - Otherwise: evaluation on intervals that bound every `f32` result in the box
//!   ([`crate::interval::FloatInterval`]).

use super::evaluator::{EvalHook, TapeEvaluator, hard_blend_constants};
use super::lipschitz::LipschitzBounds;
use super::prune::{Choice, Pruner};
use super::{Clause, Tape, flags};
use crate::blend::BlendKernel;
use crate::interval::FloatInterval;
use crate::lanes::{F32x64, LANES, LaneNumber, bits};
use crate::material_weights::MAX_TIE_PER_VALUE;
use crate::multiversion;
use crate::program::{Destination, Opcode, Program};
use std::sync::Arc;

/// For each choice of the tape, in order: two masks of boxes. In the first only the first operand matters, in
/// the second only the second one.
type ChoiceMasks = Vec<[u64; 2]>;

/// Decides one choice; [`TraceHook`] turns an implementation into an evaluation hook.
trait ChoiceSink<L: LaneNumber> {
    fn choose(
        &mut self,
        instruction: u32,
        kernel: BlendKernel,
        constants: [f32; 4],
        values: [&L::Block; 2],
    );
}

/// Choices decided by intervals.
#[derive(Default)]
struct IntervalChoices {
    masks: ChoiceMasks,
}

impl ChoiceSink<FloatInterval> for IntervalChoices {
    fn choose(
        &mut self,
        _: u32,
        kernel: BlendKernel,
        constants: [f32; 4],
        [a, b]: [&[F32x64; 2]; 2],
    ) {
        self.masks.push(decide_boxes(kernel, constants, a, b));
    }
}

/// Choices decided by Lipschitz bounds.
#[derive(Default)]
struct LipschitzChoices {
    masks: ChoiceMasks,
    bounds: Arc<LipschitzBounds>,
    /// Half the diagonal of each box.
    radius: F32x64,
    /// Absolute rounding error of a value, in addition to its relative rounding error.
    slack: F32x64,
}

impl LipschitzChoices {
    /// Returns the range of a value over the box, given its value at the centre.
    fn value_range(&self, value: &F32x64, slope: f32) -> [F32x64; 2] {
        let mut ends = [F32x64::default(); 2];
        value_range_in_lanes(value, slope, &self.radius, &self.slack, &mut ends);
        ends
    }
}

multiversion! {
    /// Writes `value ± (slope · radius + slack)`, widened for rounding, to `ends`.
    fn value_range_in_lanes(
        value: &F32x64, slope: f32, radius: &F32x64, slack: &F32x64, ends: &mut [F32x64; 2],
    ) = value_range_body;
}

#[inline(always)]
fn value_range_body(
    value: &F32x64,
    slope: f32,
    radius: &F32x64,
    slack: &F32x64,
    ends: &mut [F32x64; 2],
) {
    for lane in 0..LANES {
        let v = value.0[lane];
        let margin = radius.0[lane] * slope + slack.0[lane] + v.abs() * 2e-6;
        ends[0].0[lane] = v - margin;
        ends[1].0[lane] = v + margin;
    }
}

impl ChoiceSink<f32> for LipschitzChoices {
    fn choose(
        &mut self,
        instruction: u32,
        kernel: BlendKernel,
        constants: [f32; 4],
        [a, b]: [&F32x64; 2],
    ) {
        let [first, second] = self.bounds.choices[instruction as usize];
        let (a, b) = (self.value_range(a, first), self.value_range(b, second));
        self.masks.push(decide_boxes(kernel, constants, &a, &b));
    }
}

/// A hook that only decides choices.
#[derive(Default)]
struct TraceHook<C>(C);

impl<L: LaneNumber, C: ChoiceSink<L>> EvalHook<L> for TraceHook<C> {
    fn normal(&mut self, _: &L::PointBlock, _: u8, result: &mut L::Block) {
        // Any component of a normal: it only affects materials and decides nothing.
        for lane in 0..LANES {
            L::constant(0.0).store(result, lane);
        }
    }
    #[inline(always)]
    fn choose(
        &mut self,
        instruction: u32,
        kernel: BlendKernel,
        constants: [f32; 4],
        values: [&L::Block; 2],
    ) {
        self.0.choose(instruction, kernel, constants, values);
    }
}

/// Returns the difference from which on a kernel adds exactly zero in `f32`.
fn support(kernel: BlendKernel, width: f32, coefficient: f32) -> f32 {
    match kernel {
        // 1 + 2^(−x c) is 1 in `f32` from x c = 25 on; one more for the rounding of the exponent.
        BlendKernel::Exponential => 26.0 / coefficient,
        finite => finite.support(width.into()) as f32,
    }
}

/// The data that another machine needs to decide a choice as this module does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChoiceTest {
    /// Lipschitz bounds of the two operands; 0 where intervals decide because a bound is missing.
    pub slopes: [f32; 2],
    /// The difference from which on only one of the operands matters.
    pub support: f32,
    /// Sign of each operand as an operand of a minimum.
    pub signs: [f32; 2],
}

impl ChoiceTest {
    /// Returns the test for a clause's choice, if it has one that can be decided.
    pub fn for_clause(
        program: &Program,
        slopes: &LipschitzBounds,
        clause: &Clause,
    ) -> Option<Self> {
        if clause.flags & flags::CHOICE == 0 {
            return None;
        }
        let i = &program.code[clause.instruction as usize];
        let (kernel, [sign, negate, width, coefficient]) = match (i.destination, i.code) {
            (Destination::Blend { kernel, index }, _) => (kernel, program.pool[index as usize]),
            (Destination::Push, Opcode::Op(op)) => (BlendKernel::Hard, hard_blend_constants(op)),
            (Destination::Push, _) => return None,
        };
        let test = Self {
            slopes: if slopes.is_bounded() {
                slopes.choices[clause.instruction as usize]
            } else {
                [0.0; 2]
            },
            support: support(kernel, width, coefficient),
            signs: [sign, sign * negate].map(|sign| 1.0_f32.copysign(sign)),
        };
        let [first, second] = test.slopes;
        let numbers = [first, second, test.support];
        numbers
            .iter()
            .all(|number| number.is_finite())
            .then_some(test)
    }
}

multiversion! {
    /// Returns the boxes in which only the first, and only the second, of two operands matters.
    fn decide_boxes(
        kernel: BlendKernel, constants: [f32; 4], a: &[F32x64; 2], b: &[F32x64; 2],
    ) -> [u64; 2] = decide_boxes_body;
}

#[inline(always)]
fn decide_boxes_body(
    kernel: BlendKernel,
    [sign, negate, width, coefficient]: [f32; 4],
    a: &[F32x64; 2],
    b: &[F32x64; 2],
) -> [u64; 2] {
    let support = support(kernel, width, coefficient);
    // Of operands that tie, the first one's material shows.
    let tie = MAX_TIE_PER_VALUE as f32;
    // Both as operands of a minimum: a negative sign swaps the ends. The comparisons use differences, so
    // the factors reduce to signs.
    let (a_low, a_high) = if sign < 0.0 {
        (&a[1], &a[0])
    } else {
        (&a[0], &a[1])
    };
    let second_sign = sign * negate;
    let (b_low, b_high) = if second_sign < 0.0 {
        (&b[1], &b[0])
    } else {
        (&b[0], &b[1])
    };
    let (sa, sb) = (1.0_f32.copysign(sign), 1.0_f32.copysign(second_sign));
    let mut first = [false; LANES];
    let mut second = [false; LANES];
    for lane in 0..LANES {
        let gap = |high: f32, low: f32| low - high - high.abs().max(low.abs()) * tie;
        first[lane] = gap(a_high.0[lane] * sa, b_low.0[lane] * sb) > support;
        second[lane] = gap(b_high.0[lane] * sb, a_low.0[lane] * sa) > support;
    }
    [bits(&first), bits(&second)]
}

/// The decisions of 64 boxes about every clause.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// The masks of each clause's choice, by index of the clause.
    by_clause: ChoiceMasks,
    /// The boxes in which at least one choice is decided.
    any_decided: u64,
    /// Scratch memory for the undecided choices of a pruned tape.
    remaining: ChoiceMasks,
}

impl Trace {
    /// Returns the decision about a clause's choice in a box.
    #[inline(always)]
    pub fn choice(&self, index: usize, lane: usize) -> Choice {
        let [first, second] = self.by_clause[index];
        if first >> lane & 1 == 1 {
            Choice::First
        } else if second >> lane & 1 == 1 {
            Choice::Second
        } else {
            Choice::Both
        }
    }

    /// Reports whether any choice is decided in a box.
    #[inline(always)]
    pub fn has_decision(&self, lane: usize) -> bool {
        self.any_decided >> lane & 1 == 1
    }

    /// Appends to `pruned` the clauses that matter in any of these boxes, given as bits, and sets `common`
    /// to the trace of that pruned tape. Pruning many boxes is faster from a tape that several of them
    /// share.
    pub fn prune_for(
        &self,
        boxes: u64,
        tape: &[Clause],
        pruner: &mut Pruner,
        pruned: &mut Vec<Clause>,
        common: &mut Self,
    ) {
        let remaining = &mut common.remaining;
        remaining.clear();
        let choice = |index: usize| {
            let [first, second] = self.by_clause[index];
            if first & boxes == boxes {
                Choice::First
            } else if second & boxes == boxes {
                Choice::Second
            } else {
                remaining.push([first, second]);
                Choice::Both
            }
        };
        let start = pruned.len();
        pruner.prune(tape, choice, pruned);
        let mut masks = std::mem::take(&mut common.remaining);
        // Pruning visits the choices from the last to the first.
        masks.reverse();
        common.scatter_to_clauses(&pruned[start..], &mut masks);
        common.remaining = masks;
    }

    /// Assigns the masks of choices to the clauses of their tape.
    fn scatter_to_clauses(&mut self, tape: &[Clause], masks: &mut ChoiceMasks) {
        self.any_decided = masks
            .iter()
            .fold(0, |all, [first, second]| all | first | second);
        let mut masks = masks.drain(..);
        self.by_clause.clear();
        self.by_clause.extend(tape.iter().map(|clause| {
            if clause.flags & flags::CHOICE == 0 {
                [0, 0]
            } else {
                masks.next().unwrap_or([0, 0])
            }
        }));
    }
}

/// Computes the traces of 64 boxes at a time.
pub struct Tracer {
    /// The boxes: columns of the lower corners, then of the upper ones.
    boxes: [F32x64; 6],
    evaluator: TraceEvaluator,
    trace: Trace,
    range: [F32x64; 2],
}

/// The evaluator of the tape's pruning method.
enum TraceEvaluator {
    Lipschitz(Box<TapeEvaluator<f32, TraceHook<LipschitzChoices>>>),
    Interval(Box<TapeEvaluator<FloatInterval, TraceHook<IntervalChoices>>>),
}

impl Tracer {
    /// Creates a tracer for a tape and the tapes pruned from it.
    pub fn new(tape: &Tape) -> Self {
        let evaluator = if tape.lipschitz.is_bounded() {
            let mut machine: TapeEvaluator<f32, TraceHook<LipschitzChoices>> =
                TapeEvaluator::new(tape.values, tape.points);
            machine.hook().0.bounds = tape.lipschitz.clone();
            TraceEvaluator::Lipschitz(Box::new(machine))
        } else {
            TraceEvaluator::Interval(Box::new(TapeEvaluator::new(tape.values, tape.points)))
        };
        Self {
            boxes: [F32x64::default(); 6],
            evaluator,
            trace: Trace::default(),
            range: [F32x64::default(); 2],
        }
    }

    /// Returns the boxes of the next run: columns of the lower corners, then of the upper ones.
    pub fn boxes(&mut self) -> &mut [F32x64; 6] {
        &mut self.boxes
    }

    /// Evaluates a tape on the first `count` boxes and returns the range of its result.
    pub fn run(&mut self, program: &Program, tape: &[Clause], count: usize) -> &[F32x64; 2] {
        match &mut self.evaluator {
            TraceEvaluator::Interval(machine) => {
                machine.hook().0.masks.clear();
                *machine.inputs_mut() = self.boxes;
                self.range = *machine.run(program, tape, count);
                let masks = &mut machine.hook().0.masks;
                self.trace.scatter_to_clauses(tape, masks);
            }
            TraceEvaluator::Lipschitz(machine) => {
                let choices = &mut machine.hook().0;
                choices.masks.clear();
                let mut centres = [F32x64::default(); 3];
                box_centres(
                    &self.boxes,
                    &mut centres,
                    &mut choices.radius,
                    &mut choices.slack,
                );
                *machine.inputs_mut() = centres;
                let value = *machine.run(program, tape, count);
                let choices = &mut machine.hook().0;
                self.range = choices.value_range(&value, choices.bounds.result);
                self.trace.scatter_to_clauses(tape, &mut choices.masks);
            }
        }
        &self.range
    }

    /// Returns the trace of the last run.
    pub fn trace(&self) -> &Trace {
        &self.trace
    }
}

/// Computes the centre of each box, half its diagonal, and the rounding slack of its coordinates.
fn box_centres(
    boxes: &[F32x64; 6],
    centres: &mut [F32x64; 3],
    radius: &mut F32x64,
    slack: &mut F32x64,
) {
    *radius = F32x64::default();
    *slack = F32x64::default();
    for axis in 0..3 {
        for lane in 0..LANES {
            let (low, high) = (boxes[axis].0[lane], boxes[axis + 3].0[lane]);
            let centre = low + (high - low) * 0.5;
            let half = (high - centre).max(centre - low);
            centres[axis].0[lane] = centre;
            radius.0[lane] += half * half;
            slack.0[lane] += low.abs().max(high.abs());
        }
    }
    for lane in 0..LANES {
        radius.0[lane] = radius.0[lane].sqrt() * (1.0 + 1e-6);
        slack.0[lane] *= 4e-6;
    }
}
