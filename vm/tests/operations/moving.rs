//! Maps of the point against the union of all the copies that they represent.

use crate::fixture::{Case, Point, Random, add, distance, sub};
use sdfc_vm::table::Op;
use std::f64::consts::TAU;

const CENTRE: Point = [0.1875, -0.125, 0.0625];
const R: f64 = 0.1875;

/// A sphere off the centre.
fn ball(p: Point) -> f64 {
    distance(p, CENTRE) - R
}

/// All choices of 0 or 1 for each axis.
fn choices() -> impl Iterator<Item = [f64; 3]> {
    (0..8).map(|i: i32| [0, 1, 2].map(|axis| f64::from(i >> axis & 1)))
}

#[test]
fn an_endless_grid_is_all_its_copies() {
    let mut random = Random::new(40);
    let spacing = [1.0, 0.75, 0.0];
    for _ in 0..1000 {
        let p = random.point(2.0);
        let mut nearest = f64::INFINITY;
        for i in -4..=4 {
            for j in -5..=5 {
                let cell = [f64::from(i) * spacing[0], f64::from(j) * spacing[1], 0.0];
                nearest = nearest.min(ball(sub(p, cell)));
            }
        }
        let both = choices()
            .map(|which| Case::new(Op::RepeatNeighbour, &[spacing, which].concat()).map(p))
            .map(ball)
            .fold(f64::INFINITY, f64::min);
        assert!((both - nearest).abs() < 1e-9, "at {p:?}: {both}, {nearest}");
    }
}

#[test]
fn a_limited_grid_is_all_its_copies() {
    let mut random = Random::new(41);
    let (spacing, counts) = ([1.0, 0.75, 0.5], [3.0, 2.0, 1.0]);
    let grid = [spacing, counts].concat();
    for _ in 0..1000 {
        let p = random.point(3.0);
        let mut nearest = f64::INFINITY;
        for i in [-1.0, 0.0, 1.0] {
            for j in [-0.375, 0.375] {
                nearest = nearest.min(ball(sub(p, [i, j, 0.0])));
            }
        }
        let both = choices()
            .map(|which| {
                let arguments = [grid.clone(), which.to_vec()].concat();
                ball(Case::new(Op::RepeatLimitedNeighbour, &arguments).map(p))
            })
            .fold(f64::INFINITY, f64::min);
        assert!((both - nearest).abs() < 1e-9, "at {p:?}: {both}, {nearest}");
    }
}

#[test]
fn sectors_are_all_their_copies() {
    let mut random = Random::new(42);
    for (own, neighbour, axes) in [
        (Op::Polar, Op::PolarNeighbour, [0, 2]),
        (Op::PolarPlane, Op::PolarPlaneNeighbour, [0, 1]),
    ] {
        for n in [1.0, 2.0, 3.0, 7.0] {
            let phase = 1.25;
            // A sphere off the centre of its sector.
            let mut centre = [0.0625; 3];
            centre[axes[0]] = 0.75 * (phase + 0.1_f64).cos();
            centre[axes[1]] = 0.75 * (phase + 0.1_f64).sin();
            let ball = |p: Point| distance(p, centre) - 0.125;
            let maps = [
                Case::new(own, &[n, phase]),
                Case::new(neighbour, &[n, phase, 1.0]),
            ];
            for _ in 0..400 {
                let p = random.point(2.0);
                let copies = (0..n as i32).map(|i| {
                    let (s, c) = (f64::from(i) * TAU / n).sin_cos();
                    let mut q = p;
                    q[axes[0]] = p[axes[0]] * c + p[axes[1]] * s;
                    q[axes[1]] = p[axes[1]] * c - p[axes[0]] * s;
                    ball(q)
                });
                let nearest = copies.fold(f64::INFINITY, f64::min);
                let d = maps
                    .iter()
                    .map(|m| ball(m.map(p)))
                    .fold(f64::INFINITY, f64::min);
                assert!((d - nearest).abs() < 1e-6, "{n} at {p:?}: {d}, {nearest}");
            }
        }
    }
}

#[test]
fn a_mirror_shows_the_positive_side() {
    let mut random = Random::new(43);
    let mirror = Case::new(Op::Mirror, &[1.0, 0.0, -2.0]);
    for _ in 0..200 {
        let p = random.point(2.0);
        assert_eq!(mirror.map(p), [p[0].abs(), p[1], p[2].abs()]);
    }
}

/// A quarter turn per unit: one unit up, x has become −z as seen from above.
#[test]
fn twist_and_bend_turn_by_their_rate() {
    let quarter = TAU / 4.0;
    let twist = Case::new(Op::Twist, &[quarter]);
    let bend = Case::new(Op::Bend, &[quarter]);
    let near = |a: Point, b: Point| assert!(distance(a, b) < 1e-6, "{a:?}, {b:?}");
    near(twist.map([0.5, 0.0, 0.0]), [0.5, 0.0, 0.0]);
    near(twist.map([0.5, 1.0, 0.0]), [0.0, 1.0, 0.5]);
    near(bend.map([0.0, 0.5, 0.25]), [0.0, 0.5, 0.25]);
    near(bend.map([1.0, 0.5, 0.25]), [0.5, -1.0, 0.25]);
    // At every height, a twist is a rotation: it preserves distances.
    let mut random = Random::new(44);
    for _ in 0..200 {
        let p = random.point(1.0);
        let q = add([0.0, p[1], 0.0], [random.unit(), 0.0, random.unit()], 1.0);
        assert!((distance(twist.map(p), twist.map(q)) - distance(p, q)).abs() < 1e-9);
    }
}
