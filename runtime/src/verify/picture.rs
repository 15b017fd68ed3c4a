//! Two pictures of one view, compared pixel by pixel.

use super::Spread;
use crate::frame::Frame;
use serde::Serialize;
use std::fmt;

/// Where the normals of neighbours differ by more, there is an edge: the cosine of 10°.
const CREASE: f32 = 0.985;
/// Where the colours of neighbours differ by more, of 255, there is an edge: of a shadow, say.
const CONTRAST: u8 = 16;
/// Where the depths of neighbours differ by more than this share, there is an edge.
const STEP: f32 = 0.1;
/// How far the depths of all but a thousandth of the pixels away from edges may differ, in units
/// of the last place.
const DEPTH_ULPS: f64 = 8.0;
/// How much of a byte a pixel may differ by.
const ALLOWED: u8 = 1;

/// How two pictures differ.
#[derive(Clone, Debug, Serialize)]
pub struct PictureDifferences {
    /// How many pixels each has.
    pub pixels: usize,
    /// Rays that hit in one picture only.
    pub hit_mismatches: usize,
    /// Those of them that are not at a silhouette of the reference.
    pub hit_mismatches_inside: usize,
    /// The differences in depth where both hit, as a share of the depth.
    pub depth: Spread,
    /// The same in units of the last place.
    pub depth_ulps: Spread,
    /// The angles between the normals where both hit, in degrees.
    pub normals: Spread,
    /// Rays that took a different number of steps.
    pub steps_differ: usize,
    /// Pixels that are not at an edge of the reference.
    pub smooth_pixels: usize,
    /// Pixels that differ by more than 1 of 255 in any channel.
    pub differing: usize,
    /// Those of them that are not at an edge.
    pub differing_inside: usize,
    /// The largest difference of a channel, of 255.
    pub worst: u8,
    /// The largest away from edges.
    pub worst_inside: u8,
    /// Where that is: column and row.
    pub worst_place: [usize; 2],
}

/// Where neighbours in a picture do not belong together. Each list is by pixel.
pub(super) struct Edges {
    /// Some neighbour hits where this pixel misses, or the other way round.
    silhouette: Vec<bool>,
    /// There is an edge of any kind.
    any: Vec<bool>,
}

impl Edges {
    pub(super) fn of(frame: &Frame) -> Self {
        let bytes = frame.rgba8();
        let count = frame.width * frame.height;
        let (mut silhouette, mut any) = (vec![false; count], vec![false; count]);
        for y in 0..frame.height {
            for x in 0..frame.width {
                let here = y * frame.width + x;
                for there in neighbours(frame, x, y) {
                    silhouette[here] |= hit(frame, here) != hit(frame, there);
                    any[here] |= is_edge(frame, &bytes, here, there);
                }
            }
        }
        Self { silhouette, any }
    }
}

/// The pixels around one, itself included.
fn neighbours(frame: &Frame, x: usize, y: usize) -> impl Iterator<Item = usize> {
    let columns = x.saturating_sub(1)..(x + 2).min(frame.width);
    let rows = y.saturating_sub(1)..(y + 2).min(frame.height);
    let width = frame.width;
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

fn hit(frame: &Frame, i: usize) -> bool {
    frame.depth[i].is_finite()
}

fn is_edge(frame: &Frame, bytes: &[u8], here: usize, there: usize) -> bool {
    if hit(frame, here) != hit(frame, there) || frame.id[here] != frame.id[there] {
        return true;
    }
    if channels(bytes, here)
        .zip(channels(bytes, there))
        .any(|(a, b)| a.abs_diff(b) > CONTRAST)
    {
        return true;
    }
    if !hit(frame, here) {
        return false;
    }
    let (t, t_there) = (frame.depth[here], frame.depth[there]);
    let (n, m) = (frame.normal[here], frame.normal[there]);
    let known = n != [0.0; 3] && m != [0.0; 3];
    (t - t_there).abs() > STEP * t.abs().min(t_there.abs()) || (known && dot(n, m) < CREASE)
}

fn channels(bytes: &[u8], i: usize) -> impl Iterator<Item = u8> {
    bytes[4 * i..4 * i + 3].iter().copied()
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The angle between two unit vectors in degrees, also where it is too small for a cosine.
fn degrees_between(a: [f32; 3], b: [f32; 3]) -> f64 {
    let apart: f64 = (0..3).map(|i| f64::from(a[i] - b[i]).powi(2)).sum();
    (2.0 * (apart.sqrt() / 2.0).min(1.0).asin()).to_degrees()
}

/// Compares a picture with a reference of the same size.
pub(super) fn compare(reference: &Frame, frame: &Frame, edges: &Edges) -> PictureDifferences {
    let pixels = reference.color.len().min(frame.color.len());
    let (bytes, other_bytes) = (reference.rgba8(), frame.rgba8());
    let (mut depth, mut depth_ulps, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    let mut found = PictureDifferences {
        pixels,
        hit_mismatches: 0,
        hit_mismatches_inside: 0,
        depth: Spread::default(),
        depth_ulps: Spread::default(),
        normals: Spread::default(),
        steps_differ: 0,
        smooth_pixels: edges.any.iter().filter(|edge| !**edge).count(),
        differing: 0,
        differing_inside: 0,
        worst: 0,
        worst_inside: 0,
        worst_place: [0, 0],
    };
    for i in 0..pixels {
        found.steps_differ += usize::from(reference.steps[i] != frame.steps[i]);
        if hit(reference, i) != hit(frame, i) {
            found.hit_mismatches += 1;
            found.hit_mismatches_inside += usize::from(!edges.silhouette[i]);
        } else if hit(reference, i) && !edges.any[i] {
            let (t, other) = (f64::from(reference.depth[i]), f64::from(frame.depth[i]));
            let apart = (t - other).abs();
            depth.push(apart / t.abs().max(f64::MIN_POSITIVE));
            depth_ulps.push(apart / ulp(reference.depth[i]));
            if reference.normal[i] != [0.0; 3] || frame.normal[i] != [0.0; 3] {
                normals.push(degrees_between(reference.normal[i], frame.normal[i]));
            }
        }
        let apart = channels(&bytes, i)
            .zip(channels(&other_bytes, i))
            .map(|(a, b)| a.abs_diff(b));
        let apart = apart.max().unwrap_or(0);
        found.worst = found.worst.max(apart);
        found.differing += usize::from(apart > ALLOWED);
        if !edges.any[i] {
            found.differing_inside += usize::from(apart > ALLOWED);
            if apart > found.worst_inside {
                found.worst_inside = apart;
                found.worst_place = [i % reference.width, i / reference.width];
            }
        }
    }
    found.depth = Spread::of(depth);
    found.depth_ulps = Spread::of(depth_ulps);
    found.normals = Spread::of(normals);
    found
}

/// The distance from a number to the next larger one.
fn ulp(v: f32) -> f64 {
    let v = v.abs().max(f32::MIN_POSITIVE);
    f64::from(v.next_up()) - f64::from(v)
}

impl PictureDifferences {
    /// What is more than may be.
    pub(super) fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        if self.hit_mismatches_inside > 0 {
            failures.push(format!(
                "{} rays away from silhouettes hit in one picture only, none may",
                self.hit_mismatches_inside
            ));
        }
        if self.differing_inside > 0 {
            let [x, y] = self.worst_place;
            failures.push(format!(
                "{} pixels away from edges differ by more than {ALLOWED}/255, none may; the worst, \
                 by {}/255, is at ({x}, {y})",
                self.differing_inside, self.worst_inside
            ));
        }
        if self.depth_ulps.p999 > DEPTH_ULPS {
            failures.push(format!(
                "a thousandth of the depths differ by {:.1} ulp, {DEPTH_ULPS} are allowed",
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
            "  pixels        {} differ by more than {ALLOWED}/255, worst {}/255; away from edges {} \
             of {}, worst {}/255",
            self.differing,
            self.worst,
            self.differing_inside,
            self.smooth_pixels,
            self.worst_inside
        )
    }
}

const RED: [u8; 4] = [255, 0, 0, 255];
const AMBER: [u8; 4] = [255, 170, 0, 255];

/// A picture of the differences, as red, green, blue and alpha bytes: the reference in dark grey,
/// over it each channel's difference times 16; where only one picture hits, red, or amber at silhouettes
/// of the reference, where rounding may decide.
pub fn difference_picture(reference: &Frame, frame: &Frame) -> Vec<u8> {
    let (bytes, other_bytes) = (reference.rgba8(), frame.rgba8());
    let pixels = reference.color.len().min(frame.color.len());
    let edges = Edges::of(reference);
    let mut picture = Vec::with_capacity(4 * pixels);
    for i in 0..pixels {
        if hit(reference, i) != hit(frame, i) {
            picture.extend(if edges.silhouette[i] { AMBER } else { RED });
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
    use crate::frame::{Display, Stats, Status, Tonemap};

    /// A picture of 8 × 8 whose left half is a grey wall.
    fn wall() -> Frame {
        let left = |i: usize| i % 8 < 4;
        let each = 0..64;
        Frame {
            width: 8,
            height: 8,
            color: each
                .clone()
                .map(|i| if left(i) { [0.2; 4] } else { [0.0; 4] })
                .collect(),
            depth: each
                .clone()
                .map(|i| if left(i) { 5.0 } else { f32::INFINITY })
                .collect(),
            normal: each
                .clone()
                .map(|i| [0.0, 0.0, if left(i) { 1.0 } else { 0.0 }])
                .collect(),
            id: vec![0; 64],
            steps: vec![10; 64],
            status: each
                .map(|i| if left(i) { Status::Hit } else { Status::Miss })
                .collect(),
            display: Display {
                exposure: 1.0,
                tonemap: Tonemap::None,
                light: false,
                scene: false,
            },
            stats: Stats::default(),
        }
    }

    #[test]
    fn what_differs_at_an_edge_is_counted_and_forgiven() {
        let reference = wall();
        let edges = Edges::of(&reference);
        let mut frame = reference.clone();
        frame.depth[8 * 3 + 4] = 5.0;
        frame.color[8 * 3 + 4] = [0.2; 4];
        let found = compare(&reference, &frame, &edges);
        assert_eq!((found.hit_mismatches, found.hit_mismatches_inside), (1, 0));
        assert_eq!(
            (found.differing, found.differing_inside, found.worst),
            (1, 0, 51)
        );
        assert_eq!(found.smooth_pixels, 48);
        assert_eq!(found.failures(), [""; 0]);
    }

    #[test]
    fn what_differs_elsewhere_fails() {
        let reference = wall();
        let edges = Edges::of(&reference);
        let mut frame = reference.clone();
        frame.depth[0] = f32::INFINITY;
        frame.color[1] = [0.2 + 2.0 / 255.0; 4];
        frame.depth[2] = 5.0 * (1.0 + 1e-6);
        frame.normal[2] = [0.0, 1e-3, 1.0];
        let found = compare(&reference, &frame, &edges);
        assert_eq!(
            (found.hit_mismatches_inside, found.differing_inside),
            (1, 1)
        );
        assert_eq!((found.worst_inside, found.worst_place), (2, [1, 0]));
        assert!((found.depth.max - 1e-6).abs() < 2e-7, "{:?}", found.depth);
        assert!(
            (found.normals.max - 1e-3_f64.to_degrees()).abs() < 1e-3,
            "{:?}",
            found.normals
        );
        assert_eq!(found.failures().len(), 3);
        frame.depth[8 * 3 + 4] = 5.0;
        let picture = difference_picture(&reference, &frame);
        assert_eq!(picture[..4], RED);
        assert_eq!(picture[4 * (8 * 3 + 4)..][..4], AMBER);
        assert_eq!(picture[4..8], [44, 44, 44, 255]);
        assert_eq!(picture[4 * 7..4 * 8], [0, 0, 0, 255]);
    }
}
