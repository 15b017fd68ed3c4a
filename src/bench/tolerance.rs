//! The cheapest setting that keeps an error, in pixels.
//!
//! A setting keeps an error of n pixels if three conditions hold. The 99th percentile of its depth errors at
//! smooth pixels is at most n sides of a pixel. Silhouettes move by at most n pixels, by the bounds of the
//! threshold and the detail. No ray wrongly hits or misses away from silhouettes, or meets NaN.

use super::measure::SettingRow;
use serde::Serialize;

/// The chosen setting on an engine.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ChosenSetting {
    /// Name of the engine.
    pub(crate) engine: &'static str,
    /// The chosen setting: the fastest of those that keep the error, or the nearest to the truth where none
    /// does.
    pub(crate) setting: String,
    /// Time of its picture.
    pub(crate) milliseconds: f64,
    /// Its error.
    pub(crate) error: SettingError,
    /// True if it keeps the requested error.
    pub(crate) kept: bool,
}

/// Error of a setting.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct SettingError {
    /// 99th percentile of the depth errors at smooth pixels, in pixels.
    pub(crate) depth_pixels: f64,
    /// Bound of the displacement of silhouettes, in pixels.
    pub(crate) silhouette_pixels: f64,
    /// Number of rays that wrongly hit or miss away from silhouettes, or meet NaN.
    pub(crate) wrong_rays: usize,
}

impl SettingError {
    fn from_row(row: &SettingRow) -> Self {
        let errors = &row.measured.errors;
        Self {
            depth_pixels: row.measured.depth_pixels.p99,
            silhouette_pixels: row.knobs.silhouette_pixels_bound(),
            wrong_rays: errors.mismatches_inside + errors.nans,
        }
    }

    /// Reports whether it is at most `pixels`.
    fn is_within(&self, pixels: f64) -> bool {
        self.depth_pixels <= pixels && self.silhouette_pixels <= pixels && self.wrong_rays == 0
    }
}

/// Chooses a setting among the rows of one engine, for an error of `pixels`; `None` without rows.
pub(crate) fn choose(rows: &[SettingRow], pixels: f64) -> Option<ChosenSetting> {
    let entries: Vec<(f64, SettingError)> = rows
        .iter()
        .map(|row| (row.measured.milliseconds, SettingError::from_row(row)))
        .collect();
    let index = choose_index(&entries, pixels)?;
    let (milliseconds, error) = entries[index];
    Some(ChosenSetting {
        engine: rows[index].engine,
        setting: rows[index].setting.clone(),
        milliseconds,
        error,
        kept: error.is_within(pixels),
    })
}

/// Returns the index of the fastest setting that keeps the error. If none does, it is that of the setting
/// with the fewest wrong rays, and then the least error.
fn choose_index(entries: &[(f64, SettingError)], pixels: f64) -> Option<usize> {
    let kept = (0..entries.len()).filter(|&index| entries[index].1.is_within(pixels));
    let fastest = kept.min_by(|&a, &b| entries[a].0.total_cmp(&entries[b].0));
    fastest.or_else(|| {
        let worst = |index: usize| {
            entries[index]
                .1
                .depth_pixels
                .max(entries[index].1.silhouette_pixels)
        };
        (0..entries.len()).min_by(|&a, &b| {
            let wrong = |index: usize| entries[index].1.wrong_rays;
            wrong(a).cmp(&wrong(b)).then(worst(a).total_cmp(&worst(b)))
        })
    })
}

/// Parses a number of pixels above 0, with or without its unit.
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
    ) -> (f64, SettingError) {
        let error = SettingError {
            depth_pixels,
            silhouette_pixels,
            wrong_rays: wrong,
        };
        (milliseconds, error)
    }

    #[test]
    fn the_fastest_that_keeps_the_error_is_taken() {
        let entries = [
            entry(9.0, 0.001, 0.005, 0),
            entry(5.0, 0.002, 0.125, 0),
            entry(3.0, 0.010, 0.5, 0),
            entry(2.0, 0.900, 0.25, 0),
            entry(1.0, 0.001, 0.005, 3),
        ];
        for (pixels, index) in [(2.0, 3), (0.5, 2), (0.4, 1), (0.1, 0)] {
            assert_eq!(choose_index(&entries, pixels), Some(index), "{pixels}");
            assert!(entries[index].1.is_within(pixels), "{pixels}");
        }
        // None keeps it: the fewest wrong rays first, then the least error.
        assert_eq!(choose_index(&entries, 1e-6), Some(0));
        assert_eq!(choose_index(&entries[2..], 1e-6), Some(0));
        assert_eq!(choose_index(&[], 1.0), None);
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
