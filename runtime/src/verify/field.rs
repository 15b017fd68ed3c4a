//! The values of two engines at points, compared.

use super::Spread;
use crate::engine::Sample;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::program::{Code, Module};
use sdfc_vm::row::Category;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use serde::Serialize;
use std::fmt;

/// How many points are asked about.
pub const POINTS: usize = 4096;

/// Half a unit in the last place of 1.
const HALF_ULP: f64 = 1.0 / (1 << 24) as f64;
/// How many of these, times the largest number around, two engines' distances may differ by.
const ROUNDINGS: f64 = 16.0;
/// How many times more where a field has functions that are sums of many terms.
const FUNCTIONS: f64 = 8.0;
/// How much two gradients may differ, as a share of the steepest slope.
const GRADIENT: f64 = 1e-2;

/// How the values of two engines differ at [`POINTS`] points in the scene's bounds.
#[derive(Clone, Debug, Serialize)]
pub struct FieldDifferences {
    /// The differences of the distances, in units of the last place of the largest coordinate
    /// (or of 1).
    pub distances: Spread,
    /// The same as a share of what is allowed.
    pub distances_of_allowed: Spread,
    /// What is allowed there, in those units, times the scene's extent, its slope bound and the
    /// factor of the functions it uses.
    pub allowed: f64,
    /// Points where the field itself jumps within rounding of the point, and which are not held
    /// against anybody.
    pub jumps: usize,
    /// The differences of the gradients, as a share of the slope bound.
    pub gradients: Spread,
    /// Gradients that differ although the gradient does not change around the point.
    pub gradients_differ: usize,
    /// Where the distances differ most, compared with what is allowed: the point and both values.
    pub worst: Option<([f32; 3], f32, f32)>,
}

/// Points spread over the bounds and a little around them, always the same ones.
pub(super) fn points(bounds: &Bounds) -> Vec<[f32; 3]> {
    let shown = crate::settings::shown(bounds);
    let around = shown.grown(0.1 * shown.half_diagonal());
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
            let (low, high) = (around.min[axis], around.max[axis]);
            (low + (high - low) * random()) as f32
        })
    };
    (0..POINTS).map(point).collect()
}

/// Compares the values of two engines.
pub(super) fn compare(
    module: &Module,
    points: &[[f32; 3]],
    reference: &[Sample],
    samples: &[Sample],
) -> FieldDifferences {
    let program = &module.distance;
    let shown = crate::settings::shown(&module.settings.bounds);
    let extent = shown
        .min
        .iter()
        .chain(&shown.max)
        .fold(1.0_f64, |most, v| most.max(v.abs()));
    let functions = if program.code.iter().any(|i| is_function(i.code)) {
        FUNCTIONS
    } else {
        1.0
    };
    let roundings = ROUNDINGS * functions;

    let (mut ulps, mut shares, mut gradients) = (Vec::new(), Vec::new(), Vec::new());
    let (mut jumps, mut gradients_differ) = (0, 0);
    let (mut worst, mut worst_share) = (None, -1.0);
    for ((&p, a), b) in points.iter().zip(reference).zip(samples) {
        let largest = p
            .iter()
            .fold(1.0_f64, |most, v| most.max(f64::from(v.abs())));
        let apart = difference(a.distance, b.distance);
        let allowed = roundings * HALF_ULP * largest.max(extent);
        let around = Around::of(p, 8.0 * HALF_ULP * largest);
        if apart > allowed && around.distances(program) >= apart / 2.0 {
            jumps += 1;
        } else {
            ulps.push(apart / (2.0 * HALF_ULP * largest.log2().floor().exp2()));
            shares.push(apart / allowed);
            if apart / allowed > worst_share {
                worst_share = apart / allowed;
                worst = Some((p, a.distance, b.distance));
            }
        }
        let both = a.gradient.iter().zip(b.gradient);
        let apart: f64 = both.map(|(&a, b)| difference(a, b)).sum();
        gradients.push(apart);
        if apart > GRADIENT && around.gradients(program) < apart / 2.0 {
            gradients_differ += 1;
        }
    }
    FieldDifferences {
        distances: Spread::of(ulps),
        distances_of_allowed: Spread::of(shares),
        allowed: roundings / 2.0 * extent,
        jumps,
        gradients: Spread::of(gradients),
        gradients_differ,
        worst,
    }
}

/// Whether an instruction sums many terms: sines, powers, noise.
fn is_function(code: Code) -> bool {
    let Code::Op(op) = code else { return false };
    match op.row().meta.category {
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
        Category::Shape3 => matches!(op, Op::Gyroid | Op::SchwarzP | Op::Diamond),
        _ => false,
    }
}

/// A point and its neighbours within rounding.
struct Around([[f64; 3]; 7]);

impl Around {
    fn of(p: [f32; 3], reach: f64) -> Self {
        let centre = p.map(f64::from);
        Self(std::array::from_fn(|i| {
            let mut q = centre;
            if i > 0 {
                q[(i - 1) / 2] += if i % 2 == 1 { reach } else { -reach };
            }
            q
        }))
    }
    /// How far the distances of the neighbours are apart.
    fn distances(&self, program: &sdfc_vm::program::Program) -> f64 {
        span(self.0.iter().map(|&q| evaluate_f64(program, q)))
    }
    /// How far their gradients are apart.
    fn gradients(&self, program: &sdfc_vm::program::Program) -> f64 {
        let all = self
            .0
            .map(|[x, y, z]| gradient::<f64>(program, V3::of(x, y, z)).gradient);
        span(all.iter().map(|g| g.x))
            + span(all.iter().map(|g| g.y))
            + span(all.iter().map(|g| g.z))
    }
}

/// How far two numbers are apart; nothing where both are the same infinity or no number.
fn difference(a: f32, b: f32) -> f64 {
    if a == b || (a.is_nan() && b.is_nan()) {
        return 0.0;
    }
    let apart = (f64::from(a) - f64::from(b)).abs();
    if apart.is_nan() { f64::INFINITY } else { apart }
}

/// The largest minus the smallest.
fn span(values: impl Iterator<Item = f64>) -> f64 {
    let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(v), high.max(v)]
    });
    ends[1] - ends[0]
}

impl FieldDifferences {
    /// What is more than may be.
    pub(super) fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        let share = self.distances_of_allowed.max;
        if share > 1.0
            && let Some((p, a, b)) = self.worst
        {
            failures.push(format!(
                "the distances {a} and {b} at {p:?} are {share:.1} times as far apart as rounding allows"
            ));
        }
        if self.gradients_differ > 0 {
            failures.push(format!(
                "{} gradients differ by more than {GRADIENT} of the slope bound, none may",
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
