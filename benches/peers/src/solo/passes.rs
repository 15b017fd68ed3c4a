//! Effect of each optimizing pass: the same scene without it.

use super::{SoloOptions, ms, available_engines, scene, measure_times};
use crate::clock::repeated;
use crate::contestant::sdfc::EngineScene;
use crate::model::BoxUnion;
use crate::report::{TableColumn, OutputFormat, BenchTable};
use sdfc_compiler::passes::{PASSES, PassOptions};
use serde::Serialize;

/// Maximum number of primitives of the scene.
const MAX_PRIMITIVES: u32 = 300;
/// Size of the picture in pixels.
const PICTURE_SIZE: [u32; 2] = [320, 180];

#[derive(Serialize)]
struct PassRow {
    measured: &'static str,
    without: &'static str,
    engine: &'static str,
    primitives: u32,
    size: [u32; 2],
    instructions: usize,
    compile_ms: f64,
    load_ms: f64,
    frame_ms: f64,
}

pub(super) fn run(options: &SoloOptions, format: OutputFormat) -> Result<(), String> {
    let table = BenchTable::new(
        "Passes: 320×180, the same scene with a pass left out",
        &[
            TableColumn::left("without"),
            TableColumn::left("engine"),
            TableColumn::right("instructions"),
            TableColumn::right("compile, ms"),
            TableColumn::right("load, ms"),
            TableColumn::right("frame, ms"),
        ],
        format,
    );
    table.begin()?;
    let primitives = MAX_PRIMITIVES.min(options.most);
    let text = scene::text(&BoxUnion::new(primitives));
    for mut engine in available_engines(&options.engines) {
        let each = PASSES.iter().map(|pass| (pass.name, false));
        let variants = std::iter::once(("none", false))
            .chain(each)
            .chain([("all", true)]);
        for (name, none) in variants {
            let passes = PassOptions {
                disable_all: none,
                disabled: vec![name.to_owned()],
            };
            let compile = || EngineScene::from_text(&text, &passes, engine.kind());
            let compiled = compile()?;
            let compile_ms = repeated(options.rounds, options.patience / 4.0, || {
                compile().map(drop)
            })?;
            let times = measure_times(&mut *engine, &compiled, PICTURE_SIZE, options)?;
            let row = PassRow {
                measured: "passes",
                without: name,
                engine: engine.kind().name(),
                primitives,
                size: PICTURE_SIZE,
                instructions: compiled.module().distance.code.len(),
                compile_ms,
                load_ms: times.load,
                frame_ms: times.frame,
            };
            let cells = [
                name.to_owned(),
                row.engine.to_owned(),
                row.instructions.to_string(),
                ms(row.compile_ms),
                ms(row.load_ms),
                ms(row.frame_ms),
            ];
            table.row(&row, &cells)?;
        }
    }
    table.end()
}
