//! Pictures on the CPU: the stages of the kernels, run on blocks of 64 rays on all cores.
//!
//! The stages are those of `sdfc_shaders`, on the same bodies, so every ray takes the same steps
//! in the same order as on a GPU. A picture is cut into tiles that threads take from each other;
//! in a tile the rays of a stage stream through 64 lanes, and a lane whose ray has ended takes the
//! next one, so that the field is nearly always asked about 64 points.

mod lanes;
mod march;
mod normal;
mod occlusion;
mod shade;
mod shadow;
mod show;
mod tile;

pub use crate::frame::FieldFacts;
use crate::frame::{Frame, Picture};
pub use sdfc_vm::batch::{Column, LANES, Points};
pub use sdfc_vm::surface::SurfaceBlock;

/// A field that pictures are made of.
pub trait Field: Sync {
    /// What is known of it besides its values.
    fn facts(&self) -> FieldFacts;
    /// What asks it, with the memory that takes; each thread has its own.
    fn evaluator(&self) -> Box<dyn Evaluator + '_>;
}

/// Asks a field about 64 points at once. Only the first `count` points are wanted; the others are
/// copies of one of them.
pub trait Evaluator {
    /// The distances.
    fn distances(&mut self, points: &Points, count: usize, out: &mut Column);
    /// The gradients, in the first three columns, and the distances.
    fn gradients(&mut self, points: &Points, count: usize, out: &mut [Column; 4]);
    /// What the surface is made of, with unit normals; asked only where
    /// [`FieldFacts::material`] is `None`.
    fn surfaces(&mut self, points: &Points, normals: &Points, count: usize, out: &mut SurfaceBlock);
}

/// Computes a picture. `progress` is told the share that is done, from any thread, after each
/// tile.
pub fn render(field: &dyn Field, picture: &Picture, progress: &(dyn Fn(f32) + Sync)) -> Frame {
    tile::render(field, picture, progress)
}
