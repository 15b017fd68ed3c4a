//! Contraction of boxes: ranges of the point that follow from ranges of numbers, operation by operation.
//!
//! Where a maximum is at most zero, both operands are. Where a sum of squares has a limit, each square has. So limits are
//! passed from numbers to their operands, and in the end to the point (F. Benhamou and others, *Revising Hull and Box
//! Consistency*, 1999). In contrast to evaluation over boxes, this needs no box to begin with. Intervals do not see that a
//! rotation by an angle that varies keeps lengths. So a pair of numbers that is a rotation of two others limits these, too.

use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::analysis::rotations::{Rotation, rotations};
use crate::expression::{ExprId, Expression, Expressions};
use crate::uniforms::postorder;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;
use std::collections::{BTreeSet, HashMap};

/// Maximum number of passes over all numbers.
const MAX_PASSES: usize = 8;
/// Maximum fraction of a side that a pass leaves for another one to follow.
const MAX_REMAINING_FRACTION: f64 = 0.99;
/// Growth of a limit, relative to its magnitude, for rounding.
const ROUNDING: f64 = 1e-12;

/// Number of the point, and a range to which it is limited.
#[derive(Clone, Copy)]
pub(super) struct Limit {
    pub(super) number: ExprId,
    pub(super) range: Interval,
}

/// Maximum number of choices among operands of minima.
const MAX_CHOICES: usize = 64;

/// Returns the part of a box outside of which a number is proved to be positive.
pub(super) fn contracted_to_negative(
    expressions: &Expressions,
    number: ExprId,
    bounds: &Bounds,
    uniform: &mut dyn FnMut(ExprId) -> Interval,
) -> Bounds {
    let range = Interval {
        lo: f64::NEG_INFINITY,
        hi: 0.0,
    };
    let limits = |numbers: &[ExprId]| -> Vec<Limit> {
        let numbers = numbers.iter();
        numbers.map(|&number| Limit { number, range }).collect()
    };
    choices(expressions, number)
        .iter()
        .fold(Bounds::EMPTY, |hull, numbers| {
            hull.hull(&contracted(expressions, &limits(numbers), bounds, uniform))
        })
}

/// Returns lists of numbers. Where a number is negative, all numbers of one list are: a minimum is negative where any operand
/// is, and a maximum where both are.
fn choices(e: &Expressions, number: ExprId) -> Vec<Vec<ExprId>> {
    let (mut complete, mut pending) = (Vec::new(), vec![(Vec::new(), vec![number])]);
    while let Some((mut chosen, mut open)) = pending.pop() {
        let Some(id) = open.pop() else {
            complete.push(chosen);
            continue;
        };
        let has_room = complete.len() + pending.len() + 2 <= MAX_CHOICES;
        match (e.operands_of(id, Op::Min), e.operands_of(id, Op::Max)) {
            (Some(operands), _) if has_room => {
                for &operand in operands {
                    let open = open.iter().copied().chain([operand]);
                    pending.push((chosen.clone(), open.collect()));
                }
                continue;
            }
            (_, Some(operands)) => open.extend(operands),
            _ => chosen.push(id),
        }
        pending.push((chosen, open));
    }
    complete
}

/// Returns the part of a box outside of which a number is proved to exceed its limit.
pub(super) fn contracted(
    expressions: &Expressions,
    limits: &[Limit],
    bounds: &Bounds,
    uniform: &mut dyn FnMut(ExprId) -> Interval,
) -> Bounds {
    let mut numbers = Vec::new();
    let mut order = BTreeSet::new();
    for limit in limits {
        let operands = postorder(expressions, limit.number, |_| false);
        order.extend(operands.iter().copied());
        let number = BoxNumber::<Interval>::new(expressions, limit.number, &mut |id| {
            UniformInput::Known(uniform(id))
        });
        numbers.push((number, operands));
    }
    let order: Vec<ExprId> = order.into_iter().collect();
    let mut contraction = Contraction {
        e: expressions,
        rotations: rotations(expressions, &order),
        ranges: HashMap::new(),
    };
    let mut bounds = *bounds;
    for _ in 0..MAX_PASSES {
        for (number, operands) in &mut numbers {
            for (&id, &range) in operands.iter().zip(number.eval_all(&bounds, &[])) {
                contraction.limit(id, range);
            }
        }
        for &Limit { number, range } in limits {
            contraction.limit(number, range);
        }
        for &id in order.iter().rev() {
            contraction.limit_operands(id);
        }
        contraction.limit_rotated();
        let contracted = contraction.bounds(&order, &bounds);
        if contracted.is_empty() || !is_smaller(&contracted, &bounds) {
            break;
        }
        bounds = contracted;
    }
    bounds
}

/// Reports whether a side of a box has become shorter by a part that matters.
fn is_smaller(contracted: &Bounds, bounds: &Bounds) -> bool {
    (0..3).any(|axis| {
        let [new, old] = [contracted, bounds].map(|it| it.max[axis] - it.min[axis]);
        new < old * MAX_REMAINING_FRACTION
            || contracted.min[axis].is_finite() != bounds.min[axis].is_finite()
            || contracted.max[axis].is_finite() != bounds.max[axis].is_finite()
    })
}

struct Contraction<'e> {
    e: &'e Expressions,
    rotations: Vec<Rotation>,
    /// Ranges of numbers where all limits hold.
    ranges: HashMap<ExprId, Interval>,
}

impl Contraction<'_> {
    fn range(&self, id: ExprId) -> Interval {
        self.ranges.get(&id).copied().unwrap_or(Interval::ALL)
    }

    /// Limits a number to a range, which rounding may have made too small.
    fn limit(&mut self, id: ExprId, range: Interval) {
        let old = self.range(id);
        let Interval { lo, hi } = range;
        // Also false for NaN.
        let lo = if lo > old.lo {
            lo - lo.abs() * ROUNDING
        } else {
            old.lo
        };
        let hi = if hi < old.hi {
            hi + hi.abs() * ROUNDING
        } else {
            old.hi
        };
        let new = Interval {
            lo: lo.max(old.lo),
            hi: hi.min(old.hi),
        };
        self.ranges.insert(id, new);
    }

    /// Limits the operands of a number by its range.
    fn limit_operands(&mut self, id: ExprId) {
        let Expression::Apply { op, values, .. } = self.e.get(id) else {
            return;
        };
        let y = self.range(id);
        let up_to = |hi: f64| Interval {
            lo: f64::NEG_INFINITY,
            hi,
        };
        let from = |lo: f64| Interval {
            lo,
            hi: f64::INFINITY,
        };
        let within = |radius: f64| Interval {
            lo: -radius,
            hi: radius,
        };
        match (*op, values.as_slice()) {
            (Op::Add, &[a, b]) => {
                self.limit(a, y - self.range(b));
                self.limit(b, y - self.range(a));
            }
            (Op::Sub, &[a, b]) => {
                self.limit(a, y + self.range(b));
                self.limit(b, self.range(a) - y);
            }
            (Op::Neg, &[a]) => self.limit(a, -y),
            (Op::Mul, &[a, b]) => {
                for (one, other) in [(a, b), (b, a)] {
                    let factor = self.range(other);
                    if !factor.contains(0.0) {
                        self.limit(one, y / factor);
                    }
                }
            }
            (Op::Div, &[a, b]) => self.limit(a, y * self.range(b)),
            (Op::Abs, &[a]) => self.limit(a, within(y.hi)),
            (Op::Square, &[a]) => self.limit(a, within(y.hi.sqrt())),
            (Op::Sqrt, &[a]) => self.limit(a, up_to(y.hi * y.hi)),
            (Op::Exp, &[a]) => self.limit(a, up_to(y.hi.ln())),
            (Op::Max, &[a, b]) => {
                let highest = up_to(y.hi);
                for (one, other) in [(a, b), (b, a)] {
                    self.limit(one, highest);
                    if self.range(other).hi < y.lo {
                        self.limit(one, from(y.lo));
                    }
                }
            }
            (Op::Min, &[a, b]) => {
                for (one, other) in [(a, b), (b, a)] {
                    self.limit(one, from(y.lo));
                    if self.range(other).lo > y.hi {
                        self.limit(one, up_to(y.hi));
                    }
                }
            }
            (Op::Select, &[_, a, b]) => {
                for (one, other) in [(a, b), (b, a)] {
                    if self.range(other).lo > y.hi {
                        self.limit(one, y);
                    }
                }
            }
            _ => {}
        }
    }

    /// Limits pairs of numbers by the length of what they are rotated to.
    fn limit_rotated(&mut self) {
        for index in 0..self.rotations.len() {
            let Rotation { from, to, scale } = self.rotations[index];
            let [a, b] = to.map(|id| self.range(id).magnitude());
            let radius = a.hypot(b) / scale;
            if radius.is_finite() {
                for id in from {
                    self.limit(
                        id,
                        Interval {
                            lo: -radius,
                            hi: radius,
                        },
                    );
                }
            }
        }
    }

    /// Returns the box with the limits of coordinates.
    fn bounds(&self, order: &[ExprId], bounds: &Bounds) -> Bounds {
        let mut result = *bounds;
        for &id in order {
            if let Expression::Coordinate(axis) = *self.e.get(id) {
                let (axis, range) = (usize::from(axis), self.range(id));
                result.min[axis] = result.min[axis].max(range.lo);
                result.max[axis] = result.max[axis].min(range.hi);
            }
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contracted_box(e: &Expressions, number: ExprId) -> Bounds {
        contracted_to_negative(e, number, &Bounds::ALL_SPACE, &mut |id| {
            Interval::point(e.as_constant(id).unwrap_or(f64::NAN))
        })
    }

    /// A point at which a rounded exponential is zero stays in the box.
    #[test]
    fn rounding_leaves_the_last_point_in_the_box() {
        for number in 1..400 {
            let end = f64::from(number) * 0.137;
            let mut e = Expressions::default();
            let x = e.coordinate(0);
            let exponential = e.call(Op::Exp, &[x]);
            let limit = e.constant(end.exp());
            let value = e.call(Op::Sub, &[exponential, limit]);
            let bounds = contracted_box(&e, value);
            assert!(bounds.max[0] >= end, "{end}: {bounds:?}");
            assert!(bounds.max[0] < end * 1.01, "{end}: {bounds:?}");
        }
    }

    /// With equal signs of the sines, lengths change: at a height of 0.5, such a square reaches to 1.25.
    #[test]
    fn a_map_that_changes_lengths_is_no_rotation() {
        for (sign, reach) in [(Op::Add, 1.2), (Op::Sub, 0.7)] {
            let mut e = Expressions::default();
            let [x, y, z] = [0, 1, 2].map(|axis| e.coordinate(axis));
            let [cos, sin] = [Op::Cos, Op::Sin].map(|op| e.call(op, &[y]));
            let mut product = |a, b| e.call(Op::Mul, &[a, b]);
            let [xc, xs, zc, zs] = [
                product(x, cos),
                product(x, sin),
                product(z, cos),
                product(z, sin),
            ];
            let [first, second] = [e.call(Op::Add, &[xc, zs]), e.call(sign, &[zc, xs])];
            let half = e.constant(0.5);
            let mut outside = |number| {
                let magnitude = e.call(Op::Abs, &[number]);
                e.call(Op::Sub, &[magnitude, half])
            };
            let [first, second, height] = [outside(first), outside(second), outside(y)];
            let square = e.call(Op::Max, &[first, second]);
            let value = e.call(Op::Max, &[square, height]);
            let bounds = contracted_box(&e, value);
            assert!(bounds.max[0] >= reach, "{bounds:?}");
            assert_eq!(bounds.max[0].is_finite(), sign == Op::Sub, "{bounds:?}");
        }
    }
}
