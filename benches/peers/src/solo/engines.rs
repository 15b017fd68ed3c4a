//! The engines against each other, on scenes with increasing numbers of primitives.
//!
//! On a GPU the first frame includes the compilation of kernels.

use super::{SoloOptions, ms, check_patience, available_engines, scene, measure_times};
use crate::clock::timed;
use crate::contestant::sdfc::EngineScene;
use crate::model::BoxUnion;
use crate::report::{TableColumn, OutputFormat, BenchTable, note};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind};
use sdfc_runtime::settings::Overrides;
use serde::Serialize;

/// Size of the picture in pixels, small enough for software Vulkan.
const PICTURE_SIZE: [u32; 2] = [320, 180];
const PRIMITIVE_COUNTS: [u32; 3] = [50, 300, 1000];

#[derive(Serialize)]
struct EngineRow {
    measured: &'static str,
    engine: &'static str,
    device: String,
    primitives: u32,
    size: [u32; 2],
    first_ms: f64,
    load_ms: f64,
    frame_ms: f64,
}

pub(super) fn run(options: &SoloOptions, format: OutputFormat) -> Result<(), String> {
    let table = BenchTable::new(
        "Engines: 320×180, one light with a shadow",
        &[
            TableColumn::right("primitives"),
            TableColumn::left("engine"),
            TableColumn::right("first, ms"),
            TableColumn::right("load, ms"),
            TableColumn::right("frame, ms"),
            TableColumn::left("device"),
        ],
        format,
    );
    table.begin()?;
    let counts = PRIMITIVE_COUNTS.into_iter().filter(|&count| count <= options.most);
    let counts: Vec<u32> = counts.collect();
    for mut engine in available_engines(&EngineKind::FAST) {
        for &primitives in &counts {
            let text = scene::text(&BoxUnion::new(primitives));
            let result = measure_engine(&text, primitives, &mut *engine, options).and_then(|row| {
                let cells = [
                    primitives.to_string(),
                    row.engine.to_owned(),
                    ms(row.first_ms),
                    ms(row.load_ms),
                    ms(row.frame_ms),
                    row.device.clone(),
                ];
                table.row(&row, &cells)?;
                check_patience(row.frame_ms, options)
            });
            if let Err(problem) = result {
                let kind = engine.kind();
                note(&format!("{primitives} primitives on {kind}: {problem}"));
                break;
            }
        }
    }
    table.end()
}

fn measure_engine(
    text: &str,
    primitives: u32,
    engine: &mut dyn Engine,
    options: &SoloOptions,
) -> Result<EngineRow, String> {
    let compiled = EngineScene::from_text(text, &PassOptions::default(), engine.kind())?;
    let settings = compiled.settings(&Overrides {
        size: Some(PICTURE_SIZE),
        ..Overrides::default()
    })?;
    let (drawn, first_ms) = timed(|| {
        engine.load(&compiled.scene_input())?;
        engine.render(&settings, &|_| {})
    });
    drawn.map_err(|error| error.to_string())?;
    let times = measure_times(engine, &compiled, PICTURE_SIZE, options)?;
    Ok(EngineRow {
        measured: "engines",
        engine: engine.kind().name(),
        device: engine.device(),
        primitives,
        size: PICTURE_SIZE,
        first_ms,
        load_ms: times.load,
        frame_ms: times.frame,
    })
}
