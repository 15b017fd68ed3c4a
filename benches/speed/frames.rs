//! Frames of the examples at 1280×720 with one sample per pixel, on each engine of a hardware GPU and on the
//! CPU.
//!
//! The GPU draws with default and with strict arithmetic, whose difference is the price of equal bits.

use crate::scenes::{self, BenchScene};
use criterion::Criterion;
use sdfc_runtime::engine::{Engine, EngineKind, open, open_on};
use sdfc_runtime::gpu::{AdapterPreference, Arithmetic, Gpu};
use sdfc_runtime::settings::Overrides;
use std::time::Duration;

/// The measured engines.
const ENGINES: [(EngineKind, Arithmetic, &str); 5] = [
    (EngineKind::Cpu, Arithmetic::Default, ""),
    (EngineKind::Interp, Arithmetic::Default, ""),
    (EngineKind::Interp, Arithmetic::Strict, ", strict"),
    (EngineKind::Wgsl, Arithmetic::Default, ""),
    (EngineKind::Wgsl, Arithmetic::Strict, ", strict"),
];

pub(crate) fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("frames");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(500));
    let has_hardware = Gpu::open(AdapterPreference::Hardware).is_ok();
    if !has_hardware {
        eprintln!("frames of GPU engines are not measured: there is no hardware GPU");
    }
    for path in scenes::examples() {
        let text = std::fs::read_to_string(&path).expect("it can be read");
        let scene = BenchScene::new(&scenes::compile_scene(&text));
        let settings = scene.settings(&Overrides {
            size: Some([1280, 720]),
            aa: Some(1),
            ..Overrides::default()
        });
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        for (kind, arithmetic, suffix) in ENGINES {
            if kind != EngineKind::Cpu && !has_hardware {
                continue;
            }
            let mut engine = None;
            group.bench_function(format!("{name} on {kind}{suffix}"), |bencher| {
                let engine = engine.get_or_insert_with(|| {
                    let mut engine = open_hardware(kind, arithmetic);
                    engine
                        .load(&scene.input())
                        .expect("the scene fits every engine");
                    engine
                });
                bencher.iter(|| engine.render(&settings, &|_| {}).expect("a picture"));
            });
        }
    }
}

/// Opens an engine on a hardware GPU, or on the CPU.
fn open_hardware(kind: EngineKind, arithmetic: Arithmetic) -> Box<dyn Engine> {
    if kind == EngineKind::Cpu {
        return open(kind).expect("there is a CPU");
    }
    let gpu = Gpu::open_with(AdapterPreference::Hardware, arithmetic);
    open_on(kind, gpu.expect("the device was opened before"))
}
