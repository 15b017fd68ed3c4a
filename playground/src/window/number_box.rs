//! Number boxes: numbers that are dragged or typed. A typed number counts once it is complete; Escape
//! restores the previous one.

use eframe::egui::{Context, DragValue, Id, Key, Response, Ui, emath};
use std::cell::RefCell;

/// Number of passes over which egui reports that a widget lost the focus.
const FOCUS_LOSS_PASSES: u64 = 2;

/// Result of a number box.
pub(super) struct NumberEntry {
    pub(super) response: Response,
    /// Reason why the typed text is not a number.
    pub(super) problem: Option<String>,
}

/// Shows a number box. `parse` evaluates the typed text; `value` is the current number.
pub(super) fn show(
    ui: &mut Ui,
    drag: DragValue<'_>,
    value: f64,
    parse: impl Fn(&str) -> Result<f64, String>,
) -> NumberEntry {
    let formatted = RefCell::new(String::new());
    let problem = RefCell::new(None);
    let is_restored = is_escaped(ui.ctx());
    let drag = drag
        .update_while_editing(false)
        .custom_formatter(|value, decimals| {
            let text = emath::format_with_decimals_in_range(value, decimals);
            formatted.borrow_mut().clone_from(&text);
            text
        })
        .custom_parser(|text| {
            // The digits shown may be fewer than those of the value.
            if is_restored || *formatted.borrow() == text {
                return Some(value);
            }
            parse(text).map_err(|why| problem.replace(Some(why))).ok()
        });
    let response = ui.add(drag);
    NumberEntry {
        response,
        problem: problem.take(),
    }
}

fn escape_id() -> Id {
    Id::unique("last escape")
}

/// Records a pressed Escape key. It is called at the start of each frame.
pub(super) fn observe_escape(ctx: &Context) {
    if ctx.input(|input| input.key_pressed(Key::Escape)) {
        let pass = ctx.cumulative_pass_nr();
        ctx.data_mut(|data| data.insert_temp(escape_id(), pass));
    }
}

/// Reports whether Escape ended the last entry. A widget reports the loss of its focus for longer than the
/// key is pressed.
pub(super) fn is_escaped(ctx: &Context) -> bool {
    let escaped_at: Option<u64> = ctx.data(|data| data.get_temp(escape_id()));
    escaped_at.is_some_and(|pass| ctx.cumulative_pass_nr() <= pass + FOCUS_LOSS_PASSES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Event, Modifiers, RawInput};

    /// Returns the number in a focused box after each of the events, one a frame.
    fn after(events: Vec<Event>) -> Vec<f64> {
        let ctx = Context::default();
        let mut value = 0.123_456;
        let mut frame = |events: Vec<Event>| {
            let input = RawInput {
                events,
                ..RawInput::default()
            };
            let mut shown = value;
            let mut output = ctx.run_ui(input, |ui| {
                observe_escape(ui.ctx());
                let drag = DragValue::new(&mut shown).range(0.0..=50.0).max_decimals(2);
                let entry = super::show(ui, drag, value, |text| {
                    text.parse()
                        .map_err(|_| format!("`{text}` is not a number"))
                });
                if value == 0.123_456 && ui.input(|input| input.events.is_empty()) {
                    entry.response.request_focus();
                }
            });
            output.textures_delta.clear();
            value = shown;
            value
        };
        frame(Vec::new());
        frame(Vec::new());
        // A click selects the whole text.
        frame(vec![pressed(Key::A, Modifiers::COMMAND)]);
        let mut values: Vec<f64> = events.into_iter().map(|event| frame(vec![event])).collect();
        values.push(frame(vec![Event::PointerGone]));
        values.push(frame(vec![Event::PointerGone]));
        values
    }

    fn pressed(key: Key, modifiers: Modifiers) -> Event {
        Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers,
        }
    }

    fn key(key: Key) -> Event {
        pressed(key, Modifiers::NONE)
    }

    #[test]
    fn a_typed_number_counts_after_enter_and_is_limited_then() {
        let typed = |text: &str| Event::Text(text.to_owned());
        let values = after(vec![typed("4"), typed("0"), key(Key::Enter)]);
        assert_eq!(values, [0.123_456, 0.123_456, 40.0, 40.0, 40.0]);
        let values = after(vec![typed("9"), typed("9"), key(Key::Enter)]);
        assert_eq!(values.last(), Some(&50.0));
        let values = after(vec![typed("4x"), key(Key::Enter)]);
        assert_eq!(values.last(), Some(&0.123_456), "it is not a number");
    }

    #[test]
    fn escape_restores_the_number_and_enter_keeps_its_digits() {
        let values = after(vec![Event::Text("4".to_owned()), key(Key::Escape)]);
        assert!(values.iter().all(|v| *v == 0.123_456), "{values:?}");
        let values = after(vec![key(Key::Enter)]);
        assert!(values.iter().all(|v| *v == 0.123_456), "{values:?}");
    }
}
