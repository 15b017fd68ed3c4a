//! Pictures on the CPU: the stages of the GPU kernels, run on blocks of 64 rays on all cores.
//!
//! The stages are those of `sdfc_shaders`, on the same bodies, so every ray takes the same steps in the same
//! order as on a GPU. A picture is divided into tiles that threads take from each other. In a tile the rays
//! of a stage stream through 64 lanes, and a lane whose ray has ended takes the next one. So nearly every
//! evaluation has 64 points.

mod beam;
mod camera_rays;
mod cell_trial;
mod debug_views;
pub(crate) mod engine;
mod evaluator;
mod leaf_bins;
mod long_rays;
mod march;
mod morton;
mod normal;
mod occlusion;
mod packet;
mod plane;
mod plane_edges;
pub mod plane_quadtree;
mod probe_turns;
mod proved_steps;
mod ray_tasks;
mod refine_roots;
mod shade;
mod shadow;
mod tile;
mod tile_stages;
mod work;

use crate::cells::{Aabb, Cells};
pub use crate::render::FieldFacts;
use crate::render::{ExactValues, Geometry, Image, PixelPlane, RenderJob, RenderProgress, Samples};
pub use cell_trial::CellLayout;
pub use plane_edges::PlanePicture;
use sdfc_shaders::layout;
pub use sdfc_vm::lanes::{F32x64, LANES, Points};
pub use sdfc_vm::surface::SurfaceBlock;
use std::sync::Arc;

/// A field that can be rendered.
pub trait RenderField: Sync {
    /// Returns the properties of the field besides its values.
    fn facts(&self) -> FieldFacts;
    /// Returns the layout of the cells that packets of rays march through.
    fn cell_layout(&self, _job: &RenderJob) -> CellLayout {
        CellLayout::None
    }
    /// Returns the cells for a picture, unless there is nothing to see. If the cells to split had more clauses than
    /// `max_split_clauses`, some are not split.
    fn cells(
        &self,
        _job: &RenderJob,
        _layout: CellLayout,
        _max_split_clauses: u64,
    ) -> Option<Arc<Cells>> {
        None
    }
    /// Returns a picture of a plane, as [`plane_quadtree::picture`] does, if that is profitable.
    fn sample_plane(
        &self,
        _job: &RenderJob,
        _plane: &PixelPlane,
        _exact: ExactValues,
    ) -> Option<PlanePicture> {
        None
    }
    /// Creates an evaluator with its buffers; each thread has its own.
    fn evaluator<'a>(
        &'a self,
        job: &RenderJob,
        cells: Option<&'a Cells>,
    ) -> Box<dyn Evaluator + 'a>;
}

/// Quantity of the field to evaluate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldQuantity {
    /// Distances and gradients.
    Distances,
    /// Materials of surfaces.
    Surfaces,
}

/// 64 boxes: the lower corners, then the upper ones.
pub type AabbLanes = [F32x64; 6];

/// Lower and upper bounds.
pub type RangeLanes = [F32x64; 2];

/// Bounds of the three components of gradients, and of values.
pub type GradientRangeLanes = [RangeLanes; 4];

/// Evaluates a field at 64 points at once. Only the first `count` points are used; the others are copies of
/// one of them.
pub trait Evaluator {
    /// Computes the ends of the rays of pixels, and the normals there, if they are known without marching.
    /// Returns the number of evaluations then. Lists are by pixel.
    fn known_hits(
        &mut self,
        _frame: &layout::FrameUniforms,
        _pixels: &[[f32; 2]],
        _rays: &mut [layout::RayState],
        _normals: &mut [[f32; 3]],
    ) -> Option<u64> {
        None
    }
    /// Evaluates the distances.
    fn distances(&mut self, points: &Points, count: usize, out: &mut F32x64);
    /// Returns the preferred number of blocks of 64 points per call. With more than one,
    /// [`prune_for_regions`](Self::prune_for_regions) is optional.
    fn preferred_blocks(&self, _quantity: FieldQuantity) -> usize {
        1
    }
    /// Evaluates the distances at the first `count` points of at most
    /// [`preferred_blocks`](Self::preferred_blocks) blocks.
    fn distances_many(&mut self, points: &[Points], count: usize, out: &mut [F32x64]) {
        for (block, (points, out)) in points.iter().zip(out).enumerate() {
            self.distances(points, (count - block * LANES).min(LANES), out);
        }
    }
    /// Evaluates the distances at points that all lie in one cell.
    fn distances_in_cell(&mut self, _cell: u32, points: &Points, count: usize, out: &mut F32x64) {
        self.distances(points, count, out);
    }
    /// Computes bounds of the distances in boxes. Returns `false` if none are available.
    fn ranges(&mut self, _boxes: &AabbLanes, _count: usize, _out: &mut RangeLanes) -> bool {
        false
    }
    /// Computes bounds of the distances in boxes that all lie in one cell. Returns `false` if none are
    /// available.
    fn ranges_in_cell(
        &mut self,
        _cell: u32,
        _boxes: &AabbLanes,
        _count: usize,
        _out: &mut RangeLanes,
    ) -> bool {
        false
    }
    /// Computes bounds of the gradient, in the first three columns, and of the distance in boxes that all lie
    /// in one cell. Returns `false` if none are available.
    fn gradient_ranges_in_cell(
        &mut self,
        _cell: u32,
        _boxes: &AabbLanes,
        _count: usize,
        _out: &mut GradientRangeLanes,
    ) -> bool {
        false
    }
    /// Returns the work of all evaluations for marches so far, in halves of a clause for eight points.
    fn work(&self) -> u64 {
        0
    }
    /// Reports whether the field is written with coordinates: bounds along a ray are then far tighter than
    /// those of a whole cell.
    fn is_raw(&self) -> bool {
        false
    }
    /// Evaluates the gradients, in the first three columns, and the distances.
    fn gradients(&mut self, points: &Points, count: usize, out: &mut [F32x64; 4]);
    /// Reports whether a point lies in a cell.
    fn cell_contains(&self, _cell: u32, _point: [f32; 3]) -> bool {
        false
    }
    /// Returns an identifier that cells with the same tape share.
    fn tape_id(&self, cell: u32) -> u64 {
        cell.into()
    }
    /// Evaluates the gradients at points that all lie in one cell, or in cells with the same tape.
    fn gradients_in_cell(
        &mut self,
        _cell: u32,
        points: &Points,
        count: usize,
        out: &mut [F32x64; 4],
    ) {
        self.gradients(points, count, out);
    }
    /// Prunes the program for boxes, for [`select_region`](Self::select_region).
    fn prune_for_regions(&mut self, _quantity: FieldQuantity, _regions: &[Aabb]) {}
    /// Selects one of the boxes of [`prune_for_regions`](Self::prune_for_regions), which contains all points
    /// of the following evaluations. `None` ends that.
    fn select_region(&mut self, _region: Option<usize>) {}
    /// Evaluates materials, with unit normals; only called if [`FieldFacts::material`] is `None`.
    fn surfaces(&mut self, points: &Points, normals: &Points, count: usize, out: &mut SurfaceBlock);
    /// Evaluates the materials at the first `count` points of at most
    /// [`preferred_blocks`](Self::preferred_blocks) blocks.
    fn surfaces_many(
        &mut self,
        points: &[Points],
        normals: &[Points],
        count: usize,
        out: &mut [SurfaceBlock],
    ) {
        for (block, (points, out)) in points.iter().zip(out).enumerate() {
            let count = (count - block * LANES).min(LANES);
            self.surfaces(points, &normals[block], count, out);
        }
    }
}

/// Computes the surface at each pixel of a picture's first sample, without light and colours.
pub fn geometry(field: &dyn RenderField, job: &RenderJob) -> Geometry {
    tile_stages::geometry(field, job)
}

/// Renders a picture. Returns `None` if `progress`, which is called after each tile, stops it.
pub fn render(
    field: &dyn RenderField,
    job: &RenderJob,
    progress: &dyn RenderProgress,
) -> Option<Image> {
    render_samples(field, job, Samples::All, progress)
}

/// Renders a range of a picture's samples. Returns `None` if `progress`, which is called after each tile,
/// stops it.
pub fn render_samples(
    field: &dyn RenderField,
    job: &RenderJob,
    samples: Samples<'_>,
    progress: &dyn RenderProgress,
) -> Option<Image> {
    tile_stages::render(field, job, samples, progress)
}
