//! Compilation from text to bytecode, and to WGSL.

use crate::scenes;
use criterion::Criterion;
use sdfc_vm::file::encode_file;
use std::hint::black_box;

pub(crate) fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("compile");
    group.sample_size(10);
    for count in [1_000, 10_000] {
        let text = scenes::text(count);
        group.bench_function(format!("{count} primitives"), |bencher| {
            bencher.iter(|| encode_file(&scenes::compile_scene(black_box(&text)).module));
        });
    }
    let compiled = scenes::compile_scene(&scenes::text(1_000));
    group.bench_function("1000 primitives, graph to WGSL", |bencher| {
        bencher.iter(|| black_box(&compiled).generated());
    });
}
