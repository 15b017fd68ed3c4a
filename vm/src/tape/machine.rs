//! Running a tape on 64 points at once: the CPU's way to pictures.
//!
//! Every register is a block of 64 lanes, and every operation is a loop over them
//! ([`crate::lanes`]). On duals the same machine gives gradients, on intervals bounds; with
//! materials attached it gives surfaces ([`crate::surface`]), and with choices attached it finds
//! what a tape can be pruned to ([`super::choose`]).

use super::{Clause, Form, flags};
use crate::kernel::Kernel;
use crate::lanes::{Instructions, Lane, Loops, Reads};
use crate::program::{Code, Frame, Operands, Place, Program};
use crate::table::Op;

/// What rides along with the values. The machine tells it what it does: first what the result is
/// made of, then where it goes.
pub trait Attachment<L: Lane> {
    /// Makes room for so many registers.
    fn reserve(&mut self, values: usize);
    /// An operation at the point `q` made the result from the values in these registers, which are
    /// [`super::NONE`] where it reads none.
    fn operate(
        &mut self,
        op: Op,
        q: &L::PointBlock,
        values: [&L::Block; 2],
        registers: [u16; 2],
        constants: &[f32],
    );
    /// The result is what this register holds.
    fn copy(&mut self, from: u16);
    /// The result is a component of the normal in the frame of the point `q`.
    fn normal(&mut self, q: &L::PointBlock, axis: u8, result: &mut L::Block);
    /// A value becomes a number of the next material.
    fn channel(&mut self, channel: u8, value: &L::Block);
    /// The result is what this register holds, in a new material.
    fn paint(&mut self, from: u16, constants: &[[f32; 4]], mask: u8);
    /// The result is blended into the value of the register `below`; `values` are the two.
    fn blend(&mut self, kernel: Kernel, constants: [f32; 4], values: [&L::Block; 2], below: u16);
    /// A region may decide between two values; asked of every clause with [`flags::CHOICE`], which
    /// is of the instruction `at`.
    fn choose(&mut self, at: u32, kernel: Kernel, constants: [f32; 4], values: [&L::Block; 2]);
    /// The result goes to this register.
    fn set(&mut self, out: u16);
}

/// Nothing attached: distances and gradients only.
#[derive(Clone, Copy, Debug, Default)]
pub struct Plain;

impl<L: Lane> Attachment<L> for Plain {
    #[inline(always)]
    fn reserve(&mut self, _: usize) {}
    #[inline(always)]
    fn operate(&mut self, _: Op, _: &L::PointBlock, _: [&L::Block; 2], _: [u16; 2], _: &[f32]) {}
    #[inline(always)]
    fn copy(&mut self, _: u16) {}
    #[inline(always)]
    fn normal(&mut self, _: &L::PointBlock, _: u8, _: &mut L::Block) {}
    #[inline(always)]
    fn channel(&mut self, _: u8, _: &L::Block) {}
    #[inline(always)]
    fn paint(&mut self, _: u16, _: &[[f32; 4]], _: u8) {}
    #[inline(always)]
    fn blend(&mut self, _: Kernel, _: [f32; 4], _: [&L::Block; 2], _: u16) {}
    #[inline(always)]
    fn choose(&mut self, _: u32, _: Kernel, _: [f32; 4], _: [&L::Block; 2]) {}
    #[inline(always)]
    fn set(&mut self, _: u16) {}
}

/// The memory that a run needs, made once and used for any number of runs.
pub struct Machine<L: Lane, A: Attachment<L> = Plain> {
    values: Vec<Box<L::Block>>,
    points: Vec<Box<L::PointBlock>>,
    result: Box<L::Block>,
    constant: Box<L::Block>,
    framed: Box<L::PointBlock>,
    target: Box<L::PointBlock>,
    attachment: A,
    loops: Loops<L>,
}

impl<L: Lane, A: Attachment<L> + Default> Default for Machine<L, A> {
    fn default() -> Self {
        Self {
            values: Vec::new(),
            points: Vec::new(),
            result: Box::default(),
            constant: Box::default(),
            framed: Box::default(),
            target: Box::default(),
            attachment: A::default(),
            loops: L::loops(Instructions::Avx512),
        }
    }
}

impl<L: Lane, A: Attachment<L> + Default> Machine<L, A> {
    /// A machine for tapes of no more registers than these.
    pub fn new(values: usize, points: usize) -> Self {
        let mut machine = Self::default();
        machine.reserve(values, points);
        machine
    }

    /// The same machine with no wider instructions than these; its results have the same bits.
    pub fn limited(mut self, widest: Instructions) -> Self {
        self.loops = L::loops(widest);
        self
    }
}

impl<L: Lane, A: Attachment<L>> Machine<L, A> {
    /// Makes room for tapes of so many registers.
    pub fn reserve(&mut self, values: usize, points: usize) {
        if self.values.len() < values.max(1) {
            self.values.resize_with(values.max(1), Box::default);
            self.attachment.reserve(values.max(1));
        }
        if self.points.len() < points.max(1) {
            self.points.resize_with(points.max(1), Box::default);
        }
    }

    /// What is attached to the values.
    pub fn attachment(&mut self) -> &mut A {
        &mut self.attachment
    }

    /// The points that the next run looks at.
    pub fn seed(&mut self) -> &mut L::PointBlock {
        &mut self.points[0]
    }

    /// The last run's result.
    pub fn result(&self) -> &L::Block {
        &self.values[0]
    }

    /// Runs a tape of a verified program, or a pruned one, on the first `count` lanes of the seed.
    pub fn run(&mut self, program: &Program, tape: &[Clause], count: usize) -> &L::Block {
        let rest = self.run_bare(program, tape, count);
        let m = self;
        for clause in rest {
            let i = &program.code[clause.at as usize];
            let [a, b, c] = clause.operands;
            let value = |r: u16| usize::from(r);
            match clause.form {
                Form::Whole | Form::Alone | Form::Negated => {
                    if clause.flags & flags::CHANNEL != 0 {
                        m.attachment.channel(i.slot, &m.values[value(a)]);
                        continue;
                    }
                    let stay = &m.points[0];
                    let from = m.points.get(usize::from(clause.point)).unwrap_or(stay);
                    let q: &L::PointBlock = match i.frame {
                        Frame::Same => from,
                        Frame::Moved(index) => {
                            let by = program.pool[index as usize];
                            (m.loops.moved)(from, &by, &mut m.framed, count);
                            &m.framed
                        }
                        Frame::Mapped(index) => {
                            let row = |row: u32| program.pool[(index + row) as usize];
                            let rows = [row(0), row(1), row(2)];
                            (m.loops.mapped)(from, &rows, &mut m.framed, count);
                            &m.framed
                        }
                    };
                    // An operation of the table nearly always: a test, not a jump by a table.
                    if let Code::Op(op) = i.code {
                        if let Operands::Right(index) | Operands::Left(index) = i.operands {
                            let number = program.pool[index as usize][0];
                            (m.loops.fill)(number, &mut m.constant, count);
                        }
                        let get = |r: u16| m.values.get(value(r)).unwrap_or(&m.constant);
                        let values = [&**get(a), &**get(b), &**get(c)];
                        let numbers = program.pool[i.parameters as usize..].as_flattened();
                        let reads = Reads {
                            point: q,
                            values,
                            constants: numbers,
                            count,
                        };
                        let operation = m.loops.operations[op as usize];
                        operation(&reads, &mut m.result, &mut m.target);
                        if clause.flags & flags::GIVES_POINT != 0 {
                            let out = &mut m.points[usize::from(clause.out)];
                            std::mem::swap(out, &mut m.target);
                            continue;
                        }
                        let two = [values[0], values[1]];
                        if clause.flags & flags::CHOICE != 0 && clause.below == super::NONE {
                            m.attachment.choose(clause.at, Kernel::Hard, hard(op), two);
                        }
                        m.attachment.operate(op, q, two, [a, b], numbers);
                    } else if i.code == Code::Normal {
                        m.attachment.normal(q, i.slot, &mut m.result);
                    } else {
                        debug_assert_eq!(i.code, Code::Paint, "moves leave no clause of their own");
                        m.result.clone_from(&m.values[value(a)]);
                        let start = i.parameters as usize;
                        let numbers = &program.pool[start..start + 3];
                        m.attachment.paint(a, numbers, i.slot);
                    }
                    if clause.form == Form::Negated {
                        m.negate_result(count);
                    }
                }
                Form::Blend | Form::Copy | Form::Negate => {
                    m.result.clone_from(&m.values[value(a)]);
                    m.attachment.copy(a);
                    if clause.form == Form::Negate {
                        m.negate_result(count);
                    }
                }
            }
            let (out, below) = (value(clause.out), value(clause.below));
            match i.place {
                Place::Blend { kernel, index } if clause.below != super::NONE => {
                    let numbers = program.pool[index as usize];
                    let two = [&*m.values[below], &*m.result];
                    m.attachment.choose(clause.at, kernel, numbers, two);
                    m.attachment.blend(kernel, numbers, two, clause.below);
                    if out != below {
                        let (first, second) = m.values.split_at_mut(out.max(below));
                        let (to, from) = if out < below {
                            (&mut first[out], &second[0])
                        } else {
                            (&mut second[0], &first[below])
                        };
                        to.clone_from(from);
                    }
                    (m.loops.blend)(kernel, &mut m.values[out], &m.result, &numbers, count);
                }
                _ => std::mem::swap(&mut m.values[out], &mut m.result),
            }
            m.attachment.set(clause.out);
        }
        &m.values[0]
    }

    /// Runs the clauses at the beginning that have [`flags::BARE`]; gives the others. Fields written with
    /// coordinates often have no others, and their operations take no longer than to find out what else a
    /// clause might want.
    fn run_bare<'a>(
        &mut self,
        program: &Program,
        tape: &'a [Clause],
        count: usize,
    ) -> &'a [Clause] {
        let m = self;
        let mut rest = tape;
        while let [clause, others @ ..] = rest {
            let i = &program.code[clause.at as usize];
            let (true, Code::Op(op)) = (clause.flags & flags::BARE != 0, i.code) else {
                break;
            };
            rest = others;
            if let Operands::Right(index) | Operands::Left(index) = i.operands {
                (m.loops.fill)(program.pool[index as usize][0], &mut m.constant, count);
            }
            let get = |r: u16| m.values.get(usize::from(r)).unwrap_or(&m.constant);
            let [a, b, c] = clause.operands;
            let values = [&**get(a), &**get(b), &**get(c)];
            let point = m.points.get(usize::from(clause.point));
            let point = &**point.unwrap_or(&m.points[0]);
            let numbers = program.pool[i.parameters as usize..].as_flattened();
            let reads = Reads {
                point,
                values,
                constants: numbers,
                count,
            };
            (m.loops.operations[op as usize])(&reads, &mut m.result, &mut m.target);
            let two = [values[0], values[1]];
            if clause.flags & flags::CHOICE != 0 {
                m.attachment.choose(clause.at, Kernel::Hard, hard(op), two);
            }
            m.attachment.operate(op, point, two, [a, b], numbers);
            std::mem::swap(&mut m.values[usize::from(clause.out)], &mut m.result);
            m.attachment.set(clause.out);
        }
        rest
    }

    fn negate_result(&mut self, count: usize) {
        let reads = Reads {
            point: &*self.points[0],
            values: [&*self.result; 3],
            constants: &[],
            count,
        };
        let negate = self.loops.operations[Op::Neg as usize];
        negate(&reads, &mut self.constant, &mut self.target);
        std::mem::swap(&mut self.result, &mut self.constant);
    }
}

/// The numbers of the hard blend that an operation of the table is.
pub(super) fn hard(op: Op) -> [f32; 4] {
    let (sign, negate) = match op.row().meta.blend {
        Some(blend) => (blend.sign, blend.negate_second),
        None if op == Op::Max => (-1.0, false),
        None => (1.0, false),
    };
    [sign, if negate { -1.0 } else { 1.0 }, 0.0, 0.0]
}
