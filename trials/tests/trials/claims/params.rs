//! Claims for all values of live parameters and at all times: one compiled scene in several states.

use super::test_shape::{ParamState, TestShape, parse_scene};
use super::{boxes, slopes, steps};
use crate::oracle::unit_number;
use sdfc_trials::campaign::input_count;
use sdfc_trials::random::Random;

/// Scenes with shapes and slopes that depend on parameters and time.
const LIVE_PARAM_SCENES: &[&str] = &[
    "param r = 0.3 in 0.1..=0.9;\nsphere(r) | box(r, 0.5, 0.25).translate(2 * r, 0, 0)",
    "param r = 0.3 in 0.1..=0.9;\nfield(fn(p) => r * sin(p.x / r) + p.y, within: 3)",
    "param a = 0.5 in 0..=2;\nfield(fn(p) => dot(p, p) * a - 1, within: 4)",
    "param a = 0.5 in 0..=2;\nfield(fn(p) => p.y - a * sin(2 * p.x))",
    "param a = 0.1 in 0..=0.5;\nbox(1).warp(fn(p) => p + a * [sin(5 * p.y), sin(5 * p.z), 0])",
    "param a = 0.1 in 0..=0.5;\nsphere(0.75).displace(fn(p) => a * sin(6 * p.x) * sin(6 * p.y))",
    "param t = 20deg in -90deg..=90deg;\nbox(0.5, 2, 0.5).twist(t)",
    "param t = 20deg in -60deg..=60deg;\nbox(2, 0.5, 0.5).bend(t)",
    "param t = 20deg in -180deg..=180deg;\nbox(1, 0.5, 0.25).rotate(t, [1, 2, 0]).translate(1, 0, 0)",
    "param k = 0.1 in 0..=0.5;\nsphere(0.5) |[k] box(1.5, 0.25, 0.5)",
    "param k = 0.1 in 0..=0.5;\nbox(1) -[chamfer, k] cylinder(r: 0.25, h: 2)",
    "param k = 0.1 in -0.2..=0.5;\nbox(1).offset(k).shell(0.0625)",
    "param s = 1 in 0.75..=2;\n(sphere(0.25) | box(0.5, 0.125, 0.25)).repeat([s, 0, s], count: [3, 1, 2])",
    "param s = 1 in 0.75..=2;\nbox(0.25, 0.5, 0.375).translate(s, 0, 0.25).polar(7)",
    "param s = 1 in 0.25..=3;\nsphere(0.5).scale([s, 1, 2]) |[0.125] box(0.5)",
    "param s = 0.5 in 0..=1;\nsphere(0.75).morph(box(1), s)",
    "param s = 0.5 in 0..=1;\ntorus(r1: 0.5, r2: 0.125).elongate([s, 0, 2 * s])",
    "param s = 0.5 in 0..=1;\nrect(0.5, 0.25).revolve(offset: s + 0.5, angle: 100deg)",
    "sphere(0.5).translate(sin(time * 1rad / 1s), 0, 0) | box(0.5).rotate(time * 1rad / 1s, Z)",
    "field(fn(p) => p.y - 0.25 * sin(3 * p.x + time / 1s))",
];

#[test]
fn claims_hold_for_all_values_of_parameters() {
    let mut all_violations = Vec::new();
    for text in LIVE_PARAM_SCENES {
        let scene = parse_scene(text).unwrap_or_else(|| panic!("{text} is refused"));
        let root = scene.root.expect("the scene has a shape");
        let mut r = Random::new(10);
        for index in 0..input_count(3, 20_000) {
            let value = |(min, max): (f64, f64)| match index {
                0 => max,
                1 => min,
                _ => min + (max - min) * unit_number(&mut r),
            };
            let mut value = value;
            let ranges = scene.params.iter().filter_map(|param| param.range);
            let values: Vec<Vec<f64>> = ranges.map(|range| vec![value(range)]).collect();
            let state = ParamState {
                values,
                time: 0.7 * index as f64,
            };
            let tested = TestShape::new_at(&scene, root, text, &state);
            let tested = tested.unwrap_or_else(|| panic!("{text} is refused"));
            let violations = [
                slopes::find_violation(&tested, index),
                steps::find_violation(&tested, index),
                boxes::find_violation(&tested, index),
            ];
            let violations = violations.into_iter().flatten();
            all_violations
                .extend(violations.map(|violations| format!("{violations}, {state:?}\n{text}")));
        }
    }
    assert!(all_violations.is_empty(), "{}", all_violations.join("\n"));
}
