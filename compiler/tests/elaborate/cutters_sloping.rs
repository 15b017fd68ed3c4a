//! Cutters with sloping walls that end in a face of the body.
//!
//! The distance at the mouth of a cut shows whether the walls were prolonged. Sample points show whether the
//! set equals that of the body and the cutter alone.

use crate::scene;
use sdfc_compiler::compile::{Options, compile};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::program::Program;

/// Number of points at which two sets are compared.
const POINTS: u32 = 20_000;
/// Maximum value of a point that may be on either side of a surface.
const MAX_SURFACE_VALUE: f64 = 1e-6;

fn program(text: &str) -> Program {
    let (compiled, _) = compile(scene(text), &Options::default());
    compiled.expect("it compiles").module.distance
}

/// A body, a cutter, a point at the mouth of the cut, and the distance there.
type Case = (&'static str, &'static str, [f64; 3], f64);

/// Cutters that are extended.
const EXTENDED_CASES: &[Case] = &[
    // Cones that widen and narrow, flush and slightly beyond, in both directions.
    (
        "box([6, 1, 6])",
        "cone(r1: 0.5, r2: 1, h: 1)",
        [0.0, 0.5, 0.0],
        0.894_427,
    ),
    (
        "box([6, 1, 6])",
        "cone(r1: 1, r2: 0.5, h: 1)",
        [0.0, 0.5, 0.0],
        0.447_214,
    ),
    (
        "box([6, 1, 6])",
        "cone(r1: 0.5, r2: 1, h: 1.02)",
        [0.0, 0.51, 0.0],
        0.897_921,
    ),
    (
        "box([6, 1, 6])",
        "cone(r1: 1, r2: 0, h: 1).translate(0, -0.2, 0)",
        [0.0, -0.5, 0.0],
        0.565_685,
    ),
    (
        "box([6, 1, 6])",
        "cone(r1: 0.5, r2: 1, h: 1).rotate(180deg, X)",
        [0.0, -0.5, 0.0],
        0.894_427,
    ),
    (
        "box([6, 1, 6])",
        "cone(r1: 0.5, r2: 1, h: 1).translate(2, 0, 0).polar(4)",
        [0.0, 0.5, 2.0],
        0.894_427,
    ),
    // A pyramid, and a cylinder between points.
    (
        "box([6, 1, 6])",
        "pyramid(2, 1).rotate(180deg, X)",
        [0.0, 0.5, 0.0],
        std::f64::consts::FRAC_1_SQRT_2,
    ),
    (
        "box([6, 1, 6])",
        "cylinder(from: [0, -0.5, 0], to: [0, 0.5, 0], r: 0.5)",
        [0.0, 0.5, 0.0],
        0.5,
    ),
    // A countersink: a cone on a cylinder.
    (
        "box([6, 1, 6])",
        "cylinder(r: 0.5, h: 0.5).translate(0, -0.25, 0) | cone(r1: 0.5, r2: 1, h: 0.5).translate(0, 0.25, 0)",
        [0.0, 0.5, 0.0],
        std::f64::consts::FRAC_1_SQRT_2,
    ),
    (
        "box([9, 1, 9])",
        "(cylinder(r: 0.5, h: 0.5).translate(0, -0.25, 0) | cone(r1: 0.5, r2: 1, h: 0.5).translate(0, 0.25, 0)).translate(2, 0, 0).polar(6)",
        [2.0, 0.0, 0.0],
        0.5,
    ),
    // Polygons, extruded and revolved.
    (
        "box([4, 4, 2])",
        "polygon([[-0.5, 1], [0.5, 1], [1, 2], [-1, 2]]).extrude(2)",
        [0.0, 2.0, 0.0],
        0.894_427,
    ),
    (
        "box([4, 4, 2])",
        "polygon([[-1, 1], [1, 1], [0.5, 2], [-0.5, 2]]).extrude(2)",
        [0.0, 2.0, 0.0],
        0.5,
    ),
    (
        "box([4, 4, 2]).rotate(30deg, Z)",
        "polygon([[-0.5, 1], [0.5, 1], [1, 2], [-1, 2]]).extrude(2).rotate(30deg, Z)",
        [-1.0, 1.732_050_8, 0.0],
        0.894_427,
    ),
    (
        "polygon([[-2, -2], [2, -2], [2, 1], [1, 2], [-2, 2]]).extrude(2)",
        "polygon([[2, 1], [1, 2], [0, 2], [0, 1]]).extrude(2)",
        [1.5, 1.5, 0.0],
        0.5,
    ),
    (
        "box([6, 1, 6])",
        "polygon([[0, -0.5], [0.5, -0.5], [1, 0.5], [0, 0.5]]).revolve()",
        [0.0, 0.5, 0.0],
        0.894_427,
    ),
    (
        "cylinder(r: 2, h: 2)",
        "rect(1, 1).revolve(offset: 1.5)",
        [2.0, 0.0, 0.0],
        0.5,
    ),
    (
        "cylinder(r: 2, h: 2) - box([0.2, 4, 4])",
        "polygon([[1.5, -0.2], [2, -0.7], [2, 0.7], [1.5, 0.2]]).revolve()",
        [2.0, 0.0, 0.0],
        0.494_975,
    ),
    // Twisted.
    (
        "box([6, 1, 6])",
        "box([1, 1, 1]).twist(2deg)",
        [0.0, 0.5, 0.0],
        0.483_441,
    ),
];

/// Cutters that are not extended, or only as far as possible. The parts of a union within a box stay together.
const UNCHANGED_CASES: &[Case] = &[
    // A roof that the prolonged cone would cut, and one right above the mouth.
    (
        "(box([6, 1, 6]) | box([6, 1, 6]).translate(0, 1.001, 0)) & box(20)",
        "cone(r1: 0.5, r2: 1, h: 1)",
        [0.0, 0.5, 0.0],
        0.0,
    ),
    (
        "(box([6, 1, 6]) | (box([6, 2, 6]).translate(0, 1.5, 0) - cylinder(r: 1, h: 2).translate(0, 1.5, 0))) & box(20)",
        "cone(r1: 0.5, r2: 1, h: 1)",
        [0.0, 0.5, 0.0],
        0.0,
    ),
    // A blind hole, and one whose floor is another cone.
    (
        "box([6, 2, 6])",
        "cone(r1: 0.5, r2: 1, h: 1)",
        [0.0, 0.5, 0.0],
        0.0,
    ),
    (
        "box([6, 2, 6])",
        "cone(r1: 0.5, r2: 0.8, h: 1).translate(0, -0.5, 0) | cone(r1: 0.7, r2: 1.4, h: 1).translate(0, 0.5, 0)",
        [0.75, 0.0, 0.0],
        0.0,
    ),
    // Round rims.
    (
        "box([6, 1, 6])",
        "cone(r1: 0.5, r2: 1, h: 1, round: 0.2)",
        [0.0, 0.5, 0.0],
        0.0,
    ),
    // A groove below a second body, and one that would intersect itself where it cuts another body.
    (
        "(box([4, 4, 2]) | box([4, 1, 2]).translate(0, 2.501, 0)) & box(20)",
        "polygon([[-0.5, 1], [0.5, 1], [1, 2], [-1, 2]]).extrude(2)",
        [0.0, 2.0, 0.0],
        0.0,
    ),
    (
        "(box([4, 4, 2]) | box([1, 1, 2]).translate(1.75, 2.5, 0)) & box(20)",
        "polygon([[-0.5, 1.5], [0.5, 1.5], [1.25, 2], [-1.25, 2]]).extrude(2)",
        [0.0, 2.0, 0.0],
        0.0,
    ),
    (
        "box([4, 4, 2]) | box([4, 0.5, 2]).translate(0, 2.75, 0)",
        "polygon([[-1, 1], [1, 1], [1, 3], [-1.2, 3], [-1.2, 2.5], [0.8, 2.5], [0.8, 1.5], [-0.5, 1.5], [-0.5, 2], [-1, 2]]).extrude(2)",
        [-0.75, 2.0, 0.0],
        0.25,
    ),
    // A rim around the mouth.
    (
        "(box([6, 1, 6]) | (cylinder(r: 1.5, h: 1).translate(0, 1, 0) - cylinder(r: 1, h: 1).translate(0, 1, 0))) & box(20)",
        "polygon([[0, -0.5], [0.5, -0.5], [1, 0.5], [0, 0.5]]).revolve()",
        [0.0, 0.5, 0.0],
        0.0,
    ),
    // A ring in a wall that is not round.
    (
        "box([4, 2, 4])",
        "rect(1, 1).revolve(offset: 1.5)",
        [2.0, 0.0, 0.0],
        0.0,
    ),
    // Twisted, with a neighbour above.
    (
        "(box([6, 1, 6]) | box([6, 1, 6]).translate(0, 1.001, 0)) & box(20)",
        "box([1, 1, 1]).twist(2deg)",
        [0.0, 0.5, 0.0],
        0.0,
    ),
];

#[test]
fn sloping_walls_of_cutters_are_prolonged_out_of_the_body() {
    let mut wrong = Vec::new();
    for (body, cutter, point, expected) in EXTENDED_CASES.iter().chain(UNCHANGED_CASES) {
        let value = evaluate_f64(&program(&format!("({body}) - ({cutter})")), *point);
        if (value - expected).abs() > 1e-5 {
            wrong.push(format!(
                "({body}) - ({cutter})\n{value} at {point:?}, not {expected}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn prolonged_walls_leave_the_set_as_it_is() {
    for (body, cutter, ..) in EXTENDED_CASES.iter().chain(UNCHANGED_CASES) {
        let [body_alone, cutter_alone] = [body, cutter].map(|text| program(text));
        let cut = program(&format!("({body}) - ({cutter})"));
        let bounds = Bounds::centred([4.0, 4.0, 4.0]);
        for number in 0..POINTS {
            let point = bounds.quasi_random_point(number);
            let expected =
                evaluate_f64(&body_alone, point).max(-evaluate_f64(&cutter_alone, point));
            let value = evaluate_f64(&cut, point);
            assert!(
                expected.abs() < MAX_SURFACE_VALUE || value * expected > 0.0,
                "({body}) - ({cutter})\n{value} at {point:?}, not {expected}"
            );
        }
    }
}
