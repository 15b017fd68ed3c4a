//! How long a gradient can be in a box: less than its components allow one by one where the number is made
//! of lengths. The direction of a vector near zero may be any, so each component of the gradient of
//! its length may be 1, but its length is no more than 1, either.

use super::{BoxNumber, Step};
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

impl BoxNumber<Dual<Interval>> {
    /// A bound on the length of the gradient in the box that was last looked at.
    pub(crate) fn steepest(&self) -> f64 {
        let last = self.values.last().map_or(f64::INFINITY, by_components);
        if !self
            .steps
            .iter()
            .any(|step| matches!(step, Step::Length(_)))
        {
            return last;
        }
        let mut norms: Vec<f64> = Vec::with_capacity(self.steps.len());
        for (step, value) in self.steps.iter().zip(&self.values) {
            let norm = self.norm(step, &norms).min(by_components(value));
            norms.push(norm);
        }
        norms.last().copied().unwrap_or(last)
    }

    /// What the norms of what it is computed from say of a step's.
    fn norm(&self, step: &Step<Dual<Interval>>, norms: &[f64]) -> f64 {
        let size = |at: usize| self.values[at].value.magnitude();
        match step {
            Step::Length(vector) => self.stretch(vector),
            Step::TimesSquare([a, b]) => {
                let (number, factor) = (size(*a), size(*b));
                norms[*a] * factor * factor + 2.0 * number * factor * norms[*b]
            }
            Step::Apply { op, values, .. } => match (op, values.as_slice()) {
                (Op::Neg | Op::Abs, &[a]) => norms[a],
                (Op::Add | Op::Sub, &[a, b]) => norms[a] + norms[b],
                (Op::Min | Op::Max, &[a, b]) => norms[a].max(norms[b]),
                // 0 · ∞ is not a number, and the components decide.
                (Op::Mul, &[a, b]) => size(a) * norms[b] + size(b) * norms[a],
                _ => f64::INFINITY,
            },
            Step::Known(_) | Step::Ranged(_) | Step::Coordinate(_) => f64::INFINITY,
        }
    }

    /// How much a map of the point to these numbers stretches: the root of its largest sum along a row times
    /// that along a column, which is no less than its spectral norm.
    fn stretch(&self, vector: &[usize]) -> f64 {
        let rows = vector.iter().map(|&at| {
            let gradient = self.values[at].gradient;
            [gradient.x, gradient.y, gradient.z].map(Interval::magnitude)
        });
        let (mut row, mut columns) = (0.0_f64, [0.0_f64; 3]);
        for of in rows {
            row = row.max(of.iter().sum());
            columns = std::array::from_fn(|axis| columns[axis] + of[axis]);
        }
        let column = columns.into_iter().fold(0.0, f64::max);
        // Rounded up.
        (row * column).sqrt() * (1.0 + 1e-12)
    }
}

/// How long a gradient can be by its components alone.
fn by_components(value: &Dual<Interval>) -> f64 {
    let gradient = value.gradient;
    let squares = [gradient.x, gradient.y, gradient.z].map(|v| v.magnitude().powi(2));
    squares.iter().sum::<f64>().sqrt()
}
