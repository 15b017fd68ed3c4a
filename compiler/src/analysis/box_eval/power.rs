//! Bounds of the gradient of a power near a base of zero, where its logarithm is unbounded.

use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;
use std::f64::consts::E;

/// Minimum base of a power; below it, the power is that of this base.
pub(super) const MIN_POWER_BASE: f64 = 1e-37;
/// Factor on a bound that covers its rounding.
const ROUNDING_FACTOR: f64 = 1.0 + 1e-12;

/// Returns bounds of the gradient of `power`, by its derivatives b·a^(b − 1) by the base `a` and a^b·ln a by the exponent
/// `b`.
pub(super) fn gradient(
    base: Dual<Interval>,
    exponent: Dual<Interval>,
    power: Interval,
) -> V3<Interval> {
    let (range, b) = (base.value, exponent.value);
    let a = Interval {
        lo: range.lo.max(MIN_POWER_BASE),
        hi: range.hi.max(MIN_POWER_BASE),
    };
    let by_base = b * a.pow(b - Interval::point(1.0));
    let by_base = match range.lo < MIN_POWER_BASE {
        true => by_base.hull(Interval::point(0.0)),
        false => by_base,
    };
    let logarithm = a.ln();
    let product = power * logarithm;
    // For a positive exponent, the derivative is lowest at the base e^(−1/b).
    let lowest = match b.lo > 0.0 {
        true => -ROUNDING_FACTOR / (E * b.lo),
        false => f64::NEG_INFINITY,
    };
    let by_exponent = Interval {
        lo: product.lo.max(lowest),
        hi: product.hi,
    };
    base.gradient * by_base + exponent.gradient * by_exponent
}
