//! Seeing: what is behind a picture, as pictures, numbers and words.
//!
//! Everything here takes what an engine made and gives bytes or structs; nothing asks an engine by
//! itself, so whoever calls may do that on a thread of its own. What needs the field somewhere says
//! where ([`Asked`]), takes [`Engine::query`](sdfc_runtime::engine::Engine::query)'s answers, and draws
//! them over a picture in hand:
//!
//! | what | where it is asked for | what is asked | drawn by |
//! |---|---|---|---|
//! | the field on a plane | [`slice::Slice::cut`] | `query` | [`slice::Cut::draw`] |
//! | slopes | [`Asked::on_surface`] or a cut | `query` | [`slopes::slopes`], [`slopes::Slopes::draw`] |
//! | cells | the same | `cells_at` | [`cells::draw`] |
//! | objects | — | a picture of [`Origins`](sdfc_compiler::origins::Origins) | [`objects::draw`] |
//! | one pixel | [`pick::Spot::at`] | `query` | [`pick::describe`] |
//! | the work of rays | — | a picture | [`steps::draw`] |
//! | two engines | — | a picture of each | [`difference::difference`] |
//!
//! Pictures are red, green, blue and alpha bytes by rows from the upper left, as
//! [`Frame::rgba8`](sdfc_runtime::frame::Frame::rgba8) gives them, and of the size of the settings. A
//! picture, a frame or an answer of another length never panics: what is missing is left out.

pub mod cells;
pub mod difference;
mod ink;
pub mod objects;
pub mod pick;
pub mod rays;
pub mod slice;
pub mod slopes;
pub mod steps;

use rays::Rays;
use sdfc_runtime::frame::{Frame, RenderSettings};

/// Points that an engine is asked about, and the pixels that show them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// The pixels' numbers, row after row; they rise.
    pub pixels: Vec<u32>,
    /// The point at each of these pixels.
    pub points: Vec<[f32; 3]>,
}

impl Asked {
    /// The points of all surfaces in a picture. Of a plane figure they are those of its whole plane.
    pub fn on_surface(frame: &Frame, settings: &RenderSettings) -> Self {
        let rays = Rays::of(settings);
        let mut asked = Self::default();
        for (pixel, &depth) in frame.depth.iter().enumerate().take(rays.pixels()) {
            let ray = rays.of_pixel(pixel);
            let hit = depth.is_finite().then_some(f64::from(depth));
            let distance = match settings.plane {
                true => rays::to_figure(&ray),
                false => hit,
            };
            if let Some(distance) = distance {
                asked.pixels.push(pixel as u32);
                asked.points.push(rays::single(ray.at(distance)));
            }
        }
        asked
    }
}

/// Draws a picture back, almost to grey, so that marks laid over it are seen.
pub fn fade(picture: &mut [u8]) {
    ink::draw_back(picture, 0.85, 0.15);
}

#[cfg(test)]
mod tests;
