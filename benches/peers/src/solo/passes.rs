//! The share of each optimizing pass: the same scene without it.

use super::{Options, ms, present, scene, times};
use crate::clock::repeated;
use crate::contestant::ours::Compiled;
use crate::model::Boxes;
use crate::report::{Column, Form, Table};
use sdfc_compiler::passes::{PASSES, PassOptions};
use serde::Serialize;

/// How many primitives the scene has, at most.
const PRIMITIVES: u32 = 300;
/// The size of the picture.
const SIZE: [u32; 2] = [320, 180];

#[derive(Serialize)]
struct Row {
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

pub(super) fn run(options: &Options, form: Form) -> Result<(), String> {
    let table = Table::new(
        "Passes: 320×180, the same scene with a pass left out",
        &[
            Column::left("without"),
            Column::left("engine"),
            Column::right("instructions"),
            Column::right("compile, ms"),
            Column::right("load, ms"),
            Column::right("frame, ms"),
        ],
        form,
    );
    table.begin()?;
    let primitives = PRIMITIVES.min(options.most);
    let text = scene::text(&Boxes::new(primitives));
    for mut engine in present(&options.engines) {
        let each = PASSES.iter().map(|pass| (pass.name, false));
        let all = std::iter::once(("none", false))
            .chain(each)
            .chain([("all", true)]);
        for (name, none) in all {
            let passes = PassOptions {
                none,
                without: vec![name.to_owned()],
            };
            let compile = || Compiled::scene(&text, &passes, engine.kind());
            let compiled = compile()?;
            let compile_ms = repeated(options.rounds, options.patience / 4.0, || {
                compile().map(drop)
            })?;
            let times = times(&mut *engine, &compiled, SIZE, options)?;
            let row = Row {
                measured: "passes",
                without: name,
                engine: engine.kind().name(),
                primitives,
                size: SIZE,
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
