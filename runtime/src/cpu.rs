//! Pictures on the CPU: the stages of the kernels, run on blocks of 64 rays on all cores.
//!
//! The stages are those of `sdfc_shaders`, on the same bodies, so every ray takes the same steps
//! in the same order as on a GPU. A picture is cut into tiles that threads take from each other;
//! in a tile the rays of a stage stream through 64 lanes, and a lane whose ray has ended takes the
//! next one, so that the field is nearly always asked about 64 points.

mod beam;
pub mod figure;
mod lanes;
mod march;
mod meet;
mod normal;
mod occlusion;
mod packet;
mod shade;
mod shadow;
mod show;
mod tile;

use crate::cells::{Cells, Region};
pub use crate::frame::FieldFacts;
use crate::frame::{Frame, Picture, Progress, Samples};
use sdfc_shaders::layout;
pub use sdfc_vm::lanes::{Column, LANES, Points};
pub use sdfc_vm::surface::SurfaceBlock;
use std::sync::Arc;
pub(crate) use tile::{ends_at_far, from_eye};

/// A field that pictures are made of.
pub trait Field: Sync {
    /// What is known of it besides its values.
    fn facts(&self) -> FieldFacts;
    /// The cells for a picture, if they pay.
    fn cells(&self, _picture: &Picture) -> Option<Arc<Cells>> {
        None
    }
    /// The field at every pixel of a plane, as [`figure::sample`] gives it, if that pays.
    fn figure(&self, _picture: &Picture, _plane: &figure::Plane, _band: f32) -> Option<Vec<f32>> {
        None
    }
    /// What asks it, with the memory that takes; each thread has its own.
    fn evaluator<'a>(
        &'a self,
        picture: &Picture,
        cells: Option<&'a Cells>,
    ) -> Box<dyn Evaluator + 'a>;
}

/// What a field is asked for in announced boxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Distances and gradients.
    Distances,
    /// Surfaces.
    Surfaces,
}

/// 64 boxes: the lower corners, then the upper ones.
pub type Boxes = [Column; 6];

/// Lower and upper bounds.
pub type Range = [Column; 2];

/// Asks a field about 64 points at once. Only the first `count` points are wanted; the others are
/// copies of one of them.
pub trait Evaluator {
    /// Where the rays of pixels end and which way the surfaces face there, if that is known without
    /// marching, and how many evaluations it took. Lists are by pixel.
    fn ends(
        &mut self,
        _frame: &layout::Frame,
        _pixels: &[[f32; 2]],
        _rays: &mut [layout::Ray],
        _normals: &mut [[f32; 3]],
    ) -> Option<u64> {
        None
    }
    /// The distances.
    fn distances(&mut self, points: &Points, count: usize, out: &mut Column);
    /// How many blocks of 64 points it is best asked about at once; where it is more than one, boxes
    /// need not be announced.
    fn blocks(&self, _asked: Asked) -> usize {
        1
    }
    /// The distances at the first `count` points of at most [`blocks`](Self::blocks) blocks.
    fn distances_many(&mut self, points: &[Points], count: usize, out: &mut [Column]) {
        for (block, (points, out)) in points.iter().zip(out).enumerate() {
            self.distances(points, (count - block * LANES).min(LANES), out);
        }
    }
    /// The distances at points that all lie in one cell.
    fn distances_in(&mut self, _cell: u32, points: &Points, count: usize, out: &mut Column) {
        self.distances(points, count, out);
    }
    /// Bounds of the distances in boxes that all lie in one cell; `false` where none are known.
    fn ranges_in(&mut self, _cell: u32, _boxes: &Boxes, _count: usize, _out: &mut Range) -> bool {
        false
    }
    /// Whether the field is written with coordinates: bounds along a ray then tell far more than
    /// those of a whole cell.
    fn is_raw(&self) -> bool {
        false
    }
    /// The gradients, in the first three columns, and the distances.
    fn gradients(&mut self, points: &Points, count: usize, out: &mut [Column; 4]);
    /// Whether a point lies in a cell.
    fn holds(&self, _cell: u32, _point: [f32; 3]) -> bool {
        false
    }
    /// What is the same for cells in which the field is asked in the same way.
    fn tape_of(&self, cell: u32) -> u64 {
        cell.into()
    }
    /// The gradients at points that all lie in one cell, or in others that are asked in the same way.
    fn gradients_in(&mut self, _cell: u32, points: &Points, count: usize, out: &mut [Column; 4]) {
        self.gradients(points, count, out);
    }
    /// Announces boxes, for [`focus`](Self::focus).
    fn announce(&mut self, _program: Asked, _regions: &[Region]) {}
    /// All points that are asked about from now on lie in this one of the announced boxes; `None`
    /// ends that.
    fn focus(&mut self, _region: Option<usize>) {}
    /// What the surface is made of, with unit normals; asked only where [`FieldFacts::material`] is
    /// `None`.
    fn surfaces(&mut self, points: &Points, normals: &Points, count: usize, out: &mut SurfaceBlock);
    /// The surfaces at the first `count` points of at most [`blocks`](Self::blocks) blocks.
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

/// Where the surface is at each pixel, row after row, and which way it faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// How far along its ray; infinite where there is nothing.
    pub depth: Vec<f32>,
    /// The unit normals; zero where there is nothing.
    pub normal: Vec<[f32; 3]>,
}

/// The plane that a picture shows if it sees it face on, along parallel rays.
pub fn face_on(picture: &Picture) -> Option<figure::Plane> {
    plane_and_band(picture).map(|(plane, _)| plane)
}

/// The same, and how far from zero the field may be told by its sign alone.
pub(crate) fn plane_and_band(picture: &Picture) -> Option<(figure::Plane, f32)> {
    tile::face_on(&picture.uniforms, picture)
}

/// Computes where the surface is at each pixel of a picture's first pass, and nothing else: no light
/// and no colours.
pub fn geometry(field: &dyn Field, picture: &Picture) -> Geometry {
    tile::geometry(field, picture)
}

/// Computes a picture; none if `progress`, which is asked after each tile, stops it.
pub fn render(field: &dyn Field, picture: &Picture, progress: &dyn Progress) -> Option<Frame> {
    render_samples(field, picture, Samples::All, progress)
}

/// Computes some samples of a picture; none if `progress`, which is asked after each tile, stops it.
pub fn render_samples(
    field: &dyn Field,
    picture: &Picture,
    samples: Samples<'_>,
    progress: &dyn Progress,
) -> Option<Frame> {
    tile::render(field, picture, samples, progress)
}
