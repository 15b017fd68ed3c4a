//! Queue of input that splits the events of a busy moment over several frames.
//!
//! A frame passes its events to all widgets at once, and the focus moves only between frames. Without the
//! queue, letters that follow a click on a text field within one frame would count as keys of the window.

use eframe::egui::{Event, Key};
use std::collections::VecDeque;

/// Receiver of the next keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KeyReceiver {
    /// A text field has the focus.
    TextField,
    /// A text field is about to receive the focus.
    NoneYet,
    /// A widget without text has the focus.
    Widget,
    /// No widget has the focus.
    Window,
}

/// Events that no frame has received yet, in order.
#[derive(Debug, Default)]
pub(super) struct InputQueue {
    pending: VecDeque<Event>,
}

impl InputQueue {
    /// Adds new events, and takes those of the next frame. It ends after an event that can move the focus.
    pub(super) fn next_frame(
        &mut self,
        new: impl IntoIterator<Item = Event>,
        receiver: KeyReceiver,
    ) -> Vec<Event> {
        self.pending.extend(new);
        let mut frame = Vec::new();
        while let Some(event) = self.pending.front() {
            if receiver == KeyReceiver::NoneYet && is_keyboard_input(event) {
                break;
            }
            let ends_frame = ends_frame(event, receiver);
            frame.extend(self.pending.pop_front());
            if ends_frame {
                // A text event belongs to the key before it.
                frame.extend(
                    self.pending
                        .pop_front_if(|event| matches!(event, Event::Text(_))),
                );
                break;
            }
        }
        frame
    }

    /// Reports whether all events were received by a frame.
    pub(super) fn is_empty(&self) -> bool {
        self.pending.is_empty()
    }
}

fn is_keyboard_input(event: &Event) -> bool {
    matches!(
        event,
        Event::Key { .. } | Event::Text(_) | Event::Paste(_) | Event::Copy | Event::Cut
    )
}

/// Reports whether the receiver of keys may change with this event.
fn ends_frame(event: &Event, receiver: KeyReceiver) -> bool {
    match event {
        Event::PointerButton { .. } => true,
        Event::Key {
            key, pressed: true, ..
        } => {
            receiver != KeyReceiver::TextField || matches!(key, Key::Enter | Key::Tab | Key::Escape)
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Modifiers, PointerButton, pos2};

    fn key(key: Key) -> Event {
        Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        }
    }

    fn click(pressed: bool) -> Event {
        Event::PointerButton {
            pos: pos2(1.0, 1.0),
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        }
    }

    fn letter(letter: Key) -> [Event; 2] {
        [key(letter), Event::Text(letter.name().to_lowercase())]
    }

    #[test]
    fn the_window_receives_one_key_a_frame() {
        let mut queue = InputQueue::default();
        let events: Vec<Event> = [Key::M, Key::M, Key::P].map(letter).concat();
        let mut frames = vec![queue.next_frame(events, KeyReceiver::Window)];
        while !queue.is_empty() {
            frames.push(queue.next_frame([], KeyReceiver::Window));
        }
        assert_eq!(frames, [Key::M, Key::M, Key::P].map(|k| letter(k).to_vec()));
    }

    #[test]
    fn letters_after_a_click_wait_for_its_focus() {
        let mut queue = InputQueue::default();
        let mut events = vec![click(true), click(false)];
        events.extend([Key::S, Key::W].map(letter).concat());
        events.push(key(Key::Enter));
        events.extend(letter(Key::P));
        let pressed = queue.next_frame(events, KeyReceiver::Window);
        assert_eq!(pressed, [click(true)]);
        assert_eq!(queue.next_frame([], KeyReceiver::Window), [click(false)]);
        // Typing is not slowed down, up to the end of the entry.
        let typed = queue.next_frame([], KeyReceiver::TextField);
        assert_eq!(typed.len(), 5);
        assert_eq!(typed[4], key(Key::Enter));
        assert_eq!(queue.next_frame([], KeyReceiver::Window), letter(Key::P));
        assert!(queue.is_empty());
    }

    #[test]
    fn a_field_that_opens_holds_letters_back() {
        let mut queue = InputQueue::default();
        let moved = Event::PointerMoved(pos2(3.0, 4.0));
        let mut events = vec![moved.clone()];
        events.extend(letter(Key::S));
        assert_eq!(queue.next_frame(events, KeyReceiver::NoneYet), [moved]);
        assert_eq!(queue.next_frame([], KeyReceiver::NoneYet), []);
        assert_eq!(queue.next_frame([], KeyReceiver::TextField), letter(Key::S));
    }
}
