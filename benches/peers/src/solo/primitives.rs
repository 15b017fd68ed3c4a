//! Cost against the number of primitives, which cover the same part of the picture.

use super::{Options, ms, patient, present, scene, times};
use crate::chart::{Chart, Series};
use crate::clock::repeated;
use crate::contestant::ours::Compiled;
use crate::model::Boxes;
use crate::report::{Column, Form, Table, note};
use sdfc_compiler::passes::PassOptions;
use serde::Serialize;

/// The size of the picture.
const SIZE: [u32; 2] = [640, 360];

#[derive(Serialize)]
struct Row {
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

pub(super) fn run(options: &Options, form: Form) -> Result<(), String> {
    let table = Table::new(
        "Cost against primitives: 640×360, one light with a shadow",
        &[
            Column::right("primitives"),
            Column::left("engine"),
            Column::right("text to program, ms"),
            Column::right("load, ms"),
            Column::right("frame, ms"),
        ],
        form,
    );
    table.begin()?;
    let mut rows = Vec::new();
    for mut engine in present(&options.engines) {
        let counts = (1..).map(|power| 10_u32.pow(power));
        for primitives in counts.take_while(|&count| count <= options.most) {
            let text = scene::text(&Boxes::new(primitives));
            let compile = || Compiled::scene(&text, &PassOptions::default(), engine.kind());
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
            let times = match times(&mut *engine, &compiled, SIZE, options) {
                Ok(times) => times,
                Err(problem) => {
                    note(&format!(
                        "{primitives} primitives on {}: {problem}",
                        engine.kind()
                    ));
                    break;
                }
            };
            let row = Row {
                measured: "primitives",
                engine: engine.kind().name(),
                device: engine.device(),
                primitives,
                size: SIZE,
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
            if let Err(problem) = patient(times.frame, options) {
                note(&format!(
                    "{primitives} primitives on {}: {problem}",
                    engine.kind()
                ));
                break;
            }
        }
    }
    table.end()?;
    let series = |name: String, engine: &str, of: fn(&Row) -> f64| Series {
        name,
        points: rows
            .iter()
            .filter(|row| row.engine == engine)
            .map(|row| (f64::from(row.primitives), of(row)))
            .collect(),
    };
    let mut all = Vec::new();
    for kind in &options.engines {
        let name = kind.name();
        all.push(series(format!("{name}: frame"), name, |row| row.frame_ms));
        all.push(series(format!("{name}: load"), name, |row| row.load_ms));
    }
    if let Some(first) = options.engines.first() {
        let compile = |row: &Row| row.compile_ms;
        all.push(series("text to program".to_owned(), first.name(), compile));
    }
    Chart {
        title: "Cost against primitives, 640×360 with a shadow",
        across: "primitives",
        up: "ms",
        series: all,
    }
    .write(options.charts.as_deref(), "primitives.svg", form)
}
