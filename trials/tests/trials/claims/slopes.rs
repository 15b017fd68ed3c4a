//! Stated slope bounds against gradients, and against differences of values at two points.

use super::test_shape::{StatedSlope, TestShape, parse_scene, parse_shape, solids, valid_shape};
use super::{MAX_ROUNDING_PER_SIZE, TrialPoints, corpus, size_at};
use crate::oracle::{norm, point_along, random_direction, read_scene, unit_number};
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::solid;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::program::{Opcode, Program};
use sdfc_vm::table::Op;
use sdfc_vm::tape::Tape;

/// Number of points per bound.
const POINTS_PER_BOUND: usize = 100;
/// Number of shapes below the root that are tested as separate scenes.
const SHAPES_PER_SCENE: u64 = 1;
/// Largest number of shapes in a scene whose shapes are compiled separately.
const MAX_SCENE_SHAPES: usize = 150;
/// Factor by which rounding may exceed a bound.
const MAX_EXCESS_FACTOR: f64 = 1.0 + 1e-5;

fn contains(region: &Bounds, p: [f64; 3]) -> bool {
    (0..3).all(|i| region.min[i] <= p[i] && p[i] <= region.max[i])
}

/// Returns the nearest point of a region.
fn clamped(region: &Bounds, p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| p[i].max(region.min[i]).min(region.max[i]))
}

/// Returns the first point at which the written value exceeds a stated slope bound.
pub(super) fn find_violation(tested: &TestShape, seed: u64) -> Option<String> {
    if tested.has_estimated_bound {
        return None;
    }
    let mut points = TrialPoints::new(tested, seed);
    let compares_oracle = tested.has_known_values;
    for divisor in &tested.slopes {
        let stated = StatedSlope {
            region: divisor.region,
            slope: divisor.slope * tested.max_slope,
        };
        if stated.region.is_empty() {
            continue;
        }
        for _ in 0..POINTS_PER_BOUND {
            let mut p = points.anywhere(tested);
            if !contains(&stated.region, p) {
                p = clamped(&stated.region, p);
            }
            let slope = tested.gradient(p);
            let slope_length = norm(slope.gradient);
            if slope_length > stated.slope * MAX_EXCESS_FACTOR + 1e-9 {
                return Some(format!("slope {slope_length} at {p:?}, stated {stated:?}"));
            }
            let offset = tested.size * 10.0_f64.powf(-4.0 + 4.0 * unit_number(&mut points.random));
            let q = point_along(p, random_direction(&mut points.random), offset);
            let q = clamped(&stated.region, q);
            let distance = norm([0, 1, 2].map(|i| p[i] - q[i]));
            let rounding = MAX_ROUNDING_PER_SIZE * stated.slope.max(1.0);
            let limit =
                stated.slope * distance * MAX_EXCESS_FACTOR + rounding * size_at(p, 0.0).max(1.0);
            let change = (slope.value - tested.value(q)).abs();
            if change > limit {
                return Some(format!("{change} from {p:?} to {q:?}, stated {stated:?}"));
            }
            if compares_oracle {
                let change = (tested.oracle.value(p) - tested.oracle.value(q)).abs();
                if change > limit {
                    return Some(format!(
                        "{change} by the oracle from {p:?} to {q:?}, stated {stated:?}"
                    ));
                }
            }
        }
    }
    None
}

/// Returns the first instruction whose value is steeper than the Lipschitz bound of the tape that ends
/// there.
fn find_tape_violation(tested: &TestShape, seed: u64) -> Option<String> {
    let mut points = TrialPoints::new(tested, seed);
    let program = &tested.step;
    for length in 1..=program.code.len() {
        let prefix = Program {
            code: program.code[..length].to_vec(),
            ..program.clone()
        };
        // A prefix that ends with a point has no value, and a partial polygon has no sides.
        let is_edge = |index: usize| {
            let code = program.code.get(index).map(|i| i.code);
            code == Some(Opcode::Op(Op::PolygonEdge))
        };
        if prefix.code[length - 1].has_no_value() || is_edge(length - 1) && is_edge(length) {
            continue;
        }
        let slope = f64::from(Tape::new(&prefix).lipschitz.result);
        if !slope.is_finite() {
            continue;
        }
        for _ in 0..12 {
            let p = points.in_box(2.0);
            let slope_length = norm(super::test_shape::value_and_gradient(&prefix, p).gradient);
            let q = point_along(p, random_direction(&mut points.random), 0.1 * tested.size);
            let change = (evaluate_f64(&prefix, p) - evaluate_f64(&prefix, q)).abs();
            let limit = slope * MAX_EXCESS_FACTOR;
            if slope_length > limit + 1e-6
                || change > limit * 0.1 * tested.size + 1e-6 * size_at(p, 1.0)
            {
                return Some(format!(
                    "instruction {length}: slope {slope_length} at {p:?}, {slope} by its tape"
                ));
            }
        }
    }
    None
}

fn assert_slopes(tested: &TestShape, seed: u64) {
    if let Some(violation) = find_violation(tested, seed) {
        panic!("{violation}\n{}", tested.name);
    }
    if let Some(violation) = find_tape_violation(tested, seed) {
        panic!("{violation}\n{}", tested.name);
    }
}

#[test]
fn random_shapes_are_no_steeper_than_stated() {
    let check = |&seed: &u64| {
        let text = solid(&mut Random::new(seed), 3);
        let Some(tested) = parse_shape(&text) else {
            return CheckOutcome::Refused;
        };
        assert_slopes(&tested, seed);
        let scene = parse_scene(&text).expect("it was right before");
        let mut r = Random::new(seed);
        let shape_ids = solids(&scene);
        for _ in 0..2 {
            let id = r.pick(&shape_ids);
            if let Some(tested) = TestShape::new(&scene, id, &format!("{id:?} of {text}")) {
                assert_slopes(&tested, seed);
            }
        }
        CheckOutcome::Accepted
    };
    let tally = run(
        "slopes of random shapes",
        input_count(30, 200),
        |seed| seed,
        check,
    );
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn shapes_of_files_are_no_steeper_than_stated() {
    let mut violations = Vec::new();
    for path in corpus(2) {
        let (scene, name) = read_scene(&path);
        let shape_ids = solids(&scene);
        if shape_ids.is_empty() {
            continue;
        }
        let mut r = Random::new(3);
        let root = shape_ids.first().copied();
        let random_count = match shape_ids.len() <= MAX_SCENE_SHAPES {
            true => input_count(SHAPES_PER_SCENE, 2000),
            false => 0,
        };
        let random_ids = (0..random_count).map(|_| r.pick(&shape_ids));
        for id in root.into_iter().chain(random_ids) {
            let Some(tested) = TestShape::new(&scene, id, &name) else {
                continue;
            };
            if let Some(violation) = find_violation(&tested, 3) {
                violations.push(format!("{name}, {id:?}: {violation}"));
            }
        }
    }
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

#[test]
fn a_field_without_a_bound_is_reported_as_unbounded() {
    assert!(valid_shape("field(fn(p) => 1 / p.x, within: 2)").has_estimated_bound);
    assert!(!valid_shape("field(fn(p) => 2 * p.x, within: 2)").has_estimated_bound);
}
