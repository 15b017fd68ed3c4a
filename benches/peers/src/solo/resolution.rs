//! Cost against the number of pixels.

use super::{Options, ms, patient, present, scene, times};
use crate::chart::{Chart, Series};
use crate::contestant::ours::Compiled;
use crate::model::Boxes;
use crate::report::{Column, Form, Table, note};
use sdfc_compiler::passes::PassOptions;
use serde::Serialize;

/// How many primitives the scene has, at most.
const PRIMITIVES: u32 = 1000;
/// The sizes of the picture.
const SIZES: [[u32; 2]; 5] = [[160, 90], [320, 180], [640, 360], [960, 540], [1280, 720]];

#[derive(Serialize)]
struct Row {
    measured: &'static str,
    engine: &'static str,
    device: String,
    primitives: u32,
    size: [u32; 2],
    frame_ms: f64,
    nanoseconds_per_pixel: f64,
}

pub(super) fn run(options: &Options, form: Form) -> Result<(), String> {
    let table = Table::new(
        "Cost against resolution: smoothly united boxes, one light with a shadow",
        &[
            Column::left("size"),
            Column::right("primitives"),
            Column::left("engine"),
            Column::right("frame, ms"),
            Column::right("ns per pixel"),
        ],
        form,
    );
    table.begin()?;
    let primitives = PRIMITIVES.min(options.most);
    let text = scene::text(&Boxes::new(primitives));
    let mut rows = Vec::new();
    for mut engine in present(&options.engines) {
        let compiled = Compiled::scene(&text, &PassOptions::default(), engine.kind())?;
        for size in SIZES {
            let times = match times(&mut *engine, &compiled, size, options) {
                Ok(times) => times,
                Err(problem) => {
                    note(&format!("{size:?} on {}: {problem}", engine.kind()));
                    break;
                }
            };
            let pixels = f64::from(size[0]) * f64::from(size[1]);
            let row = Row {
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
            if let Err(problem) = patient(times.frame, options) {
                note(&format!("{size:?} on {}: {problem}", engine.kind()));
                break;
            }
        }
    }
    table.end()?;
    let series = options.engines.iter().map(|kind| Series {
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
    Chart {
        title: "Cost against resolution",
        across: "pixels",
        up: "ms a frame",
        series: series.collect(),
    }
    .write(options.charts.as_deref(), "resolution.svg", form)
}
