//! The constants of a program on their way into its pool.

use crate::program::Patch;
use std::collections::HashMap;

/// A number on its way into the pool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoolNumber {
    /// Its value; for one that follows the parameters, the present one.
    pub value: f32,
    /// The uniform result that it follows.
    pub output: Option<u32>,
}

impl From<f32> for PoolNumber {
    fn from(value: f32) -> Self {
        Self {
            value,
            output: None,
        }
    }
}

/// Collects constants by fours and shares equal runs.
#[derive(Default)]
pub struct PoolBuilder {
    pool: Vec<[f32; 4]>,
    patches: Vec<Patch>,
    known: HashMap<Vec<(u32, Option<u32>)>, u32>,
}

impl PoolBuilder {
    /// The index of these numbers, which are added unless they are there already.
    pub fn add(&mut self, numbers: &[PoolNumber]) -> u32 {
        let key: Vec<_> = numbers
            .iter()
            .map(|n| (n.value.to_bits(), n.output))
            .collect();
        // A number that follows the parameters is known by what it follows, whatever it is now.
        let key: Vec<_> = key
            .into_iter()
            .map(|(v, o)| if o.is_some() { (0, o) } else { (v, o) })
            .collect();
        if let Some(&index) = self.known.get(&key) {
            return index;
        }
        let index = self.pool.len() as u32;
        for chunk in numbers.chunks(4) {
            let mut four = [0.0; 4];
            for (slot, n) in four.iter_mut().zip(chunk) {
                *slot = n.value;
            }
            self.pool.push(four);
        }
        for (at, n) in numbers.iter().enumerate() {
            if let Some(output) = n.output {
                self.patches.push(Patch {
                    at: index * 4 + at as u32,
                    output,
                });
            }
        }
        self.known.insert(key, index);
        index
    }
    /// The constants, and which of them follow the parameters.
    pub fn finish(self) -> (Vec<[f32; 4]>, Vec<Patch>) {
        (self.pool, self.patches)
    }
}
