//! Solids: signed distances by the nearest point of the surface that each row describes.

use super::influence_box::InfluenceBox;
use super::leaf_shape::{DistanceFn, LeafDistance, LeafShape};
use super::point::{
    Point, Point2, dot, norm, norm2, point_along, segment_distance, segment_distance_2d, subtract,
    triangle_distance,
};
use super::shapes_2d::{rectangle_distance, regular_polygon};
use sdfc_vm::table::Op;

/// Slope bound of the diamond surface's value.
///
/// The squared slopes sum to at most 6, and the value is divided by √3.
const MAX_DIAMOND_SLOPE: f64 = std::f64::consts::SQRT_2;

/// Returns the solid of a row, or `None` for other rows.
pub(super) fn solid(op: Op, k: &[f64]) -> Option<LeafShape> {
    let all_space = InfluenceBox::ALL_SPACE;
    let mut slope_bound = 1.0;
    let (distance, bounds): (DistanceFn, InfluenceBox) = match op {
        Op::Sphere => (|k, p| norm(p) - k[0], InfluenceBox::centred([k[0]; 3])),
        Op::Cuboid => (cuboid, InfluenceBox::centred([k[0], k[1], k[2]])),
        Op::RoundedCuboid => (rounded_cuboid, InfluenceBox::centred([k[0], k[1], k[2]])),
        Op::BoxFrame => (box_frame, InfluenceBox::centred([k[0], k[1], k[2]])),
        Op::Capsule => (capsule, InfluenceBox::centred([k[1], k[0] + k[1], k[1]])),
        Op::CapsuleBetween => (capsule_between, {
            let ends = [0, 1, 2].map(|i| [k[i], k[i] + k[4 + i]]);
            InfluenceBox {
                low: ends.map(|[a, b]| a.min(b) - k[3]),
                high: ends.map(|[a, b]| a.max(b) + k[3]),
                distance_ratio: 1.0,
            }
        }),
        Op::Torus => (
            torus,
            InfluenceBox::centred([k[0] + k[1], k[1], k[0] + k[1]]),
        ),
        Op::CappedTorus => (
            capped_torus,
            InfluenceBox::centred([k[0] + k[1], k[1], k[0] + k[1]]),
        ),
        Op::Cylinder => (cylinder, InfluenceBox::centred([k[0], k[1], k[0]])),
        Op::RoundedCylinder => (rounded_cylinder, InfluenceBox::centred([k[0], k[1], k[0]])),
        Op::CylinderBetween => (cylinder_between, {
            let half_size = [0, 1, 2].map(|i| (k[4 + i] * k[7]).abs() + k[3]);
            InfluenceBox {
                low: [0, 1, 2].map(|i| k[i] - half_size[i]),
                high: [0, 1, 2].map(|i| k[i] + half_size[i]),
                distance_ratio: 1.0,
            }
        }),
        Op::InfiniteCone => (infinite_cone, all_space),
        Op::Cone => (
            cone,
            InfluenceBox::centred([k[0].max(k[1]), k[2], k[0].max(k[1])]),
        ),
        Op::RoundedCone => (rounded_cone, {
            let radius = k[0].max(k[1]) + k[7];
            InfluenceBox {
                low: [-radius, k[6] - k[2] - k[7], -radius],
                high: [radius, k[6] + k[2] + k[7], radius],
                distance_ratio: 1.0,
            }
        }),
        Op::RoundCone => (round_cone, {
            let (radius, top) = (k[0].max(k[1]), k[2] + k[3]);
            InfluenceBox {
                low: [-radius, (k[2] - k[0]).min(top - k[1]), -radius],
                high: [radius, (k[2] + k[0]).max(top + k[1]), radius],
                distance_ratio: 1.0,
            }
        }),
        Op::Ellipsoid => (ellipsoid, InfluenceBox::centred([k[0], k[1], k[2]])),
        Op::Plane => (|k, p| dot([k[0], k[1], k[2]], p) - k[3], all_space),
        Op::Slab => (|k, p| dot([k[0], k[1], k[2]], p).abs() - k[3], all_space),
        Op::Prism => (prism, {
            let radius = norm2(k[2], k[3]);
            InfluenceBox::centred([radius, k[4], radius])
        }),
        Op::Octahedron => (octahedron, InfluenceBox::centred([k[0]; 3])),
        Op::Tetrahedron => (
            tetrahedron,
            InfluenceBox::centred([k[0] * 3.0_f64.sqrt(); 3]),
        ),
        Op::Pyramid => (pyramid, InfluenceBox::centred([k[0], k[1], k[0]])),
        Op::Link => (
            link,
            InfluenceBox::centred([k[1] + k[2], k[0] + k[1] + k[2], k[2]]),
        ),
        Op::Gyroid => (gyroid, all_space),
        Op::SchwarzP => (schwarz_p, all_space),
        Op::Diamond => {
            slope_bound = MAX_DIAMOND_SLOPE;
            (diamond, all_space)
        }
        _ => return None,
    };
    Some(LeafShape {
        distance: LeafDistance::Own(distance),
        parameters: k.to_vec(),
        bounds,
        slope_bound,
    })
}

/// Returns the distance from the y axis, and the height.
fn cylindrical(p: Point) -> Point2 {
    [norm2(p[0], p[2]), p[1]]
}

fn box_distance(half: Point, p: Point) -> f64 {
    let nearest = [0, 1, 2].map(|i| p[i].clamp(-half[i], half[i]));
    let outside = norm(subtract(p, nearest));
    if outside > 0.0 {
        return outside;
    }
    let gap = [0, 1, 2].map(|i| half[i] - p[i].abs());
    -gap[0].min(gap[1]).min(gap[2])
}

fn cuboid(k: &[f64], p: Point) -> f64 {
    box_distance([k[0], k[1], k[2]], p)
}

fn rounded_cuboid(k: &[f64], p: Point) -> f64 {
    box_distance([k[0] - k[3], k[1] - k[3], k[2] - k[3]], p) - k[3]
}

/// Returns the distance to the nearest of 12 bars, which is one of the three of the point's octant.
///
/// `k[3]` is half of a bar's thickness.
fn box_frame(k: &[f64], p: Point) -> f64 {
    let bar = k[3];
    let mut nearest = f64::INFINITY;
    for along in 0..3 {
        let mut q = p.map(f64::abs);
        let mut half = [bar; 3];
        half[along] = k[along];
        for axis in (0..3).filter(|&axis| axis != along) {
            q[axis] -= k[axis] - bar;
        }
        nearest = nearest.min(box_distance(half, q));
    }
    nearest
}

fn capsule(k: &[f64], p: Point) -> f64 {
    segment_distance(p, [0.0, -k[0], 0.0], [0.0, k[0], 0.0]) - k[1]
}

fn capsule_between(k: &[f64], p: Point) -> f64 {
    let start = [k[0], k[1], k[2]];
    segment_distance(p, start, point_along(start, [k[4], k[5], k[6]], 1.0)) - k[3]
}

fn torus(k: &[f64], p: Point) -> f64 {
    let [radius, height] = cylindrical(p);
    norm2(radius - k[0], height) - k[1]
}

/// Returns the signed distance to a torus arc. `k[2]` and `k[3]` are the cosine and the sine of half the
/// arc.
fn capped_torus(k: &[f64], p: Point) -> f64 {
    let (ring, side) = (k[0], p[2].abs());
    // Compares angles by cross product. Both are at most half a turn.
    if p[0] * k[3] >= side * k[2] {
        return torus(k, p);
    }
    norm([p[0] - ring * k[2], p[1], side - ring * k[3]]) - k[1]
}

fn cylinder(k: &[f64], p: Point) -> f64 {
    rectangle_distance([k[0], k[1]], cylindrical(p))
}

fn rounded_cylinder(k: &[f64], p: Point) -> f64 {
    rectangle_distance([k[0] - k[2], k[1] - k[2]], cylindrical(p)) - k[2]
}

fn cylinder_between(k: &[f64], p: Point) -> f64 {
    let axis = [k[4], k[5], k[6]];
    let from = subtract(p, [k[0], k[1], k[2]]);
    let along = dot(from, axis);
    let radius = norm(point_along(from, axis, -along));
    rectangle_distance([k[3], k[7]], [radius, along])
}

/// Returns the signed distance to an infinite cone. `k` holds the sine and the cosine of half the opening
/// angle.
fn infinite_cone(k: &[f64], p: Point) -> f64 {
    let [radius, height] = cylindrical(p);
    let depth = -height;
    let along = (radius * k[0] + depth * k[1]).max(0.0);
    let distance = norm2(radius - along * k[0], depth - along * k[1]);
    let is_inside = depth >= 0.0 && radius * k[1] < depth * k[0];
    if is_inside { -distance } else { distance }
}

/// Returns the signed distance to a truncated cone of these radii and this half height.
fn cone_distance(bottom: f64, top: f64, half: f64, q: Point2) -> f64 {
    let corners = [[0.0, -half], [bottom, -half], [top, half], [0.0, half]];
    let mut distance = f64::INFINITY;
    for index in 0..3 {
        distance = distance.min(segment_distance_2d(q, corners[index], corners[index + 1]));
    }
    let fraction = (q[1] + half) / (2.0 * half);
    let is_inside = q[1].abs() < half && q[0] < bottom + (top - bottom) * fraction;
    if is_inside { -distance } else { distance }
}

fn cone(k: &[f64], p: Point) -> f64 {
    cone_distance(k[0], k[1], k[2], cylindrical(p))
}

fn rounded_cone(k: &[f64], p: Point) -> f64 {
    let [radius, height] = cylindrical(p);
    cone_distance(k[0], k[1], k[2], [radius, height - k[6]]) - k[7]
}

/// Returns the signed distance to a round cone.
///
/// `k` holds both radii, the height of the lower centre, the height of the upper centre above it, and the
/// normal of the side.
fn round_cone(k: &[f64], p: Point) -> f64 {
    let [radius, height] = cylindrical(p);
    let height = height - k[2];
    let along = height * k[4] - radius * k[5];
    if along <= 0.0 {
        norm2(radius, height) - k[0]
    } else if along >= k[3] * k[4] {
        norm2(radius, height - k[3]) - k[1]
    } else {
        radius * k[4] + height * k[5] - k[0]
    }
}

/// Returns the signed distance to an ellipsoid, along the normal through the point.
///
/// After D. Eberly, *Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid*, 2013.
fn ellipsoid(k: &[f64], p: Point) -> f64 {
    let r = [k[0], k[1], k[2]];
    let min_radius = r[0].min(r[1]).min(r[2]).max(f64::MIN_POSITIVE);
    let max_radius = r[0].max(r[1]).max(r[2]);
    let ratio = r.map(|r| (r / min_radius) * (r / min_radius));
    // Slightly off the planes of symmetry, on which the nearest point may not be unique.
    let y = p.map(|v| v.abs().max(max_radius * 1e-14));
    let z = [0, 1, 2].map(|i| y[i] / r[i]);
    let level = z[0] * z[0] + z[1] * z[1] + z[2] * z[2] - 1.0;
    let narrow = (0..3).find(|&i| r[i] <= min_radius).unwrap_or(0);
    // The sum below decreases in `u`, and its root is between these bounds.
    let mut low = z[narrow];
    let mut high = norm([0, 1, 2].map(|i| ratio[i] * z[i]));
    let mut u = low;
    for _ in 0..200 {
        let (mut sum, mut slope) = (-1.0, 0.0);
        for i in 0..3 {
            let divisor = u + (ratio[i] - 1.0);
            let fraction = ratio[i] * z[i] / divisor;
            sum += fraction * fraction;
            slope -= 2.0 * fraction * fraction / divisor;
        }
        if sum > 0.0 {
            low = u;
        } else {
            high = u;
        }
        let newton = u - sum / slope;
        let next_u = if high > 4.0 * low {
            (low * high).sqrt()
        } else if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next_u - u).abs() <= 1e-16 * u || sum == 0.0 {
            break;
        }
        u = next_u;
    }
    let nearest = [0, 1, 2].map(|i| ratio[i] * y[i] / (u + (ratio[i] - 1.0)));
    let distance = norm(subtract(y, nearest));
    if level < 0.0 { -distance } else { distance }
}

fn prism(k: &[f64], p: Point) -> f64 {
    extrusion_distance(regular_polygon(k, [p[0], p[2]]), p[1].abs() - k[4])
}

/// Returns the distance to an extrusion, from the distance to its 2-D shape and that along the axis.
pub(super) fn extrusion_distance(distance_2d: f64, height: f64) -> f64 {
    if distance_2d > 0.0 && height > 0.0 {
        norm2(distance_2d, height)
    } else {
        distance_2d.max(height)
    }
}

fn octahedron(k: &[f64], p: Point) -> f64 {
    let (r, q) = (k[0], p.map(f64::abs));
    let sum = q[0] + q[1] + q[2];
    if sum <= r {
        return (sum - r) / 3.0_f64.sqrt();
    }
    triangle_distance(q, [[r, 0.0, 0.0], [0.0, r, 0.0], [0.0, 0.0, r]])
}

/// Returns the signed distance to a tetrahedron. `k[0]` is the distance of the faces, and the corners are
/// three times as far.
fn tetrahedron(k: &[f64], p: Point) -> f64 {
    const CORNERS: [Point; 4] = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    let root = 3.0_f64.sqrt();
    let face = |corner: Point| -dot(corner, p) / root - k[0];
    let farthest = CORNERS.map(face).into_iter().fold(f64::MIN, f64::max);
    if farthest <= 0.0 {
        return farthest;
    }
    let [a, b, c, d] = CORNERS.map(|corner| corner.map(|v| v * k[0] * root));
    triangle_distance(p, [a, b, c])
        .min(triangle_distance(p, [a, c, d]))
        .min(triangle_distance(p, [a, d, b]))
        .min(triangle_distance(p, [b, d, c]))
}

/// Returns the signed distance to a pyramid. `k[0]` is half a side of the base, `k[1]` half the height.
fn pyramid(k: &[f64], p: Point) -> f64 {
    let (base, half) = (k[0], k[1]);
    let (x, z) = (p[0].abs().max(p[2].abs()), p[0].abs().min(p[2].abs()));
    let y = p[1];
    // Depth inside the nearest side, along its normal.
    let side = (base * (half - y) - 2.0 * half * x) / norm2(base, 2.0 * half);
    if y > -half && side > 0.0 {
        return -side.min(y + half);
    }
    let q = [x, y, z];
    let foot = norm([(x - base).max(0.0), y + half, (z - base).max(0.0)]);
    let corners = [[0.0, half, 0.0], [base, -half, base], [base, -half, -base]];
    foot.min(triangle_distance(q, corners))
}

/// Returns the signed distance to a link. The nearest point of its curve is on a straight piece, or on the
/// half ring beyond the end.
fn link(k: &[f64], p: Point) -> f64 {
    let beyond_end = (p[1].abs() - k[0]).max(0.0);
    norm2(norm2(p[0], beyond_end) - k[1], p[2]) - k[2]
}

/// Returns the sines and cosines of a point times a frequency.
fn waves(k: &[f64], p: Point) -> ([f64; 3], [f64; 3]) {
    let angles = p.map(|v| v * k[0]);
    (angles.map(f64::sin), angles.map(f64::cos))
}

fn gyroid(k: &[f64], p: Point) -> f64 {
    let (s, c) = waves(k, p);
    (s[0] * c[1] + s[1] * c[2] + s[2] * c[0]).abs() * k[1] - k[2]
}

fn schwarz_p(k: &[f64], p: Point) -> f64 {
    let (_, c) = waves(k, p);
    (c[0] + c[1] + c[2]).abs() * k[1] - k[2]
}

fn diamond(k: &[f64], p: Point) -> f64 {
    let (s, c) = waves(k, p);
    let level = s[0] * s[1] * s[2] + s[0] * c[1] * c[2] + c[0] * s[1] * c[2] + c[0] * c[1] * s[2];
    level.abs() * k[1] - k[2]
}
