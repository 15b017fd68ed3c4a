//! The stage `plane`: the field where each ray meets the plane through the view's centre.
//!
//! The edge of a 2-D shape is where the field changes its sign. How much of a pixel it covers follows from the field
//! at the pixel and at its four neighbours; see [`sdfc_shaders::views`].

use super::normal::{set_lane, surface_in_lane};
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
use sdfc_vm::vector::{V2, V3};

/// The field at the pixels of a picture, row after row, with a border of one pixel where coverage is computed.
#[derive(Clone, Copy)]
pub(super) struct PlaneValues<'a> {
    /// Values, in rows of `width`.
    pub(super) values: &'a [f32],
    /// Number of values in a row.
    pub(super) width: usize,
}

/// Adds a sample of the field on the plane through the view's centre; returns the number of evaluations at pixels.
/// Values around the tile and probes are not counted, as on devices.
pub(super) fn plane(
    frame: &FrameUniforms,
    features: &Features,
    tile: &mut Tile,
    picture: Option<PlaneValues<'_>>,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    let is_distance_view = features.mode == Mode::Distance;
    let has_albedo = !is_distance_view && matches!(features.mode, Mode::Shaded | Mode::Albedo);
    let mut evaluations = 0;
    let mut samples = PlaneSamples::new(tile, !is_distance_view);
    match picture {
        Some(picture) => samples.read(tile, picture),
        None => {
            samples.evaluate(frame, tile, evaluator);
            evaluations += tile.pixels.len() as u64;
        }
    }
    let mut covered = vec![0.0; tile.pixels.len()];
    if !is_distance_view {
        samples.find_coverage(frame, tile, &mut covered, evaluator);
    }
    if has_albedo && features.materials {
        evaluations += find_surfaces(frame, tile, evaluator);
    } else {
        tile.surfaces.fill(Surface::default());
    }
    for i in 0..tile.pixels.len() {
        let t = plane_point(frame, tile.pixels[i]).1;
        let distance = samples.fields[samples.index(i)];
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
        let covered = covered[i];
        let (color, covered) = if is_distance_view {
            let pixel = 2.0 * camera::half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
            (views::distance_color(distance, frame.spacing, pixel), 1.0)
        } else if has_albedo {
            let albedo = match features.materials {
                true => tile.surfaces[i].albedo,
                false => frame.albedo,
            };
            let paper = vector(frame.sky_horizon);
            (paper + (vector(albedo) - paper) * covered, covered)
        } else {
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

/// Fields of a tile's pixels, with a border of one pixel where coverage is computed.
struct PlaneSamples {
    fields: Vec<f32>,
    /// Number of values in a row.
    width: usize,
    /// Number of pixels around the tile.
    border: usize,
    tile_width: usize,
}

impl PlaneSamples {
    fn new(tile: &Tile, has_border: bool) -> Self {
        let border = usize::from(has_border);
        let [width, height] = [tile.width, tile.height].map(|side| side as usize + 2 * border);
        Self {
            fields: vec![0.0; width * height],
            width,
            border,
            tile_width: tile.width as usize,
        }
    }

    /// Returns the index of a pixel of the tile.
    fn index(&self, pixel: usize) -> usize {
        let (x, y) = (pixel % self.tile_width, pixel / self.tile_width);
        (y + self.border) * self.width + x + self.border
    }

    /// Returns the position in the picture of a value, in pixels.
    fn position(&self, tile: &Tile, index: usize) -> [f32; 2] {
        let [left, upper] = tile.pixels[0];
        let (x, y) = (index % self.width, index / self.width);
        let border = self.border as f32;
        [left + x as f32 - border, upper + y as f32 - border]
    }

    /// Reads the fields of a picture, which has the same border.
    fn read(&mut self, tile: &Tile, picture: PlaneValues<'_>) {
        let [left, upper] = tile.pixels[0].map(|v| v as usize);
        for (y, row) in self.fields.chunks_mut(self.width).enumerate() {
            let first = (upper + y) * picture.width + left;
            row.copy_from_slice(&picture.values[first..first + row.len()]);
        }
    }

    /// Evaluates the fields.
    fn evaluate(&mut self, frame: &FrameUniforms, tile: &Tile, evaluator: &mut dyn Evaluator) {
        let positions: Vec<[f32; 2]> = (0..self.fields.len())
            .map(|index| self.position(tile, index))
            .collect();
        self.fields = evaluate_at(frame, &positions, evaluator);
    }

    /// Computes how much of each pixel is covered.
    fn find_coverage(
        &self,
        frame: &FrameUniforms,
        tile: &Tile,
        covered: &mut [f32],
        evaluator: &mut dyn Evaluator,
    ) {
        let mut doubtful = Vec::new();
        let mut probes = Vec::new();
        for (i, covered) in covered.iter_mut().enumerate() {
            let k = self.index(i);
            let field = self.fields[k];
            let [left, right] = [self.fields[k - 1], self.fields[k + 1]];
            let [above, below] = [self.fields[k - self.width], self.fields[k + self.width]];
            let (upper, lower) = (k - self.width, k + self.width);
            let one_side = views::change_on_one_side(left, field, right)
                .max(views::change_on_one_side(above, field, below));
            let change = views::steepest_change::<f32>(
                V2 {
                    x: views::change_per_pixel(left, field, right, one_side),
                    y: views::change_per_pixel(above, field, below, one_side),
                },
                field,
                self.fields[upper - 1],
                self.fields[upper + 1],
                self.fields[lower - 1],
                self.fields[lower + 1],
            );
            if field.abs() > change.x.abs() + change.y.abs() {
                // The edge is more than a pixel away.
                *covered = if field < 0.0 { 1.0 } else { 0.0 };
                continue;
            }
            let pixels = views::pixels_to_edge::<f32>(field, change);
            *covered = views::coverage(pixels, frame.samples as f32);
            let beside = views::towards_edge(field, change.x, left, right);
            let along = views::towards_edge(field, change.y, above, below);
            let [upper, lower] = [upper, lower].map(|row| {
                let [left, right] = [self.fields[row - 1], self.fields[row + 1]];
                views::towards_edge(field, change.x, left, right)
            });
            let diagonal = views::towards_edge(field, change.y, upper, lower);
            let lowest = beside.min(along).min(diagonal);
            let highest = beside.max(along).max(diagonal);
            if views::is_doubtful_edge(field, lowest, highest, *covered) > 0.5 {
                let V2 { x, y } = views::edge_probe::<f32>(pixels, change);
                let [column, row] = tile.pixels[i];
                doubtful.push(i);
                probes.push([column + x, row + y]);
            }
        }
        let fields = evaluate_at(frame, &probes, evaluator);
        for (&i, probe) in doubtful.iter().zip(fields) {
            let field = self.fields[self.index(i)];
            covered[i] = views::probed_coverage(field, probe, covered[i]);
        }
    }
}

/// Evaluates the field at positions in the picture.
fn evaluate_at(
    frame: &FrameUniforms,
    positions: &[[f32; 2]],
    evaluator: &mut dyn Evaluator,
) -> Vec<f32> {
    let (mut points, mut values) = (Points::default(), F32x64::default());
    let mut fields = Vec::with_capacity(positions.len());
    for positions in positions.chunks(LANES) {
        for (lane, &position) in positions.iter().enumerate() {
            set_lane(&mut points, lane, plane_point(frame, position).0);
        }
        repeat_first(&mut points, positions.len());
        evaluator.distances(&points, positions.len(), &mut values);
        fields.extend_from_slice(&values.0[..positions.len()]);
    }
    fields
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
