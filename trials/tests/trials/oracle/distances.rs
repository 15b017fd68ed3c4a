//! Distances of all solids and figures by brute force: one point of the surface is as near as the
//! value says, and none is nearer.

use super::{Point, beyond, norm, oracle_of, point, unit};
use sdfc_trials::oracle::Oracle;
use sdfc_trials::random::Random;

/// Solids whose values are distances everywhere.
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
/// Solids whose values are distances outside.
const EXACT_OUTSIDE: &[&str] = &[
    "box_frame([0.9, 1.1, 0.7], 0.2)",
    "torus(r1: 0.3, r2: 0.5)",
    "rect(0.3, 0.4).revolve(offset: 0.5, angle: 100deg)",
    "rect(0.3, 0.4).revolve(offset: 0.5, angle: 250deg)",
];
/// Solids without an end, of which a ball is looked at.
const ENDLESS: &[&str] = &[
    "plane([1, 2, 3], at: 0.2)",
    "slab([1, -1, 0.5], 0.4)",
    "infinite_cone(50deg)",
    "infinite_cone(140deg)",
];
/// Figures whose values are distances everywhere.
const FIGURES: &[&str] = &[
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

/// Half the size of the cube that is looked at.
const DEFAULT_CUBE_HALF_LENGTH: f64 = 1.2;

/// Points of the surface, at which lines through the cube go in or out.
fn surface(oracle: &Oracle, axes: usize, count: usize) -> Vec<Point> {
    let mut r = Random::new(1);
    let mut found = Vec::new();
    let side = |p: Point| oracle.value(p) < 0.0;
    while found.len() < count {
        let mut from = point(&mut r, DEFAULT_CUBE_HALF_LENGTH);
        let mut to = point(&mut r, DEFAULT_CUBE_HALF_LENGTH);
        if axes == 2 {
            (from[2], to[2]) = (0.0, 0.0);
        }
        let at = |t: f64| beyond(from, [0, 1, 2].map(|i| to[i] - from[i]), t);
        for step in 0..64 {
            let (mut low, mut high) = (f64::from(step) / 64.0, f64::from(step + 1) / 64.0);
            let start = side(at(low));
            if start == side(at(high)) {
                continue;
            }
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if side(at(middle)) == start {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            found.push(at(low));
        }
    }
    found
}

/// The largest distance of a point of the surface from the next one that was found.
const MAX_GAP_LENGTH: f64 = 0.15;

/// Tells if the value and its slope lead to the surface.
fn leads_to_surface(oracle: &Oracle, p: Point, value: f64) -> bool {
    let foot = beyond(p, oracle.gradient(p), -value);
    oracle.value(foot).abs() < 1e-6
}

/// Demands distances of random points with wanted values.
fn demand(text: &str, axes: usize, is_wanted: impl Fn(f64) -> bool) {
    let oracle = oracle_of(text);
    let points = surface(&oracle, axes, 4000);
    let mut r = Random::new(2);
    let (mut looked_at, mut astray) = (0, 0);
    for _ in 0..300 {
        let mut p = point(&mut r, DEFAULT_CUBE_HALF_LENGTH);
        if unit(&mut r) < 0.2 {
            // Symmetries are where formulas go wrong.
            p[r.below(3)] = 0.0;
        }
        if axes == 2 {
            p[2] = 0.0;
        }
        let value = oracle.value(p);
        if !is_wanted(value) || value.abs() < 1e-3 {
            continue;
        }
        let away = |q: &Point| norm([0, 1, 2].map(|i| q[i] - p[i]));
        let nearest = points.iter().map(away).fold(f64::INFINITY, f64::min);
        let distances = value.abs() - 1e-9..value.abs() + MAX_GAP_LENGTH;
        assert!(
            distances.contains(&nearest),
            "{text}: {p:?} is {nearest} away, not {value}"
        );
        looked_at += 1;
        astray += usize::from(!leads_to_surface(&oracle, p, value));
    }
    // On ridges, where two places of the surface are equally near, there is no slope to follow.
    assert!(looked_at > 60, "{text}: {looked_at} values are looked at");
    assert!(
        astray * 8 < looked_at,
        "{text}: {astray} of {looked_at} values lead astray"
    );
}

#[test]
fn values_of_solids_are_distances() {
    for text in EXACT {
        demand(text, 3, |_| true);
    }
}

#[test]
fn values_of_some_solids_are_distances_outside() {
    for text in EXACT_OUTSIDE {
        demand(text, 3, |value| value > 0.0);
    }
}

#[test]
fn values_of_endless_solids_are_distances() {
    for text in ENDLESS {
        demand(text, 3, |value| value.abs() < 0.4);
    }
}

#[test]
fn values_of_figures_are_distances() {
    for text in FIGURES {
        demand(text, 2, |_| true);
    }
}

/// Values of sheets follow from their level functions.
#[test]
fn periodic_surfaces_are_where_their_formulas_say() {
    let turn = std::f64::consts::TAU / 0.8;
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
        let oracle = oracle_of(&format!("{name}(0.8, 0.05)"));
        for _ in 0..200 {
            let p = point(&mut r, 1.0);
            let value = level(p.map(|v| v * turn)).abs() / (turn * 3.0_f64.sqrt()) - 0.025;
            assert!((oracle.value(p) - value).abs() < 1e-12, "{name} at {p:?}");
        }
    }
}
