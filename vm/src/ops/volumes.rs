//! Bounding volumes, from the parameters of the bodies (not the arguments of the scene).
//!
//! A 2-D shape's volume is infinite along z: it is a prism until it is extruded.
//!
//! A shape's distance is at least that to its volume along the farthest axis; for exact shapes, it is at
//! least the Euclidean distance. Blends rely on this: their offset is nonzero only where a shape's distance
//! is small, and that must be near its volume. For the same reason, the maps keep empty volumes unchanged
//! (see [`Bounds`]).

use crate::bounds::Bounds;

const INFINITE: f64 = f64::INFINITY;

/// Returns a box in the plane.
fn plane_box(x: f64, y: f64) -> Bounds {
    Bounds::centred([x, y, INFINITE])
}

/// A box: half sizes.
pub fn cuboid(a: &[f64]) -> Bounds {
    Bounds::centred([a[0], a[1], a[2]])
}

/// A capsule: half length along y, radius.
pub fn capsule(a: &[f64]) -> Bounds {
    Bounds::centred([a[1], a[0] + a[1], a[1]])
}

/// A capsule between two points: start, radius, axis.
pub fn capsule_between(a: &[f64]) -> Bounds {
    let (from, to) = ([a[0], a[1], a[2]], [a[0] + a[4], a[1] + a[5], a[2] + a[6]]);
    Bounds::EMPTY.including(from).including(to).grown(a[3])
}

/// A torus: ring and tube.
pub fn torus(a: &[f64]) -> Bounds {
    Bounds::centred([a[0] + a[1], a[1], a[0] + a[1]])
}

/// An arc of a torus: ring, tube and the direction of its end, symmetric about +x.
pub fn capped_torus(a: &[f64]) -> Bounds {
    let (ring, tube, cosine, sine) = (a[0], a[1], a[2], a[3]);
    let z = if cosine < 0.0 { ring } else { ring * sine };
    Bounds {
        min: [ring * cosine, 0.0, -z],
        max: [ring, 0.0, z],
    }
    .grown(tube)
}

/// A cylinder: radius, half height.
pub fn cylinder(a: &[f64]) -> Bounds {
    Bounds::centred([a[0], a[1], a[0]])
}

/// A cylinder between two points: midpoint, radius, axis, half length. Each cap is a disc across the axis.
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

/// An infinite cone: the direction of the side. The volume is the half space below the apex.
pub fn infinite_cone(_: &[f64]) -> Bounds {
    Bounds {
        min: [-INFINITE; 3],
        max: [INFINITE, 0.0, INFINITE],
    }
}

/// A truncated cone: radii at bottom and top, half height.
pub fn cone(a: &[f64]) -> Bounds {
    cylinder(&[a[0].max(a[1]), a[2]])
}

/// A rounded cone: a truncated cone around its centre, grown by the rounding.
pub fn rounded_cone(a: &[f64]) -> Bounds {
    let mut b = cone(a).grown(a[7]);
    b.min[1] += a[6];
    b.max[1] += a[6];
    b
}

/// The hull of two spheres: their radii, the height of the first centre, the distance of the second.
pub fn round_cone(a: &[f64]) -> Bounds {
    let ball = |r: f64, y: f64| Bounds {
        min: [-r, y - r, -r],
        max: [r, y + r, r],
    };
    ball(a[0], a[2]).hull(&ball(a[1], a[2] + a[3]))
}

/// An ellipsoid: the radii.
pub fn ellipsoid(a: &[f64]) -> Bounds {
    Bounds::centred([a[0], a[1], a[2]])
}

/// A half space; it is bounded along an axis if that is its normal.
pub fn plane(a: &[f64]) -> Bounds {
    let mut b = Bounds::ALL_SPACE;
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

/// A slab: normal and half thickness.
pub fn slab(a: &[f64]) -> Bounds {
    let side = |sign: f64| plane(&[a[0] * sign, a[1] * sign, a[2] * sign, a[3]]);
    side(1.0).intersection(&side(-1.0))
}

/// A polygon: sector, its inverse, apothem and half a side. The volume is a square around the circle
/// through the corners.
pub fn ngon(a: &[f64]) -> Bounds {
    let r = a[2].hypot(a[3]);
    plane_box(r, r)
}

/// A prism: the polygon and the half height.
pub fn prism(a: &[f64]) -> Bounds {
    cylinder(&[a[2].hypot(a[3]), a[4]])
}

/// A link of a chain in the xy plane: half length, ring and tube.
pub fn link(a: &[f64]) -> Bounds {
    let r = a[1] + a[2];
    Bounds::centred([r, a[0] + r, a[2]])
}

/// A pyramid: half side and half height.
pub fn pyramid(a: &[f64]) -> Bounds {
    Bounds::centred([a[0], a[1], a[0]])
}

/// A tetrahedron: the distance of the faces. The corners lie on diagonals, three times as far.
pub fn tetrahedron(a: &[f64]) -> Bounds {
    Bounds::centred([a[0] * 3.0_f64.sqrt(); 3])
}

/// A disc: the radius.
pub fn circle(a: &[f64]) -> Bounds {
    plane_box(a[0], a[0])
}

/// A rectangle: half sizes.
pub fn rect(a: &[f64]) -> Bounds {
    plane_box(a[0], a[1])
}

/// A segment: start, axis, one over its squared length, radius.
pub fn segment(a: &[f64]) -> Bounds {
    let b = Bounds::EMPTY
        .including([a[0], a[1], 0.0])
        .including([a[0] + a[2], a[1] + a[3], 0.0])
        .grown(a[5]);
    along_z(&b, INFINITE)
}

/// A star: sector, its inverse, tip, length and normal of an edge. The volume contains the farther end of
/// the edge.
pub fn star(a: &[f64]) -> Bounds {
    let (tip, length) = (a[2], a[3]);
    let inner = (tip - length * a[5]).hypot(length * a[4]);
    let r = tip.abs().max(inner);
    plane_box(r, r)
}

/// A polygon's edge: its two ends, and the volume of the previous edges.
pub fn polygon_edge(a: &[f64], before: &Bounds) -> Bounds {
    let edge = Bounds::EMPTY
        .including([a[0], a[1], 0.0])
        .including([a[2], a[3], 0.0]);
    before.hull(&along_z(&edge, INFINITE))
}

fn along_z(b: &Bounds, half: f64) -> Bounds {
    let mut b = *b;
    if !b.is_void() {
        (b.min[2], b.max[2]) = (-half, half);
    }
    b
}

/// A constant: empty if it is positive, otherwise all of space.
pub fn constant(a: &[f64]) -> Bounds {
    if a[0] > 0.0 {
        Bounds::EMPTY
    } else {
        Bounds::ALL_SPACE
    }
}

/// An extrusion: the half height.
pub fn extrude(a: &[f64], shape: &Bounds) -> Bounds {
    along_z(shape, a[0])
}

/// A revolution: the offset from the axis. The volume is a disc around the y axis.
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

/// The section of a solid at z = 0, as a prism. (It is not empty even where the plane misses the solid,
/// which may be near.)
pub fn slice(_: &[f64], shape: &Bounds) -> Bounds {
    along_z(shape, INFINITE)
}

/// A mirrored shape: the flags of the axes. The part on the positive side appears on both sides.
pub fn mirror(a: &[f64], shape: &Bounds) -> Bounds {
    let mut b = *shape;
    for (i, axis) in a.iter().take(3).enumerate() {
        if *axis != 0.0 && !b.is_void() {
            b.min[i] = -b.max[i];
        }
    }
    b
}

/// A repetition: the spacing. The volume is infinite along each axis with a nonzero spacing.
pub fn repeat(a: &[f64], shape: &Bounds) -> Bounds {
    let mut b = *shape;
    if !b.is_void() {
        for (i, spacing) in a.iter().take(3).enumerate() {
            if *spacing != 0.0 {
                (b.min[i], b.max[i]) = (-INFINITE, INFINITE);
            }
        }
    }
    b
}

/// A limited repetition: the spacing, its inverse, and the index of the last cell.
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

/// A polar repetition: a disc around the y axis.
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

/// A polar repetition in the plane: a disc around the z axis.
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

/// An elongated shape: the half lengths, added to both sides.
pub fn elongate(a: &[f64], shape: &Bounds) -> Bounds {
    if shape.is_void() {
        return *shape;
    }
    Bounds {
        min: std::array::from_fn(|i| shape.min[i] - a[i]),
        max: std::array::from_fn(|i| shape.max[i] + a[i]),
    }
}

/// A twisted shape: the shape at any angle about the y axis.
pub fn twist(a: &[f64], shape: &Bounds) -> Bounds {
    if a[0] == 0.0 { *shape } else { polar(a, shape) }
}

/// A bent shape: the shape at any angle about the z axis.
pub fn bend(a: &[f64], shape: &Bounds) -> Bounds {
    if a[0] == 0.0 {
        *shape
    } else {
        polar_plane(a, shape)
    }
}

/// A shape with a box: centre, margin and half sizes. Beyond the box, the distance is at least that to the
/// box, even if the shape's own is less.
pub fn bounded(a: &[f64], _: &Bounds) -> Bounds {
    Bounds {
        min: std::array::from_fn(|i| a[i] - a[4 + i]),
        max: std::array::from_fn(|i| a[i] + a[4 + i]),
    }
}

/// Returns an upper bound of the stretch of a twist by `rate` within a shape's volume: the largest singular
/// value of a shear by `rate` times the distance from the axis.
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
