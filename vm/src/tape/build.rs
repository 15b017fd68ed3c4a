//! Builds the clauses of a program. The builder tracks the stack, and every value gets its own register. A
//! first pruning pass, which drops no live clause, then reduces the number of registers.

use super::{Clause, ClauseKind, flags};
use crate::blend::BlendKernel;
use crate::program::{Destination, Instruction, Opcode, Operands, PointTransform, Program};
use crate::table::Op;

/// An absent register in a newly built tape.
pub(super) const UNASSIGNED: u32 = u32::MAX;

/// Returns the clauses of a program, with the numbers of value and point registers that they use. The
/// result is renamed to register 0.
pub(super) fn clauses(program: &Program) -> (Vec<Clause<u32>>, usize, usize) {
    let mut builder = Builder {
        stack: Vec::new(),
        points: Vec::new(),
        point: 0,
        slots: vec![UNASSIGNED; program.slots as usize],
        values: 0,
        next_point: 1,
        clauses: Vec::with_capacity(program.code.len()),
    };
    for (index, i) in program.code.iter().enumerate() {
        builder.add(program, index as u32, i);
    }
    let result = builder.pop();
    let swap = |r: &mut u32| {
        if *r == result {
            *r = 0;
        } else if *r == 0 {
            *r = result;
        }
    };
    for clause in &mut builder.clauses {
        if clause.flags & flags::RETURNS_POINT == 0 {
            swap(&mut clause.dst);
        }
        swap(&mut clause.accumulator);
        clause.operands.iter_mut().for_each(swap);
    }
    (
        builder.clauses,
        builder.values as usize,
        builder.next_point as usize,
    )
}

struct Builder {
    /// Registers of the values on the stack.
    stack: Vec<u32>,
    /// Registers of the saved points.
    points: Vec<u32>,
    /// Register of the current point.
    point: u32,
    slots: Vec<u32>,
    values: u32,
    next_point: u32,
    clauses: Vec<Clause<u32>>,
}

impl Builder {
    fn pop(&mut self) -> u32 {
        self.stack.pop().unwrap_or(UNASSIGNED)
    }

    fn value(&mut self) -> u32 {
        self.values += 1;
        self.values - 1
    }

    fn add(&mut self, program: &Program, index: u32, i: &Instruction) {
        for _ in 0..i.pops {
            self.point = self.points.pop().unwrap_or(self.point);
        }
        if i.push {
            self.points.push(self.point);
        }
        // A skipped block changes nothing, and pruning drops more.
        if i.code == Opcode::Guard {
            return;
        }
        let mut operands = [UNASSIGNED; 3];
        for operand in operands[..i.pop_count()].iter_mut().rev() {
            *operand = self.pop();
        }
        // The operand beside a constant has the position at which the operation reads it.
        if let Operands::Left(_) = i.operands {
            operands.swap(0, 1);
        }
        let mut clause = Clause {
            instruction: index,
            kind: ClauseKind::Full,
            flags: 0,
            dst: UNASSIGNED,
            accumulator: UNASSIGNED,
            operands,
            point: if i.code.reads_point() {
                self.point
            } else {
                UNASSIGNED
            },
        };
        let moved = match i.code {
            Opcode::Load => Some(self.slots[usize::from(i.slot)]),
            Opcode::Store => {
                self.slots[usize::from(i.slot)] = operands[0];
                Some(operands[0])
            }
            Opcode::Top => Some(operands[0]),
            _ => None,
        };
        match (moved, i.destination) {
            (Some(value), Destination::Push) => {
                self.stack.push(value);
                return;
            }
            (Some(value), Destination::Blend { .. }) => {
                clause.kind = ClauseKind::Blend;
                clause.operands = [value, UNASSIGNED, UNASSIGNED];
            }
            (None, _) => {}
        }
        if let Destination::Blend { index, .. } = i.destination {
            clause.accumulator = self.pop();
            clause.flags |= flags::CHOICE;
            if program.pool[index as usize][1] < 0.0 {
                clause.flags |= flags::NEGATES;
            }
        }
        clause.flags |= match i.code {
            Opcode::Op(op) => self.op_flags(op, i, &clause),
            Opcode::Channel => flags::CHANNEL,
            Opcode::Paint => flags::PAINT,
            _ => 0,
        };
        if i.code.returns_point() {
            clause.dst = self.next_point;
            self.point = self.next_point;
            self.next_point += 1;
        } else if i.code != Opcode::Channel {
            clause.dst = self.value();
            self.stack.push(clause.dst);
        }
        self.clauses.push(clause);
    }

    /// Returns the flags of an operation of the table.
    fn op_flags(&self, op: Op, i: &Instruction, clause: &Clause<u32>) -> u8 {
        let row = op.row();
        let mut bits = 0;
        if Opcode::Op(op).returns_point() {
            bits |= flags::RETURNS_POINT;
        } else if i.transform == PointTransform::Identity && i.destination == Destination::Push {
            bits |= flags::SIMPLE_OP;
        }
        let has_two_operands = clause.operands[0] != UNASSIGNED && clause.operands[1] != UNASSIGNED;
        let hard = match row.facts.blend {
            Some(blend) => blend.kernel == BlendKernel::Hard,
            None => matches!(op, Op::Min | Op::Max),
        };
        if hard && has_two_operands && clause.accumulator == UNASSIGNED {
            bits |= flags::CHOICE;
            if row.facts.blend.is_some_and(|blend| blend.negate_second) {
                bits |= flags::NEGATES;
            }
        }
        bits
    }
}
