//! The picture in the middle, and what the mouse does there.

use super::canvas::{self, Pixels};
use super::theme;
use crate::camera::Place;
use crate::session::{CameraEvent, Event, Session};
use eframe::egui::{
    self, CursorIcon, PointerButton, Pos2, Rect, Response, Sense, Stroke, StrokeKind, Ui, Vec2,
    vec2,
};
use std::f32::consts::PI;
use std::sync::Arc;

/// How much nearer one notch of the wheel brings the camera.
const NOTCH: f64 = 0.0022;

/// The last picture, and the mouse over it.
#[derive(Default)]
pub(super) struct Stage {
    pixels: Option<Pixels>,
    /// Up to where the mouse has dragged.
    dragged: Option<Pos2>,
}

impl Stage {
    /// Shows the picture in all the space there is, and tells the session how large that is and what
    /// the mouse does. Gives the place of the picture on the screen.
    pub(super) fn show(&mut self, ui: &mut Ui, session: &Session, events: &mut Vec<Event>) -> Rect {
        let (rect, size) = on_pixels(ui.available_rect_before_wrap(), ui.pixels_per_point());
        events.push(Event::Resized(size));
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        self.take(session);
        match self.pixels.clone().filter(|_| session.seen().is_some()) {
            Some(pixels) => {
                let painting = canvas::paint(rect, pixels, session.is_broken());
                ui.painter().add(painting);
            }
            None => {
                ui.painter().rect_filled(rect, 0.0, theme::BACKDROP);
            }
        }
        if session.is_broken() {
            let stroke = Stroke::new(2.0, theme::ERROR);
            ui.painter()
                .rect_stroke(rect, 0.0, stroke, StrokeKind::Inside);
        }
        self.drag(ui, &response, rect, events);
        over(ui, &response, rect, events);
        rect
    }

    /// Takes a new picture from the session.
    fn take(&mut self, session: &Session) {
        let Some((picture, number)) = session.seen() else {
            return;
        };
        if self
            .pixels
            .as_ref()
            .is_none_or(|pixels| pixels.number != number)
        {
            self.pixels = Some(Pixels {
                number,
                size: picture.size.map(|side| side as u32),
                rgba: Arc::clone(&picture.rgba),
            });
        }
    }

    /// Turns and pans the camera. All of the way counts: what the mouse went before it was clear that it
    /// drags, and what it went before it let go, but not after.
    fn drag(&mut self, ui: &Ui, response: &Response, rect: Rect, events: &mut Vec<Event>) {
        let by = |button| response.dragged_by(button) || response.drag_stopped_by(button);
        let left = by(PointerButton::Primary);
        let right = by(PointerButton::Secondary) || by(PointerButton::Middle);
        let (from, to, shift) = ui.input(|input| {
            let from = self.dragged.or(input.pointer.press_origin());
            let released = input.events.iter().find_map(|event| match event {
                egui::Event::PointerButton {
                    pos,
                    pressed: false,
                    ..
                } => Some(*pos),
                _ => None,
            });
            let to = released.or(input.pointer.latest_pos());
            (from, to, input.modifiers.shift)
        });
        let dragged = from.zip(to).filter(|_| left || right);
        self.dragged = match response.drag_stopped() {
            true => None,
            false => dragged.map(|(_, to)| to),
        };
        let Some((from, to)) = dragged else {
            return;
        };
        let pans = right || shift;
        if pans {
            ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
        }
        let delta = to - from;
        if delta == Vec2::ZERO {
            return;
        }
        events.push(Event::Camera(if pans {
            CameraEvent::Pan(place(from, rect), place(to, rect))
        } else {
            // From edge to edge is half a turn.
            let [right, up] = [-delta.x, delta.y].map(|d| f64::from(d * PI / rect.height()));
            CameraEvent::Orbit([right, up])
        }));
    }
}

/// The space, moved onto whole pixels of the screen, and how many it has.
fn on_pixels(space: Rect, scale: f32) -> (Rect, [u32; 2]) {
    let corner = |p: Pos2| vec2((p.x * scale).round(), (p.y * scale).round());
    let (low, high) = (corner(space.min), corner(space.max));
    let size = (high - low).max(Vec2::splat(1.0));
    let rect = Rect::from_min_size((low / scale).to_pos2(), size / scale);
    (rect, [size.x as u32, size.y as u32])
}

/// The place in the picture of a point on the screen.
fn place(point: Pos2, rect: Rect) -> Place {
    let x = (point.x - rect.center().x) / (rect.width() / 2.0);
    let y = (point.y - rect.center().y) / (rect.height() / 2.0);
    [f64::from(x), f64::from(-y)]
}

/// The point on the screen of a place in the picture.
pub(super) fn point_of([x, y]: Place, rect: Rect) -> Pos2 {
    let half = rect.size() / 2.0;
    rect.center() + vec2(x as f32 * half.x, -y as f32 * half.y)
}

/// What the mouse does without being held down: the wheel, and clicks.
fn over(ui: &Ui, response: &Response, rect: Rect, events: &mut Vec<Event>) {
    let Some(over) = response.hover_pos() else {
        return;
    };
    let wheel = ui.input(|input| input.smooth_scroll_delta().y + 200.0 * input.zoom_delta().ln());
    if wheel != 0.0 {
        let factor = (-f64::from(wheel) * NOTCH).exp();
        events.push(Event::Camera(CameraEvent::Zoom(factor, place(over, rect))));
    }
    if response.clicked() {
        events.push(Event::Pick(place(over, rect)));
    }
    if response.double_clicked() {
        events.push(Event::Camera(CameraEvent::Focus(place(over, rect))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::pos2;

    #[test]
    fn a_space_lies_on_whole_pixels() {
        let space = Rect::from_min_max(pos2(10.3, 20.6), pos2(110.1, 80.2));
        let (rect, size) = on_pixels(space, 2.0);
        assert_eq!(size, [199, 119]);
        assert_eq!(rect.min, pos2(10.5, 20.5));
        assert_eq!(rect.max, pos2(110.0, 80.0));
        let nothing = Rect::from_min_max(pos2(5.0, 5.0), pos2(3.0, 3.0));
        assert_eq!(on_pixels(nothing, 1.0).1, [1, 1]);
    }

    #[test]
    fn places_go_from_corner_to_corner_with_y_up() {
        let rect = Rect::from_min_max(pos2(100.0, 50.0), pos2(300.0, 150.0));
        assert_eq!(place(pos2(100.0, 50.0), rect), [-1.0, 1.0]);
        assert_eq!(place(pos2(250.0, 150.0), rect), [0.5, -1.0]);
        assert_eq!(point_of([0.5, -1.0], rect), pos2(250.0, 150.0));
    }
}
