//! Stated slopes against gradients, and against the differences of values at two points.

use super::subject::{Subject, right, scene_of, solids, subject_of};
use super::{MAX_ROUNDING_PER_SIZE, Places, corpus, size_at};
use crate::oracle::{beyond, direction, norm, read, unit};
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::solid;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::program::{Code, Program};
use sdfc_vm::table::Op;
use sdfc_vm::tape::Tape;

/// The number of points at which each bound is tried.
const POINTS_PER_BOUND: usize = 100;
/// The number of shapes below the root that are tried as scenes of their own.
const SHAPES_PER_SCENE: u64 = 1;
/// The most shapes of a scene whose shapes are compiled one by one.
const MAX_SCENE_SHAPES: usize = 150;
/// The excess over a bound that rounding explains.
const MAX_EXCESS_FACTOR: f64 = 1.0 + 1e-5;

fn holds(region: &Bounds, p: [f64; 3]) -> bool {
    (0..3).all(|i| region.min[i] <= p[i] && p[i] <= region.max[i])
}

/// A point moved to the nearest one of a region.
fn clamped(region: &Bounds, p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| p[i].max(region.min[i]).min(region.max[i]))
}

/// The first point at which a written value is steeper than stated.
pub(super) fn refutation(subject: &Subject, seed: u64) -> Option<String> {
    if subject.is_guessed {
        return None;
    }
    let mut places = Places::new(subject, seed);
    let knows_values = subject.has_known_values;
    for stated in &subject.slopes {
        if stated.region.is_empty() {
            continue;
        }
        for _ in 0..POINTS_PER_BOUND {
            let mut p = places.anywhere(subject);
            if !holds(&stated.region, p) {
                p = clamped(&stated.region, p);
            }
            let found = subject.gradient(p);
            let steepness = norm(found.gradient);
            if steepness > stated.slope * MAX_EXCESS_FACTOR + 1e-9 {
                return Some(format!("slope {steepness} at {p:?}, stated {stated:?}"));
            }
            let away = subject.size * 10.0_f64.powf(-4.0 + 4.0 * unit(&mut places.random));
            let q = beyond(p, direction(&mut places.random), away);
            let q = clamped(&stated.region, q);
            let apart = norm([0, 1, 2].map(|i| p[i] - q[i]));
            let noise = MAX_ROUNDING_PER_SIZE * stated.slope.max(1.0);
            let limit = stated.slope * apart * MAX_EXCESS_FACTOR + noise * size_at(p, 0.0).max(1.0);
            let change = (found.value - subject.value(q)).abs();
            if change > limit {
                return Some(format!("{change} from {p:?} to {q:?}, stated {stated:?}"));
            }
            if knows_values {
                let change = (subject.oracle.value(p) - subject.oracle.value(q)).abs();
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

/// The first instruction whose value, with all before it, is steeper than its tape says.
fn refuted_tape(subject: &Subject, seed: u64) -> Option<String> {
    let mut places = Places::new(subject, seed);
    let program = &subject.step;
    for length in 1..=program.code.len() {
        let begin = Program {
            code: program.code[..length].to_vec(),
            ..program.clone()
        };
        // A beginning that ends with a point has no value, and half a polygon has no sides.
        let is_edge = |at: usize| {
            let code = program.code.get(at).map(|i| i.code);
            code == Some(Code::Op(Op::PolygonEdge))
        };
        if begin.code[length - 1].gives_none() || is_edge(length - 1) && is_edge(length) {
            continue;
        }
        let slope = f64::from(Tape::of(&begin).slopes.whole);
        if !slope.is_finite() {
            continue;
        }
        for _ in 0..12 {
            let p = places.within(2.0);
            let found = norm(super::subject::slope_of(&begin, p).gradient);
            let q = beyond(p, direction(&mut places.random), 0.1 * subject.size);
            let change = (evaluate_f64(&begin, p) - evaluate_f64(&begin, q)).abs();
            let limit = slope * MAX_EXCESS_FACTOR;
            if found > limit + 1e-6 || change > limit * 0.1 * subject.size + 1e-6 * size_at(p, 1.0)
            {
                return Some(format!(
                    "instruction {length}: slope {found} at {p:?}, {slope} by its tape"
                ));
            }
        }
    }
    None
}

fn demand(subject: &Subject, seed: u64) {
    if let Some(found) = refutation(subject, seed) {
        panic!("{found}\n{}", subject.name);
    }
    if let Some(found) = refuted_tape(subject, seed) {
        panic!("{found}\n{}", subject.name);
    }
}

#[test]
fn random_shapes_are_no_steeper_than_stated() {
    let check = |&seed: &u64| {
        let text = solid(&mut Random::new(seed), 3);
        let Some(subject) = subject_of(&text) else {
            return Verdict::Refused;
        };
        demand(&subject, seed);
        let scene = scene_of(&text).expect("it was right before");
        let mut r = Random::new(seed);
        let below = solids(&scene);
        for _ in 0..2 {
            let id = r.pick(&below);
            if let Some(subject) = Subject::new(&scene, id, &format!("{id:?} of {text}")) {
                demand(&subject, seed);
            }
        }
        Verdict::Accepted
    };
    let tally = run(
        "slopes of random shapes",
        count(30, 200),
        |seed| seed,
        check,
    );
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn shapes_of_files_are_no_steeper_than_stated() {
    let mut wrong = Vec::new();
    for path in corpus(2) {
        let (scene, name) = read(&path);
        let all = solids(&scene);
        if all.is_empty() {
            continue;
        }
        let mut r = Random::new(3);
        let root = all.first().copied();
        let more = match all.len() <= MAX_SCENE_SHAPES {
            true => count(SHAPES_PER_SCENE, 2000),
            false => 0,
        };
        let some = (0..more).map(|_| r.pick(&all));
        for id in root.into_iter().chain(some) {
            let Some(subject) = Subject::new(&scene, id, &name) else {
                continue;
            };
            if let Some(found) = refutation(&subject, 3) {
                wrong.push(format!("{name}, {id:?}: {found}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_field_without_a_bound_is_said_to_have_none() {
    assert!(right("field(fn(p) => 1 / p.x, within: 2)").is_guessed);
    assert!(!right("field(fn(p) => 2 * p.x, within: 2)").is_guessed);
}
