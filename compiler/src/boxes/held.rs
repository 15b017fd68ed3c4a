//! Numbers that jump, with their jumps held: each operation that jumps keeps the whole value or the choice that it has
//! at some point, and is smooth beyond. A slope found so bounds every piece of the number.

use super::Step;
use super::relative::is_flat;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

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
    let grown = |range: Interval, by: f64| Interval {
        lo: range.lo - by,
        hi: range.hi + by,
    };
    let choice = |lo: f64, hi: f64| match held {
        Held::Own => Number::fixed(value.value),
        Held::Beside => Number::fixed(Interval { lo, hi }),
    };
    match op {
        Op::Floor | Op::Ceil | Op::Round | Op::Trunc => Number::fixed(grown(value.value, more)),
        Op::Fract => Number {
            value: grown(operand(0).value.fract(), more),
            gradient: operand(0).gradient,
        },
        Op::Modulo if is_flat(&operand(1)) => Number {
            value: remainder(operand(1).value, more),
            gradient: operand(0).gradient,
        },
        Op::Less | Op::Step => choice(0.0, 1.0),
        Op::Sign => choice(-1.0, 1.0),
        Op::Select if is_flat(&operand(0)) => {
            let (a, b) = (operand(1), operand(2));
            match operand(0).value {
                condition if condition.lo > 0.5 => a,
                condition if condition.hi <= 0.5 => b,
                _ => Number {
                    value: hull(a.value, b.value),
                    gradient: V3::of(
                        hull(a.gradient.x(), b.gradient.x()),
                        hull(a.gradient.y(), b.gradient.y()),
                        hull(a.gradient.z(), b.gradient.z()),
                    ),
                },
            }
        }
        _ => value,
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

/// The range around two.
fn hull(a: Interval, b: Interval) -> Interval {
    Interval {
        lo: a.lo.min(b.lo),
        hi: a.hi.max(b.hi),
    }
}
