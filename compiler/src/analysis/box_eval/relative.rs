//! Relative gradients: bounds of the gradient of a positive number's logarithm.
//!
//! Exponentials cover many orders of magnitude in a box, so the gradient of a sum of them says little about
//! that of its logarithm. The relative gradient does. That of an exponential is the gradient of its exponent;
//! that of a sum is a mean of its operands' relative gradients.

use super::BoxStep;
use super::power::{self, MIN_POWER_BASE};
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::f64::consts::{LN_2, LOG2_E};

/// Bounds of a number's gradient divided by the number, which is positive.
pub(crate) type Relative = V3<Interval>;

/// Minimum argument of a logarithm that is not constant.
const MIN_LOGARITHM_ARGUMENT: f64 = 1e-30;
/// Minimum magnitude of a divisor.
const MIN_DIVISOR: f64 = 1e-18;

/// Narrows the result of a step by the relative gradients of its operands, and returns its own.
///
/// `None` stands for a number that may be zero or less.
pub(super) fn refine(
    value: &mut Dual<Interval>,
    step: &BoxStep<Dual<Interval>>,
    steps: &[BoxStep<Dual<Interval>>],
    previous: &[Dual<Interval>],
    relative: &[Option<Relative>],
) -> Option<Relative> {
    if let BoxStep::Apply { op, values, .. } = step {
        narrow(value, *op, values, previous, relative);
        if let (Op::Pow, &[base, exponent]) = (*op, &values[..]) {
            let bounds = power::gradient(previous[base], previous[exponent], value.value);
            value.gradient = each([value.gradient, bounds], |[a, b]| intersection(a, b));
        }
        if is_fraction_of_sum(*op, values, steps, relative) {
            value.value = intersection(value.value, Interval { lo: 0.0, hi: 1.0 });
        }
    }
    let by_rule = match step {
        BoxStep::TimesSquare([number, factor]) => relative[*number]
            .zip(relative[*factor])
            .map(|(number, factor)| number + factor + factor),
        BoxStep::Apply { op, values, .. } => rule(*op, values, previous, relative),
        _ => None,
    };
    let by_division = (value.value.lo > 0.0).then(|| {
        let inverse = Interval::point(1.0) / value.value;
        value.gradient * inverse
    });
    let combined = match (by_rule, by_division) {
        (Some(a), Some(b)) => Some(each([a, b], |[a, b]| intersection(a, b))),
        (a, b) => a.or(b),
    };
    if let Some(relative) = combined {
        let size = Interval {
            lo: value.value.lo.max(0.0),
            hi: value.value.hi,
        };
        value.gradient = each([value.gradient, relative * size], |[a, b]| {
            intersection(a, b)
        });
    }
    combined
}

/// Narrows the gradient of a logarithm.
fn narrow(
    value: &mut Dual<Interval>,
    op: Op,
    values: &[usize],
    previous: &[Dual<Interval>],
    relative: &[Option<Relative>],
) {
    let factor = match op {
        Op::Ln => 1.0,
        Op::Log2 => LOG2_E,
        _ => return,
    };
    let Some(operand_relative) = relative[values[0]] else {
        return;
    };
    let mut gradient = operand_relative * Interval::point(factor);
    if previous[values[0]].value.lo <= MIN_LOGARITHM_ARGUMENT {
        gradient = with_zero(gradient);
    }
    value.gradient = each([value.gradient, gradient], |[a, b]| intersection(a, b));
}

/// Reports whether a step divides a positive number by a sum of it and another positive number.
fn is_fraction_of_sum(
    op: Op,
    values: &[usize],
    steps: &[BoxStep<Dual<Interval>>],
    relative: &[Option<Relative>],
) -> bool {
    let (Op::Div, &[number, sum]) = (op, values) else {
        return false;
    };
    match &steps[sum] {
        BoxStep::Apply {
            op: Op::Add,
            values,
            ..
        } => values.contains(&number) && values.iter().all(|&index| relative[index].is_some()),
        _ => false,
    }
}

/// Returns the relative gradient that follows from those of the operands.
fn rule(
    op: Op,
    values: &[usize],
    previous: &[Dual<Interval>],
    relative: &[Option<Relative>],
) -> Option<Relative> {
    let operand_relative = |index: usize| relative[values[index]];
    let low = |index: usize| previous[values[index]].value.lo;
    let times = |relative: Relative, factor: f64| relative * Interval::point(factor);
    match op {
        Op::Exp => Some(previous[values[0]].gradient),
        Op::Exp2 => Some(times(previous[values[0]].gradient, LN_2)),
        Op::Add | Op::Max | Op::Min => Some(each(
            [operand_relative(0)?, operand_relative(1)?],
            |[a, b]| a.hull(b),
        )),
        Op::Mul => Some(operand_relative(0)? + operand_relative(1)?),
        Op::Div => {
            let divisor = match low(1) < MIN_DIVISOR {
                true => with_zero(operand_relative(1)?),
                false => operand_relative(1)?,
            };
            Some(operand_relative(0)? - divisor)
        }
        Op::Square => Some(times(operand_relative(0)?, 2.0)),
        Op::Abs => operand_relative(0),
        Op::Sqrt => Some(times(operand_relative(0)?, 0.5)),
        // Both summands of the slope's quotient are positive: it lies between −1 and 1.
        Op::Cosh => Some(previous[values[0]].gradient * Interval { lo: -1.0, hi: 1.0 }),
        Op::Pow if is_flat(&previous[values[0]]) && low(0) >= MIN_POWER_BASE => {
            Some(previous[values[1]].gradient * previous[values[0]].value.ln())
        }
        Op::Pow if is_flat(&previous[values[1]]) => {
            let power = operand_relative(0)? * previous[values[1]].value;
            Some(match low(0) < MIN_POWER_BASE {
                true => with_zero(power),
                false => power,
            })
        }
        Op::Pow if low(0) >= MIN_POWER_BASE => {
            let [base, exponent] = [previous[values[0]], previous[values[1]]];
            Some(operand_relative(0)? * exponent.value + exponent.gradient * base.value.ln())
        }
        _ => None,
    }
}

/// Returns a bound on the length of a step's relative gradient, by those of its operands and the
/// lengths of their gradients.
pub(super) fn norm(
    step: &BoxStep<Dual<Interval>>,
    previous: &[Dual<Interval>],
    norms: &[f64],
    relative_norms: &[f64],
) -> f64 {
    let (op, values) = match step {
        BoxStep::TimesSquare([number, factor]) => {
            return relative_norms[*number] + 2.0 * relative_norms[*factor];
        }
        BoxStep::Apply { op, values, .. } => (*op, values),
        _ => return f64::INFINITY,
    };
    let operand_norm = |index: usize| relative_norms[values[index]];
    match op {
        Op::Exp | Op::Cosh => norms[values[0]],
        Op::Exp2 => norms[values[0]] * (LN_2 + 1e-15),
        Op::Add | Op::Max | Op::Min => operand_norm(0).max(operand_norm(1)),
        Op::Mul | Op::Div => operand_norm(0) + operand_norm(1),
        Op::Square => operand_norm(0) * 2.0,
        Op::Abs => operand_norm(0),
        Op::Sqrt => operand_norm(0) * 0.5,
        Op::Pow
            if is_flat(&previous[values[0]]) && previous[values[0]].value.lo >= MIN_POWER_BASE =>
        {
            norms[values[1]] * previous[values[0]].value.ln().magnitude()
        }
        Op::Pow if is_flat(&previous[values[1]]) => {
            operand_norm(0) * previous[values[1]].value.magnitude()
        }
        _ => f64::INFINITY,
    }
}

/// Reports whether a number is the same at all points.
pub(super) fn is_flat(number: &Dual<Interval>) -> bool {
    let V3 { x, y, z } = number.gradient;
    [x, y, z].iter().all(|v| v.lo == 0.0 && v.hi == 0.0)
}

/// Returns the hull of bounds and zero.
fn with_zero(relative: Relative) -> Relative {
    let zero = Interval::point(0.0);
    each([relative, V3::new(zero, zero, zero)], |[a, b]| a.hull(b))
}

fn each([a, b]: [Relative; 2], f: impl Fn([Interval; 2]) -> Interval) -> Relative {
    V3::new(f([a.x, b.x]), f([a.y, b.y]), f([a.z, b.z]))
}

/// Returns the intersection of two intervals that hold for the same number.
fn intersection(a: Interval, b: Interval) -> Interval {
    let (lo, hi) = (a.lo.max(b.lo), a.hi.min(b.hi));
    // Rounding may leave it empty, and NaN compares as false.
    if lo <= hi { Interval { lo, hi } } else { a }
}
