//! Random scenes said in several ways, and compiled with other passes: equal values.

use sdfc_compiler::compile::{Compiled, Options, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::lower::Purpose;
use sdfc_compiler::passes::{Context, PASSES, PassOptions, optimize};
use sdfc_compiler::schedule::schedule;
use sdfc_lang::Sources;
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::checks::values_at;
use sdfc_trials::programs::points;
use sdfc_trials::random::Random;
use sdfc_trials::scenes::{Scene, Style, scene};
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::lanes::LANES;
use sdfc_vm::program::{Code, Program};
use sdfc_vm::table::Op;
use sdfc_vm::tape::Tape;
use sdfc_vm::vector::V3;
use sdfc_vm::verify::verify;

/// The most that rounding puts into a value where the point takes another path through frames.
const ROUNDING: f32 = 4e-6;

fn compiled(text: &str, without: &[&str]) -> Compiled {
    let mut sources = Sources::new();
    let file = sources.add("scene", text);
    let (scene, found) = elaborate(&mut sources, file, &elaborate::Options::default());
    let scene = scene.unwrap_or_else(|| panic!("{found:?}\n{text}"));
    let passes = PassOptions {
        none: false,
        without: without.iter().map(|&name| name.to_owned()).collect(),
    };
    let options = Options {
        passes,
        ..Options::default()
    };
    let (compiled, found) = compile(scene, &options);
    compiled.unwrap_or_else(|| panic!("{found:?}\n{text}"))
}

/// 4,096 values of the tape, and 256 of the program itself, which follows guards.
fn values(program: &Program) -> Vec<f32> {
    let tape = Tape::of(program);
    (0..64)
        .flat_map(|block| {
            let points = points(block);
            let mut values = values_at(program, &tape, &tape.clauses, &points).0;
            for (lane, value) in values.iter_mut().enumerate().step_by(LANES / 4) {
                let [x, y, z] = [0, 1, 2].map(|axis| points[axis].0[lane]);
                *value = evaluate::<f32>(program, V3::of(x, y, z));
            }
            values
        })
        .collect()
}

/// Demands that all values are equal, or as near as rounding lets them.
fn demand(what: &str, text: &str, [a, b]: [&[f32]; 2], rounding: f32) {
    let near = |a: f32, b: f32| a == b || (a - b).abs() <= rounding * (1.0 + a.abs());
    let apart = a.iter().zip(b).position(|(&a, &b)| !near(a, b));
    if let Some(at) = apart {
        panic!("{what}: point {at} is {} and {}\n{text}", a[at], b[at]);
    }
}

/// Tells if a program's value is a safe step rather than the value that was written.
fn guides(program: &Program) -> bool {
    use Op::{Bounded, FieldDistance, FieldGrowth, Piecewise};
    let steps = [Bounded, FieldDistance, FieldGrowth, Piecewise].map(Code::Op);
    program.code.iter().any(|i| steps.contains(&i.code))
}

/// All ways of one scene. What `lipschitz` does is not exact, so all are without it.
fn agree(scene: &Scene) -> Verdict {
    let text = scene.text(Style::default());
    let whole = compiled(&text, &["lipschitz"]);
    let expected = values(&whole.module.distance);
    for pass in PASSES {
        let other = compiled(&text, &["lipschitz", pass.name]);
        // Without `fold`, a point goes through two maps where it goes through one with it.
        let rounding = if pass.name == "fold" { ROUNDING } else { 0.0 };
        let found = values(&other.module.distance);
        demand(pass.name, &text, [&expected, &found], rounding);
    }

    // The passes behind `fold` in another order: what they are given is the same graph.
    let mut r = Random::new(expected.len() as u64 ^ text.len() as u64);
    let mut order = ["cse", "bounding", "dead"];
    for at in (1..order.len()).rev() {
        order.swap(at, r.below(at + 1));
    }
    let context = Context {
        purpose: Purpose::Distance,
        sight: None,
    };
    let mut graph = whole.graph.clone();
    for only in ["fold"].into_iter().chain(order) {
        let others = PASSES.iter().filter(|pass| pass.name != only);
        let options = PassOptions {
            none: false,
            without: others.map(|pass| pass.name.to_owned()).collect(),
        };
        graph = optimize(&graph, &context, &options).0;
    }
    let mut program = schedule(&graph);
    program.patch(&[]);
    verify(&program, 0, false).unwrap_or_else(|error| panic!("{order:?}: {error}\n{text}"));
    let found = values(&program);
    demand(&format!("{order:?}"), &text, [&expected, &found], 0.0);

    let styles = [
        ("shuffled", true, false, 0.0),
        ("padded", false, true, 0.0),
        ("both", true, true, 0.0),
    ];
    for (what, shuffled, padded, rounding) in styles {
        let text = scene.text(Style { shuffled, padded });
        let other = compiled(&text, &["lipschitz"]).module.distance;
        let mut both = [expected.clone(), values(&other)];
        // Other words may have closer boxes and bounds, which guide steps: the sign stays.
        if guides(&whole.module.distance) || guides(&other) {
            both = both.map(|values| values.into_iter().map(f32::signum).collect());
        }
        demand(what, &text, [&both[0], &both[1]], rounding);
    }
    Verdict::Accepted
}

#[test]
fn scenes_said_otherwise_have_the_same_values() {
    run(
        "scenes",
        count(20, 100),
        |seed| seed,
        |&seed| agree(&scene(seed)),
    );
}
