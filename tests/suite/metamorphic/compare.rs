//! Two pictures that must be the same, pixel by pixel.
//!
//! Away from edges, pixels must agree. At an edge of either picture, a pixel may show what lies on the other
//! side, so what one picture shows there must be found near it in the other. A ring or a speckle in one
//! picture alone is therefore wrong, though it makes edges of its own.

use sdfc_runtime::frame::Frame;

/// The largest difference of a colour channel, of 255.
const MAX_COLOR_DIFFERENCE: u8 = 2;
/// The largest difference of a depth, as a fraction of it.
const MAX_DEPTH_DIFFERENCE: f32 = 1e-3;
/// The distance from an edge at which pixels count as part of it.
const EDGE_REACH: usize = 2;
/// The least difference of colours, of 255, that makes an edge.
const MIN_CONTRAST: u8 = 12;
/// The least difference of depths, as a fraction, that makes an edge.
const MIN_DEPTH_STEP: f32 = 0.05;
/// The least cosine between the normals of neighbours without an edge between them.
const MIN_CREASE_COSINE: f32 = 0.985;

/// A picture as it is compared.
pub(super) struct Picture {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
    /// Depths in units of the unscaled scene, infinite where nothing is hit.
    depth: Vec<f32>,
    edges: Vec<bool>,
    /// The number of rays that ran out of steps or met a value that is not a number.
    pub(super) lost: u64,
}

/// The differences of two pictures.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Differences {
    /// Pixels of which one picture shows a surface and the other none.
    pub(super) hits: usize,
    /// Pixels of other depths.
    pub(super) depths: usize,
    /// Pixels of other colours.
    pub(super) colors: usize,
    /// The largest difference of a channel, and the first wrong pixel.
    pub(super) worst: u8,
    pub(super) first: Option<[usize; 2]>,
}

impl Differences {
    /// The number of wrong pixels.
    pub(super) fn count(&self) -> usize {
        self.hits + self.depths + self.colors
    }
}

impl Picture {
    /// A picture of a scene that is `scale` times as large as those it is compared with.
    pub(super) fn new(frame: &Frame, scale: f64) -> Self {
        let mut picture = Self {
            width: frame.width,
            height: frame.height,
            bytes: frame.rgba8(),
            depth: frame.depth.iter().map(|&t| t / scale as f32).collect(),
            edges: Vec::new(),
            lost: frame.stats.step_caps + frame.stats.nans,
        };
        let is_edge = |at: usize| picture.around(at, 1).any(|to| picture.parts(frame, at, to));
        let thin: Vec<bool> = (0..picture.depth.len()).map(is_edge).collect();
        picture.edges = (0..thin.len())
            .map(|at| picture.around(at, EDGE_REACH).any(|to| thin[to]))
            .collect();
        picture
    }

    /// The pixels at most `reach` away from one, itself included.
    fn around(&self, at: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
        let (x, y, width) = (at % self.width, at / self.width, self.width);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(self.height);
        rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
    }

    fn is_hit(&self, at: usize) -> bool {
        self.depth[at].is_finite()
    }

    fn color(&self, at: usize) -> [u8; 3] {
        std::array::from_fn(|channel| self.bytes[4 * at + channel])
    }

    /// Tells if there is an edge between two pixels.
    fn parts(&self, frame: &Frame, a: usize, b: usize) -> bool {
        if self.is_hit(a) != self.is_hit(b) || frame.id[a] != frame.id[b] {
            return true;
        }
        if difference(self.color(a), self.color(b)) >= MIN_CONTRAST {
            return true;
        }
        let (s, t) = (self.depth[a], self.depth[b]);
        let [n, m] = [a, b].map(|at| frame.normal[at]);
        let cosine: f32 = (0..3).map(|i| n[i] * m[i]).sum();
        self.is_hit(a) && ((s - t).abs() > MIN_DEPTH_STEP * s.min(t) || cosine < MIN_CREASE_COSINE)
    }

    /// Tells if something like a pixel of another picture is seen near its place in this one.
    fn shows(&self, other: &Self, at: usize) -> bool {
        let near = || self.around(at, EDGE_REACH);
        let color = other.color(at);
        near().any(|to| self.is_hit(to) == other.is_hit(at))
            && (0..3).all(|channel| {
                let values = || near().map(|to| self.color(to)[channel]);
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

/// The largest difference of a channel.
fn difference(a: [u8; 3], b: [u8; 3]) -> u8 {
    let differences = a.into_iter().zip(b).map(|(a, b)| a.abs_diff(b));
    differences.fold(0, u8::max)
}

/// Compares two pictures of the same size.
pub(super) fn compare(a: &Picture, b: &Picture) -> Differences {
    let mut found = Differences::default();
    for at in 0..a.depth.len() {
        let apart = difference(a.color(at), b.color(at));
        let is_other_hit = a.is_hit(at) != b.is_hit(at);
        let (s, t) = (a.depth[at], b.depth[at]);
        let is_other_depth =
            a.is_hit(at) && b.is_hit(at) && (s - t).abs() > MAX_DEPTH_DIFFERENCE * s.min(t);
        if !is_other_hit && !is_other_depth && apart <= MAX_COLOR_DIFFERENCE {
            continue;
        }
        if (a.edges[at] || b.edges[at]) && a.shows(b, at) && b.shows(a, at) {
            continue;
        }
        found.hits += usize::from(is_other_hit);
        found.depths += usize::from(is_other_depth);
        found.colors += usize::from(!is_other_hit && !is_other_depth);
        found.worst = found.worst.max(apart);
        found.first.get_or_insert([at % a.width, at / a.width]);
    }
    found
}
