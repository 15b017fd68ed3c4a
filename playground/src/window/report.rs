//! The compiler's report over the picture: in full for errors, else as a line that expands.

use super::state::WindowState;
use super::theme;
use crate::session::Session;
use eframe::egui::text::{LayoutJob, TextFormat};
use eframe::egui::{
    self, Area, Color32, Frame, Id, Margin, Rect, RichText, ScrollArea, Stroke, Ui,
};

/// Distance from the edges of the picture, in points.
const EDGE_MARGIN: f32 = 14.0;

/// Shows the report over the picture.
pub(super) fn show(ui: &Ui, session: &Session, state: &mut WindowState, picture_area: Rect) {
    let report = session.report().trim_end();
    if report.is_empty() {
        state.report_open = false;
        return;
    }
    let is_broken = session.is_broken();
    let is_open = is_broken || state.report_open;
    let lower_left = egui::pos2(
        picture_area.left() + EDGE_MARGIN,
        picture_area.bottom() - EDGE_MARGIN,
    );
    let width = (picture_area.width() - 2.0 * EDGE_MARGIN).max(120.0);
    // An area remembers its size, and offers no more to its content: each report has its own.
    let area_id = Id::unique(("report", report, is_open));
    let area = Area::new(area_id)
        .pivot(egui::Align2::LEFT_BOTTOM)
        .fixed_pos(lower_left)
        .constrain_to(picture_area)
        .order(egui::Order::Middle);
    area.show(ui.ctx(), |ui| {
        ui.set_max_width(width);
        let line = if is_broken {
            theme::ERROR
        } else {
            theme::WARNING
        };
        let frame = Frame::new()
            .fill(theme::OVERLAY.gamma_multiply(0.94))
            .stroke(Stroke::new(1.0, line.gamma_multiply(0.6)))
            .corner_radius(6.0);
        if is_open {
            frame
                .inner_margin(Margin::symmetric(12, 10))
                .show(ui, |ui| {
                    let height = (picture_area.height() - 4.0 * EDGE_MARGIN).max(80.0);
                    ScrollArea::both().max_height(height).show(ui, |ui| {
                        let job = colored_text(report);
                        ui.add(egui::Label::new(job).selectable(true).extend());
                    });
                    if !is_broken && ui.small_button("hide").clicked() {
                        state.report_open = false;
                    }
                });
        } else {
            frame.inner_margin(Margin::symmetric(8, 4)).show(ui, |ui| {
                let text = RichText::new(summary(report)).color(line).size(12.0);
                let label = egui::Label::new(text).sense(egui::Sense::click());
                if ui.add(label).on_hover_text("click to read").clicked() {
                    state.report_open = true;
                }
            });
        }
    });
}

/// Formats the number of warnings.
fn summary(report: &str) -> String {
    let count = report
        .lines()
        .filter(|line| line.starts_with("warning"))
        .count();
    match count {
        0 => "a note".to_owned(),
        1 => "1 warning".to_owned(),
        _ => format!("{count} warnings"),
    }
}

/// Colours the lines of the report by kind.
fn colored_text(report: &str) -> LayoutJob {
    let mut job = LayoutJob::default();
    for line in report.lines() {
        let format = TextFormat::simple(theme::mono(12.5), color(line));
        job.append(line, 0.0, format.clone());
        job.append("\n", 0.0, format);
    }
    // The last line has no line break.
    job.text.pop();
    if let Some(last) = job.sections.last_mut() {
        last.byte_range.end = job.text.len().into();
    }
    job
}

fn color(line: &str) -> Color32 {
    let start = line.trim_start();
    let is_frame = start.starts_with(['|', '-', '=', ':']);
    match line {
        _ if line.starts_with("error") => theme::ERROR,
        _ if line.starts_with("warning") => theme::WARNING,
        _ if line.starts_with("help") || line.starts_with("note") => theme::HELP,
        _ if is_frame && line.contains(['^', '+', '~']) => theme::ACCENT,
        _ if is_frame => theme::WEAK,
        _ => theme::TEXT,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_is_shown_as_it_is() {
        let report = "error[E0101]: no\n --> a.sdf:1:1\n  |\n1 | sphere(\n  | ^\nhelp: close it";
        let job = colored_text(report);
        assert_eq!(job.text, report);
        assert_eq!(
            job.sections.first().map(|s| s.format.color),
            Some(theme::ERROR)
        );
        assert_eq!(color("help: close it"), theme::HELP);
        assert_eq!(color("  | ^^^ here"), theme::ACCENT);
        assert_eq!(color("8 | let a = 1;"), theme::TEXT);
    }

    #[test]
    fn warnings_are_counted() {
        assert_eq!(
            summary("warning[W0201]: a\n\nwarning[W0202]: b\n"),
            "2 warnings"
        );
        assert_eq!(summary("warning: a"), "1 warning");
    }
}
