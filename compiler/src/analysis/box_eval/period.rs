//! Periods of a number along the axes. A number is periodic along an axis if the coordinate occurs only
//! in sines and cosines of exact multiples of it. A search through boxes then covers one period only.
//!
//! No step of the derivation of a period may round: a multiple that is not exact counts as not
//! periodic.

use super::{BoxNumber, BoxStep, BoxValue};
use sdfc_vm::table::Op;
use std::f64::consts::TAU;

/// Dependence of a number on a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum AxisDependence {
    /// No dependence.
    Independent,
    /// A multiple of the coordinate, plus a number that does not depend on it.
    Linear(f64),
    /// Periodic, with this frequency per 2π.
    Periodic(f64),
    /// Any other dependence.
    Other,
}

impl AxisDependence {
    /// Returns the dependence of a function of two numbers.
    pub(crate) fn with(self, other: Self) -> Self {
        match (self, other) {
            (Self::Independent, Self::Periodic(f)) | (Self::Periodic(f), Self::Independent) => {
                Self::Periodic(f)
            }
            (Self::Independent, Self::Independent) => Self::Independent,
            (Self::Periodic(a), Self::Periodic(b)) => Self::Periodic(common_divisor(a, b)),
            _ => Self::Other,
        }
    }

    /// Returns the dependence of the sine or cosine.
    fn wave(self) -> Self {
        match self {
            Self::Linear(factor) => Self::Periodic(factor.abs()),
            other => other,
        }
    }

    /// Returns the dependence of a multiple; `None` is an unknown factor that does not depend on the
    /// coordinate.
    fn times(self, factor_by: Option<f64>) -> Self {
        match (self, factor_by) {
            (Self::Linear(factor), Some(factor_by)) => {
                let product = factor * factor_by;
                let is_exact = factor.mul_add(factor_by, -product) == 0.0 && product.is_normal();
                if is_exact {
                    Self::Linear(product)
                } else {
                    Self::Other
                }
            }
            (Self::Linear(_), None) => Self::Other,
            (other, _) => other,
        }
    }

    /// Returns the dependence of the sum or difference.
    fn plus(self, other: Self) -> Self {
        match (self, other) {
            (Self::Linear(factor), Self::Independent) => Self::Linear(factor),
            // The sign of a subtrahend is lost: a sine has the same period with either.
            (Self::Independent, Self::Linear(factor)) => Self::Linear(factor),
            _ => self.with(other),
        }
    }

    /// Returns a range of the coordinate on which the number takes all values that it takes on this
    /// one.
    pub(crate) fn one_period(self, range: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Independent => [0.0, 0.0],
            Self::Periodic(frequency) => {
                // Slightly more than 2π, which is not a floating-point number.
                let end = TAU / frequency * (1.0 + 1e-9);
                if end < range[1] - range[0] {
                    [0.0, end]
                } else {
                    range
                }
            }
            Self::Linear(_) | Self::Other => range,
        }
    }
}

/// Returns the largest number of which both are integer multiples, by Euclid's algorithm; remainders
/// are exact.
fn common_divisor(a: f64, b: f64) -> f64 {
    if b == 0.0 {
        a
    } else {
        common_divisor(b, a % b)
    }
}

impl<R: BoxValue> BoxNumber<R> {
    /// Returns the dependence of the number on the coordinates of its point.
    pub(crate) fn axis_dependence(&self) -> [AxisDependence; 3] {
        let mut dependences: Vec<[AxisDependence; 3]> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let dependence =
                std::array::from_fn(|axis| self.step_dependence(step, axis, &dependences));
            dependences.push(dependence);
        }
        dependences
            .last()
            .copied()
            .unwrap_or([AxisDependence::Independent; 3])
    }

    /// Returns the dependence of a step on an axis, given those of the steps before.
    fn step_dependence(
        &self,
        step: &BoxStep<R>,
        axis: usize,
        dependences: &[[AxisDependence; 3]],
    ) -> AxisDependence {
        match step {
            BoxStep::Known(_) | BoxStep::Input(_) => AxisDependence::Independent,
            BoxStep::Coordinate(coordinate) if *coordinate == axis => AxisDependence::Linear(1.0),
            BoxStep::Coordinate(_) => AxisDependence::Independent,
            BoxStep::Length(values) => function_dependence(values, axis, dependences),
            BoxStep::TimesSquare(pair) => function_dependence(pair, axis, dependences),
            BoxStep::Apply {
                op, point, values, ..
            } => {
                let dependence = |index: usize| dependences[index][axis];
                let number = |index: usize| {
                    let range = self.constant_range(index)?;
                    (range.lo == range.hi).then_some(range.lo)
                };
                match (op, values.as_slice()) {
                    (Op::Sin | Op::Cos, &[a]) => dependence(a).wave(),
                    (Op::Add | Op::Sub, &[a, b]) => dependence(a).plus(dependence(b)),
                    (Op::Neg, &[a]) => dependence(a).times(Some(-1.0)),
                    (Op::Mul, &[a, b]) if dependence(a) == AxisDependence::Independent => {
                        dependence(b).times(number(a))
                    }
                    (Op::Mul, &[a, b]) if dependence(b) == AxisDependence::Independent => {
                        dependence(a).times(number(b))
                    }
                    _ => {
                        function_dependence(point.iter().flatten().chain(values), axis, dependences)
                    }
                }
            }
        }
    }
}

/// Returns the dependence of a function of the numbers at these indices.
fn function_dependence<'a>(
    indices: impl IntoIterator<Item = &'a usize>,
    axis: usize,
    dependences: &[[AxisDependence; 3]],
) -> AxisDependence {
    let dependence = indices.into_iter().map(|&index| dependences[index][axis]);
    dependence.fold(AxisDependence::Independent, AxisDependence::with)
}

#[cfg(test)]
mod tests {
    use super::{AxisDependence, common_divisor};
    use std::f64::consts::TAU;

    #[test]
    fn the_common_frequency_divides_both_exactly() {
        assert_eq!(common_divisor(20.0, 8.0), 4.0);
        assert_eq!(common_divisor(7.5, 2.5), 2.5);
        let f = common_divisor(0.1, 0.3);
        assert_eq!((0.1 % f, 0.3 % f), (0.0, 0.0));
    }

    #[test]
    fn a_period_is_enough_of_a_longer_range() {
        let repeated = AxisDependence::Periodic(2.0);
        let [start, end] = repeated.one_period([-10.0, 10.0]);
        assert!(start == 0.0 && end > TAU / 2.0 && end < TAU / 2.0 + 1e-8);
        assert_eq!(
            repeated.one_period([f64::NEG_INFINITY, f64::INFINITY]),
            [start, end]
        );
        assert_eq!(repeated.one_period([5.0, 6.0]), [5.0, 6.0]);
        assert_eq!(AxisDependence::Other.one_period([0.0, 9.0]), [0.0, 9.0]);
        assert_eq!(
            AxisDependence::Independent.one_period([-1.0, 9.0]),
            [0.0, 0.0]
        );
    }

    #[test]
    fn inexact_frequencies_have_no_period() {
        let x = AxisDependence::Linear(1.0);
        assert_eq!(x.times(Some(3.0)).wave(), AxisDependence::Periodic(3.0));
        assert_eq!(x.times(Some(0.1)).times(Some(0.3)), AxisDependence::Other);
        assert_eq!(x.with(AxisDependence::Independent), AxisDependence::Other);
        assert_eq!(x.plus(x), AxisDependence::Other);
        assert_eq!(
            x.plus(AxisDependence::Independent).wave(),
            AxisDependence::Periodic(1.0)
        );
    }
}
