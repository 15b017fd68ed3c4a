//! How steep each value of a program is, where the rows of the table say it: what decides choices by
//! a single evaluation at the middle of a box.
//!
//! Only what is continuous everywhere has a slope here. Repetition folds space with seams, and raw
//! fields have a bound that their author may have given; with such a value in it, a program is
//! pruned by intervals instead.

use super::Clause;
use super::build::NOWHERE;
use crate::program::{Code, Frame, Instruction, Operands, Place, Program};
use crate::row::{Category, Slope};
use crate::table::Op;

/// The slopes of what each choice is between, by instruction, and of the result; infinite where
/// nothing is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Slopes {
    /// For each instruction, the slopes of the first and the second of what it blends.
    pub choices: Vec<[f32; 2]>,
    /// The slope of the whole program.
    pub whole: f32,
}

impl Slopes {
    /// Whether all that it takes to prune by slopes is known.
    pub fn known(&self) -> bool {
        self.whole < f32::INFINITY
    }

    /// The slopes of a program whose clauses name so many values and points, the result in
    /// register 0.
    pub(super) fn of(
        program: &Program,
        clauses: &[Clause<u32>],
        values: usize,
        points: usize,
    ) -> Self {
        let mut slope = vec![0.0_f64; values.max(1)];
        // How much the way to each point stretches space; the first is the world's.
        let mut stretch = vec![1.0_f64; points.max(1)];
        let mut choices = vec![[f32::INFINITY; 2]; program.code.len()];
        for clause in clauses {
            let i = &program.code[clause.at as usize];
            let of = |register: u32| slope.get(register as usize).copied().unwrap_or(0.0);
            let operands = clause.operands.map(of);
            let at = stretch.get(clause.point as usize).copied().unwrap_or(1.0)
                * frame_stretch(program, i);
            let own = match i.code {
                Code::Op(op) => of_operation(program, i, op, operands, at),
                Code::Load | Code::Store | Code::Take | Code::Paint => operands[0],
                Code::Normal | Code::Channel | Code::Guard => f64::INFINITY,
            };
            if i.code.gives_point() {
                stretch[clause.out as usize] = own;
                continue;
            }
            if clause.out == NOWHERE {
                continue;
            }
            let pair = match i.place {
                Place::Blend { .. } => [of(clause.below), own],
                Place::Push => [operands[0], operands[1]],
            };
            choices[clause.at as usize] = pair.map(upwards);
            slope[clause.out as usize] = match i.place {
                Place::Blend { .. } => pair[0].max(pair[1]),
                Place::Push => own,
            };
        }
        Self {
            choices,
            whole: upwards(slope[0]),
        }
    }
}

/// To `f32`, never less.
fn upwards(slope: f64) -> f32 {
    if slope < 1e30 {
        (slope as f32) * (1.0 + 1e-6)
    } else {
        f32::INFINITY
    }
}

/// How much a frame stretches at most: the root of the largest row sum of its matrix times its own
/// transpose, which is exact for a rotation with a scale.
fn frame_stretch(program: &Program, i: &Instruction) -> f64 {
    let Frame::Mapped(index) = i.frame else {
        return 1.0;
    };
    let rows: [[f64; 3]; 3] = std::array::from_fn(|row| {
        let [x, y, z, _] = program.pool[index as usize + row];
        [x, y, z].map(f64::from)
    });
    let product = |a: usize, b: usize| (0..3).map(|k| rows[a][k] * rows[b][k]).sum::<f64>().abs();
    let sums = (0..3).map(|a| (0..3).map(|b| product(a, b)).sum::<f64>());
    sums.fold(0.0, f64::max).sqrt()
}

/// The slope of an operation's value, or the stretch of its point.
fn of_operation(
    program: &Program,
    i: &Instruction,
    op: Op,
    operands: [f64; 3],
    stretch: f64,
) -> f64 {
    let row = op.row();
    let numbers = || -> Vec<f64> {
        let pool = program.pool[i.parameters as usize..].as_flattened();
        let each = row.parameters.iter().zip(row.offsets());
        each.flat_map(|(parameter, offset)| &pool[offset..offset + parameter.ty.width()])
            .map(|&v| f64::from(v))
            .collect()
    };
    let largest = operands.into_iter().fold(0.0, f64::max);
    // A constant operand has no slope; it stands for one of the two.
    debug_assert!(i.operands == Operands::Stack || row.arity() == 2);
    match row.meta.slope {
        _ if i.code.gives_point() => match op {
            Op::Mirror | Op::Elongate | Op::Revolve | Op::Slice => stretch,
            _ => f64::INFINITY,
        },
        // Repeated and raw fields: see the head of this file.
        _ if is_raw(op) || row.meta.category == Category::Math && !coordinate(op) => f64::INFINITY,
        Slope::Constant(slope) => slope * stretch,
        Slope::Of(slope) => slope(&numbers()) * stretch,
        Slope::Largest(factor) => largest * factor,
        Slope::LargestOrOne => largest.max(stretch),
        Slope::Sum => operands.into_iter().sum(),
        Slope::Norm => operands.into_iter().map(|v| v * v).sum::<f64>().sqrt(),
        Slope::Plus(more) => largest + more(&numbers()) * stretch.max(1.0),
        Slope::Times(factor) => largest * factor(&numbers()),
        Slope::Stretch(_) | Slope::Step | Slope::Unknown => f64::INFINITY,
    }
}

/// Whether an operation makes a distance of a raw field.
pub fn is_raw(op: Op) -> bool {
    matches!(op, Op::FieldDistance | Op::FieldGrowth | Op::Piecewise)
}

/// Reports whether an instruction divides a raw field by a bound of its slope.
pub fn divides_raw(i: &Instruction) -> bool {
    matches!(i.code, Code::Op(op) if is_raw(op))
}

/// Reports whether an instruction's value may jump: where its gradient has no bound, the field may have a step.
///
/// All others, such as polynomials and roots, are continuous however steep they are.
pub fn may_jump(i: &Instruction) -> bool {
    let Code::Op(op) = i.code else { return false };
    match op {
        Op::Sign
        | Op::Floor
        | Op::Ceil
        | Op::Round
        | Op::Fract
        | Op::Trunc
        | Op::Modulo
        | Op::Step
        | Op::Less
        | Op::Select
        | Op::Tan
        | Op::Atan2 => true,
        // By a constant it has no pole.
        Op::Div => !matches!(i.operands, Operands::Right(_)),
        _ => false,
    }
}

/// Whether an operation is a coordinate or a constant, whose slopes are their rows'.
fn coordinate(op: Op) -> bool {
    matches!(op, Op::X | Op::Y | Op::Z | Op::Constant)
}
