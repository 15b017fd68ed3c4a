//! Enclosures of endless solids: outside of them the field is positive, and deep in solid half spaces it is negative.

use crate::corpus::{compiled, compiled_text, name, on_large_stack, scenes};
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::passes::PassOptions;
use sdfc_trials::random::Random;
use sdfc_vm::evaluate::evaluate_f64;

/// Number of points per scene.
const POINTS: usize = 4000;
/// Folders with endless scenes.
const FOLDERS: [&str; 4] = [
    "examples",
    "tests/scenes",
    "tests/hard",
    "tests/strangers/games",
];
/// Floors and walls with blends, cuts, frames and copies.
const TEXTS: [&str; 23] = [
    "field(fn(p) => min(p.y, 10 - p.y))",
    "field(fn(p) => min(p.y + 1, length(p - [0, 0, -9]) - 1)) | plane(X, at: -7)",
    "(plane(Y, at: -1) | plane(-Y, at: -4)) - cylinder(r: 2, h: 100)",
    "field(fn(p) => p.y - 2 * fbm(p.xz * 0.2, octaves: 4)) | sphere(1)",
    "plane(Y, at: -1000) | sphere(500)",
    "plane(Y, at: -1) | sphere(0.5)",
    "plane(Y, at: -1) |[0.4] sphere(0.7)",
    "plane(Y, at: -1) |[0.4] sphere(0.7) |[0.3] box(1).translate(1, 0, 0)",
    "plane(Y, at: -1) |[fillet, 0.4] plane(X, at: -1)",
    "plane(Y, at: -1) |[chamfer, 0.3] box(1)",
    "union(plane(Y, at: -1), box(1), plane(-Y, at: -2), smooth: 0.2)",
    "(plane(Y) & plane(X)).rotate(20deg, Z).translate(0, -1, 3) | sphere(1)",
    "(plane([1, 2, 0], at: -3) - sphere(2).translate(-3, -1, 0)).scale(1.5) | torus(1, 0.2)",
    "sphere(0.3).repeat([1, 0, 1]) | plane(Y, at: -0.2)",
    "plane(Y, at: -1).displace(fn(p) => 0.1 * sin(p.x) * sin(p.z)) | box(0.5)",
    "field(fn(p) => p.y + 0.2 * sin(p.x)) | cylinder(r: 0.3, h: 4)",
    "(plane(Y, at: -0.5) | box(1)).rotate(30deg, Z).offset(0.1).scale(2) | plane(-X, at: -9)",
    "(plane(Y, at: -0.5) |[0.3] box(1)).scale([1, 2, 3]).rotate(30deg, X)",
    "(plane(Y, at: -0.5).scale([1, 2, 3]) |[0.3] plane(X, at: -3)).scale(0.5).translate(1, 2, 3)",
    "field(fn(p) => length(p.xz) - 0.5) | plane(Y, at: -1) | sphere(1).translate(2, 0, 0)",
    "field(fn(p) => length(p.xz) - 0.5) | field(fn(p) => length(p.yz) - 0.3) | plane(Y, at: -1)",
    "union([X, Y, Z].map(fn(v) => field(fn(p) => length(cross(p, v)) - 0.4))) | plane(Y, at: -2)",
    "(box(1) | plane(Y, at: -1)).offset(0.2) | plane(X, at: -4).scale([2, 1, 1])",
];

/// Returns a point at a random scale around the origin.
fn random_point(random: &mut Random) -> [f64; 3] {
    let size = 10_f64.powf(4.0 * random.unit() - 1.0);
    [0, 1, 2].map(|_| size * (2.0 * random.unit() - 1.0))
}

/// Compares an enclosure with the field, and reports whether there is one.
fn has_valid_enclosure(name: &str, compiled: &mut Compiled) -> bool {
    compiled.update(0.0);
    let module = &compiled.module;
    let Some(enclosure) = module.settings.enclosure() else {
        return false;
    };
    let mut random = Random::for_case(name);
    for number in 0..POINTS {
        let mut p = random_point(&mut random);
        if let Some([normal @ .., offset]) = enclosure.half_spaces.get(number % 8) {
            // Points beside a plane, at any height.
            let height = (0..3).map(|i| p[i] * normal[i]).sum::<f64>() + offset;
            let beside = 10_f64.powf(6.0 * random.unit() - 6.0) * (2.0 * random.unit() - 1.0);
            p = [0, 1, 2].map(|i| p[i] + (beside - height) * normal[i]);
        }
        let heights = enclosure
            .half_spaces
            .iter()
            .map(|[x, y, z, offset]| p[0] * x + p[1] * y + p[2] * z + offset);
        let heights: Vec<f64> = heights.collect();
        let is_in_box = !enclosure.bounds.is_empty() && enclosure.bounds.distance(p) <= 0.0;
        let is_outside = !is_in_box && heights.iter().all(|height| *height > 0.0);
        let value = evaluate_f64(&module.distance, p);
        // Constants of programs are rounded.
        let error = 1e-6 * p.iter().fold(1.0, |largest, v| v.abs().max(largest));
        assert!(
            !is_outside || value.is_nan() || value > -error,
            "{name}: {value} at {p:?}, outside of {enclosure:?}"
        );
        let solid = &heights[..enclosure.solid_half_spaces];
        let is_buried = solid.iter().any(|height| *height < -enclosure.solid_depth);
        assert!(
            !is_buried || value.is_nan() || value < error,
            "{name}: {value} at {p:?}, inside of {enclosure:?}"
        );
    }
    true
}

#[test]
fn endless_solids_lie_in_their_enclosures() {
    let mut found = 0;
    for path in FOLDERS.iter().flat_map(|folder| scenes(folder)) {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        found += usize::from(has_valid_enclosure(&name(&path), &mut compiled));
    }
    assert!(found > 20, "{found}");
}

#[test]
fn floors_with_blends_and_cuts_have_enclosures() {
    for text in TEXTS {
        let mut compiled = compiled_text(text, PassOptions::default());
        assert!(has_valid_enclosure(text, &mut compiled), "{text}: none");
    }
}
