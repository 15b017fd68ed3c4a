//! Slope bounds of fields, compared with their known slopes.

use crate::scene;
use sdfc_compiler::compile::{Options, compile};
use sdfc_vm::program::Opcode;
use sdfc_vm::table::Op;

/// A field as text, its maximum slope, and the maximum ratio of the slope bound to it.
const FIELDS: &[(&str, f64, f64)] = &[
    ("field(fn(p) => p.x, within: 2)", 1.0, 1.001),
    // Along one axis alone: the other axes are not searched.
    // Within the box and a margin of a tenth of its half diagonal.
    ("field(fn(p) => exp(p.x) - 1, within: 4)", 1.35, 1.11),
    ("field(fn(p) => p.x * p.x - p.y, within: 2)", 2.5079, 1.11),
    // Down to a base of zero, where the logarithm has no bound.
    (
        "field(fn(p) => pow(abs(p.x), 1.5 + p.y * p.y) - 0.2, within: 2)",
        3.925,
        1.11,
    ),
    // Many periods: one is searched.
    (
        "field(fn(p) => 0.1 * sin(20 * p.x) * sin(20 * p.y) * sin(20 * p.z), within: 8)",
        20.0,
        1.15,
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
    // Two periodic terms without a common period.
    (
        "field(fn(p) => sin(p.x) + sin(1.41421356 * p.x), within: 20)",
        2.41421,
        1.11,
    ),
    // A single number of a range, not two: the range is searched, too.
    (
        "param r = 1 in 0.2..=3;\nfield(fn(p) => r * sin(p.x / r), within: 2)",
        1.0,
        1.3,
    ),
    (
        "param a = 0.5 in 0..=2;\nfield(fn(p) => a * sin(9 * p.x) * sin(9 * p.y), within: 4)",
        9.0,
        1.11,
    ),
    // At the origin the direction is arbitrary, but its length is at most 1.
    ("field(fn(p) => length(p) - 1, within: 3)", 1.0, 1.001),
    (
        "field(fn(p) => sqrt(p.x * p.x + p.z * p.z) - 1, within: 3)",
        1.0,
        1.001,
    ),
    // A torus: the components of the vector change along different axes.
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
    // Only one operand of a comparison takes effect.
    (
        "field(fn(p) => max(max(abs(p.x), abs(p.y)), abs(p.z)) - 1, within: 4)",
        1.0,
        1.001,
    ),
    // Sampled at another place. A warp that only shifts is bounded by a stretch of √3.
    (
        "field(fn(p) => 5 * (exp(p.x) - 1), within: 4).warp(fn(p) => [p.x + 9, p.y, p.z])",
        1.35,
        1.75,
    ),
    // Handwritten soft minima are means of their operands, over any range of exponentials.
    (
        "field(fn(p) => -ln(exp(-8 * (length(p) - 0.5)) + exp(-8 * (p.y + 0.9))) / 8, within: 20)",
        8.0,
        1.001,
    ),
    (
        "field(fn(p) => -log2(exp2(-32 * (p.x - 3)) + exp2(-32 * p.y) + exp2(-32 * (length(p) - 2))) / 32, \
         within: 200)",
        32.0,
        1.001,
    ),
    (
        "field(fn(p) => ln(pow(9, length(p) - 2) * 3 + cosh(p.y)) / 2.1972246 - 3, within: 60)",
        1.0,
        1.001,
    ),
    // A fraction of two positive numbers is between 0 and 1; the slopes of its weights are at most 1/4.
    (
        "field(fn(p) => p.y + exp(-p.x) / (exp(-p.x) + exp(p.x)) - 0.5, within: 40)",
        1.118,
        1.25,
    ),
    // The weight of a blend changes only where the numbers are close to each other, and its offset
    // compensates that.
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
    // The global bound of noise; no cell has a larger one.
    ("field(fn(p) => 0.2 * noise(3 * p), within: 2)", 5.0, 2.7852),
];

/// The slope is that of the field without its factor.
#[test]
fn slopes_are_bounded_closely() {
    let mut failures = Vec::new();
    for &(text, max_slope, max_ratio) in FIELDS {
        let (compiled, diagnostics) = compile(scene(text), &Options::default());
        let compiled = compiled.unwrap_or_else(|| panic!("{text}: {diagnostics:?}"));
        let mut module = compiled.module;
        module.update(0.0);
        let program = &module.distance;
        let mut code = program.code.iter();
        let division = code.find(|i| i.code == Opcode::Op(Op::FieldDistance));
        // A field with the slope of a distance is not divided.
        let slope = division.map_or(1.0, |i| {
            1.0 / f64::from(program.pool[i.parameters as usize][0])
        });
        // The maximum slope is at a point that is not the centre of a box.
        let min_slope = max_slope * 0.999;
        if slope < min_slope || max_slope * max_ratio < slope {
            let ratio = slope / max_slope;
            failures.push(format!("{text}: {slope}, {ratio} times {max_slope}"));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Fields whose slope has no bound, because of poles away from the surface.
const POLES: &[&str] = &[
    "field(fn(p) => 2 - 1 / length(p), within: 3)",
    "field(fn(p) => 4 - 1 / dot(p, p), within: 3)",
    "field(fn(p) => ln(2 * length(p)), within: 3)",
];

/// Hills without an end, whose slopes fade far away.
const HILLS: &[&str] = &[
    "field(fn(p) => p.y - 3 * exp(-0.1 * dot(p.xz, p.xz)))",
    "field(fn(p) => p.y - 3 / (1 + 0.1 * dot(p.xz, p.xz)))",
    "field(fn(p) => p.y - 0.8 * exp(-p.x * p.x))",
    "field(fn(p) => p.z - sin(p.x) * exp(-0.01 * p.y * p.y))",
];

#[test]
fn poles_and_hills_leave_a_proven_bound() {
    for text in POLES.iter().chain(HILLS) {
        let (compiled, diagnostics) = compile(scene(text), &Options::default());
        assert!(compiled.is_some(), "{text}: {diagnostics:?}");
        assert!(diagnostics.is_empty(), "{text}: {diagnostics:?}");
    }
}
