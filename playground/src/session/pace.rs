//! How fine the next picture is: coarse enough to be there at once while something moves, then finer
//! in steps until it is as fine as the scene asks for.

use std::time::Duration;

/// How long a picture may take while something moves: what leaves 30 of them in a second.
const BUDGET: Duration = Duration::from_millis(28);
/// The most screen pixels along each side of a coarse picture's pixel.
const COARSEST: u32 = 8;
/// What is taken where nothing was drawn yet.
const UNKNOWN: u32 = 4;
/// How long after the last movement something still moves.
pub(super) const REST: Duration = Duration::from_millis(180);
/// The weight of the newest picture in what a ray takes.
const NEWEST: f64 = 0.5;

/// How fine a picture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// One ray for so many pixels along each side.
    Coarse(u32),
    /// One ray a pixel: the first of those of a fine picture.
    Full,
    /// As many rays a pixel as the scene asks for: those that a full picture lacks, added to it.
    Fine,
}

impl Stage {
    /// How far it has come: a finer one is larger.
    fn rank(self) -> u32 {
        match self {
            Self::Coarse(_) => 0,
            Self::Full => 1,
            Self::Fine => 2,
        }
    }

    /// Whether it is soon done, however slow the scene is.
    pub(crate) fn is_coarse(self) -> bool {
        self.rank() == 0
    }

    /// The size of its picture in a space of `size` pixels.
    pub fn size(self, size: [u32; 2]) -> [u32; 2] {
        match self {
            Self::Coarse(by) => size.map(|side| side.div_ceil(by)),
            Self::Full | Self::Fine => size,
        }
    }
}

/// What a ray takes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pace {
    /// Seconds for a ray, as far as is known.
    ray: Option<f64>,
}

impl Pace {
    /// A picture of so many rays took so long.
    pub(crate) fn took(&mut self, rays: u64, time: Duration) {
        let ray = time.as_secs_f64() / rays.max(1) as f64;
        self.ray = Some(match self.ray {
            Some(before) => before + NEWEST * (ray - before),
            None => ray,
        });
    }

    /// How long so many rays would take.
    pub(crate) fn estimate(&self, rays: u64) -> Option<Duration> {
        let seconds = self.ray? * rays as f64;
        Duration::try_from_secs_f64(seconds).ok()
    }

    /// The first picture of something new, in a space of `size` pixels.
    fn first(&self, size: [u32; 2]) -> Stage {
        let rays = |by: u32| {
            let [w, h] = Stage::Coarse(by).size(size);
            u64::from(w) * u64::from(h)
        };
        if self.ray.is_none() {
            return Stage::Coarse(UNKNOWN);
        }
        let fits = |by: &u32| self.estimate(rays(*by)).is_some_and(|time| time <= BUDGET);
        match (1..=COARSEST).find(fits) {
            Some(1) => Stage::Full,
            Some(by) => Stage::Coarse(by),
            None => Stage::Coarse(COARSEST),
        }
    }

    /// The picture to draw next, if any: `done` is the finest one there is of what is to be seen, and
    /// `samples` how many rays the scene asks for along each side of a pixel.
    pub(crate) fn next(
        &self,
        done: Option<Stage>,
        size: [u32; 2],
        samples: u32,
        moves: bool,
    ) -> Option<Stage> {
        let first = self.first(size);
        match done {
            None => Some(first),
            Some(_) if moves => None,
            Some(done) => {
                let more = match done {
                    Stage::Coarse(_) => Stage::Full,
                    Stage::Full => Stage::Fine,
                    Stage::Fine => return None,
                };
                (more.rank() < Stage::Fine.rank() || samples > 1).then_some(more)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [640, 360];

    #[test]
    fn what_is_fast_is_drawn_in_full_at_once() {
        let mut pace = Pace::default();
        pace.took(640 * 360, Duration::from_millis(20));
        assert_eq!(pace.next(None, SIZE, 1, true), Some(Stage::Full));
        assert_eq!(pace.next(Some(Stage::Full), SIZE, 1, false), None);
        let fine = pace.next(Some(Stage::Full), SIZE, 2, false);
        assert_eq!(fine, Some(Stage::Fine));
    }

    #[test]
    fn what_is_slow_is_coarse_while_it_moves_and_refined_at_rest() {
        let mut pace = Pace::default();
        pace.took(640 * 360, Duration::from_millis(400));
        let first = pace.next(None, SIZE, 2, true).unwrap();
        let Stage::Coarse(by) = first else {
            panic!("{first:?}");
        };
        let [w, h] = first.size(SIZE);
        let time = pace.estimate(u64::from(w * h)).unwrap();
        assert!(time <= BUDGET, "{time:?}");
        let [w, h] = Stage::Coarse(by - 1).size(SIZE);
        let finer = pace.estimate(u64::from(w * h)).unwrap();
        assert!(finer > BUDGET, "no coarser than it must be");
        assert_eq!(pace.next(Some(first), SIZE, 2, true), None);
        assert_eq!(pace.next(Some(first), SIZE, 2, false), Some(Stage::Full));
        let fine = pace.next(Some(Stage::Full), SIZE, 2, false);
        assert_eq!(fine, Some(Stage::Fine));
        assert_eq!(pace.next(Some(Stage::Fine), SIZE, 2, false), None);
    }
}
