//! The time bar of an animation.

use super::action::{Action, key_of};
use super::icon::{self, Icon};
use super::number_box;
use super::theme;
use crate::param_input::evaluate;
use crate::session::{Event, Session, TimeEvent};
use crate::timeline::SPEED_RANGE;
use eframe::egui::{Align, DragValue, Layout, RichText, Slider, Ui, vec2};
use sdfc_vm::settings::ParamKind;

/// Shows the time bar of an animated scene.
pub(super) fn show(ui: &mut Ui, session: &Session, events: &mut Vec<Event>) {
    let Some(timeline) = session.timeline() else {
        return;
    };
    ui.horizontal_centered(|ui| {
        let mut button = |ui: &mut Ui, icon, description: &str, action, event| {
            let button = icon::button(ui, icon, vec2(28.0, 22.0), false);
            let description = format!("{description} ({})", key_of(action));
            if button.on_hover_text(description).clicked() {
                events.push(Event::Time(event));
            }
        };
        ui.spacing_mut().item_spacing.x = 4.0;
        let (back, forward) = (Action::Step(-1), Action::Step(1));
        button(ui, Icon::Back, "a frame back", back, TimeEvent::Step(-1));
        let (icon, description) = match timeline.is_playing() {
            true => (Icon::Pause, "pause"),
            false => (Icon::Play, "play"),
        };
        button(ui, icon, description, Action::Play, TimeEvent::Toggle);
        button(
            ui,
            Icon::Forth,
            "a frame forwards",
            forward,
            TimeEvent::Step(1),
        );
        ui.add_space(6.0);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 8.0;
            let mut speed = timeline.speed();
            let drag = DragValue::new(&mut speed)
                .range(SPEED_RANGE[0]..=SPEED_RANGE[1])
                .speed(0.02)
                .max_decimals(2)
                .suffix("×");
            let parse = |text: &str| evaluate(text, ParamKind::Float, 1.0, None);
            let entry = number_box::show(ui, drag, timeline.speed(), parse);
            if entry.response.on_hover_text("speed").changed() {
                events.push(Event::Time(TimeEvent::Speed(speed)));
            }
            let mut repeats = timeline.repeats();
            if ui.checkbox(&mut repeats, "loop").changed() {
                events.push(Event::Time(TimeEvent::Repeat(repeats)));
            }
            let clock = format!("{:6.2} / {:.2} s", timeline.time(), timeline.duration());
            let clock = RichText::new(clock).font(theme::mono(12.0));
            ui.label(clock.color(theme::TEXT)).on_hover_text(format!(
                "frame {} of {}",
                timeline.frame(),
                timeline.frames()
            ));
            let mut time = timeline.time();
            ui.spacing_mut().slider_width = ui.available_width();
            let slider = Slider::new(&mut time, 0.0..=timeline.duration())
                .show_value(false)
                .smart_aim(false);
            if ui.add(slider).changed() {
                events.push(Event::Time(TimeEvent::Scrub(time)));
            }
        });
    });
}
