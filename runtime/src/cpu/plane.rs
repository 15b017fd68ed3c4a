//! The stage `plane`: the field where each ray meets the plane through the view's centre.
//!
//! The coverage of pixels by a 2-D shape comes from [`super::plane_edges`].

use super::normal::{set_lane, surface_in_lane};
use super::plane_edges::{PlanePicture, PlaneValues, cover};
use super::ray_tasks::{is_nan, repeat_first};
use super::shade::add_sample;
use super::tile::Tile;
use super::{Evaluator, F32x64, FieldQuantity, LANES, Points};
use crate::cells::Aabb;
use crate::render::ray::{camera_ray, vector};
use sdfc_shaders::features::{Features, Mode};
use sdfc_shaders::layout::{FrameUniforms, RayState, Surface};
use sdfc_shaders::marching::{SHOWN, Status};
use sdfc_shaders::{camera, views};
use sdfc_vm::surface::SurfaceBlock;
use sdfc_vm::vector::V3;

/// Adds a sample of the field on the plane through the view's centre; returns the number of evaluations at pixels.
/// Values around the tile and counts of signs are not counted, as on devices.
pub(super) fn plane(
    frame: &FrameUniforms,
    features: &Features,
    tile: &mut Tile,
    picture: Option<&PlanePicture>,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    let is_distance_view = features.mode == Mode::Distance;
    let has_albedo = !is_distance_view && matches!(features.mode, Mode::Shaded | Mode::Albedo);
    let mut evaluations = 0;
    let samples = match picture {
        Some(picture) => PlaneSamples::read(tile, picture),
        None => {
            evaluations += tile.pixels.len() as u64;
            PlaneSamples::evaluate(frame, tile, !is_distance_view, evaluator)
        }
    };
    if has_albedo && features.materials {
        evaluations += find_surfaces(frame, tile, evaluator);
    } else {
        tile.surfaces.fill(Surface::default());
    }
    for i in 0..tile.pixels.len() {
        let t = plane_point(frame, tile.pixels[i]).1;
        let distance = samples.fields[i];
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
        if is_nan(distance) {
            continue;
        }
        let (color, covered) = if is_distance_view {
            let pixel = 2.0 * camera::half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
            (views::distance_color(distance, frame.spacing, pixel), 1.0)
        } else if has_albedo {
            let covered = samples.covered[i];
            let albedo = match features.materials {
                true => tile.surfaces[i].albedo,
                false => frame.albedo,
            };
            let paper = vector(frame.sky_horizon);
            (paper + (vector(albedo) - paper) * covered, covered)
        } else {
            let covered = samples.covered[i];
            (V3::new(covered, covered, covered), covered)
        };
        add_sample(&mut tile.colors[i], color, covered);
    }
    evaluations
}

/// Returns the point that the ray of a position in the picture meets, and its distance along the ray.
fn plane_point(frame: &FrameUniforms, position: [f32; 2]) -> (V3<f32>, f32) {
    let ray = camera_ray(frame, position);
    let (centre, forward) = (vector(frame.centre), vector(frame.forward));
    let t = camera::intersect_plane::<f32>(ray.origin, ray.direction, centre, forward);
    let point = camera::point_along::<f32>(ray.origin, ray.direction, t);
    (point, t)
}

/// Fields of a tile's pixels, and how much of each is covered.
#[derive(Default)]
struct PlaneSamples {
    fields: Vec<f32>,
    /// Nothing where it is not needed.
    covered: Vec<f32>,
}

impl PlaneSamples {
    /// Reads the samples of a picture.
    fn read(tile: &Tile, picture: &PlanePicture) -> Self {
        let [left, upper] = tile.pixels[0].map(|v| v as usize);
        let border = picture.border;
        let tile_rows = |samples: &[f32]| {
            let rows = samples.chunks(picture.width).skip(upper + border);
            let rows = rows.take(tile.height as usize);
            rows.flat_map(|row| &row[left + border..][..tile.width as usize])
                .copied()
                .collect()
        };
        Self {
            fields: tile_rows(&picture.values),
            covered: tile_rows(&picture.covered),
        }
    }

    /// Evaluates the field.
    fn evaluate(
        frame: &FrameUniforms,
        tile: &Tile,
        finds_coverage: bool,
        evaluator: &mut dyn Evaluator,
    ) -> Self {
        if !finds_coverage {
            return Self {
                fields: evaluate_at(frame, &tile.pixels, evaluator),
                covered: Vec::new(),
            };
        }
        let [left, upper] = tile.pixels[0].map(|first| first - 1.0);
        let [width, height] = [tile.width, tile.height].map(|side| side as usize + 2);
        let positions: Vec<[f32; 2]> = (0..width * height)
            .map(|k| [left + (k % width) as f32, upper + (k / width) as f32])
            .collect();
        let values = evaluate_at(frame, &positions, evaluator);
        let inner = (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| y * width + x));
        let mut covered = vec![0.0; tile.pixels.len()];
        let picture = PlaneValues {
            values: &values,
            width,
        };
        cover(
            picture,
            inner.clone(),
            frame.samples,
            &mut covered,
            |positions| {
                let mut values = F32x64::default();
                let positions = positions.iter().map(|[x, y]| [left + x, upper + y]);
                evaluate_block(frame, positions, evaluator, &mut values);
                values
            },
        );
        Self {
            fields: inner.map(|k| values[k]).collect(),
            covered,
        }
    }
}

/// Evaluates the field at positions in the picture.
fn evaluate_at(
    frame: &FrameUniforms,
    positions: &[[f32; 2]],
    evaluator: &mut dyn Evaluator,
) -> Vec<f32> {
    let mut values = F32x64::default();
    let mut fields = Vec::with_capacity(positions.len());
    for positions in positions.chunks(LANES) {
        evaluate_block(frame, positions.iter().copied(), evaluator, &mut values);
        fields.extend_from_slice(&values.0[..positions.len()]);
    }
    fields
}

/// Evaluates the field at up to 64 positions in the picture.
fn evaluate_block(
    frame: &FrameUniforms,
    positions: impl ExactSizeIterator<Item = [f32; 2]>,
    evaluator: &mut dyn Evaluator,
    values: &mut F32x64,
) {
    let mut points = Points::default();
    let count = positions.len();
    for (lane, position) in positions.enumerate() {
        set_lane(&mut points, lane, plane_point(frame, position).0);
    }
    repeat_first(&mut points, count);
    evaluator.distances(&points, count, values);
}

/// Finds the surface of each pixel; returns the number of evaluations.
fn find_surfaces(frame: &FrameUniforms, tile: &mut Tile, evaluator: &mut dyn Evaluator) -> u64 {
    let (mut points, mut view_normals) = (Points::default(), Points::default());
    let mut block: Box<SurfaceBlock> = Box::default();
    let forward = vector(frame.forward);
    for start in (0..tile.pixels.len()).step_by(LANES) {
        let count = LANES.min(tile.pixels.len() - start);
        for lane in 0..count {
            set_lane(
                &mut points,
                lane,
                plane_point(frame, tile.pixels[start + lane]).0,
            );
            set_lane(&mut view_normals, lane, -forward);
        }
        repeat_first(&mut points, count);
        repeat_first(&mut view_normals, count);
        let point = |lane: usize| [points[0].0[lane], points[1].0[lane], points[2].0[lane]];
        let region = Aabb::around((0..count).map(point));
        evaluator.prune_for_regions(FieldQuantity::Surfaces, &[region]);
        evaluator.select_region(Some(0));
        evaluator.surfaces(&points, &view_normals, count, &mut block);
        evaluator.select_region(None);
        for lane in 0..count {
            tile.surfaces[start + lane] = surface_in_lane(&block, lane);
        }
    }
    tile.pixels.len() as u64
}
