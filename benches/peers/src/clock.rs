//! Times: of one piece of work, and the median of several.

use std::time::Instant;

/// What work gives, and how many milliseconds it took.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let result = work();
    (result, started.elapsed().as_secs_f64() * 1e3)
}

/// The middle one of some times, or the mean of the two; 0 of none.
pub(crate) fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        count => (sorted[(count - 1) / 2] + sorted[count / 2]) / 2.0,
    }
}

/// The median of the times of a piece of work, after one run that does not count: as many as asked
/// for, or fewer where they take longer than `patience` seconds.
pub(crate) fn repeated(
    rounds: usize,
    patience: f64,
    mut work: impl FnMut() -> Result<(), String>,
) -> Result<f64, String> {
    let (result, first) = timed(&mut work);
    result?;
    let mut times = Vec::new();
    let mut spent = first;
    while times.len() < rounds && spent < patience * 1e3 {
        let (result, time) = timed(&mut work);
        result?;
        times.push(time);
        spent += time;
    }
    Ok(if times.is_empty() {
        first
    } else {
        median(&times)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_times() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(&[]), 0.0);
    }
}
