//! Labels in the corners of the picture: the legend, and the description of the picked point.

use super::picture_view::point_of;
use super::theme;
use crate::inspect::pick::Pick;
use crate::session::{Event, Session};
use eframe::egui::{
    Align2, Area, Color32, Frame, Grid, Id, Label, Margin, Order, Rect, RichText, Sense, Stroke,
    Ui, vec2,
};

fn frame() -> Frame {
    Frame::new()
        .fill(theme::OVERLAY.gamma_multiply(0.93))
        .stroke(Stroke::new(1.0, theme::LINE))
        .corner_radius(6.0)
        .inner_margin(Margin::symmetric(10, 7))
}

/// Shows the legend and notes of the displayed picture in its upper left corner.
pub(super) fn legend(ui: &Ui, session: &Session, picture_area: Rect) {
    let Some((picture, _)) = session.picture() else {
        return;
    };
    let value = ui
        .input(|input| input.pointer.hover_pos())
        .and_then(|position| {
            let offset = (position - picture_area.min) / picture_area.size();
            picture.value_at(offset.into())
        });
    if picture.legend.is_empty() && picture.notes.is_empty() {
        return;
    }
    Area::new(Id::unique("legend"))
        .fixed_pos(picture_area.left_top() + vec2(12.0, 12.0))
        .order(Order::Middle)
        .interactable(false)
        .show(ui.ctx(), |ui| {
            ui.set_max_width((picture_area.width() - 24.0).max(100.0));
            frame().show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 3.0;
                for ([r, g, b, _], text) in &picture.legend {
                    ui.horizontal(|ui| {
                        let (swatch, _) = ui.allocate_exact_size(vec2(12.0, 12.0), Sense::hover());
                        let color = Color32::from_rgb(*r, *g, *b);
                        ui.painter().rect_filled(swatch, 2.0, color);
                        ui.label(RichText::new(text).size(12.0));
                    });
                }
                if let Some((value, unit)) = value {
                    let text = format!("{value:.4} {unit} under the cursor");
                    ui.label(RichText::new(text).size(12.0));
                }
                for note in &picture.notes {
                    ui.label(RichText::new(note).size(12.0).color(theme::WEAK));
                }
            });
        });
}

/// Marks the picked point and shows its description in the upper right corner.
pub(super) fn pick(ui: &Ui, session: &Session, picture_area: Rect, events: &mut Vec<Event>) {
    let Some(picked) = session.picked() else {
        return;
    };
    if let Ok(Some(pick)) = &picked.result {
        mark(ui, session, pick, picture_area);
    }
    Area::new(Id::unique("pick"))
        .pivot(Align2::RIGHT_TOP)
        .fixed_pos(picture_area.right_top() + vec2(-12.0, 12.0))
        .order(Order::Middle)
        .show(ui.ctx(), |ui| {
            ui.set_max_width((picture_area.width() - 24.0).clamp(120.0, 310.0));
            let response = frame()
                .show(ui, |ui| match &picked.result {
                    Ok(Some(pick)) => description(ui, pick),
                    Ok(None) => {
                        ui.label("the sky");
                    }
                    Err(problem) => {
                        ui.label(RichText::new(problem.to_string()).color(theme::ERROR));
                    }
                })
                .response;
            let close = response.interact(Sense::click());
            if close.on_hover_text("click to close (Esc)").clicked() {
                events.push(Event::Unpick);
            }
        });
}

/// Draws a ring at the point's current position.
fn mark(ui: &Ui, session: &Session, pick: &Pick, picture_area: Rect) {
    let aspect = f64::from(picture_area.width() / picture_area.height());
    let ndc = session
        .camera()
        .and_then(|camera| camera.project(pick.point, aspect));
    let Some(position) = ndc.map(|ndc| point_of(ndc, picture_area)) else {
        return;
    };
    if picture_area.contains(position) {
        let painter = ui.painter().with_clip_rect(picture_area);
        painter.circle_stroke(
            position,
            6.0,
            Stroke::new(3.0, Color32::from_black_alpha(160)),
        );
        painter.circle_stroke(position, 6.0, Stroke::new(1.5, Color32::WHITE));
    }
}

fn description(ui: &mut Ui, pick: &Pick) {
    let mono = |text: String| RichText::new(text).font(theme::mono(11.5));
    ui.spacing_mut().item_spacing.y = 3.0;
    // The source text first, then the names of the enclosing shapes.
    if let Some(origin) = pick.origins.first() {
        let file = origin.file.rsplit('/').next().unwrap_or(&origin.file);
        let position = format!("{file}:{}:{}", origin.position.line, origin.position.column);
        ui.label(mono(position).color(theme::ACCENT));
        let first = origin.text.lines().next().unwrap_or_default();
        let label = Label::new(mono(first.to_owned()).color(Color32::WHITE)).truncate();
        ui.add(label).on_hover_text(mono(origin.text.clone()));
        // A shape of an import is used at a place of the scene's own text.
        for around in pick.outer_places() {
            let file = around.file.rsplit('/').next().unwrap_or(&around.file);
            let position = around.position;
            let text = format!("used in {file}:{}:{}", position.line, position.column);
            ui.label(mono(text).color(theme::ACCENT));
        }
        let names = pick.origins.iter().map(|origin| origin.name.as_str());
        let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
        if !names.is_empty() {
            let text = mono(names.join(" in ")).color(theme::HELP);
            ui.add(Label::new(text).truncate());
        }
        ui.separator();
    }
    // Text rows are lower than buttons.
    ui.spacing_mut().interact_size.y = 16.0;
    Grid::new("pick").spacing(vec2(12.0, 1.0)).show(ui, |ui| {
        let mut row = |name: &str, text: String| {
            ui.label(RichText::new(name).size(11.5).color(theme::WEAK));
            ui.add(Label::new(mono(text)).extend());
            ui.end_row();
        };
        row("point", list(pick.point));
        row("distance", format!("{:.6}", pick.distance));
        row("normal", list(pick.normal.map(f64::from)));
        row("material", pick.material_name().to_owned());
        row("albedo, linear", list(pick.surface.albedo.map(f64::from)));
        let surface = &pick.surface;
        row(
            "rough, metal",
            format!("{:.2}, {:.2}", surface.roughness, surface.metallic),
        );
        row("field", format!("{:.2e}", pick.field));
        row("slope", format!("{:.4} of at most 1", pick.slope));
        let branch_note = if pick.rounding.branch_uncertain {
            ", branch uncertain"
        } else {
            ""
        };
        row(
            "error",
            format!(
                "{:.1e}, {:.1e} pixels{branch_note}",
                pick.rounding.field, pick.rounding.pixels
            ),
        );
    });
}

fn list(numbers: [f64; 3]) -> String {
    numbers.map(|number| format!("{number:.4}")).join("  ")
}
