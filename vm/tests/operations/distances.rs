//! Every shape against its definition. A distance is right if
//! 1. its sign is that of the definition;
//! 2. it does not exceed the distance to any point of the surface (points found by bisecting the definition);
//! 3. where it is exact by its row, a step of that length along its gradient ends on the surface.
//!
//! Only the true distance satisfies both 2 and 3.

use crate::definitions::{contains, winds};
use crate::fixture::{
    Case, Point, Random, add, cases, distance, dot, gradient, is_shape, length, point,
};
use sdfc_vm::dual::Dual;
use sdfc_vm::row::{Category, Exactness};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

const REACH: f64 = 2.5;

/// Returns points of a definition's surface.
fn surface(inside: impl Fn(Point) -> bool, random: &mut Random, wanted: usize) -> Vec<Point> {
    let mut points = Vec::new();
    for _ in 0..wanted * 400 {
        let reach = if random.unit() < 0.5 { REACH } else { 0.6 };
        let (mut a, mut b) = (random.point(reach), random.point(reach));
        if inside(a) == inside(b) {
            // Short segments catch thin shapes.
            b = add(a, random.direction(), 0.3);
            if inside(a) == inside(b) {
                continue;
            }
        }
        let start = inside(a);
        for _ in 0..48 {
            let middle = add(a, std::array::from_fn(|i| b[i] - a[i]), 0.5);
            if inside(middle) == start {
                a = middle
            } else {
                b = middle
            }
        }
        points.push(a);
        if points.len() == wanted {
            break;
        }
    }
    points
}

/// Reports whether the surface passes within `r` of a point.
fn on_surface(inside: &impl Fn(Point) -> bool, p: Point, random: &mut Random, r: f64) -> bool {
    let centre = inside(p);
    (0..8000).any(|_| inside(add(p, random.direction(), r)) != centre)
}

fn check(case: &Case, inside: impl Fn(Point) -> bool, exactness: Exactness, random: &mut Random) {
    let name = case.name();
    let is_2d = case.op.row().facts.category == Category::Shape2;
    let points = surface(&inside, random, 600);
    assert!(
        points.len() > 100,
        "{name}: only {} points of the surface",
        points.len()
    );
    let mut feet = 0;
    for _ in 0..300 {
        let mut p = random.point(REACH);
        if is_2d {
            p[2] = 0.0;
        }
        let (d, slope) = gradient(case, p);
        if d.abs() > 1e-6 {
            assert_eq!(d < 0.0, inside(p), "{name} at {p:?}: {d}");
        }
        let gap = |q: &Point| {
            if is_2d {
                distance([q[0], q[1], 0.0], p)
            } else {
                distance(*q, p)
            }
        };
        let nearest = points.iter().map(gap).fold(f64::INFINITY, f64::min);
        assert!(
            d.abs() <= nearest + 2e-6,
            "{name} at {p:?}: {d}, but {nearest} to the surface"
        );
        let exact = match exactness {
            Exactness::Exact => true,
            Exactness::ExactOutside => d > 0.0,
            Exactness::Bound | Exactness::Unknown => false,
        };
        // On a ridge of the distance, the gradient is that of one side, which is equally valid. Only at
        // isolated points (an axis, a centre) there may be none.
        if exact && length(slope) > 0.5 {
            let foot = add(p, slope, -d);
            assert!(
                on_surface(&inside, foot, random, 1e-5),
                "{name} at {p:?}: {d}, {slope:?}"
            );
            feet += 1;
        }
    }
    if exactness == Exactness::Exact {
        assert!(feet > 250, "{name}: {feet} feet");
    }
}

#[test]
fn shapes_keep_their_definitions() {
    for case in cases(2, 6, |op| is_shape(op) && op != Op::PolygonEdge) {
        let mut random = Random::for_case(1, &case.name());
        let exactness = case.op.row().facts.exactness;
        check(
            &case,
            |p| contains(case.op, &case.arguments, p),
            exactness,
            &mut random,
        );
    }
}

/// The gradient is one that the surface has where branches are equal, as on planes of symmetry. A step along it ends
/// on the surface.
#[test]
fn at_ties_the_gradient_leads_to_the_surface() {
    for case in cases(2, 6, |op| is_shape(op) && op != Op::PolygonEdge) {
        let facts = &case.op.row().facts;
        let is_exact_at = |d: f64| match facts.exactness {
            Exactness::Exact => true,
            Exactness::ExactOutside => d > 0.0,
            Exactness::Bound | Exactness::Unknown => false,
        };
        let mut random = Random::for_case(5, &case.name());
        let (mut feet, mut points) = (0, 0);
        for _ in 0..600 {
            // Coordinates are zero, or equal up to their signs, or equal to an argument.
            let size = random.range(0.0, REACH);
            let mut p = [0; 3].map(|_| match (random.unit() * 5.0) as usize {
                0 => 0.0,
                1 => size,
                2 => -size,
                3 => case.arguments[(random.unit() * case.arguments.len() as f64) as usize],
                _ => random.range(-REACH, REACH),
            });
            if facts.category == Category::Shape2 {
                p[2] = 0.0;
            }
            let (d, slope) = gradient(&case, p);
            if !is_exact_at(d) {
                continue;
            }
            points += 1;
            let steepness = length(slope);
            // Between opposite nearest points, as on an axis, directions cancel. Beside such a point they differ.
            if steepness < 1.0 - 1e-5 {
                let beside = |sign: f64| {
                    [0, 1, 2].map(|axis| {
                        let mut q = p;
                        q[axis] += sign * 1e-4;
                        gradient(&case, q).1
                    })
                };
                let pairs = beside(1.0).into_iter().zip(beside(-1.0));
                let least = pairs.map(|(a, b)| dot(a, b)).fold(1.0, f64::min);
                assert!(
                    least < 1.0 - 1e-5,
                    "{} at {p:?}: {slope:?} on no ridge",
                    case.name()
                );
                continue;
            }
            feet += 1;
            let name = case.name();
            assert!(
                (steepness - 1.0).abs() < 1e-5,
                "{name} at {p:?}: {slope:?} has the length {steepness}"
            );
            let foot = case.at(add(p, slope, -d));
            assert!(
                foot.abs() < 1e-5 * (1.0 + length(p)),
                "{name} at {p:?}: {foot} after a step of {d} along {slope:?}"
            );
        }
        assert!(
            feet * 10 >= points * 7,
            "{}: {feet} directions at {points} points",
            case.name()
        );
    }
}

#[test]
fn arguments_that_do_not_fit_are_clamped() {
    let all: [(Op, &[f64]); 8] = [
        (Op::RoundedCuboid, &[1.0, 2.0, 0.5, 4.0]),
        (Op::RoundedCylinder, &[0.5, 2.0, 3.0]),
        (Op::RoundedCone, &[1.0, 0.0, 2.0, 9.0]),
        (Op::RoundedCone, &[0.25, 0.75, 1.5, 0.125]),
        (Op::RoundedCone, &[0.5, 0.5, 1.0, 0.25]),
        (Op::RoundCone, &[1.0, 0.25, 0.5]),
        (Op::RoundCone, &[0.25, 1.0, 0.5]),
        (Op::CappedTorus, &[1.0, 0.25, 5.5]),
    ];
    for (op, arguments) in all {
        let case = Case::new(op, arguments);
        check(
            &case,
            |p| contains(op, arguments, p),
            Exactness::Exact,
            &mut Random::for_case(3, &case.name()),
        );
    }
}

/// Polygons as chains of edges, some of which are self-intersecting. Their corners are on a grid, so that
/// rays to the right pass exactly through corners.
#[test]
fn polygons_are_the_winding_of_their_edges() {
    let mut random = Random::new(4);
    for _ in 0..12 {
        let n = random.range(3.0, 9.0) as usize;
        let mut corner = || (random.range(-4.0, 4.0).round()) / 2.0;
        let polygon: Vec<[f64; 2]> = (0..n).map(|_| [corner(), corner()]).collect();
        let edges: Vec<Case> = (0..n)
            .map(|i| {
                let ([ax, ay], [bx, by]) = (polygon[i], polygon[(i + 1) % n]);
                Case::new(Op::PolygonEdge, &[ax, ay, bx, by])
            })
            .collect();
        let at = |p: Point| {
            edges
                .iter()
                .fold(1e30, |d, edge| edge.with(p, [d, 0.0, 0.0]))
        };
        for k in 0..400 {
            let mut p = random.point(2.5);
            p[2] = 0.0;
            if k % 2 == 0 {
                p[1] = (p[1] * 2.0).round() / 2.0;
            }
            let d = at(p);
            let nearest = (0..n)
                .map(|i| {
                    let (a, b) = (polygon[i], polygon[(i + 1) % n]);
                    let e = [b[0] - a[0], b[1] - a[1]];
                    let q = [p[0] - a[0], p[1] - a[1]];
                    let square = e[0] * e[0] + e[1] * e[1];
                    let t = if square > 0.0 {
                        (q[0] * e[0] + q[1] * e[1]) / square
                    } else {
                        0.0
                    };
                    let t = t.clamp(0.0, 1.0);
                    (q[0] - e[0] * t).hypot(q[1] - e[1] * t)
                })
                .fold(f64::INFINITY, f64::min);
            assert!(
                (d.abs() - nearest).abs() < 1e-9,
                "{polygon:?} at {p:?}: {d}, {nearest}"
            );
            if nearest > 1e-9 {
                assert_eq!(
                    d < 0.0,
                    winds(&polygon, [p[0], p[1]]),
                    "{polygon:?} at {p:?}"
                );
            }
        }
    }
}

/// On every side of a square of either orientation, the gradient is the side's normal.
#[test]
fn on_a_polygon_the_gradient_is_the_normal() {
    let square = [[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
    for reversed in [false, true] {
        let mut corners = square;
        if reversed {
            corners.reverse();
        }
        for normal in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]] {
            let p = V3::new(
                normal[0] + normal[1] * 0.25,
                normal[1] + normal[0] * 0.25,
                0.0,
            );
            let mut d = Dual::<f64>::fixed(1e30);
            for i in 0..4 {
                let ([ax, ay], [bx, by]) = (corners[i], corners[(i + 1) % 4]);
                let edge = Case::new(Op::PolygonEdge, &[ax, ay, bx, by]);
                d = edge.dual(p, [d; 3]);
            }
            assert!(d.value.abs() < 1e-29);
            assert_eq!([d.gradient.x, d.gradient.y], normal, "reversed: {reversed}");
        }
    }
}

/// A point at a height above a point of an ellipsoid, along the normal there. Outside at any height, and
/// inside up to half of the smallest radius of curvature, the height is the distance.
#[test]
fn the_ellipsoid_has_its_true_distance() {
    let mut random = Random::new(7);
    for ratio in [1.0, 3.0, 30.0, 100.0, 1000.0] {
        for _ in 0..2000 {
            let radii = [0; 3].map(|_| 2.0 / random.range(1.0, ratio));
            // Many lie near planes of symmetry.
            let direction = [0; 3].map(|_| random.range(-1.0, 1.0) * random.unit().powi(4) + 1e-9);
            let direction = direction.map(|v| v / length(direction));
            let surface = [0, 1, 2].map(|i| direction[i] * radii[i]);
            let steep = [0, 1, 2].map(|i| direction[i] / radii[i]);
            let normal = steep.map(|v| v / length(steep));
            let smallest = radii.into_iter().fold(f64::INFINITY, f64::min);
            let largest = radii.into_iter().fold(0.0, f64::max);
            let deepest = 0.5 * smallest * smallest / largest;
            let height = match random.unit() < 0.5 {
                true => random.range(-deepest, deepest),
                false => random.range(-6.0, 4.0).exp(),
            };
            let p = [0, 1, 2].map(|i| surface[i] + normal[i] * height);
            let case = Case::new(Op::Ellipsoid, &radii);
            // Parameters are rounded to `f32`.
            let rounded = 3e-7 * (largest + height.abs());
            let value = case.at(p);
            assert!(
                (value - height).abs() < rounded,
                "{radii:?}: {value} for {height} at {p:?}"
            );
            let still = [Dual::fixed(0.0); 3];
            let slope = case.dual(point::<f64>(p), still).gradient;
            let along = slope.x * normal[0] + slope.y * normal[1] + slope.z * normal[2];
            assert!(
                (along - 1.0).abs() < 1e-5,
                "{radii:?}: {slope:?} for {normal:?}"
            );
            let single: f32 = case.on(point::<f32>(p));
            assert!((f64::from(single) - height).abs() < 1e-6 * (length(p) + largest));
        }
    }
}

/// On the long axis of a prolate spheroid with the radii `a` and twice `b`, a ring of points is nearest.
/// The depth there is `b √(1 − x² / (a² − b²))`.
#[test]
fn the_axis_of_a_spheroid_has_its_true_distance() {
    let (a, b) = (1.0_f64, 0.5_f64);
    for radii in [[a, b, b], [b, a, b], [b, b, a]] {
        let case = Case::new(Op::Ellipsoid, &radii);
        let long = radii.iter().position(|&r| r == a).expect("is one of them");
        for fraction in [0.1, 0.5, 0.9] {
            let x = fraction * (a * a - b * b) / a;
            let mut p = [0.0; 3];
            p[long] = x;
            let depth = b * (1.0 - x * x / (a * a - b * b)).sqrt();
            let value = case.at(p);
            assert!(
                (value + depth).abs() < 3e-4,
                "{radii:?} at {x}: {value}, not {depth}"
            );
        }
    }
}

/// If the smallest radius occurs more than once, the nearest point is in the direction of the point among
/// the axes of that radius.
#[test]
fn ellipsoids_with_equal_radii_have_the_depth_of_spheres_beside_their_centre() {
    for (radii, axes) in [
        ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]),
        ([1.0, 0.625, 0.625], [0.0, 1.0, 1.0]),
        ([50.0, 80.0, 50.0], [1.0, 0.0, 1.0]),
        ([0.03125, 0.03125, 0.25], [1.0, 1.0, 0.0]),
    ] {
        let ellipsoid = Case::new(Op::Ellipsoid, &radii);
        let radius = radii.into_iter().fold(f64::INFINITY, f64::min);
        let mut random = Random::new(77);
        for _ in 0..300 {
            let reach = 10_f64.powf(random.range(-6.0, -1.0)) * radius;
            let p = axes.map(|axis| axis * random.range(-reach, reach));
            let (value, depth) = (ellipsoid.at(p), length(p) - radius);
            assert!(
                (value - depth).abs() <= 1e-9 * radius,
                "{radii:?}: {value} for {depth} at {p:?}"
            );
        }
    }
}

/// At the centre, the nearest points are across the smallest radius.
#[test]
fn the_middle_of_an_ellipsoid_is_as_deep_as_its_smallest_radius() {
    for radii in [
        [1.0, 0.5, 0.25],
        [0.25, 1.0, 1.0],
        [0.5, 0.5, 0.5],
        [3.0, 0.125, 0.125],
    ] {
        let case = Case::new(Op::Ellipsoid, &radii);
        let smallest = radii.into_iter().fold(f64::INFINITY, f64::min);
        assert!((case.at([0.0; 3]) + smallest).abs() < 1e-6, "{radii:?}");
        let slope = case
            .dual(point::<f64>([0.0; 3]), [Dual::fixed(0.0); 3])
            .gradient;
        assert!((length([slope.x, slope.y, slope.z]) - 1.0).abs() < 1e-3);
    }
}
