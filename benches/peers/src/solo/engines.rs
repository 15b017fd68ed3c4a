//! The engines against each other, on scenes of more and more primitives. On a GPU the first frame
//! has the making of kernels in it.

use super::{Options, ms, patient, present, scene, times};
use crate::clock::timed;
use crate::contestant::ours::Compiled;
use crate::model::Boxes;
use crate::report::{Column, Form, Table, note};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind};
use sdfc_runtime::settings::Overrides;
use serde::Serialize;

/// Small enough for software Vulkan.
const SIZE: [u32; 2] = [320, 180];
const COUNTS: [u32; 3] = [50, 300, 1000];

#[derive(Serialize)]
struct Row {
    measured: &'static str,
    engine: &'static str,
    device: String,
    primitives: u32,
    size: [u32; 2],
    first_ms: f64,
    load_ms: f64,
    frame_ms: f64,
}

pub(super) fn run(options: &Options, form: Form) -> Result<(), String> {
    let table = Table::new(
        "Engines: 320×180, one light with a shadow",
        &[
            Column::right("primitives"),
            Column::left("engine"),
            Column::right("first, ms"),
            Column::right("load, ms"),
            Column::right("frame, ms"),
            Column::left("device"),
        ],
        form,
    );
    table.begin()?;
    let counts = COUNTS.into_iter().filter(|&count| count <= options.most);
    let counts: Vec<u32> = counts.collect();
    for mut engine in present(&EngineKind::FAST) {
        for &primitives in &counts {
            let text = scene::text(&Boxes::new(primitives));
            let done = measured(&text, primitives, &mut *engine, options).and_then(|row| {
                let cells = [
                    primitives.to_string(),
                    row.engine.to_owned(),
                    ms(row.first_ms),
                    ms(row.load_ms),
                    ms(row.frame_ms),
                    row.device.clone(),
                ];
                table.row(&row, &cells)?;
                patient(row.frame_ms, options)
            });
            if let Err(problem) = done {
                let kind = engine.kind();
                note(&format!("{primitives} primitives on {kind}: {problem}"));
                break;
            }
        }
    }
    table.end()
}

fn measured(
    text: &str,
    primitives: u32,
    engine: &mut dyn Engine,
    options: &Options,
) -> Result<Row, String> {
    let compiled = Compiled::scene(text, &PassOptions::default(), engine.kind())?;
    let settings = compiled.settings(&Overrides {
        size: Some(SIZE),
        ..Overrides::default()
    })?;
    let (first, first_ms) = timed(|| {
        engine.load(&compiled.loaded())?;
        engine.render(&settings, &|_| {})
    });
    first.map_err(|error| error.to_string())?;
    let times = times(engine, &compiled, SIZE, options)?;
    Ok(Row {
        measured: "engines",
        engine: engine.kind().name(),
        device: engine.device(),
        primitives,
        size: SIZE,
        first_ms,
        load_ms: times.load,
        frame_ms: times.frame,
    })
}
