//! What is opened over the picture by hand: the keys, and a field for a path; and what is said for a
//! while.

use super::action::KEYS;
use super::desk::{Desk, Overlay};
use super::theme;
use crate::build::Source;
use crate::session::{Event, Session};
use eframe::egui::{
    self, Align2, Area, Context, Frame, Grid, Id, Key, Margin, Modal, Rect, RichText, Stroke,
    TextEdit, Ui, vec2,
};
use std::path::PathBuf;

/// What the mouse does.
const MOUSE: [(&str, &str); 7] = [
    ("drag", "around what the camera looks at"),
    ("right or shift drag", "along the picture"),
    ("wheel", "nearer to what is under the cursor"),
    ("click", "all about what is under the cursor"),
    ("double click", "look at what is under the cursor"),
    ("drop a file", "open it"),
    ("hover a name", "what a param is for"),
];

/// Shows what is open.
pub(super) fn show(ctx: &Context, desk: &mut Desk, events: &mut Vec<Event>) {
    match desk.overlay {
        Overlay::None => {}
        Overlay::Help => {
            let response = Modal::new(Id::unique("help"))
                .frame(frame())
                .show(ctx, help);
            if response.should_close() {
                desk.overlay = Overlay::None;
            }
        }
        Overlay::Open => {
            let response = Modal::new(Id::unique("open"))
                .frame(frame())
                .show(ctx, |ui| open(ui, desk, events));
            if response.should_close() {
                desk.overlay = Overlay::None;
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

fn help(ui: &mut Ui) {
    ui.set_max_width(640.0);
    ui.horizontal_top(|ui| {
        let half = KEYS.len().div_ceil(2);
        for (at, keys) in KEYS.chunks(half).enumerate() {
            ui.vertical(|ui| {
                ui.label(theme::heading(if at == 0 { "KEYS" } else { "" }));
                let rows = keys.iter().map(|binding| (binding.name, binding.says));
                rows_of(ui, at, rows);
            });
            ui.add_space(18.0);
        }
    });
    ui.add_space(10.0);
    ui.label(theme::heading("MOUSE"));
    rows_of(ui, KEYS.len(), MOUSE.into_iter());
}

fn rows_of<'a>(ui: &mut Ui, id: usize, rows: impl Iterator<Item = (&'a str, &'a str)>) {
    Grid::new(id).spacing(vec2(14.0, 4.0)).show(ui, |ui| {
        for (name, says) in rows {
            ui.label(
                RichText::new(name)
                    .font(theme::mono(12.0))
                    .color(theme::ACCENT),
            );
            ui.label(RichText::new(says).size(13.0));
            ui.end_row();
        }
    });
}

fn open(ui: &mut Ui, desk: &mut Desk, events: &mut Vec<Event>) {
    ui.set_width(460.0);
    ui.label(theme::heading("OPEN A FILE"));
    let field = TextEdit::singleline(&mut desk.path)
        .font(theme::mono(13.0))
        .hint_text("path of a .sdf, .sdfb or .vm file")
        .margin(Margin::symmetric(8, 6))
        .desired_width(f32::INFINITY);
    let field = ui.add(field);
    if std::mem::take(&mut desk.path_is_new) {
        field.request_focus();
    }
    let enter = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        let can = !desk.path.trim().is_empty();
        let button = ui.add_enabled(can, egui::Button::new("Open"));
        if can && (enter || button.clicked()) {
            let path = PathBuf::from(desk.path.trim());
            events.push(Event::Open(Source::File(path)));
            desk.overlay = Overlay::None;
        }
        if ui.button("Cancel").clicked() {
            desk.overlay = Overlay::None;
        }
    });
}

/// Shows what was said last, for a while.
pub(super) fn said(
    ctx: &Context,
    session: &Session,
    desk: &mut Desk,
    over: Rect,
    events: &mut Vec<Event>,
) {
    let (saying, is_over) = desk.saying(ctx, session);
    if is_over {
        events.push(Event::Dismiss);
    }
    let Some((text, fails)) = saying else {
        return;
    };
    let line = if fails { theme::ERROR } else { theme::LINE };
    Area::new(Id::unique("said"))
        .pivot(Align2::CENTER_TOP)
        .fixed_pos(over.center_top() + vec2(0.0, 12.0))
        .order(egui::Order::Foreground)
        .interactable(false)
        .show(ctx, |ui| {
            ui.set_max_width((over.width() - 40.0).max(120.0));
            Frame::new()
                .fill(theme::OVERLAY.gamma_multiply(0.94))
                .stroke(Stroke::new(1.0, line))
                .corner_radius(6.0)
                .inner_margin(Margin::symmetric(12, 6))
                .show(ui, |ui| ui.label(RichText::new(text).size(13.0)));
        });
}
