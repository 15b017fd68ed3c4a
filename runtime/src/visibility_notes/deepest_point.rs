//! A search for the deepest point of a solid: samples, and descents along the gradient from the lowest of them.

use super::{field_at, samples};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::program::Module;
use sdfc_vm::vector::V3;

/// Number of samples from which a descent starts.
const STARTS: usize = 64;
/// Maximum number of steps of a descent.
const MAX_STEPS: usize = 24;
/// Maximum number of halvings of a step.
const MAX_HALVINGS: u32 = 8;
/// Length of a step, in units of the one that leads to zero.
const STEP_FRACTION: f64 = 1.2;

/// Returns the least value of the field that is found in a region, and its point. It is infinite where the field is not
/// defined.
pub(super) fn deepest_point(module: &Module, bounds: &Bounds, is_2d: bool) -> (f32, [f64; 3]) {
    let mut starts: Vec<_> = samples(module, bounds, is_2d)
        .filter(|(value, _)| !value.is_nan())
        .collect();
    starts.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    starts.truncate(STARTS);
    let lowest = |best: (f32, [f64; 3]), other: (f32, [f64; 3])| match other.0 < best.0 {
        true => other,
        false => best,
    };
    let none = (f32::INFINITY, bounds.centre());
    let sampled = starts.first().copied().unwrap_or(none);
    // A negative sample is in a solid, whichever is the deepest one.
    if sampled.0 < 0.0 {
        return sampled;
    }
    let descents = starts.iter().map(|&(_, start)| descent(module, start));
    descents.fold(sampled, lowest)
}

/// Returns the end of a descent from a point, and the value there.
fn descent(module: &Module, start: [f64; 3]) -> (f32, [f64; 3]) {
    let mut p = DVec3::from(start);
    for _ in 0..MAX_STEPS {
        let sample = gradient::<f64>(&module.distance, V3::new(p.x, p.y, p.z));
        let V3 { x, y, z } = sample.gradient;
        let slope = DVec3::new(x, y, z);
        let step = slope * (sample.value * STEP_FRACTION / slope.length_squared());
        if sample.value < 0.0 || !step.is_finite() {
            break;
        }
        let mut tries = (0..MAX_HALVINGS).map(|halvings| p - step / f64::from(1 << halvings));
        let Some(next) =
            tries.find(|&next| evaluate_f64(&module.distance, next.into()) < sample.value)
        else {
            break;
        };
        p = next;
    }
    (field_at(module, p.into()), p.into())
}
