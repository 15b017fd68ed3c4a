//! Scale at which the features of a solid without known extent are seen.
//!
//! A wave, a lattice or a noise is bounded on one side or on none. Its bounds do not tell how long its waves are. In a
//! box much smaller than these, all gradients of the field are alike.

use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::gradient;
use sdfc_vm::program::Program;
use sdfc_vm::vector::V3;

/// Number of points of a box at which gradients are compared.
const POINTS: u32 = 64;
/// Scales that are tried: powers of two, as exponents.
const EXPONENTS: std::ops::RangeInclusive<i32> = -20..=20;
/// Minimum spread of the gradients' directions, of at most one, for the field to have features.
const MIN_SPREAD: f64 = 0.01;
/// Fraction of the largest spread from which on the features are in the box.
const SPREAD_FRACTION: f64 = 0.5;
/// Number of such boxes along the shown one, and the maximum number of those for a scale to be kept.
const FEATURES_SHOWN: f64 = 4.0;
const MAX_FEATURES_SHOWN: f64 = 64.0;
/// Maximum number of instructions that are evaluated; longer programs keep their scale.
const MAX_INSTRUCTIONS: usize = 1_000_000;

/// Returns a better scale for a solid without finite sides than a guessed one; `None` if that shows its features, or
/// if there are none. `box_at` returns the shown box at a scale.
pub(super) fn scale_of_features(
    field: &Program,
    guess: f64,
    box_at: impl Fn(f64) -> Bounds,
) -> Option<f64> {
    let cost = EXPONENTS.count() * POINTS as usize * field.code.len();
    if cost > MAX_INSTRUCTIONS {
        return None;
    }
    let spreads: Vec<(f64, f64)> = EXPONENTS
        .map(|exponent| {
            let scale = 2.0_f64.powi(exponent);
            (scale, spread_of_gradients(field, &box_at(scale)))
        })
        .collect();
    let largest = spreads.iter().fold(0.0, |max: f64, (_, it)| max.max(*it));
    if largest < MIN_SPREAD {
        return None;
    }
    let has_features = |(_, spread): &&(f64, f64)| *spread >= SPREAD_FRACTION * largest;
    let (smallest, _) = spreads.iter().find(has_features)?;
    // Planes through one point look the same at all scales.
    if *smallest == spreads[0].0 {
        return None;
    }
    let is_shown = (*smallest..=smallest * MAX_FEATURES_SHOWN).contains(&guess);
    (!is_shown).then_some(smallest * FEATURES_SHOWN)
}

/// Returns how much the directions of the field's gradients differ in a box: zero if they are all alike, and one if
/// they cancel.
fn spread_of_gradients(field: &Program, bounds: &Bounds) -> f64 {
    let directions = (1..=POINTS).filter_map(|number| {
        let [x, y, z] = bounds.quasi_random_point(number);
        let V3 { x, y, z } = gradient::<f64>(field, V3::new(x, y, z)).gradient;
        DVec3::new(x, y, z).try_normalize()
    });
    let (sum, count) = directions.fold((DVec3::ZERO, 0.0_f64), |(sum, count), direction| {
        (sum + direction, count + 1.0)
    });
    1.0 - sum.length() / count.max(1.0)
}
