//! Running error bounds of whole scenes: they hold at every point, they are of the size of what is
//! seen, and no place on a surface is off by more than what `sdfc info` tells.

use crate::corpus::{compiled, compiled_text, name, on_large_stack, scenes};
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::rounding::{Rounding, rounding};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::rounding::bound;
use sdfc_vm::vector::V3;

/// Seeded numbers in [0, 1) (xorshift).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
    fn point(&mut self, within: &Bounds) -> [f32; 3] {
        std::array::from_fn(|i| {
            let (low, high) = (within.min[i].max(-20.0), within.max[i].min(20.0));
            (low + (high - low) * self.unit()) as f32
        })
    }
}

fn double(program: &Program, p: [f32; 3]) -> f64 {
    let [x, y, z] = p.map(f64::from);
    evaluate::<f64>(program, V3::of(x, y, z))
}

/// How far off `f32` is.
fn off(program: &Program, p: [f32; 3]) -> f64 {
    let [x, y, z] = p;
    let single = evaluate::<f32>(program, V3::of(x, y, z));
    (f64::from(single) - double(program, p)).abs()
}

/// What is told of a scene.
fn report(compiled: &mut Compiled) -> Rounding {
    let outputs = compiled.module.update(0.0);
    let settings = resolve(&compiled.module, &outputs, &Overrides::default());
    let settings = settings.expect("the scene has a picture");
    rounding(&compiled.module, &outputs, &settings)
}

/// A few thousand points in and around each scene. How much larger the bound is than the worst that was
/// seen is a promise for the examples; scenes of single ideas may be exact.
#[test]
fn no_scene_is_off_by_more_than_its_bound() {
    let mut slack = Vec::new();
    for folder in ["tests/scenes", "examples"] {
        for path in scenes(folder) {
            let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
            compiled.module.update(0.0);
            let program = &compiled.module.distance;
            let space = compiled.module.settings.space();
            let around = space.grown(0.1 * space.half_diagonal().min(20.0));
            let mut random = Random(7919);
            let points = (400_000 / program.code.len()).clamp(200, 3000);
            let (mut worst, mut most, mut known) = (0.0_f64, 0.0_f64, 0);
            for _ in 0..points {
                let p = random.point(&around);
                let found = bound(program, p.map(|v| Interval::point(v.into())), [0.0; 3]);
                let off = off(program, p);
                assert!(
                    off <= found.whatever_is_decided(),
                    "{} at {p:?}: {off} off, by no more than {}",
                    path.display(),
                    found.error
                );
                if found.whatever_is_decided().is_finite() {
                    known += 1;
                    worst = worst.max(off);
                    most = most.max(found.error);
                }
            }
            eprintln!(
                "{:20} {worst:.1e} seen, {most:.1e} bound, {:.0} times; {known} of {points}",
                name(&path),
                most / worst
            );
            assert!(
                known * 10 > points * 9,
                "{}: {known} of {points}",
                path.display()
            );
            if folder == "examples" {
                slack.push((most / worst, name(&path)));
            }
        }
    }
    let silly: Vec<_> = slack.iter().filter(|(ratio, _)| *ratio > 50.0).collect();
    assert!(silly.is_empty(), "{silly:?}");
}

/// Places on surfaces are found by bisection between points inside and outside.
#[test]
fn no_surface_is_off_by_more_than_is_told() {
    let mut settled = 0;
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        let mut compiled = on_large_stack(|| compiled(path, PassOptions::default()));
        let told = report(&mut compiled);
        eprintln!("{:20} {told:?}", name(path));
        // No scene of ours is drawn worse for rounding, and each has something to be seen.
        let seen = told.seen.map(|worst| worst.found);
        let fine = seen.is_some_and(|pixels| 0.0 < pixels && pixels < 0.5);
        assert!(fine, "{}: {told:?}", path.display());
        let Some(within) = told.within else { continue };
        settled += usize::from(within.is_settled());
        let program = &compiled.module.distance;
        let space = *compiled.module.settings.space();
        let space = Bounds {
            min: [space.min[0], space.min[1], space.min[2].max(-20.0)],
            max: [space.max[0], space.max[1], space.max[2].min(20.0)],
        };
        let mut random = Random(104_729);
        let sides: Vec<_> = (0..200)
            .map(|_| random.point(&space))
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
            let off = off(program, a);
            assert!(off <= within.at_most, "{} at {a:?}: {off}", path.display());
        }
    }
    assert!(
        settled >= 15,
        "the search came to an end for {settled} scenes"
    );
}

/// A blend follows its operands by shares that sum to one: what they are off by goes on, and does not add up.
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
    let told = report(&mut compiled);
    let seen = told.seen.expect("it is seen");
    assert!(seen.found < 0.1, "{seen:?}");
    let program = &compiled.module.distance;
    let mut random = Random(7_919);
    for _ in 0..200 {
        let p = random.point(compiled.module.settings.space());
        let place = p.map(|x| Interval::point(x.into()));
        let bound = bound(program, place, [0.0; 3]).error;
        let off = off(program, p);
        assert!(off <= bound && bound < 1e-3, "{off} by {bound} at {p:?}");
    }
}

/// A pixel's worth of rounding is where it should be: detail of 1e-4 at 1e4 from the origin cannot be
/// drawn, the same near the origin can, and so can something as large as its distance.
#[test]
fn what_rounding_hides_is_told() {
    let pixels = |text: &str| {
        let mut compiled = compiled_text(text, PassOptions::default());
        let seen = report(&mut compiled).seen.expect("it is seen");
        assert!(seen.is_settled(), "{text}: {seen:?}");
        seen.found
    };
    assert!(pixels("sphere(0.0001)") < 0.01);
    assert!(pixels("sphere(0.0001).translate(10000, 0, 0)") > 100.0);
    assert!(pixels("sphere(1000).translate(10000, 0, 0)") < 0.01);
    assert!(pixels("box(1).translate(100, 0, 0)") < 0.1);
    // From far away rays start near the scene; what is small there is as exact as ever.
    let far = "camera { from: [0, 0, 100000], look: [0, 0, 0], fov: 0.002deg }\nbox(1)";
    assert!(pixels(far) < 0.1);
}
