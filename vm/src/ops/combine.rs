//! Combinations of two distances: hard and smooth set operations.
//!
//! All those based on a minimum are one formula with a kernel, see [`crate::blend`]; the bodies here write
//! it out for each sign. A smooth operation's argument in a scene is the thickness: the largest offset of
//! the blend, which occurs where both operands are equal.

use crate::blend::BlendKernel;
use crate::real::{Real, Vector2, Vector3, lit};

/// Returns the union: the smaller value.
#[inline(always)]
pub fn union<R: Real>(a: R, b: R) -> R {
    a.min(b)
}

/// Returns the intersection: the larger value.
#[inline(always)]
pub fn intersection<R: Real>(a: R, b: R) -> R {
    a.max(b)
}

/// Returns the first shape without the second: the intersection with its complement.
#[inline(always)]
pub fn subtraction<R: Real>(a: R, b: R) -> R {
    a.max(-b)
}

/// Returns the symmetric difference: the region inside exactly one of two shapes.
#[inline(always)]
pub fn xor<R: Real>(a: R, b: R) -> R {
    a.min(b).max(-a.max(b))
}

/// Defines the three smooth operations of a kernel.
macro_rules! smooth {
    ($kernel:ident, $union:ident, $intersection:ident, $subtraction:ident, $shape:literal) => {
        #[doc = concat!("The union with ", $shape, " blend.")]
        #[inline(always)]
        pub fn $union<R: Real>(a: R, b: R, width: R, coefficient: R) -> R {
            a.min(b) - BlendKernel::$kernel.offset_at((a - b).abs(), width, coefficient)
        }

        #[doc = concat!("The intersection with ", $shape, " blend.")]
        #[inline(always)]
        pub fn $intersection<R: Real>(a: R, b: R, width: R, coefficient: R) -> R {
            a.max(b) + BlendKernel::$kernel.offset_at((a - b).abs(), width, coefficient)
        }

        #[doc = concat!("The first without the second, with ", $shape, " blend.")]
        #[inline(always)]
        pub fn $subtraction<R: Real>(a: R, b: R, width: R, coefficient: R) -> R {
            a.max(-b) + BlendKernel::$kernel.offset_at((a + b).abs(), width, coefficient)
        }
    };
}

smooth!(
    Quadratic,
    smooth_union,
    smooth_intersection,
    smooth_subtraction,
    "a parabolic"
);
smooth!(
    Cubic,
    cubic_union,
    cubic_intersection,
    cubic_subtraction,
    "a cubic"
);
smooth!(
    Circular,
    circular_union,
    circular_intersection,
    circular_subtraction,
    "a circular"
);
smooth!(
    Exponential,
    exponential_union,
    exponential_intersection,
    exponential_subtraction,
    "an exponential"
);

/// Returns the union with a parabolic blend whose thickness grows with the distance from `focus`. With the focus
/// at a camera, the blend stays visible from afar. The thickness is `thickness` at the focus, increases by
/// `growth` per unit of length, and is at most `most`. A varying thickness makes the result steeper by its own
/// slope, which the row's slope rule includes.
#[inline(always)]
pub fn distance_union<R: Real>(
    a: R,
    b: R,
    p: R::Vec3,
    focus: R::Vec3,
    thickness: R,
    growth: R,
    most: R,
) -> R {
    let k = (thickness + (p - focus).length() * growth).min(most);
    let width = (k * lit(4.0)).max(lit(1e-18)).named("width");
    let h = (width - (a - b).abs()).max(lit(0.0)).named("h");
    a.min(b) - h * (h / width) * lit(0.25)
}

/// Returns the union with the edge between both chamfered at 45 degrees, `size` from the edge on each side.
#[inline(always)]
pub fn chamfer_union<R: Real>(a: R, b: R, size: R) -> R {
    a.min(b)
        .min((a + b - size) * lit(std::f64::consts::FRAC_1_SQRT_2))
}

/// Returns the intersection with its edge chamfered at 45 degrees, `size` from the edge on each side.
#[inline(always)]
pub fn chamfer_intersection<R: Real>(a: R, b: R, size: R) -> R {
    a.max(b)
        .max((a + b + size) * lit(std::f64::consts::FRAC_1_SQRT_2))
}

/// Returns the first shape without the second, with the edge chamfered at 45 degrees.
#[inline(always)]
pub fn chamfer_subtraction<R: Real>(a: R, b: R, size: R) -> R {
    chamfer_intersection(a, -b, size)
}

/// Returns the union with the edge between both filled by a quarter circle of the radius `r`. It is exactly that
/// where the two surfaces meet at right angles.
#[inline(always)]
pub fn round_union<R: Real>(a: R, b: R, r: R) -> R {
    let corner = R::Vec2::new(r - a, r - b).max(R::Vec2::splat(lit(0.0)));
    r.max(a.min(b)) - corner.length()
}

/// Returns the intersection with its edge rounded by a quarter circle of the radius `r`.
#[inline(always)]
pub fn round_intersection<R: Real>(a: R, b: R, r: R) -> R {
    let corner = R::Vec2::new(r + a, r + b).max(R::Vec2::splat(lit(0.0)));
    (-r).min(a.max(b)) + corner.length()
}

/// Returns the first shape without the second, with the edge rounded by a quarter circle of the radius `r`.
#[inline(always)]
pub fn round_subtraction<R: Real>(a: R, b: R, r: R) -> R {
    round_intersection(a, -b, r)
}

/// Returns the union with stairs between both, of the total width `size`; `step` is half the period of a step.
#[inline(always)]
pub fn stairs_union<R: Real>(a: R, b: R, size: R, step: R) -> R {
    let u = (b - size).named("u");
    let wave = ((u - a + step).modulo(step * lit(2.0)) - step).abs();
    a.min(b).min((u + a + wave) * lit(0.5))
}

/// Returns the intersection with stairs along its edge, by De Morgan's law from [`stairs_union`].
#[inline(always)]
pub fn stairs_intersection<R: Real>(a: R, b: R, size: R, step: R) -> R {
    -stairs_union(-a, -b, size, step)
}

/// Returns the first shape without the second, with stairs along the edge.
#[inline(always)]
pub fn stairs_subtraction<R: Real>(a: R, b: R, size: R, step: R) -> R {
    -stairs_union(-a, b, size, step)
}

/// Returns the linear interpolation from the first value at `t = 0` to the second at `t = 1`.
#[inline(always)]
pub fn morph<R: Real>(a: R, b: R, t: R) -> R {
    a.mix(b, t)
}
