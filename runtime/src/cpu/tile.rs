//! Tiles: a square of the picture, with the results of each stage for the next ones.

use super::LANES;
use super::camera_rays::CameraRay;
use super::leaf_bins::{BUNDLE_SIDE, PACKET_SIDE};
use super::packet::Marcher;
use crate::cells::Aabb;
use crate::render::ray::{distance_from_camera, is_limited};
use crate::render::{Image, RenderJob, Status};
use sdfc_shaders::camera;
use sdfc_shaders::features::{Mode, Occlusion};
use sdfc_shaders::layout::{self, RayState, Surface};
use sdfc_shaders::marching::{SHOWN, UNDECIDED};
use sdfc_vm::vector::V3;

/// Largest side of a tile in pixels. Points that are evaluated together share cells, and the last rays of a
/// stage leave lanes empty once per tile. Ten thousand boxes take a tenth more time with tiles of 32.
const MAX_TILE_SIDE: u32 = 64;
/// Least side of a tile in pixels.
const MIN_TILE_SIDE: u32 = 32;
/// Number of tiles per core that keeps all cores busy to the end.
const TILES_PER_CORE: u32 = 16;

/// Returns the side of a picture's tiles in pixels: the largest one that gives every core
/// [`TILES_PER_CORE`] tiles, or the least one. Tiles consist of bundles of packets that do not depend on it.
fn tile_side(job: &RenderJob) -> u32 {
    let tiles = TILES_PER_CORE * rayon::current_num_threads() as u32;
    let is_small_enough = |&side: &u32| {
        let [columns, rows] = job.size.map(|length| length.div_ceil(side));
        columns.saturating_mul(rows) >= tiles
    };
    (MIN_TILE_SIDE..=MAX_TILE_SIDE)
        .rev()
        .step_by((BUNDLE_SIDE * PACKET_SIDE) as usize)
        .find(is_small_enough)
        .unwrap_or(MIN_TILE_SIDE)
}

/// A square of the picture. Lists are by pixel, row after row; items are indices in them.
#[derive(Default)]
pub(super) struct Tile {
    pub(super) left: u32,
    pub(super) upper: u32,
    /// Pixels per computed row; lines between pixels need one more than is shown.
    pub(super) width: u32,
    /// Number of computed rows.
    pub(super) height: u32,
    visible_size: [u32; 2],
    /// All items, in blocks of 8 × 8 so that rays that run together are neighbours.
    pub(super) order: Vec<u32>,
    /// Items with a surface, in that order.
    pub(super) shown: Vec<u32>,
    /// Coordinates of the pixels.
    pub(super) pixels: Vec<[f32; 2]>,
    /// Rays of the pixels in the current sample.
    pub(super) camera_rays: Vec<CameraRay>,
    pub(super) rays: Vec<RayState>,
    /// Beam of each block of pixels, block row after block row.
    pub(super) beams: Vec<layout::Beam>,
    /// Set if the evaluator returned hits and normals without marching.
    pub(super) has_known_hits: bool,
    /// Leaf in which each ray ended, if rays go through cells.
    pub(super) hit_leaves: Vec<u32>,
    /// Points of the surfaces that the rays hit.
    pub(super) points: Vec<V3<f32>>,
    pub(super) normals: Vec<[f32; 3]>,
    /// Points just outside the surfaces, where gradients are taken.
    pub(super) outside_points: Vec<V3<f32>>,
    /// Lengths of the gradients there, if occlusion reads them.
    pub(super) slopes: Vec<f32>,
    pub(super) surfaces: Vec<Surface>,
    /// Fraction of each light that arrives.
    pub(super) light_visibility: Vec<Vec<f32>>,
    /// Fraction of the sky that is visible.
    pub(super) sky_visibility: Vec<f32>,
    /// Sum of all samples.
    pub(super) colors: Vec<[f32; 4]>,
    pub(super) marcher: Marcher,
}

impl Tile {
    /// Begins the tile at a corner.
    pub(super) fn reset_to(&mut self, corner: [u32; 2], job: &RenderJob) {
        self.reset_to_square(corner, tile_side(job), job);
    }

    /// Begins a tile of a single packet.
    pub(super) fn reset_to_packet(&mut self, corner: [u32; 2], job: &RenderJob) {
        self.reset_to_square(corner, PACKET_SIDE, job);
    }

    fn reset_to_square(&mut self, corner: [u32; 2], side: u32, job: &RenderJob) {
        [self.left, self.upper] = corner;
        let remaining = [0, 1].map(|axis| job.size[axis] - corner[axis]);
        self.visible_size = remaining.map(|remaining| remaining.min(side));
        let overlap = u32::from(job.features.mode == Mode::Edges);
        [self.width, self.height] = [0, 1].map(|axis| remaining[axis].min(side + overlap));
        let count = (self.width * self.height) as usize;
        self.order.clear();
        let blocks = |side: u32| (0..side).step_by(8);
        // The order of packets, for rays that go through cells.
        for (y0, x0) in blocks(self.height).flat_map(|y| blocks(self.width).map(move |x| (y, x))) {
            for y in y0..(y0 + 8).min(self.height) {
                let row = y * self.width;
                self.order
                    .extend((x0..(x0 + 8).min(self.width)).map(|x| row + x));
            }
        }
        self.pixels.clear();
        for y in self.upper..self.upper + self.height {
            let row = self.left..self.left + self.width;
            self.pixels.extend(row.map(|x| [x as f32, y as f32]));
        }
        self.rays.resize(count, RayState::default());
        self.points.resize(count, V3::default());
        self.normals.resize(count, [0.0; 3]);
        self.outside_points.resize(count, V3::default());
        self.slopes.clear();
        let slopes = if job.features.occlusion == Occlusion::Off {
            0
        } else {
            count
        };
        self.slopes.resize(slopes, 1.0);
        self.surfaces.resize(count, Surface::default());
        self.sky_visibility.resize(count, 1.0);
        self.light_visibility.resize(job.lights.len(), Vec::new());
        for visibility in &mut self.light_visibility {
            visibility.resize(count, 1.0);
        }
        self.colors.clear();
        self.colors.resize(count, [0.0; 4]);
    }

    pub(super) fn compute_points(&mut self, items: &[u32]) {
        for &item in items {
            let i = item as usize;
            let CameraRay {
                origin, direction, ..
            } = self.camera_rays[i];
            self.points[i] = camera::point_along::<f32>(origin, direction, self.rays[i].t);
        }
    }

    /// Returns the bounding boxes of the points of each 64 items, extended by `reach`.
    pub(super) fn boxes_around(&self, items: &[u32], reach: f32) -> Vec<Aabb> {
        let region = |items: &[u32]| {
            let mut region = Aabb::around(
                items
                    .iter()
                    .map(|&item| self.points[item as usize].to_array()),
            );
            region.low = region.low.map(|v| v - reach);
            region.high = region.high.map(|v| v + reach);
            region
        };
        items.chunks(LANES).map(region).collect()
    }

    /// Iterates over the visible items and their indices in the full picture.
    pub(super) fn visible_pixels(&self, width: usize) -> impl Iterator<Item = (usize, usize)> {
        let (left, upper) = (self.left as usize, self.upper as usize);
        let tile_width = self.width as usize;
        let [columns, rows] = self.visible_size.map(|n| n as usize);
        (0..rows).flat_map(move |y| {
            (0..columns).map(move |x| (y * tile_width + x, (upper + y) * width + left + x))
        })
    }

    /// Copies the hits of the first sample to the picture.
    pub(super) fn store_hits(&self, job: &RenderJob, image: &mut Image) {
        for (i, index) in self.visible_pixels(image.width) {
            let ray = &self.rays[i];
            let status = Status::from_word(ray.status);
            image.status[index] = status;
            image.steps[index] = ray.steps;
            image.stats.count(status, || self.ends_at_far(job, i));
            image.stats.undecided += u64::from(ray.status & UNDECIDED != 0);
            if ray.status & SHOWN == 0 {
                continue;
            }
            image.depth[index] = distance_from_camera(&job.uniforms, self.pixels[i], ray.t);
            image.normal[index] = self.normals[i];
            let id = if job.features.materials {
                self.surfaces[i].id
            } else {
                job.uniforms.id
            };
            image.id[index] = id as u32;
        }
    }

    /// Counts the rays of a later sample.
    pub(super) fn count_statuses(&self, job: &RenderJob, image: &mut Image) {
        for (i, _) in self.visible_pixels(image.width) {
            let status = self.rays[i].status;
            let at_far = || self.ends_at_far(job, i);
            image.stats.count(Status::from_word(status), at_far);
            image.stats.undecided += u64::from(status & UNDECIDED != 0);
        }
    }

    /// Reports whether a pixel's ray, if it misses, ends because of the limit `far`.
    fn ends_at_far(&self, job: &RenderJob, i: usize) -> bool {
        // A plane has no rays.
        !job.shows_plane() && {
            let CameraRay { enter, exit, .. } = self.camera_rays[i];
            is_limited([enter, exit], job.uniforms.far)
        }
    }

    /// Loads the sums of earlier samples.
    pub(super) fn load_partial_sums(&mut self, image: &Image) {
        let mut colors = std::mem::take(&mut self.colors);
        for (i, index) in self.visible_pixels(image.width) {
            colors[i] = image.color[index];
        }
        self.colors = colors;
    }

    pub(super) fn store_colors(&self, samples: u32, image: &mut Image) {
        for (i, index) in self.visible_pixels(image.width) {
            image.color[index] = self.colors[i].map(|sum| sum / samples as f32);
        }
    }
}

/// Returns the corners of the tiles.
pub(super) fn corners(job: &RenderJob) -> Vec<[u32; 2]> {
    let step = tile_side(job) as usize;
    let [columns, rows] = job.size.map(|length| (0..length).step_by(step));
    rows.flat_map(|y| columns.clone().map(move |x| [x, y]))
        .collect()
}
