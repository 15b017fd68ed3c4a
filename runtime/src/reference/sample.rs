//! Samples of a picture's pixels, drawn by strata.
//!
//! A picture is divided into tiles. Tiles at edges of the solid are drawn more densely than others, since most errors
//! are there. Each pixel stands for as many pixels as there are tiles of its stratum per drawn one. So sums over the
//! sample estimate those over the picture without bias.

/// Side of a tile in pixels.
const TILE: usize = 4;
/// Ratio of two depths of a tile from which on it lies at an edge. It decides the density alone.
const EDGE_RATIO: f32 = 1.1;
/// Shares of the tiles that the strata receive where they have as many: edges, surfaces, background.
const SHARES: [f64; 3] = [0.5, 0.375, 0.125];

/// Pixels of a picture, in ascending order.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelSample {
    /// Width and height of the picture in pixels.
    pub(super) size: [usize; 2],
    /// Index of each pixel, row after row from the upper left, and the number of pixels that it stands for.
    pub(super) pixels: Vec<(usize, f64)>,
}

impl PixelSample {
    /// Returns all pixels.
    pub fn all(size: [usize; 2]) -> Self {
        Self {
            size,
            pixels: (0..size[0] * size[1]).map(|index| (index, 1.0)).collect(),
        }
    }

    /// Returns about `count` pixels, or all of a picture that has fewer. The strata are those of `depth`, drawn
    /// from the same view; it may be wrong anywhere.
    pub fn stratified(size: [usize; 2], depth: &[f32], count: usize) -> Self {
        let mut strata: [Vec<[usize; 2]>; 3] = Default::default();
        for tile in tiles(size) {
            strata[stratum(size, depth, tile)].push(tile);
        }
        let available = strata.each_ref().map(Vec::len);
        let tile_count: usize = available.iter().sum();
        let wanted = (count * tile_count).div_ceil(depth.len().max(1));
        if tile_count <= wanted {
            return Self::all(size);
        }
        let mut pixels = Vec::new();
        for (tiles, drawn) in strata.iter().zip(allotment(available, wanted)) {
            let weight = tiles.len() as f64 / drawn as f64;
            for tile in spread(tiles, drawn) {
                pixels.extend(tile_pixels(size, tile).map(|index| (index, weight)));
            }
        }
        pixels.sort_by_key(|&(index, _)| index);
        Self { size, pixels }
    }
}

/// Returns the upper left pixels of all tiles.
fn tiles([width, height]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    let rows = (0..height).step_by(TILE);
    rows.flat_map(move |y| (0..width).step_by(TILE).map(move |x| [x, y]))
}

/// Returns the indices of a tile's pixels.
fn tile_pixels([width, height]: [usize; 2], [x, y]: [usize; 2]) -> impl Iterator<Item = usize> {
    let rows = y..(y + TILE).min(height);
    rows.flat_map(move |row| (x..(x + TILE).min(width)).map(move |column| row * width + column))
}

/// Returns the stratum of a tile, by the depths in it and one pixel around it.
fn stratum([width, height]: [usize; 2], depth: &[f32], [x, y]: [usize; 2]) -> usize {
    let rows = y.saturating_sub(1)..(y + TILE + 1).min(height);
    let columns = x.saturating_sub(1)..(x + TILE + 1).min(width);
    let indices = rows.flat_map(|row| columns.clone().map(move |column| row * width + column));
    let (mut least, mut greatest) = (f32::INFINITY, 0.0_f32);
    for index in indices {
        least = least.min(depth[index]);
        greatest = greatest.max(depth[index]);
    }
    match (least.is_finite(), greatest > least * EDGE_RATIO) {
        (false, _) => 2,
        (true, false) => 1,
        (true, true) => 0,
    }
}

/// Divides `wanted` tiles among the strata. What a stratum lacks goes to the others.
fn allotment(available: [usize; 3], wanted: usize) -> [usize; 3] {
    let mut allotted = [0; 3];
    let mut left = wanted;
    loop {
        let is_open = |i: usize| allotted[i] < available[i];
        let open: Vec<usize> = (0..3).filter(|&i| is_open(i)).collect();
        let shares: f64 = open.iter().map(|&i| SHARES[i]).sum();
        if left == 0 || open.is_empty() {
            return allotted;
        }
        let before = left;
        for i in open {
            let share = (before as f64 * SHARES[i] / shares).ceil() as usize;
            let added = share.min(left).min(available[i] - allotted[i]);
            allotted[i] += added;
            left -= added;
        }
    }
}

/// Returns `count` tiles of a list: one in each of as many equal parts, at a quasi-random place.
fn spread(tiles: &[[usize; 2]], count: usize) -> impl Iterator<Item = [usize; 2]> {
    const GOLDEN_RATIO: f64 = 0.618_033_988_749_895;
    let part = tiles.len() as f64 / count as f64;
    (0..count).map(move |number| {
        let offset = (number as f64 * GOLDEN_RATIO).fract();
        let at = ((number as f64 + offset) * part) as usize;
        tiles[at.min(tiles.len() - 1)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [480, 270];

    /// Returns the depths of a disc before a wall in the left half, with nothing in the right one.
    fn depths() -> Vec<f32> {
        let pixels = 0..SIZE[0] * SIZE[1];
        let depth = pixels.map(|index| {
            let [x, y] = [index % SIZE[0], index / SIZE[0]].map(|n| n as f64);
            match ((x - 120.0).hypot(y - 135.0) < 90.0, x < 240.0) {
                (true, _) => 1.0,
                (false, true) => 2.0,
                (false, false) => f32::INFINITY,
            }
        });
        depth.collect()
    }

    #[test]
    fn sums_over_a_sample_estimate_those_over_the_picture() {
        let depth = depths();
        let sample = PixelSample::stratified(SIZE, &depth, 4096);
        let count = sample.pixels.len();
        assert!((4000..4400).contains(&count), "{count}");
        let share = |test: &dyn Fn(f32) -> bool| {
            let chosen = sample
                .pixels
                .iter()
                .filter(|(index, _)| test(depth[*index]));
            chosen.map(|(_, weight)| weight).sum::<f64>() / depth.len() as f64
        };
        let disc = std::f64::consts::PI * 90.0 * 90.0 / depth.len() as f64;
        for (share, expected) in [
            (share(&|_| true), 1.0),
            (share(&f32::is_finite), 0.5),
            (share(&|depth| depth == 1.0), disc),
        ] {
            assert!((share - expected).abs() < 0.03, "{share} for {expected}");
        }
        let at_edges = sample.pixels.iter().filter(|(_, weight)| *weight < 8.0);
        assert!(at_edges.count() >= 2000, "half of the sample");
        assert!(sample.pixels.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn small_pictures_are_sampled_entirely() {
        let sample = PixelSample::stratified([40, 22], &[1.0; 880], 4096);
        assert_eq!(sample, PixelSample::all([40, 22]));
    }

    #[test]
    fn large_strata_replace_small_ones() {
        assert_eq!(allotment([1000, 1000, 1000], 256), [128, 96, 32]);
        assert_eq!(allotment([10, 1000, 0], 256), [10, 246, 0]);
        assert_eq!(allotment([3, 2, 1], 6), [3, 2, 1]);
    }
}
