//! Bounding boxes of operations other than shapes, from the parameters of the bodies (not the arguments of
//! the scene).
//!
//! A shape's distance is at least that to its bounding box, as [`shapes`](super::shapes) describes. For this reason,
//! the maps keep empty boxes unchanged (see [`Bounds`]).

use crate::bounds::Bounds;

/// Returns a box with another half length along z, around the xy plane. Empty boxes stay empty.
pub(super) fn along_z(b: &Bounds, half: f64) -> Bounds {
    let mut b = *b;
    if !b.is_void() {
        (b.min[2], b.max[2]) = (-half, half);
    }
    b
}

/// Bounds a constant: empty if it is positive, otherwise all of space.
pub fn constant(a: &[f64]) -> Bounds {
    if a[0] > 0.0 {
        Bounds::EMPTY
    } else {
        Bounds::ALL_SPACE
    }
}

/// Bounds an extrusion, given its half height.
pub fn extrude(a: &[f64], shape: &Bounds) -> Bounds {
    along_z(shape, a[0])
}

/// Bounds a revolution, given the offset from the axis. The box is a disc around the y axis.
pub fn revolve(a: &[f64], shape: &Bounds) -> Bounds {
    if shape.is_void() {
        return *shape;
    }
    // The part beyond the axis is not revolved; `r` may be negative.
    let r = shape.max[0] + a[0];
    Bounds {
        min: [-r, shape.min[1], -r],
        max: [r, shape.max[1], r],
    }
}

/// Bounds the section of a solid at z = 0, as a prism. (It is not empty even where the plane misses the solid,
/// which may be near.)
pub fn slice(_: &[f64], shape: &Bounds) -> Bounds {
    along_z(shape, f64::INFINITY)
}

/// Bounds a mirrored shape, given the flags of the axes. The part on the positive side appears on both sides.
pub fn mirror(a: &[f64], shape: &Bounds) -> Bounds {
    let mut b = *shape;
    for (i, axis) in a.iter().take(3).enumerate() {
        if *axis != 0.0 && !b.is_void() {
            b.min[i] = -b.max[i];
        }
    }
    b
}

/// Bounds a repetition, given the spacing. The box is infinite along each axis with a nonzero spacing.
pub fn repeat(a: &[f64], shape: &Bounds) -> Bounds {
    let mut b = *shape;
    if !b.is_void() {
        for (i, spacing) in a.iter().take(3).enumerate() {
            if *spacing != 0.0 {
                (b.min[i], b.max[i]) = (-f64::INFINITY, f64::INFINITY);
            }
        }
    }
    b
}

/// Bounds a limited repetition, given the spacing, its inverse, and the index of the last cell.
pub fn repeat_limited(a: &[f64], shape: &Bounds) -> Bounds {
    let mut b = *shape;
    if !b.is_void() {
        for i in 0..3 {
            let reach = (a[i] * a[6 + i] / 2.0).abs();
            b.min[i] -= reach;
            b.max[i] += reach;
        }
    }
    b
}

/// Bounds a polar repetition by a disc around the y axis.
pub fn polar(_: &[f64], shape: &Bounds) -> Bounds {
    if shape.is_void() {
        return *shape;
    }
    let r = shape.radius_about_y();
    Bounds {
        min: [-r, shape.min[1], -r],
        max: [r, shape.max[1], r],
    }
}

/// Bounds a polar repetition in the plane by a disc around the z axis.
pub fn polar_plane(_: &[f64], shape: &Bounds) -> Bounds {
    if shape.is_void() {
        return *shape;
    }
    let r = radius_about_z(shape);
    Bounds {
        min: [-r, -r, shape.min[2]],
        max: [r, r, shape.max[2]],
    }
}

/// Bounds an elongated shape, given the half lengths, which are added to both sides.
pub fn elongate(a: &[f64], shape: &Bounds) -> Bounds {
    if shape.is_void() {
        return *shape;
    }
    Bounds {
        min: std::array::from_fn(|i| shape.min[i] - a[i]),
        max: std::array::from_fn(|i| shape.max[i] + a[i]),
    }
}

/// Bounds a twisted shape by the shape at any angle about the y axis.
pub fn twist(a: &[f64], shape: &Bounds) -> Bounds {
    if a[0] == 0.0 { *shape } else { polar(a, shape) }
}

/// Bounds a bent shape by the shape at any angle about the z axis.
pub fn bend(a: &[f64], shape: &Bounds) -> Bounds {
    if a[0] == 0.0 {
        *shape
    } else {
        polar_plane(a, shape)
    }
}

/// Bounds a shape by its box, given centre, margin and half sizes. Beyond the box, the distance is at least that
/// to the box, even if the shape's own is less.
pub fn bounded(a: &[f64], _: &Bounds) -> Bounds {
    Bounds {
        min: std::array::from_fn(|i| a[i] - a[4 + i]),
        max: std::array::from_fn(|i| a[i] + a[4 + i]),
    }
}

/// Returns an upper bound of the stretch of a twist by `rate` within a shape's bounding box. It is the largest
/// singular value of a shear by `rate` times the distance from the axis.
pub fn twist_stretch(a: &[f64], shape: &Bounds) -> f64 {
    shear(1.0, a[0] * shape.radius_about_y(), a[0])
}

/// Returns an upper bound of the stretch of a bend. The shape may have any angle within its distance from
/// the axis.
pub fn bend_stretch(a: &[f64], shape: &Bounds) -> f64 {
    let reach = radius_about_z(shape);
    shear(1.0 + (a[0] * reach).abs(), a[0] * reach, a[0])
}

/// Returns the largest singular value of the matrix (`along`, 0; `across`, 1); 1 for the rate 0, even for
/// infinite shapes.
fn shear(along: f64, across: f64, rate: f64) -> f64 {
    if rate == 0.0 {
        return 1.0;
    }
    if !across.is_finite() {
        return f64::INFINITY;
    }
    let sum = along * along + across * across + 1.0;
    ((sum + (sum * sum - 4.0 * along * along).max(0.0).sqrt()) / 2.0).sqrt()
}

fn radius_about_z(b: &Bounds) -> f64 {
    let reach = |i: usize| b.min[i].abs().max(b.max[i].abs());
    reach(0).hypot(reach(1))
}
