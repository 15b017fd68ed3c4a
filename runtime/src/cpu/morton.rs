//! Sorts unordered points so that neighbours follow each other: by the interleaved bits of their coordinates
//! in the bounding box of all points (G. M. Morton, *A computer oriented geodetic data base*, 1966). A tape
//! pruned for a run of consecutive points is then short.

use crate::cells::Aabb;

/// Bits per coordinate.
const BITS_PER_AXIS: u32 = 16;

/// Returns the indices of the points in Morton order. Points that are not finite come last.
pub(super) fn morton_order(points: &[[f32; 3]]) -> Vec<u32> {
    let Aabb { low, high } = Aabb::around(points.iter().copied().filter(is_finite));
    let key = |p: &[f32; 3]| {
        if !is_finite(p) {
            return u64::MAX;
        }
        let digits: [u64; 3] = std::array::from_fn(|axis| {
            // Halves, since the difference of two finite numbers may overflow.
            let size = (high[axis] / 2.0 - low[axis] / 2.0).max(f32::MIN_POSITIVE);
            let fraction = (p[axis] / 2.0 - low[axis] / 2.0) / size;
            (fraction * ((1 << BITS_PER_AXIS) - 1) as f32) as u64
        });
        (0..BITS_PER_AXIS).fold(0, |key, bit| {
            let axis_bit = |axis: usize| (digits[axis] >> bit & 1) << (3 * bit + axis as u32);
            key | axis_bit(0) | axis_bit(1) | axis_bit(2)
        })
    };
    let mut keyed: Vec<(u64, u32)> = points.iter().map(key).zip(0..).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, number)| number).collect()
}

/// Reports whether all coordinates are finite.
pub(super) fn is_finite(point: &[f32; 3]) -> bool {
    point.iter().all(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_point_comes_once_and_neighbours_together() {
        let mut points: Vec<[f32; 3]> = (0..4096)
            .map(|n: u32| {
                let n = n.wrapping_mul(2_654_435_761) & 4095;
                [(n & 15) as f32, (n >> 4 & 15) as f32, (n >> 8) as f32]
            })
            .collect();
        points.push([f32::NAN, 0.0, 0.0]);
        points.push([0.0, f32::INFINITY, 0.0]);
        let order = morton_order(&points);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..4098));
        assert!(order[4096..].iter().all(|&n| n >= 4096));
        // A cube of side 16 has 64 parts of 64 points.
        for run in order[..4096].chunks(64) {
            let region = Aabb::around(run.iter().map(|&n| points[n as usize]));
            assert!(region.longest_side() <= 5.0, "{region:?}");
        }
    }
}
