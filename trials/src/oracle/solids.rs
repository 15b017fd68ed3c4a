//! Solids: signed distances by the nearest point of the surface that each row describes.

use super::extent::Extent;
use super::figures::{regular_polygon, to_rectangle};
use super::point::{
    Flat, Point, beyond, dot, minus, norm, norm2, to_flat_segment, to_segment, to_triangle,
};
use sdfc_vm::table::Op;

/// The distance of a shape as a function of its numbers and the point.
pub(super) type Body = fn(&[f64], Point) -> f64;

/// A solid or figure: its distance as a function of its numbers and the point.
#[derive(Clone, Debug)]
pub(super) struct Leaf {
    /// The distance.
    pub(super) body: Body,
    /// The numbers of its parameters.
    pub(super) numbers: Vec<f64>,
    /// The box around it.
    pub(super) extent: Extent,
    /// The most that its value changes per unit of length.
    pub(super) steepness: f64,
}

/// The steepest slope of the diamond surface's value.
///
/// The squares of its slopes add up to six at most, and its value is divided by √3.
const MAX_DIAMOND_SLOPE: f64 = std::f64::consts::SQRT_2;

/// The solid of a row, if it is one.
pub(super) fn solid(op: Op, k: &[f64]) -> Option<Leaf> {
    let everywhere = Extent::EVERYWHERE;
    let mut steepness = 1.0;
    let (body, extent): (Body, Extent) = match op {
        Op::Sphere => (|k, p| norm(p) - k[0], Extent::centred([k[0]; 3])),
        Op::Cuboid => (cuboid, Extent::centred([k[0], k[1], k[2]])),
        Op::RoundedCuboid => (rounded_cuboid, Extent::centred([k[0], k[1], k[2]])),
        Op::BoxFrame => (box_frame, Extent::centred([k[0], k[1], k[2]])),
        Op::Capsule => (capsule, Extent::centred([k[1], k[0] + k[1], k[1]])),
        Op::CapsuleBetween => (capsule_between, {
            let ends = [0, 1, 2].map(|i| [k[i], k[i] + k[4 + i]]);
            Extent {
                low: ends.map(|[a, b]| a.min(b) - k[3]),
                high: ends.map(|[a, b]| a.max(b) + k[3]),
                rate: 1.0,
            }
        }),
        Op::Torus => (torus, Extent::centred([k[0] + k[1], k[1], k[0] + k[1]])),
        Op::CappedTorus => (
            capped_torus,
            Extent::centred([k[0] + k[1], k[1], k[0] + k[1]]),
        ),
        Op::Cylinder => (cylinder, Extent::centred([k[0], k[1], k[0]])),
        Op::RoundedCylinder => (rounded_cylinder, Extent::centred([k[0], k[1], k[0]])),
        Op::CylinderBetween => (cylinder_between, {
            let reach = [0, 1, 2].map(|i| (k[4 + i] * k[7]).abs() + k[3]);
            Extent {
                low: [0, 1, 2].map(|i| k[i] - reach[i]),
                high: [0, 1, 2].map(|i| k[i] + reach[i]),
                rate: 1.0,
            }
        }),
        Op::InfiniteCone => (infinite_cone, everywhere),
        Op::Cone => (
            cone,
            Extent::centred([k[0].max(k[1]), k[2], k[0].max(k[1])]),
        ),
        Op::RoundedCone => (rounded_cone, {
            let wide = k[0].max(k[1]) + k[7];
            Extent {
                low: [-wide, k[6] - k[2] - k[7], -wide],
                high: [wide, k[6] + k[2] + k[7], wide],
                rate: 1.0,
            }
        }),
        Op::RoundCone => (round_cone, {
            let (wide, top) = (k[0].max(k[1]), k[2] + k[3]);
            Extent {
                low: [-wide, (k[2] - k[0]).min(top - k[1]), -wide],
                high: [wide, (k[2] + k[0]).max(top + k[1]), wide],
                rate: 1.0,
            }
        }),
        Op::Ellipsoid => (ellipsoid, Extent::centred([k[0], k[1], k[2]])),
        Op::Plane => (|k, p| dot([k[0], k[1], k[2]], p) - k[3], everywhere),
        Op::Slab => (|k, p| dot([k[0], k[1], k[2]], p).abs() - k[3], everywhere),
        Op::Prism => (prism, {
            let wide = norm2(k[2], k[3]);
            Extent::centred([wide, k[4], wide])
        }),
        Op::Octahedron => (octahedron, Extent::centred([k[0]; 3])),
        Op::Tetrahedron => (tetrahedron, Extent::centred([k[0] * 3.0_f64.sqrt(); 3])),
        Op::Pyramid => (pyramid, Extent::centred([k[0], k[1], k[0]])),
        Op::Link => (
            link,
            Extent::centred([k[1] + k[2], k[0] + k[1] + k[2], k[2]]),
        ),
        Op::Gyroid => (gyroid, everywhere),
        Op::SchwarzP => (schwarz_p, everywhere),
        Op::Diamond => {
            steepness = MAX_DIAMOND_SLOPE;
            (diamond, everywhere)
        }
        _ => return None,
    };
    Some(Leaf {
        body,
        numbers: k.to_vec(),
        extent,
        steepness,
    })
}

/// The distance from the y axis, and the height.
fn around(p: Point) -> Flat {
    [norm2(p[0], p[2]), p[1]]
}

fn to_box(half: Point, p: Point) -> f64 {
    let nearest = [0, 1, 2].map(|i| p[i].clamp(-half[i], half[i]));
    let outside = norm(minus(p, nearest));
    if outside > 0.0 {
        return outside;
    }
    let gap = [0, 1, 2].map(|i| half[i] - p[i].abs());
    -gap[0].min(gap[1]).min(gap[2])
}

fn cuboid(k: &[f64], p: Point) -> f64 {
    to_box([k[0], k[1], k[2]], p)
}

fn rounded_cuboid(k: &[f64], p: Point) -> f64 {
    to_box([k[0] - k[3], k[1] - k[3], k[2] - k[3]], p) - k[3]
}

/// The nearest of twelve bars, which is one of the three of the point's octant.
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
        nearest = nearest.min(to_box(half, q));
    }
    nearest
}

fn capsule(k: &[f64], p: Point) -> f64 {
    to_segment(p, [0.0, -k[0], 0.0], [0.0, k[0], 0.0]) - k[1]
}

fn capsule_between(k: &[f64], p: Point) -> f64 {
    let start = [k[0], k[1], k[2]];
    to_segment(p, start, beyond(start, [k[4], k[5], k[6]], 1.0)) - k[3]
}

fn torus(k: &[f64], p: Point) -> f64 {
    let [radius, height] = around(p);
    norm2(radius - k[0], height) - k[1]
}

/// `k[2]` and `k[3]` are the cosine and the sine of half the arc.
fn capped_torus(k: &[f64], p: Point) -> f64 {
    let (ring, side) = (k[0], p[2].abs());
    // Both angles are at most half a turn.
    if p[0] * k[3] >= side * k[2] {
        return torus(k, p);
    }
    norm([p[0] - ring * k[2], p[1], side - ring * k[3]]) - k[1]
}

fn cylinder(k: &[f64], p: Point) -> f64 {
    to_rectangle([k[0], k[1]], around(p))
}

fn rounded_cylinder(k: &[f64], p: Point) -> f64 {
    to_rectangle([k[0] - k[2], k[1] - k[2]], around(p)) - k[2]
}

fn cylinder_between(k: &[f64], p: Point) -> f64 {
    let axis = [k[4], k[5], k[6]];
    let from = minus(p, [k[0], k[1], k[2]]);
    let along = dot(from, axis);
    let radius = norm(beyond(from, axis, -along));
    to_rectangle([k[3], k[7]], [radius, along])
}

/// `k` is the sine and the cosine of half the opening.
fn infinite_cone(k: &[f64], p: Point) -> f64 {
    let [radius, height] = around(p);
    let depth = -height;
    let along = (radius * k[0] + depth * k[1]).max(0.0);
    let distance = norm2(radius - along * k[0], depth - along * k[1]);
    let is_inside = depth >= 0.0 && radius * k[1] < depth * k[0];
    if is_inside { -distance } else { distance }
}

/// The signed distance to a truncated cone of these radii and this half height.
fn to_cone(bottom: f64, top: f64, half: f64, q: Flat) -> f64 {
    let corners = [[0.0, -half], [bottom, -half], [top, half], [0.0, half]];
    let mut distance = f64::INFINITY;
    for at in 0..3 {
        distance = distance.min(to_flat_segment(q, corners[at], corners[at + 1]));
    }
    let share = (q[1] + half) / (2.0 * half);
    let is_inside = q[1].abs() < half && q[0] < bottom + (top - bottom) * share;
    if is_inside { -distance } else { distance }
}

fn cone(k: &[f64], p: Point) -> f64 {
    to_cone(k[0], k[1], k[2], around(p))
}

fn rounded_cone(k: &[f64], p: Point) -> f64 {
    let [radius, height] = around(p);
    to_cone(k[0], k[1], k[2], [radius, height - k[6]]) - k[7]
}

/// `k` holds both radii, the height of the lower centre, that of the upper one above it, and the
/// normal of the side.
fn round_cone(k: &[f64], p: Point) -> f64 {
    let [radius, height] = around(p);
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

/// The distance along the normal that meets the point.
///
/// After D. Eberly, *Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid*, 2013.
fn ellipsoid(k: &[f64], p: Point) -> f64 {
    let r = [k[0], k[1], k[2]];
    let least = r[0].min(r[1]).min(r[2]).max(f64::MIN_POSITIVE);
    let most = r[0].max(r[1]).max(r[2]);
    let ratio = r.map(|r| (r / least) * (r / least));
    // A hair off the planes of symmetry, where the nearest point would not be unique.
    let y = p.map(|v| v.abs().max(most * 1e-14));
    let z = [0, 1, 2].map(|i| y[i] / r[i]);
    let level = z[0] * z[0] + z[1] * z[1] + z[2] * z[2] - 1.0;
    let narrow = (0..3).find(|&i| r[i] <= least).unwrap_or(0);
    // The sum below falls, and its root lies between these.
    let mut low = z[narrow];
    let mut high = norm([0, 1, 2].map(|i| ratio[i] * z[i]));
    let mut u = low;
    for _ in 0..200 {
        let (mut sum, mut slope) = (-1.0, 0.0);
        for i in 0..3 {
            let divisor = u + (ratio[i] - 1.0);
            let share = ratio[i] * z[i] / divisor;
            sum += share * share;
            slope -= 2.0 * share * share / divisor;
        }
        if sum > 0.0 {
            low = u;
        } else {
            high = u;
        }
        let newton = u - sum / slope;
        let next = if high > 4.0 * low {
            (low * high).sqrt()
        } else if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - u).abs() <= 1e-16 * u || sum == 0.0 {
            break;
        }
        u = next;
    }
    let nearest = [0, 1, 2].map(|i| ratio[i] * y[i] / (u + (ratio[i] - 1.0)));
    let distance = norm(minus(y, nearest));
    if level < 0.0 { -distance } else { distance }
}

fn prism(k: &[f64], p: Point) -> f64 {
    extruded(regular_polygon(k, [p[0], p[2]]), p[1].abs() - k[4])
}

/// The distance to the prism on a figure, from the distance to the figure and that along the axis.
pub(super) fn extruded(figure: f64, height: f64) -> f64 {
    if figure > 0.0 && height > 0.0 {
        norm2(figure, height)
    } else {
        figure.max(height)
    }
}

fn octahedron(k: &[f64], p: Point) -> f64 {
    let (r, q) = (k[0], p.map(f64::abs));
    let sum = q[0] + q[1] + q[2];
    if sum <= r {
        return (sum - r) / 3.0_f64.sqrt();
    }
    to_triangle(q, [[r, 0.0, 0.0], [0.0, r, 0.0], [0.0, 0.0, r]])
}

/// `k[0]` is the distance of the faces, and that of the corners is three times as much.
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
    to_triangle(p, [a, b, c])
        .min(to_triangle(p, [a, c, d]))
        .min(to_triangle(p, [a, d, b]))
        .min(to_triangle(p, [b, d, c]))
}

/// `k[0]` is half a side of the base, `k[1]` half the height.
fn pyramid(k: &[f64], p: Point) -> f64 {
    let (base, half) = (k[0], k[1]);
    let (x, z) = (p[0].abs().max(p[2].abs()), p[0].abs().min(p[2].abs()));
    let y = p[1];
    // How far inside of the nearest side, along its normal.
    let side = (base * (half - y) - 2.0 * half * x) / norm2(base, 2.0 * half);
    if y > -half && side > 0.0 {
        return -side.min(y + half);
    }
    let q = [x, y, z];
    let foot = norm([(x - base).max(0.0), y + half, (z - base).max(0.0)]);
    let corners = [[0.0, half, 0.0], [base, -half, base], [base, -half, -base]];
    foot.min(to_triangle(q, corners))
}

/// The nearest point of the curve lies on a straight piece, or on the half ring beyond its end.
fn link(k: &[f64], p: Point) -> f64 {
    let beyond_end = (p[1].abs() - k[0]).max(0.0);
    norm2(norm2(p[0], beyond_end) - k[1], p[2]) - k[2]
}

/// The sines and cosines of a point times a frequency.
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
