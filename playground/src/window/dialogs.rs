//! Dialogs over the picture: the list of keys, and the path of a file to open; also the status message.

use super::action::KEYS;
use super::state::{Dialog, WindowState};
use super::theme;
use crate::build::SceneOrigin;
use crate::session::{Event, Session};
use eframe::egui::{
    self, Align2, Area, Context, Frame, Grid, Id, Key, Margin, Modal, Rect, RichText, Stroke,
    TextEdit, Ui, Vec2, vec2,
};
use std::path::PathBuf;

/// Mouse gestures and their effects.
const MOUSE_HELP: [(&str, &str); 7] = [
    ("drag", "orbit around the camera's target"),
    ("right or shift drag", "move along the picture"),
    ("wheel", "move nearer to the point under the cursor"),
    ("click", "inspect the point under the cursor"),
    ("double click", "look at the point under the cursor"),
    ("drop a file", "open it"),
    ("hover a name", "description of a param"),
];

/// Shows the open dialog.
pub(super) fn show(ctx: &Context, state: &mut WindowState, events: &mut Vec<Event>) {
    match state.dialog {
        Dialog::None => {}
        Dialog::Help => {
            let response = Modal::new(Id::unique("help"))
                .frame(frame())
                .show(ctx, help);
            if response.should_close() {
                state.dialog = Dialog::None;
            }
        }
        Dialog::Open => {
            let response = Modal::new(Id::unique("open"))
                .frame(frame())
                .show(ctx, |ui| open(ui, state, events));
            if response.should_close() {
                state.dialog = Dialog::None;
            }
        }
    }
}

fn frame() -> Frame {
    Frame::new()
        .fill(theme::OVERLAY)
        .stroke(Stroke::new(1.0, theme::LINE))
        .corner_radius(8.0)
        .inner_margin(Margin::same(18))
}

/// Distance of the help from the edges of the window, in points.
const HELP_MARGIN: f32 = 30.0;

fn help(ui: &mut Ui) {
    let window = ui.ctx().content_rect().size();
    let space = (window - Vec2::splat(2.0 * HELP_MARGIN)).max(Vec2::splat(80.0));
    ui.set_max_width(space.x.min(640.0));
    ui.set_max_height(space.y);
    let columns = if space.x < 560.0 { 1 } else { 2 };
    egui::ScrollArea::vertical()
        .max_height(space.y)
        .show(ui, |ui| help_content(ui, columns));
}

fn help_content(ui: &mut Ui, columns: usize) {
    ui.horizontal_top(|ui| {
        let half = KEYS.len().div_ceil(columns);
        for (column, keys) in KEYS.chunks(half).enumerate() {
            ui.vertical(|ui| {
                ui.label(theme::heading(if column == 0 { "KEYS" } else { "" }));
                let rows = keys
                    .iter()
                    .map(|binding| (binding.name, binding.description));
                help_rows(ui, column, rows);
            });
            ui.add_space(18.0);
        }
    });
    ui.add_space(10.0);
    ui.label(theme::heading("MOUSE"));
    help_rows(ui, KEYS.len(), MOUSE_HELP.into_iter());
}

fn help_rows<'a>(ui: &mut Ui, id: usize, rows: impl Iterator<Item = (&'a str, &'a str)>) {
    Grid::new(id).spacing(vec2(14.0, 4.0)).show(ui, |ui| {
        for (name, description) in rows {
            ui.label(
                RichText::new(name)
                    .font(theme::mono(12.0))
                    .color(theme::ACCENT),
            );
            ui.label(RichText::new(description).size(13.0));
            ui.end_row();
        }
    });
}

fn open(ui: &mut Ui, state: &mut WindowState, events: &mut Vec<Event>) {
    ui.set_width(460.0);
    ui.label(theme::heading("OPEN A FILE"));
    let field = TextEdit::singleline(&mut state.path)
        .font(theme::mono(13.0))
        .hint_text("path of a .sdf, .sdfb or .vm file")
        .margin(Margin::symmetric(8, 6))
        .desired_width(f32::INFINITY);
    let field = ui.add(field);
    if state.frames_until_focus > 0 {
        state.frames_until_focus -= 1;
        field.request_focus();
        ui.request_repaint();
    }
    let enter = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        let can = !state.path.trim().is_empty();
        let button = ui.add_enabled(can, egui::Button::new("Open"));
        if can && (enter || button.clicked()) {
            let path = PathBuf::from(state.path.trim());
            events.push(Event::Open(SceneOrigin::File(path)));
            state.dialog = Dialog::None;
        }
        if ui.button("Cancel").clicked() {
            state.dialog = Dialog::None;
        }
    });
}

/// Shows the last message until it expires.
pub(super) fn message(
    ctx: &Context,
    session: &Session,
    state: &mut WindowState,
    picture_area: Rect,
    events: &mut Vec<Event>,
) {
    let (current_message, is_over) = state.current_message(ctx, session);
    if is_over {
        events.push(Event::Dismiss);
    }
    let Some((text, is_failure)) = current_message else {
        return;
    };
    let line = if is_failure {
        theme::ERROR
    } else {
        theme::LINE
    };
    Area::new(Id::unique("said"))
        .pivot(Align2::CENTER_TOP)
        .fixed_pos(picture_area.center_top() + vec2(0.0, 12.0))
        .order(egui::Order::Foreground)
        .interactable(false)
        .show(ctx, |ui| {
            ui.set_max_width((picture_area.width() - 40.0).max(120.0));
            Frame::new()
                .fill(theme::OVERLAY.gamma_multiply(0.94))
                .stroke(Stroke::new(1.0, line))
                .corner_radius(6.0)
                .inner_margin(Margin::symmetric(12, 6))
                .show(ui, |ui| ui.label(RichText::new(text).size(13.0)));
        });
}
