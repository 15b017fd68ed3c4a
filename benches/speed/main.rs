//! Speed from text to picture. See `benches/README.md` for how to run and compare.

mod compile;
mod edit;
mod evaluate;
mod frames;
mod parse;
mod refine;
mod render;
mod scenes;

use criterion::{criterion_group, criterion_main};

criterion_group!(
    speed,
    parse::bench,
    compile::bench,
    edit::bench,
    refine::bench,
    evaluate::bench,
    render::bench,
    frames::bench
);
criterion_main!(speed);
