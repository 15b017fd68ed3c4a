//! Bounds on the length of a gradient in a box. Where the number contains lengths they are tighter than a
//! bound by components. The direction of a vector near zero is arbitrary, so each component of the gradient
//! of its length may be 1. The length of that gradient is still at most 1.

use super::relative::is_flat;
use super::{BoxNumber, BoxStep, relative};
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use sdfc_vm::row::SlopeRule;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::f64::consts::LOG2_E;

/// Minimum magnitude of a divisor.
const MIN_DIVISOR: f64 = 1e-18;

impl BoxNumber<Dual<Interval>> {
    /// Returns a bound on the length of the gradient in the last evaluated box.
    pub(crate) fn gradient_norm_bound(&self) -> f64 {
        let last = self.values.last().map_or(f64::INFINITY, norm_by_components);
        if !self.has_norms {
            return last;
        }
        let count = self.steps.len();
        let mut norms: Vec<f64> = Vec::with_capacity(count);
        let mut relative_norms: Vec<f64> = Vec::with_capacity(count);
        for (index, (step, value)) in self.steps.iter().zip(&self.values).enumerate() {
            let mut norm = self.norm(step, &norms).min(norm_by_components(value));
            if let Some(blend) = self.blend_norm(index, &norms) {
                norm = blend.min(norm);
            }
            let mut relative_norm = f64::INFINITY;
            if let Some(gradient) = self.relative[index] {
                let size = value.value;
                relative_norm = relative::norm(step, &self.values, &norms, &relative_norms)
                    .min(length(gradient))
                    .min(if size.lo > 0.0 {
                        norm / size.lo
                    } else {
                        f64::INFINITY
                    });
                norm = product(relative_norm, size.hi).min(norm);
            }
            norm = match step {
                BoxStep::Apply {
                    op: Op::Ln, values, ..
                } => relative_norms[values[0]].min(norm),
                BoxStep::Apply {
                    op: Op::Log2,
                    values,
                    ..
                } => (relative_norms[values[0]] * LOG2_E).min(norm),
                _ => norm,
            };
            norms.push(norm);
            relative_norms.push(relative_norm);
        }
        norms.last().copied().unwrap_or(last)
    }

    /// Returns a bound on a step's gradient length, by the norms of its operands.
    fn norm(&self, step: &BoxStep<Dual<Interval>>, norms: &[f64]) -> f64 {
        let size = |index: usize| self.values[index].value.magnitude();
        match step {
            BoxStep::Length(vector) => self.stretch(vector, norms),
            BoxStep::TimesSquare([a, b]) => {
                let (number, factor) = (size(*a), size(*b));
                product(norms[*a], factor * factor) + product(2.0 * number * factor, norms[*b])
            }
            BoxStep::Apply {
                op, values, point, ..
            } => match (op, values.as_slice()) {
                (Op::Neg | Op::Abs, &[a]) => norms[a],
                (Op::Add | Op::Sub, &[a, b]) => norms[a] + norms[b],
                (Op::Min | Op::Max, &[a, b]) => norms[a].max(norms[b]),
                (Op::Mul, &[a, b]) => product(size(a), norms[b]) + product(size(b), norms[a]),
                (Op::Div, &[a, b]) => {
                    let min_divisor = self.values[b].value.abs().lo.max(MIN_DIVISOR);
                    (norms[a] + product(size(a) / min_divisor, norms[b])) / min_divisor
                }
                // The cubic is steepest at its midpoint.
                (Op::Smoothstep, &[low, high, a])
                    if is_flat(&self.values[low]) && is_flat(&self.values[high]) =>
                {
                    let width = self.values[high].value.lo - self.values[low].value.hi;
                    product(1.5 / width.max(MIN_DIVISOR), norms[a])
                }
                _ => match (op.row().facts.slope, point) {
                    (SlopeRule::Constant(slope), Some(point)) => {
                        product(slope, self.stretch(point, norms))
                    }
                    _ => f64::INFINITY,
                },
            },
            BoxStep::Known(_) | BoxStep::Input(_) | BoxStep::Coordinate(_) => f64::INFINITY,
        }
    }

    /// Returns a bound on the stretch of a map of the point to these numbers, by the norms of their
    /// gradients. The stretch is the root of the largest eigenvalue of the matrix of the gradients' dot
    /// products. That is at most the largest absolute row sum (S. Gershgorin, 1931). Gradients along
    /// different axes have a zero product.
    fn stretch(&self, vector: &[usize], norms: &[f64]) -> f64 {
        let gradients = vector.iter().map(|&index| {
            let gradient = self.values[index].gradient;
            let components = [gradient.x, gradient.y, gradient.z].map(Interval::magnitude);
            (components, norms[index])
        });
        let gradients: Vec<([f64; 3], f64)> = gradients.collect();
        let sum = |(a, (components, norm)): (usize, &([f64; 3], f64))| {
            let others = gradients.iter().enumerate().filter(|&(b, _)| a != b);
            let products = others.map(|(_, (other_components, length))| {
                let by_components =
                    (0..3).map(|axis| product(components[axis], other_components[axis]));
                by_components.sum::<f64>().min(product(*norm, *length))
            });
            norm * norm + products.sum::<f64>()
        };
        let max_row_sum = gradients.iter().enumerate().map(sum).fold(0.0, f64::max);
        // Rounded up.
        max_row_sum.sqrt() * (1.0 + 1e-12)
    }
}

/// Returns the largest product of numbers up to these. 0 · ∞ is 0, since an infinite bound means
/// "arbitrarily large".
fn product(a: f64, b: f64) -> f64 {
    match a == 0.0 || b == 0.0 {
        true => 0.0,
        false => a * b,
    }
}

/// Returns a bound on the length of a gradient by its components alone.
fn norm_by_components(value: &Dual<Interval>) -> f64 {
    length(value.gradient)
}

/// Returns the largest length of a vector with components in these ranges.
fn length(gradient: V3<Interval>) -> f64 {
    let squares = [gradient.x, gradient.y, gradient.z].map(|v| v.magnitude().powi(2));
    squares.iter().sum::<f64>().sqrt()
}
