//! Programs to clauses: what lies on the stack is followed, and every value gets a register of its
//! own. The first pruning, which leaves nothing out, makes them few.

use super::{Clause, Form, flags};
use crate::kernel::Kernel;
use crate::program::{Code, Frame, Instruction, Operands, Place, Program};
use crate::table::Op;

/// No register of a fresh tape.
pub(super) const NOWHERE: u32 = u32::MAX;

/// The clauses of a program, and how many values and points they name. The result is renamed to be
/// register 0.
pub(super) fn clauses(program: &Program) -> (Vec<Clause<u32>>, usize, usize) {
    let mut builder = Builder {
        stack: Vec::new(),
        points: Vec::new(),
        point: 0,
        slots: vec![NOWHERE; program.slots as usize],
        values: 0,
        made: 1,
        clauses: Vec::with_capacity(program.code.len()),
    };
    for (at, i) in program.code.iter().enumerate() {
        builder.add(program, at as u32, i);
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
        if clause.flags & flags::GIVES_POINT == 0 {
            swap(&mut clause.out);
        }
        swap(&mut clause.below);
        clause.operands.iter_mut().for_each(swap);
    }
    (
        builder.clauses,
        builder.values as usize,
        builder.made as usize,
    )
}

struct Builder {
    /// The registers of the values on the stack.
    stack: Vec<u32>,
    /// The registers of the points kept.
    points: Vec<u32>,
    /// The register of the current point.
    point: u32,
    slots: Vec<u32>,
    values: u32,
    made: u32,
    clauses: Vec<Clause<u32>>,
}

impl Builder {
    fn pop(&mut self) -> u32 {
        self.stack.pop().unwrap_or(NOWHERE)
    }

    fn value(&mut self) -> u32 {
        self.values += 1;
        self.values - 1
    }

    fn add(&mut self, program: &Program, at: u32, i: &Instruction) {
        for _ in 0..i.pops {
            self.point = self.points.pop().unwrap_or(self.point);
        }
        if i.push {
            self.points.push(self.point);
        }
        // What guards leave out changes nothing, and pruning leaves out more.
        if i.code == Code::Guard {
            return;
        }
        let mut operands = [NOWHERE; 3];
        for operand in operands[..i.taken()].iter_mut().rev() {
            *operand = self.pop();
        }
        // The one operand beside a constant stands where the operation reads it.
        if let Operands::Left(_) = i.operands {
            operands.swap(0, 1);
        }
        let mut clause = Clause {
            at,
            form: Form::Whole,
            flags: 0,
            out: NOWHERE,
            below: NOWHERE,
            operands,
            point: if i.code.reads_point() {
                self.point
            } else {
                NOWHERE
            },
        };
        let moved = match i.code {
            Code::Load => Some(self.slots[usize::from(i.slot)]),
            Code::Store => {
                self.slots[usize::from(i.slot)] = operands[0];
                Some(operands[0])
            }
            Code::Take => Some(operands[0]),
            _ => None,
        };
        match (moved, i.place) {
            (Some(value), Place::Push) => {
                self.stack.push(value);
                return;
            }
            (Some(value), Place::Blend { .. }) => {
                clause.form = Form::Blend;
                clause.operands = [value, NOWHERE, NOWHERE];
            }
            (None, _) => {}
        }
        if let Place::Blend { index, .. } = i.place {
            clause.below = self.pop();
            clause.flags |= flags::CHOICE;
            if program.pool[index as usize][1] < 0.0 {
                clause.flags |= flags::NEGATES;
            }
        }
        clause.flags |= match i.code {
            Code::Op(op) => self.of_operation(op, i, &clause),
            Code::Channel => flags::CHANNEL,
            Code::Paint => flags::PAINT,
            _ => 0,
        };
        if i.code.gives_point() {
            clause.out = self.made;
            self.point = self.made;
            self.made += 1;
        } else if i.code != Code::Channel {
            clause.out = self.value();
            self.stack.push(clause.out);
        }
        self.clauses.push(clause);
    }

    /// The flags that an operation of the table brings.
    fn of_operation(&self, op: Op, i: &Instruction, clause: &Clause<u32>) -> u8 {
        let row = op.row();
        let mut found = 0;
        if Code::Op(op).gives_point() {
            found |= flags::GIVES_POINT;
        } else if i.frame == Frame::Same && i.place == Place::Push {
            found |= flags::BARE;
        }
        let both = clause.operands[0] != NOWHERE && clause.operands[1] != NOWHERE;
        let hard = match row.meta.blend {
            Some(blend) => blend.kernel == Kernel::Hard,
            None => matches!(op, Op::Min | Op::Max),
        };
        if hard && both && clause.below == NOWHERE {
            found |= flags::CHOICE;
            if row.meta.blend.is_some_and(|blend| blend.negate_second) {
                found |= flags::NEGATES;
            }
        }
        found
    }
}
