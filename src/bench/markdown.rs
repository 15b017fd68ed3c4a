//! The report as Markdown: all settings over all scenes, and for each scene the default and the settings on a
//! front.

use super::BenchReport;
use super::scene_report::SceneReport;
use super::table;
use sdfc_runtime::render::RenderSettings;
use std::fmt::Write;

/// Explanations of the words in the tables, a paragraph each.
pub(crate) const LEGEND: [&str; 6] = [
    "Errors are measured against the truth that the engine `reference` proves with intervals in double \
     precision. It traces one ray through the centre of each pixel, and undecided rays are left out. \
     The row `default` has the scene's own settings. Each other row changes the named setting only.",
    "`threshold` is the distance to a surface at which a ray starts to look for the root, as a fraction \
     of half a pixel. `plain steps` is sphere tracing without relaxation. `lod` simplifies details below \
     this number of pixels. `no cells` evaluates the whole program everywhere.",
    "`ms` is the median time of several pictures without the compilation of kernels. Each picture has a \
     slightly different camera, so that no result is reused. `evaluations/px` counts evaluations of the \
     field for rays, normals, shadows and occlusion. `on rays/px` counts those along primary rays only.",
    "`wrong rays` hit in the picture and miss in truth, or the reverse. `off silhouettes` counts those \
     of them away from silhouettes. `depth` is the relative error of the depth, including silhouettes. \
     `smooth` counts smooth pixels only. `normals` are angles at smooth pixels away from edges. `step cap` \
     counts rays that exceeded their steps. `far` counts those that ended at the maximum distance, where \
     the scene continues.",
    "`ꟻLIP` is the mean perceptual difference (Andersson and others, 2020) between the shaded picture \
     and one with the finest settings. It is between 0 (equal) and 1.",
    "A setting is on the `front` of time or of evaluations if no other on its engine has at most its cost \
     and at most its `depth p99`. Over all scenes, times and evaluations are means, rays are \
     sums, and errors are medians of the scenes.",
];

/// Returns the complete report.
pub(crate) fn page(report: &BenchReport) -> String {
    let mut text = String::from("# Speed against error\n\n");
    let _ = writeln!(text, "Made by\n\n```sh\n{}\n```\n", report.command);
    for line in provenance(report) {
        let _ = writeln!(text, "- {line}");
    }
    text.push('\n');
    for paragraph in LEGEND {
        let _ = writeln!(text, "{paragraph}\n");
    }
    if !report.suite.steps.is_empty() {
        let rules = table::steps_table(&report.suite.steps);
        let _ = writeln!(
            text,
            "## Relaxed steps against plain ones\n\n{}",
            rules.markdown()
        );
    }
    let choices: Vec<_> = chosen_settings(report).collect();
    if let (false, Some(pixels)) = (choices.is_empty(), report.tolerance) {
        let table = table::choices_table(choices.into_iter());
        let _ = writeln!(
            text,
            "## The fastest that keeps an error of {pixels} px\n\n{}",
            table.markdown()
        );
    }
    let _ = writeln!(text, "## {}\n", suite_title(report));
    for device in &report.devices {
        let rows = report.suite.rows.iter();
        let table = table::suite_table(rows.filter(|row| row.engine == device.engine));
        let _ = writeln!(text, "### {}\n\n{}", device.engine, table.markdown());
    }
    text.push_str("## Each scene\n\nThe default, and the settings on a front.\n\n");
    for scene in &report.scenes {
        let rows = scene.rows.iter();
        let shown = rows.filter(|row| row.default || row.front_of_time || row.front_of_evaluations);
        let _ = writeln!(
            text,
            "### {}\n\n{}\n\n{}",
            scene.scene,
            ray_summary(scene),
            table::scene_table(shown).markdown()
        );
    }
    text.truncate(text.trim_end().len());
    text.push('\n');
    text
}

/// Returns the machine, the date and the settings of the report.
pub(crate) fn provenance(report: &BenchReport) -> Vec<String> {
    let mut lines = vec![format!(
        "{}, sdfc {}, {}",
        report.date, report.version, report.machine
    )];
    for device in &report.devices {
        lines.push(format!("{}: {}", device.engine, device.device));
    }
    lines.push(match report.rounds {
        1 => "times of one picture".to_owned(),
        rounds => format!("times are medians of at most {rounds} pictures"),
    });
    lines.push(format!(
        "the default threshold is {}",
        RenderSettings::DEFAULT_THRESHOLD_FRACTION
    ));
    lines
}

/// Returns the title over all scenes.
pub(crate) fn suite_title(report: &BenchReport) -> String {
    match report.scenes.len() {
        1 => "The scene".to_owned(),
        count => format!("All {count} scenes"),
    }
}

/// Returns the chosen settings of each scene.
pub(crate) fn chosen_settings(
    report: &BenchReport,
) -> impl Iterator<Item = (&str, &super::tolerance::ChosenSetting)> {
    report.scenes.iter().flat_map(|scene| {
        let choices = scene.choices.iter();
        choices.map(|choice| (scene.scene.as_str(), choice))
    })
}

/// Describes a scene's rays in a sentence.
pub(crate) fn ray_summary(scene: &SceneReport) -> String {
    let [width, height] = scene.size;
    let truth = &scene.truth;
    format!(
        "{width}x{height}: {} rays hit, {} miss, {} are undecided; the reference took {:.0} \
         evaluations per pixel, {:.1} s.",
        truth.hits,
        truth.misses,
        truth.undecided,
        truth.evaluations,
        truth.milliseconds / 1e3
    )
}
