//! Numbers that jump, with their jumps held: each operation that jumps keeps the whole value or the choice that it has
//! at some point, and is smooth beyond. A slope found so bounds every piece of the number. Floors, fractions,
//! remainders, comparisons and angles are held; what else jumps is written by them (`slope/jumps.rs`).

use super::Step;
use super::relative::is_flat;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::{Real, lit};
use sdfc_vm::table::Op;

type Number = Dual<Interval>;

/// The extent of the pieces that are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Held {
    /// Each piece where it is.
    Own,
    /// Each piece where the pieces beside it are, too.
    Beside,
}

/// The result of a step with its jumps held, or the one given where it has none.
pub(super) fn held(step: &Step<Number>, before: &[Number], value: Number, held: Held) -> Number {
    let Step::Apply { op, values, .. } = step else {
        return value;
    };
    let operand = |at: usize| before[values[at]];
    let more = if held == Held::Beside { 1.0 } else { 0.0 };
    let grown = |range: Interval| grown_by(range, more);
    match op {
        Op::Floor => Number::fixed(grown(value.value)),
        Op::Less if held == Held::Own => Number::fixed(value.value),
        Op::Less => Number::fixed(Interval { lo: 0.0, hi: 1.0 }),
        Op::Fract => Number {
            value: grown(operand(0).value.fract()),
            gradient: operand(0).gradient,
        },
        Op::Modulo if is_flat(&operand(1)) => Number {
            value: remainder(operand(1).value, more),
            gradient: operand(0).gradient,
        },
        Op::Atan2 => Number {
            value: grown_by(value.value, more * std::f64::consts::TAU),
            gradient: operand(0).atan2(operand(1)).gradient,
        },
        Op::Select if is_flat(&operand(0)) => {
            let condition = lit::<Number>(0.5).less(operand(0));
            Number::select(condition, operand(1), operand(2))
        }
        _ => value,
    }
}

fn grown_by(range: Interval, more: f64) -> Interval {
    Interval {
        lo: range.lo - more,
        hi: range.hi + more,
    }
}

/// All remainders of divisions by numbers in a range, as far as `more` divisors beyond.
fn remainder(divisor: Interval, more: f64) -> Interval {
    let most = divisor.magnitude() * more;
    Interval {
        lo: divisor.lo.min(0.0) - most,
        hi: divisor.hi.max(0.0) + most,
    }
}
