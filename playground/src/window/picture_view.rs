//! The picture in the centre, and its mouse input.

use super::canvas::{self, CanvasPicture};
use super::theme;
use crate::camera::Ndc;
use crate::session::{CameraEvent, Event, Session};
use eframe::egui::{
    self, CursorIcon, PointerButton, Pos2, Rect, Response, Sense, Stroke, StrokeKind, Ui, Vec2,
    vec2,
};
use std::f32::consts::PI;
use std::sync::Arc;

/// Logarithmic zoom per unit of wheel motion.
const ZOOM_PER_WHEEL_UNIT: f64 = 0.0022;

/// The displayed picture and the state of a mouse drag.
#[derive(Default)]
pub(super) struct PictureView {
    pixels: Option<CanvasPicture>,
    /// Position up to which a drag was processed.
    drag_position: Option<Pos2>,
}

impl PictureView {
    /// Shows the picture in the available space, and reports the size of that space and mouse input as
    /// events. Returns the screen area of the picture.
    pub(super) fn show(&mut self, ui: &mut Ui, session: &Session, events: &mut Vec<Event>) -> Rect {
        let (rect, size) = snap_to_pixels(ui.available_rect_before_wrap(), ui.pixels_per_point());
        events.push(Event::Resized(size));
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        self.take(session);
        match self.pixels.clone().filter(|_| session.picture().is_some()) {
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
        hover_events(ui, &response, rect, events);
        rect
    }

    /// Takes a new picture from the session.
    fn take(&mut self, session: &Session) {
        let Some((picture, number)) = session.picture() else {
            return;
        };
        if self
            .pixels
            .as_ref()
            .is_none_or(|pixels| pixels.number != number)
        {
            self.pixels = Some(CanvasPicture {
                number,
                size: picture.size.map(|side| side as u32),
                rgba: Arc::clone(&picture.rgba),
            });
        }
    }

    /// Orbits and pans the camera. The drag covers the whole path from press to release, including the
    /// motion before it was recognised as a drag.
    fn drag(&mut self, ui: &Ui, response: &Response, rect: Rect, events: &mut Vec<Event>) {
        let is_dragged = |button| response.dragged_by(button) || response.drag_stopped_by(button);
        let is_primary = is_dragged(PointerButton::Primary);
        let is_secondary =
            is_dragged(PointerButton::Secondary) || is_dragged(PointerButton::Middle);
        let (from, to, shift) = ui.input(|input| {
            let from = self.drag_position.or(input.pointer.press_origin());
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
        let drag_position = from.zip(to).filter(|_| is_primary || is_secondary);
        self.drag_position = match response.drag_stopped() {
            true => None,
            false => drag_position.map(|(_, to)| to),
        };
        let Some((from, to)) = drag_position else {
            return;
        };
        let pans = is_secondary || shift;
        if pans {
            ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
        }
        let delta = to - from;
        if delta == Vec2::ZERO {
            return;
        }
        events.push(Event::Camera(if pans {
            CameraEvent::Pan(ndc_at(from, rect), ndc_at(to, rect))
        } else {
            // A drag across the whole height is half a turn.
            let [is_secondary, up] = [-delta.x, delta.y].map(|d| f64::from(d * PI / rect.height()));
            CameraEvent::Orbit([is_secondary, up])
        }));
    }
}

/// Aligns a rectangle with screen pixels and returns its size in pixels.
fn snap_to_pixels(space: Rect, scale: f32) -> (Rect, [u32; 2]) {
    let corner = |p: Pos2| vec2((p.x * scale).round(), (p.y * scale).round());
    let (low, high) = (corner(space.min), corner(space.max));
    let size = (high - low).max(Vec2::splat(1.0));
    let rect = Rect::from_min_size((low / scale).to_pos2(), size / scale);
    (rect, [size.x as u32, size.y as u32])
}

/// Converts a screen position to normalised device coordinates.
fn ndc_at(point: Pos2, rect: Rect) -> Ndc {
    let x = (point.x - rect.center().x) / (rect.width() / 2.0);
    let y = (point.y - rect.center().y) / (rect.height() / 2.0);
    [f64::from(x), f64::from(-y)]
}

/// Converts normalised device coordinates to a screen position.
pub(super) fn point_of([x, y]: Ndc, rect: Rect) -> Pos2 {
    let half = rect.size() / 2.0;
    rect.center() + vec2(x as f32 * half.x, -y as f32 * half.y)
}

/// Handles the wheel and clicks.
fn hover_events(ui: &Ui, response: &Response, rect: Rect, events: &mut Vec<Event>) {
    let Some(position) = response.hover_pos() else {
        return;
    };
    let wheel = ui.input(|input| input.smooth_scroll_delta().y + 200.0 * input.zoom_delta().ln());
    if wheel != 0.0 {
        let factor = (-f64::from(wheel) * ZOOM_PER_WHEEL_UNIT).exp();
        events.push(Event::Camera(CameraEvent::Zoom(
            factor,
            ndc_at(position, rect),
        )));
    }
    if response.clicked() {
        events.push(Event::Pick(ndc_at(position, rect)));
    }
    if response.double_clicked() {
        events.push(Event::Camera(CameraEvent::Focus(ndc_at(position, rect))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::pos2;

    #[test]
    fn a_space_lies_on_integer_pixels() {
        let space = Rect::from_min_max(pos2(10.3, 20.6), pos2(110.1, 80.2));
        let (rect, size) = snap_to_pixels(space, 2.0);
        assert_eq!(size, [199, 119]);
        assert_eq!(rect.min, pos2(10.5, 20.5));
        assert_eq!(rect.max, pos2(110.0, 80.0));
        let nothing = Rect::from_min_max(pos2(5.0, 5.0), pos2(3.0, 3.0));
        assert_eq!(snap_to_pixels(nothing, 1.0).1, [1, 1]);
    }

    #[test]
    fn places_go_from_corner_to_corner_with_y_up() {
        let rect = Rect::from_min_max(pos2(100.0, 50.0), pos2(300.0, 150.0));
        assert_eq!(ndc_at(pos2(100.0, 50.0), rect), [-1.0, 1.0]);
        assert_eq!(ndc_at(pos2(250.0, 150.0), rect), [0.5, -1.0]);
        assert_eq!(point_of([0.5, -1.0], rect), pos2(250.0, 150.0));
    }
}
