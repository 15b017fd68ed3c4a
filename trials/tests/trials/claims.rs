//! Claims of the compiler and of the reference documentation, tested on shapes.
//!
//! Every shape is a scene of its own. The claims are its value as written, the marching step, the slope
//! bounds and the bounding boxes. Values and gradients come from programs in `f64` and from the oracle,
//! which shares no definition with them. Constants of programs are `f32`, so values agree to a relative
//! 1e-6 of the coordinates, times the slope.

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
#[path = "claims/test_shape.rs"]
mod test_shape;
#[path = "claims/values.rs"]
mod values;

use crate::oracle::{
    Point, norm, point_along, random_direction, random_point, scene_files, stranger_files,
    unit_number,
};
use sdfc_trials::campaign::input_count;
use sdfc_trials::random::Random;
use sdfc_vm::bounds::Bounds;
use std::path::PathBuf;
use test_shape::TestShape;

/// Scenes that amplify rounding: hashes by large factors, modulo one, and iterations that exceed floats.
const ROUNDING_AMPLIFIERS: &[&str] = &[
    "voronoi_stones",
    "z_julia_of_twelve_rounds",
    "z_ring_mapped_by_a_fractal",
];
/// Value from which on the compiler may limit points and values that exceed `f32` elsewhere.
const MIN_LIMITED_VALUE: f64 = 1e11;

/// Relative error that constants in `f32` may cause.
const MAX_ROUNDING_PER_SIZE: f64 = 1e-6;

/// Number of groups of the stranger scenes. Each test takes one group in the short form.
const STRANGER_PARTS: usize = 5;

/// Returns the scenes of the examples and tests, and one group of the stranger scenes. The long form
/// returns all of them.
fn corpus(part: usize) -> Vec<PathBuf> {
    let is_long = input_count(0, 1) > 0;
    let stranger_files = stranger_files().into_iter().enumerate();
    let stranger_files =
        stranger_files.filter(|(index, _)| is_long || index % STRANGER_PARTS == part);
    scene_files()
        .into_iter()
        .chain(stranger_files.map(|(_, path)| path))
        .collect()
}

/// Returns the largest absolute coordinate of a point, or `size` if that is larger.
fn size_at(p: Point, size: f64) -> f64 {
    p.iter().fold(size, |size, v| size.max(v.abs()))
}

/// Generator of points at which claims are tested: in the shape's box, near its surface, and far away.
struct TrialPoints {
    random: Random,
    centre: Point,
    half_size: Point,
    size: f64,
}

impl TrialPoints {
    fn new(tested: &TestShape, seed: u64) -> Self {
        let Bounds { min, max } = tested.bounds;
        let size = tested.size;
        let is_bounded =
            |axis: usize| (max[axis] - min[axis]).is_finite() && max[axis] >= min[axis];
        let half_size = |axis: usize| match is_bounded(axis) {
            true => 0.5 * (max[axis] - min[axis]) + 0.01 * size,
            false => size,
        };
        let centre = |axis: usize| match is_bounded(axis) {
            true => 0.5 * (max[axis] + min[axis]),
            false => 0.0,
        };
        Self {
            random: Random::new(seed),
            centre: [0, 1, 2].map(centre),
            half_size: [0, 1, 2].map(half_size),
            size,
        }
    }

    /// Returns a random point of the box scaled by a factor.
    fn in_box(&mut self, factor: f64) -> Point {
        let offset = random_point(&mut self.random, factor);
        [0, 1, 2].map(|i| self.centre[i] + self.half_size[i] * offset[i])
    }

    /// Returns a point on an axis or a diagonal of the box, where formulas switch branches.
    fn symmetric(&mut self) -> Point {
        let mut p = self.in_box(1.5);
        let axis = self.random.below(3);
        match self.random.below(3) {
            0 => p[axis] = self.centre[axis],
            1 => p[axis] = p[(axis + 1) % 3],
            _ => (p[axis], p[(axis + 1) % 3]) = (0.0, 0.0),
        }
        p
    }

    /// Returns a point near the surface, by 4 Newton steps and a small offset.
    fn near_surface(&mut self, tested: &TestShape) -> Point {
        let mut p = self.in_box(1.2);
        let max_step = self.half_size.into_iter().fold(0.0, f64::max);
        for _ in 0..4 {
            let slope = tested.gradient(p);
            let gradient_sq = norm(slope.gradient).powi(2).max(1e-12);
            let factor = slope.value / gradient_sq;
            p = [0, 1, 2].map(|i| p[i] - (factor * slope.gradient[i]).clamp(-max_step, max_step));
        }
        let offset = 0.02 * max_step * unit_number(&mut self.random).powi(3);
        point_along(p, random_direction(&mut self.random), offset)
    }

    /// Returns a point at up to 1e5 sizes from the origin, near points more often.
    fn anywhere(&mut self, tested: &TestShape) -> Point {
        match self.random.below(12) {
            0..=3 => self.in_box(1.0),
            4..=6 => self.near_surface(tested),
            7 => self.symmetric(),
            8 | 9 => self.in_box(3.0),
            10 => {
                let distance = self.size * 10.0_f64.powf(3.0 * unit_number(&mut self.random));
                random_point(&mut self.random, distance)
            }
            _ => {
                let distance = self.size * 10.0_f64.powf(5.0 * unit_number(&mut self.random));
                random_point(&mut self.random, distance)
            }
        }
    }
}
