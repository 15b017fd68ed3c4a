//! Each pass on scenes where it fires and where it must refrain: all passes, none, each alone and each left out give
//! one field, which stays a safe step, and one picture.
//!
//! The scenes of a pass stand in `tests/passes/NAME`. Those in which it does something begin with `fires`, those in
//! which it must not with `refrains`.

use super::samples::{Field, point_at, points_of, zeros};
use crate::corpus::{name, on_large_stack, scene, scenes};
use sdfc_compiler::compile::{self, Compiled, compile};
use sdfc_compiler::passes::lod::{Pixel, Sight};
use sdfc_compiler::passes::{PASSES, Pass, PassOptions};
use sdfc_runtime::engine::{EngineKind, Loaded, open};
use sdfc_runtime::frame::{CellUse, Frame, Lens, RenderSettings};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_runtime::verify::compare;
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::random::Random;
use sdfc_vm::evaluate::{evaluate, gradient};
use sdfc_vm::lanes::LANES;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;
use std::path::{Path, PathBuf};

const SIZE: [u32; 2] = [96, 72];
/// The blocks of points at which fields are compared.
const BLOCKS: usize = 32;
/// The share of its coordinates that rounding may change a value by where maps of points were composed.
const ROUNDING: f32 = 4e-6;
/// The largest gradient of a safe step.
const MAX_SLOPE: f64 = 1.0 + 1e-4;
/// The error that level of detail may make, in pixels.
const TOLERANCE: f64 = 1.0;

/// Every scene of a pass, and whether the pass fires in it.
fn cases(pass: &Pass) -> Vec<(bool, PathBuf)> {
    let paths = scenes(&format!("tests/passes/{}", pass.name));
    let fires = |path: PathBuf| {
        let name = name(&path);
        assert!(
            name.starts_with("fires") || name.starts_with("refrains"),
            "{}: scenes of passes begin with `fires` or `refrains`",
            path.display()
        );
        (name.starts_with("fires"), path)
    };
    paths.into_iter().map(fires).collect()
}

/// A scene compiled with these passes alone.
fn compiled_with(path: &Path, kept: &dyn Fn(&str) -> bool, sight: Option<Sight>) -> Compiled {
    let left_out = PASSES.iter().filter(|pass| !kept(pass.name));
    let without = left_out.map(|pass| pass.name.to_owned()).collect();
    let passes = PassOptions {
        none: false,
        without,
    };
    let options = compile::Options {
        passes,
        sight,
        ..compile::Options::default()
    };
    let (compiled, found) = on_large_stack(|| compile(scene(path), &options));
    let mut compiled = compiled.unwrap_or_else(|| panic!("{}: {found:?}", path.display()));
    compiled.module.update(0.0);
    compiled
}

/// The settings of the picture, and who looks at it.
fn seen(compiled: &mut Compiled) -> (RenderSettings, Sight) {
    let outputs = compiled.module.update(0.0);
    let overrides = Overrides {
        size: Some(SIZE),
        aa: Some(1),
        cells: CellUse::Never,
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, &outputs, &overrides).expect("it has settings");
    let pixel = match settings.view.lens {
        Lens::Perspective(angle) => Pixel::of_perspective(angle, SIZE),
        Lens::Orthographic(shown) => Pixel::of_parallel(shown, SIZE),
    };
    let sight = Sight {
        eye: settings.view.from,
        pixel,
        tolerance: TOLERANCE,
    };
    (settings, sight)
}

fn drawn(compiled: &mut Compiled, settings: &RenderSettings) -> Frame {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let outputs = compiled.module.update(0.0);
    let loaded = Loaded {
        module: &compiled.module,
        outputs: &outputs,
        generated: SceneSource::default(),
    };
    engine.load(&loaded).expect("it loads");
    engine.render(settings, &|_| {}).expect("it draws")
}

fn field(compiled: &Compiled) -> Field {
    let bounds = compiled.module.settings.bounds;
    let program = compiled.module.distance.clone();
    Field::new(String::new(), program, bounds.min, bounds.max)
}

/// Compares the fields of a scene without passes and with some; gives what is wrong.
fn compare_fields(none: &Compiled, some: &Compiled, kept: &dyn Fn(&str) -> bool) -> Option<String> {
    let (none, some) = (field(none), field(some));
    let (mut first, mut second) = (none.machine(), some.machine());
    let mut random = Random::new(5);
    let size = none.region.low.iter().chain(&none.region.high);
    let size = size.fold(0.0, |most: f32, v| most.max(v.abs()));
    let rounding = if kept("fold") { ROUNDING * size } else { 0.0 };
    for _ in 0..BLOCKS {
        let points = points_of(&none.region, &mut random);
        let values = none.values(&mut first, &none.tape.clauses, &points);
        let near = zeros(&none, &mut first, &points, &values, &mut random);
        for points in [Some(points), near].into_iter().flatten() {
            let a = none.values(&mut first, &none.tape.clauses, &points);
            let b = some.values(&mut second, &some.tape.clauses, &points);
            for lane in 0..LANES {
                let (a, b, p) = (a.0[lane], b.0[lane], point_at(&points, lane));
                let is_same = (a - b).abs() <= rounding;
                // Divisions by less: a larger value of the same sign.
                let is_grown = kept("lipschitz")
                    && b.abs() >= a.abs() * (1.0 - 1e-5) - rounding
                    && (a * b > 0.0 || a.abs().max(b.abs()) <= rounding);
                if !(is_same || is_grown) {
                    return Some(format!("{a} without passes and {b} with them at {p:?}"));
                }
                let [x, y, z] = p;
                let guarded = evaluate::<f32>(&some.program, V3 { x, y, z });
                if guarded != b {
                    return Some(format!(
                        "{b} without guards and {guarded} with them at {p:?}"
                    ));
                }
                let [x, y, z] = p.map(f64::from);
                let slope = gradient::<f64>(&some.program, V3 { x, y, z })
                    .gradient
                    .length();
                if slope > MAX_SLOPE {
                    return Some(format!("a slope of {slope} at {p:?}"));
                }
            }
        }
    }
    None
}

fn check(pass: &Pass, fires: bool, path: &Path, failures: &mut Vec<String>) {
    let mut none = compiled_with(path, &|_| false, None);
    let (settings, sight) = seen(&mut none);
    let sight = pass.needs_sight.then_some(sight);
    let picture = drawn(&mut none, &settings);
    let all: &dyn Fn(&str) -> bool = &|_| true;
    let alone: &dyn Fn(&str) -> bool = &|name| name == pass.name;
    let others: &dyn Fn(&str) -> bool = &|name| name != pass.name;
    // What it does to what `fold` leaves, where no other pass has cleaned up.
    let after_fold: &dyn Fn(&str) -> bool = &|name| name == pass.name || name == "fold";
    let mut notes = 0;
    for (which, kept) in [
        ("all", all),
        ("alone", alone),
        ("others", others),
        ("after fold", after_fold),
    ] {
        let mut some = compiled_with(path, kept, sight);
        let own = some.passes.iter().find(|done| done.name == pass.name);
        notes += own.map_or(0, |done| done.notes.len());
        let mut fail = |wrong: &str| {
            failures.push(format!("{}, {which}: {wrong}", path.display()));
        };
        // What is made simpler for its pixels is another field.
        let is_exact = !(pass.needs_sight && kept(pass.name));
        if is_exact && let Some(wrong) = compare_fields(&none, &some, kept) {
            fail(&wrong);
        }
        let (differences, _) = compare(&picture, &drawn(&mut some, &settings));
        let hits = differences.hit_mismatches_inside;
        if hits > 0 || differences.differing_inside > 0 {
            fail(&format!("the picture differs\n{differences}"));
        }
    }
    if fires != (notes > 0) {
        failures.push(format!(
            "{}: {notes} notes of what the pass did",
            path.display()
        ));
    }
}

#[test]
fn each_pass_alone_and_left_out_keeps_field_and_picture() {
    let mut failures = Vec::new();
    for pass in &PASSES {
        for (fires, path) in cases(pass) {
            check(pass, fires, &path, &mut failures);
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn every_pass_has_scenes_in_which_it_fires_and_refrains() {
    for pass in &PASSES {
        let cases = cases(pass);
        for wanted in [true, false] {
            let is_there = cases.iter().any(|(fires, _)| *fires == wanted);
            let word = if wanted { "fires" } else { "refrains" };
            assert!(is_there, "tests/passes/{} has no {word}.sdf", pass.name);
        }
    }
}
