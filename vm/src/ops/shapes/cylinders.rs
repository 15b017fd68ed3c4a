//! Cylinders with sharp and rounded rims.

use crate::bounds::Bounds;
use crate::ops::dimension::corner;
use crate::ops::prepare::{from_vec3, half, vec3};
use crate::real::{Real, Vector2, Vector3, lit};

/// Returns the signed distance to a cylinder with sharp rims around the y axis.
#[inline(always)]
pub fn cylinder<R: Real>(p: R::Vec3, r: R, half: R) -> R {
    corner::<R>(R::Vec2::new(p.xz().length() - r, p.y().abs() - half))
}

/// Returns the signed distance to a cylinder with rounded rims: the offset of a smaller sharp one by `round`.
#[inline(always)]
pub fn rounded_cylinder<R: Real>(p: R::Vec3, r: R, half: R, round: R) -> R {
    cylinder::<R>(p, r - round, half - round) - round
}

/// Converts radius, height and rounding to radius, half height and a rounding that fits.
pub fn rounded_cylinder_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let h = half(a[1]);
    vec![a[0], h, a[2].min(a[0]).min(h)]
}

/// Returns the signed distance to a cylinder around the line through `middle` along the unit vector `axis`.
#[inline(always)]
pub fn cylinder_between<R: Real>(p: R::Vec3, middle: R::Vec3, r: R, axis: R::Vec3, half: R) -> R {
    let q = (p - middle).named("q");
    let t = q.dot(axis).named("t");
    corner::<R>(R::Vec2::new((q - axis * t).length() - r, t.abs() - half))
}

/// Converts two end points and a radius to a midpoint, a radius, a unit axis and a half length. Equal end
/// points give a disc across the y axis.
pub fn cylinder_between_parameters<R: Real>(a: &[R]) -> Vec<R> {
    let (from, to) = (vec3::<R>(a), vec3::<R>(&a[3..]));
    let axis = to - from;
    let length = axis.dot(axis).sqrt();
    let none = length.less(lit(1e-12));
    let up = R::Vec3::new(lit(0.0), lit(1.0), lit(0.0));
    let axis = R::Vec3::select(none, up, axis * (lit::<R>(1.0) / length.max(lit(1e-12))));
    let mut v = from_vec3::<R>((from + to) * lit::<R>(0.5));
    v.push(a[6]);
    v.extend(from_vec3::<R>(axis));
    v.push(half(length));
    v
}

/// Bounds a cylinder between two points, given its midpoint, radius, axis and half length. Each cap is a disc
/// across the axis.
pub fn cylinder_between_bounds(a: &[f64]) -> Bounds {
    let reach = |i: usize| {
        let along = a[4 + i];
        (along * a[7]).abs() + a[3] * (1.0 - along * along).max(0.0).sqrt()
    };
    Bounds {
        min: std::array::from_fn(|i| a[i] - reach(i)),
        max: std::array::from_fn(|i| a[i] + reach(i)),
    }
}
