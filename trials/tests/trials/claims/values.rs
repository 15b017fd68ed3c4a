//! Values as written, by the engines' definitions, against those of the oracle.

use super::test_shape::{TestShape, parse_scene, parse_shape, solids, valid_shape};
use super::{MAX_ROUNDING_PER_SIZE, ROUNDING_AMPLIFIERS, TrialPoints, corpus, size_at};
use crate::oracle::{norm, point_along, random_direction, read_scene};
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::{crossing_polygon, exact_shape_2d, exact_solid, solid};
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of points per shape.
const POINTS_PER_SHAPE: usize = 150;
/// Largest fraction of points at a discontinuity, where either side is right. A quarter of the points have
/// zero coordinates.
const MAX_DISCONTINUITY_FRACTION: f64 = 0.3;
/// Distance within which a discontinuity is searched, relative to the size of coordinates.
const DISCONTINUITY_SEARCH_PER_SIZE: f64 = 1e-5;
/// Largest fraction of random shapes without promised values.
const MAX_UNPROMISED_FRACTION: f64 = 0.4;

/// Returns the first value that differs from the oracle's.
fn find_violation(tested: &TestShape, seed: u64) -> Option<String> {
    let mut points = TrialPoints::new(tested, seed);
    let mut discontinuities = 0.0;
    for _ in 0..POINTS_PER_SHAPE {
        let p = match points.random.below(4) {
            0 => points.symmetric(),
            1 => points.near_surface(tested),
            _ => points.in_box(3.0),
        };
        let slope = tested.gradient(p);
        let truth = tested.oracle.value(p);
        let size = size_at(p, tested.size);
        let slope_length = norm(slope.gradient).max(norm(tested.oracle.gradient(p)));
        let slack = MAX_ROUNDING_PER_SIZE * (size * slope_length.max(1.0) + truth.abs());
        // Rows promise no value if an intermediate number is NaN.
        let is_same = (slope.value - truth).abs() <= slack || slope.value == truth;
        // For empty shapes, engines only guarantee a positive value.
        let is_empty = tested.bounds.is_empty() && slope.value > 0.0 && truth > 0.0;
        if is_same || is_empty || slope.value.is_nan() {
            continue;
        }
        // Opposite points lie on both sides of a discontinuity through the point.
        let changes = (0..8).flat_map(|_| {
            let direction = random_direction(&mut points.random);
            [-1.0, 1.0].map(|side| {
                let distance = side * DISCONTINUITY_SEARCH_PER_SIZE * size;
                (tested.oracle.value(point_along(p, direction, distance)) - truth).abs()
            })
        });
        // At a discontinuity the value changes far more than its slope predicts.
        let max_change =
            10.0 * DISCONTINUITY_SEARCH_PER_SIZE * size * norm(slope.gradient).max(1.0);
        let is_discontinuity = changes.fold(0.0, f64::max) > max_change;
        discontinuities += f64::from(u8::from(is_discontinuity));
        if !is_discontinuity
            || discontinuities > MAX_DISCONTINUITY_FRACTION * POINTS_PER_SHAPE as f64
        {
            return Some(format!("{} and not {truth} at {p:?}", slope.value));
        }
    }
    None
}

#[test]
fn values_of_random_shapes_are_the_oracles() {
    let unpromised = AtomicU64::new(0);
    let check = |&seed: &u64| {
        let text = solid(&mut Random::new(seed), 3);
        let (Some(scene), Some(root_shape)) = (parse_scene(&text), parse_shape(&text)) else {
            return CheckOutcome::Refused;
        };
        let mut r = Random::new(seed);
        let id = r.pick(&solids(&scene));
        let random_part = TestShape::new(&scene, id, &text);
        for tested in [Some(root_shape), random_part].into_iter().flatten() {
            if !tested.has_known_values {
                unpromised.fetch_add(1, Ordering::Relaxed);
                continue;
            }
            if let Some(violation) = find_violation(&tested, seed) {
                panic!("{violation}\n{text}");
            }
        }
        CheckOutcome::Accepted
    };
    let tally = run(
        "values of random shapes",
        input_count(35, 200),
        |seed| seed,
        check,
    );
    let fraction = unpromised.into_inner() as f64 / (2 * tally.accepted).max(1) as f64;
    assert!(
        tally.accepted < 60 || fraction <= MAX_UNPROMISED_FRACTION,
        "{fraction} of the values are promised by no row"
    );
}

/// Solids and 2-D shapes, also with degenerate numbers.
#[test]
fn values_of_exact_shapes_are_the_oracles() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let text = match r.below(10) {
            0 => format!("{}.extrude(0.5)", crossing_polygon(&mut r)),
            1..=4 => format!("{}.extrude(0.5)", exact_shape_2d(&mut r)),
            _ => exact_solid(&mut r),
        };
        let tested = valid_shape(&text);
        assert!(tested.has_known_values, "{text}");
        if let Some(violation) = find_violation(&tested, seed) {
            panic!("{violation}\n{text}");
        }
        CheckOutcome::Accepted
    };
    run(
        "values of exact shapes",
        input_count(100, 50),
        |seed| seed,
        check,
    );
}

#[test]
fn values_of_files_are_the_oracles() {
    let mut violations = Vec::new();
    for path in corpus(4) {
        let (scene, name) = read_scene(&path);
        let Some(root) = scene.root.filter(|_| !scene.is_2d) else {
            continue;
        };
        let Some(tested) = TestShape::new(&scene, root, &name) else {
            continue;
        };
        if !tested.has_known_values || ROUNDING_AMPLIFIERS.contains(&name.as_str()) {
            continue;
        }
        if let Some(violation) = find_violation(&tested, 7) {
            violations.push(format!("{name}: {violation}"));
        }
    }
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}
