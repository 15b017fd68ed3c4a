//! Discontinuous operations of a number, and the surfaces on which they are discontinuous.

use super::local_bound::{LocalBound, local_bound};
use super::region_bounds::RegionBounds;
use crate::analysis::box_eval::HeldBranches;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::uniforms::{postorder, rewrite_number};
use sdfc_vm::row::Continuity;
use sdfc_vm::table::Op;

/// Surface on which operations of a field are discontinuous.
pub(super) struct Discontinuity {
    /// Number that defines the surface.
    pub(super) number: ExprId,
    pub(super) surface: JumpSurface,
    pub(super) operations: Vec<ExprId>,
    /// Bound of the number's slope.
    pub(super) slope: LocalBound,
}

/// Surface of a discontinuity, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JumpSurface {
    /// Integer values of the number: many surfaces.
    Integers,
    /// Zeros of the number.
    Zeros,
    /// Zeros of the number at which another number is negative: the branch cut of an angle.
    BranchCut(ExprId),
}

/// Slope bounds by which the surfaces of discontinuities are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum SlopeScope {
    /// Bounds that hold in all of a region.
    Region,
    /// These, and bounds around each point for numbers that have none.
    PerPoint,
}

/// Reports whether a number has discontinuous operations.
pub(crate) fn has_discontinuities(expressions: &Expressions, number: ExprId) -> bool {
    let operands = postorder(expressions, number, |_| false);
    operands
        .into_iter()
        .any(|id| is_discontinuous(expressions, id))
}

/// Reports whether an operation is discontinuous at points where its operand is continuous.
fn is_discontinuous(expressions: &Expressions, id: ExprId) -> bool {
    let Expression::Apply { op, .. } = expressions.get(id) else {
        return false;
    };
    op.row().facts.continuity == Continuity::Jumps && expressions.stage(id) > Stage::Uniform
}

/// Rewrites a number so that floors, fractions, remainders, comparisons and angles are its only
/// discontinuous operations. Its values stay the same except on the discontinuities, where these are
/// surfaces only: there it takes the value of one side.
pub(super) fn one_sided(
    expressions: &mut Expressions,
    number: ExprId,
    region_bounds: &RegionBounds,
) -> ExprId {
    rewrite_number(expressions, number, |e, id, written, values| {
        match e.get(id) {
            &Expression::Apply { op, .. } if e.stage(id) > Stage::Uniform => {
                one_sided_operation(e, op, values, region_bounds).unwrap_or(written)
            }
            _ => written,
        }
    })
}

/// Returns an operation written by the remaining discontinuous ones.
fn one_sided_operation(
    e: &mut Expressions,
    op: Op,
    values: &[ExprId],
    region_bounds: &RegionBounds,
) -> Option<ExprId> {
    let [zero, half, one, two] = [0.0, 0.5, 1.0, 2.0].map(|value| e.constant(value));
    Some(match (op, values) {
        (Op::Sign, &[a]) if region_bounds.is_nowhere_flat(e, a) => {
            let is_below = e.call(Op::Less, &[a, zero]);
            let twice = e.call(Op::Mul, &[is_below, two]);
            e.call(Op::Sub, &[one, twice])
        }
        (Op::Sign, &[a]) => {
            let is_above = e.call(Op::Less, &[zero, a]);
            let is_below = e.call(Op::Less, &[a, zero]);
            e.call(Op::Sub, &[is_above, is_below])
        }
        (Op::Step, &[edge, a]) => {
            let is_below = e.call(Op::Less, &[a, edge]);
            e.call(Op::Sub, &[one, is_below])
        }
        (Op::Floor, &[a]) => {
            let opposite = negated_operand(e, a)?;
            if !region_bounds.is_nowhere_flat(e, opposite) {
                return None;
            }
            let ceil = one_sided_operation(e, Op::Ceil, &[opposite], region_bounds)?;
            e.call(Op::Neg, &[ceil])
        }
        (Op::Ceil, &[a]) => match negated_operand(e, a) {
            Some(opposite) => {
                let floor = e.call(Op::Floor, &[opposite]);
                e.call(Op::Neg, &[floor])
            }
            None if region_bounds.is_nowhere_flat(e, a) => {
                let floor = e.call(Op::Floor, &[a]);
                e.call(Op::Add, &[floor, one])
            }
            None => {
                let opposite = e.call(Op::Neg, &[a]);
                let floor = e.call(Op::Floor, &[opposite]);
                e.call(Op::Neg, &[floor])
            }
        },
        (Op::Round, &[a]) => {
            let shifted = e.call(Op::Add, &[a, half]);
            e.call(Op::Floor, &[shifted])
        }
        (Op::Trunc, &[a]) => {
            let size = e.call(Op::Abs, &[a]);
            let floor = e.call(Op::Floor, &[size]);
            let size = e.call(Op::Max, &[zero, floor]);
            let sign = one_sided_operation(e, Op::Sign, &[a], region_bounds)?;
            e.call(Op::Mul, &[sign, size])
        }
        _ => return None,
    })
}

/// Returns `a` where a number is `−a`.
fn negated_operand(expressions: &Expressions, id: ExprId) -> Option<ExprId> {
    Some(expressions.operands_of(id, Op::Neg)?[0])
}

/// Returns the discontinuities of a number, or `None` where the surface of one is unknown. An operation
/// that is discontinuous only where another one is does not count.
pub(super) fn discontinuities(
    expressions: &mut Expressions,
    number: ExprId,
    scope: SlopeScope,
    region_bounds: &mut RegionBounds,
) -> Option<Vec<Discontinuity>> {
    let mut result: Vec<Discontinuity> = Vec::new();
    for id in postorder(expressions, number, |_| false) {
        if !is_discontinuous(expressions, id) {
            continue;
        }
        let Expression::Apply { op, values, .. } = expressions.get(id).clone() else {
            continue;
        };
        let (operand, surface) = match (op, values.as_slice()) {
            (Op::Less, &[a, b]) => (expressions.call(Op::Sub, &[a, b]), JumpSurface::Zeros),
            (Op::Modulo, &[a, b]) => (expressions.call(Op::Div, &[a, b]), JumpSurface::Integers),
            (Op::Atan2, &[_, x]) if region_bounds.is_positive(expressions, x) => continue,
            (Op::Atan2, &[y, x]) => (y, JumpSurface::BranchCut(x)),
            (_, &[a]) => (a, JumpSurface::Integers),
            _ => return None,
        };
        let number = canonical_surface_number(expressions, operand, surface);
        let known_jump = result
            .iter_mut()
            .find(|jump| jump.number == number && jump.surface == surface);
        if let Some(jump) = known_jump {
            jump.operations.push(id);
            continue;
        }
        let slope = match (surface, scope) {
            (JumpSurface::BranchCut(x), _) => {
                let slope =
                    region_bounds.slope(expressions, &[number, x], HeldBranches::OwnPiece)?;
                LocalBound::everywhere(expressions, slope)
            }
            (_, SlopeScope::Region) => {
                let slope = region_bounds.slope(expressions, &[number], HeldBranches::OwnPiece)?;
                LocalBound::everywhere(expressions, slope)
            }
            (_, SlopeScope::PerPoint) => {
                local_bound(expressions, number, HeldBranches::OwnPiece, region_bounds)?
            }
        };
        if !slope.is_zero(expressions) {
            result.push(Discontinuity {
                number,
                surface,
                operations: vec![id],
                slope,
            });
        }
    }
    Some(result)
}

/// Returns one number for all that have the same integer surfaces and the same steps: integer summands
/// are left out.
fn canonical_surface_number(e: &Expressions, mut number: ExprId, surface: JumpSurface) -> ExprId {
    let is_integer = |id: ExprId| e.as_constant(id).is_some_and(|v| v.fract() == 0.0);
    while surface == JumpSurface::Integers
        && let Expression::Apply { op, values, .. } = e.get(number)
    {
        number = match (op, values.as_slice()) {
            (Op::Add | Op::Sub, &[a, b]) if is_integer(b) => a,
            (Op::Add, &[a, b]) if is_integer(a) => b,
            _ => break,
        };
    }
    number
}
