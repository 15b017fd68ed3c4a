//! How much work goes into one submission: as much as takes a moment, by what was measured before.
//!
//! A driver may reset a device that does not answer for two seconds, a person wants to see
//! progress, and a software driver is a thousand times slower than a graphics card. So the rate at
//! which a device evaluates a scene is bounded from both sides by every submission's time, and the
//! next one's size follows from it.

/// How long a submission should take, in seconds.
const MOMENT: f64 = 0.2;
/// Evaluations per second that are assumed before anything is measured: the slowest device with
/// one of the longest scenes.
const CAUTIOUS: f64 = 2e4;
/// Pixels of the first tile.
const FIRST_TILE: u64 = 64 * 64;
/// Pixels of the smallest tile: fewer leave lanes empty and make it no faster.
const SMALLEST_TILE: u64 = 32 * 32;

/// What is known of a device's speed with a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rate {
    /// Evaluations of the distance per second.
    per_second: f64,
    known: bool,
}

impl Default for Rate {
    fn default() -> Self {
        Self {
            per_second: CAUTIOUS,
            known: false,
        }
    }
}

impl Rate {
    /// How many evaluations each of so many invocations may do; one at least.
    pub(super) fn budget(&self, invocations: u64, most: u32) -> u32 {
        let each = self.per_second * MOMENT / invocations.max(1) as f64;
        (each as u32).clamp(1, most.max(1))
    }

    /// How many pixels a tile may have when a stage works as long as `weight` evaluations on each.
    pub(super) fn pixels(&self, weight: u32) -> u64 {
        if !self.known {
            return FIRST_TILE;
        }
        ((self.per_second * MOMENT / f64::from(weight.max(1))) as u64).max(SMALLEST_TILE)
    }

    /// A submission took so long, in which at least `least` and at most `most` evaluations were
    /// done.
    pub(super) fn learn(&mut self, least: u64, most: u64, seconds: f64) {
        let seconds = seconds.max(1e-6);
        let (low, high) = (least as f64 / seconds, most as f64 / seconds);
        self.per_second = self.per_second.clamp(low, high.max(low)).max(1.0);
        self.known = true;
    }

    /// A submission of a whole tile took so long: if that was more than a moment, tiles were too
    /// large.
    pub(super) fn took(&mut self, seconds: f64) {
        if seconds > 2.0 * MOMENT {
            self.per_second = (self.per_second * MOMENT / seconds).max(1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_follows_the_measured_speed() {
        let mut rate = Rate::default();
        assert_eq!(rate.pixels(1), FIRST_TILE);
        assert_eq!(rate.budget(FIRST_TILE, 1000), 1);
        // A million evaluations in a tenth of a second, all of them certain.
        rate.learn(1_000_000, 1_000_000, 0.1);
        assert_eq!(rate.pixels(1), 2_000_000);
        assert_eq!(rate.pixels(20), 100_000);
        assert_eq!(rate.budget(4096, 1000), 488);
        assert_eq!(rate.budget(4096, 100), 100, "the loop's own limit");
        assert_eq!(rate.budget(1 << 40, 100), 1);
        // Most rays ended somewhere in the dispatch: this says nothing new.
        rate.learn(10_000, 2_000_000, 0.1);
        assert_eq!(rate.pixels(1), 2_000_000);
        // A device that became slower.
        rate.learn(0, 1000, 1.0);
        assert_eq!(rate.pixels(1), SMALLEST_TILE);
        assert_eq!(rate.budget(100, 1000), 2);
    }
}
