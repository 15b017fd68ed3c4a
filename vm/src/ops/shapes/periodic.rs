//! Triply periodic surfaces, as sheets. The gradient of each level function is at most √3 long (sampled, and
//! attained on the surface). So dividing by √3 makes the result a lower bound of the distance. A sheet has at
//! least the requested thickness, and up to √2 times that where the function is flatter.

use crate::ops::prepare::half;
use crate::real::{Real, Vector3, lit};

/// Returns sines and cosines of the coordinates, as angles.
#[inline(always)]
fn waves<R: Real>(p: R::Vec3, frequency: R) -> (R::Vec3, R::Vec3) {
    let q = (p * frequency).named("q");
    let s = R::Vec3::new(q.x().sin(), q.y().sin(), q.z().sin()).named("s");
    let c = R::Vec3::new(q.x().cos(), q.y().cos(), q.z().cos()).named("c");
    (s, c)
}

/// Converts the size of a cell and the thickness of a sheet to radians per unit, a scale, and half the
/// thickness. The scale makes the level function a lower bound of the distance.
pub fn periodic_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let per_radian = a[0] * lit(1.0 / std::f64::consts::TAU);
    let steepest = 3.0_f64.sqrt();
    vec![
        lit::<R>(1.0) / per_radian.max(lit(1e-12)),
        per_radian * lit(1.0 / steepest),
        half(a[1]),
    ]
}

/// Returns a lower bound of the distance to a sheet along the gyroid
/// `sin x cos y + sin y cos z + sin z cos x = 0`.
#[inline(always)]
pub fn gyroid<R: Real>(p: R::Vec3, frequency: R, scale: R, half: R) -> R {
    let (s, c) = waves::<R>(p, frequency);
    s.dot(R::Vec3::new(c.y(), c.z(), c.x())).abs() * scale - half
}

/// Returns a lower bound of the distance to a sheet along H. A. Schwarz's primitive surface
/// `cos x + cos y + cos z = 0`.
#[inline(always)]
pub fn schwarz_p<R: Real>(p: R::Vec3, frequency: R, scale: R, half: R) -> R {
    let q = (p * frequency).named("q");
    (q.x().cos() + q.y().cos() + q.z().cos()).abs() * scale - half
}

/// Returns a lower bound of the distance to a sheet along the diamond surface of H. A. Schwarz.
#[inline(always)]
pub fn diamond<R: Real>(p: R::Vec3, frequency: R, scale: R, half: R) -> R {
    let (s, c) = waves::<R>(p, frequency);
    let sum = s.x() * (s.y() * s.z() + c.y() * c.z()) + c.x() * (s.y() * c.z() + c.y() * s.z());
    sum.abs() * scale - half
}
