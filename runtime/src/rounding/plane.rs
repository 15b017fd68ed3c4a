//! Rounding errors in pictures of 2-D shapes: the pixels by which `f32` may move an edge.
//!
//! Edges are searched between the points of a grid. At each, the error of the field is divided by its change per
//! pixel. So it does not matter whether the field is a distance.

use super::search::{ErrorBound, SampledError, sampled_error};
use super::{RayFan, UNIT_ROUNDOFF};
use glam::DVec3;
use sdfc_vm::evaluate::{evaluate, evaluate_f64};
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::rounding::error_bound;
use sdfc_vm::vector::V3;
use std::f64::consts::TAU;

/// Number of evaluated instructions that sets the number of points.
const MAX_INSTRUCTIONS: usize = 400_000;
/// Range of the number of grid points along a side.
const POINTS_PER_SIDE: [usize; 2] = [8, 48];
/// Number of edges at which errors are computed, at most.
const MAX_EDGES: usize = 32;
/// Number of bisections from a grid cell to an edge.
const BISECTIONS: u32 = 16;
/// Number of points around an edge at which signs are compared.
const DIRECTIONS: u32 = 8;

/// Returns the largest error at edges in a picture, in pixels, or `None` if no edge was found. Nothing proves that there
/// is no larger one.
pub(super) fn error_at_edges(program: &Program, rays: &RayFan) -> Option<ErrorBound> {
    let budget = MAX_INSTRUCTIONS / program.code.len().max(1);
    let [least, most] = POINTS_PER_SIDE;
    let per_side = (budget / 2).isqrt().clamp(least, most);
    let max_edges = (budget / (2 * BISECTIONS as usize)).clamp(4, MAX_EDGES);
    let point = |x: f64, y: f64| {
        let mut p =
            rays.origin + rays.axes[1] * (rays.start[0] * x) + rays.axes[2] * (rays.start[1] * y);
        p.z = 0.0;
        p
    };
    let step = |i: usize| 1.9 * ((i as f64 + 0.5) / per_side as f64 - 0.5);
    let points: Vec<DVec3> = (0..per_side * per_side)
        .map(|i| point(step(i % per_side), step(i / per_side)))
        .collect();
    let is_inside = |p: DVec3| evaluate_f64(program, p.to_array()) < 0.0;
    let signs: Vec<bool> = points.iter().map(|p| is_inside(*p)).collect();
    let neighbours = (0..signs.len()).flat_map(|i| {
        let right = (i % per_side + 1 < per_side).then_some((i, i + 1));
        let below = (i + per_side < signs.len()).then_some((i, i + per_side));
        [right, below].into_iter().flatten()
    });
    let crossings: Vec<(usize, usize)> =
        neighbours.filter(|&(a, b)| signs[a] != signs[b]).collect();
    let stride = crossings.len().div_ceil(max_edges).max(1);
    let mut largest: Option<SampledError> = None;
    for &(a, b) in crossings.iter().step_by(stride) {
        let (mut inside, mut outside) = match signs[a] {
            true => (points[a], points[b]),
            false => (points[b], points[a]),
        };
        for _ in 0..BISECTIONS {
            let middle = (inside + outside) / 2.0;
            match is_inside(middle) {
                true => inside = middle,
                false => outside = middle,
            }
        }
        if let Some(error) = error_in_pixels(program, rays, outside) {
            largest = Some(largest.unwrap_or_default().or(error));
        }
    }
    largest.map(|largest| ErrorBound {
        upper_bound: f64::INFINITY,
        largest_found: largest.error,
        is_unbounded: largest.is_beyond,
    })
}

/// Returns the error at a point of an edge, in pixels.
fn error_in_pixels(program: &Program, rays: &RayFan, p: DVec3) -> Option<SampledError> {
    let pixel = rays.pixel[0];
    let coordinate_error = rays.rounding + p.abs().max_element() * UNIT_ROUNDOFF;
    let point = p.to_array();
    let bound = error_bound(program, point.map(Interval::point), [coordinate_error; 3]);
    let error = sampled_error(program, point, &bound)?;
    let change = |axis: DVec3| {
        let beside =
            |sign: f64| evaluate_f64(program, (p + axis * (0.5 * sign * pixel)).to_array());
        beside(1.0) - beside(-1.0)
    };
    let per_pixel = change(rays.axes[1]).hypot(change(rays.axes[2]));
    // A jump of infinite height is where it is.
    let error = per_pixel.is_finite().then(|| error.in_units(per_pixel))?;
    // Where parts meet, the bound of one counts, however steep the other one is.
    match moves_by_a_pixel(program, rays, p) {
        true => Some(error),
        false => Some(error.at_most(1.0)),
    }
}

/// Reports whether `f32` gives another sign than `f64` more than a pixel beside a point of an edge.
fn moves_by_a_pixel(program: &Program, rays: &RayFan, p: DVec3) -> bool {
    (0..DIRECTIONS).any(|i| {
        let (y, x) = (f64::from(i) / f64::from(DIRECTIONS) * TAU).sin_cos();
        let offset = (rays.axes[1] * x + rays.axes[2] * y) * (1.5 * rays.pixel[0]);
        let point = (p + offset).to_array();
        let [x, y, z] = point.map(|v| v as f32);
        let single = evaluate::<f32>(program, V3::new(x, y, z)) < 0.0;
        let double = evaluate_f64(program, point) < 0.0;
        single != double
    })
}
