//! Blends written by hand, `mix(b, a, h)` with `h = clamp(0.5 + (b - a) / (2 * k), 0, 1)`: the weight changes
//! only where the two numbers are near each other.
//!
//! In a large box the two may be far apart and the weight may change, but not at the same point. The term
//! `k * h * (1 - h)`, which such blends subtract, cancels what the weight's change adds.

use super::{BoxNumber, Step};
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// A mean of two numbers: `first + (second - first) * weight`.
struct Mean {
    first: usize,
    second: usize,
    weight: usize,
}

/// A number as a multiple of a difference of two others, and a constant.
struct Linear {
    constant: Interval,
    factor: Interval,
}

/// The ends of a weight.
const ENDS: [f64; 2] = [0.0, 1.0];

impl BoxNumber<Dual<Interval>> {
    /// A bound on the length of the gradient of a blend by hand.
    pub(super) fn blend_norm(&self, at: usize, norms: &[f64]) -> Option<f64> {
        if let Some(mean) = self.mean(at) {
            return self.mean_norm(&mean, None, norms);
        }
        let Step::Apply { op, values, .. } = &self.steps[at] else {
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
        orders.iter().find_map(|&[mean, rest]| {
            let mean = self.mean(values[mean])?;
            let bulge = self.bulge(values[rest], mean.weight)? * Interval::point(sign);
            self.mean_norm(&mean, Some(bulge), norms)
        })
    }

    /// A bound for a mean, with a term `bulge * weight * (1 - weight)` added.
    fn mean_norm(&self, mean: &Mean, bulge: Option<Interval>, norms: &[f64]) -> Option<f64> {
        let &Mean {
            first,
            second,
            weight,
        } = mean;
        let operands = norms[first].max(norms[second]);
        let (changes, gap) = match &self.steps[weight] {
            Step::Apply {
                op: Op::Clamp,
                values,
                ..
            } => {
                let &[inner, low, high] = values.as_slice() else {
                    return None;
                };
                let ends = [low, high].map(|end| self.values[end].value);
                if ends != ENDS.map(Interval::point) {
                    return None;
                }
                let Linear { constant, factor } = self.linear(inner, [second, first])?;
                // The difference and the bulge's change are linear in the weight: the ends decide.
                let at_end = |end: f64| {
                    let weight = Interval::point(end);
                    let slope = Interval::point(1.0) - weight * Interval::point(2.0);
                    let gap = (weight - constant) / factor;
                    (gap + bulge.unwrap_or(Interval::point(0.0)) * slope).magnitude()
                };
                (norms[inner], at_end(0.0).max(at_end(1.0)))
            }
            Step::Apply {
                op: Op::Smoothstep,
                values,
                ..
            } if bulge.is_none() => {
                let &[low, high, inner] = values.as_slice() else {
                    return None;
                };
                let [low, high] = [low, high].map(|end| self.values[end].value);
                let Linear { constant, factor } = self.linear(inner, [second, first])?;
                let gap = (low.hull(high) - constant) / factor;
                (norms[weight], gap.magnitude())
            }
            _ => return None,
        };
        Some(operands + changes * gap)
    }

    /// The mean that a step computes, in one of the forms in which it is written.
    fn mean(&self, at: usize) -> Option<Mean> {
        let of = |at: usize| self.operation(at);
        let (op, values) = of(at)?;
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
        let product = |at: usize| match of(at)? {
            (Op::Mul, &[a, b]) => Some([a, b]),
            _ => None,
        };
        let orders = [[0, 1], [1, 0]].map(|order| order.map(|at| values[at]));
        orders.into_iter().find_map(|[one, other]| {
            let pairs = |pair: [usize; 2]| [pair, [pair[1], pair[0]]];
            let other = pairs(product(other)?);
            // `a + (b - a) * t`.
            let short = other.into_iter().find_map(|[difference, weight]| {
                let (op, values) = of(difference)?;
                (op == Op::Sub && values[1] == one).then(|| mean(one, values[0], weight))
            });
            // `a * (1 - t) + b * t`.
            short.or_else(|| {
                let one = pairs(product(one)?);
                one.into_iter().find_map(|[first, rest]| {
                    let weight = self.complement(rest)?;
                    let second = other.iter().find(|pair| pair[1] == weight)?[0];
                    Some(mean(first, second, weight))
                })
            })
        })
    }

    /// The factor `k` of a product `k * weight * (1 - weight)`, in any order.
    fn bulge(&self, at: usize, weight: usize) -> Option<Interval> {
        let mut factors = vec![at];
        let (mut scale, mut weights, mut complements) = (Interval::point(1.0), 0, 0);
        while let Some(at) = factors.pop() {
            if at == weight {
                weights += 1;
            } else if self.complement(at) == Some(weight) {
                complements += 1;
            } else if self.is_flat(at) {
                scale = scale * self.values[at].value;
            } else if let (Op::Mul, values) = self.operation(at)? {
                factors.extend(values);
            } else {
                return None;
            }
        }
        (weights == 1 && complements == 1).then_some(scale)
    }

    /// The number whose difference from one a step is.
    fn complement(&self, at: usize) -> Option<usize> {
        match self.operation(at)? {
            (Op::Sub, &[one, weight]) => {
                (self.values[one].value == Interval::point(1.0)).then_some(weight)
            }
            _ => None,
        }
    }

    /// A step as a linear function of the difference of two others.
    fn linear(&self, at: usize, [a, b]: [usize; 2]) -> Option<Linear> {
        let zero = Interval::point(0.0);
        let (op, values) = self.operation(at)?;
        let with = |inner: Linear, f: &dyn Fn(Interval) -> Interval, more: Interval| Linear {
            constant: f(inner.constant) + more,
            factor: f(inner.factor),
        };
        let inner = |at: usize| self.linear(at, [a, b]);
        let flat = |at: usize| self.is_flat(at).then(|| self.values[at].value);
        match (op, values) {
            (Op::Sub, &[x, y]) if [x, y] == [a, b] || [y, x] == [a, b] => Some(Linear {
                constant: zero,
                factor: Interval::point(if x == a { 1.0 } else { -1.0 }),
            }),
            (Op::Neg, &[x]) => Some(with(inner(x)?, &|v| -v, zero)),
            (Op::Add, &[x, y]) => match (flat(x), flat(y)) {
                (Some(c), _) => Some(with(inner(y)?, &|v| v, c)),
                (_, Some(c)) => Some(with(inner(x)?, &|v| v, c)),
                _ => None,
            },
            (Op::Sub, &[x, y]) => match (flat(x), flat(y)) {
                (Some(c), _) => Some(with(inner(y)?, &|v| -v, c)),
                (_, Some(c)) => Some(with(inner(x)?, &|v| v, -c)),
                _ => None,
            },
            (Op::Mul, &[x, y]) => match (flat(x), flat(y)) {
                (Some(c), _) => Some(with(inner(y)?, &|v| v * c, zero)),
                (_, Some(c)) => Some(with(inner(x)?, &|v| v * c, zero)),
                _ => None,
            },
            (Op::Div, &[x, y]) => {
                let c = flat(y)?;
                Some(with(inner(x)?, &|v| v / c, zero))
            }
            _ => None,
        }
    }

    fn operation(&self, at: usize) -> Option<(Op, &[usize])> {
        match &self.steps[at] {
            Step::Apply { op, values, .. } => Some((*op, values)),
            _ => None,
        }
    }

    /// Reports whether a number is the same at all points.
    fn is_flat(&self, at: usize) -> bool {
        super::relative::is_flat(&self.values[at])
    }
}
