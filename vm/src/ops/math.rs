//! Arithmetic of raw fields: numbers in, a number out.

use crate::real::{Real, Vector3, lit};

/// The first coordinate of the point.
#[inline(always)]
pub fn x<R: Real>(p: R::Vec3) -> R {
    p.x()
}

/// The sum.
#[inline(always)]
pub fn add<R: Real>(a: R, b: R) -> R {
    a + b
}

/// The value of a program's constant.
#[inline(always)]
pub fn constant<R: Real>(value: R) -> R {
    value
}

/// The point with these coordinates.
#[inline(always)]
pub fn point<R: Real>(x: R, y: R, z: R) -> R::Vec3 {
    R::Vec3::new(x, y, z)
}

/// Without its sign.
#[inline(always)]
pub fn abs<R: Real>(a: R) -> R {
    a.abs()
}

/// Gradient noise.
#[inline(always)]
pub fn noise<R: Real>(p: R::Vec3, seed: R) -> R {
    R::noise(p, seed).0 + lit(0.0)
}
