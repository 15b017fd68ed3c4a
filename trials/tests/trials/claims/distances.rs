//! Exactness of all operations: values against the nearest surface point of the oracle.
//!
//! For an exact shape, the value times the gradient leads to a surface point. A bound never exceeds the
//! distance to a surface point. Operands are exact solids, according to the reference documentation.

use super::test_shape::{TestShape, parse_shape};
use crate::oracle::{Point, norm, point_along, random_direction, random_point};
use sdfc_compiler::scene::{Scene, ShapeKind};
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::{exact_shape_2d, exact_solid, length};
use sdfc_vm::row::{Category, Exactness};
use sdfc_vm::table::{Op, ROWS};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Half the side of the cube in which the surface is sampled.
const SURFACE_CUBE_HALF: f64 = 3.0;
/// Half the side of the cube from which distances are measured.
const POINT_CUBE_HALF: f64 = 1.3;
/// Longest measured distance. Farther surfaces are not sampled.
const MAX_DISTANCE: f64 = 1.5;
/// Number of surface points.
const SURFACE_POINTS: usize = 1200;
/// Number of points per shape from which distances are measured.
const POINTS_PER_SHAPE: usize = 120;
/// Error of a distance due to constants in `f32`.
const MAX_ERROR: f64 = 1e-5;
/// Largest excess of the nearest point found by search over a distance.
const MAX_SEARCH_EXCESS: f64 = 0.01;
/// Largest fraction of exact values that only a search confirms.
const MAX_SEARCHED_FRACTION: f64 = 0.25;

/// Returns an exact solid, translated and rotated.
fn random_operand(r: &mut Random) -> String {
    let offset = [0; 3].map(|_| length(r, -0.5, 0.5));
    let [x, y, z] = offset;
    let solid = exact_solid(r);
    format!(
        "{solid}.rotate({}deg, [1, {}, 2]).translate({x}, {y}, {z})",
        r.below(360),
        r.below(3)
    )
}

/// Returns an exact 2-D shape on the positive side of the y axis.
fn random_profile(r: &mut Random) -> String {
    // No 2-D shape extends farther than 1.25 from its centre.
    format!(
        "{}.translate({}, {})",
        exact_shape_2d(r),
        length(r, 1.25, 1.5),
        length(r, -0.5, 0.5)
    )
}

/// Returns a scene that applies an operation to exact operands.
fn scene_with_op(op: Op, r: &mut Random) -> Option<String> {
    let (a, b) = (random_operand(r), random_operand(r));
    let k = length(r, 0.015625, 0.375);
    let name = op.row().name;
    let operator = match name {
        _ if name.ends_with("union") => "|",
        _ if name.ends_with("intersection") => "&",
        _ => "-",
    };
    let blend = match name.split('_').next() {
        Some("smooth") => format!("[{k}]"),
        Some("round") => format!("[fillet, {k}]"),
        Some("stairs") => format!("[stairs, {k}, n: {}]", 1 + r.below(4)),
        Some(word @ ("cubic" | "circular" | "exponential" | "chamfer" | "distance")) => {
            format!("[{word}, {k}]")
        }
        _ => String::new(),
    };
    Some(match op {
        Op::Xor => format!("xor({a}, {b})"),
        Op::Morph => format!("{a}.morph({b}, {k})"),
        // Moved to the positive side of the plane, which no operand crosses then.
        Op::Mirror => format!("{a}.translate(2, 0, 0).mirror(X)"),
        Op::Repeat => format!("{a}.repeat([{}, 0, {}])", 0.5 + 4.0 * k, 1.0 + 2.0 * k),
        Op::RepeatLimited => {
            let counts = [0; 3].map(|_| 1 + r.below(3));
            format!(
                "{a}.repeat([{}, {}, 1], count: {counts:?})",
                0.5 + 4.0 * k,
                1.0 + 2.0 * k
            )
        }
        Op::Polar => format!("{a}.polar({})", 1 + r.below(7)),
        Op::PolarPlane => {
            let (x, n) = (length(r, -1.0, 1.0), 1 + r.below(7));
            format!(
                "{}.translate({x}, {k}).polar({n}).extrude(1)",
                exact_shape_2d(r)
            )
        }
        Op::Elongate => format!("{a}.elongate([{k}, 0, {}])", 2.0 * k),
        Op::Twist => format!("{a}.twist({}deg)", 1 + r.below(90)),
        Op::Bend => format!("{a}.bend({}deg)", 1 + r.below(90)),
        Op::Complement => format!("!{a}"),
        Op::Offset => format!("{a}.offset({})", length(r, -0.125, 0.375)),
        Op::Shell => format!("{a}.shell({k})"),
        Op::Extrude => format!("{}.extrude({})", exact_shape_2d(r), 4.0 * k),
        Op::RoundedExtrude => format!("{}.extrude({}, round: {k})", exact_shape_2d(r), 4.0 * k),
        Op::Revolve => format!("{}.revolve(offset: {})", random_profile(r), k),
        Op::RevolvePart => format!(
            "{}.revolve(offset: {}, angle: {}deg)",
            random_profile(r),
            k,
            1 + r.below(360)
        ),
        Op::Slice => format!("{a}.section([{k}, 1, 0], at: {}).extrude(1)", 0.5 * k),
        _ if op.row().facts.category == Category::Combine => format!("{a} {operator}{blend} {b}"),
        _ => return None,
    })
}

/// Reports whether a shape of the scene uses a row.
fn has_row(scene: &Scene, expected: Op) -> bool {
    scene.shapes.iter().any(|shape| match &shape.kind {
        ShapeKind::Combine { op, .. }
        | ShapeKind::Repeat { op, .. }
        | ShapeKind::Polar { op, .. }
        | ShapeKind::Domain { op, .. }
        | ShapeKind::Distance { op, .. } => *op == expected,
        _ => false,
    })
}

/// Returns surface points of the oracle, at which segments in the cube enter or leave the solid.
fn surface_points(tested: &TestShape, r: &mut Random) -> Vec<Point> {
    let mut points = Vec::new();
    let side = |p: Point| tested.oracle.value(p) < 0.0;
    for _ in 0..SURFACE_POINTS {
        let half = if r.chance(40) { SURFACE_CUBE_HALF } else { 1.0 };
        let (from, to) = (random_point(r, half), random_point(r, half));
        let line_point = |t: f64| [0, 1, 2].map(|i| from[i] + (to[i] - from[i]) * t);
        for step in 0..24 {
            let (mut low, mut high) = (f64::from(step) / 24.0, f64::from(step + 1) / 24.0);
            let start = side(line_point(low));
            if start == side(line_point(high)) {
                continue;
            }
            for _ in 0..45 {
                let middle = 0.5 * (low + high);
                if side(line_point(middle)) == start {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            points.push(line_point(low));
        }
        if points.len() >= SURFACE_POINTS {
            break;
        }
    }
    points
}

/// Returns an upper bound of the distance to the surface, improved by a random walk on it.
fn search_distance(tested: &TestShape, p: Point, start: Point, r: &mut Random) -> f64 {
    let side = |p: Point| tested.oracle.value(p) < 0.0;
    let distance_to = |q: Point| norm([0, 1, 2].map(|i| q[i] - p[i]));
    let start_side = side(p);
    let (mut nearest, mut best) = (start, distance_to(start));
    let mut radius = 0.3;
    for _ in 0..400 {
        let target = point_along(nearest, random_direction(r), radius);
        let delta = [0, 1, 2].map(|i| target[i] - p[i]);
        // Segment towards the target, up to the best distance.
        let length = norm(delta).max(1e-12);
        let line_point = |t: f64| point_along(p, delta.map(|v| v / length), t);
        if side(line_point(best)) == start_side {
            radius *= 0.97;
            continue;
        }
        let (mut low, mut high) = (0.0, best);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if side(line_point(middle)) == start_side {
                low = middle;
            } else {
                high = middle;
            }
        }
        nearest = line_point(high);
        best = high;
    }
    best
}

/// Reports whether the other side begins within [`MAX_ERROR`] of a point along the normal.
fn is_surface(tested: &TestShape, p: Point, normal: Point, is_inside: bool) -> bool {
    let is_other_side = |q: Point| (tested.oracle.value(q) < 0.0) != is_inside;
    let direction_sign = if is_inside { 1.0 } else { -1.0 };
    is_other_side(point_along(p, normal, direction_sign * MAX_ERROR))
}

/// Reports whether the other side begins within [`MAX_SEARCH_EXCESS`] of a point, which may be a corner.
fn is_corner(tested: &TestShape, p: Point, is_inside: bool, r: &mut Random) -> bool {
    (0..300).any(|_| {
        let mut q = point_along(
            p,
            random_direction(r),
            0.5 * MAX_SEARCH_EXCESS * r.below(100) as f64 / 100.0,
        );
        // Gradients lead into thin corners.
        for _ in 0..2 {
            let gradient = tested.oracle.gradient(q);
            let value = tested.oracle.value(q);
            let target = if is_inside { 1e-4 } else { -1e-4 };
            q = point_along(q, gradient, target - value);
        }
        let is_near = norm([0, 1, 2].map(|i| q[i] - p[i])) < MAX_SEARCH_EXCESS;
        is_near && (tested.oracle.value(q) < 0.0) != is_inside
    })
}

/// Checks the exactness that a row states. Returns the number of measured distances.
fn check_exactness(tested: &TestShape, exactness: Exactness, seed: u64) -> Result<usize, String> {
    let mut r = Random::new(seed ^ 0xd157);
    let points = surface_points(tested, &mut r);
    if points.len() < 100 {
        return Ok(0);
    }
    let (mut measured, mut searched) = (0, 0);
    for _ in 0..POINTS_PER_SHAPE {
        let mut p = random_point(&mut r, POINT_CUBE_HALF);
        if r.chance(15) {
            p[r.below(3)] = 0.0;
        }
        let slope = tested.gradient(p);
        let value = slope.value;
        if value.abs() > MAX_DISTANCE || value.abs() < 1e-3 {
            continue;
        }
        let truth = tested.oracle.value(p);
        if (truth < 0.0) != (value < 0.0) {
            return Err(format!("{value} at {p:?}, and {truth} by the oracle"));
        }
        let distance_to = |q: &Point| norm([0, 1, 2].map(|i| q[i] - p[i]));
        let nearest = points
            .iter()
            .min_by(|a, b| distance_to(a).total_cmp(&distance_to(b)));
        let nearest = *nearest.expect("there are points");
        if value.abs() > distance_to(&nearest) + MAX_ERROR {
            return Err(format!(
                "{value} at {p:?}, and {nearest:?} is {} away",
                distance_to(&nearest)
            ));
        }
        let is_exact = match exactness {
            Exactness::Exact => true,
            Exactness::ExactOutside => value > 0.0,
            Exactness::Bound | Exactness::Unknown => false,
        };
        if !is_exact {
            continue;
        }
        measured += 1;
        let foot = point_along(p, slope.gradient, -value);
        let is_inside = value < 0.0;
        if is_surface(tested, foot, slope.gradient, is_inside)
            || is_corner(tested, foot, is_inside, &mut r)
        {
            continue;
        }
        // On a ridge the gradient may lead to a point off the surface.
        searched += 1;
        let distance = search_distance(tested, p, nearest, &mut r);
        if distance > value.abs() + MAX_SEARCH_EXCESS {
            return Err(format!(
                "{value} at {p:?}, and the surface is {distance} away"
            ));
        }
    }
    if measured > 40 && f64::from(searched) > MAX_SEARCHED_FRACTION * measured as f64 {
        return Err(format!(
            "{searched} of {measured} values lead beside the surface"
        ));
    }
    Ok(measured)
}

/// Returns the rows with a promised exactness for exact operands.
fn rows_with_promises() -> Vec<Op> {
    let rows = ROWS.iter().filter(|row| {
        let facts = &row.facts;
        let is_derived = matches!(
            facts.category,
            Category::Combine | Category::Domain | Category::Distance | Category::Dimension
        );
        is_derived && facts.exactness != Exactness::Unknown
    });
    rows.map(|row| row.op).collect()
}

#[test]
fn operations_are_as_exact_as_their_rows_state() {
    let rows_with_promises = rows_with_promises();
    let measured = Mutex::new(BTreeMap::new());
    let violations = Mutex::new(BTreeMap::new());
    let check = |&seed: &u64| {
        let op = rows_with_promises[seed as usize % rows_with_promises.len()];
        let text = scene_with_op(op, &mut Random::new(seed));
        let text = text.unwrap_or_else(|| panic!("{op:?} is not tried"));
        let Some(scene) = super::test_shape::parse_scene(&text) else {
            return CheckOutcome::Refused;
        };
        let Some(tested) = parse_shape(&text) else {
            return CheckOutcome::Refused;
        };
        assert!(has_row(&scene, op), "{op:?} is not in {text}");
        match check_exactness(&tested, op.row().facts.exactness, seed) {
            Ok(count) => *measured.lock().unwrap().entry(op).or_insert(0) += count + 1,
            Err(violation) => {
                violations
                    .lock()
                    .unwrap()
                    .entry(op)
                    .or_insert(format!("{op:?}: {violation}\n{text}"));
            }
        }
        CheckOutcome::Accepted
    };
    let scenes = input_count(3 * rows_with_promises.len() as u64, 200);
    run("exactness", scenes, |seed| seed, check);
    let violations: Vec<String> = violations.into_inner().unwrap().into_values().collect();
    assert!(violations.is_empty(), "{}", violations.join("\n"));
    let measured = measured.into_inner().unwrap();
    for op in rows_with_promises {
        assert!(
            scenes < 100 || measured.contains_key(&op),
            "{op:?} is never measured"
        );
    }
}
