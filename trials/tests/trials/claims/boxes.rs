//! Stated boxes and outlines: no part of a shape is outside, and boxes of exact shapes touch them.

use super::test_shape::{TestShape, parse_shape, valid_shape};
use super::{MAX_ROUNDING_PER_SIZE, TrialPoints, corpus, size_at};
use crate::oracle::{Point, norm, random_point, read_scene, unit_number};
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::{exact_solid, solid, steep_inset};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::outline::directions;

/// Number of start points per shape for a search for solid points outside the box.
const POINTS_PER_BOX: usize = 150;
/// Number of steps towards the surface from each of them.
const DESCENTS_PER_POINT: usize = 5;
/// Largest excess of an outline over an exact solid, relative to half the diagonal of its box.
///
/// The search for an outline ends after a fixed number of boxes. Thin plates along a diagonal keep most of
/// the excess up to the corner.
const MAX_EXCESS_PER_SIZE: f64 = 0.9;

/// Reports whether a point is in a box, up to a slack for rounding.
fn contains(bounds: &Bounds, p: Point, slack: f64) -> bool {
    (0..3).all(|i| bounds.min[i] - slack <= p[i] && p[i] <= bounds.max[i] + slack)
}

/// Checks that the stated outline reaches at least as far as a point of the solid, in all directions.
fn check_outline(tested: &TestShape, p: Point, slack: f64) -> Result<(), String> {
    let settings = &tested.compiled.module.settings;
    // The outline of a bounded solid is that of the root as compiled.
    let is_comparable = tested.bounds.is_finite() && !tested.is_at_other_state;
    let Some(outline) = settings.subject.as_ref().filter(|_| is_comparable) else {
        return Ok(());
    };
    for (index, direction) in directions().into_iter().enumerate() {
        let projection: f64 = (0..3).map(|i| direction[i] * p[i]).sum();
        if projection > outline.supports[index] + slack * 3.0 {
            let max_projection = outline.supports[index];
            return Err(format!(
                "{p:?} is {projection} along {direction:?}, farther than {max_projection}"
            ));
        }
    }
    Ok(())
}

/// Returns the first point of the solid outside a stated box or outline.
pub(super) fn find_violation(tested: &TestShape, seed: u64) -> Option<String> {
    let mut points = TrialPoints::new(tested, seed);
    for _ in 0..POINTS_PER_BOX {
        let mut p = points.anywhere(tested);
        for _ in 0..DESCENTS_PER_POINT {
            let slope = tested.gradient(p);
            let slack = 4.0 * MAX_ROUNDING_PER_SIZE * size_at(p, tested.size);
            let tolerance = -slack * norm(slope.gradient).max(1.0);
            let is_solid = slope.value < tolerance;
            let is_true = tested.oracle.value(p) < tolerance;
            if is_solid || is_true {
                if let Some(stated) = tested.boxes.iter().find(|b| !contains(b, p, slack)) {
                    return Some(format!("{p:?} is solid, outside of {stated:?}"));
                }
                if let Err(violation) = check_outline(tested, p, slack) {
                    return Some(violation);
                }
            }
            // A step to the surface and up to 20 % past it.
            let gradient_sq = norm(slope.gradient).powi(2).max(1e-12);
            let factor = slope.value / gradient_sq * (1.0 + 0.2 * unit_number(&mut points.random));
            p = [0, 1, 2].map(|i| p[i] - factor * slope.gradient[i]);
            if !p.iter().all(|v| v.is_finite()) {
                break;
            }
        }
    }
    None
}

/// Checks the boxes and outlines of random shapes.
fn check_boxes(name: &str, text_from: impl Fn(&mut Random) -> String + Sync) {
    let check = |&seed: &u64| {
        let text = text_from(&mut Random::new(seed));
        let Some(tested) = parse_shape(&text) else {
            return CheckOutcome::Refused;
        };
        if let Some(violation) = find_violation(&tested, seed) {
            panic!("{violation}\n{text}");
        }
        CheckOutcome::Accepted
    };
    let tally = run(name, input_count(40, 200), |seed| seed, check);
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn nothing_of_a_random_shape_lies_outside_its_boxes() {
    check_boxes("boxes of random shapes", |r| solid(r, 3));
}

/// A box shrinks by an inward offset only if its shape's value changes as slowly as a distance.
#[test]
fn nothing_of_an_inset_steep_field_lies_outside_its_boxes() {
    check_boxes("boxes of insets", steep_inset);
}

#[test]
fn nothing_of_a_file_lies_outside_its_boxes() {
    let mut violations = Vec::new();
    for path in corpus(0) {
        let (scene, name) = read_scene(&path);
        let Some(root) = scene.root.filter(|_| !scene.is_2d) else {
            continue;
        };
        let Some(tested) = TestShape::new(&scene, root, &name) else {
            continue;
        };
        if let Some(violation) = find_violation(&tested, 5) {
            violations.push(format!("{name}: {violation}"));
        }
    }
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

#[test]
fn reaches_of_exact_solids_are_no_farther_than_the_corners() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let (turn, axis) = (r.below(360), [0; 3].map(|_| 1 + r.below(9)));
        let text = format!("{}.rotate({turn}deg, {axis:?})", exact_solid(&mut r));
        let tested = valid_shape(&text);
        let outline = tested.compiled.module.settings.subject.as_ref();
        let outline = outline.unwrap_or_else(|| panic!("{text} has no outline"));
        let half = [0, 1, 2].map(|i| 0.5 * (tested.bounds.max[i] - tested.bounds.min[i]));
        let size = norm(half);
        for (index, direction) in directions().into_iter().enumerate() {
            // From far away, the distance of an exact solid yields its extent in a direction.
            let distance = 1e4 * size;
            let length = norm(direction);
            let p = direction.map(|v| v / length * distance);
            let reach = (distance - tested.oracle.value(p)) * length;
            let excess = (outline.supports[index] - reach) / (size * length);
            if !(-1e-3..=MAX_EXCESS_PER_SIZE).contains(&excess) {
                panic!(
                    "{text}: {} along {direction:?}, not {reach}",
                    outline.supports[index]
                );
            }
        }
        CheckOutcome::Accepted
    };
    run(
        "reaches of exact solids",
        input_count(30, 200),
        |seed| seed,
        check,
    );
}

/// Boxes of exact solids touch them on all sides, apart from the exceptions in the reference documentation.
#[test]
fn boxes_of_parallel_solids_touch_them() {
    for text in [
        "sphere(0.6)",
        "box(0.9, 0.5, 0.7).translate(1, 2, 3)",
        "capsule(from: [-0.3, -0.4, 0], to: [0.4, 0.3, 0.2], r: 0.2)",
        "cylinder(from: [-0.3, -0.4, 0], to: [0.4, 0.3, 0.2], r: 0.3)",
        "round_cone(r1: 0.2, r2: 0.5, h: 0.2)",
        "ellipsoid([0.8, 0.3, 0.5]).scale([1, 2, 3])",
        "box(0.5).repeat(1.5, count: [3, 1, 2])",
        "sphere(0.5).offset(0.25).shell(0.125)",
        "circle(0.5).extrude(2) | sphere(1).translate(0, 2, 0)",
    ] {
        let tested = valid_shape(text);
        let mut r = Random::new(6);
        let Bounds { min, max } = tested.bounds;
        for axis in 0..3 {
            for side in [min[axis], max[axis]] {
                let inset = 0.01 * (max[axis] - min[axis]);
                let face = side + if side == min[axis] { inset } else { -inset };
                let mut nearest = f64::INFINITY;
                for _ in 0..4000 {
                    let fraction = random_point(&mut r, 0.5);
                    let mut p = [0, 1, 2].map(|i| min[i] + (max[i] - min[i]) * (fraction[i] + 0.5));
                    p[axis] = face;
                    nearest = nearest.min(tested.oracle.value(p));
                }
                assert!(
                    nearest < 1e-2,
                    "{text}: {nearest} at side {side} of axis {axis}"
                );
            }
        }
    }
}
