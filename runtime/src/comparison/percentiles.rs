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
    pub fn from_values(values: Vec<f64>) -> Self {
        Self::from_weighted(values.into_iter().map(|value| (value, 1.0)).collect())
    }

    /// Computes the percentiles of values, each with a number of values that it stands for. NaN counts as
    /// larger than all others.
    pub fn from_weighted(mut values: Vec<(f64, f64)>) -> Self {
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut total = 0.0;
        let sums: Vec<f64> = values
            .iter()
            .map(|(_, weight)| {
                total += weight;
                total
            })
            .collect();
        let percentile = |fraction: f64| {
            let rank = sums.partition_point(|sum| *sum < fraction * total);
            let value = values.get(rank).or(values.last());
            value.map_or(0.0, |(value, _)| *value)
        };
        Self {
            count: values.len(),
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

    #[test]
    fn a_weight_counts_as_that_many_values() {
        let weighted = Percentiles::from_weighted(vec![(3.0, 1.0), (1.0, 90.0), (2.0, 9.0)]);
        let mut values = vec![1.0; 90];
        values.extend([2.0; 9]);
        values.push(3.0);
        let single = Percentiles::from_values(values);
        assert_eq!(weighted, Percentiles { count: 3, ..single });
    }
}
