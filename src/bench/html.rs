//! The report as one self-contained HTML file: charts are embedded, and nothing is loaded.

use super::BenchReport;
use super::chart::Chart;
use super::charts;
use super::findings::findings;
use super::markdown::{LEGEND, chosen_settings, provenance, ray_summary, suite_title};
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
    text.push_str("<ul>\n");
    for finding in findings(report) {
        let _ = writeln!(text, "<li>{}</li>", code_spans(&finding));
    }
    text.push_str("</ul>\n");
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
        let table = table::suite_table(report.suite.of_engine(device.engine));
        let _ = write!(text, "<h3>{}</h3>\n{}", device.engine, table.html());
    }
    text.push_str("<h2>Each scene</h2>\n");
    for scene in &report.scenes {
        let _ = write!(
            text,
            "<details><summary>{}</summary>\n<p>{}</p>\n{}{}</details>\n",
            escaped(&scene.scene),
            ray_summary(scene),
            embedded(&charts::of_scene(report, scene))?,
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
    let mut text = String::from("<div class=\"charts\">\n");
    for chart in charts::of_suite(report) {
        text.push_str(&embedded(&chart)?);
    }
    text.push_str("</div>\n");
    Ok(text)
}

/// Returns a chart within HTML, where the namespace is implied.
fn embedded(chart: &Chart) -> Result<String, String> {
    let svg = chart.svg()?;
    Ok(svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", ""))
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
