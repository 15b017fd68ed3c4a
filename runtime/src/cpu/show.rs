//! The stages `view`, `edges` and `plane`: pictures of something other than light.

use super::lanes::{is_nan, repeat_first};
use super::march::vector;
use super::normal::{around, set, surface_of};
use super::shade::{add, only_surface};
use super::tile::{Camera, Tile, camera_ray};
use super::{Asked, Column, Evaluator, LANES, Points};
use sdfc_shaders::features::{Features, Mode};
use sdfc_shaders::layout::{Frame, Ray, Surface};
use sdfc_shaders::marching::{SHOWN, Status};
use sdfc_shaders::{camera, views};
use sdfc_vm::surface::SurfaceBlock;
use sdfc_vm::vector::{V2, V3};

/// Adds a pass of one of the modes that look at one ray at a time.
pub(super) fn view(frame: &Frame, features: &Features, tile: &mut Tile) {
    for i in 0..tile.colors.len() {
        let ray = &tile.rays[i];
        let surface = if features.materials {
            tile.surfaces[i]
        } else {
            only_surface(frame)
        };
        let shown = ray.status & SHOWN != 0;
        let color = match features.mode {
            Mode::Steps => Some(views::heat(ray.steps as f32 / frame.steps as f32)),
            _ if !shown => None,
            Mode::Albedo => Some(vector(surface.albedo)),
            Mode::Normal => Some(views::direction_color::<f32>(vector(tile.normals[i]))),
            Mode::Depth => {
                let [near, far] = frame.depth_range;
                let depth = ray.t + camera_ray(frame, tile.pixels[i]).beyond;
                Some(views::depth_color::<f32>(depth, V2 { x: near, y: far }))
            }
            Mode::Id => Some(views::id_color(surface.id)),
            Mode::Mask => Some(V3::of(1.0, 1.0, 1.0)),
            // These have stages of their own.
            Mode::Shaded | Mode::Distance | Mode::Edges => None,
        };
        if let Some(color) = color {
            add(&mut tile.colors[i], color, 1.0);
        }
    }
}

/// The end of a ray, as its neighbours see it.
struct End {
    p: V3<f32>,
    normal: V3<f32>,
    id: f32,
    shown: bool,
}

/// Adds a pass of lines where a ray's end and that of its right or lower neighbour do not belong
/// together.
pub(super) fn edges(frame: &Frame, features: &Features, tile: &mut Tile) {
    let end = |x: u32, y: u32| {
        let (x, y) = (x.min(tile.width - 1), y.min(tile.height - 1));
        let i = (y * tile.width + x) as usize;
        End {
            p: tile.points[i],
            normal: vector(tile.normals[i]),
            id: if features.materials {
                tile.surfaces[i].id
            } else {
                frame.id
            },
            shown: tile.rays[i].status & SHOWN != 0,
        }
    };
    let mut colors = std::mem::take(&mut tile.colors);
    for (i, color) in colors.iter_mut().enumerate() {
        let (x, y) = (i as u32 % tile.width, i as u32 / tile.width);
        let t = tile.rays[i].t;
        let half = camera::half_pixel(t, frame.footprint, frame.footprint_growth);
        let here = end(x, y);
        let edge = |there: End| {
            if !here.shown && !there.shown {
                return 0.0;
            }
            let both = if here.shown == there.shown { 1.0 } else { 0.0 };
            views::edge_between::<f32>(
                here.p,
                here.normal,
                here.id,
                there.p,
                there.normal,
                there.id,
                half,
                both,
            )
        };
        let line = edge(end(x + 1, y)).max(edge(end(x, y + 1)));
        let normal = if here.shown {
            here.normal
        } else {
            V3::default()
        };
        let paper = views::paper::<f32>(normal, camera_ray(frame, tile.pixels[i]).direction);
        let coverage = if here.shown { 1.0 } else { 0.0 };
        add(color, views::edge_color::<f32>(line, paper), coverage);
    }
    tile.colors = colors;
}

/// Adds a pass of the field on the plane through the view's centre; gives the number of
/// evaluations.
pub(super) fn plane(
    frame: &Frame,
    features: &Features,
    tile: &mut Tile,
    figure: Option<&[f32]>,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    let (mut points, mut values) = (Points::default(), Column::default());
    let mut facing = Points::default();
    let mut block: Box<SurfaceBlock> = Box::default();
    let forward = vector(frame.forward);
    let bands = features.mode == Mode::Distance;
    let painted = !bands && matches!(features.mode, Mode::Shaded | Mode::Albedo);
    let asked = painted && features.materials;
    let mut evaluations = 0;
    for start in (0..tile.pixels.len()).step_by(LANES) {
        let count = LANES.min(tile.pixels.len() - start);
        for lane in 0..count {
            let i = start + lane;
            let Camera {
                origin, direction, ..
            } = camera_ray(frame, tile.pixels[i]);
            let centre = vector(frame.centre);
            let t = camera::meet_plane::<f32>(origin, direction, centre, forward);
            tile.rays[i].t = t;
            set(
                &mut points,
                lane,
                camera::along::<f32>(origin, direction, t),
            );
            set(&mut facing, lane, -forward);
        }
        repeat_first(&mut points, count);
        repeat_first(&mut facing, count);
        match figure {
            Some(figure) => {
                for lane in 0..count {
                    let [x, y] = tile.pixels[start + lane].map(|v| v as usize);
                    values.0[lane] = figure[y * frame.size[0] as usize + x];
                }
            }
            None => {
                evaluator.distances(&points, count, &mut values);
                evaluations += count as u64;
            }
        }
        if asked {
            let point =
                |lane: usize| V3::of(points[0].0[lane], points[1].0[lane], points[2].0[lane]);
            let region = around((0..count).map(point));
            evaluator.announce(Asked::Surfaces, &[region]);
            evaluator.focus(Some(0));
            evaluator.surfaces(&points, &facing, count, &mut block);
            evaluator.focus(None);
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
            tile.rays[i] = Ray {
                t,
                radius: distance,
                status,
                steps: 1,
                ..Ray::default()
            };
            tile.surfaces[i] = if asked {
                surface_of(&block, lane)
            } else {
                Surface::default()
            };
            if is_nan(distance) {
                continue;
            }
            let pixel = 2.0 * camera::half_pixel(t, frame.footprint, frame.footprint_growth);
            let covered = views::coverage(distance, pixel);
            let (color, coverage) = if bands {
                (views::distance_color(distance, frame.spacing, pixel), 1.0)
            } else if painted {
                let paint = if asked {
                    tile.surfaces[i].albedo
                } else {
                    frame.albedo
                };
                let paper = vector(frame.sky_horizon);
                (paper + (vector(paint) - paper) * covered, covered)
            } else {
                (V3::of(covered, covered, covered), covered)
            };
            add(&mut tile.colors[i], color, coverage);
        }
    }
    evaluations
}
