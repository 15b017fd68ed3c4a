//! All engines draw all scenes alike, within the tolerances of `sdfc verify`. The short form takes every second
//! scene: with strict arithmetic, all of them have equal bits (`strict.rs`).

use crate::corpus::{compiled, on_large_stack, scenes_on_gpu};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::comparison::{Comparison, compare_engines};
use sdfc_runtime::engine::{Engine, EngineKind, SceneInput, open};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::skip::is_gpu_skipped;

/// Size of the pictures.
const SIZE: [u32; 2] = [96, 64];

#[test]
fn engines_draw_every_scene_alike() {
    if is_gpu_skipped() {
        return;
    }
    let mut engines: Vec<Box<dyn Engine>> = EngineKind::FAST
        .into_iter()
        .map(|kind| open(kind).unwrap_or_else(|error| panic!("{kind}: {error}")))
        .collect();
    let mut failures = Vec::new();
    for path in &scenes_on_gpu(1) {
        let mut compiled = on_large_stack(|| compiled(path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let source = compiled.generated();
        let overrides = Overrides {
            size: Some(SIZE),
            aa: Some(1),
            ..Overrides::default()
        };
        let settings = resolve(&compiled.module, &uniform_values, &overrides);
        let settings = settings.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let generated = SceneSource {
            text: &source.text,
            calls: &source.calls,
        };
        let loaded = SceneInput {
            module: &compiled.module,
            uniform_values: &uniform_values,
            generated,
        };
        let report = compare_engines(&loaded, &mut engines, &settings);
        let report = report.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        // Software Vulkan fuses nothing that shows in a picture.
        let is_software = report.engines[1].device.contains("software");
        let differs = |comparison: &Comparison| comparison.picture.differing_inside > 0;
        if !report.passed() || (is_software && report.comparisons.iter().any(differs)) {
            failures.push(format!("{}\n{report}", path.display()));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
}
