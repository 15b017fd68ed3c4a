//! How long a gradient can be in a box: less than its components allow one by one where the number is made
//! of lengths. The direction of a vector near zero may be any, so each component of the gradient of
//! its length may be 1, but its length is no more than 1, either.

use super::relative::is_flat;
use super::{BoxNumber, Step, relative};
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use sdfc_vm::row::Slope;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::f64::consts::LOG2_E;

/// The least magnitude of a divisor.
const LEAST_DIVISOR: f64 = 1e-18;

impl BoxNumber<Dual<Interval>> {
    /// A bound on the length of the gradient in the box that was last looked at.
    pub(crate) fn steepest(&self) -> f64 {
        let last = self.values.last().map_or(f64::INFINITY, by_components);
        if !self.has_norms {
            return last;
        }
        let count = self.steps.len();
        let mut norms: Vec<f64> = Vec::with_capacity(count);
        let mut relative_norms: Vec<f64> = Vec::with_capacity(count);
        for (at, (step, value)) in self.steps.iter().zip(&self.values).enumerate() {
            let mut norm = self.norm(step, &norms).min(by_components(value));
            if let Some(blend) = self.blend_norm(at, &norms) {
                norm = blend.min(norm);
            }
            let mut relative_norm = f64::INFINITY;
            if let Some(gradient) = self.relative[at] {
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
                Step::Apply {
                    op: Op::Ln, values, ..
                } => relative_norms[values[0]].min(norm),
                Step::Apply {
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

    /// What the norms of what it is computed from say of a step's.
    fn norm(&self, step: &Step<Dual<Interval>>, norms: &[f64]) -> f64 {
        let size = |at: usize| self.values[at].value.magnitude();
        match step {
            Step::Length(vector) => self.stretch(vector, norms),
            Step::TimesSquare([a, b]) => {
                let (number, factor) = (size(*a), size(*b));
                product(norms[*a], factor * factor) + product(2.0 * number * factor, norms[*b])
            }
            Step::Apply {
                op, values, point, ..
            } => match (op, values.as_slice()) {
                (Op::Neg | Op::Abs, &[a]) => norms[a],
                (Op::Add | Op::Sub, &[a, b]) => norms[a] + norms[b],
                (Op::Min | Op::Max, &[a, b]) => norms[a].max(norms[b]),
                (Op::Mul, &[a, b]) => product(size(a), norms[b]) + product(size(b), norms[a]),
                (Op::Div, &[a, b]) => {
                    let least = self.values[b].value.abs().lo.max(LEAST_DIVISOR);
                    (norms[a] + product(size(a) / least, norms[b])) / least
                }
                // The cubic is steepest in its middle.
                (Op::Smoothstep, &[low, high, a])
                    if is_flat(&self.values[low]) && is_flat(&self.values[high]) =>
                {
                    let width = self.values[high].value.lo - self.values[low].value.hi;
                    product(1.5 / width.max(LEAST_DIVISOR), norms[a])
                }
                _ => match (op.row().meta.slope, point) {
                    (Slope::Constant(slope), Some(point)) => {
                        product(slope, self.stretch(point, norms))
                    }
                    _ => f64::INFINITY,
                },
            },
            Step::Known(_) | Step::Ranged(_) | Step::Coordinate(_) => f64::INFINITY,
        }
    }

    /// A bound on the stretch of a map of the point to these numbers, by the norms of their gradients: the root of the
    /// largest eigenvalue of the gradients' products with each other. That is no more than the largest sum along a row
    /// of these (S. Gershgorin, 1931). Gradients along different axes have no product.
    fn stretch(&self, vector: &[usize], norms: &[f64]) -> f64 {
        let gradients = vector.iter().map(|&at| {
            let gradient = self.values[at].gradient;
            let parts = [gradient.x, gradient.y, gradient.z].map(Interval::magnitude);
            (parts, norms[at])
        });
        let gradients: Vec<([f64; 3], f64)> = gradients.collect();
        let sum = |(a, (parts, norm)): (usize, &([f64; 3], f64))| {
            let others = gradients.iter().enumerate().filter(|&(b, _)| a != b);
            let products = others.map(|(_, (other, length))| {
                let by_parts = (0..3).map(|axis| product(parts[axis], other[axis]));
                by_parts.sum::<f64>().min(product(*norm, *length))
            });
            norm * norm + products.sum::<f64>()
        };
        let most = gradients.iter().enumerate().map(sum).fold(0.0, f64::max);
        // Rounded up.
        most.sqrt() * (1.0 + 1e-12)
    }
}

/// The greatest product of numbers up to these: 0 · ∞ is 0, since the infinite end stands for "however large".
fn product(a: f64, b: f64) -> f64 {
    match a == 0.0 || b == 0.0 {
        true => 0.0,
        false => a * b,
    }
}

/// How long a gradient can be by its components alone.
fn by_components(value: &Dual<Interval>) -> f64 {
    length(value.gradient)
}

/// The greatest length of a vector with components in these ranges.
fn length(gradient: V3<Interval>) -> f64 {
    let squares = [gradient.x, gradient.y, gradient.z].map(|v| v.magnitude().powi(2));
    squares.iter().sum::<f64>().sqrt()
}
