//! The right panel: view mode, camera and engine.

use super::action::{Action, key_of};
use super::engine_label::drawn_by;
use super::state::WindowState;
use super::widgets::{choice_button, grid};
use super::{theme, view_picker};
use crate::session::{CameraEvent, EngineChoice, Event, Session};
use eframe::egui::{self, RichText, Ui};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::settings::ViewSide;
use std::time::Duration;

/// Shows the panel. Input becomes events and actions.
pub(super) fn show(
    ui: &mut Ui,
    session: &Session,
    state: &mut WindowState,
    events: &mut Vec<Event>,
) -> Vec<Action> {
    let mut actions = Vec::new();
    egui::ScrollArea::vertical()
        .auto_shrink([false; 2])
        .show(ui, |ui| {
            ui.add_space(2.0);
            view_picker::show(ui, session, state, events);
            gap(ui);
            cameras(ui, session, events, &mut actions);
            gap(ui);
            engines(ui, session, events);
        });
    actions
}

fn gap(ui: &mut Ui) {
    ui.add_space(6.0);
    ui.separator();
    ui.add_space(2.0);
}

fn cameras(ui: &mut Ui, session: &Session, events: &mut Vec<Event>, actions: &mut Vec<Action>) {
    ui.label(theme::heading("CAMERAS"));
    let (names, current_name) = session.cameras();
    for name in &names {
        let shown = if name.is_empty() { "scene" } else { name };
        let is_chosen = Some(*name) == current_name && !session.is_camera_moved();
        let width = ui.available_width();
        let button = choice_button(ui, shown, is_chosen, width);
        let description = format!("the scene's camera ({})", key_of(Action::SceneCamera));
        if button.on_hover_text(description).clicked() {
            let name = Some((*name).to_owned()).filter(|name| !name.is_empty());
            events.push(Event::Camera(CameraEvent::Scene(name)));
        }
    }
    ui.add_space(2.0);
    ui.label(theme::heading("VIEW FROM"));
    let sides = [
        (ViewSide::Front, "front"),
        (ViewSide::Right, "right"),
        (ViewSide::Top, "top"),
        (ViewSide::Back, "back"),
        (ViewSide::Left, "left"),
        (ViewSide::Bottom, "bottom"),
    ];
    let is_2d = session
        .camera()
        .is_some_and(crate::camera::OrbitCamera::is_2d);
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        ui.add_enabled_ui(!is_2d, |ui| {
            grid(ui, 3, &sides, |ui, (side, name), width| {
                let action = Action::Face(*side);
                if choice_button(ui, name, false, width)
                    .on_hover_text(key_of(action))
                    .clicked()
                {
                    actions.push(action);
                }
            });
        });
        ui.scope(|ui| {
            let others = [
                (Action::Face(ViewSide::Corner), "corner", !is_2d),
                (Action::Fit, "fit", true),
                (Action::CopyCamera, "copy", true),
            ];
            grid(ui, 3, &others, |ui, (action, name, is_available), width| {
                ui.add_enabled_ui(*is_available, |ui| {
                    let description = match action {
                        Action::CopyCamera => "copy the camera as text of the language",
                        Action::Fit => "fit the scene into the picture",
                        _ => "from above, in front and the right",
                    };
                    let description = format!("{description} ({})", key_of(*action));
                    if choice_button(ui, name, false, width)
                        .on_hover_text(description)
                        .clicked()
                    {
                        actions.push(*action);
                    }
                });
            });
        });
    });
    let mut parallel = session
        .camera()
        .is_some_and(crate::camera::OrbitCamera::is_orthographic);
    let toggle = ui.add_enabled(!is_2d, egui::Checkbox::new(&mut parallel, "orthographic"));
    let description = format!("parallel rays ({})", key_of(Action::ToggleLens));
    if toggle.on_hover_text(description).changed() {
        actions.push(Action::ToggleLens);
    }
}

fn engines(ui: &mut Ui, session: &Session, events: &mut Vec<Event>) {
    ui.label(theme::heading("ENGINE"));
    let only = EngineChoice::Only;
    let choices = [
        (EngineChoice::Auto, "auto", "the best engine here"),
        (only(EngineKind::Cpu), "cpu", "the program on all cores"),
        (
            only(EngineKind::Interp),
            "interp",
            "the program, interpreted on the GPU",
        ),
        (
            only(EngineKind::Wgsl),
            "wgsl",
            "generated WGSL, compiled for the GPU",
        ),
    ];
    ui.scope(|ui| {
        grid(
            ui,
            4,
            &choices,
            |ui, (requested, name, description), width| {
                let is_available = session.devices().gpu
                    || matches!(
                        requested,
                        EngineChoice::Auto | EngineChoice::Only(EngineKind::Cpu)
                    );
                ui.add_enabled_ui(is_available, |ui| {
                    let button =
                        choice_button(ui, name, *requested == session.engine_choice(), width);
                    let button = button.on_disabled_hover_text("there is no GPU here");
                    if button.on_hover_text(*description).clicked() {
                        events.push(Event::Engine(*requested));
                    }
                });
            },
        );
    });
    if let Some(facts) = session.facts() {
        ui.label(note(&drawn_by(session, facts.engine)));
    }
    if let Some(engine) = session.preparing() {
        ui.label(note(&format!("{engine} is being compiled …")));
    } else if let Some([first, second]) = session.compared_times() {
        let text = format!(
            "the same picture: {} and, compiled, {}",
            ms(first),
            ms(second)
        );
        ui.label(note(&text));
    }
    for (kind, why) in session.failures() {
        let text = RichText::new(format!("{kind}: {why}"));
        ui.label(text.size(11.5).color(theme::WARNING));
    }
}

fn note(text: &str) -> RichText {
    RichText::new(text).size(11.5).color(theme::WEAK)
}

/// Formats a time in milliseconds, or in seconds from 10 s.
pub(super) fn ms(time: Duration) -> String {
    let ms = time.as_secs_f64() * 1e3;
    match ms {
        _ if ms < 9.95 => format!("{ms:.1} ms"),
        _ if ms < 9999.5 => format!("{ms:.0} ms"),
        _ => format!("{:.1} s", ms * 1e-3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_two_digits_or_more() {
        let texts = [0.26, 9.96, 123.4, 12_345.0].map(|v| ms(Duration::from_secs_f64(v * 1e-3)));
        assert_eq!(texts, ["0.3 ms", "10 ms", "123 ms", "12.3 s"]);
    }
}
