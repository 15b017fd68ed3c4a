//! Pictures of 640×360 pixels of 50 primitives with a soft shadow and occlusion.
//!
//! Also measures the first picture of a scene on a GPU, whose time is mostly the compilation of kernels.

use crate::scenes;
use criterion::Criterion;
use sdfc_runtime::engine::{EngineKind, SceneInput, open};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;

pub(crate) fn bench(criterion: &mut Criterion) {
    let compiled = scenes::compile_scene(&scenes::text(50));
    let mut module = compiled.module.clone();
    let uniform_values = module.update(0.0);
    let generated = compiled.generated();
    let scene = SceneInput {
        module: &module,
        uniform_values: &uniform_values,
        generated: SceneSource {
            text: &generated.text,
            calls: &generated.calls,
        },
    };
    let settings = resolve(&module, &uniform_values, &Overrides::default()).expect("a view");
    let tiny = Overrides {
        size: Some([16, 9]),
        ..Overrides::default()
    };
    let tiny = resolve(&module, &uniform_values, &tiny).expect("a view");

    let mut group = criterion.benchmark_group("render 50 primitives");
    group.sample_size(10);
    for kind in EngineKind::FAST {
        let Ok(mut engine) = open(kind) else {
            eprintln!("engine {kind} is not measured: there is no GPU adapter");
            continue;
        };
        engine.load(&scene).expect("the scene fits every engine");
        group.bench_function(format!("640x360 on {kind}"), |bencher| {
            bencher.iter(|| engine.render(&settings, &|_| {}).expect("a picture"));
        });
        if kind == EngineKind::Cpu {
            continue;
        }
        group.bench_function(format!("first picture on {kind}"), |bencher| {
            bencher.iter(|| {
                let mut engine = open(kind).expect("it was opened before");
                engine.load(&scene).expect("the scene fits every engine");
                engine.render(&tiny, &|_| {}).expect("a picture")
            });
        });
    }
}
