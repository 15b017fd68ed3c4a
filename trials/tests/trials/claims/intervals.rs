//! Intervals over boxes: they hold the values and slopes of all points inside, by both evaluators.

use super::subject::{Subject, slope_of, subject_of};
use super::{MAX_ROUNDING_PER_SIZE, Places, corpus, size_at};
use crate::oracle::{Point, norm, read, unit};
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::solid;
use sdfc_vm::branching::{Branching, explore};
use sdfc_vm::evaluate::{evaluate, evaluate_f64, gradient};
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::vector::V3;

/// The number of boxes for each program.
const BOXES_PER_PROGRAM: usize = 15;
/// The number of points in each box.
const POINTS_PER_BOX: usize = 12;
/// The relative error of sums in `f64` along a program.
const MAX_F64_ERROR: f64 = 1e-11;

/// A value that no interval says anything of.
fn holds(range: Interval, value: f64, slack: f64) -> bool {
    value.is_nan() || range.lo.is_nan() || (range.lo - slack <= value && value <= range.hi + slack)
}

/// The first number outside of its interval.
fn refutation(subject: &Subject, program: &Program, seed: u64) -> Option<String> {
    let is_written = std::ptr::eq(program, &subject.written);
    let tells_values = is_written && subject.has_known_values;
    let mut places = Places::new(subject, seed);
    for _ in 0..BOXES_PER_PROGRAM {
        let corner = places.anywhere(subject);
        let half = size_at(corner, subject.size) * 10.0_f64.powf(-4.0 * unit(&mut places.random));
        let sides = corner.map(|v| {
            let side = if places.random.chance(10) {
                0.0
            } else {
                half * unit(&mut places.random)
            };
            Interval {
                lo: v,
                hi: v + side,
            }
        });
        let [x, y, z] = sides;
        let whole = evaluate::<Interval>(program, V3 { x, y, z });
        let sloped = gradient::<Interval>(program, V3 { x, y, z });
        // What holds zero is not explored further.
        let explored = explore(|| evaluate::<Branching>(program, Branching::point(sides)));
        let explored = match explored.contains(0.0) {
            true => Interval::ALL,
            false => explored,
        };
        for at in 0..POINTS_PER_BOX {
            let p: Point = [0, 1, 2].map(|i| match at {
                0 => sides[i].lo,
                1 => sides[i].hi,
                _ => sides[i].lo + (sides[i].hi - sides[i].lo) * unit(&mut places.random),
            });
            let found = slope_of(program, p);
            let scale = size_at(p, 1.0) * norm(found.gradient).max(1.0) + found.value.abs();
            let slack = MAX_F64_ERROR * scale;
            let value = evaluate_f64(program, p);
            for (name, range) in [
                ("values", whole),
                ("duals", sloped.value),
                ("branches", explored),
            ] {
                if !holds(range, value, slack) {
                    return Some(format!(
                        "{value} at {p:?} is not in {range:?}, {name} of {sides:?}"
                    ));
                }
            }
            let truth = subject.oracle.value(p);
            if tells_values && !holds(whole, truth, 8.0 * MAX_ROUNDING_PER_SIZE * scale) {
                return Some(format!(
                    "{truth} by the oracle at {p:?} is not in {whole:?} of {sides:?}"
                ));
            }
            let V3 { x, y, z } = sloped.gradient;
            let steepness = norm(found.gradient);
            for (axis, range) in [x, y, z].into_iter().enumerate() {
                let slope = found.gradient[axis];
                if !holds(range, slope, 1e-9 * (1.0 + steepness)) {
                    return Some(format!(
                        "slope {slope} along {axis} at {p:?} is not in {range:?} of {sides:?}"
                    ));
                }
            }
        }
    }
    None
}

fn demand(subject: &Subject, seed: u64) {
    for (name, program) in [("written", &subject.written), ("step", &subject.step)] {
        if let Some(found) = refutation(subject, program, seed) {
            panic!("{name}: {found}\n{}", subject.name);
        }
    }
}

#[test]
fn intervals_of_random_shapes_hold_all_values_and_slopes() {
    let check = |&seed: &u64| {
        let text = solid(&mut Random::new(seed), 3);
        let Some(subject) = subject_of(&text) else {
            return Verdict::Refused;
        };
        demand(&subject, seed);
        Verdict::Accepted
    };
    let tally = run(
        "intervals of random shapes",
        count(30, 200),
        |seed| seed,
        check,
    );
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn intervals_of_files_hold_all_values_and_slopes() {
    let mut wrong = Vec::new();
    for path in corpus(1) {
        let (scene, name) = read(&path);
        let Some(root) = scene.root.filter(|_| !scene.plane) else {
            continue;
        };
        let Some(subject) = Subject::new(&scene, root, &name) else {
            continue;
        };
        // Long programs take long, and consist of what short ones do.
        if subject.written.code.len() > 200 {
            continue;
        }
        if let Some(found) = refutation(&subject, &subject.written, 8) {
            wrong.push(format!("{name}: {found}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
