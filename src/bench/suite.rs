//! Each setting over all scenes.

use super::measure::SettingRow;
use super::measure::median;
use super::pareto::pareto_front;
use super::scene_report::SceneReport;
use serde::Serialize;

/// Measurements of all scenes together.
#[derive(Debug, Serialize)]
pub(crate) struct Suite {
    /// Each setting on each engine.
    pub(crate) rows: Vec<SuiteRow>,
    /// Gain of relaxed steps.
    pub(crate) steps: Vec<StepRule>,
}

/// A setting on an engine, over all scenes that were drawn with it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SuiteRow {
    /// Name of the engine.
    pub(crate) engine: &'static str,
    /// Differences of the setting from the scenes' own.
    pub(crate) setting: String,
    /// True for the scenes' own.
    pub(crate) default: bool,
    /// Number of scenes drawn with it.
    pub(crate) scenes: usize,
    /// Number of pixels in those pictures.
    pub(crate) pixels: usize,
    /// True if nothing on this engine, with as many scenes, is both faster and nearer to the truth.
    pub(crate) front_of_time: bool,
    /// True if nothing on this engine, with as many scenes, takes fewer evaluations and is nearer to the
    /// truth.
    pub(crate) front_of_evaluations: bool,
    /// Geometric mean of the times of a picture.
    pub(crate) milliseconds: f64,
    /// Mean number of evaluations per pixel.
    pub(crate) evaluations: f64,
    /// Mean number of those along rays.
    pub(crate) ray_evaluations: f64,
    /// Number of rays that wrongly hit or miss.
    pub(crate) mismatches: usize,
    /// Number of those away from silhouettes.
    pub(crate) mismatches_inside: usize,
    /// Median over scenes of the median depth error, as a fraction of the depth.
    pub(crate) depth_p50: f64,
    /// Median over scenes of the 99th percentile.
    pub(crate) depth_p99: f64,
    /// The largest 99th percentile of a scene.
    pub(crate) depth_p99_worst: f64,
    /// The largest error of a depth.
    pub(crate) depth_max: f64,
    /// Median over scenes of the 99th percentile of depth errors at smooth pixels, in units of the last
    /// place.
    pub(crate) ulps_p99: f64,
    /// The largest of these percentiles, as a fraction of the depth.
    pub(crate) smooth_p99_worst: f64,
    /// Median over scenes of the median error of normals, in degrees.
    pub(crate) normals_p50: f64,
    /// Median over scenes of the 99th percentile.
    pub(crate) normals_p99: f64,
    /// Number of pixels that are not numbers.
    pub(crate) nans: usize,
    /// Number of rays that ran out of steps.
    pub(crate) step_caps: usize,
    /// Number of rays without a hit up to their maximum length.
    pub(crate) at_far: usize,
    /// Mean perceptual difference from the pictures with the finest settings.
    pub(crate) picture: f64,
}

/// Relaxed and plain steps, on one engine.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct StepRule {
    /// Name of the engine.
    pub(crate) engine: &'static str,
    /// The setting with relaxed steps.
    pub(crate) relaxed: SuiteRow,
    /// Its counterpart with plain steps.
    pub(crate) plain: SuiteRow,
    /// Percentage of evaluations along rays that relaxed steps save.
    pub(crate) saved_percent: f64,
}

impl Suite {
    /// Returns the settings of one engine.
    pub(crate) fn of_engine(&self, engine: &str) -> impl Iterator<Item = &SuiteRow> {
        self.rows.iter().filter(move |row| row.engine == engine)
    }

    /// Returns the suite of these scenes.
    pub(crate) fn from_scenes(scenes: &[SceneReport]) -> Self {
        let mut kinds: Vec<(&'static str, &str)> = Vec::new();
        for row in scenes.iter().flat_map(|scene| &scene.rows) {
            let kind = (row.engine, row.setting.as_str());
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
        let mut rows: Vec<SuiteRow> = Vec::new();
        for (engine, setting) in kinds {
            let matches = |row: &&SettingRow| row.engine == engine && row.setting == setting;
            let setting_rows: Vec<&SettingRow> = scenes
                .iter()
                .flat_map(|scene| &scene.rows)
                .filter(matches)
                .collect();
            rows.push(row(engine, setting, &setting_rows));
        }
        mark_fronts(&mut rows, scenes.len());
        Self {
            steps: step_rules(&rows),
            rows,
        }
    }
}

fn row(engine: &'static str, setting: &str, rows: &[&SettingRow]) -> SuiteRow {
    let count = rows.len().max(1) as f64;
    let mean =
        |value: fn(&SettingRow) -> f64| rows.iter().map(|row| value(row)).sum::<f64>() / count;
    let middle =
        |value: fn(&SettingRow) -> f64| median(rows.iter().map(|row| value(row)).collect());
    let worst =
        |value: fn(&SettingRow) -> f64| rows.iter().map(|row| value(row)).fold(0.0, f64::max);
    let sum = |value: fn(&SettingRow) -> usize| rows.iter().map(|row| value(row)).sum();
    SuiteRow {
        engine,
        setting: setting.to_owned(),
        default: rows.iter().all(|row| row.default),
        scenes: rows.len(),
        pixels: sum(|row| row.measured.errors.pixels),
        front_of_time: false,
        front_of_evaluations: false,
        milliseconds: mean(|row| row.measured.milliseconds.ln()).exp(),
        evaluations: mean(|row| row.measured.evaluations),
        ray_evaluations: mean(|row| row.measured.ray_evaluations),
        mismatches: sum(|row| row.measured.errors.mismatches()),
        mismatches_inside: sum(|row| row.measured.errors.mismatches_inside),
        depth_p50: middle(|row| row.measured.errors.depth.p50),
        depth_p99: middle(SettingRow::error),
        depth_p99_worst: worst(SettingRow::error),
        depth_max: worst(|row| row.measured.errors.depth.max),
        ulps_p99: middle(|row| row.measured.errors.depth_ulps.p99),
        smooth_p99_worst: worst(|row| row.measured.errors.depth_smooth.p99),
        normals_p50: middle(|row| row.measured.errors.normals.p50),
        normals_p99: middle(|row| row.measured.errors.normals.p99),
        nans: sum(|row| row.measured.errors.nans),
        step_caps: sum(|row| row.measured.errors.step_caps),
        at_far: sum(|row| row.measured.at_far as usize),
        picture: mean(|row| row.measured.picture.mean),
    }
}

/// Marks the fronts of each engine, among the settings with which all scenes were drawn.
fn mark_fronts(rows: &mut [SuiteRow], scenes: usize) {
    let mut engines: Vec<&'static str> = rows.iter().map(|row| row.engine).collect();
    engines.dedup();
    for engine in engines {
        let these: Vec<usize> = (0..rows.len())
            .filter(|&index| rows[index].engine == engine && rows[index].scenes == scenes)
            .collect();
        let front_by = |cost: fn(&SuiteRow) -> f64| {
            let pairs: Vec<(f64, f64)> = these
                .iter()
                .map(|&index| (cost(&rows[index]), rows[index].depth_p99))
                .collect();
            pareto_front(&pairs)
        };
        let (time, evaluations) = (
            front_by(|row| row.milliseconds),
            front_by(|row| row.evaluations),
        );
        for ((index, time), evaluations) in these.into_iter().zip(time).zip(evaluations) {
            rows[index].front_of_time = time;
            rows[index].front_of_evaluations = evaluations;
        }
    }
}

/// Returns the pairs of rows that differ in the step rule alone.
fn step_rules(rows: &[SuiteRow]) -> Vec<StepRule> {
    let pairs = [
        ("default", "plain steps"),
        ("no cells", "plain steps, no cells"),
    ];
    let mut rules = Vec::new();
    for relaxed in rows {
        let with =
            |(first, second): &(&str, &'static str)| (*first == relaxed.setting).then_some(*second);
        let plain = pairs.iter().find_map(with).and_then(|setting| {
            rows.iter()
                .find(|row| row.engine == relaxed.engine && row.setting == setting)
        });
        if let Some(plain) = plain {
            rules.push(StepRule {
                engine: relaxed.engine,
                saved_percent: 100.0 * (1.0 - relaxed.ray_evaluations / plain.ray_evaluations),
                relaxed: relaxed.clone(),
                plain: plain.clone(),
            });
        }
    }
    rules
}
