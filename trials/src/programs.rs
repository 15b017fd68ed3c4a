//! Random programs that are always valid.
//!
//! The generator draws every opcode of the table and every way to use it: maps, saved points, slots,
//! constant operands, blends and guards. New rows are therefore covered without a new test. Operands are
//! arbitrary, so roots of negative numbers and divisions by zero occur.

use crate::random::Random;
use sdfc_vm::blend::BlendKernel;
use sdfc_vm::lanes::F32x64;
use sdfc_vm::pool::{PoolBuilder, PoolNumber};
use sdfc_vm::program::{
    Destination, Instruction, MAX_STACK_POINTS, Opcode, Operands, PointTransform, Program,
};
use sdfc_vm::row::Output;
use sdfc_vm::table::{Op, ROWS};

/// Generates the verified program of a seed, with about 3 to 60 instructions and one result.
pub fn program(seed: u64) -> Program {
    let mut r = Random::new(seed);
    let mut pool = PoolBuilder::default();
    let mut code = Vec::new();
    let (mut depth, mut points, mut slots) = (0_usize, 0_usize, 0_u32);
    let length = 3 + r.below(40);
    while code.len() < length || depth != 1 {
        let must_close = code.len() >= length && depth > 1;
        if depth > 0 && r.chance(8) {
            guarded_spheres(&mut r, &mut pool, &mut code, points, 0);
            continue;
        }
        let numbers = |r: &mut Random, n: usize| -> Vec<PoolNumber> {
            (0..n).map(|_| r.number().into()).collect()
        };
        let code_of = |r: &mut Random| match r.below(12) {
            0 if slots > 0 => Opcode::Load,
            1 if depth > 0 => Opcode::Store,
            2 if depth > 1 => Opcode::Top,
            _ => Opcode::Op(ROWS[r.below(ROWS.len())].op),
        };
        let opcode = if must_close {
            Opcode::Top
        } else {
            code_of(&mut r)
        };
        let mut instruction = Instruction::new(opcode);
        if let Opcode::Op(op) = opcode {
            let row = op.row();
            if row.arity() == 2 && r.chance(30) {
                let index = pool.add(&numbers(&mut r, 1));
                instruction.operands = if r.chance(50) {
                    Operands::Left(index)
                } else {
                    Operands::Right(index)
                };
            }
            if row.parameter_width() > 0 {
                instruction.parameters = pool.add(&numbers(&mut r, row.parameter_width()));
            }
            if row.reads_point() {
                instruction.transform = match r.below(3) {
                    0 => PointTransform::Identity,
                    1 => PointTransform::Translate(pool.add(&numbers(&mut r, 3))),
                    _ => PointTransform::Affine(pool.add(&numbers(&mut r, 12))),
                };
            }
            if points > 0 && r.chance(30) {
                instruction.pops = (1 + r.below(points)) as u8;
            }
            if row.output == Output::Point
                && points - (instruction.pops as usize) < MAX_STACK_POINTS
            {
                instruction.push = r.chance(70);
            }
        }
        if instruction.pop_count() > depth {
            continue;
        }
        match opcode {
            Opcode::Load => instruction.slot = r.below(slots as usize) as u8,
            Opcode::Store => {
                instruction.slot = r.below(slots as usize + 1).min(7) as u8;
                slots = slots.max(u32::from(instruction.slot) + 1);
            }
            _ => {}
        }
        let remaining = depth - instruction.pop_count();
        let blends = must_close || r.chance(40);
        if blends
            && remaining > 0
            && !instruction.has_no_value()
            && instruction.operands == Operands::Stack
        {
            let kernel = BlendKernel::ALL[r.below(5)];
            let signs = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]][r.below(3)];
            let width = 0.1 + r.below(10) as f32 / 10.0;
            let list = [signs[0], signs[1], width, 1.0 / (4.0 * width)].map(PoolNumber::from);
            instruction.destination = Destination::Blend {
                kernel,
                index: pool.add(&list),
            };
        }
        let pushes = instruction.destination == Destination::Push && !instruction.has_no_value();
        if remaining + usize::from(pushes) > 8 {
            continue;
        }
        points = points - instruction.pops as usize + usize::from(instruction.push);
        depth = remaining + usize::from(pushes);
        code.push(instruction);
        if code.len() > 400 {
            // Guard against a generator that does not terminate. It has never been reached.
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

/// Emits a guard in front of spheres that are blended into the value on top.
///
/// Some spheres are behind nested guards, and some at a mirrored point. The guard is correct: the blocks
/// that it skips do not change the value.
fn guarded_spheres(
    r: &mut Random,
    pool: &mut PoolBuilder,
    code: &mut Vec<Instruction>,
    points: usize,
    level: usize,
) -> [[f32; 2]; 3] {
    let guard_index = code.len();
    code.push(Instruction::new(Opcode::Guard));
    let smooth = r.chance(50);
    let mut hull = [[f32::INFINITY, f32::NEG_INFINITY]; 3];
    for _ in 0..1 + r.below(3) {
        if level < 3 && r.chance(25) {
            let inner_hull = guarded_spheres(r, pool, code, points, level + 1);
            for (extent, [low, high]) in hull.iter_mut().zip(inner_hull) {
                *extent = [extent[0].min(low), extent[1].max(high)];
            }
            continue;
        }
        let mut sphere = Instruction::new(Opcode::Op(Op::Sphere));
        let radius = 0.1 + r.below(900) as f32 / 1000.0;
        let centre: [f32; 3] = std::array::from_fn(|_| r.number());
        sphere.parameters = pool.add(&[radius.into()]);
        sphere.transform = PointTransform::Translate(pool.add(&centre.map(PoolNumber::from)));
        let kernel = if smooth {
            BlendKernel::Quadratic
        } else {
            BlendKernel::Hard
        };
        let list = [1.0, 1.0, 0.5, 0.5].map(PoolNumber::from);
        sphere.destination = Destination::Blend {
            kernel,
            index: pool.add(&list),
        };
        // The mirrored point is saved for this sphere only, so the sphere has two copies.
        let mirrors = points + level < MAX_STACK_POINTS && r.chance(25);
        if mirrors {
            code.push(Instruction {
                push: true,
                parameters: pool.add(&[1.0.into(), 1.0.into(), 1.0.into()]),
                ..Instruction::new(Opcode::Op(Op::Mirror))
            });
        }
        code.push(sphere);
        if mirrors {
            code.push(Instruction {
                pops: 1,
                ..Instruction::new(Opcode::Top)
            });
        }
        for (extent, centre) in hull.iter_mut().zip(centre) {
            let bounds = if mirrors {
                [-centre.abs() - radius, centre.abs() + radius]
            } else {
                [-centre - radius, -centre + radius]
            };
            *extent = [extent[0].min(bounds[0]), extent[1].max(bounds[1])];
        }
    }
    let centre = hull.map(|[low, high]| (low + high) / 2.0);
    let half = hull.map(|[low, high]| (high - low) / 2.0 + 0.01);
    // The blends inside may be smooth, also those of nested guards.
    let volume = [
        centre[0], centre[1], centre[2], 0.5, half[0], half[1], half[2], 1.0,
    ];
    let parameters = pool.add(&volume.map(PoolNumber::from));
    code[guard_index].parameters = parameters;
    code[guard_index].skips = (code.len() - guard_index - 1) as u32;
    hull
}

/// Returns 64 points in the cube from −2 to 2.
pub fn points(seed: u64) -> [F32x64; 3] {
    let mut r = Random::new(seed);
    std::array::from_fn(|_| F32x64(std::array::from_fn(|_| r.number())))
}

/// Concatenates programs into one that unites their results.
///
/// It has the kernel requirements of each of them.
pub fn concatenated(programs: &[Program]) -> Program {
    let mut combined = Program {
        code: Vec::new(),
        // The first constant turns a blend of two values into a hard union.
        pool: vec![[1.0, 1.0, 0.0, 0.0]],
        patches: Vec::new(),
        slots: 0,
    };
    for program in programs {
        let offset = combined.pool.len() as u32;
        let mut points = 0;
        for instruction in &program.code {
            points = points - instruction.pops + u8::from(instruction.push);
            combined.code.push(with_pool_offset(*instruction, offset));
        }
        // Returns to the initial point, if the program saved points.
        let destination = match combined.code.len() > program.code.len() {
            true => Destination::Blend {
                kernel: BlendKernel::Hard,
                index: 0,
            },
            false => Destination::Push,
        };
        combined.code.push(Instruction {
            pops: points,
            destination,
            ..Instruction::new(Opcode::Top)
        });
        combined.pool.extend(&program.pool);
        combined.slots = combined.slots.max(program.slots);
    }
    combined
}

/// Returns an instruction with its pool indices moved by an offset.
fn with_pool_offset(instruction: Instruction, offset: u32) -> Instruction {
    Instruction {
        parameters: if instruction.code.pool_width() > 0 {
            instruction.parameters + offset
        } else {
            0
        },
        transform: match instruction.transform {
            PointTransform::Identity => PointTransform::Identity,
            PointTransform::Translate(index) => PointTransform::Translate(index + offset),
            PointTransform::Affine(index) => PointTransform::Affine(index + offset),
        },
        operands: match instruction.operands {
            Operands::Stack => Operands::Stack,
            Operands::Left(index) => Operands::Left(index + offset),
            Operands::Right(index) => Operands::Right(index + offset),
        },
        destination: match instruction.destination {
            Destination::Push => Destination::Push,
            Destination::Blend { kernel, index } => Destination::Blend {
                kernel,
                index: index + offset,
            },
        },
        ..instruction
    }
}
