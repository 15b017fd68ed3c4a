//! Each setting over all scenes.

use super::front::front;
use super::measure::median;
use super::study::{Row, SceneReport};
use serde::Serialize;

/// What was measured of all scenes together.
#[derive(Debug, Serialize)]
pub(crate) struct Suite {
    /// Each setting on each engine.
    pub(crate) rows: Vec<SuiteRow>,
    /// What relaxed steps gain.
    pub(crate) steps: Vec<StepRule>,
}

/// A setting on an engine, over all scenes that were drawn with it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SuiteRow {
    /// The engine's name.
    pub(crate) engine: &'static str,
    /// What of the setting is not the scenes' own.
    pub(crate) setting: String,
    /// Whether it is the scenes' own.
    pub(crate) default: bool,
    /// How many scenes were drawn with it.
    pub(crate) scenes: usize,
    /// Whether nothing on this engine, with as many scenes, is both faster and nearer to the truth.
    pub(crate) front_of_time: bool,
    /// The same of evaluations.
    pub(crate) front_of_evaluations: bool,
    /// The mean time of a picture.
    pub(crate) milliseconds: f64,
    /// The mean of evaluations per pixel.
    pub(crate) evaluations: f64,
    /// The mean of those along rays.
    pub(crate) ray_evaluations: f64,
    /// All rays that wrongly hit or miss.
    pub(crate) mismatches: usize,
    /// Those away from silhouettes.
    pub(crate) mismatches_inside: usize,
    /// The median over scenes of the error of half of the depths, as a share of the depth.
    pub(crate) depth_p50: f64,
    /// The median over scenes of the error of all but a hundredth.
    pub(crate) depth_p99: f64,
    /// The worst scene's.
    pub(crate) depth_p99_worst: f64,
    /// The largest error of a depth.
    pub(crate) depth_max: f64,
    /// The median over scenes of the error of all but a hundredth of the depths at smooth pixels, in
    /// units of the last place.
    pub(crate) ulps_p99: f64,
    /// The same as a share of the depth, in the worst scene.
    pub(crate) smooth_p99_worst: f64,
    /// The median over scenes of half of the normals' errors, in degrees.
    pub(crate) normals_p50: f64,
    /// The median over scenes of the error of all but a hundredth of the normals.
    pub(crate) normals_p99: f64,
    /// All pixels that are not numbers.
    pub(crate) nans: usize,
    /// All rays that ran out of steps.
    pub(crate) step_caps: usize,
    /// All rays that met nothing as far as they go.
    pub(crate) at_far: usize,
    /// The mean perceptual difference from the pictures with the finest settings.
    pub(crate) picture: f64,
}

/// Relaxed and plain steps, on one engine.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct StepRule {
    /// The engine's name.
    pub(crate) engine: &'static str,
    /// The setting with relaxed steps.
    pub(crate) relaxed: SuiteRow,
    /// The same with plain ones.
    pub(crate) plain: SuiteRow,
    /// How many of a hundred evaluations along rays relaxed steps save.
    pub(crate) saved_percent: f64,
}

impl Suite {
    /// Of these scenes.
    pub(crate) fn of(scenes: &[SceneReport]) -> Self {
        let mut kinds: Vec<(&'static str, &str)> = Vec::new();
        for row in scenes.iter().flat_map(|scene| &scene.rows) {
            let kind = (row.engine, row.setting.as_str());
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
        let mut rows: Vec<SuiteRow> = Vec::new();
        for (engine, setting) in kinds {
            let same = |row: &&Row| row.engine == engine && row.setting == setting;
            let all: Vec<&Row> = scenes
                .iter()
                .flat_map(|scene| &scene.rows)
                .filter(same)
                .collect();
            rows.push(row(engine, setting, &all));
        }
        mark_fronts(&mut rows, scenes.len());
        Self {
            steps: step_rules(&rows),
            rows,
        }
    }
}

fn row(engine: &'static str, setting: &str, all: &[&Row]) -> SuiteRow {
    let count = all.len().max(1) as f64;
    let mean = |of: fn(&Row) -> f64| all.iter().map(|row| of(row)).sum::<f64>() / count;
    let middle = |of: fn(&Row) -> f64| median(all.iter().map(|row| of(row)).collect());
    let worst = |of: fn(&Row) -> f64| all.iter().map(|row| of(row)).fold(0.0, f64::max);
    let sum = |of: fn(&Row) -> usize| all.iter().map(|row| of(row)).sum();
    SuiteRow {
        engine,
        setting: setting.to_owned(),
        default: all.iter().all(|row| row.default),
        scenes: all.len(),
        front_of_time: false,
        front_of_evaluations: false,
        milliseconds: mean(|row| row.measured.milliseconds),
        evaluations: mean(|row| row.measured.evaluations),
        ray_evaluations: mean(|row| row.measured.ray_evaluations),
        mismatches: sum(|row| row.measured.errors.mismatches()),
        mismatches_inside: sum(|row| row.measured.errors.mismatches_inside),
        depth_p50: middle(|row| row.measured.errors.depth.p50),
        depth_p99: middle(Row::error),
        depth_p99_worst: worst(Row::error),
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

/// Marks what is on the fronts of each engine, among the settings that all scenes were drawn with.
fn mark_fronts(rows: &mut [SuiteRow], scenes: usize) {
    let mut engines: Vec<&'static str> = rows.iter().map(|row| row.engine).collect();
    engines.dedup();
    for engine in engines {
        let these: Vec<usize> = (0..rows.len())
            .filter(|&at| rows[at].engine == engine && rows[at].scenes == scenes)
            .collect();
        let by = |cost: fn(&SuiteRow) -> f64| {
            let pairs: Vec<(f64, f64)> = these
                .iter()
                .map(|&at| (cost(&rows[at]), rows[at].depth_p99))
                .collect();
            front(&pairs)
        };
        let (time, evaluations) = (by(|row| row.milliseconds), by(|row| row.evaluations));
        for ((at, time), evaluations) in these.into_iter().zip(time).zip(evaluations) {
            rows[at].front_of_time = time;
            rows[at].front_of_evaluations = evaluations;
        }
    }
}

/// The pairs of rows that differ in the step rule alone.
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
