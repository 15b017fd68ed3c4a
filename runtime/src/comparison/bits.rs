//! Bitwise comparison of two engines, as promised by strict arithmetic: the rays of an image and the values
//! at points.
//!
//! In pictures, floats are equal if they are the same number, regardless of the sign of a zero. WGSL leaves the sign
//! of a zero open even where everything else is exact. A NaN only equals the same bits. Values at points have positive
//! zeros, and equal bits.

use crate::engine::FieldSample;
use crate::render::Image;
use serde::Serialize;
use std::fmt;

/// Counts of results of two engines that differ in any bit.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BitDifferences {
    /// Number of rays of each image.
    pub rays: usize,
    /// Rays that hit in one image only.
    pub hits: usize,
    /// Rays with different depths.
    pub depths: usize,
    /// Rays with different numbers of steps.
    pub steps: usize,
    /// Rays with different normals.
    pub normals: usize,
    /// Pixels with different colours; equal colours are not promised.
    pub colors: usize,
    /// Number of points evaluated by each engine.
    pub points: usize,
    /// Points with different distances.
    pub distances: usize,
    /// Points with different gradients.
    pub gradients: usize,
    /// The first ray with a different hit, depth, number of steps or normal.
    pub first_ray: Option<RayDifference>,
    /// The first point with a different distance or gradient.
    pub first_point: Option<PointDifference>,
}

/// A ray that differs between two images.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RayDifference {
    /// Its column and row.
    pub place: [usize; 2],
    /// Depths along the ray in both images; infinite for a miss.
    pub depths: [f32; 2],
    /// Both numbers of steps.
    pub steps: [u32; 2],
}

/// A point at which two engines differ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PointDifference {
    /// The point at which both engines were queried.
    pub point: [f32; 3],
    /// Values of the field in both engines.
    pub distances: [f32; 2],
    /// Gradients of the field in both engines.
    pub gradients: [[f32; 3]; 2],
}

/// Reports whether two numbers are equal: the same value or the same bits.
fn is_equal(a: f32, b: f32) -> bool {
    a == b || a.to_bits() == b.to_bits()
}

fn all_equal(a: &[f32], b: &[f32]) -> bool {
    a.iter().zip(b).all(|(&a, &b)| is_equal(a, b))
}

/// Compares images of the same size, and samples of the same points.
pub(super) fn compare(
    [reference, image]: [&Image; 2],
    points: &[[f32; 3]],
    [samples, other_samples]: [&[FieldSample]; 2],
) -> BitDifferences {
    let mut differences = BitDifferences {
        rays: reference.depth.len(),
        points: points.len(),
        ..BitDifferences::default()
    };
    for i in 0..reference.depth.len() {
        let hits = reference.status[i] != image.status[i];
        let depths = !is_equal(reference.depth[i], image.depth[i]);
        let steps = reference.steps[i] != image.steps[i];
        let normals = !all_equal(&reference.normal[i], &image.normal[i]);
        differences.hits += usize::from(hits);
        differences.depths += usize::from(depths);
        differences.steps += usize::from(steps);
        differences.normals += usize::from(normals);
        differences.colors += usize::from(!all_equal(&reference.color[i], &image.color[i]));
        if hits || depths || steps || normals {
            differences.first_ray.get_or_insert(RayDifference {
                place: [i % reference.width, i / reference.width],
                depths: [reference.depth[i], image.depth[i]],
                steps: [reference.steps[i], image.steps[i]],
            });
        }
    }
    for ((&p, a), b) in points.iter().zip(samples).zip(other_samples) {
        let distances = a.distance.to_bits() != b.distance.to_bits();
        let gradients = a.gradient.map(f32::to_bits) != b.gradient.map(f32::to_bits);
        differences.distances += usize::from(distances);
        differences.gradients += usize::from(gradients);
        if distances || gradients {
            differences.first_point.get_or_insert(PointDifference {
                point: p,
                distances: [a.distance, b.distance],
                gradients: [a.gradient, b.gradient],
            });
        }
    }
    differences
}

impl BitDifferences {
    /// Returns messages for all promised results that differ.
    pub(super) fn failures(&self) -> Vec<String> {
        let rays = [
            (self.hits, "hit or miss"),
            (self.depths, "depth"),
            (self.steps, "number of steps"),
            (self.normals, "normal"),
        ];
        let points = [(self.distances, "distance"), (self.gradients, "gradient")];
        let ray = self.first_ray.map_or(String::new(), |ray| {
            let ([x, y], [t, other], [n, m]) = (ray.place, ray.depths, ray.steps);
            format!("; the first at ({x}, {y}): depth {t} in {n} steps, and {other} in {m}")
        });
        let point = self.first_point.map_or(String::new(), |point| {
            let ([d, other], [g, h]) = (point.distances, point.gradients);
            format!(
                "; the first at {:?}: {d} {g:?} and {other} {h:?}",
                point.point
            )
        });
        let message = |count: usize, kind: &str, what: &str, first: &str| {
            (count > 0).then(|| format!("{count} {kind} differ in their {what}, none may{first}"))
        };
        let rays = rays
            .iter()
            .filter_map(|&(n, what)| message(n, "rays", what, &ray));
        let points = points
            .iter()
            .filter_map(|&(n, what)| message(n, "points", what, &point));
        rays.chain(points).collect()
    }
}

impl fmt::Display for BitDifferences {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  bits          of {} rays differ: hit or miss {}, depth {}, steps {}, normal {}, colour {}",
            self.rays, self.hits, self.depths, self.steps, self.normals, self.colors
        )?;
        writeln!(
            f,
            "                of {} points differ: distance {}, gradient {}",
            self.points, self.distances, self.gradients
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Display, Stats, Status, Tonemap};

    /// Returns an image of two rays of which the first hits.
    fn image() -> Image {
        Image {
            width: 2,
            height: 1,
            color: vec![[0.5; 4]; 2],
            depth: vec![3.0, f32::INFINITY],
            normal: vec![[0.0, 0.0, 1.0], [0.0; 3]],
            id: vec![0; 2],
            steps: vec![7, 9],
            status: vec![Status::Hit, Status::Miss],
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
    fn any_bit_is_seen_but_the_sign_of_a_zero_in_pictures() {
        let (reference, points) = (image(), [[1.0; 3]; 2]);
        let sample = FieldSample {
            distance: 1.0,
            gradient: [1.0, 0.0, 0.0],
            ..FieldSample::default()
        };
        let samples = [sample; 2];
        let mut other = image();
        other.normal[0][1] = -0.0;
        let differences = compare([&reference, &other], &points, [&samples, &samples]);
        assert_eq!(differences.failures(), [""; 0]);
        assert_eq!((differences.rays, differences.points), (2, 2));

        other.depth[0] = 3.0_f32.next_up();
        other.steps[1] = 10;
        other.status[1] = Status::Hit;
        other.normal[0][2] = 1.0_f32.next_down();
        other.color[1] = [0.25; 4];
        let mut others = samples;
        others[0].distance = f32::NAN;
        others[1].gradient[1] = f32::from_bits(1);
        let differences = compare([&reference, &other], &points, [&samples, &others]);
        let counts = [
            differences.hits,
            differences.depths,
            differences.steps,
            differences.normals,
            differences.colors,
        ];
        assert_eq!(counts, [1; 5]);
        assert_eq!([differences.distances, differences.gradients], [1; 2]);
        let [mut negative, positive] = [samples; 2];
        negative[0].gradient[1] = -0.0;
        let signs = compare([&reference, &reference], &points, [&positive, &negative]);
        assert_eq!([signs.distances, signs.gradients], [0, 1]);
        let failures = differences.failures();
        assert_eq!(failures.len(), 6, "colours are not promised: {failures:?}");
        assert_eq!(
            failures[1],
            "1 rays differ in their depth, none may; the first at (0, 0): depth 3 in 7 steps, and \
             3.0000002 in 7"
        );
    }
}
