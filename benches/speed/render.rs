//! Pictures of 640×360 pixels of 50 primitives with a soft shadow and occlusion.
//!
//! Also measures the first picture of a scene on a GPU, whose time is mostly the compilation of kernels.

use crate::scenes::{self, BenchScene};
use criterion::Criterion;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::settings::Overrides;

pub(crate) fn bench(criterion: &mut Criterion) {
    let compiled = scenes::compile_scene(&scenes::text(50));
    let scene = BenchScene::new(&compiled);
    let settings = scene.settings(&Overrides::default());
    let tiny = Overrides {
        size: Some([16, 9]),
        ..Overrides::default()
    };
    let tiny = scene.settings(&tiny);

    let mut group = criterion.benchmark_group("render 50 primitives");
    group.sample_size(10);
    for kind in EngineKind::FAST {
        let Ok(mut engine) = open(kind) else {
            eprintln!("engine {kind} is not measured: there is no GPU adapter");
            continue;
        };
        engine
            .load(&scene.input())
            .expect("the scene fits every engine");
        group.bench_function(format!("640x360 on {kind}"), |bencher| {
            bencher.iter(|| engine.render(&settings, &|_| {}).expect("a picture"));
        });
        if kind == EngineKind::Cpu {
            continue;
        }
        group.bench_function(format!("first picture on {kind}"), |bencher| {
            bencher.iter(|| {
                let mut engine = open(kind).expect("it was opened before");
                engine
                    .load(&scene.input())
                    .expect("the scene fits every engine");
                engine.render(&tiny, &|_| {}).expect("a picture")
            });
        });
    }
}
