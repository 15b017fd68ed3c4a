//! Lipschitz bounds of the values of a program, from the rules in the rows of the table. With them, one
//! evaluation at the centre of a box decides its choices.
//!
//! Only values that are continuous everywhere have a bound here. Repetition folds space with
//! discontinuities, and the bound of a raw field may come from its author. Programs with such a value are
//! pruned by intervals.

use super::Clause;
use super::build::UNASSIGNED;
use crate::program::{Destination, Instruction, Opcode, Operands, PointTransform, Program};
use crate::row::{Category, Continuity, SlopeRule};
use crate::table::Op;
use glam::{DVec3, Vec3};

/// Lipschitz bounds of the operands of each choice, by instruction, and of the result; infinite where
/// unknown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LipschitzBounds {
    /// For each instruction, the bounds of the first and the second operand of its blend.
    pub choices: Vec<[f32; 2]>,
    /// The bound of the program's result.
    pub result: f32,
}

impl LipschitzBounds {
    /// Reports whether the result is bounded, as Lipschitz pruning requires.
    pub fn is_bounded(&self) -> bool {
        self.result < f32::INFINITY
    }

    /// Computes the bounds of a program whose clauses use `values` value registers and `points` point
    /// registers, with the result in register 0.
    pub(super) fn new(
        program: &Program,
        clauses: &[Clause<u32>],
        values: usize,
        points: usize,
    ) -> Self {
        let mut bounds = vec![0.0_f64; values.max(1)];
        // Largest stretch of space from the world to each point.
        let mut stretch = vec![1.0_f64; points.max(1)];
        let mut choices = vec![[f32::INFINITY; 2]; program.code.len()];
        for clause in clauses {
            let i = &program.code[clause.instruction as usize];
            let register_bound =
                |register: u32| bounds.get(register as usize).copied().unwrap_or(0.0);
            let operand_bounds = clause.operands.map(register_bound);
            let point_stretch = stretch.get(clause.point as usize).copied().unwrap_or(1.0)
                * transform_stretch(program, i);
            let bound = match i.code {
                Opcode::Op(op) => op_bound(program, i, op, operand_bounds, point_stretch),
                Opcode::Load | Opcode::Store | Opcode::Top | Opcode::Paint => operand_bounds[0],
                Opcode::Normal | Opcode::Channel | Opcode::Guard => f64::INFINITY,
            };
            if i.code.returns_point() {
                stretch[clause.dst as usize] = bound;
                continue;
            }
            if clause.dst == UNASSIGNED {
                continue;
            }
            let pair = match i.destination {
                Destination::Blend { .. } => [register_bound(clause.accumulator), bound],
                Destination::Push => [operand_bounds[0], operand_bounds[1]],
            };
            choices[clause.instruction as usize] = pair.map(round_up);
            bounds[clause.dst as usize] = match i.destination {
                Destination::Blend { .. } => pair[0].max(pair[1]),
                Destination::Push => bound,
            };
        }
        Self {
            choices,
            result: round_up(bounds[0]),
        }
    }
}

/// Converts to `f32`, rounding up.
fn round_up(bound: f64) -> f32 {
    if bound < 1e30 {
        (bound as f32) * (1.0 + 1e-6)
    } else {
        f32::INFINITY
    }
}

/// Returns an upper bound of the stretch of a point transform: the root of the largest row sum of its
/// matrix times its own transpose. The bound is exact for a rotation with a uniform scale.
fn transform_stretch(program: &Program, i: &Instruction) -> f64 {
    let PointTransform::Affine(index) = i.transform else {
        return 1.0;
    };
    let rows: [DVec3; 3] = std::array::from_fn(|row| {
        let [x, y, z, _] = program.pool[index as usize + row];
        Vec3::new(x, y, z).as_dvec3()
    });
    let sums = rows
        .iter()
        .map(|a| rows.iter().map(|b| a.dot(*b).abs()).sum::<f64>());
    sums.fold(0.0, f64::max).sqrt()
}

/// Returns the Lipschitz bound of an operation's value, or the stretch of its point.
fn op_bound(program: &Program, i: &Instruction, op: Op, operands: [f64; 3], stretch: f64) -> f64 {
    let row = op.row();
    let numbers = || -> Vec<f64> {
        let pool = program.pool[i.parameters as usize..].as_flattened();
        let parameters = row.parameters.iter().zip(row.offsets());
        parameters
            .flat_map(|(parameter, offset)| &pool[offset..offset + parameter.ty.width()])
            .map(|&v| f64::from(v))
            .collect()
    };
    // A constant operand has the bound 0 and counts as one of the two.
    debug_assert!(i.operands == Operands::Stack || row.arity() == 2);
    match row.facts.slope {
        // Repeated and raw fields: see the module documentation.
        SlopeRule::Fold if row.facts.continuity == Continuity::Jumps => f64::INFINITY,
        _ if op.is_raw_distance() || row.facts.category == Category::Math && !is_coordinate(op) => {
            f64::INFINITY
        }
        // The value jumps, although steps by it are safe.
        SlopeRule::Step => f64::INFINITY,
        rule => rule.bound(&operands, stretch, |rule| rule(&numbers())),
    }
}

/// Reports whether an instruction divides a raw field by a bound of its slope.
pub fn divides_raw(i: &Instruction) -> bool {
    matches!(i.code, Opcode::Op(op) if op.is_raw_distance())
}

/// Reports whether an instruction's value may be discontinuous.
///
/// A repetition jumps from one copy's frame to the next. The minimum over neighbouring copies that
/// follows it does not.
pub fn may_be_discontinuous(i: &Instruction) -> bool {
    let Opcode::Op(op) = i.code else { return false };
    match op.row().facts.continuity {
        _ if i.code.returns_point() => false,
        Continuity::Continuous => false,
        // A division by a constant has no pole.
        Continuity::HasPoles => !matches!(i.operands, Operands::Right(_)),
        Continuity::Jumps | Continuity::Selects => true,
    }
}

/// Reports whether an operation is a coordinate or a constant, whose bounds are those of their rows.
fn is_coordinate(op: Op) -> bool {
    matches!(op, Op::X | Op::Y | Op::Z | Op::Constant)
}
