//! The report as Markdown: a page of what follows, all settings over all scenes, and the default of each scene.

use super::BenchReport;
use super::findings::findings;
use super::scene_report::SceneReport;
use super::table;
use sdfc_runtime::render::RenderSettings;
use std::fmt::Write;

/// Explanations of the words in the tables, a paragraph each.
pub(crate) const LEGEND: [&str; 6] = [
    "Errors are measured against the truth that the engine `reference` proves with intervals in double \
     precision, with one ray per pixel, for a sample of the pixels. Tiles at edges are sampled more densely, and \
     each pixel counts for as many as it stands for, so numbers of rays are estimates for entire pictures. \
     Undecided rays are left out. \
     The row `default` has the scene's own settings. Each other row changes the named setting only.",
    "`threshold` is the distance to a surface at which a ray starts to look for the root, as a fraction \
     of half a pixel. `plain steps` is sphere tracing without relaxation. `lod` simplifies details below \
     this number of pixels. `no cells` evaluates the whole program everywhere.",
    "`ms` is the median time of pictures without the compilation of kernels. Each picture has a \
     slightly different camera, so that no result is reused. `evaluations/px` counts evaluations of the \
     field for rays, normals, shadows and occlusion. `on rays/px` counts those along primary rays only.",
    "`wrong rays` hit in the picture and miss in truth, or the reverse. `off silhouettes` counts those \
     of them away from silhouettes. `depth` is the relative error of the depth, including silhouettes. \
     `smooth` counts smooth pixels only. `normals` are angles at smooth pixels away from edges. `step cap` \
     counts rays that exceeded their steps. `far` counts those that ended at the maximum distance, where \
     the scene continues. `p50` and `p99` are not exceeded at 50 and 99 % of the pixels. `ulp` is a unit in the \
     last place.",
    "`ꟻLIP` is the mean perceptual difference (Andersson and others, 2020) between the shaded picture \
     and one with the finest settings. It is between 0 (equal) and 1.",
    "A setting is on the `front` of time or of evaluations if no other on its engine has at most its cost \
     and at most its `depth p99`. Over all scenes, times are geometric means, evaluations are means, rays \
     are sums, and errors are medians of the scenes.",
];

/// Returns the complete report. `chart` is the name of a picture beside it.
pub(crate) fn page(report: &BenchReport, chart: Option<&str>) -> String {
    let mut text = String::from("# Speed against error\n\n");
    if let Some(name) = chart {
        let _ = writeln!(text, "![Time against error]({name})\n");
    }
    for finding in findings(report) {
        let _ = writeln!(text, "- {finding}");
    }
    let _ = writeln!(text, "\nMade by\n\n```sh\n{}\n```\n", report.command);
    for line in provenance(report) {
        let _ = writeln!(text, "- {line}");
    }
    text.push('\n');
    for paragraph in LEGEND {
        let _ = writeln!(text, "{paragraph}\n");
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
        let table = table::suite_table(report.suite.of_engine(device.engine));
        let _ = writeln!(text, "### {}\n\n{}", device.engine, table.markdown());
    }
    if !report.suite.steps.is_empty() {
        let rules = table::steps_table(&report.suite.steps);
        let _ = writeln!(
            text,
            "### Relaxed steps against plain ones\n\n{}",
            rules.markdown()
        );
    }
    let _ = writeln!(
        text,
        "## The default of each scene\n\nAll settings are in the report that `--report` writes.\n\n{}",
        table::overview_table(&report.scenes).markdown()
    );
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
    if let Some(scene) = report.scenes.first() {
        lines.push(format!("pictures are {} pixels wide", scene.size[0]));
    }
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
        "{width}x{height}: of {} sampled pixels {} hit, {} miss, {} are undecided; the reference took \
         {:.0} evaluations per ray, {:.1} s.",
        truth.sampled,
        truth.hits,
        truth.misses,
        truth.undecided,
        truth.evaluations,
        truth.milliseconds / 1e3
    )
}
