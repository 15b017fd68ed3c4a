//! The errors that intervals of `f32` allow elementary functions: the smallest intervals that require them.

use crate::fixture::Random;
use sdfc_vm::elementary::{arctangent, cosine, exponential, logarithm, perlin, sine};
use sdfc_vm::interval::{FloatInterval, MAX_NOISE_STEEPNESS};
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::vector::V3;
use sdfc_vm::wgsl_interval::{self, WgslInterval};

/// Maximum length of a run of neighbouring numbers.
const MAX_RUN_LENGTH: usize = 12;

/// Asserts that intervals of a few neighbours contain the function's values, and that the ends' values
/// alone would not do so in every case.
fn check(
    name: &str,
    arguments: impl Fn(&mut Random) -> f32,
    function: fn(f32) -> f32,
    over: fn(FloatInterval) -> FloatInterval,
) {
    let needed = check_held(name, arguments, function, over);
    assert!(needed > 0, "{name}: no interval needs its slack");
}

/// Asserts that intervals contain the function's values; returns the number of values beyond those of the
/// ends.
fn check_held(
    name: &str,
    arguments: impl Fn(&mut Random) -> f32,
    function: fn(f32) -> f32,
    over: fn(FloatInterval) -> FloatInterval,
) -> usize {
    let mut random = Random::new(91);
    let mut needed = 0;
    for _ in 0..20_000 {
        let first = arguments(&mut random);
        let length = 2 + (random.unit() * (MAX_RUN_LENGTH - 1) as f64) as usize;
        let mut run = vec![first];
        run.extend((1..length).scan(first, |v, _| {
            *v = v.next_up();
            Some(*v)
        }));
        let hull = over(FloatInterval {
            lo: first,
            hi: run[length - 1],
        });
        let [a, b] = [first, run[length - 1]].map(function);
        for x in run {
            let v = function(x);
            assert!(
                hull.contains(v),
                "{name} of {x}: {v} outside {hull:?} from {first}"
            );
            needed += usize::from(v < a || v > b);
        }
    }
    needed
}

/// A number after which the computed power of two decreases by a step.
const FALLING_POWER: f64 = -0.360_671_07;

/// Returns one of two numbers; the second one is shifted to at or slightly below the boundary of a
/// function's piece.
fn one_of(random: &mut Random, any: f64, seam: f64) -> f32 {
    match random.unit() < 0.5 {
        true => any as f32,
        false => {
            let steps = (random.unit() * MAX_RUN_LENGTH as f64 / 2.0) as usize;
            (0..steps).fold(seam as f32, |v, _| v.next_down())
        }
    }
}

#[test]
fn elementary_functions_leave_the_ends_of_their_intervals_by_rounding() {
    let power = |r: &mut Random| {
        let x = r.range(-20.0, 20.0);
        one_of(r, x, FALLING_POWER)
    };
    check("exp2", power, exponential, Real::exp2);
    let logarithm_argument = |r: &mut Random| {
        let x = r.range(-8.0, 8.0);
        one_of(r, x.exp2(), ((x * 2.0).round() / 2.0).exp2())
    };
    // It increases everywhere, so its ends bound all values without slack.
    check_held("log2", logarithm_argument, logarithm, Real::log2);
    // No decrease was observed for sines and angles either.
    let angle = |r: &mut Random| {
        let x = r.range(-30.0, 30.0);
        let quarter = std::f64::consts::FRAC_PI_4;
        one_of(r, x, (x / quarter).round() * quarter)
    };
    check_held("sin", angle, sine, Real::sin);
    check_held("cos", angle, cosine, Real::cos);
    let side = |r: &mut Random| {
        let x = r.range(-2.0, 2.0);
        one_of(r, x, x)
    };
    check_held(
        "atan2",
        side,
        |y| arctangent(y, 0.7),
        |y| y.atan2(FloatInterval::point(0.7)),
    );
}

/// Maxima next to the end of an interval are included. They exceed the ends' values more, the farther they
/// are from zero.
#[test]
fn crests_beside_the_ends_of_an_interval_are_seen() {
    let mut random = Random::new(92);
    for round in 0..6_000 {
        let farthest = [30.0, 1_000.0, 15_000.0][round % 3];
        let turns = random.range(-farthest, farthest).round();
        let crest = ((turns + 0.25) * std::f64::consts::TAU) as f32;
        let side = random.range(0.05, 1.0) as f32;
        let beside: Vec<f32> = (-3..=3).map(|steps| neighbour(crest, steps)).collect();
        for (lo, hi) in [
            (crest - side, crest.next_down()),
            (crest.next_up(), crest + side),
            (crest, crest + side),
            (beside[1], crest + side),
            (crest - side, beside[5]),
            (beside[0], beside[6]),
        ] {
            let hull = FloatInterval { lo, hi }.sin();
            let inside = beside.iter().copied().filter(|x| (lo..=hi).contains(x));
            for x in inside.chain([lo, hi]) {
                assert!(hull.contains(sine(x)), "{x} of {lo} to {hi}: {hull:?}");
                let (trough, hull) = (-x, FloatInterval { lo: -hi, hi: -lo }.sin());
                assert!(hull.contains(sine(trough)), "{trough}: {hull:?}");
            }
        }
    }
}

/// Returns the number at this distance from another, in steps of `f32`.
fn neighbour(v: f32, steps: i32) -> f32 {
    let step = if steps < 0 {
        f32::next_down
    } else {
        f32::next_up
    };
    (0..steps.abs()).fold(v, |v, _| step(v))
}

/// For noise, a box of size zero contains its value, and small boxes contain the values at their corners.
#[test]
fn noise_leaves_its_middle_by_rounding() {
    let mut random = Random::new(93);
    for scale in [1.0, 100.0, 10_000.0] {
        for _ in 0..2_000 {
            let corner = random.point(scale).map(|v| v as f32);
            let steps = (random.unit() * 4.0) as u32;
            let end = corner.map(|v| (0..steps).fold(v, |v, _| v.next_up()));
            let side = |axis: usize| FloatInterval {
                lo: corner[axis],
                hi: end[axis],
            };
            let seed = FloatInterval::point(3.0);
            let hull = FloatInterval::noise(V3::new(side(0), side(1), side(2)), seed);
            for number in 0..8 {
                let p = [0, 1, 2].map(|axis| {
                    if number >> axis & 1 == 0 {
                        corner[axis]
                    } else {
                        end[axis]
                    }
                });
                let v = f32::noise(V3::new(p[0], p[1], p[2]), 3.0);
                assert!(hull.contains(v), "noise at {p:?}: {v} outside {hull:?}");
            }
        }
    }
}

/// Tests boxes around the steepest points found, elongated along the gradient.
#[test]
fn noise_leaves_its_middle_as_steeply_as_it_can() {
    let mut random = Random::new(94);
    let mut steepest = ([0.0; 3], V3::new(0.0, 0.0, 0.0), 0.0);
    for _ in 0..100_000 {
        let (cell, inner) = (random.point(500.0), random.point(0.15));
        let p = [0, 1, 2].map(|i| cell[i].floor() + 0.5 + inner[i]);
        let (_, slope) = perlin::<f64>(V3::new(p[0], p[1], p[2]), 3.0);
        if slope.length() > steepest.2 {
            steepest = (p, slope, slope.length());
        }
    }
    let (p, slope, length) = steepest;
    assert!(length > 0.78 * MAX_NOISE_STEEPNESS, "{length}");
    let offset = 0.02 / length;
    let [a, b] = [-offset, offset]
        .map(|offset| [0, 1, 2].map(|i| (p[i] + [slope.x, slope.y, slope.z][i] * offset) as f32));
    let side = |axis: usize| FloatInterval::between(a[axis], b[axis]);
    let hull = FloatInterval::noise(
        V3::new(side(0), side(1), side(2)),
        FloatInterval::point(3.0),
    );
    let sides = [0, 1, 2].map(|axis| WgslInterval {
        low: a[axis].min(b[axis]),
        high: a[axis].max(b[axis]),
    });
    let wgsl_bounds = wgsl_interval::noise(sides, 3.0);
    for p in [a, b] {
        let v = f32::noise(V3::new(p[0], p[1], p[2]), 3.0);
        assert!(hull.contains(v), "noise at {p:?}: {v} outside {hull:?}");
        let WgslInterval { low, high } = wgsl_bounds;
        assert!(
            low <= v && v <= high,
            "noise at {p:?}: {v} outside {low} to {high}"
        );
    }
}
