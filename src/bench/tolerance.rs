//! The cheapest setting that keeps an error, in pixels.
//!
//! A setting keeps an error of n pixels if all but a hundredth of its depths at smooth pixels are off
//! by n sides of a pixel at most, if silhouettes move by n pixels at most (as the threshold and
//! the detail promise), and if no ray wrongly hits or misses away from silhouettes or meets what is
//! not a number.

use super::study::Row;
use serde::Serialize;

/// What was taken on an engine.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Choice {
    /// The engine's name.
    pub(crate) engine: &'static str,
    /// The setting that was taken: the fastest of those that keep the error, or the nearest to the
    /// truth where none does.
    pub(crate) setting: String,
    /// How long its picture took.
    pub(crate) milliseconds: f64,
    /// How far it is off.
    pub(crate) error: Error,
    /// Whether it keeps the error.
    pub(crate) kept: bool,
}

/// How far a setting is off.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Error {
    /// All but a hundredth of the depths at smooth pixels are off by no more, in pixels.
    pub(crate) depth_pixels: f64,
    /// By how many pixels silhouettes may move.
    pub(crate) silhouette_pixels: f64,
    /// Rays that wrongly hit or miss away from silhouettes, or meet what is not a number.
    pub(crate) wrong_rays: usize,
}

impl Error {
    fn of(row: &Row) -> Self {
        let errors = &row.measured.errors;
        Self {
            depth_pixels: row.measured.depth_pixels.p99,
            silhouette_pixels: row.knobs.promised_pixels(),
            wrong_rays: errors.mismatches_inside + errors.nans,
        }
    }

    /// Whether it is no more than so many pixels.
    fn is_within(&self, pixels: f64) -> bool {
        self.depth_pixels <= pixels && self.silhouette_pixels <= pixels && self.wrong_rays == 0
    }
}

/// Takes a setting, of the rows of one engine, for an error of so many pixels; `None` of no rows.
pub(crate) fn choose(rows: &[Row], pixels: f64) -> Option<Choice> {
    let all: Vec<(f64, Error)> = rows
        .iter()
        .map(|row| (row.measured.milliseconds, Error::of(row)))
        .collect();
    let at = taken(&all, pixels)?;
    let (milliseconds, error) = all[at];
    Some(Choice {
        engine: rows[at].engine,
        setting: rows[at].setting.clone(),
        milliseconds,
        error,
        kept: error.is_within(pixels),
    })
}

/// The place of the fastest that keeps the error, or of the one with the fewest wrong rays and then
/// the least error.
fn taken(all: &[(f64, Error)], pixels: f64) -> Option<usize> {
    let kept = (0..all.len()).filter(|&at| all[at].1.is_within(pixels));
    let fastest = kept.min_by(|&a, &b| all[a].0.total_cmp(&all[b].0));
    fastest.or_else(|| {
        let worst = |at: usize| all[at].1.depth_pixels.max(all[at].1.silhouette_pixels);
        (0..all.len()).min_by(|&a, &b| {
            let wrong = |at: usize| all[at].1.wrong_rays;
            wrong(a).cmp(&wrong(b)).then(worst(a).total_cmp(&worst(b)))
        })
    })
}

/// A number of pixels above 0, with or without its unit.
pub(crate) fn pixels(text: &str) -> Result<f64, String> {
    let number = text.trim();
    let number = number.strip_suffix("px").unwrap_or(number).trim_end();
    let number = number.parse::<f64>().ok();
    let number = number.filter(|number| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "write a number of pixels above 0, such as 0.5px".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(
        milliseconds: f64,
        depth_pixels: f64,
        silhouette_pixels: f64,
        wrong: usize,
    ) -> (f64, Error) {
        let error = Error {
            depth_pixels,
            silhouette_pixels,
            wrong_rays: wrong,
        };
        (milliseconds, error)
    }

    #[test]
    fn the_fastest_that_keeps_the_error_is_taken() {
        let all = [
            entry(9.0, 0.001, 0.005, 0),
            entry(5.0, 0.002, 0.125, 0),
            entry(3.0, 0.010, 0.5, 0),
            entry(2.0, 0.900, 0.25, 0),
            entry(1.0, 0.001, 0.005, 3),
        ];
        for (pixels, place) in [(2.0, 3), (0.5, 2), (0.4, 1), (0.1, 0)] {
            assert_eq!(taken(&all, pixels), Some(place), "{pixels}");
            assert!(all[place].1.is_within(pixels), "{pixels}");
        }
        // None keeps it: the fewest wrong rays first, then the least error.
        assert_eq!(taken(&all, 1e-6), Some(0));
        assert_eq!(taken(&all[2..], 1e-6), Some(0));
        assert_eq!(taken(&[], 1.0), None);
    }

    #[test]
    fn pixels_are_written_with_or_without_their_unit() {
        for text in ["0.5", "0.5px", " 0.5 px "] {
            assert_eq!(pixels(text), Ok(0.5), "{text}");
        }
        for text in ["", "px", "0", "-1px", "inf", "nanpx", "1mm"] {
            assert!(pixels(text).is_err(), "{text}");
        }
    }
}
