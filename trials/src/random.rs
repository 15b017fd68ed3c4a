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
