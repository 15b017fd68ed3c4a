//! Facts that the rows of shapes state for the compiler, each by samples of the shape.

use crate::fixture::{Case, Point, Random, add, cases, distance, is_shape, sub};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::{OpFacts, Output};
use sdfc_vm::table::{Op, ROWS};

/// Maximum difference of values at two points that are the same to a shape.
const TOLERANCE: f64 = 1e-6;

/// Returns random cases of all operations whose rows state a fact.
fn cases_with(fact: impl Fn(&OpFacts) -> bool) -> Vec<Case> {
    cases(31, 12, |op| fact(&op.row().facts))
}

/// Returns the message for a row that states a fact that does not hold.
fn message(case: &Case, fact: &str, p: Point) -> String {
    format!(
        "{} at {p:?}: `{fact}` does not hold; remove it from the row in vm/src/table.rs",
        case.name()
    )
}

#[test]
fn between_two_points_of_a_convex_shape_lies_the_shape() {
    for case in cases_with(|facts| facts.is_convex) {
        let mut random = Random::for_case(32, &case.name());
        let rule = case.op.row().facts.bounds;
        let bounds = rule.shape_bounds(&case.parameters());
        let bounds = bounds.unwrap_or(Bounds::ALL_SPACE);
        let inside: Vec<Point> = (0..4000)
            .map(|_| random.point_in(&bounds))
            .filter(|&p| case.at(p) < 0.0)
            .collect();
        assert!(inside.len() > 4, "{}: {} points", case.name(), inside.len());
        for pair in inside.windows(2) {
            let p = add(pair[0], sub(pair[1], pair[0]), random.unit());
            assert!(case.at(p) < TOLERANCE, "{}", message(&case, "is_convex", p));
        }
    }
}

#[test]
fn turning_about_the_axis_of_revolution_keeps_the_shape() {
    for case in cases_with(|facts| facts.axis_of_revolution.is_some()) {
        let mut random = Random::for_case(33, &case.name());
        let axis = case.op.row().facts.axis_of_revolution.unwrap_or_default();
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for _ in 0..500 {
            let p = random.point(2.5);
            let (sine, cosine) = random.range(0.0, std::f64::consts::TAU).sin_cos();
            let mut q = p;
            q[u] = p[u] * cosine - p[v] * sine;
            q[v] = p[u] * sine + p[v] * cosine;
            let (a, b) = (result(&case, p), result(&case, q));
            let is_same = distance(a, b) < TOLERANCE;
            assert!(is_same, "{}", message(&case, "axis_of_revolution", p));
        }
    }
}

/// Returns the value at a point as a vector, or the point to which a map leads.
fn result(case: &Case, p: Point) -> Point {
    match case.op.row().output {
        Output::Value => [case.at(p), 0.0, 0.0],
        Output::Point => case.map(p),
    }
}

#[test]
fn exchanging_equal_axes_keeps_the_solid() {
    for case in cases_with(|facts| facts.has_equal_axes) {
        let mut random = Random::for_case(34, &case.name());
        for _ in 0..500 {
            let p = random.point(2.5);
            let q = [p[1], p[2], p[0]];
            let difference = (case.at(p) - case.at(q)).abs();
            assert!(
                difference < TOLERANCE,
                "{}",
                message(&case, "has_equal_axes", p)
            );
        }
    }
}

/// The compiler reads the facts of shapes only, and the axis of a revolution.
#[test]
fn only_shapes_state_facts_of_shapes() {
    for row in ROWS {
        let facts = &row.facts;
        let has_facts =
            facts.is_convex || facts.axis_of_revolution.is_some() || facts.has_equal_axes;
        let may = is_shape(row.op) || row.op == Op::Revolve;
        assert!(may || !has_facts, "{} is no shape", row.name);
    }
}
