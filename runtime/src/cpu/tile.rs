//! Tiles: a square of the picture, with the results of each stage for the next ones.

use super::beam::Beams;
use super::lanes::run_streamed;
use super::leaf_bins::{self, LeafBins};
use super::march::{March, Polish, vector};
use super::packet::{Marcher, NO_LEAF};
use super::plane_quadtree::PixelPlane;
use super::{Evaluator, LANES, RenderField, debug_views, normal, occlusion, shade, shadow};
use crate::cells::{Aabb, Cells};
use crate::render::{Image, RenderJob, RenderProgress, Samples, Status};
use crate::work_stealing::parallel_map_with;
use sdfc_shaders::assemble::{RenderStage, stages};
use sdfc_shaders::features::{Mode, Occlusion};
use sdfc_shaders::layout::{self, RayState, Surface};
use sdfc_shaders::marching::{SHOWN, UNDECIDED};
use sdfc_shaders::{beam, camera};
use sdfc_vm::vector::{V2, V3};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Side of a tile in pixels, if every core gets at least [`TILES_PER_CORE`] of them: points that are
/// evaluated together share cells. Ten thousand boxes take a tenth more time with tiles of 32.
const TILE_SIDE: u32 = 64;
/// Side of a tile of a smaller picture, in pixels.
const SMALL_TILE_SIDE: u32 = 32;
/// Number of tiles per core that keeps all cores busy to the end.
const TILES_PER_CORE: u32 = 16;

/// Returns the side of a picture's tiles in pixels.
fn tile_side(picture: &RenderJob) -> u32 {
    let [columns, rows] = picture.size.map(|side| side.div_ceil(TILE_SIDE));
    let has_enough_tiles =
        columns.saturating_mul(rows) >= TILES_PER_CORE * rayon::current_num_threads() as u32;
    if has_enough_tiles {
        TILE_SIDE
    } else {
        SMALL_TILE_SIDE
    }
}

/// A square of the picture. Lists are by pixel, row after row; items are indices in them.
#[derive(Default)]
pub(super) struct Tile {
    left: u32,
    upper: u32,
    /// Pixels per computed row; lines between pixels need one more than is shown.
    pub(super) width: u32,
    /// Number of computed rows.
    pub(super) height: u32,
    visible_size: [u32; 2],
    /// All items, in blocks of 8 × 8 so that rays that run together are neighbours.
    order: Vec<u32>,
    /// Items with a surface, in that order.
    pub(super) shown: Vec<u32>,
    /// Coordinates of the pixels.
    pub(super) pixels: Vec<[f32; 2]>,
    pub(super) rays: Vec<RayState>,
    /// Beam of each block of pixels, block row after block row.
    beams: Vec<layout::Beam>,
    /// Set if the evaluator returned hits and normals without marching.
    has_known_hits: bool,
    /// Leaf in which each ray ended, if rays go through cells.
    pub(super) hit_leaves: Vec<u32>,
    /// Surface points.
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
    marcher: Marcher,
}

/// The cells of a picture, binned by packets.
struct CellTraversal {
    cells: Arc<Cells>,
    leaf_bins: LeafBins,
}

/// The ray of a pixel.
pub(super) struct PixelRay {
    pub(super) origin: V3<f32>,
    pub(super) direction: V3<f32>,
    /// Difference of the start's distance from the camera to that of the central ray.
    pub(super) start_offset: f32,
}

/// Returns the distance from the camera that a pixel's ray has reached.
pub(crate) fn distance_from_camera(f: &layout::FrameUniforms, pixel: [f32; 2], t: f32) -> f32 {
    // Nearly always rays start at the camera.
    if f.approach == 0.0 {
        return t;
    }
    t + camera_ray(f, pixel).start_offset + f.approach
}

/// Reports whether a pixel's ray, if it misses, ends because of the limit `far`, and not at the end of the
/// scene's bounds.
pub(crate) fn ends_at_far(f: &layout::FrameUniforms, pixel: [f32; 2]) -> bool {
    let camera = camera_ray(f, pixel);
    let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
    let segment =
        camera::intersect_box::<f32>(camera.origin, camera.direction, low, high, f32::MAX);
    segment.x <= f.far && f.far < segment.y
}

/// Returns the ray of a pixel.
#[inline(always)]
pub(super) fn camera_ray(f: &layout::FrameUniforms, [x, y]: [f32; 2]) -> PixelRay {
    let pair = |[x, y]: [f32; 2]| V2 { x, y };
    let view_position = camera::view_position::<f32>(V2 { x, y }, pair(f.offset), pair(f.size));
    let (right, up) = (vector(f.origin_right), vector(f.origin_up));
    let origin = camera::interpolate_view::<f32>(view_position, vector(f.origin), right, up);
    let (right, up) = (vector(f.forward_right), vector(f.forward_up));
    let offset_in_view =
        camera::interpolate_view::<f32>(view_position, V3::new(0.0, 0.0, 0.0), right, up);
    let forward = camera::interpolate_view::<f32>(view_position, vector(f.forward), right, up);
    PixelRay {
        origin,
        direction: camera::unit::<f32>(forward),
        start_offset: camera::start_excess::<f32>(offset_in_view, f.approach),
    }
}

impl Tile {
    fn reset_to(&mut self, corner: [u32; 2], picture: &RenderJob) {
        [self.left, self.upper] = corner;
        let remaining = [0, 1].map(|axis| picture.size[axis] - corner[axis]);
        let side = tile_side(picture);
        self.visible_size = remaining.map(|remaining| remaining.min(side));
        let overlap = u32::from(picture.features.mode == Mode::Edges);
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
        let slopes = if picture.features.occlusion == Occlusion::Off {
            0
        } else {
            count
        };
        self.slopes.resize(slopes, 1.0);
        self.surfaces.resize(count, Surface::default());
        self.sky_visibility.resize(count, 1.0);
        self.light_visibility
            .resize(picture.lights.len(), Vec::new());
        for visibility in &mut self.light_visibility {
            visibility.resize(count, 1.0);
        }
        self.colors.clear();
        self.colors.resize(count, [0.0; 4]);
    }

    /// Renders a sample of each pixel and adds it; returns the number of evaluations.
    fn render_sample(
        &mut self,
        f: &layout::FrameUniforms,
        picture: &RenderJob,
        (stages, traversal, plane_values): (&[RenderStage], Option<&CellTraversal>, Option<&[f32]>),
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let features = &picture.features;
        let mut evaluations = 0;
        for stage in stages {
            evaluations += match stage {
                // The march computes beams itself, where it uses them.
                RenderStage::Beam => 0,
                RenderStage::March => self.march(f, traversal, evaluator),
                RenderStage::Polish | RenderStage::Normal if self.has_known_hits => 0,
                RenderStage::Polish => self.polish(f, evaluator),
                RenderStage::Normal => normal::find_normals(f, features.normals, self, evaluator),
                RenderStage::Surface => normal::find_surfaces(f, self, evaluator),
                RenderStage::Shadow => {
                    let light_forms = features.lights.iter().zip(&picture.lights).enumerate();
                    light_forms
                        .map(|(i, (&form, light))| shadow::cast(f, light, i, form, self, evaluator))
                        .sum()
                }
                RenderStage::Occlusion => occlusion::find_occlusion(f, features, self, evaluator),
                RenderStage::Shade => {
                    shade::shade(f, features, &picture.lights, self);
                    0
                }
                RenderStage::View => {
                    debug_views::view(f, features, self);
                    0
                }
                RenderStage::Edges => {
                    debug_views::edges(f, features, self);
                    0
                }
                RenderStage::Plane => {
                    debug_views::plane(f, features, self, plane_values, evaluator)
                }
            };
        }
        evaluations
    }

    /// Computes the beam of each block; returns the number of evaluations.
    fn find_beams(&mut self, frame: &layout::FrameUniforms, evaluator: &mut dyn Evaluator) -> u64 {
        let [columns, rows] = [self.width, self.height].map(|side| side.div_ceil(beam::BLOCK_SIDE));
        self.beams.clear();
        self.beams
            .resize((columns * rows) as usize, layout::Beam::default());
        let items: Vec<u32> = (0..columns * rows).collect();
        let mut task = Beams {
            frame,
            corner: [self.left, self.upper],
            columns,
            beams: &mut self.beams,
        };
        run_streamed(&mut task, evaluator, &items)
    }

    fn march(
        &mut self,
        frame: &layout::FrameUniforms,
        traversal: Option<&CellTraversal>,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        self.hit_leaves.clear();
        let known_evaluations =
            evaluator.known_hits(frame, &self.pixels, &mut self.rays, &mut self.normals);
        self.has_known_hits = known_evaluations.is_some();
        let evaluations = match (known_evaluations, traversal) {
            (Some(evaluations), _) => evaluations,
            (None, Some(traversal)) => {
                self.hit_leaves.resize(self.rays.len(), NO_LEAF);
                self.march_packets(frame, traversal, evaluator)
            }
            (None, None) => {
                let beam_evaluations = self.find_beams(frame, evaluator);
                let mut task = March {
                    frame,
                    pixels: &self.pixels,
                    rays: &mut self.rays,
                    beams: &self.beams,
                    columns: self.width.div_ceil(beam::BLOCK_SIDE),
                    width: self.width,
                };
                beam_evaluations + run_streamed(&mut task, evaluator, &self.order)
            }
        };
        self.shown.clear();
        let rays = &self.rays;
        let hit_items = self
            .order
            .iter()
            .filter(|&&i| rays[i as usize].status & SHOWN != 0);
        self.shown.extend(hit_items);
        if traversal.is_none() || self.has_known_hits {
            let hit_items = std::mem::take(&mut self.shown);
            self.compute_points(frame, &hit_items);
            self.shown = hit_items;
        }
        evaluations
    }

    fn march_packets(
        &mut self,
        frame: &layout::FrameUniforms,
        traversal: &CellTraversal,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let mut evaluations = 0;
        let block_side = |length: u32, block: u32| {
            (length - block * leaf_bins::PACKET_SIDE).min(leaf_bins::PACKET_SIDE)
        };
        let mut remaining = self.order.as_slice();
        for row in 0..self.height.div_ceil(leaf_bins::PACKET_SIDE) {
            for column in 0..self.width.div_ceil(leaf_bins::PACKET_SIDE) {
                let count = block_side(self.width, column) * block_side(self.height, row);
                let (items, others) = remaining.split_at(count as usize);
                remaining = others;
                let x = self.left + column * leaf_bins::PACKET_SIDE;
                let y = self.upper + row * leaf_bins::PACKET_SIDE;
                evaluations += self.marcher.march(
                    frame,
                    (&traversal.cells, traversal.leaf_bins.leaves_at([x, y])),
                    items,
                    &self.pixels,
                    (&mut self.rays, &mut self.points, &mut self.hit_leaves),
                    evaluator,
                );
            }
        }
        evaluations
    }

    fn polish(&mut self, frame: &layout::FrameUniforms, evaluator: &mut dyn Evaluator) -> u64 {
        let items = std::mem::take(&mut self.shown);
        let mut task = Polish {
            frame,
            pixels: &self.pixels,
            rays: &mut self.rays,
        };
        let evaluations = run_streamed(&mut task, evaluator, &items);
        self.compute_points(frame, &items);
        self.shown = items;
        evaluations
    }

    fn compute_points(&mut self, frame: &layout::FrameUniforms, items: &[u32]) {
        for &item in items {
            let i = item as usize;
            let PixelRay {
                origin, direction, ..
            } = camera_ray(frame, self.pixels[i]);
            self.points[i] = camera::point_along::<f32>(origin, direction, self.rays[i].t);
        }
    }

    /// Returns the bounding boxes of the points of each 64 items, extended by `reach`.
    pub(super) fn boxes_around(&self, items: &[u32], reach: f32) -> Vec<Aabb> {
        let region = |items: &[u32]| {
            let mut region =
                normal::bounding_box(items.iter().map(|&item| self.points[item as usize]));
            region.low = region.low.map(|v| v - reach);
            region.high = region.high.map(|v| v + reach);
            region
        };
        items.chunks(LANES).map(region).collect()
    }

    /// Iterates over the visible items and their indices in the full picture.
    fn visible_pixels(&self, width: usize) -> impl Iterator<Item = (usize, usize)> {
        let (left, upper) = (self.left as usize, self.upper as usize);
        let tile_width = self.width as usize;
        let [columns, rows] = self.visible_size.map(|n| n as usize);
        (0..rows).flat_map(move |y| {
            (0..columns).map(move |x| (y * tile_width + x, (upper + y) * width + left + x))
        })
    }

    /// Copies the hits of the first sample to the picture.
    fn store_hits(&self, picture: &RenderJob, frame: &mut Image) {
        for (i, index) in self.visible_pixels(frame.width) {
            let ray = &self.rays[i];
            let status = Status::from_word(ray.status);
            frame.status[index] = status;
            frame.steps[index] = ray.steps;
            frame
                .stats
                .count(status, || ends_at_far(&picture.uniforms, self.pixels[i]));
            frame.stats.undecided += u64::from(ray.status & UNDECIDED != 0);
            if ray.status & SHOWN == 0 {
                continue;
            }
            frame.depth[index] = distance_from_camera(&picture.uniforms, self.pixels[i], ray.t);
            frame.normal[index] = self.normals[i];
            let id = if picture.features.materials {
                self.surfaces[i].id
            } else {
                picture.uniforms.id
            };
            frame.id[index] = id as u32;
        }
    }

    /// Counts the rays of a later sample.
    fn count_statuses(&self, pass: &layout::FrameUniforms, frame: &mut Image) {
        for (i, _) in self.visible_pixels(frame.width) {
            let status = self.rays[i].status;
            let at_far = || ends_at_far(pass, self.pixels[i]);
            frame.stats.count(Status::from_word(status), at_far);
            frame.stats.undecided += u64::from(status & UNDECIDED != 0);
        }
    }

    /// Loads the sums of earlier samples.
    fn load_partial_sums(&mut self, frame: &Image) {
        let mut colors = std::mem::take(&mut self.colors);
        for (i, index) in self.visible_pixels(frame.width) {
            colors[i] = frame.color[index];
        }
        self.colors = colors;
    }

    fn store_colors(&self, samples: u32, frame: &mut Image) {
        for (i, index) in self.visible_pixels(frame.width) {
            frame.color[index] = self.colors[i].map(|sum| sum / samples as f32);
        }
    }
}

/// Returns the plane that a sample sees face on along parallel rays, and the distance from zero beyond which
/// only the field's sign matters.
pub(super) fn face_on(
    frame: &layout::FrameUniforms,
    picture: &RenderJob,
) -> Option<(PixelPlane, f32)> {
    if frame.footprint_growth != 0.0 {
        return None;
    }
    let point_at = |x: f32, y: f32| {
        let PixelRay {
            origin, direction, ..
        } = camera_ray(frame, [x, y]);
        let (centre, forward) = (vector(frame.centre), vector(frame.forward));
        let t = camera::intersect_plane::<f32>(origin, direction, centre, forward);
        camera::point_along::<f32>(origin, direction, t)
    };
    // The steps are taken from one edge to the other, so that the rounding of one pixel is not multiplied.
    let [width, height] = picture.size.map(|n| n as f32);
    let upper_left = point_at(0.0, 0.0);
    let plane = PixelPlane {
        first: upper_left.to_array(),
        right: ((point_at(width, 0.0) - upper_left) * (1.0 / width)).to_array(),
        down: ((point_at(0.0, height) - upper_left) * (1.0 / height)).to_array(),
        size: picture.size.map(|n| n as usize),
    };
    let band = picture.exact_band.unwrap_or(match picture.features.mode {
        Mode::Distance => f32::INFINITY,
        // A pixel is entirely inside or outside if the surface is more than the pixel's size away.
        _ => 4.0 * frame.footprint * (frame.samples as f32).sqrt(),
    });
    Some((plane, band))
}

/// Returns the corners of the tiles.
fn corners(picture: &RenderJob) -> Vec<[u32; 2]> {
    let step = tile_side(picture) as usize;
    let [columns, rows] = picture.size.map(|length| (0..length).step_by(step));
    rows.flat_map(|y| columns.clone().map(move |x| [x, y]))
        .collect()
}

/// Returns the cells of a picture, binned by packets, if the field has any.
fn cell_traversal(field: &dyn RenderField, picture: &RenderJob) -> Option<CellTraversal> {
    let cells = field.cells(picture)?;
    let leaf_bins = LeafBins::new(&cells, &picture.uniforms);
    Some(CellTraversal { cells, leaf_bins })
}

/// Computes the surface at each pixel, tile by tile.
pub(super) fn geometry(field: &dyn RenderField, picture: &RenderJob) -> super::Geometry {
    let corners = corners(picture);
    let traversal = cell_traversal(field, picture);
    let [width, height] = picture.size.map(|n| n as usize);
    let result = Mutex::new(super::Geometry {
        depth: vec![f32::INFINITY; width * height],
        normal: vec![[0.0; 3]; width * height],
    });
    parallel_map_with(
        corners.len(),
        || {
            let cells = traversal.as_ref().map(|traversal| &*traversal.cells);
            (Tile::default(), field.evaluator(picture, cells))
        },
        |(tile, evaluator), number| {
            tile.reset_to(corners[number], picture);
            let stages = [
                RenderStage::Beam,
                RenderStage::March,
                RenderStage::Polish,
                RenderStage::Normal,
            ];
            let inputs = (stages.as_slice(), traversal.as_ref(), None);
            tile.render_sample(&picture.uniforms, picture, inputs, &mut **evaluator);
            let mut result = result.lock().unwrap_or_else(PoisonError::into_inner);
            for (i, index) in tile.visible_pixels(width) {
                if tile.rays[i].status & SHOWN != 0 {
                    let t = tile.rays[i].t;
                    result.depth[index] =
                        distance_from_camera(&picture.uniforms, tile.pixels[i], t);
                    result.normal[index] = tile.normals[i];
                }
            }
        },
    );
    result.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// Computes a picture, tile by tile.
pub(super) fn render(
    field: &dyn RenderField,
    picture: &RenderJob,
    samples: Samples<'_>,
    progress: &dyn RenderProgress,
) -> Option<Image> {
    let (passes, initial_image) = samples.passes(picture);
    let (first_sample, end_sample) = (passes.start, passes.end);
    if passes.is_empty() {
        return Some(initial_image);
    }
    let stages = stages(&picture.features);
    let corners = corners(picture);
    let traversal = if stages.contains(&RenderStage::March) {
        cell_traversal(field, picture)
    } else {
        None
    };
    let plane_values: Vec<Option<Vec<f32>>> = passes
        .clone()
        .map(|sample| {
            let (plane, band) = if stages.contains(&RenderStage::Plane) {
                face_on(&picture.pass_uniforms(sample), picture)?
            } else {
                return None;
            };
            field.sample_plane(picture, &plane, band)
        })
        .collect();
    let frame = Mutex::new((initial_image, 0_usize));
    let stopped = AtomicBool::new(false);
    parallel_map_with(
        corners.len(),
        || {
            let cells = traversal.as_ref().map(|traversal| &*traversal.cells);
            (Tile::default(), field.evaluator(picture, cells))
        },
        |(tile, evaluator), number| {
            if stopped.load(Ordering::Relaxed) {
                return;
            }
            tile.reset_to(corners[number], picture);
            if first_sample > 0 {
                tile.load_partial_sums(&frame.lock().unwrap_or_else(PoisonError::into_inner).0);
            }
            let mut evaluations = 0;
            let mut finished_tiles = 0;
            for sample in passes.clone() {
                let pass = picture.pass_uniforms(sample);
                let sample_values = plane_values[(sample - first_sample) as usize].as_deref();
                let inputs = (stages.as_slice(), traversal.as_ref(), sample_values);
                evaluations += tile.render_sample(&pass, picture, inputs, &mut **evaluator);
                let mut image_and_count = frame.lock().unwrap_or_else(PoisonError::into_inner);
                let (frame, tiles) = &mut *image_and_count;
                if sample == 0 {
                    tile.store_hits(picture, frame);
                } else {
                    tile.count_statuses(&pass, frame);
                }
                if sample + 1 == end_sample {
                    tile.store_colors(end_sample, frame);
                    frame.stats.evaluations += evaluations;
                    *tiles += 1;
                    finished_tiles = *tiles;
                }
            }
            if progress
                .report(finished_tiles as f32 / corners.len() as f32)
                .is_break()
            {
                stopped.store(true, Ordering::Relaxed);
            }
        },
    );
    let (frame, _) = frame.into_inner().unwrap_or_else(PoisonError::into_inner);
    (!stopped.into_inner()).then_some(frame)
}
