//! Intervals over boxes: they contain the values and slopes of all points inside, by both evaluators.

use super::test_shape::{TestShape, parse_shape, value_and_gradient};
use super::{
    MAX_ROUNDING_PER_SIZE, MIN_LIMITED_VALUE, ROUNDING_AMPLIFIERS, TrialPoints, corpus, size_at,
};
use crate::oracle::{Point, norm, read_scene, unit_number};
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::solid;
use sdfc_vm::branching::{BranchInterval, eval_all_branches};
use sdfc_vm::evaluate::{evaluate, evaluate_f64, gradient};
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::vector::V3;

/// Number of boxes per program.
const BOXES_PER_PROGRAM: usize = 15;
/// Number of points per box.
const POINTS_PER_BOX: usize = 12;
/// Relative error of sums in `f64` along a program.
const MAX_F64_ERROR: f64 = 1e-11;

/// Reports whether a value is in a range, up to a slack. NaN anywhere always passes.
fn contains(range: Interval, value: f64, slack: f64) -> bool {
    value.is_nan()
        || range.lo.is_nan()
        || slack.is_nan()
        || (range.lo - slack <= value && value <= range.hi + slack)
}

/// Returns the first number outside its interval.
fn find_violation(tested: &TestShape, program: &Program, seed: u64) -> Option<String> {
    let is_written_program = std::ptr::eq(program, &tested.written);
    let compares_oracle = is_written_program && tested.has_known_values;
    let mut points = TrialPoints::new(tested, seed);
    for _ in 0..BOXES_PER_PROGRAM {
        let corner = points.anywhere(tested);
        let half =
            size_at(corner, tested.size) * 10.0_f64.powf(-4.0 * unit_number(&mut points.random));
        let sides = corner.map(|v| {
            let side = if points.random.chance(10) {
                0.0
            } else {
                half * unit_number(&mut points.random)
            };
            Interval {
                lo: v,
                hi: v + side,
            }
        });
        let [x, y, z] = sides;
        let values = evaluate::<Interval>(program, V3 { x, y, z });
        let duals = gradient::<Interval>(program, V3 { x, y, z });
        // The enumeration of branches stops at intervals that contain zero.
        let branches =
            eval_all_branches(|| evaluate::<BranchInterval>(program, BranchInterval::point(sides)));
        let branches = match branches.contains(0.0) {
            true => Interval::ALL,
            false => branches,
        };
        for index in 0..POINTS_PER_BOX {
            let p: Point = [0, 1, 2].map(|i| match index {
                0 => sides[i].lo,
                1 => sides[i].hi,
                _ => sides[i].lo + (sides[i].hi - sides[i].lo) * unit_number(&mut points.random),
            });
            let slope = value_and_gradient(program, p);
            let scale = size_at(p, 1.0) * norm(slope.gradient).max(1.0) + slope.value.abs();
            let slack = MAX_F64_ERROR * scale;
            let value = evaluate_f64(program, p);
            for (name, range) in [
                ("values", values),
                ("duals", duals.value),
                ("branches", branches),
            ] {
                if !contains(range, value, slack) {
                    return Some(format!(
                        "{value} at {p:?} is not in {range:?}, {name} of {sides:?}"
                    ));
                }
            }
            let truth = tested.oracle.value(p);
            let is_limited = truth > MIN_LIMITED_VALUE && values.hi > MIN_LIMITED_VALUE;
            if compares_oracle
                && !is_limited
                && !contains(values, truth, 8.0 * MAX_ROUNDING_PER_SIZE * scale)
            {
                return Some(format!(
                    "{truth} by the oracle at {p:?} is not in {values:?} of {sides:?}"
                ));
            }
            let V3 { x, y, z } = duals.gradient;
            let slope_length = norm(slope.gradient);
            for (axis, range) in [x, y, z].into_iter().enumerate() {
                let axis_slope = slope.gradient[axis];
                if !contains(range, axis_slope, 1e-9 * (1.0 + slope_length)) {
                    return Some(format!(
                        "slope {axis_slope} along {axis} at {p:?} is not in {range:?} of {sides:?}"
                    ));
                }
            }
        }
    }
    None
}

fn assert_intervals(tested: &TestShape, seed: u64) {
    for (name, program) in [("written", &tested.written), ("step", &tested.step)] {
        if let Some(violation) = find_violation(tested, program, seed) {
            panic!("{name}: {violation}\n{}", tested.name);
        }
    }
}

#[test]
fn intervals_of_random_shapes_hold_all_values_and_slopes() {
    let check = |&seed: &u64| {
        let text = solid(&mut Random::new(seed), 3);
        let Some(tested) = parse_shape(&text) else {
            return CheckOutcome::Refused;
        };
        assert_intervals(&tested, seed);
        CheckOutcome::Accepted
    };
    let tally = run(
        "intervals of random shapes",
        input_count(30, 200),
        |seed| seed,
        check,
    );
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn intervals_of_files_hold_all_values_and_slopes() {
    let mut violations = Vec::new();
    for path in corpus(1) {
        let (scene, name) = read_scene(&path);
        let Some(root) = scene.root.filter(|_| !scene.is_2d) else {
            continue;
        };
        let Some(tested) = TestShape::new(&scene, root, &name) else {
            continue;
        };
        // Long programs are slow, and consist of the same operations as short ones.
        let is_long = tested.written.code.len() > 200;
        if is_long || ROUNDING_AMPLIFIERS.contains(&name.as_str()) {
            continue;
        }
        if let Some(violation) = find_violation(&tested, &tested.written, 8) {
            violations.push(format!("{name}: {violation}"));
        }
    }
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}
