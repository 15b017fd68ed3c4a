//! The charts of a report.

use super::chart::{Chart, ChartPoint, Series};
use super::scene_report::SceneReport;
use super::suite::SuiteRow;
use super::{BenchReport, EngineDevice};

/// Returns the chart of all scenes: the time of each setting against its error.
pub(crate) fn time_against_error(report: &BenchReport) -> Chart {
    Chart {
        title: "Time against error; lines are the Pareto fronts".to_owned(),
        x_label: "milliseconds per picture, geometric mean of the scenes",
        y_label: "depth error p99, median of the scenes",
        series: suite_series(report, |row| ChartPoint {
            cost: row.milliseconds,
            error: row.depth_p99,
            on_front: row.front_of_time,
            is_default: row.default,
        }),
    }
}

/// Returns the charts of all scenes.
pub(super) fn of_suite(report: &BenchReport) -> [Chart; 3] {
    let work = Chart {
        title: "Work against error; lines are the Pareto fronts".to_owned(),
        x_label: "evaluations per pixel, mean of the scenes",
        y_label: "depth error p99, median of the scenes",
        series: suite_series(report, |row| ChartPoint {
            cost: row.evaluations,
            error: row.depth_p99,
            on_front: row.front_of_evaluations,
            is_default: row.default,
        }),
    };
    let visible = Chart {
        title: "Work against visible difference".to_owned(),
        x_label: "evaluations per pixel, mean of the scenes",
        y_label: "ꟻLIP, mean of the scenes",
        series: suite_series(report, |row| ChartPoint {
            cost: row.evaluations,
            error: row.picture,
            on_front: false,
            is_default: row.default,
        }),
    };
    [time_against_error(report), work, visible]
}

/// Returns the points of each engine.
fn suite_series(report: &BenchReport, point: fn(&SuiteRow) -> ChartPoint) -> Vec<Series> {
    let engine = |device: &EngineDevice| Series {
        name: device.engine,
        points: report.suite.of_engine(device.engine).map(point).collect(),
    };
    report.devices.iter().map(engine).collect()
}

/// Returns the chart of one scene.
pub(super) fn of_scene(report: &BenchReport, scene: &SceneReport) -> Chart {
    let engine = |device: &EngineDevice| Series {
        name: device.engine,
        points: scene
            .rows
            .iter()
            .filter(|row| row.engine == device.engine)
            .map(|row| ChartPoint {
                cost: row.measured.milliseconds,
                error: row.error(),
                on_front: row.front_of_time,
                is_default: row.default,
            })
            .collect(),
    };
    Chart {
        title: format!("{}: time against error", scene.scene),
        x_label: "milliseconds per picture",
        y_label: "depth error p99",
        series: report.devices.iter().map(engine).collect(),
    }
}
