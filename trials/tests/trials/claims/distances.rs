//! Exactness of all operations: their values against the nearest point of the surface that the oracle tells.
//!
//! An exact shape has a surface point where the value and its gradient lead to. A bound exceeds the
//! way to no surface point. Operands are exact solids, as the reference says.

use super::subject::{Subject, subject_of};
use crate::oracle::{Point, beyond, direction, norm, point};
use sdfc_compiler::scene::{Scene, ShapeKind};
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::random::Random;
use sdfc_trials::shapes::{exact_figure, exact_solid, length};
use sdfc_vm::row::{Category, Exactness};
use sdfc_vm::table::{Op, ROWS};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Half the side of the cube in which the surface is looked for.
const SURFACE_CUBE_HALF: f64 = 3.0;
/// Half the side of the cube from which distances are measured.
const POINT_CUBE_HALF: f64 = 1.3;
/// The longest distance that is measured: the surface is not known farther out.
const MAX_DISTANCE: f64 = 1.5;
/// The number of points of the surface.
const SURFACE_POINTS: usize = 1200;
/// The number of points from which distances are measured.
const POINTS_PER_SHAPE: usize = 120;
/// The error of a distance that constants in `f32` explain.
const MAX_ERROR: f64 = 1e-5;
/// The excess of the nearest point that is found by search over a distance.
const MAX_SEARCH_EXCESS: f64 = 0.01;
/// The share of exact values that only a search confirms.
const MAX_SEARCHED_SHARE: f64 = 0.25;

/// An exact solid, moved and turned.
fn operand(r: &mut Random) -> String {
    let by = [0; 3].map(|_| length(r, -0.5, 0.5));
    let [x, y, z] = by;
    let solid = exact_solid(r);
    format!(
        "{solid}.rotate({}deg, [1, {}, 2]).translate({x}, {y}, {z})",
        r.below(360),
        r.below(3)
    )
}

/// An exact figure to the right of the y axis.
fn profile(r: &mut Random) -> String {
    // No figure reaches farther than 1.25 from its centre.
    format!(
        "{}.translate({}, {})",
        exact_figure(r),
        length(r, 1.25, 1.5),
        length(r, -0.5, 0.5)
    )
}

/// A scene that consists of an operation on exact operands.
fn scene_of(op: Op, r: &mut Random) -> Option<String> {
    let (a, b) = (operand(r), operand(r));
    let k = length(r, 0.015625, 0.375);
    let name = op.row().name;
    let set = match name {
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
        // To the positive side of the plane, which no operand reaches across.
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
                exact_figure(r)
            )
        }
        Op::Elongate => format!("{a}.elongate([{k}, 0, {}])", 2.0 * k),
        Op::Twist => format!("{a}.twist({}deg)", 1 + r.below(90)),
        Op::Bend => format!("{a}.bend({}deg)", 1 + r.below(90)),
        Op::Complement => format!("!{a}"),
        Op::Offset => format!("{a}.offset({})", length(r, -0.125, 0.375)),
        Op::Shell => format!("{a}.shell({k})"),
        Op::Extrude => format!("{}.extrude({})", exact_figure(r), 4.0 * k),
        Op::RoundedExtrude => format!("{}.extrude({}, round: {k})", exact_figure(r), 4.0 * k),
        Op::Revolve => format!("{}.revolve(offset: {})", profile(r), k),
        Op::RevolvePart => format!(
            "{}.revolve(offset: {}, angle: {}deg)",
            profile(r),
            k,
            1 + r.below(360)
        ),
        Op::Slice => format!("{a}.section([{k}, 1, 0], at: {}).extrude(1)", 0.5 * k),
        _ if op.row().meta.category == Category::Combine => format!("{a} {set}{blend} {b}"),
        _ => return None,
    })
}

/// The rows of a scene's shapes.
fn has_row(scene: &Scene, wanted: Op) -> bool {
    scene.shapes.iter().any(|shape| match &shape.kind {
        ShapeKind::Combine { op, .. }
        | ShapeKind::Repeat { op, .. }
        | ShapeKind::Polar { op, .. }
        | ShapeKind::Domain { op, .. }
        | ShapeKind::Distance { op, .. } => *op == wanted,
        _ => false,
    })
}

/// Points of the oracle's surface, at which lines through the cube go in or out.
fn surface(subject: &Subject, r: &mut Random) -> Vec<Point> {
    let mut found = Vec::new();
    let side = |p: Point| subject.oracle.value(p) < 0.0;
    for _ in 0..SURFACE_POINTS {
        let half = if r.chance(40) { SURFACE_CUBE_HALF } else { 1.0 };
        let (from, to) = (point(r, half), point(r, half));
        let at = |t: f64| [0, 1, 2].map(|i| from[i] + (to[i] - from[i]) * t);
        for step in 0..24 {
            let (mut low, mut high) = (f64::from(step) / 24.0, f64::from(step + 1) / 24.0);
            let start = side(at(low));
            if start == side(at(high)) {
                continue;
            }
            for _ in 0..45 {
                let middle = 0.5 * (low + high);
                if side(at(middle)) == start {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            found.push(at(low));
        }
        if found.len() >= SURFACE_POINTS {
            break;
        }
    }
    found
}

/// The distance to the surface as far as a random walk on it finds a nearer point.
fn refined(subject: &Subject, p: Point, start: Point, r: &mut Random) -> f64 {
    let side = |p: Point| subject.oracle.value(p) < 0.0;
    let away = |q: Point| norm([0, 1, 2].map(|i| q[i] - p[i]));
    let own = side(p);
    let (mut nearest, mut best) = (start, away(start));
    let mut radius = 0.3;
    for _ in 0..400 {
        let target = beyond(nearest, direction(r), radius);
        let way = [0, 1, 2].map(|i| target[i] - p[i]);
        // The line to the target, as far as the best distance.
        let length = norm(way).max(1e-12);
        let at = |t: f64| beyond(p, way.map(|v| v / length), t);
        if side(at(best)) == own {
            radius *= 0.97;
            continue;
        }
        let (mut low, mut high) = (0.0, best);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if side(at(middle)) == own {
                low = middle;
            } else {
                high = middle;
            }
        }
        nearest = at(high);
        best = high;
    }
    best
}

/// Tells if the surface passes a point, which the other side begins beside.
fn is_surface(subject: &Subject, p: Point, normal: Point, is_inside: bool) -> bool {
    let is_other = |q: Point| (subject.oracle.value(q) < 0.0) != is_inside;
    let inwards = if is_inside { 1.0 } else { -1.0 };
    is_other(beyond(p, normal, inwards * MAX_ERROR))
}

/// Tells if the other side begins within [`MAX_SEARCH_EXCESS`] of a point, which may be a corner.
fn is_corner(subject: &Subject, p: Point, is_inside: bool, r: &mut Random) -> bool {
    (0..300).any(|_| {
        let mut q = beyond(
            p,
            direction(r),
            0.5 * MAX_SEARCH_EXCESS * r.below(100) as f64 / 100.0,
        );
        // Slopes lead into thin corners.
        for _ in 0..2 {
            let slope = subject.oracle.gradient(q);
            let value = subject.oracle.value(q);
            let more = if is_inside { 1e-4 } else { -1e-4 };
            q = beyond(q, slope, more - value);
        }
        let is_near = norm([0, 1, 2].map(|i| q[i] - p[i])) < MAX_SEARCH_EXCESS;
        is_near && (subject.oracle.value(q) < 0.0) != is_inside
    })
}

/// Tries the exactness that a row states; gives the number of distances that were measured.
fn demand(subject: &Subject, exactness: Exactness, seed: u64) -> Result<usize, String> {
    let mut r = Random::new(seed ^ 0xd157);
    let points = surface(subject, &mut r);
    if points.len() < 100 {
        return Ok(0);
    }
    let (mut measured, mut searched) = (0, 0);
    for _ in 0..POINTS_PER_SHAPE {
        let mut p = point(&mut r, POINT_CUBE_HALF);
        if r.chance(15) {
            p[r.below(3)] = 0.0;
        }
        let found = subject.gradient(p);
        let value = found.value;
        if value.abs() > MAX_DISTANCE || value.abs() < 1e-3 {
            continue;
        }
        let truth = subject.oracle.value(p);
        if (truth < 0.0) != (value < 0.0) {
            return Err(format!("{value} at {p:?}, and {truth} by the oracle"));
        }
        let away = |q: &Point| norm([0, 1, 2].map(|i| q[i] - p[i]));
        let nearest = points.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        let nearest = *nearest.expect("there are points");
        if value.abs() > away(&nearest) + MAX_ERROR {
            return Err(format!(
                "{value} at {p:?}, and {nearest:?} is {} away",
                away(&nearest)
            ));
        }
        let is_exact = match exactness {
            Exactness::Exact => true,
            Exactness::ExactOutside => value > 0.0,
            Exactness::Bound | Exactness::Field => false,
        };
        if !is_exact {
            continue;
        }
        measured += 1;
        let foot = beyond(p, found.gradient, -value);
        let is_inside = value < 0.0;
        if is_surface(subject, foot, found.gradient, is_inside)
            || is_corner(subject, foot, is_inside, &mut r)
        {
            continue;
        }
        // On a ridge the gradient may lead to a point beside the surface.
        searched += 1;
        let distance = refined(subject, p, nearest, &mut r);
        if distance > value.abs() + MAX_SEARCH_EXCESS {
            return Err(format!(
                "{value} at {p:?}, and the surface is {distance} away"
            ));
        }
    }
    if measured > 40 && f64::from(searched) > MAX_SEARCHED_SHARE * measured as f64 {
        return Err(format!(
            "{searched} of {measured} values lead beside the surface"
        ));
    }
    Ok(measured)
}

/// The rows that promise something of their values, given exact operands.
fn rows() -> Vec<Op> {
    let promises = ROWS.iter().filter(|row| {
        let meta = &row.meta;
        let is_change = matches!(
            meta.category,
            Category::Combine | Category::Domain | Category::Distance | Category::Dimension
        );
        is_change && meta.exactness != Exactness::Field
    });
    promises.map(|row| row.op).collect()
}

#[test]
fn operations_are_as_exact_as_their_rows_say() {
    let rows = rows();
    let measured = Mutex::new(BTreeMap::new());
    let wrong = Mutex::new(BTreeMap::new());
    let check = |&seed: &u64| {
        let op = rows[seed as usize % rows.len()];
        let text = scene_of(op, &mut Random::new(seed));
        let text = text.unwrap_or_else(|| panic!("{op:?} is not tried"));
        let Some(scene) = super::subject::scene_of(&text) else {
            return Verdict::Refused;
        };
        let Some(subject) = subject_of(&text) else {
            return Verdict::Refused;
        };
        assert!(has_row(&scene, op), "{op:?} is not in {text}");
        match demand(&subject, op.row().meta.exactness, seed) {
            Ok(count) => *measured.lock().unwrap().entry(op).or_insert(0) += count + 1,
            Err(found) => {
                wrong
                    .lock()
                    .unwrap()
                    .entry(op)
                    .or_insert(format!("{op:?}: {found}\n{text}"));
            }
        }
        Verdict::Accepted
    };
    let scenes = count(3 * rows.len() as u64, 200);
    run("exactness", scenes, |seed| seed, check);
    let wrong: Vec<String> = wrong.into_inner().unwrap().into_values().collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let measured = measured.into_inner().unwrap();
    for op in rows {
        assert!(
            scenes < 100 || measured.contains_key(&op),
            "{op:?} is never measured"
        );
    }
}
