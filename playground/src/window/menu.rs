//! The menu bar, with the name of the open file.

use super::Example;
use super::action::{Action, key_of};
use super::theme;
use crate::build::SceneOrigin;
use crate::session::{Event, Session};
use eframe::egui::{Align, Button, Layout, MenuBar, RichText, Ui};
use sdfc_compiler::export::Target;
use sdfc_runtime::settings::ViewSide;

/// Shows the menu bar. Selected entries become actions and events.
pub(super) fn show(
    ui: &mut Ui,
    session: &Session,
    examples: &[Example],
    events: &mut Vec<Event>,
) -> Vec<Action> {
    let mut actions = Vec::new();
    MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| {
            ui.set_min_width(190.0);
            item(ui, "Open …", Action::Open, &mut actions);
            ui.menu_button("Examples", |ui| examples_menu(ui, examples, events));
            ui.separator();
            item(ui, "Save picture", Action::Save, &mut actions);
            item(
                ui,
                "Write params into the text",
                Action::WriteParams,
                &mut actions,
            );
            ui.separator();
            item(ui, "Copy as WGSL", Action::Copy(Target::Wgsl), &mut actions);
            item(ui, "Copy as GLSL", Action::Copy(Target::Glsl), &mut actions);
            item(
                ui,
                "Copy for Shadertoy",
                Action::Copy(Target::Shadertoy),
                &mut actions,
            );
            ui.separator();
            item(ui, "Quit", Action::Quit, &mut actions);
        });
        ui.menu_button("View", |ui| {
            ui.set_min_width(190.0);
            item(ui, "Fit", Action::Fit, &mut actions);
            item(ui, "The scene's camera", Action::SceneCamera, &mut actions);
            item(ui, "Orthographic", Action::ToggleLens, &mut actions);
            item(ui, "Copy camera as text", Action::CopyCamera, &mut actions);
            ui.separator();
            for (side, name) in [
                (ViewSide::Front, "Front"),
                (ViewSide::Back, "Back"),
                (ViewSide::Left, "Left"),
                (ViewSide::Right, "Right"),
                (ViewSide::Top, "Top"),
                (ViewSide::Bottom, "Bottom"),
                (ViewSide::Corner, "Corner"),
            ] {
                item(ui, name, Action::Face(side), &mut actions);
            }
            ui.separator();
            item(ui, "Show the next view", Action::NextMode(1), &mut actions);
            item(ui, "Panels", Action::TogglePanels, &mut actions);
        });
        ui.menu_button("Help", |ui| {
            item(ui, "Keys and mouse", Action::Help, &mut actions);
        });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let path = session.source().path();
            let name = path
                .file_name()
                .unwrap_or(path.as_os_str())
                .to_string_lossy();
            let label = ui.label(RichText::new(name).color(theme::WEAK).size(12.5));
            label.on_hover_text(match session.source() {
                SceneOrigin::File(path) => path.display().to_string(),
                SceneOrigin::Text { .. } => "not in a file: changes are lost".to_owned(),
            });
        });
    });
    actions
}

fn item(ui: &mut Ui, text: &str, action: Action, actions: &mut Vec<Action>) {
    let key = RichText::new(key_of(action)).color(theme::WEAK).size(11.5);
    if ui.add(Button::new(text).right_text(key)).clicked() {
        actions.push(action);
        ui.close();
    }
}

fn examples_menu(ui: &mut Ui, examples: &[Example], events: &mut Vec<Event>) {
    ui.set_min_width(130.0);
    for example in examples {
        let item = ui.button(example.name);
        let description = example.text.lines().next().unwrap_or_default();
        let description = description.trim_start_matches('/').trim();
        if item.on_hover_text(description).clicked() {
            events.push(Event::Open(SceneOrigin::Text {
                name: format!("{}.sdf", example.name),
                text: example.text.to_owned(),
            }));
            ui.close();
        }
    }
}
