//! Comparison of the values of two engines at points.

use super::Percentiles;
use crate::engine::FieldSample;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::program::{Module, Opcode};
use sdfc_vm::row::{Category, Exactness};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use serde::Serialize;
use std::fmt;

/// Number of points.
pub const POINT_COUNT: usize = 4096;

/// Half a unit in the last place of 1.
const HALF_ULP: f64 = 1.0 / (1 << 24) as f64;
/// Maximum difference of two engines' distances, in half ulps of the largest coordinate.
const MAX_ROUNDINGS: f64 = 16.0;
/// Factor on that limit for fields with functions that are sums of many terms.
const FUNCTION_FACTOR: f64 = 8.0;
/// Maximum difference of two gradients, summed over the axes.
const MAX_GRADIENT_DIFFERENCE: f64 = 1e-2;

/// Differences of two engines at [`POINT_COUNT`] points in the scene's bounds.
#[derive(Clone, Debug, Serialize)]
pub struct FieldDifferences {
    /// Differences of the distances, in units of the last place of the largest coordinate (or of 1).
    pub distances: Percentiles,
    /// Those differences, as fractions of the allowed difference.
    pub distances_of_allowed: Percentiles,
    /// The allowed difference in those units, times the scene's extent and the factor of its functions.
    pub allowed: f64,
    /// Points excluded because the field itself is discontinuous within rounding of the point.
    pub jumps: usize,
    /// Differences of the gradients, summed over the axes.
    pub gradients: Percentiles,
    /// Gradients that differ although the gradient is constant around the point.
    pub gradients_differ: usize,
    /// The point with the largest difference relative to the allowed one, and both values.
    pub worst: Option<([f32; 3], f32, f32)>,
}

/// Returns points distributed over the bounds and a margin; always the same ones.
pub(super) fn points(bounds: &Bounds) -> Vec<[f32; 3]> {
    let shown = crate::settings::finite_bounds(bounds);
    let region = shown.grown(0.1 * shown.half_diagonal());
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = || {
        // splitmix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let point = |_| {
        std::array::from_fn(|axis| {
            let (low, high) = (region.min[axis], region.max[axis]);
            (low + (high - low) * random()) as f32
        })
    };
    (0..POINT_COUNT).map(point).collect()
}

/// Compares the values of two engines.
pub(super) fn compare(
    module: &Module,
    points: &[[f32; 3]],
    reference: &[FieldSample],
    samples: &[FieldSample],
) -> FieldDifferences {
    let program = &module.distance;
    let shown = crate::settings::finite_bounds(&module.settings.bounds);
    let extent = shown
        .min
        .iter()
        .chain(&shown.max)
        .fold(1.0_f64, |max, v| max.max(v.abs()));
    let functions = if program.code.iter().any(|i| is_function(i.code)) {
        FUNCTION_FACTOR
    } else {
        1.0
    };
    let roundings = MAX_ROUNDINGS * functions;

    let (mut ulps, mut fractions, mut gradients) = (Vec::new(), Vec::new(), Vec::new());
    let (mut jumps, mut gradients_differ) = (0, 0);
    let (mut worst, mut worst_fraction) = (None, -1.0);
    for ((&p, a), b) in points.iter().zip(reference).zip(samples) {
        let largest = p.iter().fold(1.0_f64, |max, v| max.max(f64::from(v.abs())));
        let difference = abs_difference(a.distance, b.distance);
        let allowed = roundings * HALF_ULP * largest.max(extent);
        let neighbourhood = Neighbourhood::new(p, 8.0 * HALF_ULP * largest);
        if difference > allowed && neighbourhood.distances(program) >= difference / 2.0 {
            jumps += 1;
        } else {
            ulps.push(difference / (2.0 * HALF_ULP * largest.log2().floor().exp2()));
            fractions.push(difference / allowed);
            if difference / allowed > worst_fraction {
                worst_fraction = difference / allowed;
                worst = Some((p, a.distance, b.distance));
            }
        }
        let pairs = a.gradient.iter().zip(b.gradient);
        let difference: f64 = pairs.map(|(&a, b)| abs_difference(a, b)).sum();
        gradients.push(difference);
        if difference > MAX_GRADIENT_DIFFERENCE
            && neighbourhood.gradients(program) < difference / 2.0
        {
            gradients_differ += 1;
        }
    }
    FieldDifferences {
        distances: Percentiles::from_values(ulps),
        distances_of_allowed: Percentiles::from_values(fractions),
        allowed: roundings / 2.0 * extent,
        jumps,
        gradients: Percentiles::from_values(gradients),
        gradients_differ,
        worst,
    }
}

/// Reports whether an instruction sums many terms: sines, powers, noise. A solid that only bounds its
/// distance is a scaled level function, which is such a sum.
fn is_function(code: Opcode) -> bool {
    let Opcode::Op(op) = code else { return false };
    match op.row().facts.category {
        Category::Math => !matches!(op, Op::X | Op::Y | Op::Z | Op::Constant | Op::MakePoint),
        Category::Domain => matches!(
            op,
            Op::Polar
                | Op::PolarNeighbour
                | Op::PolarPlane
                | Op::PolarPlaneNeighbour
                | Op::Twist
                | Op::Bend
        ),
        Category::Shape3 => op.row().facts.exactness == Exactness::Bound,
        _ => false,
    }
}

/// A point and its neighbours within rounding.
struct Neighbourhood([[f64; 3]; 7]);

impl Neighbourhood {
    fn new(p: [f32; 3], radius: f64) -> Self {
        let centre = p.map(f64::from);
        Self(std::array::from_fn(|i| {
            let mut q = centre;
            if i > 0 {
                q[(i - 1) / 2] += if i % 2 == 1 { radius } else { -radius };
            }
            q
        }))
    }
    /// Returns the range of the distances of the neighbours.
    fn distances(&self, program: &sdfc_vm::program::Program) -> f64 {
        span(self.0.iter().map(|&q| evaluate_f64(program, q)))
    }
    /// Returns the range of their gradients, summed over the axes.
    fn gradients(&self, program: &sdfc_vm::program::Program) -> f64 {
        let gradients = self
            .0
            .map(|[x, y, z]| gradient::<f64>(program, V3::new(x, y, z)).gradient);
        span(gradients.iter().map(|g| g.x))
            + span(gradients.iter().map(|g| g.y))
            + span(gradients.iter().map(|g| g.z))
    }
}

/// Returns the absolute difference of two numbers; 0 if both are NaN or the same infinity.
fn abs_difference(a: f32, b: f32) -> f64 {
    if a == b || (a.is_nan() && b.is_nan()) {
        return 0.0;
    }
    let difference = (f64::from(a) - f64::from(b)).abs();
    if difference.is_nan() {
        f64::INFINITY
    } else {
        difference
    }
}

/// Returns the largest value minus the smallest.
fn span(values: impl Iterator<Item = f64>) -> f64 {
    let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(v), high.max(v)]
    });
    ends[1] - ends[0]
}

impl FieldDifferences {
    /// Returns messages for all differences that are not allowed.
    pub(super) fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        let fraction = self.distances_of_allowed.max;
        if fraction > 1.0
            && let Some((p, a, b)) = self.worst
        {
            failures.push(format!(
                "the distances {a} and {b} at {p:?} are {fraction:.1} times as far apart as rounding allows"
            ));
        }
        if self.gradients_differ > 0 {
            failures.push(format!(
                "{} gradients differ by more than {MAX_GRADIENT_DIFFERENCE} of the slope bound, none may",
                self.gradients_differ
            ));
        }
        failures
    }
}

impl fmt::Display for FieldDifferences {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  distances     {} ulp, {:.0} allowed",
            self.distances, self.allowed
        )?;
        if self.jumps > 0 {
            writeln!(
                f,
                "                {} points on jumps of the field left out",
                self.jumps
            )?;
        }
        writeln!(f, "  gradients     {} of the slope bound", self.gradients)
    }
}
