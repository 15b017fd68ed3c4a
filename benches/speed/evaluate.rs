//! Evaluated points per second.
//!
//! The first two measure the distance alone on one thread: one point at a time, and 64. The queries of the
//! engines use all their resources, and return distance, gradient and material.

use crate::scenes::{self, BenchScene};
use criterion::{BenchmarkGroup, Criterion, Throughput, measurement::WallTime};
use sdfc_compiler::compile::Compiled;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::lanes::{F32x64, LANES, Points};
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::vector::V3;
use std::hint::black_box;

/// Number of points in a query.
const QUERY_POINTS: usize = 1 << 16;

pub(crate) fn bench(criterion: &mut Criterion) {
    let compiled = scenes::compile_scene(&scenes::text(50));
    let mut group = criterion.benchmark_group("evaluate 50 primitives");
    let program = &compiled.module.distance;
    let points = points(LANES);

    group.throughput(Throughput::Elements(LANES as u64));
    group.bench_function("one point at a time", |bencher| {
        bencher.iter(|| {
            let value = |&[x, y, z]: &[f32; 3]| evaluate::<f32>(program, V3::new(x, y, z));
            black_box(&points).iter().map(value).sum::<f32>()
        });
    });
    let tape = Tape::new(program);
    let mut machine: TapeEvaluator<f32> = TapeEvaluator::new(tape.values, tape.points);
    let block: Points = [0, 1, 2].map(|axis| {
        let mut column = F32x64::default();
        for (number, point) in column.0.iter_mut().zip(&points) {
            *number = point[axis];
        }
        column
    });
    group.bench_function("64 points at a time", |bencher| {
        bencher.iter(|| {
            *machine.inputs_mut() = black_box(block);
            machine.run(program, &tape.clauses, LANES).0[0]
        });
    });

    group
        .throughput(Throughput::Elements(QUERY_POINTS as u64))
        .sample_size(10);
    for kind in EngineKind::FAST {
        query(&mut group, &compiled, kind);
    }
}

/// Measures a query on an engine, if it is available on this machine.
fn query(group: &mut BenchmarkGroup<'_, WallTime>, compiled: &Compiled, kind: EngineKind) {
    let scene = BenchScene::new(compiled);
    let Ok(mut engine) = open(kind) else {
        eprintln!("engine {kind} is not measured: there is no GPU adapter");
        return;
    };
    engine
        .load(&scene.input())
        .expect("the scene fits every engine");
    let points = points(QUERY_POINTS);
    group.bench_function(format!("query on {kind}"), |bencher| {
        bencher.iter(|| engine.query(black_box(&points)).expect("an answer"));
    });
}

/// Returns pseudorandom points all over the scene, identical in every run.
fn points(count: usize) -> Vec<[f32; 3]> {
    let mut state = 1_u32;
    let mut next_coordinate = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32 * 12.0 - 6.0
    };
    (0..count)
        .map(|_| [next_coordinate(), next_coordinate(), next_coordinate()])
        .collect()
}
