//! Blends written by hand, `mix(b, a, h)` with `h = clamp(0.5 + (b - a) / (2 * k), 0, 1)`: the weight
//! changes only where the two numbers are close to each other.
//!
//! In a large box the two may differ by much and the weight may change, but not at the same point. The
//! term `k * h * (1 - h)`, which such blends subtract, cancels the contribution of the weight's change.

use super::{BoxNumber, BoxStep};
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// Mean of two numbers: `first + (second - first) * weight`.
struct Mean {
    first: usize,
    second: usize,
    weight: usize,
}

/// Number as a multiple of a difference of two others, plus a constant.
struct Linear {
    constant: Interval,
    factor: Interval,
}

/// Endpoints of a weight.
const WEIGHT_ENDS: [f64; 2] = [0.0, 1.0];

impl BoxNumber<Dual<Interval>> {
    /// Returns a bound on the length of the gradient of a blend written by hand.
    pub(super) fn blend_norm(&self, index: usize, norms: &[f64]) -> Option<f64> {
        if let Some(mean) = self.mean(index) {
            return self.mean_norm(&mean, None, norms);
        }
        let BoxStep::Apply { op, values, .. } = &self.steps[index] else {
            return None;
        };
        let sign = match op {
            Op::Sub => -1.0,
            Op::Add => 1.0,
            _ => return None,
        };
        let orders: &[[usize; 2]] = match op {
            Op::Add => &[[0, 1], [1, 0]],
            _ => &[[0, 1]],
        };
        orders.iter().find_map(|&[mean, other]| {
            let mean = self.mean(values[mean])?;
            let bulge = self.bulge_factor(values[other], mean.weight)? * Interval::point(sign);
            self.mean_norm(&mean, Some(bulge), norms)
        })
    }

    /// Returns a bound for a mean, with a term `bulge * weight * (1 - weight)` added.
    fn mean_norm(&self, mean: &Mean, bulge: Option<Interval>, norms: &[f64]) -> Option<f64> {
        let &Mean {
            first,
            second,
            weight,
        } = mean;
        let operands = norms[first].max(norms[second]);
        let (changes, gap) = match &self.steps[weight] {
            BoxStep::Apply {
                op: Op::Clamp,
                values,
                ..
            } => {
                let &[inner, low, high] = values.as_slice() else {
                    return None;
                };
                let ends = [low, high].map(|endpoint| self.values[endpoint].value);
                if ends != WEIGHT_ENDS.map(Interval::point) {
                    return None;
                }
                let Linear { constant, factor } = self.linear(inner, [second, first])?;
                // The difference and the change of the bulge are linear in the weight: the maximum is
                // at an endpoint.
                let at_end = |endpoint: f64| {
                    let weight = Interval::point(endpoint);
                    let slope = Interval::point(1.0) - weight * Interval::point(2.0);
                    let gap = (weight - constant) / factor;
                    (gap + bulge.unwrap_or(Interval::point(0.0)) * slope).magnitude()
                };
                (norms[inner], at_end(0.0).max(at_end(1.0)))
            }
            BoxStep::Apply {
                op: Op::Smoothstep,
                values,
                ..
            } if bulge.is_none() => {
                let &[low, high, inner] = values.as_slice() else {
                    return None;
                };
                let [low, high] = [low, high].map(|endpoint| self.values[endpoint].value);
                let Linear { constant, factor } = self.linear(inner, [second, first])?;
                let gap = (low.hull(high) - constant) / factor;
                (norms[weight], gap.magnitude())
            }
            _ => return None,
        };
        Some(operands + changes * gap)
    }

    /// Returns the mean that a step computes, in one of the forms in which it may be written.
    fn mean(&self, index: usize) -> Option<Mean> {
        let operation = |index: usize| self.operation(index);
        let (op, values) = operation(index)?;
        let mean = |first: usize, second: usize, weight: usize| Mean {
            first,
            second,
            weight,
        };
        if op == Op::Mix {
            return Some(mean(values[0], values[1], values[2]));
        }
        if op != Op::Add {
            return None;
        }
        let product = |index: usize| match operation(index)? {
            (Op::Mul, &[a, b]) => Some([a, b]),
            _ => None,
        };
        let orders = [[0, 1], [1, 0]].map(|order| order.map(|index| values[index]));
        orders.into_iter().find_map(|[first_term, second_term]| {
            let pairs = |pair: [usize; 2]| [pair, [pair[1], pair[0]]];
            let second_term = pairs(product(second_term)?);
            // `a + (b - a) * t`.
            let two_term = second_term.into_iter().find_map(|[difference, weight]| {
                let (op, values) = operation(difference)?;
                (op == Op::Sub && values[1] == first_term)
                    .then(|| mean(first_term, values[0], weight))
            });
            // `a * (1 - t) + b * t`.
            two_term.or_else(|| {
                let first_term = pairs(product(first_term)?);
                first_term.into_iter().find_map(|[first, factor]| {
                    let weight = self.complement(factor)?;
                    let second = second_term.iter().find(|pair| pair[1] == weight)?[0];
                    Some(mean(first, second, weight))
                })
            })
        })
    }

    /// Returns the factor `k` of a product `k * weight * (1 - weight)`, in any order.
    fn bulge_factor(&self, index: usize, weight: usize) -> Option<Interval> {
        let mut factors = vec![index];
        let (mut scale, mut weights, mut complements) = (Interval::point(1.0), 0, 0);
        while let Some(index) = factors.pop() {
            if index == weight {
                weights += 1;
            } else if self.complement(index) == Some(weight) {
                complements += 1;
            } else if self.is_flat(index) {
                scale = scale * self.values[index].value;
            } else if let (Op::Mul, values) = self.operation(index)? {
                factors.extend(values);
            } else {
                return None;
            }
        }
        (weights == 1 && complements == 1).then_some(scale)
    }

    /// Returns the number `w` of a step that computes `1 - w`.
    fn complement(&self, index: usize) -> Option<usize> {
        match self.operation(index)? {
            (Op::Sub, &[unit, weight]) => {
                (self.values[unit].value == Interval::point(1.0)).then_some(weight)
            }
            _ => None,
        }
    }

    /// Returns a step as a linear function of the difference of two others.
    fn linear(&self, index: usize, [a, b]: [usize; 2]) -> Option<Linear> {
        let zero = Interval::point(0.0);
        let (op, values) = self.operation(index)?;
        let transformed =
            |linear_operand: Linear, f: &dyn Fn(Interval) -> Interval, addend: Interval| Linear {
                constant: f(linear_operand.constant) + addend,
                factor: f(linear_operand.factor),
            };
        let linear_operand = |index: usize| self.linear(index, [a, b]);
        let constant_value = |index: usize| self.is_flat(index).then(|| self.values[index].value);
        match (op, values) {
            (Op::Sub, &[x, y]) if [x, y] == [a, b] || [y, x] == [a, b] => Some(Linear {
                constant: zero,
                factor: Interval::point(if x == a { 1.0 } else { -1.0 }),
            }),
            (Op::Neg, &[x]) => Some(transformed(linear_operand(x)?, &|v| -v, zero)),
            (Op::Add, &[x, y]) => match (constant_value(x), constant_value(y)) {
                (Some(c), _) => Some(transformed(linear_operand(y)?, &|v| v, c)),
                (_, Some(c)) => Some(transformed(linear_operand(x)?, &|v| v, c)),
                _ => None,
            },
            (Op::Sub, &[x, y]) => match (constant_value(x), constant_value(y)) {
                (Some(c), _) => Some(transformed(linear_operand(y)?, &|v| -v, c)),
                (_, Some(c)) => Some(transformed(linear_operand(x)?, &|v| v, -c)),
                _ => None,
            },
            (Op::Mul, &[x, y]) => match (constant_value(x), constant_value(y)) {
                (Some(c), _) => Some(transformed(linear_operand(y)?, &|v| v * c, zero)),
                (_, Some(c)) => Some(transformed(linear_operand(x)?, &|v| v * c, zero)),
                _ => None,
            },
            (Op::Div, &[x, y]) => {
                let c = constant_value(y)?;
                Some(transformed(linear_operand(x)?, &|v| v / c, zero))
            }
            _ => None,
        }
    }

    fn operation(&self, index: usize) -> Option<(Op, &[usize])> {
        match &self.steps[index] {
            BoxStep::Apply { op, values, .. } => Some((*op, values)),
            _ => None,
        }
    }

    /// Reports whether a number is the same at all points.
    fn is_flat(&self, index: usize) -> bool {
        super::relative::is_flat(&self.values[index])
    }
}
