//! One setting on one engine: how long a picture takes, and how far it is from the truth.

use sdfc_runtime::engine::{Engine, EngineError};
use sdfc_runtime::frame::{Frame, RenderSettings, View};
use sdfc_runtime::perceptual::{Difference, difference};
use sdfc_runtime::reference::{Camera, Errors, Outcome, Place, Truth, compare};
use sdfc_runtime::verify::Spread;
use serde::Serialize;
use std::time::{Duration, Instant};

/// What pictures of a scene are held against.
pub(crate) struct Measure {
    /// Where its rays end.
    pub(crate) truth: Truth,
    /// The bytes of the picture with the finest settings.
    pub(crate) finest: Vec<u8>,
}

/// What was measured of a setting.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Measured {
    /// The median time of a picture.
    pub(crate) milliseconds: f64,
    /// How long the first one took, with all kernels that were compiled for it.
    pub(crate) first_milliseconds: f64,
    /// Evaluations of the field per pixel: along rays, for normals, shadows and occlusion.
    pub(crate) evaluations: f64,
    /// Those along the rays of pixels alone.
    pub(crate) ray_evaluations: f64,
    /// How far depths are off at smooth pixels, in sides of the pixel there.
    pub(crate) depth_pixels: Spread,
    /// How many rays met nothing as far as they go, where the scene goes on.
    pub(crate) at_far: u64,
    /// How the picture differs, to a person, from the one with the finest settings.
    pub(crate) picture: Difference,
    /// How it differs from the truth.
    pub(crate) errors: Errors,
}

/// Rounds of a setting end early when they have taken this long together.
const PATIENCE: Duration = Duration::from_secs(4);
/// How far the eye moves between two pictures that are timed, as a share of the way to what it looks
/// at.
const NUDGE: f64 = 1e-4;

impl Measure {
    /// Draws what the engine has loaded, once for its errors and `rounds` times for its time.
    pub(crate) fn of(
        &self,
        engine: &mut dyn Engine,
        settings: &RenderSettings,
        rounds: usize,
    ) -> Result<Measured, EngineError> {
        let (frame, first) = timed(|| engine.render(settings, &|_| {}));
        let frame = frame?;
        let (mut times, started) = (Vec::new(), Instant::now());
        for round in 0..rounds.max(1) {
            if round > 0 && started.elapsed() > PATIENCE {
                break;
            }
            let settings = nudged(settings, round + 1);
            let (frame, time) = timed(|| engine.render(&settings, &|_| {}));
            frame?;
            times.push(time);
        }
        let pixels = frame.depth.len().max(1) as f64;
        let steps: u64 = frame.steps.iter().map(|&steps| u64::from(steps)).sum();
        let differences = difference(frame.width, &self.finest, &frame.rgba8());
        Ok(Measured {
            milliseconds: median(times),
            first_milliseconds: first,
            evaluations: frame.stats.evaluations as f64 / pixels,
            ray_evaluations: steps as f64 / pixels,
            depth_pixels: self.in_pixels(&frame, settings),
            at_far: frame.stats.at_far,
            picture: Difference::of(&differences),
            errors: compare(&self.truth, &frame),
        })
    }

    /// How far depths are off, at smooth pixels where both hit, in sides of a pixel.
    fn in_pixels(&self, frame: &Frame, settings: &RenderSettings) -> Spread {
        let camera = Camera::of(settings);
        let rays = self.truth.rays.iter().zip(&self.truth.places);
        let apart = rays
            .zip(&frame.depth)
            .filter_map(|((ray, place), &depth)| match ray.outcome {
                Outcome::Hit { t0, t1 } if *place == Place::Smooth && depth.is_finite() => {
                    let middle = t0 + (t1 - t0) / 2.0;
                    let side = 2.0 * camera.half_pixel(middle);
                    Some((f64::from(depth) - middle).abs() / side)
                }
                _ => None,
            });
        Spread::of(apart.collect())
    }
}

/// The same picture from a place that is hardly another.
fn nudged(settings: &RenderSettings, times: usize) -> RenderSettings {
    let view = settings.view;
    let way: f64 = (0..3).map(|i| (view.look[i] - view.from[i]).powi(2)).sum();
    let by = way.sqrt() * NUDGE * times as f64;
    RenderSettings {
        view: View {
            from: view.from.map(|v| v + by),
            ..view
        },
        ..settings.clone()
    }
}

/// What work gives, and how many milliseconds it took.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let result = work();
    (result, started.elapsed().as_secs_f64() * 1e3)
}

/// The middle one of some numbers, or the mean of the two; 0 of none.
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
