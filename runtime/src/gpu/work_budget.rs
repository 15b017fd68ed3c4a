//! Size of submissions to a GPU: as much work as takes [`TARGET_SUBMISSION_SECONDS`] at the measured speed.
//!
//! A driver may reset a device that does not respond for two seconds, and users need progress reports. A
//! software driver is a thousand times slower than a graphics card. Each submission's duration therefore
//! bounds the device's evaluation rate from both sides, and the size of the next submission follows from the
//! rate.

/// Target duration of a submission, in seconds.
const TARGET_SUBMISSION_SECONDS: f64 = 0.2;
/// Evaluations per second assumed before the first measurement: the slowest device with one of the longest
/// scenes.
const INITIAL_RATE: f64 = 2e4;
/// Size of the first tile, in pixels.
const FIRST_TILE_PIXELS: u64 = 64 * 64;
/// Size of the smallest tile, in pixels. Fewer pixels leave lanes empty and save no time.
const MIN_TILE_PIXELS: u64 = 32 * 32;

/// Measured speed of a device with a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorkBudget {
    /// Evaluations of the distance per second.
    per_second: f64,
    is_measured: bool,
}

impl Default for WorkBudget {
    fn default() -> Self {
        Self {
            per_second: INITIAL_RATE,
            is_measured: false,
        }
    }
}

impl WorkBudget {
    /// Returns the number of evaluations that each of `invocations` may do, at least one.
    pub(super) fn evaluations_per_invocation(&self, invocations: u64, max_evaluations: u32) -> u32 {
        let per_invocation =
            self.per_second * TARGET_SUBMISSION_SECONDS / invocations.max(1) as f64;
        (per_invocation as u32).clamp(1, max_evaluations.max(1))
    }

    /// Returns the maximum size of a tile, in pixels, for a stage that costs `weight` evaluations per pixel.
    pub(super) fn tile_pixels(&self, weight: u32) -> u64 {
        if !self.is_measured {
            return FIRST_TILE_PIXELS;
        }
        ((self.per_second * TARGET_SUBMISSION_SECONDS / f64::from(weight.max(1))) as u64)
            .max(MIN_TILE_PIXELS)
    }

    /// Records the duration of a submission that did at least `min_evaluations` and at most
    /// `max_evaluations`.
    pub(super) fn observe(&mut self, min_evaluations: u64, max_evaluations: u64, seconds: f64) {
        let seconds = seconds.max(1e-6);
        let (low, high) = (
            min_evaluations as f64 / seconds,
            max_evaluations as f64 / seconds,
        );
        self.per_second = self.per_second.clamp(low, high.max(low)).max(1.0);
        self.is_measured = true;
    }

    /// Records that all stages of a tile together did this many evaluations in this time. Dispatches that
    /// finish all their rays give no lower bound of the rate by themselves.
    pub(super) fn observe_at_least(&mut self, evaluations: u64, seconds: f64) {
        self.per_second = self.per_second.max(evaluations as f64 / seconds.max(1e-6));
    }

    /// Records the duration of a submission of a whole tile. A duration over twice the target lowers the
    /// rate.
    pub(super) fn observe_tile(&mut self, seconds: f64) {
        if seconds > 2.0 * TARGET_SUBMISSION_SECONDS {
            self.per_second = (self.per_second * TARGET_SUBMISSION_SECONDS / seconds).max(1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_follows_the_measured_speed() {
        let mut budget = WorkBudget::default();
        assert_eq!(budget.tile_pixels(1), FIRST_TILE_PIXELS);
        assert_eq!(
            budget.evaluations_per_invocation(FIRST_TILE_PIXELS, 1000),
            1
        );
        // A million evaluations in a tenth of a second, all of them certain.
        budget.observe(1_000_000, 1_000_000, 0.1);
        assert_eq!(budget.tile_pixels(1), 2_000_000);
        assert_eq!(budget.tile_pixels(20), 100_000);
        assert_eq!(budget.evaluations_per_invocation(4096, 1000), 488);
        assert_eq!(
            budget.evaluations_per_invocation(4096, 100),
            100,
            "the loop's own limit"
        );
        assert_eq!(budget.evaluations_per_invocation(1 << 40, 100), 1);
        // Most rays ended early in the dispatch: the bounds are too wide to change the rate.
        budget.observe(10_000, 2_000_000, 0.1);
        assert_eq!(budget.tile_pixels(1), 2_000_000);
        // The whole tile took as long as two million evaluations at the measured speed, and did four million.
        let mut faster = budget;
        faster.observe_at_least(4_000_000, 0.2);
        assert_eq!(faster.tile_pixels(1), 4_000_000);
        faster.observe_at_least(1_000_000, 0.2);
        assert_eq!(faster.tile_pixels(1), 4_000_000);
        // The device became slower.
        budget.observe(0, 1000, 1.0);
        assert_eq!(budget.tile_pixels(1), MIN_TILE_PIXELS);
        assert_eq!(budget.evaluations_per_invocation(100, 1000), 2);
    }
}
