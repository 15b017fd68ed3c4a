//! Distances of all solids and 2-D shapes by brute force: a surface point is as near as the value says, and
//! none is nearer.

use super::{Point, norm, oracle_for_text, point_along, random_point, unit_number};
use sdfc_trials::oracle::Oracle;
use sdfc_trials::random::Random;

/// Solids with exact distances everywhere.
const EXACT: &[&str] = &[
    "sphere(0.6)",
    "box(0.9, 0.5, 0.7)",
    "box(0.9, 0.5, 0.7, round: 0.1)",
    "capsule(h: 0.6, r: 0.25)",
    "capsule(from: [-0.3, -0.4, 0], to: [0.4, 0.3, 0.2], r: 0.2)",
    "torus(r1: 0.55, r2: 0.2)",
    "torus(r1: 0.55, r2: 0.15, angle: 100deg)",
    "torus(r1: 0.55, r2: 0.15, angle: 250deg)",
    "cylinder(r: 0.5, h: 0.8)",
    "cylinder(r: 0.5, h: 0.8, round: 0.15)",
    "cylinder(from: [-0.3, -0.4, 0], to: [0.4, 0.3, 0.2], r: 0.3)",
    "cone(r1: 0.6, r2: 0.2, h: 0.8)",
    "cone(r1: 0, r2: 0.5, h: 0.8)",
    "cone(r1: 0.6, r2: 0.2, h: 0.8, round: 0.1)",
    "cone(r1: 0.6, r2: 0, h: 0.8, round: 0.2)",
    "round_cone(r1: 0.4, r2: 0.2, h: 0.5)",
    "round_cone(r1: 0.2, r2: 0.5, h: 0.2)",
    "ellipsoid([0.8, 0.3, 0.5])",
    "ellipsoid([0.3, 0.9, 0.3])",
    "prism(3, 0.7, 0.6)",
    "prism(7, 0.7, 0.6)",
    "octahedron(0.8)",
    "tetrahedron(0.8)",
    "pyramid(0.9, 0.8)",
    "pyramid(0.5, 1.4)",
    "link(0.4, 0.35, 0.12)",
    "circle(0.5).extrude(0.6)",
    "rect(0.6, 0.4).revolve(offset: 0.5)",
];
/// Solids with exact distances outside.
const EXACT_OUTSIDE: &[&str] = &[
    "box_frame([0.9, 1.1, 0.7], 0.2)",
    "torus(r1: 0.3, r2: 0.5)",
    "rect(0.3, 0.4).revolve(offset: 0.5, angle: 100deg)",
    "rect(0.3, 0.4).revolve(offset: 0.5, angle: 250deg)",
];
/// Unbounded solids, tested within a sphere.
const UNBOUNDED: &[&str] = &[
    "plane([1, 2, 3], at: 0.2)",
    "slab([1, -1, 0.5], 0.4)",
    "infinite_cone(50deg)",
    "infinite_cone(140deg)",
];
/// 2-D shapes with exact distances everywhere.
const SHAPES_2D: &[&str] = &[
    "circle(0.6)",
    "rect(0.9, 0.5)",
    "rect([0.9, 0.5], round: 0.1)",
    "segment([-0.4, -0.3], [0.5, 0.2], r: 0.2)",
    "ngon(3, 0.7)",
    "ngon(8, 0.7)",
    "star(5, 0.8, 0.35)",
    "star(2, 0.8, 0.35)",
    "star(6, 0.4, 0.8)",
    "polygon([[-0.6, -0.5], [0.6, -0.5], [0.1, 0], [0.5, 0.6], [-0.5, 0.5]])",
    "polygon([[-0.6, -0.6], [0.6, 0.6], [0.6, -0.6], [-0.6, 0.6]])",
];

/// Half the size of the tested cube.
const CUBE_HALF_LENGTH: f64 = 1.2;

/// Returns surface points, at which segments in the cube enter or leave the solid.
fn surface_points(oracle: &Oracle, axes: usize, count: usize) -> Vec<Point> {
    let mut r = Random::new(1);
    let mut points = Vec::new();
    let side = |p: Point| oracle.value(p) < 0.0;
    while points.len() < count {
        let mut from = random_point(&mut r, CUBE_HALF_LENGTH);
        let mut to = random_point(&mut r, CUBE_HALF_LENGTH);
        if axes == 2 {
            (from[2], to[2]) = (0.0, 0.0);
        }
        let line_point = |t: f64| point_along(from, [0, 1, 2].map(|i| to[i] - from[i]), t);
        for step in 0..64 {
            let (mut low, mut high) = (f64::from(step) / 64.0, f64::from(step + 1) / 64.0);
            let start = side(line_point(low));
            if start == side(line_point(high)) {
                continue;
            }
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if side(line_point(middle)) == start {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            points.push(line_point(low));
        }
    }
    points
}

/// Largest distance from a surface point to the nearest sampled one.
const MAX_GAP_LENGTH: f64 = 0.15;

/// Reports whether the value times the gradient leads to the surface.
fn leads_to_surface(oracle: &Oracle, p: Point, value: f64) -> bool {
    let foot = point_along(p, oracle.gradient(p), -value);
    oracle.value(foot).abs() < 1e-6
}

/// Asserts distances at random points whose value satisfies the predicate.
fn assert_distances(text: &str, axes: usize, is_tested: impl Fn(f64) -> bool) {
    let oracle = oracle_for_text(text);
    let points = surface_points(&oracle, axes, 4000);
    let mut r = Random::new(2);
    let (mut tested_count, mut missed_count) = (0, 0);
    for _ in 0..300 {
        let mut p = random_point(&mut r, CUBE_HALF_LENGTH);
        if unit_number(&mut r) < 0.2 {
            // Formulas tend to fail on planes of symmetry.
            p[r.below(3)] = 0.0;
        }
        if axes == 2 {
            p[2] = 0.0;
        }
        let value = oracle.value(p);
        if !is_tested(value) || value.abs() < 1e-3 {
            continue;
        }
        let distance_to = |q: &Point| norm([0, 1, 2].map(|i| q[i] - p[i]));
        let nearest = points.iter().map(distance_to).fold(f64::INFINITY, f64::min);
        let distances = value.abs() - 1e-9..value.abs() + MAX_GAP_LENGTH;
        assert!(
            distances.contains(&nearest),
            "{text}: {p:?} is {nearest} away, not {value}"
        );
        tested_count += 1;
        missed_count += usize::from(!leads_to_surface(&oracle, p, value));
    }
    // On ridges, at equal distance to two surface points, no gradient leads to the surface.
    assert!(
        tested_count > 60,
        "{text}: {tested_count} values are looked at"
    );
    assert!(
        missed_count * 8 < tested_count,
        "{text}: {missed_count} of {tested_count} values lead astray"
    );
}

#[test]
fn values_of_solids_are_distances() {
    for text in EXACT {
        assert_distances(text, 3, |_| true);
    }
}

#[test]
fn values_of_some_solids_are_distances_outside() {
    for text in EXACT_OUTSIDE {
        assert_distances(text, 3, |value| value > 0.0);
    }
}

#[test]
fn values_of_endless_solids_are_distances() {
    for text in UNBOUNDED {
        assert_distances(text, 3, |value| value.abs() < 0.4);
    }
}

#[test]
fn values_of_2d_shapes_are_distances() {
    for text in SHAPES_2D {
        assert_distances(text, 2, |_| true);
    }
}

/// Values of sheets follow from their level functions.
#[test]
fn periodic_surfaces_are_at_the_zeros_of_their_formulas() {
    let frequency = std::f64::consts::TAU / 0.8;
    type Level = fn(Point) -> f64;
    let levels: [(&str, Level); 3] = [
        ("gyroid", |p| {
            p[0].sin() * p[1].cos() + p[1].sin() * p[2].cos() + p[2].sin() * p[0].cos()
        }),
        ("schwarz_p", |p| p[0].cos() + p[1].cos() + p[2].cos()),
        ("diamond", |p| {
            let [x, y, z] = p;
            (x - y).cos() * z.sin() + (x + y).sin() * z.cos()
        }),
    ];
    let mut r = Random::new(3);
    for (name, level) in levels {
        let oracle = oracle_for_text(&format!("{name}(0.8, 0.05)"));
        for _ in 0..200 {
            let p = random_point(&mut r, 1.0);
            let value =
                level(p.map(|v| v * frequency)).abs() / (frequency * 3.0_f64.sqrt()) - 0.025;
            assert!((oracle.value(p) - value).abs() < 1e-12, "{name} at {p:?}");
        }
    }
}
