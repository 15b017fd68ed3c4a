//! Written values by the engines' definitions against those of the oracle.

use super::subject::{Subject, right, scene_of, solids, subject_of};
use super::{HASHING, MAX_ROUNDING_PER_SIZE, Places, corpus, size_at};
use crate::oracle::{beyond, direction, norm, read};
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::{crossing_polygon, exact_figure, exact_solid, solid};
use std::sync::atomic::{AtomicU64, Ordering};

/// The number of points at which values are compared.
const POINTS_PER_SHAPE: usize = 150;
/// The share of the points that may lie at a jump, where either side is right: of a quarter of them, coordinates are zero.
const MAX_JUMP_SHARE: f64 = 0.3;
/// The distance within which a jump is looked for, by size of coordinates.
const JUMP_REACH_PER_SIZE: f64 = 1e-5;
/// The share of random shapes whose values no row promises.
const MAX_UNPROMISED_SHARE: f64 = 0.4;

/// The first value that is not the oracle's.
fn refutation(subject: &Subject, seed: u64) -> Option<String> {
    let mut places = Places::new(subject, seed);
    let mut jumps = 0.0;
    for _ in 0..POINTS_PER_SHAPE {
        let p = match places.random.below(4) {
            0 => places.symmetric(),
            1 => places.near_surface(subject),
            _ => places.within(3.0),
        };
        let own = subject.gradient(p);
        let truth = subject.oracle.value(p);
        let size = size_at(p, subject.size);
        let steepness = norm(own.gradient).max(norm(subject.oracle.gradient(p)));
        let slack = MAX_ROUNDING_PER_SIZE * (size * steepness.max(1.0) + truth.abs());
        // Rows promise no value where a number on the way is none.
        let is_same = (own.value - truth).abs() <= slack || own.value == truth;
        // Of what is nowhere, engines keep nothing but that it is far away.
        let is_nowhere = subject.bounds.is_empty() && own.value > 0.0 && truth > 0.0;
        if is_same || is_nowhere || own.value.is_nan() {
            continue;
        }
        let changes = (0..8).map(|_| {
            let q = beyond(p, direction(&mut places.random), JUMP_REACH_PER_SIZE * size);
            (subject.oracle.value(q) - truth).abs()
        });
        // A value that jumps changes by far more than its slope says.
        let most = 10.0 * JUMP_REACH_PER_SIZE * size * norm(own.gradient).max(1.0);
        let is_jump = changes.fold(0.0, f64::max) > most;
        jumps += f64::from(u8::from(is_jump));
        if !is_jump || jumps > MAX_JUMP_SHARE * POINTS_PER_SHAPE as f64 {
            return Some(format!("{} and not {truth} at {p:?}", own.value));
        }
    }
    None
}

#[test]
fn values_of_random_shapes_are_the_oracles() {
    let unpromised = AtomicU64::new(0);
    let check = |&seed: &u64| {
        let text = solid(&mut Random::new(seed), 3);
        let (Some(scene), Some(whole)) = (scene_of(&text), subject_of(&text)) else {
            return Verdict::Refused;
        };
        let mut r = Random::new(seed);
        let id = r.pick(&solids(&scene));
        let part = Subject::new(&scene, id, &text);
        for subject in [Some(whole), part].into_iter().flatten() {
            if !subject.has_known_values {
                unpromised.fetch_add(1, Ordering::Relaxed);
                continue;
            }
            if let Some(found) = refutation(&subject, seed) {
                panic!("{found}\n{text}");
            }
        }
        Verdict::Accepted
    };
    let tally = run(
        "values of random shapes",
        count(35, 200),
        |seed| seed,
        check,
    );
    let share = unpromised.into_inner() as f64 / (2 * tally.accepted).max(1) as f64;
    assert!(
        tally.accepted < 60 || share <= MAX_UNPROMISED_SHARE,
        "{share} of the values are promised by no row"
    );
}

/// Solids and figures with degenerate numbers among them.
#[test]
fn values_of_exact_shapes_are_the_oracles() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let text = match r.below(10) {
            0 => format!("{}.extrude(0.5)", crossing_polygon(&mut r)),
            1..=4 => format!("{}.extrude(0.5)", exact_figure(&mut r)),
            _ => exact_solid(&mut r),
        };
        let subject = right(&text);
        assert!(subject.has_known_values, "{text}");
        if let Some(found) = refutation(&subject, seed) {
            panic!("{found}\n{text}");
        }
        Verdict::Accepted
    };
    run("values of exact shapes", count(100, 50), |seed| seed, check);
}

#[test]
fn values_of_files_are_the_oracles() {
    let mut wrong = Vec::new();
    for path in corpus(4) {
        let (scene, name) = read(&path);
        let Some(root) = scene.root.filter(|_| !scene.plane) else {
            continue;
        };
        let Some(subject) = Subject::new(&scene, root, &name) else {
            continue;
        };
        if !subject.has_known_values || HASHING.contains(&name.as_str()) {
            continue;
        }
        if let Some(found) = refutation(&subject, 7) {
            wrong.push(format!("{name}: {found}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
