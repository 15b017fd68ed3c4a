//! Formulas in wide use that are wrong, or unsafe to march on. Each is written out here and shown to fail
//! at a stated place, where our operation is right.
//!
//! They are from the usual collections (I. Quilez, *Distance Functions*; hg_sdf; older texts), in the form
//! in which they are most often copied.

use crate::fixture::{Case, Point, Random, distance, dot, length, sub};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::SlopeRule;
use sdfc_vm::table::Op;

/// Returns the distance from a point inside an ellipsoid to its surface, by sampling the surface.
fn depth_of_ellipsoid(radii: Point, p: Point) -> f64 {
    let mut nearest = f64::INFINITY;
    for i in 0..400 {
        for j in 0..200 {
            let (u, v) = (f64::from(i) * 0.015_707_963, f64::from(j) * 0.015_787);
            let q = [
                radii[0] * v.sin() * u.cos(),
                radii[1] * v.cos(),
                radii[2] * v.sin() * u.sin(),
            ];
            nearest = nearest.min(distance(p, q));
        }
    }
    nearest
}

/// `k0 (k0 − 1) / k1` is several times too deep inside, which makes holes cut by it wrong, and it is 0/0 at
/// the centre.
#[test]
fn an_ellipsoid_has_no_excess_depth() {
    let radii = [1.0, 0.5, 0.25];
    let published = |p: Point| {
        let k0 = length([0, 1, 2].map(|i| p[i] / radii[i]));
        let k1 = length([0, 1, 2].map(|i| p[i] / (radii[i] * radii[i])));
        k0 * (k0 - 1.0) / k1
    };
    let ours = Case::new(Op::Ellipsoid, &radii);
    assert!(published([0.0; 3]).is_nan());
    assert_eq!(ours.at([0.0; 3]), -0.25);
    let p = [0.2, 0.0, 0.0];
    let depth = depth_of_ellipsoid(radii, p);
    assert!(-published(p) > 2.0 * depth, "{} of {depth}", published(p));
    assert!(-ours.at(p) <= depth + 1e-3, "{} of {depth}", ours.at(p));
}

/// `length(max(q, 0))` is zero everywhere inside: there are no normals there, and nothing can be cut with
/// it.
#[test]
fn a_box_has_a_depth() {
    let half = [0.5, 0.75, 1.0];
    let published = |p: Point| length([0, 1, 2].map(|i| (p[i].abs() - half[i]).max(0.0)));
    let ours = Case::new(Op::Cuboid, &half.map(|h| 2.0 * h));
    let p = [0.1, 0.2, 0.3];
    assert_eq!(published(p), 0.0);
    assert!((ours.at(p) + 0.4).abs() < 1e-12);
}

/// The segment's parameter is 0/0 where both ends coincide.
#[test]
fn a_capsule_of_one_point_is_a_sphere() {
    let end = [0.25, -0.5, 1.0];
    let published = |p: Point| {
        let (pa, ba) = (sub(p, end), sub(end, end));
        let h = (dot(pa, ba) / dot(ba, ba)).clamp(0.0, 1.0);
        length([0, 1, 2].map(|i| pa[i] - ba[i] * h)) - 0.5
    };
    let ours = Case::new(
        Op::CapsuleBetween,
        &[end[0], end[1], end[2], end[0], end[1], end[2], 0.5],
    );
    let mut random = Random::new(90);
    for _ in 0..100 {
        let p = random.point(2.0);
        assert!(published(p).is_nan());
        assert!((ours.at(p) - (distance(p, end) - 0.5)).abs() < 1e-7);
    }
}

/// The slant of a round cone is the root of a negative number if one sphere contains the other.
#[test]
fn a_round_cone_within_its_larger_sphere_is_that_sphere() {
    for (r1, r2, h) in [(1.0, 0.25, 0.5), (0.25, 1.0, 0.5), (0.75, 0.25, 0.5)] {
        let b: f64 = (r1 - r2) / h;
        if b.abs() > 1.0 {
            assert!((1.0 - b * b).sqrt().is_nan());
        }
        let ours = Case::new(Op::RoundCone, &[r1, r2, h]);
        let centre = if r1 > r2 { -h / 2.0 } else { h / 2.0 };
        let mut random = Random::new(91);
        for _ in 0..200 {
            let p = random.point(2.0);
            let expected = distance(p, [0.0, centre, 0.0]) - f64::max(r1, r2);
            assert!((ours.at(p) - expected).abs() < 1e-6, "{p:?}");
        }
    }
}

/// `tan` of half the opening has a pole at 90°, where the cone is a half space.
#[test]
fn a_cone_of_half_a_turn_is_a_half_space() {
    let tangent = (std::f64::consts::FRAC_PI_2).tan();
    assert!(tangent > 1e15);
    let ours = Case::new(Op::InfiniteCone, &[std::f64::consts::PI]);
    let mut random = Random::new(92);
    for _ in 0..200 {
        let p = random.point(2.0);
        assert!((ours.at(p) - p[1]).abs() < 1e-6, "{p:?}: {}", ours.at(p));
    }
}

/// The two bound forms `max(dot(q, side), −h − y)` of a cone and of a three-sided prism give half of the
/// distance beyond their rims; ours give the distance.
#[test]
fn cones_and_prisms_have_the_distance_beyond_their_rims() {
    // A cone of height 1 and bottom radius 1, with its tip at the origin; a point below its rim.
    let p = [1.5_f64, -1.5, 0.0];
    let side = std::f64::consts::FRAC_1_SQRT_2;
    let published = (side * p[0] + side * p[1]).max(-1.0 - p[1]);
    let ours = Case::new(Op::Cone, &[1.0, 0.0, 1.0]);
    let exact = 0.5_f64.hypot(0.5);
    assert!(published < 0.75 * exact);
    assert!((ours.at([p[0], p[1] + 0.5, p[2]]) - exact).abs() < 1e-6);

    let published = |p: Point| {
        let q = [p[0].abs(), p[1], p[2].abs()];
        (q[1].abs() - 0.5).max((q[2] * 0.866_025 + p[0] * 0.5).max(-p[0]) - 0.5)
    };
    let ours = Case::new(Op::Prism, &[3.0, 1.0, 1.0]);
    // Beyond the corner on the +x side.
    let p = [3.0, 0.0, 0.0];
    assert!((ours.at(p) - 2.0).abs() < 1e-6);
    assert!(published(p) < 0.55 * ours.at(p));
}

/// `max(−d1, d2)` subtracts the first from the second.
#[test]
fn a_difference_takes_the_second_from_the_first() {
    let case = Case::new(Op::Subtraction, &[]);
    let difference = |a: f64, b: f64| case.with([0.0; 3], [a, b, 0.0]);
    let published = |d1: f64, d2: f64| (-d1).max(d2);
    // In the first and not in the second: inside.
    let (first, second) = (-0.5, 0.25);
    assert!(published(first, second) > 0.0);
    assert_eq!(difference(first, second), -0.25);
    assert_eq!(difference(second, first), 0.5);
}

/// Copies off the centre of their cells: the point's own cell alone overestimates the distance by a factor
/// of nearly three, and is discontinuous.
#[test]
fn copies_off_the_middle_are_never_overestimated() {
    let (centre, r) = ([0.4, 0.0, 0.0], 0.05);
    let spacing = [1.0, 0.0, 0.0];
    let published = |p: Point| {
        let x = p[0] - (p[0] + 0.5).floor();
        distance([x, p[1], p[2]], centre) - r
    };
    let own = Case::new(Op::Repeat, &spacing);
    let neighbour = Case::new(Op::RepeatNeighbour, &[spacing, [1.0, 0.0, 0.0]].concat());
    let mut worst = 0.0_f64;
    let mut random = Random::new(93);
    for _ in 0..2000 {
        let p = random.point(3.0);
        let copies = (-5..=5).map(|i| {
            let x = centre[0] + f64::from(i);
            distance(p, [x, centre[1], centre[2]]) - r
        });
        let nearest = copies.fold(f64::INFINITY, f64::min);
        if nearest > 0.0 {
            worst = worst.max(published(p) / nearest);
        }
        let d = [&own, &neighbour].map(|copy| distance(copy.map(p), centre) - r);
        let d = d[0].min(d[1]);
        assert!((d - nearest).abs() <= 1e-9, "{p:?}: {d} of {nearest}");
    }
    assert!(worst > 2.0, "{worst}");
    let jump = published([0.5 - 1e-9, 0.0, 0.0]) - published([0.5 + 1e-9, 0.0, 0.0]);
    assert!(jump.abs() > 0.5, "{jump}");
}

/// In the shading language, the remainder has the sign of the dividend, so cells left of the origin are
/// shifted.
#[test]
fn cells_left_of_the_origin_are_like_all_others() {
    let published = |x: f64| (x + 0.5) % 1.0 - 0.5;
    assert!((published(-1.3) - -0.3).abs() > 0.5);
    let own = Case::new(Op::Repeat, &[1.0, 0.0, 0.0]);
    for i in -5..=5 {
        let x = own.map([f64::from(i) + 0.2, 0.0, 0.0])[0];
        assert!((x - 0.2).abs() < 1e-12, "{i}: {x}");
    }
    let modulo = Case::new(Op::Modulo, &[]);
    assert_eq!(modulo.with([0.0; 3], [-1.0, 3.0, 0.0]), 2.0);
}

/// A twist and a bend stretch space: distances are too large unless they are divided. The stretch of a
/// twist is not √(1 + k²r²) either, as is often stated.
#[test]
fn a_twist_and_a_bend_bound_their_stretch() {
    let twist = Case::new(Op::Twist, &[1.0]);
    let SlopeRule::PointMap(stretch) = Op::Twist.row().facts.slope else {
        panic!("a twist stretches");
    };
    // A radius of one in all directions.
    let side = std::f64::consts::FRAC_1_SQRT_2;
    let region = Bounds::centred([side, 1.0, side]);
    let bound = stretch(&twist.parameters(), &region);
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    assert!((bound - golden).abs() < 1e-9, "{bound}");
    // The bound is attained at the rim.
    let p = [1.0, 0.0, 0.0];
    let mut largest = 0.0_f64;
    for i in 0..400 {
        let angle = f64::from(i) * 0.007_85;
        let step = [0.0, angle.cos() * 1e-6, angle.sin() * 1e-6];
        let q = [0, 1, 2].map(|axis| p[axis] + step[axis]);
        largest = largest.max(distance(twist.map(p), twist.map(q)) / 1e-6);
    }
    assert!(
        largest > std::f64::consts::SQRT_2 + 0.1 && largest <= golden + 1e-6,
        "{largest}"
    );
    let SlopeRule::PointMap(stretch) = Op::Bend.row().facts.slope else {
        panic!("a bend stretches");
    };
    let bend = Case::new(Op::Bend, &[1.0]);
    assert!(stretch(&bend.parameters(), &Bounds::centred([1.0, 0.5, 1.0])) >= 1.5);
}

/// `h / k` is 0/0 for zero thickness. The exponential form overflows where 2^(−d/k) vanishes. The form with
/// `mix` loses the digits that a sentinel of 1e9 rounds away. A blend of a shape with itself is not that
/// shape.
#[test]
fn blends_keep_their_digits() {
    let single = |op: Op, k: f64, a: f32, b: f32| {
        let case = Case::new(op, &[k]);
        let value = sdfc_vm::apply::apply::<f32>(
            op,
            sdfc_vm::vector::V3::new(0.0, 0.0, 0.0),
            [a, b, 0.0],
            &case.constants,
        );
        match value {
            sdfc_vm::apply::OpResult::Value(v) => v,
            sdfc_vm::apply::OpResult::Point(_) => panic!("a blend gives a value"),
        }
    };
    let unions = [
        Op::SmoothUnion,
        Op::CubicUnion,
        Op::CircularUnion,
        Op::ExponentialUnion,
    ];
    for op in unions {
        // Zero thickness and equal operands.
        assert_eq!(single(op, 0.0, 0.5, 0.5), 0.5, "{op:?}");
        // Far from both.
        let far = single(op, 0.01, 40.0, 41.0);
        assert!((far - 40.0).abs() < 1e-3, "{op:?}: {far}");
        // Next to a sentinel for the empty shape.
        assert_eq!(single(op, 0.25, 1e9, 0.125), 0.125, "{op:?}");
        // A shape with itself.
        let same = single(op, 0.25, 0.125, 0.125);
        assert!((same - (0.125 - 0.25)).abs() < 1e-6, "{op:?}: {same}");
    }
    let published = |a: f32, b: f32, k: f32| -((-a / k).exp2() + (-b / k).exp2()).log2() * k;
    assert!(published(40.0, 41.0, 0.01).is_infinite());
    let mixed = |a: f32, b: f32, h: f32| b + (a - b) * h;
    assert_ne!(mixed(0.125, 1e9, 1.0), 0.125);
}

/// The slope of the rounded union of hg_sdf exceeds one, as its row states.
#[test]
fn a_rounded_union_states_its_larger_slope() {
    assert!(matches!(Op::RoundUnion.row().facts.slope, SlopeRule::Norm));
    // Two operands that increase together, as those of two planes at a small angle.
    let case = Case::new(Op::RoundUnion, &[0.5]);
    let at = |d: f64| case.with([0.0; 3], [d, d, 0.0]);
    let slope = (at(0.21) - at(0.2)) / 0.01;
    assert!(slope > 1.3, "{slope}");
}

/// A frame whose bars are thicker than the box, a rounding larger than it, a torus thicker than wide: valid
/// shapes, not inside-out ones.
#[test]
fn oversized_arguments_are_clamped() {
    let frame = Case::new(Op::BoxFrame, &[1.0, 1.0, 1.0, 9.0]);
    let cube = Case::new(Op::Cuboid, &[1.0, 1.0, 1.0]);
    let rounded = Case::new(Op::RoundedCuboid, &[1.0, 2.0, 3.0, 9.0]);
    let fitting = Case::new(Op::RoundedCuboid, &[1.0, 2.0, 3.0, 0.5]);
    let torus = Case::new(Op::Torus, &[0.25, 0.5]);
    let mut random = Random::new(94);
    for _ in 0..500 {
        let p = random.point(2.0);
        if cube.at(p) > 0.0 {
            assert!((frame.at(p) - cube.at(p)).abs() < 1e-6, "{p:?}");
        }
        assert_eq!(rounded.at(p), fitting.at(p));
        let ring = (p[0].hypot(p[2]) - 0.25).hypot(p[1]) - 0.5;
        assert!((torus.at(p) - ring).abs() < 1e-6, "{p:?}");
    }
}

/// By the short form, an elongated shape is flat in its gap, and has no normals there. The correction is
/// the depth.
#[test]
fn an_elongated_shape_has_a_depth_in_its_gap() {
    let elongate = Case::new(Op::Elongate, &[1.0, 0.0, 0.0]);
    let correct = Case::new(Op::ElongateCorrect, &[1.0, 0.0, 0.0]);
    let ball = |p: Point| length(p) - 0.5;
    let (p, q) = ([0.1, 0.0, 0.0], [0.3, 0.0, 0.0]);
    assert_eq!(ball(elongate.map(p)), ball(elongate.map(q)));
    let at = |p: Point| correct.with(p, [ball(elongate.map(p)), 0.0, 0.0]);
    assert!(at(p) <= at(q) && at(p) < 0.0, "{} {}", at(p), at(q));
}
