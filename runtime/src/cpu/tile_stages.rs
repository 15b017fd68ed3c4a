//! Stages of a sample, and pictures made of them tile by tile.

use super::beam::Beams;
use super::camera_rays::camera_rays;
use super::leaf_bins::{self, BUNDLE_SIDE, LeafBins};
use super::march::March;
use super::packet::NO_LEAF;
use super::packet::bundle::PacketTask;
use super::plane_edges::PlanePicture;
use super::ray_tasks::run_streamed;
use super::refine_roots::RootRefinement;
use super::tile::{Tile, corners};
use super::{
    CellLayout, Evaluator, RenderField, debug_views, normal, occlusion, plane, shade, shadow,
};
use crate::cells::Cells;
use crate::render::plane::face_on;
use crate::render::ray::distance_from_camera;
use crate::render::{Geometry, Image, RenderJob, RenderProgress, Samples};
use crate::work_stealing::parallel_map_with;
use sdfc_shaders::assemble::{RenderStage, stages};
use sdfc_shaders::marching::{self, SHOWN, Status};
use sdfc_shaders::{beam, layout};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The cells of a picture, binned by packets.
pub(super) struct CellTraversal {
    pub(super) cells: Arc<Cells>,
    leaf_bins: LeafBins,
}

impl CellTraversal {
    /// Returns the cells of a picture in a layout, unless it has none. `max_split_clauses` limits the cells that are
    /// split.
    pub(super) fn new(
        field: &dyn RenderField,
        job: &RenderJob,
        layout: CellLayout,
        max_split_clauses: u64,
    ) -> Option<Self> {
        let cells = match layout {
            CellLayout::None => return None,
            _ => field.cells(job, layout, max_split_clauses)?,
        };
        let leaf_bins = LeafBins::new(&cells, &job.uniforms);
        Some(Self { cells, leaf_bins })
    }
}

impl Tile {
    /// Renders a sample of each pixel and adds it; returns the number of evaluations.
    fn render_sample(
        &mut self,
        frame: &layout::FrameUniforms,
        job: &RenderJob,
        (stages, traversal, picture): (
            &[RenderStage],
            Option<&CellTraversal>,
            Option<&PlanePicture>,
        ),
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let features = &job.features;
        let mut evaluations = 0;
        for stage in stages {
            evaluations += match stage {
                // The march computes beams itself, where it uses them.
                RenderStage::Beam => 0,
                RenderStage::March => self.march(frame, traversal, evaluator),
                RenderStage::RefineRoots | RenderStage::Normal if self.has_known_hits => 0,
                RenderStage::RefineRoots => self.refine_roots(frame, evaluator),
                RenderStage::Normal => {
                    normal::find_normals(frame, features.normals, self, evaluator)
                }
                RenderStage::Surface => normal::find_surfaces(frame, self, evaluator),
                RenderStage::Shadow => {
                    let light_forms = features.lights.iter().zip(&job.lights).enumerate();
                    light_forms
                        .map(|(i, (&form, light))| {
                            shadow::cast(frame, light, i, form, self, evaluator)
                        })
                        .sum()
                }
                RenderStage::Occlusion => {
                    occlusion::find_occlusion(frame, features, self, evaluator)
                }
                RenderStage::Shade => {
                    shade::shade(frame, features, &job.lights, self);
                    0
                }
                RenderStage::View => {
                    debug_views::view(frame, features, self);
                    0
                }
                RenderStage::Edges => {
                    debug_views::edges(frame, features, self);
                    0
                }
                RenderStage::Plane => plane::plane(frame, features, self, picture, evaluator),
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

    pub(super) fn march(
        &mut self,
        frame: &layout::FrameUniforms,
        traversal: Option<&CellTraversal>,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        self.hit_leaves.clear();
        camera_rays(frame, &self.pixels, &mut self.camera_rays);
        let known_evaluations =
            evaluator.known_hits(frame, &self.pixels, &mut self.rays, &mut self.normals);
        self.has_known_hits = known_evaluations.is_some();
        let evaluations = match (known_evaluations, traversal) {
            (Some(evaluations), _) => evaluations,
            (None, Some(traversal)) => {
                self.hit_leaves.resize(self.rays.len(), NO_LEAF);
                let evaluations = self.march_packets(frame, traversal, evaluator);
                evaluations + self.march_extended(frame, evaluator)
            }
            (None, None) => {
                let beam_evaluations = self.find_beams(frame, evaluator);
                let items = std::mem::take(&mut self.order);
                let evaluations = self.march_items(frame, &items, evaluator);
                self.order = items;
                beam_evaluations + evaluations
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
            self.compute_points(&hit_items);
            self.shown = hit_items;
        }
        evaluations
    }

    /// Marches rays through the whole field, each block from the end of its beam.
    fn march_items(
        &mut self,
        frame: &layout::FrameUniforms,
        items: &[u32],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        match marching::proves_steps(frame.step_factor) {
            true => self.march_with::<true>(frame, items, evaluator),
            false => self.march_with::<false>(frame, items, evaluator),
        }
    }

    fn march_with<const PROVES: bool>(
        &mut self,
        frame: &layout::FrameUniforms,
        items: &[u32],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let task = March::<PROVES> {
            frame,
            camera_rays: &self.camera_rays,
            rays: &mut self.rays,
            beams: &self.beams,
            columns: self.width.div_ceil(beam::BLOCK_SIDE),
            width: self.width,
            max_steps: u32::MAX,
            are_under_way: false,
        };
        task.run(items, evaluator)
    }

    /// Marches the rays on that meet nothing in the cells and reach beyond them. Returns the number of evaluations.
    fn march_extended(
        &mut self,
        frame: &layout::FrameUniforms,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let goes_on = |item: &u32| {
            let status = self.rays[*item as usize].status;
            status == Status::Miss as u32 && frame.far < self.camera_rays[*item as usize].exit
        };
        let items: Vec<u32> = self.order.iter().copied().filter(goes_on).collect();
        if items.is_empty() {
            return 0;
        }
        let [columns, rows] = [self.width, self.height].map(|side| side.div_ceil(beam::BLOCK_SIDE));
        let start = layout::Beam {
            t: frame.far,
            steps: 0,
        };
        self.beams.clear();
        self.beams.resize((columns * rows) as usize, start);
        let evaluations = self.march_items(frame, &items, evaluator);
        let hits = items.into_iter();
        let hits = hits.filter(|&item| self.rays[item as usize].status & SHOWN != 0);
        self.compute_points(&hits.collect::<Vec<u32>>());
        evaluations
    }

    fn march_packets(
        &mut self,
        frame: &layout::FrameUniforms,
        traversal: &CellTraversal,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let side = leaf_bins::PACKET_SIDE;
        let [columns, rows] = [self.width, self.height].map(|length| length.div_ceil(side));
        let block_side = |length: u32, block: u32| (length - block * side).min(side);
        let mut remaining = self.order.as_slice();
        let mut tasks = Vec::with_capacity((columns * rows) as usize);
        for (row, column) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
            let count = block_side(self.width, column) * block_side(self.height, row);
            let (items, others) = remaining.split_at(count as usize);
            remaining = others;
            let corner = [self.left + column * side, self.upper + row * side];
            tasks.push(PacketTask {
                items,
                leaves: traversal.leaf_bins.leaves_at(corner),
            });
        }
        let mut evaluations = 0;
        let blocks = |length: u32| (0..length).step_by(BUNDLE_SIDE as usize);
        for (top, first) in blocks(rows).flat_map(|y| blocks(columns).map(move |x| (y, x))) {
            let row = |y: u32| {
                (first..(first + BUNDLE_SIDE).min(columns)).map(move |x| (y * columns + x) as usize)
            };
            let packets = (top..(top + BUNDLE_SIDE).min(rows)).flat_map(row);
            let bundle: Vec<PacketTask<'_>> = packets.map(|packet| tasks[packet]).collect();
            evaluations += self.marcher.march(
                frame,
                &traversal.cells,
                &bundle,
                &self.camera_rays,
                (&mut self.rays, &mut self.points, &mut self.hit_leaves),
                evaluator,
            );
        }
        evaluations
    }

    fn refine_roots(
        &mut self,
        frame: &layout::FrameUniforms,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let items = std::mem::take(&mut self.shown);
        let mut task = RootRefinement {
            frame,
            camera_rays: &self.camera_rays,
            rays: &mut self.rays,
        };
        let evaluations = run_streamed(&mut task, evaluator, &items);
        self.compute_points(&items);
        self.shown = items;
        evaluations
    }
}

/// Computes the surface at each pixel, tile by tile.
pub(super) fn geometry(field: &dyn RenderField, job: &RenderJob) -> Geometry {
    let corners = corners(job);
    let traversal = CellTraversal::new(field, job, field.cell_layout(job), u64::MAX);
    let [width, height] = job.size.map(|n| n as usize);
    let result = Mutex::new(Geometry {
        depth: vec![f32::INFINITY; width * height],
        normal: vec![[0.0; 3]; width * height],
    });
    parallel_map_with(
        corners.len(),
        || {
            let cells = traversal.as_ref().map(|traversal| &*traversal.cells);
            (Tile::default(), field.evaluator(job, cells))
        },
        |(tile, evaluator), number| {
            tile.reset_to(corners[number], job);
            let stages = [
                RenderStage::Beam,
                RenderStage::March,
                RenderStage::RefineRoots,
                RenderStage::Normal,
            ];
            let inputs = (stages.as_slice(), traversal.as_ref(), None);
            tile.render_sample(&job.uniforms, job, inputs, &mut **evaluator);
            let mut result = result.lock().unwrap_or_else(PoisonError::into_inner);
            for (i, index) in tile.visible_pixels(width) {
                if tile.rays[i].status & SHOWN != 0 {
                    let t = tile.rays[i].t;
                    result.depth[index] = distance_from_camera(&job.uniforms, tile.pixels[i], t);
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
    job: &RenderJob,
    samples: Samples<'_>,
    progress: &dyn RenderProgress,
) -> Option<Image> {
    let (passes, initial_image) = samples.passes(job);
    let (first_sample, end_sample) = (passes.start, passes.end);
    if passes.is_empty() {
        return Some(initial_image);
    }
    let stages = stages(&job.features);
    let corners = corners(job);
    let traversal = if stages.contains(&RenderStage::March) {
        CellTraversal::new(field, job, field.cell_layout(job), u64::MAX)
    } else {
        None
    };
    let plane_pictures: Vec<Option<PlanePicture>> = passes
        .clone()
        .map(|sample| {
            let (plane, exact) = if stages.contains(&RenderStage::Plane) {
                face_on(&job.pass_uniforms(sample), job)?
            } else {
                return None;
            };
            // Coverage reads the values beside each pixel.
            let plane = match exact.edges {
                Some(_) => plane.with_border(),
                None => plane,
            };
            field.sample_plane(job, &plane, exact)
        })
        .collect();
    let image = Mutex::new((initial_image, 0_usize));
    let stopped = AtomicBool::new(false);
    parallel_map_with(
        corners.len(),
        || {
            let cells = traversal.as_ref().map(|traversal| &*traversal.cells);
            (Tile::default(), field.evaluator(job, cells))
        },
        |(tile, evaluator), number| {
            if stopped.load(Ordering::Relaxed) {
                return;
            }
            tile.reset_to(corners[number], job);
            if first_sample > 0 {
                tile.load_partial_sums(&image.lock().unwrap_or_else(PoisonError::into_inner).0);
            }
            let mut evaluations = 0;
            let mut finished_tiles = 0;
            for sample in passes.clone() {
                let frame = job.pass_uniforms(sample);
                let picture = plane_pictures[(sample - first_sample) as usize].as_ref();
                let inputs = (stages.as_slice(), traversal.as_ref(), picture);
                evaluations += tile.render_sample(&frame, job, inputs, &mut **evaluator);
                let mut image_and_count = image.lock().unwrap_or_else(PoisonError::into_inner);
                let (image, tiles) = &mut *image_and_count;
                if sample == 0 {
                    tile.store_hits(job, image);
                } else {
                    tile.count_statuses(job, image);
                }
                if sample + 1 == end_sample {
                    tile.store_colors(end_sample, image);
                    image.stats.evaluations += evaluations;
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
    let (image, _) = image.into_inner().unwrap_or_else(PoisonError::into_inner);
    (!stopped.into_inner()).then_some(image)
}
