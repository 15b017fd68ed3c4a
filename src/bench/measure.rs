//! One setting on one engine: the time of a picture, and its error.

use super::variants::RenderSettingsVariant;
use sdfc_runtime::comparison::Percentiles;
use sdfc_runtime::engine::{Engine, EngineError};
use sdfc_runtime::perceptual::{PerceptualDifference, pixel_differences};
use sdfc_runtime::reference::{
    GroundTruth, Outcome, PictureErrors, PixelClass, ReferenceCamera, compare,
};
use sdfc_runtime::render::{Image, RenderSettings, View};
use serde::Serialize;
use std::time::{Duration, Instant};

/// The truth and the picture with which others of a scene are compared.
pub(crate) struct Baseline {
    /// The ends of its rays.
    pub(crate) truth: GroundTruth,
    /// Bytes of the picture with the finest settings.
    pub(crate) finest: Vec<u8>,
}

/// Measurements of a setting.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Measurement {
    /// Median time of a picture.
    pub(crate) milliseconds: f64,
    /// Time of the first one, with the compilation of its kernels.
    pub(crate) first_milliseconds: f64,
    /// Evaluations of the field per pixel: along rays, for normals, shadows and occlusion.
    pub(crate) evaluations: f64,
    /// Those along the rays of pixels alone.
    pub(crate) ray_evaluations: f64,
    /// Errors of depths at smooth pixels, in sides of the pixel there.
    pub(crate) depth_pixels: Percentiles,
    /// Number of rays without a hit up to their maximum length, where the scene continues.
    pub(crate) at_far: u64,
    /// Perceptual difference of the picture from the one with the finest settings.
    pub(crate) picture: PerceptualDifference,
    /// Errors relative to the truth.
    pub(crate) errors: PictureErrors,
}

/// Total duration after which no further rounds of a setting begin.
const MAX_TIMING_DURATION: Duration = Duration::from_secs(2);
/// Shift of the camera between two timed pictures, as a fraction of the distance to its target.
const CAMERA_SHIFT_FRACTION: f64 = 1e-4;

impl Baseline {
    /// Draws the loaded scene, once for its errors and `rounds` times for its time.
    pub(crate) fn measure(
        &self,
        engine: &mut dyn Engine,
        settings: &RenderSettings,
        rounds: usize,
    ) -> Result<Measurement, EngineError> {
        let (frame, first) = timed(|| engine.render(settings, &|_| {}));
        let frame = frame?;
        let (mut times, started) = (Vec::new(), Instant::now());
        for round in 0..rounds.max(1) {
            if round > 0 && started.elapsed() > MAX_TIMING_DURATION {
                break;
            }
            let settings = shift_camera(settings, round + 1);
            let (frame, time) = timed(|| engine.render(&settings, &|_| {}));
            frame?;
            times.push(time);
        }
        let pixels = frame.depth.len().max(1) as f64;
        let steps: u64 = frame.steps.iter().map(|&steps| u64::from(steps)).sum();
        let differences = pixel_differences(frame.width, &self.finest, &frame.rgba8());
        Ok(Measurement {
            milliseconds: median(times),
            first_milliseconds: first,
            evaluations: frame.stats.evaluations as f64 / pixels,
            ray_evaluations: steps as f64 / pixels,
            depth_pixels: self.depth_errors_in_pixels(&frame, settings),
            at_far: frame.stats.at_far,
            picture: PerceptualDifference::from_pixels(&differences),
            errors: compare(&self.truth, &frame),
        })
    }

    /// Returns the errors of depths, at smooth pixels where both hit, in sides of a pixel.
    fn depth_errors_in_pixels(&self, image: &Image, settings: &RenderSettings) -> Percentiles {
        let camera = ReferenceCamera::new(settings);
        let smooth = self.truth.pixels.iter().filter_map(|pixel| {
            let depth = *image.depth.get(pixel.index)?;
            match pixel.ray.outcome {
                Outcome::Hit { t0, t1 }
                    if pixel.class == PixelClass::Smooth && depth.is_finite() =>
                {
                    let middle = t0 + (t1 - t0) / 2.0;
                    let side = 2.0 * camera.half_pixel(middle);
                    Some(((f64::from(depth) - middle).abs() / side, pixel.weight))
                }
                _ => None,
            }
        });
        Percentiles::from_weighted(smooth.collect())
    }
}

/// Returns the same picture from a slightly shifted camera.
fn shift_camera(settings: &RenderSettings, count: usize) -> RenderSettings {
    let view = settings.view;
    let shift = view.target_distance() * CAMERA_SHIFT_FRACTION * count as f64;
    RenderSettings {
        view: View {
            from: view.from.map(|v| v + shift),
            ..view
        },
        ..settings.clone()
    }
}

/// Returns the result of work, and its duration in milliseconds.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let result = work();
    (result, started.elapsed().as_secs_f64() * 1e3)
}

/// Returns the median of numbers, or 0 without any.
pub(crate) fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    match numbers.len() {
        0 => 0.0,
        count => (numbers[(count - 1) / 2] + numbers[count / 2]) / 2.0,
    }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn the_middle_of_numbers() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(vec![]), 0.0);
    }
}

/// A setting on an engine.
#[derive(Debug, Serialize)]
pub(crate) struct SettingRow {
    /// Name of the engine.
    pub(crate) engine: &'static str,
    /// Differences of the setting from the default.
    pub(crate) setting: String,
    /// True for the default of the scene.
    pub(crate) default: bool,
    /// The complete setting.
    pub(crate) knobs: RenderSettingsVariant,
    /// True if nothing on this engine is both faster and nearer to the truth.
    pub(crate) front_of_time: bool,
    /// True if nothing on this engine takes fewer evaluations and is nearer to the truth.
    pub(crate) front_of_evaluations: bool,
    /// The measurements.
    #[serde(flatten)]
    pub(crate) measured: Measurement,
}

impl SettingRow {
    /// Returns the error of the fronts: the 99th percentile of depth errors, as a fraction of the depth,
    /// silhouettes included.
    pub(crate) fn error(&self) -> f64 {
        self.measured.errors.depth.p99
    }
}
