//! Conclusions from the measurements, in a few sentences.

use super::BenchReport;
use super::measure::SettingRow;
use super::suite::SuiteRow;
use super::table::{fraction, number};

/// Minimum share of the time that a setting must save to be called faster: less is noise.
const MIN_SAVED: f64 = 0.03;

/// Returns the findings, as Markdown in which only code is marked.
pub(super) fn findings(report: &BenchReport) -> Vec<String> {
    let mut lines = Vec::new();
    let engines = || report.devices.iter().map(|device| device.engine);
    lines.extend(engines().filter_map(|engine| default_setting(report, engine)));
    lines.extend(engines().filter_map(|engine| fastest_setting(report, engine)));
    lines.extend(engines().next().and_then(|engine| normals(report, engine)));
    lines.extend(
        engines()
            .next()
            .and_then(|engine| relaxation(report, engine)),
    );
    lines.extend(engines().next().and_then(|engine| cells(report, engine)));
    lines.extend(least_accurate(report));
    lines.push(proofs(report));
    lines
}

/// Returns the default of an engine over all scenes.
fn default_row<'a>(report: &'a BenchReport, engine: &str) -> Option<&'a SuiteRow> {
    report.suite.of_engine(engine).find(|row| row.default)
}

/// Returns a setting of an engine, if all scenes were drawn with it.
fn setting<'a>(report: &'a BenchReport, engine: &str, name: &str) -> Option<&'a SuiteRow> {
    let mut rows = report.suite.of_engine(engine);
    rows.find(|row| row.setting == name && row.scenes == report.scenes.len())
}

fn default_setting(report: &BenchReport, engine: &str) -> Option<String> {
    let row = default_row(report, engine)?;
    Some(format!(
        "The default on {engine}: {} ms a picture. Of a million rays {} hit wrongly or miss, {} away from \
         silhouettes, as {} sampled ones let expect. 99 % of the depths are right to {} of the depth (in the worst \
         scene {}).",
        number(row.milliseconds),
        number(per_million(row, row.mismatches)),
        number(per_million(row, row.mismatches_inside)),
        sampled(report),
        fraction(row.depth_p99),
        fraction(row.depth_p99_worst),
    ))
}

fn per_million(row: &SuiteRow, count: usize) -> f64 {
    1e6 * count as f64 / row.pixels.max(1) as f64
}

fn fastest_setting(report: &BenchReport, engine: &str) -> Option<String> {
    let default = default_row(report, engine)?;
    let rows = report.suite.of_engine(engine);
    let complete = rows.filter(|row| row.scenes == default.scenes);
    let fastest = complete.min_by(|a, b| a.milliseconds.total_cmp(&b.milliseconds))?;
    let ratio = fastest.milliseconds / default.milliseconds;
    if ratio > 1.0 - MIN_SAVED {
        return Some(format!(
            "No setting on {engine} is faster than the default by more than {} %.",
            number(100.0 * MIN_SAVED)
        ));
    }
    Some(format!(
        "The fastest on {engine} is `{}`: {} of the time of the default, with {} wrong rays of a million \
         and ꟻLIP {:.4} instead of {:.4}.",
        fastest.setting,
        number(ratio),
        number(per_million(fastest, fastest.mismatches)),
        fastest.picture,
        default.picture,
    ))
}

fn normals(report: &BenchReport, engine: &str) -> Option<String> {
    let exact = default_row(report, engine)?;
    let others = ["tetrahedron", "central", "forward"];
    let others = others.map(|name| setting(report, engine, &format!("normals {name}")));
    let others: Vec<String> = others
        .into_iter()
        .flatten()
        .map(|row| {
            format!(
                "`{}` takes {} of the time and is off by {}°",
                row.setting,
                number(row.milliseconds / exact.milliseconds),
                number(row.normals_p99)
            )
        })
        .collect();
    (!others.is_empty()).then(|| {
        format!(
            "Exact normals on {engine} are off by at most {}° at 99 % of the smooth pixels; {}.",
            number(exact.normals_p99),
            others.join(", ")
        )
    })
}

fn relaxation(report: &BenchReport, engine: &str) -> Option<String> {
    let mut rules = report.suite.steps.iter();
    let rule = rules.find(|rule| rule.engine == engine)?;
    Some(format!(
        "Relaxed steps on {engine} save {} % of the evaluations along rays and take {} of the time of plain \
         ones; wrong rays: {} instead of {}.",
        number(rule.saved_percent),
        number(rule.relaxed.milliseconds / rule.plain.milliseconds),
        rule.relaxed.mismatches,
        rule.plain.mismatches,
    ))
}

fn cells(report: &BenchReport, engine: &str) -> Option<String> {
    let mut ratios: Vec<(f64, &str)> = Vec::new();
    for scene in &report.scenes {
        let find = |test: &dyn Fn(&SettingRow) -> bool| {
            let mut rows = scene.rows.iter();
            rows.find(|row| row.engine == engine && test(row))
        };
        let with = find(&|row| row.default);
        let without = find(&|row| row.setting == "no cells");
        if let (Some(with), Some(without)) = (with, without) {
            let ratio = with.measured.milliseconds / without.measured.milliseconds;
            ratios.push((ratio, &scene.scene));
        }
    }
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (best, worst) = (ratios.first()?, ratios.last()?);
    let mean = ratios.iter().map(|(ratio, _)| ratio.ln()).sum::<f64>() / ratios.len() as f64;
    let share = number(mean.exp());
    let spread = match ratios.len() {
        1 => String::new(),
        _ => {
            let [low, high] =
                [best, worst].map(|(ratio, scene)| format!("{} ({scene})", number(*ratio)));
            format!(", from {low} to {high}")
        }
    };
    Some(format!(
        "Cells on {engine} take {share} of the time without them{spread}."
    ))
}

fn least_accurate(report: &BenchReport) -> Option<String> {
    if report.scenes.len() < 2 {
        return None;
    }
    let rows = report.scenes.iter().flat_map(|scene| {
        let defaults = scene.rows.iter().filter(|row| row.default);
        defaults.map(move |row| (scene, row))
    });
    let (scene, row) = rows.max_by(|a, b| {
        let key = |row: &SettingRow| row.measured.errors.mismatches_inside;
        (key(a.1).cmp(&key(b.1))).then(a.1.error().total_cmp(&b.1.error()))
    })?;
    let errors = &row.measured.errors;
    Some(format!(
        "The least accurate picture of the default is {} on {}: {} of {} rays are wrong away from silhouettes, \
         99 % of the depths are right to {}.",
        scene.scene,
        row.engine,
        errors.mismatches_inside,
        errors.pixels,
        fraction(row.error()),
    ))
}

/// Returns the number of pixels in all samples.
fn sampled(report: &BenchReport) -> usize {
    report.scenes.iter().map(|scene| scene.truth.sampled).sum()
}

fn proofs(report: &BenchReport) -> String {
    let undecided = report.scenes.iter().map(|scene| scene.truth.undecided);
    let (sampled, undecided) = (sampled(report), undecided.sum::<usize>());
    if undecided == 0 {
        return format!("The true ends of all {sampled} sampled rays are proved.");
    }
    format!(
        "Of {sampled} sampled rays, the ends of {undecided} are not proved ({} %); most pass close to silhouettes.",
        number(100.0 * undecided as f64 / sampled.max(1) as f64)
    )
}
