//! Selects the resolution of the next picture. Moving scenes are drawn coarsely enough to meet a time
//! budget. At rest they are refined in steps up to the scene's sample count.

use std::time::Duration;

/// Time budget of a picture during motion; it allows 30 pictures per second.
const MOTION_FRAME_BUDGET: Duration = Duration::from_millis(28);
/// Maximum number of screen pixels along each side of a coarse pixel.
const MAX_COARSE_PIXEL: u32 = 8;
/// Side of a coarse pixel, in screen pixels, before any render time is known.
const DEFAULT_COARSE_PIXEL: u32 = 4;
/// Time after the last movement during which the scene still counts as moving.
pub(super) const REST_DELAY: Duration = Duration::from_millis(180);
/// Weight of the newest picture in the running estimate of the time per ray.
const NEWEST_WEIGHT: f64 = 0.5;

/// Refinement stage of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefinementStage {
    /// One ray per square of N × N screen pixels.
    Coarse(u32),
    /// One ray per pixel: the first sample of the fine picture.
    Full,
    /// All samples that the scene requests: those missing from the full picture are added to it.
    Fine,
}

impl RefinementStage {
    /// Returns the order of the stages; finer ones are larger.
    fn rank(self) -> u32 {
        match self {
            Self::Coarse(_) => 0,
            Self::Full => 1,
            Self::Fine => 2,
        }
    }

    /// Reports whether a picture of this stage is finished soon, however slow the scene is.
    pub(crate) fn is_coarse(self) -> bool {
        self.rank() == 0
    }

    /// Returns the picture size for an area of `size` screen pixels.
    pub fn size(self, size: [u32; 2]) -> [u32; 2] {
        match self {
            Self::Coarse(factor) => size.map(|side| side.div_ceil(factor)),
            Self::Full | Self::Fine => size,
        }
    }
}

/// Running estimate of the time per ray on one engine.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RayCost {
    /// Estimated seconds per ray; `None` before the first picture.
    seconds_per_ray: Option<f64>,
}

impl RayCost {
    /// Updates the estimate with the measured time of a picture.
    pub(crate) fn observe(&mut self, rays: u64, time: Duration) {
        let seconds_per_ray = time.as_secs_f64() / rays.max(1) as f64;
        self.seconds_per_ray = Some(match self.seconds_per_ray {
            Some(previous) => previous + NEWEST_WEIGHT * (seconds_per_ray - previous),
            None => seconds_per_ray,
        });
    }

    /// Estimates the time of `rays` rays.
    pub(crate) fn estimate(&self, rays: u64) -> Option<Duration> {
        let seconds = self.seconds_per_ray? * rays as f64;
        Duration::try_from_secs_f64(seconds).ok()
    }

    /// Returns the first stage of a new view, for an area of `size` screen pixels.
    fn first_stage(&self, size: [u32; 2]) -> RefinementStage {
        let rays = |factor: u32| {
            let [w, h] = RefinementStage::Coarse(factor).size(size);
            u64::from(w) * u64::from(h)
        };
        if self.seconds_per_ray.is_none() {
            return RefinementStage::Coarse(DEFAULT_COARSE_PIXEL);
        }
        let fits = |factor: &u32| {
            self.estimate(rays(*factor))
                .is_some_and(|time| time <= MOTION_FRAME_BUDGET)
        };
        match (1..=MAX_COARSE_PIXEL).find(fits) {
            Some(1) => RefinementStage::Full,
            Some(factor) => RefinementStage::Coarse(factor),
            None => RefinementStage::Coarse(MAX_COARSE_PIXEL),
        }
    }

    /// Returns the next stage to draw, if any. `displayed` is the finest stage of the current view so
    /// far, `samples` the number of samples along each side of a pixel.
    pub(crate) fn next_stage(
        &self,
        displayed: Option<RefinementStage>,
        size: [u32; 2],
        samples: u32,
        is_moving: bool,
    ) -> Option<RefinementStage> {
        let first_stage = self.first_stage(size);
        match displayed {
            None => Some(first_stage),
            Some(_) if is_moving => None,
            Some(displayed) => {
                let finer = match displayed {
                    RefinementStage::Coarse(_) => RefinementStage::Full,
                    RefinementStage::Full => RefinementStage::Fine,
                    RefinementStage::Fine => return None,
                };
                (finer.rank() < RefinementStage::Fine.rank() || samples > 1).then_some(finer)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEFAULT_SIZE: [u32; 2] = [640, 360];

    #[test]
    fn fast_scenes_are_drawn_in_full_at_once() {
        let mut ray_cost = RayCost::default();
        ray_cost.observe(640 * 360, Duration::from_millis(20));
        assert_eq!(
            ray_cost.next_stage(None, DEFAULT_SIZE, 1, true),
            Some(RefinementStage::Full)
        );
        assert_eq!(
            ray_cost.next_stage(Some(RefinementStage::Full), DEFAULT_SIZE, 1, false),
            None
        );
        let fine_stage = ray_cost.next_stage(Some(RefinementStage::Full), DEFAULT_SIZE, 2, false);
        assert_eq!(fine_stage, Some(RefinementStage::Fine));
    }

    #[test]
    fn slow_scenes_are_coarse_in_motion_and_refined_at_rest() {
        let mut ray_cost = RayCost::default();
        ray_cost.observe(640 * 360, Duration::from_millis(400));
        let first_stage = ray_cost.next_stage(None, DEFAULT_SIZE, 2, true).unwrap();
        let RefinementStage::Coarse(factor) = first_stage else {
            panic!("{first_stage:?}");
        };
        let [w, h] = first_stage.size(DEFAULT_SIZE);
        let time = ray_cost.estimate(u64::from(w * h)).unwrap();
        assert!(time <= MOTION_FRAME_BUDGET, "{time:?}");
        let [w, h] = RefinementStage::Coarse(factor - 1).size(DEFAULT_SIZE);
        let finer = ray_cost.estimate(u64::from(w * h)).unwrap();
        assert!(finer > MOTION_FRAME_BUDGET, "no coarser than it must be");
        assert_eq!(
            ray_cost.next_stage(Some(first_stage), DEFAULT_SIZE, 2, true),
            None
        );
        assert_eq!(
            ray_cost.next_stage(Some(first_stage), DEFAULT_SIZE, 2, false),
            Some(RefinementStage::Full)
        );
        let fine_stage = ray_cost.next_stage(Some(RefinementStage::Full), DEFAULT_SIZE, 2, false);
        assert_eq!(fine_stage, Some(RefinementStage::Fine));
        assert_eq!(
            ray_cost.next_stage(Some(RefinementStage::Fine), DEFAULT_SIZE, 2, false),
            None
        );
    }
}
