//! How steep fields are said to be, against what is known of them.

use crate::scene;
use sdfc_compiler::compile::{Options, compile};
use sdfc_vm::program::Code;
use sdfc_vm::table::Op;

/// A field in a text, how steep it is at its steepest, and how many times as steep it may be said to be.
const FIELDS: &[(&str, f64, f64)] = &[
    ("field(fn(p) => p.x, within: 2)", 1.0, 1.001),
    // Along one axis alone: the others are not searched.
    // Within the box and a margin of a tenth of its half diagonal.
    ("field(fn(p) => exp(p.x) - 1, within: 4)", 1.35, 1.11),
    ("field(fn(p) => p.x * p.x - p.y, within: 2)", 2.5079, 1.11),
    // Many periods: one is searched.
    (
        "field(fn(p) => 0.1 * sin(20 * p.x) * sin(20 * p.y) * sin(20 * p.z), within: 8)",
        2.0,
        1.11,
    ),
    (
        "field(fn(p) => p.y - 0.3 * sin(2 * p.x) * cos(3 * p.z), within: 2000)",
        1.3454,
        1.11,
    ),
    (
        "field(fn(p) => sin(8 * p.x) + cos(12 * p.x), within: 100)",
        20.0,
        1.11,
    ),
    // Two that repeat, but never together.
    (
        "field(fn(p) => sin(p.x) + sin(1.41421356 * p.x), within: 20)",
        2.41421,
        1.11,
    ),
    // One number of a range, and not two: the range is searched, too.
    (
        "param r = 1 in 0.2..=3;\nfield(fn(p) => r * sin(p.x / r), within: 2)",
        1.0,
        1.3,
    ),
    (
        "param a = 0.5 in 0..=2;\nfield(fn(p) => a * sin(9 * p.x) * sin(9 * p.y), within: 4)",
        18.0,
        1.11,
    ),
    // At the origin a direction may be any, but is no longer than 1.
    ("field(fn(p) => length(p) - 1, within: 3)", 1.0, 1.001),
    (
        "field(fn(p) => sqrt(p.x * p.x + p.z * p.z) - 1, within: 3)",
        1.0,
        1.001,
    ),
    // A torus: the parts of the vector change along different axes.
    (
        "field(fn(p) => length(vec2(length(p.xz) - 1, p.y)) - 0.3, within: 4)",
        1.0,
        1.001,
    ),
    // Here they change together.
    (
        "field(fn(p) => length(vec2(p.x + p.y, p.x + p.y)) - 1, within: 4)",
        2.0,
        1.001,
    ),
    // Of what is compared, one counts.
    (
        "field(fn(p) => max(max(abs(p.x), abs(p.y)), abs(p.z)) - 1, within: 4)",
        1.0,
        1.001,
    ),
    // Elsewhere than where it is seen. A warp is taken to stretch by the root of three where it only shifts.
    (
        "field(fn(p) => 5 * (exp(p.x) - 1), within: 4).warp(fn(p) => [p.x + 9, p.y, p.z])",
        6.75,
        1.75,
    ),
    // Soft minima by hand are means of their operands, however many orders of magnitude exponentials cover.
    (
        "field(fn(p) => -ln(exp(-8 * (length(p) - 0.5)) + exp(-8 * (p.y + 0.9))) / 8, within: 20)",
        1.0,
        1.001,
    ),
    (
        "field(fn(p) => -log2(exp2(-32 * (p.x - 3)) + exp2(-32 * p.y) + exp2(-32 * (length(p) - 2))) / 32, \
         within: 200)",
        1.0,
        1.001,
    ),
    (
        "field(fn(p) => ln(pow(9, length(p) - 2) * 3 + cosh(p.y)) / 2.1972246 - 3, within: 60)",
        1.0,
        1.001,
    ),
    // A share of two positive numbers lies between 0 and 1; its weights are no steeper than a quarter.
    (
        "field(fn(p) => p.y + exp(-p.x) / (exp(-p.x) + exp(p.x)) - 0.5, within: 40)",
        1.118,
        1.11,
    ),
    // The weight of a blend changes only where the numbers are near each other, and its bulge makes up for it.
    (
        "fn smin(a: float, b: float, k: float) -> float {
            let h = clamp(0.5 + 0.5 * (b - a) / k, 0, 1);
            mix(b, a, h) - k * h * (1 - h)
        }
        field(fn(p) => smin(length(p) - 1, p.y, 0.02), within: 500)",
        1.0,
        1.001,
    ),
    (
        "fn smax(a: float, b: float, k: float) -> float {
            let h = clamp((a - b) / k * 0.5 + 0.5, 0, 1);
            b * (1 - h) + h * a + h * k * (1 - h)
        }
        field(fn(p) => smax(length(p) - 1, p.y, 0.02), within: 500)",
        1.0,
        1.001,
    ),
    (
        "fn smin(a: float, b: float, k: float) -> float {
            let h = clamp(0.5 + 0.5 * (b - a) / k, 0, 1);
            b + (a - b) * h
        }
        field(fn(p) => smin(length(p) - 1, p.y, 0.02), within: 500)",
        2.0,
        1.11,
    ),
    (
        "field(fn(p) => mix(p.x, p.y, smoothstep(-0.1, 0.1, p.x - p.y)), within: 500)",
        1.198,
        1.75,
    ),
    // What is known of noise anywhere; no cell is said to be steeper.
    ("field(fn(p) => 0.2 * noise(3 * p), within: 2)", 1.0, 2.7852),
];

#[test]
fn slopes_are_bounded_closely() {
    for &(text, steepest, times) in FIELDS {
        let (compiled, found) = compile(scene(text), &Options::default());
        let compiled = compiled.unwrap_or_else(|| panic!("{text}: {found:?}"));
        let mut module = compiled.module;
        module.update(0.0);
        let program = &module.distance;
        let mut code = program.code.iter();
        let divided = code.find(|i| i.code == Code::Op(Op::FieldDistance));
        // What is as steep as a distance is not divided.
        let slope = divided.map_or(1.0, |i| {
            1.0 / f64::from(program.pool[i.parameters as usize][0])
        });
        // Steepest at a place that no box is centred at.
        let least = steepest * 0.999;
        assert!(
            least <= slope && slope <= steepest * times,
            "{text}: at most {slope}, and it is {steepest}"
        );
    }
}
