//! Two engines compared bit by bit, as strict arithmetic promises: the picture's rays and the values
//! at points.
//!
//! Floats count as equal if they are the same number, whichever sign a zero has: WGSL leaves the
//! sign of a zero open even where everything else is exact. No number equals another one.

use crate::engine::Sample;
use crate::frame::Frame;
use serde::Serialize;
use std::fmt;

/// How many of the results of two engines are not equal in every bit.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BitDifferences {
    /// How many rays each picture has.
    pub rays: usize,
    /// Rays that hit in one picture only.
    pub hits: usize,
    /// Rays with another depth.
    pub depths: usize,
    /// Rays that took another number of steps.
    pub steps: usize,
    /// Rays with another normal.
    pub normals: usize,
    /// Pixels with another colour, which is more than is promised.
    pub colors: usize,
    /// How many points each was asked about.
    pub points: usize,
    /// Points with another distance.
    pub distances: usize,
    /// Points with another gradient.
    pub gradients: usize,
    /// The first ray whose hit, depth, steps or normal differ.
    pub first_ray: Option<RayDifference>,
    /// The first point whose distance or gradient differ.
    pub first_point: Option<PointDifference>,
}

/// A ray that is not the same in two pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RayDifference {
    /// Its column and row.
    pub place: [usize; 2],
    /// Both depths.
    pub depths: [f32; 2],
    /// Both numbers of steps.
    pub steps: [u32; 2],
}

/// A point at which two engines do not say the same.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PointDifference {
    /// The point.
    pub point: [f32; 3],
    /// Both distances.
    pub distances: [f32; 2],
    /// Both gradients.
    pub gradients: [[f32; 3]; 2],
}

/// Whether two numbers are the same one.
fn same(a: f32, b: f32) -> bool {
    a == b || a.to_bits() == b.to_bits()
}

fn same_all(a: &[f32], b: &[f32]) -> bool {
    a.iter().zip(b).all(|(&a, &b)| same(a, b))
}

/// Compares pictures of the same size, and samples of the same points.
pub(super) fn compare(
    [reference, frame]: [&Frame; 2],
    points: &[[f32; 3]],
    [samples, other_samples]: [&[Sample]; 2],
) -> BitDifferences {
    let mut found = BitDifferences {
        rays: reference.depth.len(),
        points: points.len(),
        ..BitDifferences::default()
    };
    for i in 0..reference.depth.len() {
        let hits = reference.status[i] != frame.status[i];
        let depths = !same(reference.depth[i], frame.depth[i]);
        let steps = reference.steps[i] != frame.steps[i];
        let normals = !same_all(&reference.normal[i], &frame.normal[i]);
        found.hits += usize::from(hits);
        found.depths += usize::from(depths);
        found.steps += usize::from(steps);
        found.normals += usize::from(normals);
        found.colors += usize::from(!same_all(&reference.color[i], &frame.color[i]));
        if hits || depths || steps || normals {
            found.first_ray.get_or_insert(RayDifference {
                place: [i % reference.width, i / reference.width],
                depths: [reference.depth[i], frame.depth[i]],
                steps: [reference.steps[i], frame.steps[i]],
            });
        }
    }
    for ((&p, a), b) in points.iter().zip(samples).zip(other_samples) {
        let distances = !same(a.distance, b.distance);
        let gradients = !same_all(&a.gradient, &b.gradient);
        found.distances += usize::from(distances);
        found.gradients += usize::from(gradients);
        if distances || gradients {
            found.first_point.get_or_insert(PointDifference {
                point: p,
                distances: [a.distance, b.distance],
                gradients: [a.gradient, b.gradient],
            });
        }
    }
    found
}

impl BitDifferences {
    /// What is more than none, of all that is promised.
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
        let point = self.first_point.map_or(String::new(), |found| {
            let ([d, other], [g, h]) = (found.distances, found.gradients);
            format!(
                "; the first at {:?}: {d} {g:?} and {other} {h:?}",
                found.point
            )
        });
        let told = |count: usize, of: &str, what: &str, first: &str| {
            (count > 0).then(|| format!("{count} {of} differ in their {what}, none may{first}"))
        };
        let rays = rays
            .iter()
            .filter_map(|&(n, what)| told(n, "rays", what, &ray));
        let points = points
            .iter()
            .filter_map(|&(n, what)| told(n, "points", what, &point));
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
    use crate::frame::{Display, Stats, Status, Tonemap};

    /// Two rays of which the first hits.
    fn frame() -> Frame {
        Frame {
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
                light: false,
                scene: false,
            },
            stats: Stats::default(),
        }
    }

    #[test]
    fn any_bit_is_seen_but_the_sign_of_a_zero() {
        let (reference, points) = (frame(), [[1.0; 3]; 2]);
        let sample = Sample {
            distance: 1.0,
            gradient: [1.0, 0.0, 0.0],
            ..Sample::default()
        };
        let samples = [sample; 2];
        let mut other = frame();
        other.normal[0][1] = -0.0;
        let found = compare([&reference, &other], &points, [&samples, &samples]);
        assert_eq!(found.failures(), [""; 0]);
        assert_eq!((found.rays, found.points), (2, 2));

        other.depth[0] = 3.0_f32.next_up();
        other.steps[1] = 10;
        other.status[1] = Status::Hit;
        other.normal[0][2] = 1.0_f32.next_down();
        other.color[1] = [0.25; 4];
        let mut others = samples;
        others[0].distance = f32::NAN;
        others[1].gradient[1] = f32::from_bits(1);
        let found = compare([&reference, &other], &points, [&samples, &others]);
        let counts = [
            found.hits,
            found.depths,
            found.steps,
            found.normals,
            found.colors,
        ];
        assert_eq!(counts, [1; 5]);
        assert_eq!([found.distances, found.gradients], [1; 2]);
        let failures = found.failures();
        assert_eq!(failures.len(), 6, "colours are not promised: {failures:?}");
        assert_eq!(
            failures[1],
            "1 rays differ in their depth, none may; the first at (0, 0): depth 3 in 7 steps, and \
             3.0000002 in 7"
        );
    }
}
