//! The stages `view`, `edges` and `plane`: pictures of something other than light.

use super::normal::{set_lane, surface_in_lane};
use super::ray_tasks::{is_nan, repeat_first};
use super::shade::{add_sample, uniform_surface};
use super::tile::Tile;
use super::{Evaluator, F32x64, FieldQuantity, LANES, Points};
use crate::cells::Aabb;
use crate::render::ray::{PixelRay, camera_ray, vector};
use sdfc_shaders::features::{Features, Mode};
use sdfc_shaders::layout::{FrameUniforms, RayState, Surface};
use sdfc_shaders::marching::{SHOWN, Status};
use sdfc_shaders::{camera, views};
use sdfc_vm::surface::SurfaceBlock;
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

/// Adds a sample of the field on the plane through the view's centre; returns the number of evaluations.
pub(super) fn plane(
    frame: &FrameUniforms,
    features: &Features,
    tile: &mut Tile,
    plane_values: Option<&[f32]>,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    let (mut points, mut values) = (Points::default(), F32x64::default());
    let mut view_normals = Points::default();
    let mut block: Box<SurfaceBlock> = Box::default();
    let forward = vector(frame.forward);
    let is_distance_view = features.mode == Mode::Distance;
    let has_albedo = !is_distance_view && matches!(features.mode, Mode::Shaded | Mode::Albedo);
    let needs_surfaces = has_albedo && features.materials;
    let mut evaluations = 0;
    for start in (0..tile.pixels.len()).step_by(LANES) {
        let count = LANES.min(tile.pixels.len() - start);
        for lane in 0..count {
            let i = start + lane;
            let PixelRay {
                origin, direction, ..
            } = camera_ray(frame, tile.pixels[i]);
            let centre = vector(frame.centre);
            let t = camera::intersect_plane::<f32>(origin, direction, centre, forward);
            tile.rays[i].t = t;
            set_lane(
                &mut points,
                lane,
                camera::point_along::<f32>(origin, direction, t),
            );
            set_lane(&mut view_normals, lane, -forward);
        }
        repeat_first(&mut points, count);
        repeat_first(&mut view_normals, count);
        match plane_values {
            Some(plane_values) => {
                for lane in 0..count {
                    let [x, y] = tile.pixels[start + lane].map(|v| v as usize);
                    values.0[lane] = plane_values[y * frame.size[0] as usize + x];
                }
            }
            None => {
                evaluator.distances(&points, count, &mut values);
                evaluations += count as u64;
            }
        }
        if needs_surfaces {
            let point = |lane: usize| [points[0].0[lane], points[1].0[lane], points[2].0[lane]];
            let region = Aabb::around((0..count).map(point));
            evaluator.prune_for_regions(FieldQuantity::Surfaces, &[region]);
            evaluator.select_region(Some(0));
            evaluator.surfaces(&points, &view_normals, count, &mut block);
            evaluator.select_region(None);
            evaluations += count as u64;
        }
        for lane in 0..count {
            let i = start + lane;
            let (t, distance) = (tile.rays[i].t, values.0[lane]);
            let status = if is_nan(distance) {
                Status::NotANumber as u32
            } else if distance < 0.0 {
                Status::Hit as u32 | SHOWN
            } else {
                Status::Miss as u32
            };
            tile.rays[i] = RayState {
                t,
                field: distance,
                status,
                steps: 1,
                ..RayState::default()
            };
            tile.surfaces[i] = if needs_surfaces {
                surface_in_lane(&block, lane)
            } else {
                Surface::default()
            };
            if is_nan(distance) {
                continue;
            }
            let pixel = 2.0 * camera::half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
            let shape_coverage = views::coverage(distance, pixel);
            let (color, coverage) = if is_distance_view {
                (views::distance_color(distance, frame.spacing, pixel), 1.0)
            } else if has_albedo {
                let albedo = if needs_surfaces {
                    tile.surfaces[i].albedo
                } else {
                    frame.albedo
                };
                let paper = vector(frame.sky_horizon);
                (
                    paper + (vector(albedo) - paper) * shape_coverage,
                    shape_coverage,
                )
            } else {
                (
                    V3::new(shape_coverage, shape_coverage, shape_coverage),
                    shape_coverage,
                )
            };
            add_sample(&mut tile.colors[i], color, coverage);
        }
    }
    evaluations
}
