//! Warnings of seams where parts touch and inner values have a visible effect.

use crate::build;
use sdfc_compiler::compile::{Options, compile};

/// Reports whether a text results in a warning of a seam.
fn warns_of_seam(text: &str) -> bool {
    let (scene, ..) = build(text, &[], &[]);
    let scene = scene.unwrap_or_else(|| panic!("{text}: not elaborated"));
    let (compiled, diagnostics) = compile(scene, &Options::default());
    assert!(compiled.is_some(), "{text}: not compiled");
    diagnostics.iter().any(|d| d.code.as_str() == "W0405")
}

#[test]
fn visible_seams_are_reported() {
    for text in [
        // A cone on a cylinder.
        "(cylinder(r: 1, h: 1) | cone(r1: 1, r2: 0.5, h: 1).translate(0, 1, 0)).shell(0.2)",
        "(cylinder(r: 1, h: 1) | cone(r1: 1, r2: 0.5, h: 1).translate(0, 1, 0)).offset(-0.2)",
        // Parts of two colours.
        "(box(1).color(#c03020) | box(1).translate(1, 0, 0).color(#2040c0)).shell(0.2)",
        // Sectors of a full revolution.
        "polygon([[0, 0], [2, -1.154700538], [2, 1.154700538]]).polar(6).extrude(1).offset(-0.2)",
        // A fillet that cuts across a seam.
        "(box(1).color(#c03020) | box(1).translate(1, 0, 0).color(#2040c0)) \
         -[fillet, 0.2] cylinder(r: 0.3, h: 3).translate(0.5, 0, 0)",
        // Values of fields.
        "(field(fn(p) => max(abs(p.x), max(abs(p.y), abs(p.z))) - 0.5) \
         | field(fn(p) => max(abs(p.x - 1), max(abs(p.y), abs(p.z))) - 0.5)).offset(-0.2)",
    ] {
        assert!(warns_of_seam(text), "{text}");
    }
}

#[test]
fn shapes_without_visible_seams_are_not_reported() {
    for text in [
        // Flush parts are extended.
        "(box(1) | box(1).translate(1, 0, 0)).shell(0.2)",
        // Overlapping parts, and parts with a gap.
        "(sphere(1) | sphere(0.8).translate(1.2, 0, 0)).offset(-0.2)",
        "(cylinder(r: 0.3, h: 4) | box(1)).offset(-0.1)",
        "(cylinder(r: 1, h: 1) | cone(r1: 1, r2: 0.5, h: 1).translate(0, 0.5, 0)).offset(-0.2)",
        "(box(1) | box(1).translate(1.01, 0, 0)).offset(-0.2)",
        "(box(1) | box(1).translate(1.001, 0, 0)).offset(-0.2)",
        // Spheres that touch in a point, bars that touch in an edge.
        "(sphere(0.5) | sphere(0.5).translate(1, 0, 0)).shell(0.2)",
        "(box(1) | box(1).translate(1, 1, 0)).offset(-0.2)",
        // No operation with a visible effect of inner values.
        "cylinder(r: 1, h: 1) | cone(r1: 1, r2: 0.5, h: 1).translate(0, 1, 0)",
        "(cylinder(r: 1, h: 1) | cone(r1: 1, r2: 0.5, h: 1).translate(0, 1, 0)).offset(0.2)",
        // A fillet far from the seam.
        "(box(1).color(#c03020) | box(1).translate(1, 0, 0).color(#2040c0)) \
         -[fillet, 0.1] cylinder(r: 0.1, h: 3)",
        // Values that are not distances, of a single body.
        "sphere(1).scale([1, 0.5, 2]).offset(-0.2)",
        "(sphere(1) |[0.3] sphere(0.8).translate(1.2, 0, 0)).shell(0.2)",
        "field(fn(p) => dot(p, p) - 1).offset(-0.2) | box(0.1)",
        "torus(r1: 1, r2: 0.3).shell(0.1)",
        "box(1).repeat([1.5, 0, 0], count: [3, 1, 1]).offset(-0.2)",
        "rect(1, 2).translate(0.5, 0).revolve().shell(0.2)",
    ] {
        assert!(!warns_of_seam(text), "{text}");
    }
}
