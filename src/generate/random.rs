//! Pseudorandom numbers that are the same on every machine.

/// A generator: splitmix64, after G. Steele, D. Lea and C. Flood, *Fast Splittable Pseudorandom Number
/// Generators*, 2014.
pub(super) struct SplitMix(u64);

impl SplitMix {
    /// Returns the generator of a seed.
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns a number in [0, 1).
    pub(super) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a number between two.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Points that fill the unit cube evenly for any count: the additive recurrence of M. Roberts, *The
/// Unreasonable Effectiveness of Quasirandom Sequences*, 2018, from a random start.
pub(super) struct EvenPoints([f64; 3]);

impl EvenPoints {
    /// Returns the points of a random start.
    pub(super) fn new(random: &mut SplitMix) -> Self {
        Self(std::array::from_fn(|_| random.unit()))
    }
}

impl Iterator for EvenPoints {
    type Item = [f64; 3];
    fn next(&mut self) -> Option<[f64; 3]> {
        /// The root of x⁴ = x + 1; the increments are its inverse powers.
        const ROOT: f64 = 1.220_744_084_605_759_5;
        for (axis, coordinate) in (1..).zip(&mut self.0) {
            *coordinate = (*coordinate + ROOT.powi(-axis)).fract();
        }
        Some(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_seed_always_gives_the_same_numbers() {
        // The first output of the published generator for the seed 0 is 0xe220a8397b1dcdaf.
        let first = SplitMix::new(0).unit();
        assert_eq!(
            first,
            (0xe220_a839_7b1d_cdaf_u64 >> 11) as f64 / (1_u64 << 53) as f64
        );
        let mut random = SplitMix::new(7);
        assert!((0..1000).all(|_| (2.0..3.0).contains(&random.between(2.0, 3.0))));
    }

    #[test]
    fn even_points_keep_apart() {
        let points: Vec<_> = EvenPoints::new(&mut SplitMix::new(1))
            .take(500)
            .map(DVec3::from)
            .collect();
        let pairs = points.iter().enumerate();
        let nearest = pairs
            .flat_map(|(i, a)| points[..i].iter().map(move |b| a.distance(*b)))
            .fold(f64::INFINITY, f64::min);
        // A regular grid of 500 points has them 0.126 apart.
        assert!(nearest > 0.04, "{nearest}");
    }
}
