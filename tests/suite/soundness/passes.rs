//! Passes on scenes where they fire and where they must refrain. All passes, none, each alone, and each
//! left out give the same field, which stays a safe step, and the same picture.
//!
//! The scenes of a pass are in `tests/passes/NAME`. Those in which it fires begin with `fires`, those in
//! which it must not with `refrains`.

use super::samples::{Field, point_at, points_of, zeros};
use crate::corpus::{name, on_large_stack, scene, scenes};
use sdfc_compiler::compile::{self, Compiled, compile};
use sdfc_compiler::passes::lod::{LodTarget, PixelSize};
use sdfc_compiler::passes::{PASSES, Pass, PassEffect, PassOptions};
use sdfc_runtime::comparison::compare;
use sdfc_runtime::engine::{EngineKind, SceneInput, open};
use sdfc_runtime::render::{CellMode, Image, RenderSettings, ResolvedLens};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::random::Random;
use sdfc_vm::evaluate::{evaluate, gradient};
use sdfc_vm::lanes::LANES;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;
use std::path::{Path, PathBuf};

const SIZE: [u32; 2] = [96, 72];
/// Number of blocks of points at which fields are compared.
const BLOCK_COUNT: usize = 32;
/// Maximum rounding error of a value relative to its coordinates, where point maps were composed.
const MAX_ROUNDING: f32 = 4e-6;
/// Maximum gradient of a safe step.
const MAX_SLOPE: f64 = 1.0 + 1e-4;
/// Tolerance of level of detail, in pixels.
const TOLERANCE: f64 = 1.0;

/// Returns the scenes of a pass and whether the pass fires in them.
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

/// Compiles a scene with the selected passes only.
fn compiled_with(path: &Path, kept: &dyn Fn(&str) -> bool, sight: Option<LodTarget>) -> Compiled {
    let left_out = PASSES.iter().filter(|pass| !kept(pass.name));
    let without = left_out.map(|pass| pass.name.to_owned()).collect();
    let passes = PassOptions {
        disable_all: false,
        disabled: without,
    };
    let options = compile::Options {
        passes,
        lod_target: sight,
        ..compile::Options::default()
    };
    let (compiled, found) = on_large_stack(|| compile(scene(path), &options));
    let mut compiled = compiled.unwrap_or_else(|| panic!("{}: {found:?}", path.display()));
    compiled.module.update(0.0);
    compiled
}

/// Returns the settings of the picture and the target for level of detail.
fn seen(compiled: &mut Compiled) -> (RenderSettings, LodTarget) {
    let uniform_values = compiled.module.update(0.0);
    let overrides = Overrides {
        size: Some(SIZE),
        aa: Some(1),
        cells: CellMode::Never,
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, &uniform_values, &overrides).expect("it has settings");
    let pixel = match settings.view.lens {
        ResolvedLens::Perspective(angle) => PixelSize::from_perspective(angle, SIZE),
        ResolvedLens::Orthographic(shown) => PixelSize::from_parallel(shown, SIZE),
    };
    let sight = LodTarget {
        camera_position: settings.view.from,
        pixel,
        tolerance: TOLERANCE,
    };
    (settings, sight)
}

fn drawn(compiled: &mut Compiled, settings: &RenderSettings) -> Image {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let uniform_values = compiled.module.update(0.0);
    let loaded = SceneInput {
        module: &compiled.module,
        uniform_values: &uniform_values,
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

/// Compares the fields of a scene without passes and with some; returns a description of the first error.
fn compare_fields(none: &Compiled, some: &Compiled, kept: &dyn Fn(&str) -> bool) -> Option<String> {
    let (none, some) = (field(none), field(some));
    let (mut first, mut second) = (none.machine(), some.machine());
    let mut random = Random::new(5);
    let size = none.region.low.iter().chain(&none.region.high);
    let size = size.fold(0.0, |most: f32, v| most.max(v.abs()));
    let keeps = |effect: PassEffect| {
        let mut passes = PASSES.iter();
        passes.any(|pass| pass.effect == effect && kept(pass.name))
    };
    let rounding = if keeps(PassEffect::Rounding) {
        MAX_ROUNDING * size
    } else {
        0.0
    };
    for _ in 0..BLOCK_COUNT {
        let points = points_of(&none.region, &mut random);
        let values = none.values(&mut first, &none.tape.clauses, &points);
        let near = zeros(&none, &mut first, &points, &values, &mut random);
        for points in [Some(points), near].into_iter().flatten() {
            let a = none.values(&mut first, &none.tape.clauses, &points);
            let b = some.values(&mut second, &some.tape.clauses, &points);
            for lane in 0..LANES {
                let (a, b, p) = (a.0[lane], b.0[lane], point_at(&points, lane));
                let is_same = (a - b).abs() <= rounding;
                // A smaller divisor gives a larger value of the same sign.
                let is_grown = keeps(PassEffect::LargerSteps)
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
    let sight = pass.needs_lod_target.then_some(sight);
    let picture = drawn(&mut none, &settings);
    let all: &dyn Fn(&str) -> bool = &|_| true;
    let alone: &dyn Fn(&str) -> bool = &|name| name == pass.name;
    let others: &dyn Fn(&str) -> bool = &|name| name != pass.name;
    // Applied to the output of `fold` alone, before other passes clean up.
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
        // Level of detail changes the field.
        let is_exact = !(pass.needs_lod_target && kept(pass.name));
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
