//! The report as one self-contained HTML file: charts are embedded, and nothing is loaded.

use super::BenchReport;
use super::chart::{Chart, ChartPoint, Series};
use super::markdown::{LEGEND, chosen_settings, provenance, ray_summary, suite_title};
use super::scene_report::SceneReport;
use super::table::{self, escaped};
use std::fmt::Write;

/// Returns the complete report.
pub(crate) fn page(report: &BenchReport) -> Result<String, String> {
    let mut text = String::from(HEAD);
    let _ = write!(
        text,
        "<h1>Speed against error</h1>\n<pre>{}</pre>\n<ul>\n",
        escaped(&report.command)
    );
    for line in provenance(report) {
        let _ = writeln!(text, "<li>{}</li>", escaped(&line));
    }
    let _ = write!(text, "</ul>\n<h2>{}</h2>\n", suite_title(report));
    text.push_str(&suite_charts(report)?);
    text.push_str("<details><summary>Terms</summary>\n");
    for paragraph in LEGEND {
        let _ = writeln!(text, "<p>{}</p>", code_spans(paragraph));
    }
    text.push_str("</details>\n");
    if !report.suite.steps.is_empty() {
        let rules = table::steps_table(&report.suite.steps);
        let _ = write!(
            text,
            "<h3>Relaxed steps against plain ones</h3>\n{}",
            rules.html()
        );
    }
    let choices: Vec<_> = chosen_settings(report).collect();
    if let (false, Some(pixels)) = (choices.is_empty(), report.tolerance) {
        let table = table::choices_table(choices.into_iter());
        let _ = write!(
            text,
            "<h3>The fastest that keeps an error of {pixels} px</h3>\n{}",
            table.html()
        );
    }
    for device in &report.devices {
        let rows = report.suite.rows.iter();
        let table = table::suite_table(rows.filter(|row| row.engine == device.engine));
        let _ = write!(text, "<h3>{}</h3>\n{}", device.engine, table.html());
    }
    text.push_str("<h2>Each scene</h2>\n");
    for scene in &report.scenes {
        let _ = write!(
            text,
            "<details><summary>{}</summary>\n<p>{}</p>\n{}{}</details>\n",
            escaped(&scene.scene),
            ray_summary(scene),
            scene_chart(report, scene)?,
            table::scene_table(scene.rows.iter()).html()
        );
    }
    text.push_str("</main>\n</body>\n</html>\n");
    Ok(text)
}

const HEAD: &str = "<!DOCTYPE html>
<html lang=\"en\">
<head>
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<title>sdfc: speed against error</title>
<style>
:root { color-scheme: light; }
body { margin: 0; background: #fff; color: #222; font: 15px/1.5 system-ui, sans-serif; }
main { max-width: 78rem; margin: 0 auto; padding: 1.5rem; }
h1, h2, h3 { line-height: 1.2; font-weight: 600; }
h2 { margin-top: 2.5rem; border-bottom: 1px solid #ddd; padding-bottom: 0.3rem; }
pre { background: #f5f5f3; padding: 0.7rem 1rem; overflow-x: auto; white-space: pre-wrap; }
.charts { display: flex; flex-wrap: wrap; gap: 1rem; }
svg { max-width: 100%; height: auto; border: 1px solid #e5e5e5; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: 0.2rem 0.6rem; text-align: right; white-space: nowrap; }
th { border-bottom: 1px solid #999; font-weight: 600; vertical-align: bottom; }
td { border-bottom: 1px solid #eee; }
.word { text-align: left; }
tr.marked td { background: #fbf4e4; font-weight: 600; }
summary { cursor: pointer; padding: 0.35rem 0; font-weight: 600; }
</style>
</head>
<body>
<main>
";

/// Returns the charts over all scenes.
fn suite_charts(report: &BenchReport) -> Result<String, String> {
    let series = |point: fn(&super::suite::SuiteRow) -> ChartPoint| -> Vec<Series> {
        let engine = |device: &super::EngineDevice| Series {
            name: device.engine,
            points: report
                .suite
                .rows
                .iter()
                .filter(|row| row.engine == device.engine)
                .map(point)
                .collect(),
        };
        report.devices.iter().map(engine).collect()
    };
    let charts = [
        Chart {
            title: "Time against error; lines are the Pareto fronts".to_owned(),
            x_label: "milliseconds per picture, mean of the scenes",
            y_label: "depth error p99, median of the scenes",
            series: series(|row| ChartPoint {
                cost: row.milliseconds,
                error: row.depth_p99,
                on_front: row.front_of_time,
                is_default: row.default,
            }),
        },
        Chart {
            title: "Work against error; lines are the Pareto fronts".to_owned(),
            x_label: "evaluations per pixel, mean of the scenes",
            y_label: "depth error p99, median of the scenes",
            series: series(|row| ChartPoint {
                cost: row.evaluations,
                error: row.depth_p99,
                on_front: row.front_of_evaluations,
                is_default: row.default,
            }),
        },
        Chart {
            title: "Work against visible difference".to_owned(),
            x_label: "evaluations per pixel, mean of the scenes",
            y_label: "ꟻLIP, mean of the scenes",
            series: series(|row| ChartPoint {
                cost: row.evaluations,
                error: row.picture,
                on_front: false,
                is_default: row.default,
            }),
        },
    ];
    let mut text = String::from("<div class=\"charts\">\n");
    for chart in charts {
        text.push_str(&chart.svg()?);
    }
    text.push_str("</div>\n");
    Ok(text)
}

/// Returns the chart of one scene.
fn scene_chart(report: &BenchReport, scene: &SceneReport) -> Result<String, String> {
    let engine = |device: &super::EngineDevice| Series {
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
    let chart = Chart {
        title: format!("{}: time against error", scene.scene),
        x_label: "milliseconds per picture",
        y_label: "depth error p99",
        series: report.devices.iter().map(engine).collect(),
    };
    chart.svg()
}

/// Converts a paragraph of Markdown, in which only code is marked.
fn code_spans(paragraph: &str) -> String {
    let parts = paragraph.split('`').enumerate();
    let render = |(index, part): (usize, &str)| match index % 2 {
        0 => escaped(part),
        _ => format!("<code>{}</code>", escaped(part)),
    };
    parts.map(render).collect()
}
