//! Choices by `and`, `or` and `not`, whose operands are true where they are not zero.
//!
//! Fidget has no selection: `or(and(c, a), and(not(c), b))` is one. It is read as such, so that no discontinuity is
//! suspected where `a` is zero.

use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// Number of points at which a number is tested for zero, and half sides of the cubes that contain them.
const POINTS: u32 = 64;
const HALF_SIDES: [f64; 4] = [0.3, 1.0, 3.0, 10.0];
/// Maximum number of operations for the tests of one file.
const MAX_OPERATIONS: usize = 20_000_000;

/// Reads choices of a file.
pub(super) struct TruthReader {
    remaining_operations: usize,
}

impl Default for TruthReader {
    fn default() -> Self {
        Self {
            remaining_operations: MAX_OPERATIONS,
        }
    }
}

impl TruthReader {
    /// Returns the second operand where both are not zero, else zero.
    pub(super) fn and(&mut self, e: &mut Expressions, a: ExprId, b: ExprId) -> ExprId {
        if is_condition(e, a) && is_condition(e, b) {
            return e.call(Op::And, &[a, b]);
        }
        let condition = self.truth(e, a);
        let zero = e.constant(0.0);
        select(e, condition, b, zero)
    }

    /// Returns the first operand that is not zero, else zero.
    pub(super) fn or(&mut self, e: &mut Expressions, a: ExprId, b: ExprId) -> ExprId {
        if is_condition(e, a) && is_condition(e, b) {
            return e.call(Op::Or, &[a, b]);
        }
        let condition = self.truth(e, a);
        // Where the condition holds, so do those within the operands.
        let then = match chosen_or_zero(e, a) {
            Some((chosen_if, chosen)) if chosen_if == condition => chosen,
            _ => a,
        };
        let negated = e.call(Op::Not, &[condition]);
        let otherwise = match chosen_or_zero(e, b) {
            Some((chosen_if, chosen)) if chosen_if == negated => chosen,
            _ => b,
        };
        select(e, condition, then, otherwise)
    }

    /// Returns the condition that a number is zero.
    pub(super) fn not(&mut self, e: &mut Expressions, a: ExprId) -> ExprId {
        let condition = self.truth(e, a);
        e.call(Op::Not, &[condition])
    }

    /// Returns the condition that a number is not zero, up to sets without a volume. On these, `f32` decides.
    fn truth(&mut self, e: &mut Expressions, value: ExprId) -> ExprId {
        if is_condition(e, value) {
            return value;
        }
        if let Some(constant) = e.as_constant(value) {
            return e.constant(f64::from(u8::from(constant != 0.0)));
        }
        if let Some((condition, chosen)) = chosen_or_zero(e, value) {
            let chosen = self.truth(e, chosen);
            return match e.as_constant(chosen) {
                Some(constant) if constant != 0.0 => condition,
                _ => e.call(Op::And, &[condition, chosen]),
            };
        }
        if self.is_zero_nowhere(e, value) {
            return e.constant(1.0);
        }
        let zero = e.constant(0.0);
        let size = e.call(Op::Abs, &[value]);
        e.call(Op::Less, &[zero, size])
    }

    /// Reports whether a number is zero at none of many points.
    fn is_zero_nowhere(&mut self, e: &Expressions, value: ExprId) -> bool {
        let mut uniform = |id| {
            let constant = e.as_constant(id);
            UniformInput::Known(constant.map_or(Interval::ALL, Interval::point))
        };
        let mut number = BoxNumber::<Interval>::new(e, value, &mut uniform);
        let cost = number.cost() * POINTS as usize * HALF_SIDES.len();
        if cost > self.remaining_operations {
            return false;
        }
        self.remaining_operations -= cost;
        HALF_SIDES.iter().all(|&half_side| {
            let cube = Bounds::centred([half_side; 3]);
            (1..=POINTS).all(|index| {
                let p = cube.quasi_random_point(index);
                let range = number.eval(&Bounds { min: p, max: p }, &[]);
                range.lo > 0.0 || range.hi < 0.0
            })
        })
    }
}

/// Returns the larger one of two numbers. That of a comparison and zero is the condition itself.
pub(super) fn larger(e: &mut Expressions, a: ExprId, b: ExprId) -> ExprId {
    for (comparison, other) in [(a, b), (b, a)] {
        if e.as_constant(other) == Some(0.0)
            && let Some([more, less]) = operands(e, comparison, Op::Sub)
            && let (Some([x, y]), Some([u, v])) =
                (operands(e, more, Op::Less), operands(e, less, Op::Less))
            && (x, y) == (v, u)
        {
            return more;
        }
    }
    e.call(Op::Intersection, &[a, b])
}

/// Returns the two operands of an operation, if a number is one.
fn operands(e: &Expressions, id: ExprId, wanted: Op) -> Option<[ExprId; 2]> {
    match e.get(id) {
        Expression::Apply { op, values, .. } if *op == wanted => values.as_slice().try_into().ok(),
        _ => None,
    }
}

/// Reports whether a number is 1 or 0.
fn is_condition(e: &Expressions, id: ExprId) -> bool {
    matches!(
        e.get(id),
        Expression::Apply {
            op: Op::Less | Op::Not | Op::And | Op::Or,
            ..
        }
    )
}

/// Returns the condition and the number of a selection of it or zero.
fn chosen_or_zero(e: &Expressions, id: ExprId) -> Option<(ExprId, ExprId)> {
    match e.get(id) {
        Expression::Apply {
            op: Op::Select,
            values,
            ..
        } => match values.as_slice() {
            &[condition, chosen, other] if e.as_constant(other) == Some(0.0) => {
                Some((condition, chosen))
            }
            _ => None,
        },
        _ => None,
    }
}

fn select(e: &mut Expressions, condition: ExprId, then: ExprId, otherwise: ExprId) -> ExprId {
    match e.as_constant(condition) {
        Some(0.0) => otherwise,
        Some(_) => then,
        None => e.call(Op::Select, &[condition, then, otherwise]),
    }
}
