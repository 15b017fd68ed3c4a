//! Evaluation of a program at one point, for any number type: the semantics of programs in its shortest
//! form. Tests and proofs use it (`f64`, intervals, duals); rendering uses [`crate::tape`].
//!
//! The program must be verified ([`crate::verify`]).

use crate::apply::{Apply, OpResult, apply};
use crate::dual::{Dual, DualVec3};
use crate::guard::influence_margin_sq;
use crate::program::{Destination, Instruction, Opcode, Operands, PointTransform, Program};
use crate::real::{Real, Vector3};
use crate::vector::V3;

/// Returns the value of the program at a point.
pub fn evaluate<R: Apply>(program: &Program, point: R::Vec3) -> R {
    let mut stack: Vec<R> = Vec::with_capacity(8);
    let mut points: Vec<R::Vec3> = Vec::new();
    let mut slots = vec![R::constant(0.0); program.slots as usize];
    let mut p = point;
    let mut next = 0;
    while let Some(i) = program.code.get(next) {
        next += 1;
        for _ in 0..i.pops {
            p = points.pop().unwrap_or(p);
        }
        if i.push {
            points.push(p);
        }
        let q = transformed::<R>(program, i, p);
        let result = match i.code {
            Opcode::Op(op) => {
                let constants = constants(program, i);
                match apply::<R>(op, q, operands(program, i, &mut stack), constants) {
                    OpResult::Value(v) => v,
                    OpResult::Point(to) => {
                        p = to;
                        continue;
                    }
                }
            }
            Opcode::Load => slots[usize::from(i.slot)],
            Opcode::Store => {
                let top = pop(&mut stack);
                slots[usize::from(i.slot)] = top;
                top
            }
            Opcode::Top => pop(&mut stack),
            // Surfaces are evaluated by `crate::surface`.
            Opcode::Normal => R::constant(0.0),
            Opcode::Channel => {
                pop(&mut stack);
                continue;
            }
            Opcode::Paint => pop(&mut stack),
            Opcode::Guard => {
                let top = stack.last().copied().unwrap_or(R::constant(0.0));
                if may_skip(constants(program, i), q, top) {
                    next += i.skips as usize;
                }
                continue;
            }
        };
        let result = match i.destination {
            Destination::Push => result,
            Destination::Blend { kernel, index } => {
                let below = pop(&mut stack);
                let [s, sb, width, coefficient] =
                    program.pool[index as usize].map(|v| R::constant(v.into()));
                R::convex_blend(below, result, |below, result| {
                    kernel.blend(below, result, s, sb, width, coefficient)
                })
            }
        };
        stack.push(result);
    }
    pop(&mut stack)
}

/// Reports whether a guard with these parameters certainly allows its block to be skipped.
fn may_skip<R: Real>(k: &[f32], q: R::Vec3, top: R) -> bool {
    let number = |i: usize| R::constant(k[i].into());
    let vector = |i: usize| R::Vec3::new(number(i), number(i + 1), number(i + 2));
    let excess = influence_margin_sq::<R>(q, top, vector(0), number(3), vector(4), number(7));
    R::is_certain(R::constant(0.0).less(excess))
}

/// Returns the value and its gradient.
pub fn gradient<R: Real>(program: &Program, point: R::Vec3) -> Dual<R>
where
    Dual<R>: Apply + Real<Vec3 = DualVec3<R>>,
{
    evaluate::<Dual<R>>(program, DualVec3::seed(point))
}

/// Returns the value at a point given in `f64`.
pub fn evaluate_f64(program: &Program, [x, y, z]: [f64; 3]) -> f64 {
    evaluate::<f64>(program, V3::new(x, y, z))
}

/// Pops a value. A verified program never pops more than it pushed; the zero is unreachable.
fn pop<R: Real>(stack: &mut Vec<R>) -> R {
    stack.pop().unwrap_or(R::constant(0.0))
}

/// Returns the parameters of an instruction's operation.
pub(crate) fn constants<'a>(program: &'a Program, i: &Instruction) -> &'a [f32] {
    let start = i.parameters as usize;
    program.pool[start..start + i.code.pool_width()].as_flattened()
}

fn operands<R: Real>(program: &Program, i: &Instruction, stack: &mut Vec<R>) -> [R; 3] {
    let mut operands = [R::constant(0.0); 3];
    let constant = |index: u32| R::constant(program.pool[index as usize][0].into());
    match i.operands {
        Operands::Stack => {
            for slot in operands[..i.code.arity()].iter_mut().rev() {
                *slot = pop(stack);
            }
        }
        Operands::Right(index) => operands = [pop(stack), constant(index), constant(index)],
        Operands::Left(index) => operands = [constant(index), pop(stack), constant(index)],
    }
    operands
}

/// Returns the point of evaluation of an instruction.
pub(crate) fn transformed<R: Real>(program: &Program, i: &Instruction, p: R::Vec3) -> R::Vec3 {
    let row = |index: u32| program.pool[index as usize].map(|v| R::constant(v.into()));
    match i.transform {
        PointTransform::Identity => p,
        PointTransform::Translate(index) => {
            let [x, y, z, _] = row(index);
            p + R::Vec3::new(x, y, z)
        }
        PointTransform::Affine(index) => {
            apply_affine::<R>([row(index), row(index + 1), row(index + 2)], p)
        }
    }
}

/// Maps a point by a 3×4 matrix, summed in the order of the columns.
#[inline(always)]
pub fn apply_affine<R: Real>(rows: [[R; 4]; 3], p: R::Vec3) -> R::Vec3 {
    R::Vec3::new(
        row_product::<R>(rows[0], p),
        row_product::<R>(rows[1], p),
        row_product::<R>(rows[2], p),
    )
}

/// Returns the product of a row of a matrix with a point.
#[inline(always)]
fn row_product<R: Real>([a, b, c, d]: [R; 4], p: R::Vec3) -> R {
    p.x() * a + p.y() * b + p.z() * c + d
}
