//! Random scenes written in several ways, and compiled with other passes: equal values.

use sdfc_compiler::compile::{Compiled, Options, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::graph::Purpose;
use sdfc_compiler::passes::{Context, PASSES, PassEffect, PassOptions, optimize};
use sdfc_compiler::schedule::schedule;
use sdfc_lang::Sources;
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::checks::tape_values;
use sdfc_trials::programs::points;
use sdfc_trials::random::Random;
use sdfc_trials::scenes::{RandomScene, SceneStyle, scene};
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::lanes::LANES;
use sdfc_vm::program::{Opcode, Program};
use sdfc_vm::table::Op;
use sdfc_vm::tape::Tape;
use sdfc_vm::vector::V3;
use sdfc_vm::verify::verify;

/// Largest relative rounding error where the point takes another path through maps.
const MAX_ROUNDING: f32 = 4e-6;

fn compile_without(text: &str, excluded_passes: &[&str]) -> Compiled {
    let mut sources = Sources::new();
    let file = sources.add("scene", text);
    let (scene, diagnostics) = elaborate(&mut sources, file, &elaborate::Options::default());
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics:?}\n{text}"));
    let passes = PassOptions {
        disable_all: false,
        disabled: excluded_passes
            .iter()
            .map(|&name| name.to_owned())
            .collect(),
    };
    let options = Options {
        passes,
        ..Options::default()
    };
    let (compiled, diagnostics) = compile(scene, &options);
    compiled.unwrap_or_else(|| panic!("{diagnostics:?}\n{text}"))
}

/// Returns 4,096 values of the tape, 256 of them replaced by those of the program itself, which executes
/// guards.
fn values(program: &Program) -> Vec<f32> {
    let tape = Tape::new(program);
    (0..64)
        .flat_map(|block| {
            let points = points(block);
            let mut values = tape_values(program, &tape, &tape.clauses, &points).0;
            for (lane, value) in values.iter_mut().enumerate().step_by(LANES / 4) {
                let [x, y, z] = [0, 1, 2].map(|axis| points[axis].0[lane]);
                *value = evaluate::<f32>(program, V3::new(x, y, z));
            }
            values
        })
        .collect()
}

/// Asserts that all values are equal, up to rounding.
fn assert_equal_values(label: &str, text: &str, [a, b]: [&[f32]; 2], rounding: f32) {
    let is_near = |a: f32, b: f32| a == b || (a - b).abs() <= rounding * (1.0 + a.abs());
    let difference = a.iter().zip(b).position(|(&a, &b)| !is_near(a, b));
    if let Some(index) = difference {
        panic!(
            "{label}: point {index} is {} and {}\n{text}",
            a[index], b[index]
        );
    }
}

/// Reports whether a program's value is a safe step instead of the written value.
fn is_safe_step(program: &Program) -> bool {
    use Op::{Bounded, FieldDistance, FieldGrowth, Piecewise};
    let steps = [Bounded, FieldDistance, FieldGrowth, Piecewise].map(Opcode::Op);
    program.code.iter().any(|i| steps.contains(&i.code))
}

/// Returns the names of the passes with an effect, in order.
fn passes_with(effect: PassEffect) -> Vec<&'static str> {
    let passes = PASSES.iter().filter(|pass| pass.effect == effect);
    passes.map(|pass| pass.name).collect()
}

/// Checks all variants of one scene. All are compiled without the passes that change values.
fn check_variants(scene: &RandomScene) -> CheckOutcome {
    let text = scene.text(SceneStyle::default());
    let inexact = passes_with(PassEffect::LargerSteps);
    let full = compile_without(&text, &inexact);
    let expected = values(&full.module.distance);
    for pass in PASSES {
        let other = compile_without(&text, &[&inexact[..], &[pass.name]].concat());
        // Without the pass, a point passes two maps instead of one composed map.
        let rounding = match pass.effect {
            PassEffect::Rounding => MAX_ROUNDING,
            _ => 0.0,
        };
        let other_values = values(&other.module.distance);
        assert_equal_values(pass.name, &text, [&expected, &other_values], rounding);
    }

    // The passes that keep every bit, in another order: their input is the same graph.
    let mut r = Random::new(expected.len() as u64 ^ text.len() as u64);
    let mut order = passes_with(PassEffect::None);
    for index in (1..order.len()).rev() {
        order.swap(index, r.below(index + 1));
    }
    let context = Context {
        purpose: Purpose::Distance,
        lod_target: None,
    };
    let mut graph = full.graph.clone();
    let rounding_passes = passes_with(PassEffect::Rounding);
    for &enabled in rounding_passes.iter().chain(&order) {
        let excluded = PASSES.iter().filter(|pass| pass.name != enabled);
        let options = PassOptions {
            disable_all: false,
            disabled: excluded.map(|pass| pass.name.to_owned()).collect(),
        };
        graph = optimize(&graph, &context, &options).0;
    }
    let mut program = schedule(&graph);
    program.patch(&[]);
    verify(&program, 0, false).unwrap_or_else(|error| panic!("{order:?}: {error}\n{text}"));
    let other_values = values(&program);
    assert_equal_values(
        &format!("{order:?}"),
        &text,
        [&expected, &other_values],
        0.0,
    );

    let styles = [
        ("shuffled", true, false, 0.0),
        ("padded", false, true, 0.0),
        ("both", true, true, 0.0),
    ];
    for (label, shuffled, padded, rounding) in styles {
        let text = scene.text(SceneStyle { shuffled, padded });
        let other = compile_without(&text, &inexact).module.distance;
        let mut pair = [expected.clone(), values(&other)];
        // Another text may have tighter boxes and bounds, which change steps. Only the sign is equal.
        if is_safe_step(&full.module.distance) || is_safe_step(&other) {
            pair = pair.map(|values| values.into_iter().map(f32::signum).collect());
        }
        assert_equal_values(label, &text, [&pair[0], &pair[1]], rounding);
    }
    CheckOutcome::Accepted
}

#[test]
fn equivalent_texts_have_the_same_values() {
    run(
        "scenes",
        input_count(20, 100),
        |seed| seed,
        |&seed| check_variants(&scene(seed)),
    );
}
