//! Random programs: equal bits at random points on every engine.

use super::{engines, is_long};
use crate::corpus::{compiled_text, scene_input};
use sdfc_compiler::passes::PassOptions;
use sdfc_compiler::raise::raise;
use sdfc_runtime::engine::{Engine, FieldSample};
use sdfc_runtime::gpu::Arithmetic;
use sdfc_trials::checks::has_nonfinite_intermediate;
use sdfc_trials::programs::program;
use sdfc_trials::random::Random;
use sdfc_vm::listing;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::vector::V3;

/// Reports whether two samples are equal.
fn same(a: &FieldSample, b: &FieldSample) -> bool {
    let same = |a: f32, b: f32| a == b || (a.is_nan() && b.is_nan());
    same(a.distance, b.distance) && a.gradient.iter().zip(b.gradient).all(|(&a, b)| same(a, b))
}

/// Counts the samples that differ.
fn pairs_that_differ(some: &[FieldSample], others: &[FieldSample]) -> usize {
    let differ = |(a, b): &(&FieldSample, &FieldSample)| !same(a, b);
    some.iter().zip(others).filter(differ).count()
}

/// Magnitude below which a value may result from subnormal numbers, which devices may flush to zero.
const MIN_RELIABLE: f32 = 1e-30;

/// Reports whether samples of a point may differ because raw arithmetic met a non-finite or subnormal
/// number.
fn may_differ(program: &Program, [x, y, z]: [f32; 3], a: &FieldSample, b: &FieldSample) -> bool {
    let slopes = a.gradient.iter().zip(b.gradient);
    let values = slopes.chain([(&a.distance, b.distance)]);
    let mut unequal = values.filter(|(a, b)| **a != *b);
    unequal.all(|(a, b)| a.abs().max(b.abs()) < MIN_RELIABLE)
        || has_nonfinite_intermediate(program, V3::new(x, y, z))
}

#[test]
fn random_programs_have_the_same_bits_on_every_engine() {
    let (programs, points) = if is_long() {
        (256, 1 << 16)
    } else {
        (12, 1 << 12)
    };
    have_the_same_bits(Arithmetic::Strict, programs, points);
    have_the_same_bits(Arithmetic::Portable, programs / 4, points);
}

fn have_the_same_bits(arithmetic: Arithmetic, programs: u64, points: usize) {
    let Some(mut engines) = engines(arithmetic) else {
        return;
    };
    let plain = compiled_text("sphere(1)", PassOptions::default()).module;
    let (mut values, mut excused, mut different) = (0_usize, 0, Vec::new());
    for seed in 0..programs {
        let mut module = Module {
            distance: program(seed),
            ..plain.clone()
        };
        let uniform_values = module.update(0.0);
        let compiled = raise(module);
        let source = compiled.generated();
        let loaded = scene_input(&compiled, &uniform_values, &source);
        let mut random = Random::new(seed);
        let points: Vec<[f32; 3]> = (0..points)
            .map(|_| std::array::from_fn(|_| random.number()))
            .collect();
        let ask = |engine: &mut Box<dyn Engine>| {
            engine.load(&loaded)?;
            engine.query(&points)
        };
        let samples: Vec<Vec<FieldSample>> = engines
            .iter_mut()
            .map(|engine| ask(engine).unwrap_or_else(|error| panic!("{seed}: {error}")))
            .collect();
        values += points.len();
        for (engine, others) in engines.iter().zip(&samples).skip(1) {
            let pairs = samples[0].iter().zip(others).zip(&points);
            let differ = |((a, b), p): &((&FieldSample, &FieldSample), &[f32; 3])| {
                !same(a, b) && !may_differ(&compiled.module.distance, **p, a, b)
            };
            let wrong: Vec<_> = pairs.filter(differ).collect();
            excused += pairs_that_differ(&samples[0], others) - wrong.len();
            let count = wrong.len();
            if let Some(((a, b), p)) = wrong.first() {
                different.push(format!(
                    "program {seed}, {}: {count} points, the first {p:?}: {:?} {:?} and {:?} {:?}\n{}",
                    engine.kind(), a.distance, a.gradient, b.distance, b.gradient,
                    listing::print(&compiled.module.distance)
                ));
            }
        }
    }
    eprintln!(
        "{arithmetic:?}: {values} distances and gradients on each of three engines, {excused} not promised"
    );
    // Excused differences must be rare.
    assert!(excused * 100 < values, "{excused} of {values}");
    assert!(different.is_empty(), "{}", different.join("\n\n"));
}
