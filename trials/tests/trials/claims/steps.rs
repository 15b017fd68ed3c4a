//! Marching steps: the sign is constant within the sphere of a step's length.

use super::test_shape::{TestShape, parse_shape, valid_shape};
use super::{MAX_ROUNDING_PER_SIZE, ROUNDING_AMPLIFIERS, TrialPoints, corpus, size_at};
use crate::oracle::{norm, point_along, random_direction, read_scene, unit_number};
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::{product_field, solid};
use sdfc_vm::program::Opcode;
use sdfc_vm::table::Op;

/// Number of points from which steps are tested.
const STEPS_PER_SHAPE: usize = 150;
/// Number of random directions per step.
const DIRECTIONS_PER_STEP: usize = 4;

/// Returns the first step that passes a surface.
pub(super) fn find_violation(tested: &TestShape, seed: u64) -> Option<String> {
    if tested.has_estimated_bound {
        return None;
    }
    let mut points = TrialPoints::new(tested, seed);
    for _ in 0..STEPS_PER_SHAPE {
        let p = points.anywhere(tested);
        let step = tested.step(p);
        let slope = tested.gradient(p);
        let slack = MAX_ROUNDING_PER_SIZE * size_at(p, 1.0);
        let length = step.abs() / tested.max_step_slope * (1.0 - 1e-5) - slack;
        // No step is claimed where the written value overflows.
        if tested.value(p).is_infinite() {
            continue;
        }
        if !step.is_finite() {
            return Some(format!("a step of {step} at {p:?}"));
        }
        if length <= 0.0 {
            continue;
        }
        let slope_length = norm(slope.gradient).max(1e-30);
        let descent = slope
            .gradient
            .map(|v| -v * slope.value.signum() / slope_length);
        let random = (0..DIRECTIONS_PER_STEP).map(|_| random_direction(&mut points.random));
        let directions: Vec<_> = [descent].into_iter().chain(random).collect();
        for direction in directions {
            for fraction in [1.0, unit_number(&mut points.random)] {
                let q = point_along(p, direction, length * fraction);
                let (written, truth) = (tested.value(q), tested.oracle.value(q));
                // Near a surface with small slopes, small values count as zero.
                let is_zero =
                    |v: f64| v.abs() <= slack * norm(tested.gradient(q).gradient).max(1.0);
                if (written < 0.0) != (step < 0.0) && !is_zero(written) {
                    return Some(format!("{step} at {p:?}, but {written} at {q:?}"));
                }
                if (truth < 0.0) != (step < 0.0) && !is_zero(truth) {
                    return Some(format!(
                        "{step} at {p:?}, but {truth} by the oracle at {q:?}"
                    ));
                }
            }
        }
    }
    None
}

#[test]
fn steps_of_random_shapes_pass_no_surface() {
    let check = |&seed: &u64| {
        let text = solid(&mut Random::new(seed), 3);
        let Some(tested) = parse_shape(&text) else {
            return CheckOutcome::Refused;
        };
        if let Some(violation) = find_violation(&tested, seed) {
            panic!("{violation}\n{text}");
        }
        CheckOutcome::Accepted
    };
    let tally = run(
        "steps of random shapes",
        input_count(35, 200),
        |seed| seed,
        check,
    );
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

/// Bounds around a point hold although factors, and with them the slope there, are zero.
#[test]
fn steps_of_fields_with_products_pass_no_surface() {
    let (mut largest_step, mut count): (f64, usize) = (0.0, 0);
    for seed in 0..input_count(120, 2_000) {
        let text = product_field(&mut Random::new(seed));
        let Some(mut tested) = parse_shape(&text) else {
            continue;
        };
        let is_piecewise = |code: &Opcode| matches!(code, Opcode::Op(Op::Piecewise));
        if !tested.step.code.iter().any(|i| is_piecewise(&i.code)) {
            continue;
        }
        tested.has_estimated_bound = false;
        tested.max_step_slope = 1.0;
        if let Some(violation) = find_violation(&tested, seed) {
            panic!("{violation}\n{text}");
        }
        count += 1;
        largest_step = largest_step.max(tested.step([2.0, 3.0, 0.0]).abs());
    }
    assert!(
        count > 20 && largest_step > 0.01,
        "{count} steps, {largest_step} at most"
    );
}

#[test]
fn steps_of_files_pass_no_surface() {
    let mut violations = Vec::new();
    for path in corpus(3) {
        let (scene, name) = read_scene(&path);
        let Some(root) = scene.root.filter(|_| !scene.is_2d) else {
            continue;
        };
        let Some(tested) = TestShape::new(&scene, root, &name) else {
            continue;
        };
        if ROUNDING_AMPLIFIERS.contains(&name.as_str()) {
            continue;
        }
        if let Some(violation) = find_violation(&tested, 4) {
            violations.push(format!("{name}: {violation}"));
        }
    }
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

/// A stated bound determines steps where it holds, and is not used where it does not.
#[test]
fn steps_of_fields_with_stated_bounds_pass_no_surface() {
    let fields = [
        ("length(p) - 0.5", ""),
        ("3 * length(p) - 2", ", within: 4"),
        ("dot(p, p) - 1", ", within: 3"),
        ("p.y - 0.25 * sin(4 * p.x) * cos(3 * p.z)", ", within: 5"),
        ("p.x * p.x * p.y + p.z * p.z - 0.25", ", within: 2"),
    ];
    for (formula, arguments) in fields {
        for bound in [0.125, 0.5, 1.0, 5.0, 50.0] {
            for change in ["", ".offset(0.125)", ".scale(2).rotate(30deg, Z)"] {
                let text =
                    format!("field(fn(p) => {formula}{arguments}, lipschitz: {bound}){change}");
                let tested = valid_shape(&text);
                if let Some(violation) = find_violation(&tested, 9) {
                    panic!("{violation}\n{text}");
                }
            }
        }
    }
}
