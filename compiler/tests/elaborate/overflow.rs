//! Fields that exceed `f32` on their way: where a real number is large, they are outside.

use crate::scene;
use sdfc_compiler::compile::{Options, compile};
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::vector::V3;

/// Shapes that are a disc of radius 0.8, or what is left of another shape by it.
///
/// `disc` stands for a field: `z` is a power of the point's place in the disc, and infinite far from it.
const SHAPES: &[(&str, bool)] = &[
    (
        "field(fn(p) => { disc max(dot(z, z) - 1, abs(p.z) - 0.3) })",
        true,
    ),
    (
        "field(fn(p) => { disc max(abs(p.z) - 0.3, dot(z, z) - 1) })",
        true,
    ),
    (
        "field(fn(p) => { disc max(clamp(dot(z, z) - 1, -1, 1), abs(p.z) - 0.3) })",
        true,
    ),
    (
        "field(fn(p) => { disc min(max(dot(z, z) - 1, abs(p.z) - 0.3), length(p) - 0.1) })",
        true,
    ),
    (
        "field(fn(p) => { disc dot(z, z) - 1 }) & box(500, 500, 0.6)",
        true,
    ),
    (
        "!(!field(fn(p) => { disc dot(z, z) - 1 })) & box(500, 500, 0.6)",
        true,
    ),
    (
        "box(500, 500, 0.6) - field(fn(p) => { disc dot(z, z) - 1 })",
        false,
    ),
    (
        "box(1.6, 1.6, 0.6).warp(fn(p) => { disc vec3(z.x, z.y, p.z) })",
        true,
    ),
    (
        "box(500, 500, 0.6).displace(fn(p) => { disc -dot(z, z) }) & box(500, 500, 0.6)",
        true,
    ),
];

#[test]
fn fields_are_outside_where_they_exceed_floats() {
    let disc =
        "let z = fold(list(0..7), p.xy / 0.8, fn(z, i) => vec2(z.x*z.x - z.y*z.y, 2*z.x*z.y));";
    for (text, is_disc) in SHAPES {
        let (compiled, diagnostics) =
            compile(scene(&text.replace("disc", disc)), &Options::default());
        let module = compiled.unwrap_or_else(|| panic!("{text}: {diagnostics:?}"));
        for (x, y, is_in_disc) in [
            (0.0, 0.3, true),
            (0.5, 0.5, true),
            (0.9, 0.0, false),
            (2.0, 1.0, false),
            (-60.0, 100.0, false),
        ] {
            let value = evaluate::<f32>(&module.module.distance, V3::new(x, y, 0.1));
            assert_eq!(
                value < 0.0,
                is_in_disc == *is_disc,
                "{text} at {x}, {y}: {value}"
            );
        }
    }
}
