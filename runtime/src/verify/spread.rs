//! How a list of differences is spread.

use serde::Serialize;
use std::fmt;

/// The middle, two high percentiles and the largest of some numbers that are not negative.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// How many there are.
    pub count: usize,
    /// Half of them are at most this.
    pub p50: f64,
    /// All but a hundredth of them are at most this.
    pub p99: f64,
    /// All but a thousandth of them are at most this.
    pub p999: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// Of these numbers; what is not a number counts as larger than all others.
    pub fn of(mut numbers: Vec<f64>) -> Self {
        numbers.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * numbers.len() as f64).ceil() as usize;
            numbers.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
        };
        Self {
            count: numbers.len(),
            p50: at(0.5),
            p99: at(0.99),
            p999: at(0.999),
            max: at(1.0),
        }
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "half {:.3e}, 99.9 % {:.3e}, all {:.3e}",
            self.p50, self.p999, self.max
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_members_of_the_list() {
        let spread = Spread::of((0..1000).rev().map(f64::from).collect());
        assert_eq!((spread.p50, spread.p99), (499.0, 989.0));
        assert_eq!((spread.p999, spread.max), (998.0, 999.0));
        assert_eq!(Spread::of(vec![]), Spread::default());
        assert!(Spread::of(vec![f64::NAN, 1.0]).max.is_nan());
    }
}
