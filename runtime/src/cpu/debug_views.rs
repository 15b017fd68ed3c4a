//! The stages `view` and `edges`: pictures of something other than light.

use super::shade::{add_sample, uniform_surface};
use super::tile::Tile;
use crate::render::ray::{camera_ray, vector};
use sdfc_shaders::features::{Features, Mode};
use sdfc_shaders::layout::FrameUniforms;
use sdfc_shaders::marching::SHOWN;
use sdfc_shaders::{camera, views};
use sdfc_vm::vector::{V2, V3};

/// Adds a sample of one of the modes that depend on one ray at a time.
pub(super) fn view(frame: &FrameUniforms, features: &Features, tile: &mut Tile) {
    for i in 0..tile.colors.len() {
        let ray = &tile.rays[i];
        let surface = if features.materials {
            tile.surfaces[i]
        } else {
            uniform_surface(frame)
        };
        let is_shown = ray.status & SHOWN != 0;
        let color = match features.mode {
            Mode::Steps => Some(views::heat(ray.steps as f32 / frame.max_steps as f32)),
            _ if !is_shown => None,
            Mode::Albedo => Some(vector(surface.albedo)),
            Mode::Normal => Some(views::direction_color::<f32>(vector(tile.normals[i]))),
            Mode::Depth => {
                let [near, far] = frame.depth_range;
                let depth = ray.t + camera_ray(frame, tile.pixels[i]).start_offset;
                Some(views::depth_color::<f32>(depth, V2 { x: near, y: far }))
            }
            Mode::Id => Some(views::id_color(surface.id)),
            Mode::Mask => Some(V3::new(1.0, 1.0, 1.0)),
            // These modes have their own stages.
            Mode::Shaded | Mode::Distance | Mode::Edges => None,
        };
        if let Some(color) = color {
            add_sample(&mut tile.colors[i], color, 1.0);
        }
    }
}

/// Surface at the end of a pixel's ray.
struct PixelEnd {
    p: V3<f32>,
    normal: V3<f32>,
    id: f32,
    is_shown: bool,
}

/// Adds a sample of lines where a ray's end and that of its right or lower neighbour do not belong together.
pub(super) fn edges(frame: &FrameUniforms, features: &Features, tile: &mut Tile) {
    let end = |x: u32, y: u32| {
        let (x, y) = (x.min(tile.width - 1), y.min(tile.height - 1));
        let i = (y * tile.width + x) as usize;
        PixelEnd {
            p: tile.points[i],
            normal: vector(tile.normals[i]),
            id: if features.materials {
                tile.surfaces[i].id
            } else {
                frame.id
            },
            is_shown: tile.rays[i].status & SHOWN != 0,
        }
    };
    let mut colors = std::mem::take(&mut tile.colors);
    for (i, color) in colors.iter_mut().enumerate() {
        let (x, y) = (i as u32 % tile.width, i as u32 / tile.width);
        let t = tile.rays[i].t;
        let half = camera::half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
        let end_here = end(x, y);
        let edge_to = |neighbor: PixelEnd| {
            if !end_here.is_shown && !neighbor.is_shown {
                return 0.0;
            }
            let shown_alike = if end_here.is_shown == neighbor.is_shown {
                1.0
            } else {
                0.0
            };
            views::edge_between::<f32>(
                end_here.p,
                end_here.normal,
                end_here.id,
                neighbor.p,
                neighbor.normal,
                neighbor.id,
                half,
                shown_alike,
            )
        };
        let line = edge_to(end(x + 1, y)).max(edge_to(end(x, y + 1)));
        let normal = if end_here.is_shown {
            end_here.normal
        } else {
            V3::default()
        };
        let paper = views::paper_color::<f32>(normal, camera_ray(frame, tile.pixels[i]).direction);
        let coverage = if end_here.is_shown { 1.0 } else { 0.0 };
        add_sample(color, views::edge_color::<f32>(line, paper), coverage);
    }
    tile.colors = colors;
}
