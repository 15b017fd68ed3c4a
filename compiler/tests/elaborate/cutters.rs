//! Cutters that end in a face of the body, or just beyond it.
//!
//! The distance at the mouth of a cut shows whether its cutter was extended. Then it is the distance to the
//! nearest wall. Else the field is about zero, with no surface there.

use crate::scene;
use sdfc_compiler::compile::{Options, compile};
use sdfc_vm::evaluate::evaluate_f64;

/// The value of a scene's program at a point.
fn value(text: &str, point: [f64; 3]) -> f64 {
    let (compiled, _) = compile(scene(text), &Options::default());
    let module = compiled.expect("it compiles").module;
    evaluate_f64(&module.distance, point)
}

/// A scene, a point, and the distance from it to the nearest wall of a cut.
type Case = (&'static str, [f64; 3], f64);

/// Cutters with free space above them.
const EXTENDED_CASES: &[Case] = &[
    // Flush, on both sides, and slightly beyond.
    (
        "box([4, 1, 4]) - cylinder(r: 0.5, h: 1)",
        [0.0, 0.5, 0.0],
        0.5,
    ),
    (
        "box([4, 1, 4]) - cylinder(r: 0.5, h: 1)",
        [0.0, -0.5, 0.0],
        0.5,
    ),
    (
        "box([4, 1, 4]) - cylinder(r: 0.5, h: 1.02)",
        [0.0, 0.51, 0.0],
        0.5,
    ),
    (
        "box([4, 1, 4]) - prism(n: 6, r: 1, h: 1)",
        [0.0, 0.5, 0.0],
        0.866_025,
    ),
    // Through a side of a regular prism, and with rounded edges.
    (
        "box([4, 1, 4]) - prism(n: 6, r: 1, h: 2).translate(0, 0, 2 - sqrt(3) / 2)",
        [0.0, 0.0, 2.0],
        0.5,
    ),
    (
        "box([4, 1, 4]) - box([1, 1, 1], round: 0.2)",
        [0.0, 0.5, 0.0],
        0.3,
    ),
    (
        "box([4, 1, 4]) - cylinder(r: 0.5, h: 1, round: 0.2)",
        [0.0, 0.5, 0.0],
        0.3,
    ),
    // Along each axis of a box, through its end and into its side.
    (
        "box([4, 1, 4]) - box([2, 1, 2]).translate(1, 0, 1)",
        [2.0, 0.0, 1.0],
        1.0,
    ),
    (
        "box([4, 1, 4]) - box([2, 1, 2]).translate(1, 0, 1)",
        [2.0, 0.5, 2.0],
        2.0,
    ),
    // Up to another cutter, wider or of the same profile.
    (
        "box([4, 1, 4]) - (cylinder(r: 0.5, h: 0.5).translate(0, -0.25, 0) | cylinder(r: 1, h: 0.5).translate(0, 0.25, 0))",
        [0.0, 0.0, 0.0],
        0.5,
    ),
    (
        "box([4, 1, 4]) - cylinder(r: 0.5, h: 0.5).translate(0, -0.25, 0) - cylinder(r: 0.5, h: 0.5).translate(0, 0.25, 0)",
        [0.0, 0.0, 0.0],
        0.5,
    ),
    // In an intersection, and past obstacles that only bounding boxes see.
    (
        "box([4, 1, 4]) - (cylinder(r: 0.5, h: 1) & box([2, 1, 2]))",
        [0.0, 0.5, 0.0],
        0.5,
    ),
    (
        "(box([4, 1, 4]) | cylinder(r: 1, h: 2)) - cylinder(r: 0.25, h: 1).translate(1.3, 0, 0).polar(8)",
        [0.919_238_8, 0.5, 0.919_238_8],
        0.25,
    ),
    // With a live height, centred or on the floor, and slightly longer.
    (
        "param h = 1 in 0.5..=2; box([4, h, 4]) - cylinder(r: 0.5, h: h)",
        [0.0, 0.5, 0.0],
        0.5,
    ),
    (
        "param h = 1 in 0.5..=2; param d = 0.5 in 0.1..=0.9; box([4, h, 4]).translate(0, h / 2, 0) - cylinder(r: 0.5, h: d).translate(0, h - d / 2, 0)",
        [0.0, 1.0, 0.0],
        0.5,
    ),
    (
        "param h = 1 in 0.5..=2; rect(4, 4).extrude(h).rotate(90deg, X) - cylinder(r: 0.5, h: h + 0.02)",
        [0.0, 0.51, 0.0],
        0.5,
    ),
    (
        "param h = 1 in 0.5..=2; (box([4, h, 4]) | box([1, h / 2, 1]).translate(2, 0, 0)) - cylinder(r: 0.25, h: h).translate(1, 0, 0).polar(4)",
        [0.0, 0.5, 1.0],
        0.25,
    ),
    // Up to the pole of a round body, whose extent is a sum of live numbers.
    (
        "param h = 1 in 0.5..=2; capsule(h: h, r: 1) - cylinder(r: 0.5, h: h + 2)",
        [0.0, 1.5, 0.0],
        0.5,
    ),
    (
        "param r = 2 in 1..=3; torus(r1: r, r2: 0.5) - box([2 * r + 1, 0.4, 0.4])",
        [2.5, 0.0, 0.0],
        0.2,
    ),
    // With a live number in a polygon, of the body or of the cutter.
    (
        "param h = 1 in 0.5..=2; polygon([[0, 0], [3, 0], [3, h], [0, h]]).revolve() - cylinder(r: 0.5, h: h).translate(0, h / 2, 0)",
        [0.0, 1.0, 0.0],
        0.5,
    ),
    (
        "param r = 3; rect(r, 1).translate(r / 2, 0.5).revolve() - cylinder(r: 0.5, h: 1).translate(0, 0.5, 0)",
        [0.0, 1.0, 0.0],
        0.5,
    ),
    (
        "param w = 4; polygon([[-w / 2, 0], [w / 2, 0], [w / 2, 1], [-w / 2, 1]]).extrude(2) - box([1, 0.5, 2]).translate(0, 0.75, 0)",
        [0.0, 1.0, 0.0],
        0.5,
    ),
    (
        "param h = 1 in 0.5..=2; box([4, h, 4]).translate(0, h / 2, 0) - polygon([[0, 0], [0.5, 0], [0.5, h], [0, h]]).revolve()",
        [0.25, 1.0, 0.0],
        0.25,
    ),
    (
        "param h = 1 in 0.5..=2; box([4, h, 2]).translate(0, h / 2, 0) - rect(1, h).translate(0, h / 2).extrude(2)",
        [0.0, 1.0, 0.0],
        0.5,
    ),
    // From 2-D shapes.
    (
        "(rect([4, 4]) - rect([1, 2]).translate(0, 1)).extrude(1)",
        [0.0, 2.0, 0.0],
        0.5,
    ),
    (
        "rect([4, 4]).extrude(1) - circle(0.5).extrude(1)",
        [0.0, 0.0, 0.5],
        0.5,
    ),
    (
        "rect([4, 4]).extrude(1) - rect([1, 2]).extrude(2).translate(0, 1, 0)",
        [0.0, 2.0, 0.0],
        0.5,
    ),
    // In frames: rotated together, rotated alone, scaled.
    (
        "(box([4, 1, 4]) - cylinder(r: 0.5, h: 1)).rotate(30deg, Z)",
        [-0.25, 0.433_013, 0.0],
        0.5,
    ),
    (
        "box([4, 1, 4]) - cylinder(r: 0.5, h: 4).rotate(90deg, X)",
        [0.0, 0.0, 2.0],
        0.5,
    ),
    (
        "box([4, 1, 4]) - cylinder(r: 1, h: 2).scale(0.5)",
        [0.0, 0.5, 0.0],
        0.5,
    ),
    // Many cutters: in a union, in copies, one after the other, with materials.
    (
        "box([4, 1, 4]) - (cylinder(r: 0.5, h: 1) | sphere(0.1).translate(1, 0, 1))",
        [0.0, 0.5, 0.0],
        0.5,
    ),
    (
        "box([9, 1, 9]) - cylinder(r: 0.5, h: 1).translate(2, 0, 0).polar(6)",
        [2.0, 0.5, 0.0],
        0.5,
    ),
    (
        "box([9, 1, 9]) - cylinder(r: 0.5, h: 1).repeat([2, 0, 2], [3, 1, 3])",
        [2.0, 0.5, 2.0],
        0.5,
    ),
    (
        "box([9, 1, 9]) - cylinder(r: 0.5, h: 1).translate(2, 0, 0).mirror(X)",
        [-2.0, 0.5, 0.0],
        0.5,
    ),
    (
        "box([4, 1, 4]) - sphere(0.1) - cylinder(r: 0.5, h: 1).color(#ff0000)",
        [0.0, 0.5, 0.0],
        0.5,
    ),
    // A hole that ends at the floor of a wider one.
    (
        "box([4, 1, 4]) - box([2, 1, 2]).translate(0, 0.5, 0) - cylinder(r: 0.5, h: 0.5).translate(0, -0.25, 0)",
        [0.0, 0.0, 0.0],
        0.5,
    ),
    // Beside a higher part, and below one with a gap.
    (
        "(box([4, 1, 4]) | box([1, 3, 1]).translate(1.5, 1, 1.5)) - cylinder(r: 0.5, h: 1)",
        [0.0, 0.5, 0.0],
        0.5,
    ),
    (
        "(box([4, 1, 4]) | box([4, 1, 4]).translate(0, 3, 0)) - cylinder(r: 0.5, h: 1)",
        [0.0, 0.5, 0.0],
        0.5,
    ),
];

/// Cutters that must not be extended; the field is zero where they end.
const UNCHANGED_CASES: &[Case] = &[
    // Blind holes, and no gap to the part above.
    (
        "box([4, 2, 4]) - cylinder(r: 0.5, h: 1)",
        [0.0, 0.5, 0.0],
        0.0,
    ),
    (
        "(box([4, 1, 4]) | box([4, 1, 4]).translate(0, 1, 0)) - cylinder(r: 0.5, h: 1)",
        [0.0, 0.5, 0.0],
        0.0,
    ),
    // Above the material that a blend adds below its operands.
    (
        "(box([4, 1, 4]) |[fillet, 0.4] cylinder(r: 0.5, h: 1)) - box([6, 2, 6]).translate(3, 0.5, 0)",
        [0.6, -0.5, 0.0],
        0.0,
    ),
    // Below a narrower cutter.
    (
        "box([4, 1, 4]) - cylinder(r: 0.5, h: 0.5).translate(0, -0.25, 0) - cylinder(r: 0.3, h: 0.5).translate(0, 0.25, 0)",
        [0.4, 0.0, 0.0],
        0.0,
    ),
    // Along copies, and with a live height.
    (
        "box([9, 1, 9]) - box([1, 1, 9]).repeat([1.5, 0, 0], [3, 1, 1])",
        [2.0, 0.0, 4.0],
        0.0,
    ),
    // Depending on another number, or on one that may be smaller.
    (
        "param h = 1 in 0.5..=2; param g = 1 in 0.5..=2; box([4, h, 4]) - cylinder(r: 0.5, h: g)",
        [0.0, 0.5, 0.0],
        0.0,
    ),
    (
        "param h = 1 in 0.5..=2; polygon([[0, 0], [3, 0], [3, h], [0, h]]).revolve() - cylinder(r: 0.5, h: 1).translate(0, 0.5, 0)",
        [0.0, 1.0, 0.0],
        0.0,
    ),
    (
        "param h = 1 in 0.5..=2; box([4, h, 4]) - cylinder(r: 0.5, h: 2 * h - 1)",
        [0.0, 0.5, 0.0],
        0.0,
    ),
];

/// Cutters whose sides enclose the body, points where such a side was, and the distance to what is left.
const ENCLOSING_CASES: &[Case] = &[
    (
        "cylinder(r: 2, h: 4) - cylinder(r: 2, h: 2).translate(0, 1, 0)",
        [2.0, 1.0, 0.0],
        1.0,
    ),
    (
        "cylinder(r: 2, h: 4) - (cylinder(r: 2.01, h: 2) - cylinder(r: 1, h: 2)).translate(0, 1, 0)",
        [2.0, 1.0, 0.0],
        1.0,
    ),
    (
        "rect(4, 3, round: 0.5).extrude(4) - rect(4, 3, round: 0.5).extrude(2).translate(0, 0, 1)",
        [2.0, 0.0, 1.0],
        1.0,
    ),
    (
        "rect(4, 3, round: 0.5).extrude(4) - (rect(4, 3, round: 0.5) - rect(2, 2)).extrude(2).translate(0, 0, 1)",
        [2.0, 0.0, 1.0],
        1.0,
    ),
    (
        "prism(6, r: 2, h: 4) - prism(6, r: 2, h: 2).translate(0, 1, 0)",
        [2.0, 1.0, 0.0],
        1.0,
    ),
    (
        "cone(r1: 3, r2: 1, h: 4) - cone(r1: 2, r2: 1, h: 2).translate(0, 1, 0)",
        [1.5, 1.0, 0.0],
        1.0,
    ),
    // Its upper face is moved, too.
    (
        "cone(r1: 3, r2: 1, h: 4) - cone(r1: 2, r2: 1, h: 2).translate(0, 1, 0)",
        [0.0, 2.0, 0.0],
        2.0,
    ),
    (
        "cylinder(r: 2, h: 4) - cylinder(r: 2, h: 2).translate(0, 1, 0)",
        [0.0, 2.0, 0.0],
        2.0,
    ),
    ("sphere(2) - sphere(2).slice(Y)", [0.0, 2.0, 0.0], 2.0),
    (
        "box([2, 4, 2]) - cylinder(r: 1.5, h: 2).translate(0, 1, 0)",
        [0.0, 1.0, 1.5],
        1.0,
    ),
    // Below a wider part that the cutter does not reach.
    (
        "(cylinder(r: 3, h: 2).translate(0, -1, 0) | cylinder(r: 2, h: 4)) - cylinder(r: 2, h: 1).translate(0, 1.5, 0)",
        [2.0, 1.5, 0.0],
        0.5,
    ),
    (
        "xor(box([4, 1, 4]), cylinder(r: 0.5, h: 1))",
        [0.0, 0.5, 0.0],
        0.5,
    ),
    // Sides that cut something: narrower, shifted, tilted, of another profile, or with a wider part between the faces.
    (
        "cylinder(r: 2, h: 4) - cylinder(r: 1.9, h: 2).translate(0, 1, 0)",
        [1.9, 1.0, 0.0],
        0.0,
    ),
    (
        "cylinder(r: 2, h: 4) - cylinder(r: 2, h: 2).translate(0.1, 1, 0)",
        [-1.9, 1.0, 0.0],
        0.0,
    ),
    (
        "box([2, 4, 2]) - cylinder(r: 1.4, h: 2).translate(0, 1, 0)",
        [
            1.4 * std::f64::consts::FRAC_1_SQRT_2,
            1.0,
            1.4 * std::f64::consts::FRAC_1_SQRT_2,
        ],
        0.0,
    ),
    (
        "rect(4, 3, round: 0.5).extrude(4) - rect(4, 3, round: 0.6).extrude(2).translate(0, 0, 1)",
        [
            2.0 - 0.6 + 0.6 * std::f64::consts::FRAC_1_SQRT_2,
            1.5 - 0.6 + 0.6 * std::f64::consts::FRAC_1_SQRT_2,
            1.0,
        ],
        0.0,
    ),
    (
        "(cylinder(r: 3, h: 2).translate(0, 1, 0) | cylinder(r: 2, h: 4)) - cylinder(r: 2, h: 2).translate(0, 1, 0)",
        [2.0, 1.0, 0.0],
        0.0,
    ),
    (
        "cone(r1: 3, r2: 1, h: 4) - cone(r1: 1.9, r2: 1, h: 2).translate(0, 1, 0)",
        [1.9, 0.0, 0.0],
        0.0,
    ),
    ("sphere(2) - sphere(1.9).slice(Y)", [0.0, 1.9, 0.0], 0.0),
    // A sheared bar, which is wider than its axes are long.
    (
        "cylinder(r: 1, h: 4).shear(xz: 0.9) - cylinder(r: 1.45, h: 2).translate(0, 1, 0)",
        [1.217639, 1.0, 0.787308],
        0.0,
    ),
];

#[test]
fn cutters_lose_sides_that_enclose_the_body() {
    check(ENCLOSING_CASES.iter());
}

#[test]
fn flat_faces_of_cutters_are_moved_out_of_the_body() {
    check(EXTENDED_CASES.iter().chain(UNCHANGED_CASES));
}

/// Compares the values of scenes at their points.
fn check<'a>(cases: impl Iterator<Item = &'a Case>) {
    for (text, point, expected) in cases {
        let distance = value(text, *point);
        assert!(
            (distance - expected).abs() < 1e-5,
            "{text}\n{distance} at {point:?}"
        );
    }
}
