//! Where a number repeats along an axis: it meets that coordinate in nothing but sines and cosines of
//! exact multiples of it. A search through boxes need not look at more than one period then.
//!
//! Nothing is rounded on the way to a period: what is no exact multiple is taken not to repeat.

use super::{BoxNumber, OverBox, Step};
use sdfc_vm::table::Op;
use std::f64::consts::TAU;

/// How a number depends on a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Along {
    /// Not at all.
    Nothing,
    /// It is a multiple of it, and something that does not depend on it.
    Linear(f64),
    /// It repeats, so many times in 2π.
    Periodic(f64),
    /// In some other way.
    Otherwise,
}

impl Along {
    /// A function of two numbers.
    pub(crate) fn with(self, other: Self) -> Self {
        match (self, other) {
            (Self::Nothing, Self::Periodic(f)) | (Self::Periodic(f), Self::Nothing) => {
                Self::Periodic(f)
            }
            (Self::Nothing, Self::Nothing) => Self::Nothing,
            (Self::Periodic(a), Self::Periodic(b)) => Self::Periodic(common(a, b)),
            _ => Self::Otherwise,
        }
    }

    /// The sine or cosine of it.
    fn wave(self) -> Self {
        match self {
            Self::Linear(factor) => Self::Periodic(factor.abs()),
            other => other,
        }
    }

    /// As many times it; `None` is an unknown number that does not depend on the coordinate.
    fn times(self, by: Option<f64>) -> Self {
        match (self, by) {
            (Self::Linear(factor), Some(by)) => {
                let product = factor * by;
                let is_exact = factor.mul_add(by, -product) == 0.0 && product.is_normal();
                if is_exact {
                    Self::Linear(product)
                } else {
                    Self::Otherwise
                }
            }
            (Self::Linear(_), None) => Self::Otherwise,
            (other, _) => other,
        }
    }

    /// Their sum or difference.
    fn plus(self, other: Self) -> Self {
        match (self, other) {
            (Self::Linear(factor), Self::Nothing) => Self::Linear(factor),
            // The sign of what is taken away is lost: a sine repeats as often with either.
            (Self::Nothing, Self::Linear(factor)) => Self::Linear(factor),
            _ => self.with(other),
        }
    }

    /// A range of the coordinate in which the number is all that it is in this one.
    pub(crate) fn enough_of(self, range: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Nothing => [0.0, 0.0],
            Self::Periodic(frequency) => {
                // A little more than 2π, which is no number of the machine.
                let end = TAU / frequency * (1.0 + 1e-9);
                if end < range[1] - range[0] {
                    [0.0, end]
                } else {
                    range
                }
            }
            Self::Linear(_) | Self::Otherwise => range,
        }
    }
}

/// The largest number that both are whole multiples of, by Euclid; remainders are exact.
fn common(a: f64, b: f64) -> f64 {
    if b == 0.0 { a } else { common(b, a % b) }
}

impl<R: OverBox> BoxNumber<R> {
    /// How the number depends on the coordinates of its point.
    pub(crate) fn along(&self) -> [Along; 3] {
        let mut found: Vec<[Along; 3]> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let of = std::array::from_fn(|axis| self.along_axis(step, axis, &found));
            found.push(of);
        }
        found.last().copied().unwrap_or([Along::Nothing; 3])
    }

    /// The same of a step and an axis, from what was found of the steps before.
    fn along_axis(&self, step: &Step<R>, axis: usize, found: &[[Along; 3]]) -> Along {
        match step {
            Step::Known(_) | Step::Ranged(_) => Along::Nothing,
            Step::Coordinate(of) if *of == axis => Along::Linear(1.0),
            Step::Coordinate(_) => Along::Nothing,
            Step::Length(values) => together(values, axis, found),
            Step::TimesSquare(pair) => together(pair, axis, found),
            Step::Apply {
                op, point, values, ..
            } => {
                let of = |place: usize| found[place][axis];
                let number = |place: usize| {
                    let range = self.known(place)?;
                    (range.lo == range.hi).then_some(range.lo)
                };
                match (op, values.as_slice()) {
                    (Op::Sin | Op::Cos, &[a]) => of(a).wave(),
                    (Op::Add | Op::Sub, &[a, b]) => of(a).plus(of(b)),
                    (Op::Neg, &[a]) => of(a).times(Some(-1.0)),
                    (Op::Mul, &[a, b]) if of(a) == Along::Nothing => of(b).times(number(a)),
                    (Op::Mul, &[a, b]) if of(b) == Along::Nothing => of(a).times(number(b)),
                    _ => together(point.iter().flatten().chain(values), axis, found),
                }
            }
        }
    }
}

/// A function of the numbers at these places.
fn together<'a>(
    places: impl IntoIterator<Item = &'a usize>,
    axis: usize,
    found: &[[Along; 3]],
) -> Along {
    let along = places.into_iter().map(|&place| found[place][axis]);
    along.fold(Along::Nothing, Along::with)
}

#[cfg(test)]
mod tests {
    use super::{Along, common};
    use std::f64::consts::TAU;

    #[test]
    fn the_common_frequency_divides_both_exactly() {
        assert_eq!(common(20.0, 8.0), 4.0);
        assert_eq!(common(7.5, 2.5), 2.5);
        let f = common(0.1, 0.3);
        assert_eq!((0.1 % f, 0.3 % f), (0.0, 0.0));
    }

    #[test]
    fn a_period_is_enough_of_a_longer_range() {
        let repeated = Along::Periodic(2.0);
        let [start, end] = repeated.enough_of([-10.0, 10.0]);
        assert!(start == 0.0 && end > TAU / 2.0 && end < TAU / 2.0 + 1e-8);
        assert_eq!(
            repeated.enough_of([f64::NEG_INFINITY, f64::INFINITY]),
            [start, end]
        );
        assert_eq!(repeated.enough_of([5.0, 6.0]), [5.0, 6.0]);
        assert_eq!(Along::Otherwise.enough_of([0.0, 9.0]), [0.0, 9.0]);
        assert_eq!(Along::Nothing.enough_of([-1.0, 9.0]), [0.0, 0.0]);
    }

    #[test]
    fn what_is_not_exact_does_not_repeat() {
        let x = Along::Linear(1.0);
        assert_eq!(x.times(Some(3.0)).wave(), Along::Periodic(3.0));
        assert_eq!(x.times(Some(0.1)).times(Some(0.3)), Along::Otherwise);
        assert_eq!(x.with(Along::Nothing), Along::Otherwise);
        assert_eq!(x.plus(x), Along::Otherwise);
        assert_eq!(x.plus(Along::Nothing).wave(), Along::Periodic(1.0));
    }
}
