//! Measurements of a scene: all settings on all engines, against one truth.

use super::EngineDevice;
use super::measure::{Baseline, Measurement, SettingRow, timed};
use super::pareto::pareto_front;
use super::tolerance::{ChosenSetting, choose};
use super::variants::{RenderSettingsVariant, sweep};
use crate::engine::{self, ArithmeticArgs};
use crate::failure::Failure;
use crate::scene::{self, BuildArgs, OpenedScene, lod};
use crate::terminal::Terminal;
use sdfc_runtime::engine::{Engine, EngineKind};
use sdfc_runtime::reference::{Outcome, PixelSample, TraceOptions, TruePixel, trace_sample};
use sdfc_runtime::render::{Image, RenderSettings};
use sdfc_runtime::settings::{CameraChanges, Overrides, resolve};
use serde::Serialize;
use std::path::Path;

/// Options of measurements.
#[derive(Clone, Debug)]
pub(crate) struct MeasureOptions {
    /// Width of the pictures in pixels; their shape is that of the scene.
    pub(crate) width: u32,
    /// Minimum number of pixels whose rays are proved, or all of a picture that has fewer.
    pub(crate) samples: usize,
    /// Maximum number of pictures in the median of a time.
    pub(crate) rounds: usize,
    /// The requested error of settings, in pixels.
    pub(crate) tolerance: Option<f64>,
    /// Changes of the scenes' cameras.
    pub(crate) camera_changes: CameraChanges,
}

/// Measurements of a scene.
#[derive(Debug, Serialize)]
pub(crate) struct SceneReport {
    /// Its path.
    pub(crate) scene: String,
    /// Width and height of the pictures.
    pub(crate) size: [u32; 2],
    /// Summary of its rays.
    pub(crate) truth: TruthSummary,
    /// Each setting on each engine.
    pub(crate) rows: Vec<SettingRow>,
    /// The chosen setting on each engine, for a requested error.
    pub(crate) choices: Vec<ChosenSetting>,
}

/// Results of the reference for a sample of a scene's pixels.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct TruthSummary {
    /// Number of pixels in the sample.
    pub(crate) sampled: usize,
    /// Number of those whose rays are proved to hit.
    pub(crate) hits: usize,
    /// Number of those whose rays are proved to miss.
    pub(crate) misses: usize,
    /// Number of the others.
    pub(crate) undecided: usize,
    /// Evaluations of the field on intervals, per ray.
    pub(crate) evaluations: f64,
    /// Its duration.
    pub(crate) milliseconds: f64,
}

/// Measures a scene. `report_progress` receives the finished fraction of the work.
pub(crate) fn measure_scene(
    path: &Path,
    build: &BuildArgs,
    engines: &mut [Box<dyn Engine>],
    options: &MeasureOptions,
    terminal: &Terminal,
    report_progress: &dyn Fn(f32),
) -> Result<SceneReport, Failure> {
    let build = &build.for_camera(&options.camera_changes);
    let opened = scene::open(path, build, terminal)?;
    let settings = settings(path, &opened, options)?;
    let finest = finest(&opened, &settings)?;
    let size = settings.size.map(|side| side as usize);
    let sample = PixelSample::stratified(size, &finest.depth, options.samples);
    let (truth, milliseconds) = timed(|| {
        trace_sample(
            opened.module(),
            &settings,
            &sample,
            &TraceOptions::default(),
        )
    });
    let count_outcomes = |test: fn(&TruePixel) -> bool| {
        let pixels = truth.pixels.iter();
        pixels.filter(|pixel| test(pixel)).count()
    };
    let summary = TruthSummary {
        sampled: truth.pixels.len(),
        hits: count_outcomes(|pixel| matches!(pixel.ray.outcome, Outcome::Hit { .. })),
        misses: count_outcomes(|pixel| matches!(pixel.ray.outcome, Outcome::Miss)),
        undecided: truth.undecided(),
        evaluations: truth.evaluations as f64 / truth.traced.max(1) as f64,
        milliseconds,
    };
    let baseline = Baseline {
        finest: finest.rgba8(),
        truth,
    };
    let job = SweepJob {
        path,
        build,
        settings: &settings,
        has_detail: lod::can_reduce_detail(path, build)?,
        rounds: options.rounds,
        baseline: &baseline,
    };
    let count = engines.len() as f32;
    let (mut rows, mut choices) = (Vec::new(), Vec::new());
    for (index, engine) in engines.iter_mut().enumerate() {
        let report_engine = |fraction: f32| report_progress((index as f32 + fraction) / count);
        let measured = job.run_on(&mut **engine, &report_engine)?;
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

/// Returns the settings of a picture with one sample per pixel.
fn settings(
    path: &Path,
    opened: &OpenedScene,
    options: &MeasureOptions,
) -> Result<RenderSettings, Failure> {
    let overrides = Overrides {
        camera_changes: options.camera_changes.clone(),
        ..Overrides::default()
    };
    let width = options.width;
    let input_error = |problem: String| Failure::Input(format!("{}: {problem}", path.display()));
    let settings = resolve(opened.module(), &opened.uniform_values, &overrides)
        .map_err(|error| input_error(error.to_string()))?;
    if settings.is_2d {
        return Err(input_error(
            "a 2-D shape has no depth that could be wrong".to_owned(),
        ));
    }
    let [scene_width, height] = settings.size.map(u64::from);
    let height = (u64::from(width) * height / scene_width.max(1)).clamp(1, 4 * u64::from(width));
    Ok(RenderSettings {
        size: [width, height as u32],
        aa: 1,
        ..settings
    })
}

/// Returns the picture with which others are compared.
fn finest(opened: &OpenedScene, settings: &RenderSettings) -> Result<Image, Failure> {
    let mut cpu = engine::open(EngineKind::Cpu, ArithmeticArgs::default())?;
    engine::load(&mut *cpu, opened)?;
    let settings = RenderSettingsVariant::finest().applied(settings);
    cpu.render(&settings, &|_| {}).map_err(engine::to_failure)
}

/// The work for each engine.
struct SweepJob<'a> {
    path: &'a Path,
    build: &'a BuildArgs,
    settings: &'a RenderSettings,
    has_detail: bool,
    rounds: usize,
    baseline: &'a Baseline,
}

impl SweepJob<'_> {
    /// Measures all settings on one engine.
    fn run_on(
        &self,
        engine: &mut dyn Engine,
        report_progress: &dyn Fn(f32),
    ) -> Result<Vec<SettingRow>, Failure> {
        let build = self.build.for_engine(engine);
        let default = RenderSettingsVariant::from_settings(self.settings);
        let mut sweep = sweep(default, engine.kind(), self.has_detail);
        let count = sweep.len() as f32;
        let mut rows = Vec::new();
        // Settings with the same compiled scene are measured together: they are grouped by their detail, and
        // otherwise in order.
        while let Some(first) = sweep.first() {
            let lod = first.lod;
            let scene = match lod {
                None => scene::unwrap_reported(scene::compile(
                    self.path,
                    scene::read(self.path)?,
                    &build,
                )?)?,
                Some(pixels) => lod::recompile_for_view(self.path, &build, self.settings, pixels)?,
            };
            engine::load(engine, &scene)?;
            let (same_lod, others) = sweep.into_iter().partition(|variant| variant.lod == lod);
            sweep = others;
            let same_lod: Vec<RenderSettingsVariant> = same_lod;
            for variant in same_lod {
                let settings = variant.applied(self.settings);
                let measured = self.baseline.measure(engine, &settings, self.rounds);
                rows.push(SettingRow {
                    engine: engine.kind().name(),
                    setting: variant.label(&default),
                    default: variant == default,
                    knobs: variant,
                    front_of_time: false,
                    front_of_evaluations: false,
                    measured: measured.map_err(engine::to_failure)?,
                });
                report_progress(rows.len() as f32 / count);
            }
        }
        mark_fronts(&mut rows);
        Ok(rows)
    }
}

/// Marks the rows of one engine that are on its fronts.
fn mark_fronts(rows: &mut [SettingRow]) {
    let front_by = |rows: &[SettingRow], cost: fn(&Measurement) -> f64| {
        let pairs: Vec<(f64, f64)> = rows
            .iter()
            .map(|row| (cost(&row.measured), row.error()))
            .collect();
        pareto_front(&pairs)
    };
    let time_front = front_by(rows, |measured| measured.milliseconds);
    let evaluations_front = front_by(rows, |measured| measured.evaluations);
    for ((row, time), evaluations) in rows.iter_mut().zip(time_front).zip(evaluations_front) {
        row.front_of_time = time;
        row.front_of_evaluations = evaluations;
    }
}

/// Returns the device of each engine.
pub(crate) fn devices(engines: &[Box<dyn Engine>]) -> Vec<EngineDevice> {
    let device = |engine: &dyn Engine| EngineDevice {
        engine: engine.kind().name(),
        device: engine.device(),
    };
    engines.iter().map(|engine| device(&**engine)).collect()
}
