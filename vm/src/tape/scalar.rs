//! Evaluation of a tape at one point, for any number type. Proofs use it on pruned programs in full
//! precision ([`crate::branching`], intervals and duals of `f64`).
//!
//! A pruned tape is valid in the region that its choices were decided in. There it equals the full program
//! for real numbers. [`decide_choice`] decides by intervals of `f64`, which bound the formula itself and
//! not its `f32` evaluation.

use super::evaluator::hard_blend_constants;
use super::prune::Choice;
use super::{Clause, ClauseKind, flags};
use crate::apply::{Apply, OpResult, apply};
use crate::blend::BlendKernel;
use crate::evaluate::{constants, transformed};
use crate::interval::Interval;
use crate::program::{Destination, Opcode, Operands, Program};
use crate::real::Real;

/// Reusable registers of an evaluation.
#[derive(Debug)]
pub struct Registers<R: Real> {
    values: Vec<R>,
    points: Vec<R::Vec3>,
}

impl<R: Real> Registers<R> {
    /// Creates registers for tapes of at most this many values and points; `point` is any point.
    pub fn new(values: usize, points: usize, point: R::Vec3) -> Self {
        Self {
            values: vec![R::constant(0.0); values.max(1)],
            points: vec![point; points.max(1)],
        }
    }
}

/// Evaluates a tape of a distance program at a point. `choose` is called for each choice with the clause's
/// index, the kernel, its constants, and the two operands.
pub fn eval<R: Apply>(
    program: &Program,
    tape: &[Clause],
    registers: &mut Registers<R>,
    point: R::Vec3,
    mut choose: impl FnMut(usize, BlendKernel, [f32; 4], [R; 2]),
) -> R {
    let Registers { values, points } = registers;
    points[0] = point;
    for (clause_index, clause) in tape.iter().enumerate() {
        let i = &program.code[clause.instruction as usize];
        let constant = match i.operands {
            Operands::Right(index) | Operands::Left(index) => program.pool[index as usize][0],
            Operands::Stack => 0.0,
        };
        // An absent register stands for the constant operand.
        let get = |r: u16| {
            let value = values.get(usize::from(r)).copied();
            value.unwrap_or(R::constant(constant.into()))
        };
        let operands = clause.operands.map(get);
        let choice = clause.flags & flags::CHOICE != 0;
        let result = match (clause.kind, i.code) {
            (ClauseKind::Full | ClauseKind::OpOnly | ClauseKind::NegatedOp, Opcode::Op(op)) => {
                let from = points.get(usize::from(clause.point)).copied();
                let q = transformed::<R>(program, i, from.unwrap_or(point));
                if choice && clause.accumulator == super::NO_REGISTER {
                    choose(
                        clause_index,
                        BlendKernel::Hard,
                        hard_blend_constants(op),
                        [operands[0], operands[1]],
                    );
                }
                match apply::<R>(op, q, operands, constants(program, i)) {
                    OpResult::Value(value) if clause.kind == ClauseKind::NegatedOp => -value,
                    OpResult::Value(value) => value,
                    OpResult::Point(to) => {
                        points[usize::from(clause.dst)] = to;
                        continue;
                    }
                }
            }
            (ClauseKind::Negate, _) => -operands[0],
            // Moves need no clause, and surface operations have none in distance tapes.
            _ => operands[0],
        };
        values[usize::from(clause.dst)] = match i.destination {
            Destination::Blend { kernel, index } if clause.accumulator != super::NO_REGISTER => {
                let numbers = program.pool[index as usize];
                let accumulator = values[usize::from(clause.accumulator)];
                if choice {
                    choose(clause_index, kernel, numbers, [accumulator, result]);
                }
                let [s, sb, width, coefficient] = numbers.map(|v| R::constant(v.into()));
                kernel.blend(accumulator, result, s, sb, width, coefficient)
            }
            _ => result,
        };
    }
    values[0]
}

/// Decides a choice from bounds of its two operands.
pub fn decide_choice(
    kernel: BlendKernel,
    [sign, negate, width, _]: [f32; 4],
    [a, b]: [Interval; 2],
) -> Choice {
    let signed = |v: Interval, sign: f32| if sign < 0.0 { -v } else { v };
    // Both as operands of a minimum.
    let (a, b) = (signed(a, sign), signed(b, sign * negate));
    let support = kernel.support(width.into());
    let exceeds_support =
        |nearer: Interval, farther: Interval| (farther.lo - nearer.hi).next_down() > support;
    if exceeds_support(a, b) {
        Choice::First
    } else if exceeds_support(b, a) {
        Choice::Second
    } else {
        Choice::Both
    }
}
