//! The left panel: one control per param, as its declaration specifies.

use super::action::{Action, key_of};
use super::icon::{self, Icon};
use super::number_box;
use super::state::WindowState;
use super::theme;
use crate::session::{Event, ParamState, Session};
use eframe::egui::{self, Align, DragValue, Layout, RichText, Slider, Ui, vec2};
use sdfc_vm::settings::ParamKind;

/// Shows the controls. Changes become events and actions.
pub(super) fn show(
    ui: &mut Ui,
    session: &Session,
    state: &mut WindowState,
    events: &mut Vec<Event>,
) -> Vec<Action> {
    let mut actions = Vec::new();
    ui.add_space(2.0);
    ui.label(theme::heading("PARAMS"));
    ui.add_space(2.0);
    let is_changed = session.params().iter().any(ParamState::is_changed);
    let bottom = 34.0;
    egui::ScrollArea::vertical()
        .max_height((ui.available_height() - bottom).max(60.0))
        .auto_shrink([false, true])
        .show(ui, |ui| {
            for (index, param) in session.params().iter().enumerate() {
                ui.push_id(index, |ui| row(ui, index, param, state, events));
                ui.add_space(5.0);
            }
        });
    ui.add_space(4.0);
    ui.add_enabled_ui(is_changed, |ui| {
        ui.horizontal(|ui| {
            let reset = ui.button("Reset all").on_hover_text(format!(
                "all params as in the text ({})",
                key_of(Action::ResetParams)
            ));
            if reset.clicked() {
                actions.push(Action::ResetParams);
            }
            let write = ui.button("Write all").on_hover_text(format!(
                "write the changed values into the text ({})",
                key_of(Action::WriteParams)
            ));
            if write.clicked() {
                actions.push(Action::WriteParams);
            }
        });
    });
    actions
}

/// Shows a param: its name, its value, and a slider below if it has a range.
fn row(
    ui: &mut Ui,
    index: usize,
    param: &ParamState,
    state: &mut WindowState,
    events: &mut Vec<Event>,
) {
    let scale = DisplayScale::from_param(param);
    let mut value = param.value.clone();
    let mut changed = false;
    ui.horizontal(|ui| {
        let name_width = (ui.available_width() - controls_width(param)).max(40.0);
        ui.scope(|ui| {
            ui.set_max_width(name_width);
            name(ui, param);
        });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            changed |= compact(ui, param, &scale, state, &mut value);
            if param.is_changed() {
                buttons(ui, index, param, events);
            }
        });
    });
    let ranged = param.spec.range.filter(|_| value.len() == 1);
    if let Some(range) = ranged.filter(|_| param.spec.kind != ParamKind::Bool) {
        changed |= slider(ui, param, &scale, range, &mut value[0]);
    }
    if changed {
        events.push(Event::Set(index, value));
    }
}

/// Returns the width of the controls in a param's line.
fn controls_width(param: &ParamState) -> f32 {
    let control_width = match (param.spec.kind, param.value.len()) {
        (ParamKind::Bool, _) => 24.0,
        (ParamKind::Color, _) | (_, 1) => 68.0,
        (_, count) => 50.0 * count as f32,
    };
    let buttons = if param.is_changed() { 46.0 } else { 0.0 };
    let mark = if param.spec.structural { 50.0 } else { 0.0 };
    control_width + buttons + mark
}

/// Display of a param's numbers in the author's unit.
struct DisplayScale {
    unit: &'static str,
    /// Size of the unit in scene units.
    factor: f64,
    decimals: usize,
    step: Option<f64>,
}

impl DisplayScale {
    fn from_param(param: &ParamState) -> Self {
        let (unit, factor) = param.unit();
        let is_integer = param.spec.kind == ParamKind::Int;
        let step = param.spec.step.map(|step| step / factor);
        let step = if is_integer {
            Some(step.unwrap_or(1.0))
        } else {
            step
        };
        let range_width = match param.spec.range {
            Some((min, max)) => (max - min) / factor,
            None => (param.spec.default[0] / factor).abs().max(1.0),
        };
        // Three digits of the range, or those of the step.
        let resolution = step.unwrap_or(range_width * 1e-3).abs().max(1e-9);
        let decimals = if is_integer {
            0
        } else {
            (-resolution.log10()).ceil().clamp(0.0, 9.0) as usize
        };
        Self {
            unit,
            factor,
            decimals,
            step,
        }
    }

    fn speed(&self, param: &ParamState) -> f64 {
        let range_width = param.spec.range.map(|(min, max)| (max - min) / self.factor);
        let size = (param.spec.default[0] / self.factor).abs().max(0.1);
        self.step
            .unwrap_or(range_width.unwrap_or(2.0 * size) / 200.0)
    }
}

fn name(ui: &mut Ui, param: &ParamState) {
    let color = if param.is_changed() {
        theme::ACCENT
    } else {
        theme::TEXT
    };
    let text = RichText::new(&param.spec.name).color(color);
    let response = ui.add(egui::Label::new(text).truncate());
    if param.spec.structural {
        ui.label(RichText::new("rebuilds").size(10.5).color(theme::WEAK))
            .on_hover_text("it decides the structure: a change compiles the scene again");
    }
    response.on_hover_ui(|ui| {
        if !param.spec.doc.is_empty() {
            ui.label(&param.spec.doc);
        }
        let range = param.spec.range.map(|(min, max)| {
            let (unit, factor) = param.unit();
            let dots = if param.spec.inclusive { "..=" } else { ".." };
            let [min, max] = [min, max].map(|v| format_short(v / factor));
            format!(", {min}{unit}{dots}{max}{unit}")
        });
        let text = format!(
            "{} = {}{}",
            param.spec.name,
            param.text(),
            range.unwrap_or_default()
        );
        ui.label(
            RichText::new(text)
                .font(theme::mono(12.0))
                .color(theme::WEAK),
        );
    });
}

/// Shows the control at the end of a param's line; returns whether it changed the value.
fn compact(
    ui: &mut Ui,
    param: &ParamState,
    scale: &DisplayScale,
    state: &mut WindowState,
    value: &mut [f64],
) -> bool {
    match (param.spec.kind, value) {
        (ParamKind::Bool, [value]) => {
            let mut is_on = *value != 0.0;
            let changed = ui.checkbox(&mut is_on, "").changed();
            *value = f64::from(is_on);
            changed
        }
        (ParamKind::Color, value @ [_, _, _]) => {
            let mut rgb = [value[0] as f32, value[1] as f32, value[2] as f32];
            ui.spacing_mut().interact_size.x = 56.0;
            let changed = ui.color_edit_button_rgb(&mut rgb).changed();
            if changed {
                for (to, from) in value.iter_mut().zip(rgb) {
                    *to = f64::from(from);
                }
            }
            changed
        }
        (_, [value]) => {
            ui.spacing_mut().interact_size.x = 64.0;
            number(ui, param, scale, state, value, "")
        }
        (_, value) => {
            // Laid out from right to left, so that x is on the left.
            let names = ["x ", "y ", "z "];
            let mut changed = false;
            ui.spacing_mut().item_spacing.x = 3.0;
            ui.spacing_mut().interact_size.x = 46.0;
            for (axis, value) in value.iter_mut().enumerate().rev() {
                changed |= number(
                    ui,
                    param,
                    scale,
                    state,
                    value,
                    names.get(axis).unwrap_or(&""),
                );
            }
            changed
        }
    }
}

/// Shows the number box of a component.
fn number(
    ui: &mut Ui,
    param: &ParamState,
    scale: &DisplayScale,
    state: &mut WindowState,
    value: &mut f64,
    prefix: &str,
) -> bool {
    let mut shown = *value / scale.factor;
    let mut drag = DragValue::new(&mut shown)
        .prefix(prefix)
        .suffix(scale.unit)
        .speed(scale.speed(param))
        .max_decimals(scale.decimals);
    if let Some((min, max)) = param.spec.range {
        drag = drag.range(min / scale.factor..=max / scale.factor);
    }
    let parse = |text: &str| param.evaluate(text).map(|value| value / scale.factor);
    let entry = number_box::show(ui, drag, *value / scale.factor, parse);
    if let Some(why) = entry.problem {
        state.show_message(ui.ctx(), why);
    }
    let changed = entry.response.changed();
    if changed {
        *value = shown * scale.factor;
    }
    changed
}

fn slider(
    ui: &mut Ui,
    param: &ParamState,
    scale: &DisplayScale,
    range: (f64, f64),
    value: &mut f64,
) -> bool {
    let mut shown = *value / scale.factor;
    ui.spacing_mut().slider_width = ui.available_width();
    let mut slider = Slider::new(&mut shown, range.0 / scale.factor..=range.1 / scale.factor)
        .show_value(false)
        .max_decimals(scale.decimals);
    if let Some(step) = scale.step {
        slider = slider.step_by(step);
    }
    let changed = ui.add(slider).changed();
    if changed {
        *value = shown * scale.factor;
        if param.spec.kind == ParamKind::Int {
            *value = value.round();
        }
    }
    changed
}

/// Shows the buttons that reset the value or write it into the text.
fn buttons(ui: &mut Ui, index: usize, param: &ParamState, events: &mut Vec<Event>) {
    ui.spacing_mut().item_spacing.x = 1.0;
    let size = vec2(20.0, 20.0);
    let reset = icon::button(ui, Icon::Reset, size, true);
    if reset.on_hover_text("as it stands in the text").clicked() {
        events.push(Event::Reset(index));
    }
    if param.source.is_some() {
        let write = icon::button(ui, Icon::Write, size, true);
        let text = format!("write {} into the text", param.text());
        if write.on_hover_text(text).clicked() {
            events.push(Event::WriteBack(vec![index]));
        }
    }
}

/// Formats a number with at most four decimals.
fn format_short(v: f64) -> String {
    let text = format!("{v:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_ranges_are_short() {
        assert_eq!(
            [0.5, 120.0, 1.0 / 3.0, 0.0].map(format_short),
            ["0.5", "120", "0.3333", "0"]
        );
    }
}
