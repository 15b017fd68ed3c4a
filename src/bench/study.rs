//! A scene, measured: all settings on all engines, against one truth.

use super::Device;
use super::front::front;
use super::knobs::{Knobs, sweep};
use super::measure::{Measure, Measured, timed};
use super::tolerance::{Choice, choose};
use crate::engine::{self, Tier};
use crate::failure::Failure;
use crate::scene::{self, Build, Opened, detail};
use crate::terminal::Terminal;
use sdfc_runtime::engine::{Engine, EngineKind};
use sdfc_runtime::frame::RenderSettings;
use sdfc_runtime::reference::{self, trace};
use sdfc_runtime::settings::{Overrides, resolve};
use serde::Serialize;
use std::path::Path;

/// How scenes are measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Options {
    /// The width of the pictures in pixels; their shape is the scene's.
    pub(crate) width: u32,
    /// How many pictures a time is the median of, at most.
    pub(crate) rounds: usize,
    /// The error that settings are to keep, in pixels, where one is asked for.
    pub(crate) tolerance: Option<f64>,
}

/// What was measured of a scene.
#[derive(Debug, Serialize)]
pub(crate) struct SceneReport {
    /// Its path.
    pub(crate) scene: String,
    /// Width and height of the pictures.
    pub(crate) size: [u32; 2],
    /// What is known of its rays.
    pub(crate) truth: TruthSummary,
    /// Each setting on each engine.
    pub(crate) rows: Vec<Row>,
    /// What was taken on each engine, where an error was asked for.
    pub(crate) choices: Vec<Choice>,
}

/// What the reference says of a scene's rays.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct TruthSummary {
    /// How many are proved to hit.
    pub(crate) hits: usize,
    /// How many are proved to miss.
    pub(crate) misses: usize,
    /// How many are neither.
    pub(crate) undecided: usize,
    /// Evaluations of the field on intervals, per pixel.
    pub(crate) evaluations: f64,
    /// How long it took.
    pub(crate) milliseconds: f64,
}

/// A setting on an engine.
#[derive(Debug, Serialize)]
pub(crate) struct Row {
    /// The engine's name.
    pub(crate) engine: &'static str,
    /// What of the setting is not the default.
    pub(crate) setting: String,
    /// Whether it is the scene's own.
    pub(crate) default: bool,
    /// All of it.
    pub(crate) knobs: Knobs,
    /// Whether nothing on this engine is both faster and nearer to the truth.
    pub(crate) front_of_time: bool,
    /// Whether nothing on this engine takes fewer evaluations and is nearer to the truth.
    pub(crate) front_of_evaluations: bool,
    /// What was measured.
    #[serde(flatten)]
    pub(crate) measured: Measured,
}

impl Row {
    /// The error that fronts are about: all but a hundredth of the depths are off by less, as a share
    /// of the depth, silhouettes included.
    pub(crate) fn error(&self) -> f64 {
        self.measured.errors.depth.p99
    }
}

/// Measures a scene. `told` hears what share of the work is done.
pub(crate) fn study(
    path: &Path,
    build: &Build,
    engines: &mut [Box<dyn Engine>],
    options: &Options,
    terminal: &Terminal,
    told: &dyn Fn(f32),
) -> Result<SceneReport, Failure> {
    let opened = scene::open(path, build, terminal)?;
    let settings = settings(path, &opened, options.width)?;
    let (truth, milliseconds) =
        timed(|| trace(opened.module(), &settings, &reference::Options::default()));
    let pixels = truth.rays.len().max(1) as f64;
    let of = |test: fn(&reference::Outcome) -> bool| {
        let outcomes = truth.rays.iter().map(|ray| &ray.outcome);
        outcomes.filter(|outcome| test(outcome)).count()
    };
    let summary = TruthSummary {
        hits: of(|outcome| matches!(outcome, reference::Outcome::Hit { .. })),
        misses: of(|outcome| matches!(outcome, reference::Outcome::Miss)),
        undecided: truth.undecided(),
        evaluations: truth.evaluations as f64 / pixels,
        milliseconds,
    };
    let measure = Measure {
        finest: finest(&opened, &settings)?,
        truth,
    };
    let job = Job {
        path,
        build,
        settings: &settings,
        has_detail: detail::is_possible(path, build)?,
        rounds: options.rounds,
        measure: &measure,
    };
    let count = engines.len() as f32;
    let (mut rows, mut choices) = (Vec::new(), Vec::new());
    for (at, engine) in engines.iter_mut().enumerate() {
        let told = |share: f32| told((at as f32 + share) / count);
        let measured = job.on(&mut **engine, &told)?;
        choices.extend(
            options
                .tolerance
                .and_then(|pixels| choose(&measured, pixels)),
        );
        rows.extend(measured);
    }
    Ok(SceneReport {
        scene: path.display().to_string(),
        size: settings.size,
        truth: summary,
        rows,
        choices,
    })
}

/// The settings of a small picture, one sample per pixel.
fn settings(path: &Path, opened: &Opened, width: u32) -> Result<RenderSettings, Failure> {
    let wrong = |problem: String| Failure::Input(format!("{}: {problem}", path.display()));
    let settings = resolve(opened.module(), &opened.outputs, &Overrides::default())
        .map_err(|error| wrong(error.to_string()))?;
    if settings.plane {
        return Err(wrong(
            "a figure in the plane has no depth that could be wrong".to_owned(),
        ));
    }
    let [full, height] = settings.size.map(u64::from);
    let height = (u64::from(width) * height / full.max(1)).clamp(1, 4 * u64::from(width));
    Ok(RenderSettings {
        size: [width, height as u32],
        aa: 1,
        ..settings
    })
}

/// The bytes of the picture that others are compared with.
fn finest(opened: &Opened, settings: &RenderSettings) -> Result<Vec<u8>, Failure> {
    let mut cpu = engine::open(EngineKind::Cpu, Tier::default())?;
    engine::load(&mut *cpu, opened)?;
    let settings = Knobs::finest().applied(settings);
    let frame = cpu.render(&settings, &|_| {}).map_err(engine::failed)?;
    Ok(frame.rgba8())
}

/// What engines are asked to do.
struct Job<'a> {
    path: &'a Path,
    build: &'a Build,
    settings: &'a RenderSettings,
    has_detail: bool,
    rounds: usize,
    measure: &'a Measure,
}

impl Job<'_> {
    /// All settings on one engine.
    fn on(&self, engine: &mut dyn Engine, told: &dyn Fn(f32)) -> Result<Vec<Row>, Failure> {
        let build = self.build.for_engine(engine);
        let default = Knobs::of(self.settings);
        let mut sweep = sweep(default, engine.kind(), self.has_detail);
        let count = sweep.len() as f32;
        let mut rows = Vec::new();
        // What is compiled once is measured at once: settings are taken by their detail, and in
        // their order apart from that.
        while let Some(first) = sweep.first() {
            let lod = first.lod;
            let scene = match lod {
                None => scene::made(scene::compile(self.path, scene::read(self.path)?, &build)?)?,
                Some(pixels) => detail::seen(self.path, &build, self.settings, pixels)?,
            };
            engine::load(engine, &scene)?;
            let (these, others) = sweep.into_iter().partition(|knobs| knobs.lod == lod);
            sweep = others;
            let these: Vec<Knobs> = these;
            for knobs in these {
                let settings = knobs.applied(self.settings);
                let measured = self.measure.of(engine, &settings, self.rounds);
                rows.push(Row {
                    engine: engine.kind().name(),
                    setting: knobs.label(&default),
                    default: knobs == default,
                    knobs,
                    front_of_time: false,
                    front_of_evaluations: false,
                    measured: measured.map_err(engine::failed)?,
                });
                told(rows.len() as f32 / count);
            }
        }
        mark_fronts(&mut rows);
        Ok(rows)
    }
}

/// Marks which rows of one engine are on its fronts.
fn mark_fronts(rows: &mut [Row]) {
    let by = |rows: &[Row], cost: fn(&Measured) -> f64| {
        let pairs: Vec<(f64, f64)> = rows
            .iter()
            .map(|row| (cost(&row.measured), row.error()))
            .collect();
        front(&pairs)
    };
    let of_time = by(rows, |measured| measured.milliseconds);
    let of_evaluations = by(rows, |measured| measured.evaluations);
    for ((row, time), evaluations) in rows.iter_mut().zip(of_time).zip(of_evaluations) {
        row.front_of_time = time;
        row.front_of_evaluations = evaluations;
    }
}

/// What each engine runs on.
pub(crate) fn devices(engines: &[Box<dyn Engine>]) -> Vec<Device> {
    let device = |engine: &dyn Engine| Device {
        engine: engine.kind().name(),
        device: engine.device(),
    };
    engines.iter().map(|engine| device(&**engine)).collect()
}
