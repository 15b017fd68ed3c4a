//! The right panel: what is shown, from where, and what draws it.

use super::action::{Action, key_of};
use super::desk::Desk;
use super::{shown, theme};
use crate::camera::Side;
use crate::session::{CameraEvent, Choice, Event, Session};
use eframe::egui::{self, Button, RichText, Ui, vec2};
use sdfc_runtime::engine::EngineKind;
use std::time::Duration;

/// Shows it; what is done with it becomes events and actions.
pub(super) fn show(
    ui: &mut Ui,
    session: &Session,
    desk: &mut Desk,
    events: &mut Vec<Event>,
) -> Vec<Action> {
    let mut actions = Vec::new();
    egui::ScrollArea::vertical()
        .auto_shrink([false; 2])
        .show(ui, |ui| {
            ui.add_space(2.0);
            shown::show(ui, session, desk, events);
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

/// So many of these beside each other, as wide as the panel.
pub(super) fn grid<T>(
    ui: &mut Ui,
    columns: usize,
    cells: &[T],
    mut add: impl FnMut(&mut Ui, &T, f32),
) {
    ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
    ui.spacing_mut().button_padding.x = 3.0;
    let gaps = 4.0 * (columns - 1) as f32;
    let width = ((ui.available_width() - gaps) / columns as f32).floor();
    for row in cells.chunks(columns) {
        ui.horizontal(|ui| {
            for cell in row {
                add(ui, cell, width);
            }
        });
    }
}

/// A button of a choice, perhaps the one that is chosen.
pub(super) fn choice(ui: &mut Ui, text: &str, is_chosen: bool, width: f32) -> egui::Response {
    let button = Button::new(RichText::new(text).size(12.5)).selected(is_chosen);
    ui.add(button.min_size(vec2(width, 22.0)).truncate())
}

fn cameras(ui: &mut Ui, session: &Session, events: &mut Vec<Event>, actions: &mut Vec<Action>) {
    ui.label(theme::heading("CAMERAS"));
    let (names, chosen) = session.cameras();
    for name in &names {
        let shown = if name.is_empty() { "scene" } else { name };
        let is_chosen = Some(*name) == chosen && !session.has_own_view();
        let width = ui.available_width();
        let button = choice(ui, shown, is_chosen, width);
        let says = format!("the scene's camera ({})", key_of(Action::SceneCamera));
        if button.on_hover_text(says).clicked() {
            let name = Some((*name).to_owned()).filter(|name| !name.is_empty());
            events.push(Event::Camera(CameraEvent::Scene(name)));
        }
    }
    ui.add_space(2.0);
    ui.label(theme::heading("VIEW FROM"));
    let sides = [
        (Side::Front, "front"),
        (Side::Right, "right"),
        (Side::Top, "top"),
        (Side::Back, "back"),
        (Side::Left, "left"),
        (Side::Bottom, "bottom"),
    ];
    let is_plane = session
        .camera()
        .is_some_and(crate::camera::Camera::is_plane);
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        ui.add_enabled_ui(!is_plane, |ui| {
            grid(ui, 3, &sides, |ui, (side, name), width| {
                let action = Action::Face(*side);
                if choice(ui, name, false, width)
                    .on_hover_text(key_of(action))
                    .clicked()
                {
                    actions.push(action);
                }
            });
        });
        ui.scope(|ui| {
            let others = [
                (Action::Face(Side::Isometric), "corner", !is_plane),
                (Action::Fit, "fit", true),
                (Action::CopyCamera, "copy", true),
            ];
            grid(ui, 3, &others, |ui, (action, name, can), width| {
                ui.add_enabled_ui(*can, |ui| {
                    let says = match action {
                        Action::CopyCamera => "copy the camera as text of the language",
                        Action::Fit => "all of the scene into the picture",
                        _ => "from above, in front and the right",
                    };
                    let says = format!("{says} ({})", key_of(*action));
                    if choice(ui, name, false, width).on_hover_text(says).clicked() {
                        actions.push(*action);
                    }
                });
            });
        });
    });
    let mut parallel = session
        .camera()
        .is_some_and(crate::camera::Camera::is_orthographic);
    let toggle = ui.add_enabled(
        !is_plane,
        egui::Checkbox::new(&mut parallel, "orthographic"),
    );
    let says = format!("parallel rays ({})", key_of(Action::ToggleLens));
    if toggle.on_hover_text(says).changed() {
        actions.push(Action::ToggleLens);
    }
}

fn engines(ui: &mut Ui, session: &Session, events: &mut Vec<Event>) {
    ui.label(theme::heading("ENGINE"));
    let only = Choice::Only;
    let choices = [
        (Choice::Auto, "auto", "what is best here"),
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
        grid(ui, 4, &choices, |ui, (choose, name, says), width| {
            let can = session.devices().gpu
                || matches!(choose, Choice::Auto | Choice::Only(EngineKind::Cpu));
            ui.add_enabled_ui(can, |ui| {
                let button = choice(ui, name, *choose == session.choice(), width);
                let button = button.on_disabled_hover_text("there is no GPU here");
                if button.on_hover_text(*says).clicked() {
                    events.push(Event::Engine(*choose));
                }
            });
        });
    });
    if let Some(engine) = session.preparing() {
        ui.label(note(&format!("{engine} is being compiled …")));
    } else if let Some([first, second]) = session.compared() {
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

/// A time, in milliseconds.
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
