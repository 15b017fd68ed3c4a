//! Numbers that jump, with their jumps held: each operation that jumps keeps the whole value or the choice that it has
//! at some point, or takes that of a neighbour, and is smooth beyond. A slope found so bounds every piece of the
//! number, as far as the neighbouring pieces reach.

use super::Step;
use super::relative::is_flat;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Vector3;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

type Number = Dual<Interval>;

/// The result of a step with its jumps held, or the one given where it has none.
pub(super) fn held(step: &Step<Number>, before: &[Number], value: Number) -> Number {
    let Step::Apply { op, values, .. } = step else {
        return value;
    };
    let operand = |at: usize| before[values[at]];
    let fixed = |lo: f64, hi: f64| Number::fixed(Interval { lo, hi });
    match op {
        Op::Floor | Op::Ceil | Op::Round | Op::Trunc => {
            fixed(value.value.lo - 1.0, value.value.hi + 1.0)
        }
        Op::Fract => Number {
            value: Interval { lo: -1.0, hi: 2.0 },
            gradient: operand(0).gradient,
        },
        Op::Modulo if is_flat(&operand(1)) => {
            let most = operand(1).value.magnitude();
            Number {
                value: Interval {
                    lo: -2.0 * most,
                    hi: 2.0 * most,
                },
                gradient: operand(0).gradient,
            }
        }
        Op::Less | Op::Step => fixed(0.0, 1.0),
        Op::Sign => fixed(-1.0, 1.0),
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

/// The range around two.
fn hull(a: Interval, b: Interval) -> Interval {
    Interval {
        lo: a.lo.min(b.lo),
        hi: a.hi.max(b.hi),
    }
}
