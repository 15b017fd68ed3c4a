//! The status bar: activity, times, device and statistics.

use super::side_panel::ms;
use super::state::WindowState;
use super::theme;
use crate::session::{RefinementStage, Session};
use eframe::egui::{Align, Layout, RichText, Ui};

/// Shows the status bar.
pub(super) fn show(ui: &mut Ui, session: &Session, state: &WindowState) {
    ui.horizontal_centered(|ui| {
        ui.spacing_mut().item_spacing.x = 14.0;
        let text = |text: String| RichText::new(text).size(11.5).color(theme::WEAK);
        let activity = activity(session, state);
        ui.label(RichText::new(activity).size(11.5).color(theme::TEXT));
        let Some(facts) = session.facts() else {
            return;
        };
        let device = text(format!("{} · {}", facts.engine, facts.device));
        let times = format!(
            "read {}   compile {}   upload {}   draw {}",
            ms(facts.reading),
            ms(facts.compiling),
            ms(facts.loading),
            ms(facts.drawing),
        );
        ui.label(text(times))
            .on_hover_text("from the saved file to programs, to the engine, to the picture");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let [width, height] = facts.size;
            ui.label(text(format!("{width}×{height}")));
            let evaluations = format!("{:.1} evaluations a ray", facts.evaluations);
            ui.label(text(evaluations)).on_hover_text(
                "the number of evaluations of the field per ray, including gradients",
            );
            let [distance, surface] = facts.instructions;
            let program = ui.label(text(format!("{} instructions", distance + surface)));
            program.on_hover_text(format!(
                "{distance} of the distance, {surface} of surfaces; {} constants, {} cells, {} \
                 pipelines created",
                facts.constants, facts.cells, facts.pipelines,
            ));
            ui.add(eframe::egui::Label::new(device).truncate());
        });
    });
}

/// Describes the current activity.
fn activity(session: &Session, state: &WindowState) -> String {
    if !session.is_busy() {
        return "at rest".to_owned();
    }
    match (session.drawing_stage(), state.rate()) {
        (Some(RefinementStage::Fine), _) => "refining".to_owned(),
        (_, Some(rate)) => format!("{rate:.0} fps"),
        (Some(_), None) => "drawing".to_owned(),
        (None, None) => "building".to_owned(),
    }
}
