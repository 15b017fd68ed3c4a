//! Cost against the number of pixels.

use super::{SoloOptions, ms, check_patience, available_engines, scene, measure_times};
use crate::chart::{LogLogChart, ChartSeries};
use crate::contestant::sdfc::EngineScene;
use crate::model::BoxUnion;
use crate::report::{TableColumn, OutputFormat, BenchTable, note};
use sdfc_compiler::passes::PassOptions;
use serde::Serialize;

/// Maximum number of primitives of the scene.
const MAX_PRIMITIVES: u32 = 1000;
/// Sizes of the picture in pixels.
const PICTURE_SIZES: [[u32; 2]; 5] = [[160, 90], [320, 180], [640, 360], [960, 540], [1280, 720]];

#[derive(Serialize)]
struct ResolutionRow {
    measured: &'static str,
    engine: &'static str,
    device: String,
    primitives: u32,
    size: [u32; 2],
    frame_ms: f64,
    nanoseconds_per_pixel: f64,
}

pub(super) fn run(options: &SoloOptions, format: OutputFormat) -> Result<(), String> {
    let table = BenchTable::new(
        "Cost against resolution: smoothly united boxes, one light with a shadow",
        &[
            TableColumn::left("size"),
            TableColumn::right("primitives"),
            TableColumn::left("engine"),
            TableColumn::right("frame, ms"),
            TableColumn::right("ns per pixel"),
        ],
        format,
    );
    table.begin()?;
    let primitives = MAX_PRIMITIVES.min(options.most);
    let text = scene::text(&BoxUnion::new(primitives));
    let mut rows = Vec::new();
    for mut engine in available_engines(&options.engines) {
        let compiled = EngineScene::from_text(&text, &PassOptions::default(), engine.kind())?;
        for size in PICTURE_SIZES {
            let times = match measure_times(&mut *engine, &compiled, size, options) {
                Ok(times) => times,
                Err(problem) => {
                    note(&format!("{size:?} on {}: {problem}", engine.kind()));
                    break;
                }
            };
            let pixels = f64::from(size[0]) * f64::from(size[1]);
            let row = ResolutionRow {
                measured: "resolution",
                engine: engine.kind().name(),
                device: engine.device(),
                primitives,
                size,
                frame_ms: times.frame,
                nanoseconds_per_pixel: times.frame * 1e6 / pixels,
            };
            let cells = [
                format!("{}×{}", size[0], size[1]),
                primitives.to_string(),
                row.engine.to_owned(),
                ms(row.frame_ms),
                format!("{:.0}", row.nanoseconds_per_pixel),
            ];
            table.row(&row, &cells)?;
            rows.push(row);
            if let Err(problem) = check_patience(times.frame, options) {
                note(&format!("{size:?} on {}: {problem}", engine.kind()));
                break;
            }
        }
    }
    table.end()?;
    let series = options.engines.iter().map(|kind| ChartSeries {
        name: kind.name().to_owned(),
        points: rows
            .iter()
            .filter(|row| row.engine == kind.name())
            .map(|row| {
                (
                    f64::from(row.size[0]) * f64::from(row.size[1]),
                    row.frame_ms,
                )
            })
            .collect(),
    });
    LogLogChart {
        title: "Cost against resolution",
        x_axis: "pixels",
        y_axis: "ms a frame",
        series: series.collect(),
    }
    .write(options.charts.as_deref(), "resolution.svg", format)
}
