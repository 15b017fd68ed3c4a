//! Stated boxes and reaches: nothing of a shape lies outside, and boxes of exact shapes touch them.

use super::subject::{Subject, right, subject_of};
use super::{MAX_ROUNDING_PER_SIZE, Places, corpus, size_at};
use crate::oracle::{Point, norm, point, read, unit};
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::{exact_solid, solid};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::outline::directions;

/// The number of points from which a way out of the box is looked for.
const POINTS_PER_BOX: usize = 150;
/// The number of steps towards the surface from each of them.
const DESCENTS_PER_POINT: usize = 5;
/// The most that the reach of an exact solid exceeds the solid's, by half the diagonal of its box.
///
/// The search for a reach ends after a number of boxes: thin plates across a diagonal keep most of the way to
/// the corner.
const MAX_EXCESS_PER_SIZE: f64 = 0.9;

/// Tells if a point is in a box, or no farther outside than rounding explains.
fn holds(bounds: &Bounds, p: Point, slack: f64) -> bool {
    (0..3).all(|i| bounds.min[i] - slack <= p[i] && p[i] <= bounds.max[i] + slack)
}

/// The largest product of a direction and a point of the outline is no less than this point's.
fn outline_holds(subject: &Subject, p: Point, slack: f64) -> Result<(), String> {
    let settings = &subject.compiled.module.settings;
    // The outline of a solid with an end is that of the whole solid, as it is compiled.
    let is_whole = subject.bounds.is_finite() && !subject.is_moved;
    let Some(outline) = settings.subject.as_ref().filter(|_| is_whole) else {
        return Ok(());
    };
    for (at, direction) in directions().into_iter().enumerate() {
        let along: f64 = (0..3).map(|i| direction[i] * p[i]).sum();
        if along > outline.reaches[at] + slack * 3.0 {
            let reach = outline.reaches[at];
            return Err(format!(
                "{p:?} is {along} along {direction:?}, farther than {reach}"
            ));
        }
    }
    Ok(())
}

/// The first point of the solid outside of what is stated.
pub(super) fn refutation(subject: &Subject, seed: u64) -> Option<String> {
    let mut places = Places::new(subject, seed);
    for _ in 0..POINTS_PER_BOX {
        let mut p = places.anywhere(subject);
        for _ in 0..DESCENTS_PER_POINT {
            let found = subject.gradient(p);
            let slack = 4.0 * MAX_ROUNDING_PER_SIZE * size_at(p, subject.size);
            let tolerance = -slack * norm(found.gradient).max(1.0);
            let is_solid = found.value < tolerance;
            let is_true = subject.oracle.value(p) < tolerance;
            if is_solid || is_true {
                if let Some(stated) = subject.boxes.iter().find(|b| !holds(b, p, slack)) {
                    return Some(format!("{p:?} is solid, outside of {stated:?}"));
                }
                if let Err(found) = outline_holds(subject, p, slack) {
                    return Some(found);
                }
            }
            // A step to the surface and a little into it.
            let square = norm(found.gradient).powi(2).max(1e-12);
            let by = found.value / square * (1.0 + 0.2 * unit(&mut places.random));
            p = [0, 1, 2].map(|i| p[i] - by * found.gradient[i]);
            if !p.iter().all(|v| v.is_finite()) {
                break;
            }
        }
    }
    None
}

#[test]
fn nothing_of_a_random_shape_lies_outside_its_boxes() {
    let check = |&seed: &u64| {
        let text = solid(&mut Random::new(seed), 3);
        let Some(subject) = subject_of(&text) else {
            return Verdict::Refused;
        };
        if let Some(found) = refutation(&subject, seed) {
            panic!("{found}\n{text}");
        }
        Verdict::Accepted
    };
    let tally = run("boxes of random shapes", count(40, 200), |seed| seed, check);
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn nothing_of_a_file_lies_outside_its_boxes() {
    let mut wrong = Vec::new();
    for path in corpus(0) {
        let (scene, name) = read(&path);
        let Some(root) = scene.root.filter(|_| !scene.plane) else {
            continue;
        };
        let Some(subject) = Subject::new(&scene, root, &name) else {
            continue;
        };
        if let Some(found) = refutation(&subject, 5) {
            wrong.push(format!("{name}: {found}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn reaches_of_exact_solids_are_no_farther_than_the_corners() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let (turn, axis) = (r.below(360), [0; 3].map(|_| 1 + r.below(9)));
        let text = format!("{}.rotate({turn}deg, {axis:?})", exact_solid(&mut r));
        let subject = right(&text);
        let outline = subject.compiled.module.settings.subject.as_ref();
        let outline = outline.unwrap_or_else(|| panic!("{text} has no outline"));
        let half = [0, 1, 2].map(|i| 0.5 * (subject.bounds.max[i] - subject.bounds.min[i]));
        let size = norm(half);
        for (at, direction) in directions().into_iter().enumerate() {
            // From far away, the distance to an exact solid tells its reach along the way.
            let far = 1e4 * size;
            let length = norm(direction);
            let p = direction.map(|v| v / length * far);
            let reach = (far - subject.oracle.value(p)) * length;
            let excess = (outline.reaches[at] - reach) / (size * length);
            if !(-1e-3..=MAX_EXCESS_PER_SIZE).contains(&excess) {
                panic!(
                    "{text}: {} along {direction:?}, not {reach}",
                    outline.reaches[at]
                );
            }
        }
        Verdict::Accepted
    };
    run(
        "reaches of exact solids",
        count(30, 200),
        |seed| seed,
        check,
    );
}

/// Boxes of exact solids touch them on all sides, but for what the reference says of them.
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
        let subject = right(text);
        let mut r = Random::new(6);
        let Bounds { min, max } = subject.bounds;
        for axis in 0..3 {
            for side in [min[axis], max[axis]] {
                let inwards = 0.01 * (max[axis] - min[axis]);
                let face = side + if side == min[axis] { inwards } else { -inwards };
                let mut nearest = f64::INFINITY;
                for _ in 0..4000 {
                    let share = point(&mut r, 0.5);
                    let mut p = [0, 1, 2].map(|i| min[i] + (max[i] - min[i]) * (share[i] + 0.5));
                    p[axis] = face;
                    nearest = nearest.min(subject.oracle.value(p));
                }
                assert!(
                    nearest < 1e-2,
                    "{text}: {nearest} at side {side} of axis {axis}"
                );
            }
        }
    }
}
