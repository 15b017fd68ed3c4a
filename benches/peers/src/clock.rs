//! Timing of a piece of work, and the median of several times.

use std::time::Instant;

/// Runs work, and returns its result and its time in milliseconds.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let result = work();
    (result, started.elapsed().as_secs_f64() * 1e3)
}

/// Returns the median of times, which is the mean of the middle two of an even number, or 0 of none.
pub(crate) fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        count => (sorted[(count - 1) / 2] + sorted[count / 2]) / 2.0,
    }
}

/// Returns the median time of a piece of work in milliseconds, after one run that does not count.
///
/// It runs `rounds` times, or fewer if these take longer than `max_seconds`.
pub(crate) fn repeated(
    rounds: usize,
    max_seconds: f64,
    mut work: impl FnMut() -> Result<(), String>,
) -> Result<f64, String> {
    let (result, first) = timed(&mut work);
    result?;
    let mut times = Vec::new();
    let mut spent_ms = first;
    while times.len() < rounds && spent_ms < max_seconds * 1e3 {
        let (result, time) = timed(&mut work);
        result?;
        times.push(time);
        spent_ms += time;
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
