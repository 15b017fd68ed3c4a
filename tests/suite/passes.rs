//! Passes preserve the values of all scenes: with all passes, with none, and with each left out.

use crate::corpus::{compiled, compiled_text, name, on_large_stack, scenes};
use sdfc_compiler::export::module_text;
use sdfc_compiler::passes::{PASSES, Pass, PassEffect, PassOptions};
use sdfc_trials::random::Random;
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::lanes::{F32x64, LANES};
use sdfc_vm::listing;
use sdfc_vm::program::{Opcode, Program};
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::vector::V3;
use std::path::Path;

/// Returns points in and around a cube of three units; 64 blocks give 4,096.
fn points(block: u64) -> [F32x64; 3] {
    let mut random = Random::new(block);
    std::array::from_fn(|_| F32x64(std::array::from_fn(|_| 6.0 * random.unit_f32() - 3.0)))
}

fn values(program: &Program) -> Vec<f32> {
    let tape = Tape::new(program);
    let mut machine = TapeEvaluator::<f32>::new(tape.values, tape.points);
    (0..64)
        .flat_map(|block| {
            *machine.inputs_mut() = points(block);
            machine.run(program, &tape.clauses, LANES).0
        })
        .collect()
}

#[test]
fn passes_keep_every_bit() {
    let mut variants = vec![PassOptions {
        disable_all: true,
        disabled: vec![],
    }];
    for pass in PASSES {
        variants.push(PassOptions {
            disable_all: false,
            disabled: vec![pass.name.to_owned()],
        });
    }
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        on_large_stack(|| {
            let expected = values(&compiled(path, PassOptions::default()).module.distance);
            assert_eq!(expected.len(), 64 * LANES);
            for options in &variants {
                let other = values(&compiled(path, options.clone()).module.distance);
                // Without larger steps, values may be smaller, but never larger or of the opposite sign.
                let is_left_out = |pass: &Pass| {
                    options.disable_all || options.disabled.iter().any(|name| name == pass.name)
                };
                let may_shrink = PASSES
                    .iter()
                    .any(|pass| pass.effect == PassEffect::LargerSteps && is_left_out(pass));
                let same = |a: f32, b: f32| {
                    let shrunk = may_shrink && b.abs() <= a.abs() * 1.00001 && a * b > 0.0;
                    a == b || (a.is_nan() && b.is_nan()) || shrunk
                };
                let differs = expected.iter().zip(&other).position(|(a, b)| !same(*a, *b));
                if let Some(index) = differs {
                    panic!(
                        "{}, {options:?}: point {index} is {} with all passes, {} with these",
                        path.display(),
                        expected[index],
                        other[index]
                    );
                }
            }
        });
    }
}

fn guards(program: &Program) -> usize {
    let is_guard = |i: &&sdfc_vm::program::Instruction| i.code == Opcode::Guard;
    program.code.iter().filter(is_guard).count()
}

/// Compares values with and without guards, near the scene and far from it.
fn compare_guards(path: &Path, program: &Program) {
    let tape = Tape::new(program);
    let mut machine = TapeEvaluator::<f32>::new(tape.values, tape.points);
    for block in 0..48 {
        let scale = [0.3, 1.0, 4.0, 40.0][block as usize % 4];
        let points = points(block).map(|column| F32x64(column.0.map(|v| v * scale)));
        *machine.inputs_mut() = points;
        let unguarded = *machine.run(program, &tape.clauses, LANES);
        for lane in 0..LANES {
            let [x, y, z] = [0, 1, 2].map(|axis| points[axis].0[lane]);
            let guarded = evaluate::<f32>(program, V3::new(x, y, z));
            let unguarded = unguarded.0[lane];
            assert!(
                guarded == unguarded || (guarded.is_nan() && unguarded.is_nan()),
                "{}: {guarded} with guards and {unguarded} without at {x}, {y}, {z}",
                path.display()
            );
        }
    }
}

#[test]
fn guards_skip_only_what_does_not_matter() {
    let mut guarded = Vec::new();
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        on_large_stack(|| {
            let module = compiled(path, PassOptions::default()).module;
            let programs = [Some(&module.distance), module.surface.as_ref()];
            for program in programs.into_iter().flatten() {
                if guards(program) > 0 {
                    compare_guards(path, program);
                }
            }
        });
        let program = on_large_stack(|| compiled(path, PassOptions::default()).module.distance);
        if guards(&program) > 0 {
            guarded.push(name(path));
        }
    }
    for scene in ["guards", "spheres_many"] {
        assert!(guarded.iter().any(|name| name == scene), "{guarded:?}");
    }
}

/// Returns dumps of a scene without and with one pass, after all passes before it.
fn before_and_after(pass: &str, path: &Path) -> String {
    let text =
        std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let passes_before = PASSES.iter().take_while(|p| p.name != pass);
    let passes_from = PASSES.iter().skip_while(|p| p.name != pass);
    let without = |passes: Vec<&str>| PassOptions {
        disable_all: false,
        disabled: passes.into_iter().map(str::to_owned).collect(),
    };
    let names: Vec<&str> = passes_from.map(|p| p.name).collect();
    assert!(passes_before.count() + names.len() == PASSES.len());
    let without_pass = compiled_text(&text, without(names.clone()));
    let with_pass = compiled_text(&text, without(names[1..].to_vec()));
    let notes = with_pass
        .passes
        .iter()
        .find(|pass_report| pass_report.name == pass);
    let notes = notes.expect("the pass is known").notes.join("; ");
    format!(
        "{text}\n--- before\n{}\n--- after: {notes}\n{}",
        without_pass.optimized.dump(),
        with_pass.optimized.dump()
    )
}

fn check(name: &str, text: &str) {
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!(name, text);
    });
}

/// A pass for level of detail is shown by `lod::`, for a picture.
#[test]
fn each_pass_shows_what_it_does() {
    for pass in PASSES.iter().filter(|pass| !pass.needs_lod_target) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/passes")
            .join(pass.name)
            .join("fires.sdf");
        check(
            &format!("pass__{}", pass.name),
            &before_and_after(pass.name, &path),
        );
    }
}

#[test]
fn guards_stand_in_every_stage() {
    let piles = "union(for i in 0..48 { box(0.3).rotate(i * 10deg, Y)\
                 .translate(i % 4 + floor(i / 24) * 20, floor(i / 4) % 6, 0) })\n";
    let compiled = compiled_text(piles, PassOptions::default());
    let wgsl = module_text(&compiled);
    let function = wgsl.find("fn scene_distance").unwrap_or_default();
    check(
        "guards",
        &format!(
            "{piles}\n--- optimized\n{}\n--- asm\n{}\n--- wgsl\n{}",
            compiled.optimized.dump(),
            listing::print(&compiled.module.distance),
            &wgsl[function..]
        ),
    );
}

#[test]
fn composed_maps_of_points_differ_by_rounding_only() {
    let text = "box([1, 0.4, 0.7]).rotate(20deg, [1, 2, 3]).translate(0.3, 0, 0.1)\
                .warp(fn(p) => [p.z + 0.5, p.y, -p.x]).warp(fn(p) => [p.x, p.y - 0.2, p.z])\n";
    let some = |passes: &[&str]| {
        let without = passes.iter().map(|pass| (*pass).to_owned()).collect();
        let none = false;
        compiled_text(
            text,
            PassOptions {
                disable_all: none,
                disabled: without,
            },
        )
    };
    let [without, with] = [&["fold", "lipschitz"][..], &["lipschitz"]].map(some);
    let all = some(&[]).module.distance;
    assert_eq!(all.code.len(), 1, "one frame and the box");
    let pairs = values(&with.module.distance)
        .into_iter()
        .zip(values(&without.module.distance));
    for (a, b) in pairs {
        assert!((a - b).abs() < 4e-6, "{a} and {b}");
    }
}
