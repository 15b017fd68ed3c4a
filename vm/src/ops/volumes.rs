//! Bounding volumes, from the parameters of the bodies (not the arguments of the scene).
//!
//! A plane shape's volume is infinite along z: it is a prism until it is extruded.
//!
//! A shape is at least as far as its volume, along the axis where that is farthest; where it is
//! exact, it is as far as the volume in a straight line. Blends rely on it: they add something to a
//! shape where its distance is small, and that must be near its volume. For the same reason the maps
//! keep empty volumes as they are (see [`Bounds`]).

use crate::bounds::Bounds;

const FAR: f64 = f64::INFINITY;

/// A box in the plane.
fn plane_box(x: f64, y: f64) -> Bounds {
    Bounds::centred([x, y, FAR])
}

/// The box itself: half sizes.
pub fn cuboid(a: &[f64]) -> Bounds {
    Bounds::centred([a[0], a[1], a[2]])
}

/// Half length along y, radius.
pub fn capsule(a: &[f64]) -> Bounds {
    Bounds::centred([a[1], a[0] + a[1], a[1]])
}

/// Start, radius, axis.
pub fn capsule_between(a: &[f64]) -> Bounds {
    let (from, to) = ([a[0], a[1], a[2]], [a[0] + a[4], a[1] + a[5], a[2] + a[6]]);
    Bounds::EMPTY.including(from).including(to).grown(a[3])
}

/// Ring and tube.
pub fn torus(a: &[f64]) -> Bounds {
    Bounds::centred([a[0] + a[1], a[1], a[0] + a[1]])
}

/// Ring, tube and the direction of the arc's end, symmetric about +x.
pub fn capped_torus(a: &[f64]) -> Bounds {
    let (ring, tube, cosine, sine) = (a[0], a[1], a[2], a[3]);
    let z = if cosine < 0.0 { ring } else { ring * sine };
    Bounds {
        min: [ring * cosine, 0.0, -z],
        max: [ring, 0.0, z],
    }
    .grown(tube)
}

/// Radius, half height.
pub fn cylinder(a: &[f64]) -> Bounds {
    Bounds::centred([a[0], a[1], a[0]])
}

/// Middle, radius, axis, half length: each cap is a disc across the axis.
pub fn cylinder_between(a: &[f64]) -> Bounds {
    let reach = |i: usize| {
        let along = a[4 + i];
        (along * a[7]).abs() + a[3] * (1.0 - along * along).max(0.0).sqrt()
    };
    Bounds {
        min: std::array::from_fn(|i| a[i] - reach(i)),
        max: std::array::from_fn(|i| a[i] + reach(i)),
    }
}

/// The direction of the side: everything below the apex, unless it is a needle.
pub fn infinite_cone(_: &[f64]) -> Bounds {
    Bounds {
        min: [-FAR; 3],
        max: [FAR, 0.0, FAR],
    }
}

/// Radii below and above, half height.
pub fn cone(a: &[f64]) -> Bounds {
    cylinder(&[a[0].max(a[1]), a[2]])
}

/// The same, grown by the rounding around its middle.
pub fn rounded_cone(a: &[f64]) -> Bounds {
    let mut b = cone(a).grown(a[7]);
    b.min[1] += a[6];
    b.max[1] += a[6];
    b
}

/// Radii of the balls, height of the first, distance of the second.
pub fn round_cone(a: &[f64]) -> Bounds {
    let ball = |r: f64, y: f64| Bounds {
        min: [-r, y - r, -r],
        max: [r, y + r, r],
    };
    ball(a[0], a[2]).hull(&ball(a[1], a[2] + a[3]))
}

/// The radii.
pub fn ellipsoid(a: &[f64]) -> Bounds {
    Bounds::centred([a[0], a[1], a[2]])
}

/// A half space; bounded along an axis if that is its normal.
pub fn plane(a: &[f64]) -> Bounds {
    let mut b = Bounds::EVERYTHING;
    for i in 0..3 {
        if a[(i + 1) % 3] == 0.0 && a[(i + 2) % 3] == 0.0 {
            if a[i] > 0.0 {
                b.max[i] = a[3] / a[i];
            } else if a[i] < 0.0 {
                b.min[i] = a[3] / a[i];
            }
        }
    }
    b
}

/// Normal and half thickness.
pub fn slab(a: &[f64]) -> Bounds {
    let side = |sign: f64| plane(&[a[0] * sign, a[1] * sign, a[2] * sign, a[3]]);
    side(1.0).common(&side(-1.0))
}

/// Sector, its inverse, apothem and half a side: a disc through the corners.
pub fn ngon(a: &[f64]) -> Bounds {
    let r = a[2].hypot(a[3]);
    plane_box(r, r)
}

/// The polygon and the half height.
pub fn prism(a: &[f64]) -> Bounds {
    cylinder(&[a[2].hypot(a[3]), a[4]])
}

/// Half length, ring and tube, in the xy plane.
pub fn link(a: &[f64]) -> Bounds {
    let r = a[1] + a[2];
    Bounds::centred([r, a[0] + r, a[2]])
}

/// Half side and half height.
pub fn pyramid(a: &[f64]) -> Bounds {
    Bounds::centred([a[0], a[1], a[0]])
}

/// The distance of the faces: the corners lie on diagonals, three times as far.
pub fn tetrahedron(a: &[f64]) -> Bounds {
    Bounds::centred([a[0] * 3.0_f64.sqrt(); 3])
}

/// Radius.
pub fn circle(a: &[f64]) -> Bounds {
    plane_box(a[0], a[0])
}

/// Half sizes.
pub fn rect(a: &[f64]) -> Bounds {
    plane_box(a[0], a[1])
}

/// Start, axis, one over its squared length, radius.
pub fn segment(a: &[f64]) -> Bounds {
    let b = Bounds::EMPTY
        .including([a[0], a[1], 0.0])
        .including([a[0] + a[2], a[1] + a[3], 0.0])
        .grown(a[5]);
    along_z(&b, FAR)
}

/// Sector, its inverse, tip, length and normal of an edge: the farther of its two ends.
pub fn star(a: &[f64]) -> Bounds {
    let (tip, length) = (a[2], a[3]);
    let inner = (tip - length * a[5]).hypot(length * a[4]);
    let r = tip.abs().max(inner);
    plane_box(r, r)
}

/// What came before, and the two ends of an edge.
pub fn polygon_edge(a: &[f64], before: &Bounds) -> Bounds {
    let edge = Bounds::EMPTY
        .including([a[0], a[1], 0.0])
        .including([a[2], a[3], 0.0]);
    before.hull(&along_z(&edge, FAR))
}

fn along_z(b: &Bounds, half: f64) -> Bounds {
    let mut b = *b;
    if !b.is_void() {
        (b.min[2], b.max[2]) = (-half, half);
    }
    b
}

/// A number: nowhere, or everywhere.
pub fn constant(a: &[f64]) -> Bounds {
    if a[0] > 0.0 {
        Bounds::EMPTY
    } else {
        Bounds::EVERYTHING
    }
}

/// Half height of a plane shape.
pub fn extrude(a: &[f64], shape: &Bounds) -> Bounds {
    along_z(shape, a[0])
}

/// Offset from the axis: a disc around the y axis.
pub fn revolve(a: &[f64], shape: &Bounds) -> Bounds {
    if shape.is_void() {
        return *shape;
    }
    // What lies on the other side of the axis does not come along; `r` may be negative.
    let r = shape.max[0] + a[0];
    Bounds {
        min: [-r, shape.min[1], -r],
        max: [r, shape.max[1], r],
    }
}

/// The plane z = 0 of a solid, as a prism. (There is one even where the plane misses the solid: it
/// may be near.)
pub fn slice(_: &[f64], shape: &Bounds) -> Bounds {
    along_z(shape, FAR)
}

/// Axes to mirror: what lies on their positive sides, on both.
pub fn mirror(a: &[f64], shape: &Bounds) -> Bounds {
    let mut b = *shape;
    for (i, axis) in a.iter().take(3).enumerate() {
        if *axis != 0.0 && !b.is_void() {
            b.min[i] = -b.max[i];
        }
    }
    b
}

/// Spacing: without end along each axis that has one.
pub fn repeat(a: &[f64], shape: &Bounds) -> Bounds {
    let mut b = *shape;
    if !b.is_void() {
        for (i, spacing) in a.iter().take(3).enumerate() {
            if *spacing != 0.0 {
                (b.min[i], b.max[i]) = (-FAR, FAR);
            }
        }
    }
    b
}

/// Spacing, one over it, and the last cell.
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

/// A disc around the y axis.
pub fn polar(_: &[f64], shape: &Bounds) -> Bounds {
    if shape.is_void() {
        return *shape;
    }
    let r = shape.reach_from_y();
    Bounds {
        min: [-r, shape.min[1], -r],
        max: [r, shape.max[1], r],
    }
}

/// A disc around the z axis.
pub fn polar_plane(_: &[f64], shape: &Bounds) -> Bounds {
    if shape.is_void() {
        return *shape;
    }
    let r = reach_from_z(shape);
    Bounds {
        min: [-r, -r, shape.min[2]],
        max: [r, r, shape.max[2]],
    }
}

/// Half lengths added to both sides.
pub fn elongate(a: &[f64], shape: &Bounds) -> Bounds {
    if shape.is_void() {
        return *shape;
    }
    Bounds {
        min: std::array::from_fn(|i| shape.min[i] - a[i]),
        max: std::array::from_fn(|i| shape.max[i] + a[i]),
    }
}

/// Turned about the y axis by any angle.
pub fn twist(a: &[f64], shape: &Bounds) -> Bounds {
    if a[0] == 0.0 { *shape } else { polar(a, shape) }
}

/// Turned about the z axis by any angle.
pub fn bend(a: &[f64], shape: &Bounds) -> Bounds {
    if a[0] == 0.0 {
        *shape
    } else {
        polar_plane(a, shape)
    }
}

/// Middle, margin and half sizes of a box: beyond it, the distance is at least that to the box,
/// however little the shape's own is.
pub fn bounded(a: &[f64], _: &Bounds) -> Bounds {
    Bounds {
        min: std::array::from_fn(|i| a[i] - a[4 + i]),
        max: std::array::from_fn(|i| a[i] + a[4 + i]),
    }
}

/// How much a twist by `rate` stretches space within the reach of a shape: the largest singular
/// value of a shear by `rate` times the distance from the axis.
pub fn twist_stretch(a: &[f64], shape: &Bounds) -> f64 {
    shear(1.0, a[0] * shape.reach_from_y(), a[0])
}

/// The same for a bend. Turned by some angle, the shape may be anywhere within its reach.
pub fn bend_stretch(a: &[f64], shape: &Bounds) -> f64 {
    let reach = reach_from_z(shape);
    shear(1.0 + (a[0] * reach).abs(), a[0] * reach, a[0])
}

/// The largest singular value of the matrix (`along`, 0; `across`, 1); 1 without a rate, even for
/// shapes without end.
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

fn reach_from_z(b: &Bounds) -> f64 {
    let reach = |i: usize| b.min[i].abs().max(b.max[i].abs());
    reach(0).hypot(reach(1))
}
