//! Frames of the examples at 1280×720 with one sample per pixel, on each engine of a hardware GPU and on the
//! CPU.
//!
//! The GPU draws with default and with strict arithmetic, whose difference is the price of equal bits.

use crate::scenes;
use criterion::Criterion;
use sdfc_runtime::engine::{EngineError, EngineKind, SceneInput, open, open_on};
use sdfc_runtime::gpu::{AdapterPreference, Arithmetic, Gpu};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use std::time::Duration;

pub(crate) fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("frames");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(500));
    let engines = [
        (EngineKind::Cpu, Arithmetic::Default, ""),
        (EngineKind::Interp, Arithmetic::Default, ""),
        (EngineKind::Interp, Arithmetic::Strict, ", strict"),
        (EngineKind::Wgsl, Arithmetic::Default, ""),
        (EngineKind::Wgsl, Arithmetic::Strict, ", strict"),
    ];
    for path in scenes::examples() {
        let text = std::fs::read_to_string(&path).expect("it can be read");
        let compiled = scenes::compile_scene(&text);
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
        let overrides = Overrides {
            size: Some([1280, 720]),
            aa: Some(1),
            ..Overrides::default()
        };
        let settings = resolve(&module, &uniform_values, &overrides).expect("a view");
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        for (kind, arithmetic, suffix) in engines {
            let open = || match kind {
                EngineKind::Cpu => open(kind),
                _ => Gpu::open_with(AdapterPreference::Hardware, arithmetic)
                    .map(|gpu| open_on(kind, gpu))
                    .map_err(EngineError::from),
            };
            let mut engine = None;
            group.bench_function(format!("{name} on {kind}{suffix}"), |bencher| {
                let Ok(engine) = engine.get_or_insert_with(open).as_mut() else {
                    eprintln!("engine {kind}{suffix} is not measured: there is no hardware GPU");
                    return bencher.iter(|| {});
                };
                engine.load(&scene).expect("the scene fits every engine");
                bencher.iter(|| engine.render(&settings, &|_| {}).expect("a picture"));
            });
        }
    }
}
