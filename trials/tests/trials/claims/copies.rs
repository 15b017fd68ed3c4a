//! Repetitions against the explicit union of their copies.

use super::test_shape::{TestShape, parse_shape, valid_shape};
use super::{MAX_ROUNDING_PER_SIZE, size_at};
use crate::oracle::{Point, random_point};
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::{exact_shape_2d, exact_solid, length, solid};
use std::fmt::Write;

/// Number of points at which both are compared.
const POINTS_PER_PAIR: usize = 150;
/// Number of copies per side that replace an infinite row.
const COPIES_PER_SIDE: i32 = 5;

/// Returns an exact solid or a union of two. It may be off-centre in its cell, cross its walls, or touch
/// them.
fn random_child(r: &mut Random) -> String {
    random_child_with(r, &["|"])
}

/// Returns an exact solid, or two combined by one of these operators.
fn random_child_with(r: &mut Random, operators: &[&str]) -> String {
    let mut text = exact_solid(r);
    if r.chance(40) {
        let offset = [0; 3].map(|_| length(r, -0.75, 0.75));
        let other = exact_solid(r);
        let _ = write!(
            text,
            ".translate({}, {}, {})",
            offset[0], offset[1], offset[2]
        );
        text = format!("({text} {} {other})", r.pick(operators));
    }
    if r.chance(60) {
        let offset = [0; 3].map(|_| length(r, -0.5, 0.5));
        let _ = write!(
            text,
            ".translate({}, {}, {})",
            offset[0], offset[1], offset[2]
        );
    }
    if r.chance(50) {
        let _ = write!(text, ".rotate({}deg, [1, {}, 2])", r.below(360), r.below(5));
    }
    text
}

/// Asserts equal values of a repeated shape and the union of its copies, in a cube.
///
/// Without `compares_values`, only the signs must agree.
fn assert_equal_values(
    folded: &TestShape,
    listed: &TestShape,
    half: f64,
    seed: u64,
    compares_values: bool,
) {
    let mut r = Random::new(seed);
    for _ in 0..POINTS_PER_PAIR {
        let mut p = random_point(&mut r, half);
        if r.chance(10) {
            // The centre plane of a cell, or the axis of a ring.
            p[r.below(3)] = 0.0;
        }
        let value = folded.value(p);
        let slack = 4.0 * MAX_ROUNDING_PER_SIZE * size_at(p, folded.size);
        for truth in [
            listed.value(p),
            listed.oracle.value(p),
            folded.oracle.value(p),
        ] {
            let is_equal = match compares_values {
                true => (value - truth).abs() <= slack,
                false => {
                    (value < 0.0) == (truth < 0.0) || value.abs().min(truth.abs()) <= 4.0 * slack
                }
            };
            assert!(
                is_equal,
                "{value} and not {truth} at {p:?}\n{}\n{}",
                folded.name, listed.name
            );
        }
    }
}

/// Returns the text of a union of copies in a grid.
fn grid(random_child: &str, spacing: Point, counts: [Vec<f64>; 3]) -> String {
    let mut copies = Vec::new();
    for x in &counts[0] {
        for y in &counts[1] {
            for z in &counts[2] {
                let offset = [x * spacing[0], y * spacing[1], z * spacing[2]];
                copies.push(format!(
                    "c.translate({}, {}, {})",
                    offset[0], offset[1], offset[2]
                ));
            }
        }
    }
    format!("let c = {random_child};\nunion([{}])", copies.join(", "))
}

/// Returns the indices of copies along an axis, centred at zero.
fn centreed_indices(count: usize) -> Vec<f64> {
    (0..count)
        .map(|index| index as f64 - 0.5 * (count - 1) as f64)
        .collect()
}

#[test]
fn limited_repetitions_are_the_union_of_their_copies() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let random_child = random_child(&mut r);
        let spacing = [0; 3].map(|_| length(&mut r, 0.25, 2.0));
        let counts = [0; 3].map(|_| 1 + r.below(4));
        let text = format!("({random_child}).repeat({spacing:?}, count: {counts:?})");
        let Some(folded) = parse_shape(&text) else {
            return CheckOutcome::Refused;
        };
        let listed = valid_shape(&grid(&random_child, spacing, counts.map(centreed_indices)));
        assert_equal_values(&folded, &listed, 4.0, seed, true);
        CheckOutcome::Accepted
    };
    let tally = run(
        "limited repetitions",
        input_count(12, 200),
        |seed| seed,
        check,
    );
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn endless_repetitions_are_the_union_of_their_copies() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let random_child = random_child(&mut r);
        let (axis, step) = (r.below(3), length(&mut r, 0.5, 2.0));
        let mut spacing = [0.0; 3];
        spacing[axis] = step;
        let text = format!("({random_child}).repeat({spacing:?})");
        let Some(folded) = parse_shape(&text) else {
            return CheckOutcome::Refused;
        };
        let copy_range = (-COPIES_PER_SIDE..=COPIES_PER_SIDE).map(f64::from);
        let mut numbers = [0; 3].map(|_| vec![0.0]);
        numbers[axis] = copy_range.collect();
        let listed = valid_shape(&grid(&random_child, spacing, numbers));
        // A copy spans at most 4 cells, and there are 5 copies per side.
        assert_equal_values(&folded, &listed, 0.5 * step, seed, true);
        CheckOutcome::Accepted
    };
    let tally = run(
        "endless repetitions",
        input_count(10, 200),
        |seed| seed,
        check,
    );
    assert!(tally.accepted * 2 > tally.refused, "{tally:?}");
}

#[test]
fn rings_are_the_union_of_their_copies() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let is_2d = r.chance(30);
        let sectors = 1 + r.below(11);
        let offset = [length(&mut r, -1.0, 2.0), length(&mut r, -1.0, 1.0)];
        let angles = (0..sectors).map(|at| 360.0 * at as f64 / sectors as f64);
        let (text, listed) = if is_2d {
            let random_child = format!(
                "{}.translate({}, {})",
                exact_shape_2d(&mut r),
                offset[0],
                offset[1]
            );
            let copies: Vec<String> = angles.map(|a| format!("c.rotate({a}deg)")).collect();
            let listed = format!(
                "let c = {random_child};\nunion([{}]).extrude(1)",
                copies.join(", ")
            );
            (
                format!("({random_child}).polar({sectors}).extrude(1)"),
                listed,
            )
        } else {
            let random_child = format!(
                "({}).translate({}, 0, {})",
                random_child(&mut r),
                offset[0],
                offset[1]
            );
            let copies: Vec<String> = angles.map(|a| format!("c.rotate({a}deg, Y)")).collect();
            let listed = format!("let c = {random_child};\nunion([{}])", copies.join(", "));
            (format!("({random_child}).polar({sectors})"), listed)
        };
        let Some(folded) = parse_shape(&text) else {
            return CheckOutcome::Refused;
        };
        assert_equal_values(&folded, &valid_shape(&listed), 3.0, seed, true);
        CheckOutcome::Accepted
    };
    let tally = run("rings", input_count(12, 200), |seed| seed, check);
    assert!(tally.accepted > tally.refused, "{tally:?}");
}

/// Rings of cut solids cover the same points as the union of their copies, though their values may be
/// larger.
#[test]
fn rings_of_cut_solids_are_where_their_copies_are() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let sectors = 1 + r.below(11);
        let random_child = random_child_with(&mut r, &["&", "-"]);
        let random_child = format!(
            "({random_child}).translate({}, 0, 0.5)",
            length(&mut r, -1.0, 2.0)
        );
        let Some(folded) = parse_shape(&format!("({random_child}).polar({sectors})")) else {
            return CheckOutcome::Refused;
        };
        let angles = (0..sectors).map(|at| 360.0 * at as f64 / sectors as f64);
        let copies: Vec<String> = angles.map(|a| format!("c.rotate({a}deg, Y)")).collect();
        let listed = valid_shape(&format!(
            "let c = {random_child};\nunion([{}])",
            copies.join(", ")
        ));
        assert_equal_values(&folded, &listed, 3.0, seed, false);
        CheckOutcome::Accepted
    };
    run(
        "rings of cut solids",
        input_count(10, 200),
        |seed| seed,
        check,
    );
}

/// Only the signs agree for children whose values are not distances.
#[test]
fn repetitions_of_any_shape_are_where_their_copies_are() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let random_child = solid(&mut r, 2);
        let spacing = [0; 3].map(|_| length(&mut r, 1.0, 3.0));
        let counts = [0; 3].map(|_| 1 + r.below(3));
        let text = format!("({random_child}).repeat({spacing:?}, count: {counts:?})");
        let Some(folded) = parse_shape(&text) else {
            return CheckOutcome::Refused;
        };
        let Some(listed) = parse_shape(&grid(&random_child, spacing, counts.map(centreed_indices)))
        else {
            return CheckOutcome::Refused;
        };
        assert_equal_values(&folded, &listed, 4.0, seed, false);
        CheckOutcome::Accepted
    };
    run(
        "repetitions of any shape",
        input_count(10, 200),
        |seed| seed,
        check,
    );
}

/// A mirror keeps the positive side of its plane, and adds its image.
#[test]
fn mirrors_are_what_they_show_on_both_sides() {
    let check = |&seed: &u64| {
        let mut r = Random::new(seed);
        let random_child = random_child(&mut r);
        let offset = length(&mut r, -0.5, 0.5);
        let normal = r.pick(&["[1, 0, 0]", "[0, 0, 1]", "[1, 2, 2]", "[-3, 0, 4]"]);
        let Some(folded) = parse_shape(&format!("({random_child}).mirror({normal}, at: {offset})"))
        else {
            return CheckOutcome::Refused;
        };
        let listed = valid_shape(&format!(
            "let c = ({random_child}) - plane({normal}, at: {offset});\nc | c.reflect({normal}, at: {offset})"
        ));
        assert_equal_values(&folded, &listed, 3.0, seed, false);
        CheckOutcome::Accepted
    };
    run("mirrors", input_count(10, 200), |seed| seed, check);
}
