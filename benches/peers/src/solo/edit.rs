//! The time from an edit to a frame: one primitive of many is moved in the text, or a live param is
//! changed.

use super::{Options, ms, patient, present, scene};
use crate::clock::{median, timed};
use crate::contestant::ours::Compiled;
use crate::model::Boxes;
use crate::report::{Column, Form, Table, note};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind};
use sdfc_runtime::settings::Overrides;
use serde::Serialize;

/// How many primitives the scene has, at most. Of generated source it is fewer: each edit of it is
/// compiled again, and software drivers need minutes and gigabytes for a thousand.
fn primitives(kind: EngineKind) -> u32 {
    match kind {
        EngineKind::Cpu | EngineKind::Interp | EngineKind::Reference => 1000,
        EngineKind::Wgsl => 100,
    }
}

/// The size of the picture.
const SIZE: [u32; 2] = [320, 180];

#[derive(Serialize)]
struct Row {
    measured: &'static str,
    edit: &'static str,
    engine: &'static str,
    device: String,
    primitives: u32,
    size: [u32; 2],
    compile_ms: f64,
    load_ms: f64,
    frame_ms: f64,
    pipelines: u64,
}

pub(super) fn run(options: &Options, form: Form) -> Result<(), String> {
    let table = Table::new(
        "From an edit to a frame: 320×180, one light with a shadow",
        &[
            Column::left("edit"),
            Column::right("primitives"),
            Column::left("engine"),
            Column::right("compile, ms"),
            Column::right("load, ms"),
            Column::right("frame, ms"),
            Column::right("pipelines made"),
        ],
        form,
    );
    table.begin()?;
    for mut engine in present(&EngineKind::FAST) {
        let primitives = primitives(engine.kind()).min(options.most);
        for edit in [moved, changed] {
            match edit(primitives, &mut *engine, options) {
                Ok(row) => {
                    let cells = [
                        row.edit.to_owned(),
                        primitives.to_string(),
                        row.engine.to_owned(),
                        ms(row.compile_ms),
                        ms(row.load_ms),
                        ms(row.frame_ms),
                        row.pipelines.to_string(),
                    ];
                    table.row(&row, &cells)?;
                }
                Err(problem) => note(&format!("an edit on {}: {problem}", engine.kind())),
            }
        }
    }
    table.end()
}

/// The times of one edit after another.
#[derive(Default)]
struct Laps {
    compile: Vec<f64>,
    load: Vec<f64>,
    frame: Vec<f64>,
}

impl Laps {
    /// Adds the times of an edit.
    fn add(&mut self, compile: f64, load: f64, frame: f64) {
        self.compile.push(compile);
        self.load.push(load);
        self.frame.push(frame);
    }

    /// Whether there are enough.
    fn are_enough(&self, options: &Options) -> bool {
        let all = [&self.compile, &self.load, &self.frame];
        let spent: f64 = all.into_iter().flatten().sum();
        self.frame.len() >= options.rounds.max(1) || spent > options.patience * 1e3
    }

    fn row(&self, edit: &'static str, primitives: u32, engine: &dyn Engine, before: u64) -> Row {
        Row {
            measured: "edit",
            edit,
            engine: engine.kind().name(),
            device: engine.device(),
            primitives,
            size: SIZE,
            compile_ms: median(&self.compile),
            load_ms: median(&self.load),
            frame_ms: median(&self.frame),
            pipelines: engine.pipelines_created() - before,
        }
    }
}

/// Draws the scene that is loaded.
fn draw(engine: &mut dyn Engine, compiled: &Compiled) -> Result<(), String> {
    let settings = compiled.settings(&Overrides {
        size: Some(SIZE),
        ..Overrides::default()
    })?;
    let frame = engine.render(&settings, &|_| {});
    frame.map(drop).map_err(|error| error.to_string())
}

/// A box is moved: the text is compiled again.
fn moved(primitives: u32, engine: &mut dyn Engine, options: &Options) -> Result<Row, String> {
    let mut boxes = Boxes::new(primitives);
    let kind = engine.kind();
    let compile = |text: &str| Compiled::scene(text, &PassOptions::default(), kind);
    let first = compile(&scene::text(&boxes))?;
    engine
        .load(&first.loaded())
        .map_err(|error| error.to_string())?;
    let (drawn, first_ms) = timed(|| draw(engine, &first));
    drawn?;
    patient(first_ms, options)?;
    let before = engine.pipelines_created();
    let mut laps = Laps::default();
    while !laps.are_enough(options) {
        boxes.nudge(laps.frame.len() % boxes.len());
        let text = scene::text(&boxes);
        let (compiled, compile_ms) = timed(|| compile(&text));
        let compiled = compiled?;
        let (loaded, load_ms) = timed(|| engine.load(&compiled.loaded()));
        loaded.map_err(|error| error.to_string())?;
        let (drawn, frame_ms) = timed(|| draw(engine, &compiled));
        drawn?;
        laps.add(compile_ms, load_ms, frame_ms);
    }
    Ok(laps.row("a box is moved", primitives, engine, before))
}

/// A live param is changed: numbers are computed again and written.
fn changed(primitives: u32, engine: &mut dyn Engine, options: &Options) -> Result<Row, String> {
    let text = scene::with_param(&Boxes::new(primitives));
    let mut compiled = Compiled::scene(&text, &PassOptions::default(), engine.kind())?;
    engine
        .load(&compiled.loaded())
        .map_err(|error| error.to_string())?;
    let (drawn, first_ms) = timed(|| draw(engine, &compiled));
    drawn?;
    patient(first_ms, options)?;
    let before = engine.pipelines_created();
    let mut laps = Laps::default();
    while !laps.are_enough(options) {
        let value = 0.1 + 0.01 * (laps.frame.len() + 1) as f64;
        let (updated, load_ms) = timed(|| {
            compiled.set_params(value);
            engine.update(compiled.module(), &compiled.outputs)
        });
        updated.map_err(|error| error.to_string())?;
        let (drawn, frame_ms) = timed(|| draw(engine, &compiled));
        drawn?;
        laps.add(0.0, load_ms, frame_ms);
    }
    Ok(laps.row("a param is changed", primitives, engine, before))
}
