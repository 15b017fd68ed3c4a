//! Rounding-error bounds of whole scenes. They hold at every point, they are not much larger than observed
//! errors, and no surface point exceeds the error reported by `sdfc info`.

use crate::corpus::{compiled, compiled_text, name, on_large_stack, scenes};
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::rounding::{Rounding, rounding};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_trials::random::Random;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::rounding::error_bound;
use sdfc_vm::vector::V3;

/// Returns a random point of a box, and at most 20 from each coordinate plane.
fn random_point(random: &mut Random, within: &Bounds) -> [f32; 3] {
    std::array::from_fn(|i| {
        let (low, high) = (within.min[i].max(-20.0), within.max[i].min(20.0));
        (low + (high - low) * random.unit()) as f32
    })
}

fn double(program: &Program, p: [f32; 3]) -> f64 {
    let [x, y, z] = p.map(f64::from);
    evaluate::<f64>(program, V3::new(x, y, z))
}

/// Returns the error of `f32` at a point.
fn rounding_error(program: &Program, p: [f32; 3]) -> f64 {
    let [x, y, z] = p;
    let single = evaluate::<f32>(program, V3::new(x, y, z));
    (f64::from(single) - double(program, p)).abs()
}

/// Returns the rounding report of a scene.
fn report(compiled: &mut Compiled) -> Rounding {
    let uniform_values = compiled.module.update(0.0);
    let settings = resolve(&compiled.module, &uniform_values, &Overrides::default());
    let settings = settings.expect("the scene has a picture");
    rounding(&compiled.module, &uniform_values, &settings)
}

/// Samples up to 3,000 points in and around each scene. The ratio between bound and largest observed
/// error is limited for the examples only; scenes of a single feature may be exact.
#[test]
fn no_scene_is_off_by_more_than_its_bound() {
    let mut slack = Vec::new();
    for folder in ["tests/scenes", "examples"] {
        for path in scenes(folder) {
            let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
            compiled.module.update(0.0);
            let program = &compiled.module.distance;
            let space = compiled.module.settings.clip_bounds();
            let region = space.grown(0.1 * space.half_diagonal().min(20.0));
            let mut random = Random::for_case(&name(&path));
            let points = (400_000 / program.code.len()).clamp(200, 3000);
            let (mut worst, mut max_bound, mut bounded_count) = (0.0_f64, 0.0_f64, 0);
            for _ in 0..points {
                let p = random_point(&mut random, &region);
                let error_bound =
                    error_bound(program, p.map(|v| Interval::point(v.into())), [0.0; 3]);
                let error = rounding_error(program, p);
                assert!(
                    error <= error_bound.worst_case_error(),
                    "{} at {p:?}: {error} off, by no more than {}",
                    path.display(),
                    error_bound.error
                );
                if error_bound.worst_case_error().is_finite() {
                    bounded_count += 1;
                    worst = worst.max(error);
                    max_bound = max_bound.max(error_bound.error);
                }
            }
            eprintln!(
                "{:20} {worst:.1e} seen, {max_bound:.1e} bound, {:.0} times; {bounded_count} of {points}",
                name(&path),
                max_bound / worst
            );
            assert!(
                bounded_count * 10 > points * 9,
                "{}: {bounded_count} of {points}",
                path.display()
            );
            if folder == "examples" {
                slack.push((max_bound / worst, name(&path)));
            }
        }
    }
    let loose: Vec<_> = slack.iter().filter(|(ratio, _)| *ratio > 50.0).collect();
    assert!(loose.is_empty(), "{loose:?}");
}

/// Surface points are found by bisection between points inside and outside.
#[test]
fn no_surface_is_off_by_more_than_is_reported() {
    let mut settled_count = 0;
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        let mut compiled = on_large_stack(|| compiled(path, PassOptions::default()));
        let rounding = report(&mut compiled);
        eprintln!("{:20} {rounding:?}", name(path));
        // No scene of the repository is visibly affected by rounding, and each has a visible surface.
        let visible = rounding.visible.map(|worst| worst.largest_found);
        let is_drawn = visible.is_some_and(|pixels| 0.0 < pixels && pixels < 0.5);
        assert!(is_drawn, "{}: {rounding:?}", path.display());
        let Some(within) = rounding.in_bounds else {
            continue;
        };
        settled_count += usize::from(within.is_settled());
        let program = &compiled.module.distance;
        let space = *compiled.module.settings.clip_bounds();
        let space = Bounds {
            min: [space.min[0], space.min[1], space.min[2].max(-20.0)],
            max: [space.max[0], space.max[1], space.max[2].min(20.0)],
        };
        let mut random = Random::for_case(&name(path));
        let sides: Vec<_> = (0..200)
            .map(|_| random_point(&mut random, &space))
            .map(|p| (double(program, p), p))
            .collect();
        let (inside, outside): (Vec<_>, Vec<_>) = sides.into_iter().partition(|(d, _)| *d < 0.0);
        for ((_, from), (_, to)) in inside.iter().zip(&outside) {
            let (mut a, mut b) = (*from, *to);
            for _ in 0..40 {
                let middle: [f32; 3] = std::array::from_fn(|i| (a[i] + b[i]) / 2.0);
                if double(program, middle) < 0.0 {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            let error = rounding_error(program, a);
            assert!(
                error <= within.upper_bound,
                "{} at {a:?}: {error}",
                path.display()
            );
        }
    }
    assert!(
        settled_count >= 15,
        "the search came to an end for {settled_count} scenes"
    );
}

/// Plots are true or far from the origin: a pixel by which rounding moves an edge is one that `f32` draws wrong.
#[test]
fn edges_of_plots_are_reported_as_far_as_they_move() {
    for (text, moves) in [
        (
            "field(fn(p: vec2) => sin(3 * atan2(p.y, p.x)) - length(p))",
            false,
        ),
        ("field(fn(p: vec2) => p.y - ln(p.x))", false),
        ("field(fn(p: vec2) => exp(20 * p.x) - exp(20 * p.y))", false),
        ("field(fn(p: vec2) => p.x * p.y)", false),
        // A steep and a flat part that meet.
        (
            "field(fn(p: vec2) => 1e8 * (length(p) - 1)) | field(fn(p: vec2) => 1e-8 * (p.y - 0.3))",
            false,
        ),
        ("circle(1).translate(1e7, 0)", true),
        ("field(fn(p: vec2) => p.x + 1e8 - 1e8)", true),
    ] {
        let x = if text.contains("1e7") { "1e7" } else { "0" };
        let text =
            format!("camera {{ from: [{x}, 0, 5], look: [{x}, 0, 0], height: 4 }}\n{text}\n");
        let mut compiled = compiled_text(&text, PassOptions::default());
        let visible = report(&mut compiled).visible;
        let pixels = visible.map(|error| error.largest_found);
        assert!(
            pixels.is_some_and(|pixels| (pixels > 1.0) == moves),
            "{text}: {pixels:?}"
        );
    }
}

/// Blend weights sum to one, so the errors of the operands are averaged and do not accumulate.
#[test]
fn chains_of_blends_are_off_by_little() {
    use std::fmt::Write;
    let mut text = String::from("sphere(0.3)");
    for n in 1..300 {
        let (x, y) = (f64::from(n) * 0.01, f64::from(n * 37 % 11) * 0.1);
        let blend = ["|[0.05]", "|[0.1]", "-[0.02]"][n as usize % 3];
        let _ = write!(text, "\n{blend} sphere(0.3).translate({x}, {y}, 0)");
    }
    let mut compiled = compiled_text(&text, PassOptions::default());
    let rounding = report(&mut compiled);
    let visible = rounding.visible.expect("it is seen");
    assert!(visible.largest_found < 0.1, "{visible:?}");
    let program = &compiled.module.distance;
    let mut random = Random::for_case("chain");
    for _ in 0..200 {
        let p = random_point(&mut random, compiled.module.settings.clip_bounds());
        let point_box = p.map(|x| Interval::point(x.into()));
        let bound = error_bound(program, point_box, [0.0; 3]).error;
        let error = rounding_error(program, p);
        assert!(
            error <= bound && bound < 1e-3,
            "{error} by {bound} at {p:?}"
        );
    }
}

/// Rounding is reported in pixels: detail of 1e-4 at 1e4 from the origin cannot be drawn. The same detail
/// near the origin can, as can a shape as large as its distance.
#[test]
fn detail_hidden_by_rounding_is_reported() {
    let pixels = |text: &str| {
        let mut compiled = compiled_text(text, PassOptions::default());
        let visible = report(&mut compiled).visible.expect("it is seen");
        assert!(visible.is_settled(), "{text}: {visible:?}");
        visible.largest_found
    };
    assert!(pixels("sphere(0.0001)") < 0.01);
    assert!(pixels("sphere(0.0001).translate(10000, 0, 0)") > 100.0);
    assert!(pixels("sphere(1000).translate(10000, 0, 0)") < 0.01);
    assert!(pixels("box(1).translate(100, 0, 0)") < 0.1);
    // Distant cameras start rays near the scene, so small parts there keep their precision.
    let far_scene = "camera { from: [0, 0, 100000], look: [0, 0, 0], fov: 0.002deg }\nbox(1)";
    assert!(pixels(far_scene) < 0.1);
}
