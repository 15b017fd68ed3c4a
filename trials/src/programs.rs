//! Programs that are always valid.
//!
//! The generator draws every opcode of the table and every way to use it (frames, kept points, slots,
//! constant operands, blends, guards), so a new row is covered without a new test. The numbers are
//! any: roots of negative numbers and divisions by zero occur.

use crate::random::Random;
use sdfc_vm::kernel::Kernel;
use sdfc_vm::lanes::Column;
use sdfc_vm::pool::{PoolBuilder, PoolNumber};
use sdfc_vm::program::{Code, Frame, Instruction, MAX_POINTS, Operands, Place, Program};
use sdfc_vm::row::Output;
use sdfc_vm::table::{Op, ROWS};

/// The program of a seed: verified, of 3 to some 60 instructions, with one value left at its end.
pub fn program(seed: u64) -> Program {
    let mut r = Random::new(seed);
    let mut pool = PoolBuilder::default();
    let mut code = Vec::new();
    let (mut depth, mut points, mut slots) = (0_usize, 0_usize, 0_u32);
    let length = 3 + r.below(40);
    while code.len() < length || depth != 1 {
        let closing = code.len() >= length && depth > 1;
        if depth > 0 && r.chance(8) {
            guarded_balls(&mut r, &mut pool, &mut code, points, 0);
            continue;
        }
        let numbers = |r: &mut Random, n: usize| -> Vec<PoolNumber> {
            (0..n).map(|_| r.number().into()).collect()
        };
        let code_of = |r: &mut Random| match r.below(12) {
            0 if slots > 0 => Code::Load,
            1 if depth > 0 => Code::Store,
            2 if depth > 1 => Code::Take,
            _ => Code::Op(ROWS[r.below(ROWS.len())].op),
        };
        let picked = if closing { Code::Take } else { code_of(&mut r) };
        let mut i = Instruction::new(picked);
        if let Code::Op(op) = picked {
            let row = op.row();
            if row.arity() == 2 && r.chance(30) {
                let index = pool.add(&numbers(&mut r, 1));
                i.operands = if r.chance(50) {
                    Operands::Left(index)
                } else {
                    Operands::Right(index)
                };
            }
            if row.parameter_width() > 0 {
                i.parameters = pool.add(&numbers(&mut r, row.parameter_width()));
            }
            if row.reads_point() {
                i.frame = match r.below(3) {
                    0 => Frame::Same,
                    1 => Frame::Moved(pool.add(&numbers(&mut r, 3))),
                    _ => Frame::Mapped(pool.add(&numbers(&mut r, 12))),
                };
            }
            if points > 0 && r.chance(30) {
                i.pops = (1 + r.below(points)) as u8;
            }
            if row.output == Output::Point && points - (i.pops as usize) < MAX_POINTS {
                i.push = r.chance(70);
            }
        }
        if i.taken() > depth {
            continue;
        }
        match picked {
            Code::Load => i.slot = r.below(slots as usize) as u8,
            Code::Store => {
                i.slot = r.below(slots as usize + 1).min(7) as u8;
                slots = slots.max(u32::from(i.slot) + 1);
            }
            _ => {}
        }
        let left = depth - i.taken();
        let blends = closing || r.chance(40);
        if blends && left > 0 && !i.gives_none() && i.operands == Operands::Stack {
            let kernel = Kernel::ALL[r.below(5)];
            let signs = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]][r.below(3)];
            let width = 0.1 + r.below(10) as f32 / 10.0;
            let list = [signs[0], signs[1], width, 1.0 / (4.0 * width)].map(PoolNumber::from);
            i.place = Place::Blend {
                kernel,
                index: pool.add(&list),
            };
        }
        let pushes = i.place == Place::Push && !i.gives_none();
        if left + usize::from(pushes) > 8 {
            continue;
        }
        points = points - i.pops as usize + usize::from(i.push);
        depth = left + usize::from(pushes);
        code.push(i);
        if code.len() > 400 {
            // Never seen; a guard against a generator that cannot close.
            panic!("the program does not end");
        }
    }
    let (pool, patches) = pool.finish();
    Program {
        code,
        pool,
        patches,
        slots,
    }
}

/// A guard in front of balls that are blended into the value on top, some of them behind guards of
/// their own, some at a point that is kept for a while. It tells the truth: what it skips does not
/// matter.
fn guarded_balls(
    r: &mut Random,
    pool: &mut PoolBuilder,
    code: &mut Vec<Instruction>,
    points: usize,
    level: usize,
) -> [[f32; 2]; 3] {
    let at = code.len();
    code.push(Instruction::new(Code::Guard));
    let smooth = r.chance(50);
    let mut hull = [[f32::INFINITY, f32::NEG_INFINITY]; 3];
    for _ in 0..1 + r.below(3) {
        if level < 3 && r.chance(25) {
            let inner = guarded_balls(r, pool, code, points, level + 1);
            for (side, [low, high]) in hull.iter_mut().zip(inner) {
                *side = [side[0].min(low), side[1].max(high)];
            }
            continue;
        }
        let mut ball = Instruction::new(Code::Op(Op::Sphere));
        let radius = 0.1 + r.below(900) as f32 / 1000.0;
        let by: [f32; 3] = std::array::from_fn(|_| r.number());
        ball.parameters = pool.add(&[radius.into()]);
        ball.frame = Frame::Moved(pool.add(&by.map(PoolNumber::from)));
        let kernel = if smooth {
            Kernel::Quadratic
        } else {
            Kernel::Hard
        };
        let list = [1.0, 1.0, 0.5, 0.5].map(PoolNumber::from);
        ball.place = Place::Blend {
            kernel,
            index: pool.add(&list),
        };
        // The mirrored point is kept for this ball only: the shape is there on both sides.
        let mirrors = points + level < MAX_POINTS && r.chance(25);
        if mirrors {
            code.push(Instruction {
                push: true,
                parameters: pool.add(&[1.0.into(), 1.0.into(), 1.0.into()]),
                ..Instruction::new(Code::Op(Op::Mirror))
            });
        }
        code.push(ball);
        if mirrors {
            code.push(Instruction {
                pops: 1,
                ..Instruction::new(Code::Take)
            });
        }
        for (side, by) in hull.iter_mut().zip(by) {
            let reach = if mirrors {
                [-by.abs() - radius, by.abs() + radius]
            } else {
                [-by - radius, -by + radius]
            };
            *side = [side[0].min(reach[0]), side[1].max(reach[1])];
        }
    }
    let middle = hull.map(|[low, high]| (low + high) / 2.0);
    let half = hull.map(|[low, high]| (high - low) / 2.0 + 0.01);
    // The blends within may be smooth, or those of the guards within.
    let volume = [
        middle[0], middle[1], middle[2], 0.5, half[0], half[1], half[2], 1.0,
    ];
    let parameters = pool.add(&volume.map(PoolNumber::from));
    code[at].parameters = parameters;
    code[at].skips = (code.len() - at - 1) as u32;
    hull
}

/// 64 points in the cube from −2 to 2.
pub fn points(seed: u64) -> [Column; 3] {
    let mut r = Random::new(seed);
    std::array::from_fn(|_| Column(std::array::from_fn(|_| r.number())))
}

/// One program that runs several one after another and unites what they give: it needs of a kernel
/// what each of them needs.
pub fn joined(programs: &[Program]) -> Program {
    let mut all = Program {
        code: Vec::new(),
        // The first constant makes a blend of two values a hard union.
        pool: vec![[1.0, 1.0, 0.0, 0.0]],
        patches: Vec::new(),
        slots: 0,
    };
    for program in programs {
        let by = all.pool.len() as u32;
        let mut points = 0;
        for i in &program.code {
            points = points - i.pops + u8::from(i.push);
            all.code.push(moved(*i, by));
        }
        // Back to where it began, if it kept a point.
        let place = match all.code.len() > program.code.len() {
            true => Place::Blend {
                kernel: Kernel::Hard,
                index: 0,
            },
            false => Place::Push,
        };
        all.code.push(Instruction {
            pops: points,
            place,
            ..Instruction::new(Code::Take)
        });
        all.pool.extend(&program.pool);
        all.slots = all.slots.max(program.slots);
    }
    all
}

/// An instruction whose constants lie so many places farther on.
fn moved(i: Instruction, by: u32) -> Instruction {
    Instruction {
        parameters: if i.code.pool_width() > 0 {
            i.parameters + by
        } else {
            0
        },
        frame: match i.frame {
            Frame::Same => Frame::Same,
            Frame::Moved(index) => Frame::Moved(index + by),
            Frame::Mapped(index) => Frame::Mapped(index + by),
        },
        operands: match i.operands {
            Operands::Stack => Operands::Stack,
            Operands::Left(index) => Operands::Left(index + by),
            Operands::Right(index) => Operands::Right(index + by),
        },
        place: match i.place {
            Place::Push => Place::Push,
            Place::Blend { kernel, index } => Place::Blend {
                kernel,
                index: index + by,
            },
        },
        ..i
    }
}
