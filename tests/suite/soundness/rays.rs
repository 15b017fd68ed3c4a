//! Rays through cells end on surfaces, including near-grazing rays.
//!
//! Picture comparisons exclude silhouettes, where errors of leaves would be visible.

use crate::corpus::compiled_text;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, SceneInput, open};
use sdfc_runtime::reference::ReferenceCamera;
use sdfc_runtime::render::{CellMode, ResolvedLens, Status};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::evaluate::gradient;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// Raw fields that decrease ever more slowly and increase again before they reach zero.
const FIELDS: [&str; 5] = [
    "field(fn(p) => dot(p, p) - 1, within: 3)",
    "field(fn(p) => dot(p * p, p * p) - 5 * dot(p, p) + 11.8, within: 5)",
    "field(fn(p) => p.y - 0.3 * p.x * p.x + 0.2 * p.z * p.z, within: 3)",
    "field(fn(p) => (dot(p, p) + 0.6) * (dot(p, p) + 0.6) - 4 * (p.x * p.x + p.z * p.z), within: 3)",
    "field(fn(p) => sin(3 * p.x) * cos(3 * p.y) + sin(3 * p.y) * cos(3 * p.z) + 0.4, within: 3)",
];
/// Maximum distance of a hit from a surface, in half pixels.
const MAX_HIT_ERROR: f64 = 0.05;

#[test]
fn rays_through_cells_end_on_surfaces() {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let (mut hits, mut failures) = (0, Vec::new());
    for text in FIELDS {
        let mut compiled = compiled_text(&format!("{text}\n"), PassOptions::default());
        let uniform_values = compiled.module.update(0.0);
        let module = &compiled.module;
        let scene = SceneInput {
            module,
            uniform_values: &uniform_values,
            generated: SceneSource::default(),
        };
        engine.load(&scene).expect("it loads");
        for size in [[96, 72], [131, 90], [320, 40]] {
            let overrides = Overrides {
                size: Some(size),
                aa: Some(1),
                cells: CellMode::Always,
                ..Overrides::default()
            };
            let settings = resolve(module, &uniform_values, &overrides).expect("it has settings");
            let image = engine.render(&settings, &|_| {}).expect("it is drawn");
            let camera = ReferenceCamera::new(&settings);
            let ResolvedLens::Perspective(angle) = settings.view.lens else {
                panic!("a scene's own camera")
            };
            for (at, status) in image.status.iter().enumerate() {
                if *status != Status::Hit {
                    continue;
                }
                let pixel = [at % image.width, at / image.width];
                let ray = camera.ray(pixel.map(|v| v as f64), [0.0; 2]);
                let depth = f64::from(image.depth[at]);
                let [x, y, z] = [0, 1, 2].map(|i| ray.origin[i] + depth * ray.direction[i]);
                let found = gradient::<f64>(&module.distance, V3::new(x, y, z));
                let off = found.value.abs() / found.gradient.length();
                let half_pixel = depth * (angle / 2.0).tan() / f64::from(size[1]);
                hits += 1;
                if off > MAX_HIT_ERROR * half_pixel {
                    failures.push((off / half_pixel, text, size, pixel));
                }
            }
        }
    }
    failures.sort_by(|a, b| b.0.total_cmp(&a.0));
    let first = failures.iter().take(9);
    let first: Vec<String> = first.map(|failure| format!("{failure:?}")).collect();
    assert!(
        failures.is_empty(),
        "{} of {hits} rays end beside surfaces:\n{}",
        failures.len(),
        first.join("\n")
    );
    assert!(hits > 20_000, "only {hits} hits");
}
