//! The definition of each shape as membership, without distances wherever possible.

use crate::fixture::{Point, add, distance, dot, length, sub};
use sdfc_vm::table::Op;
use std::f64::consts::{PI, TAU};

/// Reports whether a point is in the shape with these arguments.
pub(crate) fn contains(op: Op, a: &[f64], p: Point) -> bool {
    let [x, y, z] = p;
    let rad = x.hypot(z);
    match op {
        Op::Sphere => dot(p, p) <= a[0] * a[0],
        Op::Cuboid => (0..3).all(|i| p[i].abs() <= a[i] / 2.0),
        Op::RoundedCuboid => {
            let round = a[3].min(a[0] / 2.0).min(a[1] / 2.0).min(a[2] / 2.0);
            near_box(p, [0, 1, 2].map(|i| a[i] / 2.0 - round), round)
        }
        Op::BoxFrame => {
            let bar = a[3].min(a[0]).min(a[1]).min(a[2]);
            let edges = (0..3).filter(|&i| p[i].abs() >= a[i] / 2.0 - bar).count();
            edges >= 2 && (0..3).all(|i| p[i].abs() <= a[i] / 2.0)
        }
        Op::Capsule => {
            let centre = |t: f64| [0.0, (t - 0.5) * a[0], 0.0];
            least(|t| distance(p, centre(t))) <= a[1]
        }
        Op::CapsuleBetween => {
            let (from, to) = ([a[0], a[1], a[2]], [a[3], a[4], a[5]]);
            least(|t| distance(p, add(from, sub(to, from), t))) <= a[6]
        }
        Op::Torus => {
            rad.powi(2) + dot(p, p) + a[0].powi(2) - y * y - 2.0 * a[0] * rad
                <= a[1] * a[1] + rad.powi(2) - y * y
        }
        Op::CappedTorus => {
            let ring = |t: f64| {
                let angle = (t - 0.5) * a[2].min(TAU);
                [a[0] * angle.cos(), 0.0, a[0] * angle.sin()]
            };
            least(|t| distance(p, ring(t))) <= a[1]
        }
        Op::Cylinder => rad <= a[0] && y.abs() <= a[1] / 2.0,
        Op::RoundedCylinder => {
            let round = a[2].min(a[0]).min(a[1] / 2.0);
            near_box(
                [rad, y, 0.0],
                [a[0] - round, a[1] / 2.0 - round, 0.0],
                round,
            )
        }
        Op::CylinderBetween => {
            let (from, to) = ([a[0], a[1], a[2]], [a[3], a[4], a[5]]);
            let axis = sub(to, from);
            let t = dot(sub(p, from), axis) / dot(axis, axis);
            (0.0..=1.0).contains(&t) && distance(p, add(from, axis, t)) <= a[6]
        }
        Op::InfiniteCone => rad.atan2(-y) <= a[0] / 2.0,
        Op::Cone => y.abs() <= a[2] / 2.0 && rad <= a[0] + (a[1] - a[0]) * (y / a[2] + 0.5),
        Op::RoundedCone => {
            let (inset, round) = inset_cone(a);
            to_polygon(&inset, [rad, y]) <= round
        }
        Op::RoundCone => {
            let ball = |t: f64| {
                let centre = [0.0, (t - 0.5) * a[2], 0.0];
                distance(p, centre) - (a[0] + (a[1] - a[0]) * t)
            };
            least(ball) <= 0.0
        }
        Op::Ellipsoid => (0..3).map(|i| (p[i] / a[i]).powi(2)).sum::<f64>() <= 1.0,
        Op::Plane => dot(p, [a[0], a[1], a[2]]) <= a[3],
        Op::Slab => dot(p, [a[0], a[1], a[2]]).abs() <= a[3] / 2.0,
        Op::Prism => y.abs() <= a[2] / 2.0 && in_ngon(a[0], a[1], x, z),
        Op::Octahedron => x.abs() + y.abs() + z.abs() <= a[0],
        Op::Tetrahedron => {
            let s = a[0] / 3.0_f64.sqrt();
            let v = [[-s, -s, s], [s, s, s], [-s, s, -s], [s, -s, -s]];
            let volume = |q: [Point; 4]| {
                let [a, b, c] = [sub(q[1], q[0]), sub(q[2], q[0]), sub(q[3], q[0])];
                a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                    + a[2] * (b[0] * c[1] - b[1] * c[0])
            };
            let total = volume(v);
            (0..4).all(|i| {
                let mut w = v;
                w[i] = p;
                volume(w) / total >= 0.0
            })
        }
        Op::Pyramid => {
            let up = y / a[1] + 0.5;
            (0.0..=1.0).contains(&up) && x.abs().max(z.abs()) <= a[0] / 2.0 * (1.0 - up)
        }
        Op::Link => {
            // Around the centre line: two half circles and two straight parts.
            let half = a[0] / 2.0;
            let arc = |t: f64| {
                let angle = t * PI;
                [a[1] * angle.cos(), half + a[1] * angle.sin(), 0.0]
            };
            let straight = |t: f64| [a[1], half * (2.0 * t - 1.0), 0.0];
            let q = [x.abs(), y.abs(), z];
            least(|t| distance(q, arc(t))).min(least(|t| distance(q, straight(t)))) <= a[2]
        }
        Op::Gyroid | Op::SchwarzP | Op::Diamond => {
            let q = p.map(|v| v * TAU / a[0]);
            let (s, c) = (q.map(f64::sin), q.map(f64::cos));
            let level = match op {
                Op::Gyroid => s[0] * c[1] + s[1] * c[2] + s[2] * c[0],
                Op::SchwarzP => c[0] + c[1] + c[2],
                _ => {
                    s[0] * s[1] * s[2]
                        + s[0] * c[1] * c[2]
                        + c[0] * s[1] * c[2]
                        + c[0] * c[1] * s[2]
                }
            };
            level.abs() * a[0] / TAU / 3.0_f64.sqrt() <= a[1] / 2.0
        }
        Op::Circle => x.hypot(y) <= a[0],
        Op::Rect => x.abs() <= a[0] / 2.0 && y.abs() <= a[1] / 2.0,
        Op::RoundedRect => {
            let round = a[2].min(a[0] / 2.0).min(a[1] / 2.0);
            near_box(
                [x, y, 0.0],
                [a[0] / 2.0 - round, a[1] / 2.0 - round, 0.0],
                round,
            )
        }
        Op::Segment => {
            let (from, to) = ([a[0], a[1], 0.0], [a[2], a[3], 0.0]);
            least(|t| distance([x, y, 0.0], add(from, sub(to, from), t))) <= a[4]
        }
        Op::Ngon => in_ngon(a[0], a[1], y, x),
        Op::Star => winds(&star(a), [x, y]),
        _ => panic!(
            "`{}` has no definition: add its inside to `contains` in vm/tests/operations/definitions.rs",
            op.row().name
        ),
    }
}

/// Returns the corners of a star.
fn star(a: &[f64]) -> Vec<[f64; 2]> {
    (0..2 * a[0] as usize)
        .map(|i| {
            let (angle, r) = (i as f64 * PI / a[0], if i % 2 == 0 { a[1] } else { a[2] });
            [r * angle.sin(), r * angle.cos()]
        })
        .collect()
}

/// Reports whether a polygon winds around a point, by the angles that its edges subtend.
pub(crate) fn winds(polygon: &[[f64; 2]], p: [f64; 2]) -> bool {
    let turn: f64 = (0..polygon.len())
        .map(|i| {
            let [a, b] =
                [polygon[i], polygon[(i + 1) % polygon.len()]].map(|q| [q[0] - p[0], q[1] - p[1]]);
            (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1])
        })
        .sum();
    ((turn / TAU).round() as i64) % 2 != 0
}

/// Reports whether a point is within `r` of the box of these half sizes.
fn near_box(p: Point, half: Point, r: f64) -> bool {
    length(std::array::from_fn(|i| {
        p[i] - p[i].clamp(-half[i], half[i])
    })) <= r + 1e-12
}

/// Reports whether (u, v) is in the polygon of `n` corners, the first one at the distance `r` along u, by
/// its half planes.
fn in_ngon(n: f64, r: f64, u: f64, v: f64) -> bool {
    (0..n as usize).all(|i| {
        let angle = (i as f64 + 0.5) * TAU / n;
        u * angle.cos() + v * angle.sin() <= r * (PI / n).cos()
    })
}

/// Returns the smallest value over [0, 1] of a function with few minima: a scan, then a golden-section
/// search.
fn least(f: impl Fn(f64) -> f64) -> f64 {
    let n = 64;
    let best = (0..=n)
        .map(|i| i as f64 / n as f64)
        .min_by(|&s, &t| f(s).total_cmp(&f(t)));
    let best = best.unwrap_or(0.0);
    let (mut low, mut high) = (
        (best - 1.0 / n as f64).max(0.0),
        (best + 1.0 / n as f64).min(1.0),
    );
    for _ in 0..50 {
        let (s, t) = (low + (high - low) * 0.382, low + (high - low) * 0.618);
        if f(s) < f(t) { high = t } else { low = s }
    }
    f((low + high) / 2.0)
}

/// Returns the profile of a cone whose planes are all moved inwards by the rounding, and the rounding that
/// fits. It is a large square, clipped by one plane after another.
fn inset_cone(a: &[f64]) -> (Vec<[f64; 2]>, f64) {
    let (bottom, top, h) = (a[0], a[1], a[2]);
    let slope = (bottom - top).hypot(h);
    let (nx, ny) = (h / slope, (bottom - top) / slope);
    let at = nx * (bottom + top) / 2.0;
    let cut = |round: f64| {
        let planes = [
            (0.0, 1.0, h / 2.0 - round),
            (0.0, -1.0, h / 2.0 - round),
            (nx, ny, at - round),
            (-nx, ny, at - round),
        ];
        let mut polygon = vec![[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
        for (x, y, d) in planes {
            let side = |q: [f64; 2]| x * q[0] + y * q[1] - d;
            let corners = polygon.clone();
            polygon.clear();
            for i in 0..corners.len() {
                let (p, q) = (corners[i], corners[(i + 1) % corners.len()]);
                let (s, t) = (side(p), side(q));
                if s <= 0.0 {
                    polygon.push(p);
                }
                if (s < 0.0) != (t < 0.0) && s != t {
                    let f = s / (s - t);
                    polygon.push([p[0] + (q[0] - p[0]) * f, p[1] + (q[1] - p[1]) * f]);
                }
            }
        }
        polygon
    };
    // Finds the largest rounding that fits, by bisection.
    let mut round = a[3];
    if cut(round).is_empty() {
        let (mut low, mut high) = (0.0, round);
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if cut(middle).is_empty() {
                high = middle
            } else {
                low = middle
            }
        }
        round = low;
    }
    (cut(round), round)
}

/// Returns the distance to a convex polygon; zero inside.
fn to_polygon(polygon: &[[f64; 2]], p: [f64; 2]) -> f64 {
    if polygon.len() > 2 && winds(polygon, p) {
        return 0.0;
    }
    let p = [p[0], p[1], 0.0];
    let edges = (0..polygon.len()).map(|i| {
        let [a, b] = [polygon[i], polygon[(i + 1) % polygon.len()]].map(|q| [q[0], q[1], 0.0]);
        least(|t| distance(p, add(a, sub(b, a), t)))
    });
    edges.fold(f64::INFINITY, f64::min)
}
