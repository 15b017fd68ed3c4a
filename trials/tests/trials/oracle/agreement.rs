//! Signs of the engines' values, evaluated in `f64`, against the oracle's.

use super::{
    Point, compile_scene, elaborate_in, near_surface, oracle, random_point, read_scene,
    scene_files, unit_number,
};
use sdfc_compiler::scene::Scene;
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::oracle::Oracle;
use sdfc_trials::random::Random;
use sdfc_trials::scenes::{SceneStyle, scene as random_scene};
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::row::Category;
use sdfc_vm::table::ROWS;
use std::path::Path;

/// Largest value that counts as zero, since constants of programs are `f32`.
const MAX_ROUNDING_PER_SIZE: f64 = 1e-6;

#[test]
fn every_row_of_shapes_has_a_meaning() {
    let is_shape = |category| {
        matches!(
            category,
            Category::Shape3
                | Category::Shape2
                | Category::Combine
                | Category::Domain
                | Category::Distance
                | Category::Dimension
        )
    };
    for row in ROWS.iter().filter(|row| is_shape(row.facts.category)) {
        assert!(Oracle::supports(row.op), "{}", row.name);
    }
    let arithmetic = ROWS
        .iter()
        .filter(|row| row.facts.category == Category::Math);
    for row in arithmetic {
        assert!(!Oracle::supports(row.op), "{}", row.name);
    }
}

/// Returns messages for the generated points at which signs differ.
fn differences(
    scene: Scene,
    points: &mut dyn FnMut(&Oracle) -> Point,
    count: usize,
) -> Vec<String> {
    let oracle = oracle(&scene);
    let compiled = compile_scene(scene);
    let program = &compiled.module.distance;
    let mut messages = Vec::new();
    for _ in 0..count {
        let p = points(&oracle);
        let (truth, value) = (oracle.value(p), evaluate_f64(program, p));
        assert!(truth.is_finite() && truth.abs() < 1e8, "{truth} at {p:?}");
        let size = p.iter().fold(1.0_f64, |size, v| size.max(v.abs()));
        let is_near = truth.abs().min(value.abs()) <= MAX_ROUNDING_PER_SIZE * size;
        if (truth < 0.0) != (value < 0.0) && !is_near {
            messages.push(format!("{value} and not {truth} at {p:?}"));
        }
    }
    messages
}

/// Returns a generator of points of a cube, half of them near the surface.
fn near_or_in_cube(mut r: Random, half: f64) -> impl FnMut(&Oracle) -> Point {
    move |oracle| {
        let p = random_point(&mut r, half);
        if unit_number(&mut r) < 0.5 {
            return p;
        }
        let near = near_surface(oracle, p, half);
        let offset = random_point(&mut r, 0.01 * half);
        [0, 1, 2].map(|i| near[i] + offset[i])
    }
}

#[test]
fn values_of_all_scenes_have_the_right_sign() {
    let mut failures = Vec::new();
    for path in scene_files() {
        let (scene, name) = read_scene(&path);
        for half in [1.5, 6.0] {
            let messages = differences(
                scene.clone(),
                &mut near_or_in_cube(Random::new(5), half),
                1000,
            );
            if let Some(first) = messages.first() {
                failures.push(format!("{name}: {} points, as {first}", messages.len()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn values_of_random_scenes_have_the_right_sign() {
    let check = |seed: &u64| {
        let text = random_scene(*seed).text(SceneStyle::default());
        let scene = elaborate_in(Path::new("."), &text).0;
        let messages = differences(scene, &mut near_or_in_cube(Random::new(*seed), 3.0), 200);
        if let Some(first) = messages.first() {
            panic!("{} points, as {first}\n{text}", messages.len());
        }
        CheckOutcome::Accepted
    };
    let tally = run(
        "signs of random scenes",
        input_count(60, 100),
        |seed| seed,
        check,
    );
    assert!(tally.is_balanced(), "{tally:?}");
}

/// Shapes of all kinds, about as large as a unit.
const SHAPES: &[&str] = &[
    "box(0.8, 0.5, 0.6)",
    "box_frame([0.8, 0.9, 0.7], 0.1)",
    "capsule(from: [-0.2, -0.3, 0], to: [0.3, 0.3, 0.1], r: 0.15)",
    "torus(r1: 0.4, r2: 0.12, angle: 220deg)",
    "torus(r1: 0.3, r2: 0.1).elongate([0.5, 0.5, 0.5])",
    "cylinder(from: [-0.3, -0.2, 0], to: [0.3, 0.2, 0.1], r: 0.12)",
    "(infinite_cone(50deg) & box(1.2))",
    "cone(r1: 0.4, r2: 0.1, h: 0.7, round: 0.08)",
    "round_cone(r1: 0.1, r2: 0.4, h: 0.2)",
    "ellipsoid([0.5, 0.3, 0.4])",
    "(slab([1, -2, 0.5], 0.2) & box(0.9))",
    "prism(5, 0.4, 0.5)",
    "prism(2, 0.5, 0.4)",
    "tetrahedron(0.5)",
    "pyramid(0.8, 0.7)",
    "link(0.4, 0.2, 0.06)",
    "(gyroid(0.5, 0.06) & box(0.9))",
    "(schwarz_p(0.5, 0.06) & sphere(0.6))",
    "(diamond(0.6, 0.06) & box(0.9))",
    "rect([0.7, 0.5], round: 0.12).extrude(0.3, round: 0.05)",
    "segment([-0.3, -0.2], [0.3, 0.2], r: 0.12).extrude(0.3)",
    "ngon(5, 0.4).extrude(0.3)",
    "star(5, 0.45, 0.2).extrude(0.3, round: 0.1)",
    "polygon([[-0.4, -0.4], [0.4, 0.4], [0.4, -0.4], [-0.4, 0.4]]).extrude(0.2)",
    "polygon([[0.1, -0.3], [0.4, -0.3], [0.2, 0], [0.3, 0.4]]).revolve()",
    "rect(0.2, 0.3).revolve(offset: 0.4, angle: 250deg)",
    "box(0.8).section([1, 2, 1], at: 0.1).extrude(0.2)",
    "field(fn(p) => length(p) - 0.5 + 0.1 * sin(6 * p.x), within: 1.4)",
    "xor(sphere(0.4), box(0.7), cylinder(r: 0.2, h: 1))",
    "(sphere(0.45) |[0.1] box(0.3, 0.9, 0.3))",
    "(sphere(0.5) -[cubic, 0.05] sphere(0.4).translate(0.2, 0.1, 0))",
    "(sphere(0.5) &[circular, 0.05] sphere(0.5).translate(0.2, 0.1, 0))",
    "(sphere(0.3) |[exponential, 0.05] sphere(0.3).translate(0.4, 0.1, 0))",
    "(box(0.8) -[chamfer, 0.1] cylinder(r: 0.2, h: 2))",
    "(box(0.8, 0.2, 0.8) |[fillet, 0.1] cylinder(r: 0.2, h: 0.8))",
    "(box(0.8) &[stairs, 0.2, n: 3] cylinder(r: 0.4, h: 2))",
    "(box(0.8, 0.2, 0.8) |[distance, 0.05] sphere(0.3))",
];
/// Transforms of shapes, of all kinds.
const TRANSFORMS: &[&str] = &[
    ".scale([1.6, 0.8, 1])",
    ".shear(xy: 0.4, xz: -0.2)",
    ".reflect([1, 1, 0], at: 0.1)",
    ".mirror([1, 1, 0], at: 0.05)",
    ".translate(0.3, 0.1, 0).mirror([1, 0, 1])",
    ".repeat([1.5, 0, 1.7])",
    ".repeat([1.5, 1.6, 1.7], count: [3, 1, 2])",
    ".translate(2, 0, 0).polar(7)",
    ".elongate([0.3, 0.2, 0.2])",
    ".twist(70deg)",
    ".bend(30deg)",
    ".translate(0.7, 0.2, 0.1).twist(40deg).translate(0.1, 0, 0).bend(20deg)",
    ".offset(0.07)",
    ".offset(-0.05)",
    ".shell(0.05).offset(0.02)",
    ".displace(fn(p) => 0.05 * sin(9 * p.x) * sin(9 * p.y))",
    ".warp(fn(p) => p + 0.06 * [sin(5 * p.y), sin(5 * p.z), sin(5 * p.x)])",
    ".morph(sphere(0.4), 0.3)",
    ".slice([1, 0, 1], at: 0.05)",
    ".complement() & box(1.5)",
    ".rotate_quaternion([0.1, 0.2, 0.3, 0.9])",
    ".section(Y, at: 0.02).offset(0.05).revolve(offset: 0.3)",
    ".translate(0.1, 0, 0) |[0.1] box(2, 0.2, 2).translate(0, -0.3, 0)",
];

#[test]
fn values_of_all_changes_of_all_shapes_have_the_right_sign() {
    let mut failures = Vec::new();
    for shape in SHAPES {
        for transform in TRANSFORMS {
            let text = format!("{shape}{transform}");
            let (scene, messages) = elaborate_in(Path::new("."), &text);
            let is_cut = messages.iter().any(|message| message.contains("cut"));
            if is_cut {
                continue;
            }
            let messages = differences(scene, &mut near_or_in_cube(Random::new(6), 1.5), 100);
            if let Some(first) = messages.first() {
                failures.push(format!("{text}: {} points, as {first}", messages.len()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
