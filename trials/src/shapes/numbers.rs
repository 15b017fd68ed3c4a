//! Random numbers of shapes, some of which are degenerate.

use crate::random::Random;

/// Denominator of all lengths.
pub(super) const LENGTH_STEPS_PER_UNIT: f64 = 64.0;
/// Probability of a degenerate number, in percent.
const DEGENERATE_PERCENT: usize = 12;

/// Returns a multiple of 1/64 between two lengths.
pub fn length(r: &mut Random, min: f64, max: f64) -> f64 {
    let steps = ((max - min) * LENGTH_STEPS_PER_UNIT) as usize;
    min + r.below(steps + 1) as f64 / LENGTH_STEPS_PER_UNIT
}

/// Returns a length that may be zero.
pub(super) fn length_or_zero(r: &mut Random, max: f64) -> f64 {
    if r.chance(DEGENERATE_PERCENT) {
        return 0.0;
    }
    length(r, 1.0 / LENGTH_STEPS_PER_UNIT, max)
}

/// Returns a rounding radius between zero and the largest that fits, both included.
pub(super) fn rounding(r: &mut Random, max: f64) -> f64 {
    match r.below(6) {
        0 => max,
        1 => 0.0,
        _ => max * r.below(64) as f64 / 64.0,
    }
}

/// Returns a vector with signed components.
pub(super) fn vector(r: &mut Random, max: f64) -> [f64; 3] {
    [0; 3].map(|_| length(r, -max, max))
}

/// Returns a nonzero vector.
pub(super) fn direction(r: &mut Random) -> [f64; 3] {
    let v = vector(r, 1.0);
    if v == [0.0; 3] { [0.0, 1.0, 0.0] } else { v }
}

/// Returns an integer number of degrees.
pub(super) fn degrees(r: &mut Random, min: usize, max: usize) -> usize {
    min + r.below(max - min + 1)
}
