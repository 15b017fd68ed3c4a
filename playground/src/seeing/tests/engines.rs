//! Leaves on every engine.

use super::*;
use sdfc_runtime::engine::on;
use sdfc_runtime::gpu::{Gpu, Preference};

/// An engine; only a stated reason excuses the want of a device.
fn engine(kind: EngineKind) -> Option<Box<dyn Engine>> {
    if kind == EngineKind::Cpu {
        return Some(open(kind).expect("there is always a CPU"));
    }
    if let Ok(reason) = std::env::var("SDFC_SKIP_GPU") {
        eprintln!("skipped: {reason}");
        return None;
    }
    let gpu = Gpu::open(Preference::Any);
    let gpu = gpu.unwrap_or_else(|error| panic!("{error}; ./test.sh installs a software driver"));
    Some(on(kind, gpu))
}

#[test]
fn leaves_are_the_same_on_every_engine() {
    let text = "camera { from: [0, 2, 6], look: [0, 0, 0], fov: 40deg }\n\
        (sphere(1) - box(1).translate(0.6, 0.6, 0.6)) |[0.3] sphere(0.6).translate(-1.2, 0, 0)\n\
        | torus(1.4, 0.1)";
    let mut stage = Stage::of(text, [48, 32]);
    let generated = stage.origins.compiled.generated();
    let outputs = stage.origins.compiled.update(0.0);
    let scene = Loaded {
        module: &stage.origins.compiled.module,
        outputs: &outputs,
        generated: SceneSource {
            text: &generated.text,
            calls: &generated.calls,
        },
    };
    let expected = stage
        .leaves
        .render(&stage.settings, &|_| {})
        .expect("draws");
    let asked = Asked::on_surface(&expected, &stage.settings);
    for kind in EngineKind::FAST {
        let Some(mut engine) = engine(kind) else {
            continue;
        };
        engine.load(&scene).expect("loads");
        let frame = engine.render(&stage.settings, &|_| {}).expect("draws");
        let pairs = expected.id.iter().zip(&frame.id);
        let same = pairs.filter(|(a, b)| a == b).count();
        assert!(
            same + 4 >= frame.id.len(),
            "{kind}: {same} of {}",
            frame.id.len()
        );
        let samples = engine.query(&asked.points).expect("answers");
        let pairs = asked.pixels.iter().zip(&samples);
        let same = pairs
            .filter(|(pixel, sample)| expected.id[**pixel as usize] == sample.surface.id as u32);
        let same = same.count();
        assert!(
            same + 4 >= samples.len(),
            "{kind}: {same} of {}",
            samples.len()
        );
    }
}
