//! Pixel-by-pixel comparison of two pictures that must be equal.
//!
//! Away from edges, pixels must agree. At an edge of either picture, a pixel may show the other side of
//! the edge. So its content must be found nearby in the other picture. A ring or speckle in one picture
//! alone is therefore an error, although it creates edges of its own. What is narrower than a pixel is
//! looked for in finer pictures of both scenes.

use glam::Vec3;
use sdfc_runtime::render::Image;

/// Maximum difference of a colour channel, of 255.
const MAX_COLOR_DIFFERENCE: u8 = 2;
/// Maximum relative difference of a depth.
const MAX_DEPTH_DIFFERENCE: f32 = 1e-3;
/// Distance in pixels from an edge within which pixels belong to it.
const EDGE_REACH: usize = 2;
/// Minimum difference of a colour channel, of 255, that makes an edge.
const MIN_CONTRAST: u8 = 12;
/// Minimum relative difference of depths that makes an edge.
const MIN_DEPTH_STEP: f32 = 0.05;
/// Minimum cosine between the normals of adjacent pixels without an edge between them.
const MIN_CREASE_COSINE: f32 = 0.985;

/// A picture prepared for comparison.
pub(crate) struct Picture {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
    /// Depths in units of the unscaled scene, infinite without a hit.
    depth: Vec<f32>,
    edges: Vec<bool>,
    /// Number of rays that ran out of steps or met NaN.
    pub(crate) lost: u64,
}

/// Differences of two pictures.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Differences {
    /// Number of pixels where only one picture shows a surface.
    pub(crate) hits: usize,
    /// Number of pixels with different depths.
    pub(crate) depths: usize,
    /// Number of pixels with different colours.
    pub(crate) colors: usize,
    /// Largest difference of a channel, and the first wrong pixel.
    pub(crate) worst: u8,
    pub(crate) first: Option<[usize; 2]>,
}

impl Differences {
    /// Returns the number of wrong pixels.
    pub(crate) fn count(&self) -> usize {
        self.hits + self.depths + self.colors
    }
}

impl Picture {
    /// Prepares the picture of a scene scaled by `scale`.
    pub(crate) fn new(image: &Image, scale: f64) -> Self {
        let mut picture = Self {
            width: image.width,
            height: image.height,
            bytes: image.rgba8(),
            depth: image.depth.iter().map(|&t| t / scale as f32).collect(),
            edges: Vec::new(),
            lost: image.stats.step_caps + image.stats.nans,
        };
        let is_edge = |pixel: usize| {
            picture
                .neighbours(pixel, 1)
                .any(|neighbour| picture.is_edge_between(image, pixel, neighbour))
        };
        let edge_pixels: Vec<bool> = (0..picture.depth.len()).map(is_edge).collect();
        picture.edges = (0..edge_pixels.len())
            .map(|pixel| {
                picture
                    .neighbours(pixel, EDGE_REACH)
                    .any(|neighbour| edge_pixels[neighbour])
            })
            .collect();
        picture
    }

    /// Returns the pixels at most `reach` away from one, including itself.
    fn neighbours(&self, pixel: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
        let (x, y, width) = (pixel % self.width, pixel / self.width, self.width);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(self.height);
        rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
    }

    fn is_hit(&self, pixel: usize) -> bool {
        self.depth[pixel].is_finite()
    }

    fn color(&self, pixel: usize) -> [u8; 3] {
        std::array::from_fn(|channel| self.bytes[4 * pixel + channel])
    }

    /// Reports whether an edge lies between two pixels.
    fn is_edge_between(&self, image: &Image, a: usize, b: usize) -> bool {
        if self.is_hit(a) != self.is_hit(b) || image.id[a] != image.id[b] {
            return true;
        }
        if difference(self.color(a), self.color(b)) >= MIN_CONTRAST {
            return true;
        }
        let (s, t) = (self.depth[a], self.depth[b]);
        let [n, m] = [a, b].map(|pixel| Vec3::from(image.normal[pixel]));
        let cosine = n.dot(m);
        self.is_hit(a) && ((s - t).abs() > MIN_DEPTH_STEP * s.min(t) || cosine < MIN_CREASE_COSINE)
    }

    /// Reports whether a pixel of another picture is found near its position in this one. This picture is
    /// as large as the other one, or larger by an integer factor.
    fn shows_nearby(&self, other: &Self, pixel: usize) -> bool {
        let scale = self.width / other.width;
        let (x, y) = (pixel % other.width, pixel / other.width);
        let [x, y] = [x, y].map(|coordinate| coordinate * scale + scale / 2);
        let neighbourhood = || self.neighbours(y * self.width + x, EDGE_REACH * scale);
        let color = other.color(pixel);
        neighbourhood().any(|neighbour| self.is_hit(neighbour) == other.is_hit(pixel))
            && (0..3).all(|channel| {
                let values = || neighbourhood().map(|neighbour| self.color(neighbour)[channel]);
                let low = values()
                    .min()
                    .unwrap_or(0)
                    .saturating_sub(MAX_COLOR_DIFFERENCE);
                let high = values()
                    .max()
                    .unwrap_or(0)
                    .saturating_add(MAX_COLOR_DIFFERENCE);
                (low..=high).contains(&color[channel])
            })
    }
}

/// Returns the largest difference of a channel.
fn difference(a: [u8; 3], b: [u8; 3]) -> u8 {
    let differences = a.into_iter().zip(b).map(|(a, b)| a.abs_diff(b));
    differences.fold(0, u8::max)
}

/// Compares two pictures of the same size.
pub(crate) fn compare(a: &Picture, b: &Picture) -> Differences {
    compare_finely([a, b], [a, b])
}

/// Compares two pictures of the same size. What one shows at an edge is looked for in the finer picture of
/// the other scene.
pub(crate) fn compare_finely(
    [a, b]: [&Picture; 2],
    [fine_a, fine_b]: [&Picture; 2],
) -> Differences {
    let mut differences = Differences::default();
    for pixel in 0..a.depth.len() {
        let color_difference = difference(a.color(pixel), b.color(pixel));
        let is_other_hit = a.is_hit(pixel) != b.is_hit(pixel);
        let (s, t) = (a.depth[pixel], b.depth[pixel]);
        let is_other_depth =
            a.is_hit(pixel) && b.is_hit(pixel) && (s - t).abs() > MAX_DEPTH_DIFFERENCE * s.min(t);
        if !is_other_hit && !is_other_depth && color_difference <= MAX_COLOR_DIFFERENCE {
            continue;
        }
        if (a.edges[pixel] || b.edges[pixel])
            && fine_a.shows_nearby(b, pixel)
            && fine_b.shows_nearby(a, pixel)
        {
            continue;
        }
        differences.hits += usize::from(is_other_hit);
        differences.depths += usize::from(is_other_depth);
        differences.colors += usize::from(!is_other_hit && !is_other_depth);
        differences.worst = differences.worst.max(color_difference);
        differences
            .first
            .get_or_insert([pixel % a.width, pixel / a.width]);
    }
    differences
}
