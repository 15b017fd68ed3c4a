//! The builder of a program's constant pool.

use crate::program::Patch;
use std::collections::HashMap;

/// A number of the pool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoolNumber {
    /// Its value; if it depends on the parameters, the current one.
    pub value: f32,
    /// The uniform result that it depends on.
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

/// Collects constants in groups of four and deduplicates equal runs.
#[derive(Default)]
pub struct PoolBuilder {
    pool: Vec<[f32; 4]>,
    patches: Vec<Patch>,
    indices: HashMap<Vec<(u32, Option<u32>)>, u32>,
}

impl PoolBuilder {
    /// Returns the pool index of these numbers; adds them unless an equal run exists.
    pub fn add(&mut self, numbers: &[PoolNumber]) -> u32 {
        let key: Vec<_> = numbers
            .iter()
            .map(|n| (n.value.to_bits(), n.output))
            .collect();
        // A number that depends on the parameters is identified by its uniform result, whatever its current
        // value.
        let key: Vec<_> = key
            .into_iter()
            .map(|(v, o)| if o.is_some() { (0, o) } else { (v, o) })
            .collect();
        if let Some(&index) = self.indices.get(&key) {
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
                    index: index * 4 + at as u32,
                    output,
                });
            }
        }
        self.indices.insert(key, index);
        index
    }
    /// Returns the constants, and the patches of those that depend on the parameters.
    pub fn finish(self) -> (Vec<[f32; 4]>, Vec<Patch>) {
        (self.pool, self.patches)
    }
}
