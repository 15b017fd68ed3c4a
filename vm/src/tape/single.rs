//! Running a tape on one point, on any number type, for those who want a pruned program's meaning
//! in full precision: proofs ([`crate::branching`], intervals and duals of `f64`).
//!
//! A pruned tape holds in the region that its choices were decided in, and there it gives what the
//! whole program gives for real numbers. Choices are decided here by intervals of `f64`
//! ([`decide`]), which bound the formula itself and not what `f32` makes of it.

use super::machine::hard;
use super::prune::Choice;
use super::{Clause, Form, flags};
use crate::apply::{Applied, Apply, apply};
use crate::evaluate::{constants, framed};
use crate::interval::Interval;
use crate::kernel::Kernel;
use crate::program::{Code, Operands, Place, Program};
use crate::real::Real;

/// The memory of a run, for any number of runs.
#[derive(Debug)]
pub struct Registers<R: Real> {
    values: Vec<R>,
    points: Vec<R::Vec3>,
}

impl<R: Real> Registers<R> {
    /// Room for tapes of no more registers than these; `point` is any point.
    pub fn new(values: usize, points: usize, point: R::Vec3) -> Self {
        Self {
            values: vec![R::constant(0.0); values.max(1)],
            points: vec![point; points.max(1)],
        }
    }
}

/// The value at a point of a tape that belongs to a program of distances. `choose` is told of each
/// choice: the clause's place, the kernel and its numbers, and the two values.
pub fn run<R: Apply>(
    program: &Program,
    tape: &[Clause],
    registers: &mut Registers<R>,
    point: R::Vec3,
    mut choose: impl FnMut(usize, Kernel, [f32; 4], [R; 2]),
) -> R {
    let Registers { values, points } = registers;
    points[0] = point;
    for (place, clause) in tape.iter().enumerate() {
        let i = &program.code[clause.at as usize];
        let constant = match i.operands {
            Operands::Right(index) | Operands::Left(index) => program.pool[index as usize][0],
            Operands::Stack => 0.0,
        };
        // A register that is none stands for the constant operand.
        let get = |r: u16| {
            let value = values.get(usize::from(r)).copied();
            value.unwrap_or(R::constant(constant.into()))
        };
        let operands = clause.operands.map(get);
        let choice = clause.flags & flags::CHOICE != 0;
        let result = match (clause.form, i.code) {
            (Form::Whole | Form::Alone | Form::Negated, Code::Op(op)) => {
                let from = points.get(usize::from(clause.point)).copied();
                let q = framed::<R>(program, i, from.unwrap_or(point));
                if choice && clause.below == super::NONE {
                    choose(place, Kernel::Hard, hard(op), [operands[0], operands[1]]);
                }
                match apply::<R>(op, q, operands, constants(program, i)) {
                    Applied::Value(value) if clause.form == Form::Negated => -value,
                    Applied::Value(value) => value,
                    Applied::Point(to) => {
                        points[usize::from(clause.out)] = to;
                        continue;
                    }
                }
            }
            (Form::Negate, _) => -operands[0],
            // Moves leave no clause of their own, and surfaces no clause in tapes of distances.
            _ => operands[0],
        };
        values[usize::from(clause.out)] = match i.place {
            Place::Blend { kernel, index } if clause.below != super::NONE => {
                let numbers = program.pool[index as usize];
                let below = values[usize::from(clause.below)];
                if choice {
                    choose(place, kernel, numbers, [below, result]);
                }
                let [s, sb, width, coefficient] = numbers.map(|v| R::constant(v.into()));
                kernel.blend(below, result, s, sb, width, coefficient)
            }
            _ => result,
        };
    }
    values[0]
}

/// Which of the two values of a choice matters, where all there is to know are these bounds.
pub fn decide(kernel: Kernel, [sign, negate, width, _]: [f32; 4], [a, b]: [Interval; 2]) -> Choice {
    let signed = |v: Interval, sign: f32| if sign < 0.0 { -v } else { v };
    // Both as operands of a minimum.
    let (a, b) = (signed(a, sign), signed(b, sign * negate));
    let support = kernel.support(width.into());
    let apart =
        |nearer: Interval, farther: Interval| (farther.lo - nearer.hi).next_down() > support;
    if apart(a, b) {
        Choice::First
    } else if apart(b, a) {
        Choice::Second
    } else {
        Choice::Both
    }
}
