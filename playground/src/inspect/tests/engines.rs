//! Leaf numbers on every engine.

use super::*;
use sdfc_runtime::engine::open_on;
use sdfc_runtime::gpu::{AdapterPreference, Gpu};
use sdfc_trials::skip::is_gpu_skipped;

/// Opens an engine. A missing device fails the test unless `SDFC_SKIP_GPU` states a reason.
fn engine(kind: EngineKind) -> Option<Box<dyn Engine>> {
    if kind == EngineKind::Cpu {
        return Some(open(kind).expect("there is always a CPU"));
    }
    if is_gpu_skipped() {
        return None;
    }
    let gpu = Gpu::open(AdapterPreference::Any);
    let gpu = gpu.unwrap_or_else(|error| panic!("{error}; ./test.sh installs a software driver"));
    Some(open_on(kind, gpu))
}

#[test]
fn leaves_are_the_same_on_every_engine() {
    let text = "camera { from: [0, 2, 6], look: [0, 0, 0], fov: 40deg }\n\
        (sphere(1) - box(1).translate(0.6, 0.6, 0.6)) |[0.3] sphere(0.6).translate(-1.2, 0, 0)\n\
        | torus(1.4, 0.1)";
    let mut fixture = Fixture::new(text, [48, 32]);
    let generated = fixture.origins.compiled.generated();
    let uniform_values = fixture.origins.compiled.update(0.0);
    let scene = SceneInput {
        module: &fixture.origins.compiled.module,
        uniform_values: &uniform_values,
        generated: SceneSource {
            text: &generated.text,
            calls: &generated.calls,
        },
    };
    let expected = fixture
        .leaves
        .render(&fixture.settings, &|_| {})
        .expect("draws");
    let query_points = QueryPoints::on_surface(&expected, &fixture.settings);
    for kind in EngineKind::FAST {
        let Some(mut engine) = engine(kind) else {
            continue;
        };
        engine.load(&scene).expect("loads");
        let image = engine.render(&fixture.settings, &|_| {}).expect("draws");
        let pairs = expected.id.iter().zip(&image.id);
        let equal = pairs.filter(|(a, b)| a == b).count();
        assert!(
            equal + 4 >= image.id.len(),
            "{kind}: {equal} of {}",
            image.id.len()
        );
        let samples = engine.query(&query_points.points).expect("answers");
        let pairs = query_points.pixels.iter().zip(&samples);
        let equal = pairs
            .filter(|(pixel, sample)| expected.id[**pixel as usize] == sample.surface.id as u32);
        let equal = equal.count();
        assert!(
            equal + 4 >= samples.len(),
            "{kind}: {equal} of {}",
            samples.len()
        );
    }
}
