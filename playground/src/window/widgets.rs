//! Grids and buttons of the side panel.

use eframe::egui::{self, Button, RichText, Ui, vec2};

/// Shows items in a grid of `columns` columns, as wide as the panel.
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

/// Shows a button that selects one of several options.
pub(super) fn choice_button(
    ui: &mut Ui,
    text: &str,
    is_chosen: bool,
    width: f32,
) -> egui::Response {
    let button = Button::new(RichText::new(text).size(12.5)).selected(is_chosen);
    ui.add(button.min_size(vec2(width, 22.0)).truncate())
}
