//! Button icons, drawn as shapes because fonts may lack them.

use super::theme;
use eframe::egui::{Painter, Pos2, Rect, Response, Sense, Shape, Stroke, Ui, Vec2, pos2, vec2};
use std::f32::consts::TAU;

/// An icon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Icon {
    /// A triangle.
    Play,
    /// Two bars.
    Pause,
    /// A triangle to the left, and a bar.
    Back,
    /// A triangle to the right, and a bar.
    Forth,
    /// A circular arrow.
    Reset,
    /// A pencil.
    Write,
}

/// Shows a button with an icon. A `quiet` button has a background only while hovered.
pub(super) fn button(ui: &mut Ui, icon: Icon, size: Vec2, quiet: bool) -> Response {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    if ui.is_rect_visible(rect) {
        let look = ui.style().interact(&response);
        if !quiet || response.hovered() {
            ui.painter().rect_filled(rect, 4.0, look.weak_bg_fill);
        }
        let color = match quiet && !response.hovered() {
            true => theme::ACCENT,
            false => look.fg_stroke.color,
        };
        let stroke = Stroke::new(1.4, color);
        paint(ui.painter(), icon, rect.center(), stroke);
    }
    response
}

/// Paints an icon about twelve points wide, centred at a point.
fn paint(painter: &Painter, icon: Icon, at: Pos2, stroke: Stroke) {
    let p = |x: f32, y: f32| pos2(at.x + x, at.y + y);
    let solid = |points: Vec<Pos2>| {
        painter.add(Shape::convex_polygon(points, stroke.color, Stroke::NONE));
    };
    let bar = |x: f32, width: f32| {
        let rect = Rect::from_center_size(p(x, 0.0), vec2(width, 10.0));
        painter.rect_filled(rect, 0.0, stroke.color);
    };
    match icon {
        Icon::Play => solid(vec![p(-3.5, -5.5), p(5.5, 0.0), p(-3.5, 5.5)]),
        Icon::Pause => {
            bar(-2.7, 3.0);
            bar(2.7, 3.0);
        }
        Icon::Back => {
            bar(-4.2, 1.8);
            solid(vec![p(4.5, -5.0), p(-2.5, 0.0), p(4.5, 5.0)]);
        }
        Icon::Forth => {
            solid(vec![p(-4.5, -5.0), p(2.5, 0.0), p(-4.5, 5.0)]);
            bar(4.2, 1.8);
        }
        Icon::Reset => {
            // Three quarters of a circle, open at the upper left, where the arrowhead is.
            let at = |turn: f32| p(4.3 * (turn * TAU).cos(), 4.3 * (turn * TAU).sin());
            let arc = (0..=18).map(|i| at(-0.36 + 0.78 * i as f32 / 18.0));
            painter.add(Shape::line(arc.collect(), stroke));
            solid(vec![p(-5.8, -5.4), p(-0.6, -4.6), p(-4.6, -0.8)]);
        }
        Icon::Write => {
            let outline = [
                (-4.6, 4.6),
                (-3.9, 1.7),
                (2.6, -4.8),
                (4.8, -2.6),
                (-1.7, 3.9),
            ];
            let outline = outline.map(|(x, y)| p(x, y));
            painter.add(Shape::closed_line(outline.to_vec(), stroke));
            painter.line_segment([p(1.2, -3.4), p(3.4, -1.2)], stroke);
        }
    }
}
