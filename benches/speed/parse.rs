//! Parsing from text to a tree.

use crate::scenes;
use criterion::{Criterion, Throughput};
use sdfc_lang::{Sources, parse};
use std::hint::black_box;

pub(crate) fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("parse");
    for count in [1_000, 10_000] {
        let mut sources = Sources::new();
        let text = scenes::text(count);
        group.throughput(Throughput::Bytes(text.len() as u64));
        let file = sources.add("bench.sdf", text);
        group.bench_function(format!("{count} primitives"), |bencher| {
            bencher.iter(|| parse(black_box(&sources), file));
        });
    }
}
