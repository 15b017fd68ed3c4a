//! Claims of the compiler and of the reference, tried on shapes.
//!
//! Every shape is a scene of its own: its value as it is written, the step that engines march by, the bounds
//! on slopes and the boxes that the compiler states. Values and gradients are those of programs in `f64`, and
//! those of the oracle, which shares no definition with them. Constants of programs are `f32`, so values agree
//! to a millionth of the coordinates, times the slope.

#[path = "claims/boxes.rs"]
mod boxes;
#[path = "claims/copies.rs"]
mod copies;
#[path = "claims/distances.rs"]
mod distances;
#[path = "claims/intervals.rs"]
mod intervals;
#[path = "claims/params.rs"]
mod params;
#[path = "claims/slopes.rs"]
mod slopes;
#[path = "claims/steps.rs"]
mod steps;
#[path = "claims/subject.rs"]
mod subject;
#[path = "claims/values.rs"]
mod values;

use crate::oracle::{Point, beyond, direction, files, norm, point, strangers, unit};
use sdfc_trials::campaign::count;
use sdfc_trials::random::Random;
use sdfc_vm::bounds::Bounds;
use std::path::PathBuf;
use subject::Subject;

/// The scenes that multiply rounding: hashes by large factors, taken modulo one.
const HASHING: &[&str] = &["voronoi_stones"];

/// The relative error that constants in `f32` may cause.
const MAX_ROUNDING_PER_SIZE: f64 = 1e-6;

/// The number of parts of the strangers' scenes, of which a test takes one in the short form.
const STRANGER_PARTS: usize = 5;

/// The scenes of the examples, of the tests, and one part of those of strangers; in the long form all of them.
fn corpus(part: usize) -> Vec<PathBuf> {
    let is_long = count(0, 1) > 0;
    let strangers = strangers().into_iter().enumerate();
    let strangers = strangers.filter(|(at, _)| is_long || at % STRANGER_PARTS == part);
    files()
        .into_iter()
        .chain(strangers.map(|(_, path)| path))
        .collect()
}

/// The largest magnitude of a point's coordinates, or a size if that is larger.
fn size_at(p: Point, size: f64) -> f64 {
    p.iter().fold(size, |size, v| size.max(v.abs()))
}

/// The points at which a claim is tried: in the shape's box, near its surface, and as far away as rays reach.
struct Places {
    random: Random,
    middle: Point,
    half: Point,
    size: f64,
}

impl Places {
    fn new(subject: &Subject, seed: u64) -> Self {
        let Bounds { min, max } = subject.bounds;
        let size = subject.size;
        let is_ended = |axis: usize| (max[axis] - min[axis]).is_finite() && max[axis] >= min[axis];
        let half = |axis: usize| match is_ended(axis) {
            true => 0.5 * (max[axis] - min[axis]) + 0.01 * size,
            false => size,
        };
        let middle = |axis: usize| match is_ended(axis) {
            true => 0.5 * (max[axis] + min[axis]),
            false => 0.0,
        };
        Self {
            random: Random::new(seed),
            middle: [0, 1, 2].map(middle),
            half: [0, 1, 2].map(half),
            size,
        }
    }

    /// A point of the box, times a factor.
    fn within(&mut self, factor: f64) -> Point {
        let by = point(&mut self.random, factor);
        [0, 1, 2].map(|i| self.middle[i] + self.half[i] * by[i])
    }

    /// A point on an axis or a diagonal of the box, where formulas take turns.
    fn symmetric(&mut self) -> Point {
        let mut p = self.within(1.5);
        let axis = self.random.below(3);
        match self.random.below(3) {
            0 => p[axis] = self.middle[axis],
            1 => p[axis] = p[(axis + 1) % 3],
            _ => (p[axis], p[(axis + 1) % 3]) = (0.0, 0.0),
        }
        p
    }

    /// A point near the surface, by steps of Newton's method.
    fn near_surface(&mut self, subject: &Subject) -> Point {
        let mut p = self.within(1.2);
        let longest = self.half.into_iter().fold(0.0, f64::max);
        for _ in 0..4 {
            let found = subject.gradient(p);
            let square = norm(found.gradient).powi(2).max(1e-12);
            let by = found.value / square;
            p = [0, 1, 2].map(|i| p[i] - (by * found.gradient[i]).clamp(-longest, longest));
        }
        let by = 0.02 * longest * unit(&mut self.random).powi(3);
        beyond(p, direction(&mut self.random), by)
    }

    /// A point anywhere that rays can reach, near ones more often.
    fn anywhere(&mut self, subject: &Subject) -> Point {
        match self.random.below(12) {
            0..=3 => self.within(1.0),
            4..=6 => self.near_surface(subject),
            7 => self.symmetric(),
            8 | 9 => self.within(3.0),
            10 => {
                let far = self.size * 10.0_f64.powf(3.0 * unit(&mut self.random));
                point(&mut self.random, far)
            }
            _ => {
                let far = self.size * 10.0_f64.powf(5.0 * unit(&mut self.random));
                point(&mut self.random, far)
            }
        }
    }
}
