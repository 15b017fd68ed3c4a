//! Contraction of boxes: ranges of the point that follow from ranges of numbers, operation by operation.
//!
//! Both operands of a maximum are at most zero where it is. Each square of a sum has the limit of the sum. So limits are
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
use std::collections::{BTreeSet, HashMap, HashSet};

/// Maximum number of passes over all numbers.
const MAX_PASSES: usize = 8;
/// Maximum fraction of a side that a pass leaves for another one to follow.
const MAX_REMAINING_FRACTION: f64 = 0.99;
/// Maximum number of choices among operands of minima.
const MAX_CHOICES: usize = 64;
/// Growth of a limit, relative to its magnitude, for rounding.
const ROUNDING: f64 = 1e-12;

/// Number of the point, and a range to which it is limited.
#[derive(Clone, Copy)]
pub(super) struct NumberLimit {
    pub(super) number: ExprId,
    pub(super) range: Interval,
}

/// Returns the part of a box outside of which a number is proved to be positive. It runs at most `operations` operations.
pub(super) fn contracted_to_negative(
    expressions: &Expressions,
    number: ExprId,
    bounds: &Bounds,
    operations: usize,
    uniform: &mut dyn FnMut(ExprId) -> Interval,
) -> Bounds {
    let range = Interval {
        lo: f64::NEG_INFINITY,
        hi: 0.0,
    };
    let limits = |numbers: &[ExprId]| -> Vec<NumberLimit> {
        let numbers = numbers.iter();
        numbers
            .map(|&number| NumberLimit { number, range })
            .collect()
    };
    let mut contraction = Contraction::new(expressions, &[number], uniform);
    let max_choices = operations / (MAX_PASSES * contraction.order.len().max(1));
    if max_choices == 0 {
        return *bounds;
    }
    choices(expressions, number, max_choices.min(MAX_CHOICES))
        .iter()
        .fold(Bounds::EMPTY, |hull, numbers| {
            hull.hull(&contraction.contracted(&limits(numbers), bounds))
        })
}

/// Returns lists of numbers. Where a number is negative, all numbers of one list are: a minimum is negative where any operand
/// is, and a maximum where both are.
fn choices(e: &Expressions, number: ExprId, max_choices: usize) -> Vec<Vec<ExprId>> {
    let (mut complete, mut pending) = (Vec::new(), vec![NegativeSet::default().with(number)]);
    while let Some(mut choice) = pending.pop() {
        let Some(id) = choice.open.pop() else {
            complete.push(choice.chosen);
            continue;
        };
        let has_room = complete.len() + pending.len() + 2 <= max_choices;
        match (e.operands_of(id, Op::Min), e.operands_of(id, Op::Max)) {
            (Some(operands), _) if has_room => {
                pending.extend(operands.iter().map(|&operand| choice.clone().with(operand)));
                continue;
            }
            (_, Some(operands)) => {
                choice = operands.iter().fold(choice, |choice, &id| choice.with(id));
            }
            _ => choice.chosen.push(id),
        }
        pending.push(choice);
    }
    complete
}

/// Numbers that are negative together.
#[derive(Clone, Default)]
struct NegativeSet {
    chosen: Vec<ExprId>,
    /// Numbers whose operands are not yet regarded.
    open: Vec<ExprId>,
    /// All numbers that were open. Operands may be shared many times.
    reached: HashSet<ExprId>,
}

impl NegativeSet {
    /// Adds a number that is negative, too.
    fn with(mut self, id: ExprId) -> Self {
        if self.reached.insert(id) {
            self.open.push(id);
        }
        self
    }
}

/// Numbers through whose operations limits are passed.
pub(super) struct Contraction<'e> {
    e: &'e Expressions,
    /// Numbers, each with its operands in the order of evaluation.
    numbers: Vec<(BoxNumber<Interval>, Vec<ExprId>)>,
    /// All operands, before their users.
    order: Vec<ExprId>,
    rotations: Vec<Rotation>,
}

impl<'e> Contraction<'e> {
    pub(super) fn new(
        e: &'e Expressions,
        numbers: &[ExprId],
        uniform: &mut dyn FnMut(ExprId) -> Interval,
    ) -> Self {
        let mut order = BTreeSet::new();
        let numbers = numbers.iter().map(|&id| {
            let operands = postorder(e, id, |_| false);
            order.extend(operands.iter().copied());
            let number = BoxNumber::new(e, id, &mut |id| UniformInput::Known(uniform(id)));
            (number, operands)
        });
        let numbers = numbers.collect();
        let order: Vec<ExprId> = order.into_iter().collect();
        Self {
            e,
            numbers,
            rotations: rotations(e, &order),
            order,
        }
    }

    /// Returns the part of a box outside of which a number or an operand is proved to exceed its limit.
    pub(super) fn contracted(&mut self, limits: &[NumberLimit], bounds: &Bounds) -> Bounds {
        let mut limited = LimitedRanges {
            e: self.e,
            ranges: HashMap::new(),
        };
        let mut bounds = *bounds;
        for _ in 0..MAX_PASSES {
            for (number, operands) in &mut self.numbers {
                for (&id, &range) in operands.iter().zip(number.eval_all(&bounds, &[])) {
                    limited.limit(id, range);
                }
            }
            for &NumberLimit { number, range } in limits {
                limited.limit(number, range);
            }
            for &id in self.order.iter().rev() {
                limited.limit_operands(id);
            }
            for rotation in &self.rotations {
                limited.limit_rotated(rotation);
            }
            let contracted = limited.bounds(&self.order, &bounds);
            if contracted.is_empty() || !is_smaller(&contracted, &bounds) {
                break;
            }
            bounds = contracted;
        }
        bounds
    }
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

/// Ranges of numbers where all limits hold.
struct LimitedRanges<'e> {
    e: &'e Expressions,
    ranges: HashMap<ExprId, Interval>,
}

impl LimitedRanges<'_> {
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

    /// Limits both numbers by the length of what they are rotated to.
    fn limit_rotated(&mut self, rotation: &Rotation) {
        let &Rotation { from, to, scale } = rotation;
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
        contracted_to_negative(e, number, &Bounds::ALL_SPACE, 100_000, &mut |id| {
            Interval::point(e.as_constant(id).unwrap_or(f64::NAN))
        })
    }

    /// The last point whose rounded root is within a limit stays in the box.
    #[test]
    fn rounding_leaves_the_last_point_in_the_box() {
        for number in 1..400 {
            let end = f64::from(number) * 0.137;
            let mut e = Expressions::default();
            let x = e.coordinate(0);
            let root = e.call(Op::Sqrt, &[x]);
            let limit = NumberLimit {
                number: root,
                range: Interval {
                    lo: 0.0,
                    hi: end.sqrt(),
                },
            };
            let mut contraction = Contraction::new(&e, &[root], &mut |_| Interval::ALL);
            let bounds = contraction.contracted(&[limit], &Bounds::ALL_SPACE);
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
