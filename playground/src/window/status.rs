//! The status bar: activity, engine, times, device and statistics.

use super::engine_label::drawn_by;
use super::side_panel::ms;
use super::state::WindowState;
use super::theme;
use crate::session::{PictureFacts, RefinementStage, Session};
use eframe::egui::{FontId, Label, RichText, Ui};
use std::time::Duration;

/// Distance between two texts, in points.
const GAP: f32 = 14.0;
/// Font size of the texts, in points.
const TEXT_SIZE: f32 = 11.5;

/// Shows the status bar at the session's time `now`. Texts that do not fit are left out, the least
/// important ones first.
pub(super) fn show(ui: &mut Ui, session: &Session, state: &WindowState, now: Duration) {
    ui.horizontal_centered(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        let is_held = ui.ctx().dragged_id().is_some() || session.is_moving(now);
        let activity = activity(session, state, is_held);
        let facts = session.facts();
        let drawn_by = facts.as_ref().map(|facts| drawn_by(session, facts.engine));
        let first = [Some(activity), drawn_by];
        let first: Vec<String> = first.into_iter().flatten().collect();
        let first = RichText::new(first.join(" · ")).size(TEXT_SIZE);
        ui.add(Label::new(first.color(theme::TEXT)).truncate());
        let Some(facts) = facts else {
            return;
        };
        let texts = statistics(&facts);
        let widths = texts.each_ref().map(|(text, _)| text_width(ui, text));
        let visible = visible_count(&widths, ui.available_width());
        for (text, description) in texts.into_iter().take(visible) {
            let label = ui.label(RichText::new(text).size(TEXT_SIZE).color(theme::WEAK));
            label.on_hover_text(description);
        }
    });
}

/// Returns the texts behind the activity and their descriptions, the most important ones first.
fn statistics(facts: &PictureFacts) -> [(String, String); 5] {
    let [width, height] = facts.size;
    let [distance, surface] = facts.instructions;
    [
        (
            format!("{width}×{height}"),
            "width and height in pixels".to_owned(),
        ),
        (
            format!("{:.1} evaluations a ray", facts.evaluations),
            "the number of evaluations of the field per ray, including gradients".to_owned(),
        ),
        (
            format!(
                "read {}   compile {}   upload {}   draw {}",
                ms(facts.reading),
                ms(facts.compiling),
                ms(facts.loading),
                ms(facts.drawing),
            ),
            "from the saved file to programs, to the engine, to the picture".to_owned(),
        ),
        (
            format!("{} instructions", distance + surface),
            format!(
                "{distance} of the distance, {surface} of surfaces; {} constants, {} cells, {} \
                 pipelines created",
                facts.constants, facts.cells, facts.pipelines,
            ),
        ),
        (facts.device.clone(), "the device that drew".to_owned()),
    ]
}

fn text_width(ui: &Ui, text: &str) -> f32 {
    let font = FontId::proportional(TEXT_SIZE);
    let layout = ui
        .painter()
        .layout_no_wrap(text.to_owned(), font, theme::WEAK);
    layout.size().x
}

/// Returns the number of texts that fit into a width.
fn visible_count(widths: &[f32], available: f32) -> usize {
    let ends = widths.iter().scan(0.0, |end, width| {
        *end += width + GAP;
        Some(*end)
    });
    ends.take_while(|end| *end <= available).count()
}

/// Describes the current activity. `is_held` is set during a motion.
fn activity(session: &Session, state: &WindowState, is_held: bool) -> String {
    if !session.is_busy() {
        return if is_held { "moving" } else { "at rest" }.to_owned();
    }
    match (session.drawing_stage(), state.rate()) {
        (Some(RefinementStage::Fine), _) => "refining".to_owned(),
        (_, Some(rate)) => format!("{rate:.0} fps"),
        (Some(_), None) => "drawing".to_owned(),
        (None, None) => "building".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_that_do_not_fit_are_left_out() {
        let widths = [50.0, 100.0, 20.0];
        let counts = [0.0, 63.0, 64.0, 177.0, 178.0, 212.0, 1000.0];
        let counts = counts.map(|available| visible_count(&widths, available));
        assert_eq!(counts, [0, 0, 1, 1, 2, 3, 3]);
    }
}
