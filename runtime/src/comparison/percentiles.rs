//! Percentiles of a list of differences.

use serde::Serialize;
use std::fmt;

/// Median, two high percentiles and maximum of non-negative numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Percentiles {
    /// Number of values.
    pub count: usize,
    /// The median.
    pub p50: f64,
    /// The 99th percentile.
    pub p99: f64,
    /// The 99.9th percentile.
    pub p999: f64,
    /// The maximum.
    pub max: f64,
}

impl Percentiles {
    /// Computes the percentiles of values; NaN counts as larger than all others.
    pub fn from_values(mut numbers: Vec<f64>) -> Self {
        numbers.sort_by(f64::total_cmp);
        let percentile = |fraction: f64| {
            let rank = (fraction * numbers.len() as f64).ceil() as usize;
            numbers.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
        };
        Self {
            count: numbers.len(),
            p50: percentile(0.5),
            p99: percentile(0.99),
            p999: percentile(0.999),
            max: percentile(1.0),
        }
    }
}

impl fmt::Display for Percentiles {
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
        let spread = Percentiles::from_values((0..1000).rev().map(f64::from).collect());
        assert_eq!((spread.p50, spread.p99), (499.0, 989.0));
        assert_eq!((spread.p999, spread.max), (998.0, 999.0));
        assert_eq!(Percentiles::from_values(vec![]), Percentiles::default());
        assert!(Percentiles::from_values(vec![f64::NAN, 1.0]).max.is_nan());
    }
}
