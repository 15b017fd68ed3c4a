//! Pixelwise comparison of two images of one view.

use super::Percentiles;
use crate::render::Image;
use glam::Vec3;
use serde::Serialize;
use std::fmt;

/// Cosine of 10°. Neighbours whose normals have a smaller cosine are separated by an edge.
const MIN_NORMAL_COSINE: f32 = 0.985;
/// Maximum colour difference of neighbours, of 255, that is not an edge (of a shadow, for example).
const MAX_COLOR_STEP: u8 = 16;
/// Maximum relative depth difference of neighbours that is not an edge.
const MAX_DEPTH_STEP: f32 = 0.1;
/// Limit of the depth differences of all but a thousandth of the pixels away from edges, in units of the last
/// place. Devices round quotients and roots by rules of their own; an H100 differed by 11.
const MAX_DEPTH_ULPS: f64 = 16.0;
/// Maximum difference of a byte.
const MAX_BYTE_DIFFERENCE: u8 = 1;
/// Maximum difference of a byte in a few pixels away from edges. Penumbras and occlusion take minima over the
/// steps of their rays, and a step may be on either side of a limit.
const MAX_UNSTABLE_BYTE_DIFFERENCE: u8 = 8;
/// Maximum fraction of these pixels.
const MAX_UNSTABLE_FRACTION: f64 = 5e-4;

/// Differences of two images.
#[derive(Clone, Debug, Serialize)]
pub struct PictureDifferences {
    /// Number of pixels of each image.
    pub pixels: usize,
    /// Rays that hit in one image only.
    pub hit_mismatches: usize,
    /// Those of them that are not at a silhouette of the reference.
    pub hit_mismatches_inside: usize,
    /// Relative depth differences where both hit, away from edges of the reference.
    pub depth: Percentiles,
    /// Those differences in units of the last place.
    pub depth_ulps: Percentiles,
    /// Angles between the normals where both hit, in degrees, away from edges of the reference.
    pub normals: Percentiles,
    /// Rays with different numbers of steps.
    pub steps_differ: usize,
    /// Pixels that are not at an edge of the reference.
    pub smooth_pixels: usize,
    /// Pixels that differ by more than 1 of 255 in any channel.
    pub differing: usize,
    /// Those of them that are not at an edge.
    pub differing_inside: usize,
    /// The largest difference of a channel, of 255.
    pub worst: u8,
    /// The largest difference away from edges.
    pub worst_inside: u8,
    /// The column and row of that pixel.
    pub worst_place: [usize; 2],
}

/// Edges in an image. Each list has one entry per pixel.
pub(super) struct Edges {
    /// A neighbour hits where this pixel misses, or the reverse.
    silhouette: Vec<bool>,
    /// There is an edge of any kind.
    any: Vec<bool>,
}

impl Edges {
    pub(super) fn new(image: &Image) -> Self {
        let bytes = image.rgba8();
        let count = image.width * image.height;
        let (mut silhouette, mut any) = (vec![false; count], vec![false; count]);
        for y in 0..image.height {
            for x in 0..image.width {
                let pixel = y * image.width + x;
                for neighbour in neighbours(image, x, y) {
                    silhouette[pixel] |= hit(image, pixel) != hit(image, neighbour);
                    any[pixel] |= is_edge(image, &bytes, pixel, neighbour);
                }
            }
        }
        Self { silhouette, any }
    }
}

/// Returns the pixels around a pixel, itself included, by index.
fn neighbours(image: &Image, x: usize, y: usize) -> impl Iterator<Item = usize> {
    let columns = x.saturating_sub(1)..(x + 2).min(image.width);
    let rows = y.saturating_sub(1)..(y + 2).min(image.height);
    let width = image.width;
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

fn hit(image: &Image, i: usize) -> bool {
    image.depth[i].is_finite()
}

fn is_edge(image: &Image, bytes: &[u8], pixel: usize, neighbour: usize) -> bool {
    if hit(image, pixel) != hit(image, neighbour) || image.id[pixel] != image.id[neighbour] {
        return true;
    }
    if channels(bytes, pixel)
        .zip(channels(bytes, neighbour))
        .any(|(a, b)| a.abs_diff(b) > MAX_COLOR_STEP)
    {
        return true;
    }
    if !hit(image, pixel) {
        return false;
    }
    let (t, t_there) = (image.depth[pixel], image.depth[neighbour]);
    let (n, m) = (image.normal[pixel], image.normal[neighbour]);
    let have_normals = n != [0.0; 3] && m != [0.0; 3];
    (t - t_there).abs() > MAX_DEPTH_STEP * t.abs().min(t_there.abs())
        || (have_normals && Vec3::from(n).dot(m.into()) < MIN_NORMAL_COSINE)
}

fn channels(bytes: &[u8], i: usize) -> impl Iterator<Item = u8> {
    bytes[4 * i..4 * i + 3].iter().copied()
}

/// Returns the angle between two unit vectors in degrees. It is exact also where the angle is too small for a
/// cosine.
fn degrees_between(a: [f32; 3], b: [f32; 3]) -> f64 {
    let distance = (Vec3::from(a) - Vec3::from(b)).as_dvec3().length();
    (2.0 * (distance / 2.0).min(1.0).asin()).to_degrees()
}

/// Compares an image with a reference of the same size.
pub(super) fn compare(reference: &Image, image: &Image, edges: &Edges) -> PictureDifferences {
    let pixels = reference.color.len().min(image.color.len());
    let (bytes, other_bytes) = (reference.rgba8(), image.rgba8());
    let (mut depth, mut depth_ulps, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    let mut differences = PictureDifferences {
        pixels,
        hit_mismatches: 0,
        hit_mismatches_inside: 0,
        depth: Percentiles::default(),
        depth_ulps: Percentiles::default(),
        normals: Percentiles::default(),
        steps_differ: 0,
        smooth_pixels: edges.any.iter().filter(|edge| !**edge).count(),
        differing: 0,
        differing_inside: 0,
        worst: 0,
        worst_inside: 0,
        worst_place: [0, 0],
    };
    for i in 0..pixels {
        differences.steps_differ += usize::from(reference.steps[i] != image.steps[i]);
        if hit(reference, i) != hit(image, i) {
            differences.hit_mismatches += 1;
            differences.hit_mismatches_inside += usize::from(!edges.silhouette[i]);
        } else if hit(reference, i) && !edges.any[i] {
            let (t, other_t) = (f64::from(reference.depth[i]), f64::from(image.depth[i]));
            let difference = (t - other_t).abs();
            depth.push(difference / t.abs().max(f64::MIN_POSITIVE));
            depth_ulps.push(difference / ulp(reference.depth[i]));
            if reference.normal[i] != [0.0; 3] || image.normal[i] != [0.0; 3] {
                normals.push(degrees_between(reference.normal[i], image.normal[i]));
            }
        }
        let difference = channels(&bytes, i)
            .zip(channels(&other_bytes, i))
            .map(|(a, b)| a.abs_diff(b));
        let difference = difference.max().unwrap_or(0);
        differences.worst = differences.worst.max(difference);
        differences.differing += usize::from(difference > MAX_BYTE_DIFFERENCE);
        if !edges.any[i] {
            differences.differing_inside += usize::from(difference > MAX_BYTE_DIFFERENCE);
            if difference > differences.worst_inside {
                differences.worst_inside = difference;
                differences.worst_place = [i % reference.width, i / reference.width];
            }
        }
    }
    differences.depth = Percentiles::from_values(depth);
    differences.depth_ulps = Percentiles::from_values(depth_ulps);
    differences.normals = Percentiles::from_values(normals);
    differences
}

/// Returns the distance from the magnitude of a number to the next larger one.
fn ulp(v: f32) -> f64 {
    let v = v.abs().max(f32::MIN_POSITIVE);
    f64::from(v.next_up()) - f64::from(v)
}

impl PictureDifferences {
    /// Returns messages for all differences that are not allowed.
    pub(super) fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        if self.hit_mismatches_inside > 0 {
            failures.push(format!(
                "{} rays away from silhouettes hit in one picture only, none may",
                self.hit_mismatches_inside
            ));
        }
        let most = (MAX_UNSTABLE_FRACTION * self.smooth_pixels as f64) as usize;
        if self.differing_inside > most || self.worst_inside > MAX_UNSTABLE_BYTE_DIFFERENCE {
            let [x, y] = self.worst_place;
            failures.push(format!(
                "{} pixels away from edges differ by more than {MAX_BYTE_DIFFERENCE}/255, {most} may, by at most \
                 {MAX_UNSTABLE_BYTE_DIFFERENCE}/255; the worst, by {}/255, is at ({x}, {y})",
                self.differing_inside, self.worst_inside
            ));
        }
        if self.depth_ulps.p999 > MAX_DEPTH_ULPS {
            failures.push(format!(
                "a thousandth of the depths differ by {:.1} ulp, {MAX_DEPTH_ULPS} are allowed",
                self.depth_ulps.p999
            ));
        }
        failures
    }
}

impl fmt::Display for PictureDifferences {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  hit or miss   {} of {} rays differ, {} away from silhouettes",
            self.hit_mismatches, self.pixels, self.hit_mismatches_inside
        )?;
        writeln!(f, "  depth         {} of the depth", self.depth)?;
        writeln!(f, "                {} ulp", self.depth_ulps)?;
        writeln!(f, "  normals       {} degrees", self.normals)?;
        writeln!(
            f,
            "  steps         {} of {} rays differ",
            self.steps_differ, self.pixels
        )?;
        writeln!(
            f,
            "  pixels        {} differ by more than {MAX_BYTE_DIFFERENCE}/255, worst {}/255; away from edges {} \
             of {}, worst {}/255",
            self.differing,
            self.worst,
            self.differing_inside,
            self.smooth_pixels,
            self.worst_inside
        )
    }
}

/// Colour of pixels that only one of two pictures hits.
pub const MISMATCH_COLOR: [u8; 4] = [255, 0, 0, 255];
/// Colour of such pixels at a silhouette.
pub const SILHOUETTE_COLOR: [u8; 4] = [255, 170, 0, 255];

/// Draws the differences, as red, green, blue and alpha bytes. Each channel's difference times 16 is added to the
/// reference in dark grey. Pixels where only one image hits are red, or amber at silhouettes of the reference,
/// where rounding may decide.
pub fn difference_image(reference: &Image, image: &Image) -> Vec<u8> {
    let (bytes, other_bytes) = (reference.rgba8(), image.rgba8());
    let pixels = reference.color.len().min(image.color.len());
    let edges = Edges::new(reference);
    let mut picture = Vec::with_capacity(4 * pixels);
    for i in 0..pixels {
        if hit(reference, i) != hit(image, i) {
            picture.extend(if edges.silhouette[i] {
                SILHOUETTE_COLOR
            } else {
                MISMATCH_COLOR
            });
            continue;
        }
        let grey = channels(&bytes, i).map(u16::from).sum::<u16>() / 12;
        for (a, b) in channels(&bytes, i).zip(channels(&other_bytes, i)) {
            picture.push(a.abs_diff(b).saturating_mul(16).saturating_add(grey as u8));
        }
        picture.push(255);
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Display, Stats, Status, Tonemap};

    /// Returns an image of 8 × 8 pixels whose left half is a grey wall.
    fn wall() -> Image {
        let is_left = |i: usize| i % 8 < 4;
        let pixels = 0..64;
        Image {
            width: 8,
            height: 8,
            color: pixels
                .clone()
                .map(|i| if is_left(i) { [0.2; 4] } else { [0.0; 4] })
                .collect(),
            depth: pixels
                .clone()
                .map(|i| if is_left(i) { 5.0 } else { f32::INFINITY })
                .collect(),
            normal: pixels
                .clone()
                .map(|i| [0.0, 0.0, if is_left(i) { 1.0 } else { 0.0 }])
                .collect(),
            id: vec![0; 64],
            steps: vec![10; 64],
            status: pixels
                .map(|i| {
                    if is_left(i) {
                        Status::Hit
                    } else {
                        Status::Miss
                    }
                })
                .collect(),
            display: Display {
                exposure: 1.0,
                tonemap: Tonemap::None,
                is_light: false,
                is_lit_scene: false,
            },
            stats: Stats::default(),
        }
    }

    #[test]
    fn differences_at_edges_are_counted_and_accepted() {
        let reference = wall();
        let edges = Edges::new(&reference);
        let mut image = reference.clone();
        image.depth[8 * 3 + 4] = 5.0;
        image.color[8 * 3 + 4] = [0.2; 4];
        let differences = compare(&reference, &image, &edges);
        assert_eq!(
            (
                differences.hit_mismatches,
                differences.hit_mismatches_inside
            ),
            (1, 0)
        );
        assert_eq!(
            (
                differences.differing,
                differences.differing_inside,
                differences.worst
            ),
            (1, 0, 51)
        );
        assert_eq!(differences.smooth_pixels, 48);
        assert_eq!(differences.failures(), [""; 0]);
    }

    #[test]
    fn a_few_small_differences_elsewhere_are_accepted() {
        let reference = wall();
        let unchanged = compare(&reference, &reference, &Edges::new(&reference));
        let failures = |differing_inside, worst_inside| {
            let differences = PictureDifferences {
                smooth_pixels: 10_000,
                differing_inside,
                worst_inside,
                ..unchanged.clone()
            };
            differences.failures().len()
        };
        assert_eq!(failures(5, 8), 0);
        assert_eq!(failures(6, 2), 1);
        assert_eq!(failures(1, 9), 1);
    }

    #[test]
    fn differences_elsewhere_fail() {
        let reference = wall();
        let edges = Edges::new(&reference);
        let mut image = reference.clone();
        image.depth[0] = f32::INFINITY;
        image.color[1] = [0.2 + 2.0 / 255.0; 4];
        image.depth[2] = 5.0 * (1.0 + 3e-6);
        image.normal[2] = [0.0, 1e-3, 1.0];
        let differences = compare(&reference, &image, &edges);
        assert_eq!(
            (
                differences.hit_mismatches_inside,
                differences.differing_inside
            ),
            (1, 1)
        );
        assert_eq!(
            (differences.worst_inside, differences.worst_place),
            (2, [1, 0])
        );
        assert!(
            (differences.depth.max - 3e-6).abs() < 2e-7,
            "{:?}",
            differences.depth
        );
        assert!(
            (differences.normals.max - 1e-3_f64.to_degrees()).abs() < 1e-3,
            "{:?}",
            differences.normals
        );
        assert_eq!(differences.failures().len(), 3);
        image.depth[8 * 3 + 4] = 5.0;
        let picture = difference_image(&reference, &image);
        assert_eq!(picture[..4], MISMATCH_COLOR);
        assert_eq!(picture[4 * (8 * 3 + 4)..][..4], SILHOUETTE_COLOR);
        assert_eq!(picture[4..8], [44, 44, 44, 255]);
        assert_eq!(picture[4 * 7..4 * 8], [0, 0, 0, 255]);
    }
}
