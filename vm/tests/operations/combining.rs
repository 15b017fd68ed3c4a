//! Operations on distances against closed forms: shapes that can be constructed in two ways.

use crate::fixture::{Case, Random, add, distance, length};
use sdfc_vm::table::Op;

/// Evaluates a case for a single operand.
fn on(case: &Case, d: f64, p: [f64; 3]) -> f64 {
    case.with(p, [d, 0.0, 0.0])
}

#[test]
fn an_extruded_disc_is_a_cylinder() {
    let mut random = Random::new(30);
    let disc = Case::new(Op::Circle, &[0.5]);
    let sharp = (
        Case::new(Op::Extrude, &[1.5]),
        Case::new(Op::Cylinder, &[0.5, 1.5]),
    );
    let round = (
        Case::new(Op::RoundedExtrude, &[1.5, 0.125]),
        Case::new(Op::RoundedCylinder, &[0.5, 1.5, 0.125]),
    );
    for (extrude, cylinder) in [sharp, round] {
        for _ in 0..500 {
            let p = random.point(2.0);
            let d = on(&extrude, disc.at(p), p);
            assert!((d - cylinder.at([p[0], p[2], p[1]])).abs() < 1e-12);
        }
    }
}

#[test]
fn a_revolved_disc_is_a_torus() {
    let mut random = Random::new(31);
    let (disc, torus) = (
        Case::new(Op::Circle, &[0.25]),
        Case::new(Op::Torus, &[1.0, 0.25]),
    );
    let revolve = Case::new(Op::Revolve, &[1.0]);
    for _ in 0..500 {
        let p = random.point(2.0);
        assert!((disc.at(revolve.map(p)) - torus.at(p)).abs() < 1e-12);
    }
}

/// A partial turn. A point is inside if it is inside the full turn and within the angle. No distance exceeds
/// that to a point inside.
#[test]
fn a_partial_turn_is_a_wedge_of_the_full_turn() {
    let mut random = Random::new(32);
    let (disc, torus) = (
        Case::new(Op::Circle, &[0.25]),
        Case::new(Op::Torus, &[0.75, 0.25]),
    );
    for angle in [0.75, 2.5, 3.5, 6.0] {
        let part = Case::new(Op::RevolvePart, &[0.75, angle]);
        let close = Case::new(Op::RevolveClose, &[angle]);
        let at = |p| on(&close, disc.at(part.map(p)), p);
        let mut inside = Vec::new();
        for _ in 0..40_000 {
            let p = random.point(1.25);
            let within = p[2].atan2(p[0]).abs() < angle / 2.0 && torus.at(p) < 0.0;
            assert_eq!(at(p) < 0.0, within, "{angle} at {p:?}");
            if within {
                inside.push(p);
            }
        }
        for _ in 0..500 {
            let p = random.point(2.0);
            let nearest = inside
                .iter()
                .map(|&q| distance(p, q))
                .fold(f64::INFINITY, f64::min);
            assert!(
                at(p) <= nearest,
                "{angle} at {p:?}: {} and {nearest}",
                at(p)
            );
            let q = add(p, random.direction(), 0.5 * random.unit());
            assert!(
                (at(p) - at(q)).abs() <= distance(p, q) * (1.0 + 1e-5),
                "{angle} at {p:?}"
            );
            assert!(
                at(p) < 0.0 || at(p) >= nearest - 0.2,
                "{angle} at {p:?}: {} and {nearest}",
                at(p)
            );
        }
    }
}

#[test]
fn an_elongated_sphere_is_a_capsule_and_an_elongated_box_a_box() {
    let mut random = Random::new(33);
    let (ball, capsule) = (
        Case::new(Op::Sphere, &[0.5]),
        Case::new(Op::Capsule, &[1.5, 0.5]),
    );
    let (small, large) = (
        Case::new(Op::Cuboid, &[0.5, 1.0, 0.75]),
        Case::new(Op::Cuboid, &[1.5, 1.5, 1.75]),
    );
    for _ in 0..500 {
        let p = random.point(2.0);
        let pulled = |p, by: [f64; 3], shape: &Case| {
            let (map, correct) = (
                Case::new(Op::Elongate, &by),
                Case::new(Op::ElongateCorrect, &by),
            );
            on(&correct, shape.at(map.map(p)), p)
        };
        let both = |by, shape| pulled(p, by, shape);
        assert!((both([0.0, 1.5, 0.0], &ball) - capsule.at(p)).abs() < 1e-12);
        // Inside, the depths of the small box and of the gap add up to less than the depth of the large
        // box.
        let (d, whole) = (both([1.0, 0.5, 1.0], &small), large.at(p));
        assert!(if whole > 0.0 {
            (d - whole).abs() < 1e-12
        } else {
            whole <= d && d <= 0.0
        });
        let q = add(p, random.direction(), 0.5 * random.unit());
        let torus = Case::new(Op::Torus, &[0.5, 0.25]);
        let at = |p| pulled(p, [1.0, 0.5, 0.25], &torus);
        assert!(
            (at(p) - at(q)).abs() <= distance(p, q) * (1.0 + 1e-9),
            "at {p:?}, {q:?}"
        );
    }
}

#[test]
fn offsets_and_shells_of_a_sphere_are_spheres() {
    let mut random = Random::new(34);
    for _ in 0..200 {
        let p = random.point(2.0);
        let d = length(p) - 1.0;
        assert_eq!(on(&Case::new(Op::Offset, &[0.25]), d, p), length(p) - 1.25);
        let shell = on(&Case::new(Op::Shell, &[0.5]), d, p);
        assert_eq!(shell < 0.0, (0.75..1.25).contains(&length(p)));
        assert_eq!(on(&Case::new(Op::Complement, &[]), d, p), -d);
        assert_eq!(on(&Case::new(Op::FieldDistance, &[4.0]), d, p), d / 4.0);
    }
}

/// Two walls at right angles: the shape between them is known exactly.
#[test]
fn profiles_between_walls_have_their_defined_shapes() {
    let mut random = Random::new(35);
    let r = 0.5;
    for _ in 0..2000 {
        let p = random.point(1.0);
        let (a, b) = (p[0], p[1]);
        let at = |op, arguments: &[f64]| Case::new(op, arguments).with(p, [a, b, 0.0]);
        let hard = a <= 0.0 || b <= 0.0;
        assert_eq!(
            at(Op::ChamferUnion, &[r]) <= 0.0,
            hard || a + b <= r,
            "chamfer at {p:?}"
        );
        let filled = hard || (a < r && b < r && (r - a).hypot(r - b) >= r);
        assert_eq!(at(Op::RoundUnion, &[r]) <= 0.0, filled, "round at {p:?}");
        let step = r / 4.0;
        let below = a < r && b < r && {
            // Four stairs descend from b = r at a = 0 to a = r at b = 0, with corners on the line a + b =
            // r.
            let u = (a - b + r) / (2.0 * step);
            let near = ((u - 0.5).round() + 0.5) * 2.0 * step;
            let (x, y) = (near / 2.0, r - near / 2.0);
            a <= x && b <= y
        };
        let stairs = at(Op::StairsUnion, &[r, 4.0]);
        if (a + b - r).abs() > 2.0 * step {
            assert_eq!(stairs <= 0.0, hard || below || a + b < r, "stairs at {p:?}");
        }
        let with = |op, arguments: &[f64], a, b| Case::new(op, arguments).with(p, [a, b, 0.0]);
        for (union, intersection, subtraction, arguments) in [
            (
                Op::ChamferUnion,
                Op::ChamferIntersection,
                Op::ChamferSubtraction,
                vec![r],
            ),
            (
                Op::RoundUnion,
                Op::RoundIntersection,
                Op::RoundSubtraction,
                vec![r],
            ),
            (
                Op::StairsUnion,
                Op::StairsIntersection,
                Op::StairsSubtraction,
                vec![r, 4.0],
            ),
        ] {
            let common = with(intersection, &arguments, a, b);
            assert!((common + with(union, &arguments, -a, -b)).abs() < 1e-12);
            assert!((with(subtraction, &arguments, a, -b) - common).abs() < 1e-12);
        }
    }
}

#[test]
fn xor_and_morph_follow_their_definitions() {
    let mut random = Random::new(36);
    let xor = Case::new(Op::Xor, &[]);
    for _ in 0..200 {
        let [a, b] = [0; 2].map(|_| random.range(-1.0, 1.0));
        let d = xor.with([0.0; 3], [a, b, 0.0]);
        assert_eq!(d < 0.0, (a < 0.0) != (b < 0.0));
        assert!(d.abs() <= a.abs().min(b.abs()));
        for (t, expected) in [(-1.0, a), (0.25, a + (b - a) * 0.25), (3.0, b)] {
            let morph = Case::new(Op::Morph, &[t]).with([0.0; 3], [a, b, 0.0]);
            assert!((morph - expected).abs() < 1e-12);
        }
    }
}

/// The thickness of a distance-aware blend at its focus, between, and at its maximum.
#[test]
fn a_distance_aware_blend_grows_at_its_stated_rate() {
    let case = Case::new(Op::DistanceUnion, &[0.0, 0.0, 0.0, 0.125, 0.25, 0.5]);
    for (x, k) in [(0.0, 0.125), (1.0, 0.375), (1.5, 0.5), (9.0, 0.5)] {
        let d = case.with([x, 0.0, 0.0], [1.0, 1.0, 0.0]);
        assert!((1.0 - d - k).abs() < 1e-12, "{x}: {d}");
    }
}

/// A bound that is wrong far from its shape's box. The result never exceeds the true distance, and near the
/// box it is at least the bound.
#[test]
fn a_bounded_distance_is_safe() {
    let mut random = Random::new(37);
    let (c, r, margin) = ([0.5, 0.0, 0.25], 0.5, 0.25);
    let low = c.map(|v| v - r);
    let high = c.map(|v| v + r);
    let case = Case::new(Op::Bounded, &[low, high, [margin, 2.0, 0.0]].concat()[..8]);
    let mut near = 0;
    for _ in 0..2000 {
        let p = random.point(1.5);
        let d = distance(p, c) - r;
        let beyond = distance([0, 1, 2].map(|i| p[i].clamp(low[i], high[i])), p);
        let bound = if beyond <= margin {
            0.5 * d
        } else {
            3.0 - 4.0 * d
        };
        let safe = on(&case, bound, p);
        assert!(safe.abs() <= d.abs() + 1e-12, "at {p:?}: {safe}, {d}");
        assert!(safe >= 0.0 || d < 0.0);
        if beyond <= margin && d > 0.0 {
            near += 1;
            assert!(safe >= bound, "at {p:?}: {safe}, {d}");
        }
    }
    assert!(near > 50, "{near}");
}

/// NaN is propagated, and no minimum hides it, except where the box alone decides.
#[test]
fn steps_of_what_is_no_number_are_none() {
    let bounded = Case::new(Op::Bounded, &[-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 0.25, 4.0]);
    assert!(on(&bounded, f64::NAN, [0.5, 0.25, 0.0]).is_nan());
    assert!(on(&bounded, f64::NAN, [1.125, 0.25, 0.0]).is_nan());
    assert_eq!(on(&bounded, f64::NAN, [3.0, 0.25, 0.0]), 2.0);
    let growth = Case::new(Op::FieldGrowth, &[0.5, 1.0, 1.5, 2.0]);
    assert!(on(&growth, f64::NAN, [0.25, 0.25, 0.0]).is_nan());
    assert!(on(&growth, f64::NAN, [25.0, 0.25, 0.0]).is_nan());
    assert_eq!(on(&growth, 0.0, [0.25, 0.25, 0.0]), 0.0);
    let piecewise = |value: f64| Case::new(Op::Piecewise, &[]).with([0.0; 3], [value, 0.25, 0.0]);
    assert!(piecewise(f64::NAN).is_nan());
    assert_eq!(piecewise(-3.0), -0.25);
    assert!(on(&growth, f64::INFINITY, [25.0, 0.25, 0.0]) > 0.0);
}
