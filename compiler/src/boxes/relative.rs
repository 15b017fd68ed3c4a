//! Relative gradients: bounds of the gradient of a positive number's logarithm.
//!
//! Exponentials cover many orders of magnitude in a box, so the gradient of a sum of them tells little about
//! that of its logarithm. The relative gradient does: that of an exponential is the gradient of its
//! exponent, and that of a sum is a mean of its operands' relative gradients.

use super::Step;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::f64::consts::{LN_2, LOG2_E};

/// Bounds of a number's gradient divided by the number, which is positive.
pub(crate) type Relative = V3<Interval>;

/// The least argument of a logarithm that is not flat.
const LEAST_LOGARITHM: f64 = 1e-30;
/// The least magnitude of a divisor.
const LEAST_DIVISOR: f64 = 1e-18;

/// The least base of a power.
const LEAST_BASE: f64 = 1e-37;

/// Narrows what a step gave by the relative gradients of its operands, and returns that of the result.
///
/// `None` stands for a number that may be zero or less.
pub(super) fn refine(
    value: &mut Dual<Interval>,
    step: &Step<Dual<Interval>>,
    steps: &[Step<Dual<Interval>>],
    before: &[Dual<Interval>],
    relative: &[Option<Relative>],
) -> Option<Relative> {
    if let Step::Apply { op, values, .. } = step {
        narrow(value, *op, values, before, relative);
        if is_share(*op, values, steps, relative) {
            value.value = common(value.value, Interval { lo: 0.0, hi: 1.0 });
        }
    }
    let ruled = match step {
        Step::TimesSquare([number, factor]) => relative[*number]
            .zip(relative[*factor])
            .map(|(number, factor)| number + factor + factor),
        Step::Apply { op, values, .. } => rule(*op, values, before, relative),
        _ => None,
    };
    let divided = (value.value.lo > 0.0).then(|| {
        let inverse = Interval::point(1.0) / value.value;
        value.gradient * inverse
    });
    let found = match (ruled, divided) {
        (Some(a), Some(b)) => Some(each([a, b], |[a, b]| common(a, b))),
        (a, b) => a.or(b),
    };
    if let Some(relative) = found {
        let size = Interval {
            lo: value.value.lo.max(0.0),
            hi: value.value.hi,
        };
        value.gradient = each([value.gradient, relative * size], |[a, b]| common(a, b));
    }
    found
}

/// Narrows the gradient of a logarithm.
fn narrow(
    value: &mut Dual<Interval>,
    op: Op,
    values: &[usize],
    before: &[Dual<Interval>],
    relative: &[Option<Relative>],
) {
    let factor = match op {
        Op::Ln => 1.0,
        Op::Log2 => LOG2_E,
        _ => return,
    };
    let Some(found) = relative[values[0]] else {
        return;
    };
    let mut gradient = found * Interval::point(factor);
    if before[values[0]].value.lo <= LEAST_LOGARITHM {
        gradient = with_zero(gradient);
    }
    value.gradient = each([value.gradient, gradient], |[a, b]| common(a, b));
}

/// Reports whether a step divides a positive number by a sum of it and another positive number.
fn is_share(
    op: Op,
    values: &[usize],
    steps: &[Step<Dual<Interval>>],
    relative: &[Option<Relative>],
) -> bool {
    let (Op::Div, &[number, sum]) = (op, values) else {
        return false;
    };
    match &steps[sum] {
        Step::Apply {
            op: Op::Add,
            values,
            ..
        } => values.contains(&number) && values.iter().all(|&at| relative[at].is_some()),
        _ => false,
    }
}

/// The relative gradient that follows from those of the operands.
fn rule(
    op: Op,
    values: &[usize],
    before: &[Dual<Interval>],
    relative: &[Option<Relative>],
) -> Option<Relative> {
    let of = |at: usize| relative[values[at]];
    let low = |at: usize| before[values[at]].value.lo;
    let times = |relative: Relative, factor: f64| relative * Interval::point(factor);
    match op {
        Op::Exp => Some(before[values[0]].gradient),
        Op::Exp2 => Some(times(before[values[0]].gradient, LN_2)),
        Op::Add | Op::Max | Op::Min => Some(each([of(0)?, of(1)?], |[a, b]| a.hull(b))),
        Op::Mul => Some(of(0)? + of(1)?),
        Op::Div => {
            let divisor = match low(1) < LEAST_DIVISOR {
                true => with_zero(of(1)?),
                false => of(1)?,
            };
            Some(of(0)? - divisor)
        }
        Op::Square => Some(times(of(0)?, 2.0)),
        Op::Abs => of(0),
        Op::Sqrt => Some(times(of(0)?, 0.5)),
        // Both summands of the slope's quotient are positive: it lies between −1 and 1.
        Op::Cosh => Some(before[values[0]].gradient * Interval { lo: -1.0, hi: 1.0 }),
        Op::Pow if is_flat(&before[values[0]]) && low(0) >= LEAST_BASE => {
            Some(before[values[1]].gradient * before[values[0]].value.ln())
        }
        Op::Pow if is_flat(&before[values[1]]) => {
            let power = of(0)? * before[values[1]].value;
            Some(match low(0) < LEAST_BASE {
                true => with_zero(power),
                false => power,
            })
        }
        _ => None,
    }
}

/// Bounds of the length of a step's relative gradient, by those of its operands and the lengths of their gradients.
pub(super) fn norm(
    step: &Step<Dual<Interval>>,
    before: &[Dual<Interval>],
    norms: &[f64],
    relative_norms: &[f64],
) -> f64 {
    let (op, values) = match step {
        Step::TimesSquare([number, factor]) => {
            return relative_norms[*number] + 2.0 * relative_norms[*factor];
        }
        Step::Apply { op, values, .. } => (*op, values),
        _ => return f64::INFINITY,
    };
    let of = |at: usize| relative_norms[values[at]];
    match op {
        Op::Exp | Op::Cosh => norms[values[0]],
        Op::Exp2 => norms[values[0]] * (LN_2 + 1e-15),
        Op::Add | Op::Max | Op::Min => of(0).max(of(1)),
        Op::Mul | Op::Div => of(0) + of(1),
        Op::Square => of(0) * 2.0,
        Op::Abs => of(0),
        Op::Sqrt => of(0) * 0.5,
        Op::Pow if is_flat(&before[values[0]]) && before[values[0]].value.lo >= LEAST_BASE => {
            norms[values[1]] * before[values[0]].value.ln().magnitude()
        }
        Op::Pow if is_flat(&before[values[1]]) => of(0) * before[values[1]].value.magnitude(),
        _ => f64::INFINITY,
    }
}

/// Reports whether a number is the same at all points.
pub(super) fn is_flat(number: &Dual<Interval>) -> bool {
    let V3 { x, y, z } = number.gradient;
    [x, y, z].iter().all(|v| v.lo == 0.0 && v.hi == 0.0)
}

/// The hull of bounds and zero.
fn with_zero(relative: Relative) -> Relative {
    let zero = Interval::point(0.0);
    each([relative, V3::of(zero, zero, zero)], |[a, b]| a.hull(b))
}

fn each([a, b]: [Relative; 2], f: impl Fn([Interval; 2]) -> Interval) -> Relative {
    V3::of(f([a.x, b.x]), f([a.y, b.y]), f([a.z, b.z]))
}

/// The numbers in both of two intervals that hold for the same number.
fn common(a: Interval, b: Interval) -> Interval {
    let (lo, hi) = (a.lo.max(b.lo), a.hi.min(b.hi));
    // Rounding may leave nothing, and NaN compares as false.
    if lo <= hi { Interval { lo, hi } } else { a }
}
