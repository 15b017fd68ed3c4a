//! Pseudorandom numbers, identical on every machine.

/// Generator splitmix64, after G. Steele, D. Lea and C. Flood, *Fast Splittable Pseudorandom Number
/// Generators*, 2014.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Creates the generator of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Creates the generator of a named case, so that no case changes the numbers of another one.
    pub fn for_case(name: &str) -> Self {
        // FNV-1a, by G. Fowler, L. C. Noll and K.-P. Vo.
        let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Self(hash)
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number from 0 to `end`, exclusive, or 0 if `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() >> 11) as usize % end.max(1)
    }

    /// Returns a number from 0 to 1, exclusive, with 53 random bits.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a number from 0 to 1, exclusive, with 24 random bits.
    pub fn unit_f32(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// Returns `true` with a probability in percent.
    pub fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    /// Returns a number from −2 to 2 with three decimal digits, so that listings stay short.
    pub fn number(&mut self) -> f32 {
        (self.below(4001) as f32 - 2000.0) / 1000.0
    }

    /// Returns one element of a nonempty list.
    pub fn pick<T: Clone>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())].clone()
    }

    /// Returns a random range of at most `max_length` elements within `0..length`.
    pub fn range(&mut self, length: usize, max_length: usize) -> std::ops::Range<usize> {
        let start = self.below(length + 1);
        start..(start + self.below(max_length + 1)).min(length)
    }
}

#[cfg(test)]
mod tests {
    use super::Random;

    /// The first numbers of the reference implementation for seed 0, and a published FNV-1a hash.
    #[test]
    fn numbers_are_those_of_the_published_algorithms() {
        let mut random = Random::new(0);
        assert_eq!(random.bits(), 0xe220_a839_7b1d_cdaf);
        assert_eq!(random.bits(), 0x6e78_9e6a_a1b9_65f4);
        assert_eq!(Random::for_case("a").0, 0xaf63_dc4c_8601_ec8c);
    }

    #[test]
    fn units_fill_the_interval_without_its_end() {
        let mut random = Random::for_case("units");
        let (mut low, mut high) = (1.0_f64, 0.0_f64);
        for _ in 0..10_000 {
            for unit in [random.unit(), f64::from(random.unit_f32())] {
                (low, high) = (low.min(unit), high.max(unit));
            }
        }
        assert!((0.0..1e-3).contains(&low), "{low}");
        assert!((0.999..1.0).contains(&high), "{high}");
    }
}
