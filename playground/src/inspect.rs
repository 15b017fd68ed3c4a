//! Inspection: data behind a picture, as overlays, numbers and text.
//!
//! All functions here convert the output of an engine into bytes or structs. None of them calls an
//! engine, so callers may run the queries on their own thread. Overlays that need field samples provide
//! [`QueryPoints`], take the results of [`Engine::query`](sdfc_runtime::engine::Engine::query), and are
//! drawn over an existing picture:
//!
//! | overlay | query points | query | drawn by |
//! |---|---|---|---|
//! | the field on a plane | [`slice::Slice::visible_part`] | `query` | [`slice::VisibleSlice::draw`] |
//! | slope classes | [`QueryPoints::on_surface`] or a slice | `query` | [`slopes::classify_slopes`], [`slopes::PointSlopes::draw`] |
//! | cells | the same | `cells_at` | [`cells::draw`] |
//! | objects | — | a picture of [`Provenance`](sdfc_compiler::provenance::Provenance) | [`objects::draw`] |
//! | one pixel | [`pick::PixelHit::from_image`] | `query` | [`pick::describe`] |
//! | steps of rays | — | a picture | [`steps::draw`] |
//! | two engines | — | a picture of each | [`difference::difference`] |
//!
//! Pictures are red, green, blue and alpha bytes in rows from the upper left, in the size of the
//! settings. A picture, image or result of another length never causes a panic: missing data is skipped.

pub mod cells;
pub mod difference;
mod ink;
pub mod legend;
pub mod objects;
pub mod pick;
pub mod rays;
pub mod slice;
pub mod slopes;
pub mod steps;

use rays::PictureRays;
use sdfc_runtime::render::{Image, RenderSettings};

/// Points at which an engine samples the field, and the pixels that show them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QueryPoints {
    /// Pixel indices in rows, ascending.
    pub pixels: Vec<u32>,
    /// Point of each of these pixels.
    pub points: Vec<[f32; 3]>,
}

impl QueryPoints {
    /// Returns the surface points of all hits in a picture. For a 2-D shape they cover its whole plane.
    pub fn on_surface(image: &Image, settings: &RenderSettings) -> Self {
        let rays = PictureRays::new(settings);
        let mut query_points = Self::default();
        for (pixel, &depth) in image.depth.iter().enumerate().take(rays.pixels()) {
            let ray = rays.for_pixel(pixel);
            let hit_distance = depth.is_finite().then_some(f64::from(depth));
            let distance = match settings.is_2d {
                true => rays::distance_to_figure_plane(&ray),
                false => hit_distance,
            };
            if let Some(distance) = distance {
                query_points.pixels.push(pixel as u32);
                query_points.points.push(ray.at(distance).as_vec3().into());
            }
        }
        query_points
    }
}

/// Fades a picture almost to grey, so that overlaid marks stand out.
pub fn fade(picture: &mut [u8]) {
    ink::mute(picture, 0.85, 0.15);
}

#[cfg(test)]
mod tests;
