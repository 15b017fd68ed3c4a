//! Steps that engines march by: within the ball of a step's length the sign stays.

use super::subject::{Subject, right, subject_of};
use super::{HASHING, MAX_ROUNDING_PER_SIZE, Places, corpus, size_at};
use crate::oracle::{beyond, direction, norm, read, unit};
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::solid;

/// The number of points from which a step is tried.
const STEPS_PER_SHAPE: usize = 150;
/// The number of random directions that a step is tried in.
const DIRECTIONS_PER_STEP: usize = 4;

/// The first step that leads past a surface.
pub(super) fn refutation(subject: &Subject, seed: u64) -> Option<String> {
    if subject.is_guessed {
        return None;
    }
    let mut places = Places::new(subject, seed);
    for _ in 0..STEPS_PER_SHAPE {
        let p = places.anywhere(subject);
        let step = subject.step(p);
        let found = subject.gradient(p);
        let slack = MAX_ROUNDING_PER_SIZE * size_at(p, 1.0);
        let length = step.abs() * (1.0 - 1e-5) - slack;
        // Where what is written overflows, no step is claimed.
        if subject.value(p).is_infinite() {
            continue;
        }
        if !step.is_finite() {
            return Some(format!("a step of {step} at {p:?}"));
        }
        if length <= 0.0 {
            continue;
        }
        let steepness = norm(found.gradient).max(1e-30);
        let ahead = found
            .gradient
            .map(|v| -v * found.value.signum() / steepness);
        let random = (0..DIRECTIONS_PER_STEP).map(|_| direction(&mut places.random));
        let ways: Vec<_> = [ahead].into_iter().chain(random).collect();
        for way in ways {
            for share in [1.0, unit(&mut places.random)] {
                let q = beyond(p, way, length * share);
                let (written, truth) = (subject.value(q), subject.oracle.value(q));
                // Where the surface is flat, values near it are as good as zero.
                let is_zero =
                    |v: f64| v.abs() <= slack * norm(subject.gradient(q).gradient).max(1.0);
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
        let Some(subject) = subject_of(&text) else {
            return Verdict::Refused;
        };
        if let Some(found) = refutation(&subject, seed) {
            panic!("{found}\n{text}");
        }
        Verdict::Accepted
    };
    let tally = run("steps of random shapes", count(35, 200), |seed| seed, check);
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn steps_of_files_pass_no_surface() {
    let mut wrong = Vec::new();
    for path in corpus(3) {
        let (scene, name) = read(&path);
        let Some(root) = scene.root.filter(|_| !scene.plane) else {
            continue;
        };
        let Some(subject) = Subject::new(&scene, root, &name) else {
            continue;
        };
        if HASHING.contains(&name.as_str()) {
            continue;
        }
        if let Some(found) = refutation(&subject, 4) {
            wrong.push(format!("{name}: {found}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A bound that is stated guides steps where it holds, and is not used where it does not.
#[test]
fn steps_of_fields_with_stated_bounds_pass_no_surface() {
    let fields = [
        ("length(p) - 0.5", ""),
        ("3 * length(p) - 2", ", within: 4"),
        ("dot(p, p) - 1", ", within: 3"),
        ("p.y - 0.25 * sin(4 * p.x) * cos(3 * p.z)", ", within: 5"),
        ("p.x * p.x * p.y + p.z * p.z - 0.25", ", within: 2"),
    ];
    for (formula, ends) in fields {
        for bound in [0.125, 0.5, 1.0, 5.0, 50.0] {
            for change in ["", ".offset(0.125)", ".scale(2).rotate(30deg, Z)"] {
                let text = format!("field(fn(p) => {formula}{ends}, lipschitz: {bound}){change}");
                let subject = right(&text);
                if let Some(found) = refutation(&subject, 9) {
                    panic!("{found}\n{text}");
                }
            }
        }
    }
}
