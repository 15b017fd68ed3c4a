//! Running a program on 64 points at once: the CPU's way to pictures.
//!
//! Every value of the machine is a block of 64 lanes, and every operation is a loop over them
//! ([`crate::lanes`]). On dual lanes the same machine gives gradients; with materials attached it
//! gives surfaces ([`crate::surface`]).

use crate::evaluate::constants;
use crate::lanes::Loops;
pub use crate::lanes::{Column, LANES, Lane, Points};
use crate::program::{Code, Frame, Needs, Operands, Place, Program};
use crate::surface::{Attachment, Plain};

/// The memory that a run needs, made once and used for any number of runs.
pub struct Machine<L: Lane, A: Attachment<L> = Plain> {
    /// The value on top, which [`run`](Self::run) leaves the result in.
    top: Box<L::Block>,
    result: Box<L::Block>,
    constant: Box<L::Block>,
    stack: Vec<Box<L::Block>>,
    slots: Vec<Box<L::Block>>,
    points: Vec<L::PointBlock>,
    current: L::PointBlock,
    framed: L::PointBlock,
    target: L::PointBlock,
    attachment: A,
    loops: Loops<L>,
}

impl<L: Lane, A: Attachment<L>> Machine<L, A> {
    /// A machine for programs that need no more than `needs`.
    pub fn new(needs: &Needs) -> Self {
        Self {
            top: Box::default(),
            result: Box::default(),
            constant: Box::default(),
            // One more than the depth: the first push saves a top that means nothing.
            stack: vec![Box::default(); needs.depth + 1],
            slots: vec![Box::default(); needs.slots],
            points: vec![L::PointBlock::default(); needs.points],
            current: L::PointBlock::default(),
            framed: L::PointBlock::default(),
            target: L::PointBlock::default(),
            attachment: A::new(needs),
            loops: L::loops(),
        }
    }

    /// What is attached to the values.
    pub fn attachment(&mut self) -> &mut A {
        &mut self.attachment
    }

    /// Runs a verified program, whose needs the machine covers, on 64 points.
    pub fn run(&mut self, program: &Program, points: &Points) -> &L::Block {
        run(self, program, points);
        &self.top
    }
}

fn run<L: Lane, A: Attachment<L>>(m: &mut Machine<L, A>, program: &Program, points: &Points) {
    m.current = L::seed(points);
    let (mut depth, mut kept) = (0_usize, 0_usize);
    for i in &program.code {
        if i.pops > 0 {
            kept -= usize::from(i.pops);
            m.current.clone_from(&m.points[kept]);
        }
        if i.push {
            m.points[kept].clone_from(&m.current);
            kept += 1;
        }
        let q = match i.frame {
            Frame::Same => &m.current,
            Frame::Moved(index) => {
                (m.loops.moved)(&m.current, program.pool[index as usize], &mut m.framed);
                &m.framed
            }
            Frame::Mapped(index) => {
                let row = |row: u32| program.pool[(index + row) as usize];
                (m.loops.mapped)(&m.current, [row(0), row(1), row(2)], &mut m.framed);
                &m.framed
            }
        };
        let taken = i.taken();
        match i.code {
            Code::Op(op) => {
                let constants = constants(program, i);
                let under = |n: usize| &*m.stack[depth.saturating_sub(n)];
                let [a, b, c] = match i.operands {
                    Operands::Stack => match taken {
                        0 | 1 => [&*m.top, &*m.top, &*m.top],
                        2 => [under(1), &*m.top, &*m.top],
                        _ => [under(2), under(1), &*m.top],
                    },
                    Operands::Right(index) | Operands::Left(index) => {
                        let value = L::constant(program.pool[index as usize][0].into());
                        for lane in 0..LANES {
                            value.store(&mut m.constant, lane);
                        }
                        match i.operands {
                            Operands::Left(_) => [&*m.constant, &*m.top, &*m.top],
                            _ => [&*m.top, &*m.constant, &*m.constant],
                        }
                    }
                };
                (m.loops.operate)(op, q, [a, b, c], constants, &mut m.result, &mut m.target);
                if i.code.gives_point() {
                    std::mem::swap(&mut m.current, &mut m.target);
                    // Its operands are gone: the value below them is on top again.
                    if taken > 0 {
                        depth -= taken;
                        std::mem::swap(&mut m.top, &mut m.stack[depth]);
                        m.attachment.restore(depth);
                    }
                    continue;
                }
                m.attachment
                    .operate(op, q, [a, b], (depth, taken), constants);
            }
            Code::Load => {
                m.result.clone_from(&m.slots[usize::from(i.slot)]);
                m.attachment.load(i.slot);
            }
            Code::Store => {
                m.slots[usize::from(i.slot)].clone_from(&m.top);
                m.result.clone_from(&m.top);
                m.attachment.store(i.slot);
            }
            Code::Take => {
                m.result.clone_from(&m.top);
                m.attachment.keep();
            }
            Code::Normal => m.attachment.normal(q, i.slot, &mut m.result),
            Code::Channel => {
                m.attachment.channel(i.slot, &m.top);
                depth -= 1;
                std::mem::swap(&mut m.top, &mut m.stack[depth]);
                m.attachment.restore(depth);
                continue;
            }
            Code::Paint => {
                m.result.clone_from(&m.top);
                let start = i.parameters as usize;
                m.attachment.paint(&program.pool[start..start + 3], i.slot);
            }
        }
        match i.place {
            Place::Push => {
                if taken == 0 {
                    std::mem::swap(&mut m.stack[depth], &mut m.top);
                    m.attachment.save(depth);
                    depth += 1;
                } else {
                    depth -= taken - 1;
                }
                std::mem::swap(&mut m.top, &mut m.result);
                m.attachment.take_result();
            }
            Place::Blend { kernel, index } => {
                let constants = program.pool[index as usize];
                depth -= taken;
                let below = if taken == 0 {
                    &*m.top
                } else {
                    &*m.stack[depth]
                };
                m.attachment.blend(
                    kernel,
                    constants,
                    (taken > 0).then_some(depth),
                    below,
                    &m.result,
                );
                if taken > 0 {
                    std::mem::swap(&mut m.top, &mut m.stack[depth]);
                }
                (m.loops.blend)(kernel, &mut m.top, &m.result, constants);
            }
        }
    }
}
