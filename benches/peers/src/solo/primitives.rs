//! Cost against the number of primitives, which cover a constant part of the picture.

use super::{SoloOptions, ms, check_patience, available_engines, scene, measure_times};
use crate::chart::{LogLogChart, ChartSeries};
use crate::clock::repeated;
use crate::contestant::sdfc::EngineScene;
use crate::model::BoxUnion;
use crate::report::{TableColumn, OutputFormat, BenchTable, note};
use sdfc_compiler::passes::PassOptions;
use serde::Serialize;

/// Size of the picture in pixels.
const PICTURE_SIZE: [u32; 2] = [640, 360];

#[derive(Serialize)]
struct PrimitivesRow {
    measured: &'static str,
    engine: &'static str,
    device: String,
    primitives: u32,
    size: [u32; 2],
    instructions: usize,
    compile_ms: f64,
    load_ms: f64,
    frame_ms: f64,
}

pub(super) fn run(options: &SoloOptions, format: OutputFormat) -> Result<(), String> {
    let table = BenchTable::new(
        "Cost against primitives: 640×360, one light with a shadow",
        &[
            TableColumn::right("primitives"),
            TableColumn::left("engine"),
            TableColumn::right("text to program, ms"),
            TableColumn::right("load, ms"),
            TableColumn::right("frame, ms"),
        ],
        format,
    );
    table.begin()?;
    let mut rows = Vec::new();
    for mut engine in available_engines(&options.engines) {
        let counts = (1..).map(|power| 10_u32.pow(power));
        for primitives in counts.take_while(|&count| count <= options.most) {
            let text = scene::text(&BoxUnion::new(primitives));
            let compile = || EngineScene::from_text(&text, &PassOptions::default(), engine.kind());
            let compiled = match compile() {
                Ok(compiled) => compiled,
                Err(problem) => {
                    note(&format!("{primitives} primitives: {problem}"));
                    break;
                }
            };
            let compile_ms = repeated(options.rounds, options.patience / 4.0, || {
                compile().map(drop)
            })?;
            let times = match measure_times(&mut *engine, &compiled, PICTURE_SIZE, options) {
                Ok(times) => times,
                Err(problem) => {
                    note(&format!(
                        "{primitives} primitives on {}: {problem}",
                        engine.kind()
                    ));
                    break;
                }
            };
            let row = PrimitivesRow {
                measured: "primitives",
                engine: engine.kind().name(),
                device: engine.device(),
                primitives,
                size: PICTURE_SIZE,
                instructions: compiled.module().distance.code.len(),
                compile_ms,
                load_ms: times.load,
                frame_ms: times.frame,
            };
            let cells = [
                primitives.to_string(),
                row.engine.to_owned(),
                ms(row.compile_ms),
                ms(row.load_ms),
                ms(row.frame_ms),
            ];
            table.row(&row, &cells)?;
            rows.push(row);
            if let Err(problem) = check_patience(times.frame, options) {
                note(&format!(
                    "{primitives} primitives on {}: {problem}",
                    engine.kind()
                ));
                break;
            }
        }
    }
    table.end()?;
    let series = |name: String, engine: &str, value: fn(&PrimitivesRow) -> f64| ChartSeries {
        name,
        points: rows
            .iter()
            .filter(|row| row.engine == engine)
            .map(|row| (f64::from(row.primitives), value(row)))
            .collect(),
    };
    let mut all_series = Vec::new();
    for kind in &options.engines {
        let name = kind.name();
        all_series.push(series(format!("{name}: frame"), name, |row| row.frame_ms));
        all_series.push(series(format!("{name}: load"), name, |row| row.load_ms));
    }
    if let Some(first) = options.engines.first() {
        let compile = |row: &PrimitivesRow| row.compile_ms;
        all_series.push(series("text to program".to_owned(), first.name(), compile));
    }
    LogLogChart {
        title: "Cost against primitives, 640×360 with a shadow",
        x_axis: "primitives",
        y_axis: "ms",
        series: all_series,
    }
    .write(options.charts.as_deref(), "primitives.svg", format)
}
