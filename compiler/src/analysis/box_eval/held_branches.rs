//! Numbers with discontinuities, with their branches held. Each discontinuous operation keeps the integer or
//! the choice that it has at one point, and is smooth beyond. A slope bound of the result holds for every
//! piece of the number. Floors, fractions, remainders, comparisons and angles are held. Other discontinuous
//! operations are expressed by them (`slope/discontinuities.rs`).

use super::BoxStep;
use super::relative::is_flat;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::{Real, lit};
use sdfc_vm::table::Op;

type HeldNumber = Dual<Interval>;

/// Extent of the pieces that are evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HeldBranches {
    /// Each piece within its own region.
    OwnPiece,
    /// Each piece also within the regions of its neighbours.
    WithNeighbours,
}

/// Returns the result of a step with its discontinuities held, or `value` where it has none.
pub(super) fn hold_branches(
    step: &BoxStep<HeldNumber>,
    previous: &[HeldNumber],
    value: HeldNumber,
    held: HeldBranches,
) -> HeldNumber {
    let BoxStep::Apply { op, values, .. } = step else {
        return value;
    };
    let operand = |index: usize| previous[values[index]];
    let extra = if held == HeldBranches::WithNeighbours {
        1.0
    } else {
        0.0
    };
    let extended = |range: Interval| grown_by(range, extra);
    match op {
        Op::Floor => HeldNumber::fixed(extended(value.value)),
        Op::Less if held == HeldBranches::OwnPiece => HeldNumber::fixed(value.value),
        Op::Less => HeldNumber::fixed(Interval { lo: 0.0, hi: 1.0 }),
        Op::Fract => HeldNumber {
            value: extended(operand(0).value.fract()),
            gradient: operand(0).gradient,
        },
        Op::Modulo if is_flat(&operand(1)) => HeldNumber {
            value: remainder(operand(1).value, extra),
            gradient: operand(0).gradient,
        },
        Op::Atan2 => HeldNumber {
            value: grown_by(value.value, extra * std::f64::consts::TAU),
            gradient: operand(0).atan2(operand(1)).gradient,
        },
        Op::Select if is_flat(&operand(0)) => {
            let condition = lit::<HeldNumber>(0.5).less(operand(0));
            HeldNumber::select(condition, operand(1), operand(2))
        }
        _ => value,
    }
}

fn grown_by(range: Interval, extra: f64) -> Interval {
    Interval {
        lo: range.lo - extra,
        hi: range.hi + extra,
    }
}

/// Returns the range of remainders of divisions by numbers in a range, extended by `extra_divisors` divisors.
fn remainder(divisor: Interval, extra_divisors: f64) -> Interval {
    let extra = divisor.magnitude() * extra_divisors;
    Interval {
        lo: divisor.lo.min(0.0) - extra,
        hi: divisor.hi.max(0.0) + extra,
    }
}
