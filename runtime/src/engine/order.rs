//! Points that come in no order, put so that neighbours follow each other: by the interleaved bits
//! of their places in the box around all (G. M. Morton, *A computer oriented geodetic data base*,
//! 1966). A tape pruned for a run of them is then short.

use crate::cells::Region;

/// Bits of a place along an axis.
const BITS: u32 = 16;

/// The numbers of the points, neighbours after each other; those that are nowhere come last.
pub(super) fn by_place(points: &[[f32; 3]]) -> Vec<u32> {
    let Region { low, high } = around(points.iter().filter(|p| is_somewhere(p)));
    let key = |p: &[f32; 3]| {
        if !is_somewhere(p) {
            return u64::MAX;
        }
        let digits: [u64; 3] = std::array::from_fn(|axis| {
            // Halves, since the difference of two numbers may be none.
            let size = (high[axis] / 2.0 - low[axis] / 2.0).max(f32::MIN_POSITIVE);
            let share = (p[axis] / 2.0 - low[axis] / 2.0) / size;
            (share * ((1 << BITS) - 1) as f32) as u64
        });
        (0..BITS).fold(0, |key, bit| {
            let at = |axis: usize| (digits[axis] >> bit & 1) << (3 * bit + axis as u32);
            key | at(0) | at(1) | at(2)
        })
    };
    let mut keyed: Vec<(u64, u32)> = points.iter().map(key).zip(0..).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, number)| number).collect()
}

/// The box around points.
pub(super) fn around<'a>(points: impl Iterator<Item = &'a [f32; 3]>) -> Region {
    let nothing = Region {
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };
    points.fold(nothing, |region, p| Region {
        low: std::array::from_fn(|axis| region.low[axis].min(p[axis])),
        high: std::array::from_fn(|axis| region.high[axis].max(p[axis])),
    })
}

/// Whether all coordinates are numbers, and finite.
pub(super) fn is_somewhere(point: &[f32; 3]) -> bool {
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
        let order = by_place(&points);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..4098));
        assert!(order[4096..].iter().all(|&n| n >= 4096));
        // A cube of 16 has 64 parts of 64 points.
        for run in order[..4096].chunks(64) {
            let region = around(run.iter().map(|&n| &points[n as usize]));
            assert!(region.side() <= 5.0, "{region:?}");
        }
    }
}
