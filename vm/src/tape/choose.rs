//! Choices: which minima and maxima of a tape are decided in each of 64 boxes.
//!
//! Where the operands of a choice are farther apart, all over the box, than its kernel reaches, the
//! kernel adds exactly nothing and the minimum is exactly the nearer one, so what is pruned away
//! cannot change a bit of the result. How far apart they are is found in one of two ways:
//! - where all slopes are known ([`super::steep`]), from one evaluation at the middle of the box,
//!   which no value leaves by more than its slope times the box's half diagonal (W. Barbier and
//!   others, *Lipschitz Pruning*, 2025);
//! - else by running the tape on intervals that bound what `f32` gives anywhere in the box
//!   ([`crate::interval::FloatInterval`]).

use super::machine::{Attachment, Machine, hard};
use super::prune::{Choice, Pruner};
use super::steep::Slopes;
use super::{Clause, Tape, flags};
use crate::interval::FloatInterval;
use crate::kernel::Kernel;
use crate::lanes::{Column, LANES, Lane, bits};
use crate::program::{Code, Place, Program};
use crate::table::Op;
use crate::widest;
use std::sync::Arc;

/// What a run on 64 boxes decided: for each choice of the tape, in order, the boxes in which only
/// the first operand matters, and those in which only the second does.
type Masks = Vec<[u64; 2]>;

/// What becomes an attachment by saying how choices are made.
trait Chooses<L: Lane> {
    fn choose(&mut self, at: u32, kernel: Kernel, constants: [f32; 4], values: [&L::Block; 2]);
}

/// Choices by intervals.
#[derive(Default)]
struct ByIntervals {
    decided: Masks,
}

impl Chooses<FloatInterval> for ByIntervals {
    fn choose(&mut self, _: u32, kernel: Kernel, constants: [f32; 4], [a, b]: [&[Column; 2]; 2]) {
        self.decided.push(decide(kernel, constants, a, b));
    }
}

/// Choices by slopes.
#[derive(Default)]
struct BySlopes {
    decided: Masks,
    slopes: Arc<Slopes>,
    /// Half the diagonal of each box.
    radius: Column,
    /// What rounding may put into a value, besides a share of the value itself.
    slack: Column,
}

impl BySlopes {
    /// Between what a value lies that is this one in the middle of the box.
    fn around(&self, value: &Column, slope: f32) -> [Column; 2] {
        let mut ends = [Column::default(); 2];
        around(value, slope, &self.radius, &self.slack, &mut ends);
        ends
    }
}

widest! {
    /// The ends of what a value and its slope allow in boxes of this radius.
    fn around(
        value: &Column, slope: f32, radius: &Column, slack: &Column, ends: &mut [Column; 2],
    ) = around_body;
}

#[inline(always)]
fn around_body(
    value: &Column,
    slope: f32,
    radius: &Column,
    slack: &Column,
    ends: &mut [Column; 2],
) {
    for lane in 0..LANES {
        let v = value.0[lane];
        let most = radius.0[lane] * slope + slack.0[lane] + v.abs() * 2e-6;
        ends[0].0[lane] = v - most;
        ends[1].0[lane] = v + most;
    }
}

impl Chooses<f32> for BySlopes {
    fn choose(&mut self, at: u32, kernel: Kernel, constants: [f32; 4], [a, b]: [&Column; 2]) {
        let [first, second] = self.slopes.choices[at as usize];
        let (a, b) = (self.around(a, first), self.around(b, second));
        self.decided.push(decide(kernel, constants, &a, &b));
    }
}

/// An attachment that does nothing but choose.
#[derive(Default)]
struct Choosing<C>(C);

impl<L: Lane, C: Chooses<L>> Attachment<L> for Choosing<C> {
    #[inline(always)]
    fn reserve(&mut self, _: usize) {}
    #[inline(always)]
    fn operate(&mut self, _: Op, _: &L::PointBlock, _: [&L::Block; 2], _: [u16; 2], _: &[f32]) {}
    #[inline(always)]
    fn copy(&mut self, _: u16) {}
    fn normal(&mut self, _: &L::PointBlock, _: u8, result: &mut L::Block) {
        // Any component of a normal; what is made of it paints and decides nothing.
        for lane in 0..LANES {
            L::constant(0.0).store(result, lane);
        }
    }
    #[inline(always)]
    fn channel(&mut self, _: u8, _: &L::Block) {}
    #[inline(always)]
    fn paint(&mut self, _: u16, _: &[[f32; 4]], _: u8) {}
    #[inline(always)]
    fn blend(&mut self, _: Kernel, _: [f32; 4], _: [&L::Block; 2], _: u16) {}
    #[inline(always)]
    fn choose(&mut self, at: u32, kernel: Kernel, constants: [f32; 4], values: [&L::Block; 2]) {
        self.0.choose(at, kernel, constants, values);
    }
    #[inline(always)]
    fn set(&mut self, _: u16) {}
}

/// From where on a kernel adds exactly nothing in `f32`.
fn support(kernel: Kernel, width: f32, coefficient: f32) -> f32 {
    match kernel {
        // 1 + 2^(−x c) is 1 in `f32` from x c = 25 on; one more for the rounding of the exponent.
        Kernel::Exponential => 26.0 / coefficient,
        finite => finite.support(width.into()) as f32,
    }
}

/// What decides a choice, for who runs tapes on another machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Test {
    /// How steep the two are; 0 where not all slopes are known, and intervals decide.
    pub slopes: [f32; 2],
    /// From which difference on only one of them matters.
    pub support: f32,
    /// The sign of each as an operand of a minimum.
    pub signs: [f32; 2],
}

impl Test {
    /// That of a clause of a tape, if it has a choice that can be decided.
    pub fn of(program: &Program, slopes: &Slopes, clause: &Clause) -> Option<Self> {
        if clause.flags & flags::CHOICE == 0 {
            return None;
        }
        let i = &program.code[clause.at as usize];
        let (kernel, [sign, negate, width, coefficient]) = match (i.place, i.code) {
            (Place::Blend { kernel, index }, _) => (kernel, program.pool[index as usize]),
            (Place::Push, Code::Op(op)) => (Kernel::Hard, hard(op)),
            (Place::Push, _) => return None,
        };
        let test = Self {
            slopes: if slopes.known() {
                slopes.choices[clause.at as usize]
            } else {
                [0.0; 2]
            },
            support: support(kernel, width, coefficient),
            signs: [sign, sign * negate].map(|sign| 1.0_f32.copysign(sign)),
        };
        let [first, second] = test.slopes;
        let known = [first, second, test.support];
        known
            .iter()
            .all(|number| number.is_finite())
            .then_some(test)
    }
}

widest! {
    /// In which boxes only one of two operands matters.
    fn decide(
        kernel: Kernel, constants: [f32; 4], a: &[Column; 2], b: &[Column; 2],
    ) -> [u64; 2] = decide_body;
}

#[inline(always)]
fn decide_body(
    kernel: Kernel,
    [sign, negate, width, coefficient]: [f32; 4],
    a: &[Column; 2],
    b: &[Column; 2],
) -> [u64; 2] {
    let support = support(kernel, width, coefficient);
    // Both as operands of a minimum: a sign swaps the ends. What is compared are differences, so
    // that the sign can be left to them.
    let (a_low, a_high) = if sign < 0.0 {
        (&a[1], &a[0])
    } else {
        (&a[0], &a[1])
    };
    let other = sign * negate;
    let (b_low, b_high) = if other < 0.0 {
        (&b[1], &b[0])
    } else {
        (&b[0], &b[1])
    };
    let (sa, sb) = (1.0_f32.copysign(sign), 1.0_f32.copysign(other));
    let mut first = [false; LANES];
    let mut second = [false; LANES];
    for lane in 0..LANES {
        first[lane] = b_low.0[lane] * sb - a_high.0[lane] * sa > support;
        second[lane] = a_low.0[lane] * sa - b_high.0[lane] * sb > support;
    }
    [bits(&first), bits(&second)]
}

/// What 64 boxes decide, clause by clause.
#[derive(Clone, Debug, Default)]
pub struct Decided {
    /// By a clause's place, the masks of its choice.
    by_place: Masks,
    /// The boxes in which any is decided.
    anywhere: u64,
    /// Memory for the choices that pruning leaves.
    left: Masks,
}

impl Decided {
    /// What a clause's choice is in a box.
    #[inline(always)]
    pub fn choice(&self, place: usize, lane: usize) -> Choice {
        let [first, second] = self.by_place[place];
        if first >> lane & 1 == 1 {
            Choice::First
        } else if second >> lane & 1 == 1 {
            Choice::Second
        } else {
            Choice::Both
        }
    }

    /// Whether any choice is decided in a box.
    #[inline(always)]
    pub fn any(&self, lane: usize) -> bool {
        self.anywhere >> lane & 1 == 1
    }

    /// Appends to `kept` what of the tape matters in any of these boxes, given as bits; `common`
    /// becomes what each of them decides of that. Many boxes are pruned quicker by way of what
    /// several have in common.
    pub fn prune_for(
        &self,
        boxes: u64,
        tape: &[Clause],
        pruner: &mut Pruner,
        kept: &mut Vec<Clause>,
        common: &mut Self,
    ) {
        let left = &mut common.left;
        left.clear();
        let choice = |place: usize| {
            let [first, second] = self.by_place[place];
            if first & boxes == boxes {
                Choice::First
            } else if second & boxes == boxes {
                Choice::Second
            } else {
                left.push([first, second]);
                Choice::Both
            }
        };
        let start = kept.len();
        pruner.prune(tape, choice, kept);
        let mut masks = std::mem::take(&mut common.left);
        // It asks from the back to the front.
        masks.reverse();
        common.spread(&kept[start..], &mut masks);
        common.left = masks;
    }

    /// Spreads the masks of choices over all clauses of their tape.
    fn spread(&mut self, tape: &[Clause], masks: &mut Masks) {
        self.anywhere = masks
            .iter()
            .fold(0, |all, [first, second]| all | first | second);
        let mut masks = masks.drain(..);
        self.by_place.clear();
        self.by_place.extend(tape.iter().map(|clause| {
            if clause.flags & flags::CHOICE == 0 {
                [0, 0]
            } else {
                masks.next().unwrap_or([0, 0])
            }
        }));
    }
}

/// Finds out what 64 boxes decide.
pub struct Chooser {
    /// The boxes: columns of the lower corners, then of the upper ones.
    boxes: [Column; 6],
    way: Way,
    decided: Decided,
    range: [Column; 2],
}

/// One of the two ways.
enum Way {
    Slopes(Box<Machine<f32, Choosing<BySlopes>>>),
    Intervals(Box<Machine<FloatInterval, Choosing<ByIntervals>>>),
}

impl Chooser {
    /// One for a tape and what it is pruned to.
    pub fn new(tape: &Tape) -> Self {
        let way = if tape.slopes.known() {
            let mut machine: Machine<f32, Choosing<BySlopes>> =
                Machine::new(tape.values, tape.points);
            machine.attachment().0.slopes = tape.slopes.clone();
            Way::Slopes(Box::new(machine))
        } else {
            Way::Intervals(Box::new(Machine::new(tape.values, tape.points)))
        };
        Self {
            boxes: [Column::default(); 6],
            way,
            decided: Decided::default(),
            range: [Column::default(); 2],
        }
    }

    /// The boxes of the next run: columns of the lower corners, then of the upper ones.
    pub fn boxes(&mut self) -> &mut [Column; 6] {
        &mut self.boxes
    }

    /// Runs a tape on the first `count` boxes; gives what its result lies between.
    pub fn run(&mut self, program: &Program, tape: &[Clause], count: usize) -> &[Column; 2] {
        match &mut self.way {
            Way::Intervals(machine) => {
                machine.attachment().0.decided.clear();
                *machine.seed() = self.boxes;
                self.range = *machine.run(program, tape, count);
                let masks = &mut machine.attachment().0.decided;
                self.decided.spread(tape, masks);
            }
            Way::Slopes(machine) => {
                let choosing = &mut machine.attachment().0;
                choosing.decided.clear();
                let mut middle = [Column::default(); 3];
                measure(
                    &self.boxes,
                    &mut middle,
                    &mut choosing.radius,
                    &mut choosing.slack,
                );
                *machine.seed() = middle;
                let value = *machine.run(program, tape, count);
                let choosing = &mut machine.attachment().0;
                self.range = choosing.around(&value, choosing.slopes.whole);
                self.decided.spread(tape, &mut choosing.decided);
            }
        }
        &self.range
    }

    /// What the boxes of the last run decide.
    pub fn decided(&self) -> &Decided {
        &self.decided
    }
}

/// The middle of each box, half its diagonal, and how much rounding its coordinates suffer.
fn measure(boxes: &[Column; 6], middle: &mut [Column; 3], radius: &mut Column, slack: &mut Column) {
    *radius = Column::default();
    *slack = Column::default();
    for axis in 0..3 {
        for lane in 0..LANES {
            let (low, high) = (boxes[axis].0[lane], boxes[axis + 3].0[lane]);
            let at = low + (high - low) * 0.5;
            let half = (high - at).max(at - low);
            middle[axis].0[lane] = at;
            radius.0[lane] += half * half;
            slack.0[lane] += low.abs().max(high.abs());
        }
    }
    for lane in 0..LANES {
        radius.0[lane] = radius.0[lane].sqrt() * (1.0 + 1e-6);
        slack.0[lane] *= 4e-6;
    }
}
