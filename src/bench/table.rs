//! Tables of measurements, in Markdown and in HTML.

use super::measure::SettingRow;
use super::scene_report::SceneReport;
use super::suite::{StepRule, SuiteRow};
use super::tolerance::ChosenSetting;
use std::fmt::Write;

/// Words and numbers in rows.
pub(crate) struct Table {
    /// Names of the columns; the first `words` of them contain words, the others numbers.
    columns: Vec<&'static str>,
    words: usize,
    rows: Vec<(Vec<String>, bool)>,
}

impl Table {
    fn new(words: usize, columns: &[&'static str]) -> Self {
        Self {
            columns: columns.to_vec(),
            words,
            rows: Vec::new(),
        }
    }

    /// Returns Markdown; marked rows are bold in their first column.
    pub(crate) fn markdown(&self) -> String {
        let mut text = format!("| {} |\n|", self.columns.join(" | "));
        for index in 0..self.columns.len() {
            text.push_str(if index < self.words { "---|" } else { "---:|" });
        }
        text.push('\n');
        for (cells, marked) in &self.rows {
            let mut cells = cells.clone();
            if let (true, Some(first)) = (marked, cells.first_mut()) {
                *first = format!("**{first}**");
            }
            let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            let _ = writeln!(text, "| {} |", cells.join(" | "));
        }
        text
    }

    /// Returns HTML; marked rows have the class `marked`.
    pub(crate) fn html(&self) -> String {
        let class = |index: usize| {
            if index < self.words {
                " class=\"word\""
            } else {
                ""
            }
        };
        let mut text = String::from("<div class=\"wide\"><table>\n<thead><tr>");
        for (index, name) in self.columns.iter().enumerate() {
            let _ = write!(text, "<th{}>{}</th>", class(index), escaped(name));
        }
        text.push_str("</tr></thead>\n<tbody>\n");
        for (cells, marked) in &self.rows {
            text.push_str(if *marked {
                "<tr class=\"marked\">"
            } else {
                "<tr>"
            });
            for (index, cell) in cells.iter().enumerate() {
                let _ = write!(text, "<td{}>{}</td>", class(index), escaped(cell));
            }
            text.push_str("</tr>\n");
        }
        text.push_str("</tbody></table></div>\n");
        text
    }
}

/// Escapes a text for HTML.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Returns the settings of one engine over all scenes.
pub(crate) fn suite_table<'a>(rows: impl Iterator<Item = &'a SuiteRow>) -> Table {
    let mut table = Table::new(
        2,
        &[
            "setting",
            "front",
            "ms",
            "evaluations/px",
            "on rays/px",
            "wrong rays",
            "off silhouettes",
            "depth p50",
            "p99",
            "p99, worst scene",
            "max",
            "smooth p99, ulp",
            "normals p50",
            "p99",
            "NaN",
            "step cap",
            "far",
            "ꟻLIP",
        ],
    );
    for row in rows {
        let cells = vec![
            row.setting.clone(),
            fronts(row.front_of_time, row.front_of_evaluations),
            number(row.milliseconds),
            number(row.evaluations),
            number(row.ray_evaluations),
            row.mismatches.to_string(),
            row.mismatches_inside.to_string(),
            fraction(row.depth_p50),
            fraction(row.depth_p99),
            fraction(row.depth_p99_worst),
            fraction(row.depth_max),
            number(row.ulps_p99),
            degrees(row.normals_p50),
            degrees(row.normals_p99),
            row.nans.to_string(),
            row.step_caps.to_string(),
            row.at_far.to_string(),
            picture(row.picture),
        ];
        table.rows.push((cells, row.default));
    }
    table
}

/// Returns the settings of a scene.
pub(crate) fn scene_table<'a>(rows: impl Iterator<Item = &'a SettingRow>) -> Table {
    let mut table = Table::new(
        3,
        &[
            "setting",
            "engine",
            "front",
            "ms",
            "evaluations/px",
            "wrong rays",
            "off silhouettes",
            "depth p50",
            "p99",
            "max",
            "smooth p99",
            "ulp",
            "normals p50",
            "p99",
            "NaN",
            "step cap",
            "far",
            "ꟻLIP",
        ],
    );
    for row in rows {
        let (measured, errors) = (&row.measured, &row.measured.errors);
        let cells = vec![
            row.setting.clone(),
            row.engine.to_owned(),
            fronts(row.front_of_time, row.front_of_evaluations),
            number(measured.milliseconds),
            number(measured.evaluations),
            errors.mismatches().to_string(),
            errors.mismatches_inside.to_string(),
            fraction(errors.depth.p50),
            fraction(errors.depth.p99),
            fraction(errors.depth.max),
            fraction(errors.depth_smooth.p99),
            number(errors.depth_ulps.p99),
            degrees(errors.normals.p50),
            degrees(errors.normals.p99),
            errors.nans.to_string(),
            errors.step_caps.to_string(),
            measured.at_far.to_string(),
            picture(measured.picture.mean),
        ];
        table.rows.push((cells, row.default));
    }
    table
}

/// Returns the default of each scene on each engine.
pub(crate) fn overview_table(scenes: &[SceneReport]) -> Table {
    let mut table = Table::new(
        2,
        &[
            "scene",
            "engine",
            "ms",
            "first ms",
            "evaluations/px",
            "sampled",
            "undecided",
            "wrong rays",
            "off silhouettes",
            "depth p99",
            "smooth p99, ulp",
            "normals p99",
            "step cap",
            "far",
        ],
    );
    for scene in scenes {
        for row in scene.rows.iter().filter(|row| row.default) {
            let (measured, errors) = (&row.measured, &row.measured.errors);
            let cells = vec![
                scene.scene.clone(),
                row.engine.to_owned(),
                number(measured.milliseconds),
                number(measured.first_milliseconds),
                number(measured.evaluations),
                scene.truth.sampled.to_string(),
                scene.truth.undecided.to_string(),
                errors.mismatches().to_string(),
                errors.mismatches_inside.to_string(),
                fraction(errors.depth.p99),
                number(errors.depth_ulps.p99),
                degrees(errors.normals.p99),
                errors.step_caps.to_string(),
                measured.at_far.to_string(),
            ];
            table.rows.push((cells, false));
        }
    }
    table
}

/// Returns the gain of relaxed steps.
pub(crate) fn steps_table(rules: &[StepRule]) -> Table {
    let mut table = Table::new(
        2,
        &[
            "engine",
            "with",
            "plain, on rays/px",
            "relaxed, on rays/px",
            "saved",
            "plain, wrong rays",
            "relaxed, wrong rays",
            "plain, off silhouettes",
            "relaxed, off silhouettes",
            "plain, depth p99",
            "relaxed, depth p99",
        ],
    );
    for rule in rules {
        let cells = vec![
            rule.engine.to_owned(),
            rule.relaxed.setting.clone(),
            number(rule.plain.ray_evaluations),
            number(rule.relaxed.ray_evaluations),
            format!("{:.1} %", rule.saved_percent),
            rule.plain.mismatches.to_string(),
            rule.relaxed.mismatches.to_string(),
            rule.plain.mismatches_inside.to_string(),
            rule.relaxed.mismatches_inside.to_string(),
            fraction(rule.plain.depth_p99),
            fraction(rule.relaxed.depth_p99),
        ];
        table.rows.push((cells, false));
    }
    table
}

/// Returns the chosen settings for an error, by scene.
pub(crate) fn choices_table<'a>(
    choices: impl Iterator<Item = (&'a str, &'a ChosenSetting)>,
) -> Table {
    let mut table = Table::new(
        4,
        &[
            "scene",
            "engine",
            "taken",
            "kept",
            "ms",
            "depth p99, px",
            "silhouettes, px",
            "wrong rays",
        ],
    );
    for (scene, choice) in choices {
        let cells = vec![
            scene.to_owned(),
            choice.engine.to_owned(),
            choice.setting.clone(),
            if choice.kept { "yes" } else { "no" }.to_owned(),
            number(choice.milliseconds),
            number(choice.error.depth_pixels),
            number(choice.error.silhouette_pixels),
            choice.error.wrong_rays.to_string(),
        ];
        table.rows.push((cells, false));
    }
    table
}

/// Names the fronts of a setting.
fn fronts(time: bool, evaluations: bool) -> String {
    match (time, evaluations) {
        (true, true) => "time, evaluations",
        (true, false) => "time",
        (false, true) => "evaluations",
        (false, false) => "",
    }
    .to_owned()
}

/// Formats a number with about three digits.
pub(super) fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if size < 0.01 => format!("{value:.1e}"),
        size if size < 1.0 => format!("{value:.3}"),
        size if size < 10.0 => format!("{value:.2}"),
        size if size < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// Formats a fraction of a depth.
pub(super) fn fraction(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else {
        format!("{value:.1e}")
    }
}

fn degrees(value: f64) -> String {
    format!("{}°", number(value))
}

fn picture(value: f64) -> String {
    format!("{value:.4}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new(1, &["a<b", "n"]);
        table
            .rows
            .push((vec!["x & y".to_owned(), number(0.5)], true));
        table
    }

    #[test]
    fn markdown_marks_the_default() {
        assert_eq!(
            table().markdown(),
            "| a<b | n |\n|---|---:|\n| **x & y** | 0.500 |\n"
        );
    }

    #[test]
    fn nothing_in_a_cell_is_markup() {
        let html = table().html();
        assert!(html.contains("<th class=\"word\">a&lt;b</th>"), "{html}");
        assert!(html.contains("<td class=\"word\">x &amp; y</td>"), "{html}");
    }

    #[test]
    fn numbers_have_three_digits() {
        let values = [0.0, 0.001_234, 0.123_4, 1.234, 12.34, 1234.0];
        let texts = ["0", "1.2e-3", "0.123", "1.23", "12.3", "1234"];
        assert_eq!(values.map(number), texts);
    }
}
