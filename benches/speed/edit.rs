//! An edit in the playground: from a saved text to a picture, and from a moved slider to a picture.
//!
//! Each round changes one number of 1,000 primitives, so that no cached result applies. The picture has a
//! single ray: the benchmark measures the path to it, with program words and constants in the engine.

use crate::scenes;
use criterion::Criterion;
use sdfc_io::files::Disk;
use sdfc_playground::build::{BuildTask, SceneOrigin, build};
use sdfc_playground::renderer::{
    CancelToken, DrawTask, Renderer, SampleSet, SceneInputs, ViewMode,
};
use sdfc_runtime::engine::{self, EngineKind};
use sdfc_runtime::settings::Overrides;
use std::sync::Arc;

pub(crate) fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("edit");
    group.sample_size(20);
    let text = scenes::text(1_000);
    let mut number = 0;
    let mut edited = |radius: u64| {
        number += 1;
        let text = format!("{text}| sphere(0.{radius})\n");
        let name = "edited.sdf".to_owned();
        let built = build(
            &BuildTask {
                number,
                source: SceneOrigin::Text { name, text },
                overrides: Vec::new(),
                time: 0.0,
                part: None,
            },
            &Disk,
        );
        built.scene.unwrap_or_else(|| panic!("{}", built.report))
    };
    let mut round = 0;
    group.bench_function("1000 primitives, text to programs", |bencher| {
        bencher.iter(|| {
            round += 1;
            edited(100 + round)
        });
    });
    let mut painter = Renderer::new(Box::new(engine::open));
    group.bench_function("1000 primitives, text to a ray on cpu", |bencher| {
        bencher.iter(|| {
            round += 1;
            let scene = edited(100 + round);
            let drawn = painter.draw(&DrawTask {
                number: round,
                scene,
                inputs: SceneInputs {
                    values: Arc::default(),
                    time: 0.0,
                },
                engine: EngineKind::Cpu,
                overrides: Overrides {
                    size: Some([1, 1]),
                    aa: Some(1),
                    ..Overrides::default()
                },
                samples: SampleSet::All,
                show: ViewMode::default(),
                leaf: None,
                stop: CancelToken::default(),
            });
            assert!(drawn.picture.is_ok());
            drawn
        });
    });
}
