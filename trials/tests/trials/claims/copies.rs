//! Repetitions against the union of their copies, written out by hand.

use super::subject::{Subject, right, subject_of};
use super::{MAX_ROUNDING_PER_SIZE, size_at};
use crate::oracle::{Point, point};
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::{exact_figure, exact_solid, length, solid};
use std::fmt::Write;

/// The number of points at which both are compared.
const POINTS_PER_PAIR: usize = 150;
/// The number of copies on each side that stand for an endless row of them.
const COPIES_ASIDE: i32 = 5;

/// An exact solid, perhaps of two, which may lie beside its cell, leave it, or touch its walls.
fn child(r: &mut Random) -> String {
    child_by(r, &["|"])
}

/// The same, of two by one of these operators.
fn child_by(r: &mut Random, operators: &[&str]) -> String {
    let mut text = exact_solid(r);
    if r.chance(40) {
        let by = [0; 3].map(|_| length(r, -0.75, 0.75));
        let other = exact_solid(r);
        let _ = write!(text, ".translate({}, {}, {})", by[0], by[1], by[2]);
        text = format!("({text} {} {other})", r.pick(operators));
    }
    if r.chance(60) {
        let by = [0; 3].map(|_| length(r, -0.5, 0.5));
        let _ = write!(text, ".translate({}, {}, {})", by[0], by[1], by[2]);
    }
    if r.chance(50) {
        let _ = write!(text, ".rotate({}deg, [1, {}, 2])", r.below(360), r.below(5));
    }
    text
}

/// Demands equal values of a folded shape and the union of its copies, in a cube.
fn demand(folded: &Subject, listed: &Subject, half: f64, seed: u64, tells_values: bool) {
    let mut r = Random::new(seed);
    for _ in 0..POINTS_PER_PAIR {
        let mut p = point(&mut r, half);
        if r.chance(10) {
            // The middle of a cell, and the axis of a ring.
            p[r.below(3)] = 0.0;
        }
        let own = folded.value(p);
        let slack = 4.0 * MAX_ROUNDING_PER_SIZE * size_at(p, folded.size);
        for truth in [
            listed.value(p),
            listed.oracle.value(p),
            folded.oracle.value(p),
        ] {
            let is_right = match tells_values {
                true => (own - truth).abs() <= slack,
                false => (own < 0.0) == (truth < 0.0) || own.abs().min(truth.abs()) <= 4.0 * slack,
            };
            assert!(
                is_right,
                "{own} and not {truth} at {p:?}\n{}\n{}",
                folded.name, listed.name
            );
        }
    }
}

/// Copies in a grid, as text.
fn grid(child: &str, spacing: Point, counts: [Vec<f64>; 3]) -> String {
    let mut copies = Vec::new();
    for x in &counts[0] {
        for y in &counts[1] {
            for z in &counts[2] {
                let by = [x * spacing[0], y * spacing[1], z * spacing[2]];
                copies.push(format!("c.translate({}, {}, {})", by[0], by[1], by[2]));
            }
        }
    }
    format!("let c = {child};\nunion([{}])", copies.join(", "))
}

/// The numbers of copies along an axis, around zero.
fn around_zero(count: usize) -> Vec<f64> {
    (0..count)
        .map(|at| at as f64 - 0.5 * (count - 1) as f64)
        .collect()
}

#[test]
fn limited_repetitions_are_the_union_of_their_copies() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let child = child(&mut r);
        let spacing = [0; 3].map(|_| length(&mut r, 0.25, 2.0));
        let counts = [0; 3].map(|_| 1 + r.below(4));
        let text = format!("({child}).repeat({spacing:?}, count: {counts:?})");
        let Some(folded) = subject_of(&text) else {
            return Verdict::Refused;
        };
        let listed = right(&grid(&child, spacing, counts.map(around_zero)));
        demand(&folded, &listed, 4.0, seed, true);
        Verdict::Accepted
    };
    let tally = run("limited repetitions", count(12, 200), |seed| seed, check);
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn endless_repetitions_are_the_union_of_their_copies() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let child = child(&mut r);
        let (axis, step) = (r.below(3), length(&mut r, 0.5, 2.0));
        let mut spacing = [0.0; 3];
        spacing[axis] = step;
        let text = format!("({child}).repeat({spacing:?})");
        let Some(folded) = subject_of(&text) else {
            return Verdict::Refused;
        };
        let aside = (-COPIES_ASIDE..=COPIES_ASIDE).map(f64::from);
        let mut numbers = [0; 3].map(|_| vec![0.0]);
        numbers[axis] = aside.collect();
        let listed = right(&grid(&child, spacing, numbers));
        // A copy reaches over no more than four cells, and there are five on each side.
        demand(&folded, &listed, 0.5 * step, seed, true);
        Verdict::Accepted
    };
    let tally = run("endless repetitions", count(10, 200), |seed| seed, check);
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn rings_are_the_union_of_their_copies() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let is_plane = r.chance(30);
        let sectors = 1 + r.below(11);
        let away = [length(&mut r, -1.0, 2.0), length(&mut r, -1.0, 1.0)];
        let angles = (0..sectors).map(|at| 360.0 * at as f64 / sectors as f64);
        let (text, listed) = if is_plane {
            let child = format!(
                "{}.translate({}, {})",
                exact_figure(&mut r),
                away[0],
                away[1]
            );
            let copies: Vec<String> = angles.map(|a| format!("c.rotate({a}deg)")).collect();
            let listed = format!(
                "let c = {child};\nunion([{}]).extrude(1)",
                copies.join(", ")
            );
            (format!("({child}).polar({sectors}).extrude(1)"), listed)
        } else {
            let child = format!("({}).translate({}, 0, {})", child(&mut r), away[0], away[1]);
            let copies: Vec<String> = angles.map(|a| format!("c.rotate({a}deg, Y)")).collect();
            let listed = format!("let c = {child};\nunion([{}])", copies.join(", "));
            (format!("({child}).polar({sectors})"), listed)
        };
        let Some(folded) = subject_of(&text) else {
            return Verdict::Refused;
        };
        demand(&folded, &right(&listed), 3.0, seed, true);
        Verdict::Accepted
    };
    let tally = run("rings", count(12, 200), |seed| seed, check);
    assert!(tally.accepted > tally.refused, "{tally:?}");
}

/// Rings of what is cut are where the union of their copies is, though their values may be larger.
#[test]
fn rings_of_cut_solids_are_where_their_copies_are() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let sectors = 1 + r.below(11);
        let child = child_by(&mut r, &["&", "-"]);
        let child = format!("({child}).translate({}, 0, 0.5)", length(&mut r, -1.0, 2.0));
        let Some(folded) = subject_of(&format!("({child}).polar({sectors})")) else {
            return Verdict::Refused;
        };
        let angles = (0..sectors).map(|at| 360.0 * at as f64 / sectors as f64);
        let copies: Vec<String> = angles.map(|a| format!("c.rotate({a}deg, Y)")).collect();
        let listed = right(&format!("let c = {child};\nunion([{}])", copies.join(", ")));
        demand(&folded, &listed, 3.0, seed, false);
        Verdict::Accepted
    };
    run("rings of cut solids", count(10, 200), |seed| seed, check);
}

/// Of children whose values are no distances, the sides are those of the union.
#[test]
fn repetitions_of_any_shape_are_where_their_copies_are() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let child = solid(&mut r, 2);
        let spacing = [0; 3].map(|_| length(&mut r, 1.0, 3.0));
        let counts = [0; 3].map(|_| 1 + r.below(3));
        let text = format!("({child}).repeat({spacing:?}, count: {counts:?})");
        let Some(folded) = subject_of(&text) else {
            return Verdict::Refused;
        };
        let Some(listed) = subject_of(&grid(&child, spacing, counts.map(around_zero))) else {
            return Verdict::Refused;
        };
        demand(&folded, &listed, 4.0, seed, false);
        Verdict::Accepted
    };
    run(
        "repetitions of any shape",
        count(10, 200),
        |seed| seed,
        check,
    );
}

/// A mirror shows what lies on the positive side of its plane, and its image.
#[test]
fn mirrors_are_what_they_show_on_both_sides() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let child = child(&mut r);
        let at = length(&mut r, -0.5, 0.5);
        let normal = r.pick(&["[1, 0, 0]", "[0, 0, 1]", "[1, 2, 2]", "[-3, 0, 4]"]);
        let Some(folded) = subject_of(&format!("({child}).mirror({normal}, at: {at})")) else {
            return Verdict::Refused;
        };
        let listed = right(&format!(
            "let c = ({child}) - plane({normal}, at: {at});\nc | c.reflect({normal}, at: {at})"
        ));
        demand(&folded, &listed, 3.0, seed, false);
        Verdict::Accepted
    };
    run("mirrors", count(10, 200), |seed| seed, check);
}
