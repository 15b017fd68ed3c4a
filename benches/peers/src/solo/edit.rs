//! Time from an edit to a frame: one primitive of many is moved in the text, or a live parameter is
//! changed.

use super::{SoloOptions, ms, check_patience, available_engines, scene};
use crate::clock::{median, timed};
use crate::contestant::sdfc::EngineScene;
use crate::model::BoxUnion;
use crate::report::{TableColumn, OutputFormat, BenchTable, note};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind};
use sdfc_runtime::settings::Overrides;
use serde::Serialize;

/// Returns the maximum number of primitives of the scene.
///
/// It is lower for generated source. Each edit compiles it again, and software drivers need minutes and
/// gigabytes for 1,000 primitives.
fn max_primitives(kind: EngineKind) -> u32 {
    match kind {
        EngineKind::Cpu | EngineKind::Interp | EngineKind::Reference => 1000,
        EngineKind::Wgsl => 100,
    }
}

/// Size of the picture in pixels.
const PICTURE_SIZE: [u32; 2] = [320, 180];

#[derive(Serialize)]
struct EditRow {
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

pub(super) fn run(options: &SoloOptions, format: OutputFormat) -> Result<(), String> {
    let table = BenchTable::new(
        "From an edit to a frame: 320×180, one light with a shadow",
        &[
            TableColumn::left("edit"),
            TableColumn::right("primitives"),
            TableColumn::left("engine"),
            TableColumn::right("compile, ms"),
            TableColumn::right("load, ms"),
            TableColumn::right("frame, ms"),
            TableColumn::right("pipelines made"),
        ],
        format,
    );
    table.begin()?;
    for mut engine in available_engines(&EngineKind::FAST) {
        let primitives = max_primitives(engine.kind()).min(options.most);
        for edit in [measure_moved_box, measure_changed_param] {
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

/// Times of successive edits, in milliseconds.
#[derive(Default)]
struct EditTimes {
    compile: Vec<f64>,
    load: Vec<f64>,
    frame: Vec<f64>,
}

impl EditTimes {
    /// Adds the times of an edit.
    fn add(&mut self, compile: f64, load: f64, frame: f64) {
        self.compile.push(compile);
        self.load.push(load);
        self.frame.push(frame);
    }

    /// Reports whether enough edits were measured.
    fn is_complete(&self, options: &SoloOptions) -> bool {
        let all_times = [&self.compile, &self.load, &self.frame];
        let spent_ms: f64 = all_times.into_iter().flatten().sum();
        self.frame.len() >= options.rounds.max(1) || spent_ms > options.patience * 1e3
    }

    fn row(&self, edit: &'static str, primitives: u32, engine: &dyn Engine, pipelines_before: u64) -> EditRow {
        EditRow {
            measured: "edit",
            edit,
            engine: engine.kind().name(),
            device: engine.device(),
            primitives,
            size: PICTURE_SIZE,
            compile_ms: median(&self.compile),
            load_ms: median(&self.load),
            frame_ms: median(&self.frame),
            pipelines: engine.pipelines_created() - pipelines_before,
        }
    }
}

/// Draws the loaded scene.
fn draw(engine: &mut dyn Engine, compiled: &EngineScene) -> Result<(), String> {
    let settings = compiled.settings(&Overrides {
        size: Some(PICTURE_SIZE),
        ..Overrides::default()
    })?;
    let frame = engine.render(&settings, &|_| {});
    frame.map(drop).map_err(|error| error.to_string())
}

/// Measures edits that move a box: the text is compiled again.
fn measure_moved_box(primitives: u32, engine: &mut dyn Engine, options: &SoloOptions) -> Result<EditRow, String> {
    let mut boxes = BoxUnion::new(primitives);
    let kind = engine.kind();
    let compile = |text: &str| EngineScene::from_text(text, &PassOptions::default(), kind);
    let first = compile(&scene::text(&boxes))?;
    engine
        .load(&first.scene_input())
        .map_err(|error| error.to_string())?;
    let (drawn, first_ms) = timed(|| draw(engine, &first));
    drawn?;
    check_patience(first_ms, options)?;
    let pipelines_before = engine.pipelines_created();
    let mut times = EditTimes::default();
    while !times.is_complete(options) {
        boxes.nudge(times.frame.len() % boxes.len());
        let text = scene::text(&boxes);
        let (compiled, compile_ms) = timed(|| compile(&text));
        let compiled = compiled?;
        let (loaded, load_ms) = timed(|| engine.load(&compiled.scene_input()));
        loaded.map_err(|error| error.to_string())?;
        let (drawn, frame_ms) = timed(|| draw(engine, &compiled));
        drawn?;
        times.add(compile_ms, load_ms, frame_ms);
    }
    Ok(times.row("a box is moved", primitives, engine, pipelines_before))
}

/// Measures edits that change a live parameter: numbers are computed again and written.
fn measure_changed_param(primitives: u32, engine: &mut dyn Engine, options: &SoloOptions) -> Result<EditRow, String> {
    let text = scene::with_param(&BoxUnion::new(primitives));
    let mut compiled = EngineScene::from_text(&text, &PassOptions::default(), engine.kind())?;
    engine
        .load(&compiled.scene_input())
        .map_err(|error| error.to_string())?;
    let (drawn, first_ms) = timed(|| draw(engine, &compiled));
    drawn?;
    check_patience(first_ms, options)?;
    let pipelines_before = engine.pipelines_created();
    let mut times = EditTimes::default();
    while !times.is_complete(options) {
        let value = 0.1 + 0.01 * (times.frame.len() + 1) as f64;
        let (updated, load_ms) = timed(|| {
            compiled.set_params(value);
            engine.update(compiled.module(), &compiled.uniform_values)
        });
        updated.map_err(|error| error.to_string())?;
        let (drawn, frame_ms) = timed(|| draw(engine, &compiled));
        drawn?;
        times.add(0.0, load_ms, frame_ms);
    }
    Ok(times.row("a param is changed", primitives, engine, pipelines_before))
}
