//! Strict arithmetic: every bit of hit, depth, step count and normal, and of distances and gradients
//! at points, is the same on every engine.

use crate::corpus::{compiled, on_large_stack, scenes};
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind, Loaded, open_with};
use sdfc_runtime::gpu::Arithmetic;
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_runtime::verify::{BitDifferences, Report, verify_with};
use sdfc_shaders::assemble::SceneSource;

/// The width and height of the pictures.
const SIZE: [u32; 2] = [96, 64];

fn engines() -> Vec<Box<dyn Engine>> {
    EngineKind::ALL
        .into_iter()
        .map(|kind| {
            open_with(kind, Arithmetic::Strict).unwrap_or_else(|error| panic!("{kind}: {error}"))
        })
        .collect()
}

/// Compares all engines on a scene, its picture of this size.
fn compared(compiled: &mut Compiled, engines: &mut [Box<dyn Engine>], size: [u32; 2]) -> Report {
    let outputs = compiled.module.update(0.0);
    let source = compiled.generated();
    let overrides = Overrides {
        size: Some(size),
        aa: Some(1),
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, &outputs, &overrides);
    let settings = settings.unwrap_or_else(|error| panic!("{error}"));
    let loaded = Loaded {
        module: &compiled.module,
        outputs: &outputs,
        generated: SceneSource {
            text: &source.text,
            calls: &source.calls,
        },
    };
    let report = verify_with(&loaded, engines, &settings, Arithmetic::Strict);
    report.unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_scene_has_the_same_bits_on_every_engine() {
    if let Ok(reason) = std::env::var("SDFC_SKIP_GPU") {
        eprintln!("skipped: engines are not compared ({reason})");
        return;
    }
    let mut engines = engines();
    let mut failures = Vec::new();
    let mut colors = 0;
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        let mut compiled = on_large_stack(|| compiled(path, PassOptions::default()));
        let report = compared(&mut compiled, &mut engines, SIZE);
        let bits: Vec<&BitDifferences> = report
            .comparisons
            .iter()
            .filter_map(|comparison| comparison.bits.as_ref())
            .collect();
        colors += bits.iter().map(|bits| bits.colors).sum::<usize>();
        if !report.passed() {
            failures.push(format!("{}\n{report}", path.display()));
        }
    }
    println!("{colors} pixels of another colour");
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
}
